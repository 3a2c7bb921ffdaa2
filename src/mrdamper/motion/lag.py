"""A first-order lag along a sampled signal, exact for signals straight between samples."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrdamper.data import Floats
from mrdamper.tracing import Tape, choose, streamed

_SHORT = 1e-4  # step over time constant below which a series loses fewer digits
_FORGOTTEN = 1e-18  # share of the past below which it is rounding


def lag_step(tape: Tape, time: Any, signal: Any, time_constant: Any) -> Any:
    """`first_order_lag` for one sample."""
    held, last = tape.remember("lagged"), tape.previous(signal, "signal")

    def lagged() -> Any:
        step = time.step / time_constant
        keep = np.exp(-step)
        gain = choose(step > _SHORT, lambda: -np.expm1(-step) / step, lambda: 1 - step / 2 + step**2 / 6)
        moved = keep * held + ((gain - keep) * last + (1 - gain) * signal)
        return tape.select(tape.first, 0.0, moved)

    value = choose(time_constant > 0, lagged, lambda: signal)
    tape.update(held, value)
    return value


@streamed(lag_step)
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
    gain = np.where(step > _SHORT, -np.expm1(-step) / np.where(step > 0, step, 1.0), 1 - step / 2 + step**2 / 6)
    value = np.concatenate([[0.0], (gain - keep[1:]) * signal[:-1] + (1 - gain) * signal[1:]])
    span = 1
    while span < value.size and keep.max() > _FORGOTTEN:
        value[span:] = value[span:] + keep[span:] * value[:-span]
        keep = np.concatenate([np.zeros(span), keep[span:] * keep[:-span]])
        span *= 2
    return value
