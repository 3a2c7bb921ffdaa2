"""Which tests next: records a rig can play, chosen by how much they shrink the doubt about a damper.

With a model, records are added one by one, each the one that lowers the mean variance of the force
over the envelope most for its rig time. Drift is in the reckoning: a session brings a gain and an
offset of its own, so the tenth record of one session teaches less than the first of the next.
Without a model, a first matrix for an unknown damper, a reason for every row.
"""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from mrdamper.dampers.base import Damper, Prediction
from mrdamper.dampers.certainty import Certainty
from mrdamper.dampers.slopes import force_slopes
from mrdamper.data import Condition, Floats
from mrdamper.errors import InputError
from mrdamper.motion import Excitation, sine
from mrdamper.rig_files.strict_toml import read_toml

_LEVELS = (4, 4, 4)  # currents, frequencies, amplitudes on the grid of candidates
_SAMPLES = 24  # of a cycle that count; model error leaves fewer independent ones than a rig records
_DRAWS = 2  # of the parameters, beside the estimate
_FLOOR = 0.01  # of half the peak-to-peak force: what no record is better than
_SEED = 20240813


@dataclass(frozen=True)
class Limits:
    """What a rig can do, and what a test costs.

    Attributes
    ----------
    current_A, frequency_Hz, amplitude_mm : (float, float)
        Lowest and highest.
    velocity_m_s : float
        Highest peak velocity.
    force_N : float
        Rated force of the damper; only a plan without a model needs it.
    cycles : float
        Of a record.
    sample_rate_Hz : float
    minutes_between : float
        From the end of a record to the start of the next: set-up and cooling.
    sessions : int
        Over which the hours are spread.
    """

    current_A: tuple[float, float]
    frequency_Hz: tuple[float, float]
    amplitude_mm: tuple[float, float]
    velocity_m_s: float = math.inf
    force_N: float = 0.0
    cycles: float = 6.0
    sample_rate_Hz: float = 500.0
    minutes_between: float = 3.0
    sessions: int = 2

    def __post_init__(self) -> None:
        for name in ("current_A", "frequency_Hz", "amplitude_mm"):
            low, high = getattr(self, name)
            least = 0.0 if name == "current_A" else 1e-6
            if not least <= low <= high < math.inf:
                raise _bad(f"{name} = [{low:g}, {high:g}]", "give the lowest and the highest, positive and in order")
        for name in ("velocity_m_s", "cycles", "sample_rate_Hz", "sessions"):
            if not getattr(self, name) > 0:
                raise _bad(f"{name} = {getattr(self, name):g}", "give a number above zero")
        if self.minutes_between < 0 or self.force_N < 0:
            raise _bad("a negative time or force", "give zero or more")
        if self.amplitude_mm[0] > 1000:
            raise _bad(f"amplitudes from {self.amplitude_mm[0]:g} mm", "is that in µm? amplitude_mm is in mm")
        if self.slowest > self.velocity_m_s:
            raise _bad(
                f"the slowest motion has {self.slowest:.3g} m/s, the limit is {self.velocity_m_s:g} m/s",
                "allow a lower frequency or amplitude; velocity_m_s is in m/s",
            )

    @property
    def slowest(self) -> float:
        """Lowest peak velocity [m/s]."""
        return 2 * math.pi * self.frequency_Hz[0] * self.amplitude_mm[0] * 1e-3

    def minutes(self, condition: Condition) -> float:
        """Rig time of a record."""
        return self.cycles / condition.frequency_Hz / 60 + self.minutes_between

    def candidates(self) -> list[Condition]:
        """Conditions on a grid inside the limits."""
        count_I, count_f, count_A = _LEVELS
        grid = itertools.product(
            np.unique(np.linspace(*self.current_A, count_I)),
            np.unique(np.geomspace(*self.frequency_Hz, count_f)),
            np.unique(np.geomspace(*self.amplitude_mm, count_A)),
        )
        made = [Condition(float(i), float(f), float(a) * 1e-3) for i, f, a in grid]
        return [c for c in made if c.peak_velocity <= self.velocity_m_s * (1 + 1e-9)]


def _bad(found: str, mend: str) -> InputError:
    return InputError(found, where="limits", mend=mend, code="E_LIMITS")


def read_limits(path: Path) -> Limits:
    """Limits from a TOML file whose keys are those of `Limits`, units in their names.

    Raises
    ------
    InputError
        E_LIMITS if the file cannot be read, or a key is unknown, missing, or no number.
    """
    try:
        given = read_toml(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(
            str(error).splitlines()[0], where=str(path), mend="give a TOML file of limits", code="E_LIMITS"
        ) from error
    known = {field.name: field for field in fields(Limits)}
    for name, value in given.items():
        if name not in known:
            stem = name.split("_")[0]
            near = [other for other in known if other.split("_")[0] == stem]
            raise _bad(
                f"key {name}",
                f"write {near[0]}: the unit is part of the name" if near else f"known: {', '.join(known)}",
            )
        numbers = value if isinstance(value, list) else [value]
        pair = name in ("current_A", "frequency_Hz", "amplitude_mm")
        plain = all(isinstance(n, int | float) and not isinstance(n, bool) and math.isfinite(n) for n in numbers)
        if not plain or len(numbers) != (2 if pair else 1):
            raise _bad(f"{name} = {value!r}", "give [lowest, highest]" if pair else "give one number")
    missing = [name for name in ("current_A", "frequency_Hz", "amplitude_mm") if name not in given]
    if missing:
        raise _bad(f"no {', '.join(missing)}", "give [lowest, highest] of each")
    values = {name: tuple(map(float, v)) if isinstance(v, list) else v for name, v in given.items()}
    return Limits(**{**values, "sessions": int(given.get("sessions", 2))})


@dataclass(frozen=True)
class Planned:
    """A record to play.

    Attributes
    ----------
    session : int
        From 1.
    condition : Condition
    minutes : float
        Of rig time.
    before, after : float
        Standard deviation of the force over the envelope, a share of half its peak-to-peak value:
        without this record, with it; NaN without a model.
    reason : str
    """

    session: int
    condition: Condition
    minutes: float
    before: float
    after: float
    reason: str


@dataclass(frozen=True, eq=False)
class _Doubt:
    """Derivatives of a condition's force by the numbers, over half its peak-to-peak, and that force."""

    slopes: Floats
    force: Floats


def plan_tests(damper: Damper, limits: Limits, hours: float) -> list[Planned]:
    """Records that shrink the doubt about a damper's force most, in the order to play them.

    Parameters
    ----------
    damper : Damper
        With its covariance.
    limits : Limits
    hours : float
        Of rig time.

    Raises
    ------
    InputError
        E_CERTAINTY without a covariance; E_LIMITS if the hours hold no record or nothing is allowed.
    """
    known = damper.certainty
    if known is None or not known.names:
        raise InputError(
            "the model does not know how sure it is",
            mend="study the tests again, or plan without a model",
            code="E_CERTAINTY",
        )
    reckoning = Reckoning.of(damper, limits)
    _refuse_short(limits, hours, reckoning.conditions)
    return reckoning.chosen(hours)


@dataclass(frozen=True, eq=False)
class Reckoning:
    """What records on a grid of conditions would tell, session by session.

    Attributes
    ----------
    known : Certainty
    limits : Limits
    conditions : sequence of Condition
    prior : (P, P) array
        Precision of the numbers before any new record.
    goal : (P, P) array
        Weight of the numbers' variances in that of the force over the envelope.
    columns : derivatives of each condition's force, at each draw of the numbers
    """

    known: Certainty
    limits: Limits
    conditions: Sequence[Condition]
    prior: Floats
    goal: Floats
    columns: Sequence[Sequence[Floats]]

    @classmethod
    def of(cls, damper: Damper, limits: Limits) -> Reckoning:
        """Of a damper with its covariance, over the limits' grid."""
        known: Certainty = damper.certainty  # type: ignore[assignment]
        conditions = limits.candidates()
        doubts = [_doubts(damper, known, condition) for condition in conditions]
        even = known.covariance + 1e-12 * np.diag(np.diag(known.covariance))
        goal = np.mean(
            [np.mean([d.slopes.T @ d.slopes / len(d.slopes) for d in drawn], axis=0) for drawn in doubts], axis=0
        )
        spread = max(known.force, _FLOOR)
        columns = [[_whitened(d, spread) for d in drawn] for drawn in doubts]
        return cls(known, limits, conditions, np.asarray(np.linalg.inv(even), dtype=float), goal, columns)

    def variance(self, precision: Floats) -> float:
        """Mean variance of the force over the envelope, relative."""
        return float(np.trace(np.linalg.solve(precision, self.goal)))

    def precision(self, played: Sequence[Sequence[int]]) -> Floats:
        """Of the numbers after records, given as indices of conditions a session."""
        return self.prior + sum(_information(self.columns, rows, self.known) for rows in played)

    def spread(self, played: Sequence[Sequence[int]]) -> float:
        """Standard deviation of the force over the envelope after records."""
        return math.sqrt(self.variance(self.precision(played)))

    def chosen(self, hours: float) -> list[Planned]:
        """Records one by one, each the one that lowers the variance most for its rig time."""
        known, limits, conditions = self.known, self.limits, self.conditions
        played: list[list[int]] = [[] for _ in range(limits.sessions)]
        made, left, total = [], hours * 60, self.prior
        while True:
            at = min(range(limits.sessions), key=lambda s: sum(limits.minutes(conditions[i]) for i in played[s]))
            rest = total - _information(self.columns, played[at], known)
            options = [i for i in range(len(conditions)) if limits.minutes(conditions[i]) <= left]
            if not options:
                return made
            before = self.variance(total)
            gains = [
                (before - self.variance(rest + _information(self.columns, [*played[at], i], known)))
                / limits.minutes(conditions[i])
                for i in options
            ]
            best = options[int(np.argmax(gains))]
            played[at].append(best)
            total = rest + _information(self.columns, played[at], known)
            minutes = limits.minutes(conditions[best])
            left -= minutes
            reason, after = _reason(known, total - self.prior, self.prior, at + 1), math.sqrt(self.variance(total))
            made.append(Planned(at + 1, conditions[best], minutes, math.sqrt(before), after, reason))


def taught_least(damper: Damper, count: int = 3) -> list[tuple[str, float]]:
    """The runs a damper was identified from that say least about its numbers, each with its share of what is known."""
    known = damper.certainty
    shares = sorted(known.taught.items(), key=lambda item: item[1]) if known else []
    return shares[:count] if len(shares) > count else []


def _doubts(damper: Damper, known: Certainty, condition: Condition) -> list[_Doubt]:
    """At the estimate and at some draws of the numbers."""
    rng = np.random.default_rng(_SEED)
    root = np.linalg.cholesky(known.covariance + 1e-12 * np.diag(np.diag(known.covariance)))
    made = []
    for draw in range(_DRAWS + 1):
        shift = 0.5 * root @ rng.standard_normal(len(known.names)) * (draw > 0)
        values = {}
        for i, name in enumerate(known.names):
            own = damper.own_numbers[name]
            moved = own.value * math.exp(shift[i]) if own.log else own.value + shift[i]
            values[name] = float(np.clip(moved, *own.bounds))
        drawn = damper.with_numbers(values)
        motion = sine(condition, 2, 4 * _SAMPLES)
        base = Prediction(motion, drawn.force_along(motion, condition), condition, ())
        last = slice(-4 * _SAMPLES, None, 4)
        half = float(np.ptp(base.force[last]) / 2) or 1.0
        slopes = force_slopes(drawn, base, known.names)[last]
        made.append(_Doubt(slopes / half, base.force[last] / half))
    return made


def _whitened(doubt: _Doubt, spread: float) -> Floats:
    """(K, P + 2) derivatives by the numbers and by a session's gain and offset, over the error of a sample."""
    return np.column_stack([doubt.slopes, doubt.force, np.ones(doubt.force.size)]) / spread


def _information(columns: Sequence[Sequence[Floats]], rows: Sequence[int], known: Certainty) -> Floats:
    """Of one session's records on the numbers, its own gain and offset not being known."""
    count = len(known.names)
    if not rows:
        return np.zeros((count, count))
    total = np.zeros((count, count))
    for draw in range(len(columns[0])):
        table = np.concatenate([columns[i][draw] for i in rows])
        whole = table.T @ table
        own = whole[count:, count:] + np.diag([1 / max(known.gain, 1e-4) ** 2, 1e4])
        total += whole[:count, :count] - whole[:count, count:] @ np.linalg.solve(own, whole[count:, :count])
    return total / len(columns[0])


def _reason(known: Certainty, gained: Floats, prior: Floats, session: int) -> str:
    """Which number has gained most so far."""
    before = np.sqrt(np.diag(np.linalg.inv(prior)))
    after = np.sqrt(np.maximum(np.diag(np.linalg.inv(prior + gained)), 0.0))
    best = int(np.argmin(after / before))
    share = 100 * after[best] / before[best]
    return f"session {session}; {known.names[best]} is then known to {share:.0f} % of today's error"


def _refuse_short(limits: Limits, hours: float, conditions: Sequence[Condition]) -> None:
    if not conditions:
        raise _bad("no motion is allowed", "raise velocity_m_s, or lower frequency_Hz or amplitude_mm")
    least = min(limits.minutes(c) for c in conditions)
    if not (math.isfinite(hours) and hours * 60 >= least):
        raise _bad(f"{hours:g} hours", f"the shortest record takes {least:.1f} minutes of rig time")


def first_matrix(limits: Limits, hours: float) -> list[Planned]:
    """A first test matrix for a damper nobody has tested, the most telling rows first.

    Raises
    ------
    InputError
        E_LIMITS if the hours hold no record, or nothing is allowed.
    """
    (i_low, i_high), (f_low, f_high), (a_low, a_high) = limits.current_A, limits.frequency_Hz, limits.amplitude_mm
    _refuse_short(limits, hours, limits.candidates())
    f_mid, a_mid = math.sqrt(f_low * f_high), math.sqrt(a_low * a_high)
    i_mid = (i_low + i_high) / 2
    wanted = [
        (i_low, f_mid, a_mid, "passive: viscous damping, friction and gas without the field"),
        (i_high, f_mid, a_mid, "full field at the same motion: the range of the yield force"),
        (i_low, f_low, a_mid, "slow and passive: offset, gas spring and friction, hardly any viscous force"),
        (i_high, f_high, a_low, "short strokes, full field: play, seat and knee before the yield"),
        (i_mid, f_mid, a_mid, "half the field: whether the yield force saturates"),
        (i_low, f_high, a_mid, "fast and passive: viscous damping and whether it thins"),
        (i_high, f_low, a_high, "long and slow, full field: the plateau of the yield force"),
        (i_high, f_high, a_mid, "fast, full field: damping that grows with current, and lag"),
        (i_low + 0.25 * (i_high - i_low), f_mid, a_mid, "a quarter of the field: where the yield force begins"),
        (i_mid, f_low, a_low, "slow and short: rate dependence of the knee, apart from amplitude"),
        (i_mid, f_high, a_low, "fast and short at half the field: frequency and amplitude apart"),
        (i_high, f_mid, a_mid, "a repeat in another session: how much sessions differ"),
    ]
    made, left, count = [], hours * 60, 0
    for current, frequency, amplitude, reason in wanted:
        top = limits.velocity_m_s / (2 * math.pi * amplitude * 1e-3)
        if top < f_low:
            continue  # no frequency of the rig is slow enough for this stroke
        condition = Condition(current, min(frequency, top), amplitude * 1e-3)
        minutes = limits.minutes(condition)
        if minutes > left:
            continue
        repeat = reason.startswith("a repeat")
        session = limits.sessions if repeat else 1 + count * limits.sessions // len(wanted)
        made.append(Planned(session, condition, minutes, math.nan, math.nan, reason))
        left, count = left - minutes, count + 1
    return made


def record_of(planned: Planned, limits: Limits, damper: Damper | None) -> tuple[Excitation, Floats]:
    """The motion to play, eased in and out over a cycle, and the force to expect [N] for the load cell's range."""
    condition = planned.condition
    per_cycle = max(20, round(limits.sample_rate_Hz / condition.frequency_Hz))
    motion = sine(condition, math.ceil(limits.cycles) + 2, per_cycle)
    ease = np.clip(np.minimum(motion.time, motion.time[-1] - motion.time) * condition.frequency_Hz, 0, 1)
    ease = ease**2 * (3 - 2 * ease)
    eased = replace(
        motion,
        displacement=motion.displacement * ease,
        velocity=np.gradient(motion.displacement * ease, motion.time),
        acceleration=np.gradient(np.gradient(motion.displacement * ease, motion.time), motion.time),
    )
    if damper is not None:
        return eased, damper.force_along(eased, condition)
    peak = max(abs(limits.current_A[1]), 1e-9)
    share = 0.2 + 0.8 * condition.current_A / peak  # of the rated force; a guess, to set the range
    return eased, limits.force_N * share * np.tanh(eased.velocity / (0.05 * condition.peak_velocity))


def limits_of(damper: Damper) -> Limits:
    """The ranges a damper was tested over, as limits."""
    e = damper.envelope
    return Limits(
        e.current_A,
        e.frequency_Hz,
        (1e3 * e.amplitude_m[0], 1e3 * e.amplitude_m[1]),
        velocity_m_s=e.peak_velocity_m_s[1],
    )


def rows(planned: Sequence[Planned], names: Sequence[str]) -> list[dict[str, Any]]:
    """Columns of plan.csv."""
    return [
        {
            "order": number,
            "session": item.session,
            "file": name,
            "current_A": item.condition.current_A,
            "frequency_Hz": item.condition.frequency_Hz,
            "amplitude_mm": 1e3 * item.condition.amplitude_m,
            "minutes": round(item.minutes, 2),
            "band_before": "" if math.isnan(item.before) else item.before,
            "band_after": "" if math.isnan(item.after) else item.after,
            "reason": item.reason,
        }
        for number, (item, name) in enumerate(zip(planned, names, strict=True), start=1)
    ]
