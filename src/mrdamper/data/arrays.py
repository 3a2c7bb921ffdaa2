"""Memory-mapped arrays in chunks, whose memory is released after use."""

from __future__ import annotations

import mmap
from collections.abc import Callable, Iterator
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
T = TypeVar("T", bound=np.generic)
CHUNK = 2**18  # samples


def chunks(values: NDArray[T], overlap: int = 0) -> Iterator[tuple[int, NDArray[T]]]:
    """Start and samples of every chunk of an array, in order; each but the last holds `overlap` samples of the next."""
    for at in range(0, max(values.size, 1), CHUNK):
        yield at, values[at : at + CHUNK + overlap]
        drop_pages(values)


def blocks(size: int, step: int) -> Iterator[slice]:
    """Slices of at most so many samples."""
    return (slice(begin, min(begin + step, size)) for begin in range(0, size, max(1, step)))


def take(values: NDArray[T], index: NDArray[np.intp]) -> NDArray[T]:
    """Return the samples of an increasing index, without holding all of a memory-mapped array at once."""
    if index.size == values.size <= CHUNK:
        return values  # the same array: cached results of it are valid
    if values.size <= CHUNK:
        return values[index]
    bounds = np.searchsorted(index, np.arange(CHUNK, values.size, CHUNK))
    parts: list[NDArray[T]] = []
    for part in np.split(index, bounds):
        parts.append(values[part])
        drop_pages(values)
    return np.concatenate(parts)


def index_at(values: NDArray[np.generic], value: float, side: Literal["left", "right"] = "left") -> int:
    """Index of the first of increasing values that is not below a value, or that is above it (`right`)."""
    return int(np.searchsorted(values, value, side))


def drop_pages(values: NDArray[np.generic]) -> None:
    """Release the memory of a memory-mapped array, or of a view of one; its numbers stay in its file."""
    held: object = values
    while held is not None:
        inner = getattr(held, "_mmap", None)
        if inner is not None and hasattr(mmap, "MADV_DONTNEED"):
            inner.madvise(mmap.MADV_DONTNEED)
            return
        held = getattr(held, "base", None)


def rescale(values: Floats, factor: float, offset: float = 0.0) -> Floats:
    """Values times a factor, plus an offset; a memory-mapped array is changed in place, piece by piece."""
    if factor == 1.0 and offset == 0.0:
        return values
    if not isinstance(values, np.memmap):
        return factor * values + offset if offset else factor * values
    for _, piece in chunks(values):
        piece[:] = factor * piece + offset
    return values


def odd_steps(time: Floats, odd: Callable[[Floats], np.ndarray]) -> Iterator[tuple[int, float, float]]:
    """Yield steps of time that a test finds odd: sample after the step, time before and after it."""
    last = None  # sample of the last time stamp that was there
    for start, piece in chunks(time):
        index = start + np.flatnonzero(np.isfinite(piece))
        if last is not None:
            index = np.concatenate([[last], index])
        if not index.size:
            continue
        stamps = time[index]
        for i in np.flatnonzero(odd(np.diff(stamps))):
            yield int(index[i + 1]), float(stamps[i]), float(stamps[i + 1])
        last = int(index[-1])
