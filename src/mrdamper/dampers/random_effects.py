"""Gains and offsets that differ between sessions and between runs, estimated from the residuals of a fit.

A measured force is (1 + g + h) F + o + p and a remainder: g and o are those of its session, h and p those of the
run. Their four variances follow from quadratic forms of the gains and offsets that the residuals of each run show, of
least variance at the variances themselves, which are iterated (MINQUE; for normal effects the end is that of
restricted maximum likelihood) [Rao 1971, J. Multivar. Anal. 1, 445; Searle, Casella and McCulloch 1992, Variance
Components, chapters 6 and 11]. A variance is not negative (non-negative least squares), and one of which the fit has
absorbed nearly everything is not estimated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mrdamper.dampers.concatenated_runs import MIN_ERROR_PP
from mrdamper.dampers.run_residuals import RunResiduals
from mrdamper.data import Floats, session_groups
from mrdamper.data.arrays import blocks
from mrdamper.statistics.linear import nonnegative_least_squares

_MIN_RETAINED = 0.05  # share of a variance that the fit must have left in the residuals for it to be estimated
_MAX_CONDITION = 100.0  # condition number of the equations; beyond, runs and sessions are not separated
_ITERATIONS = 4  # of the variances at which the quadratic forms are of least variance
_MAX_SHOWN = 128  # gains and offsets up to which those of draws are iterated: time grows with the cube of their number
_MIN_SHARE = 1e-4  # of the largest variance, with which every other one counts in these forms
_DRAWS, _ROUNDS, _SEED = 600, 4, 20240813  # draws of gains and offsets; rounds of weights, as in the joint fit
_DRAWS_PER_BLOCK = 40  # draws whose matrices fit the processor's cache
_EXCHANGES = 3  # rounds in which each of some representative draws is exchanged


@dataclass(frozen=True)
class Effects:
    """Standard deviations of gains and offsets; zero degrees of freedom if these runs do not determine them."""

    # gain and offset: between sessions, of the force as a share and as a shift [N]
    gain: float = 0.0
    offset: float = 0.0
    session_dof: float = 0.0
    # run_gain and run_offset: between runs of one session [-] and [N]
    run_gain: float = 0.0
    run_offset: float = 0.0
    run_dof: float = 0.0


@dataclass(frozen=True, eq=False)
class Draws:
    """Draws of gains and offsets, and fits to them."""

    shifts: Floats  # (D, R, 2) gains and offsets of the runs [-, N]
    moved: Floats  # (D, P) change of the parameters
    shown: Floats  # (D, P) variance of the parameters by the residuals of a draw, over that of the draws

    def representative(self, count: int) -> NDArray[np.intp]:
        """Draws of which the mean change is near zero and the mean square near that of all, by exchanges.

        Sixteen draws at random may be a third larger or smaller than all.
        """
        unit: Floats = self.moved / np.maximum(np.sqrt(np.mean(self.moved**2, axis=0)), np.finfo(float).tiny)
        table = np.concatenate([unit, unit**2 - 1], axis=1)
        chosen = np.arange(count)
        for at in [*range(count)] * _EXCHANGES:
            others = table[np.delete(chosen, at)].sum(axis=0)
            chosen[at] = np.argmin(np.sum((others + table) ** 2, axis=1))
        return chosen


class GainsAndOffsets:
    """Gains and offsets of R runs from the residuals of a fit.

    `slopes`: (N, P) derivatives of the force by the parameters at the samples of each run; `influence`: (P, N) changes
    of the parameters by a change of each residual [per N].
    """

    def __init__(self, runs: Sequence[RunResiduals], slopes: Sequence[Floats], influence: Sequence[Floats]):
        self.runs, self.slopes = runs, slopes
        self.unit = float(np.median([np.ptp(run.predicted) / 2 for run in runs])) or 1.0  # of offsets [N]
        count = len(runs)
        tables = [np.column_stack([r.predicted, np.full(r.picked.size, self.unit)]) for r in runs]
        self.effect = -np.concatenate([i @ t for i, t in zip(influence, tables, strict=True)], axis=1)  # (P, 2R)
        self._shown = np.zeros((2 * count, 2 * count))  # effect of each gain and offset on the residuals of every run
        self._read, self._noise = np.zeros(2 * count), np.zeros(2 * count)
        for k, (run, slope, table) in enumerate(zip(runs, slopes, tables, strict=True)):
            own, solve = slice(2 * k, 2 * k + 2), np.linalg.pinv(run.weighted(table)) * run.weight
            self._read[own] = solve @ run.residual
            self._shown[own] = solve @ slope @ self.effect
            self._shown[own, own] += solve @ table
            rest = run.residual - table @ self._read[own]
            self._noise[own] = np.sum(solve**2, axis=1) * float(np.average(rest**2, weights=run.weight**2))
        self.sessions = session_groups(run.session for run in runs)
        turned, sizes, _ = np.linalg.svd(self._shown)
        self._turned = turned[:, sizes > _MIN_RETAINED].T  # to the part that the fit has not absorbed

    def _groups(self, component: int) -> Floats:
        """(2R, G) gains or offsets of the runs by those of sessions (components 0 and 1) or of runs (2 and 3)."""
        groups = self.sessions if component < 2 else [[k] for k in range(len(self.runs))]
        table = np.zeros((len(self._shown), len(groups)))
        for k, members in enumerate(groups):
            table[2 * np.array(members) + component % 2, k] = 1.0
        return table

    @cached_property
    def _designs(self) -> dict[int, Floats]:
        """(K, G) gains and offsets of the residuals by one unit of each effect, for each variance they determine."""
        tables = {component: self._groups(component) for component in range(4)}
        shown = {c: self._turned @ self._shown @ table for c, table in tables.items()}
        enough = {c: np.sum(shown[c] ** 2) >= _MIN_RETAINED * max(table.sum(), 1.0) for c, table in tables.items()}
        designs = {c: shown[c] for c in tables if enough[c] and enough[c - c % 2]}  # offsets only with gains
        if 0 in designs and 2 in designs:
            unit = [(z @ z.T).ravel() / np.linalg.norm(z @ z.T) for z in designs.values()]
            if np.linalg.cond(np.inner(unit, unit)) > _MAX_CONDITION:
                # Sessions of one run each: all scatter is counted as that between sessions.
                return {c: design for c, design in designs.items() if c < 2}
        return designs

    def _variances(self, shown: Floats, assumed: Floats, noise: float = 1.0) -> tuple[Floats, Floats]:
        """Estimate variances (D, C), none negative, by quadratic forms of least variance at assumed variances.

        `shown` (D, K): gains and offsets of the residuals, with a share `noise` of their noise; `assumed`: (D, C) or
        (1, C), no row zero. Returns the inner products (D, G, G) Zᵀ V⁻¹ Z of the effects, too.
        """
        designs = list(self._designs.values())
        whole, first = np.hstack(designs), np.cumsum([0, *(z.shape[1] for z in designs[:-1])])
        own: Floats = self._turned * self._noise @ self._turned.T
        least = _MIN_SHARE * assumed.max(axis=1, keepdims=True)
        covariance = own + np.multiply.outer(_MIN_SHARE * least[:, 0], np.eye(len(own)))
        covariance = covariance + np.tensordot(np.maximum(assumed, least), [z @ z.T for z in designs], 1)
        turned = np.linalg.solve(covariance, whole).astype(float, copy=False)
        inner: Floats = whole.T @ turned
        table = np.add.reduceat(np.add.reduceat(inner**2, first, axis=1), first, axis=2)
        by_noise = np.add.reduceat(np.sum(turned * (own @ turned), axis=1), first, axis=1) if noise else 0.0
        forms = np.add.reduceat((shown[:, None, :] @ turned)[:, 0] ** 2, first, axis=1)
        size: Floats = np.sqrt(np.einsum("dcc->dc", table))
        table: Floats = table / size[:, :, None] / size[:, None, :]
        right: Floats = (forms - noise * by_noise) / size
        solved = np.linalg.solve(table, right[:, :, None])[:, :, 0].astype(float)
        table = np.broadcast_to(table, (len(solved), *table.shape[1:]))
        for i in np.flatnonzero((solved < 0).any(axis=1)):
            solved[i] = nonnegative_least_squares(table[i], right[i])[0]
        return solved / size, inner

    def _iterated(self, shown: Floats, noise: float = 1.0) -> Floats:
        """(D, C) variances, iterated from equal ones, of the gains and offsets of residuals (D, K)."""
        estimates = np.tile(np.mean(shown**2, axis=1)[:, None], len(self._designs))
        for _ in range(_ITERATIONS):
            some = np.flatnonzero(estimates.any(axis=1))
            for part in (some[rows] for rows in blocks(some.size, _DRAWS_PER_BLOCK)):
                estimates[part] = self._variances(shown[part], estimates[part], noise)[0]
        return estimates

    def effects(self) -> Effects:
        """Return the four standard deviations and their degrees of freedom."""
        used, shown = list(self._designs), (self._turned @ self._read)[None]
        variances, dof = np.zeros((2, 4))
        if not used or not (fitted := self._iterated(shown)).any():
            return Effects()
        variances[used], inner = fitted[0], self._variances(shown, fitted)[1]
        begin = 0
        for c in used:  # Satterthwaite of a form
            end = begin + self._designs[c].shape[1]
            product = inner[0, begin:end, begin:end] @ inner[0, begin:end, begin:end]
            count = len(self.sessions) if c < 2 else len(self.runs)
            dof[c], begin = min(np.trace(product) ** 2 / np.sum(product * product.T), count - 1.0), end
        gain, offset, run_gain, run_offset = (np.sqrt(variances) * [1.0, self.unit, 1.0, self.unit]).tolist()
        return Effects(gain, offset, float(dof[0]), run_gain, run_offset, float(dof[2]))

    def by_gains(self) -> Floats:
        """(P,) change of the parameters by the gains and offsets of the residuals."""
        return self.effect @ np.linalg.lstsq(self._shown, self._read, rcond=_MIN_RETAINED)[0]

    @cached_property
    def rests(self) -> list[Floats]:
        """Residuals of each run without gains and offsets, and without their effect on the parameters."""
        rests, by_gains = list[Floats](), self.by_gains()
        for run, slope in zip(self.runs, self.slopes, strict=True):
            rest, table = run.residual - slope @ by_gains, np.column_stack([run.predicted, np.ones(run.picked.size)])
            own = run.weighted(table)
            rests.append(rest - table @ np.linalg.lstsq(own, rest * run.weight, rcond=None)[0])
        return rests

    def draws(self, effects: Effects) -> Draws:
        """Draw gains and offsets, and fit each draw as the runs were: linearised, weights and parameters in turn.

        The fit weights a run less the larger its error, so an outlier changes the parameters less than in proportion to
        its gain.
        """
        rng, count = np.random.default_rng(_SEED), len(self.runs)
        drawn = rng.standard_normal((_DRAWS, count, 2)) * [effects.run_gain, effects.run_offset]
        shared = rng.standard_normal((_DRAWS, len(self.sessions), 2)) * [effects.gain, effects.offset]
        for k, members in enumerate(self.sessions):
            drawn[:, members] += shared[:, k : k + 1]
        return Draws(drawn, self._refitted(drawn), self._variances_over(drawn, effects))

    def _variances_over(self, drawn: Floats, effects: Effects) -> Floats:
        """(D, P) variances of the parameters that residuals of draws (D, R, 2) show, over those of the draws."""
        used = list(self._designs)
        roots = np.array([effects.gain, effects.offset / self.unit, effects.run_gain, effects.run_offset / self.unit])
        variances = np.square(roots)[used]
        if not variances.any():
            return np.ones((len(drawn), len(self.effect)))
        moved = np.array([np.sum((self.effect @ self._groups(c)) ** 2, axis=1) for c in used])
        read = (drawn / [1.0, self.unit]).reshape(len(drawn), -1) @ (self._turned @ self._shown).T
        if read.shape[1] > _MAX_SHOWN:
            estimates = self._variances(read, variances[None], noise=0.0)[0]
        else:
            estimates = self._iterated(read, noise=0.0)
        return estimates @ moved / np.maximum(variances @ moved, np.finfo(float).tiny)

    def _refitted(self, shift: Floats) -> Floats:
        """(D, P) parameters by draws of gains and offsets (D, R, 2)."""
        size, count = self.slopes[0].shape[1], len(self.runs)
        grams, rest = np.empty((count, size + 2, size + 2)), np.empty(count)
        for i, (run, slope, left) in enumerate(zip(self.runs, self.slopes, self.rests, strict=True)):
            table = np.column_stack([slope, run.predicted, np.ones(run.picked.size)])
            each = run.weight * np.sqrt(run.error) / run.information  # whose squares add up to the error's
            table: Floats = table * each[:, None]
            grams[i], rest[i] = table.T @ table, np.sum((left * each) ** 2)
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
            weight = 1 / np.maximum(np.sqrt(np.maximum(squares, 0)), MIN_ERROR_PP)
        return moved
