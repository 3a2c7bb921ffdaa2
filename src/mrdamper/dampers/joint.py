"""Joint identification: one model of a whole damper, from all its runs at once.

The model takes the current as an input and neither frequency nor amplitude, so every run
informs every parameter, and the result predicts any motion. Linear parameters are projected
out; the others are refined by Levenberg–Marquardt from the model's start. Each run counts by
its own peak-to-peak force, and the sum of the run errors is minimised, not of their squares,
so that one drifting session cannot bend the model (iteratively reweighted).
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from mrdamper.dampers.base import UNTESTED, Damper, Envelope, Saved
from mrdamper.dampers.coil import Coil
from mrdamper.data import Condition, Floats, Run
from mrdamper.errors import IdentificationError, ParameterError, RunError
from mrdamper.identification.columns import bounds_of, linear_table
from mrdamper.models import Model, Scale, SearchAxis, model_type
from mrdamper.motion import Excitation, equivalent_sine, measured_motion
from mrdamper.optimizers.ending import Ending
from mrdamper.optimizers.levenberg_marquardt import least_squares
from mrdamper.optimizers.linear import on_one_blas_thread, solve_bounded, solve_linear

_ROWS = 400  # samples of a run that enter the least squares; its motion is followed in full
_CYCLES = 4  # of a sine that enter: more repeat the same
_WARM_UP = 1.5  # cycles before the scored samples in which the model forgets its start
_SETTLED = 1e-6  # relative gain of a step at which the search ends
_BEST = 1e-3  # nrmse_pp below which a run gains no more weight


@dataclass(frozen=True)
class SavedJoint(Saved):
    """A joint damper in a saved model."""

    model: str
    parameters: dict[str, float]
    parameter_units: dict[str, str]  # for the reader
    free: tuple[str, ...]


@dataclass(frozen=True, eq=False, repr=False)
class JointDamper(Damper):
    """One model for all currents and motions of a damper.

    Attributes
    ----------
    rig : str
    model : Model
        Takes the current from the motion.
    free : tuple of str
        Parameters determined from the data.
    envelope : Envelope
    provenance : mapping
    coil : Coil, optional
    """

    kind: ClassVar[str] = "joint"
    saved: ClassVar[type[Saved]] = SavedJoint

    rig: str
    model: Model
    free: tuple[str, ...]
    envelope: Envelope
    provenance: Mapping[str, str] = field(default_factory=dict)
    coil: Coil | None = None

    @property
    def title(self) -> str:
        return self.model.title

    @property
    def parameter_count(self) -> int:
        return len(self.free)

    @property
    def knee(self) -> float | None:
        return self.model.knee

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
        return replace(self, model=replace(self.model, **values))

    def to_saved(self) -> SavedJoint:
        units = {info.name: info.unit for info in self.model.parameters()}
        return SavedJoint(self.model.name, self.model.values(), units, self.free)

    @classmethod
    def from_saved(
        cls, saved: SavedJoint, rig: str, envelope: Envelope, provenance: Mapping[str, str], coil: Coil | None
    ) -> Self:
        try:
            model = model_type(saved.model)(**saved.parameters)
        except TypeError as error:
            raise ParameterError(f"parameters do not fit the model: {error}", mend="write the model again") from error
        return cls(rig, model, saved.free, envelope, provenance, coil)


def damper_of(given: Damper | Model) -> Damper:
    """A damper as it is; a bare model as a damper of no rig, tested nowhere."""
    if isinstance(given, Model):
        return JointDamper("", given, (), UNTESTED)
    return given


@dataclass(frozen=True, eq=False)
class JointFit:
    """A joint identification.

    Attributes
    ----------
    damper : JointDamper
    nrmse_pp : (R,) array
        Error of each run, on the samples that entered.
    at_bounds : tuple of str
    point : (D,) array
        Where the search ended, on its axes.
    ending : Ending
    evaluations : int
    seconds : float
    """

    damper: JointDamper
    nrmse_pp: Floats
    at_bounds: tuple[str, ...]
    point: Floats
    ending: Ending
    evaluations: int
    seconds: float


class JointProblem:
    """Runs of one rig prepared for one model type.

    All runs are strung into one motion: a model with fading memory forgets one run while it
    follows the next from 1.5 cycles before its scored samples, and one long array is followed
    faster than many short ones.

    Parameters
    ----------
    runs : sequence of Run
        Of one rig; any motion, any current.
    model : str or type of Model
    fixed : mapping, optional
        Parameters held at a value.

    Raises
    ------
    IdentificationError
        If there are no runs, or runs of several rigs.
    """

    def __init__(self, runs: Sequence[Run], model: str | type[Model], fixed: Mapping[str, float] | None = None):
        if not runs:
            raise IdentificationError("no runs", mend="give at least one")
        rigs = {run.rig for run in runs}
        if len(rigs) > 1:
            raise IdentificationError(f"runs of {len(rigs)} rigs", mend="identify one rig at a time")
        self.rig = rigs.pop()
        self.model_type = model_type(model) if isinstance(model, str) else model
        self.fixed = dict(fixed or {})
        infos = self.model_type.parameters()
        self.free = tuple(info.name for info in infos if info.name not in self.fixed)
        self.linear = [info for info in infos if info.linear and info.name in self.free]
        self.axes: tuple[SearchAxis, ...] = self.model_type.search_axes(Scale(1e-2, 0.1), self.free)
        self.parts = [_Part.of(run) for run in runs]

    @property
    def start(self) -> Floats:
        """(D,) the model's start on the search axes."""
        return np.array([axis.coordinate(axis.grid[0]) for axis in self.axes])

    @on_one_blas_thread
    def fit(
        self,
        rows: Sequence[int] | None = None,
        start: Floats | None = None,
        rounds: int = 3,
        most_steps: int = 15,
        settled: float = _SETTLED,
    ) -> JointFit:
        """Identify from all runs, or from those at some indices.

        Parameters
        ----------
        rows : sequence of int, optional
        start : (D,) array, optional
            Where to begin on the search axes: the result of a fit to more runs, say.
        rounds, most_steps : int
            Rounds of robust weights, and steps of the search in each.
        settled : float
            Relative gain of a step at which the search ends; below the default its curvature is learnt too.
        """
        begin = time.perf_counter()
        table = _Table(self, self.parts if rows is None else [self.parts[i] for i in rows])
        lower, upper = self._box()
        point = self.start if start is None else start
        evaluations, ending = 0, Ending.SOLVED
        for _ in range(rounds):
            if self.axes:
                found = least_squares(
                    lambda u: table.solve(u).residual,
                    point,
                    lower,
                    upper,
                    most_steps,
                    settled,
                    curved=settled < _SETTLED,
                )
                point, ending = found.point, found.ending
                evaluations += found.evaluations
            table.weights = 1.0 / np.sqrt(np.maximum(table.solve(point).nrmse_pp, _BEST))
        solved = table.solve(point)
        at_bounds = [axis.name for axis, u in zip(self.axes, point, strict=True) if axis.at_bound(float(u))]
        return JointFit(
            self._damper(solved.model, table.parts),
            solved.nrmse_pp,
            (*at_bounds, *solved.held),
            point,
            ending,
            evaluations,
            time.perf_counter() - begin,
        )

    @on_one_blas_thread
    def without(self, fit: JointFit, rows: Sequence[int]) -> JointDamper:
        """The damper had some runs been missing: one Gauss–Newton step from the fit to all.

        Leaving out one condition of many moves the parameters little, and one step from the
        full fit then lands where a new search would, at no cost worth counting.

        Parameters
        ----------
        fit : JointFit
            To all runs of this problem.
        rows : sequence of int
            Runs to keep.
        """
        residual, jacobian, owner = self.linearised(fit)
        kept = np.isin(owner, list(rows))
        step = solve_linear(jacobian[kept], -residual[kept], rank_limit=1e-12)
        lower, upper = self._box()
        table = _Table(self, [self.parts[i] for i in rows])
        table.weights = 1.0 / np.sqrt(np.maximum(fit.nrmse_pp[list(rows)], _BEST))
        solved = table.solve(np.clip(fit.point + step[: len(self.axes)], lower, upper))
        return self._damper(solved.model, table.parts)

    def linearised(self, fit: JointFit) -> tuple[Floats, Floats, NDArray[np.intp]]:
        """Residual at a fit, its derivatives by all free parameters, and the run of each row."""
        if self._linearisation is None or self._linearisation[0] is not fit:
            table = _Table(self, self.parts)
            table.weights = 1.0 / np.sqrt(np.maximum(fit.nrmse_pp, _BEST))
            self._linearisation = (fit, *table.linearise(fit.point, fit.damper.model))
        return self._linearisation[1:]

    _linearisation: tuple[JointFit, Floats, Floats, NDArray[np.intp]] | None = None

    def _damper(self, model: Model, parts: Sequence[_Part]) -> JointDamper:
        about = {"runs": str(len(parts)), "fit": "joint, all runs at once"}
        return JointDamper(self.rig, model, self.free, Envelope.of([p.condition for p in parts]), about)

    def _box(self) -> tuple[Floats, Floats]:
        return (
            np.array([axis.coordinate(axis.lower) for axis in self.axes]),
            np.array([axis.coordinate(axis.upper) for axis in self.axes]),
        )

    def bare(self, point: Floats) -> Model:
        """The model at a point of the search axes, its linear parameters zero."""
        values = {axis.name: axis.value(float(u)) for axis, u in zip(self.axes, point, strict=True)}
        return self.model_type.build({**self.fixed, **values, **{info.name: 0.0 for info in self.linear}})


@dataclass(frozen=True, eq=False)
class _Part:
    """A run's motion from shortly before its steady window on, and the samples that are scored."""

    motion: Excitation
    picked: NDArray[np.intp]
    target: Floats
    condition: Condition
    scale: float

    @classmethod
    def of(cls, run: Run) -> _Part:
        found = equivalent_sine(run)
        motion = measured_motion(run).about(found.centre)
        first, last = (int(i) for i in np.flatnonzero(run.in_window)[[0, -1]])
        period = 1 / found.condition.frequency_Hz
        if found.is_sine:
            first = max(first, int(np.searchsorted(run.time, run.time[last] - _CYCLES * period)))
        begin = int(np.searchsorted(run.time, run.time[first] - _WARM_UP * period))
        picked = np.arange(first, last + 1, max(1, (last + 1 - first) // _ROWS))
        scale = float(np.ptp(run.force[first : last + 1]))
        if scale == 0:
            raise RunError("the force does not change", where=f"run {run.id}", mend="leave the run out")
        return cls(motion.part(slice(begin, last + 1)), picked - begin, run.force[picked], found.condition, scale)


@dataclass(frozen=True, eq=False)
class _Solved:
    model: Model
    residual: Floats
    nrmse_pp: Floats
    held: tuple[str, ...]


class _Table:
    """Some runs strung together, with the weight of each."""

    def __init__(self, problem: JointProblem, parts: Sequence[_Part]):
        self.problem, self.parts = problem, parts
        self.motion = string(part.motion for part in parts)
        offsets = np.cumsum([0, *(len(part.motion) for part in parts)])
        self.picked = np.concatenate([part.picked + at for part, at in zip(parts, offsets[:-1], strict=True)])
        self.seen = self.motion.part(self.picked)
        self.target = np.concatenate([part.target for part in parts])
        self.owner = np.repeat(np.arange(len(parts)), [part.target.size for part in parts])
        # Divides residuals so that their squares sum to each run's nrmse_pp².
        self.size = np.array([part.scale * np.sqrt(part.target.size) for part in parts])
        self.weights = np.ones(len(parts))

    def solve(self, point: Floats) -> _Solved:
        """Linear parameters of least weighted squares at a point of the search axes."""
        linear = self.problem.linear
        bare = self.problem.bare(point)
        base, columns = linear_table(bare, linear, self.seen, bare.state(self.motion)[self.picked])
        factor = (self.weights / self.size)[self.owner]
        columns, right = columns * factor[:, None], (self.target - base) * factor
        solution, held = solve_bounded(columns, right, *bounds_of(linear))
        residual = columns @ solution - right
        errors = np.sqrt(np.bincount(self.owner, residual**2)) / self.weights
        model = replace(bare, **{i.name: float(s) for i, s in zip(linear, solution, strict=True)})
        return _Solved(model, residual, errors, tuple(i.name for i, h in zip(linear, held, strict=True) if h))

    def linearise(self, point: Floats, model: Model) -> tuple[Floats, Floats, NDArray[np.intp]]:
        """Weighted residual of a model, derivatives by search axes and linear parameters, owners."""
        factor = (self.weights / self.size)[self.owner]
        linear = {info.name: getattr(model, info.name) for info in self.problem.linear}

        def residual(u: Floats) -> Floats:
            moved = replace(self.problem.bare(u), **linear)
            return (moved.force(self.seen, moved.state(self.motion)[self.picked]) - self.target) * factor

        r = residual(point)
        lower, upper = self.problem._box()
        steps = 1e-6 * (upper - lower)
        slopes = [(residual(point + s) - r) / d for s, d in zip(np.diag(steps), steps, strict=True)]
        bare = self.problem.bare(point)
        state = bare.state(self.motion)[self.picked]
        columns = linear_table(bare, self.problem.linear, self.seen, state)[1] * factor[:, None]
        return r, np.column_stack([*slopes, columns]), self.owner


def string(motions: Iterable[Excitation]) -> Excitation:
    """Several motions one after the other, a second apart."""
    parts = list(motions)
    time, clock = [], 0.0
    for part in parts:
        time.append(part.time - part.time[0] + clock)
        clock = float(time[-1][-1]) + 1.0
    names = ("displacement", "velocity", "acceleration", "current")
    return Excitation(np.concatenate(time), *(np.concatenate([getattr(p, n) for p in parts]) for n in names))
