"""Dominguez-type: Bouc–Wen over current, scaled by powers of frequency and amplitude."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from mrdamper.dampers.published.base import ConditionedDamper, powers_of_motion, scale_of_motion
from mrdamper.data import Condition, Floats
from mrdamper.identification import Identification
from mrdamper.models.bouc_wen import BoucWen

_RISE = 3.0  # 1/A, start of the exponential's rate, which few test matrices determine
_FLOOR = 1e-3  # smallest share of beta in beta + gamma


class DominguezType(ConditionedDamper):
    """F = (f/f_r)^d2 (X/X_r)^d4 [c0(I) v + k0(I) x + alpha(I) z] + f0.

    c0 and alpha rise linearly up to a break current and saturate exponentially above it; k0 and gamma are linear in the
    current; beta is constant, n = 2 and A = 1. Two of the published 16 parameters only scale others, and frequency and
    amplitude are relative to the middle of the tests; the offset force is added.

    References
    ----------
    After Dominguez, Sedaghati and Stiharu (2008), "Modeling and application of MR dampers in
    semi-adaptive structures", Computers and Structures 86, 407–415; recalled from a review,
    equations not seen, hence "-type".
    """

    name: ClassVar[str] = "dominguez-type"
    heading: ClassVar[str] = "Dominguez-type"
    source: ClassVar[str] = "after Dominguez, Sedaghati and Stiharu 2008; equations not seen"
    unverified: ClassVar[str] = (
        "which coefficients carry the current and by which law, and that one power law of frequency and "
        "amplitude multiplies the whole force; of the 16 parameters two only scale others"
    )
    equation: ClassVar[str] = (
        r"F = s \left[c\,v + (k_1 + k_2 I)\,x + \alpha z\right] + f_0,\quad "
        r"s = (f/f_r)^{d_2} (A/A_r)^{d_4},\quad "
        r"c = \max\left(0, c_4 + (c_1 - c_4) I_b + c_2 \left(1 - e^{-c_3 I_a}\right)\right),\quad "
        r"\alpha = \max\left(0, \alpha_4 + (\alpha_1 - \alpha_4) I_b "
        r"+ \alpha_2 \left(1 - e^{-\alpha_3 I_a}\right)\right),\quad "
        r"I_b = \min(I, I_r)/I_r,\quad I_a = \max(0, I - I_r),\quad "
        r"\dot z = v - \beta |v| |z| z - \gamma v z^2,\quad "
        r"\gamma = \min(\beta, \max(-0.999 \beta, \gamma_1 - \gamma_2 I))"
    )
    basis: ClassVar[str] = "bouc-wen"
    limits: ClassVar[str] = "needs frequency and amplitude: sines only; one power law for all forces"

    @classmethod
    def start(cls, identifications: Sequence[Identification], reference: Condition) -> dict[str, float]:
        conditions = [i.condition for i in identifications]
        currents = np.array([c.current_A for c in conditions])
        values = {
            name: np.array([i.model.values()[name] for i in identifications])
            for name in ("c", "alpha", "beta", "gamma", "k1", "f0")
        }
        total = values["beta"] + values["gamma"]
        force = values["alpha"] / np.sqrt(total)
        powers = powers_of_motion(conditions, reference, np.log(np.maximum(force, 1.0)))
        scale = np.array([scale_of_motion(c, reference, *powers) for c in conditions])
        beta = float(np.quantile(total, 0.9)) / 2
        # Alpha follows from the yield force, which is well determined, and not from the identified alpha.
        smooth_total = np.exp(np.polyval(_line(currents, np.log(total)), currents))
        gamma = _line(currents, smooth_total - beta)
        straight = np.maximum(np.polyval(gamma, currents) + beta, _FLOOR * beta)
        k = _line(currents, values["k1"] / scale)
        return {
            "d2": powers[1],
            "d4": powers[0],
            **_rising("c", currents, values["c"] / scale, reference.current_A),
            **_rising("alpha", currents, force * np.sqrt(straight) / scale, reference.current_A),
            "k1": float(k[1]),
            "k2": float(k[0]),
            "gamma1": float(gamma[1]),
            "gamma2": float(-gamma[0]),
            "beta": beta,
            "f0": float(np.median(values["f0"])),
        }

    def model_at(self, condition: Condition) -> BoucWen:
        given, current = self.coefficients, condition.current_A
        scale = scale_of_motion(condition, self.reference, given["d4"], given["d2"])
        beta = np.maximum(given["beta"], 1.0)
        gamma = np.clip(given["gamma1"] - given["gamma2"] * current, (_FLOOR - 1) * beta, beta)
        return BoucWen(
            c=np.maximum(scale * _law(given, "c", current, self.reference.current_A), 0.0),
            alpha=np.maximum(scale * _law(given, "alpha", current, self.reference.current_A), 0.0),
            beta=beta,
            gamma=gamma,
            k1=scale * (given["k1"] + given["k2"] * current),
            f0=given["f0"],
        )


def _line(currents: Floats, values: Floats) -> Floats:
    """Slope and level over current; no slope where one current was tested."""
    return np.polyfit(currents, values, 1) if np.ptp(currents) > 0 else np.array([0.0, float(np.mean(values))])


def _rising(name: str, currents: Floats, values: Floats, knee: float) -> dict[str, float]:
    """Level at the break, rise above it, its rate, and level at zero current."""
    lift = np.where(currents > knee, 1 - np.exp(-_RISE * (currents - knee)), 0.0)
    below = np.clip(1 - currents / knee, 0.0, None)
    table = np.column_stack([1 - below, lift, below])
    at_break, rise, at_zero = np.linalg.lstsq(table, values, rcond=1e-8)[0].tolist()
    return {f"{name}1": at_break, f"{name}2": rise, f"{name}3": _RISE, f"{name}4": at_zero}


def _law(given: Mapping[str, float], name: str, current: float, knee: float) -> float:
    at_break, rise, rate, at_zero = (given[f"{name}{i}"] for i in range(1, 5))
    below, above = np.minimum(current, knee), np.maximum(current - knee, 0.0)
    return at_zero + (at_break - at_zero) * below / knee + rise * (1 - np.exp(-np.maximum(rate, 0.0) * above))
