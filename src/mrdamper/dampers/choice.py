"""Selection of the terms of a global model by cross-validation.

Terms are tried on the linearisation of one fit: omitting a condition, a current or a session,
with a term or without it, is then linear algebra on a few thousand rows, and only the selected
terms are fitted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mrdamper.dampers.coil import Coil
from mrdamper.dampers.fold_fits import FoldFits
from mrdamper.dampers.joint import JointFit, JointProblem, LocalMinimum
from mrdamper.dampers.search_space import FALL, RISE, level_count
from mrdamper.data import Floats, Run, condition_groups, level_groups, session_folds
from mrdamper.models import model_type
from mrdamper.statistics.functions.selection import Errors, smaller_wins
from mrdamper.statistics.linear import on_one_blas_thread, solve_linear

_COARSE_TOLERANCE = 1e-4  # relative gain of a step that suffices to compare forms
_NO_ONSET_A = 1e-4  # below the currents of any test: the yield force rises from no current on [A]
_NO_PLAY_LENGTH_M = 1e-2  # longer than any free play, so that none is left [m]
_BLOCK_CYCLES = 12.0  # cycles of one block of a record that is no sine, in cross-validation
MODEL = "play-bypass"
_PLAIN = "none beyond the plain form"
SEARCHED = ("leak", "cq", "qb")  # presets free from the first fit on: without them others compensate for their effects


@dataclass(frozen=True)
class ModelTerm:
    """Optional term of a model."""

    title: str
    names: tuple[str, ...]  # parameters it takes
    held: tuple[tuple[str, float], ...] = ()  # presets of the model that the term holds at another value


_NO_ONSET = (("Ic", _NO_ONSET_A),)
LEVEL_LAWS = (
    ModelTerm("yield force rises with the current from no current on", (), held=_NO_ONSET),
    ModelTerm("yield force begins to rise over the current of the preset", ()),
    ModelTerm("yield force rises over a current of its own", ("Ic",)),
    ModelTerm("yield force saturates with current", ("si",), held=_NO_ONSET),
    ModelTerm("yield force saturates, and rises over the current of the preset", ("si",)),
    ModelTerm("yield force rises and saturates over currents of its own", ("Ic", "si")),
)
_LEVEL_LAW_PARAMETERS = ("Ic", "si")
TERMS = (
    ModelTerm("viscosity differs by direction", ("cq",)),
    ModelTerm("bypass differs by direction", ("qb",)),
    ModelTerm("yield force differs by direction", ("asymmetry",)),
    ModelTerm("viscosity rises with current", ("c1",)),
    ModelTerm("Stribeck amplitude depends on current", ("h1",)),
    ModelTerm("inertia", ("m",)),
)


@dataclass(frozen=True)
class TermTrial:
    """Result of the cross-validation of one term."""

    term: str
    kept: bool
    # mean cross-validated nrmse_pp with the term (if rejected) or without it (if kept), by kind of fold
    left_out: Mapping[str, float]
    before: Mapping[str, float]  # the same of the model it was tried on


@dataclass(frozen=True, eq=False)
class JointChoice:
    """Global model whose terms were selected by cross-validation."""

    problem: JointProblem
    fit: JointFit
    tried: tuple[TermTrial, ...]
    left_out: Mapping[str, float]  # mean cross-validated nrmse_pp by kind of fold: "condition", "current", "session"
    searched: tuple[str, ...] = ()  # presets that a search without a fold has free, too


@on_one_blas_thread
def identify_jointly(runs: Sequence[Run], model: str = MODEL) -> JointChoice:
    """Identify one damper from all runs of a rig, with the terms selected by cross-validation.

    The runs have any motion and any current; the model has `current_levels`. Of all models but play and bypass, each
    parameter that is preset to zero is a term. Raises `IdentificationError` and `RunError` as `JointProblem`.
    """
    return _of_play_and_bypass(runs) if model == MODEL else _with_presets_as_terms(runs, model)


def _of_play_and_bypass(runs: Sequence[Run]) -> JointChoice:
    """Select the free play, the law of the current and the terms, in this order."""
    problem = JointProblem(runs, MODEL).determined()
    fixed = problem.fixed
    laws = _level_laws(problem)
    ends = [part.steady_end() for part in problem.parts]
    searched = sorted({name for law in laws for name in law.names})
    short = JointProblem(runs, MODEL, fixed, free=(*SEARCHED, *searched), parts=ends)
    fit = short.search(rounds=2, most_steps=15, settled=_COARSE_TOLERANCE)
    short, fit, tried = _lost_motion(short, fit)
    second = fit.second
    law, fit, more, current = _level_law(short, fit, laws)
    tried = (*tried, *more)
    problem = problem.with_free((*SEARCHED, *law.names), {**short.fixed, **dict(law.held)})
    fit = problem.fit(start=problem.from_point(fit), rounds=2, most_steps=8, settled=_COARSE_TOLERANCE / 10)
    evidence = CrossValidation.of(problem, fit)
    chosen, more = evidence.choose([t for t in TERMS if not problem.fixed.keys() & set(t.names)])
    final, best = problem, fit
    off = {name: 0.0 for term in TERMS for name in term.names if name in problem.free and name not in chosen}
    coil, gone = _absent(problem, fit)
    off |= dict.fromkeys(gone, 0.0)
    if off or coil != problem.given_coil:
        final = JointProblem(runs, MODEL, {**problem.fixed, **off}, free=problem.free, coil=coil, parts=problem.parts)
        best = final.fit(start=evidence.start(final, chosen), rounds=1, settled=_COARSE_TOLERANCE / 10)
    coil, gone = _absent(final, best)
    if gone or coil != final.given_coil:
        fixed = {**final.fixed, **dict.fromkeys(gone, 0.0)}
        final = JointProblem(runs, MODEL, fixed, free=final.free, coil=coil, parts=final.parts)
        best = final.fit(start=final.from_point(best), rounds=1, settled=_COARSE_TOLERANCE / 10)
    tried = (*tried, *more)
    choice = _conclude((problem, fit), (final, best), second, tried, _kept_terms(tried, law), current)
    return replace(choice, searched=SEARCHED)


def _conclude(
    full: tuple[JointProblem, JointFit],
    selected: tuple[JointProblem, JointFit],
    second: LocalMinimum | None,
    tried: tuple[TermTrial, ...],
    terms: str,
    current: Errors,
) -> JointChoice:
    """Return the selected model, or the full one where fits do not confirm the step that selected it."""
    left_out, before = (CrossValidation.of(*each).everything() for each in (selected, full))
    final, best = selected if smaller_wins(left_out, before) else full
    best = final.fit(start=best.point, settled=_COARSE_TOLERANCE / 10, to_the_last_digit=True)
    evidence = CrossValidation.of(final, best, sessions=True)
    means = _means(dict(sorted({**evidence.everything(), **current}.items())))
    about = {**best.damper.provenance, "terms": terms}
    best = replace(best, damper=replace(best.damper, provenance=about), second=second)
    return JointChoice(final, best, tried, means)


def _with_presets_as_terms(runs: Sequence[Run], model: str) -> JointChoice:
    """Select the presets of a model that are zero, beginning with all of them."""
    infos = model_type(model).parameters()
    optional = {info.name: info.meaning for info in infos if info.preset and info.default == 0.0}
    problem = JointProblem(runs, model, free=tuple(optional)).determined()
    ends = problem.with_parts([part.steady_end() for part in problem.parts])
    short = ends.search(rounds=2, most_steps=15, settled=_COARSE_TOLERANCE)
    fit = problem.fit(start=short.point, rounds=1, settled=_COARSE_TOLERANCE / 10)
    evidence = CrossValidation.of(problem, fit)
    chosen, tried = evidence.choose([ModelTerm(optional[n], (n,)) for n in problem.free if n in optional])
    final = problem.with_free(tuple(chosen))
    best = final.fit(start=evidence.start(final, chosen), rounds=1, settled=_COARSE_TOLERANCE / 10)
    terms = "; ".join(t.term for t in tried if t.kept) or _PLAIN
    return _conclude((problem, fit), (final, best), short.second, tried, terms, {})


def _lost_motion(problem: JointProblem, fit: JointFit) -> tuple[JointProblem, JointFit, tuple[TermTrial, ...]]:
    """Remove the free play from the model where it predicts as well without it."""
    without = problem.with_free(problem.free, {"e": _NO_PLAY_LENGTH_M})
    starts = (without.from_point(fit), without.start)  # the minimum without play may be another
    fits = [without.fit(start=start, rounds=1, most_steps=10, settled=_COARSE_TOLERANCE) for start in starts]
    refitted = min(fits, key=lambda each: float(np.sum(each.nrmse_pp)))
    now, scores = (CrossValidation.of(p, f).everything() for p, f in ((problem, fit), (without, refitted)))
    kept = not smaller_wins(scores, now)
    trial = _tried("free play after a reversal", kept, now, scores)
    if kept:
        return problem, fit, (trial,)
    return without, replace(refitted, second=LocalMinimum.beside(refitted, [fit])), (trial,)


def _absent(problem: JointProblem, fit: JointFit) -> tuple[Coil | Literal["determined"] | None, tuple[str, ...]]:
    """Return the coil to determine, and presets, without those that ended without an effect."""
    least = {
        a.name
        for a, u in zip(problem.space.axes, fit.point, strict=True)
        if a.at_bound(float(u)) and a.value(float(u)) < np.sqrt(a.upper * max(a.lower, 1e-9 * a.upper))
    }
    coil = None if {RISE, FALL} <= least else problem.given_coil
    return coil, tuple(name for name in ("leak", "si") if name in least)


def _level_laws(problem: JointProblem) -> tuple[ModelTerm, ...]:
    """Functions of current that the tests determine, the shortest first.

    A function has a parameter fewer than there are levels; a changing current passes through all. Two levels determine
    a straight line only. Three determine a saturation; runs at two of them are fitted without it.
    """
    levels = level_count(problem.currents)
    free = {"si"} if levels == 3 else set[str]()
    able = [law for law in LEVEL_LAWS if len(set(law.names) - free) + 2 < max(levels, 3)]
    return tuple(able[: None if levels > 2 else 1])


def _kept_terms(tried: Sequence[TermTrial], law: ModelTerm) -> str:
    """Name the kept terms; of the laws of the current, each kept until a better one, the selected one alone."""
    others = {one.title for one in LEVEL_LAWS} - {law.title}
    return "; ".join(t.term for t in tried if t.kept and t.term not in others) or _PLAIN


def _level_law(
    longest: JointProblem, fit: JointFit, forms: Sequence[ModelTerm]
) -> tuple[ModelTerm, JointFit, tuple[TermTrial, ...], dict[str, Floats]]:
    """Select the form of the yield force over current by cross-validation, the shortest first.

    Inner currents, if any, are omitted and fitted from independent starts, because one step does not suffice between
    currents. The search began with every parameter of the function, because the others compensate for a form that is
    too short.
    """
    levels = [*level_groups(longest.currents).values()][1:-1] if len(forms) > 1 else []
    without = FoldFits(longest, levels)
    starts = [without.refit([i for i in range(len(longest.parts)) if i not in level]) for level in levels]
    tried: list[TermTrial] = []
    best: tuple[ModelTerm, JointFit, Errors] | None = None
    for form in forms:
        names = [n for n in longest.free if n not in _LEVEL_LAW_PARAMETERS or n in form.names]
        problem = longest.with_free(names, dict(form.held))
        trial = fit
        if form.held or set(problem.free) != set(longest.free):
            trial = problem.fit(start=problem.from_point(fit), rounds=1, most_steps=10, settled=_COARSE_TOLERANCE)
        scores: Errors = CrossValidation.of(problem, trial).everything()
        if levels:
            scores = {**scores, "current": _left_out_current(problem, starts, levels)}
        if best is None:
            best = form, trial, scores
            continue
        kept = not smaller_wins(best[2], scores)
        tried.append(_tried(form.title, kept, scores, best[2]))
        if kept:
            best = form, trial, scores
    assert best is not None
    current = {what: error for what, error in best[2].items() if what == "current"}
    return best[0], best[1], tuple(tried), current


def _left_out_current(problem: JointProblem, starts: Sequence[JointFit], levels: Sequence[Sequence[int]]) -> Floats:
    """Errors nrmse_pp of the runs at some currents, each level predicted by a fit without it from its start."""
    errors: list[Floats] = []
    for level, start in zip(levels, starts, strict=True):
        rest = [i for i in range(len(problem.parts)) if i not in level]
        without = problem.fit(rest, problem.from_point(start), rounds=1, most_steps=8, settled=_COARSE_TOLERANCE)
        errors.append(problem.errors(without, level))
    return np.concatenate(errors)


@dataclass(frozen=True, eq=False)
class CrossValidation:
    """Cross-validation of terms on the linearisation of a fit by all parameters; an omitted parameter is zero."""

    names: tuple[str, ...]  # length P, parameters of the search axes and linear ones
    values: Floats  # (P,) at the end of the fit
    residual: Floats  # (N,) weighted
    jacobian: Floats  # (N, P)
    weights: Floats  # (N,) robust weight of the run of each sample
    share: Floats  # (N,) share of its run that each sample represents
    folds: Mapping[str, Sequence[np.ndarray]]  # samples omitted together, by kind

    @classmethod
    def of(cls, problem: JointProblem, fit: JointFit, *, sessions: bool = False) -> CrossValidation:
        """Linearise a problem where a fit of it ended; conditions are omitted, and sessions if asked for."""
        linearised = problem.linearised(fit)
        table = linearised.table
        names = (*(a.name for a in problem.space.axes), *(i.name for i in problem.space.linear))
        values = np.array([*fit.point, *(getattr(fit.damper.model, i.name) for i in problem.space.linear)])
        return cls(
            names, values, linearised.residual, linearised.jacobian, table.weights[table.owner], table.share,
            _folds(problem, table.owner, sessions),
        )  # fmt: skip

    def everything(self) -> dict[str, Floats]:
        """Return the cross-validated errors with all parameters."""
        return self.scores(frozenset(self.names))

    def scores(self, active: frozenset[str]) -> dict[str, Floats]:
        """Return the cross-validated error of every fold by kind, without the other parameters."""
        on, base = self._without(active)
        errors: dict[str, Floats] = {}
        jacobian = self.jacobian[:, on]
        normal, right = jacobian.T @ jacobian, jacobian.T @ base
        for kind, folds in self.folds.items():
            errors[kind] = np.zeros(len(folds))
            for i, fold in enumerate(folds):
                J = jacobian[fold]
                step = _damped(normal - J.T @ J, -(right - J.T @ base[fold]))
                with np.errstate(over="ignore"):  # infinite where the rest determines a parameter by rounding only
                    squares = np.sum(((base[fold] + J @ step) / self.weights[fold]) ** 2)
                errors[kind][i] = np.sqrt(squares / np.sum(self.share[fold]))  # one for each whole run
        return errors

    def choose(self, removable: Sequence[ModelTerm]) -> tuple[frozenset[str], tuple[TermTrial, ...]]:
        """Select the terms without which the cross-validated error increases, one after the other."""
        active = frozenset(n for n in self.names if not n.startswith("coil."))
        now, tried = self.scores(active), list[TermTrial]()
        for term in removable:
            if set(term.names) <= active:
                without = self.scores(active - set(term.names))
                keep = not smaller_wins(without, now)
                tried.append(_tried(term.title, keep, now, without))
                if not keep:
                    active, now = active - set(term.names), without
        return active, tuple(tried)

    def start(self, problem: JointProblem, active: frozenset[str]) -> Floats:
        """Return the start of the problem of the selected parameters: one step of the linearisation from the fit."""
        on, base = self._without(active)
        moved = np.where(on, self.values, 0.0)
        moved[on] += solve_linear(self.jacobian[:, on], -base, rank_limit=1e-10)
        values = dict(zip(self.names, moved.tolist(), strict=True))
        lower, upper = problem.space.box()
        margin = 0.02 * (upper - lower)
        return np.clip([values[a.name] for a in problem.space.axes], lower + margin, upper - margin)

    def _without(self, active: frozenset[str]) -> tuple[NDArray[np.bool_], Floats]:
        """Return the parameters that are active, lags of the coil always, and the residual without the others."""
        on = np.array([n in active or n.startswith("coil.") for n in self.names])
        return on, self.residual - self.jacobian @ np.where(on, 0.0, self.values)


def _damped(normal: Floats, right: Floats) -> Floats:
    scale = np.sqrt(np.maximum(np.diag(normal), np.finfo(float).tiny))
    stiff = normal / scale / scale[:, None] + 1e-9 * np.eye(scale.size)
    return np.linalg.solve(stiff, right / scale) / scale


def _tried(title: str, kept: bool, larger: Errors, smaller: Errors) -> TermTrial:
    """Compare the cross-validated errors of the models with and without a term."""
    return TermTrial(title, kept, _means(smaller if kept else larger), _means(larger if kept else smaller))


def _means(errors: Errors) -> dict[str, float]:
    return {kind: float(np.mean(values)) for kind, values in errors.items()}


def _folds(problem: JointProblem, owner: NDArray[np.intp], sessions: bool) -> dict[str, list[NDArray[np.intp]]]:
    """Return samples omitted together, by kind: of a condition, or a stretch of another record; of a session if asked.

    A record that is no sine is a condition by itself; its stretches are predicted from the rest of it, too.
    """
    conditions: list[NDArray[np.intp]] = []
    for group in condition_groups([part.sine for part in problem.parts]):
        rows, part = np.flatnonzero(np.isin(owner, group)), problem.parts[group[0]]
        cycles = (part.motion.time[-1] - part.motion.time[0]) * part.condition.frequency_Hz
        conditions += [rows] if part.sine else np.array_split(rows, max(4, int(cycles / _BLOCK_CYCLES)))
    folds = {"condition": conditions} if len(conditions) > 2 else {}
    if sessions and (groups := session_folds(problem.runs)):
        folds["session"] = [np.flatnonzero(np.isin(owner, group)) for group in groups]
    return folds
