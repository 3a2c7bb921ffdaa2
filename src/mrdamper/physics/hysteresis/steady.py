"""The steady loop of a sine: its curve and its harmonics."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from mrdamper.data import Floats
from mrdamper.errors import ExcitationError
from mrdamper.physics.hysteresis.master_curve import SATURATED, MasterCurve, gauss_legendre, master_curve
from mrdamper.physics.hysteresis.response import on_curve
from mrdamper.physics.hysteresis.shape import Shape
from mrdamper.physics.motion.path import memoize_per_path


def steady_loop(shape: Shape, amplitude: float, theta: ArrayLike) -> Floats:
    """State on the steady loop of x = amplitude · sin(theta).

    `shape`: one shape, or P of them; `amplitude` [m]; `theta` (N,): phase [rad]. Returns (N,) array, or (P, N): zeta
    [-].
    """
    sign, share = _half_cycles(np.asarray(theta, dtype=float))
    loops = list(_loops(shape, amplitude))
    if not shape.is_many:
        return sign * loops[0].loading(share)
    forces = np.empty((len(loops), share.size))
    for rho in dict.fromkeys(loop.rho for loop in loops):  # alike: one curve for all of their samples
        alike = [i for i, loop in enumerate(loops) if loop.rho == rho]
        reach, to_zero = np.array([(loops[i].reach, loops[i].to_zero) for i in alike]).T[:, :, None]
        phi = 2 * reach * share - to_zero
        forces[alike] = on_curve(loops[alike[0]].curve, rho, phi.ravel()).reshape(phi.shape)
    return sign * forces


def loop_harmonics(shape: Shape, amplitude: float, orders: Sequence[int] = (1, 3, 5, 7)) -> tuple[Floats, Floats]:
    """Fourier coefficients of the steady loop of one shape, zeta = Σ_k sine_k sin(k theta) + cosine_k cos(k theta).

    `amplitude` of x = amplitude · sin(theta) [m]; `orders` k >= 1 (K,), even ones are zero. Returns sine and cosine
    (K,) [-], to 1e-13 for n = 1 and 2. The first cosine is the area ∮ zeta dx over π · amplitude.
    """
    return next(_loops(shape, amplitude)).harmonics(np.asarray(orders))


@dataclass(frozen=True)
class _SteadyLoop:
    """The loading half of the loop of one shape, from −Z to Z."""

    curve: MasterCurve
    rho: float
    reach: float  # kappa · amplitude: amplitude in yield displacements
    saturation: float  # r = −ln(1 − Z), accurate where Z is 1 to rounding

    @classmethod
    def of(cls, kappa: float, rho: float, n: float, amplitude: float) -> Self:
        """Solve for the peak.

        Distance −Z → 0 plus distance 0 → Z is the stroke. Both are concave in r, so Newton steps from the left do not
        overshoot, and no bracket is needed.
        """
        if not (amplitude > 0 and math.isfinite(amplitude)):
            raise ExcitationError(f"the amplitude is {amplitude:g} m", remedy="give a positive amplitude")
        curve, reach = master_curve(n), kappa * amplitude
        r = reach  # the first step from r = 0
        for _ in range(100):
            miss = 2 * reach - curve.climb_distance(r) - _to_zero(curve, rho, r)
            gap = math.exp(-min(r, SATURATED))
            rate = -math.expm1(n * math.log1p(-gap)) / gap if gap < 1 else 1.0  # `approach_rate` of one number
            step = miss / (1 / rate + gap / ((1 - rho) + rho * gap * rate))
            r += max(step, 0.0)
            if step <= 4e-16 * r:
                break
        return cls(curve, rho, reach, r)

    @cached_property
    def to_zero(self) -> float:
        """Distance from the reversal to zeta = 0 [yield displacements]."""
        return _to_zero(self.curve, self.rho, self.saturation)

    def loading(self, share: Floats) -> Floats:
        """State at shares of the stroke after the lower reversal."""
        return on_curve(self.curve, self.rho, 2 * self.reach * share - self.to_zero)

    def harmonics(self, orders: np.ndarray) -> tuple[Floats, Floats]:
        """Fourier coefficients, by Gauss points on parts of the phase on which the loop is smooth.

        The parts are short where the curvature is large: after the reversal, about zeta = 0, where a power n loses its
        higher derivatives, and in the approach to saturation.
        """
        distance = np.concatenate([self.to_zero * _RELEASE_PIECES, self.to_zero + _CLIMB_PIECES])
        share = np.clip(np.append(distance, 2 * self.reach) / (2 * self.reach), 0.0, 1.0)
        share[-1] = 1.0
        phase, weight = _gauss_points(2 * np.arcsin(np.sqrt(share)), 16 + int(orders.max(initial=1)))
        loading = self.loading(_share_of_stroke(phase))
        angle = np.multiply.outer(orders, phase - np.pi / 2)
        odd = np.where(orders % 2, 2 / np.pi, 0.0)
        return odd * (np.sin(angle) @ (weight * loading)), odd * (np.cos(angle) @ (weight * loading))


@memoize_per_path
def _half_cycles(theta: Floats) -> Floats:
    """(2, N) direction of the motion at phases of a sine, and the share of the stroke behind."""
    half_cycle, since_reversal = np.divmod(theta + np.pi / 2, np.pi)
    return np.stack([1.0 - 2.0 * (half_cycle % 2), _share_of_stroke(since_reversal)])


def _share_of_stroke(since_reversal: Floats) -> Floats:
    """Share of the stroke behind at phases 0...pi after a reversal: (1 − cos)/2 without its cancellation."""
    return np.sin(since_reversal / 2) ** 2


def _to_zero(curve: MasterCurve, rho: float, r: float) -> float:
    # An elastic spring (rho = 1) is reversible; the logarithm is inaccurate near Z = 1.
    return curve.climb_distance(r) if rho == 1 else curve.release_distance(-math.expm1(-r), rho, math)


# Ends of the pieces that Gauss points are put on. Each is short against the distance to the
# nearest singularity of what is integrated.
_RELEASE_PIECES = np.array([0, 1e-3, 0.01, 0.03, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99, 0.9999, 1])
_CLIMB_PIECES = np.array([1e-4, 0.01, 0.1, 0.25, 0.5, 1, 1.5, 2, 4, 8, 16, 40])


def _gauss_points(ends: Floats, points: int = 16) -> tuple[Floats, Floats]:
    """Nodes and weights of Gauss–Legendre rules on consecutive pieces."""
    node, weight = gauss_legendre(points)
    half = 0.5 * np.diff(ends)[:, None]
    return (ends[:-1, None] + half * (1 + node)).ravel(), (half * weight).ravel()


def _loops(shape: Shape, amplitude: float) -> Iterator[_SteadyLoop]:
    for kappa, rho in np.broadcast(shape.kappa, shape.rho):
        yield _SteadyLoop.of(float(kappa), float(rho), shape.n, float(amplitude))
