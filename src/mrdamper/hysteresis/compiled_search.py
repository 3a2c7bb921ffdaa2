"""Search of the one length of a hysteresis, everything else eliminated, in machine code.

The same steps as the NumPy search takes: the columns that stay are orthogonalised, a grid of
lengths finds the valley, and a secant on the gradient finds its bottom. What a step needs of
the samples are a dozen sums. Importing this module imports numba.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Self

import numpy as np

from mrdamper.data import Floats
from mrdamper.hysteresis.compiled import CUT, Strokes, cut, fill
from mrdamper.hysteresis.compiled_batch import add_products, dot
from mrdamper.hysteresis.compiled_options import inner, kernel
from mrdamper.hysteresis.compiled_tables import curve_of
from mrdamper.motion import Path

FOUND, AT_END, STEPS_SPENT, GENERAL_WAY = 0, 1, 2, 3
MESSAGES = {
    FOUND: "converged: the cost changes no more",
    AT_END: "every coordinate ended at a bound",
    STEPS_SPENT: "stopped after 40 steps; the cost was still falling: start nearer",
}
_WORTH_THREADS = 4_000_000  # samples × evaluations: about 10 ms, below which threads cost more than they gain


@dataclass(frozen=True, eq=False)
class LengthSearch:
    """One condition to be searched; make it with `LengthSearch.of`.

    Attributes
    ----------
    strokes : Strokes
        N samples.
    columns : (L, M) array
        Columns that stay, at the last M samples.
    force : (M,) array
        [N]
    rho, n : float
        Of the shape.
    grid : (G,) array
        Logarithms of the yield displacements to begin from.
    bounds : (float, float)
        Of that logarithm.
    lower, upper : (L+1,) arrays
        Bounds of the coefficients, that of the state last.
    grid_stroke : int
        First stroke of the end of the motion that the grid is tried on.
    """

    strokes: Strokes
    columns: Floats
    force: Floats
    rho: float
    n: float
    grid: Floats
    bounds: tuple[float, float]
    lower: Floats
    upper: Floats
    grid_stroke: int

    @classmethod
    def of(
        cls,
        path: Path,
        columns: Floats,
        force: Floats,
        *,
        grid: Floats,
        bounds: tuple[float, float],
        lower: Floats,
        upper: Floats,
        rho: float = 0.0,
        n: float = 2.0,
        grid_samples: int = 1500,
    ) -> Self:
        """Take (M, L) columns and an (M,) force at the last M samples of a path; the rest as the attributes."""
        strokes = Strokes.of(path)
        led = int(np.searchsorted(strokes.begin, max(0, len(path) - grid_samples), side="right")) - 1
        return cls(
            strokes,
            np.ascontiguousarray(columns.T),
            np.ascontiguousarray(force),
            float(rho),
            float(n),
            np.ascontiguousarray(grid, dtype=float),
            bounds,
            np.ascontiguousarray(lower, dtype=float),
            np.ascontiguousarray(upper, dtype=float),
            max(led, 0),
        )


@dataclass(frozen=True)
class LengthFound:
    """Where a search ended.

    Attributes
    ----------
    status : int
        FOUND, AT_END (of the bounds), STEPS_SPENT, or GENERAL_WAY where a coefficient's bound or
        dependent columns ask for the general method.
    start, log_length : float
        Logarithms of the yield displacement [m] the search began and ended at.
    coefficients : (L+1,) array
        Of the columns and, last, of zeta [N].
    cost : float
        [N²]
    evaluations : int
    """

    status: int
    start: float
    log_length: float
    coefficients: Floats
    cost: float
    evaluations: int


def search_lengths(searches: list[LengthSearch], *, threads: int = 1) -> list[LengthFound]:
    """Search many conditions, each on one thread: the bits do not depend on their number."""
    if threads > 1 and sum(s.force.size * (s.grid.size + 12) for s in searches) > _WORTH_THREADS:
        with ThreadPoolExecutor(threads) as pool:  # its threads sleep while they wait
            return list(pool.map(search_length, searches, chunksize=max(1, len(searches) // (4 * threads))))
    return [search_length(search) for search in searches]


def search_length(search: LengthSearch) -> LengthFound:
    """Yield displacement of least squared force error, the coefficients solved for at every step."""
    coefficients = np.zeros(search.columns.shape[0] + 1)
    status, start, end, cost, evaluations = _search(
        search.columns,
        search.force,
        search.strokes,
        search.grid_stroke,
        search.rho,
        curve_of(search.n, search.rho < 0),
        search.grid,
        search.bounds,
        search.lower,
        search.upper,
        coefficients,
    )
    return LengthFound(status, start, end, coefficients, cost, evaluations)


@kernel
def _search(columns, force, strokes, grid_stroke, rho, curve, grid, bounds, lower, upper, coefficients):
    """Status, start, end, cost and evaluations; the coefficients come back in the last argument."""
    count, size = columns.shape[0], strokes.distance.size
    first = np.uint64(size - force.size)
    rows, inverse, along = np.zeros((count + 1, size)), np.zeros((count, count)), np.zeros(count)
    if not _orthogonalised(columns, force, first, rows, inverse, along):
        return GENERAL_WAY, 0.0, 0.0, 0.0, 0
    start = _best_of_grid(strokes, first, grid_stroke, rho, curve, grid, rows)
    z, change, work, cuts = np.zeros(size), np.zeros(size), np.zeros((2, count)), np.empty(strokes.lengths.size, CUT)
    rest_squared = dot(rows[count], rows[count], first, np.uint64(size))
    u, low, high = start, -np.inf, np.inf
    end, least = u, np.inf
    before_u, before_gradient, status, steps = 0.0, 0.0, STEPS_SPENT, 0
    while steps < 40:
        _states_and_slopes(np.exp(-u), rho, curve, strokes, cuts, z, change)
        steps += 1
        scale, cost, gradient, curvature = _fit(rows, first, z, change, rest_squared, work)
        if not scale > -np.inf or not _inside(inverse, along, scale, work[0], lower, upper, coefficients):
            return GENERAL_WAY, 0.0, 0.0, 0.0, steps
        if cost <= least:
            end, least = u, cost
        low, high = (u, high) if gradient < 0.0 else (low, u)
        if steps > 1 and (gradient - before_gradient) * (u - before_u) > 0.0:
            curvature = (gradient - before_gradient) / (u - before_u)
        if (u <= bounds[0] and gradient > 0.0) or (u >= bounds[1] and gradient < 0.0):
            status = AT_END
            break
        if gradient * gradient <= 1e-9 * cost * curvature:
            status = FOUND
            break
        target = min(max(u - gradient / curvature, bounds[0]), bounds[1])
        if not (low < target < high):
            target = 0.5 * (max(low, bounds[0]) + min(high, bounds[1]))
        before_u, before_gradient, u = u, gradient, target
    return status, start, end, least, steps + grid.size


@inner
def _best_of_grid(strokes, first, grid_stroke, rho, curve, grid, rows):
    """Place of the grid that explains the force of the last strokes best."""
    count, size = rows.shape[0] - 1, np.uint64(rows.shape[1])
    running = np.zeros((rows.shape[1] + 1, count + 1))
    for row in range(count + 1):
        total = 0.0
        for i in range(first, size):
            total += rows[row, i]
            running[i + np.uint64(1), row] = total
    begin, lengths = strokes.begin[grid_stroke:], strokes.lengths[grid_stroke:]
    direction = strokes.first_direction if grid_stroke % 2 == 0 else -strokes.first_direction
    last = Strokes(strokes.distance, begin, lengths, direction)
    sums = np.zeros((grid.size, count + 2))
    add_products(np.exp(-grid), np.full(grid.size, rho), curve, last, max(first, begin[0]), rows, running, sums)
    best, most = 0, -1.0
    for g in range(grid.size):
        left = sums[g, count + 1]
        for row in range(count):
            left -= sums[g, row] ** 2
        gain = max(sums[g, count], 0.0) ** 2 / max(left, 1e-12 * sums[g, count + 1] + 1e-300)
        if gain > most:
            best, most = g, gain
    return grid[best]


@inner
def _orthogonalised(columns, force, first, rows, inverse, along):
    """Orthonormal rows of the columns, and last the rest of the force; false where columns depend on each other.

    Modified Gram–Schmidt, twice over: small matrices need no library, and twice is enough.
    """
    count, size, last = columns.shape[0], np.uint64(columns.shape[1]), np.uint64(rows.shape[1])
    for j in range(count):
        inverse[j, j] = 1.0
        for i in range(size):
            rows[j, first + i] = columns[j, i]
        whole = dot(rows[j], rows[j], first, last)
        for _ in range(2):
            for k in range(j):
                part = dot(rows[k], rows[j], first, last)
                for i in range(first, last):
                    rows[j, i] -= part * rows[k, i]
                for m in range(count):
                    inverse[j, m] -= part * inverse[k, m]
        left = dot(rows[j], rows[j], first, last)
        if not left > 1e-10 * whole:
            return False
        norm = np.sqrt(left)
        for i in range(first, last):
            rows[j, i] /= norm
        for m in range(count):
            inverse[j, m] /= norm
    for i in range(size):
        rows[count, first + i] = force[i]
    for j in range(count):
        along[j] = dot(rows[j], rows[count], first, last)
    for j in range(count):
        for i in range(first, last):
            rows[count, i] -= along[j] * rows[j, i]
    return True


@inner
def _fit(rows, first, z, change, rest_squared, work):
    """Best size of the state beside the columns, the cost there, and gradient and curvature of the search."""
    count, end = rows.shape[0] - 1, np.uint64(rows.shape[1])
    square = dot(z, z, first, end)
    whole = square
    both, moved = dot(z, change, first, end), dot(change, change, first, end)
    for row in range(count):
        work[0, row], work[1, row] = dot(rows[row], z, first, end), dot(rows[row], change, first, end)
        square -= work[0, row] ** 2
        both -= work[0, row] * work[1, row]
        moved -= work[1, row] ** 2
    if not square > 1e-10 * whole:
        return -np.inf, 0.0, 0.0, 0.0
    with_force, change_with_force = dot(rows[count], z, first, end), dot(rows[count], change, first, end)
    size = with_force / square
    growth = (change_with_force - 2.0 * size * both) / square
    gradient = size * (size * both - change_with_force)
    curvature = size * size * moved + 2.0 * size * growth * both + growth * growth * square
    return size, rest_squared - size * with_force, gradient, curvature


@inner
def _inside(inverse, along, size, shared, lower, upper, coefficients):
    """Coefficients of the columns and the state, and whether they lie within their bounds."""
    count = along.size
    for m in range(count):
        total = 0.0
        for j in range(count):
            total += inverse[j, m] * (along[j] - size * shared[j])
        coefficients[m] = total
    coefficients[count] = size
    inside = True
    for m in range(count + 1):
        inside = inside and lower[m] <= coefficients[m] <= upper[m]
    return inside


@inner
def _states_and_slopes(kappa, rho, curve, strokes, cuts, z, change):
    """States, and their derivative with respect to the logarithm of the length."""
    cut(kappa, rho, curve, strokes, 0.0, cuts)
    n, cells, shift = curve.n, curve.cells, 0.0
    distance, begin, lengths, _ = strokes
    for k in range(cuts.size):
        stroke, a, b = cuts[k], begin[k], begin[k + 1]
        fill(kappa, rho, n, cells, stroke, distance, a, b, z, np.uint64(0))
        for i in range(a, stroke.zero):
            change[i] = -stroke.sign * (1.0 - rho * _power(abs(z[i]), n)) * (kappa * distance[i] + shift)
        for i in range(stroke.zero, stroke.full):
            change[i] = -stroke.sign * (1.0 - _power(abs(z[i]), n)) * (kappa * distance[i] + shift)
        for i in range(stroke.full, b):
            change[i] = 0.0
        if k + 1 < cuts.size:
            w = cuts[k + 1].start
            slope = -_rate(-w, rho, n) * (kappa * lengths[k] + shift)
            shift = slope / _rate(w, rho, n) if slope != 0.0 else 0.0


@inner
def _rate(w, rho, n):
    return 1.0 - _power(w, n) if w >= 0.0 else 1.0 - rho * _power(-w, n)


@inner
def _power(w, n):
    return w if n == 1.0 else (w * w if n == 2.0 else w**n)
