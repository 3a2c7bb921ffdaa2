"""Claims of the paper on its damper and its method: one row with measurements, limits and verdict per claim.

A claim agrees where each of its values meets its limit, agrees in part where at least one meets it or the wider one,
and differs where none does. Values that are no support alone, such as the quality of a fit, must meet their limits for
a claim to agree and do not make it agree in part. A claim without all of its values cannot be checked. A property that
the virtual damper was built with is recovered, in part, or not; a claim on the authors' own damper is not checked on
the virtual one: values stand beside the paper's.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from mrdamper.data.wording import number
from mrdamper.errors import UnknownNameError
from mrdamper.paper import claims_on_fits, claims_on_tests
from mrdamper.paper.results import Measured, Reproduction

Verdict = Literal["agrees", "agrees in part", "differs", "not checked", "cannot be checked"]
Kind = Literal["method", "damper", "built in"]  # claim on the method, on a damper, on a property of the virtual one
_RECOVERED = {"agrees": "recovered", "agrees in part": "recovered in part", "differs": "not recovered"}


@dataclass(frozen=True)
class ClaimLimit:
    """Limit of one value."""

    value: str  # description of the value
    sense: Literal["below", "above"]
    holds: float  # limit, which the value may reach
    near: float  # wider limit for partial agreement; equal to the limit if there is none
    alone: bool = True  # the value supports the claim by itself

    def grade(self, value: float) -> int:
        """Return 2 within the limit, 1 within the wider one, 0 beyond both."""
        holds, near = (value <= end if self.sense == "below" else value >= end for end in (self.holds, self.near))
        return 2 if holds else 1 if near else 0

    @property
    def text(self) -> str:
        """The limit in words."""
        sign = "≤" if self.sense == "below" else "≥"
        wider = "" if self.near == self.holds else f" (in part: {sign} {number(self.near)})"
        return f"{self.value} {sign} {number(self.holds)}{wider}" + ("" if self.alone else " (no support alone)")


def _below(value: str, holds: float, near: float | None = None, *, alone: bool = True) -> ClaimLimit:
    return ClaimLimit(value, "below", holds, holds if near is None else near, alone)


def _above(value: str, holds: float, near: float | None = None, *, alone: bool = True) -> ClaimLimit:
    return ClaimLimit(value, "above", holds, holds if near is None else near, alone)


@dataclass(frozen=True)
class _Row:
    """A claim, its place in the paper, the figure that shows it, and how it is measured and limited."""

    text: str
    source: str
    figure: str
    kind: Kind
    measure: Callable[[Reproduction], Measured]
    limits: tuple[ClaimLimit, ...]


_RATIO = 1.1, 1.5  # error over another method's: comparable, comparable in part
ROWS: Mapping[str, _Row] = MappingProxyType({
    "gas series": _Row(
        "A series of third order replaces the gas force.", "Eq. 3–7", "", "built in", claims_on_tests.gas_series,
        (_below("error of the series over the gas force", 0.02, 0.05),)),
    "friction": _Row(
        "Seal friction is 25–100 N at 0.01 mm/s and may be neglected.", "section 2", "fig03", "damper",
        claims_on_tests.friction,
        (_above("least friction, N", 25.0, 15.0), _below("largest friction, N", 100.0, 150.0),
         _below("mean friction over the smallest peak force", 0.05, 0.15))),
    "bulge": _Row(
        "Force–displacement loops bulge at x = 0.", "section 2", "fig05", "damper", claims_on_tests.bulges,
        (_above("share of loops wider at x = 0 than at 0.8 X", 1.0, 0.8),)),
    "energy": _Row(
        "The dissipated energy rises with frequency and current.", "section 2", "analysis", "damper",
        claims_on_tests.energy,
        (_above("share of current steps that raise the energy", 1.0, 0.9),
         _above("share of frequency steps that raise the energy", 1.0, 0.9))),
    "stroke end": _Row(
        "After each stroke end the force is missing for a length that grows with speed.", "section 2", "fig04",
        "built in", claims_on_tests.stroke_end,
        (_above("lost length at the fast motion over that at the slow one", 1.25, 1.15),)),
    "phase": _Row(
        "The force leads by 1.4–1.5 rad whatever the current.", "Eq. 16–19", "phase", "damper", claims_on_tests.phase,
        (_above("share of runs within 1.4–1.5 rad", 1.0, 0.5),
         _below("largest change with the current at one motion, rad", 0.02, 0.05))),
    "quadratic": _Row(
        "At every motion F0 is a quadratic of the current.", "Eq. 23", "fig12", "method", claims_on_tests.quadratic,
        (_above("least R² of a motion", 0.98, 0.9),)),
    "speed shift": _Row(
        "f · A shifts the quadratic of F0 (and so c X ω) without bending it.", "Eq. 24–26", "fig14", "method",
        claims_on_tests.speed_shift, (_above("R² of one surface for all runs", 0.98, 0.9),)),
    "saturation": _Row(
        "The magnetic circuit saturates near 1.5 A.", "section 2", "fig06", "built in", claims_on_tests.saturation,
        (_below("slope above 1.5 A over slope below 1 A", 0.4, 0.7),)),
    "viscosity": _Row(
        "F0 sin φ/(X ω) is the viscous damping.", "Eq. 19", "function_c", "method", claims_on_fits.viscosity,
        (_below("median of closed form over consistent c", 1.1, 1.5),)),
    "mass": _Row(
        "The equivalent mass falls off with frequency and does not depend on the amplitude.", "Eq. 27–31",
        "function_m", "method", claims_on_fits.mass,
        (_above("R² of m over current and frequency", 0.9, 0.6, alone=False),
         _below("largest spread of m over amplitudes, over its mean", 0.2, 0.5), _above("least m, kg", 0.0))),
    "alpha": _Row(
        "α rises with the frequency and falls with the amplitude, in a plane beside its current law.", "Eq. 32–36",
        "fig20", "damper", claims_on_fits.alpha,
        (_above("sign of the slope over frequency", 1.0), _below("sign of the slope over amplitude", -1.0),
         _above("R²", 0.9, 0.6, alone=False))),
    "beta": _Row(
        "β over current: curves that differ at small current merge at large current.", "Eq. 37–40", "fig21", "method",
        claims_on_fits.beta,
        (_below("scatter of ln β at the highest current over that at the lowest", 0.5, 0.8),
         _above("R² of ln β", 0.9, 0.6, alone=False),
         _below("share of runs at the limit of the box", 0.1, 0.3, alone=False))),
    "presets": _Row(
        "The preset parameters are insensitive.", "section 4", "sensitivity", "method", claims_on_fits.presets,
        (_below("error left by a wrong n, others identified anew", 0.02, 0.05),
         _below("error left by a wrong γ/β, others identified anew", 0.02, 0.05),
         _below("error left by a wrong A, others identified anew", 1e-6, 1e-3))),
    "search": _Row(
        "The genetic algorithm finds α and β.", "section 4.3, Eq. 21–22", "genetic", "method", claims_on_fits.search,
        (_below("median ratio of α and its optimum", 1.1, 2.0),
         _below("median ratio of β and its optimum", 1.1, 2.0))),
    "accuracy": _Row(
        "The accuracy is comparable to that of the traditional Bouc–Wen model.", "section 6", "fig26", "method",
        claims_on_fits.accuracy,
        (_below("median validation error over the traditional Bouc–Wen's", *_RATIO),
         _below("mean relative error (Eq. 44) over the traditional Bouc–Wen's", *_RATIO))),
    "few parameters": _Row(
        "The accuracy is close to that of Ali's model with fewer parameters.", "section 6", "fig26", "method",
        claims_on_fits.few_parameters,
        (_below("median validation error over the Ali-type's", *_RATIO),
         _below("searched parameters a run over the Ali-type's", 0.99, alone=False))),
    "fast": _Row(
        "Identification is faster than that of the traditional Bouc–Wen model.", "section 6", "fig26", "method",
        claims_on_fits.fast,
        (_below("forces until within 1 % of the search's end, over the traditional Bouc–Wen's", 0.99, 1.5),)),
    "generalisation": _Row(
        "The model predicts a motion that was not tested (80 mm, 1 Hz).", "section 6", "fig24", "method",
        claims_on_fits.generalisation,
        (_below("median validation error over the median error of identification", 1.5, 2.5, alone=False),
         _below("worst validation error, nrmse_pp", 0.1, 0.2))),
})  # fmt: skip


@dataclass(frozen=True)
class Claim:
    """Result on one claim of the paper."""

    key: str  # of `ROWS`
    # text and source: the claim; equation or section of Qian et al. 2024
    text: str
    source: str
    verdict: Verdict  # by `verdict_on`
    said: str  # the verdict for a reader, with the damper it rests on
    # evidence and threshold: values and limits
    evidence: str
    threshold: str
    figure: str  # name of the figure that shows it
    seeds: str  # number of noise seeds with the same verdict, and the other verdicts; empty where it was checked once


def check_claims(study: Reproduction) -> tuple[Claim, ...]:
    """Measure and check every claim; state the reason where the data do not allow it."""
    return tuple(_checked(study, key, row, row.measure(study)) for key, row in ROWS.items())


def _checked(study: Reproduction, key: str, row: _Row, measured: Measured) -> Claim:
    verdict, virtual = verdict_on(key, measured.values), study.rig is not None
    text = in_words(verdict, row.kind, virtual=virtual)
    if row.kind == "damper" and virtual and verdict != "cannot be checked":
        verdict = "not checked"
    listed = [
        f"{limit.value} {number(value, 3)}" if math.isfinite(value) else f"{limit.value}: not tested"
        for limit, value in zip(row.limits, measured.values, strict=False)
    ]
    evidence = "; ".join(part for part in (*listed, measured.evidence) if part)
    seeds = steadiness(verdict, study.seed_verdicts.get(key, ()))
    return Claim(key, row.text, row.source, verdict, text, evidence, thresholds(key), row.figure, seeds)


def verdict_on(key: str, values: Sequence[float]) -> Verdict:
    """Return the verdict on a claim of `ROWS` for values in the order of its limits; NaN where one is missing."""
    if key not in ROWS:
        raise UnknownNameError.of("claim", key, ROWS)
    limits = ROWS[key].limits
    if len(values) != len(limits) or not all(map(math.isfinite, values)):
        return "cannot be checked"
    grades = [limit.grade(value) for limit, value in zip(limits, values, strict=True)]
    if min(grades) == 2:
        return "agrees"
    supported = any(grade for limit, grade in zip(limits, grades, strict=True) if limit.alone)
    return "agrees in part" if supported else "differs"


def in_words(verdict: Verdict, kind: Kind, *, virtual: bool) -> str:
    """Word a verdict for the reader, with its damper."""
    if verdict not in _RECOVERED:
        return verdict
    if virtual and kind == "damper":
        return "not decided: the damper is virtual"
    if virtual and kind == "built in":
        return f"{_RECOVERED[verdict]} (built into the virtual damper)"
    preposition = "from" if verdict == "differs" else "with"
    return f"{verdict} {preposition} the paper on {'the virtual' if virtual else 'this'} damper"


def thresholds(key: str) -> str:
    """Return every limit of a claim, in words."""
    return "; ".join(limit.text for limit in ROWS[key].limits)


def steadiness(verdict: str, over_seeds: Sequence[str]) -> str:
    """Count the noise seeds with the same verdict and the other verdicts; empty where it was not checked again."""
    others = Counter(over_seeds)
    if set(others) <= {"cannot be checked"}:
        return ""
    same = others.pop(verdict, 0)
    return "; ".join([f"{same} of {len(over_seeds)}", *(f"{n} {other}" for other, n in others.most_common())])
