"""The ways to a model that are compared: the paper's recipe, its consistent counterpart, one fit, tradition."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from mrdamper.dampers.base import Damper, Envelope
from mrdamper.dampers.coil import Coil
from mrdamper.dampers.modified import ModifiedFit, fit_modified, fit_modified_jointly
from mrdamper.dampers.paper import Settled, paper_functions
from mrdamper.data import Condition, Floats, Run
from mrdamper.errors import IdentificationError
from mrdamper.identification import Identification, identify
from mrdamper.identification.harmonic_balance import SineRecord
from mrdamper.identification.methods.balance import Balance
from mrdamper.identification.methods.direct_genetic import DirectGenetic
from mrdamper.identification.methods.paper import Paper
from mrdamper.metrics import mean_relative_error
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.motion import Excitation
from mrdamper.simulation import Response, simulate, steady_loop
from mrdamper.study.workflow import Progress
from mrdamper.validation import Validation, validate

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
        made.append(contender(title, "paper", fit.damper, found, fit, held_out, time.perf_counter() - begin))
    progress(CONSISTENT, 0.5)
    begin = time.perf_counter()
    found = [settled.identify(run, Balance()) for run in train]
    spent = time.perf_counter() - begin
    for title, make in ((SAME_FORMS, paper_functions), (CONSISTENT, chosen_functions)):
        begin = time.perf_counter()
        fit = make(found)
        seconds = spent + time.perf_counter() - begin
        made.append(contender(title, "consistent", fit.damper, found, fit, held_out, seconds))
    progress(JOINT, 0.75)
    begin = time.perf_counter()
    plain = [identify(run, BoucWen, Balance()) for run in train]
    try:
        fit, _ = fit_modified_jointly(train, plain)
        made.append(contender(JOINT, "joint", fit.damper, plain, fit, held_out, time.perf_counter() - begin))
    except IdentificationError as error:
        progress(f"{JOINT}: left out, {error.found}", 0.9)
    for title, chosen in traditional(found, held_out).items():
        begin = time.perf_counter()
        damper = OnePerCurrent.of(chosen)
        seconds = spent * len(chosen) / len(found) + time.perf_counter() - begin
        made.append(contender(title, "traditional", damper, chosen, None, held_out, seconds))
    return made


def traditional(found: Sequence[Identification], held_out: Sequence[Run]) -> dict[str, list[Identification]]:
    """One identification a current: from the motion nearest in speed to the held-out runs, and from the slowest."""
    aims = {TRADITIONAL: _peak_velocity(held_out), SLOWEST: 0.0}
    return {title: [found[i] for i in _one_per_current([f.condition for f in found], v)] for title, v in aims.items()}


def direct_genetic(train: Sequence[Run], held_out: Sequence[Run], settled: Settled, progress: Progress) -> Contender:
    """All parameters at once by the genetic algorithm, one run a current."""
    begin = time.perf_counter()
    conditions = [SineRecord.of(run).condition for run in train]
    nearest = [train[i] for i in _one_per_current(conditions, _peak_velocity(held_out))]
    found = []
    for number, run in enumerate(nearest):
        progress(f"direct genetic, {run.id}", number / len(nearest))
        found.append(settled.identify(run, DirectGenetic()))
    damper = OnePerCurrent.of(found)
    return contender(DIRECT, "traditional", damper, found, None, held_out, time.perf_counter() - begin)


def contender(
    title: str,
    group: str,
    damper: Damper,
    found: Sequence[Identification],
    fit: ModifiedFit | None,
    held_out: Sequence[Run],
    seconds: float,
) -> Contender:
    """Validate a damper that was made in some way."""
    validation = validate(damper, held_out, title)
    errors = tuple(_relative_error(damper, run) for run in held_out)
    return Contender(title, group, damper, tuple(found), fit, validation, errors, seconds)


def _relative_error(damper: Damper, run: Run) -> float:
    inside = run.in_window
    return mean_relative_error(run.force[inside], damper.predict_run(run).force[inside])


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
    coil : Coil, optional
    """

    kind: ClassVar[str] = "one-per-current"

    rig: str
    models: tuple[tuple[float, BoucWen], ...]
    envelope: Envelope
    provenance: Mapping[str, str] = field(default_factory=dict)
    coil: Coil | None = None

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
        return simulate(self.at(condition), self.felt(motion)).force


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
