"""The paper's order, literally: its functions through identifications made run by run.

[Qian et al. 2024, Eq. 23–43] Kept as it is described, so that its verdict can stand beside
those of the consistent and the joint identification.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrdamper.dampers.base import Envelope
from mrdamper.dampers.modified import ModifiedFit, ModifiedModel
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.data import Condition, Floats
from mrdamper.errors import IdentificationError
from mrdamper.functions.fitting import FunctionFit, fit_function
from mrdamper.identification import Identification
from mrdamper.models.bouc_wen import BoucWen

PAPER_FORMS = {
    "c": "viscous-paper",
    "m": "mass-exponential",
    "alpha": "plane",
    "beta": "current-decay-frequency",
    "f0": "constant",
    "k1": "constant",
    "k2": "constant",
    "k3": "constant",
}
_SHORTER = ("quadratic-current", "linear-current", "constant")


def paper_functions(found: Sequence[Identification], mass_law: str = "exponential") -> ModifiedFit:
    """The paper's functions [Qian et al. 2024, Eq. 23–43] by plain least squares.

    Shorter ones where the tests cannot tell the terms apart. beta spans decades and must stay
    positive: its function gives the logarithm.

    Parameters
    ----------
    found : sequence of Identification
    mass_law : {"exponential", "inverse-square", "power"}
        Reading of Eq. 29, which the text leaves open.
    """
    forms = {**PAPER_FORMS, "m": f"mass-{mass_law}"}
    conditions = tuple(i.condition for i in found)
    values = {name: np.array([float(getattr(i.model, name)) for i in found]) for name in PAPER_FORMS}
    functions = {
        name: _first_determined((form, *_SHORTER), conditions, values[name], log=name == "beta")
        for name, form in forms.items()
    }
    damper = ModifiedModel(
        rig=found[0].rig,
        parameters=ParameterMap(BoucWen, {name: fit.function for name, fit in functions.items()}),
        envelope=Envelope.of(conditions),
    )
    return ModifiedFit(damper, functions, values, conditions)


def _first_determined(forms: Sequence[str], conditions: Sequence[Condition], values: Floats, log: bool) -> FunctionFit:
    for form in forms[:-1]:
        try:
            return fit_function(form, conditions, values, log=log)
        except IdentificationError:
            continue
    return fit_function(forms[-1], conditions, values, log=log)
