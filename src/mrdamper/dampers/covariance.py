"""Uncertainty of a damper from its runs: parameters, sessions, and model error."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.calibration import (
    QUANTITIES,
    Calibration,
    Growth,
    PredictedRun,
    StandardizedErrors,
    model_error,
    scatter_between_sessions,
    standardized,
)
from mrdamper.dampers.curvature import growth_by_curvature
from mrdamper.dampers.random_effects import Draws, Effects, GainsAndOffsets
from mrdamper.dampers.refits import refitted
from mrdamper.dampers.run_residuals import RunResiduals, normal_matrix
from mrdamper.dampers.slopes import force_slopes, relative_variances
from mrdamper.dampers.uncertainty import FittedParameter, Uncertainty
from mrdamper.data import Floats, Run, condition_groups
from mrdamper.identification.covariance import alike_groups, score_covariance
from mrdamper.identification.intervals import dof_of_quantile, interval_about, relative_width, student, weaknesses
from mrdamper.statistics.metrics import dissipated_power, peak_force

_MAX_RUN_SHARE = 0.6  # share of the information on a parameter from which one run mainly determines it
_MIN_EIGENVALUE = 1e-10  # of the largest of the scaled normal matrix, below which a direction is not determined
_REFITS = 16  # draws of gains and offsets that are fitted without linearisation
_SEED = 20261124  # of errors within the runs that are drawn beside those of sessions
# share of the information on a direction, and of the variance of the error of the form, that a fit without a condition
# has at least
_MIN_RETAINED = 0.05
_LEVEL = 0.95  # of the intervals by which a parameter is identifiable or not


def estimate_uncertainty(
    damper: Damper,
    runs: Sequence[Run],
    cross_validated: Sequence[PredictedRun] = (),
    held: Collection[str] = (),
    *,
    away: Sequence[PredictedRun] = (),
    other_sessions: Sequence[PredictedRun] = (),
    bounded: bool = True,
) -> Damper:
    """Return the damper with its uncertainty.

    `runs` are those it was identified from. The other runs were predicted by models identified without some of them.
    `cross_validated`, without their condition: the model error, and the calibration of prediction intervals; without
    them the residuals of the runs are used, uncalibrated. `away`, without their current or the fastest motions: how the
    error grows away from the tests. `other_sessions`, without their session: the scatter between sessions is not below
    theirs.

    `held` are parameters that ended at a limit of the search, inside their bounds. Parameters at a bound are held there
    if `bounded`; otherwise they count like the others. Raises `InputError` (E_CLOCK) if the clock of a session is no
    date.
    """
    if not damper.fitted_parameters or not runs:
        return damper
    parts = [RunResiduals.of(damper, run) for run in runs]
    numbers = damper.fitted_parameters
    at_bound = tuple(n for n, own in numbers.items() if bounded and (n.split(".")[0] in held or own.at_bound))
    free = [name for name in numbers if name not in at_bound]
    slopes = [force_slopes(damper, p.prediction, free)[p.picked] for p in parts]
    kept, unseen, alike, inverse = _determined(slopes, parts, len(free))
    conditions = [part.prediction.condition for part in parts]
    infinite = np.diag([np.inf if i in unseen else 1.0 for i in range(len(free))])
    words = weaknesses(free, infinite, alike, conditions)
    unknown = {free[i] for i in (*unseen, *(i for group in alike for i in group))}
    names = [free[i] for i in kept]
    # A parameter at its bound of zero has no size that its interval could be compared with.
    sized = {name for name in names if bounded or numbers[name].value}
    spread, wide = _identifiable(names, sized, numbers, parts, [s[:, kept] for s in slopes], inverse)
    spread = spread.curved(damper, parts)
    effects, samples = spread.effects, sum(part.picked.size for part in parts)
    uncertainty = Uncertainty(
        spread.names, tuple(numbers[n].log for n in spread.names), spread.covariance, spread.dof, at_bound,
        tuple(name for name in free if name in unknown | wide),
        effects.gain, effects.offset, effects.session_dof, effects.run_gain, effects.run_offset, effects.run_dof,
        words=(*words, *_rest_on_one_run(spread.names, parts, spread.information)),
        information=dict(zip([p.run.id for p in parts], _shares(spread.information), strict=True)),
        effective=spread.effective(samples), interval_factor=spread.interval_factor,
    )  # fmt: skip
    uncertainty = _with_model_error(uncertainty, damper, parts, spread.slopes, cross_validated, away, other_sessions)
    return replace(damper, uncertainty=uncertainty)


@dataclass(frozen=True, eq=False)
class _Spread:
    """Covariance of some parameters by its causes, and the share (R, P) each run has in their information.

    `within` is that by noise and model error, of relative variance `doubt`; `draws` are of gains and offsets.
    """

    names: tuple[str, ...]
    slopes: Sequence[Floats]
    within: Floats
    doubt: Floats
    draws: Draws
    effects: Effects
    rests: Sequence[Floats]
    textbook: Floats
    information: Floats
    wider: Floats | float = 1.0  # (P,) factor on changes by draws for what their linearisation omits

    @classmethod
    def of(
        cls, names: Sequence[str], parts: Sequence[RunResiduals], slopes: Sequence[Floats], inverse: Floats
    ) -> _Spread:
        weighted = [part.weighted(slope) for slope, part in zip(slopes, parts, strict=True)]
        influence = [inverse @ part.weighted(table).T for table, part in zip(weighted, parts, strict=True)]
        scatter = GainsAndOffsets(parts, slopes, influence)
        effects = scatter.effects()
        within, doubt = _within(parts, slopes, inverse, scatter.by_gains())
        left = sum(float(np.sum((part.residual * part.weight) ** 2)) for part in parts)
        squares = np.array([np.sum((table @ inverse) ** 2, axis=0) for table in weighted])
        return cls(
            tuple(names), slopes, within, doubt, scatter.draws(effects), effects, scatter.rests,
            left * np.diag(inverse), squares / np.maximum(squares.sum(axis=0), np.finfo(float).tiny),
        )  # fmt: skip

    def curved(self, damper: Damper, parts: Sequence[RunResiduals]) -> _Spread:
        """Widen the intervals by what the linearisation of the draws omits, of one model of a damper.

        Some draws are fitted without linearisation. Each interval is widened by the mean absolute change of its
        parameter in these fits over that in the linearised fits to the same draws, and never narrowed. One outlier
        would determine a mean square.
        """
        moved = self.draws.moved
        if damper.one_model is None or not moved.any():
            return self
        some = self.draws.representative(_REFITS)
        shifts = np.concatenate([np.zeros((1, len(parts), 2)), self.draws.shifts[some]])
        starts = np.concatenate([np.zeros((1, len(self.names))), moved[some]])
        fits = refitted(damper, parts, self.rests, self.names, shifts, starts)
        linear = np.maximum(np.mean(np.abs(moved[some]), axis=0), np.finfo(float).tiny)
        return replace(self, wider=np.maximum(np.mean(np.abs(fits[1:] - fits[0]), axis=0) / linear, 1.0))

    @cached_property
    def covariance(self) -> Floats:
        """(P, P) of the parameters, or of their logarithms, linearised.

        Correlated parameters lie on a curve of nearly the same force: a factor on one of them alone would increase the
        variance of the force.
        """
        return self.within + self.draws.moved.T @ self.draws.moved / len(self.draws.moved)

    @cached_property
    def quantiles(self) -> Floats:
        """(P,) share `_LEVEL` of errors of the draws, each over the standard error that its own residuals would show.

        The scatter of sessions that the residuals of a draw show depends on the gains that move its parameters: the
        ratio is not distributed as Student's [bootstrap-t: Hall 1988, Ann. Stat. 16, 927].
        """
        rng, moved, within = np.random.default_rng(_SEED), self.wider * self.draws.moved, np.diag(self.within)
        free = 2 / np.maximum(self.doubt, 1e-9)
        error = moved + np.sqrt(within) * rng.standard_normal(moved.shape)
        variance = within * rng.chisquare(free, moved.shape) / free + self.draws.shown * np.mean(moved**2, axis=0)
        ratio = np.abs(error) / np.sqrt(np.maximum(variance, np.finfo(float).tiny))
        return np.array([float(np.quantile(column, _LEVEL)) for column in ratio.T])

    @property
    def interval_factor(self) -> Floats:
        """(P,) factor on standard errors, above one for curved parameters.

        Below one where a normal interval would cover more than its share of the draws.
        """
        variance = np.maximum(np.diag(self.covariance), np.finfo(float).tiny)
        curved = np.diag(self.within) + self.wider**2 * np.mean(self.draws.moved**2, axis=0)
        return np.sqrt(curved / variance) * np.minimum(self.quantiles / student(_LEVEL, np.inf), 1.0)

    @property
    def dof(self) -> Floats:
        """(P,) degrees of freedom at which Student's interval holds its share of the draws."""
        return np.array([dof_of_quantile(float(q), _LEVEL) for q in self.quantiles])

    def effective(self, samples: int) -> dict[str, float]:
        """Return the independent samples of each parameter."""
        variance = np.maximum(self.interval_factor**2 * np.diag(self.covariance), np.finfo(float).tiny)
        return dict(zip(self.names, np.minimum(self.textbook / variance, samples).tolist(), strict=True))


def _identifiable(
    names: list[str],
    sized: Collection[str],
    own: Mapping[str, FittedParameter],
    parts: Sequence[RunResiduals],
    slopes: Sequence[Floats],
    inverse: Floats,
) -> tuple[_Spread, set[str]]:
    """Return the covariance of parameters whose intervals span less than three decades, and those whose do not.

    Parameters are held in sequence, the widest first, until the intervals of the others are bounded; all that were too
    wide are not identifiable. Curvature is not considered here.
    """
    wide: set[str] = set()
    while True:
        spread = _Spread.of(names, parts, slopes, inverse)
        errors: Floats = spread.interval_factor * np.sqrt(np.diag(spread.covariance))
        ends = [
            interval_about(own[n].value, float(e), float(d), _LEVEL, own[n].log, own[n].exponent)
            for n, e, d in zip(names, errors, spread.dof, strict=True)
        ]
        lost = [i for i, each in enumerate(ends) if each is None and names[i] in sized]
        if not lost:
            return spread, wide
        wide |= {names[i] for i in lost}
        widths = {i: relative_width(p.value, float(errors[i]), p.log, p.exponent) for i in lost if (p := own[names[i]])}
        worst = max(lost, key=widths.__getitem__)
        keep = [i for i in range(len(names)) if i != worst]
        names, slopes = [names[i] for i in keep], [slope[:, keep] for slope in slopes]
        inverse = _determined(slopes, parts, len(keep))[3]


def _determined(
    slopes: Sequence[Floats], parts: Sequence[RunResiduals], count: int
) -> tuple[list[int], list[int], list[list[int]], Floats]:
    """Columns to keep, those not determined, groups with the same effect, and the inverse normal matrix of the kept."""
    normal = normal_matrix(slopes, parts)
    keep: list[int] = [i for i in range(count) if normal[i, i] > 0]
    unseen, alike = [i for i in range(count) if i not in keep], list[list[int]]()
    while keep:
        scale = np.sqrt(np.diag(normal)[keep])
        values, vectors = np.linalg.eigh(normal[np.ix_(keep, keep)] / np.outer(scale, scale))
        if values[0] > _MIN_EIGENVALUE * values[-1]:
            return keep, unseen, alike, (vectors / values) @ vectors.T / np.outer(scale, scale)
        groups = alike_groups(vectors[:, values <= _MIN_EIGENVALUE * values[-1]])
        alike += [[keep[i] for i in group] for group, _ in groups]
        keep = [i for at, i in enumerate(keep) if at not in {one for _, one in groups}]
    return [], unseen, alike, np.zeros((0, 0))


def _shares(information: Floats) -> list[float]:
    """(R,) mean share of each run in the information on the parameters."""
    return information.mean(axis=1).tolist() if information.shape[1] else [0.0] * len(information)


def _rest_on_one_run(names: Sequence[str], parts: Sequence[RunResiduals], information: Floats) -> list[str]:
    """Parameters of which one run of several gives most of the information."""
    if len(parts) < 3:
        return []
    best = np.argmax(information, axis=0)
    return [
        f"{name} is determined mainly by run {parts[r].run.id} ({100 * information[r, i]:.0f} % of its information)"
        for i, (name, r) in enumerate(zip(names, map(int, best), strict=True))
        if information[r, i] > _MAX_RUN_SHARE
    ]


def _within(
    parts: Sequence[RunResiduals], slopes: Sequence[Floats], inverse: Floats, by_gains: Floats | float = 0.0
) -> tuple[Floats, Floats]:
    """Covariance by noise and model error within the runs, and its relative variance by parameter.

    The effect of gains and offsets of other runs on the parameters is no model error.
    """
    total, doubt = np.zeros_like(inverse), np.zeros(len(inverse))
    for part, slope in zip(parts, slopes, strict=True):
        for stretch in part.stretches:
            table = np.column_stack([stretch.predicted - stretch.predicted.mean(), np.ones(stretch.time.size)])
            even = part.evenly(slope, stretch)
            rest: Floats = stretch.residual - np.sum(even * by_gains, axis=1)
            rest -= table @ np.linalg.lstsq(table, rest, rcond=None)[0]
            own = inverse * stretch.weight**2  # parameters with an effect on this stretch
            score, dof, _ = score_covariance(even, rest, stretch.time, stretch.frequency, own)
            covariance = inverse @ score @ inverse * stretch.weight**4
            total += covariance
            doubt += np.diag(covariance) ** 2 * 2 / dof
    return total, doubt / np.maximum(np.diag(total), np.finfo(float).tiny) ** 2


def _inside(part: RunResiduals) -> PredictedRun:
    """Return a run and the force of the fit to all runs."""
    steady = part.stretches[0]
    measured = steady.predicted - steady.residual
    powers = [dissipated_power(f, steady.velocity, steady.time) for f in (measured, steady.predicted)]
    peak = np.array([peak_force(measured) / max(peak_force(steady.predicted), 1e-300)])
    energy = np.array([powers[0] / powers[1] if powers[1] else np.inf])
    return PredictedRun(part.run.id, part.session, steady.predicted, measured, peak, energy)


def _by_parameters(part: RunResiduals, slopes: Floats, covariance: Floats) -> Floats:
    """(3,) relative variances of a run's force, peak and energy by the parameters."""
    steady = part.stretches[0]
    even = part.evenly(slopes, steady)
    return relative_variances(even, covariance, steady.predicted, steady.velocity, steady.time)


@dataclass(frozen=True, eq=False)
class _WithoutCondition:
    """Variances of the prediction of a run by a fit without its condition."""

    by_parameters: Floats  # (3,) relative, of the force, the peak and the energy
    of_form: float  # over that of the error of the form


def _without_their_condition(
    parts: Sequence[RunResiduals], slopes: Sequence[Floats], covariance: Floats
) -> dict[str, _WithoutCondition]:
    """Return the variances of each run.

    Of N the normal matrix and N_c the share of a condition in it, these fits have (I - N⁻¹ N_c)⁻¹ of the covariance.
    Their error of the form is larger than that of the fit to all conditions: of independent errors of one variance, the
    residual of a point of leverage h has 1 - h, and that of a fit without the point 1 / (1 - h) [Cook and Weisberg
    1982, Residuals and Influence in Regression, section 2.2]. The leverage of a condition is taken along its force.
    """
    normal = normal_matrix(slopes, parts)
    scale = np.sqrt(np.diag(normal))
    values, vectors = np.linalg.eigh(normal / np.outer(scale, scale))
    root, back = vectors / np.sqrt(values) / scale[:, None], (vectors * np.sqrt(values)).T * scale
    sines = [part.prediction.condition if part.stretches[0].frequency is not None else None for part in parts]
    variances = dict[str, _WithoutCondition]()
    for fold in condition_groups(sines):
        tables = np.concatenate([parts[k].weighted(slopes[k]) for k in fold]) @ root
        force = np.concatenate([parts[k].weight * parts[k].predicted for k in fold])
        taken, axes = np.linalg.eigh(tables.T @ tables)
        without = root @ (axes / np.sqrt(np.maximum(1 - taken, _MIN_RETAINED))) @ axes.T @ back
        leverage = float(np.sum((force @ tables) ** 2) / np.maximum(force @ force, np.finfo(float).tiny))
        for k in fold:
            by_parameters = _by_parameters(parts[k], slopes[k], without @ covariance @ without.T)
            variances[parts[k].run.id] = _WithoutCondition(by_parameters, 1 / max(1 - leverage, _MIN_RETAINED))
    return variances


def _with_model_error(
    uncertainty: Uncertainty,
    damper: Damper,
    parts: Sequence[RunResiduals],
    slopes: Sequence[Floats],
    cross_validated: Sequence[PredictedRun],
    away: Sequence[PredictedRun],
    other_sessions: Sequence[PredictedRun],
) -> Uncertainty:
    """Model error after gain and offset of each run, and the calibration."""
    own = {
        part.run.id: _by_parameters(part, slope, uncertainty.covariance)
        for part, slope in zip(parts, slopes, strict=True)
    }
    shown = cross_validated or [_inside(part) for part in parts]
    error = model_error(shown)
    uncertainty = replace(uncertainty, force=error.force, peak=error.peak, energy=error.energy)
    if not cross_validated:
        return uncertainty
    if uncertainty.of_sessions and (scatter := scatter_between_sessions(other_sessions)):
        uncertainty = replace(uncertainty, gain=scatter[0], offset=scatter[1])
    # A fold with other runs of a session has absorbed part of its gain: the scatter about the mean remains.
    left = 1 - 1 / max(len({part.session for part in parts}), 1)
    of_sessions = {"gain": left * uncertainty.gain**2, "offset": left * uncertainty.offset**2}
    curvature = growth_by_curvature(damper, parts, slopes, uncertainty.names)
    uncertainty = replace(
        uncertainty,
        left_out=len(cross_validated),
        run_gain=float(np.sqrt(max(error.gain**2 - of_sessions["gain"], 0.0))),
        run_offset=float(np.sqrt(max(error.offset**2 - of_sessions["offset"], 0.0))),
        run_dof=max(len(cross_validated) - 1.0, 1.0),
        growth=Growth.of([*cross_validated, *away], error, own, curvature),
    )
    fits = _without_their_condition(parts, slopes, uncertainty.covariance)
    usual = _WithoutCondition(
        np.median([fit.by_parameters for fit in fits.values()], axis=0),
        float(np.median([fit.of_form for fit in fits.values()])),
    )
    scores: list[StandardizedErrors] = []
    for run in cross_validated:
        fit = fits.get(run.run_id, usual)
        shares = zip(QUANTITIES, fit.by_parameters, strict=True)
        grown = {q: share + uncertainty.growth.variance(q, run.distance) for q, share in shares}
        form = {q: fit.of_form * getattr(uncertainty, q) ** 2 for q in (*QUANTITIES, "run_gain", "run_offset")}
        gain, offset = (form[f"run_{name}"] + of_sessions[name] for name in ("gain", "offset"))
        force = gain * run.predicted**2 + offset + (grown["force"] + form["force"]) * run.half**2
        peak, energy = (np.sqrt(grown[q] + gain + form[q]) for q in ("peak", "energy"))
        scores.append(standardized(run, np.sqrt(force), float(peak), float(energy)))
    return replace(uncertainty, calibration=Calibration.of(cross_validated, scores))
