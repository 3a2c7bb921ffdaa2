"""Autoregressive models of a residual, by Burg's recursion and by their restricted likelihood."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrdamper.data.arrays import Floats

_HIGHEST_ORDER = 12
_MAX_CORRELATION = 0.9995  # of neighbours
_RANK = 1e-10  # of the largest singular value of a Jacobian, below which a direction is linearly dependent
_LARGEST_RATIO, _STEP = 4.0, 0.35  # of 1 - φ on the grid, to that of Burg's recursion; step of its logarithm


@dataclass(frozen=True, eq=False)
class Autoregression:
    """Autoregressive model of noise."""

    variance: float  # of the innovation
    reflections: Floats  # (K,) reflection coefficients of the lattice filter

    @classmethod
    def of(cls, residual: Floats) -> Autoregression:
        """By Burg's recursion, of the order that Akaike's corrected criterion chooses."""
        size = residual.size
        models = _burg(residual, min(_HIGHEST_ORDER, size // 10))
        best, least = models[0], np.inf
        for model in models:
            order = model.order
            criterion = size * np.log(max(model.variance, 1e-300)) + 2 * (order + 1) * size / (size - order - 2)
            if criterion < least:
                best, least = model, criterion
        return best

    @property
    def order(self) -> int:
        """Number of coefficients."""
        return self.reflections.size

    @property
    def predictors(self) -> list[Floats]:
        """Coefficients of each order up to its own, by Levinson's recursion."""
        rows = [np.zeros(0)]
        for reflection in self.reflections.tolist():
            rows.append(np.append(rows[-1] + reflection * rows[-1][::-1], reflection))
        return rows

    @property
    def coefficients(self) -> Floats:
        """(K,) coefficients of the preceding samples in the prediction error."""
        return self.predictors[-1]

    @property
    def lags(self) -> float:
        """Number of samples that count as one independent sample in a mean."""
        own = float(np.prod(1 - self.reflections**2))
        return own / float(1 + self.coefficients.sum()) ** 2

    def spectrum(self, size: int) -> Floats:
        """Calculate the power spectrum, whose mean by `mean_weights(size)` is the variance."""
        return self.variance / np.abs(np.fft.rfft(np.append(1.0, self.coefficients), transform_length(size))) ** 2

    def innovations(self, table: Floats) -> Floats:
        """Prediction errors (N, C) of columns, of equal variance; the first are predicted from fewer samples."""
        rows, out = self.predictors, table.copy()
        for lag, coefficient in enumerate(rows[-1].tolist(), 1):
            out[lag:] += coefficient * table[:-lag]
        for first in range(self.order):
            share = np.sqrt(np.prod(1 - self.reflections[first:] ** 2))
            out[first] = share * (table[first] + rows[first] @ table[:first][::-1])
        return out


def transform_length(size: int) -> int:
    """Length of a zero-padded Fourier transform in which convolutions of a record do not overlap."""
    return 1 << (2 * size - 1).bit_length()


def mean_weights(size: int) -> Floats:
    """Weights of the non-negative frequencies of this transform in a mean over all frequencies."""
    weights = np.full(transform_length(size) // 2 + 1, 2.0 / transform_length(size))
    weights[[0, -1]] /= 2
    return weights


def _burg(residual: Floats, highest: int, first: float | None = None) -> list[Autoregression]:
    """Models of each order up to the highest; the first reflection coefficient may be given."""
    forward = backward = residual - residual.mean()
    size = residual.size
    models = [Autoregression(float(forward @ forward) / size, np.zeros(0))]
    for order in range(1, highest + 1):
        ahead, behind = forward[1:], backward[:-1]
        power = float(ahead @ ahead + behind @ behind)
        if power <= 0:
            break
        reflection = -2 * float(ahead @ behind) / power
        if order == 1:  # bias by the mean that was subtracted [Kendall 1954, Marriott and Pope 1954]
            reflection = max(reflection - max(1 - 3 * reflection, 0.0) / size, -_MAX_CORRELATION)
            reflection = reflection if first is None else first
        forward, backward = ahead + reflection * behind, behind + reflection * ahead
        variance = float(forward @ forward + backward @ backward) / (2 * forward.size)
        if variance <= 0:
            break
        models.append(Autoregression(variance, np.append(models[-1].reflections, reflection)))
    return models


def models_by_likelihood(jacobian: Floats, residual: Floats) -> tuple[list[Autoregression], Floats]:
    """Models of shorter and longer correlation times than that of Burg's recursion, and the probability of each.

    A fit reduces the slow part of the noise in its residual (N,), which has an order above zero. The restricted
    likelihood is that of the part of the noise that no parameter can describe [Cheang and Reinsel 2000, J. Am. Stat.
    Assoc. 95, 1173]; the prior of the correlation φ of neighbouring samples is that of Jeffreys, (1 - φ²)^-½. The
    Jacobian (N, P) has fewer columns than rows, of similar size.
    """
    turned, sizes, _ = np.linalg.svd(jacobian, full_matrices=False)
    columns = turned[:, sizes > _RANK * sizes[0]]
    burg, free = Autoregression.of(residual), residual.size - columns.shape[1]
    largest = min(_LARGEST_RATIO * (1 + float(burg.reflections[0])), 1.0)  # 1 - φ
    logs = np.arange(np.log(1 - _MAX_CORRELATION), np.log(largest) + _STEP, _STEP)
    models, likelihoods = list[Autoregression](), list[float]()
    for log in logs.tolist():
        shape = _burg(residual, burg.order, float(np.exp(log)) - 1)[-1]
        table = shape.innovations(np.column_stack([residual, columns]))
        basis, triangle = np.linalg.qr(table[:, 1:])
        rest = table[:, 0] - basis @ (basis.T @ table[:, 0])
        variance = float(rest @ rest) / free
        orders = np.arange(1, shape.order + 1)
        likelihoods.append(
            float(orders @ np.log(1 - shape.reflections**2)) / 2
            - free * np.log(variance) / 2
            - float(np.log(np.abs(np.diag(triangle))).sum())
            + log / 2
        )
        models.append(Autoregression(variance, shape.reflections))
    probabilities = np.exp(np.array(likelihoods) - max(likelihoods))
    return models, probabilities / probabilities.sum()
