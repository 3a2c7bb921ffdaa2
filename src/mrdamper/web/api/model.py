"""The Model view: a damper under sliders, answered fast enough to be dragged."""

from __future__ import annotations

from functools import lru_cache
from threading import Lock
from time import thread_time
from typing import Any

import numpy as np
from fastapi import APIRouter
from fastapi.responses import Response
from pydantic import BaseModel, Field

from mrdamper.dampers.bands import band, no_band, scope
from mrdamper.dampers.base import Damper
from mrdamper.data import Condition, Floats
from mrdamper.data.encoding import finite
from mrdamper.physics.motion import Excitation
from mrdamper.statistics.metrics import dissipated_power, peak_force
from mrdamper.web.curves import on_screen, predicted_cycle
from mrdamper.web.held_parameters import held_model, loop_held, predict_held, sliders
from mrdamper.web.responses import frame
from mrdamper.web.rig_table import RigTable, condition_on_screen
from mrdamper.web.sessions import Bench, Current, Session, shared

router = APIRouter(prefix="/sessions/{session}/dampers")
_FAMILY = 10  # loops of a family over current, at most
_LEVEL = 0.9  # of the band around a loop
_OVER = {"peak": "peak_N", "energy": "energy_J"}
_OF_HAND = "no band: of a parameter held by hand the tests say nothing"
_TURN = Lock()  # answers in turn: small NumPy calls of many threads at once take the interpreter from each other
_QUANTITIES = ("current_A", "frequency_Hz", "amplitude_m")
_BEYOND = 1.25  # sliders and curves reach past the tested conditions, where the answer is flagged


class PredictionRequest(BaseModel, extra="forbid", allow_inf_nan=False):
    """Values of the sliders [SI units]."""

    current_A: float = Field(ge=0, le=1000)
    frequency_Hz: float = Field(gt=0, le=10_000)
    amplitude_m: float = Field(gt=0, le=10)
    held: dict[str, float] = Field(default_factory=dict, max_length=64)
    family: bool = False
    currents: int = Field(default=33, ge=0, le=100)
    band: bool = False

    @property
    def condition(self) -> Condition:
        """The condition asked for."""
        return Condition(self.current_A, self.frequency_Hz, self.amplitude_m)


@router.get("")
def dampers(session: Current) -> list[dict[str, Any]]:
    """All dampers on the bench, the newest last."""
    return [_head(bench) for bench in session.dampers.values()]


@router.get("/{key}")
def damper(key: str, session: Current) -> dict[str, Any]:
    """Return a damper's sliders and tested envelope."""
    bench = session.damper(key)
    chosen, e = bench.damper, bench.damper.envelope
    start = chosen.envelope.middle
    table = session.table_of(chosen.rig)
    near = table.nearest(start, 1, anywhere=True) if table else []
    if near and near[0].condition:
        start = near[0].condition  # one that was measured: there is something to compare with
    return {
        **_head(bench),
        "parameters": sliders(chosen),
        "follows": chosen.one_model is None,
        "start": {name: getattr(start, name) for name in _QUANTITIES},
        "envelope": {name: getattr(e, name) for name in (*_QUANTITIES, "peak_velocity_m_s")},
        "reach": {
            "current_A": (0.0, _BEYOND * (e.current_A[1] or 1.0)),
            "frequency_Hz": (e.frequency_Hz[0] / _BEYOND, e.frequency_Hz[1] * _BEYOND),
            "amplitude_m": (e.amplitude_m[0] / _BEYOND, e.amplitude_m[1] * _BEYOND),
        },
        "provenance": dict(chosen.provenance),
    }


@router.post("/{key}/predict")
def predict(key: str, ask: PredictionRequest, session: Current) -> Response:
    """Loops at a condition with a band or why there is none, the curves over current, what was measured nearest."""
    damper = session.damper(key, sure=ask.band and not ask.held).damper
    with _TURN:
        return _predicted(damper, ask, session)


def _predicted(damper: Damper, ask: PredictionRequest, session: Session) -> Response:
    arrays: dict[str, Any] = {}
    loops = []
    table, paces = session.table_of(damper.rig), []
    for name, condition in _loops(damper, ask, table):
        began = thread_time()  # of this damper's work alone, however busy the machine is
        prediction = predict_held(damper, condition, ask.held)
        paces.append(1e3 * (thread_time() - began))
        cycle = predicted_cycle(prediction)
        arrays |= {f"{name}.{axis}": values for axis, values in cycle.items()}
        figures = _figures(prediction.motion, prediction.force, ask.frequency_Hz)
        loops.append({"name": name, "current_A": condition.current_A, **figures})
        if name == "now" and ask.band and not ask.held and (around := band(damper, prediction, _LEVEL)):
            for end, force in (("low", around.low), ("high", around.high)):
                arrays |= {f"{end}.{axis}": v for axis, v in on_screen(prediction.motion, force).items()}
            loops[-1] |= {
                "peak_from_N": around.peak[0],
                "peak_to_N": around.peak[1],
                "level": _LEVEL,
                "scope": scope(damper, _LEVEL),
            }
        elif name == "now" and ask.band:
            loops[-1]["no_band"] = _OF_HAND if ask.held else no_band(damper)
    if ask.currents:
        held = tuple(sorted(ask.held.items()))
        arrays |= _over_current(damper, held, ask.frequency_Hz, ask.amplitude_m, ask.currents)
    model = held_model(damper, ask.condition, ask.held)
    head = {
        "loops": loops,
        "pace_ms": min(paces),
        "peak_velocity_m_s": ask.condition.peak_velocity,
        "extrapolation": damper.envelope.flags(ask.condition),
        "tested_A": damper.envelope.current_A,
        "parameters": {n: finite(v) for n, v in model.values().items()} if model else {},
        "nearest": [_measured(row) for row in table.nearest(ask.condition)] if table else [],
        "measured": [_measured(row) for row in table.at_motion(ask.condition)] if table else [],
    }
    return frame(head, arrays)


def _loops(damper: Damper, ask: PredictionRequest, table: RigTable | None) -> list[tuple[str, Condition]]:
    """Return the loop asked for, and where wished those at the currents of the tests."""
    loops = [("now", ask.condition)]
    if ask.family:
        currents = _tested_currents(damper, table)
        loops += [(f"family{i}", Condition(c, ask.frequency_Hz, ask.amplitude_m)) for i, c in enumerate(currents)]
    return loops


def _tested_currents(damper: Damper, table: RigTable | None) -> list[float]:
    """Levels of the tests on the bench, or the ends of what the damper says was tested."""
    levels = list(table.currents) if table else list(damper.envelope.current_A)
    picked = np.linspace(0, len(levels) - 1, min(len(levels), _FAMILY - 1)).round().astype(int)
    return sorted({levels[i] for i in picked})


@shared
@lru_cache(maxsize=64)  # the same while the current is moved, and in every session with the same damper
def _over_current(
    damper: Damper, held: tuple[tuple[str, float], ...], frequency_Hz: float, amplitude_m: float, points: int
) -> dict[str, Any]:
    even = np.linspace(0.0, _BEYOND * (damper.envelope.current_A[1] or 1.0), max(points - 2, 2))
    currents = np.union1d(even, damper.envelope.current_A)  # the line changes its dash where the tests end
    conditions = [Condition(float(I), frequency_Hz, amplitude_m) for I in currents]
    loops = [loop_held(damper, condition, dict(held)) for condition in conditions]
    figures = [_figures(loop.excitation, loop.force, frequency_Hz) for loop in loops]
    curves = {f"over.{end}": np.array([f[name] for f in figures]) for end, name in _OVER.items()}
    return {"over.current": currents, **curves}


def _figures(motion: Excitation, force: Floats, frequency_Hz: float) -> dict[str, float]:
    power = dissipated_power(force, motion.velocity, motion.time)
    return {"peak_N": peak_force(force), "energy_J": power / frequency_Hz}


def _measured(row: Any) -> dict[str, Any]:
    return {
        "key": row.key,
        "id": row.run.id,
        "split": row.run.split,
        "condition": condition_on_screen(row.condition),
        "peak_N": finite(row.loop.peak_force),
        "energy_J": finite(row.loop.dissipated_energy),
    }


def _head(bench: Bench) -> dict[str, Any]:
    return {
        "key": bench.key,
        "title": bench.damper.title,
        "rig": bench.damper.rig,
        "numbers": bench.damper.parameter_count,
        "origin": bench.origin,
        "note": bench.note,
        "error": finite(bench.error),
        "selected": bench.selected,
    }
