"""Convex hull of the tested motions, and the tested motion nearest to any other.

Between tests a parameter function interpolates; outside them a polynomial in frequency and
amplitude has no support. The dependence on the motion is therefore held constant outside the
hull of the tested motions: the function is evaluated at the nearest motion of the hull, by
distance in log f and log A. Lines of equal f·A are straight there, so the hull bounds the peak
velocity, too, and the projection on a convex set is continuous.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from mrdamper.data.arrays import Floats
from mrdamper.data.conditions import Condition, same_motion

_where: Callable[..., Any] = np.where  # of arrays and of traced numbers
_SLEEK = 0.05  # width of a hull in the logarithm below which it is a segment: tests repeat a motion to some per cent
_ZERO_IN_LOGARITHM = 1e-12  # frequency [Hz] and amplitude [m] that replace zero in the logarithm


@dataclass(frozen=True)
class MotionHull:
    """Convex hull of tested motions over log f and log A."""

    # frequency [Hz] and amplitude [m] of the corners, counter-clockwise; one corner is a single motion, two are a
    # segment
    corners: tuple[tuple[float, float], ...]

    @classmethod
    def of(cls, conditions: Sequence[Condition]) -> MotionHull:
        """Take the hull of the motions of tested conditions; a hull without width becomes a segment or a point."""
        return _hull(tuple(conditions))

    def nearest(self, frequency: Any, amplitude: Any) -> tuple[Any, Any]:
        """Frequency [Hz] and amplitude [m] of the nearest motion of the hull; for arrays and traced numbers."""
        numbers = isinstance(frequency, float) and isinstance(amplitude, float)
        return (_nearest_of_numbers if numbers else _nearest)(self, frequency, amplitude)


def _nearest(hull: MotionHull, frequency: Any, amplitude: Any) -> tuple[Any, Any]:
    if len(hull.corners) == 1:
        return hull.corners[0]
    u, w = (np.log(np.maximum(value, _ZERO_IN_LOGARITHM)) for value in (frequency, amplitude))
    corners = np.log(hull.corners)
    inside: Any = None
    nearest: tuple[Any, Any, Any] | None = None
    count = len(corners)
    for i in range(count if count > 2 else 1):
        (u0, w0), (u1, w1) = corners[i].tolist(), corners[(i + 1) % count].tolist()
        du, dw = u1 - u0, w1 - w0
        left = du * (w - w0) - dw * (u - u0) >= 0
        inside = left if inside is None else inside & left
        share = np.clip(((u - u0) * du + (w - w0) * dw) / (du**2 + dw**2), 0.0, 1.0)
        at, up = u0 + share * du, w0 + share * dw
        distance = (u - at) * (u - at) + (w - up) * (w - up)
        if nearest is None:
            nearest = distance, at, up
            continue
        closer = distance < nearest[0]
        nearest = tuple(np.where(closer, a, b) for a, b in zip((distance, at, up), nearest, strict=True))  # type: ignore[assignment]
    assert nearest is not None
    f, A = np.exp(nearest[1]), np.exp(nearest[2])
    if count == 2:
        return f, A
    return _where(inside, frequency, f), _where(inside, amplitude, A)


# Dampers of many models are made from the same tests, and predict the same runs.
_nearest_of_numbers = lru_cache(maxsize=4096)(_nearest)


@lru_cache(maxsize=256)
def _hull(conditions: tuple[Condition, ...]) -> MotionHull:
    points = np.log([(c.frequency_Hz, c.amplitude_m) for c in conditions])
    groups = same_motion(conditions, _SLEEK)
    centres = np.array([points[group].mean(axis=0) for group in groups])
    middle = centres.mean(axis=0)
    axes = np.linalg.svd(centres - middle, full_matrices=True)[2]
    along = (centres - middle) @ axes.T
    if np.ptp(along[:, 0]) < _SLEEK:
        return MotionHull((_motion(middle),))
    if np.ptp(along[:, 1]) < _SLEEK:
        ends = middle + np.outer([along[:, 0].min(), along[:, 0].max()], axes[0])
        return MotionHull(tuple(_motion(end) for end in ends))
    return MotionHull(tuple(_motion(corner) for corner in _convex(centres)))


def _motion(point: Floats) -> tuple[float, float]:
    frequency, amplitude = np.exp(point).tolist()
    return float(frequency), float(amplitude)


def _convex(points: Floats) -> Floats:
    """Corners of the convex hull of points in the plane, counter-clockwise [Andrew 1979]."""
    ordered = points[np.lexsort(points.T[::-1])]

    def chain(row: Floats) -> list[Floats]:
        corners: list[Floats] = []
        for point in row:
            while len(corners) > 1 and _turn(corners[-2], corners[-1], point) <= 0:
                corners.pop()
            corners.append(point)
        return corners[:-1]

    return np.array([*chain(ordered), *chain(ordered[::-1])])


def _turn(a: Floats, b: Floats, c: Floats) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
