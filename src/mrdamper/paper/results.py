"""Results of the study of the paper, which claims check, figures draw and tables list."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mrdamper.dampers.modified import ModifiedFit
from mrdamper.data import Condition, Dataset, Floats, Run, same_motion
from mrdamper.identification import Identification
from mrdamper.identification.harmonic_balance import ForceReading
from mrdamper.identification.loop_analysis import LoopAnalysis
from mrdamper.paper.assumptions import SAME
from mrdamper.paper.genetic import GeneticMinimum
from mrdamper.paper.options import ALI, DIRECT, LITERAL, TRADITIONAL, PaperOptions
from mrdamper.paper.sensitivity import OneAtATime, Sobol
from mrdamper.paper.virtual_rig import VirtualRig
from mrdamper.physics.gas_spring import GasSpring
from mrdamper.statistics.functions.fitting import FunctionFit
from mrdamper.study.recipe import RecipeResult

SAME_CURRENT = 0.02  # difference within which two runs have one current [A]


@dataclass(frozen=True)
class GeneticCheck:
    """Genetic search with the paper's settings on one run, and the optimum of the same error."""

    condition: Condition
    minimum: GeneticMinimum
    # reached and optimum: RMSE at the end of the search and its minimum [N]
    reached: float
    optimum: float
    seconds: float


@dataclass(frozen=True)
class GeneticEnd:
    """End of a genetic search of fewer generations on a run, over the optimum."""

    run_id: str
    seed: int
    # alpha, beta and error: parameters and RMSE reached over those of the optimum
    alpha: float
    beta: float
    error: float
    # forces and to_settle: computed in all, and until the error is within 1 % of the final one
    forces: int
    to_settle: int
    seconds: float


@dataclass(frozen=True, eq=False)
class Reproduction:
    """Results of the study."""

    dataset: Dataset
    rig: VirtualRig | None  # the true damper, where the data are synthetic
    gas: GasSpring | None
    train: tuple[Run, ...]
    held_out: tuple[Run, ...]
    friction: Run | None  # slow test
    loops: tuple[LoopAnalysis, ...]
    readings: tuple[ForceReading, ...]  # F0, phi, f0 of the identification runs
    options: PaperOptions
    contenders: tuple[RecipeResult, ...] = ()  # compared methods, with different `recipe.title`
    # validation runs identified by the literal and the consistent method, by title and run id, or why not
    there: Mapping[tuple[str, str], Identification | str] = field(default_factory=dict)
    genetic: tuple[GeneticCheck, ...] = ()
    ended: tuple[GeneticEnd, ...] = ()  # one for each identification run, with its own seed
    # forces computed until the direct genetic search settled, by run id
    direct: Mapping[str, int] = field(default_factory=dict)
    # median validation nrmse_pp by method, one per noise seed
    seed_errors: Mapping[str, Floats] = field(default_factory=dict)
    # verdicts by the key of the claim, one per noise seed
    seed_verdicts: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    sensitivity: tuple[OneAtATime, ...] = ()
    sobol: Sobol | None = None
    notes: tuple[str, ...] = ()
    seconds: float = 0.0

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """Measured conditions of the identification runs."""
        return tuple(loop.condition for loop in self.loops if loop.split == "train")

    def contender(self, title: str) -> RecipeResult | None:
        """Return the method of that title, where the data allowed it."""
        return next((c for c in self.contenders if c.recipe.title == title), None)

    def named(self, *titles: str) -> list[RecipeResult]:
        """Return the methods of these titles, where the data allowed them."""
        return [c for title in titles if (c := self.contender(title))]

    @property
    def best(self) -> RecipeResult | None:
        """Method with the lowest median validation error, where there are validation runs."""
        scored = [c for c in self.contenders if c.validation.runs]
        return min(scored, key=lambda c: c.validation.median(), default=None)

    def amplitude_group(self, place: int) -> list[Run]:
        """Return the identification runs of the smaller (0) or larger (-1) of the two most tested amplitudes."""
        groups: list[list[Run]] = []
        level = 0.0
        for condition, run in sorted(zip(self.conditions, self.train, strict=True), key=lambda p: p[0].amplitude_m):
            if not groups or np.log(condition.amplitude_m / level) > SAME:
                groups.append([])
                level = condition.amplitude_m
            groups[-1].append(run)
        most = sorted(range(len(groups)), key=lambda i: -len(groups[i]))[:2]
        return groups[sorted(most)[place]]


def motions(study: Reproduction) -> list[list[int]]:
    """Return the indices of the identification runs of every motion, by rising current."""
    groups = same_motion(study.conditions, tolerance=SAME)
    return [sorted(group, key=lambda i: study.conditions[i].current_A) for group in groups]


def values(study: Reproduction, title: str, name: str) -> Floats:
    """Return F0 [N], or a parameter of a method's identifications [SI]; empty where there are none."""
    if name == "F0":
        return np.array([r.amplitude for r in study.readings])
    method = study.contender(title)
    return np.array([float(getattr(i.model, name)) for i in (method.identifications if method else ())])


def function_of(study: Reproduction, name: str) -> FunctionFit | None:
    """Return the function of a parameter by the literal method, if there is one."""
    literal = study.contender(LITERAL)
    fit = literal.fit if literal else None
    return fit.functions.get(name) if isinstance(fit, ModifiedFit) else None


def rate_rows(study: Reproduction) -> list[dict[str, Any]]:
    """List accuracy and identification rate over the current at the validation runs, by method [section 6].

    Rate: forces computed until a genetic search is within 1 % of its end, median of the runs identified at that
    current; for a search by least squares, until its end.
    """
    current = {run.id: c.current_A for run, c in zip(study.train, study.conditions, strict=True)}
    searches = {LITERAL: {end.run_id: end.to_settle for end in study.ended}, DIRECT: dict(study.direct)}
    rows = []
    for method in study.named(LITERAL, TRADITIONAL, ALI, DIRECT):
        title = method.recipe.title
        counts = searches.get(title) or {i.run_id: i.evaluations for i in method.identifications}
        for score in sorted(method.validation.runs, key=lambda r: r.condition.current_A):
            near = [n for name, n in counts.items() if abs(current[name] - score.condition.current_A) < SAME_CURRENT]
            rows.append(
                {"method": title, "current_A": score.condition.current_A, "nrmse_pp": score.scores.nrmse_pp,
                 "wape": score.scores.wape, "mean_relative_error": score.scores.mean_relative_error,
                 "forces_until_settled": float(np.median(near)) if near else None}
            )  # fmt: skip
    return rows


def cost_per_run(study: Reproduction, method: RecipeResult) -> tuple[float, float]:
    """Return forces (median) and seconds per identification, the fit included; the paper's by its genetic search."""
    if method.recipe.title == LITERAL and study.ended:
        return float(np.median([e.forces for e in study.ended])), float(np.mean([e.seconds for e in study.ended]))
    counts = [i.evaluations for i in method.identifications]
    return float(np.median(counts)) if counts else float("nan"), method.seconds / max(len(counts), 1)


@dataclass(frozen=True)
class Measured:
    """Values of a claim in the order of its limits; empty where it could not be measured."""

    values: tuple[float, ...] = ()
    evidence: str = ""  # further values, or why there are none

    @classmethod
    def of(cls, *values: float | np.floating, evidence: str = "") -> Measured:
        """Take values in the order of the limits."""
        return cls(tuple(map(float, values)), evidence)


def unknown(why: str) -> Measured:
    """Return no values, and the reason."""
    return Measured(evidence=why)
