"""Limits of a rig, and the rig time of its tests."""

from __future__ import annotations

import itertools
import math
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from mrdamper.dampers.base import Damper
from mrdamper.data import Condition, Floats
from mrdamper.rig_files.strict_toml import LimitsError, load_part

_MAX_SAMPLES = 500_000  # of a planned record
_RANGES = ("current_A", "frequency_Hz", "amplitude_mm")
_LEVELS = 4  # of each of them on the grid of candidates
_ROUNDING = 0.02  # largest relative change of a planned value by rounding
_Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]  # of a file
_Whole = Annotated[int, Field(strict=True)]


@dataclass(frozen=True)
class Limits:
    """Limits of a rig, each range from the lowest to the highest, and the time a test takes.

    Raises `InputError` (E_LIMITS) if they allow nothing, or appear to have another unit.
    """

    read_by: ClassVar = "mrdamper.study.limits.Limits.read(file) or .of(damper)"
    current_A: tuple[float, float]
    frequency_Hz: tuple[float, float]
    amplitude_mm: tuple[float, float]
    velocity_m_s: float = math.inf  # highest peak velocity
    force_N: float = 0.0  # rated force of the damper; only a plan without a model needs it
    cycles: float = 6.0  # of a record
    sample_rate_Hz: float = 500.0
    minutes_between: float = 3.0  # from the end of a record to the start of the next: set-up and cooling
    session_minutes: float = 10.0  # to begin a session: mount the damper, zero the load cell, warm up
    sessions: int = 12  # largest number; a plan uses the best number

    def __post_init__(self) -> None:
        for name in _RANGES:
            low, high = getattr(self, name)
            least = 0.0 if name == "current_A" else 1e-6
            if not least <= low <= high < math.inf:
                raise bad_limits(
                    f"{name} = [{low:g}, {high:g}]", "give the lowest and the highest, positive and in order"
                )
        for name in ("velocity_m_s", "cycles", "sample_rate_Hz", "sessions"):
            if not getattr(self, name) > 0:
                raise bad_limits(f"{name} = {getattr(self, name):g}", "give a number above zero")
        samples = self.cycles / self.frequency_Hz[0] * self.sample_rate_Hz
        if samples > _MAX_SAMPLES:
            text = f"a record of {self.cycles:g} cycles at {self.frequency_Hz[0]:g} Hz has {samples:.3g} samples"
            raise bad_limits(text, f"lower sample_rate_Hz or cycles to at most {_MAX_SAMPLES:,} samples")
        if self.sessions != int(self.sessions):
            raise bad_limits(f"sessions = {self.sessions:g}", "give a whole number")
        if min(self.minutes_between, self.session_minutes, self.force_N) < 0:
            raise bad_limits("a negative time or force", "give zero or more")
        for name, wrong, other in (
            ("amplitude_mm", self.amplitude_mm[0] > 1000, "µm"),
            ("amplitude_mm", self.amplitude_mm[1] < 0.1, "m"),
            ("current_A", self.current_A[1] > 100, "mA"),
            ("frequency_Hz", self.frequency_Hz[1] > 1000, "mHz"),
            ("velocity_m_s", math.inf > self.velocity_m_s > 50, "mm/s"),
        ):
            if wrong:
                raise bad_limits(f"{name} = {getattr(self, name)}", f"is that in {other}? The unit is part of the name")
        slowest = Condition(0.0, self.frequency_Hz[0], 1e-3 * self.amplitude_mm[0]).peak_velocity
        if slowest > self.velocity_m_s:
            raise bad_limits(
                f"the slowest motion has {slowest:.3g} m/s, the limit is {self.velocity_m_s:g} m/s",
                "allow a lower frequency or amplitude; velocity_m_s is in m/s",
            )

    @classmethod
    def read(cls, path: Path) -> Limits:
        """Read the rig limits of a limits file, whose keys are the attributes, units in their names.

        Raises `InputError` (E_LIMITS) if the file cannot be read, or a key is unknown, missing, or no number.
        """
        kinds: dict[str, Any] = {**dict.fromkeys(_RANGES, tuple[_Number, _Number]), "sessions": _Whole}
        part = {f.name: (kinds.get(f.name, _Number), ... if f.default is MISSING else f.default) for f in fields(cls)}
        return cls(**load_part(path, part))

    @classmethod
    def of(cls, damper: Damper) -> Limits:
        """Return the tested ranges of a damper."""
        e = damper.envelope
        ends = (e.current_A, e.frequency_Hz, (1e3 * e.amplitude_m[0], 1e3 * e.amplitude_m[1]))
        current, frequency, amplitude = ((set_value(low), set_value(high)) for low, high in ends)
        rate = min(cls.sample_rate_Hz, 0.5 * _MAX_SAMPLES * frequency[0] / cls.cycles)
        fastest = max(e.peak_velocity_m_s[1], Condition(0.0, frequency[0], 1e-3 * amplitude[0]).peak_velocity)
        return cls(current, frequency, amplitude, velocity_m_s=fastest, sample_rate_Hz=rate)

    @property
    def opening(self) -> float:
        """Set-up time of a session in addition to its records, which includes one pause [min]."""
        return max(self.session_minutes - self.minutes_between, 0.0)

    def minutes(self, condition: Condition) -> float:
        """Rig time of a record and the pause before it."""
        return self.cycles / condition.frequency_Hz / 60 + self.minutes_between

    def candidates(self, hours: float) -> list[Condition]:
        """Conditions on a grid inside the limits.

        Raises `InputError` (E_LIMITS) if nothing is allowed, or the hours do not hold one record.
        """
        current = _rounded(np.linspace(*self.current_A, _LEVELS))
        frequency, amplitude = (
            _rounded(np.geomspace(*ends, _LEVELS)) for ends in (self.frequency_Hz, self.amplitude_mm)
        )
        conditions = [
            Condition(float(i), float(f), 1e-3 * float(a))
            for i, f, a in itertools.product(current, frequency, amplitude)
        ]
        allowed = [c for c in conditions if c.peak_velocity <= self.velocity_m_s * (1 + 1e-9)]
        least = self.opening + min(self.minutes(c) for c in allowed)
        if not (math.isfinite(hours) and hours * 60 >= least):
            raise bad_limits(
                f"the rig time is {hours:g} hours",
                f"a session with its shortest record takes {least:.1f} minutes with setting up; give at least "
                f"{math.ceil(least / 0.6) / 100:g} hours",
            )
        return allowed


def set_value(value: float) -> float:
    """Round a value as an operator sets it: to two digits, or three where two change it by over 2 %."""
    rounded = float(f"{value:.2g}")
    return rounded if abs(rounded - value) <= _ROUNDING * abs(value) else float(f"{value:.3g}")


def _rounded(levels: Floats) -> Floats:
    """Levels as they are set, none of them beyond the first and the last one given."""
    return np.unique(np.clip([set_value(float(level)) for level in levels], levels[0], levels[-1]))


def bad_limits(problem: str, remedy: str) -> LimitsError:
    """Return the error for limits that cannot be used."""
    return LimitsError(problem, where="limits", remedy=remedy)
