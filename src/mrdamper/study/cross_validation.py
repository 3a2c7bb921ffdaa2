"""Cross-validation of a damper by kind of fold.

A fold is a set of runs that are omitted together: those of a condition, a current, a motion or a session, or a
stretch of a long record. Every run is predicted by a damper identified without its fold and scored as a whole.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from itertools import pairwise

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.calibration import PredictedRun
from mrdamper.data import Condition, Run, condition_groups, level_groups, same_motion, session_folds
from mrdamper.data.arrays import index_at
from mrdamper.errors import InputError
from mrdamper.physics.motion import equivalent_sine
from mrdamper.physics.motion.sines import sine_condition
from mrdamper.study.validation import RunScore, Validation, leave_out

_MOTION_TOLERANCE = 0.05  # frequencies and amplitudes this close are one motion
_FAST_VELOCITY_RATIO = 0.8  # of the largest peak velocity, from which a motion is among the fastest
_MIN_STRETCH_CYCLES = 12  # cycles of a long record that are omitted together, at least
_MAX_STRETCHES = 8  # stretches of a record
NO_CURRENT = "no current"  # kind of fold that is reported without effect on the ranking: no current lies below 0 A
_STRETCH_NOTE = "stretch of"  # note of a stretch: the record it was cut from


def cross_validate(pieces: Sequence[Run], refit: Callable[[Sequence[int]], Damper], title: str) -> Validation:
    """Score every run with a damper identified without its condition, and every stretch of a record without it.

    `pieces` are runs, and stretches of long records; `refit` makes a damper of the pieces at some indices.
    """
    return _whole_again(leave_out(pieces, condition_folds(pieces), refit, title), pieces)


def folds_by_kind(pieces: Sequence[Run]) -> dict[str, list[list[int]]]:
    """Return indices of runs, and stretches of long records, omitted together, by kind of fold beyond a condition.

    "current": every level of sines but 0 A; "no current": all sines at 0 A, reported without effect on the ranking;
    "fastest motions": those whose peak velocity is within a fifth of the largest; "session": every session of several;
    "other records": all records except sines at one current. A kind is absent where it would leave fewer than two
    levels, two motions or two sessions.
    """
    sines = {i: condition for i, piece in enumerate(pieces) if (condition := sine_condition(piece))}
    folds: dict[str, list[list[int]]] = {}
    by_level = level_groups([sines[i].current_A if i in sines else None for i in range(len(pieces))])
    if len(by_level) > 2:
        folds["current"] = [group for level, group in by_level.items() if level > 0]
        if 0.0 in by_level:
            folds[NO_CURRENT] = [by_level[0.0]]
    if fastest := _fastest(sines):
        folds["fastest motions"] = [fastest]
    sessions = session_folds(pieces)
    if sum(map(len, sessions)) == len(pieces):  # errors by session are compared between models, of all runs
        folds["session"] = sessions
    others = [i for i in range(len(pieces)) if i not in sines]
    if others and len(sines) > 2:
        folds["other records"] = [others]
    return folds


def all_folds(pieces: Sequence[Run]) -> list[list[int]]:
    """Return indices omitted together in any kind of fold."""
    return [*condition_folds(pieces), *(group for groups in folds_by_kind(pieces).values() for group in groups)]


def condition_folds(pieces: Sequence[Run]) -> list[list[int]]:
    """Return indices of the runs of every condition; records that are no sine at one current are a condition each."""
    return condition_groups([sine_condition(piece) for piece in pieces])


def _fastest(sines: Mapping[int, Condition]) -> list[int]:
    """Return the sines of the largest peak velocities, one motion at least; empty if fewer than two would remain."""
    rows = [*sines]
    groups = [[rows[k] for k in group] for group in same_motion([*sines.values()], _MOTION_TOLERANCE)]
    groups.sort(key=lambda group: -max(sines[i].peak_velocity for i in group))
    if len(groups) < 3:
        return []
    speeds = [max(sines[i].peak_velocity for i in group) for group in groups]
    count = int(np.clip(np.sum(np.array(speeds) >= _FAST_VELOCITY_RATIO * speeds[0]), 1, len(groups) - 2))
    return [i for group in groups[:count] for i in group]


def cross_validate_by_kind(
    pieces: Sequence[Run], refit: Callable[[Sequence[int]], Damper], title: str
) -> dict[str, Validation]:
    """Score runs with dampers made without their fold, by kind of fold (`folds_by_kind`); arguments as there.

    Runs of a fold without which no damper can be identified are among the refused.
    """
    scores: dict[str, Validation] = {}
    for kind, groups in folds_by_kind(pieces).items():
        scored: list[RunScore] = []
        refused: dict[str, str] = {}
        for group in groups:
            try:
                scored += leave_out(pieces, [group], refit, title).runs
            except InputError as error:
                refused |= {pieces[i].notes.get(_STRETCH_NOTE, pieces[i].id): str(error) for i in group}
        scores[kind] = replace(_whole_again(Validation(title, tuple(scored)), pieces), refused=refused)
    return scores


def stretches(run: Run) -> list[Run]:
    """Divide a record that is no sine into stretches of a dozen cycles or more, eight at most; keep a sine."""
    period = 1 / equivalent_sine(run).condition.frequency_Hz
    begin, end = run.window or (float(run.time[0]), float(run.time[-1]))
    count = min(_MAX_STRETCHES, int((end - begin) / period / _MIN_STRETCH_CYCLES))
    if sine_condition(run) is not None or count < 2:
        return [run]
    cuts: list[int] = np.searchsorted(run.time, np.linspace(begin, end, count + 1)).tolist()
    parts: list[Run] = []
    for number, (first, last) in enumerate(pairwise(cuts), 1):
        lead = max(0, index_at(run.time, run.time[first] - 1.5 * period))
        window = (float(run.time[first]), float(run.time[min(last, run.time.size) - 1]))
        notes = {**run.notes, _STRETCH_NOTE: run.id}
        parts.append(replace(run.part(lead, last), id=f"{run.id} {number}/{count}", window=window, notes=notes))
    return parts


def _whole_again(validation: Validation, pieces: Sequence[Run]) -> Validation:
    """Combine the scores of stretches to one score per record."""
    record = {piece.id: piece.notes.get(_STRETCH_NOTE, piece.id) for piece in pieces}
    scored: dict[str, list[RunScore]] = {}
    for score in validation.runs:
        scored.setdefault(record[score.run_id], []).append(score)
    return replace(validation, runs=tuple(_joined(name, scores) for name, scores in scored.items()))


def _joined(name: str, scores: Sequence[RunScore]) -> RunScore:
    """Combine errors of stretches of about one length by their squares."""
    if len(scores) == 1 and scores[0].run_id == name:
        return scores[0]

    def joined(field_name: str) -> float:
        values = np.array([getattr(score.scores, field_name) for score in scores])
        return float(np.sqrt(np.mean(values**2)) if field_name.startswith("nrmse") else np.mean(values))

    whole = replace(scores[0].scores, **{f.name: joined(f.name) for f in fields(scores[0].scores)})
    flags = tuple(dict.fromkeys(flag for score in scores for flag in score.extrapolation))
    rests = [score.rest for score in scores if score.rest is not None]
    rest = float(np.sqrt(np.mean(np.square(rests)))) if rests else None
    predictions = [score.predicted for score in scores if score.predicted is not None]
    beside = PredictedRun.joined(name, predictions) if predictions else None
    return replace(scores[0], run_id=name, scores=whole, extrapolation=flags, rest=rest, reading=None, predicted=beside)
