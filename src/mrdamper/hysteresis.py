"""Exact Bouc–Wen hysteresis: no differential equation is solved.

Between two velocity reversals the hysteretic displacement depends on the distance travelled
only, and has a closed form. `follow` walks a measured motion stroke by stroke, `step` one
sample, `steady_peak` and its companions give the closed loop under a sine.

Everything is in the normal form ζ = z/z_max, in which the redundant scale of A, alpha, beta
and gamma is gone: κ = A/z_max [1/m], ρ = (γ − β)/(γ + β), n. Here β multiplies |v| and γ
multiplies v. [Bouc 1967; Wen 1976; Ikhouane and Rodellar 2007; closed forms derived]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mrdamper.data import Floats
from mrdamper.errors import ParameterError
from mrdamper.master_curve import curve, inverse


@dataclass(frozen=True, eq=False)
class Shape:
    """Shape of a Bouc–Wen loop without its force scale.

    Attributes
    ----------
    kappa : float or (P,) array
        1/kappa is the yield displacement [1/m].
    rho : float or (P,) array
        (γ − β)/(γ + β), at most 1; 0 for γ = β, −1 for γ = 0.
    n : float
        Sharpness of the yield, at least 1.
    """

    kappa: Floats | float
    rho: Floats | float = 0.0
    n: float = 2.0

    def __post_init__(self) -> None:
        if not (np.all(np.asarray(self.kappa) > 0) and np.all(np.isfinite(self.kappa))):
            raise ParameterError(f"kappa is {self.kappa}", mend="it is positive: beta + gamma > 0")
        if not np.all(np.asarray(self.rho) <= 1):
            raise ParameterError(f"rho is {self.rho}", mend="it is at most 1: beta is not negative")
        if not self.n >= 1:
            raise ParameterError(f"n is {self.n}", mend="it is 1 or more")

    @classmethod
    def from_bouc_wen(cls, beta: float, gamma: float, n: float = 2.0, A: float = 1.0) -> Shape:
        """The shape of dz/dt = A v − β |v| |z|^(n−1) z − γ v |z|^n.

        Raises
        ------
        ParameterError
            If A ≤ 0, β < 0 or β + γ ≤ 0: such loops create energy or do not close.
        """
        if A <= 0 or beta < 0 or beta + gamma <= 0:
            raise ParameterError(
                f"A = {A:g}, beta = {beta:g}, gamma = {gamma:g}", mend="A > 0, beta ≥ 0 and beta + gamma > 0 dissipate"
            )
        return cls(A / largest_z(beta, gamma, n, A), (gamma - beta) / (gamma + beta), n)

    def to_bouc_wen(self, A: float = 1.0) -> tuple[float, float]:
        """β and γ [m⁻ⁿ for A = 1] of this shape."""
        total = A * (self.kappa / A) ** self.n
        return float(total * (1 - self.rho) / 2), float(total * (1 + self.rho) / 2)

    @property
    def yield_displacement(self) -> float:
        """1/κ [m]."""
        return 1.0 / self.kappa  # type: ignore[return-value]


def largest_z(beta: float, gamma: float, n: float, A: float = 1.0) -> float:
    """z_max = (A/(β + γ))^(1/n) [m for dimensionless A]."""
    return (A / (beta + gamma)) ** (1.0 / n)


def normal_form(A: float, beta: float, gamma: float, n: float) -> tuple[float, float, float]:
    """(z_max, ρ, σ) with dw/dt = ρ (v − σ |v| |w|^(n−1) w + (σ − 1) v |w|^n), w = z/z_max.

    [Ikhouane and Rodellar 2007]
    """
    z_max = largest_z(beta, gamma, n, A)
    return z_max, A / z_max, beta / (beta + gamma)


@dataclass(frozen=True, eq=False)
class Path:
    """A sampled motion cut into strokes, each one way between two reversals.

    Attributes
    ----------
    stroke : (N,) integer array
        Stroke each sample belongs to.
    distance : (N,) array
        Way from the stroke's start to the sample [m].
    direction, length : (S,) arrays
        +1 or −1; way from the stroke's start to its end [m].
    """

    stroke: NDArray[np.intp]
    distance: Floats
    direction: Floats
    length: Floats

    @classmethod
    def of(cls, displacement: ArrayLike, peaks: Literal["parabola", "samples"] = "parabola") -> Path:
        """Cut a motion into strokes.

        Parameters
        ----------
        displacement : (N,) array
            [m]
        peaks : "parabola" or "samples"
            Reversals lie between samples. A parabola through the three samples around each
            finds the missed peak; on a smooth motion this cuts the error a thousandfold and
            more. It never adds more than an eighth of the longer neighbouring step.
        """
        x = np.asarray(displacement, dtype=float)
        moves = np.flatnonzero(np.diff(x)) + 1  # first sample of each new value
        kept = np.concatenate([[0], moves])
        values = x[kept]
        steps = np.diff(values)
        if steps.size == 0:
            return cls(np.zeros(x.size, dtype=np.intp), np.zeros(x.size), np.ones(1), np.zeros(1))
        turning = np.flatnonzero(steps[1:] * steps[:-1] < 0) + 1  # indices into values
        peak = values[turning]
        starts_at = kept[turning] + 1  # first sample of the stroke after each reversal
        if peaks == "parabola":
            before, after = steps[turning - 1], steps[turning]
            dwell = kept[np.minimum(turning + 1, kept.size - 1)] - kept[turning]
            single, double = dwell == 1, dwell == 2
            # Vertex of the parabola through three samples; through the middle of two equal ones.
            lift = (before + after) ** 2 / (8 * (before - after)) * single + (before - after) / 16 * double
            peak = peak + lift
            # A vertex ahead of its sample hands the sample to the next stroke.
            starts_at -= single & (np.abs(before) < np.abs(after))
        stroke = np.zeros(x.size, dtype=np.intp)
        np.add.at(stroke, starts_at, 1)
        stroke = np.cumsum(stroke)
        direction = np.sign(steps[0]) * (-1.0) ** np.arange(turning.size + 1)
        origin = np.concatenate([[x[0]], peak])
        ends = np.concatenate([peak, [x[-1]]])
        distance = direction[stroke] * (x - origin[stroke])
        return cls(stroke, np.maximum(distance, 0.0), direction, direction * (ends - origin))


def follow(shape: Shape, path: Path, zeta0: float = 0.0) -> Floats:
    """ζ along a motion, exact for motion monotone between reversals.

    Parameters
    ----------
    shape : Shape
        One shape, or P at once.
    path : Path
    zeta0 : float
        Start value, |ζ| ≤ 1.

    Returns
    -------
    (N,) array, or (P, N) for P shapes
    """
    kappa, rho = np.broadcast_arrays(np.atleast_1d(shape.kappa), np.atleast_1d(shape.rho))
    starts = np.empty((kappa.size, path.direction.size))
    if kappa.size == 1 and shape.n in (1, 2):
        starts[0] = _chain(float(kappa[0]), float(rho[0]), int(shape.n), path, zeta0)
    else:
        w = np.full(kappa.size, path.direction[0] * zeta0)
        for i, length in enumerate(path.length):
            starts[:, i] = inverse(w, rho, shape.n)
            w = -curve(starts[:, i] + kappa * length, rho, shape.n)
    phi = starts[:, path.stroke] + kappa[:, None] * path.distance
    zeta = path.direction[path.stroke] * curve(phi, rho[:, None], shape.n)
    return zeta if np.ndim(shape.kappa) or np.ndim(shape.rho) else zeta[0]


def _chain(kappa: float, rho: float, n: int, path: Path, zeta0: float) -> list[float]:
    """φ at the start of every stroke: the only sequential part, so in plain floats."""
    w, starts = float(path.direction[0]) * zeta0, []
    for length in path.length.tolist():
        phi = _scalar_inverse(w, rho, n)
        starts.append(phi)
        w = -_scalar_curve(phi + kappa * length, rho, n)
    return starts


def step(shape: Shape, zeta: float, dx: float) -> float:
    """ζ after a monotone move dx [m] from ζ: exact, for streaming."""
    if dx == 0.0:
        return zeta
    q = 1.0 if dx > 0 else -1.0
    kappa, rho, n = float(shape.kappa), float(shape.rho), shape.n
    if n in (1, 2):
        return q * _scalar_curve(_scalar_inverse(q * zeta, rho, int(n)) + kappa * abs(dx), rho, int(n))
    return q * float(stroke(shape, q * zeta, abs(dx)))


def stroke(shape: Shape, zeta0: ArrayLike, distance: ArrayLike) -> Floats:
    """ζ·sgn(v) after a monotone way, from its value at the start; elementwise.

    Values above 1, from outside the loop, decay towards 1 (n = 1 and 2 only).

    Raises
    ------
    ParameterError
        If a start value lies above 1 and n is neither 1 nor 2.
    """
    w, u = np.broadcast_arrays(np.asarray(zeta0, dtype=float), shape.kappa * np.asarray(distance, dtype=float))
    result = curve(inverse(np.minimum(w, 1.0), shape.rho, shape.n) + u, shape.rho, shape.n)
    outside = w > 1
    if np.any(outside):
        if shape.n not in (1, 2):
            raise ParameterError("a start value above z_max", mend="start inside the loop, or use n = 1 or 2")
        high, way = w[outside], u[outside]
        decayed = 1 + (high - 1) * np.exp(-way) if shape.n == 1 else 1 / np.tanh(way + np.arctanh(1 / high))
        result = np.array(result)
        result[outside] = decayed
    return result


def _scalar_curve(phi: float, rho: float, n: int) -> float:
    if phi >= 0:
        return -math.expm1(-phi) if n == 1 else math.tanh(phi)
    if abs(rho) < 1e-8:
        return phi
    if n == 1:
        return math.expm1(rho * phi) / rho
    root = math.sqrt(abs(rho))
    return (math.tanh(root * phi) if rho > 0 else math.tan(max(root * phi, -1.5707))) / root


def _scalar_inverse(zeta: float, rho: float, n: int) -> float:
    if zeta >= 1:
        return math.inf
    if zeta >= 0:
        return -math.log1p(-zeta) if n == 1 else math.atanh(zeta)
    if abs(rho) < 1e-8:
        return zeta
    if n == 1:
        return math.log1p(rho * zeta) / rho if rho * zeta > -1 else -math.inf
    root = math.sqrt(abs(rho))
    if rho > 0:
        return math.atanh(root * zeta) / root if root * zeta > -1 else -math.inf
    return math.atan(root * zeta) / root


def stability_class(A: float, beta: float, gamma: float) -> str:
    """Class I–V of bounded-input bounded-output stability, "unstable" where there is none.

    [Ikhouane and Rodellar 2007, recalled and re-derived] Class II holds for |z(0)| up to
    (A/(γ − β))^(1/n), class IV for |z(0)| ≤ z_max.
    """
    plus, minus = beta + gamma, beta - gamma
    if A > 0 and plus > 0:
        return "I" if minus >= 0 else "II" if beta >= 0 else "unstable"
    if A < 0 and minus > 0:
        return "III" if plus >= 0 else "IV" if beta >= 0 else "unstable"
    if A == 0 and plus > 0 and minus >= 0:
        return "V"
    return "unstable"


def dissipates(A: float, beta: float, gamma: float) -> bool:
    """Whether no motion takes energy out of the element: A > 0, β ≥ 0, β + γ > 0 (derived).

    β ≥ |γ|, often stated, is sufficient and not necessary.
    """
    return A > 0 and beta >= 0 and beta + gamma > 0
