"""Linear least squares: equilibrated, bounded, or with columns that are factored once.

Matrices have many rows and few columns, whose sizes may differ by ten powers of ten. They are small, so further threads
of the linear algebra save no time and change the last bits of a result by another order of sums: one thread is used.
"""

from __future__ import annotations

import sys
from collections.abc import Generator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import import_module
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]  # as in `data`, which this package does not import
_WELL_APART = 1e-4  # smallest pivot of equilibrated columns at which the normal equations keep their digits
_RIDGE = 1e-11  # of equilibrated columns that may be nearly equal
_RANK_LIMIT = 1e-10  # singular value over the largest below which a direction is rounding
_MIN_RELATIVE_PIVOT = 1e-5  # pivot over the largest below which a column is explained by the others

_ROWS_PER_BLOCK = 50_000  # rows of a table that are factored at a time
_SMALL_PRODUCT = 1_000_000  # multiplications of a matrix product up to which OpenBLAS copies nothing


def solve_linear(columns: Floats, right: Floats, rank_limit: float | None = None) -> Floats:
    """Coefficients (L,) of least squares; of several solutions the shortest, relative to the size of each column.

    A singular value over the largest below `rank_limit` counts as undetermined.
    """
    return _solved(columns, right, columns.T @ columns, right @ columns, rank_limit)


def _solved(columns: Floats, right: Floats, gram: Floats, moments: Floats, rank_limit: float | None = None) -> Floats:
    """Solve `solve_linear`, given the products of the columns with each other and with the right side."""
    if (inverse := _inverse_of_gram(gram)) is not None:
        # Normal equations with one refinement: as accurate as a factorisation of N rows.
        solution = inverse @ moments
        return solution + inverse @ ((right - columns @ solution) @ columns)
    scale = _sizes(gram)
    return np.asarray(np.linalg.lstsq(columns / scale, right, rcond=rank_limit)[0], dtype=float) / scale


def solve_weighted(columns: Floats, right: Floats, weights: Floats, rank_limit: float | None = None) -> Floats:
    """Coefficients (F, L) of least squares with each of F sets of weights (F, N); other arguments as `solve_linear`."""
    squares, width = weights**2, columns.shape[1]
    products = (columns[:, :, None] * columns[:, None, :]).reshape(len(columns), -1)
    gram: Floats = (squares @ products).reshape(-1, width, width)
    if (inverse := _inverse_of_gram(gram)) is None:
        each = [solve_linear(columns * own[:, None], right * own, rank_limit) for own in weights]
        return np.array(each).reshape(-1, width)
    solution: Floats = np.zeros(gram.shape[:2])
    for _ in range(2):  # the second time for the remainder, as in `solve_linear`
        left: Floats = (squares * (right - solution @ columns.T)) @ columns
        solution += np.matmul(inverse, left[:, :, None])[:, :, 0]
    return solution


def project_out_columns(columns: Floats, right: Floats) -> Floats:
    """Subtract from (N,) or (N, D) right sides the part the columns explain; arguments as `solve_linear`."""
    scale = np.linalg.norm(columns, axis=0)
    basis, triangle = np.linalg.qr(columns / np.where(scale > 0, scale, 1.0))
    pivots = np.abs(triangle.diagonal())
    if pivots.min(initial=1.0) <= _RANK_LIMIT * pivots.max(initial=1.0):  # one column more is rounding
        turned, sizes, _ = np.linalg.svd(triangle)
        basis = basis @ turned[:, sizes > _RANK_LIMIT * sizes[0]]
    return right - basis @ (basis.T @ right)


def products_of_rest(columns: Floats, right: Floats) -> Floats:
    """(D, D) products of right sides (N, D) as `project_out_columns` leaves them; one triangle holds them."""
    scale, count = np.linalg.norm(columns, axis=0), columns.shape[1]
    whole = np.concatenate([columns / np.where(scale > 0, scale, 1.0), right], axis=1)
    triangle = np.asarray(np.linalg.qr(whole, mode="r"), dtype=float)
    pivots, rest = np.abs(triangle.diagonal()[:count]), triangle[count:, count:]
    if len(pivots) < count or pivots.min(initial=1.0) <= _RANK_LIMIT * pivots.max(initial=1.0):
        rest = project_out_columns(columns, right)
    return rest.T @ rest


def project_out(columns: Floats, slopes: Floats) -> Floats:
    """Project slopes (N, D) onto the orthogonal complement of columns, as a step of a search needs it.

    By normal equations with a ridge: a fraction of the time of `project_out_columns` for thousands of rows, and not to
    the last digits.
    """
    gram = columns.T @ columns
    scale = _sizes(gram)
    normal = gram / scale / scale[:, None] + _RIDGE * np.eye(scale.size)
    taken = (np.linalg.solve(normal, columns.T @ slopes / scale[:, None]) / scale[:, None]).T @ columns.T
    return np.subtract(slopes, taken.T, out=taken.T)


def products_without(columns: Floats, slopes: Floats, gram: Floats) -> Floats:
    """(K, K) products of slopes (K, N) projected as `project_out` does, without the projected slopes themselves.

    `gram` (L, L) are the products of the columns.
    """
    scale = _sizes(gram)
    unit = products_of(slopes, columns.T) / scale
    normal = gram / scale / scale[:, None] + _RIDGE * np.eye(scale.size)
    return gram_of(slopes) - unit @ np.linalg.solve(normal, unit.T)


def gram_of(rows: Floats) -> Floats:
    """(K, K) products of rows (K, N) with each other, by `products_of`."""
    gram: Floats = np.empty((len(rows), len(rows)))
    gram[:-1] = products_of(rows[:-1], rows)
    gram[-1, :-1], gram[-1, -1] = gram[:-1, -1], rows[-1] @ rows[-1]
    return gram


def products_of(rows: Floats, others: Floats) -> Floats:
    """(K, M) products of few rows (K, N) and others (M, N), a block of columns at a time.

    If some of the others are the rows themselves, there should be further ones: a symmetric product of BLAS takes three
    times as long, and a product too large for its code for small matrices twice.
    """
    step = max(1, _SMALL_PRODUCT // max(1, len(rows) * len(others)))
    begins = range(0, max(1, rows.shape[1]), step)
    blocks = [rows[:, i : i + step] @ others[:, i : i + step].T for i in begins]
    return sum(blocks[1:], start=blocks[0])


def solve_bounded(
    columns: Floats, right: Floats, lower: Floats, upper: Floats, products: Floats | None = None
) -> tuple[Floats, NDArray[np.bool_]]:
    """Least squares with bounds on the coefficients (L,), by holding violated ones at their bound.

    Returns the coefficients, and which of them ended at a bound. `products` (L, L + 1) are those of the columns with
    each other and with the right side, if known.
    """
    if products is None:
        products = np.column_stack([columns.T @ columns, right @ columns])
    gram = products[:, :-1]
    solution, held = _solved(columns, right, gram, products[:, -1]), np.zeros(len(gram), dtype=bool)
    while (outside := ~held & ((solution < lower) | (solution > upper))).any():
        held |= outside
        free, solution = ~held, np.where(held, np.minimum(np.maximum(solution, lower), upper), 0.0)
        some, rest = columns[:, free], right - columns[:, held] @ solution[held]
        solution[free] = _solved(some, rest, gram[free][:, free], rest @ some)
    return solution, held


def robust_weights(errors: Floats, best: float) -> Floats:
    """Weights with which weighted squares sum up to the errors themselves, which limits the effect of one bad run.

    `errors` (R,) are root mean square residuals of each group of rows, at the last fit; below `best` a group gains no
    more weight.
    """
    return 1.0 / np.sqrt(np.maximum(errors, best))


def _sizes(gram: Floats) -> Floats:
    """Norms of the columns of Gram matrices; one of columns that are zero."""
    scale: Floats = np.sqrt(gram.diagonal(0, -2, -1))
    scale[~(scale > 0)] = 1.0
    return scale


def _inverse_of_gram(gram: Floats) -> Floats | None:
    """Invert Gram matrices by equilibrated columns; None as `_inverse`."""
    scale = _sizes(gram)
    row, column = scale[..., None, :], scale[..., :, None]
    inverse = _inverse(gram / row / column)
    return None if inverse is None else inverse / row / column


def _inverse(normal: Floats) -> Floats | None:
    """Inverse of matrices of equilibrated columns; None where one has a pivot at which it would lose digits."""
    try:
        inverse: Floats = np.asarray(np.linalg.inv(normal), dtype=float)
        largest = inverse.diagonal(0, -2, -1)  # over the inverse square of every pivot
        if largest.min(initial=1.0) > 0 and largest.max(initial=1.0) < _WELL_APART**-2:
            return inverse
        pivots = np.linalg.cholesky(normal).diagonal(0, -2, -1)
    except np.linalg.LinAlgError:
        return None
    return inverse if pivots.min(initial=1.0) > _WELL_APART else None


def positive(matrix: Floats) -> Floats:
    """Return a covariance made symmetric, and positive where rounding left it singular."""
    even = (matrix + matrix.T) / 2
    return even + 1e-12 * np.diag(np.diag(even))


@dataclass(frozen=True, eq=False)
class FixedColumns:
    """Constant columns of problems with one further column, factored once."""

    basis: Floats  # (N, L) orthonormal, of the columns
    triangle: Floats  # (L, L) columns = basis · triangle · scale
    scale: Floats  # (L,) root mean square of each column
    along: Floats  # (L,) basisᵀ · right
    rest: Floats  # (N,) the right side less its projection on the columns

    @classmethod
    def of(cls, columns: Floats, right: Floats) -> Self:
        """Factor (N, L) columns with an (N,) right side."""
        scale = np.sqrt(np.einsum("ij,ij->j", columns, columns) / len(columns))
        scale[scale == 0] = 1.0
        basis, triangle = _factored(columns, scale)
        along = basis.T @ right
        return cls(basis, triangle, scale, along, right - basis @ along)

    @property
    def independent(self) -> bool:
        """True if no column is explained by the others."""
        pivots = np.abs(np.diag(self.triangle))
        return bool(pivots.min(initial=1.0) > _MIN_RELATIVE_PIVOT * pivots.max(initial=1.0))

    @cached_property
    def inverse(self) -> Floats:
        """(L, L) matrix from coefficients of the basis to those of the columns."""
        return np.linalg.inv(self.triangle) / self.scale[:, None]


def _factored(columns: Floats, scale: Floats) -> tuple[Floats, Floats]:
    """Orthonormal basis and triangle of (N, L) columns over their scale; of many rows block by block, twice.

    A long table is factored without the four copies of one factorisation.
    """
    size, count = columns.shape
    if size <= _ROWS_PER_BLOCK:
        return np.linalg.qr(columns / scale)
    basis, triangle = np.empty((count, size)).T, np.eye(count)
    blocks = [slice(begin, begin + _ROWS_PER_BLOCK) for begin in range(0, size, _ROWS_PER_BLOCK)]
    source, over = columns, np.diag(1 / scale)
    for _ in range(2):  # the second time for the rounding that the first leaves between the columns of a basis
        part = np.empty((0, count))
        for rows in blocks:
            part = np.linalg.qr(np.vstack([part, source[rows] @ over]), mode="r")
        if not np.all(np.diag(part)):
            return np.linalg.qr(columns / scale)
        over = over @ np.linalg.inv(part)
        for rows in blocks:
            basis[rows] = source[rows] @ over
        triangle, source, over = part @ triangle, basis, np.eye(count)
    return basis, triangle


def nonnegative_least_squares(table: Floats, right: Floats) -> tuple[Floats, float]:
    """Coefficients of least squares that are not negative, and the norm of the rest.

    By an active set [Lawson and Hanson 1974, Solving Least Squares Problems, algorithm 23.10]: SciPy, which has it, is
    slow to import.
    """
    solution, free = np.zeros(table.shape[1]), np.zeros(table.shape[1], dtype=bool)
    rounding = 10 * max(table.shape) * np.finfo(float).eps * float(np.abs(table).sum(axis=0).max(initial=0.0))
    for _ in range(3 * solution.size):
        gain = np.where(free, -np.inf, table.T @ (right - table @ solution))
        if not gain.max(initial=-np.inf) > rounding:
            break
        free[gain.argmax()] = True
        while True:
            trial = np.zeros(solution.size)
            trial[free] = np.linalg.lstsq(table[:, free], right, rcond=None)[0]
            below = free & (trial <= 0)
            if not below.any():
                break
            solution += np.min(solution[below] / (solution[below] - trial[below])) * (trial - solution)
            free &= solution > rounding
            solution[~free] = 0.0
        solution = trial
    return solution, float(np.linalg.norm(table @ solution - right))


def inverse_of_triangle(triangle: NDArray[np.floating[Any]]) -> Floats:
    """Invert lower triangles (..., L, L) by halves: NumPy has no method for them, and SciPy is slow to import."""
    half = triangle.shape[-1] // 2
    inverse = np.zeros(triangle.shape)
    upper = inverse[..., :half, :half] = np.linalg.inv(triangle[..., :half, :half])
    lower = inverse[..., half:, half:] = np.linalg.inv(triangle[..., half:, half:])
    inverse[..., half:, :half] = -lower @ (triangle[..., half:, :half] @ upper)
    return inverse


@contextmanager
def one_blas_thread() -> Generator[None]:
    """Hold the linear algebra to one thread inside the block.

    It takes threadpoolctl. Without it, set OMP_NUM_THREADS=1 and OPENBLAS_NUM_THREADS=1 (or
    MKL_NUM_THREADS=1) before Python starts for results that agree to the last bit between machines
    of different numbers of cores.
    """
    controller = _controller("scipy.linalg" in sys.modules)
    with controller.limit(limits=1, user_api="blas") if controller else nullcontext():
        yield


on_one_blas_thread = one_blas_thread()  # as a decorator of a function that runs inside such a block


@cache
def _controller(with_scipy: bool) -> Any:
    """Return the controller of the libraries that are loaded; those of SciPy come with its import."""
    try:
        threadpoolctl: Any = import_module("threadpoolctl")
    except ModuleNotFoundError:
        return None
    np.linalg.inv(np.eye(2))  # the library to be held has to be loaded first
    return threadpoolctl.ThreadpoolController()
