"""The Simulate view: a damper in a building or a vehicle, under a control law."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from threading import Lock
from typing import Any

import numpy as np
from fastapi import APIRouter
from fastapi.responses import Response
from pydantic import BaseModel, Field

from mrdamper.dampers.base import Damper
from mrdamper.data import Floats
from mrdamper.data.encoding import finite
from mrdamper.data.parameters import with_values
from mrdamper.errors import UnknownNameError
from mrdamper.statistics.metrics import peak_force
from mrdamper.systems.controllers import controller_type, controller_types
from mrdamper.systems.controllers.passive import Passive
from mrdamper.systems.inputs import Input, bundled_records, load_input, made_inputs
from mrdamper.systems.measures import cost
from mrdamper.systems.result import Simulation
from mrdamper.systems.simulate import SystemLoop, simulate_system
from mrdamper.systems.structure import GRAVITY, System
from mrdamper.systems.system_file import bundled_systems, load_system
from mrdamper.web.responses import frame
from mrdamper.web.sessions import OpenSession, shared

router = APIRouter(prefix="/sessions/{session}/simulate")
_ROAD_S = 8.0
_MAX_SAMPLES = 2000  # of a history on the page
_LOCK = Lock()  # one at a time: each takes seconds
_FORCE_SHARE = 0.08  # force of the dampers over the weight of the body [-]
_LOWEST_HZ = 0.2  # slower motion of the ground is not shown


class SimulateRequest(BaseModel, extra="forbid", allow_inf_nan=False):
    """Choices of the panel."""

    damper: str = Field(max_length=64)
    system: str = Field(max_length=64)
    source: str = Field(max_length=64)
    control: str = Field(max_length=64)
    current_A: float = Field(ge=0, le=1000)
    scaled: bool = False  # masses and springs of a vehicle to the force of the damper


@router.get("/choices")
def choices(session: OpenSession) -> dict[str, Any]:
    """List systems, inputs by their kind, and control laws."""
    records = [(f"{name}@{speed}", f"{name}, {speed} × speed" if speed > 1 else name)
               for name in bundled_records() for speed in (5, 1)]  # fmt: skip
    roads = [(name, _road_title(name)) for name, (kind, _) in made_inputs().items() if kind.kind == "road"]
    laws = [(name, kind.title) for name, kind in controller_types().items() if name != "passive"]
    systems = {name: load_system(name).system for name in bundled_systems()}
    return {
        "systems": [{"name": name, "title": s.title, "kind": _kind(s)} for name, s in systems.items()],
        "sources": {"ground": _titled(records), "road": _titled(roads)},
        "controls": _titled([("passive", Passive.title), *laws]),
    }


@router.post("")
def simulate(query: SimulateRequest, session: OpenSession) -> Response:
    """Return histories of a system with a damper under a control law, and with that damper at 0 A."""
    if query.system not in bundled_systems():  # a name, never a path of this machine
        raise UnknownNameError.of("system", query.system, bundled_systems())
    damper = session.damper(query.damper).damper
    with _LOCK:  # equal requests meanwhile receive the same result
        return frame(*_simulated(damper, query.system, query.source, query.control, query.current_A, query.scaled))


@shared
@lru_cache(maxsize=48)
def _simulated(
    damper: Damper, system_name: str, source_name: str, control: str, current_A: float, scaled: bool
) -> tuple[dict[str, Any], dict[str, Floats]]:
    """Return head and histories; shared by all sessions with the same damper."""
    system, source, capacity, scale = _setup(damper, system_name, source_name, scaled)
    kind = controller_type(control)
    law = with_values(kind, {"current_A": current_A}) if kind is Passive else kind()
    dampers = dict.fromkeys((link.name for link in system.dampers), damper)
    result = simulate_system(system, source, dampers, law, highest=None if kind is Passive else current_A)
    passive, passive_cost = _passive(damper, system_name, source_name, scaled, result.step)
    head = {
        "title": f"{system.title}, {type(law).title}", "kind": _kind(system), "scale": scale, "capacity_N": capacity,
        "coordinates": system.coordinates, "channels": system.channels,
        "coordinate": system.coordinates[-1 if system.ground is not None else 0],  # whose acceleration is shown
        "dampers": [link.name for link in result.dampers],
        "peaks": {name: values.tolist() for name, values in result.peaks.items()},
        "gain": finite(1 - (cost(result) / passive_cost) ** 0.5 if passive_cost > 0 else None),
        "outside": result.outside, "converged": result.settled,
        "step_s": result.step, "halving": finite(result.halving),
    }  # fmt: skip
    return head, _thinned(_histories(result, source)) | passive


@shared
@lru_cache(maxsize=16)
def _setup(damper: Damper, system_name: str, source_name: str, scaled: bool) -> tuple[System, Input, float, float]:
    """Return a system, its input, the force of the damper [N] and the scale of a vehicle."""
    system, e, scale = load_system(system_name).system, damper.envelope, 1.0
    capacity = peak_force(damper.predict(replace(e.middle, current_A=e.current_A[1])).force)
    if scaled and _kind(system) == "road":
        scale = float(f"{capacity * len(system.dampers) / (_FORCE_SHARE * GRAVITY * system.M[0, 0]):.2g}")
        system = _scaled(system, scale)
    return system, _source(source_name, system), capacity, scale


@shared
@lru_cache(maxsize=16)
def _passive(
    damper: Damper, system_name: str, source_name: str, scaled: bool, step: float
) -> tuple[dict[str, Floats], float]:
    """Return accelerations of the system with that damper at 0 A, and the cost."""
    system, source, *_ = _setup(damper, system_name, source_name, scaled)
    dampers = dict.fromkeys((link.name for link in system.dampers), damper)
    result = SystemLoop(system, source, dampers, Passive()).run(step)
    return _thinned({f"passive.{name}": result.a[:, i] for i, name in enumerate(system.coordinates)}), cost(result)


def _titled(pairs: list[tuple[str, str]]) -> list[dict[str, str]]:
    return [{"name": name, "title": title} for name, title in pairs]


def _thinned(histories: dict[str, Floats]) -> dict[str, Floats]:
    return {name: values[:: -(-values.size // _MAX_SAMPLES)].astype("<f4") for name, values in histories.items()}


def _road_title(name: str) -> str:
    """Return the title of a road: "ISO 8608 road, class B" for iso8608-b."""
    standard, _, grade = name.partition("-")
    return f"ISO 8608 road, class {grade.upper()}" if standard == "iso8608" and grade else name


def _scaled(system: System, factor: float) -> System:
    """Multiply masses, dashpots and springs; frequencies and strokes on the same road remain."""
    links = tuple(replace(k, stiffness=factor * k.stiffness, damping=factor * k.damping) for k in system.links)
    push = None if system.push is None else (factor * system.push[0], factor * system.push[1])
    return replace(system, M=factor * system.M, C=factor * system.C, K=factor * system.K, push=push, links=links)


def _kind(system: System) -> str:
    return "ground" if system.ground is not None else "road"


def _source(name: str, system: System) -> Input:
    record, _, speed = name.partition("@")
    road = _kind(system) == "road"
    sources = made_inputs() if road else bundled_records()
    if record not in sources:
        raise UnknownNameError.of("input", record, sources)
    if road:
        return load_input(record, {"length_s": _ROAD_S})
    return load_input(record, time_scale=5.0 if speed == "5" else 1.0)


def _histories(result: Simulation, source: Input) -> dict[str, Floats]:
    columns = {"time": result.time}
    for i, name in enumerate(result.system.coordinates):
        columns |= {f"x.{name}": result.x[:, i], f"a.{name}": result.a[:, i]}
    for i, link in enumerate(result.links):
        if link.role == "damper":
            channels = {"stroke": result.stroke, "force": result.force, "current": result.current}
            columns |= {f"{channel}.{link.name}": values[:, i] for channel, values in channels.items()}
    if result.system.ground is not None:
        return columns | {"input.ground": _displacement(source.value(result.time), result.step)}
    return columns | {f"input.{name}": result.road[:, i] for i, name in enumerate(result.system.channels)}


def _displacement(acceleration: Floats, step: float) -> Floats:
    """(N,) displacement [m] of an acceleration, without the low frequencies that drift dominates."""
    omega = 2 * np.pi * np.fft.rfftfreq(2 * acceleration.size, step)
    spectrum = np.fft.rfft(acceleration, 2 * acceleration.size)
    kept = omega > 2 * np.pi * _LOWEST_HZ
    displacement = np.where(kept, -spectrum / np.where(kept, omega, 1.0) ** 2, 0.0)
    return np.fft.irfft(displacement, 2 * acceleration.size)[: acceleration.size]
