"""A traced program along whole records: compiled with a compiler, otherwise in the interpreter."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mrdamper.tracing import Program
from mrdamper.tracing.c_writer import record_source
from mrdamper.tracing.compiled.cache import load
from mrdamper.tracing.python import python_functions, python_source

Floats = NDArray[np.float64]
_MIN_COMPILED_LINES = 1_000_000  # lines executed in the interpreter, from which a program is compiled
_COMPARED_SAMPLES = 24  # samples on which a new library is compared with the interpreter
_POSITIVE = {"current": 1.0, "frequency": 1.0, "amplitude": 1e-2}  # positive inputs of this comparison [A], [Hz], [m]
_MAX_DIFFERENCE = 1e-9  # relative difference allowed in this comparison


@dataclass(frozen=True, eq=False)
class Channels:
    """Inputs along a record, and their addresses and strides for a library."""

    arrays: Sequence[Floats]  # each (N,), in the order of the program's inputs
    places: NDArray[np.uintp]
    strides: NDArray[np.int64]

    @classmethod
    def of(cls, channels: Iterable[ArrayLike]) -> Self:
        """Locate the elements of arrays, which are converted if they are no floats."""
        arrays = [np.asarray(channel, dtype=float) for channel in channels]
        places = np.array([array.ctypes.data for array in arrays], dtype=np.uintp)
        return cls(arrays, places, np.array([array.strides[0] // 8 for array in arrays], dtype=np.int64))

    @cached_property
    def addresses(self) -> tuple[ctypes.c_void_p, ctypes.c_void_p]:
        """Pointers to the addresses and to the strides."""
        return address(self.places), address(self.strides)


@dataclass(frozen=True, eq=False)
class Along:
    """A program along a record."""

    outputs: Floats  # (K, N)
    memory: tuple[float, ...]  # after the last sample with a result
    failed: int  # the first sample without a result; −1 if all have one


class RecordProgram:
    """A program for one sample that runs along records."""

    def __init__(self, program: Program):
        self.program = program
        self.starts = tuple(program.tape.starts.values())
        self._prepare, self.step = python_functions(program)
        self._walked = 0

    def prepare(self, given: Sequence[float]) -> tuple[float, ...] | None:
        """Calculate the constants that follow from parameters; None where they need another program."""
        try:
            status, derived = self._prepare(tuple(given))
        except (ValueError, ArithmeticError):
            return None
        return None if status else derived

    def along(
        self, given: Sequence[float], derived: Sequence[float], memory: Sequence[float], channels: Sequence[ArrayLike]
    ) -> Along:
        """Run along a record: channels (N,) are the inputs in the program's order.

        Arguments are the parameters, the constants from `prepare`, and the memory before the first sample: `starts` for
        a damper at rest.
        """
        arrays = [np.asarray(channel, dtype=float) for channel in channels]
        self._walked += arrays[0].size * self.lines
        if self._walked > _MIN_COMPILED_LINES and (library := self._library) is not None:
            return self._run(library, given, derived, memory, Channels.of(arrays))
        return self.interpreted_along(given, derived, memory, arrays)

    def compiled_along(
        self,
        given: Sequence[float],
        derived: Sequence[float],
        memory: Sequence[float],
        channels: Sequence[ArrayLike] | Channels,
        picked: NDArray[np.intp] | None = None,
        begins: NDArray[np.intp] | None = None,
    ) -> Along | None:
        """Compute the same as `along`, compiled whatever the length; None without a usable compiler.

        Outputs are those of all samples, or of some at ascending indices. At `begins` the memory is reset.
        """
        if (library := self._library) is None:
            return None
        channels = channels if isinstance(channels, Channels) else Channels.of(channels)
        return self._run(library, given, derived, memory, channels, picked, begins)

    def interpreted_along(
        self, given: Sequence[float], derived: Sequence[float], memory: Sequence[float], arrays: Sequence[Floats]
    ) -> Along:
        outputs = np.empty((len(self.program.outputs), arrays[0].size))
        held, given, derived = tuple(memory), tuple(given), tuple(derived)
        for i, sample in enumerate(zip(*(channel.tolist() for channel in arrays), strict=True)):
            try:
                status, out, after = self.step(given, derived, held, sample)
            except (ValueError, ArithmeticError):
                return Along(outputs, held, i)
            if status:
                return Along(outputs, held, i)
            outputs[:, i], held = out, after
        return Along(outputs, held, -1)

    def _run(
        self,
        library: ctypes.CDLL,
        given: Sequence[float],
        derived: Sequence[float],
        memory: Sequence[float],
        channels: Channels,
        picked: NDArray[np.intp] | None = None,
        begins: NDArray[np.intp] | None = None,
    ) -> Along:
        numbers = np.array([*given, 0.0, *derived, 0.0, *memory, 0.0], dtype=float)
        p = numbers.ctypes.data
        d = p + 8 * (len(given) + 1)
        s = d + 8 * (len(derived) + 1)
        size = channels.arrays[0].size
        outputs = np.empty((len(self.program.outputs), size if picked is None else picked.size))
        indices = None if picked is None else np.ascontiguousarray(picked, dtype=np.int64)
        restarts = None if begins is None else np.append(begins, size).astype(np.int64)
        along = library.along
        along.restype = ctypes.c_longlong
        failed = along(
            ctypes.c_void_p(p), ctypes.c_void_p(d), ctypes.c_void_p(s), ctypes.c_longlong(size), *channels.addresses,
            None if indices is None else address(indices), ctypes.c_longlong(outputs.shape[1]),
            None if restarts is None else address(restarts), address(outputs),
        )  # fmt: skip
        return Along(outputs, tuple(numbers[-1 - len(memory) : -1].tolist()), int(failed))

    @cached_property
    def lines(self) -> int:
        """Lines of the program, the cost of a sample in the interpreter."""
        return python_source(self.program).count("\n")

    @cached_property
    def _source(self) -> str:
        return record_source(self.program)

    @property
    def _library(self) -> ctypes.CDLL | None:
        return load(self._source, self._holds)

    def _holds(self, library: ctypes.CDLL) -> bool:
        """Tell if a library computes the same as the interpreter on a short motion."""
        turns = np.linspace(0.1, 6.0, _COMPARED_SAMPLES)
        values: Mapping[str, Floats] = {
            "dt": np.full(_COMPARED_SAMPLES, 1e-3),
            **{name: size * (0.5 + 0.1 * turns) for name, size in _POSITIVE.items()},
        }
        arrays = [values.get(name, (1 + k) * 1e-2 * np.sin(turns)) for k, name in enumerate(self.program.tape.inputs)]
        given = self.program.given
        derived = self.prepare(given)
        if derived is None:
            return True
        outputs = self._run(library, given, derived, self.starts, Channels.of(arrays))
        expected = self.interpreted_along(given, derived, self.starts, arrays)
        size = _COMPARED_SAMPLES if expected.failed < 0 else expected.failed
        if 0 <= outputs.failed < size:  # a division by zero raises in the interpreter, and may have no effect in C
            return False
        wanted = expected.outputs[:, :size]
        if not np.isfinite(wanted).all():
            return True
        room = _MAX_DIFFERENCE * np.abs(wanted).max(axis=1, keepdims=True, initial=0.0)
        return bool(np.all(np.abs(outputs.outputs[:, :size] - wanted) <= room))


def address(array: np.ndarray) -> ctypes.c_void_p:
    """Return where the elements of an array are stored; the caller keeps the array until the call has ended."""
    return ctypes.c_void_p(array.ctypes.data)
