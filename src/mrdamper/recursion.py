"""A first-order lag along a sampled signal, exact for signals straight between samples."""

from __future__ import annotations

import numpy as np

from mrdamper.data import Floats

_FORGOTTEN = 1e-18  # share of the past below which it is rounding


def first_order_lag(time: Floats, signal: Floats, time_constant: float) -> Floats:
    """Y with T dy/dt + y = signal, from y = 0 at the first sample.

    y_i = p_i y_(i−1) + g_i with p = exp(−Δt/T). Instead of a loop over samples, spans of 1, 2,
    4, ... samples are joined until the past is forgotten: a few passes over the whole array.

    Parameters
    ----------
    time, signal : (N,) arrays
        [s]; the signal counts as straight between samples.
    time_constant : float
        T [s]; 0 passes the signal on.
    """
    if time_constant <= 0:
        return signal.copy()
    step = np.diff(time) / time_constant
    keep = np.concatenate([[0.0], np.exp(-step)])
    # Weights of the two ends of a straight piece; the series where their difference would cancel.
    gain = np.where(step > 1e-4, -np.expm1(-step) / np.where(step > 0, step, 1.0), 1 - step / 2 + step**2 / 6)
    value = np.concatenate([[0.0], (gain - keep[1:]) * signal[:-1] + (1 - gain) * signal[1:]])
    span = 1
    while span < value.size and keep.max() > _FORGOTTEN:
        value[span:] = value[span:] + keep[span:] * value[:-span]
        keep = np.concatenate([np.zeros(span), keep[span:] * keep[:-span]])
        span *= 2
    return value
