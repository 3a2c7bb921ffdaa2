"""Runs whose gains differ from those of the others by more than those of sessions, each by its own factor.

A damper of another strength changes the force by another factor at every current, which a model of many coefficients
describes nearly as well as a single damper. The evidence for independent gains of some runs needs no second model, and
it is low if sessions explain the differences.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from math import inf, lgamma

from mrdamper.study.contradictions.evidence import Evidence, Moments, RowProducts

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
        for misfit in _MISFITS:
            evidence.spread = replace(scatter, misfit=misfit)
            odds = evidence.log_evidence(_weighed(evidence, variant, ()))
            if best is None or odds > best[0]:
                best = odds, misfit, variant
    assert best is not None
    evidence.spread = replace(scatter, misfit=best[1])
    differences = _grown(evidence, best[2])
    evidence.spread = scatter
    return differences


def _grown(evidence: Evidence, products: Sequence[RowProducts]) -> GainDifferences:
    """Add a run to the group or remove one from it for as long as this raises the odds."""
    group, size, now = frozenset[int](), len(products), -inf
    every = range(size)
    for _ in range(_ROUNDS):
        usual = _weighed(evidence, products, group)
        wide = _weighed(evidence, products, group, every)

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
    free = _weighed(evidence, products, every, every)
    none = evidence.log_evidence(_weighed(evidence, products, ()))
    return GainDifferences(group, now - none, evidence.log_evidence(free) - none)


def _weighed(
    evidence: Evidence, products: Sequence[RowProducts], group: Collection[int], wide: Collection[int] = ()
) -> list[Moments]:
    """Weighted products at the coefficients that follow if a group has gains of its own; wide gains of some runs."""
    expected = evidence.prior
    of_group, of_wide = (
        [replace(run, gain=_GAIN) if k in runs else run for k, run in enumerate(products)] for runs in (group, wide)
    )
    for _ in range(_REFITS + 1):
        expected = evidence.posterior(expected.weigh(of_group))
    return expected.weigh(of_wide)
