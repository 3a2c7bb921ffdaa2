"""First-order memories along a sampled motion: a lag, and a load that increases with distance and relaxes with time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from mrdamper.data import Floats
from mrdamper.physics.motion.path import LONG, Path, memoize_per_path
from mrdamper.tracing import Tape, choose, streamed

_SHORT = 1e-4  # step over time constant below which a series is more accurate
_FORGOTTEN = 1e-18  # share of the past below which it is rounding


def lag_step(tape: Tape, time: Any, signal: Any, time_constant: Any) -> Any:
    """`first_order_lag` for one sample."""
    held, last = tape.remember("lagged"), tape.previous(signal, "signal")

    def lagged() -> Any:
        step = time.step / time_constant
        keep = np.exp(-step)
        gain = choose(step > _SHORT, lambda: (1 - keep) / step, lambda: 1 - step / 2 + step**2 / 6)
        moved = keep * held + ((gain - keep) * last + (1 - gain) * signal)
        return tape.select(tape.first, 0.0, moved)

    value = choose(time_constant > 0, lagged, lambda: signal)
    tape.update(held, value)
    return value


@streamed(lag_step)
def first_order_lag(time: Floats, signal: Floats, time_constant: float) -> Floats:
    """Y with T dy/dt + y = signal, from y = 0 at the first sample.

    y_i = p_i y_(i−1) + g_i with p = exp(−Δt/T). A few passes over the array replace a loop over samples. The signal is
    linear between the times (N,) [s]; with a time constant T [s] of 0 it is returned.
    """
    if time_constant <= 0:
        return signal.copy()
    rows = iter(_known_weights(time, time_constant) if time.size <= LONG else _weights(time, time_constant))
    value = np.zeros(signal.size)
    value[1:] = next(rows)[1:] * signal[:-1]
    value[1:] += next(rows)[1:] * signal[1:]
    return _summed(rows, value)


def _weights(time: Floats, time_constant: float) -> Iterator[Floats]:
    """(N,) weights of the two ends of the linear pieces, then of the past, by span."""
    step = np.diff(time) / time_constant
    keep = np.concatenate([[0.0], np.exp(-step)])
    # The series where the difference of the two would cancel.
    gain = np.where(step > _SHORT, (1 - keep[1:]) / np.where(step > 0, step, 1.0), 1 - step / 2 + step**2 / 6)
    yield np.append(0.0, gain - keep[1:])
    yield np.append(0.0, 1 - gain)
    yield from _spans(keep)


@memoize_per_path
def _known_weights(time: Floats, time_constant: float) -> Floats:
    """Return the weights as rows of a table, for the next signal along these times."""
    return np.stack(list(_weights(time, time_constant)))


def _spans(keep: Floats) -> Iterator[Floats]:
    """Calculate the part of the memory kept over 1, 2, 4, ... samples, until nothing is left."""
    span = 1
    while span < keep.size and keep.max() > _FORGOTTEN:
        yield keep
        keep = np.concatenate([np.zeros(span), keep[span:] * keep[:-span]])
        span *= 2


def _summed(spans: Iterable[Floats], value: Floats) -> Floats:
    """Y with y_i = keep_i y_(i−1) + value_i, in place: spans are joined."""
    for power, keep in enumerate(spans):
        value[1 << power :] += keep[1 << power :] * value[: -(1 << power)]
    return value


def decaying_sum(value: Floats, keep: float) -> Floats:
    """(N,) y_i = keep · y_(i−1) + value_i, from y_0 = value_0: a filter of one pole, its span doubled in every pass."""
    total, span = value.copy(), 1
    while span < total.size and keep**span > _FORGOTTEN:
        total[span:] += keep**span * total[:-span]
        span *= 2
    return total


def load_step(tape: Tape, time: Any, path: Any, length: Any, leak: Any) -> Any:
    """`leaking_load` for one sample."""
    held = tape.remember("load", 1.0)
    travelled = abs(path.step)
    for turn in path.turns:
        travelled = travelled + abs(turn)
    both = travelled + time.step * (leak * length)
    settled = choose(both > 0, lambda: travelled / both, lambda: 1.0)
    moved = tape.select(tape.first, 1.0, settled + (held - settled) * np.exp(-(1 / length) * both))
    load = choose(leak > 0, lambda: moved, lambda: 1.0)
    tape.update(held, load)
    return load


@streamed(load_step)
def leaking_load(time: Floats, path: Path, length: float, leak: float) -> Floats:
    """G with dG/dt = (|v|/length)(1 − G) − leak G, from G = 1: a load that increases with motion and relaxes at rest.

    The speed is constant between two times (N,) [s] of the path. `length` is the displacement over which the load
    increases [m], `leak` its relaxation rate [1/s], 0 for none.
    """
    return np.ones(time.size) if leak <= 0 else _loaded(path, time, length, leak)


@memoize_per_path
def _loaded(path: Path, time: Floats, length: float, leak: float) -> Floats:
    built, leaked = np.diff(path.travel) / length, leak * np.diff(time)
    both = np.maximum(built + leaked, np.finfo(float).tiny)
    keep = np.concatenate([[0.0], np.exp(-both)])
    return _summed(_spans(keep), np.concatenate([[1.0], (1 - keep[1:]) * built / both]))
