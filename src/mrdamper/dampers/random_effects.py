"""Gains and offsets that differ between sessions and between runs, estimated from what a fit leaves over.

A measured force is (1 + g + h) F + o + p and a remainder: g and o are those of its session, h and p those of the
run. Their four variances follow from quadratic statistics of the gains and offsets that the residuals of each run
show, less what noise shows, with the share counted that the fit has absorbed [Rao 1971; Searle, Casella and
McCulloch 1992, Variance Components, chapter 5]. A variance is not negative (non-negative least squares), and one of
which the fit has absorbed nearly everything is not estimated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrdamper.dampers.run_residuals import RunResiduals
from mrdamper.data import SESSIONS_NEEDED, Floats
from mrdamper.statistics.linear import nonnegative_least_squares

_MIN_RETAINED = 0.05  # share of a variance that the fit must have left in the residuals for it to be estimated
_MAX_CONDITION = 100.0  # condition number of the moment equations; beyond, runs and sessions are not separated
_DRAWS, _ROUNDS, _SEED = 600, 4, 20240813  # draws of gains and offsets; rounds of weights, as in the joint fit
_MIN_ERROR_PP = 1e-3  # nrmse_pp below which a run gains no more weight, as in the joint fit


@dataclass(frozen=True)
class Effects:
    """Standard deviations of gains and offsets; zero degrees of freedom where these runs cannot show them.

    Attributes
    ----------
    gain, offset : float
        Between sessions, of the force as a share and as a shift [N].
    session_dof : float
    run_gain, run_offset : float
        Between runs of one session [-] and [N].
    run_dof : float
    """

    gain: float = 0.0
    offset: float = 0.0
    session_dof: float = 0.0
    run_gain: float = 0.0
    run_offset: float = 0.0
    run_dof: float = 0.0


@dataclass(frozen=True, eq=False)
class Draws:
    """Draws of gains and offsets, and fits to them.

    Attributes
    ----------
    shifts : (D, R, 2) array
        Gains and offsets of the runs [-, N].
    moved : (D, P) array
        Change of the parameters.
    shown : (D, P) array
        Variance of the parameters that the residuals of a draw would show, over that of the draws.
    """

    shifts: Floats
    moved: Floats
    shown: Floats


@dataclass(frozen=True, eq=False)
class _Component:
    """Variance of gains (0) or offsets (1) shared by groups of runs.

    Attributes
    ----------
    which : int
    members : (K, R) array or None
        One where a run belongs to a group; None where every run is a group of its own.
    """

    which: int
    members: Floats | None

    def sums(self, table: Floats) -> Floats:
        """Return sums of the rows (R, ·) of each group."""
        return table if self.members is None else self.members @ table

    @property
    def sizes(self) -> Floats | float:
        """Runs of each group, as a column."""
        return 1.0 if self.members is None else np.maximum(self.members.sum(axis=1, keepdims=True), 1.0)


class GainsAndOffsets:
    """Gains and offsets of runs as the residuals of a fit show them.

    Parameters
    ----------
    runs : sequence of RunResiduals, length R
    slopes : sequence of (N, P) arrays
        Derivatives of the force by the parameters at the samples of each run.
    influence : sequence of (P, N) arrays
        Change of the parameters by a change of each residual [per N].
    """

    def __init__(self, runs: Sequence[RunResiduals], slopes: Sequence[Floats], influence: Sequence[Floats]):
        self.runs, self.slopes = runs, slopes
        self.unit = float(np.median([np.ptp(run.predicted) / 2 for run in runs])) or 1.0  # of offsets [N]
        count = len(runs)
        tables = [np.column_stack([r.predicted, np.full(r.picked.size, self.unit)]) for r in runs]
        self.effect = -np.concatenate([i @ t for i, t in zip(influence, tables, strict=True)], axis=1)  # (P, 2R)
        self._shown = np.zeros((2 * count, 2 * count))  # what each gain and offset shows as in every run
        self._read, self._noise = np.zeros(2 * count), np.zeros(2 * count)
        for k, (run, slope, table) in enumerate(zip(runs, slopes, tables, strict=True)):
            own, solve = slice(2 * k, 2 * k + 2), np.linalg.pinv(run.weighted(table)) * run.weight
            self._read[own] = solve @ run.residual
            self._shown[own] = solve @ slope @ self.effect
            self._shown[own, own] += solve @ table
            rest = run.residual - table @ self._read[own]
            self._noise[own] = np.sum(solve**2, axis=1) * float(np.average(rest**2, weights=run.weight**2))
        names = sorted({run.session for run in runs if run.session is not None})
        members = [[k for k, run in enumerate(runs) if run.session == name] for name in names]
        self.sessions = members if len(names) >= SESSIONS_NEEDED else []

    def effects(self) -> Effects:
        """Return the four standard deviations and the degrees of freedom behind them."""
        single = [[k] for k in range(len(self.runs))]
        between, within = self._pair(self.sessions), self._pair(single)
        if not between or self._dof(between[0], len(self.sessions)) < 1:
            between = []
        if not within:
            return self._solved(between, [])
        if between and self._condition([*between, *within]) > _MAX_CONDITION:
            within = []  # sessions of one run each: all scatter is counted as that between sessions
        return self._solved(between, within)

    def by_gains(self) -> Floats:
        """(P,) change of the parameters by the gains and offsets that the residuals show."""
        return self.effect @ np.linalg.lstsq(self._shown, self._read, rcond=_MIN_RETAINED)[0]

    def rests(self) -> list[Floats]:
        """Return what is left of the residuals of each run after all gains and offsets, and what they moved."""
        rests, by_gains = list[Floats](), self.by_gains()
        for run, slope in zip(self.runs, self.slopes, strict=True):
            rest, table = run.residual - slope @ by_gains, np.column_stack([run.predicted, np.ones(run.picked.size)])
            own = run.weighted(table)
            rests.append(rest - table @ np.linalg.lstsq(own, rest * run.weight, rcond=None)[0])
        return rests

    def draws(self, effects: Effects) -> Draws:
        """Draw gains and offsets, and fit each draw as the runs were: linearised, weights and parameters in turn.

        The fit counts a run less the worse it is described, so a run far off moves the parameters less than its gain
        would say.
        """
        rng, count = np.random.default_rng(_SEED), len(self.runs)
        drawn = rng.standard_normal((_DRAWS, count, 2)) * [effects.run_gain, effects.run_offset]
        shared = rng.standard_normal((_DRAWS, len(self.sessions), 2)) * [effects.gain, effects.offset]
        for k, members in enumerate(self.sessions):
            drawn[:, members] += shared[:, k : k + 1]
        moved, read = self._refitted(drawn)
        by_run = self.effect.reshape(len(self.effect), count, 2)
        shares: list[Floats] = []
        for members, spreads in (
            (self.sessions, (effects.gain, effects.offset / self.unit)),
            ([[k] for k in range(count)], (effects.run_gain, effects.run_offset / self.unit)),
        ):
            for which, spread in enumerate(spreads):
                sums = [by_run[:, group, which].sum(axis=1) * spread for group in members]
                shares.append(np.sum(np.square(sums), axis=0) if sums else np.zeros(len(self.effect)))
        total = np.maximum(np.sum(shares, axis=0), np.finfo(float).tiny)
        return Draws(drawn, moved, self._variances_over(read, effects) @ (np.array(shares) / total))

    def _variances_over(self, read: Floats, effects: Effects) -> Floats:
        """(D, 4) variances that draws of readings (D, R, 2) would show, over those they were drawn with."""
        drawn_with = (effects.gain, effects.offset / self.unit, effects.run_gain, effects.run_offset / self.unit)
        between, within = self._pair(self.sessions), self._pair([[k] for k in range(len(self.runs))])
        used = [
            (i, c) for i, c in enumerate([*(between or [None] * 2), *within]) if c is not None and drawn_with[i] > 0
        ]
        shown = np.ones((len(read), 4))
        if not used:
            return shown
        own = np.array([self._moment(c, c) for _, c in used])
        squares = [np.sum(c.sums(read[:, :, c.which].T) ** 2 / c.sizes, axis=0) for _, c in used]
        right = np.column_stack(squares) / own
        table = self._equations([c for _, c in used])
        solved = np.linalg.solve(table, right.T).T
        for row in np.flatnonzero((solved < 0).any(axis=1)):
            solved[row] = nonnegative_least_squares(table, right[row])[0]
        shown[:, [i for i, _ in used]] = solved / np.square([drawn_with[i] for i, _ in used])
        return shown

    def _pair(self, groups: Sequence[Sequence[int]]) -> list[_Component]:
        """Gain and offset shared by groups of runs; empty unless the residuals still show the gain."""
        table = None
        if len(groups) < len(self.runs):
            table = np.zeros((len(groups), len(self.runs)))
            for k, members in enumerate(groups):
                table[k, members] = 1.0
        components = [_Component(which, table) for which in (0, 1)]
        return components if groups and self._retained(components[0]) >= _MIN_RETAINED else []

    def _read_by(self, statistic: _Component, component: _Component) -> Floats:
        """(J, K) effects of the groups of a component on a statistic: sums of groups over the root of their size."""
        block = self._shown[statistic.which :: 2, component.which :: 2]
        return statistic.sums(component.sums(block.T).T) / np.sqrt(statistic.sizes)

    def _moment(self, statistic: _Component, component: _Component) -> float:
        return float(np.sum(self._read_by(statistic, component) ** 2))

    def _retained(self, component: _Component) -> float:
        """Share of a component's variance that the fit has left."""
        count = len(self.runs) if component.members is None else float(component.members.sum())
        return self._moment(component, component) / count

    def _excess(self, component: _Component) -> float:
        """Return the statistic of a component, less what noise alone gives it."""
        read, noise = (values[component.which :: 2, None] for values in (self._read, self._noise))
        return float(np.sum((component.sums(read) ** 2 - component.sums(noise)) / component.sizes))

    def _dof(self, component: _Component, count: int) -> float:
        """Degrees of freedom of a variance read by its statistic, at most one less than the groups it is of."""
        shown = self._read_by(component, component)
        gram = shown.T @ shown
        trace, square = float(np.trace(gram)), float(np.sum(gram**2))
        return min(trace**2 / square, count - 1.0)

    def _equations(self, components: Sequence[_Component]) -> Floats:
        """Return expectation of each statistic by each variance, every row over its own diagonal."""
        table = np.array([[self._moment(a, b) for b in components] for a in components])
        return table / np.maximum(np.diag(table), np.finfo(float).tiny)[:, None]

    def _condition(self, components: Sequence[_Component]) -> float:
        return float(np.linalg.cond(self._equations(components)))

    def _solved(self, between: Sequence[_Component], within: Sequence[_Component]) -> Effects:
        used = [c for c in (*between, *within) if self._retained(c) >= _MIN_RETAINED]
        if not used:
            return Effects()
        own = np.array([self._moment(c, c) for c in used])
        read = np.array([self._excess(c) for c in used])
        fitted, _ = nonnegative_least_squares(self._equations(used), read / own)
        variances: dict[int, float] = dict(zip(map(id, used), fitted.tolist(), strict=True))
        gain, offset = (float(np.sqrt(variances.get(id(c), 0.0))) for c in between) if between else (0.0, 0.0)
        run_gain, run_offset = (float(np.sqrt(variances.get(id(c), 0.0))) for c in within) if within else (0.0, 0.0)
        return Effects(
            gain, offset * self.unit, self._dof(between[0], len(self.sessions)) if between else 0.0,
            run_gain, run_offset * self.unit, self._dof(within[0], len(self.runs)) if within else 0.0,
        )  # fmt: skip

    def _refitted(self, shift: Floats) -> tuple[Floats, Floats]:
        """(D, P) parameters, and the gains and offsets (D, R, 2) that residuals show, by draws (D, R, 2) of them."""
        size, count = self.slopes[0].shape[1], len(self.runs)
        grams, rest = np.empty((count, size + 2, size + 2)), np.empty(count)
        for i, (run, slope) in enumerate(zip(self.runs, self.slopes, strict=True)):
            table = np.column_stack([slope, run.predicted, np.ones(run.picked.size)])
            each = run.weight * np.sqrt(run.error) / run.information  # whose squares add up to the error's
            table: Floats = table * each[:, None]
            residual: Floats = run.residual * each
            grams[i] = table.T @ table
            own = table[:, size:]
            rest[i] = np.sum((residual - own @ np.linalg.lstsq(own, residual, rcond=None)[0]) ** 2)
        pulls = np.einsum("rpk,drk->drp", grams[:, :size, size:], shift)
        information = np.array([run.information**2 for run in self.runs])
        moved, weight = np.zeros((len(shift), size)), np.ones((len(shift), count))
        for _ in range(_ROUNDS):
            pull = weight * information
            normal: Floats = np.einsum("dr,rpq->dpq", pull, grams[:, :size, :size])
            unit: Floats = np.sqrt(np.einsum("dpp->dp", normal))
            right: Floats = np.einsum("dr,drp->dp", pull, pulls) / unit
            moved = np.linalg.solve(normal / unit[:, :, None] / unit[:, None, :], right[:, :, None])[:, :, 0] / unit
            left = np.concatenate([np.broadcast_to(moved[:, None, :], (len(shift), count, size)), -shift], axis=2)
            squares = np.einsum("drp,rpq,drq->dr", left, grams, left, optimize=True) + rest
            weight = 1 / np.maximum(np.sqrt(np.maximum(squares, 0)), _MIN_ERROR_PP)
        own = np.linalg.solve(grams[:, size:, size:], grams[:, size:, :size])
        return moved, (np.einsum("rkp,dp->drk", own, moved) - shift) / [1.0, self.unit]
