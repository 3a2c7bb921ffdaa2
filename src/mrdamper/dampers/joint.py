"""Global fit of one model of a whole damper to all its runs.

The model takes the current as an input and neither frequency nor amplitude, so every run determines every parameter,
and the result predicts any motion. Linear parameters are projected out; the others are refined by Levenberg–Marquardt
from the model's start. Each run counts by its own peak-to-peak force, and the sum of the run errors is minimised, not
of their squares, to limit the effect of a drifting session (iteratively reweighted).
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Literal, Self

import numpy as np

from mrdamper.dampers.base import Damper, Saved, not_held
from mrdamper.dampers.coil import Coil
from mrdamper.dampers.concatenated_runs import JointResiduals, Linearisation
from mrdamper.dampers.envelope import UNTESTED
from mrdamper.dampers.run_rows import RunRows, envelope_of
from mrdamper.dampers.search_space import FALL, RISE, SearchSpace, undetermined
from mrdamper.dampers.uncertainty import FittedParameter
from mrdamper.data import Condition, Floats, Run
from mrdamper.errors import IdentificationError, ParameterError, require
from mrdamper.models import Model, Scale, SearchAxis, model_type
from mrdamper.models.base import grid_of
from mrdamper.statistics.levenberg_marquardt import Minimum, least_squares, newton_refine
from mrdamper.statistics.linear import on_one_blas_thread
from mrdamper.statistics.stop_reason import StopReason

_SEARCH_TOLERANCE = 1e-6  # relative gain of a step at which the search ends
_LAG_BOUNDS_S, _START_LAG_S = (1e-4, 0.2), 8e-3  # of a coil's field [s]
_TRIAL_RUNS, _TRIAL_STEPS = 6, 5  # runs on which starts are tried, and steps from each
_REFIT_TOLERANCE = 5e-4  # relative gain of a step at which a fit without some runs ends
_REFIT_STEPS = 15  # of such a fit
_MAX_COST_RATIO = 0.85  # share of the first start's cost that another one must come below
_MAX_ERROR_RATIO = 0.995  # share of the first end's error that another one must come below
_CACHED_LINEARISATIONS = 8  # linearisations
_MIN_YIELD_DIFFERENCE = 0.1  # relative difference from which two yield displacements differ
_MAX_RUNNER_UP_RATIO = 1.25  # ratio of the errors up to which a local minimum is reported


@dataclass(frozen=True)
class SavedJoint(Saved):
    """A joint damper in a saved model."""

    model: str
    parameters: dict[str, float]
    parameter_units: dict[str, str]  # for the reader
    free: tuple[str, ...]


@dataclass(frozen=True, eq=False, repr=False)
class JointDamper(Damper):
    """One model for all currents and motions of a damper."""

    kind: ClassVar[str] = "joint"
    saved: ClassVar[type[Saved]] = SavedJoint

    model: Model  # takes the current from the motion
    free: tuple[str, ...]  # parameters determined from the data

    @property
    def title(self) -> str:
        return self.model.title

    @property
    def parameter_count(self) -> int:
        """Number of parameters determined from the tests; a preset, which is of other dampers, is none of them."""
        return len(self.free)

    @property
    def yield_length(self) -> float | None:
        return self.model.yield_length

    @property
    def source(self) -> str:
        return self.model.source

    @property
    def equation(self) -> str:
        return self.model.equation

    @property
    def one_model(self) -> Model:
        return self.model

    def model_at(self, condition: Condition) -> Model:
        return self.model

    def holding(self, values: Mapping[str, float]) -> JointDamper:
        if missing := values.keys() - self.model.values().keys():
            raise not_held(self, sorted(missing))
        return replace(self.with_parameters(values), uncertainty=None)

    @property
    def fitted_parameters(self) -> Mapping[str, FittedParameter]:
        return {
            info.name: FittedParameter(getattr(self.model, info.name), info.bounds, info.scale == "log", info.unit)
            for info in self.model.parameters()
            if info.name in self.free
        }

    def with_parameters(self, values: Mapping[str, float]) -> Self:
        return replace(self, model=replace(self.model, **values))

    def to_saved(self) -> SavedJoint:
        units = {info.name: info.unit for info in self.model.parameters()}
        return SavedJoint(self.model.name, self.model.values(), units, self.free)

    @classmethod
    def from_saved(cls, saved: SavedJoint, **shared: Any) -> Self:
        try:
            model = model_type(saved.model)(**saved.parameters)
        except TypeError as error:
            raise ParameterError(f"parameters do not fit the model: {error}", remedy="write the model again") from error
        return cls(model, saved.free, **shared)


def damper_of(given: Damper | Model) -> Damper:
    """Return a damper unchanged; a model as a damper without rig and tests."""
    if isinstance(given, Model):
        return JointDamper(given, (), envelope=UNTESTED)
    require(given, Damper, "a damper or a model", "load_model(file) gives one")
    return given


@dataclass(frozen=True, eq=False)
class JointFit:
    """A joint identification."""

    damper: JointDamper
    nrmse_pp: Floats  # (R,) error of each run, on the samples of the fit
    at_bounds: tuple[str, ...]
    point: Floats  # (D,) end of the search, on its axes
    ending: StopReason
    seconds: float
    searched: tuple[str, ...] = ()  # names of the search axes
    second: LocalMinimum | None = None

    @property
    def error(self) -> float:
        """Mean nrmse_pp of the runs."""
        return float(np.mean(self.nrmse_pp))


@dataclass(frozen=True)
class LocalMinimum:
    """Another local minimum of the search: another yield displacement with nearly the same error."""

    # yield_length and error: [m]; mean nrmse_pp
    yield_length: float
    error: float
    # chosen_yield_length and chosen_error: of the end that was chosen
    chosen_yield_length: float
    chosen_error: float

    @classmethod
    def beside(cls, chosen: JointFit, ends: Iterable[JointFit]) -> LocalMinimum | None:
        """Return the best of some ends of a search that differ from the chosen one, if any."""
        own = chosen.damper.yield_length
        others = [
            (e.error, k)
            for e in ends
            if (k := e.damper.yield_length) and own and abs(k - own) > _MIN_YIELD_DIFFERENCE * own
        ]
        error, yield_length = min(others, default=(np.inf, 0.0))
        return (
            cls(yield_length, error, own, chosen.error) if own and error < _MAX_RUNNER_UP_RATIO * chosen.error else None
        )


class JointProblem:
    """Runs of one rig prepared for one model type.

    All runs are concatenated into one motion: the effect of one run on the state decays during the next, which begins
    1.5 cycles before its scored samples, and one long array is evaluated faster than many short ones.

    The runs have any motion and any current; whole records are used, including ramps and rests. `fixed` holds
    parameters at a value, `free` are presets to determine as well. `coil` states known lags of the field, or none; by
    default they are determined where a current changes. Raises `IdentificationError` if there are no runs, or runs of
    several rigs.
    """

    def __init__(
        self,
        runs: Sequence[Run],
        model: str | type[Model],
        fixed: Mapping[str, float] | None = None,
        *,
        free: Sequence[str] = (),
        coil: Coil | Literal["determined"] | None = "determined",
        parts: Sequence[RunRows] = (),
    ):
        if not runs:
            raise IdentificationError("no runs", remedy="give at least one")
        rigs = {run.rig for run in runs}
        if len(rigs) > 1:
            raise IdentificationError(f"runs of {len(rigs)} rigs", remedy="identify one rig at a time")
        self.rig, self.runs = rigs.pop(), tuple(runs)
        self.model_type = model_type(model) if isinstance(model, str) else model
        self.fixed = dict(fixed or {})
        infos = self.model_type.parameters()
        self.free = tuple(i.name for i in infos if i.name not in self.fixed and (not i.preset or i.name in free))
        linear = [info for info in infos if info.linear and info.name in self.free]
        self.parts = list(parts) or [RunRows.of(run) for run in runs]
        axes = list(self.model_type.search_axes(_scale(self.parts), self.free))
        self.given_coil: Coil | Literal["determined"] | None = coil
        if coil == "determined" and any(part.changes for part in self.parts):
            axes += [SearchAxis(name, *_LAG_BOUNDS_S, (_START_LAG_S,), log=True) for name in (RISE, FALL)]
        self.space = SearchSpace(self.model_type, self.fixed, linear, axes, None if coil == "determined" else coil)

    def with_free(self, free: Sequence[str], fixed: Mapping[str, float] | None = None) -> JointProblem:
        """Return the same runs with other presets free, or more parameters held."""
        held = {**self.fixed, **(fixed or {})}
        return JointProblem(self.runs, self.model_type, held, free=free, coil=self.given_coil, parts=self.parts)

    @property
    def currents(self) -> list[float | None]:
        """Constant currents of the runs [A]; None where the current changes."""
        return [None if part.changes else part.condition.current_A for part in self.parts]

    def determined(self, rows: Sequence[int] | None = None) -> JointProblem:
        """Return the problem with effects of the current held at zero that all runs, or some, do not determine."""
        names = undetermined(
            self.model_type, [self.currents[i] for i in range(len(self.parts)) if rows is None or i in rows]
        )
        return self.with_free(self.free, dict.fromkeys(names, 0.0)) if set(names) & set(self.free) else self

    def with_parts(self, parts: Sequence[RunRows]) -> JointProblem:
        """Return the same problem of other samples of the runs."""
        return JointProblem(self.runs, self.model_type, self.fixed, free=self.free, coil=self.given_coil, parts=parts)

    def from_point(self, fit: JointFit) -> Floats:
        """(D,) the result of another problem on these axes; further axes have their start values."""
        lags = fit.damper.coil
        axis_values = {RISE: lags.rise_s, FALL: lags.fall_s} if lags else {}
        axis_values |= {name: getattr(fit.damper.model, name) for name in fit.searched if name not in axis_values}
        pairs = [(a, axis_values.get(a.name, a.grid[0])) for a in self.space.axes]
        return np.array([a.coordinate(min(max(value, a.lower), a.upper)) for a, value in pairs])

    def errors(self, fit: JointFit, rows: Sequence[int]) -> Floats:
        """(len(rows),) nrmse_pp of some runs predicted by a fit to others."""
        table = JointResiduals(self.space, [self.parts[i] for i in rows])
        return np.sqrt(np.bincount(table.owner, table.residual(fit.point, fit.damper.model) ** 2))

    @property
    def start(self) -> Floats:
        """(D,) the most promising of the model's starts on the search axes."""
        return self.promising[0]

    @cached_property
    def promising(self) -> list[Floats]:
        """Points some steps down from the model's starts, the most promising first.

        Each length of free play has its own local minimum and its best start. The first is the most probable: another
        must be clearly better.
        """
        grid = grid_of(self.space.axes)
        if len(grid) == 1:
            return grid
        table = self._few
        costs = np.array([float(np.sum(table.solve(u).nrmse_pp)) for u in grid])
        lengths = np.array([u[[len(axis.grid) > 1 for axis in self.space.axes]][0] for u in grid])
        kinds = [np.flatnonzero(lengths == d) for d in dict.fromkeys(lengths.tolist())]
        ends = [self._downhill(grid[min(kind, key=costs.__getitem__)]) for kind in kinds]
        first = ends[0]
        ends.sort(key=lambda end: _MAX_COST_RATIO * end.cost if end is first else end.cost)
        return [end.point for end in ends]

    @cached_property
    def _few(self) -> JointResiduals:
        """A few runs on which starts are tried."""
        few = self.parts[:: max(1, len(self.parts) // _TRIAL_RUNS)]
        return JointResiduals(self.space, [part.steady_end() for part in few])

    def _downhill(self, start: Floats) -> Minimum:
        """Return some steps from a start, on few runs."""
        table = self._few
        return least_squares(
            table.solved_residual, start, *self.space.box(), _TRIAL_STEPS, 1e-3, products=table.products
        )

    def search(
        self, start: Floats | None = None, rounds: int = 3, most_steps: int = 25, settled: float = _SEARCH_TOLERANCE
    ) -> JointFit:
        """Identify from the two most promising of the model's starts, and from another if one is given.

        `start` (D,) is any point of the search axes; the other arguments are those of `fit`. Returns the best end; the
        next best of another yield displacement is its `second`.
        """
        starts = [*self.promising[:2], *([] if start is None else [self._downhill(start).point])]
        ends = [self.fit(start=u, rounds=rounds, most_steps=most_steps, settled=settled) for u in starts]
        best = min(ends, key=lambda end: _MAX_ERROR_RATIO * end.error if end is ends[0] else end.error)
        return replace(best, second=LocalMinimum.beside(best, ends))

    @on_one_blas_thread
    def fit(
        self,
        rows: Sequence[int] | None = None,
        start: Floats | None = None,
        rounds: int = 3,
        most_steps: int = 25,
        settled: float = _SEARCH_TOLERANCE,
        *,
        to_the_last_digit: bool = False,
    ) -> JointFit:
        """Identify from all runs, or from those at some indices.

        The search begins at `start` (D,) on the search axes, for example the result of a fit to more runs. It has some
        rounds of robust weights, and steps in each, and ends at a relative gain of a step, `settled`; below the default
        its curvature is estimated, too. The weights of the first round are equal. `to_the_last_digit`: continue every
        round until the gradient vanishes, so that the result does not depend on rounding.
        """
        begin = time.perf_counter()
        parts = self.parts if rows is None else [self.parts[i] for i in rows]
        table, point = JointResiduals(self.space, parts), self.start if start is None else start
        return self._search(table, parts, point, rounds, most_steps, settled, begin, to_the_last_digit)

    def _search(
        self,
        table: JointResiduals,
        parts: Sequence[RunRows],
        point: Floats,
        rounds: int,
        most_steps: int,
        settled: float,
        begin: float,
        to_the_last_digit: bool = False,
    ) -> JointFit:
        """Search in rounds, with weights by the errors the last one left."""
        ending, curved = StopReason.SOLVED, settled < _SEARCH_TOLERANCE
        for _ in range(rounds):
            if self.space.axes:
                solution = least_squares(
                    table.solved_residual, point, *self.space.box(), most_steps, settled,
                    products=table.products, curved=curved, lengthened=True,
                )  # fmt: skip
                point, ending = solution.point, solution.ending
                if to_the_last_digit:
                    point = newton_refine(table.gradient, point, *self.space.box(), table.gradient)
            table.weigh(table.solve(point).nrmse_pp)
        solved = table.solve(point)
        return JointFit(
            self._damper(solved.model, point, parts),
            solved.nrmse_pp,
            (*self.space.at_bounds(point), *solved.held),
            point,
            ending,
            time.perf_counter() - begin,
            tuple(axis.name for axis in self.space.axes),
        )

    @on_one_blas_thread
    def refit(self, fit: JointFit, rows: Sequence[int], settled: float = _REFIT_TOLERANCE) -> JointFit:
        """Fit the runs at some indices, starting from the fit to all runs of this problem.

        The search first follows the known derivatives of the fit to all, which needs no force, and then its own. It
        ends at a relative gain of a step, `settled`.
        """
        begin, rows = time.perf_counter(), sorted(rows)
        linearised = self.linearised(fit)
        table = linearised.table.only(rows)
        errors, point = linearised.extrapolate_refit(rows, self.space.box())
        table.weigh(errors)
        costs = [float(np.sum(table.solve(u).residual ** 2)) for u in (fit.point, point)]
        if costs[1] > costs[0]:  # outside the range of the derivatives
            point = fit.point
        table.weigh(table.solve(point).nrmse_pp)
        return self._search(table, [self.parts[i] for i in rows], point, 1, _REFIT_STEPS, settled, begin)

    def linearised(self, fit: JointFit) -> Linearisation:
        """All runs linearised at a fit, weighted by its errors; cached for the last fits."""
        linearisation = next((each for one, each in self._linearisations if one is fit), None)
        if linearisation is None:
            table = JointResiduals(self.space, self.parts)
            table.weigh(fit.nrmse_pp)
            linearisation = Linearisation(table, fit.point, *table.linearise(fit.point, fit.damper.model))
            self._linearisations = [*self._linearisations[1 - _CACHED_LINEARISATIONS :], (fit, linearisation)]
        return linearisation

    _linearisations: Sequence[tuple[JointFit, Linearisation]] = ()

    def _damper(self, model: Model, point: Floats, parts: Sequence[RunRows]) -> JointDamper:
        about = {"runs": str(len(parts)), "fit": "global fit, all runs"}
        coil, envelope = self.space.coil_at(point), envelope_of(parts)
        return JointDamper(model, self.free, rig=self.rig, envelope=envelope, provenance=about, coil=coil)


def _scale(parts: Sequence[RunRows]) -> Scale:
    """Sizes of all runs: the middle motion, the largest force and current."""
    return Scale(
        amplitude=float(np.median([part.condition.amplitude_m for part in parts])),
        speed=float(np.median([part.condition.peak_velocity for part in parts])),
        force=max(part.scale for part in parts) / 2,
        current=max(float(np.max(np.abs(part.motion.current))) for part in parts),
    )
