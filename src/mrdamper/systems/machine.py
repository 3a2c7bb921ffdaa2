"""The loop as machine code. The loop itself is compiled once and kept on disk; what a damper or a law
answers enters through an address, and is all that is compiled anew. Importing this imports numba.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

from numba import cfunc, njit, types
from numba.core.errors import NumbaExperimentalFeatureWarning
from numba.extending import register_jitable
from numba.np.unsafe.ndarray import to_fixed_tuple

from mrdamper.systems import kernel

_number, _whole = types.float64, types.int64
_vector, _matrix = types.float64[::1], types.float64[:, ::1]
_evaluate = types.Tuple((_whole, _number, _number))(_whole, *[_vector] * 4, *[_number] * 5)
_command = _whole(*[_vector] * 5)

compile_ = njit(error_model="numpy")
register_jitable(error_model="numpy")(kernel.search)
_walk = njit(
    _whole(
        types.FunctionType(_evaluate), types.FunctionType(_command), _number, _whole, *[_matrix] * 10,
        *[_vector] * 6, *[_matrix] * 5,
    ),
    cache=True,
    error_model="numpy",
)(kernel.walk)  # fmt: skip


def evaluation(evaluate: Any) -> Any:
    """What answers for the elements, as an address."""
    return cfunc(_evaluate)(evaluate.py_func)


def command(command: Any) -> Any:
    """What answers for the law, as an address."""
    return cfunc(_command)(command.py_func)


def walk_of(evaluate: Any, command: Any) -> Callable[..., int]:
    """`kernel.walk` with what answers for the elements, and for the law."""

    def walk(*arguments: Any) -> int:
        with warnings.catch_warnings():  # functions by address are called experimental since numba 0.49
            warnings.simplefilter("ignore", NumbaExperimentalFeatureWarning)
            return _walk(evaluate, command, *arguments)

    return walk


def cut(begin: int, size: int) -> Any:
    """A function from an array to a tuple of `size` of its numbers."""
    if size == 0:
        return compile_(lambda values: ())
    return compile_(lambda values: to_fixed_tuple(values[begin : begin + size], size))  # type: ignore[call-arg]
