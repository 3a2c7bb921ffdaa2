"""Gains and offsets that the runs of a test session share, estimated from the tests of a damper.

The force of the same test differs by a few per cent between days and by less within an hour, by temperatures, preload
and zero of the load cell. One run of a day therefore has information on the others. Gain and offset are random, with a
covariance of three parts: common to a session (a day), decaying with the time between two runs of it, and independent
for each run. [Rasmussen and Williams 2006, Gaussian processes; the three variances by maximum likelihood]
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from mrdamper.data.arrays import Floats
from mrdamper.data.runs import Run
from mrdamper.data.sessions import SESSIONS_NEEDED, hour_of, session_folds, session_groups, session_of
from mrdamper.data.strict_text import STRICT
from mrdamper.data.wording import counted
from mrdamper.errors import InputError

if TYPE_CHECKING:
    from mrdamper.dampers.protocols import DamperLike as Damper

UNKNOWN, KNOWN = "unknown", "known"  # session of a score: predicted as it is, or corrected by other runs of the day
_CORRELATION_HOURS = (0.5, 1.0, 2.0, 4.0, 8.0)  # correlation times within a session [h]
# smallest share of the scatter of each run alone, because the model error differs at every condition
_MIN_RUN_SHARE = 0.2
_MIN_DEVIATION = 0.04  # relative deviation of a session's gain from which it is named
_DEVIATION_RATIO = 4.0  # the same, as a multiple of the standard deviation of the other sessions
_REMEDY = "repeat a condition on each of three days or more; state recorded_at or session in runs.csv"


@dataclass(frozen=True)
class RecordingTime:
    """Session and time of a recording."""

    __pydantic_config__: ClassVar = STRICT

    session: str | None  # None where it is not known
    hour: float | None = None  # since 1970; None where only a day or a name is known

    @classmethod
    def of(cls, run: Run) -> RecordingTime:
        """From the notes of a run; raises E_CLOCK as `session_of`."""
        return cls(session_of(run), hour_of(run))


@dataclass(frozen=True)
class GainOffset:
    """Gain and offset that fit a prediction p to a run by least squares: gain · p + offset."""

    gain: float
    offset: float  # [N]
    # mean and square: mean of p [N] and of p² [N²]
    mean: float
    square: float
    rest: float  # mean square of the residual [N²]
    pp: float  # peak-to-peak measured force [N]

    @classmethod
    def of(cls, measured: Floats, predicted: Floats) -> GainOffset:
        """Least squares of one run."""
        size, middle = measured.size, float(measured.sum()) / measured.size
        mean, square = float(predicted.sum()) / size, float(predicted @ predicted) / size
        spread = square - mean**2
        shared = float(predicted @ measured) / size - mean * middle
        gain = shared / spread if spread > 1e-12 * max(square, 1e-300) else 1.0
        offset = middle - gain * mean
        error = gain * predicted + (offset - measured)
        return cls(gain, offset, mean, square, float(error @ error) / size, float(np.ptp(measured)))

    def error(self, gain: float, offset: float) -> float:
        """nrmse_pp of the prediction after another gain and offset."""
        g, o = gain - self.gain, offset - self.offset
        return float(np.sqrt(max(self.rest + g**2 * self.square + 2 * g * o * self.mean + o**2, 0.0)) / self.pp)


@dataclass(frozen=True)
class RunScatter:
    """Standard deviations of one quantity between runs."""

    __pydantic_config__: ClassVar = STRICT

    session: float  # shared by a session
    hour: float  # shared by neighbours in a session
    run: float  # of the run alone
    hours: float  # correlation time of neighbours [h]

    @property
    def total(self) -> float:
        """Standard deviation of a run in a future session."""
        return float(np.sqrt(self.session**2 + self.hour**2 + self.run**2))

    def covariance(self, a: Sequence[RecordingTime], b: Sequence[RecordingTime]) -> Floats:
        """Return (A, B) of runs that are not the same."""
        shared = [[x.session is not None and x.session == y.session for y in b] for x in a]
        same = np.array(shared, dtype=float).reshape(len(a), len(b))
        hours = [[np.nan if w.hour is None else w.hour for w in when] for when in (a, b)]
        apart = np.abs(np.subtract.outer(*hours))
        near = np.where(np.isfinite(apart), np.exp(-np.nan_to_num(apart) / self.hours), 0.0)
        return same * (self.session**2 + self.hour**2 * near)

    def given(self, at: RecordingTime, others: Sequence[RecordingTime], values: Floats) -> tuple[float, float]:
        """Mean and standard deviation of a run's value, given those of others."""
        if not len(others) or self.total == 0:
            return 0.0, self.total
        own = max(self.run, _MIN_RUN_SHARE * self.total) ** 2
        k = self.covariance([at], others)[0]
        K = self.covariance(others, others) + own * np.eye(len(others))
        solved = np.linalg.solve(K, np.column_stack([values, k]))
        left = self.total**2 - float(k @ solved[:, 1])
        return float(k @ solved[:, 0]), float(np.sqrt(max(left, own)))

    @classmethod
    def likeliest(cls, when: Sequence[RecordingTime], values: Floats) -> RunScatter:
        """Maximum likelihood: the shares by halving steps from many starts, the scale in closed form."""
        size = len(values)
        alike = cls(1.0, 0.0, 0.0, np.inf).covariance(when, when)

        def costs(points: Floats, near: Floats) -> tuple[Floats, Floats]:
            shares = np.exp(points)[:, :, None, None]
            K = shares[:, 0] * alike + shares[:, 1] * near + np.eye(size)
            sign, log = np.linalg.slogdet(K)
            scale = np.linalg.solve(K, values[:, None])[..., 0] @ values / size
            good = (sign > 0) & (scale > 0)
            return np.where(good, log + size * np.log(np.where(good, scale, 1.0)), np.inf), np.where(good, scale, 0.0)

        best = (np.inf, cls(0.0, 0.0, 0.0, _CORRELATION_HOURS[0]))
        for hours in _CORRELATION_HOURS:
            near = cls(0.0, 1.0, 0.0, hours).covariance(when, when)
            np.fill_diagonal(near, 1.0)
            for start in ((1.0, 1.0), (1.0, 0.01), (0.01, 1.0), (0.01, 0.01)):
                point, step = np.log([*start]), 2.0
                (least,), (scale,) = costs(point[None], near)
                while step > 0.02:
                    trials = np.clip(point + step * np.concatenate([np.eye(2), -np.eye(2)]), -14, 9)
                    tried, scales = costs(trials, near)
                    at = int(np.argmin(tried))
                    if tried[at] < least - 1e-9:
                        point, least, scale = trials[at], tried[at], scales[at]
                    else:
                        step /= 2
                if least < best[0] - 1e-6:
                    session, hour = np.sqrt(scale * np.exp(point))
                    best = least, cls(float(session), float(hour), float(np.sqrt(scale)), hours)
        return best[1]


@dataclass(frozen=True)
class SessionCorrection:
    """Expected gain and offset of a run by the other runs of its session, with standard deviations."""

    gain: float
    gain_spread: float
    # offset and offset_spread: [N]
    offset: float
    offset_spread: float


@dataclass(frozen=True)
class Sessions:
    """Scatter between the sessions of a rig, and gains and offsets of the sessions a damper was identified in.

    Raises `InputError` if the lists, of R runs, differ in length.
    """

    __pydantic_config__: ClassVar = STRICT

    gain: RunScatter  # of gains [-]
    offset: RunScatter  # of offsets [N]
    # run_ids, when, gains, offsets: of the damper's own tests, against the damper
    run_ids: tuple[str, ...]
    when: tuple[RecordingTime, ...]
    gains: tuple[float, ...]
    offsets: tuple[float, ...]

    def __post_init__(self) -> None:
        if len({len(each) for each in (self.run_ids, self.when, self.gains, self.offsets)}) > 1:
            raise InputError("sessions: the lists differ in length", remedy="write the model again")

    @classmethod
    def of(cls, runs: Sequence[Run], left_out: Sequence[GainOffset], own: Sequence[GainOffset]) -> Sessions:
        """Estimate them from the tests of a damper, R runs.

        `left_out`: gains and offsets of each run predicted without its condition, whose scatter is that of future
        sessions; `own`: against the damper itself. Raises `InputError`: E_SESSION if no session has two runs, or there
        are under three; E_CLOCK if sessions overlap in time.
        """
        when = tuple(RecordingTime.of(run) for run in runs)
        _refuse_disorder(runs, when)
        if not session_folds(runs):
            count = len({w.session for w in when} - {None})
            reason = f"the runs state {counted(count, 'test session') if count else 'no test session'}"
            reason = "every session holds one run" if count >= SESSIONS_NEEDED else reason
            raise InputError(
                f"{reason}: the scatter between sessions cannot be estimated", remedy=_REMEDY, code="E_SESSION"
            )
        gain = RunScatter.likeliest(when, np.array([r.gain - 1 for r in left_out]))
        offset = RunScatter.likeliest(when, np.array([r.offset for r in left_out]))
        gains, offsets = tuple(r.gain for r in own), tuple(r.offset for r in own)
        return cls(gain, offset, tuple(run.id for run in runs), when, gains, offsets)

    def expected(self, at: RecordingTime, without: str = "") -> SessionCorrection | None:
        """Gain and offset of a run recorded then, by all runs but one; None if its session is unknown."""
        rows = [i for i, name in enumerate(self.run_ids) if name != without]
        when = [self.when[i] for i in rows]
        if at.session is None or all(w.session != at.session for w in when):
            return None
        gain, gain_spread = self.gain.given(at, when, np.array([self.gains[i] for i in rows]) - 1)
        offset, offset_spread = self.offset.given(at, when, np.array([self.offsets[i] for i in rows]))
        return SessionCorrection(1 + gain, gain_spread, offset, offset_spread)

    def deviating(self) -> dict[str, float]:
        """Return the gains [-] of sessions that differ from the others far more than these from each other."""
        groups = session_groups(when.session for when in self.when)
        alone = float(np.hypot(self.gain.hour, self.gain.run))
        gains = [[self.gains[i] for i in group] for group in groups]
        ratios: dict[str, float] = {}
        for group, own in zip(groups, gains, strict=True):
            others = [float(np.mean(values)) for values in gains if values is not own]
            usual = float(np.median(others))
            scatter = np.hypot(np.std(others, ddof=1), alone / np.sqrt(len(own)))
            if abs(np.mean(own) - usual) > max(_MIN_DEVIATION, _DEVIATION_RATIO * float(scatter)) * usual:
                ratios[str(self.when[group[0]].session)] = float(np.mean(own)) / usual
        return ratios

    def seen(self, damper: Damper, runs: Iterable[Run], own: bool) -> Sessions:
        """Return the sessions with the gains and offsets of further runs, for example check runs of a day.

        The damper's own tests count, too, if `own`.
        """
        rows = list[tuple[str, RecordingTime, float, float]]()
        for run in runs:
            inside = run.in_window
            reading = GainOffset.of(run.force[inside], damper.predict(run).force[inside])
            rows.append((run.id, RecordingTime.of(run), reading.gain, reading.offset))
        if own:
            names = {name for name, *_ in rows}
            tests = zip(self.run_ids, self.when, self.gains, self.offsets, strict=True)
            rows += [row for row in tests if row[0] not in names]
        ids, when, gains, offsets = zip(*rows, strict=True) if rows else ((), (), (), ())
        return replace(self, run_ids=ids, when=when, gains=gains, offsets=offsets)


def sessions_known(damper: Damper, runs: Iterable[Run] = (), own: bool = False) -> Sessions:
    """Return the sessions as known by check runs, by a damper's own tests, or by both.

    Raises `InputError` (E_SESSION) if the damper's tests do not determine the scatter between sessions.
    """
    sessions = damper.uncertainty.sessions if damper.uncertainty else None
    if sessions is None:
        raise InputError(
            "its tests could not tell what runs of a session share",
            where=damper.title,
            remedy=_REMEDY,
            code="E_SESSION",
        )
    return sessions.seen(damper, runs, own)


def known_errors(sessions: Sessions, runs: Sequence[Run], left_out: Sequence[GainOffset]) -> Floats:
    """(R,) nrmse_pp of runs predicted without their condition, corrected by the other runs of their session.

    The sessions are those of these runs; their gains and offsets are replaced by those of the same predictions.
    """
    gains, offsets = tuple(r.gain for r in left_out), tuple(r.offset for r in left_out)
    sessions = replace(sessions, gains=gains, offsets=offsets)
    errors: list[float] = []
    for run, reading in zip(runs, left_out, strict=True):
        correction = sessions.expected(RecordingTime.of(run), without=run.id)
        errors.append(reading.error(correction.gain, correction.offset) if correction else reading.error(1.0, 0.0))
    return np.array(errors)


def _refuse_disorder(runs: Sequence[Run], when: Sequence[RecordingTime]) -> None:
    """Refuse a session interrupted by runs of another: a clock or a name is wrong."""
    timed = sorted((i for i, w in enumerate(when) if w.hour is not None), key=lambda i: when[i].hour or 0.0)
    timed = [i for i in timed if when[i].session is not None]
    ended: set[str | None] = set()
    for i, j in pairwise(timed):
        if when[i].session != when[j].session:
            ended.add(when[i].session)
            if when[j].session in ended:
                raise InputError(
                    f"session {when[j].session!r} goes on after session {when[i].session!r} began",
                    where=f"run {runs[j].id}",
                    remedy="check recorded_at, or give each session a name of its own",
                    code="E_CLOCK",
                )
