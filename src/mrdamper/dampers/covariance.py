"""From runs to what is known of a damper: the spread of its numbers and of sessions, and the model's own error."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrdamper.dampers.base import Damper, Prediction
from mrdamper.dampers.certainty import Certainty
from mrdamper.dampers.slopes import force_slopes
from mrdamper.data import Floats, Run
from mrdamper.identification.covariance import alike_groups, score_covariance
from mrdamper.identification.intervals import weaknesses
from mrdamper.metrics import Scores, peak_force

_ROWS = 400  # samples of a run that enter
_CYCLES = 4  # of a sine that enter, as in the joint fit
_WARM_UP = 1.5  # cycles before them in which the model forgets its start
_BEST = 1e-3  # nrmse_pp below which a run gains no more weight, as in the joint fit
_DRAWS, _ROUNDS, _SEED = 600, 4, 20240813  # of sessions; of weights, as in the joint fit
_ONE_RUN = 0.6  # share of what is known of a number from which it rests on one run
_UNKNOWN = 1e-10  # of the largest: eigenvalue of the scaled normal matrix below which a direction is unknown


def session_of(run: Run) -> str:
    """The session a run was recorded in: as stated, or its day and hour, or the run by itself."""
    clock = run.notes.get("recorded_at", "")
    return run.notes.get("session") or (clock[:13] if len(clock) >= 13 else f"run {run.id}")


def certain(
    damper: Damper,
    runs: Sequence[Run],
    left_out: Sequence[Scores] = (),
    held: Collection[str] = (),
    *,
    bounded: bool = True,
) -> Damper:
    """The damper with what is known of its uncertainty.

    Parameters
    ----------
    damper : Damper
    runs : sequence of Run
        It was identified from.
    left_out : sequence of Scores
        Of runs predicted without their condition: what the form itself is wrong by.
    held : collection of str
        Parameters that ended at a limit of what was searched, inside their bounds.
    bounded : bool
        Numbers at a bound are held there; otherwise they count like the others, as if there were none.
    """
    if not damper.fitted_parameters or not runs:
        return damper
    parts = [Part.of(damper, run) for run in runs]
    numbers = damper.fitted_parameters
    at_bound = tuple(
        name
        for name, own in numbers.items()
        if bounded and (name.split(".")[0] in held or np.isclose(own.value, own.bounds, rtol=1e-6, atol=1e-12).any())
    )
    free = [name for name in numbers if name not in at_bound]
    slopes = [force_slopes(damper, p.prediction, free)[p.picked] for p in parts]
    known, unseen, alike, inverse = _known(slopes, parts, len(free))
    conditions = [part.prediction.condition for part in parts]
    infinite = np.diag([np.inf if i in unseen else 1.0 for i in range(len(free))])
    words = weaknesses(free, infinite, alike, conditions)
    slopes = [slope[:, known] for slope in slopes]
    names = tuple(free[i] for i in known)
    influence = [inverse @ (slope * part.weight**2).T for slope, part in zip(slopes, parts, strict=True)]
    told = _told(parts, slopes, inverse)
    words += _rest_on_one_run(names, parts, told)
    within, doubt = _within(parts, slopes, inverse)
    gain, offset, session_dof, between = _sessions(parts, slopes, influence, within)
    covariance = within + between
    variance = np.maximum(np.diag(covariance), np.finfo(float).tiny)
    share = np.diag(between) / variance
    samples = sum(part.picked.size for part in parts)
    left = sum(float(part.residual @ part.residual) * part.weight**2 for part in parts)
    effective = np.minimum(left * np.diag(inverse) / variance, samples)
    dof = 1 / (share**2 / max(session_dof, 1.0) + (1 - share) ** 2 * doubt / 2)
    made = Certainty(
        names, tuple(numbers[n].log for n in names), covariance, np.maximum(dof, 1.0), at_bound,
        tuple(free[i] for i in sorted({*unseen, *(i for group in alike for i in group)})),
        gain, offset, session_dof, words=tuple(words),
        taught={part.run.id: float(np.mean(row)) if names else 0.0 for part, row in zip(parts, told, strict=True)},
        effective=dict(zip(names, effective.tolist(), strict=True)),
    )  # fmt: skip
    return replace(damper, certainty=_with_model_error(made, damper, parts, slopes, left_out))  # type: ignore[type-var]


@dataclass(frozen=True, eq=False)
class Part:
    """What enters of a run: samples, what was left over, and the weight its residuals had."""

    run: Run
    session: str
    prediction: Prediction
    picked: np.ndarray
    residual: Floats
    scale: float
    weight: float
    frequency: float | None

    @classmethod
    def of(cls, damper: Damper, run: Run) -> Part:
        prediction = damper.predict_run(run)
        first, last = (int(i) for i in np.flatnonzero(run.in_window)[[0, -1]])
        begin = 0
        if prediction.is_sine:
            period = 1 / prediction.condition.frequency_Hz
            first = max(first, int(np.searchsorted(run.time, run.time[last] - _CYCLES * period)))
            begin = int(np.searchsorted(run.time, run.time[first] - _WARM_UP * period))
            short = replace(prediction, motion=prediction.motion.part(slice(begin, last + 1)))
            prediction = replace(short, force=damper.force_for(short))
        measured = run.force[first : last + 1 : max(1, (last + 1 - first) // _ROWS)]
        picked = np.arange(first, last + 1, max(1, (last + 1 - first) // _ROWS)) - begin
        residual = prediction.force[picked] - measured
        scale = float(np.ptp(run.force[first : last + 1])) or 1.0
        error = float(np.sqrt(np.mean(residual**2))) / scale
        weight = 1 / (scale * np.sqrt(picked.size) * np.sqrt(max(error, _BEST)))
        frequency = prediction.condition.frequency_Hz if prediction.is_sine else None
        return cls(run, session_of(run), prediction, picked, residual, scale, weight, frequency)

    @property
    def predicted(self) -> Floats:
        """Force at the picked samples [N]."""
        return self.prediction.force[self.picked]


def normal_of(slopes: Sequence[Floats], parts: Sequence[Part]) -> Floats:
    """(P, P) weighted normal matrix of some runs."""
    return np.sum([(s.T @ s) * part.weight**2 for s, part in zip(slopes, parts, strict=True)], axis=0)


def _known(
    slopes: Sequence[Floats], parts: Sequence[Part], count: int
) -> tuple[list[int], list[int], list[list[int]], Floats]:
    """Columns to keep, those no run shows, groups that do the same, and the inverse of the kept ones' normal matrix."""
    normal = normal_of(slopes, parts)
    keep = [i for i in range(count) if normal[i, i] > 0]
    unseen, alike = [i for i in range(count) if i not in keep], []
    while keep:
        scale = np.sqrt(np.diag(normal)[keep])
        values, vectors = np.linalg.eigh(normal[np.ix_(keep, keep)] / np.outer(scale, scale))
        if values[0] > _UNKNOWN * values[-1]:
            return keep, unseen, alike, (vectors / values) @ vectors.T / np.outer(scale, scale)
        groups = alike_groups(vectors[:, values <= _UNKNOWN * values[-1]])
        alike += [[keep[i] for i in group] for group, _ in groups]
        keep = [i for at, i in enumerate(keep) if at not in {one for _, one in groups}]
    return [], unseen, alike, np.zeros((0, 0))


def _told(parts: Sequence[Part], slopes: Sequence[Floats], inverse: Floats) -> Floats:
    """(R, P) share each run has in what is known of each number."""
    told = np.array([np.sum((s @ inverse * p.weight) ** 2, axis=0) for s, p in zip(slopes, parts, strict=True)])
    return told / np.maximum(told.sum(axis=0), np.finfo(float).tiny)


def _rest_on_one_run(names: Sequence[str], parts: Sequence[Part], told: Floats) -> list[str]:
    """Numbers of which one run of several tells most, in words."""
    if len(parts) < 3 or not names:
        return []
    best = np.argmax(told, axis=0)
    return [
        f"{name} rests on one run: {parts[r].run.id} tells {100 * told[r, i]:.0f} % of it"
        for i, (name, r) in enumerate(zip(names, best, strict=True))
        if told[r, i] > _ONE_RUN
    ]


def _within(parts: Sequence[Part], slopes: Sequence[Floats], inverse: Floats) -> tuple[Floats, Floats]:
    """Covariance by noise and model error within the runs, and its relative variance by parameter."""
    total, doubt = np.zeros_like(inverse), np.zeros(len(inverse))
    for part, slope in zip(parts, slopes, strict=True):
        table = np.column_stack([part.predicted - part.predicted.mean(), np.ones(part.picked.size)])
        rest = part.residual - table @ np.linalg.lstsq(table, part.residual, rcond=None)[0]
        time = part.prediction.motion.time[part.picked]
        own = inverse * part.weight**2  # what this run takes part in
        score, dof, _ = score_covariance(slope, rest, time, part.frequency, own)
        made = inverse @ score @ inverse * part.weight**4
        total += made
        doubt += np.diag(made) ** 2 * 2 / dof
    return total, doubt / np.maximum(np.diag(total), np.finfo(float).tiny) ** 2


def _sessions(
    parts: Sequence[Part], slopes: Sequence[Floats], influence: Sequence[Floats], within: Floats
) -> tuple[float, float, float, Floats]:
    """Spread of gains and offsets between sessions, its degrees of freedom, and what it does to the parameters.

    By moments: gains and offsets read off the residuals of each session, less what noise would
    show, and scaled by what the fit has left of them [Rao 1971].
    """
    sessions = sorted({part.session for part in parts})
    count, size = len(sessions), len(within)
    reading = np.zeros((2 * count, 2 * count))  # what a session's gain and offset show as, in every session
    shown, noise = np.zeros(2 * count), np.zeros(2 * count)
    effect = np.zeros((size, 2 * count))
    tables = []
    for part in parts:
        table = np.column_stack([part.predicted, np.ones(part.picked.size)])
        tables.append(table)
        at = 2 * sessions.index(part.session)
        effect[:, at : at + 2] -= influence[len(tables) - 1] @ table
    for k, session in enumerate(sessions):
        own = [i for i, part in enumerate(parts) if part.session == session]
        stacked = np.concatenate([tables[i] * parts[i].weight for i in own])
        left = np.concatenate([parts[i].residual * parts[i].weight for i in own])
        slope = np.concatenate([slopes[i] * parts[i].weight for i in own])
        solve = np.linalg.pinv(stacked)
        shown[2 * k : 2 * k + 2] = solve @ left
        rows = solve @ slope @ effect
        rows[:, 2 * k : 2 * k + 2] += np.eye(2)
        reading[2 * k : 2 * k + 2] = rows
        rest = left - stacked @ (solve @ left)
        noise[2 * k : 2 * k + 2] = np.diag(np.linalg.pinv(stacked.T @ stacked)) * float(np.mean(rest**2))
    gains, offsets = slice(0, None, 2), slice(1, None, 2)
    moments = np.array(
        [
            [np.sum(reading[gains, gains] ** 2), np.sum(reading[gains, offsets] ** 2)],
            [np.sum(reading[offsets, gains] ** 2), np.sum(reading[offsets, offsets] ** 2)],
        ]
    )
    seen = np.array([np.sum(shown[gains] ** 2 - noise[gains]), np.sum(shown[offsets] ** 2 - noise[offsets])])
    found = np.linalg.lstsq(moments, seen, rcond=1e-9)[0]
    # A share of a variance cannot be below zero; then the other is read alone.
    if found[0] < 0 or found[1] < 0:
        alone = np.maximum(seen, 0) / np.maximum(np.diag(moments), 1e-12)
        found = np.where(found < 0, 0.0, alone)
    projected = reading[gains, gains]
    dof = float(np.trace(projected.T @ projected) ** 2 / max(np.sum((projected.T @ projected) ** 2), 1e-300))
    dof = min(dof, float(np.trace(projected)), count - 1.0)
    gain, offset = float(np.sqrt(found[0])), float(np.sqrt(found[1]))
    return gain, offset, max(dof, 0.0), _shaken(parts, slopes, sessions, gain, offset)


def _shaken(
    parts: Sequence[Part], slopes: Sequence[Floats], sessions: Sequence[str], gain: float, offset: float
) -> Floats:
    """(P, P) covariance of the numbers by sessions whose gains and offsets are drawn anew.

    The fit counts a run less the worse it is described, so a session far off moves the numbers less
    than its gain would say. Each draw is therefore fitted as the runs were: linearised, weights and
    numbers in turn.
    """
    size, count = slopes[0].shape[1], len(parts)
    rng = np.random.default_rng(_SEED)
    drawn = rng.standard_normal((_DRAWS, len(sessions), 2)) * [gain, offset]
    shift = drawn[:, [sessions.index(part.session) for part in parts]]  # (draws, runs, 2)
    grams, rest = np.empty((count, size + 2, size + 2)), np.empty(count)
    for i, (part, slope) in enumerate(zip(parts, slopes, strict=True)):
        table = np.column_stack([slope, part.predicted, np.ones(part.picked.size)])
        grams[i] = table.T @ table
        own = table[:, size:]
        rest[i] = np.sum((part.residual - own @ np.linalg.lstsq(own, part.residual, rcond=None)[0]) ** 2)
    pulls = np.einsum("rpk,drk->drp", grams[:, :size, size:], shift)
    scale = np.array([part.scale * np.sqrt(part.picked.size) for part in parts])
    moved, weight = np.zeros((_DRAWS, size)), np.ones((_DRAWS, count))
    for _ in range(_ROUNDS):
        pull = weight / scale**2
        normal = np.einsum("dr,rpq->dpq", pull, grams[:, :size, :size])
        unit = np.sqrt(np.einsum("dpp->dp", normal))
        right = np.einsum("dr,drp->dp", pull, pulls) / unit
        moved = np.linalg.solve(normal / unit[:, :, None] / unit[:, None, :], right[:, :, None])[:, :, 0] / unit
        left = np.concatenate([np.broadcast_to(moved[:, None, :], (_DRAWS, count, size)), -shift], axis=2)
        squares = np.einsum("drp,rpq,drq->dr", left, grams, left, optimize=True) + rest
        weight = 1 / np.maximum(np.sqrt(np.maximum(squares, 0)) / scale, _BEST)
    return moved.T @ moved / _DRAWS


def _with_model_error(
    made: Certainty, damper: Damper, parts: Sequence[Part], slopes: Sequence[Floats], left_out: Sequence[Scores]
) -> Certainty:
    """What left-out conditions were wrong by, less what the numbers and the sessions explain."""
    if not left_out:
        return made
    explained = {"force": [], "peak": [], "energy": []}
    for part, slope in zip(parts, slopes, strict=True):
        half = peak_force(part.predicted) or 1.0
        inside = np.einsum("np,pq,nq->n", slope, made.covariance, slope)
        session = (made.gain * part.predicted) ** 2 + made.offset**2
        explained["force"].append(float(np.mean(inside + session)) / half**2)
        top, bottom = int(np.argmax(part.predicted)), int(np.argmin(part.predicted))
        swing = (slope[top] - slope[bottom]) / 2
        explained["peak"].append(float(swing @ made.covariance @ swing) / half**2 + made.gain**2)
        explained["energy"].append(explained["peak"][-1])
    errors = {
        "force": [2 * s.nrmse_pp for s in left_out],  # over half the peak-to-peak force
        "peak": [s.peak_error for s in left_out],
        "energy": [s.energy_error for s in left_out if np.isfinite(s.energy_error)],
    }
    rest = {
        name: float(np.sqrt(max(np.mean(np.square(values)) - np.mean(explained[name]), 0.0))) if values else 0.0
        for name, values in errors.items()
    }
    return replace(made, **rest, left_out=len(left_out))
