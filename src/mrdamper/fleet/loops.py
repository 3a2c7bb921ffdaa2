"""Loops and forces by which dampers of a population are compared, independent of the model."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

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


def velocity_ladder(
    model: Model, currents: Iterable[float], speeds: Sequence[float], amplitude: float
) -> dict[tuple[float, float], tuple[float, float]]:
    """Rebound and compression force [N] at mid-stroke of a sine, by current [A] and speed [m/s]."""
    steps = [(current, speed) for current in currents for speed in speeds]
    conditions = [Condition(current, speed / (2 * np.pi * amplitude), amplitude) for current, speed in steps]
    force = simulate(model, concatenate(sine(c, 2, _PER_CYCLE) for c in conditions)).force
    last = np.arange(len(steps)) * (2 * _PER_CYCLE + 1) + 2 * _PER_CYCLE
    rebound, compression = force[last], force[last - _PER_CYCLE // 2]
    return {step: (float(up), float(down)) for step, up, down in zip(steps, rebound, compression, strict=True)}


def gas_and_friction(
    ladder: dict[tuple[float, float], tuple[float, float]], speeds: Sequence[float]
) -> tuple[float, float]:
    """Gas force and friction [N] at the lowest current, extrapolated to zero velocity.

    The gas force is the mean of rebound and compression, friction half their difference.
    """
    current = min(c for c, _ in ladder)
    (up1, down1), (up2, down2) = ladder[current, speeds[0]], ladder[current, speeds[1]]
    share = speeds[0] / (speeds[1] - speeds[0])
    half1, half2 = (up1 - down1) / 2, (up2 - down2) / 2
    middle1, middle2 = (up1 + down1) / 2, (up2 + down2) / 2
    return middle1 - share * (middle2 - middle1), half1 - share * (half2 - half1)
