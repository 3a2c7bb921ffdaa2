"""How certain parameters are when residuals are not independent.

What a damper model leaves over is mostly model error, repeated every cycle, not noise. The
usual standard errors, which count every sample as new evidence, are then far too small.
"""

from __future__ import annotations

import numpy as np

from mrdamper.data import Floats


def standard_errors(jacobian: Floats, residual: Floats) -> Floats:
    """Standard errors of least-squares parameters, widened for autocorrelated residuals.

    Parameters
    ----------
    jacobian : (N, P) array
        Derivatives of the residual with respect to the parameters.
    residual : (N,) array

    Returns
    -------
    (P,) array
        √diag(σ² (JᵀJ)⁻¹ τ) with τ the integrated autocorrelation time in samples; infinite
        where the data does not determine a parameter.
    """
    scale = np.sqrt(np.sum(jacobian**2, axis=0))
    determined = scale > 0
    errors = np.full(scale.size, np.inf)
    if not determined.any():
        return errors
    scaled = jacobian[:, determined] / scale[determined]
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    safe = np.maximum(values, np.finfo(float).eps * values[-1] * scaled.shape[0])
    spread = np.sum(vectors**2 / safe, axis=1)
    variance = float(residual @ residual) / max(residual.size - scale.size, 1)
    errors[determined] = np.sqrt(variance * autocorrelation_time(residual) * spread) / scale[determined]
    return errors


def autocorrelation_time(residual: Floats) -> float:
    """Samples per independent one: 1 + 2 Σ ρ_k up to the first pair of non-positive sum.

    Initial positive sequence estimate [Geyer 1992, Statistical Science 7, 473].
    """
    centred = residual - residual.mean()
    size = centred.size
    padded = 1 << (2 * size - 1).bit_length()  # a power of two transforms several times faster
    spectrum = np.fft.rfft(centred, padded)
    correlation = np.fft.irfft(spectrum * spectrum.conj(), padded)[:size]
    if correlation[0] <= 0:
        return 1.0
    rho = correlation / correlation[0]
    pairs = rho[: size // 2 * 2].reshape(-1, 2).sum(axis=1)
    ends = np.flatnonzero(pairs <= 0)
    kept = pairs[: ends[0]] if ends.size else pairs
    return float(max(2 * kept.sum() - 1, 1.0))
