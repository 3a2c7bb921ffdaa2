"""Tested ranges of a damper: flags of extrapolation, and the distance of a condition from the tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np

from mrdamper.dampers.distance import Distance, distance_from, tested_levels
from mrdamper.data.conditions import Condition, same_condition
from mrdamper.data.runs import Floats
from mrdamper.data.wording import number, span
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.statistics.functions.motion_hull import MotionHull
from mrdamper.statistics.linear import nonnegative_least_squares

SLACK = 0.02  # relative tolerance within which a condition is not extrapolated: a rig repeats it to a few per cent
COMBINATION = "combination"  # every quantity was tested, but not their combination
_SUM_WEIGHT = 10.0  # weight of the sum of shares, which is one, against distances in the hull
_UNITS = {"current": "A", "frequency": "Hz", "velocity": "m/s"}
SAME_CURRENT = 1e-3  # A; a current that varies less is one current
_LOGARITHM_FLOOR = 1e-12  # frequency [Hz] and amplitude [m] that replace zero in a logarithm
_SLIP = 20.0  # a quantity so many times outside the tests may have been given in another unit


class Beyond(NamedTuple):
    """A quantity that lies outside its tested range."""

    quantity: str
    value: float  # SI
    tested: tuple[float, float]

    def __str__(self) -> str:
        low, high = self.tested
        scale, unit = (1e3, "mm") if self.quantity == "amplitude" else (1, _UNITS[self.quantity])
        side, share = (
            ("above", self.value / high - 1 if high else np.inf)
            if self.value > high
            else ("below", 1 - self.value / low)
        )
        times = float(f"{1 + share:.2g}")
        by = f" by {100 * share:.0f} %" if share < 1 else f", {times:g} times the largest" if high else ""
        return (
            f"{self.quantity} {number(scale * self.value, 3)} {unit} lies {side} the tested range "
            f"({span(scale * low, scale * high, unit, to=' to ')}){by}{self._other_unit()}"
        )

    def _other_unit(self) -> str:
        """Name the unit in which a current or an amplitude would be a tested one, where milli- was forgotten."""
        (low, high), value = self.tested, self.value
        if self.quantity == "current" and value > _SLIP * high and low <= 1e-3 * value:
            return f"; {value:g} mA are {1e-3 * value:g} A"
        if self.quantity == "amplitude" and low > _SLIP * value and 1e3 * value <= high:
            return f"; {1e3 * value:g} m are {1e6 * value:g} mm"
        return ""


@dataclass(frozen=True)
class Envelope:
    """Ranges of the tests a damper was identified from: lowest and highest tested."""

    current_A: tuple[float, float]
    frequency_Hz: tuple[float, float]
    amplitude_m: tuple[float, float]
    peak_velocity_m_s: tuple[float, float]
    any_motion: bool = False  # motions that are no sine were among the tests
    any_record: bool = False  # records that are no sine at one current were among the tests
    # tested currents [A] with their frequencies [Hz] and amplitudes [m]; empty where only the ranges are known
    conditions: tuple[tuple[float, float, float], ...] = ()

    @classmethod
    def of(cls, conditions: Sequence[Condition]) -> Envelope:
        """Return the envelope of a set of tested conditions."""
        rows = [(c.current_A, c.frequency_Hz, c.amplitude_m, c.peak_velocity) for c in conditions]
        tested = tuple(_point(conditions[group[0]]) for group in same_condition(conditions))
        current, frequency, amplitude, velocity = ((min(values), max(values)) for values in zip(*rows, strict=True))
        return cls(current, frequency, amplitude, velocity, conditions=tested)

    def with_tests(self, conditions: Sequence[Condition]) -> Envelope:
        """Return the envelope with further tested sines at one current each, where its own conditions are known."""
        if not self.conditions:
            return self
        wider = Envelope.of([*self._tested, *conditions])
        names = ("current_A", "frequency_Hz", "amplitude_m", "peak_velocity_m_s")
        ends = {n: [*getattr(self, n), *getattr(wider, n)] for n in names}
        ranges = {name: (min(values), max(values)) for name, values in ends.items()}
        return replace(self, conditions=wider.conditions, **ranges)

    def with_motion(self, current: Floats, displacement: Floats, velocity: Floats, *, sine: bool = False) -> Envelope:
        """Return the envelope widened by the samples of a record that is no sine at one current."""

        def wider(span: tuple[float, float], values: Floats) -> tuple[float, float]:
            return min(span[0], float(np.min(values))), max(span[1], float(np.max(values)))

        moved = np.array([np.ptp(displacement) / 2])
        return replace(
            self,
            any_motion=self.any_motion or not sine,
            any_record=True,
            current_A=wider(self.current_A, np.abs(current)),
            amplitude_m=wider(self.amplitude_m, moved),
            peak_velocity_m_s=wider(self.peak_velocity_m_s, np.array([np.max(np.abs(velocity))])),
        )

    @property
    def tested(self) -> bool:
        """True where the tested ranges are known; a model without a damper has none."""
        return bool(np.isfinite([*self.current_A, *self.amplitude_m]).all())

    def ranges(self, to: str = "–") -> dict[str, str]:
        """Write the tested range of each quantity in the units of a test plan; `to` stands between its ends."""
        amplitudes = (1e3 * self.amplitude_m[0], 1e3 * self.amplitude_m[1])
        return {
            "current": span(*self.current_A, "A", to=to),
            "frequency": span(*self.frequency_Hz, "Hz", to=to),
            "amplitude": span(*amplitudes, "mm", to=to),
            "peak velocity": span(*self.peak_velocity_m_s, "m/s", to=to),
        }

    @property
    def middle(self) -> Condition:
        """The condition in the middle of the ranges."""
        return Condition(*(0.5 * (low + high) for low, high in (self.current_A, self.frequency_Hz, self.amplitude_m)))

    @property
    def corners(self) -> list[Condition]:
        """The conditions at the ends of the ranges."""
        return [Condition(*ends) for ends in product(self.current_A, self.frequency_Hz, self.amplitude_m)]

    @property
    def farthest(self) -> list[Condition]:
        """Combinations inside the ranges that may be far from any test: corners of the motions, currents between."""
        levels = sorted({point[0] for point in self.conditions}) or list(self.current_A)
        currents = [*levels, *((one + other) / 2 for one, other in pairwise(levels))]
        fastest = self.peak_velocity_m_s[1]
        motions = [
            (f, min(A, fastest / (2 * np.pi * max(f, _LOGARITHM_FLOOR))))
            for f, A in product(self.frequency_Hz, self.amplitude_m)
        ]
        return [Condition(current, *motion) for current in currents for motion in motions]

    def flags(self, condition: Condition) -> tuple[str, ...]:
        """List the quantities of a condition outside the tested ranges; empty inside the envelope."""
        outside = tuple(beyond.quantity for beyond in self.outside(condition))
        return outside or (() if self._combined(condition) else (COMBINATION,))

    def outside(self, asked: Condition | Excitation) -> tuple[Beyond, ...]:
        """Return the quantities of a condition, or of a motion that is no sine, outside the tested ranges."""
        if isinstance(asked, Condition):
            current, moved, velocity = (abs(asked.current_A),) * 2, asked.amplitude_m, asked.peak_velocity
            lowest, frequencies = velocity, [("frequency", (asked.frequency_Hz,) * 2, self.frequency_Hz)]
        else:
            currents = np.abs(asked.current)
            current, moved = (float(np.min(currents)), float(np.max(currents))), float(np.ptp(asked.displacement) / 2)
            velocity, lowest, frequencies = float(np.max(np.abs(asked.velocity))), np.inf, []  # it passes all below
        checks = (
            ("current", current, self.current_A),
            *frequencies,
            ("amplitude", (moved, moved), self.amplitude_m),
            ("velocity", (lowest, velocity), self.peak_velocity_m_s),
        )
        return tuple(
            Beyond(name, most if most > high * (1 + SLACK) else least, (low, high))
            for name, (least, most), (low, high) in checks
            if most > high * (1 + SLACK) or least < low - SLACK * high
        )

    def distance(self, condition: Condition, current: Floats) -> Distance:
        """Distance of a condition and the currents (N,) [A] along its motion; zero where only ranges are known."""
        if not self.conditions or condition.frequency_Hz <= 0 or condition.amplitude_m <= 0:
            return Distance()
        nearest = distance_from(self._tested, condition, current, swept_A=self._swept_A)
        if not self.any_motion:
            return nearest
        larger = max(0.0, np.log(condition.amplitude_m / self.amplitude_m[1]))
        faster = max(0.0, np.log(condition.peak_velocity / self.peak_velocity_m_s[1]))
        return replace(nearest, motion=min(nearest.motion, float(np.hypot(larger, faster))))

    @property
    def levels_A(self) -> Floats:
        """(L,) tested currents, ascending [A]; the lowest and the highest where it changed in a test."""
        return tested_levels(self._tested, self._swept_A)

    @property
    def _swept_A(self) -> tuple[float, float] | None:
        return self.current_A if self.any_record else None

    def nearest(self, condition: Condition) -> Condition:
        """Return the motion of the hull of the tested ones that is nearest to a condition, at its current."""
        frequency, amplitude = MotionHull.of(self._tested).nearest(condition.frequency_Hz, condition.amplitude_m)
        return Condition(condition.current_A, float(frequency), float(amplitude))

    def _combined(self, condition: Condition) -> bool:
        """Tell if a condition lies in the convex hull of the tested ones, in I, log f and log A (and log f·A)."""
        if not self.conditions or condition.frequency_Hz <= 0 or condition.amplitude_m <= 0:
            return True
        return _in_hull(self.conditions, max(self.current_A[1], SAME_CURRENT), _point(condition))

    @cached_property
    def _tested(self) -> tuple[Condition, ...]:
        return tuple(Condition(*point) for point in self.conditions)


@lru_cache(maxsize=4096)
def _in_hull(tested: tuple[tuple[float, float, float], ...], scale: float, asked: tuple[float, float, float]) -> bool:
    corners = np.array([_features(point, scale) for point in tested]) - _features(asked, scale)
    centred = np.column_stack([corners, np.full(len(corners), _SUM_WEIGHT)])
    return bool(nonnegative_least_squares(centred.T, np.array([0.0, 0.0, 0.0, _SUM_WEIGHT]))[1] < SLACK)


def _point(condition: Condition) -> tuple[float, float, float]:
    return abs(condition.current_A), condition.frequency_Hz, condition.amplitude_m


def _features(point: tuple[float, float, float], current_scale: float) -> Floats:
    return np.array([point[0] / current_scale, *np.log(np.maximum(point[1:], _LOGARITHM_FLOOR))])


_ANY = (-np.inf, np.inf)
UNTESTED = Envelope(_ANY, _ANY, _ANY, _ANY)
