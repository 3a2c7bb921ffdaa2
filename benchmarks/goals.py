"""Goals of speed and accuracy of the project, with the measured values of this run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Goal:
    """A goal: `measured` should be at most `limit`, or at least with `at_least`; `why` states why not."""

    name: str
    limit: float
    measured: float | None
    unit: str = ""
    at_least: bool = False
    why: str = ""

    @property
    def met(self) -> bool | None:
        if self.measured is None:
            return None
        return self.measured >= self.limit if self.at_least else self.measured <= self.limit

    @property
    def verdict(self) -> str:
        return {True: "met", False: "missed", None: "not measured"}[self.met]


_STUDY = "every fold of every candidate is fitted again, for both rigs"
_STATE = "NumPy operations that divide the record into strokes, and one tanh per sample"
_IN_C = "other exponents than 1 and 2 use tables of degree five, and a step checks its input and computes the velocity"
_MOTION = "seven harmonics, a smoothed motion and its strokes are computed for every record"
_STREAM = "a step computes the whole force of the model with variable parameters, not the state alone"


def goals(results: Any) -> list[Goal]:
    """Every goal, from the tables of a run (`page.Results`)."""
    return [*_of_accuracy(results), *_of_the_main_job(results), *_of_streams(results), *_of_peers(results)]


def _of_accuracy(results: Any) -> list[Goal]:
    return [
        Goal("error over z_max for n = 1 and 2", 1e-12, results.accuracy.get("closed")),
        Goal("error over z_max for other n", 1e-8, results.accuracy.get("tables")),
    ]


def _of_the_main_job(results: Any) -> list[Goal]:
    # Processor time, including children, which depends least on the load.
    process = {row.name: row.seconds for row in results.processes}
    memory = {row.name: row.megabytes for row in results.processes}
    many = {row.name: 1e3 * row.seconds for row in results.many}
    real = [row.seconds for row in results.real]
    bare, motion = _least(process, "NumPy alone"), _least(many, "motion analysis alone")
    began = f"Python and NumPy alone take {bare:.2f} s; " if bare else ""
    analysis = f"analysing the motions takes {motion:.0f} ms" if motion else "the motions are analysed too"
    return [
        Goal(
            "identify() of 48 conditions from a cold process",
            0.25,
            _least(process, "identify() of 48 conditions"),
            "s",
            why=f"{began}{analysis}; the checks of the import, which the documented call makes, take most of it",
        ),
        Goal("48 conditions in process, all of identify()", 60, _least(many, "identify()"), "ms", why=analysis),
        Goal("of that, analysing the motions", 25, motion, "ms", why=_MOTION),
        Goal("both bundled rigs, per-run and global fit", 2, sum(real) if real else None, "s"),
        Goal("mrdamper study, caches empty", 8, _least(process, "study, caches empty"), "s", why=_STUDY),
        Goal("mrdamper study, caches filled", 8, _least(process, "study, caches filled"), "s", why=_STUDY),
        Goal("mrdamper study, peak memory", 500, _least(memory, "mrdamper study"), "MB"),
        Goal(
            "mrdamper --help",
            0.3,
            _least(process, "--help"),
            "s",
            why="most of it is Python's own start and the command line library",
        ),
    ]


def _of_streams(results: Any) -> list[Goal]:
    loop = {row.name: row.nanoseconds for row in results.simulation}
    in_c = [row.c for row in results.streams if row.c]
    return [
        Goal("streaming compiled", 15, _least(loop, "streaming, compiled"), "ns per sample", why=_STREAM),
        Goal("a step of the slowest damper in C", 50, max(in_c, default=None), "ns", why=_IN_C),
    ]


def _of_peers(results: Any) -> list[Goal]:
    loop = {row.name: row.ratio for row in results.simulation}
    one = {row.name: row.ratio for row in results.identification}
    wanted = [
        ("times faster than solve_ivp at its defaults", 500, _least(loop, "solve_ivp", "defaults")),
        ("times faster than solve_ivp at rtol 1e-8", 2000, _least(loop, "solve_ivp", "1e-8")),
        ("times faster than odeint", 200, _least(loop, "odeint")),
        ("times faster than openseespy", 200, _least(loop, "openseespy")),
        (
            "identify(), all of it: times faster than the GA over solve_ivp",
            1e5,
            _against(one, "identify()", "solve_ivp"),
        ),
    ]
    new = _least(loop, "strokes included")
    c = {name: _least(loop, "hand-written C", name) for name in ("RK4", "closed form")}
    return [Goal(name, limit, measured, at_least=True, why=_STATE) for name, limit, measured in wanted] + [
        Goal(
            f"a new motion, against hand-written C by {name}",
            1.5,
            new / peer if new and peer else None,
            "×",
            why=_STATE,
        )
        for name, peer in c.items()
    ]


def _against(ratios: dict[str, float], ours: str, peer: str) -> float | None:
    """Ratio of a peer's time to the whole time of mrdamper."""
    own, other = _least(ratios, ours), _least(ratios, "GA", peer)
    return other / own if own and other else None


def _least(table: dict[str, float], *words: str) -> float | None:
    """The least of the rows whose names hold all words: the best of several peers, or of several sizes."""
    found: Iterable[float] = [value for name, value in table.items() if all(word in name for word in words)]
    return min(found, default=None)
