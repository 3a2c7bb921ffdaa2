"""The Model view: loops of a damper for the values of its sliders, fast enough to drag them."""

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
from mrdamper.dampers.prediction import Prediction
from mrdamper.data import Condition, Floats
from mrdamper.data.encoding import finite
from mrdamper.physics.motion import Excitation
from mrdamper.report.plots.cycle import spread_out
from mrdamper.statistics.metrics import dissipated_power, peak_force
from mrdamper.web.curves import screen_arrays
from mrdamper.web.held_parameters import held_loop, held_model, predict_held, sliders
from mrdamper.web.responses import frame
from mrdamper.web.rig_table import RigTable, TableRow, describe
from mrdamper.web.sessions import OpenSession, Session, SessionDamper, shared

router = APIRouter(prefix="/sessions/{session}/dampers")
_MAX_FAMILY = 10  # loops of a family over current
_LEVEL = 0.9  # of the prediction interval
_HELD = "no prediction interval: the tests carry no information on a parameter held by hand"
_LOCK = Lock()  # one response at a time: threads with small NumPy calls slow each other down
_QUANTITIES = ("current_A", "frequency_Hz", "amplitude_m")
_BEYOND = 1.25  # factor to which sliders and curves exceed the tested conditions


class Held(BaseModel, extra="forbid", allow_inf_nan=False):
    """Parameters held by hand."""

    held: dict[str, float] = Field(default_factory=dict, max_length=64)


class PredictionRequest(Held):
    """Values of the sliders [SI units]."""

    current_A: float = Field(ge=0, le=1000)
    frequency_Hz: float = Field(gt=0, le=10_000)
    amplitude_m: float = Field(gt=0, le=10)
    family: bool = False
    currents: int = Field(default=33, ge=0, le=100)
    interval: bool = False

    @property
    def condition(self) -> Condition:
        """The condition of the sliders."""
        return Condition(self.current_A, self.frequency_Hz, self.amplitude_m)


@router.get("")
def dampers(session: OpenSession) -> list[dict[str, Any]]:
    """List all dampers of the session, the newest last."""
    return [_describe(damper) for damper in session.dampers.values()]


@router.get("/{key}")
def damper(key: str, session: OpenSession) -> dict[str, Any]:
    """Return the sliders and the tested envelope of a damper."""
    damper = session.damper(key)
    model, e = damper.damper, damper.damper.envelope
    start = e.middle
    table = session.table_of(model.rig)
    nearest = table.nearest(start, 1, any_distance=True) if table else []
    if nearest and nearest[0].condition:
        start = nearest[0].condition  # a measured one, for comparison
    return {
        **_describe(damper),
        "parameters": sliders(model),
        "follows": model.one_model is None,
        "start": {name: getattr(start, name) for name in _QUANTITIES},
        "envelope": {name: getattr(e, name) for name in (*_QUANTITIES, "peak_velocity_m_s")},
        "reach": {
            "current_A": (0.0, _BEYOND * (e.current_A[1] or 1.0)),
            "frequency_Hz": (e.frequency_Hz[0] / _BEYOND, e.frequency_Hz[1] * _BEYOND),
            "amplitude_m": (e.amplitude_m[0] / _BEYOND, e.amplitude_m[1] * _BEYOND),
        },
    }


@router.post("/{key}/predict")
def predict(key: str, query: PredictionRequest, session: OpenSession) -> Response:
    """Return loops at a condition with their interval, the curves over current, and the nearest measured runs."""
    damper = session.damper(key, with_uncertainty=query.interval and not query.held).damper
    with _LOCK:
        return _predicted(damper, query, session)


def _predicted(damper: Damper, query: PredictionRequest, session: Session) -> Response:
    arrays: dict[str, Any] = {}
    loops, times = [], []
    table = session.table_of(damper.rig)
    for name, condition in _conditions(damper, query, table):
        began = thread_time()  # of this damper alone, however busy the machine is
        prediction = predict_held(damper, condition, query.held)
        times.append(1e3 * (thread_time() - began))
        arrays |= {
            f"{name}.{axis}": values for axis, values in screen_arrays(prediction.motion, prediction.force).items()
        }
        peak, energy = _peak_and_energy(prediction.motion, prediction.force, query.frequency_Hz)
        loops.append({"name": name, "current_A": condition.current_A, "peak_N": peak, "energy_J": energy})
        if name == "now" and query.interval:
            loops[-1] |= _interval(damper, prediction, query, arrays)
    if query.currents:
        held = tuple(sorted(query.held.items()))
        arrays |= _over_current(damper, held, query.frequency_Hz, query.amplitude_m, query.currents)
    model = held_model(damper, query.condition, query.held)
    head = {
        "loops": loops,
        "loop_ms": min(times),
        "peak_velocity_m_s": query.condition.peak_velocity,
        "extrapolation": damper.envelope.flags(query.condition),
        "tested_A": damper.envelope.current_A,
        "parameters": {n: finite(v) for n, v in model.values().items()} if model else {},
        "nearest": [_measured(row) for row in table.nearest(query.condition)] if table else [],
        "measured": [_measured(row) for row in table.at_motion(query.condition)] if table else [],
    }
    return frame(head, arrays)


def _conditions(damper: Damper, query: PredictionRequest, table: RigTable | None) -> list[tuple[str, Condition]]:
    """Return the condition of the sliders, and for a family those at the currents of the tests."""
    conditions = [("now", query.condition)]
    if query.family:  # at the levels of the loaded tests, or the ends of the tested currents
        levels = list(table.currents) if table else list(damper.envelope.current_A)
        for i, level in enumerate(sorted(set(spread_out(levels, _MAX_FAMILY - 1)))):
            conditions.append((f"family{i}", Condition(level, query.frequency_Hz, query.amplitude_m)))
    return conditions


def _interval(
    damper: Damper, prediction: Prediction, query: PredictionRequest, arrays: dict[str, Any]
) -> dict[str, Any]:
    """Return the prediction interval of a loop, or the reason why there is none; its curves are added to `arrays`."""
    around = None if query.held else band(damper, prediction, _LEVEL)
    if around is None:
        return {"no_interval": _HELD if query.held else no_band(damper)}
    for end, force in (("low", around.low), ("high", around.high)):
        arrays.update({f"{end}.{axis}": values for axis, values in screen_arrays(prediction.motion, force).items()})
    low, high = around.peak
    return {"peak_from_N": low, "peak_to_N": high, "level": _LEVEL, "scope": scope(damper, _LEVEL)}


@shared
@lru_cache(maxsize=64)  # the same while the current is moved, and in every session with the same damper
def _over_current(
    damper: Damper, held: tuple[tuple[str, float], ...], frequency_Hz: float, amplitude_m: float, points: int
) -> dict[str, Any]:
    even = np.linspace(0.0, _BEYOND * (damper.envelope.current_A[1] or 1.0), max(points - 2, 2))
    currents = np.union1d(even, damper.envelope.current_A)  # the curve is dashed from the ends of the tested currents
    loops = [held_loop(damper, Condition(float(I), frequency_Hz, amplitude_m), dict(held)) for I in currents]
    peak, energy = np.array([_peak_and_energy(loop.excitation, loop.force, frequency_Hz) for loop in loops]).T
    return {"over.current": currents, "over.peak": peak, "over.energy": energy}


def _peak_and_energy(motion: Excitation, force: Floats, frequency_Hz: float) -> tuple[float, float]:
    """Return peak force [N] and energy per cycle [J]."""
    return peak_force(force), dissipated_power(force, motion.velocity, motion.time) / frequency_Hz


def _measured(row: TableRow) -> dict[str, Any]:
    described = describe(row)
    return {name: described[name] for name in ("key", "id", "split", "condition", "peak_N", "energy_J")}


def _describe(damper: SessionDamper) -> dict[str, Any]:
    return {
        **{name: getattr(damper, name) for name in ("key", "origin", "note", "selected")},
        "title": damper.damper.title,
        "rig": damper.damper.rig,
        "parameter_count": damper.damper.parameter_count,
        "error": finite(damper.error),
    }
