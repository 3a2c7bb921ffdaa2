"""Distance of a prediction from the tests of a damper.

Three dimensionless numbers: the distance of a current between two tested ones, the distance beyond them, and the
distance of a motion from the convex hull of the tested motions in log f and log A, where lines of equal peak velocity
are straight. They are zero at the tests, and the model error increases with each (`calibration.Growth`). The first and
the last become distances of a prediction with the forces there (`prediction.distance_from_tests`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrdamper.data.arrays import Floats
from mrdamper.data.conditions import Condition, current_levels
from mrdamper.statistics.functions.motion_hull import MotionHull

_CURRENT_TOLERANCE = 0.02  # of the largest current: sessions repeat a level to some per cent
_MAX_SAMPLES = 400  # samples of a current that are used


@dataclass(frozen=True)
class Distance:
    """Distance from the tests, by quantity."""

    # product of the distances of a current from its two tested neighbours, over the square of the distance between
    # them; of a prediction, times the change of the peak force between them over the peak force
    between: float = 0.0
    # product of the distances from the two nearest tested currents on one side, over the square of the largest tested
    # current: the error of extrapolation grows with it
    beyond: float = 0.0
    # Euclidean distance from the hull of tested motions in ln f and ln A; of a prediction, that of its velocity and of
    # its force, too (`Prediction.distance`)
    motion: float = 0.0

    @property
    def squares(self) -> Floats:
        """(3,) squared distances."""
        return np.square([self.between, self.beyond, self.motion])


def distance_from(
    tested: Sequence[Condition], at: Condition, current: Floats, *, swept_A: tuple[float, float] | None = None
) -> Distance:
    """Distance of a condition and the currents (N,) [A] along its motion from tested conditions, one at least.

    `at` is the equivalent condition of the motion; `swept_A` are the lowest and highest current of tests in which it
    changed, and passed through all between them.
    """
    levels = tested_levels(tested, swept_A)
    some = np.abs(current[:: max(1, current.size // _MAX_SAMPLES)])
    distances = _current_distances(some, levels, changing=swept_A is not None)
    between, beyond = (float(np.sqrt(np.mean(distance**2))) for distance in distances)
    frequency, amplitude = MotionHull.of(tested).nearest(at.frequency_Hz, at.amplitude_m)
    motion = np.hypot(np.log(at.frequency_Hz / frequency), np.log(at.amplitude_m / amplitude))
    return Distance(between, beyond, float(motion))


def tested_levels(tested: Sequence[Condition], swept_A: tuple[float, float] | None) -> Floats:
    """Ascending currents (L,) [A] of tested conditions, or the ends of a current that changed in them."""
    return np.array(sorted({*(swept_A or current_levels([abs(c.current_A) for c in tested]))}))


def shares_between(current: Floats, levels: Floats) -> tuple[Floats, NDArray[np.intp]]:
    """(N,) products of the shares of the distance to the two neighbours, and the index of the upper one."""
    after = np.clip(np.searchsorted(levels, current), 1, levels.size - 1)
    lower, upper = levels[after - 1], levels[after]
    return np.maximum((current - lower) * (upper - current), 0) / (upper - lower) ** 2, after


def _current_distances(current: Floats, levels: Floats, changing: bool) -> tuple[Floats, Floats]:
    """Products of the distances to the two nearest levels, as the first two numbers of `Distance`."""
    largest = float(levels[-1]) or 1.0
    outside = np.maximum(np.maximum(levels[0] - current, current - levels[-1]) / largest - _CURRENT_TOLERANCE, 0)
    if changing:  # a record passes through all currents between its ends
        return np.zeros_like(outside), outside**2
    if levels.size == 1:  # the spacing is the distance of the level from 0 A
        return np.zeros_like(outside), outside * (outside + 1)
    between, after = shares_between(current, levels)
    return between, outside * (outside + (levels[after] - levels[after - 1]) / largest)
