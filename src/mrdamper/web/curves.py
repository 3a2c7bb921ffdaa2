"""Loops as arrays in the units of the screen: measured, predicted, and both over one run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrdamper.dampers.base import Damper
from mrdamper.dampers.prediction import Prediction
from mrdamper.data import Floats, Run
from mrdamper.models import Model
from mrdamper.physics.motion import Excitation, analyse_motion, centred_motion, equivalent_sine
from mrdamper.physics.simulation import simulate

MM = 1e3
MOST_POINTS = 1000  # of a loop on the screen
_MOST_OF_WINDOW = 8000  # of a window of many cycles: fewer would show fast motion as another


def on_screen(
    motion: Excitation,
    force: Floats,
    picked: NDArray[np.intp] | None = None,
    start: float = 0.0,
    most: int = MOST_POINTS,
) -> dict[str, Floats]:
    """Time [s] from `start`, displacement [mm], velocity [m/s] and force [N] of some samples, thinned."""
    picked = np.arange(len(motion)) if picked is None else picked
    if picked.size > most:  # evenly, and the last sample closes the loop
        picked = picked[np.linspace(0, picked.size - 1, most).round().astype(int)]
    return {
        "t": motion.time[picked] - start,
        "x": MM * motion.displacement[picked],
        "v": motion.velocity[picked],
        "F": force[picked],
    }


def measured_cycle(run: Run) -> dict[str, Floats]:
    """Return the last whole cycle of a steady sine, from its way up through mid-stroke on."""
    return on_screen(centred_motion(run), run.force, *_last_cycle(run))


def measured_window(run: Run) -> dict[str, Floats]:
    """All of a run's steady window."""
    return on_screen(centred_motion(run), run.force, np.flatnonzero(run.in_window), most=_MOST_OF_WINDOW)


def raw_record(run: Run) -> dict[str, Floats]:
    """Return a whole record as it stands in the file, for runs without motion."""
    velocity = np.zeros(run.time.size) if run.velocity is None else run.velocity
    motion = Excitation(run.time, run.displacement, velocity, np.zeros(run.time.size), run.current)
    return on_screen(motion, run.force, most=_MOST_OF_WINDOW)


def predicted_cycle(prediction: Prediction) -> dict[str, Floats]:
    """Return a predicted closed loop."""
    return on_screen(prediction.motion, prediction.force)


def modelled_cycle(model: Model, run: Run, delay: float = 0.0) -> dict[str, Floats]:
    """Return the force of a model over the samples of `measured_cycle`, its force channel late by `delay` [s]."""
    motion = centred_motion(run)
    force = simulate(model, motion.delayed(delay) if delay else motion).force
    return on_screen(motion, force, *_last_cycle(run))


def predicted_on_run(damper: Damper, run: Run) -> tuple[dict[str, Floats], tuple[str, ...]]:
    """Return the force a damper predicts along the measured motion: last cycle of a sine, or the whole window."""
    prediction = damper.predict(run)
    if equivalent_sine(run).is_sine:
        return on_screen(prediction.motion, prediction.force, *_last_cycle(run)), prediction.extrapolation
    window = np.flatnonzero(run.in_window)
    return on_screen(prediction.motion, prediction.force, window, most=_MOST_OF_WINDOW), prediction.extrapolation


def _last_cycle(run: Run) -> tuple[NDArray[np.intp], float]:
    """Return samples of the last cycle inside the steady window that begins on the way up, and its start [s]."""
    series = analyse_motion(run).series
    period = 1.0 / series.frequency
    crossing = series.origin - series.phase() * period / (2 * np.pi)
    end = float(run.time[run.in_window][-1])
    start = float(crossing + np.floor((end - crossing) / period - 1.0 + 1e-6) * period)
    first, last = np.searchsorted(run.time, (start, start + period))
    # From the sample before it begins to the one after it ends: the loop is closed as far as the record goes.
    return np.arange(max(int(first) - 1, 0), min(int(last) + 1, run.time.size)), start
