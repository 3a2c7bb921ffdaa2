"""Monte Carlo simulation of a system with sampled dampers, and bands of its results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.causal import free_name
from mrdamper.data import Floats
from mrdamper.data.progress import Progress, silent
from mrdamper.errors import InputError, StepError
from mrdamper.systems.kernel import ElementParameters
from mrdamper.systems.measures import measures
from mrdamper.systems.result import Simulation
from mrdamper.systems.simulate import SystemLoop, changed

LEVELS = (0.05, 0.5, 0.95)
_MAX_DRAWS = 100_000
_MOST_LOST = 0.1  # share of draws without a solution, from which there are no bands
_LEAST_DOF = 3.0  # below, Student's distribution has no variance


@dataclass(frozen=True)
class Draw:
    """A sample of the parameters of a damper."""

    numbers: Mapping[str, float] = field(default_factory=dict)  # fitted parameters that differ from the damper's
    gain: float = 0.0  # of its session: the force becomes (1 + gain) F + offset [N]
    offset: float = 0.0


@dataclass(frozen=True, eq=False)
class Bands:
    """Peaks and measures over many draws."""

    peaks: Mapping[str, Floats]  # (S, ·) each: as `Simulation.peaks`, one row a draw
    measures: Mapping[str, Floats]  # (S,) each: as `measures.measures`
    lost: int  # draws without a solution, omitted
    step: float  # of all draws [s]
    step_change: float  # largest relative change of a peak between that step and the one the mean was run at

    @property
    def count(self) -> int:
        """Number of draws with a solution."""
        return len(next(iter(self.peaks.values())))

    def quantiles(self) -> dict[str, Floats]:
        """(L, ·) quantiles at `LEVELS` of every peak and (L,) of every measure."""
        return {name: np.quantile(rows, LEVELS, axis=0) for name, rows in {**self.peaks, **self.measures}.items()}


def draw(dampers: Mapping[str, Damper], count: int, seed: int = 1) -> list[dict[str, Draw]]:
    """Sample dampers from their uncertainty: parameters, and the gain and offset of a session.

    Links that share a damper share its parameters; each has its own session. Distributions are Student's, with the
    degrees of freedom of the estimates. The model error (`Uncertainty.force`) is not sampled. Raises `InputError`
    (E_CERTAINTY) if a damper has no uncertainty, E_DRAWS if the count is out of range.
    """
    if not 2 <= count <= _MAX_DRAWS:
        raise InputError(f"{count} draws", remedy=f"give 2 to {_MAX_DRAWS:,}", code="E_DRAWS")
    rng = np.random.default_rng(seed)
    shared: dict[int, list[dict[str, float]]] = {}
    draws: list[dict[str, Draw]] = [{} for _ in range(count)]
    for link, damper in dampers.items():
        uncertainty = damper.uncertainty
        if uncertainty is None:
            raise InputError(
                f"{damper.title} was saved without its uncertainty",
                where=link,
                remedy="give a model that study wrote from tests, or leave out --draws",
                code="E_CERTAINTY",
            )
        if id(damper) not in shared:
            shared[id(damper)] = _numbers_drawn(damper, count, rng)
        spread = np.array([uncertainty.total_gain, uncertainty.total_offset])
        dof = uncertainty.session_dof if uncertainty.of_sessions else uncertainty.run_dof
        sessions = (_student(rng, dof, count) * rng.standard_normal((count, 2)) * spread).tolist()
        for row, numbers, (gain, offset) in zip(draws, shared[id(damper)], sessions, strict=True):
            row[link] = Draw(numbers, gain, offset)
    return draws


def _numbers_drawn(damper: Damper, count: int, rng: np.random.Generator) -> list[dict[str, float]]:
    uncertainty, own = damper.uncertainty, damper.fitted_parameters
    assert uncertainty is not None
    if not uncertainty.names:
        return [{} for _ in range(count)]
    # Correlations instead of covariances: the units differ by many orders of magnitude.
    scale = np.sqrt(np.diag(uncertainty.covariance))
    size = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh(uncertainty.covariance / np.outer(size, size))
    nudges = rng.standard_normal((count, scale.size)) @ (vectors * np.sqrt(np.maximum(values, 0.0))).T * scale
    nudges *= _student(rng, float(np.min(uncertainty.dof)), count)
    pairs = [zip(uncertainty.names, row, strict=True) for row in nudges.tolist()]
    return [{name: own[name].moved(nudge) for name, nudge in row} for row in pairs]


def _student(rng: np.random.Generator, dof: float, count: int) -> Floats:
    """(S, 1) factors that convert normal draws to Student's distribution."""
    dof = max(dof, _LEAST_DOF)
    return np.sqrt(dof / rng.chisquare(dof, (count, 1)))


def monte_carlo(
    loop: SystemLoop,
    draws: Sequence[Mapping[str, Draw]],
    mean: Simulation,
    progress: Progress = silent,
) -> Bands:
    """Run a loop made with `free` again with other parameters of its dampers; it is traced and compiled once.

    Draws come by link from `draw`; `mean` is the simulation of the dampers themselves. Draws use twice its step, or
    half the first step of the loop if that is longer, because more draws improve the bands more than a smaller step.
    Raises `StepError` (E_STEP_LOST) if over a tenth of the draws have no solution.
    """
    machine = len(draws) > 5 or None
    step = max(2 * mean.step, loop.first_step / 2)
    peaks, values, lost = [], [], 0
    for number, one in enumerate(draws):
        progress(f"draw {number + 1} of {len(draws)}", number / len(draws))
        try:
            done = loop.run(step, machine=machine, numbers=_numbers(loop, one))
        except (StepError, InputError):  # parameters without a damper, or a motion without a solution
            lost += 1
            continue
        peaks.append(done.peaks)
        values.append(measures(done))
    if lost > _MOST_LOST * len(draws):
        raise StepError(
            f"{lost} of {len(draws)} draws have no solution",
            where=loop.system.name,
            remedy="the damper's numbers are too uncertain for bands: test more (mrdamper plan)",
            code="E_STEP_LOST",
        )
    names = list(dict.fromkeys(name for row in values for name in row))
    return Bands(
        {name: np.array([row[name] for row in peaks]) for name in peaks[0]},
        {name: np.array([row[name] for row in values]) for name in names},
        lost,
        step,
        changed(loop.run(step, machine=machine).peaks, mean.peaks),
    )


def _numbers(loop: SystemLoop, one: Mapping[str, Draw]) -> ElementParameters:
    stages = []
    for link, stage in zip(loop.links, loop.stages, strict=True):
        if link.name in one:
            drawn = one[link.name]
            moved = {free_name(name): value for name, value in drawn.numbers.items()}
            names = stage.program.tape.parameters
            given = tuple(moved.get(name, value) for name, value in zip(names, stage.given, strict=True))
            stage = stage.at(given, (1.0 + drawn.gain, drawn.offset))
        stages.append(stage)
    return ElementParameters.of(stages)
