"""What the study of the paper found: results that claims judge, figures draw and tables list."""

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
from mrdamper.paper.genetic import GeneticMinimum
from mrdamper.paper.options import PaperOptions
from mrdamper.paper.recipes import ALI, DIRECT, LITERAL, TRADITIONAL
from mrdamper.paper.sensitivity import OneAtATime, Sobol
from mrdamper.paper.virtual_rig import VirtualRig
from mrdamper.physics.gas_spring import GasSpring
from mrdamper.statistics.functions.fitting import FunctionFit
from mrdamper.study.recipe import Scored

SAME_CURRENT = 0.02  # difference within which two runs have one current [A]
SAME = 0.08  # relative tolerance within which two runs have one motion


@dataclass(frozen=True)
class GeneticCheck:
    """The genetic search with the paper's settings on one run beside the optimum it is after.

    Attributes
    ----------
    condition : Condition
    minimum : GeneticMinimum
    reached, optimum : float
        RMSE where it ended and the lowest there is [N].
    seconds : float
    """

    condition: Condition
    minimum: GeneticMinimum
    reached: float
    optimum: float
    seconds: float


@dataclass(frozen=True)
class Ended:
    """Where a genetic search of fewer generations ended on a run, over the optimum.

    Attributes
    ----------
    run_id : str
    seed : int
    alpha, beta : float
        Parameter reached over that of the optimum.
    error : float
        RMSE reached over the lowest there is.
    forces, to_settle : int
        Computed in all, and until no error lower by over a hundredth was found.
    seconds : float
    """

    run_id: str
    seed: int
    alpha: float
    beta: float
    error: float
    forces: int
    to_settle: int
    seconds: float


@dataclass(frozen=True, eq=False)
class Reproduction:
    """Everything the study found.

    Attributes
    ----------
    dataset : Dataset
    rig : VirtualRig or None
        The truth, where the data are synthetic.
    gas : GasSpring or None
    train, held_out : tuple of Run
    friction : Run or None
    loops : tuple of LoopAnalysis
    readings : tuple of ForceReading
        F0, phi, f0 of the train runs.
    contenders : tuple of Scored
        Their `recipe.title` tells them apart.
    options : PaperOptions
    there : mapping of (str, str) to Identification or str
        By title and run id: held-out runs identified the literal and the consistent way, or why not.
    genetic : tuple of GeneticCheck
    ended : tuple of Ended
        Genetic searches over all train runs, one seed each.
    direct : mapping of str to int
        Forces computed until the direct genetic search of a run settled, by run id.
    seed_errors : mapping of str to (S,) array
        Median nrmse_pp over the held-out runs, one a noise seed, by contender.
    seed_verdicts : mapping of str to tuple of str
        Verdicts on a claim by its key, one a noise seed.
    sensitivity : tuple of OneAtATime
        At the run in the middle of the consistent identifications.
    sobol : Sobol or None
    notes : tuple of str
    seconds : float
    """

    dataset: Dataset
    rig: VirtualRig | None
    gas: GasSpring | None
    train: tuple[Run, ...]
    held_out: tuple[Run, ...]
    friction: Run | None
    loops: tuple[LoopAnalysis, ...]
    readings: tuple[ForceReading, ...]
    contenders: tuple[Scored, ...]
    options: PaperOptions
    there: Mapping[tuple[str, str], Identification | str] = field(default_factory=dict)
    genetic: tuple[GeneticCheck, ...] = ()
    ended: tuple[Ended, ...] = ()
    direct: Mapping[str, int] = field(default_factory=dict)
    seed_errors: Mapping[str, Floats] = field(default_factory=dict)
    seed_verdicts: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    sensitivity: tuple[OneAtATime, ...] = ()
    sobol: Sobol | None = None
    notes: tuple[str, ...] = ()
    seconds: float = 0.0

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """Measured conditions of the train runs."""
        return tuple(loop.condition for loop in self.loops if loop.split == "train")

    def contender(self, title: str) -> Scored | None:
        """The contender of that title, where the data allowed it."""
        return next((c for c in self.contenders if c.recipe.title == title), None)

    def named(self, *titles: str) -> list[Scored]:
        """The contenders of these titles, where the data allowed them."""
        return [c for title in titles if (c := self.contender(title))]

    def amplitude_group(self, place: int) -> list[Run]:
        """Return the identification runs of the smallest (0) or largest (-1) of the two most tested amplitudes."""
        groups: list[list[Run]] = []
        levels: list[float] = []
        for run, condition in sorted(
            zip(self.train, self.conditions, strict=True), key=lambda pair: pair[1].amplitude_m
        ):
            if not levels or np.log(condition.amplitude_m / levels[-1]) > SAME:
                groups.append([])
                levels.append(condition.amplitude_m)
            groups[-1].append(run)
        most = sorted(range(len(groups)), key=lambda i: -len(groups[i]))[:2]
        return groups[sorted(most)[place]]

    @property
    def best(self) -> Scored | None:
        """The contender that predicts the held-out runs best, where there are any."""
        judged = [c for c in self.contenders if c.validation.runs]
        return min(judged, key=lambda c: c.validation.median(), default=None)


def motions(study: Reproduction) -> list[list[int]]:
    """Indices of the train runs of every motion, by rising current."""
    groups = same_motion(study.conditions, tolerance=SAME)
    return [sorted(group, key=lambda i: study.conditions[i].current_A) for group in groups]


def amplitudes(study: Reproduction) -> Floats:
    """F0 of the train runs [N]."""
    return np.array([r.amplitude for r in study.readings])


def values(study: Reproduction, title: str, name: str) -> Floats:
    """A parameter of a contender's identifications [SI]; empty where there are none."""
    contender = study.contender(title)
    return np.array([float(getattr(i.model, name)) for i in (contender.identifications if contender else ())])


def function_of(study: Reproduction, name: str) -> FunctionFit | None:
    """The function of a parameter by the literal recipe, if there is one."""
    contender = study.contender(LITERAL)
    fit = contender.fit if contender else None
    return fit.functions.get(name) if isinstance(fit, ModifiedFit) else None


def forces_a_run(study: Reproduction, way: Scored) -> float:
    """Forces computed to identify from one run, median; the paper's own way by its genetic search."""
    counts = [i.evaluations for i in way.identifications]
    if way.recipe.title == LITERAL and study.ended:
        counts = [end.forces for end in study.ended]
    return float(np.median(counts)) if counts else float("nan")


def rate_rows(study: Reproduction) -> list[dict[str, Any]]:
    """List accuracy and identification rate over the current at the validation runs, by method [section 6].

    Rate: forces computed until a genetic search is within 1 % of its end, median of the runs identified at that
    current; for a search by least squares, until its end.
    """
    current = {run.id: c.current_A for run, c in zip(study.train, study.conditions, strict=True)}
    counts: dict[str, dict[str, int]] = {LITERAL: {end.run_id: end.to_settle for end in study.ended}}
    counts[DIRECT] = dict(study.direct)
    rows = []
    for method in study.named(LITERAL, TRADITIONAL, ALI, DIRECT):
        title = method.recipe.title
        settled = counts.get(title) or {i.run_id: i.evaluations for i in method.identifications}
        for score in sorted(method.validation.runs, key=lambda r: r.condition.current_A):
            near = [n for name, n in settled.items() if abs(current[name] - score.condition.current_A) < SAME_CURRENT]
            rows.append(
                {
                    "method": title,
                    "current_A": score.condition.current_A,
                    "nrmse_pp": score.scores.nrmse_pp,
                    "wape": score.scores.wape,
                    "mean_relative_error": score.scores.mean_relative_error,
                    "forces_until_settled": float(np.median(near)) if near else None,
                }
            )
    return rows


def seconds_a_run(study: Reproduction, way: Scored) -> float:
    """Time of an identification with its share of the fit over conditions; the paper's own by its genetic search."""
    if way.recipe.title == LITERAL and study.ended:
        return float(np.mean([end.seconds for end in study.ended]))
    return way.seconds / max(len(way.identifications), 1)
