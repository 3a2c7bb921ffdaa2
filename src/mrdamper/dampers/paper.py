"""The paper's order, literally: its functions through identifications made run by run.

[Qian et al. 2024, Eq. 23–43] Kept as it is described, so that its verdict can stand beside
those of the consistent and the joint identification.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mrdamper.dampers.base import Envelope
from mrdamper.dampers.modified import ModifiedFit, ModifiedModel
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.data import Condition, Floats, Run
from mrdamper.errors import IdentificationError
from mrdamper.functions.fitting import FunctionFit, fit_function
from mrdamper.gas_spring import GasSpring
from mrdamper.identification import Identification, Method, Problem, identify
from mrdamper.identification.harmonic_balance import separate_mass
from mrdamper.identification.methods.balance import Balance
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


@dataclass(frozen=True)
class Settled:
    """What is held in every identification: the gas spring, or what stands in for it."""

    gas: GasSpring | None
    fixed: Mapping[str, float] = field(default_factory=dict)
    free: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, train: Sequence[Run], gas: GasSpring | None) -> Settled:
        if gas is not None:
            longest = max(float(np.ptp(run.displacement)) / 2 for run in train)
            gas.force([-longest, longest])  # refuses motions that leave no gas volume
            return cls(gas)
        found = [identify(run, BoucWen, Balance()) for run in train]
        stiffness = [float(i.model.k1) for i in found if isinstance(i.model, BoucWen)]
        try:
            apart = separate_mass([i.condition for i in found], stiffness)
        except IdentificationError as error:
            return cls(
                None, notes=(f"the gas spring is unknown and {error}: the mass is left out, k1 holds k1 − m ω²",)
            )
        note = (
            f"the gas spring is unknown: k1 = {apart.k1:.4g} N/m comes from a regression of the consistent in-phase "
            f"stiffness k1 − m ω² over the frequencies (with m = {apart.m:.3g} kg); k2 = k3 = 0"
        )
        return cls(None, {"k1": apart.k1, "k2": 0.0, "k3": 0.0}, ("m",), (note,))

    def identify(self, run: Run, method: Method) -> Identification:
        return identify(run, BoucWen, method, gas=self.gas, fixed=self.fixed, free=self.free)

    def problem(self, run: Run) -> Problem:
        return Problem.of(run, BoucWen, gas=self.gas, fixed=self.fixed, free=self.free)


def paper_functions(found: Sequence[Identification]) -> ModifiedFit:
    """The paper's functions [Qian et al. 2024, Eq. 23–43] by plain least squares.

    Shorter ones where the tests cannot tell the terms apart. beta spans decades and must stay
    positive: its function gives the logarithm.
    """
    conditions = tuple(i.condition for i in found)
    values = {name: np.array([float(getattr(i.model, name)) for i in found]) for name in PAPER_FORMS}
    functions = {
        name: _first_determined((form, *_SHORTER), conditions, values[name], log=name == "beta")
        for name, form in PAPER_FORMS.items()
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
