"""`integrate` for one sample: the same linearly implicit steps, written on a tape.

The sample interval is divided into at most a fixed number of steps whose error is estimated and kept below the
tolerance; a guard refuses an incomplete interval.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mrdamper.tracing import Tape
from mrdamper.tracing.tangent import derivatives

Rate = Callable[[Any, Any, Any, Any, Any, Any], None]
MOST_STEPS = 400  # steps between two samples; few are usual
_AHEAD = 1e-5  # of a step, for the derivative by time


class _Columns(list[Any]):
    """States by column, for `state[:, j]`."""

    def __getitem__(self, index: Any) -> Any:
        return super().__getitem__(index[1] if hasattr(index, "__len__") else index)


def integrate_step(
    tape: Tape,
    rate: Rate,
    parameters: Sequence[Any],
    motion: tuple[Any, Any, Any, Any],
    start: Sequence[float],
    scale: Sequence[Any],
    *,
    tolerance: Any = 1e-5,
    most: int = MOST_STEPS,
) -> Any:
    """States after one sample, from those before, in at most `most` steps."""
    held = [tape.remember(f"state{i}", value) for i, value in enumerate(start)]
    size = tape.remember("substep", 1.0)
    time, *channels = motion
    width = tape.select(tape.first, 1.0, time.step)  # the first sample has no interval, and its steps are not used
    ends = [(tape.previous(channel, name), channel) for channel, name in zip(channels, "xvi", strict=True)]
    between = _between(ends, width)

    def slopes(t: Any, y: Sequence[Any]) -> list[Any]:
        out: list[Any] = [0.0] * len(y)
        rate(*between(t), y, parameters, out)
        return out

    def advance(done: Any, share: Any, *y: Any) -> tuple[Any, list[Any]]:
        h = np.minimum(share * width, width - done)
        new, worst = _rodas3(tape, slopes, done, h, y, scale, tolerance)
        good = worst <= 1.0
        factor = np.minimum(5.0, np.maximum(0.1, 0.9 * np.maximum(worst, 1e-6) ** (-1 / 3)))
        after = tape.select(good, done + h, done)
        kept = [tape.select(good, n, o) for n, o in zip(new, y, strict=True)]
        next_share = np.minimum(tape.select(worst < 1e9, h * factor, h * 0.1) / width, 1.0)
        return after < width * (1 - 1e-12), [after, next_share, *kept]

    walked, share, *reached = tape.loop([0.0, tape.apply("maximum", size, 1e-3), *held], advance, most, still=2)
    later = [tape.select(tape.first, h, r) for h, r in zip(held, reached, strict=True)]
    for memory, value in zip((*held, size), (*later, tape.select(tape.first, size, share)), strict=True):
        tape.update(memory, value)
    tape.require(tape.first | (walked >= width * (1 - 1e-12)))
    return _Columns(later)


def _between(ends: Sequence[tuple[Any, Any]], width: Any) -> Callable[[Any], tuple[Any, Any, Any]]:
    """Displacement, velocity and current between two samples: a cubic, its slope, a straight line."""
    (x0, x1), (v0, v1), (i0, i1) = ends
    rate = 1 / width
    mean = (x1 - x0) * rate
    square, cube = 3 * mean - 2 * v0 - v1, v0 + v1 - 2 * mean

    def at(t: Any) -> tuple[Any, Any, Any]:
        s = t * rate
        x = x0 + t * (v0 + s * (square + s * cube))
        return x, v0 + s * (2 * square + 3 * s * cube), i0 + s * (i1 - i0)

    return at


def _rodas3(
    tape: Tape,
    slopes: Callable[[Any, Sequence[Any]], list[Any]],
    t: Any,
    h: Any,
    y: Sequence[Any],
    scale: Sequence[Any],
    tolerance: Any,
) -> tuple[list[Any], Any]:
    """One step, and its error over the tolerance. [Sandu et al. 1997]

    A step may not change a state by more than itself, because the method could step over a pole. The derivative by time
    is a forward difference, because a step often begins at a reversal, where the rate is not smooth.
    """
    order = range(len(y))
    f = slopes(t, y)
    columns = [derivatives(tape, f, state) for state in y]
    later = slopes(t + _AHEAD * h, y)
    slope = [(later[i] - f[i]) * (1 / _AHEAD) for i in order]
    rate = 1 / h
    solve = _solver([[column[i] for column in columns] for i in order], rate)
    k0 = solve([f[i] + 0.5 * slope[i] for i in order])
    k1 = solve([f[i] + 4 * rate * k0[i] + 1.5 * slope[i] for i in order])
    here = [y[i] + 2 * k0[i] for i in order]
    f2 = slopes(t + h, here)
    k2 = solve([f2[i] + (k0[i] - k1[i]) * rate for i in order])
    here = [here[i] + k2[i] for i in order]
    f3 = slopes(t + h, here)
    k3 = solve([f3[i] + (k0[i] - k1[i] - 8 / 3 * k2[i]) * rate for i in order])
    new = [here[i] + k3[i] for i in order]
    worst: Any = 0.0
    for i in order:
        size = 1 / np.maximum(abs(y[i]), scale[i])
        error = np.maximum(abs(k3[i]) * (1 / tolerance), abs(new[i] - y[i])) * size
        worst = error if isinstance(worst, float) else np.maximum(worst, error)
    # Comparisons with NaN are false: such a step is rejected.
    return new, worst


def _solver(jacobian: list[list[Any]], rate: Any) -> Callable[[list[Any]], list[Any]]:
    """Solutions of (2 rate − J) k = right, by Cramer's rule: models have few states."""
    size = len(jacobian)
    matrix = [[2 * rate - value if i == j else -value for j, value in enumerate(row)] for i, row in enumerate(jacobian)]
    if size == 1:
        inverse = 1 / matrix[0][0]
        return lambda right: [right[0] * inverse]
    order = tuple(range(size))
    cofactors = [
        [(-1) ** (i + j) * _determinant(matrix, _without(order, i), _without(order, j)) for j in order] for i in order
    ]
    inverse = 1 / _sum([matrix[0][j] * cofactors[0][j] for j in order])
    return lambda right: [_sum([cofactors[i][j] * right[i] for i in order]) * inverse for j in order]


def _determinant(matrix: list[list[Any]], rows: tuple[int, ...], columns: tuple[int, ...]) -> Any:
    if len(rows) == 1:
        return matrix[rows[0]][columns[0]]
    first, rest = rows[0], rows[1:]
    return _sum(
        [(-1) ** i * matrix[first][j] * _determinant(matrix, rest, _without(columns, j)) for i, j in enumerate(columns)]
    )


def _without(places: tuple[int, ...], left_out: int) -> tuple[int, ...]:
    return tuple(place for place in places if place != left_out)


def _sum(terms: list[Any]) -> Any:
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total
