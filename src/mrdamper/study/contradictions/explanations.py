"""Explanations of a run that contradicts the others: the change, and the probability of the run after it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from mrdamper.study.contradictions.evidence import Evidence, Posterior, RowProducts
from mrdamper.study.contradictions.tracks import SAME_CURRENT, Track, irregularity

Cause = Literal["force", "offset", "current", "displacement", "time", "sign", "damper", "shifted"]

FORCE_UNITS = {"lbf": 4.4482216, "kgf": 9.80665, "kN": 1e3, "daN": 10.0, "kip": 4448.2216}  # in newtons
LENGTH_UNITS = {"inch": 25.4, "cm": 10.0, "m": 1e3, "µm": 1e-3}  # in millimetres
TIME_UNITS = {"ms": 1e-3, "min": 60.0}  # in seconds
_UNIT_TOLERANCE = 0.08  # difference of the logarithms up to which a factor is that of a unit
_FACTORS = (0.2, 0.25, 0.35, 0.5, 0.7, 1.4, 2.0, 2.8, 4.0, 5.0)  # of displacement or time, beside units
_MAX_FACTOR = 2e3  # factor of displacement or time between two tested motions
_SAME_FACTOR = 0.03  # difference of the logarithms of factors that are one
_TRIED_CURRENTS = 31  # currents that are tried

# Logarithms of prior odds against an explanation: one that names a unit, a tested level or a tested motion is simpler.
_UNIT_ODDS, LEVEL_ODDS, FREE_ODDS, _SIGN_ODDS, _ODD_MOTION_ODDS, _ALONE_ODDS = 4.0, 4.0, 7.0, 4.0, 16.0, 10.0
_TESTED_MOTION_ODDS = 5.0  # decrease for a motion of other runs, and increase for losing such a motion
_LOST_MOTION_ODDS = 30.0  # increase, without a unit, for a motion that no other run has instead of one that they have
EMPTY_CELL_ODDS = 6.0  # decrease for a filled empty cell of the matrix of tests, down to its inverse
MAX_IRREGULARITY = 0.5  # repeated and missing tests of a matrix that is nearly complete, over its tests
_EDGE_ODDS = 14.0  # increase of a factor or another current for the only run at the lowest or highest current
_CLEAR_ODDS = 7.0  # difference from which the data decide between two explanations
_USUAL_STEP = 3.0  # the same of the time between two samples
_SAME_STEP = 0.01  # relative difference of times between samples that are one

_SAME_FORCE = 1.08  # ratio of two forces at a motion up to which they may be one
_OTHER_FORCE = 1.15  # the same from which they are two, whatever the sessions

# Sizes below which an explanation is within the differences between sessions and tests.
MIN_FACTOR = 1.25  # of a force or a displacement
MIN_OFFSET = 0.2  # of the median half range of the force
MIN_CURRENT_EFFECT = 0.12  # RMS change of the force over the run's half range
MIN_UNEXPLAINED = 0.1  # RMS error of the force over the run's half range, at the best gain of a session
MAX_SESSION_GAIN = 1.12  # gain of a session against the others


@dataclass(frozen=True)
class Trial:
    """A change of a run that may explain it."""

    # "force", "offset", "current", "displacement", "time", "sign", or "damper" for a run without an explanation
    cause: Cause
    value: float  # factor that corrects the force, the displacement or the time; force to add [N]; current [A]
    unit: str  # unit the channel is in, where the factor is that of a unit
    odds: float  # logarithm of the prior odds against it
    zero: float = 0.0  # force to add [N] that explains the run as well as other signs do

    def is_like(self, other: Trial) -> bool:
        """Tell whether two runs have the same cause with the same value."""
        if self.cause != other.cause:
            return False
        if self.cause in ("force", "displacement", "time"):
            return abs(math.log(self.value / other.value)) < _UNIT_TOLERANCE
        return abs(self.value - other.value) <= 0.1 * max(abs(self.value), abs(other.value))


_ALONE = Trial("damper", 1.0, "", _ALONE_ODDS)  # of a run without an explanation


@dataclass(frozen=True, eq=False)
class Explanation:
    """Change of a run's data with which it agrees with the others."""

    trial: Trial
    gain: float  # logarithm of the odds of the explanation against no explanation
    products: RowProducts  # of the run as corrected

    @property
    def cause(self) -> Cause:
        """The cause of the trial."""
        return self.trial.cause


class ExplanationCandidate:
    """The run at a position, with its products, and its changed versions, whose products are computed once."""

    def __init__(self, index: int, tracks: Sequence[Track], evidence: Evidence, products: RowProducts) -> None:
        self.track, self.evidence, self.own, self._index = tracks[index], evidence, products, index
        self.set_tracks(tracks)

    def set_tracks(self, tracks: Sequence[Track]) -> None:
        """Compare with these runs, of which some have other motions than before."""
        self._others = [t for k, t in enumerate(tracks) if k != self._index]
        self._usual_step = float(np.median([track.step for track in self._others]))
        self._motions: list[tuple[Trial, RowProducts]] = []

    def explanations(self, others: Posterior) -> list[Explanation]:
        """Explanations that are more than differences between sessions, the most probable first.

        `others` are coefficients by the other runs.
        """
        return self.explanations_of_each([self], others)[0]

    @staticmethod
    def explanations_of_each(
        candidates: Sequence[ExplanationCandidate], others: Posterior, like: Sequence[Trial] = ()
    ) -> list[list[Explanation]]:
        """Explanations of several runs, which are weighed at once; if there are some trials, only those like one."""
        versions = [candidate._versions(others, like) for candidate in candidates]
        products = [each for of in versions for _, each in of]
        odds = iter(others.log_probabilities(others.weigh(products)))
        return [one._ranked(of, [next(odds) for _ in of]) for one, of in zip(candidates, versions, strict=True)]

    def _versions(self, others: Posterior, like: Sequence[Trial]) -> list[tuple[Trial, RowProducts]]:
        """Return the run as it is, with the most probable zero of its force, and as corrected by every trial."""
        zero = next(self._of_the_force(others))
        return [(_ALONE, self.own), (zero, self.changed(zero)), *self._trials(others, like)]

    def _ranked(self, versions: Sequence[tuple[Trial, RowProducts]], odds: Sequence[float]) -> list[Explanation]:
        (least, at_zero, *odds), (_, (zero, _), *changes) = odds, versions
        candidates: list[Explanation] = []
        for (trial, products), logarithm in zip(changes, odds, strict=True):
            if trial.cause == "sign" and at_zero > logarithm - _CLEAR_ODDS:
                if at_zero > logarithm + _CLEAR_ODDS:
                    continue  # another zero of the force explains it, of whatever size
                trial = replace(trial, zero=zero.value)
            if trial.cause in ("force", "current") and self._is_edge:
                trial = replace(trial, odds=trial.odds + _EDGE_ODDS)
            candidates.append(Explanation(trial, logarithm - trial.odds - least, products))
        return sorted(candidates, key=lambda e: -e.gain)

    def alone(self, others: Posterior) -> Explanation:
        """Return the explanation without a change: the run is of another damper."""
        return self.alone_of_each([self], others)[0]

    @staticmethod
    def alone_of_each(candidates: Sequence[ExplanationCandidate], others: Posterior) -> list[Explanation]:
        """Explanations of several runs without a change, which are weighed at once."""
        own = others.weigh([candidate.own for candidate in candidates])
        odds = zip(others.evidence.prior.log_probabilities(own), others.log_probabilities(own), strict=True)
        return [candidate._alone(others, *each) for candidate, each in zip(candidates, odds, strict=True)]

    def _alone(self, others: Posterior, free: float, expected: float) -> Explanation:
        unexplained = self.own.unexplained(others.at(self.own.over)[0], MAX_SESSION_GAIN)
        gain = free - _ALONE_ODDS - expected if unexplained >= MIN_UNEXPLAINED * self.own.size else -np.inf
        return Explanation(_ALONE, gain, self.own)

    def changed(self, trial: Trial) -> RowProducts:
        """Products of the run as corrected by a trial of force, offset or current."""
        if trial.cause == "current":
            return replace(self.own, over=self.evidence.share(trial.value))
        if trial.cause == "offset":
            return self.own.with_force(1.0, trial.value / self.evidence.force)
        return self.own.with_force(trial.value, 0.0)

    @cached_property
    def _is_edge(self) -> bool:
        """Tell if a run is the only one at the lowest or highest current: the others are extrapolated to it."""
        currents = np.concatenate([track.current[[0, -1]] for track in self._others])
        return bool(
            np.all(self.track.current > currents.max() * 1.05) or np.all(self.track.current < currents.min() * 0.95)
        )

    def _trials(self, others: Posterior, like: Sequence[Trial]) -> Iterator[tuple[Trial, RowProducts]]:
        causes = {one.cause for one in like}

        def is_tried(trial: Trial) -> bool:
            return self._is_large(trial) and (not like or any(trial.is_like(one) for one in like))

        currents = self._of_the_current(others) if not like or "current" in causes else ()
        for trial in filter(is_tried, (*self._of_the_force(others), *currents)):
            yield trial, self.changed(trial)
        if like and not causes & {"sign", "displacement", "time"}:
            return
        self.prepare([self])
        for trial, products in self._motions:
            if is_tried(trial):
                yield trial, replace(products, misfit=self.own.misfit)

    @staticmethod
    def prepare(candidates: Sequence[ExplanationCandidate]) -> None:
        """Compute the products of the other motions of runs, of all at once where these are asked for in turn."""
        missing = [candidate for candidate in candidates if not candidate._motions]
        moved = [list(candidate._of_the_motion()) for candidate in missing]
        if missing:
            products = iter(missing[0].evidence.products([track for of in moved for _, track in of]))
            for candidate, of in zip(missing, moved, strict=True):
                candidate._motions = [(trial, next(products)) for trial, _ in of]

    def _of_the_force(self, others: Posterior) -> Iterator[Trial]:
        expected, one = others.at(self.own.over)[0], self.own.constant
        mean = float(one @ self.own.gram @ expected) / self.own.rows
        measured = float(one @ self.own.moment) / self.own.rows
        yield Trial("offset", self.evidence.force * (mean - measured), "", FREE_ODDS)
        swing = expected - mean * one
        along = float(swing @ self.own.moment) - measured * float(swing @ self.own.gram @ one)
        if along > 0:
            best = float(swing @ self.own.gram @ swing) / along
            yield Trial("force", best, "", FREE_ODDS)
            for unit, factor in _both_ways(FORCE_UNITS):
                if abs(math.log(best / factor)) < 3 * _UNIT_TOLERANCE:
                    yield Trial("force", factor, unit, _UNIT_ODDS)

    def _of_the_current(self, others: Posterior) -> Iterator[Trial]:
        if self.track.current_changes:
            return
        levels: list[float] = self.evidence.nodes.tolist()
        tried: list[float] = np.linspace(0, levels[-1], _TRIED_CURRENTS)[1:-1].tolist()
        overs = [self.evidence.share(current) for current in (*levels, *tried)]
        change = np.array([mean for mean, _ in others.at_each(overs)]) - others.at(self.own.over)[0]
        power = np.maximum(np.sum(change @ self.own.gram * change, axis=1), 0.0)
        large = np.sqrt(power / self.own.rows) > MIN_CURRENT_EFFECT * self.own.size
        for k in np.flatnonzero(large).tolist():
            yield Trial("current", (*levels, *tried)[k], "", LEVEL_ODDS if k < len(levels) else FREE_ODDS)

    def _of_the_motion(self) -> Iterator[tuple[Trial, Track]]:
        """Yield a factor of displacement or time, with the run as corrected; both channels inverted."""
        here = sum(map(self.track.is_at_motion, self._others))
        yield (inverted := Trial("sign", -1.0, "", _SIGN_ODDS)), self.moved(inverted)
        kinds: tuple[tuple[Cause, dict[str, float]], ...] = (("displacement", LENGTH_UNITS), ("time", TIME_UNITS))
        for cause, units in kinds:
            named = [(unit, factor) for unit, factor in _both_ways(units) if self._is_nearer(cause, factor)]
            factors = [
                *((f, u, _UNIT_ODDS) for u, f in named),
                *((f, "", _ODD_MOTION_ODDS) for f in (*_FACTORS, *self._ratios(cause))),
            ]
            for k, (factor, unit, odds) in enumerate(factors):
                if any(abs(math.log(factor / f)) < _SAME_FACTOR for f, *_ in factors[:k]):
                    continue
                trial = Trial(cause, factor, unit, odds)
                moved = self.moved(trial)
                there = sum(map(moved.is_at_motion, self._others))
                tested = int(np.sign(there - here)) if self.track.frequency else 0
                if not unit and tested < 0 and not there:
                    odds += _LOST_MOTION_ODDS
                # 1 for a motion that more of the other runs have, −1 for one that fewer have
                odds -= _TESTED_MOTION_ODDS * tested + _USUAL_STEP * (cause == "time") * self._is_usual(factor)
                if tested != 0:
                    odds = completed_matrix_odds(odds, [*self._others, self.track], {len(self._others): moved})
                yield replace(trial, odds=odds), moved

    def _ratios(self, cause: Cause) -> list[float]:
        """Factors that bring the motion to one that other runs have."""
        own, name = self.track, {"time": "frequency"}.get(cause, "amplitude")
        if not own.frequency:
            return []
        ratios = [getattr(t, name) / getattr(own, name) for t in self._others if t.frequency]
        ratios = [1 / r if cause == "time" else r for r in ratios]
        return [r for r in ratios if MIN_FACTOR < max(r, 1 / r) < _MAX_FACTOR]

    def _is_usual(self, factor: float) -> int:
        """1 if a factor of time makes the time between two samples that of most other runs, −1 if it was that."""
        after, before = (abs(self.track.step * f / self._usual_step - 1) < _SAME_STEP for f in (factor, 1.0))
        return int(after) - int(before)

    def moved(self, trial: Trial) -> Track:
        """Return the run with its motion as corrected by a trial."""
        if trial.cause == "sign":
            moved = self.track.scaled(-1.0)
            return replace(moved, force=-self.track.force)
        return self.track.scaled(time=trial.value) if trial.cause == "time" else self.track.scaled(trial.value)

    def _is_large(self, trial: Trial) -> bool:
        if trial.cause in ("force", "displacement", "time"):
            return abs(math.log(trial.value)) > math.log(MIN_FACTOR)
        if trial.cause == "offset":
            return abs(trial.value) > MIN_OFFSET * self.evidence.force * max(self.own.size, 0.3)
        return True

    def _is_nearer(self, cause: Cause, factor: float) -> bool:
        """Tell whether a factor brings the stroke or the time between samples nearer to the usual one, as units do."""
        if cause == "time":
            size = self.track.step / self._usual_step
        else:
            size = float(np.ptp(self.track.displacement)) / 2 / self.evidence.amplitude
        return abs(math.log(size * factor)) < abs(math.log(size))


def unproven_currents(tracks: Sequence[Track], apparent: Mapping[int, float]) -> set[int]:
    """Find runs, by position, that look like another current [A] because the model fails at their motion.

    Runs at the motion show it. Either one at the apparent current has another force; or a bypass or a compliance limits
    the force: the run has the largest force there, as has one whose current is no nearer to the apparent than to the
    stated one. If the force is limited anywhere, runs that have the largest force of their motion are no evidence for
    a lower current, nor are those beside them.
    """
    refuted, largest, limited = set[int](), set[int](), set[int]()
    for k, current in apparent.items():
        run, stated = tracks[k], float(tracks[k].current[0])
        beside = [i for i, t in enumerate(tracks) if i != k and not t.current_changes and t.is_at_motion(run)]
        others = [(i, float(tracks[i].current[0]), tracks[i].half_range / run.half_range) for i in beside]
        if any(
            i not in apparent and abs(at - current) <= SAME_CURRENT and not _alike(r, _OTHER_FORCE)
            for i, at, r in others
        ):
            refuted.add(k)
        if others and max(ratio for *_, ratio in others) <= _SAME_FORCE:
            alike = [at for _, at, ratio in others if _alike(ratio, _SAME_FORCE)]
            if any(abs(at - stated) <= abs(at - current) + SAME_CURRENT for at in alike):
                limited.add(k)
            if current < stated:
                largest.add(k)
    of_a_limit = limited | largest if limited else limited
    return refuted | {k for k in apparent if any(tracks[k].is_at_motion(tracks[other]) for other in of_a_limit)}


def _alike(ratio: float, most: float) -> bool:
    return 1 / most <= ratio <= most


def completed_matrix_odds(odds: float, tracks: Sequence[Track], moved: Mapping[int, Track]) -> float:
    """Return prior odds against other motions of some runs, lower where these fill empty cells of the matrix of tests.

    They are higher where cells become empty. `odds` are those where no cell is filled; `tracks` are all runs, and
    `moved` those with other motions, by position.
    """
    kept = {k: track for k, track in enumerate(tracks) if not track.current_changes}
    currents = [float(track.current[0]) for track in kept.values()]
    missing = irregularity([moved.get(k, track) for k, track in kept.items()], currents)
    present = irregularity(list(kept.values()), currents)
    if min(present, missing) > MAX_IRREGULARITY * len(kept):
        return odds
    return max(odds - EMPTY_CELL_ODDS * (present - missing), min(odds, -EMPTY_CELL_ODDS))


def _both_ways(units: dict[str, float]) -> list[tuple[str, float]]:
    """Units of a channel that was read as N, mm or s, and of one that was read as this unit and is in N, mm or s."""
    return [*units.items(), *((f"not {name}", 1 / factor) for name, factor in units.items())]
