"""A second set of contradicting folders: other dampers, other designs of tests, other kinds of faults.

The dampers have Bouc–Wen loops, an internal series spring (Spencer), a shifted hyperbolic tangent (Kwok), free play
with an asymmetric valve, and a strongly saturating coil; half of the folders hold random records, too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.contradicting_folders import (
    RATE,
    Change,
    Folder,
    SyntheticDamper,
    change_force,
    change_motion,
    change_time,
    copy_of,
    make_random,
    make_run,
    with_current,
)
from mrdamper.data import Floats, Run


@dataclass(frozen=True)
class SecondDamper(SyntheticDamper):
    """A synthetic damper of the second set; attributes as of the first set, and of other kinds.

    Attributes
    ----------
    rebound : float
        Ratio of the force in extension to that in compression [-].
    """

    rebound: float = 1.0

    def force(self, time: Floats, x: Floats, current: Floats) -> Floats:
        """(N,) force [N] along a motion."""
        v, step = np.gradient(x, time), float(time[1] - time[0])
        plastic, viscous = self.yield_force(current), self.viscous + self.viscous_per_ampere * np.abs(current)
        rest = self.gas * (1 + x / (4 * self.amplitude)) + self.mass * np.gradient(v, time)
        if self.kind == "kwok":
            width = 0.06 * self.amplitude * 2 * np.pi
            force = plastic * np.tanh(v / width + 0.5 * np.sign(x)) + viscous * v
        elif self.kind == "spencer":
            force = self._spencer(x, v, plastic, viscous, step)
        elif self.kind == "play":
            force = plastic * self._play(x) + viscous * v
        else:
            force = plastic * self._bouc_wen(v, step) + viscous * v
        return np.where(v > 0, self.rebound, 1.0) * force + rest

    def _bouc_wen(self, v: Floats, step: float) -> Floats:
        z, found, y = 0.0, [], self.yield_displacement
        for rate in v.tolist():
            for _ in range(12):
                z += step / 12 / y * (rate - 0.6 * abs(rate) * abs(z) * z - 0.4 * rate * z * z)
            found.append(z)
        return np.array(found)

    def _play(self, x: Floats) -> Floats:
        """Elastic-plastic element behind free play [-]."""
        play, y, inner, z, found = 0.4 * self.yield_displacement, self.yield_displacement, 0.0, 0.0, []
        for place in x.tolist():
            moved = min(max(inner, place - play), place + play)
            z = min(max(z + (moved - inner) / y, -1.0), 1.0)
            inner = moved
            found.append(z)
        return np.array(found)

    def _spencer(self, x: Floats, v: Floats, plastic: Floats, viscous: Floats, step: float) -> Floats:
        """Bouc–Wen element and dashpot behind a stiffer dashpot."""
        y, z, inner, found, d = 0.0, 0.0, 0.0, [], self.yield_displacement
        for place, rate, f, c in zip(x.tolist(), v.tolist(), plastic.tolist(), viscous.tolist(), strict=True):
            for _ in range(12):
                inner = (f * z + c * rate) / (9 * c)
                w = rate - inner
                z += step / 12 / d * (w - 0.5 * abs(w) * abs(z) * z - 0.5 * w * z * z)
                y += step / 12 * inner
            found.append(f * z + c * (rate - inner) + 0.02 * f * place / self.amplitude)
        return np.array(found)


DAMPERS = (
    SecondDamper("bouc-wen", 140.0, 700.0, 50.0, 1500.0, 300.0, 0.0011, 160.0, 5.0, 0.02, (0.0, 0.4, 0.8, 1.2, 1.6)),
    SecondDamper("kwok", 40.0, 500.0, 1.0, 700.0, 200.0, 0.0008, 60.0, 1.0, 0.012, (0.0, 0.25, 0.5, 1.0)),
    SecondDamper("spencer", 200.0, 2500.0, 2.0, 4000.0, 1500.0, 0.002, 400.0, 20.0, 0.04, (0.0, 0.5, 1.0, 2.0)),
    SecondDamper("play", 400.0, 9000.0, 2.5, 8000.0, 2000.0, 0.003, 1500.0, 60.0, 0.05, (0.0, 1.0, 2.0, 3.0)),
    SecondDamper(
        "rebound", 150.0, 900.0, 0.7, 900.0, 400.0, 0.0007, 120.0, 3.0, 0.03, (0.0, 0.5, 1.0, 1.5), rebound=1.6
    ),
)  # fmt: skip


def matrix(damper: SecondDamper, rng: np.random.Generator) -> list[Run]:
    """Every current at three motions."""
    gains = 1 + 0.04 * rng.uniform(-1, 1, size=4)
    points = [(i, f, a) for i in damper.currents for f, a in _motions(damper)]
    return [make_run(damper, f"t{k:02d}", i, f, a, rng, gain=gains[k % 4]) for k, (i, f, a) in enumerate(points)]


def _motions(damper: SecondDamper) -> tuple[tuple[float, float], ...]:
    return (0.4, damper.amplitude), (1.6, 0.5 * damper.amplitude), (3.0, 0.3 * damper.amplitude)


def resampled(run: Run, rate: float, name: str, seed: int = 8) -> Run:
    """A copy at another sample rate, cropped, with a little noise."""
    time = np.arange(run.time[40], run.time[-30], 1 / rate)
    x, force, current = (np.interp(time, run.time, v) for v in (run.displacement, run.force, run.current))
    force = force + 2e-4 * np.ptp(force) * np.random.default_rng(seed).normal(size=time.size)
    return Run(name, time - time[0], x, force, current, rig=run.rig)


def second_folders(damper: SecondDamper, seed: int = 21) -> list[Folder]:
    """The kinds of contradicting folders of the second set, of one damper."""
    rng = np.random.default_rng(seed)
    sound = matrix(damper, rng)
    records = [make_random(damper, f"r{k}", rng, 1 + 0.03 * k) for k in range(3)]
    levels, count = damper.currents, len(sound)
    size = damper.per_ampere * max(levels)
    found: list[Folder] = []

    def add(name: str, changes: dict[int, Change | Run], *causes: str, extra: tuple[Run, ...] = (), random=False):
        runs = [*sound, *records] if random else list(sound)
        good = list(runs)
        for k, change in changes.items():
            runs[k] = change if isinstance(change, Run) else change(runs[k])
        wrong = frozenset([*(runs[k].id for k in changes), *(run.id for run in extra)])
        found.append(Folder(name, [*runs, *extra], wrong, causes, good))

    def test(k: int, of: SecondDamper = damper, coil: float | None = None) -> Run:
        f, a = _motions(damper)[k % 3]
        return make_run(of, f"t{k:02d}", levels[k // 3], f, a, rng, coil=coil)

    def held(name: str, label: float, coil: float) -> Run:
        run = make_random(damper, name, rng, constant=coil)
        return replace(run, current=np.full(run.time.size, label))

    add("one run in daN", {7: change_force(0.1)}, "force")
    add("one run in kip", {4: change_force(1 / 4448.2216)}, "force", "size")
    add(
        "kgf and a random record in kgf",
        {5: change_force(1 / 9.80665), count: change_force(1 / 9.80665)},
        "force",
        random=True,
    )
    add("amplifier at 0.6 for four runs", {k: change_force(0.6) for k in (2, 5, 8, 10)}, "force", "damper", "current")
    add(
        "load cell zeroed under preload in three runs", {k: change_force(1.0, -0.6 * size) for k in (1, 5, 9)}, "offset"
    )
    add("zero of a random record", {count + 1: change_force(1.0, 0.7 * size)}, "offset", random=True)
    add("stroke for amplitude in three runs", {k: change_motion(2.0) for k in (1, 4, 9)}, "displacement")
    add("stroke in half", {8: change_motion(0.5)}, "displacement", "time")
    add("a random record in inches", {count + 2: change_motion(1 / 25.4)}, "displacement", "size", random=True)
    add("time in minutes", {6: change_time(1 / 60)}, "time", "displacement")
    add("time in milliseconds", {7: change_time(1e-3)}, "time")
    add("sample rate half of what is written", {k: change_time(0.5) for k in (4, 10)}, "time")
    add(
        "highest current limited by the supply in two of three",
        {k: test(k, coil=0.55 * levels[-1]) for k in (count - 3, count - 1)},
        "current",
        "force",
    )
    add("two open coils at one level", {k: test(k, coil=0.0) for k in (6, 8)}, "current", "force")
    add("three open coils", {k: test(k, coil=0.0) for k in (4, 8, 9)}, "current", "force")
    add("three currents in mA", {k: with_current(1e3 * levels[k // 3]) for k in (3, 7, 10)}, "current", "size")
    add(
        "a random record under another current",
        {},
        "current",
        "force",
        extra=(held("r9", levels[-1], levels[1]),),
        random=True,
    )
    add("rows shifted up from the third on", _shifted(sound, 2, 1), "shifted", "current")
    add("rows shifted down from the fifth on", _shifted(sound, 4, -1), "shifted", "current")
    worn = replace(
        damper, per_ampere=0.6 * damper.per_ampere, viscous=0.3 * damper.viscous, friction=0.5 * damper.friction
    )
    stiff = replace(
        damper, per_ampere=1.7 * damper.per_ampere, viscous=2.5 * damper.viscous, friction=3 * damper.friction
    )
    add("a worn damper in one run", {count - 2: test(count - 2, worn)}, "damper", "force", "current")
    add("a stiff damper in one run", {3: test(3, stiff)}, "damper", "force", "current")
    add("a stiff damper in three runs", {k: test(k, stiff) for k in (1, 5, 9)}, "damper", "force", "current")
    add(
        "a worn damper in a random record",
        {},
        "damper",
        "force",
        "current",
        extra=(make_random(worn, "r9", rng),),
        random=True,
    )
    add("both channels inverted in two runs", {k: _inverted for k in (0, 4)}, "sign")
    add("a random record inverted", {count: _inverted}, "sign", random=True)
    add("a copy resampled", {}, "copy", extra=(resampled(sound[4], 0.75 * RATE, "c0"),))
    add(
        "a copy of a random record, cropped",
        {},
        "copy",
        extra=(copy_of(records[1], "c0", start=1000, noise=1e-4 * size),),
        random=True,
    )
    add("a copy scaled by 1.03", {}, "copy", extra=(change_force(1.03)(copy_of(sound[5], "c0")),))
    add("a copy inverted", {}, "copy", extra=(_inverted(copy_of(sound[7], "c0", 20)),))
    add(
        "a validation run copied from a random record",
        {},
        "copy",
        extra=(replace(copy_of(records[0], "c0", 500, 2), split="validate"),),
        random=True,
    )
    for share, name in ((0.4, "40 % of the runs in lbf"), (0.4, "40 % of the runs of another damper")):
        wrong = list(range(0, count, 3))[: round(share * count)] + list(range(1, count, 4))
        wrong = sorted(set(wrong))[: round(share * count)]
        runs = [
            (change_force(1 / 4.4482216)(r) if "lbf" in name else test(k, stiff)) if k in wrong else r
            for k, r in enumerate(sound)
        ]
        found.append(Folder(name, runs, frozenset(), ("refused",), sound))
    return found


def _inverted(run: Run) -> Run:
    return replace(run, force=-run.force, displacement=-run.displacement)


def _shifted(sound: list[Run], first: int, by: int) -> dict[int, Change | Run]:
    last = len(sound) - 1
    source = {k: float(np.mean(sound[min(max(k + by, first), last)].current)) for k in range(first, last + 1)}
    return {k: with_current(i) for k, i in source.items() if abs(i - float(np.mean(sound[k].current))) > 0.05}
