"""Force that is late against the motion, beyond what hysteresis explains.

A viscous force that is late looks like a spring, a hysteretic one like more hysteresis; but
no passive force goes on rising after the motion has turned. So the force is explained by
springs, velocity terms and elastic–plastic elements of several yield displacements (a
Prandtl–Ishlinskii sum, which can be any hysteresis that does not depend on rate), all
delayed together, and the delay that explains it best is the lag.

What has no corner cannot be dated: a smooth force that is late is, on one sine, exactly a
force with a spring. So not every late force is said. Of forces of seven kinds of dampers
that are late by 5 % of the period about seven in ten are, by 8 % nearly nine in ten, and of 900
clean ones, a third of them with wide hysteresis, none (benchmarks/import_detection.py). The
limits below stand where hysteresis that builds up smoothly begins to be accused.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from mrdamper.data import Floats
from mrdamper.optimizers.linear import on_one_blas_thread
from mrdamper.rig_files.quality.flat import flagged_samples, flat_tops
from mrdamper.rig_files.quality.view import View, sample_noise
from mrdamper.rig_files.record import Finding

LIMIT = 0.02  # of the period
_BETTER = 0.5  # of the RMS misfit without delay: a smaller improvement may be any rate dependence
_UNEXPLAINED = 0.03  # of the force's RMS: hysteresis that leaves less explains the force
_GRID = np.linspace(-0.04, 0.16, 21)  # delays tried first, of the period
_FINE = np.array([-0.005, -0.0025, 0.0025, 0.005])  # and then around the best of them
_YIELD = np.geomspace(0.005, 1.2, 9)  # yield displacements, of the amplitude
_SOFT = np.array([0.02, 0.05, 0.1, 0.2, 0.4])  # velocities in which a yield force builds up, of the peak
_POINTS = 256  # of one cycle of the elements
_ROWS = 800
_FREE = 6  # of the elements, powers of x and v, may have either sign


class ForceLag(NamedTuple):
    """Delay of the force that explains it best; a misfit is what is left beyond sample noise, RMS over the force's."""

    share: float  # of the period
    misfit: float  # at this delay
    without: float  # without delay


def force_channel(view: View) -> Iterator[Finding]:
    """Say that the force lags the motion by more than 2 % of the period."""
    lag = force_lag(view)
    if lag is not None and lag.share > LIMIT and lag.without > _UNEXPLAINED and lag.misfit < _BETTER * lag.without:
        period = 1 / view.motion.condition.frequency_Hz  # type: ignore[union-attr]
        yield Finding(
            "W_LAG",
            f"the force is {1e3 * lag.share * period:.3g} ms ({100 * lag.share:.1f} % of the period) later than "
            "hysteresis explains; if the channel is known to be late, say [channels.force] delay_ms in a profile",
        )


@on_one_blas_thread
def force_lag(view: View) -> ForceLag | None:
    """Best delay of the force on a sine; None where the motion is none."""
    motion = view.motion
    if motion is None:
        return None
    run = view.steady
    first = view.run.time[view.strokes.reversals[0]] if view.strokes.reversals.size else run.time[0]
    late = run.time >= first  # before its first reversal the damper may come from rest
    if view.noticed("W_CLIPPED", "W_FROZEN"):  # flat stretches look late
        if flat_tops(view, "displacement"):
            return None
        start = (view.strokes.steady or (0,))[0]
        late &= ~flagged_samples(view)[view.index[start : start + late.size]]
    rows = np.flatnonzero(late)[:: max(1, np.count_nonzero(late) // _ROWS)]
    phase = (run.time[rows] - motion.series.origin) * motion.condition.frequency_Hz
    columns = _elements(view)
    ramp = (phase - phase.mean())[:, None]
    force = run.force[rows] - np.mean(run.force[rows])
    tried = {float(delay): _misfit(phase - delay, columns, ramp, force) for delay in _GRID}
    near = min(tried, key=tried.__getitem__)
    tried.update({near + float(d): _misfit(phase - near - d, columns, ramp, force) for d in _FINE})
    best = min(tried, key=tried.__getitem__)
    noise = sample_noise(run.force) / float(np.sqrt(np.mean(force**2)))
    beyond = [float(np.sqrt(max(tried[d] ** 2 - noise**2, (0.2 * noise) ** 2))) for d in (best, min(tried, key=abs))]
    return ForceLag(best, *beyond)


def _misfit(phase: Floats, columns: Floats, ramp: Floats, force: Floats) -> float:
    """RMS misfit over the force's RMS with the elements read at the given phases."""
    from scipy.optimize import nnls

    place = (phase % 1.0) * _POINTS
    low = np.minimum(place.astype(int), _POINTS - 1)  # rounding may give a whole cycle
    part = (place - low)[:, None]
    free = columns[low] * (1 - part) + columns[(low + 1) % _POINTS] * part
    table = np.column_stack([np.ones(force.size), ramp, free, force])
    # A triangle of the size of the columns holds all that the fit needs of the rows.
    gram = table.T @ table
    gram[np.diag_indices_from(gram)] *= 1 + 1e-12
    try:
        triangle = np.linalg.cholesky(gram).T
    except np.linalg.LinAlgError:  # the motion has too few different values, as a square wave
        return np.inf
    either = triangle[:, : 2 + _FREE]
    left = nnls(np.column_stack([either, -either, triangle[:, 2 + _FREE : -1]]), triangle[:, -1])[1]
    return float(left / np.linalg.norm(force))


def _elements(view: View) -> Floats:
    """One steady cycle of everything that may make up the force, scaled to about one; columns."""
    series = view.motion.series  # type: ignore[union-attr]
    amplitude = view.motion.condition.amplitude_m  # type: ignore[union-attr]
    time = series.origin + np.arange(_POINTS) / _POINTS / series.frequency
    x = (series(time) - series.mean - series.drift * (time - series.origin)) / amplitude
    v = (series(time, 1) - series.drift) / (2 * np.pi * series.frequency * amplitude)
    steps = np.diff(np.concatenate([x, x, x[:1]]))
    state, states = np.zeros(_YIELD.size), np.empty((steps.size, _YIELD.size))
    for i, step in enumerate(steps):
        state = np.clip(state + step, -_YIELD, _YIELD)
        states[i] = state
    steady = states[_POINTS - 1 : 2 * _POINTS - 1] / np.minimum(_YIELD, 1.0)
    return np.column_stack([x, x**2, x**3, v**2, np.abs(v) * v, v**3, v, np.tanh(np.divide.outer(v, _SOFT)), steady])
