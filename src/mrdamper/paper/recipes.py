"""Recipes that are compared: the paper's, its consistent counterpart, one fit of all runs, the traditional use."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.modified import ModifiedFit, fit_modified
from mrdamper.dampers.published import all_published
from mrdamper.data import Condition, Run
from mrdamper.identification import Identification
from mrdamper.identification.basis import Basis
from mrdamper.identification.harmonic_balance import SineRecord
from mrdamper.identification.methods.balance import Balance
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.paper.assumptions import PaperAssumptions
from mrdamper.paper.direct_genetic import DirectGenetic
from mrdamper.paper.functions import fit_paper_functions
from mrdamper.paper.options import (
    ALI,
    CONSISTENT,
    DIRECT,
    HALF,
    JOINT,
    LITERAL,
    SAME_FORMS,
    SLOWEST,
    TRADITIONAL,
    PaperOptions,
)
from mrdamper.study.fit_result import FitResult
from mrdamper.study.recipe import Recipe, conditioned, fit_functions_jointly, modified, whole_damper

_MOST_CURRENTS = 5  # currents at which Ali's model is identified on every run

Steps = list[tuple[Recipe, Sequence[Run]]]


def recipes_of_paper(
    train: Sequence[Run],
    held_out: Sequence[Run],
    assumptions: PaperAssumptions,
    options: PaperOptions,
    *,
    explain: bool = True,
) -> Steps:
    """Return the fast recipes and the runs of each; with `explain` the literal one states the hysteretic part of c."""
    literal = replace(options.method("optimum"), explain=explain)
    half = replace(literal, force_amplitude="half-peak-to-peak", explain=False)
    consistent = assumptions.basis(Balance())
    by_paper = partial(fit_paper_functions, mass_law=options.mass_law)
    plain = Basis("bouc-wen", Balance(), fixed=options.fixed)
    steps: Steps = [
        (Recipe("bouc-wen:literal", assumptions.basis(literal), by_paper, "paper", LITERAL), train),
        (Recipe("bouc-wen:half", assumptions.basis(half), by_paper, "paper", HALF), train),
        (Recipe("bouc-wen:same-forms", consistent, by_paper, "consistent", SAME_FORMS), train),
        (Recipe("bouc-wen:consistent", consistent, fit_chosen_functions, "consistent", CONSISTENT), train),
        (Recipe("bouc-wen:joint", plain, fit_functions_jointly, "joint", JOINT), train),
    ]
    for title, speed in ((TRADITIONAL, _peak_velocity(held_out)), (SLOWEST, 0.0)):
        if speed is not None:
            recipe = Recipe(f"bouc-wen:{title}", consistent, one_per_current, "traditional", title)
            steps.append((recipe, nearest_speed(train, speed)))
    return steps


def comparators(train: Sequence[Run], held_out: Sequence[Run], assumptions: PaperAssumptions) -> Steps:
    """Return the paper's comparators: genetic search on a run per current; Ali's slow model on every other current."""
    basis = assumptions.basis(DirectGenetic.name)
    direct = Recipe("bouc-wen:direct-genetic", basis, one_per_current, "traditional", DIRECT)
    ali = replace(conditioned(all_published()["ali-type"]), way="literature", title=ALI)
    levels = sorted({_level(run) for run in train})
    kept = {*(levels[::2] if len(levels) > _MOST_CURRENTS else levels), levels[-1]}
    nearest = nearest_speed(train, _peak_velocity(held_out or train) or 0.0)
    return [(direct, nearest), (ali, [run for run in train if _level(run) in kept])]


def literature(train: Sequence[Run]) -> Steps:
    """Return Bingham, hyperbolic tangent, play and bypass, and the published dampers but Ali's."""
    recipes = [modified("bingham"), modified("kwok"), whole_damper("play-bypass")]
    recipes += [conditioned(cls) for name, cls in all_published().items() if name != "ali-type"]
    return [(replace(recipe, way="literature"), train) for recipe in recipes]


def fit_chosen_functions(runs: Sequence[Run], identifications: Sequence[Identification]) -> FitResult:
    """Fit functions chosen by leave-one-condition-out cross-validation."""
    fit = chosen_functions(identifications)
    return FitResult(fit.damper, lambda rows: chosen_functions([identifications[i] for i in rows]).damper, fit)


def one_per_current(runs: Sequence[Run], identifications: Sequence[Identification]) -> FitResult:
    """Take one set of parameters per current for every motion: the traditional use."""
    damper = OnePerCurrent.of(identifications)
    return FitResult(damper, lambda rows: OnePerCurrent.of([identifications[i] for i in rows]))


def chosen_functions(identifications: Sequence[Identification]) -> ModifiedFit:
    """Fit functions chosen by leave-one-condition-out cross-validation; held parameters stay constant."""
    forms = {**BoucWen.map_forms(), "k2": ("constant",), "m": ("constant", "quadratic-current")}
    held = set(BoucWen.__dataclass_fields__) - set(identifications[0].free)
    return fit_modified(
        identifications, {name: ("constant",) if name in held else options for name, options in forms.items()}
    )


@dataclass(frozen=True, eq=False)
class OnePerCurrent(Damper):
    """Damper with one set of parameters for each current, from one motion: the traditional use."""

    kind: ClassVar[str] = "one-per-current"

    models: tuple[tuple[float, BoucWen], ...]  # current [A] and model

    @classmethod
    def of(cls, identifications: Sequence[Identification]) -> OnePerCurrent:
        """Take the models of identifications at different currents."""
        models = tuple((i.condition.current_A, i.model) for i in identifications if isinstance(i.model, BoucWen))
        envelope = Envelope.of([i.condition for i in identifications])
        return cls(models, rig=identifications[0].rig, envelope=envelope)

    @property
    def title(self) -> str:
        return "traditional Bouc–Wen"

    @property
    def parameter_count(self) -> int:
        return 5 * len(self.models)  # c, f0, alpha, beta and stiffness or mass; the rest is preset

    def model_at(self, condition: Condition) -> BoucWen:
        """Return the model at the nearest current."""
        return min(self.models, key=lambda pair: abs(pair[0] - condition.current_A))[1]


def nearest_speed(runs: Sequence[Run], speed: float) -> list[Run]:
    """Return, for every current, the sine run whose peak velocity [m/s] is nearest to a speed."""
    nearest: dict[float, Run] = {}
    for run in sorted(runs, key=lambda run: abs(SineRecord.of(run).condition.peak_velocity - speed)):
        nearest.setdefault(_level(run), run)
    return [nearest[level] for level in sorted(nearest)]


def _peak_velocity(runs: Sequence[Run]) -> float | None:
    return float(np.median([SineRecord.of(run).condition.peak_velocity for run in runs])) if runs else None


def _level(run: Run) -> float:
    return round(SineRecord.of(run).condition.current_A, 2)
