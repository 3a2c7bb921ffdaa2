"""How the kernels are compiled. Importing this module imports numba."""

from __future__ import annotations

from typing import Any

from numba import njit

_OPTIONS: dict[str, Any] = {"cache": True, "error_model": "numpy", "nogil": True, "fastmath": {"contract"}}
_NO_DOORS: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}  # for Python; they take time
_SUMS: dict[str, Any] = _OPTIONS | _NO_DOORS | {"fastmath": {"contract", "reassoc", "nsz"}}

kernel = njit(**_OPTIONS)
inner = njit(**_OPTIONS, **_NO_DOORS)  # called from kernels only
inner_sum = njit(**_SUMS)  # sums in any order, or they could not be taken in vector registers
