"""Ali-type: Spencer's model, three of its parameters over current, amplitude and frequency."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Self

import numpy as np

from mrdamper.dampers.published.base import (
    ConditionedDamper,
    fit_quadratic,
    powers_of_motion,
    quadratic,
    scale_of_motion,
)
from mrdamper.data import Condition, Floats, Run
from mrdamper.identification import Identification
from mrdamper.models.spencer import Spencer

_VARYING = ("c0", "c1", "yield_force")


class AliType(ConditionedDamper):
    """Spencer's model with c0, c1 and the hysteretic force as P(I) (X/X_r)^p (f/f_r)^q, P a quadratic.

    k0, k1, x0 (as f0) and the shape of the hysteresis are constant. Individual fits, then regression: a global
    refinement would integrate every run at every trial.

    References
    ----------
    After Ali and Ramaswamy (2009), "Testing and modeling of MR damper and its application to
    SDOF systems using integral backstepping technique", J. Dynamic Systems, Measurement, and
    Control 131; abstract recalled, equations not seen, hence "-type".
    """

    name: ClassVar[str] = "ali-type"
    heading: ClassVar[str] = "Ali-type (Spencer-based)"
    source: ClassVar[str] = "after Ali and Ramaswamy 2009; equations not seen"
    unverified: ClassVar[str] = (
        "that three of the ten numbers vary, their powers of amplitude and frequency, and the quadratic of the current"
    )
    equation: ClassVar[str] = (
        r"F = c_1 \dot y + k_1 x + f_0,\quad \dot y = \frac{F_z \zeta + k_0 r + c_0 v}{c_0 + c_1},\quad "
        r"r = x - y,\quad "
        r"x_z \dot\zeta = \dot r - \frac{1}{2} |\dot r| |\zeta| \zeta - \frac{1}{2} \dot r \zeta^2,\quad "
        r"x_z = \exp(x_{z,\mathrm{log}}),\quad "
        r"c_0 = \max(c_{0,\mathrm{floor}}, c_{00} + c_{01} I + c_{02} I^2) (A/A_r)^{c_{0,p}} (f/f_r)^{c_{0,q}},\quad "
        r"c_1 = \max(c_{1,\mathrm{floor}}, c_{10} + c_{11} I + c_{12} I^2) (A/A_r)^{c_{1,p}} (f/f_r)^{c_{1,q}},\quad "
        r"F_z = \max(F_{z,\mathrm{floor}}, F_{z0} + F_{z1} I + F_{z2} I^2) (A/A_r)^{F_{z,p}} (f/f_r)^{F_{z,q}}"
    )
    basis: ClassVar[str] = "spencer"
    limits: ClassVar[str] = "needs frequency and amplitude: sines only; stepped, not closed"

    @classmethod
    def start(cls, identifications: Sequence[Identification], reference: Condition) -> dict[str, float]:
        conditions = [i.condition for i in identifications]
        coefficients: dict[str, float] = {}
        for name in _VARYING:
            values = np.array([getattr(i.model, name) for i in identifications])
            coefficients |= _power_law(name, conditions, values, reference)
        for name in ("k0", "k1", "f0"):
            coefficients[name] = float(np.median([getattr(i.model, name) for i in identifications]))
        lengths = [np.log(i.model.values()["yield_displacement"]) for i in identifications]
        coefficients["yield_displacement_log"] = float(np.median(lengths))
        return coefficients

    def refined(self, runs: Sequence[Run]) -> Self:
        return self

    def model_at(self, condition: Condition) -> Spencer:
        given = self.coefficients
        values: dict[str, float] = {}
        for name in _VARYING:
            power = scale_of_motion(condition, self.reference, given[f"{name}_p"], given[f"{name}_q"])
            values[name] = np.maximum(quadratic(condition.current_A, given, name), given[f"{name}_floor"]) * power
        c1 = values["c1"]
        return Spencer(
            c1=c1,
            c0_ratio=np.clip(values["c0"] / c1, 1e-6, 1e3),
            k0_rate=np.clip(given["k0"] / c1, 0.0, 1e4),
            creep=np.clip(values["yield_force"] / c1, 1e-9, 1e2),
            yield_displacement=float(np.exp(given["yield_displacement_log"])),
            k1=given["k1"],
            f0=given["f0"],
        )

    @property
    def parameter_count(self) -> int:
        return sum(not name.endswith("_floor") for name in self.coefficients)


def _power_law(name: str, conditions: Sequence[Condition], values: Floats, reference: Condition) -> dict[str, float]:
    """Powers from logarithms with a level for every current, then the quadratic of the remainder."""
    powers = powers_of_motion(conditions, reference, np.log(np.maximum(values, 1e-3)))
    p, q = np.clip(powers, -2, 2).tolist()
    currents = np.array([c.current_A for c in conditions])
    rest = values / [scale_of_motion(c, reference, p, q) for c in conditions]
    floor = 0.2 * float(np.min(rest))  # the quadratic may dip below zero between currents
    return {**fit_quadratic(name, currents, rest), f"{name}_p": p, f"{name}_q": q, f"{name}_floor": max(floor, 1e-3)}
