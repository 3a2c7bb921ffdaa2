"""Measured and predicted loops as arrays in the units of the page."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrdamper.dampers.base import Damper
from mrdamper.data import Floats, Run
from mrdamper.models import Model
from mrdamper.physics.motion import Excitation, analyse_motion, centred_motion, equivalent_sine
from mrdamper.physics.simulation import simulate

MM = 1e3
_MAX_POINTS = 1000  # of a loop
_MAX_WINDOW_POINTS = 8000  # of a window of many cycles: fewer would show aliases of fast motion


def screen_arrays(
    motion: Excitation,
    force: Floats,
    picked: NDArray[np.intp] | None = None,
    start: float = 0.0,
    limit: int = _MAX_POINTS,
) -> dict[str, Floats]:
    """Return time [s] from `start`, displacement [mm], velocity [m/s] and force [N] of some samples, thinned."""
    picked = np.arange(len(motion)) if picked is None else picked
    if picked.size > limit:  # evenly, and the last sample closes the loop
        picked = picked[np.linspace(0, picked.size - 1, limit).round().astype(int)]
    return {
        "t": motion.time[picked] - start,
        "x": MM * motion.displacement[picked],
        "v": motion.velocity[picked],
        "F": force[picked],
    }


def measured_cycle(run: Run) -> dict[str, Floats]:
    """Return the last whole cycle of a steady sine, from mid-stroke with positive velocity."""
    return screen_arrays(centred_motion(run), run.force, *_last_cycle(run))


def measured_window(run: Run) -> dict[str, Floats]:
    """Return the steady window of a run."""
    return screen_arrays(centred_motion(run), run.force, np.flatnonzero(run.in_window), limit=_MAX_WINDOW_POINTS)


def raw_record(run: Run) -> dict[str, Floats]:
    """Return a whole record as in its file, for runs without motion."""
    velocity = np.zeros(run.time.size) if run.velocity is None else run.velocity
    motion = Excitation(run.time, run.displacement, velocity, np.zeros(run.time.size), run.current)
    return screen_arrays(motion, run.force, limit=_MAX_WINDOW_POINTS)


def modelled_cycle(model: Model, run: Run, delay: float = 0.0) -> dict[str, Floats]:
    """Return the force of a model at the samples of `measured_cycle`, for a force channel delayed by `delay` [s]."""
    motion = centred_motion(run)
    force = simulate(model, motion.delayed(delay) if delay else motion).force
    return screen_arrays(motion, force, *_last_cycle(run))


def predicted_on_run(damper: Damper, run: Run) -> tuple[dict[str, Floats], tuple[str, ...]]:
    """Return the force a damper predicts along the measured motion: last cycle of a sine, or the whole window."""
    prediction = damper.predict(run)
    motion, force = prediction.motion, prediction.force
    if equivalent_sine(run).is_sine:
        arrays = screen_arrays(motion, force, *_last_cycle(run))
    else:
        arrays = screen_arrays(motion, force, np.flatnonzero(run.in_window), limit=_MAX_WINDOW_POINTS)
    return arrays, prediction.extrapolation


def _last_cycle(run: Run) -> tuple[NDArray[np.intp], float]:
    """Return the samples of the last cycle in the steady window with a rising start, and its start [s]."""
    series = analyse_motion(run).series
    period = 1.0 / series.frequency
    crossing = series.origin - series.phase() * period / (2 * np.pi)
    end = float(run.time[run.in_window][-1])
    start = float(crossing + np.floor((end - crossing) / period - 1.0 + 1e-6) * period)
    first, last = np.searchsorted(run.time, (start, start + period))
    # from the sample before its start to the one after its end, so that the loop is closed
    return np.arange(max(int(first) - 1, 0), min(int(last) + 1, run.time.size)), start
