"""Lei-type: piecewise linear loop with parameters quadratic in the current."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from mrdamper.dampers.published.base import ConditionedDamper, fit_quadratic, quadratic
from mrdamper.data import Condition
from mrdamper.identification import Identification
from mrdamper.models.biviscous import Biviscous


class LeiType(ConditionedDamper):
    """Hysteretic biviscous model whose c_po, c_pr, f_y and v0 are quadratics in the current.

    References
    ----------
    After Lei et al.; the published equations were not seen, hence "-type". The loop is that
    of Wereley, Pang and Kamath (1998).
    """

    name: ClassVar[str] = "lei-type"
    heading: ClassVar[str] = "Lei-type (piecewise, quadratic in current)"
    source: ClassVar[str] = "after Lei et al.; equations not seen"
    unverified: ClassVar[str] = (
        "the piecewise loop (taken from Wereley et al. 1998) and which of its numbers are quadratics of the current"
    )
    equation: ClassVar[str] = (
        r"F = c_{po} v + f_y \max\left(-1, \min\left(1, \frac{v - v_h\,\mathrm{sgn}\,a}{v_y}\right)\right) + f_0,\quad "
        r"v_y = \frac{f_y}{c_{pr} - c_{po}},\quad v_h = v_0 \frac{c_{pr} v_y}{f_y},\quad "
        r"c_{po} = \max(0, c_{po0} + c_{po1} I + c_{po2} I^2),\quad "
        r"c_{pr} = \max(1.01 c_{po} + 1, c_{pr0} + c_{pr1} I + c_{pr2} I^2),\quad "
        r"f_y = \max(1, f_{y0} + f_{y1} I + f_{y2} I^2),\quad "
        r"v_0 = \max(0, v_{00} + v_{01} I + v_{02} I^2)"
    )
    basis: ClassVar[str] = "biviscous"
    limits: ClassVar[str] = "no dependence on frequency and amplitude; memoryless, sines only"

    @classmethod
    def start(cls, identifications: Sequence[Identification], reference: Condition) -> dict[str, float]:
        currents = np.array([i.condition.current_A for i in identifications])
        coefficients: dict[str, float] = {}
        for name in ("cpo", "cpr", "fy", "v0"):
            values = np.array([getattr(i.model, name) for i in identifications])
            coefficients |= fit_quadratic(name, currents, values)
        coefficients["f0"] = float(np.median([i.model.values()["f0"] for i in identifications]))
        return coefficients

    def model_at(self, condition: Condition) -> Biviscous:
        cpo, cpr, fy, v0 = (
            quadratic(condition.current_A, self.coefficients, name) for name in ("cpo", "cpr", "fy", "v0")
        )
        cpo, fy = np.maximum(cpo, 0.0), np.maximum(fy, 1.0)
        cpr = np.maximum(cpr, 1.01 * cpo + 1.0)  # quadratics may cross; the branches must still meet
        v0 = np.minimum(np.maximum(v0, 0.0), 0.999 * fy / cpr)
        return Biviscous.from_wereley(cpo, cpr, fy, v0, self.coefficients["f0"])
