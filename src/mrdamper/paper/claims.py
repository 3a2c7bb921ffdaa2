"""Claim by claim: what the paper says of its damper and its method, in numbers, and the verdict on them.

`tested` and `identified` measure; the thresholds and the verdicts stand in `verdicts`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mrdamper.paper import claims_on_fits, claims_on_tests
from mrdamper.paper.results import Reproduction
from mrdamper.paper.verdicts import Kind, Measured, Verdict, in_words, judge, steadiness, thresholds


@dataclass(frozen=True)
class Claim:
    """One claim of the paper.

    Attributes
    ----------
    key : str
        Of the table of limits.
    text : str
    source : str
        Equation or section of Qian et al. 2024.
    verdict : str
        As `verdicts.judge` gives it.
    said : str
        The verdict for a reader: what a virtual rig was built with is recovered, not confirmed.
    evidence : str
        The numbers it rests on.
    threshold : str
    figure : str
        Name of the figure that shows it.
    seeds : str
        How many noise seeds say the same, and what the others say; empty where it was judged once.
    """

    key: str
    text: str
    source: str
    verdict: Verdict
    said: str
    evidence: str
    threshold: str
    figure: str
    seeds: str


def judge_all(study: Reproduction) -> tuple[Claim, ...]:
    """Measure and judge every claim; one that the data do not allow says why."""
    claims = []
    for key, text, source, figure, kind, measure in _CLAIMS:
        found = measure(study)
        verdict = judge(key, found.numbers)
        numbers = "; ".join(
            f"{name} {value:.3g}" if np.isfinite(value) else f"{name}: not tested"
            for name, value in found.numbers.items()
        )
        said = in_words(verdict, kind, virtual=study.rig is not None)
        if kind == "damper" and study.rig is not None and verdict != "cannot be judged":
            verdict = "not judged"
        evidence = "; ".join(part for part in (numbers, found.evidence) if part)
        seeds = steadiness(verdict, study.seed_verdicts.get(key, ()))
        claims.append(Claim(key, text, source, verdict, said, evidence, thresholds(key), figure, seeds))
    return tuple(claims)


# Key of the limits, claim, where it stands, figure, kind, measurement.
_CLAIMS: tuple[tuple[str, str, str, str, Kind, Callable[[Reproduction], Measured]], ...] = (
    ("gas series", "A series of third order replaces the gas force.",
     "Eq. 3–7", "", "built in", claims_on_tests.gas_series),
    ("friction", "Seal friction is 25–100 N at 0.01 mm/s and may be neglected.",
     "section 2", "fig03", "damper", claims_on_tests.friction),
    ("bulge", "Force–displacement loops bulge at x = 0.",
     "section 2", "fig05", "damper", claims_on_tests.bulges),
    ("energy", "The dissipated energy rises with frequency and current.",
     "section 2", "analysis", "damper", claims_on_tests.energy),
    ("stroke end", "After each stroke end the force is missing for a length that grows with speed.",
     "section 2", "fig04", "built in", claims_on_tests.stroke_end),
    ("phase", "The force leads by 1.4–1.5 rad whatever the current.",
     "Eq. 16–19", "phase", "damper", claims_on_tests.phase),
    ("quadratic", "At every motion F0 is a quadratic of the current.",
     "Eq. 23", "fig12", "method", claims_on_tests.quadratic),
    ("speed shift", "f · A shifts the quadratic of F0 (and so c X ω) without bending it.",
     "Eq. 24–26", "fig14", "method", claims_on_tests.speed_shift),
    ("saturation", "The magnetic circuit saturates near 1.5 A.",
     "section 2", "fig06", "built in", claims_on_tests.saturation),
    ("viscosity", "F0 sin φ/(X ω) is the viscous damping.",
     "Eq. 19", "function_c", "method", claims_on_fits.viscosity),
    ("mass", "The equivalent mass falls off with frequency and does not depend on the amplitude.",
     "Eq. 27–31", "function_m", "method", claims_on_fits.mass),
    ("alpha", "α rises with the frequency and falls with the amplitude, in a plane beside its current law.",
     "Eq. 32–36", "fig20", "damper", claims_on_fits.alpha),
    ("beta", "β over current: curves that differ at small current merge at large current.",
     "Eq. 37–40", "fig21", "method", claims_on_fits.beta),
    ("presets", "The preset parameters are insensitive.",
     "section 4", "sensitivity", "method", claims_on_fits.presets),
    ("search", "The genetic algorithm finds α and β.",
     "section 4.3, Eq. 21–22", "genetic", "method", claims_on_fits.search),
    ("accuracy", "The accuracy is comparable to that of the traditional Bouc–Wen model.",
     "section 6", "fig26", "method", claims_on_fits.accuracy),
    ("few parameters", "The accuracy is close to that of Ali's model with fewer parameters.",
     "section 6", "fig26", "method", claims_on_fits.few_parameters),
    ("fast", "Identification is faster than that of the traditional Bouc–Wen model.",
     "section 6", "fig26", "method", claims_on_fits.fast),
    ("generalisation", "The model predicts a motion that was not tested (80 mm, 1 Hz).",
     "section 6", "fig24", "method", claims_on_fits.generalisation),
)  # fmt: skip
