"""The hysteretic state along a motion."""

from __future__ import annotations

import math
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mrdamper.data.arrays import Floats
from mrdamper.errors import ParameterError
from mrdamper.physics.hysteresis.master_curve import MasterCurve, master_curve
from mrdamper.physics.hysteresis.shape import Shape
from mrdamper.physics.motion.path import Path
from mrdamper.tracing import Tape, choose, streamed

_BLOCK = 20_000  # samples whose states are computed at a time, with their slopes


def follow_step(tape: Tape, shape: Shape, path: Any, zeta0: ArrayLike = 0.0) -> Any:
    """`follow` for one sample."""
    zeta = tape.remember("zeta", float(zeta0))  # type: ignore[arg-type]
    turned = zeta
    for turn in path.turns:
        turned = choose(turn == 0.0, lambda held=turned: held, lambda held=turned, dx=turn: step(shape, held, dx))
    reached = step(shape, turned, path.step)
    tape.update(zeta, reached)
    return reached


@streamed(follow_step)
def follow(shape: Shape, path: Path, zeta0: float = 0.0) -> Floats:
    """(N,) hysteretic state z/z_max [-] of one shape along a motion, from the state zeta0 before its first sample.

    Exact for any motion that is monotone between its samples and reversals; the sampling has no effect. Accurate to
    1e-12 for n = 1 and 2, to 1e-8 for other n. Raises `ParameterError` if that state lies beyond ±1 by more than that.
    """
    if not abs(zeta0) <= 1 + 1e-8:
        raise ParameterError(f"the state starts at {zeta0:g} z_max", remedy="start within ±z_max")
    return follow_one(float(shape.kappa), float(shape.rho), shape.n, path, zeta0=min(max(float(zeta0), -1.0), 1.0))


def step(shape: Shape, zeta: Any, dx: Any) -> Any:
    """State [z_max] after a monotone displacement dx [m] from the state zeta [z_max]: `follow` for one number.

    Plain or traced, without checks of the start.
    """
    curve, back = master_curve(shape.n), dx < 0
    xp = math if isinstance(back, bool) else np
    w = choose(back, lambda: -zeta, lambda: zeta)
    reached = advance(curve, shape.rho, w, shape.kappa * abs(dx), xp)
    return choose(back, lambda: -reached, lambda: reached)


def follow_one(kappa: float, rho: float, n: float, path: Path, part: slice = slice(None), zeta0: float = 0.0) -> Floats:
    """States of one shape at a part of the samples, without checks, for inner loops.

    Only the states at reversals are sequential: plain floats there, arrays for the samples.
    """
    curve = master_curve(n)
    starts = np.array(starts_of_strokes(curve, kappa, rho, path, path.first_direction * zeta0))
    along = state_at(curve, rho, starts, path.stroke[part], kappa * path.distance[part])
    return np.multiply(path.direction[part], along, out=along)


def starts_of_strokes(curve: MasterCurve, kappa: float, rho: float, path: Path, w: float) -> list[float]:
    """State at the beginning of every stroke, in its direction, from that of the first on."""
    starts = [w]
    full = (curve.release_distance(1.0, rho, math) + curve.full) / kappa
    for length in path.lengths:
        if w != -1.0 or length < full:  # otherwise the stroke saturates
            w = -advance(curve, rho, w, kappa * length)
        starts.append(w)
    return starts


def on_curve(curve: MasterCurve, rho: float, phi: Floats) -> Floats:
    """State at signed distances phi [yield displacements] past zero."""
    with np.errstate(over="ignore"):  # far before zero; replaced below
        w = curve.rise(phi, np)
    releasing = phi < 0
    if rho == 0:  # a straight line, whatever the curve
        np.copyto(w, phi, where=releasing)
    elif (rows := releasing.nonzero()[0]).size:
        w[rows] = -curve.release(-phi[rows], rho, np)
    return w


def state_at(curve: MasterCurve, rho: float, starts: Floats, stroke: np.ndarray | slice, phi: Floats) -> Floats:
    """State in the direction of motion after phi, for samples whose stroke began at `starts[stroke]`.

    All but the states that already point along the motion are on one curve through zero.
    """
    to_zero = curve.release_distance(np.maximum(-starts, 0.0), rho, np)
    w = on_curve(curve, rho, phi - to_zero[stroke])
    ahead = starts > 0
    if ahead.any():
        climbing = ahead[stroke]
        w[climbing] = curve.climb(starts[stroke][climbing], phi[climbing], np)
    return w


def advance(curve: MasterCurve, rho: Any, w: Any, phi: Any, xp: ModuleType = math) -> Any:
    """One stroke of one number."""

    def released() -> Any:
        to_zero = curve.release_distance(-w, rho, xp)
        return choose(
            phi < to_zero,
            lambda: -curve.release(to_zero - phi, rho, xp),
            lambda: curve.rise(phi - to_zero, xp),
        )

    return choose(w < 0, released, lambda: curve.climb(w, phi, xp))


def follow_with_slope(kappa: float, rho: float, n: float, path: Path, part: slice) -> tuple[Floats, Floats]:
    """States as `follow_one`, and their derivative with respect to ln kappa.

    Along a stroke the state is a function of kappa times the distance, shifted by where the stroke
    began; so its derivative is the rate there times that distance and the derivative of the shift.
    """
    curve = master_curve(n)
    w, slope = 0.0, 0.0
    starts, shifts = [0.0], [0.0]
    full = (curve.release_distance(1.0, rho, math) + curve.full) / kappa
    for length in path.lengths:
        if w == -1.0 and length >= full:
            slope = 0.0
        else:
            end = advance(curve, rho, w, kappa * length)
            slope = -_rate(end, rho, n) * (kappa * length + shifts[-1])
            w = -end
        starts.append(w)
        shifts.append(slope / _rate(w, rho, n) if slope else 0.0)
    strokes, distances, directions = path.stroke[part], path.distance[part], path.direction[part]
    first, later = np.array(starts), np.array(shifts)
    states, slopes = np.empty((2, distances.size))
    for begin in range(0, distances.size, _BLOCK):  # of which all arrays stay in the processor's cache
        rows = slice(begin, begin + _BLOCK)
        stroke, phi, direction = strokes[rows], kappa * distances[rows], directions[rows]
        state = state_at(curve, rho, first, stroke, phi)
        size = np.abs(state)
        rate = 1.0 - (size if n == 1 else size * size if n == 2 else size**n)
        if rho != 1.0:
            before = np.flatnonzero(state < 0)
            rate[before] = (1.0 - rho) + rho * rate[before]
        states[rows], slopes[rows] = direction * state, direction * (rate * (phi + later[stroke]))
    return states, slopes


def _rate(w: float, rho: float, n: float) -> float:
    return 1.0 - w**n if w >= 0 else 1.0 - rho * (-w) ** n


def follow_alike(n: float, rho: float, kappa: Floats, path: Path) -> Floats:
    """(P, N) states from zero for P shapes that differ in kappa only, all at once."""
    curve = master_curve(n)
    starts = _starts(n, rho, kappa, path)
    to_zero = np.where(starts < 0, curve.release_distance(np.maximum(-starts, 0.0), rho, np), 0.0)
    phi = np.multiply.outer(kappa, path.distance)
    past = (phi - to_zero[:, path.stroke]).ravel()
    w = on_curve(curve, rho, past).reshape(phi.shape)
    if (starts > 0).any():
        ahead = np.maximum(starts, 0.0)[:, path.stroke]
        w = np.where(ahead > 0, curve.climb(ahead.ravel(), phi.ravel(), np).reshape(phi.shape), w)
    w *= path.direction
    return w


def _starts(n: float, rho: float, kappa: Floats, path: Path) -> Floats:
    """(P, K) state in the direction of motion at the beginning of each stroke."""
    curve = master_curve(n)
    starts = np.full((kappa.size, len(path.lengths) + 1), -1.0)
    starts[:, 0] = 0.0
    lengths = np.array(path.lengths)
    if not lengths.size:
        return starts
    # Shapes that saturate in every stroke need no recursion.
    full = curve.release_distance(1.0, rho, math) + curve.full
    stepped = np.flatnonzero(kappa * lengths.min() < full)
    kappa, w = kappa[stepped], np.zeros(stepped.size)
    for k, length in enumerate(path.lengths if stepped.size else (), 1):
        past = kappa * length - curve.release_distance(np.maximum(-w, 0.0), rho, np)
        end = curve.climb(np.maximum(w, 0.0), np.maximum(past, 0.0), np)
        turned = past < 0
        if turned.any():
            end[turned] = -curve.release(-past[turned], rho, np)
        w = starts[stepped, k] = -end
    return starts
