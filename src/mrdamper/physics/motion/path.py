"""A sampled motion cut into strokes at its reversals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, wraps
from typing import Any, Literal, Self
from weakref import ref

import numpy as np
from numpy.typing import ArrayLike

from mrdamper.data.arrays import Floats
from mrdamper.errors import ExcitationError, is_a

_AROUND = np.array([[-1], [0], [1]])
LONG = 200_000  # samples from which results are not cached


@dataclass(frozen=True, eq=False)
class Path:
    """A sampled motion cut into strokes. Make it with `Path.of`, once for all shapes."""

    stroke: np.ndarray  # (N,) stroke each sample lies in
    distance: Floats  # (N,) distance since the reversal that began the stroke [m]
    direction: Floats  # (N,) +1 or −1, the sign of the velocity in that stroke
    lengths: tuple[float, ...]  # length of every stroke but the last [m]
    first_direction: float  # direction of the first stroke

    @classmethod
    def of(cls, displacement: ArrayLike, *, peaks: Literal["parabola", "samples"] = "parabola") -> Self:
        """Divide a motion of displacements (N,) [m] at its reversals, about which the samples count as even in time.

        A smooth motion reverses between two samples, beyond both. "parabola" puts the peak where the parabola through
        the three samples at the reversal has its vertex, "samples" at the outermost sample. At 1000 samples per cycle
        the error of zeta is 1e-9 instead of 1e-4. Raises `ExcitationError` if the array is no channel of finite
        numbers.
        """
        x = np.asarray(displacement, dtype=float)
        if x.ndim != 1 or x.size == 0:
            raise ExcitationError(f"displacement has shape {x.shape}", remedy="give one channel, samples in a row")
        if not np.isfinite(x).all():
            raise ExcitationError("displacement holds NaN or infinity", remedy="cut or repair the record")
        arrival, departure, first = _reversals(x)
        peak, begin = x[arrival], departure + 1  # a rest belongs to the stroke it ends
        if peaks == "parabola":
            beyond, begin = _vertex(x, arrival, departure)
            peak = peak + beyond

        bounds, origin = np.zeros(begin.size + 2, dtype=np.intp), np.empty(begin.size + 1)
        bounds[1:-1], bounds[-1], origin[:1], origin[1:] = begin, x.size, x[:1], peak
        counts = bounds[1:] - bounds[:-1]
        directions = np.full(counts.size, first)
        directions[1::2] = -first
        distance = x - origin.repeat(counts)
        return cls(
            stroke=np.arange(counts.size).repeat(counts),
            distance=np.abs(distance, out=distance),
            direction=directions.repeat(counts),
            lengths=tuple(np.abs(origin[1:] - origin[:-1]).tolist()),
            first_direction=first,
        )

    def __len__(self) -> int:
        return self.distance.size

    @property
    def travel(self) -> Floats:
        """(N,) distance travelled since the first sample, round the reversals [m]."""
        return np.cumsum([0.0, *self.lengths])[self.stroke] + self.distance

    @cached_property
    def moves(self) -> tuple[Floats, Floats, Floats]:
        """(N,) signed moves [m] from sample to sample: to a reversal between the two, to another, and the rest.

        If the motion reverses between two samples it continues to the reversal first; noise reverses it twice at most.
        """
        signed = self.direction * self.distance
        turn, back, move = np.zeros(signed.size), np.zeros(signed.size), np.zeros(signed.size)
        np.subtract(signed[1:], signed[:-1], out=move[1:])
        at = np.flatnonzero(self.stroke[1:] != self.stroke[:-1]) + 1
        if at.size:
            lengths, before = np.array([*self.lengths, 0.0]), at - 1
            turn[at] = self.direction[before] * (lengths[self.stroke[before]] - self.distance[before])
            twice = self.stroke[at] - self.stroke[before] == 2
            back[at] = np.where(twice, -self.direction[before] * lengths[self.stroke[before] + 1], 0.0)
            move[at] = signed[at]
        return turn, back, move


def memoize_per_path(function: Callable[..., Floats]) -> Callable[..., Floats]:
    """Cache the last two results of a function of a path or of samples, and of some numbers.

    A search changes one parameter at a time, so results for the others are reused. The cache ends with the path.
    Symbols and very long records are computed every time.
    """
    memory: dict[int, tuple[ref[Any], list[tuple[tuple[Any, ...], Floats]]]] = {}

    @wraps(function)
    def remembered(first: Any, *given: Any, **options: Any) -> Floats:
        if options or not is_a(first, (np.ndarray, Path)) or len(first) > LONG:
            return function(first, *given, **options)
        if id(first) not in memory:
            memory[id(first)] = ref(first, lambda _, key=id(first): memory.pop(key, None)), []
        _, last = memory[id(first)]
        for place, (before, result) in enumerate(last):
            if all(a is b or not (isinstance(a, np.ndarray) or a != b) for a, b in zip(before, given, strict=True)):
                last.insert(0, last.pop(place))
                return result
        result = function(first, *given)
        result.flags.writeable = False
        last[:] = (given, result), *last[:1]
        return result

    return remembered


def _reversals(x: Floats) -> tuple[np.ndarray, np.ndarray, float]:
    """Find the samples where the motion arrives at its turning points and departs from them, and its first direction.

    The samples differ where the motion rests there.
    """
    rising = x[1:] > x[:-1]
    resting = x[1:] == x[:-1]
    moving = np.flatnonzero(~resting) if resting.any() else None
    if moving is not None:
        rising = rising[moving]
    turn = (rising[1:] != rising[:-1]).nonzero()[0]
    first = -1.0 if rising.size and not rising[0] else 1.0
    arrival = turn + 1 if moving is None else moving[turn] + 1
    return arrival, arrival if moving is None else moving[turn + 1], first


def _vertex(x: Floats, arrival: np.ndarray, departure: np.ndarray) -> tuple[Floats, np.ndarray]:
    """Calculate the distance of the reversal beyond the outermost sample (signed), and the first sample after it.

    The vertex of the parabola through the sample and its neighbours, at most an eighth of the larger neighbouring move
    beyond the sample. Two equal outermost samples are on both sides of the peak, as in the parabola; three or more are
    a rest or the resolution of the sensor, and the reversal is there.
    """
    before, here, after = x[arrival + _AROUND]
    came, leaves = here - before, here - after  # of one sign; `leaves` may be 0
    slope = came - leaves  # twice the velocity at the sample, in displacement per sample
    beyond = slope * slope / (8 * (came + leaves))
    # If it is slower on the far side, the reversal is after the sample.
    begin = arrival + 1 - (slope * came < 0)
    if departure is not arrival:
        rests = departure > arrival + 1
        beyond[rests] = 0.0
        begin[rests] = departure[rests] + 1
    return beyond, begin
