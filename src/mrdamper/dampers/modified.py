"""Modified model: a model whose parameters are functions of I, f and A.

[Qian et al. 2024, Eq. 23–43], with the functions fitted to identifications that count the hysteretic force once, and
each form selected by cross-validation over conditions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, ClassVar, Self

import numpy as np

from mrdamper.dampers.base import Damper, Saved, not_held
from mrdamper.dampers.condensed_runs import Condensed, condense
from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.normal_equations import ABSENT, Law, choose_forms, fit_jointly
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.dampers.run_rows import RunRows, envelope_of
from mrdamper.dampers.uncertainty import FittedParameter
from mrdamper.data import Condition, Floats, Run
from mrdamper.errors import IdentificationError, ParameterError
from mrdamper.identification import Identification
from mrdamper.models import Model, model_type
from mrdamper.statistics.functions.fitting import FunctionFit, assess, choose_function
from mrdamper.statistics.functions.forms import FORMS, ParameterFunction, features
from mrdamper.statistics.functions.motion_hull import MotionHull

_RATES = (0.4, 0.8, 1.5, 2.5, 4.0)  # of decaying laws, times the largest current [-]
_ONSET_RATES = (1.2, 2.4, 4.0, 6.0, 9.0)  # of laws that begin with the square of the current, likewise
_MIN_FREQUENCY_RATIO = 1.2  # highest over lowest frequency from which a mass can be separated from a stiffness [-]


@dataclass(frozen=True)
class SavedFunction(Saved):
    """A parameter function in a saved model."""

    form: str
    coefficients: tuple[float, ...]
    rates: tuple[float, ...] = ()
    log: bool = False
    formula: str = ""  # for the reader; the coefficients are used


@dataclass(frozen=True)
class SavedModified(Saved):
    """A modified model in a saved model."""

    model: str
    functions: dict[str, SavedFunction]
    tested_motions: tuple[tuple[float, float], ...] = ()  # corners: frequency [Hz], amplitude [m]; none: not held


_EXTRAPOLATING_FORM = "viscous-paper"  # form of c that is meant for larger amplitudes [Qian et al. 2024, section 6]
_EXTRAPOLATED_AMPLITUDE = 2.0  # largest amplitude over the largest tested one, for that form


@dataclass(frozen=True, eq=False, repr=False)
class ModifiedModel(Damper):
    """A model whose parameters are functions of current, frequency and amplitude."""

    kind: ClassVar[str] = "modified"
    saved: ClassVar[type[Saved]] = SavedModified
    conditional: ClassVar[bool] = True

    parameters: ParameterMap

    @property
    def title(self) -> str:
        title = self.parameters.model_type.title
        return title if "modified" in title else f"modified {title}"

    @property
    def parameter_count(self) -> int:
        return self.parameters.parameter_count

    @property
    def source(self) -> str:
        return self.parameters.model_type.source

    @property
    def equation(self) -> str:
        coordinates = self.parameters.model_type.coordinates
        relations = [coordinates[name][1] for name in self.functions if name in coordinates]
        return r",\quad ".join([self.parameters.model_type.equation, *relations])

    @property
    def functions(self) -> Mapping[str, ParameterFunction]:
        return self.parameters.functions

    @property
    def tested_motions(self) -> MotionHull | None:
        return self.parameters.motions if self.parameters.follows_motion else None

    @property
    def followed_amplitudes(self) -> tuple[float, float]:
        low, high = self.envelope.amplitude_m
        extrapolates = any(function.form == _EXTRAPOLATING_FORM for function in self.functions.values())
        return low, high * (_EXTRAPOLATED_AMPLITUDE if extrapolates else 1.0)

    def model_at(self, condition: Condition) -> Model:
        """Return the model at a condition."""
        return self.parameters.at(condition)

    def holding(self, values: Mapping[str, float]) -> ModifiedModel:
        missing = [name for name in values if name not in self.functions]
        if missing:
            raise not_held(self, missing)
        functions = dict(self.functions)
        for name, value in values.items():
            log = functions[name].log
            if log and not value > 0:
                raise ParameterError(f"{name} = {value:g}", where=self.title, remedy="give a value over zero")
            functions[name] = ParameterFunction("constant", (math.log(value) if log else value,), log=log)
        return replace(self, parameters=replace(self.parameters, functions=functions), uncertainty=None)

    @property
    def fitted_parameters(self) -> Mapping[str, FittedParameter]:
        units = self.parameters.units
        return {
            f"{name}.{i}": FittedParameter(value, unit=unit, exponent=exponent)
            for name, f in self.functions.items()
            for i, (value, unit, exponent) in enumerate(
                zip((*f.coefficients, *f.rates), f.units(units[name]), self._exponents(f), strict=True)
            )
        }

    def _exponents(self, function: ParameterFunction) -> Sequence[float]:
        """Return the largest multiple of each coefficient in the logarithm of a parameter at the tests."""
        count = len(function.coefficients) + len(function.rates)
        if not function.log:
            return [0.0] * count
        columns = FORMS[function.form].columns(*features(self.envelope.corners), function.rates)
        return [*np.abs(columns).max(axis=0).tolist(), *[0.0] * len(function.rates)]

    def with_parameters(self, values: Mapping[str, float]) -> Self:
        functions = {}
        for name, f in self.functions.items():
            numbers = [values.get(f"{name}.{i}", v) for i, v in enumerate((*f.coefficients, *f.rates))]
            cut = len(f.coefficients)
            functions[name] = replace(f, coefficients=tuple(numbers[:cut]), rates=tuple(numbers[cut:]))
        return replace(self, parameters=replace(self.parameters, functions=functions))

    def to_saved(self) -> SavedModified:
        functions = {
            name: SavedFunction(f.form, f.coefficients, f.rates, f.log, f.formula) for name, f in self.functions.items()
        }
        motions = self.parameters.motions
        return SavedModified(self.parameters.model_type.name, functions, motions.corners if motions else ())

    @classmethod
    def from_saved(cls, saved: SavedModified, **shared: Any) -> Self:
        functions = {n: ParameterFunction(f.form, f.coefficients, f.rates, f.log) for n, f in saved.functions.items()}
        motions = MotionHull(saved.tested_motions) if saved.tested_motions else None
        damper = cls(ParameterMap(model_type(saved.model), functions, motions), **shared)
        try:
            damper.model_at(damper.envelope.middle)
        except (TypeError, KeyError) as error:
            raise ParameterError(f"functions do not fit the model: {error}", remedy="write the model again") from error
        return damper


@dataclass(frozen=True, eq=False)
class ModifiedFit:
    """A modified model and the fits of its functions."""

    damper: ModifiedModel
    functions: Mapping[str, FunctionFit]
    values: Mapping[str, Floats]  # (N,) the identified values of each function
    conditions: tuple[Condition, ...]
    # coordinates whose function leaves the search range, or a bound of the parameter at a test
    at_bounds: tuple[str, ...] = ()
    # forms that violate a physical law, by coordinate and name, with the law
    refused: Mapping[str, str] = field(default_factory=dict[str, str])


def fit_modified(
    identifications: Sequence[Identification],
    forms: Mapping[str, Sequence[str]] | None = None,
    provenance: Mapping[str, str] | None = None,
) -> ModifiedFit:
    """Fit a modified model to the identifications of a test matrix, of one rig and one model type.

    `forms`: candidate forms by parameter; by default the model's own. Raises `IdentificationError` if there is nothing
    to fit, or the identifications mix models or rigs.
    """
    if not identifications:
        raise IdentificationError("no identifications", remedy="identify at least one run")
    types = {type(i.model) for i in identifications}
    rigs = {i.rig for i in identifications}
    if len(types) > 1 or len(rigs) > 1:
        raise IdentificationError(
            f"identifications of {len(types)} models and {len(rigs)} rigs", remedy="fit one model of one rig at a time"
        )
    model_type, rig = types.pop(), rigs.pop()
    conditions = tuple(i.condition for i in identifications)
    candidates = dict(model_type.map_forms() if forms is None else forms)
    values = {name: np.array([_coordinate(i, name) for i in identifications]) for name in candidates}
    fits = {
        name: choose_function(
            candidates[name],
            conditions,
            values[name],
            log=name in model_type.log_coordinates(),
            uncertainty=np.array([i.standard_errors.get(name, np.inf) for i in identifications])
            / (values[name] if name in model_type.log_coordinates() else 1.0),
            dissipating=_dissipating(model_type).get(name, ""),
        )
        for name in candidates
    }
    functions = {name: fit.function for name, fit in fits.items()}
    damper = ModifiedModel(
        ParameterMap(model_type, functions, MotionHull.of(conditions)),
        rig=rig,
        envelope=Envelope.of(conditions),
        provenance={**(provenance or {}), **_about_forms(functions)},
    )
    broken = {f"{name}: {form}": why for name, fit in fits.items() for form, why in fit.refused.items()}
    return ModifiedFit(damper, fits, values, conditions, functions_at_bounds(damper.parameters, conditions), broken)


def fit_modified_jointly(
    runs: Sequence[Run],
    identifications: Sequence[Identification],
    provenance: Mapping[str, str] | None = None,
    *,
    any_motion: bool = True,
) -> tuple[ModifiedFit, Callable[[Sequence[int]], ModifiedModel]]:
    """Fit all parameter functions to the forces of all runs at once.

    The identifications are of these runs, in this order: the start of the shape coordinate. Functions of frequency and
    amplitude are tried, too, if `any_motion`; otherwise laws over the current only. Returns the fit, and a function
    that fits the model to the runs of some indices only, with the same forms. Raises `IdentificationError` if the model
    has more than one shape coordinate, or there are too few runs.
    """
    model_type = type(identifications[0].model)
    conditions = [i.condition for i in identifications]
    inertia = ("m",) if "m" not in model_type.map_forms() and _tells_inertia(model_type, conditions) else ()
    data = _condensed(tuple(runs), model_type, inertia)
    shapes = np.array([_coordinate(i, data.shape) if data.shape else 1.0 for i in identifications])
    chosen = choose_forms(data, _candidates(data, any_motion), shapes, _dissipating(model_type))
    forms, joint = chosen.forms, chosen.fit
    start = joint.parameters.functions.get(data.shape)
    about = {**(provenance or {}), **_about_forms(joint.parameters.functions)}

    parts = [RunRows.of(run) for run in runs]

    def model(rows: Sequence[int], parameters: ParameterMap) -> ModifiedModel:
        held = replace(parameters, motions=MotionHull.of([data.conditions[i] for i in rows]))
        rig, envelope = identifications[0].rig, envelope_of([parts[i] for i in rows])
        return ModifiedModel(held, rig=rig, envelope=envelope, provenance=dict(about))

    def refit(rows: Sequence[int]) -> ModifiedModel:
        return model(rows, fit_jointly(data.only(rows), forms, start).parameters)

    functions = joint.parameters.functions
    values = {name: np.array([_coordinate(i, name) for i in identifications]) for name in functions}
    fits = {name: assess(function, data.conditions, values[name]) for name, function in functions.items()}
    at_bounds = tuple(dict.fromkeys((*joint.at_bounds, *functions_at_bounds(joint.parameters, data.conditions))))
    damper = model(range(len(runs)), joint.parameters)
    fit = ModifiedFit(damper, fits, values, data.conditions, at_bounds, chosen.refused)
    return fit, refit


_condensed = lru_cache(maxsize=2)(condense)  # functions of the motion are tried on them, and of the current alone


def _candidates(data: Condensed, any_motion: bool) -> dict[str, list[Law]]:
    """Forms of every coordinate, shortest first; rates of laws over the current are tried on a grid."""
    highest = max(abs(c.current_A) for c in data.conditions) or 1.0
    decaying = [Law("decaying-current", (rate / highest,)) for rate in _RATES]
    onset = [Law("onset-current", (rate / highest,)) for rate in _ONSET_RATES]
    candidates: dict[str, list[Law]] = {}
    for name, forms in data.model_type.map_forms().items():
        laws = [
            Law(form)
            for form in forms
            if (any_motion or not FORMS[form].follows_motion) and (name == data.shape or not FORMS[form].rate_bounds)
        ]
        dissipating = _dissipating(data.model_type)
        if name in dissipating and len(laws) > 1:
            laws += decaying
        if dissipating.get(name) == "N" and len(laws) > 1:
            laws += onset
        candidates[name] = laws
    return candidates | {name: [Law(ABSENT), Law("constant")] for name in data.linear if name not in candidates}


def _tells_inertia(model_type: type[Model], conditions: Sequence[Condition]) -> bool:
    """Tell if a mass can be separated from a stiffness: the model has one, and the frequencies of the tests differ."""
    frequencies = [c.frequency_Hz for c in conditions]
    has_mass = any(info.name == "m" and info.linear for info in model_type.parameters())
    return has_mass and max(frequencies) > _MIN_FREQUENCY_RATIO * min(frequencies)


def _dissipating(model_type: type[Model]) -> dict[str, str]:
    """Units of the linear coordinates that must not be negative."""
    units = {i.name: i.unit for i in model_type.parameters() if i.linear and i.bounds[0] == 0}
    return units | ({"yield_force": "N"} if "yield_force" in model_type.map_forms() else {})


def functions_at_bounds(parameters: ParameterMap, conditions: Sequence[Condition]) -> tuple[str, ...]:
    """Parameters whose function leaves their bounds at a test, or has a rate at a bound of the search."""
    bounds = {info.name: info.bounds for info in parameters.model_type.parameters()}
    names: list[str] = []
    for name, function in parameters.functions.items():
        low, high = bounds.get(name, (0.0 if name == "yield_force" else -np.inf, np.inf))
        values = function(*features(conditions))
        ends = zip(function.rates, FORMS[function.form].rate_bounds, strict=True)
        ended = any(np.isclose(rate, bounds_of_rate, rtol=1e-6).any() for rate, bounds_of_rate in ends)
        if ended or np.any(values < low) or np.any(values > high):
            names.append(name)
    return tuple(names)


def _about_forms(functions: Mapping[str, ParameterFunction]) -> dict[str, str]:
    follows = [name for name, function in functions.items() if FORMS[function.form].follows_motion]
    forms = "; ".join(f"{name}: {function.form}" for name, function in functions.items())
    return {"forms": forms, "depends on frequency and amplitude": ", ".join(follows) or "no parameter"}


def _coordinate(identification: Identification, name: str) -> float:
    return float(getattr(identification.model, name))
