"""Fits of one model to parts of the runs, from starts that do not depend on the omitted runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from mrdamper.dampers.joint import JointFit, JointProblem, LocalMinimum

_MAX_OMITTED_SHARE = 0.5  # largest share of the runs that a search omits
_START_COUNT = 3  # starts of a search
_SEARCH_ROUNDS, _SEARCH_STEPS = 1, 10  # of a search on steady ends
_SEARCH_TOLERANCE = 1e-4  # relative gain of a step at which such a search ends
_MAX_ERROR_RATIO = 1.05  # times the smallest error on the remaining runs, up to which a start is used
_FIT_TOLERANCE = 1e-4  # relative gain of a step at which a fit without a fold ends


class FoldFits:
    """Fits without folds of runs: indices of runs that will be omitted together.

    Folds are gathered into a few blocks. For each block one search starts from the model's start values on the steady
    ends of the runs outside it; the fits without the folds of the block begin at its result. `searched` are presets
    that are free in the search as well, as in that over all runs: without them others compensate for their effects, and
    the search ends in another local minimum.
    """

    def __init__(self, problem: JointProblem, folds: Iterable[Sequence[int]], searched: Sequence[str] = ()):
        self.problem, self.searched = problem, tuple(searched)
        self.blocks = _blocks(folds, len(problem.parts))
        self._without_effects: dict[tuple[str, ...], FoldFits] = {}
        self._starts: dict[frozenset[int], list[JointFit]] = {}
        self._fits: dict[tuple[int, ...], JointFit] = {}
        self._ends: dict[tuple[object, ...], list[JointFit]] = {}  # of searches, also of fits without some effects

    def refit(self, rows: Sequence[int]) -> JointFit:
        """Fit the runs at some indices: the result with the smallest error from the best starts.

        Fits are cached, because a single record is a condition and a kind of fold.
        """
        if (key := tuple(sorted(rows))) not in self._fits:
            self._fits[key] = self._fit(rows)
        return self._fits[key]

    def _fit(self, rows: Sequence[int]) -> JointFit:
        """Fit the runs at some indices from the starts of the block of the others.

        Effects of the current that these runs do not determine are zero.
        """
        if (problem := self.problem.determined(rows)) is not self.problem:
            if problem.free not in self._without_effects:
                fits = FoldFits(problem, [sorted(block) for block in self.blocks], self.searched)
                self._without_effects[problem.free], fits._ends = fits, self._ends
            return self._without_effects[problem.free].refit(rows)
        left = frozenset(range(len(self.problem.parts))) - set(rows)
        block = next((block for block in self.blocks if left <= block), left)
        if block not in self._starts:
            self._starts[block] = self._search(block)
        ends = {float(np.mean(start.nrmse_pp[list(rows)])): start for start in self._starts[block]}
        able = [start for error, start in ends.items() if error <= _MAX_ERROR_RATIO * min(ends)]
        return min((self.problem.refit(start, rows, _FIT_TOLERANCE) for start in able), key=lambda fit: fit.error)

    def _search(self, block: frozenset[int]) -> list[JointFit]:
        """Return ends of the search without a block: the best, and others with similar error and another yield."""
        whole = self.problem
        rows = [i for i in range(len(whole.parts)) if i not in block]
        short = JointProblem(
            [whole.runs[i] for i in rows],
            whole.model_type,
            {name: value for name, value in whole.fixed.items() if name not in self.searched},
            free=(*whole.free, *self.searched),
            coil=whole.given_coil,
            parts=[whole.parts[i].steady_end() for i in rows],
        ).determined()
        key = block, short.free, *sorted(short.fixed.items())
        if key not in self._ends:
            ends = [
                short.fit(start=start, rounds=_SEARCH_ROUNDS, most_steps=_SEARCH_STEPS, settled=_SEARCH_TOLERANCE)
                for start in short.promising[:_START_COUNT]
            ]
            self._ends[key] = sorted(ends, key=lambda end: end.error)
        ends = self._ends[key]
        kept = [ends[0], *(end for end in ends[1:] if LocalMinimum.beside(ends[0], [end]))]
        return [self._in_whole(end) for end in kept[:_START_COUNT]]

    def _in_whole(self, end: JointFit) -> JointFit:
        """Return the end of a search as a start for fits of this problem."""
        whole, point = self.problem, self.problem.from_point(end)
        damper = replace(end.damper, model=whole.space.with_linear_of(end.damper.model, point))
        start = replace(end, point=point, damper=damper)
        return replace(start, nrmse_pp=whole.errors(start, range(len(whole.parts))))


def _blocks(folds: Iterable[Sequence[int]], count: int) -> tuple[frozenset[int], ...]:
    """Few sets that contain every fold and at most half of the runs, unless a fold is larger by itself."""
    blocks: list[frozenset[int]] = []
    for fold in sorted((frozenset(fold) for fold in folds), key=len, reverse=True):
        able = [i for i, block in enumerate(blocks) if len(block | fold) <= _MAX_OMITTED_SHARE * count or fold <= block]
        if not able:
            blocks.append(fold)
            continue
        best = min(able, key=lambda i: len(blocks[i] | fold) - len(blocks[i]))
        blocks[best] |= fold
    return tuple(blocks)
