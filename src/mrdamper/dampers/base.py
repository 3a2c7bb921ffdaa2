"""An identified damper: something that predicts a force, and knows where it was tested.

Whatever the model behind it, a `Damper` answers two questions: the steady loop at a
condition, and the force along a measured motion. Each answer carries the flags of its
extrapolation.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mrdamper.dampers.coil import Coil
from mrdamper.data import Condition, Floats, Run
from mrdamper.motion import Excitation, equivalent_sine, measured_motion
from mrdamper.simulation import Response

NOT_A_SINE = "not a sine"
COARSE = "sampling"
_SAMPLES_IN_KNEE = 2  # below, the knee falls between samples
SLACK = 0.02  # a test bench repeats a condition to a few per cent; within that nothing is extrapolated


@dataclass(frozen=True)
class Envelope:
    """Ranges of the tests a damper was identified from.

    Attributes
    ----------
    current_A, frequency_Hz, amplitude_m, peak_velocity_m_s : (float, float)
        Lowest and highest tested.
    """

    current_A: tuple[float, float]
    frequency_Hz: tuple[float, float]
    amplitude_m: tuple[float, float]
    peak_velocity_m_s: tuple[float, float]

    @classmethod
    def of(cls, conditions: Sequence[Condition]) -> Envelope:
        """The envelope of a set of tested conditions."""

        def span(values: list[float]) -> tuple[float, float]:
            return min(values), max(values)

        return cls(
            span([c.current_A for c in conditions]),
            span([c.frequency_Hz for c in conditions]),
            span([c.amplitude_m for c in conditions]),
            span([c.peak_velocity for c in conditions]),
        )

    def flags(self, condition: Condition) -> tuple[str, ...]:
        """Which quantities of a condition lie outside: empty inside the envelope."""
        checks = (
            ("current", abs(condition.current_A), self.current_A),
            ("frequency", condition.frequency_Hz, self.frequency_Hz),
            ("amplitude", condition.amplitude_m, self.amplitude_m),
            ("velocity", condition.peak_velocity, self.peak_velocity_m_s),
        )
        return tuple(
            name for name, value, (low, high) in checks if value < low - SLACK * high or value > high * (1 + SLACK)
        )

    def motion_flags(self, motion: Excitation) -> tuple[str, ...]:
        """Which quantities of a motion that is no sine lie outside."""
        moved = float(np.ptp(motion.displacement) / 2)
        checks = (
            ("current", float(np.min(np.abs(motion.current))), float(np.max(np.abs(motion.current))), self.current_A),
            ("amplitude", moved, moved, self.amplitude_m),
            ("velocity", 0.0, float(np.max(np.abs(motion.velocity))), self.peak_velocity_m_s),
        )
        return tuple(
            name
            for name, lowest, highest, (low, high) in checks
            if highest > high * (1 + SLACK) or (name != "velocity" and lowest < low - SLACK * high)
        )


def samples_in_knee(motion: Excitation, knee: float) -> float:
    """Samples a motion has, after the median reversal, before it has moved on by `knee` [m]."""
    path = motion.path
    inside = np.bincount(path.stroke[path.distance < knee], minlength=path.stroke[-1] + 1)
    return float(np.median(inside[1:])) if inside.size > 1 else np.inf


@dataclass(frozen=True, eq=False)
class Prediction:
    """A predicted force.

    Attributes
    ----------
    motion : Excitation
    force : (N,) array
        [N]
    condition : Condition
        That the prediction was made for, or that the motion amounts to.
    extrapolation : tuple of str
        Quantities outside the tested envelope; empty inside.
    """

    motion: Excitation
    force: Floats
    condition: Condition
    extrapolation: tuple[str, ...]


class Damper(ABC):
    """An identified damper."""

    kind: ClassVar[str]
    rig: str
    envelope: Envelope
    provenance: Mapping[str, str]
    coil: Coil | None

    @property
    @abstractmethod
    def title(self) -> str:
        """What to call it in a report."""

    @property
    @abstractmethod
    def parameter_count(self) -> int:
        """Numbers determined from the data."""

    @property
    def knee(self) -> float | None:
        """Motion after a reversal in which the force turns over [m], where the model has such a length."""
        return None

    @abstractmethod
    def loop(self, condition: Condition) -> Response:
        """Steady loop at a condition, one closed cycle."""

    @abstractmethod
    def force_along(self, motion: Excitation, condition: Condition) -> Floats:
        """Force [N] along a motion about mid-stroke that amounts to a condition."""

    def predict(self, condition: Condition) -> Prediction:
        """Steady loop at a condition, with its flags."""
        response = self.loop(condition)
        return Prediction(response.excitation, response.force, condition, self.envelope.flags(condition))

    def felt(self, motion: Excitation) -> Excitation:
        """The motion with the current whose field is there: its magnitude, behind the coil's lags."""
        if self.coil is None:
            return motion.with_current(np.abs(motion.current))
        return motion.with_current(self.coil.along(motion.time, motion.current))

    def predict_run(self, run: Run) -> Prediction:
        """Force along the measured motion of a run, with its flags. The measured force is not looked at."""
        found = equivalent_sine(run)
        motion = measured_motion(run).about(found.centre)
        flags = self.envelope.flags(found.condition)
        if not found.is_sine:
            flags = (*self.envelope.motion_flags(motion), NOT_A_SINE)
        if self.knee is not None and samples_in_knee(motion, self.knee) < _SAMPLES_IN_KNEE:
            flags = (*flags, COARSE)
        return Prediction(motion, self.force_along(motion, found.condition), found.condition, flags)
