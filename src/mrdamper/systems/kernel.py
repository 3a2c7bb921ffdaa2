"""Time integration of a linear structure and the elements between its points.

Trapezoidal rule (Newmark, average acceleration) for the structure, solved together with the force of every element at
the end of the step: unconditionally stable for the structure and for elements of any stiffness. The discrete energy
balance holds to rounding for any step, so a gap indicates a wrong sign or a search that did not converge.

`mrdamper.systems.machine` runs the same loop compiled, for many steps or many runs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import ParameterError
from mrdamper.tracing import Program
from mrdamper.tracing.compiled import RecordProgram

_MAX_EVALUATIONS = 60  # evaluations of one element in one search
_MAX_SWEEPS = 50  # over all elements in one step
_FORCE_TOLERANCE = 1e-8  # of an element's largest force so far


@dataclass(frozen=True, eq=False)
class LoopElement:
    """A program for one sample with parameters, and the gain and offset of its first output."""

    source: RecordProgram
    given: tuple[float, ...]  # parameters
    derived: tuple[float, ...]  # constants that follow from these
    scale: tuple[float, float] = (1.0, 0.0)  # gain and offset

    @classmethod
    def of(cls, program: Program) -> LoopElement:
        """Return a traced program with the parameters it was traced with."""
        source = RecordProgram(program)
        return cls(source, program.given, source.prepare(program.given) or ())

    @property
    def program(self) -> Program:
        """The program."""
        return self.source.program

    @property
    def start(self) -> tuple[float, ...]:
        """Memory before the first sample."""
        return self.source.starts

    @property
    def sizes(self) -> tuple[int, int, int]:
        """Numbers of parameters, derived constants and memory values."""
        return len(self.given), len(self.derived), len(self.start)

    def at(self, given: tuple[float, ...], scale: tuple[float, float]) -> LoopElement:
        """Return the element with other parameters and scale; raises `ParameterError` if they need another program."""
        derived = self.source.prepare(given)
        if derived is None or len(given) != len(self.given):
            raise ParameterError("parameters that need another program", remedy="trace that damper by itself")
        return LoopElement(self.source, given, derived, scale)


@dataclass(frozen=True, eq=False)
class ElementParameters:
    """Concatenated parameters of all elements, and where those of each begin."""

    given: Floats
    derived: Floats
    start: Floats

    @classmethod
    def of(cls, elements: Sequence[LoopElement]) -> ElementParameters:
        """Concatenate gain, offset and parameters, derived constants, and memory of every element."""
        parts = [(*e.scale, *e.given) for e in elements], [e.derived for e in elements], [e.start for e in elements]
        return cls(*(np.array([*chain.from_iterable(part)], dtype=float) for part in parts))


def interpreted_loop(elements: Sequence[LoopElement], control: LoopElement | None) -> Callable[..., int]:
    """Return the loop for these stages in the interpreter: `walk` without its first two arguments.

    Elements compute force [N] and flags from displacement [m], velocity [m/s], acceleration [m/s²], command [A] and dt
    [s]; the control computes one command [A] per element from signals and dt.
    """
    ends = np.cumsum([[0, 0, 0], *([2 + p, d, m] for p, d, m in (e.sizes for e in elements))], axis=0).tolist()

    def evaluate(j, p, d, memory, later, x, v, a, current, dt):
        (p0, d0, m0), (p1, d1, m1) = ends[j : j + 2]
        given = (_numbers(part) for part in (p[p0 + 2 : p1], d[d0:d1], memory[m0:m1]))
        status, out, later[m0:m1] = elements[j].source.step(*given, (x, v, a, current, dt))
        return status, p[p0] * out[0] + p[p0 + 1], out[1]

    def command(p, d, memory, y, out):
        assert control is not None
        inputs = _numbers(y[: len(control.program.tape.inputs)])
        status, out[:], memory[:] = control.source.step(_numbers(p[2:]), _numbers(d), _numbers(memory), inputs)
        return status

    return partial(walk, evaluate, command)


def _numbers(values: Floats) -> tuple[float, ...]:
    return tuple(values.tolist())


def slope_and_scale(count: int) -> tuple[Floats, Floats]:
    """Slopes of the elements' forces [N s/m] and their largest forces [N], as start values of a search."""
    return np.zeros(count), np.full(count, 1e-6)


def search(evaluate, j, p, d, memory, later, state, free, compliance, current, dt, slope, scale):
    """Solve for the end velocity and force of one element.

    The structure moves by `u = free − compliance f`, and the force of the element is D(u). Their difference increases
    with u, so that a secant method within a bracket converges, also at a jump of D.
    """
    x0, u0, f0, drift = state
    low, high = -math.inf, math.inf
    gap_low, gap_high = 0.0, 0.0
    stiff = 1.0 / compliance
    u = (free * stiff + slope * u0 - f0) / (slope + stiff)  # extrapolated along the slope
    last_u, last_gap = u, 0.0
    f, flags = f0, 0.0
    for k in range(_MAX_EVALUATIONS):
        status, f, flags = evaluate(
            j, p, d, memory, later, x0 + 0.5 * dt * (u + u0) + drift, u, (u - u0) / dt, current, dt
        )
        if status != 0 or not math.isfinite(f):
            return 1, u, f, flags, slope
        line = (free - u) * stiff
        gap = f - line
        if abs(gap) <= _FORCE_TOLERANCE * scale or abs(gap) * compliance <= 1e-14 * (abs(u) + abs(free)):
            return 0, u, line, flags, slope
        if k > 0 and u != last_u:
            slope = max((gap - last_gap) / (u - last_u) - stiff, -0.5 * stiff)
        if gap > 0:
            high, gap_high = u, gap
        else:
            low, gap_low = u, gap
        last_u, last_gap = u, gap
        u = u - gap / (slope + stiff)
        if (k >= 3 and not (low < u < high)) or k > 8:
            if math.isinf(low):
                u = high - 2.0 * gap_high * compliance
            elif math.isinf(high):
                u = low - 2.0 * gap_low * compliance
            else:
                u = 0.5 * (low + high)
    if not (math.isinf(low) or math.isinf(high)):  # a jump: the structure determines the force
        return 0, u, (free - u) * stiff, flags, slope
    return 1, u, f, flags, slope


def walk(
    evaluate, command, dt, every, P, Q, R, G, B, loads, road, road_rate, H, driven, p, d, memory, cp, cd, cm, slope,
    scale, currents, x, v, f, flags,
    ):  # fmt: skip
    """Fill x, v (N, n), f, currents, flags (N, E) from their first rows on; the step that failed, or −1.

    A record may be computed in parts: `memory`, `cm`, `slope` and `scale` (E,) are updated for the next part, and the
    last row of one part is the first of the next.

    End velocity of the points is 2 (P v + Q x + load − R f_mean) − v. `loads` (N, n) is the response to the mean load
    of the step that ends there, `road` and `road_rate` (N, E) the contribution of the input to an element's stroke and
    its rate, `seen` (N, S) to a signal.
    """
    samples, n = x.shape
    count = f.shape[1]
    later = memory.copy()
    mean, free = np.zeros(n), np.zeros(count)
    signals, held = np.zeros(H.shape[0] + 1), currents[0].copy()
    for i in range(1, samples):
        if H.shape[0] > 0 and (i - 1) % every == 0:
            state = (*x[i - 1], *v[i - 1], *f[i - 1])
            for s in range(H.shape[0]):
                signals[s] = _plus_product(driven[i - 1, s], H[s], state)
            signals[H.shape[0]] = every * dt
            if command(cp, cd, cm, signals, held) != 0:
                return i
        currents[i] = held
        for r in range(n):
            total = loads[i, r]
            for k in range(n):
                total += P[r, k] * v[i - 1, k] + Q[r, k] * x[i - 1, k]
            mean[r] = _plus_product(total, -0.5 * R[r], f[i - 1])
        for j in range(count):
            free[j] = _plus_product(road_rate[i, j], B[j], 2.0 * mean - v[i - 1])
        f[i] = f[i - 1]
        for _ in range(_MAX_SWEEPS):
            moved = 0.0
            for j in range(count):
                began = _start_of(j, i, dt, B, road, road_rate, x, v, f)
                others = np.arange(count) != j
                line = _plus_product(free[j], -G[j][others], f[i][others])
                status, _u, force, flag, slope[j] = search(
                    evaluate, j, p, d, memory, later, began, line, G[j, j], currents[i, j], dt, slope[j], scale[j]
                )
                if status != 0:
                    return i
                scale[j] = max(scale[j], abs(force))
                if j > 0:  # the elements before it were solved with its former force
                    moved = max(moved, abs(force - f[i, j]) / scale[j])
                f[i, j], flags[i, j] = force, flag
            if moved <= 10 * _FORCE_TOLERANCE:
                break
        memory[:] = later
        for r in range(n):
            total = _plus_product(mean[r], -0.5 * R[r], f[i])
            v[i, r] = 2.0 * total - v[i - 1, r]
            x[i, r] = x[i - 1, r] + dt * total
    return -1


def _plus_product(start, row, values):
    """Return start + row · values, summed from left to right as the compiled loop does."""
    for a, b in zip(row, values, strict=True):
        start += a * b
    return start


def _start_of(j, i, dt, B, road, road_rate, x, v, f):
    """Return stroke, its rate and the force of element j where step i begins, and the road's part of its movement."""
    x0 = _plus_product(road[i - 1, j], B[j], x[i - 1])
    u0 = _plus_product(road_rate[i - 1, j], B[j], v[i - 1])
    drift = road[i, j] - road[i - 1, j] - 0.5 * dt * (road_rate[i, j] + road_rate[i - 1, j])
    return x0, u0, f[i - 1, j], drift
