"""Channels that are late or early against the motion: a velocity, and a force beyond what a damper explains.

A velocity is compared with the derivative of the displacement. A viscous force that is late looks like a spring, a
hysteretic one like more hysteresis; but no passive force goes on rising after the motion has turned, and none turns
before the motion. So the mean cycle is explained by springs, velocity terms and elastic–plastic elements of many
yield displacements (a Prandtl–Ishlinskii sum, which can be any hysteresis that does not depend on rate), all delayed
together and behind one first-order low-pass, and the delay and the time constant that explain it best are the lag,
with the intervals of those that explain it nearly as well.

What has no corner cannot be dated: a smooth force that is late is, on one sine, exactly a force with a spring, and
friction without a yield displacement behind a first-order filter is hysteresis of another shape: only noise shows
that filter. A smooth force that is early has a spring of negative stiffness, which only a moving mass has, and then
in proportion to frequency squared: a mass no damper has is reported as a lead. A delay is none where a force that
rises with the velocity in any way, behind a spring, explains the loop as well: one that leaks below the yield force
falls long before the motion turns. The limits stand beyond what clean records of thirteen model families and of the
bundled rigs show; docs/rig-procedure.md has what is found from which size on.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.wording import number, span
from mrdamper.rig_files.quality.cycles import (
    POINTS,
    WARNED,
    Cycles,
    effect_on,
    elastic_plastic,
    percent_of,
    steady_cycles,
)
from mrdamper.rig_files.quality.flat import flagged_samples
from mrdamper.rig_files.quality.motion import current_changes
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding
from mrdamper.statistics.linear import on_one_blas_thread

SAMPLES = 1.5  # a velocity formed by backward differences and one filter step is this late
OF_PERIOD = 0.0025  # and this much of a period cannot be seen in any loop
GAIN = 0.2  # a velocity this much too large or too small is in another unit
UNLIKE = 0.5  # more of the channel left unexplained, and it is another quantity
_ROWS = 4_000  # samples compared at most
LIMIT = 0.01  # of the period: shorter lags are within the samples of a cycle
_NEARLY, _NEARLY_EARLY = 0.004, 0.025  # of the force's RMS: hysteresis, or relaxation, that leaves less explains it
_LITTLE, _UNEXPLAINED = 0.007, 0.05  # of the force's RMS: up to here little, from here on much
_FAR_BETTER, _BETTER, _MUCH_BETTER = 0.1, 0.2, 0.4  # of the misfit without delay, where that is little, more and much
_UNFILTERED, _FILTERED = 0.0015, 0.2  # of the force's RMS, and of that: the misfit without and with a filter
_DELAYS = np.round(np.arange(-0.12, 0.161, 0.02), 3)  # tried first, of the period
_FINE = np.array([-0.01, -0.005, -0.0025, 0.0025, 0.005, 0.01])  # and then around the best of them
_CONSTANTS = (0.01, 0.02, 0.04, 0.07, 0.12)  # time constants, of the period
_FINER = np.array([0.7, 0.85, 1.0, 1.15, 1.3])  # times the best of them
_LEAST = 0.3  # of the noise: misfits below are not told apart
_AS_GOOD, _MODEL = 1.5, 0.1  # times the best misfit, and of that without lag: what the elements' own error may be
_YIELD = np.geomspace(0.0005, 1.0, 40)  # yield displacements, of half the stroke
_BETWEEN, _LARGEST = 9, 2  # yield displacements tried between the neighbours of those that act most
_SOFT = np.array([0.01, 0.02, 0.05, 0.1, 0.2, 0.4])  # velocities in which a yield force builds up, of the peak
_THINNING = np.array([0.3, 0.6])  # powers of the velocity: fluids that thin with shear
_HARDLY_BETTER, _NO_BETTER, _EXPLAINED = 0.45, 0.8, 0.002  # of the misfit beside any function of velocity; of the force
# Velocities, of the peak, between which a force rises:
_EDGES = np.array([0, 3, 6, 10, 14, 18, 22, 26, 30, 35, 40, 45, 50, 55, 60, 70, 80, 90, 100]) / 100
_SERIES = np.array([0, 0.01, 0.02, 0.05, 0.1, 0.2])  # elastic displacement at the peak force, of the amplitude
_LEAD = 0.015  # share of the force that acts as a negative spring
_MASS = 30.0  # [kg] that would explain it


class Delay(NamedTuple):
    """One signal against another, as offset + gain · reference(t − delay)."""

    delay: float  # [s], positive where the signal is late
    gain: float
    unexplained: float  # share of the signal's variance


def velocity_channel(view: View) -> None:
    """Refuse a velocity channel that is not the derivative of displacement."""
    channel, run = view.record.velocity, view.run
    if channel is None:
        return
    measured = channel[view.index]
    there = np.isfinite(measured)
    if np.count_nonzero(there) < 0.5 * there.size:
        return
    measured = np.interp(run.time, run.time[there], measured[there])
    period = view.strokes.period or float(np.ptp(run.time))  # a record without two reversals is a cycle at most
    delay = delay_between(run.time, view.moving.velocity, measured, period)
    late = abs(delay.delay) > max(SAMPLES * view.step, OF_PERIOD * period)
    sign = f"set [channels.velocity] sign = {1 if view.has_changed_sign('velocity') else -1} in a profile"
    remedy = sign if delay.gain < 0 else "correct its unit in a profile"
    if delay.unexplained > UNLIKE:
        what = "is not the derivative of displacement, at any delay"
    elif delay.gain < 0:
        what = "runs against the derivative of displacement"
    elif late:
        side = "behind" if delay.delay > 0 else "ahead of"
        what = f"is {number(1e3 * abs(delay.delay))} ms {side} the derivative of displacement"
        remedy = f"set [channels.velocity] delay_ms = {1e3 * delay.delay:.4g} in a profile"
    elif abs(delay.gain - 1) > GAIN:
        what = f"is {number(delay.gain, 3)} times the derivative of displacement"
    else:
        return
    raise view.refused("E_CHANNEL_LAG", f"velocity {what}", f"{remedy}, or leave the column out")


def delay_between(time: Floats, reference: Floats, signal: Floats, period: float) -> Delay:
    """Find the delay of a signal against a reference, within half a period [s] either way.

    A signal that is the reference's negative, to a twentieth of its variance, is called that
    rather than half a period late. Otherwise the best of a grid of delays is refined by
    Gauss–Newton on delay, gain and offset.
    """
    few = slice(None, None, max(1, time.size // 500))
    turned = _at(0.0, time[few], signal[few], time, reference)
    if turned.gain < 0 and turned.unexplained < 0.05:
        return turned
    grid = np.linspace(-0.5, 0.5, 81)[1:-1] * period
    trials = [_at(delay, time[few], signal[few], time, reference) for delay in grid]
    rising = [trial for trial in trials if trial.gain > 0] or trials
    delay = min(rising, key=lambda trial: trial.unexplained).delay
    rows = slice(None, None, max(1, time.size // _ROWS))
    t, s, slope = time[rows], signal[rows], np.gradient(reference, time)
    for _ in range(6):
        inside = (t - delay >= time[0]) & (t - delay <= time[-1])
        shifted = t[inside] - delay
        columns = [np.ones(shifted.size), np.interp(shifted, time, reference), -np.interp(shifted, time, slope)]
        _, gain, moved = np.linalg.lstsq(np.column_stack(columns), s[inside], rcond=None)[0]
        if gain == 0 or abs(moved / gain) > 0.1 * period:
            break
        delay += float(moved / gain)
    return _at(delay, t, s, time, reference)


def _at(delay: float, t: Floats, signal: Floats, time: Floats, reference: Floats) -> Delay:
    inside = (t - delay >= time[0]) & (t - delay <= time[-1])
    r, s = np.interp(t[inside] - delay, time, reference), signal[inside]
    r, s = r - np.mean(r), s - np.mean(s)
    size = float(r @ r)
    gain = float(r @ s) / size if size > 0 else 0.0
    left = float(np.mean((s - gain * r) ** 2)) / max(float(np.mean(s**2)), np.finfo(float).tiny)
    return Delay(float(delay), gain, left)


class Lag(NamedTuple):
    """One way to be late, in periods."""

    delay: float = 0.0  # negative: early
    constant: float = 0.0  # time constant of a first-order low-pass


@dataclass(frozen=True)
class ForceLag:
    """Lags of the force by how well they explain it; a misfit is RMS beyond sample noise, over the force's."""

    tried: dict[Lag, float]  # misfits
    noise: float  # of the mean cycle, over the force's RMS
    cycle: Floats  # (P,) force without the best of them [N]

    @property
    def best(self) -> Lag:
        """The simplest of those that explain the force nearly as well as any: a delay, a filter, or both."""
        near = self.alike(min(self.tried.values()))
        return min(near, key=lambda lag: ((lag.delay != 0) + 2 * (lag.constant != 0), self.tried[lag]))

    def alike(self, misfit: float) -> list[Lag]:
        """Return the lags that explain the force nearly as well as one of this misfit."""
        enough = max(_AS_GOOD * misfit, _MODEL * self.tried[Lag()])
        return [lag for lag, left in self.tried.items() if left <= enough]

    def interval(self, name: str) -> tuple[float, float]:
        """Lowest and highest delay or constant of those that explain the force nearly as well as the best."""
        values = [getattr(lag, name) for lag in self.alike(self.tried[self.best])]
        return min(values), max(values)

    @property
    def is_clear(self) -> bool:
        """True where the lag explains more than any rate dependence may, and none of the other sign nearly as much."""
        low, high = self.interval("delay")
        without, best = (_beyond(self.tried[lag], self.noise) for lag in (Lag(), self.best))
        return low * high >= 0 and _is_clear(self.best, without, best)


def _beyond(misfit: float, noise: float) -> float:
    return float(np.sqrt(max(misfit**2 - noise**2, (_LEAST * noise) ** 2)))


def _is_clear(lag: Lag, without: float, misfit: float) -> bool:
    """Check that a lag explains more of a misfit than any rate dependence may."""
    if lag.constant:
        return without > _UNFILTERED and misfit < _FILTERED * without
    late = lag.delay > 0
    better = _MUCH_BETTER if without > _UNEXPLAINED else _BETTER if late and without > _LITTLE else _FAR_BETTER
    return abs(lag.delay) > LIMIT and without > (_NEARLY if late else _NEARLY_EARLY) and misfit < better * without


def _may_be_clear(misfit: float, noise: float) -> bool:
    """Check that what is left without a lag is so much beyond the noise that some lag could be clear."""
    without = _beyond(misfit, noise)
    return any(_is_clear(lag, without, _LEAST * noise) for lag in (Lag(1.0), Lag(-1.0), Lag(0.0, 1.0)))


def force_channel(view: View) -> Iterator[Finding]:
    """Report a force that is late or early against the motion."""
    cycles, motion = steady_cycles(view), view.motion
    if cycles is None or motion is None or view.noticed("W_CLIPPED", "W_DRIFT"):
        return
    if view.noticed("W_FROZEN"):  # stretches that are flat within the cycles look late
        flagged = view.record.time[flagged_samples(view)]
        if np.any((flagged >= cycles.starts[0]) & (flagged <= cycles.starts[-1] + cycles.period)):
            return
    if current_changes(view):  # with it the loop, by more than any lag
        return
    lag = force_lag(view)
    if lag is not None and lag.is_clear:
        moved = effect_on(cycles, lag.cycle)
        if max(moved) > (WARNED if lag.best.constant else 0):
            text = f"{_description(lag, cycles)}, which moves {percent_of(*moved)}; filter both channels alike, and if"
            yield Finding("W_LAG", f"{text} the delay is known, set delay_ms in [channels.force] of a profile")
        return
    share, mass = _negative_spring(view, cycles)
    if share > _LEAD and mass > _MASS:
        yield Finding(
            "W_LAG",
            f"{100 * share:.2g} % of the force acts as a spring of negative stiffness, for which {number(mass, 3)} "
            "kg would have to move with the rod: an inertia (of the fluid, or of a part before the load cell) if tests "
            "of other frequencies show a similar mass; else the force is early by about "
            f"{100 * share / (2 * np.pi):.2g} % of the period or more, or the displacement late (filter, or a "
            "high-pass in the force)",
        )


def _description(lag: ForceLag, cycles: Cycles) -> str:
    best, parts = lag.best, []
    if best.delay:
        low, high = sorted(abs(1e3 * cycles.period * end) for end in lag.interval("delay"))
        word = "later" if best.delay > 0 else "earlier"
        parts.append(
            f"{number(1e3 * abs(best.delay) * cycles.period, 3)} ms ({100 * abs(best.delay):.1f} % of the period; "
            f"{span(low, high, 'ms', to=' to ')} explain it nearly as well) {word} than hysteresis explains"
        )
    if best.constant:
        low, high = (1e3 * cycles.period * end for end in lag.interval("constant"))
        parts.append(
            f"behind a first-order filter of {number(1e3 * best.constant * cycles.period, 3)} ms "
            f"({span(low, high, 'ms', to=' to ')} explain it nearly as well; corner "
            f"{1 / (2 * np.pi * best.constant * cycles.period):.3g} Hz)"
        )
    return f"the force is {' and '.join(parts)}"


def _negative_spring(view: View, cycles: Cycles) -> tuple[float, float]:
    """Share of the force that is in phase with the displacement and against it, and the mass that explains it [kg]."""
    x, force = (np.fft.rfft(channel.loop)[1] for channel in (cycles.displacement, cycles.force))
    against = -float((force * np.conj(x)).real) / abs(x) * (2 / POINTS)  # [N]
    amplitude, half = float(abs(x)) * (2 / POINTS), 0.5 * cycles.force.span
    if against > _LEAD * half:  # harmonics of the velocity have a part in it, by what of the force follows the velocity
        memoryless = _elements(*_motion(view, cycles), np.empty(0))
        against = -float(np.linalg.lstsq(memoryless, cycles.force.loop, rcond=1e-9)[0][1])
    return against / half, against / amplitude / (2 * np.pi / cycles.period) ** 2


def _phases(cycles: Cycles) -> Floats:
    return cycles.starts[0] + np.arange(POINTS) / POINTS * cycles.period


def _motion(view: View, cycles: Cycles) -> tuple[Floats, Floats]:
    """Displacement and velocity of one cycle, of their amplitudes: (P,) arrays."""
    motion = view.motion
    assert motion is not None
    series, time = motion.series, _phases(cycles)
    x = (series(time) - series.mean - series.drift * (time - series.origin)) / motion.condition.amplitude_m
    return x, (series(time, 1) - series.drift) / (2 * np.pi * series.frequency * motion.condition.amplitude_m)


@on_one_blas_thread
def force_lag(view: View) -> ForceLag | None:
    """Fit a delay and a first-order filter of the force on a sine; None without a sine, or where neither is needed."""
    cycles = steady_cycles(view)
    if cycles is None:
        return None
    motion, mean = _motion(view, cycles), float(np.mean(cycles.force.loop))
    force = cycles.force.loop - mean
    size = float(np.linalg.norm(force))
    if size == 0:
        return None
    phases = _phases(cycles)
    noise = view.force_noise * np.sqrt(POINTS / len(cycles.starts)) / size
    shares = np.empty(0)
    for every in (2, 1, 0):  # few yield displacements, more, and those between the ones that act most
        yields = _YIELD[::every] if every else _refined(_YIELD, shares)
        plain = _Behind(_elements(*motion, yields))
        misfit, shares = plain.fit(force)
        if not _may_be_clear(misfit, noise):
            return None
    tried, behind = {Lag(): misfit}, {0.0: plain}

    def moved(lag: Lag) -> Floats:
        return cycles.read(force, phases + lag.delay * cycles.period)

    def attempt(lags: Iterable[Lag]) -> Lag:
        """Try lags, and return the best so far."""
        for lag in lags:
            if lag in tried:
                continue
            if lag.constant not in behind:
                behind[lag.constant] = _Behind(plain.elements, lag.constant)
            tried[lag] = behind[lag.constant].fit(moved(lag))[0]
        return min(tried, key=tried.__getitem__)

    late = 0.0
    if misfit > _NEARLY:
        near = attempt(Lag(float(delay)) for delay in _DELAYS)
        late = attempt(Lag(near.delay + float(step)) for step in _FINE).delay
    attempt(Lag(delay, constant) for constant in _CONSTANTS for delay in (0.0, max(late - constant, 0.0)))
    alone = min((lag for lag in tried if lag.constant and not lag.delay), key=tried.__getitem__)
    if tried[alone] < _MUCH_BETTER * misfit:
        finer = _elements(*motion, _refined(yields, behind[alone.constant].fit(force)[1]))
        for constant in alone.constant * _FINER:
            behind[constant] = _Behind(finer, constant)
            tried[Lag(0.0, float(constant))] = behind[constant].fit(force)[0]
    lag = ForceLag(tried, noise, force)
    if lag.best.delay and lag.is_clear and _is_shape(motion, force, moved(lag.best), lag):
        return None
    best = behind[lag.best.constant]
    return replace(lag, cycle=mean + best.elements @ best.fit(moved(lag.best))[1])


def _elements(x: Floats, v: Floats, yields: Floats) -> Floats:
    """(P, M) columns that may make up the force of one cycle; all but the first `_FREE` resist the motion."""
    either = np.column_stack([np.ones(x.size), x, x**2, x**3, v**2, np.abs(v) * v, v**3])
    loops = elastic_plastic(x, v > 0, yields * 0.5 * float(np.ptp(x)))
    thinning = np.sign(v)[:, None] * np.abs(v[:, None]) ** _THINNING
    return np.column_stack([either, v, np.tanh(v[:, None] / _SOFT), thinning, loops])


def _is_shape(motion: tuple[Floats, Floats], force: Floats, moved: Floats, lag: ForceLag) -> bool:
    """Check that a force which rises with the velocity in any way leaves no need of the lag.

    One that leaks below the yield force falls long before the motion turns; behind a spring it looks early.
    """
    early, left = lag.best.delay < 0, []
    for loop in (force, moved):
        rate = 0.5 * POINTS * (np.roll(loop, -1) - np.roll(loop, 1)) / (2 * np.pi * float(np.max(np.abs(loop))))
        flow = motion[1][:, None] - (_SERIES if early else _SERIES[:1]) * rate[:, None]  # velocity without the spring's
        share = np.clip((np.abs(flow)[..., None] - _EDGES[:-1]) / np.diff(_EDGES), 0, 1)
        rising = (np.sign(flow)[..., None] * share).reshape(POINTS, -1)
        misfit = _Behind(np.column_stack([_elements(*motion, _YIELD), rising])).fit(loop)[0]
        left.append(_beyond(misfit, lag.noise))
    return left[1] > (_NO_BETTER if early else _HARDLY_BETTER) * left[0] or (early and left[0] < _EXPLAINED)


_FREE = 7  # columns of `_elements` that may have either sign


class _Behind:
    """Everything that may make up the force of one cycle, behind a first-order low-pass; its constant in periods."""

    def __init__(self, elements: Floats, constant: float = 0.0):
        self.elements = elements
        if constant:
            response = 1 / (1 + 2j * np.pi * constant * np.arange(POINTS // 2 + 1))
            elements = np.fft.irfft(np.fft.rfft(elements, axis=0) * response[:, None], POINTS, axis=0)
        self.basis, triangle = np.linalg.qr(elements)
        self.table = np.column_stack([triangle[:, :_FREE], -triangle[:, :_FREE], triangle[:, _FREE:]])

    def fit(self, force: Floats) -> tuple[float, Floats]:
        """RMS that the elements leave of a force, over its RMS, and their (M,) shares; no resisting one is negative."""
        from scipy.optimize import nnls

        inside = self.basis.T @ force
        outside = max(float(force @ force - inside @ inside), 0.0)
        parts, left = nnls(self.table, inside)
        shares = np.concatenate([parts[:_FREE] - parts[_FREE : 2 * _FREE], parts[2 * _FREE :]])
        return float(np.sqrt((outside + left**2) / (force @ force))), shares


def _refined(yields: Floats, shares: Floats) -> Floats:
    """Yield displacements with those between the ones that act most and their neighbours: one is a free number."""
    most = np.argsort(shares[-yields.size :])[-_LARGEST:]
    low, high = (yields[np.clip(most + step, 0, yields.size - 1)] for step in (-1, 1))
    between = np.geomspace(low, high, _BETWEEN).reshape(-1)
    return np.unique(np.concatenate([_YIELD[::2], between]))
