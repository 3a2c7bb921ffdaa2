"""The recipes that are compared: the paper's, its consistent counterpart, one fit of all runs, the traditional."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import ClassVar

import numpy as np

from mrdamper.dampers.base import Damper, Envelope
from mrdamper.dampers.certainty import Certainty
from mrdamper.dampers.coil import Coil
from mrdamper.dampers.modified import ModifiedFit, fit_modified
from mrdamper.dampers.published import all_published
from mrdamper.data import Condition, Run
from mrdamper.identification import Identification
from mrdamper.identification.harmonic_balance import SineRecord
from mrdamper.identification.methods.balance import Balance
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.paper.assumptions import PaperAssumptions
from mrdamper.paper.functions import fit_paper_functions
from mrdamper.paper.options import PaperOptions
from mrdamper.study.recipe import (
    Basis,
    FitResult,
    Recipe,
    conditioned,
    fit_functions_jointly,
    modified,
    play_and_bypass,
)

LITERAL, HALF, SAME_FORMS = "paper, literal", "paper, F0 half peak-to-peak", "consistent, the paper's functions"
CONSISTENT, JOINT = "consistent", "joint"
TRADITIONAL = "traditional, nearest speed"
SLOWEST = "traditional, slowest motion"
DIRECT = "direct genetic, nearest speed"
ALI = "Ali-type (Spencer-based)"

Steps = list[tuple[Recipe, Sequence[Run]]]


def recipes_of_paper(
    train: Sequence[Run],
    held_out: Sequence[Run],
    assumptions: PaperAssumptions,
    options: PaperOptions,
    *,
    explain: bool = True,
) -> Steps:
    """Return the recipes that are compared, but for the costly ones, and the identification runs each needs.

    Parameters
    ----------
    train, held_out : sequence of Run
    assumptions : PaperAssumptions
    options : PaperOptions
    explain : bool
        The literal method states for every run how much of its c is hysteretic.
    """
    literal = replace(options.method("optimum"), explain=explain)
    half = replace(literal, force_amplitude="half-peak-to-peak", explain=False)
    consistent = assumptions.basis(Balance())
    by_paper = partial(fit_paper_functions, mass_law=options.mass_law)
    plain = Basis("bouc-wen", Balance(), fixed=options.fixed)
    steps: Steps = [
        (Recipe("bouc-wen:literal", assumptions.basis(literal), by_paper, "paper", LITERAL), train),
        (Recipe("bouc-wen:half", assumptions.basis(half), by_paper, "paper", HALF), train),
        (Recipe("bouc-wen:same-forms", consistent, by_paper, "consistent", SAME_FORMS), train),
        (Recipe("bouc-wen:consistent", consistent, through_chosen, "consistent", CONSISTENT), train),
        (Recipe("bouc-wen:joint", plain, fit_functions_jointly, "joint", JOINT), train),
    ]
    nearest = [(TRADITIONAL, peak_velocity(held_out))] if held_out else []
    for title, speed in (*nearest, (SLOWEST, 0.0)):
        recipe = Recipe(f"bouc-wen:{title}", consistent, one_per_current, "traditional", title)
        steps.append((recipe, nearest_speed(train, speed)))
    return steps


def comparators(train: Sequence[Run], held_out: Sequence[Run], assumptions: PaperAssumptions) -> Steps:
    """Return the paper's comparators: every parameter by the genetic algorithm, one run a current; Ali's model.

    Ali's, whose every run is integrated thousands of times, is identified at every other current of a large matrix.
    """
    direct = Recipe(
        "bouc-wen:direct-genetic", assumptions.basis("direct-genetic"), one_per_current, "traditional", DIRECT
    )
    ali = conditioned(all_published()["ali-type"])
    return [
        (direct, nearest_speed(train, peak_velocity(held_out or train))),
        (replace(ali, way="literature", title=ALI), _fewer_currents(train)),
    ]


def _fewer_currents(train: Sequence[Run]) -> Sequence[Run]:
    """The runs at every other current and at the highest, where there are over five."""
    levels = sorted({round(SineRecord.of(run).condition.current_A, 2) for run in train})
    kept = levels[::2] if len(levels) > 5 else levels
    return [run for run in train if round(SineRecord.of(run).condition.current_A, 2) in (*kept, levels[-1])]


def literature(train: Sequence[Run]) -> Steps:
    """Bingham, hyperbolic tangent, the other condition-dependent dampers of the house, and play and bypass."""
    found = [modified("bingham"), modified("kwok"), play_and_bypass()]
    found += [conditioned(cls) for name, cls in all_published().items() if name != "ali-type"]
    return [(replace(recipe, way="literature"), train) for recipe in found]


def through_chosen(runs: Sequence[Run], identifications: Sequence[Identification]) -> FitResult:
    """Functions chosen by how they predict left-out conditions."""
    fit = chosen_functions(identifications)
    return FitResult(fit.damper, lambda rows: chosen_functions([identifications[i] for i in rows]).damper, fit)


def one_per_current(runs: Sequence[Run], identifications: Sequence[Identification]) -> FitResult:
    """One set of parameters a current, used at every motion: the traditional use."""
    damper = OnePerCurrent.of(identifications)
    return FitResult(damper, lambda rows: OnePerCurrent.of([identifications[i] for i in rows]))


def chosen_functions(found: Sequence[Identification]) -> ModifiedFit:
    """Functions chosen by how they predict left-out conditions."""
    forms = {**BoucWen.map_forms(), "k2": ("constant",), "m": ("constant", "quadratic-current")}
    # What was held has no function to find.
    held = {name for name in forms if name in BoucWen.__dataclass_fields__ and name not in found[0].free}
    return fit_modified(found, {name: ("constant",) if name in held else options for name, options in forms.items()})


@dataclass(frozen=True, eq=False)
class OnePerCurrent(Damper):
    """A model with one set of parameters for each current, from one motion: the traditional use.

    Attributes
    ----------
    rig : str
    models : tuple of (float, BoucWen)
        Current [A] and model.
    envelope : Envelope
    provenance : mapping
    coil : Coil, optional
    certainty : Certainty, optional
    """

    kind: ClassVar[str] = "one-per-current"

    rig: str
    models: tuple[tuple[float, BoucWen], ...]
    envelope: Envelope
    provenance: Mapping[str, str] = field(default_factory=dict)
    coil: Coil | None = None
    certainty: Certainty | None = None

    @classmethod
    def of(cls, found: Sequence[Identification]) -> OnePerCurrent:
        """Take the models of identifications at different currents."""
        models = tuple((i.condition.current_A, i.model) for i in found if isinstance(i.model, BoucWen))
        return cls(found[0].rig, models, Envelope.of([i.condition for i in found]))

    @property
    def title(self) -> str:
        return "traditional Bouc–Wen"

    @property
    def parameter_count(self) -> int:
        # c, f0, alpha, beta and stiffness or mass; the rest is preset
        return 5 * len(self.models)

    def model_at(self, condition: Condition) -> BoucWen:
        """The model at the nearest current."""
        return min(self.models, key=lambda pair: abs(pair[0] - condition.current_A))[1]


def peak_velocity(runs: Sequence[Run]) -> float:
    """Median peak velocity [m/s] of sine runs."""
    return float(np.median([SineRecord.of(run).condition.peak_velocity for run in runs]))


def nearest_speed(runs: Sequence[Run], speed: float) -> list[Run]:
    """At every current, the sine run whose peak velocity [m/s] is nearest to a speed."""
    nearest: dict[float, tuple[float, Run]] = {}
    for run in runs:
        condition = SineRecord.of(run).condition
        key, off = round(condition.current_A, 2), abs(condition.peak_velocity - speed)
        if key not in nearest or off < nearest[key][0]:
            nearest[key] = off, run
    return [nearest[key][1] for key in sorted(nearest)]
