"""Covariance of least-squares parameters where residuals are not independent.

Residuals of dampers are correlated for two reasons. Noise has a spectrum: an offset force depends on the noise at 0 Hz,
a viscous damping on that at the frequency of the motion. Model error repeats with every cycle: more cycles do not
reduce it, so it counts as one unknown function of the phase and not as noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from mrdamper.data.arrays import Floats
from mrdamper.identification.autoregression import Autoregression, mean_weights, models_by_likelihood, transform_length
from mrdamper.identification.intervals import dof_of_quantile, student

_MIN_VARIANCE = 1e-200  # smallest variance, by which shares are divided
_HARMONICS = 24  # harmonics of the motion in which model error is estimated
_REPEATS = 0.95  # cycles from which harmonics of the motion are resolved
_MIN_CYCLES = 1.9  # cycles from which repetition is detected
_MAX_SAMPLES = 2001  # largest number of samples
_MAX_SHARE = 0.1  # of the noise in the fit, above which its residual does not show the correlation time of the noise
_LEVEL = 0.95  # of intervals whose degrees of freedom are sought
_TAKES_PART = 0.1  # in a direction, of its unit vector
_NO_MORE = 1e-12  # of the largest: eigenvalue of the scaled normal matrix below which a direction is not determined


@dataclass(frozen=True, eq=False)
class ParameterCovariance:
    """Covariance of parameters."""

    covariance: Floats  # (P, P) infinite on the diagonal where the data does not determine a parameter
    dof: Floats  # (P,) degrees of freedom of each variance, for Student's t
    effective: Floats  # (P,) independent samples with the same error of each parameter for a white residual
    textbook: Floats  # (P,) standard errors by s² (JᵀJ)⁻¹, as if the residual were white
    memory: float  # length of the record in correlation times of its residual, of which about ten are needed
    # parameters with the same effect on the residual, of which only some combinations are determined
    alike: tuple[tuple[int, ...], ...] = ()

    @property
    def errors(self) -> Floats:
        """(P,) standard errors."""
        return np.sqrt(np.diag(self.covariance))


def spread(
    jacobian: Floats, residual: Floats, time: Floats | None = None, frequency: float | None = None
) -> ParameterCovariance:
    """Covariance of the parameters of a least-squares fit to one record.

    (JᵀJ)⁻¹ Jᵀ Σ J (JᵀJ)⁻¹ with Σ from the residual: an autoregression whose order an information criterion selects,
    and, if the motion repeats, the repeating part of the residual, each harmonic corrected for the part that the fit
    absorbed. The times (N,) [s] are evenly spaced, or nearly; the frequency [Hz] is that of a motion that repeats.
    """
    whole, squares = residual.size, float(residual @ residual)
    if (block := max(1, whole // _MAX_SAMPLES)) > 1:  # means over a few samples keep slower components
        kept = whole // block * block
        jacobian, residual = (a[:kept].reshape(-1, block, *a.shape[1:]).mean(axis=1) for a in (jacobian, residual))
        time = None if time is None else time[:kept].reshape(-1, block).mean(axis=1)
    scale: Floats = np.sqrt(np.sum(jacobian**2, axis=0))
    active = scale > 0
    size, count = residual.size, scale.size
    covariance = np.diag(np.full(count, np.inf))
    if not active.any():
        return ParameterCovariance(covariance, np.ones(count), np.zeros(count), np.full(count, np.inf), np.inf)
    unit = jacobian[:, active] / scale[active]
    values, vectors = np.linalg.eigh(unit.T @ unit)
    safe = np.maximum(values, np.finfo(float).eps * values[-1] * active.sum())
    inverse = (vectors / safe) @ vectors.T
    score, dof, memory = score_covariance(unit, residual, time, frequency, inverse)
    middle = inverse @ score @ inverse
    weak = values <= _NO_MORE * values[-1]
    lost = np.sum(vectors[:, weak] ** 2, axis=1) > 1e-6
    rows = np.flatnonzero(active)
    alike = tuple(tuple(int(rows[i]) for i in group) for group, _ in alike_groups(vectors[:, weak]))
    covariance[np.ix_(rows, rows)] = middle / scale[active][:, None] / scale[active]
    for row in rows[lost]:
        covariance[row, :] = covariance[:, row] = 0.0
        covariance[row, row] = np.inf
    textbook = np.full(count, np.inf)
    variance = squares / max(whole - active.sum(), 1)
    textbook[rows] = np.where(lost, np.inf, variance / block * np.diag(inverse) / scale[active] ** 2)
    with np.errstate(invalid="ignore", divide="ignore"):
        effective = np.nan_to_num(whole * textbook / np.diag(covariance), nan=0.0, posinf=float(whole))
    free = np.ones(count)
    free[rows] = np.clip(dof, 1.0, max(size - active.sum(), 1))
    return ParameterCovariance(covariance, free, np.minimum(effective, whole), np.sqrt(textbook), memory, alike)


def alike_groups(vectors: Floats) -> list[tuple[list[int], int]]:
    """Group the parameters with the same effect on a residual, each with its main parameter.

    Two such pairs span a plane in which any vector is an eigenvector, so groups follow from the reduced form of the
    basis, in which each has its own parameter.

    `vectors` (P, K): combinations of parameters that change nothing.
    """
    basis, own = vectors.T.copy(), list[int]()
    for k in range(len(basis)):
        row, column = map(int, np.unravel_index(int(np.argmax(np.abs(basis[k:]))), basis[k:].shape))
        basis[[k, k + row]] = basis[[k + row, k]]
        basis[k] /= basis[k, column]
        others = np.arange(len(basis)) != k
        basis[others] -= np.multiply.outer(basis[others, column], basis[k])
        own.append(column)
    return [(np.flatnonzero(np.abs(row) > _TAKES_PART).tolist(), one) for row, one in zip(basis, own, strict=True)]


def score_covariance(
    jacobian: Floats, residual: Floats, time: Floats | None, frequency: float | None, inverse: Floats
) -> tuple[Floats, Floats, float]:
    """Jᵀ Σ J, (P,) degrees of freedom behind each parameter's variance, the record's length in lags of its residual.

    `inverse` is (JᵀJ)⁻¹, for the part of the residual that the fit absorbed.
    """
    repeats = time is not None and frequency is not None and np.ptp(time) * frequency >= _REPEATS
    rest, parts = residual, []
    if repeats:
        rest, parts = _repeated(jacobian, residual, time, frequency, inverse)  # type: ignore[arg-type]
    noise, memory = _noise(jacobian, rest, inverse)
    parts = [*parts, noise]
    total = np.sum([score for score, _ in parts], axis=0)
    # Relative variances of the parts, each by its share of a parameter's variance [Satterthwaite 1946].
    shares = [np.diag(inverse @ score @ inverse) for score, _ in parts]
    whole = np.maximum(np.sum(shares, axis=0), _MIN_VARIANCE)
    doubt = np.sum(
        [np.clip(share / whole, -1e3, 1e3) ** 2 * relative for share, (_, relative) in zip(shares, parts, strict=True)],
        axis=0,
    )
    return total, 2 / np.maximum(doubt, 1e-9), residual.size / max(memory, 1e-9)


Part = tuple[Floats, Floats]  # Jᵀ Σ J of one cause, and the relative variance of each parameter's share of it


def _repeated(
    jacobian: Floats, residual: Floats, time: Floats, frequency: float, inverse: Floats
) -> tuple[Floats, list[Part]]:
    """Separate the part of a residual that does not repeat in every cycle; return it and the score's covariance."""
    size, count = jacobian.shape
    step = float(np.median(np.diff(time)))
    most = int(min(_HARMONICS, 0.4 / (step * frequency), size // 8))
    if most < 4:
        return residual, []
    orders: Floats = np.arange(1.0, most + 1)
    waves, gram, windows = _waves((time - time[0]).tobytes(), frequency, most)
    along: Floats = waves @ (residual - residual.mean())
    amplitudes = np.linalg.solve(gram, along)
    rest = residual - amplitudes @ waves
    responses = (waves @ jacobian).T  # (P, 2K)
    # Share of every harmonic that the parameters describe, and that the residual therefore lacks.
    taken = np.clip(np.sum(responses * (inverse @ responses), axis=0) / np.diag(gram), 0.0, 1.0)
    left = (1 - taken).reshape(most, 2).mean(axis=1)
    power = (amplitudes**2).reshape(most, 2).mean(axis=1)
    # By leakage, a record that does not end where it began has more power there than the spectrum of its noise.
    spectrum = mean_weights(size) * Autoregression.of(rest).spectrum(size)
    expected: Floats = windows @ spectrum / np.diag(gram) ** 2
    expected = expected.reshape(most, 2).mean(axis=1) * size / (size - 2 * most)
    # Noise has power at these frequencies, too; only a significant excess counts as repeating.
    if np.sum(power) < (1 + 3 / np.sqrt(left.sum())) * np.sum(expected * left):
        return residual, []
    level, relative = _power_law(orders, power, expected, left)
    lines = (responses * np.repeat(level, 2)) @ responses.T
    pull = inverse @ responses
    shares = (pull**2 * np.repeat(level, 2)).reshape(count, most, 2).sum(axis=2)
    weights = shares / np.maximum(shares.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    if np.ptp(time) * frequency < _MIN_CYCLES:
        rest = residual  # the repeating part cannot be separated
    return rest, [(lines, np.sum(weights @ relative * weights, axis=1))]


@lru_cache(maxsize=4)  # for all models that are fitted to a run
def _waves(time: bytes, frequency: float, most: int) -> tuple[Floats, Floats, Floats]:
    """(2K, N) harmonics of a motion at times (N,), (2K, 2K) their products, and (2K, F) their squared transforms."""
    turned = _powers(np.exp(2j * np.pi * frequency * np.frombuffer(time)), most)
    waves = np.stack([turned.real, turned.imag], axis=1).reshape(2 * most, -1)
    transformed = np.fft.rfft(waves, transform_length(waves.shape[1]))
    return waves, waves @ waves.T, transformed.real**2 + transformed.imag**2


def _power_law(orders: Floats, power: Floats, expected: Floats, left: Floats) -> tuple[Floats, Floats]:
    """Mean power of repeated lines at every order, and the covariance of its logarithm.

    The model error of a symmetric damper has odd lines far above even ones; each kind decreases with a power of the
    order. The lines that the fit absorbed are estimated from the others [Whittle 1953].
    """
    odd = orders % 2 == 1
    groups = [group for group in (odd, ~odd) if left[group].sum() > 1]
    logs = np.log(orders)
    shapes = np.exp(-np.outer(np.linspace(0.0, 6.0, 61), logs))  # a row a fall
    level = np.zeros_like(shapes)
    for group in groups:
        amount = np.sum(power[group] / shapes[:, group], axis=1) / left[group].sum()
        level[:, group] = amount[:, None] * shapes[:, group]
    covered = np.logical_or.reduce(groups) if groups else np.zeros(orders.size, dtype=bool)
    costs = np.log(np.maximum(level[:, covered], _MIN_VARIANCE)) @ left[covered]
    best = level[int(np.argmin(costs))]
    columns = np.column_stack([*[group.astype(float) for group in groups], -logs])
    information = (columns * left[:, None]).T @ columns
    relative: Floats = np.asarray(columns @ np.linalg.pinv(information) @ columns.T, dtype=float)
    return np.maximum(best - expected, 0.0), relative


def _noise(jacobian: Floats, residual: Floats, inverse: Floats) -> tuple[Part, float]:
    """Calculate the score's covariance from the spectrum of the residual, and its correlation time in samples."""
    size = residual.size
    model = Autoregression.of(residual)
    spectrum = model.spectrum(size)
    transformed = np.fft.rfft(jacobian, transform_length(size), axis=0)
    score = _score(transformed, mean_weights(size) * spectrum)
    memory = np.fft.irfft(spectrum, transform_length(size))[: model.order + 1]  # covariance of the residual at its lags
    if memory[0] <= 0:
        return (score, np.zeros(len(inverse))), 1.0
    # The fit absorbed a share of the noise.
    taken = float(np.sum(inverse * score)) / (size * memory[0])
    if model.order and taken > _MAX_SHARE:
        return _noise_by_likelihood(jacobian, residual, inverse)
    relative = np.full(len(inverse), 2.0 / size)
    if order := model.order:  # uncertainty of the spectrum by its coefficients, for each parameter
        lags = np.arange(order)
        doubt = model.variance / size * np.linalg.pinv(memory[np.abs(np.subtract.outer(lags, lags))])
        influence = np.abs(transformed @ inverse) ** 2 * spectrum[:, None]
        response = np.fft.rfft(np.append(1.0, model.coefficients), transform_length(size))
        bent = -np.fft.irfft(influence / response.conj()[:, None], transform_length(size), axis=0)[1 : order + 1]
        slopes = 2 * bent / np.maximum(mean_weights(size) @ influence, 1e-300)
        relative = relative + np.sum(slopes * (doubt @ slopes), axis=0)
    return (score / max(1 - taken, 0.2), relative), model.lags


def _score(transformed: NDArray[np.complex128], spectrum: Floats) -> Floats:
    """(P, P) covariance of the score by noise, of the Fourier transform of the Jacobian and means of the spectrum."""
    return np.real((transformed.conj().T * spectrum) @ transformed)


def _noise_by_likelihood(jacobian: Floats, residual: Floats, inverse: Floats) -> tuple[Part, float]:
    """Calculate the same where the fit has reduced the noise so much that its correlation time is not known.

    The covariance is the mean over models by their restricted likelihood; the degrees of freedom of a parameter are
    those at which Student's interval is that of the mixture.
    """
    from scipy.special import ndtr  # type: ignore[reportMissingTypeStubs]

    models, probabilities = models_by_likelihood(jacobian, residual)
    size = residual.size
    transformed, weights = np.fft.rfft(jacobian, transform_length(size), axis=0), mean_weights(size)
    scores = np.array([_score(transformed, weights * model.spectrum(size)) for model in models])
    score: Floats = np.tensordot(probabilities, scores, 1)
    variances = np.maximum(np.einsum("ip,mpq,iq->mi", inverse, scores, inverse), 0.0)
    ratios = np.sqrt(
        variances / np.maximum(probabilities @ variances, _MIN_VARIANCE)
    )  # of the standard errors by each model
    quantiles = np.linspace(student(_LEVEL, np.inf), student(_LEVEL, 1.0), 400)
    inside = np.tensordot(probabilities, 2 * ndtr(quantiles[:, None, None] / np.maximum(ratios, 1e-9)) - 1, (0, 1))
    dof = np.array([dof_of_quantile(float(np.interp(_LEVEL, own, quantiles)), _LEVEL) for own in inside.T])
    return (score, 2 / dof + 2 / size), float(np.exp(probabilities @ np.log([model.lags for model in models])))


def _powers(base: NDArray[np.complex128], count: int) -> NDArray[np.complex128]:
    """(count, N) first powers of some numbers."""
    powers = np.empty((count, base.size), dtype=complex)
    for k in range(count):
        np.multiply(powers[k - 1] if k else 1.0, base, out=powers[k])
    return powers
