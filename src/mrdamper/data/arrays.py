"""Long arrays in pieces: what looks at every sample of a column that lies in a file lets go of its memory."""

from __future__ import annotations

import mmap
from collections.abc import Iterator
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
T = TypeVar("T", bound=np.generic)
CHUNK = 2**20  # samples


def chunks(values: NDArray[T], overlap: int = 0) -> Iterator[tuple[int, NDArray[T]]]:
    """Start and samples of every chunk of an array, in order; each but the last holds `overlap` samples of the next."""
    for at in range(0, max(values.size, 1), CHUNK):
        yield at, values[at : at + CHUNK + overlap]
        drop_pages(values)


def take(values: NDArray[T], index: NDArray[np.intp]) -> NDArray[T]:
    """Return the samples of an increasing index, without holding all of a memory-mapped array at once."""
    if index.size == values.size <= CHUNK:
        return values  # the same array: what is remembered of it holds
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
    """Let go of the memory of a memory-mapped array, or of a view of one; its numbers stay in its file."""
    held: object = values
    while held is not None:
        inner = getattr(held, "_mmap", None)
        if inner is not None and hasattr(mmap, "MADV_DONTNEED"):
            inner.madvise(mmap.MADV_DONTNEED)
            return
        held = getattr(held, "base", None)
