"""An identified damper, which predicts a force with its range of validity.

A `Damper` of any model predicts the steady loop at a condition and the force along a measured motion, each with flags
of extrapolation.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

from mrdamper.dampers.causal import causal_force
from mrdamper.dampers.coil import Coil
from mrdamper.dampers.envelope import SAME_CURRENT, Envelope
from mrdamper.dampers.prediction import NOT_A_SINE, Prediction
from mrdamper.dampers.uncertainty import FittedParameter, Uncertainty, table
from mrdamper.data import Condition, Displayable, Floats, Run
from mrdamper.data.strict_text import STRICT
from mrdamper.errors import InputError, require, validate_arguments
from mrdamper.models.base import Model
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.physics.motion.sines import centred_motion, equivalent_sine, sine_condition
from mrdamper.physics.motion.strokes import steady_part
from mrdamper.physics.simulation import ForceLaw, Response, simulate, steady_loop
from mrdamper.statistics.functions.forms import ParameterFunction
from mrdamper.statistics.functions.motion_hull import MotionHull

COARSE = "sampling"
_MIN_YIELD_SAMPLES = 2  # below, the yield displacement is between samples


def samples_in_yield_displacement(motion: Excitation, yield_length: float) -> float:
    """Return the number of samples within `yield_length` [m] after the median reversal of a motion."""
    path = motion.path
    inside = np.bincount(path.stroke[path.distance < yield_length], minlength=path.stroke[-1] + 1)
    return float(np.median(inside[1:])) if inside.size > 1 else np.inf


@dataclass(frozen=True)
class Saved:
    """Fields that one kind of damper adds to a saved model. Subclasses declare them.

    Only numbers, texts, lists and mappings of them: the types are checked when a file is read.
    """

    __pydantic_config__: ClassVar = STRICT


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Damper(Displayable):
    """An identified damper. Subclasses are frozen dataclasses, found by discovery.

    Attributes
    ----------
    kind : str
        Name in a saved model.
    saved : type of Saved
        Schema of its part of a saved model.
    conditional : bool
        Whether the model depends on frequency and amplitude; other motions than sines are then interpreted as a
        changing sine, sample by sample.
    streams : bool
        Whether it can be evaluated sample by sample.
    rig : str
    envelope : Envelope
        Ranges of the tests it was identified from.
    provenance : mapping of str to str
        Dataset, values and methods of the identification, versions; texts for the report.
    coil : Coil or None
    uncertainty : Uncertainty or None
        Covariance of its parameters and errors of its predictions; None where they are not known.

    Examples
    --------
    >>> from mrdamper import Damper, identify, load_dataset
    >>> from mrdamper.dampers.modified import fit_modified
    >>> runs = load_dataset().rig("utfsm").split("train")[:8]
    >>> damper = fit_modified([identify(run, "bingham") for run in runs]).damper
    >>> isinstance(damper, Damper)
    True
    """

    read_by: ClassVar = "mrdamper.load_model(file)"
    kind: ClassVar[str]
    saved: ClassVar[type[Saved]]
    conditional: ClassVar[bool] = False
    streams: ClassVar[bool] = True

    rig: str = ""
    envelope: Envelope
    provenance: Mapping[str, str] = field(default_factory=dict[str, str])
    coil: Coil | None = None
    uncertainty: Uncertainty | None = None

    def __eq__(self, other: object) -> bool:
        """Tell if two dampers are saved alike: one that was saved and loaded equals itself."""
        if self is other or type(self) is not type(other):
            return self is other
        dump = import_module("mrdamper.dampers.model_file").dump_model  # which imports this module
        try:
            return bool(dump(self) == dump(other))
        except InputError:  # one without tests, or of a kind that is not saved
            return False

    def __hash__(self) -> int:
        return hash((self.kind, self.rig, tuple(p.value for p in self.fitted_parameters.values())))

    @property
    @abstractmethod
    def title(self) -> str:
        """Title in a report."""

    @property
    def headline(self) -> str:
        """Title, rig and number of identified parameters."""
        rig = f" of rig {self.rig}" if self.rig else ""
        return f"{self.title}{rig}: {self.parameter_count} parameters from tests"

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
        """Its equations as LaTeX, with a comma and a quad between them; empty where there are none."""
        return ""

    @property
    def numbers(self) -> Mapping[str, float]:
        """Coefficients in its equation that are neither parameters nor in functions."""
        return {}

    @property
    def one_model(self) -> Model | None:
        """The one model for every condition; None if its parameters depend on the condition."""
        return None

    @property
    def functions(self) -> Mapping[str, ParameterFunction]:
        """Parameter functions by what they give; none where the parameters are no such functions."""
        return {}

    @property
    def tested_motions(self) -> MotionHull | None:
        """Motions outside which its functions are evaluated at the nearest one; None if they follow any motion."""
        return None

    @property
    def followed_amplitudes(self) -> tuple[float, float]:
        """Amplitudes [m] within which the parameters follow a motion that is no known sine."""
        return self.envelope.amplitude_m

    @property
    def fitted_parameters(self) -> Mapping[str, FittedParameter]:
        """Parameters determined from the data; empty if they have no meaning."""
        return {}

    def with_parameters(self, values: Mapping[str, float]) -> Self:
        """Return the damper with some parameters changed, for derivatives and draws."""
        raise not_held(self, values)

    @property
    def yield_length(self) -> float | None:
        """Displacement after a reversal in which the force changes its sign [m], if the model has such a length."""
        return None

    def save(self, path: str | Path) -> None:
        """Write the damper as JSON; see `mrdamper.save_model`."""
        import_module("mrdamper").save_model(self, path)

    def prediction_interval(self, prediction: Prediction, level: float = 0.9) -> Any:
        """Prediction intervals of a force that this damper predicted; see `mrdamper.dampers.bands.band`."""
        require(prediction, Prediction, "a prediction", "give damper.predict(...) of the condition or motion")
        return import_module("mrdamper.dampers.bands").band(self, prediction, level)

    def score(self, runs: Iterable[Run]) -> Any:
        """Score the predictions of runs or of a dataset; see `mrdamper.validate`."""
        return import_module("mrdamper").validate(self, runs)

    def to_saved(self) -> Saved:
        """Its own part of a saved model; raises `InputError` if its kind cannot be saved."""
        raise InputError("this kind of damper is not saved", where=self.title, remedy="save another damper")

    @classmethod
    def from_saved(cls, saved: Any, **shared: Any) -> Self:
        """Return the damper from the result of `to_saved` and the fields of all kinds; raises `InputError` if none."""
        raise NotImplementedError(cls.kind)  # a kind that cannot be saved is not in files

    def holding(self, values: Mapping[str, float]) -> Damper:
        """Return the damper with some parameters held at a value; raises `InputError` (E_HELD) if it has none such."""
        raise not_held(self, values)

    @validate_arguments()
    def loop(self, condition: Condition) -> Response:
        """Steady loop at a condition, one closed cycle."""
        at = replace(condition, current_A=abs(condition.current_A))
        return steady_loop(self.model_at(at), at)

    @validate_arguments()
    def force_along(self, motion: Excitation, condition: Condition) -> Floats:
        """Force [N] along a motion about mid-stroke with an equivalent condition."""
        return self._force_along(motion, condition)

    def _force_along(self, motion: Excitation, condition: Condition) -> Floats:
        at = replace(condition, current_A=abs(condition.current_A))
        return simulate(self.model_at(at), self.with_field_current(motion)).force

    def with_field_current(self, motion: Excitation) -> Excitation:
        """Return the motion with the current of the present field: its magnitude, with the lags of the coil."""
        if self.coil is None:
            return motion.with_current(np.abs(motion.current))
        return motion.with_current(self.coil.along(motion.time, motion.current))

    @validate_arguments()
    def predict(self, at: Condition | Run | Excitation) -> Prediction:
        """Predict the force at a condition, one steady loop, or along the motion and current of a run.

        The measured force of a run is not used. Parameters that depend on frequency and amplitude use those of the run
        if it is a sine at one current. Otherwise they follow the equivalent sine of the past motion: a flagged
        approximation, equal to the force of a stream of the damper.

        Parameters
        ----------
        at : Condition, Run or Excitation
            The displacements of an excitation count from mid-stroke, and are used as they are: with a stiffness, a
            motion about another position has another mean force. A motion in arrays is
            ``measured_motion(Run("mine", time, displacement, np.zeros(time.size), current))`` in s, m, N and A
            (`mrdamper.physics.motion.measured_motion`). The displacement sensor of a recorded run may have its zero
            anywhere, so those of a run count from their middle.

        Returns
        -------
        Prediction
            Of a condition, one closed cycle; otherwise a force at each sample. `extrapolation` lists
            what lies outside the tested ranges.
        """
        if isinstance(at, Condition):
            loop = self.loop(at)
            return Prediction(loop.excitation, loop.force, at, self.envelope.flags(at), steady=True)
        if isinstance(at, Excitation):
            # Approach and return to rest would change the amplitude and the middle of the sine between them.
            one_current, motion = np.ptp(at.current) <= SAME_CURRENT, at
            steady = steady_part(at.time, at.displacement) if one_current else slice(None)
            window = float(at.time[steady][0]), float(at.time[steady][-1])
            run = Run("excitation", at.time, at.displacement, np.zeros(len(at)), at.current, window=window)
        else:
            run, motion = at, centred_motion(at)
        sine = equivalent_sine(run)
        condition, tested = sine.condition, self.envelope.any_record if sine.is_sine else self.envelope.any_motion
        if is_sine := sine_condition(run) is not None:
            flags = self.envelope.flags(condition)
        else:
            flags = (*(beyond.quantity for beyond in self.envelope.outside(motion)), *(() if tested else (NOT_A_SINE,)))
        if (
            self.yield_length is not None
            and samples_in_yield_displacement(motion, self.yield_length) < _MIN_YIELD_SAMPLES
        ):
            flags = (*flags, COARSE)
        untested = not (sine.is_sine or self.envelope.any_motion)
        prediction = Prediction(
            motion, np.zeros(len(motion)), condition, flags, is_sine=is_sine, untested_kind=untested
        )
        return replace(prediction, force=self.force_for(prediction))

    def force_for(self, prediction: Prediction) -> Floats:
        """Return the force of this damper for the motion of another one's prediction."""
        motion, condition = prediction.motion, prediction.condition
        if prediction.steady:
            return self.loop(condition).force
        if self.conditional and not (prediction.is_sine and np.ptp(motion.current) <= SAME_CURRENT):
            return causal_force(self, motion)
        return self._force_along(motion, condition)


def not_held(damper: Damper, names: Iterable[str]) -> InputError:
    """Return the refusal of parameters that a damper does not have."""
    return InputError(
        f"{', '.join(names)} cannot be held in a saved model of this kind",
        where=damper.title,
        remedy="release it on the Model page, or save the project in the app instead",
        code="E_HELD",
    )
