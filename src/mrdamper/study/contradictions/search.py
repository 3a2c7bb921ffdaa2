"""Search for the runs that contradict the others."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import combinations, product
from typing import Any

import numpy as np

from mrdamper.data import Floats, current_levels
from mrdamper.study.contradictions.evidence import (
    AssumedScatter,
    Evidence,
    Moments,
    Posterior,
    RowProducts,
    model_error,
)
from mrdamper.study.contradictions.explanations import (
    EMPTY_CELL_ODDS,
    FREE_ODDS,
    LEVEL_ODDS,
    MAX_IRREGULARITY,
    MAX_SESSION_GAIN,
    Cause,
    Explanation,
    ExplanationCandidate,
    Trial,
    completed_matrix_odds,
    unproven_currents,
)
from mrdamper.study.contradictions.gains import gain_differences
from mrdamper.study.contradictions.tracks import SAME_CURRENT, Track, irregularity

_ODDS, _FEW_ODDS = 6.0, 36.0  # logarithm of the odds from which an explanation is far better: always, over the runs
_GAIN_ODDS = 12.0  # the first of these for runs with gains of their own
_ALONE_ODDS = 10.0  # additional odds for a run without an explanation
_MISFITS = (4.0, 2.0, 1.4, 1.0, 0.7, 0.5, 0.35)  # factors of the usual model error that are tried
_SATURATIONS = (4.0, 1.0, 0.5, 0.25)  # saturation of the course over the current that is tried
_BENDS = (0.8, 0.3, 0.1)  # deviations from the common course over the current that are tried
_LEAK_ODDS = 2.0  # logarithm of the odds of the median run from which a damper has stop operators that leak
# Deviations of gains and offsets between runs that are tried.
_GAINS = ((0.06, 0.04), (0.04, 0.04), (0.06, 0.01), (0.04, 0.01), (0.025, 0.01), (0.015, 0.01))
_SHARED_EXPLANATIONS = 3  # explanations of a run that others may have in common with it
_RUNS_PER_ROUND = 16  # runs whose explanations are tried in a round, at least
_KEEP_ODDS = 3.0  # logarithm of the odds from which an accepted explanation stays
_SHIFT_ODDS = 9.0  # logarithm of the prior odds against shifted rows
_EXCHANGE_ODDS = 6.0  # the same against two exchanged rows
_SPARSE_ODDS = 20.0  # the same where the tests are no matrix of currents and motions
_MIN_SHIFT_ODDS = -EMPTY_CELL_ODDS  # prior odds of shifted rows at least, where these complete the matrix of tests
_MEMBER_ODDS = 4.0  # the same against a further run with the same cause
_MAJORITY_ODDS = 6.0  # the same against another current of most runs at a current
_MIN_SHIFTED_RUNS = 2  # runs whose current a shift has to change
_TIE_ODDS = 6.0  # odds up to which a run without a better explanation has the best one
_SHARED_CAUSES = ("force", "offset", "displacement", "time", "sign")  # causes that several runs have with one value
_COMPARED_EXPLANATIONS = 6  # explanations of a run that are compared with those of other runs
_GROUP_SEEDS = 5  # runs from which a second group of runs is grown
_GROUP_ERROR_RATIO = 2.5  # factor by which the model error of a group of its own is smaller than that of all runs
_MIN_MISFIT = 0.5  # factor of the usual model error for groups at least
_ERROR_FACTORS = np.array([1.0, 0.7, 0.45, 0.3])  # factors of the model error that explained runs leave
_REFINED_EXPLANATIONS = 4  # single explanations whose model error is adapted
_GROUP_GAIN_DIFFERENCE = 0.3  # difference of the logarithms of the gains of two groups of runs at one current
_MIN_BESIDE = 3  # other runs at a motion or a current that show how well the model describes it
_MAX_BESIDE = 3.0  # factor of the usual model error there at most; beyond, runs there do not agree
_FEW_CURRENTS = 16  # currents that are tried for several runs together
_CURRENT_FACTORS = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8)  # factors of the stated current that several runs may share
_MAX_SEVERAL = 0.34  # share of the runs that may have other currents
_MIN_CHANGE = 0.08  # change of a current over the highest one at least
_MAX_CHANGES = 12  # changes of currents in one set
_PAIR = 2  # runs with faults of their own that look like those of another damper
_ROUNDS = 4  # assignments of runs to two groups


@dataclass(frozen=True, eq=False)
class JointExplanation:
    """Explanations of some runs together, and the logarithm of their odds against none."""

    explanations: dict[int, Explanation]
    gain: float


_FALLING_ODDS, _MIN_FALL, _MAX_FALLING_ODDS = 60.0, 0.05, 8.0  # odds against a falling force: per share, from, at most
_AT_NODE = 0.9  # share of a node from which a run is at its current
_NO_PROPOSAL = JointExplanation({}, -np.inf)


class Search:
    """Runs of a rig, compared with each other."""

    def __init__(self, tracks: Sequence[Track]) -> None:
        self.tracks = list(tracks)
        self.found: dict[int, Explanation] = {}  # runs that contradict the others, by position
        # gains of the other runs, by position, if too many differ to identify the wrong ones
        self.differing: dict[int, float] = {}
        self.unproven: set[int] = set()  # runs whose motion the model does not describe, instead of another current
        self._set_aside: set[int] = set()  # those of them without which the others are compared
        self.evidence = Evidence(tracks)
        self._products = self.evidence.products(tracks)
        self._candidates = [ExplanationCandidate(i, tracks, self.evidence, p) for i, p in enumerate(self._products)]
        self._members: list[Moments] = []
        self._adapt()

    def run(self, most: int) -> None:
        """Explain runs until the others agree, or more than `most` are explained.

        Explanations of other runs may rest on currents without evidence: the runs with these are set aside then, and
        the others are compared again.
        """
        tracks, apparent = list(self.tracks), dict[int, float]()
        while True:
            self._explain_until_agreement(most)
            apparent |= _apparent_currents(self.found)
            unproven = unproven_currents(tracks, apparent) - self.unproven
            self.unproven |= unproven
            if not unproven or set(self.found) <= unproven:
                break
            self._set_aside |= unproven
            self.found, self.tracks = {}, list(tracks)
            for candidate in self._candidates:
                candidate.set_tracks(tracks)
            self._products = [candidate.own for candidate in self._candidates]
            self._adapt()
        for i in self.unproven & set(self.found):
            del self.found[i]
            self._products[i] = self._candidates[i].own
            self._members[i] = self.posterior([i]).weigh([self._products[i]])[0]
        for i in self._set_aside:
            explanations = self._candidates[i].explanations(self.posterior())
            best = next((e for e in explanations if e.cause != "current"), None)
            if best is not None and best.gain >= self._threshold({i: best}):
                self.found[i] = best
                self.unproven.discard(i)
        self._review()
        # Runs whose explanation was dropped are evidence against that of others.
        unproven = unproven_currents(tracks, _apparent_currents(self.found))
        self.unproven |= unproven
        self.found = {k: explanation for k, explanation in self.found.items() if k not in unproven}

    def _explain_until_agreement(self, most: int) -> None:
        while len(self.found) <= most:
            best = max(self._proposals(), key=self._rank, default=_NO_PROPOSAL)
            is_of_current = {e.cause for e in best.explanations.values()} <= {"current", "shifted", "damper"}
            if best.gain > 0 and (is_of_current or best.gain < self._threshold(best.explanations)):
                best = max(best, self._of_several(), key=self._rank)
            if not best.explanations or best.gain < self._threshold(best.explanations):
                best = self._further()
                best = best if best.explanations else self._of_gains(-np.inf)
            elif not self._is_shared(best.explanations.values()):
                self._of_gains(best.gain)
            if not best.explanations or self.differing:
                break
            self._accept(self._by_themselves(best.explanations))

    def posterior(self, but: Iterable[int] = ()) -> Posterior:
        """Coefficients determined by the runs as corrected, without some of them."""
        return self.evidence.posterior([self._members[k] for k in self._agreeing(but)])

    def explain(self, track: Track) -> Explanation | None:
        """Return the named explanation of a further run that is far better than none."""
        candidate = ExplanationCandidate(
            len(self.tracks), [*self.tracks, track], self.evidence, *self.evidence.products([track])
        )
        best = next(iter(candidate.explanations(self.posterior())), None)
        explanations = {} if best is None else {len(self.tracks): best}
        if best is None or best.gain < self._threshold(explanations):
            return None
        return None if unproven_currents([*self.tracks, track], _apparent_currents(explanations)) else best

    def _threshold(self, explanations: Mapping[int, Explanation]) -> float:
        """Logarithm of the odds from which explanations are far better than none.

        A cause that other runs have, and runs at the motion of one that is explained, need less: tests of one motion
        are successive.
        """
        beside = [self.tracks[k] for k in self.found]
        if self._is_shared(explanations.values()) or all(
            k < len(self.tracks) and any(self.tracks[k].is_at_motion(one) for one in beside) for k in explanations
        ):
            return _TIE_ODDS
        alone = any(e.cause == "damper" for e in explanations.values())
        return _ODDS + _FEW_ODDS / len(self.tracks) + (_ALONE_ODDS if alone else 0.0)

    def _rank(self, proposal: JointExplanation) -> float:
        """Logarithm of the odds of a proposal, where a cause found in other runs is as probable as in a group."""
        if not self._is_shared(proposal.explanations.values()):
            return proposal.gain
        return proposal.gain + max([0.0, *(e.trial.odds - _MEMBER_ODDS for e in proposal.explanations.values())])

    def _is_shared(self, explanations: Iterable[Explanation]) -> bool:
        """Tell whether explanations have causes that were found in other runs."""
        shared = self._shared_trials()
        return bool(shared) and all(any(e.trial.is_like(one) for one in shared) for e in explanations)

    def _shared_trials(self) -> list[Trial]:
        return [e.trial for e in self.found.values() if e.cause in _SHARED_CAUSES]

    def _agreeing(self, but: Iterable[int] = ()) -> list[int]:
        of_another_damper = {k for k, explanation in self.found.items() if explanation.cause == "damper"}
        return [k for k in range(len(self.tracks)) if k not in of_another_damper | self._set_aside | set(but)]

    def _accept(self, explanations: dict[int, Explanation]) -> None:
        self.found |= explanations
        for i, explanation in explanations.items():
            self._products[i] = explanation.products
            if explanation.cause in ("displacement", "time"):
                self.tracks[i] = self._candidates[i].moved(explanation.trial)
                for candidate in self._candidates:
                    candidate.set_tracks(self.tracks)
        self._adapt()

    def _adapt(self) -> None:
        """Select the spread that suits the runs, robust against a minority; weigh the runs with it."""
        agreeing = self._agreeing()
        expected = self.evidence.prior
        self.evidence.spread = AssumedScatter(2.0)
        for _ in range(2):
            expected = self.evidence.posterior(expected.weigh([self._products[k] for k in agreeing]))
        scores: dict[AssumedScatter, float] = {}

        def choose(variants: Iterable[dict[str, float]]) -> None:
            best = max(scores, key=scores.__getitem__, default=AssumedScatter())
            spreads = [one for one in (replace(best, **variant) for variant in variants) if one not in scores]
            # Moments of records of changing current are large.
            size = 1 if any(self._products[k].over is None for k in agreeing) else len(spreads)
            for block in (spreads[k : k + size] for k in range(0, len(spreads), size or 1)):
                self.evidence.spread = AssumedScatter.several(block)
                members = expected.weigh([self._products[k] for k in agreeing])
                odds = self.evidence.posterior(members).log_probabilities_by_others(members)
                for spread, median in zip(block, np.ravel(np.median(odds, axis=0)).tolist(), strict=True):
                    scores[spread] = median - _LEAK_ODDS * spread.leak

        for _ in range(2):
            choose({"saturation": saturation, "bend": bend} for saturation, bend in product(_SATURATIONS, _BENDS))
            choose({"misfit": misfit, "leak": leak} for misfit, leak in product(_MISFITS, (0.0, 1.0)))
        choose({"gain": gain, "offset": offset} for gain, offset in _GAINS)
        self.evidence.spread = max(scores, key=scores.__getitem__)
        expected = self.evidence.posterior(expected.weigh([self._products[k] for k in agreeing]))
        self._products = [replace(products, misfit=1.0) for products in self._products]
        self._members = expected.weigh(self._products)
        self._products = self._widened()
        self._members = expected.weigh(self._products)
        for candidate, products in zip(self._candidates, self._products, strict=True):
            candidate.own = replace(candidate.own, misfit=products.misfit)

    def _widened(self) -> list[RowProducts]:
        """Return the runs with a wider model error at motions and currents that the linear model describes worse.

        It fails there in every run, so the error follows from the others there and not from the run itself. At a
        current several runs may be wrong together, so the best of the others counts.
        """
        posterior = self.posterior()
        ratios: dict[int, float] = {}
        for k in self._agreeing():
            error = self._products[k].unexplained(posterior.without(self._members[k]), MAX_SESSION_GAIN)
            ratios[k] = error / (self.evidence.spread.misfit * model_error(self._products[k]))
        widened: list[RowProducts] = []
        for i, (track, products) in enumerate(zip(self.tracks, self._products, strict=True)):
            others = [(ratio, self.tracks[k]) for k, ratio in ratios.items() if k != i]
            at_motion = [ratio for ratio, other in others if other.is_at_motion(track)]
            at_current = [ratio for ratio, other in others if other.is_at_current(track)]
            beside = [np.quantile(at_motion, 0.75)] if len(at_motion) >= _MIN_BESIDE else []
            beside += [min(at_current)] if len(at_current) >= _MIN_BESIDE else []
            widened.append(replace(products, misfit=float(np.clip(max(beside, default=1.0), 1.0, _MAX_BESIDE))))
        return widened

    def _proposals(self) -> Iterator[JointExplanation]:
        posterior, prior = self.posterior(), self.evidence.prior
        self._base = self._adapted([self._products[k] for k in self._agreeing()], posterior)
        left = [k for k in range(len(self.tracks)) if k not in self.found and k not in self._set_aside]
        members = [self._members[k] for k in left]
        by_others = dict(zip(left, posterior.log_probabilities_by_others(members), strict=True))
        odds = {k: p - by_others[k] for k, p in zip(left, prior.log_probabilities(members), strict=True)}
        order = sorted(left, key=lambda k: -odds[k])
        self._own = self.evidence.log_evidence([self._members[k] for k in self._agreeing()])
        self._options: dict[int, list[Explanation]] = {}
        most = max(_RUNS_PER_ROUND, len(order) // 4)
        # A record of many currents is improbable a priori: its error by the others counts as well.
        improbable = sorted(left, key=by_others.__getitem__)
        chosen = dict.fromkeys([*order[:most], *improbable[: most // 3]])
        ExplanationCandidate.prepare([self._candidates[i] for i in chosen])
        singles = [self._of_one(i) for i in chosen]
        yield from map(self._refined, sorted(singles, key=lambda proposal: -proposal.gain)[:_REFINED_EXPLANATIONS])
        groups = dict.fromkeys([*self._groups(order, posterior), *self._alike()])
        ranked = sorted(map(self._of_group, groups), key=lambda proposal: -proposal.gain)
        yield from (self._smaller(proposal) for proposal in ranked[:_REFINED_EXPLANATIONS])
        if not self.found:
            best = max(self._of_rows(order[:_RUNS_PER_ROUND]), key=lambda proposal: proposal.gain, default=_NO_PROPOSAL)
            if best.explanations:
                yield self._refined_rows(best, posterior)

    def _of_several(self) -> JointExplanation:
        """Return the best other currents of some runs together: each its own, or all by one factor, as of a session.

        Before all of them are explained, none of them may look far better than the others.
        """
        spread = self.evidence.spread
        currents = self._levels(k for k in self._agreeing() if k not in self.found)
        expected, last = self.posterior(), float(self.evidence.nodes[-1])
        tried = dict.fromkeys(np.linspace(0, last, _FEW_CURRENTS)[1:-1].tolist(), FREE_ODDS)
        tried |= dict.fromkeys(self.evidence.nodes.tolist(), LEVEL_ODDS)
        free = [Trial("current", current, "", odds) for current, odds in tried.items()]
        self.evidence.spread = replace(spread, gain=_GAINS[-1][0], offset=_GAINS[-1][1])
        sets = dict(self._grown_currents({k: free for k in currents if k in self._options}, 0.0))
        for factor in _CURRENT_FACTORS:
            scaled = {k: Trial("current", factor * at, "", _MEMBER_ODDS) for k, at in currents.items() if at > 0}
            suspects = {k: [trial] for k, trial in scaled.items() if k in self._options}
            sets |= self._grown_currents(suspects, FREE_ODDS - _MEMBER_ODDS)
            for session in sorted({self.tracks[k].session for k in scaled} - {""}):
                sets[tuple((k, t) for k, t in scaled.items() if self.tracks[k].session == session)] = FREE_ODDS
        self.evidence.spread = spread
        base, best = self._adapted_gains({}, expected), _NO_PROPOSAL
        for members, odds in sets.items():
            apparent = {k: trial.value for k, trial in members}
            if 2 <= len(members) <= _MAX_SEVERAL * len(self.tracks) and not unproven_currents(self.tracks, apparent):
                changed = {k: self._candidates[k].changed(trial) for k, trial in members}
                gain = self._adapted_gains(changed, expected) - base - odds
                if gain > best.gain:
                    best = JointExplanation({k: Explanation(t, gain, changed[k]) for k, t in members}, gain)
        return best

    def _grown_currents(
        self, trials: Mapping[int, Sequence[Trial]], odds: float
    ) -> Iterator[tuple[tuple[tuple[int, Trial], ...], float]]:
        """Yield sets of runs with other currents and their prior odds, each with the most probable further change."""
        chosen = dict[int, Trial]()
        members = {k: self._members[k] for k in self._agreeing()}
        least = _MIN_CHANGE * float(self.evidence.nodes[-1])
        for _ in range(_MAX_CHANGES):
            options: list[tuple[float, int, Trial, Moments]] = []
            for i, of in trials.items():
                others = self.evidence.posterior([m for k, m in members.items() if k != i])
                stated = Trial("current", float(self.tracks[i].current[0]), "", 0.0)
                versions = [chosen.get(i, stated), *([stated] if i in chosen else [])]
                versions += [t for t in of if abs(t.value - stated.value) > least]
                moments = others.weigh([self._candidates[i].changed(trial) for trial in versions])
                gains = [p - t.odds for p, t in zip(others.log_probabilities(moments), versions, strict=True)]
                options += [(g - gains[0], i, t, m) for g, t, m in zip(gains, versions, moments, strict=True)][1:]
            gain, i, trial, moment = max(options, key=lambda option: option[0], default=(-np.inf, 0, None, None))
            if trial is None or moment is None or gain < (1e-6 if i in chosen else -_MEMBER_ODDS):
                return
            members[i], chosen[i] = moment, trial
            if trial.odds == 0.0:
                del chosen[i]
            yield tuple(sorted(chosen.items(), key=lambda item: item[0])), odds + sum(t.odds for t in chosen.values())

    def _adapted_gains(self, changed: Mapping[int, RowProducts], expected: Posterior) -> float:
        """Logarithm of the evidence of all runs, some changed, at the most probable model error and gains."""
        products, spread = [changed.get(k, self._products[k]) for k in self._agreeing()], self.evidence.spread
        totals: list[float] = []
        for gain, offset in {(spread.gain, spread.offset), *_GAINS[-2:]}:
            self.evidence.spread = replace(spread, gain=gain, offset=offset)
            totals.append(self._adapted(products, expected))
        self.evidence.spread = spread
        return max(totals)

    def _further(self) -> JointExplanation:
        """Return the run that best has the cause found in others, as a further one of their group."""
        shared = self._shared_trials()
        options = [
            (e.gain + e.trial.odds - _MEMBER_ODDS, i, e)
            for i, of in self._options.items()
            for e in of
            if any(e.trial.is_like(trial) for trial in shared)
        ]
        gain, i, best = max(options, key=lambda option: option[0], default=(-np.inf, 0, None))
        if best is None or gain < _TIE_ODDS:
            return _NO_PROPOSAL
        return JointExplanation({i: replace(best, gain=gain)}, gain)

    def _of_gains(self, gain: float) -> JointExplanation:
        """Return the few runs with independent gains; note the gains if there are too many.

        There are too many if this is more probable than the best explanation of some runs, whose gain is given.
        """
        left, least = self._agreeing(), _GAIN_ODDS + _FEW_ODDS / len(self.tracks)
        differences = gain_differences(self.evidence, [self._products[k] for k in left])
        if differences.everywhere >= max(least, gain):
            posterior = self.posterior()
            self.differing = {k: self._gain(k, posterior) for k in left}
        elif differences.odds >= least:
            trial, odds = Trial("damper", 1.0, "", 0.0), differences.odds
            alone = {left[k]: Explanation(trial, odds, self._products[left[k]]) for k in differences.members}
            return JointExplanation(alone, odds)
        return _NO_PROPOSAL

    def _by_themselves(self, group: dict[int, Explanation]) -> dict[int, Explanation]:
        """Return explanations of two causes instead of another damper of two runs, where each is as probable."""
        if len(group) != _PAIR or any(e.cause != "damper" for e in group.values()):
            return group
        others = self.posterior(group)
        named = {k: e for k in group for e in self._candidates[k].explanations(others)[:1]}
        probable = all(self._candidates[k].alone(others).gain - e.gain < _TIE_ODDS for k, e in named.items())
        return named if probable and len({e.cause for e in named.values()}) == _PAIR else group

    def _of_one(self, i: int) -> JointExplanation:
        others = self.posterior([i])
        alone, named = self._candidates[i].alone(others), self._candidates[i].explanations(others)
        self._options[i] = named
        best = named[0] if named and alone.gain - named[0].gain < _TIE_ODDS else alone
        return JointExplanation({i: best}, best.gain)

    def _refined(self, proposal: JointExplanation) -> JointExplanation:
        """Return a proposal for one run whose gain counts that all runs agree better afterwards."""
        ((i, explanation),) = proposal.explanations.items()
        rest = self._agreeing([i])
        others = self.evidence.posterior([self._members[k] for k in rest])
        kept = [self._products[k] for k in rest]
        if explanation.cause == "damper":
            gain = self._adapted(kept, others, [[explanation.products]])
        else:
            gain = self._adapted([*kept, explanation.products], others)
        gain -= self._base + explanation.trial.odds
        return JointExplanation({i: replace(explanation, gain=gain)}, gain)

    def _adapted(
        self, products: Sequence[RowProducts], expected: Posterior, apart: Sequence[Sequence[RowProducts]] = ()
    ) -> float:
        """Logarithm of the evidence of runs, and of others apart, at the model error most probable for them."""
        spread = self.evidence.spread
        self.evidence.spread = replace(spread, misfit=np.maximum(_ERROR_FACTORS * spread.misfit, _MISFITS[-1]))
        members = expected.weigh(products)
        posterior = self.evidence.posterior(members)
        total = posterior.log_evidence - self._falling(members, posterior)
        for group in apart:
            own = self.evidence.posterior(expected.weigh(group))
            total += self.evidence.log_evidence(own.weigh(group))
        self.evidence.spread = spread
        return float(np.max(total))

    def _falling(self, members: Sequence[Moments], posterior: Posterior) -> Any:
        """Logarithm of the prior odds against a force that falls with the current, by its relative decrease."""
        occupied = np.sum([m.over for m in members if m.over is not None and m.over.max() > _AT_NODE], axis=0)
        if np.ndim(occupied) == 0 or np.count_nonzero(np.asarray(occupied) > 0) < 2:
            return 0.0
        nodes = np.eye(self.evidence.nodes.size)[np.asarray(occupied) > 0]
        means = np.array([posterior.at(node)[0] for node in nodes])
        sizes = np.sqrt(np.sum(means @ self._usual_gram * means, axis=-1))
        fall = np.max(1 - sizes / np.maximum.accumulate(sizes), axis=0)
        return np.clip(_FALLING_ODDS * (fall - _MIN_FALL), 0.0, _MAX_FALLING_ODDS)

    @cached_property
    def _usual_gram(self) -> Floats:
        """Mean products of the elements over the runs at constant currents."""
        return np.mean([p.gram / p.rows for p in self._products if p.over is not None], axis=0)

    def _groups(self, order: Sequence[int], posterior: Posterior) -> list[tuple[int, ...]]:
        """Return sets of runs that may be wrong in the same way: the high or low runs of a current; a second group."""
        gains = {k: self._gain(k, posterior) for k in order}
        sets: list[list[int]] = []
        low: list[int] = []
        high: list[int] = []
        levels = self._levels(order)
        for level in sorted(set(levels.values())):
            at = sorted((k for k in levels if levels[k] == level), key=gains.__getitem__)
            for size in range(2, len(at)):
                sets += [at[:size], at[-size:]]
            jumps = np.diff([np.log(max(gains[k], 1e-3)) for k in at])
            if jumps.size and jumps.max() > _GROUP_GAIN_DIFFERENCE:
                low += at[: int(np.argmax(jumps)) + 1]
                high += at[int(np.argmax(jumps)) + 1 :]
        sets += [low, high]
        ranked = sorted(order, key=gains.__getitem__)
        third = len(ranked) // 3
        seeds = (*([k] for k in order[:_GROUP_SEEDS]), ranked[:third], ranked[-third:])
        sets += self._grown(map(frozenset, seeds), posterior)
        return list(dict.fromkeys(tuple(sorted(s)) for s in sets if 2 <= len(s) <= len(self.tracks) // 2))

    def _alike(self) -> list[tuple[int, ...]]:
        """Return sets of runs that one explanation makes more probable each, from the runs that are explained best."""
        sets: list[list[int]] = []
        for i in sorted(self._options, key=lambda k: -max((e.gain for e in self._options[k]), default=-np.inf)):
            if len(sets) >= _GROUP_SEEDS * _SHARED_EXPLANATIONS:
                break
            for explanation in self._options[i][:_SHARED_EXPLANATIONS]:
                trial = explanation.trial
                sets.append([k for k, of in self._options.items() if _any_like(of, trial)])
                if trial.cause in ("displacement", "time"):  # together they may complete the matrix of tests
                    sets.append([k for k, of in self._options.items() if _any_like(of, trial, by_odds=True)])
        return [tuple(sorted(s)) for s in sets if 2 <= len(s) <= len(self.tracks) // 2]

    def _gain(self, k: int, posterior: Posterior) -> float:
        """Force of a run over that expected by the others."""
        products = self._products[k]
        expected = posterior.without(self._members[k])
        swing = expected - products.constant * float(products.constant @ products.gram @ expected) / products.rows
        return float(swing @ products.moment) / max(float(swing @ products.gram @ swing), 1e-12)

    def _grown(self, seeds: Iterable[frozenset[int]], posterior: Posterior) -> list[list[int]]:
        """Return the groups of runs, each about some, that follow another damper than the others."""
        spread, groups = self.evidence.spread, list[list[int]]()
        self.evidence.spread = replace(spread, misfit=max(spread.misfit / _GROUP_ERROR_RATIO, _MIN_MISFIT))
        agreeing = self._agreeing()
        members = dict(zip(agreeing, posterior.weigh([self._products[k] for k in agreeing]), strict=True))

        @cache
        def moved(group: frozenset[int]) -> frozenset[int]:
            own = self.evidence.posterior([members[k] for k in group])
            rest = self.evidence.posterior([members[k] for k in members if k not in group])
            nearer = set[int]()
            for its, others, is_own in ((own, rest, True), (rest, own, False)):
                of = [k for k in members if k not in self.found and (k in group) == is_own]
                runs = [members[k] for k in of]
                pairs = zip(of, its.log_probabilities_by_others(runs), others.log_probabilities(runs), strict=True)
                nearer |= {k for k, inside, outside in pairs if (inside > outside) == is_own}
            return frozenset(nearer)

        for group in seeds:
            for _ in range(_ROUNDS):
                if not 0 < len(group) < len(members) or moved(group) == group:
                    break
                group = moved(group)
            groups.append(sorted(group))
        self.evidence.spread = spread
        return groups

    def _of_group(self, group: tuple[int, ...]) -> JointExplanation:
        """Return the best explanation that several runs have in common: one cause with one value, or another damper."""
        rest = self._agreeing(group)
        others = self.evidence.posterior([self._members[k] for k in rest])
        kept, own = [self._products[k] for k in rest], [self._products[k] for k in group]
        base = self._base + _MEMBER_ODDS * (len(group) - 1)
        first, *rest_of_group = candidates = [self._candidates[k] for k in group]
        compared = first.explanations(others)[:_COMPARED_EXPLANATIONS]
        trials = [explanation.trial for explanation in compared]
        options = [compared, *(first.explanations_of_each(rest_of_group, others, trials) if compared else ())]
        best, joint = _NO_PROPOSAL, -np.inf
        for explanation in compared:
            if explanation.cause == "current" and not self._may_share(group, explanation.trial.value):
                continue
            alike = [next((e for e in of if e.trial.is_like(explanation.trial)), None) for of in options]
            members = {k: e for k, e in zip(group, alike, strict=True) if e is not None}
            if len(members) == len(group):
                odds = max(e.trial.odds for e in members.values())
                if explanation.cause in ("displacement", "time"):
                    moved = {k: self._candidates[k].moved(e.trial) for k, e in members.items()}
                    odds = completed_matrix_odds(odds, self.tracks, moved)
                if explanation.cause == "current" and self._outnumbers(group):
                    odds += _MAJORITY_ODDS
                moments = others.weigh([e.products for e in members.values()])
                score = self.evidence.log_evidence([*(self._members[k] for k in rest), *moments]) - odds
                if score > joint:
                    joint, best = score, JointExplanation(members, odds)
        if best.explanations:
            corrected = [e.products for e in best.explanations.values()]
            gain = self._adapted([*kept, *corrected], others) - base - best.gain
            best = JointExplanation({k: replace(e, gain=gain) for k, e in best.explanations.items()}, gain)
        alone = first.alone_of_each(candidates, others)
        if sum(np.isfinite(e.gain) for e in alone) > len(group) / 2:
            gain = self._adapted(kept, others, [own]) - base - alone[0].trial.odds
            if gain > best.gain + _TIE_ODDS:
                best = JointExplanation({k: replace(e, gain=gain) for k, e in zip(group, alone, strict=True)}, gain)
        return best

    def _may_share(self, group: tuple[int, ...], current: float) -> bool:
        """Tell whether runs may have one current: those of a level, but not all of them, or of open coils."""
        levels = self._levels(range(len(self.tracks)))
        inside = {level for k, level in levels.items() if k in group}
        outside = {level for k, level in levels.items() if k not in group}
        return inside <= outside and (len(inside) == 1 or current <= SAME_CURRENT)

    def _outnumbers(self, group: tuple[int, ...]) -> bool:
        """Tell whether a group is most of the runs at one of its currents: the few others may be wrong."""
        levels = self._levels(range(len(self.tracks)))
        inside, every = [levels[k] for k in group if k in levels], list(levels.values())
        return any(2 * inside.count(level) > every.count(level) for level in inside)

    def _levels(self, runs: Iterable[int]) -> dict[int, float]:
        constant = [k for k in runs if not self.tracks[k].current_changes]
        return dict(zip(constant, current_levels([float(self.tracks[k].current[0]) for k in constant]), strict=True))

    def _smaller(self, proposal: JointExplanation) -> JointExplanation:
        """Return a proposal for a group without the runs that need no explanation once the others are explained."""
        while len(proposal.explanations) > 2 and proposal.gain >= self._threshold(proposal.explanations):
            members = tuple(proposal.explanations)
            subsets = [tuple(k for k in members if k != left) for left in members]
            best = max(map(self._of_group, subsets), key=lambda subset: subset.gain)
            if best.gain <= proposal.gain:
                break
            proposal = best
        return proposal

    def _of_rows(self, suspects: Sequence[int]) -> Iterator[JointExplanation]:
        """Currents of other rows of the table of tests: two rows exchanged, or all shifted by one from some row on."""
        order = [k for k, track in enumerate(self.tracks) if not track.current_changes]
        written = [float(self.tracks[k].current[0]) for k in order]
        rows, last = list(range(len(order))), len(order) - 1
        rigid = [self.tracks[k] for k in order]
        empty = irregularity(rigid, written)
        for i, j in combinations(rows, 2):
            if (order[i] in suspects or order[j] in suspects) and abs(written[i] - written[j]) > SAME_CURRENT:
                odds = _EXCHANGE_ODDS if empty <= MAX_IRREGULARITY * len(rows) else _SPARSE_ODDS
                yield self._of_currents({order[i]: written[j], order[j]: written[i]}, "current", odds)
        for step in (-1, 1):
            for first in range(last):
                moved = [written[k if k < first else min(max(k + step, first), last)] for k in rows]
                changed = {order[k]: moved[k] for k in rows if abs(moved[k] - written[k]) > SAME_CURRENT}
                if len(changed) >= _MIN_SHIFTED_RUNS:
                    filled = empty - irregularity(rigid, moved) if set(moved) == set(written) else 0
                    odds = _SHIFT_ODDS - EMPTY_CELL_ODDS * filled * (empty <= MAX_IRREGULARITY * len(rows))
                    yield self._of_currents(changed, "shifted", max(odds, _MIN_SHIFT_ODDS))

    def _of_currents(self, currents: dict[int, float], cause: Cause, odds: float) -> JointExplanation:
        trials = {k: Trial("current", current, "", odds) for k, current in currents.items()}
        moved = {k: self._candidates[k].changed(trial) for k, trial in trials.items()}
        kept = {k: self._members[k] for k in self._agreeing()}
        members = [replace(m, over=moved[k].over) if k in moved else m for k, m in kept.items()]
        gain = self.evidence.log_evidence(members) - self._own - odds
        return JointExplanation(
            {k: Explanation(replace(t, cause=cause), gain, moved[k]) for k, t in trials.items()}, gain
        )

    def _refined_rows(self, proposal: JointExplanation, posterior: Posterior) -> JointExplanation:
        moved = proposal.explanations
        products = [moved[k].products if k in moved else self._products[k] for k in self._agreeing()]
        gain = self._adapted(products, posterior) - self._base - next(iter(moved.values())).trial.odds
        return JointExplanation({k: replace(e, gain=gain) for k, e in moved.items()}, gain)

    def _review(self) -> None:
        """Compare each explanation with all the other runs as they ended; drop those no longer needed."""
        if any(e.cause == "shifted" for e in self.found.values()):
            return
        for i, now in list(self.found.items()):
            if now.cause == "damper" and sum(e.cause == "damper" for e in self.found.values()) > 1:
                continue
            others = self.posterior([i])
            alone, named = self._candidates[i].alone(others), self._candidates[i].explanations(others)
            best = named[0] if named and alone.gain - named[0].gain < _TIE_ODDS else alone
            trials = [e.trial for k, e in self.found.items() if k != i]
            usual = [e for e in named if best.gain - e.gain < _TIE_ODDS and any(e.trial.is_like(t) for t in trials)]
            best = usual[0] if usual else best
            if best.gain >= _KEEP_ODDS:
                self.found[i] = replace(best, gain=max(best.gain, now.gain))
                self._products[i] = best.products
            else:
                del self.found[i]
                self._products[i] = self._candidates[i].own
            self._members[i] = others.weigh([self._products[i]])[0]


def _any_like(explanations: Sequence[Explanation], trial: Trial, by_odds: bool = False) -> bool:
    """Tell whether an explanation like a trial makes its run more probable, or would without its prior odds."""
    return any(e.gain + by_odds * e.trial.odds > 0 and e.trial.is_like(trial) for e in explanations)


def _apparent_currents(explanations: Mapping[int, Explanation]) -> dict[int, float]:
    return {k: e.trial.value for k, e in explanations.items() if e.cause == "current"}
