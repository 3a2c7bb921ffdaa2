"""A synthetic damper on a synthetic rig, more complex than any model identified here.

It replaces test data that are not public, so that methods can be checked against known parameters, which are its
fields. The test matrix is that of Qian et al. 2024, section 2; the parameters of the damper are typical values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from mrdamper.data import Condition, Dataset, Floats, Run
from mrdamper.data.parameters import ParameterInfo, param, parameters_of
from mrdamper.errors import ParameterError
from mrdamper.physics.gas_spring import GasSpring
from mrdamper.physics.hysteresis import Shape, follow
from mrdamper.physics.motion import Excitation, Path, sine, triangle
from mrdamper.physics.motion.lag import decaying_sum

MOTIONS = ((0.020, 1.0), (0.020, 1.5), (0.020, 2.0), (0.050, 0.5), (0.050, 1.0), (0.050, 1.5))
HELD_OUT = (0.080, 1.0)
CURRENTS = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0)
SLOW_SPEED = 1e-5  # of the friction test [m/s]
SYNTHETIC = {"licence": "CC0-1.0", "provenance": "synthetic: mrdamper.paper.virtual_rig, no measurement"}


@dataclass(frozen=True)
class VirtualRig:
    """The damper, its sensors and its recorder. Displacement and force are positive in extension.

    The force is the sum of the exact gas spring, a shear-thinning viscous force, a hysteretic force, seal friction that
    varies along the stroke, inertia and an offset. The yield force saturates with current, the yield point lags with
    rate, and after each reversal the hysteretic force is partly missing until a vacuum cavity has closed.
    """

    gas_pressure: float = param("Pa", "absolute gas pressure at mid-stroke", bounds=(0, np.inf), default=1.5e6)
    gas_volume: float = param("m^3", "gas volume at mid-stroke", bounds=(0, np.inf), default=1.5e-4)
    rod_diameter: float = param("m", "rod diameter", bounds=(0, np.inf), default=0.020)
    offset_force: float = param("N", "static gas force beyond the weight", default=120.0)
    mass: float = param("kg", "moving mass beyond the load cell", bounds=(0, np.inf), default=4.0)
    yield_off: float = param("N", "yield force without current", bounds=(0, np.inf), default=15.0)
    yield_per_ampere: float = param("N/A", "yield force gained per ampere, unsaturated", default=850.0)
    saturation_current: float = param("A", "current at which the magnetic circuit saturates", default=1.5)
    knee: float = param("m", "yield displacement", bounds=(0, np.inf), default=7e-4)
    knee_sharpness: float = param("-", "exponent n of the hysteresis", bounds=(1, 20), default=1.6)
    knee_asymmetry: float = param("-", "(gamma − beta)/(gamma + beta)", bounds=(-100, 1), default=-0.3)
    knee_lag: float = param("s", "time in which the hysteretic force follows", bounds=(0, np.inf), default=3e-3)
    viscosity: float = param("N s/m", "viscous damping at low speed", bounds=(0, np.inf), default=1300.0)
    viscosity_per_ampere: float = param("N s/m/A", "gained per ampere, unsaturated", default=250.0)
    thinning_speed: float = param("m/s", "speed at which shear thinning sets in", default=0.35)
    thinning: float = param("-", "exponent lost by thinning", bounds=(0, 1), default=0.4)
    friction_low: float = param("N", "smallest seal friction along the stroke", default=25.0)
    friction_high: float = param("N", "largest seal friction along the stroke", default=80.0)
    friction_wave: float = param("m", "distance over which seal friction repeats", default=0.037)
    friction_knee: float = param("m", "displacement in which the seal breaks away", default=6e-5)
    cavity_time: float = param("s", "cavity length over the peak speed of the stroke before", default=6e-3)
    cavity_depth: float = param("-", "share of the yield force missing until it closes", bounds=(0, 1), default=0.4)
    force_noise: float = param("N", "standard deviation of the load cell", bounds=(0, np.inf), default=6.0)
    force_step: float = param("N", "resolution of the load cell channel", bounds=(0, np.inf), default=0.5)
    force_delay: float = param("s", "delay of the force channel", bounds=(0, np.inf), default=5e-4)
    displacement_noise: float = param("m", "standard deviation of the gauge", bounds=(0, np.inf), default=5e-6)
    displacement_step: float = param("m", "resolution of the gauge channel", bounds=(0, np.inf), default=2e-6)
    sample_rate: float = param("Hz", "samples per second", bounds=(0, np.inf), default=500.0)

    def __post_init__(self) -> None:
        for info in self.parameters():
            value = getattr(self, info.name)
            if not info.bounds[0] <= value <= info.bounds[1]:
                raise ParameterError(
                    f"{info.name} is {value:g} {info.unit}", where="virtual rig", remedy="see its bounds"
                )

    @classmethod
    def parameters(cls) -> tuple[ParameterInfo, ...]:
        """Return unit, bounds and meaning of every parameter."""
        return parameters_of(cls)

    @cached_property
    def gas(self) -> GasSpring:
        """The gas spring, for the identification."""
        return GasSpring(self.gas_pressure, self.gas_volume, np.pi * self.rod_diameter**2 / 4)

    def magnetisation(self, current: Any) -> Floats:
        """Return the effective current [A]: the current below saturation, the saturation current far above."""
        ratio = np.abs(current) / self.saturation_current
        return np.abs(current) / (1 + ratio**6) ** (1 / 6)

    def yield_force(self, current: Any) -> Floats:
        """Return the yield force [N] at a current [A]."""
        return self.yield_off + self.yield_per_ampere * self.magnetisation(current)

    def force(self, motion: Excitation) -> Floats:
        """Return the true force [N] along a motion from rest, without sensor effects."""
        x, v, a, path = motion.displacement, motion.velocity, motion.acceleration, motion.path
        viscosity = self.viscosity + self.viscosity_per_ampere * self.magnetisation(motion.current)
        viscous = viscosity * v * (1 + (v / self.thinning_speed) ** 2) ** (-self.thinning / 2)
        return (
            -self.gas.force(-x)  # the gas opposes compression
            + viscous
            + _follow_lag(self._hysteretic(motion), motion.time, self.knee_lag)
            + self._friction(x, path)
            + self.mass * a
            + self.offset_force
        )

    def sense(self, motion: Excitation, force: Floats, rng: np.random.Generator, **labels: Any) -> Run:
        """Return the record of a motion and its true force [N], delayed, noisy, quantised, with fields of `Run`."""
        late = np.interp(motion.time - self.force_delay, motion.time, force)
        x = motion.displacement + self.displacement_noise * rng.standard_normal(len(motion))
        return Run(
            time=motion.time,
            displacement=_quantised(x, self.displacement_step),
            force=_quantised(late + self.force_noise * rng.standard_normal(len(motion)), self.force_step),
            current=motion.current,
            rig="virtual",
            **{"notes": SYNTHETIC, **labels},
        )

    def _hysteretic(self, motion: Excitation) -> Floats:
        path = motion.path
        along = path.direction * follow(Shape(1 / self.knee, self.knee_asymmetry, self.knee_sharpness), path)
        closed = self.cavity_time * _speed_before(motion.velocity, path.stroke)
        filled = (path.distance / np.maximum(closed, 1e-12)) ** 8
        share = 1 - self.cavity_depth / (1 + filled)
        return self.yield_force(motion.current) * path.direction * np.where(along > 0, along * share, along)

    def _friction(self, x: Floats, path: Path) -> Floats:
        middle, swing = (self.friction_high + self.friction_low) / 2, (self.friction_high - self.friction_low) / 2
        size = middle + swing * np.sin(2 * np.pi * x / self.friction_wave)
        return size * follow(Shape(1 / self.friction_knee, -1.0, 1.0), path)


def virtual_dataset(
    rig: VirtualRig | None = None, currents: Sequence[float] = CURRENTS, seed: int = 0, cycles: int = 4
) -> Dataset:
    """Test the paper's matrix on the virtual rig; synthetic, the same for the same `seed` of the sensor noise.

    20 mm at 1.0, 1.5, 2.0 Hz and 50 mm at 0.5, 1.0, 1.5 Hz are for identification, 80 mm at 1 Hz for validation, each
    at all `currents` [A], with some steady cycles after one cycle of run-in.
    """
    chosen = rig or VirtualRig()
    runs = []
    for number, (c, motion, force) in enumerate(true_runs(chosen, tuple(currents), cycles)):
        labels = {
            "id": f"{1e3 * c.amplitude_m:g}mm-{c.frequency_Hz:g}Hz-{c.current_A:g}A",
            "split": "validate" if (c.amplitude_m, c.frequency_Hz) == HELD_OUT else "train",
            "nominal": c,
            "window": (1 / c.frequency_Hz, float(motion.time[-1])),
        }
        runs.append(chosen.sense(motion, force, np.random.default_rng((seed, number)), **labels))
    return Dataset(tuple(runs), "virtual rig (synthetic)")


@lru_cache(maxsize=1)
def true_runs(
    rig: VirtualRig, currents: tuple[float, ...], cycles: int = 4
) -> list[tuple[Condition, Excitation, Floats]]:
    """Return condition, motion and true force of every run of the matrix, the prediction motion last."""
    runs = []
    for amplitude, frequency in (*MOTIONS, HELD_OUT):
        for current in currents:
            condition = Condition(current, frequency, amplitude)
            motion = sine(condition, cycles + 1, round(rig.sample_rate / frequency))
            runs.append((condition, motion, rig.force(motion)))
    return runs


def friction_test(rig: VirtualRig, seed: int = 0, *, filled: bool = False) -> Run:
    """Test one cycle of 20 mm at 0.01 mm/s, 0 A [section 2], without fluid as in the paper or `filled`; synthetic."""
    if not filled:
        rig = replace(rig, yield_off=0.0, yield_per_ampere=0.0, viscosity=0.0, viscosity_per_ampere=0.0)
    condition = Condition(0.0, SLOW_SPEED / (4 * 0.020), 0.020)
    motion = triangle(condition, 1.25, 8000)
    rng = np.random.default_rng((seed, 10_000))
    return rig.sense(motion, rig.force(motion), rng, id="friction-0.01mm-s", excitation="triangle", nominal=condition)


def _follow_lag(force: Floats, time: Floats, lag: float) -> Floats:
    """Apply a first-order lag, exact for a force that is held over each step."""
    if lag == 0:
        return force
    keep = np.exp(-float(time[1] - time[0]) / lag)
    return decaying_sum(np.append(force[:1], (1 - keep) * force[1:]), keep)


def _speed_before(velocity: Floats, stroke: np.ndarray) -> Floats:
    """Return the peak speed [m/s] of the stroke before the one each sample lies in; zero in the first."""
    begins = np.searchsorted(stroke, np.arange(stroke[-1] + 1))
    peaks = np.maximum.reduceat(np.abs(velocity), begins)
    return np.concatenate([[0.0], peaks[:-1]])[stroke]


def _quantised(signal: Floats, step: float) -> Floats:
    return np.round(signal / step) * step if step > 0 else signal
