"""Functions of current, frequency and amplitude [Qian et al. 2024, Eq. 23–43], fitted to parameters of single runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.modified import ModifiedFit, ModifiedModel, functions_at_bounds
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.data import Condition, Floats, Run
from mrdamper.errors import IdentificationError
from mrdamper.identification import Identification
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.statistics.functions.fitting import FunctionFit, assess, fit_function
from mrdamper.study.fit_result import FitResult

PAPER_FORMS = {
    "c": "viscous-paper", "m": "mass-exponential", "alpha": "plane", "beta": "current-decay-frequency",
    "f0": "constant", "k1": "constant", "k2": "constant", "k3": "constant",
}  # fmt: skip
_SHORTER = ("quadratic-current", "linear-current")  # in place of a form that the tests do not determine


def paper_functions(
    identifications: Sequence[Identification], mass_law: str = "exponential", provenance: dict[str, str] | None = None
) -> ModifiedFit:
    """Fit the paper's functions by plain least squares.

    Shorter ones replace those that the tests do not determine. c is fitted through the viscous part of F0, as in the
    paper [Eq. 24–26]. beta spans decades and must stay positive: its function is that of the logarithm. `mass_law` is
    the interpretation of Eq. 29, which the text leaves open.
    """
    forms = {**PAPER_FORMS, "m": f"mass-{mass_law}"}
    conditions = tuple(i.condition for i in identifications)
    values = {name: np.array([float(getattr(i.model, name)) for i in identifications]) for name in PAPER_FORMS}
    functions = {name: _fit(form, conditions, values[name], log=name == "beta") for name, form in forms.items()}
    parameters = ParameterMap(BoucWen, {name: fit.function for name, fit in functions.items()})
    rig, envelope = identifications[0].rig, Envelope.of(conditions)
    damper = ModifiedModel(parameters, rig=rig, envelope=envelope, provenance=dict(provenance or {}))
    return ModifiedFit(damper, functions, values, conditions, functions_at_bounds(damper.parameters, conditions))


def fit_paper_functions(
    runs: Sequence[Run], identifications: Sequence[Identification], mass_law: str = "exponential"
) -> FitResult:
    """Make the modified model of the paper from the identifications of single runs [Eq. 41–43]."""
    about = {
        "method": "Qian et al. 2024, literal",
        "identification runs": str(len(identifications)),
        "mass law": mass_law,
    }
    fit = paper_functions(identifications, mass_law, about)

    @cache  # folds that differ only in runs without identification count once
    def fitted(kept: tuple[int, ...]) -> Damper:
        return paper_functions([identifications[i] for i in kept], mass_law).damper

    def refit(rows: Sequence[int]) -> Damper:
        ids = {runs[i].id for i in rows}
        if not (kept := tuple(n for n, one in enumerate(identifications) if one.run_id in ids)):
            raise IdentificationError("none of the runs is a pure sine", where="paper", remedy="test more pure sines")
        return fitted(kept)

    return FitResult(fit.damper, refit, fit)


def _fit(form: str, conditions: Sequence[Condition], values: Floats, log: bool) -> FunctionFit:
    """Fit a form, or the first shorter one that the conditions determine."""
    for tried in (form, *_SHORTER):
        with suppress(IdentificationError):
            return (
                _fit_viscous(conditions, values)
                if tried == "viscous-paper"
                else fit_function(tried, conditions, values, log=log)
            )
    return fit_function("constant", conditions, values, log=log)


def _fit_viscous(conditions: Sequence[Condition], c: Floats) -> FunctionFit:
    """Fit F0 sin φ = 2π f A c over current and f A, and convert it to the function of c [Eq. 24–26]."""
    speed = 2 * math.pi * np.array([condition.frequency_Hz * condition.amplitude_m for condition in conditions])
    fit = fit_function("quadratic-current-speed", conditions, speed * c)
    coefficients = tuple(value / (2 * math.pi) for value in fit.function.coefficients)
    function = replace(fit.function, form="viscous-paper", coefficients=coefficients)
    return replace(assess(function, conditions, c), left_out=fit.left_out)
