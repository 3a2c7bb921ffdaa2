"""The Ride view: a damper of the bench at work in a building or a vehicle, under a control law."""

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
from mrdamper.systems.structure import System
from mrdamper.systems.system_file import bundled_systems, load_system
from mrdamper.web.responses import frame
from mrdamper.web.sessions import Current, shared

router = APIRouter(prefix="/sessions/{session}/ride")
_LENGTH = 8.0  # s of a road
_SAMPLES = 2000  # of a history that travel to the page
_TURN = Lock()  # one at a time: each takes seconds
_FORCE_SHARE = 0.08  # force of the dampers over the weight of the body [-]
_GRAVITY = 9.81  # acceleration of gravity [m/s²]
_SLOWEST = 0.2  # Hz; what of the ground's motion is slower than this is left out of the picture


class RideRequest(BaseModel, extra="forbid", allow_inf_nan=False):
    """Choices of the panel."""

    damper: str = Field(max_length=64)
    system: str = Field(max_length=64)
    source: str = Field(max_length=64)
    control: str = Field(max_length=64)
    current_A: float = Field(ge=0, le=1000)
    scaled: bool = False  # masses and springs of a vehicle to the force of the damper


@router.get("/choices")
def choices(session: Current) -> dict[str, Any]:
    """Systems, what shakes them, and laws."""
    records = [{"name": f"{name}@{speed}", "title": f"{name}, {speed} × speed" if speed > 1 else name}
               for name in bundled_records() for speed in (5, 1)]  # fmt: skip
    roads = [name for name, (kind, _) in made_inputs().items() if kind.kind == "road"]
    laws = [{"name": name, "title": kind.title} for name, kind in controller_types().items() if name != "passive"]
    systems = [(name, load_system(name).system) for name in bundled_systems()]
    return {
        "systems": [{"name": name, "title": s.title, "kind": _kind(s)} for name, s in systems],
        "sources": {"ground": records, "road": [{"name": name, "title": _road_title(name)} for name in roads]},
        "controls": [{"name": "passive", "title": Passive.title}, *laws],
    }


@router.post("")
def ride(ask: RideRequest, session: Current) -> Response:
    """Histories of a system with a damper under a law, and with that damper left without current."""
    if ask.system not in bundled_systems():  # a name, never a path of this machine
        raise UnknownNameError.of("system", ask.system, bundled_systems())
    with _TURN:  # whoever asks the same meanwhile gets the same
        return frame(
            *_ridden(session.damper(ask.damper).damper, ask.system, ask.source, ask.control, ask.current_A, ask.scaled)
        )


@shared
@lru_cache(maxsize=48)
def _ridden(
    damper: Damper, name: str, source_name: str, control: str, current_A: float, scaled: bool
) -> tuple[dict[str, Any], dict[str, Floats]]:
    """Head and histories of a ride; shared by all sessions with the same damper."""
    system, source, capacity, scale = _setting(damper, name, source_name, scaled)
    kind = controller_type(control)
    law = with_values(kind, {"current_A": current_A}) if kind is Passive else kind()
    dampers = dict.fromkeys((link.name for link in system.dampers), damper)
    done = simulate_system(system, source, dampers, law, highest=None if kind is Passive else current_A)
    idle, idle_cost = _idle(damper, name, source_name, scaled, done.step)
    head = {
        "kind": _kind(system),
        "scale": scale,
        "capacity_N": capacity,
        "title": f"{system.title}, {type(law).title}",
        "coordinates": system.coordinates,
        "channels": system.channels,
        "dampers": [link.name for link in done.dampers],
        "calm": system.coordinates[-1 if system.ground is not None else 0],
        "peaks": {name: values.tolist() for name, values in done.peaks.items()},
        "gain": finite(1 - (cost(done) / idle_cost) ** 0.5 if idle_cost > 0 else None),
        "outside": done.outside,
        "settled": done.settled,
        "step_s": done.step,
        "halving": finite(done.halving),
        "energy_gap": finite(done.energy_gap),
    }
    return head, _thinned(_histories(done, source)) | idle


@shared
@lru_cache(maxsize=16)
def _setting(damper: Damper, name: str, source: str, scaled: bool) -> tuple[System, Input, float, float]:
    """System, its input, the force of the damper [N] and the scale of a vehicle."""
    system, capacity, scale = load_system(name).system, _capacity(damper), 1.0
    if scaled and _kind(system) == "road":
        scale = float(f"{capacity * len(system.dampers) / (_FORCE_SHARE * _GRAVITY * system.M[0, 0]):.2g}")
        system = _scaled(system, scale)
    return system, _source(source, system), capacity, scale


@shared
@lru_cache(maxsize=16)
def _idle(damper: Damper, name: str, source_name: str, scaled: bool, step: float) -> tuple[dict[str, Floats], float]:
    """Accelerations of the system with that damper left without current, and its cost."""
    system, source, *_ = _setting(damper, name, source_name, scaled)
    dampers = dict.fromkeys((link.name for link in system.dampers), damper)
    idle = SystemLoop(system, source, dampers, Passive()).run(step)
    return _thinned({f"idle.{at}": idle.a[:, i] for i, at in enumerate(system.coordinates)}), cost(idle)


def _thinned(histories: dict[str, Floats]) -> dict[str, Floats]:
    """As many samples as the page shows."""
    return {name: values[:: -(-values.size // _SAMPLES)].astype("<f4") for name, values in histories.items()}


def _road_title(name: str) -> str:
    """Return the title of a road: "ISO 8608 road, class B" for iso8608-b."""
    standard, _, grade = name.partition("-")
    return f"ISO 8608 road, class {grade.upper()}" if standard == "iso8608" and grade else name


def _capacity(damper: Damper) -> float:
    """Predict the peak force [N] at the highest tested current and a middle motion."""
    e = damper.envelope
    return peak_force(damper.predict(replace(e.middle, current_A=e.current_A[1])).force)


def _scaled(system: System, factor: float) -> System:
    """Multiply masses, dashpots and springs; frequencies and strokes under the same road stay."""
    links = tuple(
        replace(link, stiffness=factor * link.stiffness, damping=factor * link.damping) for link in system.links
    )
    push = None if system.push is None else (factor * system.push[0], factor * system.push[1])
    return replace(system, M=factor * system.M, C=factor * system.C, K=factor * system.K, push=push, links=links)


def _kind(system: System) -> str:
    return "ground" if system.ground is not None else "road"


def _source(name: str, system: System) -> Input:
    record, _, speed = name.partition("@")
    sources = made_inputs() if _kind(system) == "road" else bundled_records()
    if record not in sources:
        raise UnknownNameError.of("input", record, sources)
    if _kind(system) == "road":
        return load_input(record, {"length_s": _LENGTH})
    return load_input(record, time_scale=5.0 if speed == "5" else 1.0)


def _histories(done: Simulation, source: Input) -> dict[str, Floats]:
    columns = {"time": done.time}
    for i, name in enumerate(done.system.coordinates):
        columns |= {f"x.{name}": done.x[:, i], f"a.{name}": done.a[:, i]}
    for i, link in enumerate(done.links):
        if link.role == "damper":
            columns |= {f"stroke.{link.name}": done.stroke[:, i], f"force.{link.name}": done.force[:, i]}
            columns[f"current.{link.name}"] = done.current[:, i]
    if done.system.ground is not None:
        return columns | {"way.ground": _moved(source.value(done.time), done.step)}
    return columns | {f"way.{name}": done.road[:, i] for i, name in enumerate(done.system.channels)}


def _moved(acceleration: Floats, step: float) -> Floats:
    """(N,) displacement [m] behind an acceleration, without what is too slow to be told from drift."""
    omega = 2 * np.pi * np.fft.rfftfreq(2 * acceleration.size, step)
    spectrum = np.fft.rfft(acceleration, 2 * acceleration.size)
    kept = omega > 2 * np.pi * _SLOWEST
    moved = np.where(kept, -spectrum / np.where(kept, omega, 1.0) ** 2, 0.0)
    return np.fft.irfft(moved, 2 * acceleration.size)[: acceleration.size]
