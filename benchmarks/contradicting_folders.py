"""Synthetic folders of tests, sound ones and ones with contradicting runs.

The dampers are integrated here, without the models of the package, to try the search for contradictions on dampers of
several kinds: elastic-plastic loops with exponential approach (Dahl, LuGre with Stribeck effect), a hyperbolic tangent
with hysteresis, and a biviscous damper with leakage; each with gas force and moving mass.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mrdamper.data import Floats, Run

RATE = 400.0  # sample rate [Hz]
LBF, KGF, INCH = 4.4482216, 9.80665, 25.4


@dataclass(frozen=True)
class SyntheticDamper:
    """A synthetic damper.

    Attributes
    ----------
    kind : "dahl", "lugre", "tanh" or "biviscous"
    friction, per_ampere : float
        Yield force without current [N], and what an ampere adds [N/A].
    saturation : float
        Current at which the yield force saturates [A].
    viscous, viscous_per_ampere : float
        [N s/m], [N s/(m A)]
    yield_displacement : float
        [m]
    gas : float
        Gas force at mid-stroke [N].
    mass : float
        [kg]
    amplitude : float
        Of the largest motion [m].
    currents : tuple of float
        Tested levels [A].
    """

    kind: str = "dahl"
    friction: float = 120.0
    per_ampere: float = 900.0
    saturation: float = 1.2
    viscous: float = 900.0
    viscous_per_ampere: float = 500.0
    yield_displacement: float = 0.0006
    gas: float = 150.0
    mass: float = 4.0
    amplitude: float = 0.025
    currents: tuple[float, ...] = (0.0, 0.5, 1.0, 1.5)

    def yield_force(self, current: Floats) -> Floats:
        """Yield force [N] at currents [A]."""
        return self.friction + self.per_ampere * self.saturation * np.tanh(np.abs(current) / self.saturation)

    def force(self, time: Floats, x: Floats, current: Floats) -> Floats:
        """(N,) force [N] along a motion."""
        v = np.gradient(x, time)
        plastic = self.yield_force(current)
        viscous = self.viscous + self.viscous_per_ampere * np.abs(current)
        gas = self.gas / (1 - x / (6 * self.amplitude)) ** 1.3
        rest = gas + self.mass * np.gradient(v, time)
        if self.kind == "tanh":
            return plastic * np.tanh(v / 0.01 + 1.5 * x / self.amplitude) + viscous * v + rest
        if self.kind == "biviscous":
            knee = 0.02 + 0.01 * np.abs(current)
            v = v + 0.15 * np.gradient(v, time) * 0.02
            return plastic * np.clip(v / knee, -1, 1) * (1 - 0.1 * np.exp(-np.abs(v) / 0.02)) + viscous * v + rest
        stribeck = 0.25 * np.exp(-np.abs(v) / 0.01) if self.kind == "lugre" else np.zeros(v.size)
        return plastic * self._loop(np.diff(x, prepend=x[:1]), 1 + stribeck) + viscous * v + rest

    def _loop(self, steps: Floats, limit: Floats) -> Floats:
        """Elastic-plastic state that approaches its limit exponentially over the travel [-]."""
        z, found = 0.0, []
        for step, most in zip(steps.tolist(), limit.tolist(), strict=True):
            end = most if step > 0 else -most
            z = end + (z - end) * float(np.exp(-abs(step) / self.yield_displacement / most))
            found.append(z)
        return np.array(found)


DAMPERS = (
    SyntheticDamper(),
    SyntheticDamper("lugre", 300.0, 5000.0, 3.0, 9000.0, 1000.0, 0.0012, 600.0, 40.0, 0.05, (0.0, 0.6, 1.2, 1.8)),
    SyntheticDamper("tanh", 25.0, 220.0, 0.8, 150.0, 60.0, 0.0005, 30.0, 0.5, 0.01, (0.0, 0.3, 0.6, 1.0)),
    SyntheticDamper("biviscous", 60.0, 700.0, 1.5, 1500.0, 300.0, 0.0005, 0.0, 2.0, 0.015, (0.0, 0.4, 0.8, 1.6)),
)


def make_run(
    damper: SyntheticDamper,
    name: str,
    current: float,
    frequency: float,
    amplitude: float,
    rng: np.random.Generator,
    *,
    noise: float = 0.004,
    gain: float = 1.0,
    coil: float | None = None,
    cycles: int = 5,
) -> Run:
    """A sine test; the coil may carry another current than the one that is written down [A]."""
    time = np.arange(0, (cycles + 1.3) / frequency, 1 / max(RATE, 60 * frequency))
    ramp = np.clip(time * frequency - 0.3, 0, 1)
    x = amplitude * ramp**2 * (3 - 2 * ramp) * np.sin(2 * np.pi * frequency * time + rng.uniform(0, 6))
    real = np.full(time.size, current if coil is None else coil)
    force = gain * damper.force(time, x, real)
    force += noise * np.ptp(force) * rng.normal(size=time.size) + 0.002 * damper.per_ampere * rng.normal(size=time.size)
    x = x + 2e-5 * amplitude * rng.normal(size=time.size)
    channel = current + 0.003 * rng.normal(size=time.size)
    return Run(name, time, x, force, channel, rig="bench", window=(float(time[0] + 1.3 / frequency), float(time[-1])))


def make_random(
    damper: SyntheticDamper, name: str, rng: np.random.Generator, gain: float = 1.0, constant: float | None = None
) -> Run:
    """A random motion under a switched or a constant current [A]."""
    time = np.arange(0, 20, 1 / RATE)
    frequencies = np.linspace(0.2, 3, 25)
    waves = np.sin(2 * np.pi * frequencies * time[:, None] + rng.uniform(0, 6.3, 25)) / (1 + frequencies)
    x = waves.sum(axis=1)
    x *= damper.amplitude / np.max(np.abs(x))
    current = np.repeat(rng.choice(damper.currents, size=20), int(RATE))[: time.size]
    if constant is not None:
        current = np.full(time.size, constant)
    force = gain * damper.force(time, x, current)
    force += 0.004 * np.ptp(force) * rng.normal(size=time.size)
    return Run(name, time, x, force, current, rig="bench", excitation="random")


def motions(damper: SyntheticDamper) -> tuple[tuple[float, float], ...]:
    """Frequencies [Hz] and amplitudes [m] of a full matrix."""
    return (0.5, damper.amplitude), (1.0, damper.amplitude), (2.0, 0.4 * damper.amplitude)


def full_matrix(damper: SyntheticDamper, rng: np.random.Generator, drift: float = 0.03) -> list[Run]:
    """Every current at every motion; gains of sessions differ by `drift`."""
    gains = 1 + drift * rng.uniform(-1, 1, size=3)
    points = [(i, f, a) for i in damper.currents for f, a in motions(damper)]
    return [make_run(damper, f"t{k:02d}", i, f, a, rng, gain=gains[k % 3]) for k, (i, f, a) in enumerate(points)]


def sound_folder(number: int) -> list[Run]:
    """One of the sound folders: other dampers, designs of tests, noise, session gains and reversed coils."""
    rng = np.random.default_rng(1000 + number)
    base = DAMPERS[number % len(DAMPERS)]
    stretch = float(np.exp(rng.uniform(-0.7, 0.7)))
    damper = replace(
        base,
        per_ampere=base.per_ampere * stretch,
        saturation=base.saturation * float(np.exp(rng.uniform(-0.8, 1.0))),
        viscous=base.viscous * float(np.exp(rng.uniform(-1, 1))),
        yield_displacement=base.yield_displacement * float(np.exp(rng.uniform(-1, 1))),
        gas=base.gas * rng.uniform(0, 2),
    )
    gains = 1 + 0.08 * rng.uniform(-1, 1, size=3)
    noise = float(rng.uniform(0.001, 0.02))
    design = number // len(DAMPERS) % 4
    if design == 0:
        points = [(i, f, a) for i in damper.currents for f, a in motions(damper)]
    elif design == 1:  # sparse
        points = [
            (
                float(rng.choice(damper.currents)),
                float(rng.uniform(0.3, 4)),
                damper.amplitude * float(rng.uniform(0.2, 1)),
            )
            for _ in range(int(rng.integers(4, 10)))
        ]
    elif design == 2:  # one level tested once, repeated tests
        points = [(i, f, a) for i in damper.currents[:2] for f, a in motions(damper)] * 2
        points.append((damper.currents[-1], *motions(damper)[1]))
    else:
        points = [(i, f, a) for i in damper.currents[::2] for f, a in motions(damper)]
    runs = []
    for k, (i, f, a) in enumerate(points):
        sign = -1 if rng.uniform() < 0.2 else 1
        runs.append(make_run(damper, f"t{k:02d}", sign * i, f, a, rng, gain=gains[k % 3], noise=noise))
    if design == 3 or number % 5 == 0:
        runs += [make_random(damper, f"r{k}", rng, gains[k % 3]) for k in range(2)]
    return runs


@dataclass(frozen=True)
class Folder:
    """A folder with runs that contradict the others.

    Attributes
    ----------
    name : str
    runs : list of Run
    wrong : frozenset of str
        Runs that have to be named; empty where the folder has to be refused.
    causes : tuple of str
        Accepted causes.
    sound : list of Run
        The runs as they ought to be.
    """

    name: str
    runs: list[Run]
    wrong: frozenset[str]
    causes: tuple[str, ...]
    sound: list[Run]


Change = Callable[[Run], Run]


def change_force(gain: float, offset: float = 0.0) -> Change:
    return lambda run: replace(run, force=gain * run.force + offset)


def change_motion(gain: float) -> Change:
    return lambda run: replace(run, displacement=gain * run.displacement)


def change_time(factor: float) -> Change:
    return lambda run: replace(
        run, time=factor * run.time, window=(factor * run.window[0], factor * run.window[1]) if run.window else None
    )


def with_current(current: float) -> Change:
    return lambda run: replace(run, current=run.current - np.mean(run.current) + current)


def copy_of(run: Run, name: str, start: int = 0, every: int = 1, noise: float = 0.0, seed: int = 5) -> Run:
    rng = np.random.default_rng(seed)
    part = slice(start, None, every)
    time = run.time[part]
    force = run.force[part] + noise * rng.normal(size=time.size)
    x, current = run.displacement[part], run.current[part]
    return Run(name, time - time[0], x, force, current, rig=run.rig)


def folders(damper: SyntheticDamper, seed: int = 3) -> list[Folder]:
    """The kinds of contradicting folders, of one damper."""
    rng = np.random.default_rng(seed)
    sound = full_matrix(damper, rng)
    levels, size = damper.currents, damper.per_ampere * levels_span(damper)
    found: list[Folder] = []

    def add(name: str, changes: dict[int, Change | Run], *causes: str, extra: tuple[Run, ...] = ()) -> None:
        runs = list(sound)
        for k, change in changes.items():
            runs[k] = change if isinstance(change, Run) else change(runs[k])
        wrong = frozenset([*(f"t{k:02d}" for k in changes), *(run.id for run in extra)])
        found.append(Folder(name, [*runs, *extra], wrong, causes, sound))

    def tested(k: int, coil: float) -> Run:
        f, a = motions(damper)[k % 3]
        return make_run(damper, f"t{k:02d}", levels[k // 3], f, a, rng, coil=coil)

    add("one run in lbf", {4: change_force(1 / LBF)}, "force")
    add("one run in kgf", {8: change_force(1 / KGF)}, "force")
    add("one run in kN", {5: change_force(1e-3)}, "force", "size")
    add("N under lbf", {7: change_force(LBF)}, "force")
    add("three runs in lbf", {1: change_force(1 / LBF), 5: change_force(1 / LBF), 9: change_force(1 / LBF)}, "force")
    add("range of the load cell doubled", {6: change_force(2.0)}, "force")
    add("half the force", {10: change_force(0.5)}, "force", "current")
    add("zero of the load cell", {3: change_force(1.0, 0.8 * size)}, "offset")
    add("one run in inches", {4: change_motion(1 / INCH)}, "displacement")
    add("one run in cm", {7: change_motion(0.1)}, "displacement")
    add("one run in metres", {7: change_motion(1e-3)}, "displacement", "size")
    add("mm under inches", {1: change_motion(INCH)}, "displacement")
    add("stroke for amplitude", {6: change_motion(2.0)}, "displacement", "time")
    add("current in mA", {8: with_current(1e3 * levels[2])}, "current", "size")
    add("open coil", {7: tested(7, 0.0)}, "current")
    add("open coil at the highest current", {10: tested(10, 0.0)}, "current")
    add("half-open coil", {7: tested(7, levels[2] / 2)}, "current", "force")
    add("two half-open coils", {9: tested(9, levels[3] / 2), 11: tested(11, levels[3] / 2)}, "current", "force")
    add("another current than written", {4: tested(4, levels[3])}, "current", "force")
    add("two rows exchanged", {1: with_current(levels[3]), 10: with_current(levels[0])}, "current", "shifted")
    shifted = {k: with_current(float(np.mean(sound[k - 1].current))) for k in range(6, 12)}
    add("rows shifted from the seventh on", {k: shifted[k] for k in shifted if k % 3 == 0}, "shifted", "current")
    add(
        "both channels inverted",
        {5: lambda run: replace(run, force=-run.force, displacement=-run.displacement)},
        "sign",
    )
    add("time in half seconds", {2: change_time(2.0)}, "time", "displacement")
    add("time too short", {7: change_time(0.2)}, "time", "displacement")
    weak = replace(
        damper, per_ampere=0.45 * damper.per_ampere, viscous=0.4 * damper.viscous, friction=2.5 * damper.friction
    )
    f1, f2 = motions(damper)[1], motions(damper)[2]
    another = make_run(weak, "t07", levels[2], *f1, rng)
    add("another damper in one run", {7: another}, "damper", "force", "current")
    many = {k: make_run(weak, f"t{k:02d}", levels[k // 3], *motions(damper)[k % 3], rng) for k in (1, 4, 7, 10)}
    add("another damper in four runs", {**many}, "damper", "force", "current")
    add("a copy with noise", {}, "copy", extra=(copy_of(sound[5], "t12", noise=0.0005 * size),))
    add("a copy cropped", {}, "copy", extra=(copy_of(sound[8], "t12", start=137),))
    add("a copy decimated", {}, "copy", extra=(copy_of(sound[3], "t12", every=2),))
    add("a copy cropped, decimated, with noise", {}, "copy", extra=(copy_of(sound[10], "t12", 51, 2, 0.001 * size),))
    add(
        "a validation run that is a copy",
        {},
        "copy",
        extra=(replace(copy_of(sound[4], "t12", noise=0.001 * size), split="validate"),),
    )
    add(
        "a copy under another current",
        {},
        "copy",
        extra=(with_current(levels[1])(copy_of(sound[9], "t12", noise=0.0005 * size)),),
    )
    add("a random record in lbf", {}, "force", extra=(change_force(1 / LBF)(make_random(damper, "r0", rng)),))
    half = {k: make_run(weak, f"t{k:02d}", levels[k // 3], *motions(damper)[k % 3], rng) for k in range(0, 12, 2)}
    found.append(
        Folder(
            "two dampers, half the runs each",
            [half.get(k, r) for k, r in enumerate(sound)],
            frozenset(),
            ("refused",),
            sound,
        )
    )
    _ = f2
    return found


def levels_span(damper: SyntheticDamper) -> float:
    """Highest tested current [A]."""
    return max(damper.currents)
