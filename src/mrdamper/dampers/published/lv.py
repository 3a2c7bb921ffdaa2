"""Lv-type: quasi-static flow of a Herschel–Bulkley fluid, yield stress over the current."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from mrdamper.dampers.published.base import ConditionedDamper, fit_quadratic, quadratic
from mrdamper.data import Condition
from mrdamper.identification import Identification
from mrdamper.models.herschel_bulkley import HerschelBulkley


class LvType(ConditionedDamper):
    """Slot flow whose yield force is a quadratic in the current; consistency and flow index are constant.

    The viscous force scale is K' [N (s/m)^m] of F = K' |v|^m before the yield stress; v_c follows
    from f_y and K'.

    References
    ----------
    After Lv et al.; the published equations were not seen, hence "-type". The flow is derived
    in `HerschelBulkley`.
    """

    name: ClassVar[str] = "lv-type"
    heading: ClassVar[str] = "Lv-type (rheological)"
    source: ClassVar[str] = "after Lv et al.; equations not seen"
    unverified: ClassVar[str] = "the fluid law and what of it depends on the current"
    equation: ClassVar[str] = (
        r"F = \frac{f_y}{T}\,\mathrm{sgn}\,v + f_0,\quad \frac{|v|}{v_c} = \frac{m}{2m+1} T^{-1/m}"
        r" (1-T)^{1+1/m} \left(1 + \frac{m}{m+1} T\right),\quad "
        r"f_y = \max(1, f_{y0} + f_{y1} I + f_{y2} I^2),\quad "
        r"v_c = \left(f_y/\exp(\mathrm{consistency}_{\mathrm{log}})\right)^{1/m}"
    )
    basis: ClassVar[str] = "bingham"
    limits: ClassVar[str] = "no hysteresis: a single curve over velocity"

    @classmethod
    def start(cls, identifications: Sequence[Identification], reference: Condition) -> dict[str, float]:
        currents = np.array([i.condition.current_A for i in identifications])
        values = [i.model.values() for i in identifications]
        speed = float(np.median([i.condition.peak_velocity for i in identifications]))
        index = 0.8
        viscous = float(np.median([v["c"] for v in values])) * speed ** (1 - index)
        return {
            **fit_quadratic("fy", currents, np.array([v["fy"] for v in values])),
            "consistency_log": float(np.log(max(viscous, 1.0) / 3)),  # slot flow needs about three times the stress
            "m": index,
            "f0": float(np.median([v["f0"] for v in values])),
        }

    def model_at(self, condition: Condition) -> HerschelBulkley:
        given = self.coefficients
        force = np.maximum(quadratic(condition.current_A, given, "fy"), 1.0)
        index = np.clip(given["m"], 0.1, 2.0)
        speed = np.clip((force / np.exp(given["consistency_log"])) ** (1 / index), 1e-9, 1e6)
        return HerschelBulkley(fy=force, vc=speed, m=index, f0=given["f0"])
