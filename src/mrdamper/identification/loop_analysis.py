"""Peak force, energy, equivalent damping and dynamic range of a measured loop, without a model.

The counterpart of the test analysis in section 2 of Qian et al. 2024.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrdamper.data import Condition, Floats, Run, current_levels, index_at, same_motion
from mrdamper.data.runs import once_per_run
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.physics.motion.measured import measured_motion
from mrdamper.physics.motion.sines import MotionAnalysis, analyse_motion
from mrdamper.statistics.linear import solve_linear
from mrdamper.statistics.metrics import dissipated_power
from mrdamper.statistics.peaks import cycle_starts, extreme_forces


@dataclass(frozen=True)
class LoopAnalysis:
    """Values of one run's steady loops."""

    run_id: str
    split: str
    motion: MotionAnalysis
    peak_force: float  # half the peak-to-peak force without noise, median over the cycles [N]
    mean_force: float  # mean force over whole cycles [N]: gas force, preload, and the load cell's zero
    dissipated_energy: float  # per cycle [J]
    equivalent_damping: float  # of the viscous damper that dissipates as much, W/(π ω X²) [N s/m]

    @property
    def condition(self) -> Condition:
        """Measured current, frequency and amplitude."""
        return self.motion.condition


@once_per_run
def analyse_loop(run: Run) -> LoopAnalysis:
    """Analyse the whole cycles inside a run's steady window.

    Raises `ExcitationError` if there is under one cycle.
    """
    analysis = analyse_motion(run)
    steady = run.steady()
    whole = whole_cycles(steady.time, analysis.condition.frequency_Hz)
    motion = measured_motion(steady).part(whole)
    force = steady.force[whole]
    frequency, amplitude = analysis.condition.frequency_Hz, analysis.condition.amplitude_m
    energy = dissipated_power(force, motion.velocity, motion.time) / frequency
    highest, lowest = extreme_forces(force, cycle_starts(force.size, max(1, round(np.ptp(motion.time) * frequency))))
    return LoopAnalysis(
        run_id=run.id,
        split=run.split,
        motion=analysis,
        peak_force=(highest - lowest) / 2,
        mean_force=float(np.mean(force)),
        dissipated_energy=energy,
        equivalent_damping=energy / (2 * np.pi**2 * frequency * amplitude**2),
    )


def damping_share(motion: Excitation, force: Floats) -> float:
    """Part of a force's standard deviation that opposes the velocity; negative with negative dissipated energy.

    The sign is that of c in F = f0 + r t + k x + c v by least squares.
    """
    t = motion.time - motion.time[0]
    columns = np.stack([motion.velocity, motion.displacement, np.ones_like(t), t]).T
    return float(solve_linear(columns, force)[0] * np.std(motion.velocity) / np.std(force))


def at_levels(loops: Sequence[LoopAnalysis]) -> tuple[LoopAnalysis, ...]:
    """Return the same loops, each at the current level of the test matrix it belongs to."""
    levels = current_levels([loop.condition.current_A for loop in loops])
    return tuple(
        replace(loop, motion=replace(loop.motion, condition=replace(loop.condition, current_A=level)))
        for loop, level in zip(loops, levels, strict=True)
    )


def whole_cycles(time: Floats, frequency: float) -> slice:
    """Return the samples of the largest whole number of cycles from the start."""
    cycles = max(1, int(np.ptp(time) * frequency + 0.02))
    return slice(0, index_at(time, time[0] + cycles / frequency + 1e-9, "right"))


@dataclass(frozen=True)
class DynamicRange:
    """Peak force at each current over that at the lowest, at one motion."""

    frequency_Hz: float
    amplitude_m: float
    currents_A: tuple[float, ...]
    ratios: tuple[float, ...]


def dynamic_ranges(loops: Sequence[LoopAnalysis]) -> tuple[DynamicRange, ...]:
    """Dynamic range of every motion that was tested at two currents or more."""
    ranges: list[DynamicRange] = []
    for group in same_motion([loop.condition for loop in loops]):
        members = sorted((loops[i] for i in group), key=lambda loop: loop.condition.current_A)
        currents = tuple(m.condition.current_A for m in members)
        if len(set(currents)) < 2:
            continue
        lowest = members[0].peak_force
        first = members[0].condition
        ranges.append(
            DynamicRange(first.frequency_Hz, first.amplitude_m, currents, tuple(m.peak_force / lowest for m in members))
        )
    return tuple(ranges)
