"""Force that is late or early against the motion, beyond what a damper explains.

A viscous force that is late looks like a spring, a hysteretic one like more hysteresis; but no
passive force goes on rising after the motion has turned, and none turns before the motion. So the mean
cycle is explained by springs, velocity terms and elastic–plastic elements of many yield displacements
(a Prandtl–Ishlinskii sum, which can be any hysteresis that does not depend on rate), all shifted together,
and the delay that explains it best is the lag, with the interval of delays that explain it nearly as well.

What has no corner cannot be dated: a smooth force that is late is, on one sine, exactly a force with a
spring, and a first-order filter rounds a corner as hysteresis does. A smooth force that is early has a
spring of negative stiffness, which only a moving mass has, and then in proportion to frequency squared:
a mass no damper has is reported as a lead. The limits stand beyond what clean records of seven model
families and of the bundled rigs show; docs/rig-procedure.md has what is found from which size on.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from mrdamper.data import Floats
from mrdamper.rig_files.quality.cycles import POINTS, Cycles, steady_cycles
from mrdamper.rig_files.quality.effects import change, damping, elastic_plastic, percent
from mrdamper.rig_files.quality.flat import flagged_samples
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding
from mrdamper.statistics.linear import on_one_blas_thread

LIMIT = 0.01  # of the period: shorter lags are within the samples of a cycle
_BETTER, _FAR_BETTER = 0.2, 0.12  # of the misfit without delay: a smaller improvement may be any rate dependence
_MUCH_BETTER = 0.4  # of it, where hysteresis leaves much
_NEARLY, _NEARLY_EARLY = 0.005, 0.025  # of the force's RMS: hysteresis, or relaxation, that leaves less explains it
_LITTLE, _UNEXPLAINED = 0.007, 0.05  # of the force's RMS: up to here little, from here on much
_GRID = np.round(np.arange(-0.12, 0.161, 0.02), 3)  # delays tried first, of the period
_FINE = np.array([-0.01, -0.005, -0.0025, 0.0025, 0.005, 0.01])  # and then around the best of them
_AS_GOOD, _MODEL = 1.5, 0.1  # times the best misfit, and of that without delay: what the elements' own error may be
_YIELD = np.geomspace(0.0005, 1.0, 40)  # yield displacements, of half the stroke
_SOFT = np.array([0.01, 0.02, 0.05, 0.1, 0.2, 0.4])  # velocities in which a yield force builds up, of the peak
_LEAD = 0.015  # share of the force that acts as a negative spring
_MASS = 30.0  # [kg] that would explain it


class ForceLag(NamedTuple):
    """Delay of the force that explains it best; a misfit is RMS beyond sample noise, over the force's."""

    share: float  # of the period; negative: early
    misfit: float  # at this delay
    without: float  # without delay
    low: float  # of the delays that explain the force nearly as well
    high: float


def force_channel(view: View) -> Iterator[Finding]:
    """Report a force that is late or early against the motion."""
    cycles, motion = steady_cycles(view), view.motion
    if cycles is None or motion is None or view.noticed("W_CLIPPED", "W_DRIFT") or _stands_still(view, cycles):
        return
    lag = force_lag(view)
    if lag is not None and _is_clear(lag):
        late = 1e3 * np.array([lag.share, lag.low, lag.high]) * cycles.period
        word, bounds = ("later", late[1:]) if lag.share > 0 else ("earlier", -late[:0:-1])
        yield Finding(
            "W_LAG",
            f"the force is {abs(late[0]):.3g} ms ({100 * abs(lag.share):.1f} % of the period; {bounds[0]:.3g} to "
            f"{bounds[1]:.3g} ms explain it nearly as well) {word} than hysteresis explains, which moves the damping "
            f"by {percent(effect_of_delay(cycles, lag.share))}; if the delay is known, set delay_ms in "
            "[channels.force] of a profile",
        )
        return
    share, mass = _negative_spring(cycles)
    if share > _LEAD and mass > _MASS:
        yield Finding(
            "W_LAG",
            f"{100 * share:.2g} % of the force acts as a spring of negative stiffness, for which {mass:.3g} kg would "
            f"have to move with the rod: the force is early by about {100 * share / (2 * np.pi):.2g} % of the period "
            "or more, or the displacement late (filter, or a high-pass in the force)",
        )


def _stands_still(view: View, cycles: Cycles) -> bool:
    """Check for a channel that is frozen within the cycles: flat stretches look late."""
    if not view.noticed("W_FROZEN"):
        return False
    flagged = view.record.time[flagged_samples(view)]
    return bool(np.any((flagged >= cycles.starts[0]) & (flagged <= cycles.starts[-1] + cycles.period)))


def _is_clear(lag: ForceLag) -> bool:
    nearly = _NEARLY if lag.share > 0 else _NEARLY_EARLY
    better = _BETTER if lag.share > 0 and lag.without > _LITTLE else _FAR_BETTER
    better = better if lag.without < _UNEXPLAINED else _MUCH_BETTER
    return abs(lag.share) > LIMIT and lag.without > nearly and lag.misfit < better * lag.without


def effect_of_delay(cycles: Cycles, share: float) -> float:
    """Relative change of the damping by a force that is late by a share of the period."""
    motion, force = cycles.displacement, cycles.force.loop
    shifted = _read(force, np.arange(POINTS) / POINTS + share)
    return change(damping(motion.loop, motion.slope, shifted), damping(motion.loop, motion.slope, force))


def _negative_spring(cycles: Cycles) -> tuple[float, float]:
    """Share of the force that is in phase with the displacement and against it, and the mass that explains it [kg]."""
    x, force = (np.fft.rfft(channel.loop)[1] for channel in (cycles.displacement, cycles.force))
    against = -float((force * np.conj(x)).real) / abs(x) * (2 / POINTS)  # [N]
    amplitude = float(abs(x)) * (2 / POINTS)
    return against / (0.5 * cycles.force.span), against / amplitude / (2 * np.pi / cycles.period) ** 2


@on_one_blas_thread
def force_lag(view: View) -> ForceLag | None:
    """Best delay of the force on a sine; None where the motion is none, or is explained without."""
    cycles, motion = steady_cycles(view), view.motion
    if cycles is None or motion is None:
        return None
    series, phase = motion.series, np.arange(POINTS) / POINTS
    time = cycles.starts[0] + phase * cycles.period
    x = (series(time) - series.mean - series.drift * (time - series.origin)) / motion.condition.amplitude_m
    v = (series(time, 1) - series.drift) / (2 * np.pi * series.frequency * motion.condition.amplitude_m)
    force = cycles.force.loop - np.mean(cycles.force.loop)
    size = float(np.linalg.norm(force))
    if size == 0:
        return None
    elements = _Elements(x, v, _YIELD)
    without = elements.misfit(force)
    if without <= _NEARLY:
        return None
    tried = {0.0: without} | {float(d): elements.misfit(_read(force, phase + d)) for d in _GRID if d}
    near = min(tried, key=tried.__getitem__)
    tried |= {near + float(step): elements.misfit(_read(force, phase + near + step)) for step in _FINE}
    best = min(tried, key=tried.__getitem__)
    enough = max(_AS_GOOD * tried[best], _MODEL * without)
    alike = [delay for delay, left in tried.items() if left <= enough]
    noise = view.force_noise * np.sqrt(POINTS / len(cycles.starts)) / size
    left, unmoved = (float(np.sqrt(max(m**2 - noise**2, (0.3 * noise) ** 2))) for m in (tried[best], without))
    return ForceLag(best, left, unmoved, min(alike), max(alike))


class _Elements:
    """Everything that may make up the force of one cycle of a motion."""

    def __init__(self, x: Floats, v: Floats, yields: Floats):
        either = np.column_stack([np.ones(x.size), x, x**2, x**3, v**2, np.abs(v) * v, v**3])
        loops = elastic_plastic(x, v > 0, yields * 0.5 * float(np.ptp(x)))
        resisting = np.column_stack([v, np.tanh(v[:, None] / _SOFT), loops])
        self.basis, triangle = np.linalg.qr(np.column_stack([either, resisting]))
        free = triangle[:, : either.shape[1]]
        self.table = np.column_stack([free, -free, triangle[:, either.shape[1] :]])

    def misfit(self, force: Floats) -> float:
        """RMS of what the elements leave of a force, over its RMS; those that resist have no negative share."""
        from scipy.optimize import nnls

        inside = self.basis.T @ force
        outside = max(float(force @ force - inside @ inside), 0.0)
        return float(np.sqrt((outside + nnls(self.table, inside)[1] ** 2) / (force @ force)))


def _read(loop: Floats, phase: Floats) -> Floats:
    """One cycle's values at phases in cycles, by linear interpolation."""
    return np.interp(phase % 1.0, np.arange(POINTS + 1) / POINTS, np.append(loop, loop[0]))
