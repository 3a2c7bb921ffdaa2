"""Forces at set velocities in rebound and compression, as in test reports.

Gas force is the force that does not change sign with the motion; friction is the remainder at the lowest current and
low velocity. Both are subtracted or stated separately from the damping forces. Extension is positive, so rebound is the
side of positive velocity and force.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mrdamper.data import Condition, Floats, Run, current_levels, same_motion
from mrdamper.errors import IdentificationError, InputError
from mrdamper.identification.loop_analysis import analyse_loop, whole_cycles
from mrdamper.physics.motion import equivalent_sine, measured_motion
from mrdamper.statistics.peaks import cycle_extremes, cycle_starts, extreme_forces

SIDES = ("rebound", "compression")
_DEFAULT_VELOCITIES = 6  # number of default velocities
_SLOW_VELOCITY = 0.010  # peak velocity [m/s] up to which a test counts as slow: viscous force is then a few newtons
_MIDDLE = 0.25  # share of the amplitude around mid-stroke in which the force at mid-stroke is evaluated


@dataclass(frozen=True)
class Stroke:
    """Values of one run for both sides, including the gas force."""

    run_id: str
    condition: Condition  # measured, its current rounded to the level of the test matrix
    peak_velocity: tuple[float, float]  # of rebound and compression, both positive [m/s]
    # largest force in the direction of rebound and of compression, signed, without noise, median over the cycles [N]
    peak_force: tuple[float, float]
    mid_force: tuple[float, float]  # force at mid-stroke, moving in rebound and in compression, signed [N]
    # half the width of the force–velocity loop: velocity at which the force less the gas force is zero, mean of
    # both sides [m/s]
    zero_force_velocity: float
    energy: float  # dissipated per cycle [J]

    @property
    def gas_force(self) -> float:
        """Half the sum of the forces at mid-stroke [N], which does not change its sign with the motion."""
        return (self.mid_force[0] + self.mid_force[1]) / 2

    @property
    def mid_damping_force(self) -> float:
        """Half the difference of the forces at mid-stroke [N], which changes its sign with the motion."""
        return (self.mid_force[0] - self.mid_force[1]) / 2


@dataclass(frozen=True)
class Characteristics:
    """Characteristic values of one damper's runs, without a model."""

    strokes: tuple[Stroke, ...]  # by current and peak velocity
    currents: tuple[float, ...]  # levels of the test matrix [A]
    # gas_force, friction: [N]; friction is nan where the tests do not determine it
    gas_force: float
    friction: float
    # gas_from, friction_from: how each was determined
    gas_from: str
    friction_from: str
    passed_over: Mapping[str, str]  # by run, why it has no steady cycle at one current

    def at(self, current: float) -> tuple[Stroke, ...]:
        """Return the strokes of a level, slow to fast."""
        return tuple(s for s in self.strokes if s.condition.current_A == current)

    def damping_force(self, stroke: Stroke, side: int) -> float:
        """Peak force of a side (0 rebound, 1 compression) with the gas force subtracted, positive [N]."""
        return abs(stroke.peak_force[side] - self.gas_force)

    def curve(self, current: float, side: int) -> tuple[Floats, Floats]:
        """Peak velocity [m/s], rising, and peak damping force [N] of a level; tests of one motion are averaged."""
        strokes = self.at(current)
        rows = np.array([(s.peak_velocity[side], self.damping_force(s, side)) for s in strokes])
        means = np.array([rows[group].mean(axis=0) for group in same_motion([s.condition for s in strokes])])
        speeds, forces = means[np.argsort(means[:, 0])].T
        return speeds, forces

    def at_velocity(self, current: float, velocity: float, side: int) -> float:
        """Peak damping force at a peak velocity [N], linearly interpolated between tested ones; nan outside them."""
        return float(np.interp(velocity, *self.curve(current, side), left=np.nan, right=np.nan))

    def ladder(self) -> tuple[float, ...]:
        """Round velocities [m/s] over the range that was tested at most currents."""
        slowest = [min(s.peak_velocity[side] for s in self.at(c)) for c in self.currents for side in (0, 1)]
        fastest = [max(s.peak_velocity[side] for s in self.at(c)) for c in self.currents for side in (0, 1)]
        low, high = float(np.median(slowest)), float(np.median(fastest))
        for step in (10.0**power * mantissa for power in range(-5, 3) for mantissa in (1, 2, 2.5, 5)):
            count = np.floor(high / step + 1e-9) - np.ceil(low / step - 1e-9) + 1
            if 1 <= count <= _DEFAULT_VELOCITIES:
                return tuple(float(f"{step * (np.ceil(low / step - 1e-9) + i):.6g}") for i in range(int(count)))
        return (float(f"{high:.3g}"),)


def characterise(runs: Sequence[Run]) -> Characteristics:
    """Characterise one damper from its steady sine runs; other motions are ignored.

    Raises `IdentificationError` if no run holds a steady cycle at one current.

    `runs`: of one rig.
    """
    usable, passed_over = list[Run](), dict[str, str]()
    for run in runs:
        try:
            run.current_A  # noqa: B018
            if equivalent_sine(run).is_sine:
                usable.append(run)
            else:
                passed_over[run.id] = "the motion is no steady cycle"
        except InputError as error:
            passed_over[run.id] = f"{error.found} [{error.code}]"
    if not usable:
        raise IdentificationError("no run holds a steady cycle at one current", remedy="see what mrdamper check says")
    levels = current_levels([run.current_A for run in usable])
    strokes = [_stroke(run, level) for run, level in zip(usable, levels, strict=True)]
    strokes.sort(key=lambda s: (s.condition.current_A, s.condition.peak_velocity))
    gas, gas_from = _gas_force(strokes)
    friction, friction_from = _friction(strokes)
    currents = tuple(sorted(set(levels)))
    return Characteristics(tuple(strokes), currents, gas, friction, gas_from, friction_from, passed_over)


def _stroke(run: Run, current: float) -> Stroke:
    loop = analyse_loop(run)
    steady = run.steady()
    whole = whole_cycles(steady.time, loop.condition.frequency_Hz)
    motion = measured_motion(steady).about(loop.motion.series.mean).part(whole)
    force = steady.force[whole]
    rebound, compression = motion.velocity > 0, motion.velocity < 0
    starts = cycle_starts(force.size, max(1, round(float(np.ptp(motion.time)) * loop.condition.frequency_Hz)))
    fastest, slowest = cycle_extremes(motion.velocity, starts)
    mid = tuple(_at_mid_stroke(motion.displacement, force, side) for side in (rebound, compression))
    condition = Condition(current, loop.condition.frequency_Hz, loop.condition.amplitude_m)
    return Stroke(
        run.id,
        condition,
        (fastest, -slowest),
        extreme_forces(force, starts),
        (mid[0], mid[1]),
        _zero_force_velocity(motion.velocity, force - (mid[0] + mid[1]) / 2),
        loop.dissipated_energy,
    )


def _at_mid_stroke(displacement: Floats, force: Floats, side: np.ndarray) -> float:
    near = side & (np.abs(displacement) < _MIDDLE * np.abs(displacement).max())
    table = np.column_stack([np.ones(near.sum()), displacement[near], displacement[near] ** 2])
    return float(np.linalg.lstsq(table, force[near], rcond=None)[0][0])


def _zero_force_velocity(velocity: Floats, force: Floats) -> float:
    crossing = np.flatnonzero((force[1:] > 0) != (force[:-1] > 0))
    if not crossing.size:
        return float("nan")
    share = force[crossing] / (force[crossing] - force[crossing + 1])
    at = velocity[crossing] + share * (velocity[crossing + 1] - velocity[crossing])
    return float(np.median(np.abs(at)))


def _gas_force(strokes: Sequence[Stroke]) -> tuple[float, str]:
    slow = [s for s in strokes if max(s.peak_velocity) <= _SLOW_VELOCITY]
    tests = f"from {len(slow)} slow tests, up to {1e3 * _SLOW_VELOCITY:g} mm/s" if slow else "from mid-stroke forces"
    gas = np.array([s.gas_force for s in slow or strokes])
    damping = np.array([s.mid_damping_force for s in slow or strokes])
    if gas.size >= 3 and damping.max() > 2 * damping.min() > 0:  # the sides differ in proportion to the damping force
        return float(np.polyfit(damping, gas, 1, w=1 / damping)[1]), f"{tests}, extrapolated to no damping"
    return float(np.median(gas)), f"{tests}, median"


def _friction(strokes: Sequence[Stroke]) -> tuple[float, str]:
    lowest = [s for s in strokes if s.condition.current_A == min(s.condition.current_A for s in strokes)]
    half = np.array([s.mid_damping_force for s in lowest])
    speed = np.array([s.condition.peak_velocity for s in lowest])
    level = f"{lowest[0].condition.current_A:g} A"
    if speed.min() <= _SLOW_VELOCITY:
        return float(half[speed <= _SLOW_VELOCITY].mean()), f"from slow tests at {level}"
    if np.ptp(speed) > 0.5 * speed.min() and speed.size >= 3:
        line = np.polyfit(speed, half, 1)
        if line[1] >= 0:
            return float(line[1]), f"at {level}, extrapolated to zero velocity; includes the fluid's yield force"
    return float("nan"), "not known: no slow test, and too few velocities at the lowest current"
