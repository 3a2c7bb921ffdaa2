"""What is left out together: the runs of a condition, a stretch of a long record; and scored as whole runs again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from itertools import pairwise

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.calibration import PredictedRun
from mrdamper.data import Run
from mrdamper.physics.motion import equivalent_sine
from mrdamper.study.validation import RunScore, Validation, leave_one_condition_out

_STRETCH, _STRETCHES = 12, 8  # cycles of a long record that are left out together, at least; stretches at most
_RECORD = "stretch of"  # note of a stretch: the record it was cut from


def cross_validate(pieces: Sequence[Run], refit: Callable[[Sequence[int]], Damper], title: str) -> Validation:
    """Every run and record scored with a damper made without its condition, or without the stretch that is scored.

    Parameters
    ----------
    pieces : sequence of Run
        Runs, and stretches of long records.
    refit : callable
        Makes a damper of the pieces at some indices.
    title : str
    """
    motions = [equivalent_sine(piece) for piece in pieces]
    others = [i for i, piece in enumerate(pieces) if not motions[i].is_sine or piece.current_changes]
    scored = leave_one_condition_out(pieces, [m.condition for m in motions], refit, title, others)
    return _whole_again(scored, pieces)


def stretches(run: Run) -> list[Run]:
    """A record that is no sine, cut into stretches of a dozen cycles or more, eight at most; a sine as it is."""
    motion = equivalent_sine(run)
    period = 1 / motion.condition.frequency_Hz
    begin, end = run.window or (float(run.time[0]), float(run.time[-1]))
    count = min(_STRETCHES, int((end - begin) / period / _STRETCH))
    if (motion.is_sine and not run.current_changes) or count < 2:
        return [run]
    cuts = np.searchsorted(run.time, np.linspace(begin, end, count + 1))
    parts = []
    for number, (first, last) in enumerate(pairwise(cuts.tolist()), 1):
        lead = max(0, int(np.searchsorted(run.time, run.time[first] - 1.5 * period)))
        window = (float(run.time[first]), float(run.time[min(last, run.time.size) - 1]))
        notes = {**run.notes, _RECORD: run.id}
        parts.append(replace(run.part(lead, last), id=f"{run.id} {number}/{count}", window=window, notes=notes))
    return parts


def _whole_again(validation: Validation, pieces: Sequence[Run]) -> Validation:
    """One score a record where its stretches were scored one by one."""
    record = {piece.id: piece.notes.get(_RECORD, piece.id) for piece in pieces}
    scored: dict[str, list[RunScore]] = {}
    for score in validation.runs:
        scored.setdefault(record[score.run_id], []).append(score)
    return replace(validation, runs=tuple(_joined(name, scores) for name, scores in scored.items()))


def _joined(name: str, scores: Sequence[RunScore]) -> RunScore:
    """Errors of stretches of about one length as those of the whole: squares add up."""
    if len(scores) == 1 and scores[0].run_id == name:
        return scores[0]

    def joined(field_name: str) -> float:
        values = np.array([getattr(score.scores, field_name) for score in scores])
        return float(np.sqrt(np.mean(values**2)) if field_name.startswith("nrmse") else np.mean(values))

    whole = replace(scores[0].scores, **{f.name: joined(f.name) for f in fields(scores[0].scores)})
    flags = tuple(dict.fromkeys(flag for score in scores for flag in score.extrapolation))
    rests = [score.rest for score in scores if score.rest is not None]
    rest = float(np.sqrt(np.mean(np.square(rests)))) if rests else None
    seen = [score.predicted for score in scores if score.predicted is not None]
    beside = PredictedRun.joined(name, seen) if seen else None
    return replace(scores[0], run_id=name, scores=whole, extrapolation=flags, rest=rest, reading=None, predicted=beside)
