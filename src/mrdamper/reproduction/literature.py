"""The models the paper compares with, and those users expect, on the same runs."""

from __future__ import annotations

import time
from collections.abc import Sequence

from mrdamper.dampers.joint import JointProblem
from mrdamper.dampers.modified import fit_modified
from mrdamper.dampers.published import all_conditioned
from mrdamper.data import Run
from mrdamper.errors import InputError
from mrdamper.identification import identify
from mrdamper.reproduction.ways import Contender, contender
from mrdamper.study.workflow import JOINTLY, Progress

GROUP = "literature"
MODIFIED = ("bingham", "kwok")  # identified run by run, then functions; the others bring their own laws


def literature(train: Sequence[Run], held_out: Sequence[Run], progress: Progress) -> list[Contender]:
    """Bingham, hyperbolic tangent, every condition-dependent damper of the house, and play and bypass."""
    made = []
    names = (*MODIFIED, *all_conditioned(), JOINTLY)
    for number, name in enumerate(names):
        progress(name, number / len(names))
        try:
            made.append(_one(name, train, held_out))
        except InputError as error:
            progress(f"{name}: left out, {error.found}", number / len(names))
    return made


def _one(name: str, train: Sequence[Run], held_out: Sequence[Run]) -> Contender:
    begin = time.perf_counter()
    if name in MODIFIED:
        found = [identify(run, name) for run in train]
        fit = fit_modified(found)
        return contender(fit.damper.title, GROUP, fit.damper, found, fit, held_out, time.perf_counter() - begin)
    if name == JOINTLY:
        damper = JointProblem(train, JOINTLY).fit().damper
        return contender(damper.title, GROUP, damper, (), None, held_out, time.perf_counter() - begin)
    cls = all_conditioned()[name]
    found = [identify(run, cls.basis, free=cls.basis_free) for run in train] if cls.basis else []
    damper = cls.fit(train, found)
    return contender(damper.title, GROUP, damper, found, None, held_out, time.perf_counter() - begin)
