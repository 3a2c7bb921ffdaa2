"""Loops and forces by which dampers of a population are compared, independent of the model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrdamper.dampers.concatenated_runs import concatenate
from mrdamper.data import Condition, Floats, Run
from mrdamper.models import Model
from mrdamper.physics.motion import equivalent_sine, measured_motion, sine
from mrdamper.physics.simulation import simulate

PHASES = 64  # points of a loop
_SAME_CURRENT, _SAME_MOTION = 0.02, 0.08  # [A] and relative tolerance within which a test belongs to the test matrix
_PER_CYCLE = 200  # samples of a synthetic cycle
Test = tuple[float, float, float]  # current [A], frequency [Hz], amplitude [m]


def measured_loop(run: Run) -> Floats:
    """(64,) mean measured force [N] by the phase of the motion, from mid-stroke in extension on."""
    equivalent = equivalent_sine(run)
    inside = run.in_window
    motion = measured_motion(run).part(inside)
    omega = 2 * np.pi * equivalent.condition.frequency_Hz
    phase = np.arctan2(omega * (motion.displacement - equivalent.centre), motion.velocity) % (2 * np.pi)
    bins = np.minimum((phase * (PHASES / (2 * np.pi))).astype(int), PHASES - 1)
    counts = np.bincount(bins, minlength=PHASES)
    sums = np.bincount(bins, run.force[inside], minlength=PHASES)
    filled = np.flatnonzero(counts)
    return np.interp(np.arange(PHASES), filled, sums[filled] / counts[filled], period=PHASES)


def by_test(tests: Sequence[Test], matrix: Sequence[Test]) -> list[list[int]]:
    """Return the indices of the tests of a damper for each test of the population's matrix."""
    return [[i for i, test in enumerate(tests) if _is_same(test, wanted)] for wanted in matrix]


def _is_same(test: Test, wanted: Test) -> bool:
    return abs(test[0] - wanted[0]) <= _SAME_CURRENT + 0.03 * abs(wanted[0]) and all(
        abs(a / b - 1) <= _SAME_MOTION for a, b in zip(test[1:], wanted[1:], strict=True)
    )


def deviation(loop: Floats, reference: Floats) -> float:
    """RMS distance of two loops over the peak-to-peak force of the reference."""
    return float(np.sqrt(np.mean((loop - reference) ** 2)) / np.ptp(reference))


def shape_deviation(loop: Floats, reference: Floats) -> float:
    """Calculate the deviation of the shape: of the loop scaled and shifted onto the reference."""
    columns = np.column_stack([loop, np.ones(loop.size)])
    return deviation(columns @ np.linalg.lstsq(columns, reference, rcond=None)[0], reference)


def velocity_ladder(model: Model, currents: Sequence[float], speeds: Sequence[float], amplitude: float) -> Floats:
    """(C, S, 2) rebound and compression force [N] at mid-stroke of a sine, by current [A] and speed [m/s]."""
    frequencies = [speed / (2 * np.pi * amplitude) for speed in speeds]
    conditions = [Condition(current, frequency, amplitude) for current in currents for frequency in frequencies]
    force = simulate(model, concatenate(sine(c, 2, _PER_CYCLE) for c in conditions)).force
    last = np.arange(len(conditions)) * (2 * _PER_CYCLE + 1) + 2 * _PER_CYCLE
    return np.stack([force[last], force[last - _PER_CYCLE // 2]], axis=1).reshape(len(currents), len(speeds), 2)


def gas_and_friction(ladder: Floats, speeds: Sequence[float]) -> tuple[float, float]:
    """Gas force and friction [N] at the lowest current and rest: mean and half difference of both directions."""
    slow, fast = ladder[0, :2]
    rebound, compression = slow - speeds[0] / (speeds[1] - speeds[0]) * (fast - slow)
    return float(rebound + compression) / 2, float(rebound - compression) / 2
