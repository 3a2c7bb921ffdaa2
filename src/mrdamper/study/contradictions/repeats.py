"""Tests at one current, frequency and amplitude whose forces differ by more than the scatter of a rig explains.

Gains of a rig differ between sessions by a few per cent. No run is excluded by such a difference: repeats alone do not
show which of two forces is the correct one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from mrdamper.data.wording import counted, number
from mrdamper.errors import listed
from mrdamper.study.contradictions.tracks import Track

REPEATS_CODE = "W_REPEATS"
_MIN_COMMON_RATIO = 0.10  # logarithm of a factor that several pairs have in common
_SAME_RATIO = 0.05  # difference of the logarithms of two factors that are one
_MIN_PAIRS = 3  # pairs that show a common factor
_MIN_SHARE = 2 / 3  # share of the repeated conditions that show it
_MIN_RATIO = 0.18  # logarithm of a factor that one pair shows
_MAX_NAMES = 4  # runs named in one sentence
_CAUSES = "another gain of the load cell, another temperature, or another damper"
_REMEDY = "correct [channels.force] scale of the wrong ones, or name the other damper in the column rig"
Pair = tuple[Track, Track]  # at one condition: the one with the larger force first


def unequal_repeats(tracks: Sequence[Track]) -> list[str]:
    """State which repeated tests of a rig differ in force: groups of pairs with one factor, else single pairs."""
    conditions = [_pairs(group) for group in _repeated(tracks)]
    pairs = [max(group, key=_log_ratio) for group in conditions]
    differing = [pair for pair in pairs if _log_ratio(pair) > _MIN_COMMON_RATIO]
    if len(differing) >= max(_MIN_PAIRS, _MIN_SHARE * len(pairs)):
        middle = float(np.median([_log_ratio(pair) for pair in differing]))
        if sum(abs(_log_ratio(pair) - middle) < _SAME_RATIO for pair in differing) >= _MIN_SHARE * len(pairs):
            return [_of_group(differing, middle)]
    return [_of_pair(pair) for pair in pairs if _log_ratio(pair) > _MIN_RATIO]


def _repeated(tracks: Sequence[Track]) -> Iterator[list[Track]]:
    """Yield the tests of each condition that was tested more than once."""
    groups: list[list[Track]] = []
    for track in tracks:
        like = (group for group in groups if track.is_at_motion(group[0]) and track.is_at_current(group[0]))
        group = next(like, None)
        if group is None:
            groups.append([track])
        else:
            group.append(track)
    yield from (group for group in groups if len(group) > 1)


def _pairs(group: Sequence[Track]) -> list[Pair]:
    ranked = sorted(group, key=lambda track: -track.half_range)
    return list(pairwise(ranked))


def _log_ratio(pair: Pair) -> float:
    high, low = pair
    return float(np.log(high.half_range / low.half_range)) if low.half_range > 0 else np.inf


def _of_group(pairs: Sequence[Pair], middle: float) -> str:
    high, low = ({side.run.id: side.session for side in sides} for sides in zip(*pairs, strict=True))
    one, other = ({*sessions.values()} for sessions in (high, low))
    if len(one) == 1 and one != other and "" not in one | other:
        names, others = f"The tests of session {one.pop()}", f"those of session {listed(sorted(other), _MAX_NAMES)}"
        sessions = ""
    else:
        names = f"{counted(len(high), 'run')} ({listed(sorted(high), _MAX_NAMES)})"
        others = f"others ({listed(sorted(low), _MAX_NAMES)})"
        sessions = "state the session of each test in the column session, "
    ratio, verb = number(float(np.exp(middle)), 3), "has" if len(high) == 1 else "have"
    return (
        f"{names} {verb} {ratio} times the force of {others} at the same current, frequency and amplitude "
        f"({counted(len(pairs), 'pair')}): {_CAUSES}; {sessions}{_REMEDY}."
    )


def _of_pair(pair: Pair) -> str:
    high, low = pair
    ratio = number(float(np.exp(_log_ratio(pair))), 3)
    return (
        f"Run {high.run.id} has {ratio} times the force of run {low.run.id} at the same current, frequency and "
        f"amplitude: {_CAUSES}; {_REMEDY}."
    )
