"""Likelihood of the parameters of a damper, and its profile along one parameter.

The likelihood is that of the score: the residuals projected on the derivatives at the estimate and
weighted by the covariance of the score, which contains noise, repeated model error and sessions. It
is greatest at the estimate, its curvature there is the inverse of the damper's covariance, and away
from it the model is evaluated in full, not linearised [Hansen 1982, Econometrica 50, 1029].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mrdamper.dampers.base import Damper
from mrdamper.dampers.concatenated_runs import concatenate
from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.dampers.run_residuals import RunResiduals, normal_matrix
from mrdamper.dampers.slopes import force_slopes
from mrdamper.dampers.uncertainty import Uncertainty
from mrdamper.data import Floats, Run
from mrdamper.errors import InputError
from mrdamper.physics.motion import Excitation
from mrdamper.statistics.linear import positive

CHI_SQUARED_95 = 3.84  # fall of twice the logarithm at which a 95 % interval ends: chi squared of one
_MEMORY_SAMPLES = 20  # samples before the scored ones, which contain a reversal
_PROFILE_POINTS, _PROFILE_RANGE = 12, 4.0  # points of a profile on each side, and its range in standard errors
_MAX_STEPS, _TOLERANCE = 12, 1e-3  # steps of the other parameters at one point; gain at which they end

Kind = Literal["bounded", "one-sided", "flat"]


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Minus twice the logarithm of the likelihood of a damper's parameters, zero at the estimate."""

    damper: Damper  # with its covariance
    names: tuple[str, ...]  # its parameters, including those at a bound
    start: Floats  # (P,) the estimate; logarithms where the damper uses them
    covariance: Floats  # (P, P)
    logs: tuple[bool, ...]
    bounds: Floats
    parts: tuple[RunResiduals, ...]
    instruments: Floats
    measured: Floats
    offset: Floats
    turned: Floats

    @classmethod
    def of(cls, damper: Damper, runs: Sequence[Run]) -> Likelihood:
        """Of the runs a damper was identified from; raises `InputError` (E_CERTAINTY) if they determine nothing."""
        whole = estimate_uncertainty(damper, runs, bounded=False)
        uncertainty: Uncertainty | None = whole.uncertainty
        if uncertainty is None or not uncertainty.names:
            raise InputError(
                "these runs determine no parameter of the damper",
                remedy="give the runs it was identified from",
                code="E_CERTAINTY",
            )
        names, numbers = uncertainty.names, damper.fitted_parameters
        parts = tuple(RunResiduals.of(damper, run) for run in runs)
        slopes = [force_slopes(damper, p.prediction, names)[p.picked] for p in parts]
        normal = normal_matrix(slopes, parts)
        root = np.linalg.cholesky(positive(normal @ uncertainty.covariance @ normal))
        rows = np.concatenate([p.weighted(p.weighted(s)) for s, p in zip(slopes, parts, strict=True)])
        instruments: Floats = np.asarray(np.linalg.solve(root, rows.T), dtype=float)
        measured = np.concatenate([p.predicted - p.residual for p in parts])
        # The remaining score by robust weights is part of the estimate; that by a bound is not.
        score = rows.T @ np.concatenate([p.residual for p in parts])
        score[[bool(numbers[name].at_bound) for name in names]] = 0.0
        logs = tuple(numbers[n].log for n in names)
        start = np.array(
            [np.log(numbers[n].value) if log else numbers[n].value for n, log in zip(names, logs, strict=True)]
        )
        bounds = np.array([_coordinates(numbers[n].bounds, log) for n, log in zip(names, logs, strict=True)])
        return cls(
            damper, names, start, uncertainty.covariance, logs, bounds, parts, instruments, measured,
            np.asarray(np.linalg.solve(root, score), dtype=float),
            np.asarray(np.linalg.solve(root, normal), dtype=float),
        )  # fmt: skip

    def score(self, point: Floats) -> Floats:
        """(P,) whitened score at a point; not finite outside the bounds."""
        if np.any(point < self.bounds[:, 0]) or np.any(point > self.bounds[:, 1]):
            return np.full(len(self.names), np.inf)
        values = {
            n: float(np.exp(u)) if log else float(u) for n, u, log in zip(self.names, point, self.logs, strict=True)
        }
        moved = self.damper.with_parameters(values)
        return self.instruments @ (self._force(moved) - self.measured) - self.offset

    def __call__(self, point: Floats) -> float:
        """Minus twice the logarithm at a point; infinite outside the bounds."""
        e = self.score(point)
        return float(e @ e) if np.all(np.isfinite(e)) else np.inf

    def _force(self, damper: Damper) -> Floats:
        model = damper.one_model
        if model is None or self._concatenated is None:
            return np.concatenate([damper.force_for(p.prediction)[p.picked] for p in self.parts])
        whole, picked, motion = self._concatenated
        return model.force(motion, model.state(whole)[picked])

    @cached_property
    def _concatenated(self) -> tuple[Excitation, NDArray[np.intp], Excitation] | None:
        """All runs in one motion, which is evaluated faster; None if the state does not decay between runs."""
        if self.damper.one_model is None or min(int(p.picked[0]) for p in self.parts) < _MEMORY_SAMPLES:
            return None
        motions = [self.damper.with_field_current(p.prediction.motion) for p in self.parts]
        begins = np.cumsum([0, *(len(m) for m in motions)])[:-1]
        picked = np.concatenate([p.picked + b for p, b in zip(self.parts, begins, strict=True)])
        whole = concatenate(motions)
        return whole, picked, whole.part(picked)


def _coordinates(bounds: tuple[float, float], log: bool) -> tuple[float, float]:
    if not log:
        return bounds
    low, high = bounds
    return (float(np.log(low)) if low > 0 else -np.inf), float(np.log(high))


@dataclass(frozen=True, eq=False)
class LikelihoodProfile:
    """Profile likelihood: the least misfit over all other parameters as one parameter varies."""

    name: str
    unit: str
    values: Floats  # (K,)
    fall: Floats  # (K,) minus twice the logarithm of the likelihood, over its least
    estimate: float
    interval: tuple[float, float]  # ends of the interval within which the fall is below 3.84; infinite on an open side
    kind: Kind


def profile(likelihood: Likelihood, name: str) -> LikelihoodProfile:
    """Compute the profile likelihood of a parameter; raises `InputError` (E_CERTAINTY) if the damper has none such."""
    own = likelihood.damper.fitted_parameters.get(name)
    if own is None:
        names = ", ".join(likelihood.damper.fitted_parameters)
        raise InputError(f"no number {name}", remedy=f"known: {names}", code="E_CERTAINTY")
    if name not in likelihood.names or name in (likelihood.damper.uncertainty or _NO_PARAMETERS).unknown:
        flat = np.array([own.value])
        return LikelihoodProfile(name, own.unit, flat, np.zeros(1), own.value, (-np.inf, np.inf), "flat")
    i = likelihood.names.index(name)
    error = float(np.sqrt(likelihood.covariance[i, i]))
    points, falls = [likelihood.start], [likelihood(likelihood.start)]
    for side in (-1.0, 1.0):
        at = likelihood.start
        for step in range(1, _PROFILE_POINTS + 1):
            u = likelihood.start[i] + side * error * _PROFILE_RANGE * step / _PROFILE_POINTS
            u = float(np.clip(u, *likelihood.bounds[i]))
            if not np.isfinite(u) or u == at[i]:
                break
            at, fall = _others(likelihood, i, u, at)
            points.append(at)
            falls.append(fall)
            if fall > 3 * CHI_SQUARED_95:
                break
    order = np.argsort([p[i] for p in points])
    us, fall = np.array(points)[order, i], np.array(falls)[order]
    fall = fall - fall.min()
    best = int(np.argmin(fall))
    low, high = _crossing(us[: best + 1][::-1], fall[: best + 1][::-1]), _crossing(us[best:], fall[best:])
    log = likelihood.logs[i]
    lower, upper = np.clip(np.exp([low, high]) if log else [low, high], *own.bounds).tolist()
    closed = int(np.isfinite(low)) + int(np.isfinite(high))
    kind: Kind = ("flat", "one-sided", "bounded")[closed]
    values = np.exp(us) if log else us
    return LikelihoodProfile(name, own.unit, values, fall, own.value, (lower, upper), kind)


_NO_PARAMETERS = Uncertainty((), (), np.zeros((0, 0)), np.zeros(0))


def _others(likelihood: Likelihood, held: int, value: float, start: Floats) -> tuple[Floats, float]:
    """Fit the other parameters with one held, by chord steps that are shortened where they overshoot."""
    free = np.arange(len(start)) != held
    solve = np.linalg.pinv(likelihood.turned[:, free])
    at = start.copy()
    at[free] -= np.linalg.lstsq(
        likelihood.turned[:, free], likelihood.turned[:, held] * (value - start[held]), rcond=None
    )[0]
    at[held] = value
    at = np.clip(at, likelihood.bounds[:, 0], likelihood.bounds[:, 1])
    e = likelihood.score(at)
    for _ in range(_MAX_STEPS):
        step, share, better = solve @ e, 1.0, None
        while share > 0.05:
            there = at.copy()
            there[free] -= share * step
            there = np.clip(there, likelihood.bounds[:, 0], likelihood.bounds[:, 1])
            moved = likelihood.score(there)
            if moved @ moved < e @ e:
                better = (there, moved)
                break
            share /= 3
        if better is None:
            break
        gain = float(e @ e - better[1] @ better[1])
        at, e = better
        if gain < _TOLERANCE:
            break
    return at, float(e @ e)


def _crossing(values: Floats, fall: Floats) -> float:
    """Find the value at which a fall first reaches `CHI_SQUARED_95` along a side; infinite if it does not."""
    over = np.flatnonzero(fall >= CHI_SQUARED_95)
    if not over.size or over[0] == 0:
        return float(np.sign(values[-1] - values[0]) or 1.0) * np.inf if not over.size else float(values[0])
    k = int(over[0])
    # The fall is nearly a parabola: linear in its root.
    root = np.sqrt(np.maximum(fall, 0))
    share = (np.sqrt(CHI_SQUARED_95) - root[k - 1]) / (root[k] - root[k - 1])
    return float(values[k - 1] + share * (values[k] - values[k - 1]))
