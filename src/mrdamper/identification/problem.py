"""Identification problem of one run, and its solution."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from mrdamper.data.arrays import Floats
from mrdamper.data.conditions import Condition
from mrdamper.data.displayable import Displayable
from mrdamper.data.runs import Run
from mrdamper.errors import IdentificationError, UnknownNameError, validate_arguments
from mrdamper.identification.intervals import NOT_IDENTIFIABLE, interval_about, written
from mrdamper.models.base import Model
from mrdamper.physics.gas_spring import GasSpring
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.physics.motion.measured import measured_motion
from mrdamper.physics.motion.sines import MotionAnalysis, analyse_motion
from mrdamper.statistics.metrics import Scores
from mrdamper.statistics.stop_reason import StopReason

DELAY = "delay"  # name of the search coordinate
DELAY_LIMIT = 3e-3  # largest delay between the channels [s]


@dataclass(frozen=True, eq=False)
class Problem:
    """One run, one model, and which of its parameters are free."""

    run: Run
    model_type: type[Model]
    free: tuple[str, ...]  # parameters to determine
    fixed: Mapping[str, float]  # parameters held at a value
    with_delay: bool = False  # also determine a delay of the force channel, within ±3 ms

    @classmethod
    def of(
        cls,
        run: Run,
        model_type: type[Model],
        *,
        free: Sequence[str] = (),
        fixed: Mapping[str, float] | None = None,
        gas: GasSpring | None = None,
        with_delay: bool = False,
    ) -> Problem:
        """Determine which parameters are free: all but the presets, the fixed ones, and those of the gas spring.

        Raises `UnknownNameError` if the model has no such parameter. Raises `IdentificationError` if m and k1 are both
        to be free: at one frequency a = −ω² x, so they cannot be separated. Raises `ParameterError` if the motion would
        compress the gas to no volume at all.

        `free`: presets to free as well; `fixed`: parameters to hold at a value [SI]; `gas`: a known gas spring fixes
        k1, k2 and k3, so that the mass is identifiable.
        """
        infos = {info.name: info for info in model_type.parameters()}
        held = dict(fixed or {})
        wanted = list(free)
        if gas is not None:
            gas.force(np.ptp(run.displacement) / 2)  # refuses a motion that leaves no gas volume
            k1, k2, k3 = gas.stiffnesses("extension")
            held = {"k1": k1, "k2": k2, "k3": k3} | held
            if "m" not in held:
                wanted.append("m")
        for name in (*wanted, *held):
            if name not in infos:
                raise UnknownNameError.of(f"parameter of {model_type.name}", name, infos)
        chosen = tuple(name for name, info in infos.items() if name not in held and (not info.preset or name in wanted))
        if {"m", "k1"} <= set(chosen):
            raise IdentificationError(
                "m and k1 are both free, and at one frequency a = −ω² x makes them one parameter",
                where=f"run {run.id}",
                remedy="fix one, give a gas spring, or identify over several frequencies jointly",
            )
        presets = {n: i.default for n, i in infos.items() if n not in chosen and i.default is not None}
        return cls(run, model_type, chosen, MappingProxyType({**presets, **held}), with_delay)

    @cached_property
    def analysis(self) -> MotionAnalysis:
        """Frequency, amplitude and mean of the measured motion."""
        return analyse_motion(self.run)

    @cached_property
    def motion(self) -> Excitation:
        """Smooth measured motion about mid-stroke, from one cycle before the steady window on."""
        return _motion_of(self.run)

    @cached_property
    def scored(self) -> slice:
        """Samples of `motion` inside the steady window."""
        return slice(len(self.motion) - int(np.count_nonzero(self.run.in_window)), None)

    @cached_property
    def seen(self) -> Excitation:
        """The motion inside the steady window."""
        return self.motion.part(self.scored)

    @cached_property
    def force(self) -> Floats:
        """Measured force in the steady window [N]."""
        return self.run.steady().force


@lru_cache(maxsize=2)  # several models are identified from one run, some from a shortened version of it
def _motion_of(run: Run) -> Excitation:
    analysis, window = analyse_motion(run), run.window
    if window is not None:
        early = window[0] - 1.0 / analysis.condition.frequency_Hz
        inside = np.flatnonzero((run.time >= early) & (run.time <= window[1]))
        run = run.part(int(inside[0]), int(inside[-1]) + 1)
    return measured_motion(run).about(analysis.series.mean)


@dataclass(frozen=True)
class Solution:
    """Result of an identification method."""

    model: Model
    delay: float  # [s]
    at_bounds: tuple[str, ...]
    # start, end: search coordinates
    start: Mapping[str, float]
    end: Mapping[str, float]
    evaluations: int
    ending: StopReason
    seed: int | None = None
    notes: tuple[str, ...] = ()


class Method(ABC):
    """A method to determine the free parameters."""

    name: ClassVar[str]
    summary: ClassVar[str] = ""

    @abstractmethod
    def solve(self, problem: Problem) -> Solution:
        """Determine the free parameters of a problem."""

    def for_many_runs(self) -> Method:
        """Return the method with reduced effort for dozens of runs."""
        return self


@dataclass(frozen=True)
class RunUncertainty:
    """Standard errors of a run's parameters and search coordinates, and notes on them."""

    # errors, dof: standard errors, and their degrees of freedom
    errors: Mapping[str, float] = field(default_factory=dict[str, float])
    dof: Mapping[str, float] = field(default_factory=dict[str, float])
    # independent samples with the same error for a white residual
    effective: Mapping[str, float] = field(default_factory=dict[str, float])
    doubts: tuple[str, ...] = ()  # parameters that the samples do not determine


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Displayable):
    """A model identified from one run."""

    run_id: str
    rig: str
    condition: Condition  # measured
    model: Model  # with the parameters found
    method: str  # its name
    free: tuple[str, ...]  # parameters determined
    at_bounds: tuple[str, ...]  # those that ended at a limit
    delay: float  # of the force channel [s]
    scores: Scores  # inside the steady window
    floor: float | None  # the run's cycle-to-cycle scatter as nrmse_pp, the lower limit of the error of any model
    # start, end: search coordinates the refinement began and ended at
    start: Mapping[str, float]
    end: Mapping[str, float]
    evaluations: int  # forces computed
    ending: StopReason
    seed: int | None  # of the random search, where one was used
    notes: tuple[str, ...]  # remarks on the parameters
    residual: Floats  # (N,) predicted minus measured force in the steady window [N]
    ask: Callable[[], RunUncertainty]  # returns the uncertainty, which takes longer than the search

    @cached_property
    def uncertainty(self) -> RunUncertainty:
        """Errors, their degrees of freedom, independent samples, and parameters that the samples do not determine."""
        try:
            return self.ask()
        except (np.linalg.LinAlgError, ArithmeticError) as error:
            unknown = dict.fromkeys(self.free, np.inf)
            return RunUncertainty(
                unknown, unknown, doubts=(f"the uncertainty of the parameters is {NOT_IDENTIFIABLE}: {error}",)
            )

    @property
    def standard_errors(self) -> Mapping[str, float]:
        """Standard errors of the free parameters and the search coordinates, for a correlated residual."""
        return self.uncertainty.errors

    @property
    def doubts(self) -> tuple[str, ...]:
        """Parameters with the same effect on the samples, and a record too short, in words."""
        return self.uncertainty.doubts

    def __getstate__(self) -> dict[str, Any]:
        """Compute the uncertainty, so that another process does not need the run."""
        return {**self.__dict__, "uncertainty": self.uncertainty, "ask": RunUncertainty}

    @property
    def headline(self) -> str:
        """Model, run, condition and residual."""
        fault = f"{100 * self.scores.nrmse_pp:.2f} %"
        return f"{self.model.name} from run {self.run_id} at {self.condition}: {fault} of the peak-to-peak force"

    @property
    def details(self) -> Sequence[str]:
        """Free parameters with their 95 % intervals and units, and the numbers of independent samples."""
        infos = {info.name: info for info in self.model.parameters()}
        lines: list[str] = []
        for name in self.free:
            state, ends = self._state(name), self.interval(name)
            count = (
                f"{self.uncertainty.effective[name]:.0f} of {self.residual.size} samples independent" if ends else ""
            )
            lines.append(f"{name} = {written(getattr(self.model, name), ends, infos[name].unit)} ({count or state})")
        return lines

    def _state(self, name: str) -> str:
        """Describe the state of one parameter."""
        if name not in self.free:
            return "held"
        if name not in self.standard_errors:
            return "at a bound: one-sided"
        return "determined" if self.interval(name) else NOT_IDENTIFIABLE

    @validate_arguments()
    def interval(self, name: str, level: float = 0.95) -> tuple[float, float] | None:
        """Return the ends of a parameter's interval within the form of the model; None where there is none.

        Raises `InputError` (E_LEVEL) if the level is not between 0 and 1.
        """
        error = self.standard_errors.get(name)
        if error is None:
            return None
        log = {info.name: info.scale == "log" for info in self.model.parameters()}.get(name, False)
        value = float(getattr(self.model, name))
        return interval_about(value, error / value if log else error, self.uncertainty.dof[name], level, log)

    @property
    def table(self) -> Mapping[str, Sequence[Any]]:
        """One row per parameter."""
        infos = self.model.parameters()
        names = [info.name for info in infos]
        intervals = [self.interval(name) for name in names]
        return {
            "parameter": names,
            "value": [float(getattr(self.model, name)) for name in names],
            "unit": [info.unit for info in infos],
            "standard_error": [self.standard_errors.get(name) for name in names],
            "low_95": [ends[0] if ends else None for ends in intervals],
            "high_95": [ends[1] if ends else None for ends in intervals],
            "effective_samples": [self.uncertainty.effective.get(name) for name in names],
            "state": [self._state(name) for name in names],
            "meaning": [info.meaning for info in infos],
        }
