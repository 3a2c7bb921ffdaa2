"""Runs whose gains differ from those of the others by more than those of sessions, each by its own factor.

A damper of another strength changes the force by another factor at every current, which a model of many coefficients
describes nearly as well as a single damper. The evidence for independent gains of some runs needs no second model, and
it is low if sessions explain the differences.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from math import inf, lgamma

import numpy as np

from mrdamper.study.contradictions.evidence import Evidence, Moments, Posterior, RowProducts

_GAIN = 0.6  # standard deviation of the gain of a run of another damper
_MISFITS = (0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0, 4.0)  # factors of the usual model error that are tried
_REFITS = 2  # posteriors computed for one set of runs, since gains multiply the expected force
_ROUNDS = 4  # sets of runs that are tried in turn


@dataclass(frozen=True)
class GainDifferences:
    """The runs whose gains differ, and logarithms of odds against gains as of sessions."""

    members: frozenset[int]  # positions of the runs with independent gains; the others agree
    odds: float  # logarithm of the odds that these runs have independent gains
    everywhere: float  # the same for every run: so many differ that the wrong ones cannot be identified


def gain_differences(evidence: Evidence, products: Sequence[RowProducts]) -> GainDifferences:
    """Find the runs with independent gains among those that are compared, by their products."""
    scatter = evidence.spread
    best: tuple[float, float, Sequence[RowProducts]] | None = None
    usual = [replace(run, misfit=1.0) for run in products]
    for variant in (products, usual) if any(run.misfit != 1.0 for run in products) else (products,):
        evidence.spread = replace(scatter, misfit=np.array(_MISFITS))
        odds = evidence.log_evidence(_expected(evidence, variant).weigh(variant))
        k = int(np.argmax(odds))
        if best is None or odds[k] > best[0]:
            best = float(odds[k]), _MISFITS[k], variant
    assert best is not None
    evidence.spread = replace(scatter, misfit=best[1])
    differences = _grown(evidence, best[2], best[0])
    evidence.spread = scatter
    return differences


def _grown(evidence: Evidence, products: Sequence[RowProducts], none: float) -> GainDifferences:
    """Add a run to the group or remove one from it for as long as this raises the odds; `none` are those of none."""
    group, size, now = frozenset[int](), len(products), -inf
    every, free = range(size), [replace(run, gain=_GAIN) for run in products]
    for _ in range(_ROUNDS):
        expected = _expected(evidence, [free[k] if k in group else products[k] for k in every])
        usual, wide = expected.weigh(products), expected.weigh(free)

        def odds(members: Collection[int], usual: Sequence[Moments] = usual, wide: Sequence[Moments] = wide) -> float:
            chosen = lgamma(size + 1) - lgamma(len(members) + 1) - lgamma(size - len(members) + 1)
            return evidence.log_evidence([wide[k] if k in members else usual[k] for k in every]) - chosen

        grown, now = group, odds(group)
        while True:
            score, changed = max(((odds(grown ^ {k}), grown ^ {k}) for k in every), key=lambda option: option[0])
            if score <= now:
                break
            now, grown = score, changed
        settled, group = grown == group, grown
        if settled:
            break
    return GainDifferences(group, now - none, evidence.log_evidence(_expected(evidence, free).weigh(free)) - none)


def _expected(evidence: Evidence, products: Sequence[RowProducts]) -> Posterior:
    """Coefficients of runs, some of which may have gains of their own."""
    expected = evidence.prior
    for _ in range(_REFITS + 1):
        expected = evidence.posterior(expected.weigh(products))
    return expected
