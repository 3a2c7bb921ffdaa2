"""Compiled time integration: `loop.c` with the C programs of the elements and the control law."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from mrdamper.systems.kernel import ElementParameters, LoopElement, interpreted_loop, slope_and_scale
from mrdamper.tracing.c_writer import PREAMBLE, functions
from mrdamper.tracing.compiled.cache import load
from mrdamper.tracing.compiled.record import address

_LOOP = Path(__file__).with_name("loop.c")
_STEPS = 40  # steps over which a new library is compared with the interpreter
_MAX_RELATIVE_DIFFERENCE = 1e-9  # relative difference allowed there

_EVALUATE = """
static int evaluate(whole j, const real *p, const real *d, const real *memory, real *later, real x, real v, real a,
    real current, real dt, real *force, real *flags)
{{
    const real u[5] = {{x, v, a, current, dt}};
    real out[2];
    switch (j) {{
{cases}    default:
        return 0;
    }}
}}
"""
_CASE = """    case {index}:
        memcpy(later + {m}, memory + {m}, {size} * sizeof(real));
        if (!step_{program}(p + {p} + 2, d + {d}, later + {m}, u, out)) {{
            return 0;
        }}
        *force = p[{p}] * out[0] + p[{p} + 1];
        *flags = out[1];
        return 1;
"""
_COMMAND = """
static int command(const real *p, const real *d, real *memory, const real *signals, real *out)
{{
    {body}
}}
"""


def compiled_loop(elements: Sequence[LoopElement], control: LoopElement | None) -> Callable[..., int] | None:
    """Return the loop for these stages, compiled; None without a usable compiler. Arguments as `interpreted_loop`."""
    library = _library(tuple(elements), control)
    return None if library is None else _walk_of(library)


@lru_cache(maxsize=16)
def _library(elements: tuple[LoopElement, ...], control: LoopElement | None) -> ctypes.CDLL | None:
    def holds(library: ctypes.CDLL) -> bool:
        return _alike(_walk_of(library), interpreted_loop(elements, control), elements, control)

    return load(_source(elements, control), holds)


def _source(elements: Sequence[LoopElement], control: LoopElement | None) -> str:
    programs = list({id(stage.program): stage.program for stage in elements}.values())
    places = {id(program): index for index, program in enumerate(programs)}
    begins = np.cumsum([[0, 0, 0], *([2 + p, d, m] for p, d, m in (e.sizes for e in elements))], axis=0).tolist()
    cases = "".join(
        _CASE.format(index=i, program=places[id(stage.program)], p=p, d=d, m=m, size=len(stage.start))
        for i, (stage, (p, d, m)) in enumerate(zip(elements, begins, strict=False))
    )
    text = PREAMBLE + "".join(functions(program, index) for index, program in enumerate(programs))
    text += _EVALUATE.format(cases=cases)
    body = "return 1;"
    if control is not None:
        text += functions(control.program, len(programs))
        body = f"return step_{len(programs)}(p + 2, d, memory, signals, out);"
    return text + _COMMAND.format(body=body) + "\n" + _LOOP.read_text(encoding="utf-8")


def _walk_of(library: ctypes.CDLL) -> Callable[..., int]:
    run = library.walk
    run.restype = ctypes.c_longlong

    def walk(
        dt: float, every: int, P, Q, R, G, B, loads, road, road_rate, H, driven, p, d, memory, cp, cd, cm, slope, scale,
        currents, x, v, f, flags,
    ) -> int:  # fmt: skip
        samples, n = x.shape
        count, signals = f.shape[1], H.shape[0]
        sizes = np.array([samples, n, count, signals, every, memory.size], dtype=np.int64)
        given = [np.ascontiguousarray(a) for a in (P, Q, R, G, B, loads, road, road_rate, H, driven, p, d, cp, cd)]
        work = np.zeros(3 * n + 3 * count + signals + memory.size + 1)
        inputs, outputs = (
            np.array([a.ctypes.data for a in arrays], dtype=np.uintp)
            for arrays in (given, (memory, cm, slope, scale, currents, x, v, f, flags))
        )
        return int(run(ctypes.c_double(dt), address(sizes), address(inputs), address(outputs), address(work)))

    return walk


def _alike(
    one: Callable[..., int], other: Callable[..., int], elements: Sequence[LoopElement], control: LoopElement | None
) -> bool:
    """Tell if two loops give the same motion of one mass on a spring, with all elements beside it, for some steps."""
    count, dt = len(elements), 1e-3
    numbers, law = ElementParameters.of(elements), ElementParameters.of([] if control is None else [control])
    mass, stiffness = 300.0, 2e4
    S = np.array([[1 / (2 / dt * mass + dt / 2 * stiffness)]])
    B, H = np.ones((count, 1)), np.zeros((0 if control is None else len(control.program.tape.inputs) - 1, 2 + count))
    R = S @ B.T
    turns = np.linspace(0.0, 4.0, _STEPS)[:, None]
    loads = S[0, 0] * 500.0 * np.sin(turns)
    still = np.zeros((_STEPS, count))
    results = []
    for walk in (one, other):
        x, v = np.zeros((2, _STEPS, 1))
        f, flags = np.zeros((2, _STEPS, count))
        currents = np.full((_STEPS, count), 0.1)
        try:
            failed = walk(
                dt, 1, S * 2 / dt * mass, -S * stiffness, R, B @ R, B, loads, still, still.copy(), H,
                np.zeros((_STEPS, H.shape[0])), numbers.given, numbers.derived, numbers.start.copy(), law.given,
                law.derived, law.start.copy(), *slope_and_scale(count), currents, x, v, f, flags,
            )  # fmt: skip
        except (ValueError, ArithmeticError):
            return True  # of the interpreter, where compiled code continues with values that are not finite
        results.append((failed, np.column_stack([x, v, f, currents])))
    (failed, motion), (expected, reference) = results
    size = np.abs(reference).max(axis=0) + 1e-30
    return failed == expected and bool(np.all(np.abs(motion - reference) <= _MAX_RELATIVE_DIFFERENCE * size))
