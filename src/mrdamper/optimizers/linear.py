"""One thread for the linear algebra: the same bits whatever the machine offers.

Matrices here are small, so threads of the linear algebra gain nothing, wait for each other on a
busy machine, and add up sums in another order, which changes the last bits of a result.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, wraps
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Hold the linear algebra to one thread inside the block.

    It takes threadpoolctl. Without it, set OMP_NUM_THREADS=1 and OPENBLAS_NUM_THREADS=1 (or
    MKL_NUM_THREADS=1) before Python starts for results that agree to the last bit between machines
    of different numbers of cores.
    """
    controller = _controller()
    if controller is None:
        yield
        return
    with controller.limit(limits=1, user_api="blas"):
        yield


def on_one_blas_thread(function: Callable[P, T]) -> Callable[P, T]:
    """Run a function inside `one_blas_thread`."""

    @wraps(function)
    def held(*args: P.args, **kwargs: P.kwargs) -> T:
        with one_blas_thread():
            return function(*args, **kwargs)

    return held


@cache
def _controller() -> Any:
    try:
        from threadpoolctl import ThreadpoolController
    except ModuleNotFoundError:
        return None
    import numpy as np

    np.linalg.inv(np.eye(2))  # the library to be held has to be loaded first
    return ThreadpoolController()
