"""Verdicts as pure functions of a few numbers, and every threshold in one table.

A claim agrees where each of its numbers meets its limit, agrees in part where some do or come
within the wider limit, and differs where none comes near. The quality of a fit must be good enough
for a claim to agree, but is no support by itself. A claim without all of its numbers cannot be
judged. A property that the virtual damper was built with is recovered, in part, or not; a claim on
the authors' own damper is not judged on the virtual one: values stand beside the paper's.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

import numpy as np

from mrdamper.errors import UnknownNameError

Verdict = Literal["agrees", "agrees in part", "differs", "not judged", "cannot be judged"]
Kind = Literal["method", "damper", "built in"]
VALUES = "values beside the paper's"  # of a claim on the authors' damper, shown of another one
_RECOVERED: Mapping[str, str] = MappingProxyType(
    {"agrees": "recovered", "agrees in part": "recovered in part", "differs": "not recovered"}
)
_WORDS: Mapping[str, str] = MappingProxyType(
    {
        "agrees": "agrees with the paper",
        "agrees in part": "agrees in part with the paper",
        "differs": "differs from the paper",
    }
)


def in_words(verdict: Verdict, kind: Kind, *, virtual: bool) -> str:
    """Word a verdict for the reader, with the damper it rests on.

    Parameters
    ----------
    verdict : Verdict
    kind : {"method", "damper", "built in"}
        A claim on the method; on the authors' damper; on what the virtual damper was built with.
    virtual : bool
        The data are of the virtual damper.
    """
    if verdict not in _WORDS:
        return verdict
    if virtual and kind == "damper":
        return f"{VALUES} (virtual damper)"
    if virtual and kind == "built in":
        return f"{_RECOVERED[verdict]} (built into the virtual damper)"
    return f"{_WORDS[verdict]} on {'the virtual' if virtual else 'this'} damper"


@dataclass(frozen=True)
class Limit:
    """One number's limit.

    Attributes
    ----------
    number : str
        What it is, in words.
    sense : {"below", "above"}
    holds : float
        The number must be on this side of it, the limit itself included.
    near : float
        Wider limit, within which the claim holds in part; the same where there is none.
    alone : bool
        Whether it speaks for the claim even where no other number does.
    """

    number: str
    sense: Literal["below", "above"]
    holds: float
    near: float
    alone: bool = True

    def grade(self, value: float) -> int:
        """2 within the limit, 1 within the wider one, 0 beyond both."""
        holds, near = (value <= end if self.sense == "below" else value >= end for end in (self.holds, self.near))
        return 2 if holds else 1 if near else 0

    @property
    def text(self) -> str:
        """The threshold in words."""
        sign = "≤" if self.sense == "below" else "≥"
        wider = "" if self.near == self.holds else f" (in part: {sign} {self.near:g})"
        return f"{self.number} {sign} {self.holds:g}{wider}"


def _fitted(number: str, holds: float, near: float) -> Limit:
    return Limit(number, "above", holds, near, alone=False)


def _below(number: str, holds: float, near: float | None = None) -> Limit:
    return Limit(number, "below", holds, holds if near is None else near)


def _above(number: str, holds: float, near: float | None = None) -> Limit:
    return Limit(number, "above", holds, holds if near is None else near)


LIMITS: Mapping[str, tuple[Limit, ...]] = MappingProxyType(
    {
        "gas series": (_below("error of the series over the gas force", 0.02, 0.05),),
        "friction": (
            _above("least friction, N", 25.0, 15.0),
            _below("largest friction, N", 100.0, 150.0),
            _below("mean friction over the smallest peak force", 0.05, 0.15),
        ),
        "bulge": (_above("share of loops wider at x = 0 than at 0.8 X", 1.0, 0.8),),
        "energy": (
            _above("share of current steps that raise the energy", 1.0, 0.9),
            _above("share of frequency steps that raise the energy", 1.0, 0.9),
        ),
        "stroke end": (_above("lost length at the fast motion over that at the slow one", 1.25, 1.15),),
        "phase": (
            _above("share of runs within 1.4–1.5 rad", 1.0, 0.5),
            _below("largest change with the current at one motion, rad", 0.02, 0.05),
        ),
        "quadratic": (_above("least R² of a motion", 0.98, 0.9),),
        "speed shift": (_above("R² of one surface for all runs", 0.98, 0.9),),
        "saturation": (_below("slope above 1.5 A over slope below 1 A", 0.4, 0.7),),
        "viscosity": (_below("median of closed form over consistent c", 1.1, 1.5),),
        "mass": (
            _fitted("R² of m over current and frequency", 0.9, 0.6),
            _below("largest spread of m over amplitudes, over its mean", 0.2, 0.5),
            _above("least m, kg", 0.0),
        ),
        "alpha": (
            _above("sign of the slope over frequency", 1.0),
            _below("sign of the slope over amplitude", -1.0),
            _fitted("R²", 0.9, 0.6),
        ),
        "beta": (
            _below("scatter of ln β at the highest current over that at the lowest", 0.5, 0.8),
            _fitted("R² of ln β", 0.9, 0.6),
            Limit("share of runs at the limit of the box", "below", 0.1, 0.3, alone=False),
        ),
        "presets": (
            _below("error left by a wrong n, others identified anew", 0.02, 0.05),
            _below("error left by a wrong γ/β, others identified anew", 0.02, 0.05),
            _below("error left by a wrong A, others identified anew", 1e-6, 1e-3),
        ),
        "search": (
            _below("median factor by which α misses the optimum", 1.1, 2.0),
            _below("median factor by which β misses the optimum", 1.1, 2.0),
        ),
        "accuracy": (
            _below("median validation error over the traditional Bouc–Wen's", 1.1, 1.5),
            _below("mean relative error (Eq. 44) over the traditional Bouc–Wen's", 1.1, 1.5),
        ),
        "few parameters": (
            _below("median held-out error over the Ali-type's", 1.1, 1.5),
            _below("searched parameters a run over the Ali-type's", 0.99),
        ),
        "fast": (_below("forces until within 1 % of the search's end, over the traditional Bouc–Wen's", 0.99, 1.5),),
        "generalisation": (
            Limit("median held-out error over the median error of identification", "below", 1.5, 2.5, alone=False),
            _below("worst held-out error, nrmse_pp", 0.1, 0.2),
        ),
    }
)


@dataclass(frozen=True)
class Measured:
    """The numbers a claim rests on.

    Attributes
    ----------
    numbers : mapping of str to float
        By the words of the claim's limits; empty where it cannot be judged.
    evidence : str
        More of what was found, or why nothing could be.
    """

    numbers: Mapping[str, float] = field(default_factory=dict)
    evidence: str = ""


def measured(key: str, *values: float | np.floating, evidence: str = "") -> Measured:
    """The numbers of a claim in the order of its limits."""
    return Measured({limit.number: float(v) for limit, v in zip(LIMITS[key], values, strict=True)}, evidence)


def unknown(why: str) -> Measured:
    """No numbers, and the reason."""
    return Measured(evidence=why)


def judge(key: str, numbers: Mapping[str, float]) -> Verdict:
    """The verdict on a claim.

    Parameters
    ----------
    key : str
        Of `LIMITS`.
    numbers : mapping of str to float
        By the words of the limits; NaN where one is missing.

    Raises
    ------
    UnknownNameError
        If there is no such claim, or a number is not one of its own.
    """
    if key not in LIMITS:
        raise UnknownNameError.of("claim", key, LIMITS)
    limits = LIMITS[key]
    for name in numbers:
        if name not in {limit.number for limit in limits}:
            raise UnknownNameError.of(f"number of claim {key}", name, [limit.number for limit in limits])
    values = [float(numbers.get(limit.number, math.nan)) for limit in limits]
    if not all(map(math.isfinite, values)):
        return "cannot be judged"
    grades = [limit.grade(value) for limit, value in zip(limits, values, strict=True)]
    if min(grades) == 2:
        return "agrees"
    speaking = [grade for limit, grade in zip(limits, grades, strict=True) if limit.alone]
    return "differs" if max(speaking) == 0 else "agrees in part"


def thresholds(key: str) -> str:
    """Every threshold of a claim, in words."""
    return "; ".join(limit.text for limit in LIMITS[key])


def steadiness(verdict: str, over_seeds: Sequence[str]) -> str:
    """How often noise seeds give the same verdict, and what the others say; empty where it was not judged again."""
    others = Counter(over_seeds)
    if set(others) <= {"cannot be judged"}:
        return ""
    same = others.pop(verdict, 0)
    text = f"{same} of {len(over_seeds)}"
    return "; ".join([text, *(f"{count} {other}" for other, count in others.most_common())])
