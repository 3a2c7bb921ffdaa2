"""How sure a damper is: the spread of its numbers, of a session it has not seen, and of its form.

Three parts, stated apart. The numbers it was identified from are uncertain (*parameter*): noise
and model error within the runs, and gains and offsets that differ from session to session. A
session nobody has seen brings a gain and an offset of its own (*session*). And the form is not
the damper (*model*): what conditions left out of the fit were wrong by, beyond the other two.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mrdamper.data import Condition, Floats, Run
from mrdamper.errors import InputError
from mrdamper.identification.covariance import score_covariance
from mrdamper.metrics import Scores, dissipated_power, peak_force

if TYPE_CHECKING:
    from mrdamper.dampers.base import Damper, Prediction

_ROWS = 400  # samples of a run that enter
_CYCLES = 4  # of a sine that enter
_WARM_UP = 1.5  # cycles before them in which the model forgets its start
_STEP = 1e-4  # of a number, for derivatives
_BEST = 1e-3  # nrmse_pp below which a run gains no more weight, as in the joint fit
_UNKNOWN = 1e-10  # of the largest: eigenvalue of the scaled normal matrix below which a direction is unknown


@dataclass(frozen=True)
class OwnNumber:
    """A number of a damper determined from data: its value, its bounds, and whether it is searched in the logarithm."""

    value: float
    bounds: tuple[float, float] = (-np.inf, np.inf)
    log: bool = False


@dataclass(frozen=True, eq=False)
class Certainty:
    """What is known of how wrong a damper may be.

    Attributes
    ----------
    names : tuple of str, length P
        Numbers determined from the data.
    logs : tuple of bool, length P
        Whether the covariance is that of the logarithm.
    covariance : (P, P) array
    dof : (P,) array
        Degrees of freedom behind each variance.
    one_sided : tuple of str
        Numbers held by a bound: only the other side is open.
    unknown : tuple of str
        Numbers these runs cannot tell apart from others.
    gain, offset : float
        Standard deviations between sessions, of the force as a share and as a shift [N].
    session_dof : float
        Degrees of freedom behind them; below 1 there are too few runs to know.
    force, peak, energy : float
        Standard deviations of the model's own error: of the force over half its peak-to-peak value,
        of the peak force and of the dissipated energy, relative.
    left_out : int
        Runs left out that say so.
    """

    names: tuple[str, ...]
    logs: tuple[bool, ...]
    covariance: Floats
    dof: Floats
    one_sided: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
    gain: float = 0.0
    offset: float = 0.0
    session_dof: float = 0.0
    force: float = 0.0
    peak: float = 0.0
    energy: float = 0.0
    left_out: int = 0

    def interval(self, damper: Damper, name: str, level: float = 0.95) -> tuple[float, float]:
        """Ends of a number's interval.

        Raises
        ------
        InputError
            E_CERTAINTY if it is not among those whose spread is known.
        """
        if name not in self.names:
            why = "held by a bound" if name in self.one_sided else "not determined by these runs"
            raise InputError(f"{name} is {why}", mend="test where it matters", code="E_CERTAINTY")
        i = self.names.index(name)
        value, half = (
            damper.own_numbers[name].value,
            student(level, self.dof[i]) * float(np.sqrt(self.covariance[i, i])),
        )
        if self.logs[i]:
            return float(value * np.exp(-half)), float(value * np.exp(half))
        return float(value - half), float(value + half)


@dataclass(frozen=True, eq=False)
class Band:
    """Where the force of an unknown session lies.

    Attributes
    ----------
    low, high : (N,) arrays
        [N]
    parameter, session, model : (N,) arrays
        Standard deviations of the parts [N].
    peak : (float, float)
        Of half the peak-to-peak force [N].
    energy : (float, float)
        Relative, around the predicted dissipated energy.
    known_session : (float, float)
        Peak force once the session's gain is known [N].
    """

    low: Floats
    high: Floats
    parameter: Floats
    session: Floats
    model: Floats
    peak: tuple[float, float]
    energy: tuple[float, float]
    known_session: tuple[float, float]


def student(level: float, dof: float) -> float:
    """Two-sided quantile of Student's t.

    Raises
    ------
    InputError
        E_LEVEL if the level is not between 0 and 1.
    """
    from scipy.special import stdtrit

    if not 0 < level < 1:
        raise InputError(f"level {level:g}", mend="give a share between 0 and 1, as 0.9", code="E_LEVEL")
    return float(stdtrit(max(dof, 1.0), (1 + level) / 2))


def session_of(run: Run) -> str:
    """The session a run was recorded in: as stated, or its day and hour, or the run by itself."""
    clock = run.notes.get("recorded_at", "")
    return run.notes.get("session") or (clock[:13] if len(clock) >= 13 else f"run {run.id}")


def certain(damper: Damper, runs: Sequence[Run], left_out: Sequence[Scores] = ()) -> Damper:
    """The damper with what is known of its uncertainty.

    Parameters
    ----------
    damper : Damper
    runs : sequence of Run
        It was identified from.
    left_out : sequence of Scores
        Of runs predicted without their condition: what the form itself is wrong by.
    """
    if not damper.own_numbers or not runs:
        return damper
    parts = [_Part.of(damper, run) for run in runs]
    numbers = damper.own_numbers
    at_bound = tuple(n for n, own in numbers.items() if np.isclose(own.value, own.bounds, rtol=1e-6, atol=1e-12).any())
    free = [name for name in numbers if name not in at_bound]
    slopes = [np.column_stack([force_slope(damper, p.prediction, n)[p.picked] for n in free]) for p in parts]
    known, unknown, inverse = _known(slopes, parts, free)
    slopes = [slope[:, known] for slope in slopes]
    names = tuple(free[i] for i in known)
    influence = [inverse @ (slope * part.weight**2).T for slope, part in zip(slopes, parts, strict=True)]
    within, doubt = _within(parts, slopes, inverse)
    gain, offset, session_dof, between = _sessions(parts, slopes, influence, within)
    covariance = within + between
    share = np.diag(between) / np.maximum(np.diag(covariance), np.finfo(float).tiny)
    dof = 1 / (share**2 / max(session_dof, 1.0) + (1 - share) ** 2 * doubt / 2)
    made = Certainty(
        names,
        tuple(numbers[n].log for n in names),
        covariance,
        np.maximum(dof, 1.0),
        at_bound,
        unknown,
        gain,
        offset,
        session_dof,
    )
    return replace(damper, certainty=_with_model_error(made, damper, parts, slopes, left_out))  # type: ignore[type-var]


@dataclass(frozen=True, eq=False)
class _Part:
    """What enters of a run: samples, what was left over, and the weight its residuals had."""

    run: Run
    session: str
    prediction: Prediction
    picked: np.ndarray
    residual: Floats
    weight: float
    frequency: float | None

    @classmethod
    def of(cls, damper: Damper, run: Run) -> _Part:
        prediction = damper.predict_run(run)
        first, last = (int(i) for i in np.flatnonzero(run.in_window)[[0, -1]])
        begin = 0
        if prediction.is_sine:
            period = 1 / prediction.condition.frequency_Hz
            first = max(first, int(np.searchsorted(run.time, run.time[last] - _CYCLES * period)))
            begin = int(np.searchsorted(run.time, run.time[first] - _WARM_UP * period))
            short = replace(prediction, motion=prediction.motion.part(slice(begin, last + 1)))
            prediction = replace(short, force=damper.again(short))
        measured = run.force[first : last + 1 : max(1, (last + 1 - first) // _ROWS)]
        picked = np.arange(first, last + 1, max(1, (last + 1 - first) // _ROWS)) - begin
        residual = prediction.force[picked] - measured
        scale = float(np.ptp(run.force[first : last + 1])) or 1.0
        error = float(np.sqrt(np.mean(residual**2))) / scale
        weight = 1 / (scale * np.sqrt(picked.size) * np.sqrt(max(error, _BEST)))
        frequency = prediction.condition.frequency_Hz if prediction.is_sine else None
        return cls(run, session_of(run), prediction, picked, residual, weight, frequency)

    @property
    def predicted(self) -> Floats:
        """Force at the picked samples [N]."""
        return self.prediction.force[self.picked]


def force_slope(damper: Damper, prediction: Prediction, name: str) -> Floats:
    """(N,) derivative of a predicted force by one of the damper's own numbers, or by its logarithm."""
    value, log = damper.own_numbers[name].value, damper.own_numbers[name].log
    step = _STEP if log else _STEP * (abs(value) or 1.0)
    moved = damper.with_numbers({name: value * np.exp(step) if log else value + step})
    return (moved.again(prediction) - prediction.force) / step


def _known(
    slopes: Sequence[Floats], parts: Sequence[_Part], free: Sequence[str]
) -> tuple[list[int], tuple[str, ...], Floats]:
    """Columns that are determined, names of the others, and the inverse of the normal matrix of the former."""
    normal = np.sum([(s.T @ s) * part.weight**2 for s, part in zip(slopes, parts, strict=True)], axis=0)
    keep = list(np.flatnonzero(np.diag(normal) > 0))
    while keep:
        scale = np.sqrt(np.diag(normal)[keep])
        values, vectors = np.linalg.eigh(normal[np.ix_(keep, keep)] / np.outer(scale, scale))
        if values[0] > _UNKNOWN * values[-1]:
            inverse = (vectors / values) @ vectors.T / np.outer(scale, scale)
            lost = tuple(name for i, name in enumerate(free) if i not in keep)
            return [int(i) for i in keep], lost, inverse
        keep.pop(int(np.argmax(np.abs(vectors[:, 0]))))
    return [], tuple(free), np.zeros((0, 0))


def _within(parts: Sequence[_Part], slopes: Sequence[Floats], inverse: Floats) -> tuple[Floats, Floats]:
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
    parts: Sequence[_Part], slopes: Sequence[Floats], influence: Sequence[Floats], within: Floats
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
    variances = np.tile(found, count)
    return float(np.sqrt(found[0])), float(np.sqrt(found[1])), max(dof, 0.0), (effect * variances) @ effect.T


def _with_model_error(
    made: Certainty, damper: Damper, parts: Sequence[_Part], slopes: Sequence[Floats], left_out: Sequence[Scores]
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


def band(
    damper: Damper, prediction: Prediction, level: float = 0.9, shown: NDArray[np.bool_] | None = None
) -> Band | None:
    """Where the force lies at a level, in a session nobody has seen; None where nothing is known of it.

    Parameters
    ----------
    damper : Damper
    prediction : Prediction
        Of this damper.
    level : float
    shown : (N,) array of bool, optional
        Samples the band is of, its peak and its energy among them; default all.

    Raises
    ------
    InputError
        E_LEVEL if the level is not between 0 and 1.
    """
    student(level, 1.0)
    known: Certainty | None = damper.certainty
    if known is None:
        return None
    seen_at = slice(None) if shown is None else shown
    force, motion = prediction.force[seen_at], prediction.motion.part(seen_at)
    table = [force_slope(damper, prediction, name)[seen_at] for name in known.names]
    slopes = np.column_stack(table) if table else np.zeros((force.size, 0))
    half = peak_force(force)
    parameter = np.einsum("np,pq,nq->n", slopes, known.covariance, slopes)
    session = (known.gain * force) ** 2 + known.offset**2
    model = np.full(force.size, (known.force * half) ** 2)
    top, bottom = int(np.argmax(force)), int(np.argmin(force))
    swing = (slopes[top] - slopes[bottom]) / 2
    own = float(swing @ known.covariance @ swing)
    worst = float(np.min(known.dof)) if known.names else 1.0
    dofs = (worst, max(known.session_dof, 1.0), max(known.left_out - 1.0, 1.0))

    def reach(parts: Sequence[float]) -> float:
        whole = sum(parts)
        if whole <= 0:
            return 0.0
        dof = whole**2 / sum(part**2 / d for part, d in zip(parts, dofs, strict=True))
        return student(level, dof) * float(np.sqrt(whole))

    t = reach([float(np.mean(v)) for v in (parameter, session, model)])
    mean = float(np.mean(parameter + session + model))
    width = (t / np.sqrt(mean) if mean > 0 else 0.0) * np.sqrt(parameter + session + model)
    unseen = reach([own, (known.gain * half) ** 2, (known.peak * half) ** 2])
    seen = reach([own, 0.0, (known.peak * half) ** 2])
    power = dissipated_power(force, motion.velocity, motion.time) or 1.0
    turned = np.array([dissipated_power(column, motion.velocity, motion.time) for column in slopes.T]) / power
    loss = reach([float(turned @ known.covariance @ turned), known.gain**2, known.energy**2])
    return Band(
        force - width, force + width, np.sqrt(parameter), np.sqrt(session), np.sqrt(model),
        (max(half - unseen, 0.0), half + unseen), (-loss, loss), (max(half - seen, 0.0), half + seen),
    )  # fmt: skip


def unsure(damper: Damper) -> list[str]:
    """What cannot be known from these runs, and what is known badly, in words."""
    known: Certainty | None = damper.certainty
    if known is None:
        return ["How sure the numbers are is not known: the model was saved without it."]
    said = [f"{name} ended at a limit of its range: only one side of it is open." for name in known.one_sided]
    if known.unknown:
        said.append(f"{', '.join(known.unknown)} cannot be known from these runs: others do the same to the force.")
    if known.session_dof < 2:
        said.append("There are too few sessions to know how much they differ.")
    numbers = damper.own_numbers
    for i, name in enumerate(known.names):
        error = float(np.sqrt(known.covariance[i, i])) / (1.0 if known.logs[i] else abs(numbers[name].value) or 1.0)
        if error > 0.5:
            said.append(f"{name} is known to a factor only: its standard error is {100 * error:.0f} %.")
    scale = np.sqrt(np.diag(known.covariance))
    alike = known.covariance / np.outer(scale, scale) if known.names else np.zeros((0, 0))
    for i, j in zip(*np.where(np.triu(np.abs(alike), 1) > 0.98), strict=True):
        said.append(
            f"{known.names[i]} and {known.names[j]} are known together, not apart (correlation {alike[i, j]:.2f})."
        )
    return said


def at_condition(damper: Damper, condition: Condition, level: float = 0.9) -> tuple[Prediction, Band | None]:
    """Steady loop at a condition, and its band."""
    prediction = damper.predict(condition)
    return prediction, band(damper, prediction, level)


def table(damper: Damper, level: float = 0.95) -> list[Mapping[str, float | str]]:
    """Numbers with the ends of their intervals, one row each."""
    known: Certainty | None = damper.certainty
    rows = []
    for name, own in damper.own_numbers.items():
        row: dict[str, float | str] = {"name": name, "value": own.value, "low": "", "high": ""}
        if known is not None and name in known.names:
            row["low"], row["high"] = known.interval(damper, name, level)
        rows.append(row)
    return rows
