"""Test planning: records within the limits of a rig that reduce the uncertainty of a damper most.

Records are added in sequence, each time the one that reduces the mean variance of the force over the envelope most for
its rig time. The variance is that of the prediction interval, by the parameters and by the distance from the tests.
Each session has its own gain and offset, so the tenth record of a session has less information than the first of the
next; but a session takes set-up time, and the number of sessions is optimised, too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain, count, pairwise, takewhile

import numpy as np
from numpy.typing import NDArray

from mrdamper.dampers.base import Damper
from mrdamper.dampers.prediction import Prediction
from mrdamper.dampers.slopes import force_slopes
from mrdamper.dampers.uncertainty import Uncertainty
from mrdamper.data import Condition, Floats
from mrdamper.data.progress import Progress, silent
from mrdamper.errors import InputError, UnknownNameError, numbers, validate_arguments
from mrdamper.identification.intervals import student
from mrdamper.physics.motion import sine
from mrdamper.statistics.linear import positive
from mrdamper.study.distance_variance import DISTANCES, distance_variance
from mrdamper.study.limits import Limits
from mrdamper.study.proposal import Proposal

_SAMPLES = 24  # independent samples per cycle; model error leaves fewer than a rig records
_DRAWS = 2  # of the parameters, beside the estimate
_NEARER = (1.0, 0.5, 0.25, 0.125, 0.0)  # factors of a draw that are tried until the model has a force
_MIN_ERROR_RATIO = 0.01  # of half the peak-to-peak force: smallest error of a record
_MIN_SESSION_GAIN = 1e-4  # standard deviation of the gain between sessions, at least [-]
_MIN_SESSION_OFFSET = 1e-3  # the same of the offset, over half the peak-to-peak force
_PRIOR_LOG_DEVIATION = 1.0  # standard deviation of the logarithm of a parameter that no run determines
_LEVEL = 0.9  # of bands
_SEED = 20240813


@validate_arguments("hours")
def plan_tests(
    damper: Damper,
    limits: Limits | None = None,
    hours: float = 1.0,
    about: str | Condition | None = None,
    progress: Progress = silent,
) -> tuple[list[Proposal], ExperimentDesign]:
    """Choose the records that reduce an uncertainty most, in the order to run them.

    Parameters
    ----------
    damper : Damper
        With its covariance.
    limits : Limits, optional
        Default: the ranges of the tests, `mrdamper.study.limits.Limits.of(damper)`.
    hours : float
        Rig time, including set-up of sessions.
    about : str, Condition or None
        The uncertainty to reduce: of a parameter, of the force at a condition, or over the limits.
    progress : callable
        Called with the step and the share done, 0...1.

    Raises
    ------
    InputError
        E_CERTAINTY without a covariance; E_LIMITS if no record fits into the hours or the limits.
    UnknownNameError
        If the damper has no such parameter.

    Examples
    --------
    >>> from importlib.resources import files
    >>> from mrdamper import load_model, plan_tests
    >>> damper = load_model(files("mrdamper.data.bundled") / "models/labcontrol.json")
    >>> proposals, _ = plan_tests(damper, hours=0.5)
    >>> len(proposals) > 0
    True
    """
    (hours,) = numbers(hours)
    limits = limits or Limits.of(damper)
    conditions = limits.candidates(hours)
    reckoning = ExperimentDesign.of(damper, limits, conditions, about, progress)
    progress("choosing records", 0.9)
    return reckoning.proposals(reckoning.chosen(hours)), reckoning


Sessions = list[list[int]]  # conditions of each session, by index in the grid


@dataclass(frozen=True, eq=False)
class ExperimentDesign:
    """Information of records at a grid of C conditions on P parameters, session by session."""

    limits: Limits
    conditions: Sequence[Condition]
    names: tuple[str, ...]
    prior: Floats  # (P, P) precision of the parameters before any new record
    goal: Floats  # (P, P) weights of the parameters' variances in the variance to be reduced
    # (C, D, P + 2, P + 2) of each condition's derivatives by the numbers and by a session's gain and offset, over the
    # error of a sample, at D draws of the numbers
    grams: Floats
    session: Floats  # (2,) precision of the gain and the offset of a session not yet begun
    about: str  # the uncertainty to reduce, as text
    beside: float  # variance of the force in addition: unknown session and model error at tests
    # (3,) variances to be reduced by each of `DISTANCES`, after some records
    by_distance: Callable[[Sequence[int]], Floats] = lambda rows: np.zeros(len(DISTANCES))

    @classmethod
    def of(
        cls,
        damper: Damper,
        limits: Limits,
        conditions: Sequence[Condition],
        about: str | Condition | None = None,
        progress: Progress = silent,
    ) -> ExperimentDesign:
        """Of a damper with its covariance; raises as `plan_tests`."""
        uncertainty: Uncertainty | None = damper.uncertainty
        if uncertainty is None or not uncertainty.names:
            remedy = "study the tests again, or plan without a model"
            raise InputError("the model was saved without its uncertainty", remedy=remedy, code="E_CERTAINTY")
        # Parameters that no run determines have a wide prior: a factor, or a change of the whole force.
        unknown = [n for n in damper.fitted_parameters if n not in uncertainty.names and n not in uncertainty.one_sided]
        names = (*uncertainty.names, *unknown)
        slopes_of_draws: list[Floats] = []
        for number, condition in enumerate(conditions):
            progress(f"information of test {number + 1} of {len(conditions)}", 0.9 * number / len(conditions))
            slopes_of_draws.append(_slopes(damper, uncertainty, names, condition))
        stacked = np.array(slopes_of_draws)  # (C, D, K, P + 2)
        doubt = stacked if not isinstance(about, Condition) else np.array([_slopes(damper, uncertainty, names, about)])
        by_number = doubt[..., : len(names)]
        goal = np.einsum("cdkp,cdkq->pq", by_number, by_number) / np.prod(doubt.shape[:3])
        logs = [damper.fitted_parameters[name].log for name in names]
        covariance = np.diag(np.where(logs, _PRIOR_LOG_DEVIATION**2, 1 / np.maximum(np.diag(goal), 1e-12)))
        covariance[: len(uncertainty.names), : len(uncertainty.names)] = uncertainty.covariance
        if isinstance(about, str):
            if about not in names:
                raise UnknownNameError.of("number to plan for", about, names)
            own = damper.fitted_parameters[about]
            goal = np.zeros_like(goal)
            goal[names.index(about), names.index(about)] = 1 if own.log else 1 / (own.value or 1.0) ** 2
        grams = np.einsum("cdkp,cdkq->cdpq", stacked, stacked) / max(uncertainty.force, _MIN_ERROR_RATIO) ** 2
        half = 1 / float(np.mean(stacked[..., -1]))
        least = (_MIN_SESSION_GAIN, _MIN_SESSION_OFFSET * half)
        session = np.maximum((uncertainty.total_gain, uncertainty.total_offset), least) ** -2.0
        mean = np.mean(doubt[..., len(names) :] ** 2, axis=(0, 1, 2))
        beside = float(mean @ [uncertainty.total_gain**2, uncertainty.total_offset**2]) + uncertainty.force**2
        words = about if isinstance(about, str) else f"at {about}" if about else "over the envelope"
        precision = np.asarray(np.linalg.inv(positive(covariance)), dtype=float)
        between = [about] if isinstance(about, Condition) else [] if about else _with_currents_between(conditions)
        by_distance = distance_variance(damper, between, conditions, _LEVEL)
        return cls(limits, conditions, names, precision, goal, grams, session, words, beside, by_distance)

    @cached_property
    def minutes(self) -> Floats:
        """(C,) rig time of a record at each condition."""
        return np.array([self.limits.minutes(condition) for condition in self.conditions])

    def information(self, sums: Floats) -> Floats:
        """(..., P, P) information of sessions on the parameters, with unknown gains and offsets."""
        size = len(self.names)
        own, cross = sums[..., size:, size:] + np.diag(self.session), sums[..., :size, size:]
        shared = cross @ np.linalg.solve(own, np.swapaxes(cross, -1, -2))
        return (sums[..., :size, :size] - shared).mean(axis=-3)

    def variance(self, precision: Floats) -> Floats:
        """(...) variance to be reduced, by the parameters."""
        return np.trace(np.linalg.solve(precision, np.broadcast_to(self.goal, precision.shape)), axis1=-2, axis2=-1)

    def precision(self, played: Sessions) -> Floats:
        """(P, P) precision of the parameters after some records."""
        return self.prior + sum(self.information(self.grams[rows].sum(axis=0)) for rows in played if rows)

    def spread(self, played: Sessions) -> float:
        """Return the standard deviation to be reduced, after some records."""
        by_distance = self.by_distance([*chain(*played)])
        return math.sqrt(self.variance(self.precision(played)) + by_distance.sum())

    def _by_distance_with(self, rows: Sequence[int], options: NDArray[np.intp]) -> Floats:
        """(N,) variance by distance after some records and each option."""
        return np.array([self.by_distance([*rows, option]).sum() for option in options.tolist()])

    def chosen(self, hours: float) -> Sessions:
        """Choose the records, and the number of sessions that reduces the variance most."""
        least = self.limits.opening + self.minutes.min()
        affordable = takewhile(lambda n: n <= self.limits.sessions and n * least <= 60 * hours, count(1))
        return min((self._exchanged(self._filled(n, hours)) for n in affordable), key=self.spread)

    def _filled(self, sessions: int, hours: float) -> Sessions:
        """Add records, each the one that lowers the variance most for its rig time, sessions in turn."""
        played: Sessions = [[] for _ in range(sessions)]
        sums = np.zeros((sessions, *self.grams.shape[1:]))
        information = np.zeros((sessions, *self.prior.shape))
        left = 60 * hours - sessions * self.limits.opening
        while True:
            at = min(range(sessions), key=lambda s: self.minutes[played[s]].sum())
            # Empty sessions reserve the time of their shortest record.
            free = left - self.minutes.min() * sum(not rows for i, rows in enumerate(played) if i != at)
            options = np.flatnonzero(self.minutes <= free * (1 + 1e-12))
            if not options.size:
                return played
            total = self.prior + information.sum(axis=0)
            then = self.information(sums[at] + self.grams[options])
            rows = [*chain(*played)]
            before = self.variance(total) + self.by_distance(rows).sum()
            after = self.variance(total - information[at] + then) + self._by_distance_with(rows, options)
            best = int(np.argmax((before - after) / self.minutes[options]))
            played[at].append(int(options[best]))
            sums[at] += self.grams[options[best]]
            information[at], left = then[best], left - self.minutes[options[best]]

    def _exchanged(self, played: Sessions) -> Sessions:
        """Exchange each record for the one that lowers the variance most and takes no longer."""
        for rows in played:
            others = self.precision([other for other in played if other is not rows])
            for k, now in enumerate(rows):
                options = np.flatnonzero(self.minutes <= self.minutes[now])
                left = rows[:k] + rows[k + 1 :]
                sums = self.grams[left].sum(axis=0) + self.grams[options]
                remaining = [*left, *chain(*(other for other in played if other is not rows))]
                after = self.variance(others + self.information(sums)) + self._by_distance_with(remaining, options)
                rows[k] = int(options[np.argmin(after)])
        return played

    def proposals(self, played: Sessions) -> list[Proposal]:
        """Return the records with the standard deviation before and after each, session by session."""
        proposals: list[Proposal] = []
        before, so_far = self.spread([]), [list[int]() for _ in played]
        today, first = np.sqrt(np.diag(np.linalg.inv(self.prior))), self.by_distance([])
        by_distance = first
        for session, rows in enumerate(played):
            for i in rows:
                so_far[session].append(i)
                after, last, by_distance = self.spread(so_far), by_distance, self.by_distance([*chain(*so_far)])
                then = np.sqrt(np.diag(np.linalg.inv(self.precision(so_far)))) / today
                best, nearer = int(np.argmin(then)), int(np.argmax(last - by_distance))
                what, share = f"standard error of {self.names[best]}", then[best]
                if (last - by_distance).sum() > (before**2 - after**2) / 2:
                    what, share = f"model error {DISTANCES[nearer]}", math.sqrt(by_distance[nearer] / first[nearer])
                reason = f"{what} falls to {100 * share:.0f} % of today's"
                proposals.append(
                    Proposal(session + 1, self.conditions[i], float(self.minutes[i]), reason, before, after)
                )
                before = after
        return proposals

    def summary(self, proposals: Sequence[Proposal]) -> str:
        """State the standard deviation before and after as text."""
        before, after = proposals[0].before, proposals[-1].after
        if self.about in self.names:
            return f"standard error of {self.about} {_percent(before)} -> {_percent(after)} of its value"
        tests, total = (
            [f"±{_percent(student(_LEVEL, np.inf) * math.hypot(s, math.sqrt(more)))}" for s in (before, after)]
            for more in (0, self.beside)
        )
        return (
            f"{100 * _LEVEL:g} % prediction interval of the force {self.about}, relative to the peak force: "
            f"{tests[0]} -> {tests[1]} from the parameters and the distance from the tests; "
            f"{total[0]} -> {total[1]} with a future session and the model error at tests"
        )


def _percent(share: float) -> str:
    """Write a share as a percentage; over 100 %, the number itself means nothing."""
    return f"{100 * share:.1f} %" if share <= 1 else "over 100 % (not determined)"


def _with_currents_between(conditions: Sequence[Condition]) -> list[Condition]:
    """Add the currents in the middle between neighbours, at each motion of the first current."""
    levels = sorted({c.current_A for c in conditions})
    motions = [c for c in conditions if c.current_A == levels[0]]
    return [*conditions, *(replace(c, current_A=(a + b) / 2) for a, b in pairwise(levels) for c in motions)]


def _slopes(damper: Damper, uncertainty: Uncertainty, names: Sequence[str], condition: Condition) -> Floats:
    """(D, K, P + 2) derivatives over half the peak-to-peak force: by the parameters, by a gain, by an offset [N].

    A draw at which the model has no force (a rate of the current far beyond its estimate) is moved nearer to the
    estimate.
    """
    rng = np.random.default_rng(_SEED)
    root = np.linalg.cholesky(positive(uncertainty.covariance))
    slopes: list[Floats] = []
    for draw in range(_DRAWS + 1):
        shift = 0.5 * root @ rng.standard_normal(len(uncertainty.names)) * (draw > 0)
        for share in _NEARER:
            try:
                with np.errstate(over="ignore"):
                    slopes.append(_slopes_at(share * shift, damper, uncertainty, names, condition))
                break
            except InputError:
                if share == 0:
                    raise
    return np.array(slopes)


def _slopes_at(
    shift: Floats, damper: Damper, uncertainty: Uncertainty, names: Sequence[str], condition: Condition
) -> Floats:
    """(K, P + 2) these derivatives with the parameters moved by (P,) a shift."""
    motion, last = sine(condition, 2, 4 * _SAMPLES), slice(-4 * _SAMPLES, None, 4)
    own, steps = damper.fitted_parameters, zip(uncertainty.names, shift.tolist(), strict=True)
    drawn = damper.with_parameters({name: own[name].moved(step) for name, step in steps})
    base = Prediction(motion, drawn.force_along(motion, condition), condition, ())
    force = base.force[last]
    half = float(np.ptp(force) / 2) or 1.0
    return np.column_stack([force_slopes(drawn, base, names)[last], force, np.ones(force.size)]) / half


def least_informative_runs(damper: Damper, least: int = 3) -> list[tuple[str, float]]:
    """Return the runs that carry least information on the parameters of a damper, each with its share."""
    uncertainty = damper.uncertainty
    shares = sorted(uncertainty.information.items(), key=lambda item: item[1]) if uncertainty else []
    return shares[:least] if len(shares) > least else []
