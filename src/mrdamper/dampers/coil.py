"""Lag of the field, and so of the yield force, behind the coil current, and the current driver.

Flux increases and decreases with different lags, by eddy currents and, for the decrease, by free-wheeling of the
driver. The field of a damper is symmetric: only the magnitude of the current counts, with a coil or without.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import numpy as np

from mrdamper.data.arrays import Floats
from mrdamper.data.strict_text import STRICT
from mrdamper.errors import ParameterError
from mrdamper.tracing import Tape, choose, program
from mrdamper.tracing.compiled.record import RecordProgram

_MAX_LAG_S = 10.0  # s; the longest lag of a coil


@dataclass(frozen=True)
class Driver:
    """Current driver: gain, coil lag and limit from the command voltage to the current.

    Behind an amplifier without current control the current lags by L/R. Zero inductance is a current controller,
    without a lag. Raises `ParameterError` if a value is not possible.
    """

    __pydantic_config__: ClassVar = STRICT

    amperes_per_volt: float  # gain of the amplifier; for a bare coil one over its resistance
    resistance_ohm: float = 0.0  # of the coil
    inductance_H: float = 0.0  # of the coil
    limit_A: float | None = None  # largest magnitude of current it delivers, if there is a limit

    def __post_init__(self) -> None:
        for name, value, good in (
            ("amperes_per_volt", self.amperes_per_volt, 0 < abs(self.amperes_per_volt) < math.inf),
            ("resistance_ohm", self.resistance_ohm, 0 <= self.resistance_ohm < math.inf),
            ("inductance_H", self.inductance_H, 0 <= self.inductance_H < math.inf),
            ("limit_A", self.limit_A, self.limit_A is None or 0 < self.limit_A < math.inf),
            ("resistance_ohm", self.resistance_ohm, self.resistance_ohm > 0 or self.inductance_H == 0),
        ):
            if not good:
                raise ParameterError(
                    f"{name} = {value:g}",
                    where="coil driver",
                    remedy="a gain, R, L >= 0 (R with L), a limit above zero",
                )

    @property
    def lag_s(self) -> float:
        """L/R [s]; zero under current control."""
        return self.inductance_H / self.resistance_ohm if self.inductance_H else 0.0

    def current(self, time: Floats, volts: Floats) -> Floats:
        """(N,) current [A] of (N,) command voltages [V] at (N,) times [s]."""
        limit = self.limit_A or math.inf
        amperes = np.clip(self.amperes_per_volt * np.asarray(volts, dtype=float), -limit, limit)
        return field_current(time, amperes, self.lag_s, self.lag_s, signed=True)


@dataclass(frozen=True)
class Coil:
    """Lags of the field behind the current.

    Raises `ParameterError` if a time constant is negative, not finite, or over 10 s.
    """

    __pydantic_config__: ClassVar = STRICT

    # rise_s, fall_s: time constants while the field grows and while it decays; zero follows at once
    rise_s: float
    fall_s: float
    driver: Driver | None = None  # source of the current, if the input is a voltage

    def __post_init__(self) -> None:
        for name, value in (("rise_s", self.rise_s), ("fall_s", self.fall_s)):
            if not 0 <= value <= _MAX_LAG_S:
                raise ParameterError(f"{name} = {value:g} s", where="coil", remedy=f"give 0 to {_MAX_LAG_S:g} s")

    def along(self, time: Floats, current: Floats) -> Floats:
        """(N,) current [A] of the present field at (N,) times [s]; see `field_current`."""
        return field_current(time, current, self.rise_s, self.fall_s)

    def step(self, tape: Tape, dt: Any, size: Any) -> Any:
        """`along` for one sample, on a tape; `size` is the magnitude of the current, `dt` the step of time."""
        return field_step(tape, dt, size, self.rise_s, self.fall_s) if max(self.rise_s, self.fall_s) > 0 else size


def field_current(time: Floats, current: Floats, rise: float, fall: float, signed: bool = False) -> Floats:
    """Return the current (N,) whose steady field is the present one: the lagged magnitude of a current (N,) [A].

    T di/dt + i = |I|, T = `rise` [s] while |I| > i and `fall` [s] while |I| < i, exact for |I| straight between the
    times (N,) [s]; settled at the first sample. `signed`: lag the current itself, not its magnitude, as behind a
    driver's L/R.
    """
    wanted = np.asarray(current, dtype=float) if signed else np.abs(current)
    if (rise <= 0 and fall <= 0) or not np.any(np.diff(wanted)):
        return wanted.copy()
    record, given = _field_record(), (float(rise), float(fall))
    derived = record.prepare(given)
    assert derived is not None
    return record.along(given, derived, record.starts, (np.diff(time, prepend=time[0] - 1.0), wanted)).outputs[0]


@cache
def _field_record() -> RecordProgram:
    """Return `field_step` as a program, whose lags can be set."""
    tape = Tape()
    step, wanted = tape.input("dt"), tape.input("current")
    lags = (tape.parameter(name, 1.0) for name in ("rise", "fall"))
    return RecordProgram(program(tape, {"field": field_step(tape, step, wanted, *lags)}))


def field_step(tape: Tape, step: Any, wanted: Any, rise: Any, fall: Any) -> Any:
    """`field_current` for one sample, on a tape: dg/dt = s − g/T for the gap g to a wanted current of slope s.

    If the two become equal within the step of time `step`, the other lag holds from there on.
    """
    change = wanted - tape.previous(wanted, "wanted_current")
    gap = tape.remember("current_gap")
    slope = change / step
    upward = (gap > 0) | ((gap <= 0) & (gap >= 0) & (change > 0))
    constant, other = tape.select(upward, rise, fall), tape.select(upward, fall, rise)
    against = gap * change < 0
    met = choose(
        against & (constant > 0),
        lambda: constant * np.log1p(-gap / (slope * constant)),
        lambda: tape.select(against, 0.0, step),
    )
    crosses = against & (met < step)
    left, lag = tape.select(crosses, step - met, step), tape.select(crosses, other, constant)
    begin = tape.select(crosses, 0.0, gap)
    moved = choose(lag > 0, lambda: begin + (begin - slope * lag) * np.expm1(-left / lag), lambda: 0.0 * left)
    gap_now = tape.select(tape.first, 0.0, moved)
    tape.update(gap, gap_now)
    return wanted - gap_now
