"""Whether errors and verdicts are the noise's: the ways and the claims once more, a noise seed each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from mrdamper.data import Condition, Floats
from mrdamper.identification.harmonic_balance import SineRecord, read_force
from mrdamper.identification.loop_analysis import analyse_loop
from mrdamper.paper.assumptions import PaperAssumptions
from mrdamper.paper.claims import judge_all
from mrdamper.paper.options import PaperOptions
from mrdamper.paper.recipes import HALF, JOINT, recipes_of_paper
from mrdamper.paper.results import Reproduction
from mrdamper.paper.virtual_rig import VirtualRig, friction_test, noisy_dataset, true_runs
from mrdamper.physics.motion import Excitation
from mrdamper.study.recipe import Progress, fit_and_score_all

CURRENTS = (0.0, 0.5, 1.0, 1.5, 2.0)
_CYCLES = 2
# The forms of a joint fit chosen anew take as long as all the rest; noise moves both readings of F0 alike.
_ONCE = (JOINT, HALF)


@dataclass(frozen=True)
class Seed:
    """What one noise seed says.

    Attributes
    ----------
    errors : mapping of str to float
        Median nrmse_pp over the held-out runs, by contender.
    verdicts : mapping of str to str
        By the key of the claim.
    """

    errors: Mapping[str, float]
    verdicts: Mapping[str, str]


def by_seed(found: Sequence[Seed]) -> tuple[dict[str, Floats], dict[str, tuple[str, ...]]]:
    """Errors by contender and verdicts by claim, one a noise seed."""
    errors = {title: np.array([seed.errors[title] for seed in found]) for title in (found[0].errors if found else ())}
    return errors, {key: tuple(seed.verdicts[key] for seed in found) for key in (found[0].verdicts if found else ())}


def one_seed(rig: VirtualRig, options: PaperOptions, seed: int, progress: Progress) -> Seed:
    """The quick ways and the claims they allow, with one seed of noise, on every other current and two cycles a run."""
    progress(f"noise seed {seed}", 0.0)
    dataset = noisy_dataset(rig, _truth(rig), seed)
    train, held_out = list(dataset.split("train")), list(dataset.split("validate"))
    assumptions = PaperAssumptions.of(train, rig.gas).preset(options.fixed)
    steps = [
        step
        for step in recipes_of_paper(train, held_out, assumptions, options, explain=False)
        if step[0].title not in _ONCE
    ]
    contenders, _ = fit_and_score_all(steps, held_out, leave_out=False)
    study = Reproduction(
        dataset=dataset,
        rig=rig,
        gas=rig.gas,
        train=tuple(train),
        held_out=tuple(held_out),
        friction=friction_test(rig, seed=seed, filled=options.friction_test == "filled"),
        loops=tuple(analyse_loop(run) for run in (*train, *held_out)),
        readings=tuple(read_force(SineRecord.of(run)) for run in train),
        contenders=tuple(contenders),
        options=options,
    )
    return Seed(
        {c.recipe.title: c.validation.median() for c in contenders}, {c.key: c.verdict for c in judge_all(study)}
    )


@cache
def _truth(rig: VirtualRig) -> Sequence[tuple[Condition, Excitation, Floats]]:
    return true_runs(rig, CURRENTS, cycles=_CYCLES)
