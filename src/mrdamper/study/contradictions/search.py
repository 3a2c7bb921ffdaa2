"""Search for the runs that contradict the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrdamper.study.contradictions.evidence import Evidence, Moments, Posterior
from mrdamper.study.contradictions.explanations import Candidate, Explanation
from mrdamper.study.contradictions.tracks import Track

_ODDS = 8.0  # logarithm of the odds from which an explanation is far better than none
_ALONE_ODDS = 20.0  # the same of a run that nothing explains
_MISFITS = (4.0, 2.0, 1.0, 0.6, 0.4)  # factors of the usual model error that are tried
_LOOKED_AT = 8  # runs whose explanations are tried in a round, at least
_SHIFT_ODDS = 12.0  # logarithm of the prior odds against shifted rows
_FEWEST_SHIFTED = 2  # runs whose current a shift has to change
_SAME_CURRENT = 0.01  # difference of two currents that are one [A]
_EQUAL = 6.0  # odds up to which a run nothing explains better takes the best explanation


@dataclass(frozen=True, eq=False)
class Search:
    """Runs as explained.

    Attributes
    ----------
    evidence : Evidence
    explanations : mapping of int to Explanation
        By the run's position.
    members : list of Moments
        Of every run as corrected.
    """

    evidence: Evidence
    explanations: dict[int, Explanation]
    members: list[Moments]

    @classmethod
    def of(cls, tracks: Sequence[Track]) -> Search:
        """Runs that agree."""
        evidence, _ = _suitable(tracks, range(len(tracks)))
        return cls(evidence, {}, evidence.moments(tracks))


@dataclass(frozen=True)
class Shift:
    """Rows of a table of tests that are shifted by one.

    Attributes
    ----------
    first : int
        Position of the first run with the current of another row.
    down : bool
        The rows hold the currents of the rows above.
    currents : mapping of int to float
        Apparent current of every run whose current is wrong [A].
    gain : float
        Logarithm of the odds against no shift.
    """

    first: int
    down: bool
    currents: dict[int, float]
    gain: float


def search(tracks: Sequence[Track], most: int) -> Search:
    """Explain runs, the least probable one first, until the others agree.

    Parameters
    ----------
    tracks : sequence of Track
    most : int
        Explanations at which the search ends: the runs disagree.
    """
    corrected = list(tracks)
    found: dict[int, Explanation] = {}
    evidence, odds = _suitable(tracks, range(len(tracks)))
    while len(found) <= most:
        members = evidence.moments(corrected)
        order = sorted(odds, key=lambda i: -odds[i])
        suspects = [i for k, i in enumerate(order) if k < max(_LOOKED_AT, len(order) // 4)]
        best = {i: best_explanation(tracks[i], _posterior(evidence, members, found, i)) for i in suspects}
        i, explanation = max(best.items(), key=lambda pair: pair[1].gain)
        if not is_far_better(explanation):
            break
        found[i], corrected[i] = explanation, explanation.track
        evidence, odds = _suitable(corrected, [k for k in range(len(tracks)) if not _is_alone(found, k)])
        odds = {k: v for k, v in odds.items() if k not in found}
    return _reviewed(found, tracks, corrected)


def find_shift(tracks: Sequence[Track]) -> Shift | None:
    """Find currents that are those of the rows above or below in the table of tests, from some row on.

    None where a single run explains as much.
    """
    if any(track.current_changes for track in tracks):
        return None
    evidence, odds = _suitable(tracks, range(len(tracks)))
    own = evidence.moments(tracks)
    written = [float(track.current[0]) for track in tracks]
    shares = evidence.shares(np.array(written))
    base, best = evidence.log_evidence(own), None
    for down in (False, True):
        for first in range(len(tracks) - 1):
            source = [
                k if k < first else min(k + 1, len(own) - 1) if down else max(k - 1, first) for k in range(len(own))
            ]
            changed = {k: written[j] for k, j in enumerate(source) if abs(written[j] - written[k]) > _SAME_CURRENT}
            if len(changed) < _FEWEST_SHIFTED:
                continue
            moved = [replace(own[k], over=shares[j]) for k, j in enumerate(source)]
            gain = evidence.log_evidence(moved) - base - _SHIFT_ODDS
            if best is None or gain > best.gain:
                best = Shift(min(changed), not down, changed, gain)
    if best is None or best.gain < _ODDS:
        return None
    suspects = sorted(odds, key=lambda i: -odds[i])[:_LOOKED_AT]
    single = max(best_explanation(tracks[i], _posterior(evidence, own, {}, i)).gain for i in suspects)
    return best if best.gain > single else None


def is_far_better(explanation: Explanation) -> bool:
    """Tell whether an explanation is far better than none."""
    return explanation.gain >= (_ALONE_ODDS if explanation.cause == "damper" else _ODDS)


def best_explanation(track: Track, others: Posterior) -> Explanation:
    """The most probable explanation of a run that is more than what sessions differ by."""
    alone, *named = Candidate(track, others).explanations()
    return named[0] if named and alone.gain - named[0].gain < _EQUAL else alone


def _posterior(evidence: Evidence, members: Sequence[Moments], found: dict[int, Explanation], but: int) -> Posterior:
    return evidence.posterior([m for k, m in enumerate(members) if k != but and not _is_alone(found, k)])


def _is_alone(found: dict[int, Explanation], k: int) -> bool:
    return k in found and found[k].cause == "damper"


def _reviewed(found: dict[int, Explanation], tracks: Sequence[Track], corrected: list[Track]) -> Search:
    """The explanations against all the other runs as they ended; those no longer needed are dropped."""
    evidence, _ = _suitable(corrected, [k for k in range(len(tracks)) if not _is_alone(found, k)])
    members = evidence.moments(corrected)
    for i in list(found):
        explanation = best_explanation(tracks[i], _posterior(evidence, members, found, i))
        if is_far_better(explanation):
            found[i], members[i] = explanation, explanation.moments
        else:
            del found[i]
            members[i] = evidence.moments([tracks[i]])[0]
    return Search(evidence, found, members)


def _suitable(tracks: Sequence[Track], members: Sequence[int]) -> tuple[Evidence, dict[int, float]]:
    """The evidence whose model error suits the runs, whatever a minority of them does; odds of a model of their own."""
    chosen = [tracks[i] for i in members]
    usual = Evidence(chosen)
    elements = usual.elements(chosen)
    found = []
    for misfit in _MISFITS:
        evidence = usual.with_misfit(misfit)
        own = evidence.moments(chosen, elements)
        total = evidence.total(own)
        others = np.array([evidence.posterior_of(*total, but=one).log_probability(one) for one in own])
        found.append((evidence, own, others))
    scores = [float(np.median(others - found[0][2])) for _, _, others in found]
    evidence, own, others = found[int(np.argmax(scores))]
    return evidence, {i: evidence.prior.log_probability(o) - p for i, o, p in zip(members, own, others, strict=True)}
