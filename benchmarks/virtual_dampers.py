"""Identification of synthetic dampers of every size: `python -m benchmarks.virtual_dampers [NAME ...]`.

Twenty-four dampers from 20 N to 200 kN, tested as laboratories test: few or many currents, sines, random motion, ramps
and stops, a switched current, slow and fast clocks, noisy channels. Each is identified from its tests alone. The output
contains the cross-validated error, the error on a random record with a switched current that was not used, the noise,
and parameters that ended at a bound although the true value is none.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from mrdamper.dampers.choice import JointChoice, identify_jointly
from mrdamper.dampers.coil import Coil
from mrdamper.data import Condition, Run
from mrdamper.models.play_bypass import PlayBypass
from mrdamper.physics.motion import Excitation, measured_motion, random_motion, sine
from mrdamper.physics.simulation import simulate
from mrdamper.study.cross_validation import stretches
from mrdamper.study.validation import score_run


@dataclass(frozen=True)
class Virtual:
    """A synthetic damper and its tests.

    Attributes
    ----------
    name : str
    force : float
        Yield force at full current [N].
    stroke : float
        Amplitude of the tests [m].
    speed : float
        Peak velocity of the fastest test [m/s].
    current : float
        Full current [A].
    lost : float
        Free play 2 (d − e) [m]; zero: none.
    rebound : float
        Force in extension over that in compression, of viscosity, yield and bypass alike.
    coil : Coil or None
    tests : str
        "sines", "random", "ramps", "switched", "few".
    rate : float
        Samples in a cycle of the fastest motion.
    noise, current_noise : float
        Standard deviations over the peak-to-peak force, and over the full current.
    levels : tuple of float
        Currents tested, as shares of the full one.
    onset, saturation : float
        Ic and si I_max of the level law.
    leak : float
        Relaxation rate at rest [1/s].
    """

    name: str
    force: float
    stroke: float
    speed: float
    current: float
    lost: float = 4e-4
    rebound: float = 1.0
    coil: Coil | None = None
    tests: str = "sines"
    rate: float = 120.0
    noise: float = 3e-3
    current_noise: float = 0.0
    levels: tuple[float, ...] = (0.0, 0.25, 0.5, 0.75, 1.0)  # the law of the yield force has four parameters
    onset: float = 0.12
    saturation: float = 0.5
    leak: float = 18.0

    @property
    def truth(self) -> PlayBypass:
        """The damper."""
        F, V, I = self.force, self.speed, self.current
        q = (self.rebound - 1) / (self.rebound + 1)
        seat = max(0.08 * self.lost, 5e-3 * self.stroke) if self.lost else 0.03 * self.stroke
        rise = 1 - np.exp(-1 / self.onset)
        return PlayBypass(
            f0=0.05 * F, k=0.05 * F / self.stroke, c0=0.25 * F / V, c1=0.15 * F / V / I, fy0=0.08 * F,
            fy1=0.92 * F * (1 + self.saturation) / rise / I, d=self.lost / 2 + seat, e=seat, cb=5 * F / V, h0=0.35,
            h1=0.25 / I, vh=0.02 * V, T=4e-3, asymmetry=q, cq=q * 0.25 * F / V, qb=q, Ic=self.onset * I,
            leak=self.leak, si=self.saturation / I, m=2e-3 * F / (V**2 / self.stroke),
        )  # fmt: skip

    @property
    def fastest(self) -> float:
        """Frequency of the fastest motion [Hz]."""
        return self.speed / (2 * np.pi * 0.4 * self.stroke)

    def runs(self, seed: int = 1) -> list[Run]:
        """What the laboratory recorded."""
        rng = np.random.default_rng(seed)
        return [self.record(rng, f"{self.tests}{i}", m) for i, m in enumerate(self._motions(rng))]

    def unseen(self) -> Run:
        """A random record with a switched current, not used for identification."""
        rng = np.random.default_rng(99)
        return self.record(rng, "unseen", self._switched(self._random(rng, 25), rng))

    def record(self, rng: np.random.Generator, name: str, motion: Excitation) -> Run:
        """The force along a motion, and the channels with their noise."""
        amperes = motion.current
        seen = Run(name, motion.time, motion.displacement, np.zeros(len(motion)), amperes)
        followed = measured_motion(seen).with_current(self._field(motion))
        force = simulate(self.truth, followed).force
        force = force + self.noise * np.ptp(force) * rng.standard_normal(force.size)
        channel = amperes + self.current_noise * self.current * rng.standard_normal(force.size)
        kind = "sine" if self.tests in ("sines", "few") and name != "unseen" else "random"
        window = (float(motion.time[len(motion) // 4]), float(motion.time[-1])) if kind == "sine" else None
        return Run(name, motion.time, motion.displacement, force, channel, excitation=kind, window=window)

    def _field(self, motion: Excitation) -> np.ndarray:
        return self.coil.along(motion.time, motion.current) if self.coil else np.abs(motion.current)

    def _motions(self, rng: np.random.Generator) -> Iterator[Excitation]:
        if self.tests in ("sines", "few"):
            shapes = (
                [(0.4, 1.0), (1.0, 0.2)] if self.tests == "few" else [(0.4, 1.0), (1.0, 0.2), (0.6, 0.5), (0.2, 0.6)]
            )
            for level in self.levels:
                for amplitude, speed in shapes:
                    f = speed * self.fastest * 0.4 / amplitude
                    rate = max(40, int(self.rate / (f / self.fastest)))
                    yield sine(Condition(level * self.current, f, amplitude * self.stroke), 6, min(rate, 2000))
        elif self.tests == "random":
            for level in self.levels:
                motion = self._random(rng, 20)
                yield motion.with_current(np.full(len(motion), level * self.current))
        elif self.tests == "switched":
            for _ in range(2):
                yield self._switched(self._random(rng, 40), rng)
        else:
            for level in self.levels:
                yield self._ramps(rng, level * self.current)

    def _random(self, rng: np.random.Generator, cycles: float) -> Excitation:
        f = self.fastest
        return random_motion(rng, cycles / f, 0.15 * self.stroke, (0.1 * f, 1.2 * f), 0.0, self.rate * f)

    def _switched(self, motion: Excitation, rng: np.random.Generator) -> Excitation:
        changes = np.cumsum(rng.uniform(0.3, 1.5, 500)) / self.fastest
        return motion.with_current(rng.uniform(0, self.current, 501)[np.searchsorted(changes, motion.time)])

    def _ramps(self, rng: np.random.Generator, current: float) -> Excitation:
        """Straight ways at several speeds, with rests between them."""
        f = self.fastest
        ways, places = [0.0], [0.0]
        for i in range(24):
            target = self.stroke * rng.uniform(0.3, 1.0) * (-1) ** i
            ways.append(ways[-1] + abs(target - places[-1]) / (self.speed * rng.choice([0.05, 0.2, 0.6, 1.0])))
            places.append(target)
            ways.append(ways[-1] + rng.choice([0.1, 1.0]) / f)
            places.append(target)
        time = np.arange(int(ways[-1] * self.rate * f)) / (self.rate * f)
        x = np.interp(time, ways, places)
        width = max(3, int(self.rate / 12))
        x = np.convolve(np.pad(x, width, mode="edge"), np.hanning(width) / np.hanning(width).sum(), "same")[
            width:-width
        ]
        return Excitation(time, x, np.gradient(x, time), np.zeros_like(x), np.full(time.size, current))


LAG, SLOW = Coil(6e-3, 12e-3), Coil(20e-3, 35e-3)
DAMPERS = (
    Virtual("plain", 1e3, 0.02, 0.2, 1.0),
    Virtual("prosthesis, 20 N", 20.0, 0.01, 0.1, 0.3, lost=1e-4, noise=8e-3),
    Virtual("seat, 60 N, noisy", 60.0, 0.015, 0.15, 0.5, lost=0.0, noise=1e-2, current_noise=0.01),
    Virtual("washing machine, few tests", 150.0, 0.02, 0.3, 0.5, tests="few", levels=(0.0, 1.0)),
    Virtual("truck seat, random", 800.0, 0.03, 0.3, 1.0, tests="random"),
    Virtual("switched current", 1.2e3, 0.02, 0.25, 1.0, coil=LAG, tests="switched"),
    Virtual("switched, noisy current", 2e3, 0.025, 0.3, 2.0, coil=SLOW, tests="switched", current_noise=0.01),
    Virtual("no lost motion, switched", 1.5e3, 0.02, 0.2, 2.0, lost=0.0, coil=LAG, tests="switched"),
    Virtual("no lost motion, ramps", 1.5e3, 0.02, 0.2, 2.0, lost=0.0, tests="ramps"),
    Virtual("car, rebound 1.5", 1.5e3, 0.05, 0.6, 1.8, rebound=1.5, lost=5e-4),
    Virtual("car, rebound 2.2, random", 1.8e3, 0.05, 0.8, 2.0, rebound=2.2, lost=8e-4, tests="random"),
    Virtual("car, rebound 3, switched", 2e3, 0.05, 1.0, 2.0, rebound=3.0, lost=5e-4, coil=LAG, tests="switched"),
    Virtual("car, rebound 3, sines", 2e3, 0.05, 1.0, 2.0, rebound=3.0, lost=0.0),
    Virtual("short knee 0.05 mm", 1e3, 0.01, 0.1, 1.0, lost=5e-5, rate=250),
    Virtual("knee 2 mm", 3e3, 0.03, 0.2, 1.5, lost=2e-3),
    Virtual("knee 8 mm, random", 5e3, 0.06, 0.4, 2.0, lost=8e-3, tests="random"),
    Virtual("slow clock", 2e3, 0.03, 0.2, 1.0, lost=1e-3, rate=50),
    Virtual("fast clock, few currents", 2e3, 0.03, 0.2, 1.0, rate=600, levels=(0.0, 0.5, 1.0), tests="random",
            saturation=0.0),
    Virtual("one current", 1e3, 0.02, 0.2, 0.6, levels=(1.0,)),
    Virtual("hard saturation", 4e3, 0.03, 0.3, 3.0, onset=0.3, saturation=2.0, levels=(0.0, 0.2, 0.4, 0.7, 1.0)),
    Virtual("20 kN, ramps and stops", 2e4, 0.05, 0.2, 2.0, lost=1e-3, tests="ramps", leak=5.0),
    Virtual("bridge, 60 kN, slow", 6e4, 0.08, 0.1, 4.0, lost=1.5e-3, rebound=1.1),
    Virtual("building, 120 kN, switched", 1.2e5, 0.1, 0.3, 5.0, lost=2e-3, coil=SLOW, tests="switched"),
    Virtual("200 kN, random, rebound 1.5", 2e5, 0.12, 0.4, 5.0, lost=4e-3, rebound=1.5, tests="random"),
)  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """Result of the identification of a synthetic damper.

    Attributes
    ----------
    left_out, unseen, noise : float
        nrmse_pp.
    astray : tuple of str
        Parameters at a bound whose true value is none.
    choice : JointChoice
    seconds : float
        Processor time.
    """

    left_out: float
    unseen: float
    noise: float
    astray: tuple[str, ...]
    choice: JointChoice
    seconds: float


def identified(virtual: Virtual) -> Outcome:
    """Identify a synthetic damper from its tests."""
    runs = virtual.runs()
    begin = time.process_time()
    choice = identify_jointly([piece for run in runs for piece in stretches(run)])
    seconds = time.process_time() - begin
    unseen = score_run(replace(choice.fit.damper, rig=""), virtual.unseen()).scores.nrmse_pp
    left_out = choice.left_out.get("condition", float("nan"))
    return Outcome(left_out, unseen, virtual.noise, _astray(virtual, choice), choice, seconds)


def _astray(virtual: Virtual, choice: JointChoice) -> tuple[str, ...]:
    """Names at a bound that the truth does not share."""
    truth = {**virtual.truth.values(), "seat_share": virtual.truth.seat_share}
    if virtual.coil is None:
        truth |= {"coil.rise_s": 0.0, "coil.fall_s": 0.0}
    else:
        truth |= {"coil.rise_s": virtual.coil.rise_s, "coil.fall_s": virtual.coil.fall_s}
    return tuple(name for name in choice.fit.at_bounds if truth[name] != 0.0)


def main(names: list[str]) -> None:
    chosen = [v for v in DAMPERS if not names or any(name in v.name for name in names)]
    print(
        "| damper | left out | unseen, switched | noise | at a bound | terms | CPU s |\n|---|---|---|---|---|---|---|"
    )
    found = []
    for virtual in chosen:
        made = identified(virtual)
        found.append(made)
        terms = "; ".join(t.term for t in made.choice.tried if t.kept)
        errors = " | ".join(f"{100 * e:.2f} %" for e in (made.left_out, made.unseen, made.noise))
        print(f"| {virtual.name} | {errors} | {', '.join(made.astray)} | {terms} | {made.seconds:.1f} |", flush=True)
    ratios = [[getattr(o, name) / o.noise for o in found] for name in ("left_out", "unseen")]
    medians = " / ".join(f"{np.nanmedian(r):.2f}" for r in ratios)
    print(f"median left out / unseen over noise: {medians}; astray: {sum(bool(o.astray) for o in found)}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
