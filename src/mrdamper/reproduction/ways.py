"""The ways to a model that are compared: the paper's recipe, its consistent counterpart, one fit, tradition."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from mrdamper.damper import Damper, Envelope
from mrdamper.data import Condition, Floats, Run
from mrdamper.errors import IdentificationError
from mrdamper.excitation import Excitation
from mrdamper.gas_spring import GasSpring
from mrdamper.harmonic_balance import SineRecord, separate_mass
from mrdamper.identification import Identification, Method, Problem, identify
from mrdamper.identification.methods.balance import Balance
from mrdamper.identification.methods.direct_genetic import DirectGenetic
from mrdamper.identification.methods.paper import Paper
from mrdamper.metrics import mean_relative_error
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.modified import ModifiedFit, ModifiedModel, fit_modified, fit_modified_jointly
from mrdamper.parameter_functions import FunctionFit, ParameterMap, fit_function
from mrdamper.simulation import Response, simulate, steady_loop
from mrdamper.validation import Validation, validate
from mrdamper.workflow import Progress

PAPER_FORMS = {
    "c": "viscous-paper",
    "m": "mass-exponential",
    "alpha": "plane",
    "beta": "current-decay-frequency",
    "f0": "constant",
    "k1": "constant",
    "k2": "constant",
    "k3": "constant",
}
_SHORTER = ("quadratic-current", "linear-current", "constant")
LITERAL, HALF, SAME_FORMS = "paper, literal", "paper, F0 half peak-to-peak", "consistent, the paper's functions"
CONSISTENT, JOINT = "consistent", "joint"
TRADITIONAL = "traditional, nearest speed"
SLOWEST = "traditional, slowest motion"
DIRECT = "direct genetic, nearest speed"


@dataclass(frozen=True, eq=False)
class Contender:
    """One way to a model, and how it predicts.

    Attributes
    ----------
    title : str
    group : str
        "paper" (literal), "consistent", "joint" or "traditional".
    damper : Damper
    identifications : tuple of Identification
        Behind it.
    fit : ModifiedFit or None
        Parameter functions, where it has any.
    held_out : Validation
    relative_errors : tuple of float
        Mean relative error of each held-out run [Qian et al. 2024, Eq. 44].
    seconds : float
        Spent on identification and functions.
    """

    title: str
    group: str
    damper: Damper
    identifications: tuple[Identification, ...]
    fit: ModifiedFit | None
    held_out: Validation
    relative_errors: tuple[float, ...]
    seconds: float


@dataclass(frozen=True)
class Settled:
    """What is held in every identification: the gas spring, or what stands in for it."""

    gas: GasSpring | None
    fixed: Mapping[str, float] = field(default_factory=dict)
    free: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, train: Sequence[Run], gas: GasSpring | None) -> Settled:
        if gas is not None:
            longest = max(float(np.ptp(run.displacement)) / 2 for run in train)
            gas.force([-longest, longest])  # refuses motions that leave no gas volume
            return cls(gas)
        found = [identify(run, BoucWen, Balance()) for run in train]
        stiffness = [float(i.model.k1) for i in found if isinstance(i.model, BoucWen)]
        try:
            apart = separate_mass([i.condition for i in found], stiffness)
        except IdentificationError as error:
            return cls(
                None, notes=(f"the gas spring is unknown and {error}: the mass is left out, k1 holds k1 − m ω²",)
            )
        note = (
            f"the gas spring is unknown: k1 = {apart.k1:.4g} N/m comes from a regression of the consistent in-phase "
            f"stiffness k1 − m ω² over the frequencies (with m = {apart.m:.3g} kg); k2 = k3 = 0"
        )
        return cls(None, {"k1": apart.k1, "k2": 0.0, "k3": 0.0}, ("m",), (note,))

    def identify(self, run: Run, method: Method) -> Identification:
        return identify(run, BoucWen, method, gas=self.gas, fixed=self.fixed, free=self.free)

    def problem(self, run: Run) -> Problem:
        return Problem.of(run, BoucWen, gas=self.gas, fixed=self.fixed, free=self.free)


def contenders(train: Sequence[Run], held_out: Sequence[Run], settled: Settled, progress: Progress) -> list[Contender]:
    """Identify, map and validate in every way but the direct genetic one."""
    made = []
    literal = Paper(search="optimum")
    half = Paper(search="optimum", force_amplitude="half-peak-to-peak")
    for number, (title, method) in enumerate(((LITERAL, literal), (HALF, half))):
        progress(title, 0.25 * number)
        begin = time.perf_counter()
        found = [settled.identify(run, method) for run in train]
        fit = paper_functions(found)
        made.append(_contender(title, "paper", fit.damper, found, fit, held_out, time.perf_counter() - begin))
    progress(CONSISTENT, 0.5)
    begin = time.perf_counter()
    found = [settled.identify(run, Balance()) for run in train]
    spent = time.perf_counter() - begin
    for title, make in ((SAME_FORMS, paper_functions), (CONSISTENT, chosen_functions)):
        begin = time.perf_counter()
        fit = make(found)
        seconds = spent + time.perf_counter() - begin
        made.append(_contender(title, "consistent", fit.damper, found, fit, held_out, seconds))
    progress(JOINT, 0.75)
    begin = time.perf_counter()
    plain = [identify(run, BoucWen, Balance()) for run in train]
    try:
        fit, _ = fit_modified_jointly(train, plain)
        made.append(_contender(JOINT, "joint", fit.damper, plain, fit, held_out, time.perf_counter() - begin))
    except IdentificationError:
        pass  # too few runs; the other verdicts stand
    for title, chosen in traditional(found, held_out).items():
        begin = time.perf_counter()
        damper = OnePerCurrent.of(chosen)
        seconds = spent * len(chosen) / len(found) + time.perf_counter() - begin
        made.append(_contender(title, "traditional", damper, chosen, None, held_out, seconds))
    return made


def traditional(found: Sequence[Identification], held_out: Sequence[Run]) -> dict[str, list[Identification]]:
    """One identification a current: from the motion nearest in speed to the held-out runs, and from the slowest."""
    aims = {TRADITIONAL: _peak_velocity(held_out), SLOWEST: 0.0}
    return {title: [found[i] for i in _one_per_current([f.condition for f in found], v)] for title, v in aims.items()}


def direct_contender(train: Sequence[Run], held_out: Sequence[Run], settled: Settled, progress: Progress) -> Contender:
    """All parameters at once by the genetic algorithm, one run a current."""
    begin = time.perf_counter()
    conditions = [SineRecord.of(run).condition for run in train]
    nearest = [train[i] for i in _one_per_current(conditions, _peak_velocity(held_out))]
    found = []
    for number, run in enumerate(nearest):
        progress(f"direct genetic, {run.id}", number / len(nearest))
        found.append(settled.identify(run, DirectGenetic()))
    damper = OnePerCurrent.of(found)
    return _contender(DIRECT, "traditional", damper, found, None, held_out, time.perf_counter() - begin)


def _contender(
    title: str,
    group: str,
    damper: Damper,
    found: Sequence[Identification],
    fit: ModifiedFit | None,
    held_out: Sequence[Run],
    seconds: float,
) -> Contender:
    validation = validate(damper, held_out, title)
    errors = tuple(_relative_error(damper, run) for run in held_out)
    return Contender(title, group, damper, tuple(found), fit, validation, errors, seconds)


def _relative_error(damper: Damper, run: Run) -> float:
    inside = run.in_window
    return mean_relative_error(run.force[inside], damper.predict_run(run).force[inside])


def paper_functions(found: Sequence[Identification]) -> ModifiedFit:
    """The paper's functions [Qian et al. 2024, Eq. 23–43] by plain least squares.

    Shorter ones where the tests cannot tell the terms apart. beta spans decades and must stay
    positive: its function gives the logarithm.
    """
    conditions = tuple(i.condition for i in found)
    values = {name: np.array([float(getattr(i.model, name)) for i in found]) for name in PAPER_FORMS}
    functions = {
        name: _first_determined((form, *_SHORTER), conditions, values[name], log=name == "beta")
        for name, form in PAPER_FORMS.items()
    }
    damper = ModifiedModel(
        rig=found[0].rig,
        parameters=ParameterMap(BoucWen, {name: fit.function for name, fit in functions.items()}),
        envelope=Envelope.of(conditions),
    )
    return ModifiedFit(damper, functions, values, conditions)


def _first_determined(forms: Sequence[str], conditions: Sequence[Condition], values: Floats, log: bool) -> FunctionFit:
    for form in forms[:-1]:
        try:
            return fit_function(form, conditions, values, log=log)
        except IdentificationError:
            continue
    return fit_function(forms[-1], conditions, values, log=log)


def chosen_functions(found: Sequence[Identification]) -> ModifiedFit:
    """Functions chosen by how they predict left-out conditions."""
    forms = {**BoucWen.map_forms(), "k2": ("constant",), "m": ("constant", "quadratic-current")}
    # What was held has no function to find.
    held = {name for name in forms if name in BoucWen.__dataclass_fields__ and name not in found[0].free}
    return fit_modified(found, {name: ("constant",) if name in held else options for name, options in forms.items()})


@dataclass(frozen=True, eq=False)
class OnePerCurrent(Damper):
    """A model with one set of parameters for each current, from one motion: the traditional use.

    Attributes
    ----------
    rig : str
    models : tuple of (float, BoucWen)
        Current [A] and model.
    envelope : Envelope
    provenance : mapping
    """

    kind: ClassVar[str] = "one-per-current"

    rig: str
    models: tuple[tuple[float, BoucWen], ...]
    envelope: Envelope
    provenance: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, found: Sequence[Identification]) -> OnePerCurrent:
        """Take the models of identifications at different currents."""
        models = tuple((i.condition.current_A, i.model) for i in found if isinstance(i.model, BoucWen))
        return cls(found[0].rig, models, Envelope.of([i.condition for i in found]))

    @property
    def title(self) -> str:
        return "traditional Bouc–Wen"

    @property
    def parameter_count(self) -> int:
        # c, f0, alpha, beta and stiffness or mass; the rest is preset
        return 5 * len(self.models)

    def at(self, condition: Condition) -> BoucWen:
        """The model at the nearest current."""
        return min(self.models, key=lambda pair: abs(pair[0] - condition.current_A))[1]

    def loop(self, condition: Condition) -> Response:
        return steady_loop(self.at(condition), condition)

    def force_along(self, motion: Excitation, condition: Condition) -> Floats:
        return simulate(self.at(condition), motion).force


def _peak_velocity(runs: Sequence[Run]) -> float:
    return float(np.median([SineRecord.of(run).condition.peak_velocity for run in runs]))


def _one_per_current(conditions: Sequence[Condition], speed: float) -> list[int]:
    """At every current, the index of the condition whose peak velocity [m/s] is nearest to a speed."""
    nearest: dict[float, tuple[float, int]] = {}
    for index, condition in enumerate(conditions):
        key, off = round(condition.current_A, 2), abs(condition.peak_velocity - speed)
        if key not in nearest or off < nearest[key][0]:
            nearest[key] = off, index
    return [nearest[key][1] for key in sorted(nearest)]
