"""`Excitation`: motion and current in time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mrdamper.data.arrays import Floats
from mrdamper.errors import ExcitationError, validate_arguments
from mrdamper.physics.motion.path import Path

_STILL, _REST = 0.01, 0.1  # share of the peak speed below which a motion is at rest, and its shortest duration [s]


@dataclass(frozen=True, eq=False)
class Excitation:
    """Motion and current at the samples of one stretch of time.

    Attributes
    ----------
    time, displacement, velocity, acceleration, current : (N,) arrays
        [s], [m], [m/s], [m/s²], [A]; all but the time may be scalars.

    Raises
    ------
    ExcitationError
        If an array has another number of samples than the time.

    Examples
    --------
    >>> import numpy as np
    >>> from mrdamper import Excitation
    >>> t = np.linspace(0.0, 1.0, 1001)
    >>> v = 0.1 * np.cos(2 * np.pi * t)
    >>> motion = Excitation(t, 0.1 * np.sin(2 * np.pi * t) / (2 * np.pi), v, np.gradient(v, t), 0.5)
    >>> motion.current.shape
    (1001,)
    """

    time: Floats
    displacement: Floats
    velocity: Floats
    acceleration: Floats
    current: Floats

    def __post_init__(self) -> None:
        size = self.time.size
        for name in ("displacement", "velocity", "acceleration", "current"):
            array = np.asarray(getattr(self, name), dtype=float)
            if array.shape not in ((), (1,), (size,)):
                raise ExcitationError(f"{name} has {array.size} samples, time has {size}", remedy="give one for each")
            object.__setattr__(self, name, array if array.shape == (size,) else np.broadcast_to(array, (size,)))

    def __len__(self) -> int:
        return self.time.size

    @cached_property
    def path(self) -> Path:
        """The motion cut into strokes."""
        return Path.of(self.displacement)

    @cached_property
    def resting(self) -> NDArray[np.bool_]:
        """(N,) where the motion, after its begin, is at rest for a tenth of a second or longer."""
        speed = np.abs(self.velocity)
        moving = np.flatnonzero(speed > _STILL * speed.max()) if len(self) else np.zeros(0, dtype=int)
        still = np.zeros(len(self), dtype=bool)
        for begin, end in pairwise([*moving.tolist(), len(self)]):
            if end - begin > 2 and self.time[end - 1] - self.time[begin + 1] >= _REST:
                still[begin + 1 : end] = True
        return still

    def part(self, mask: ArrayLike | slice) -> Excitation:
        """Return the samples selected by a mask, slice or index."""
        pick = {name: getattr(self, name)[mask] for name in self.__dataclass_fields__}
        return Excitation(**pick)

    @validate_arguments()
    def with_current(self, current: ArrayLike) -> Excitation:
        """Return the same motion at another current [A], a scalar or one value per sample."""
        motion = replace(self, current=np.asarray(current, dtype=float))
        if "path" in self.__dict__:
            motion.__dict__["path"] = self.path  # the path does not depend on the current
        return motion

    @validate_arguments()
    def about(self, centre: float) -> Excitation:
        """Return the same motion with displacements counted from `centre` [m]."""
        return replace(self, displacement=self.displacement - centre)

    @validate_arguments()
    def delayed(self, delay: float) -> Excitation:
        """Return the motion `delay` seconds later, to first order in the delay, for small delays."""
        return replace(
            self,
            displacement=self.displacement - delay * self.velocity,
            velocity=self.velocity - delay * self.acceleration,
        )
