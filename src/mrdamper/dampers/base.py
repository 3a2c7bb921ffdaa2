"""An identified damper: something that predicts a force, and knows where it was tested.

Whatever the model behind it, a `Damper` answers two questions: the steady loop at a
condition, and the force along a measured motion. Each answer carries the flags of its
extrapolation.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise, product
from typing import Any, ClassVar, Self

import numpy as np

from mrdamper.dampers.causal import SLACK, causal_force
from mrdamper.dampers.coil import Coil
from mrdamper.dampers.distance import Distance, distance_from
from mrdamper.dampers.uncertainty import FittedParameter, Uncertainty, table
from mrdamper.data import Condition, Displayable, Floats, Run, same_condition
from mrdamper.errors import InputError, validate_arguments
from mrdamper.models.base import Model
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.physics.motion.measured import measured_motion
from mrdamper.physics.motion.sines import equivalent_sine
from mrdamper.physics.simulation import ForceLaw, Response, simulate, steady_loop
from mrdamper.statistics.functions.forms import ParameterFunction
from mrdamper.statistics.functions.motion_hull import MotionHull

NOT_A_SINE = "not a sine"
COARSE = "sampling"
COMBINATION = "combination"  # every quantity was tested, these together were not
_SUM_WEIGHT = 10.0  # weight of the sum of shares, which is one, against distances in the hull
_SAME_CURRENT = 1e-3  # A; a current that varies less is one current
_LOGARITHM_FLOOR = 1e-12  # frequency [Hz] and amplitude [m] that stand for zero in a logarithm
_MIN_YIELD_SAMPLES = 2  # below, the yield displacement falls between samples


@dataclass(frozen=True)
class Envelope:
    """Ranges of the tests a damper was identified from.

    Attributes
    ----------
    current_A, frequency_Hz, amplitude_m, peak_velocity_m_s : (float, float)
        Lowest and highest tested.
    any_motion : bool
        Motions that are no sine, or currents that change, were among the tests.
    conditions : tuple of (float, float, float)
        Tested currents [A] with their frequencies [Hz] and amplitudes [m]; empty where only the ranges are known.
    """

    current_A: tuple[float, float]
    frequency_Hz: tuple[float, float]
    amplitude_m: tuple[float, float]
    peak_velocity_m_s: tuple[float, float]
    any_motion: bool = False
    conditions: tuple[tuple[float, float, float], ...] = ()

    @classmethod
    def of(cls, conditions: Sequence[Condition]) -> Envelope:
        """Return the envelope of a set of tested conditions."""

        def span(values: list[float]) -> tuple[float, float]:
            return min(values), max(values)

        return cls(
            span([c.current_A for c in conditions]),
            span([c.frequency_Hz for c in conditions]),
            span([c.amplitude_m for c in conditions]),
            span([c.peak_velocity for c in conditions]),
            conditions=tuple(_point(conditions[group[0]]) for group in same_condition(conditions)),
        )

    def with_motion(self, current: Floats, displacement: Floats, velocity: Floats) -> Envelope:
        """Return the envelope widened by the samples of a record that is no sine at one current."""

        def wider(span: tuple[float, float], values: Floats) -> tuple[float, float]:
            return min(span[0], float(np.min(values))), max(span[1], float(np.max(values)))

        moved = np.array([np.ptp(displacement) / 2])
        return replace(
            self,
            any_motion=True,
            current_A=wider(self.current_A, np.abs(current)),
            amplitude_m=wider(self.amplitude_m, moved),
            peak_velocity_m_s=wider(self.peak_velocity_m_s, np.array([np.max(np.abs(velocity))])),
        )

    @property
    def tested(self) -> bool:
        """True where the tested ranges are known; a model without a damper has none."""
        return bool(np.isfinite([*self.current_A, *self.amplitude_m]).all())

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
        checks = (
            ("current", abs(condition.current_A), self.current_A),
            ("frequency", condition.frequency_Hz, self.frequency_Hz),
            ("amplitude", condition.amplitude_m, self.amplitude_m),
            ("velocity", condition.peak_velocity, self.peak_velocity_m_s),
        )
        outside = tuple(
            name for name, value, (low, high) in checks if value < low - SLACK * high or value > high * (1 + SLACK)
        )
        return outside or (() if self._combined(condition) else (COMBINATION,))

    def distance(self, condition: Condition, current: Floats) -> Distance:
        """Distance of a condition and the currents (N,) [A] along its motion; zero where only ranges are known."""
        if not self.conditions or condition.frequency_Hz <= 0 or condition.amplitude_m <= 0:
            return Distance()
        nearest = distance_from(self._tested, condition, current, swept_A=self.current_A if self.any_motion else None)
        if not self.any_motion:
            return nearest
        larger = max(0.0, np.log(condition.amplitude_m / self.amplitude_m[1]))
        faster = max(0.0, np.log(condition.peak_velocity / self.peak_velocity_m_s[1]))
        return replace(nearest, motion=min(nearest.motion, float(np.hypot(larger, faster))))

    def _combined(self, condition: Condition) -> bool:
        """Tell if a condition lies in the convex hull of the tested ones, in I, log f and log A (and log f·A)."""
        if not self.conditions or condition.frequency_Hz <= 0 or condition.amplitude_m <= 0:
            return True
        return _in_hull(self.conditions, max(self.current_A[1], _SAME_CURRENT), _point(condition))

    @cached_property
    def _tested(self) -> tuple[Condition, ...]:
        return tuple(Condition(*point) for point in self.conditions)

    def motion_flags(self, motion: Excitation) -> tuple[str, ...]:
        """List the quantities of a motion that is no sine outside the tested ranges."""
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


@lru_cache(maxsize=4096)
def _in_hull(tested: tuple[tuple[float, float, float], ...], scale: float, asked: tuple[float, float, float]) -> bool:
    from scipy.optimize import nnls  # slow to import, and needed only here

    corners = np.array([_features(point, scale) for point in tested]) - _features(asked, scale)
    centred = np.column_stack([corners, np.full(len(corners), _SUM_WEIGHT)])
    return bool(nnls(centred.T, np.array([0.0, 0.0, 0.0, _SUM_WEIGHT]))[1] < SLACK)


def samples_in_yield_displacement(motion: Excitation, yield_length: float) -> float:
    """Return samples a motion has, after the median reversal, before it has moved on by `yield_length` [m]."""
    path = motion.path
    inside = np.bincount(path.stroke[path.distance < yield_length], minlength=path.stroke[-1] + 1)
    return float(np.median(inside[1:])) if inside.size > 1 else np.inf


@dataclass(frozen=True, eq=False, repr=False)
class Prediction(Displayable):
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
    steady : bool
        One closed loop of the steady response, not a motion from rest.

    Examples
    --------
    >>> from mrdamper import Condition, identify, load_dataset
    >>> from mrdamper.dampers.modified import fit_modified
    >>> runs = load_dataset().rig("utfsm").split("train")[:8]
    >>> damper = fit_modified([identify(run, "bingham") for run in runs]).damper
    >>> prediction = damper.predict(Condition(current_A=0.5, frequency_Hz=2.0, amplitude_m=0.01))
    >>> prediction.force.shape == prediction.motion.time.shape
    True
    """

    motion: Excitation
    force: Floats
    condition: Condition
    extrapolation: tuple[str, ...]
    steady: bool = False

    def distance(self, tested: Envelope) -> Distance:
        """Distance from tests."""
        return tested.distance(self.condition, self.motion.current)

    @property
    def is_sine(self) -> bool:
        """True where the motion is the sine of the condition."""
        return NOT_A_SINE not in self.extrapolation

    @property
    def headline(self) -> str:
        """Condition, peak forces and what is extrapolated."""
        low, high = float(np.min(self.force)), float(np.max(self.force))
        outside = f"; outside the tested range in {', '.join(self.extrapolation)}" if self.extrapolation else ""
        return f"prediction at {self.condition}: {low:.4g} to {high:.4g} N{outside}"

    @property
    def table(self) -> Mapping[str, Floats]:
        """A row a sample, SI."""
        motion = self.motion
        return {
            "time_s": motion.time,
            "displacement_m": motion.displacement,
            "velocity_m_s": motion.velocity,
            "current_A": motion.current,
            "force_N": self.force,
        }


def _point(condition: Condition) -> tuple[float, float, float]:
    return abs(condition.current_A), condition.frequency_Hz, condition.amplitude_m


def _features(point: tuple[float, float, float], current_scale: float) -> Floats:
    return np.array(
        [point[0] / current_scale, np.log(max(point[1], _LOGARITHM_FLOOR)), np.log(max(point[2], _LOGARITHM_FLOOR))]
    )


_ANY = (-np.inf, np.inf)
UNTESTED = Envelope(_ANY, _ANY, _ANY, _ANY)


@dataclass(frozen=True)
class Saved:
    """Fields that one kind of damper adds to a saved model. Subclasses declare them.

    Only numbers, texts, lists and mappings of them: the types are checked when a file is read.
    """

    __pydantic_config__: ClassVar = {"extra": "forbid", "allow_inf_nan": False}


class Damper(Displayable):
    """An identified damper. Subclasses are frozen dataclasses, found by their file.

    Attributes
    ----------
    kind : str
        What a saved model calls it.
    saved : type of Saved
        Schema of its part of a saved model.
    conditional : bool
        Whether the model behind it depends on frequency and amplitude; then motion that is no sine
        is read as a sine that changes, sample by sample.
    streams : bool
        Whether it can be asked sample by sample.
    rig : str
    envelope : Envelope
        Ranges of the tests it was identified from.
    provenance : mapping of str to str
    coil : Coil or None
    uncertainty : Uncertainty or None
        How sure its numbers and predictions are, where that is known.

    Examples
    --------
    >>> from mrdamper import Damper, identify, load_dataset
    >>> from mrdamper.dampers.modified import fit_modified
    >>> runs = load_dataset().rig("utfsm").split("train")[:8]
    >>> damper = fit_modified([identify(run, "bingham") for run in runs]).damper
    >>> isinstance(damper, Damper)
    True
    """

    kind: ClassVar[str]
    saved: ClassVar[type[Saved]]
    conditional: ClassVar[bool] = False
    streams: ClassVar[bool] = True

    rig: str
    envelope: Envelope
    provenance: Mapping[str, str]
    coil: Coil | None
    uncertainty: Uncertainty | None

    @property
    @abstractmethod
    def title(self) -> str:
        """Title in a report."""

    @property
    def headline(self) -> str:
        """Title, rig and number of identified parameters."""
        return f"{self.title} of rig {self.rig}: {self.parameter_count} parameters from tests"

    @property
    def details(self) -> Sequence[str]:
        """Its parameters with their 95 % intervals and units."""
        return [f"{row['name']} = {row['written']}" for row in table(self)]

    @property
    def table(self) -> Mapping[str, Sequence[Any]]:
        """One row per quantity: the tested range."""
        names = ("current_A", "frequency_Hz", "amplitude_m", "peak_velocity_m_s")
        ranges = {name: getattr(self.envelope, name) for name in names}
        return {
            "tested": list(ranges),
            "lowest": [low for low, _ in ranges.values()],
            "highest": [high for _, high in ranges.values()],
        }

    @property
    @abstractmethod
    def parameter_count(self) -> int:
        """Numbers determined from the data."""

    @abstractmethod
    def model_at(self, condition: Condition) -> ForceLaw:
        """Return the force law at a condition."""

    @property
    def source(self) -> str:
        """Publication of its equations."""
        return ""

    @property
    def equation(self) -> str:
        """Its equations as LaTeX, hand-written, with a comma and a quad between them; empty where there are none."""
        return ""

    @property
    def numbers(self) -> Mapping[str, float]:
        """Coefficients in its equation that are neither parameters nor in functions."""
        return {}

    @property
    def one_model(self) -> Model | None:
        """The one model behind every condition; None where its parameters follow the condition."""
        return None

    @property
    def functions(self) -> Mapping[str, ParameterFunction]:
        """Parameter functions by what they give; none where the parameters are no such functions."""
        return {}

    @property
    def tested_motions(self) -> MotionHull | None:
        """Motions outside which its functions are held at the nearest one; None where they follow any motion."""
        return None

    @property
    def followed_amplitudes(self) -> tuple[float, float]:
        """Amplitudes [m] up to which the parameters follow a motion that is no known sine."""
        return self.envelope.amplitude_m

    @property
    def fitted_parameters(self) -> Mapping[str, FittedParameter]:
        """The numbers determined from the data; none where nobody could name them."""
        return {}

    def with_parameters(self, values: Mapping[str, float]) -> Self:
        """Return the damper with some of its own numbers changed; only for derivatives and draws."""
        raise not_held(self, values)

    @property
    def yield_length(self) -> float | None:
        """Motion after a reversal in which the force turns over [m], where the model has such a length."""
        return None

    def to_saved(self) -> Saved:
        """Its own part of a saved model.

        Raises
        ------
        InputError
            If it is of a kind that lives in one study only.
        """
        raise InputError("this kind of damper is not saved", where=self.title, remedy="save another damper")

    @classmethod
    def from_saved(
        cls, saved: Any, rig: str, envelope: Envelope, provenance: Mapping[str, str], coil: Coil | None
    ) -> Self:
        """Return the damper of what `to_saved` gave and what all kinds share.

        Raises
        ------
        InputError
            If it does not make a damper.
        """
        raise NotImplementedError(cls.kind)  # a kind that cannot be saved is not looked for in files

    def holding(self, values: Mapping[str, float]) -> Damper:
        """Return the damper with some of its own numbers held at a value.

        Raises
        ------
        InputError
            E_HELD if it is not made of them.
        """
        raise not_held(self, values)

    @validate_arguments()
    def loop(self, condition: Condition) -> Response:
        """Steady loop at a condition, one closed cycle."""
        at = replace(condition, current_A=abs(condition.current_A))
        return steady_loop(self.model_at(at), at)

    @validate_arguments()
    def force_along(self, motion: Excitation, condition: Condition) -> Floats:
        """Force [N] along a motion about mid-stroke that amounts to a condition."""
        at = replace(condition, current_A=abs(condition.current_A))
        return simulate(self.model_at(at), self.with_field_current(motion)).force

    def with_field_current(self, motion: Excitation) -> Excitation:
        """Return the motion with the current whose field is there: its magnitude, behind the coil's lags."""
        if self.coil is None:
            return motion.with_current(np.abs(motion.current))
        return motion.with_current(self.coil.along(motion.time, motion.current))

    @validate_arguments()
    def predict(self, condition: Condition) -> Prediction:
        """Steady loop at a condition, with its flags."""
        response = self.loop(condition)
        return Prediction(response.excitation, response.force, condition, self.envelope.flags(condition), steady=True)

    @validate_arguments()
    def predict_run(self, run: Run) -> Prediction:
        """Force along the measured motion of a run, with its flags. The measured force is not looked at.

        Parameters that ask for a frequency and an amplitude get those of the run where it is a sine
        of one current. Otherwise they follow the sine that the motion has resembled so far: an
        approximation, flagged as such, and the force that a stream of the damper gives.
        """
        sine = equivalent_sine(run)
        motion = measured_motion(run).about(sine.centre)
        if sine.is_sine and not run.current_changes:
            flags = self.envelope.flags(sine.condition)
        else:
            flags = (*self.envelope.motion_flags(motion), *(() if self.envelope.any_motion else (NOT_A_SINE,)))
        if (
            self.yield_length is not None
            and samples_in_yield_displacement(motion, self.yield_length) < _MIN_YIELD_SAMPLES
        ):
            flags = (*flags, COARSE)
        prediction = Prediction(motion, np.zeros(len(motion)), sine.condition, flags)
        return replace(prediction, force=self.force_for(prediction))

    def force_for(self, prediction: Prediction) -> Floats:
        """Return the force of this damper for what another one's prediction was made for."""
        motion, condition = prediction.motion, prediction.condition
        if prediction.steady:
            return self.loop(condition).force
        if self.conditional and not (prediction.is_sine and np.ptp(motion.current) <= _SAME_CURRENT):
            return causal_force(self, motion)
        return self.force_along(motion, condition)


def not_held(damper: Damper, names: Iterable[str]) -> InputError:
    """Return the refusal of numbers a damper is not made of."""
    return InputError(
        f"{', '.join(names)} cannot be held in a saved model of this kind",
        where=damper.title,
        remedy="release it on the Model page, or save the state of the bench instead",
        code="E_HELD",
    )
