"""The loop's physics: the force follows the motion, takes energy out of it, and is the same in every cycle."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrdamper.data import Floats, once_per_run
from mrdamper.data.wording import number
from mrdamper.errors import QualityError
from mrdamper.identification.loop_analysis import damping_share as share_of_damping
from mrdamper.physics.motion.strokes import longest_run
from mrdamper.rig_files.quality.cycles import POINTS, every_cycle, steady_cycles
from mrdamper.rig_files.quality.motion import LEAST_CYCLES, current_changes, cycles_of, steady_window
from mrdamper.rig_files.quality.view import MOST_SAMPLES, View
from mrdamper.rig_files.record import SIGNED, Finding, SteadyPart
from mrdamper.statistics.peaks import sample_noise

_SLOW, _FAST = 0.1, 0.5  # of the largest velocity: samples near the reversals, and away from them
_BELOW = 0.15  # of the range: so far below both strokes is a rectified force at the reversals
_LOW, _ALIKE = 0.2, 0.25  # of a folded force's largest: near zero, and strokes that do not differ
GIVING = -0.05  # share of the force in phase with the velocity, below which the loop gives energy
_CLEARLY = 0.3  # share of the force that opposes, or pushes, in a cycle that surely does
_ELASTIC = 0.9  # correlation with the displacement from which a force is nearly that of a spring
_GAIN, _EVEN = 0.3, 0.08  # natural logarithms: a leap of the force's size, and what it varies by before and after
_SAME_CURRENT = 0.1  # [A]
_FEWEST = 20  # samples of a cycle
_FEWEST_STROKES, _MOST_STROKES, _SAME_STROKE = 10, 0.6, 0.02  # strokes; share that are alike, to this tolerance
_LONG = 0.08  # of a cycle: a stretch of the other sign that no timing makes
POOR_REPEATABILITY = 0.03  # of the peak-to-peak force; good rigs have 0.2 to 1.7 %
_NOISE = 0.7  # of a channel's standard deviation: white noise has 1, a noisy load cell 0.1
_LEAP, _LEAPS = 0.4, 0.4  # a step of such a share of the range, and the part of the path in such steps
_NO_ENERGY = 0.002  # share of the force that opposes the velocity: a spring's
_STILL, _GOES_ON = 0.01, 0.5  # of the steady stroke and of the steady force, peak to peak
_FEWEST_AT_REST = 5  # samples
_UNLIKE = 0.25  # scatter from cycle to cycle over the peak-to-peak force; beyond, it is no answer to the motion


def dissipates(view: View) -> None:
    """Refuse a loop that gives energy: the force's sign is wrong, or columns are exchanged.

    The sign is that of c in F = f0 + r t + k x + c v by least squares, which over whole
    cycles is that of the loop's energy, and which holds for part cycles and any motion too.
    """
    if cycles_of(view) < LEAST_CYCLES:
        return
    share = damping_share(view)
    if _is_rectified(view):
        problem = "the force has the size of a damper's but one sign in both directions: an absolute value"
        raise view.refused("E_RECTIFIED", problem, "export the channel with its sign")
    if share < GIVING:
        displacement, force = view.run.displacement, view.run.force
        elastic = float(np.corrcoef(displacement, force)[0, 1])
        if _exchanged(view):
            what = "displacement and force look exchanged"
            remedy = "name the columns the other way round: [channels.force] column = ... in a profile"
        elif share > -_CLEARLY and elastic > _ELASTIC:
            delay = -share / elastic * np.std(displacement) / np.std(view.moving.velocity)
            what = f"the force is nearly that of a spring, {1e3 * delay:.2g} ms or more behind the displacement"
            remedy = "record it again with both channels filtered alike, or set the force's known delay_ms in a profile"
        else:
            what = "force and displacement count in opposite directions"
            changed = [role for role in SIGNED if view.has_changed_sign(role)]
            remedy = f"set [channels.force] sign = {1 if changed else -1} in a profile"
            if len(changed) == 1:
                (other,) = {*SIGNED} - {*changed}
                remedy = f"set [channels.{other}] sign = -1 in a profile, or [channels.{changed[0]}] sign = 1"
        problem = f"negative dissipated energy ({-100 * share:.0f} % of the force acts along the motion): {what}"
        raise view.refused("E_DISSIPATION_SIGN", problem, remedy)


def _is_rectified(view: View) -> bool:
    """Check for a force that has one sign and is nearer to zero at the reversals than in either stroke.

    A damper's force at a reversal lies between those of the strokes.
    """
    force, velocity = view.run.force, view.moving.velocity
    span = float(np.ptp(force))
    force = -force if 2 * np.count_nonzero(force < 0) > force.size else force
    negative = np.count_nonzero(force < -3 * sample_noise(force) - 0.02 * span)
    if negative > 0.01 * (force.size - 1):
        return False
    fastest = float(np.max(np.abs(velocity)))
    parts = [force[np.abs(velocity) < _SLOW * fastest], force[velocity > _FAST * fastest]]
    parts += [force[velocity < -_FAST * fastest]]
    if min(map(len, parts)) < _FEWEST:
        return False
    turning, *strokes = (float(np.median(part)) for part in parts)
    return turning < min(strokes) - _BELOW * span or _is_folded(view, force, *strokes)


def _is_folded(view: View, force: Floats, out: float, back: float) -> bool:
    """Check for a force as large in one direction as in the other that goes down to zero on either side of the middle.

    A damper's strokes differ by most of its range, whatever gas or a spring adds.
    """
    top = float(np.max(force))
    low = view.run.displacement[force < _LOW * top] - float(np.median(view.run.displacement))
    sides = min(np.count_nonzero(low > 0), np.count_nonzero(low < 0))
    return bool(abs(out - back) < _ALIKE * top and min(out, back) > 0.5 * top and sides > 0.2 * low.size > 1)


def keeps_its_sign(view: View) -> None:
    """Refuse a force that changes its sign within the record: cycle against cycle, or stretches of one."""
    cycles = every_cycle(view)
    if view.noticed("W_FROZEN"):
        return  # a force that stands still opposes its own other half cycle
    if cycles is None:
        _keeps_its_scale_in_strokes(view)
    if cycles is None or len(cycles.starts) < 2 or cycles.period < _FEWEST * view.step:
        return
    starts, force = cycles.starts, cycles.force.values
    ends = np.searchsorted(view.run.time, [starts, starts + cycles.period])
    shares = np.array([_damping_share(view, start, stop) for start, stop in ends.T])
    flipped = np.flatnonzero(shares < -_CLEARLY)
    if flipped.size and float(np.max(shares)) > _CLEARLY:
        raise _flip(view, float(starts[flipped[0]]), flipped.size, len(starts))
    if len(starts) < 3:
        return
    sizes = np.log(np.mean(np.abs(force - np.mean(force, axis=1, keepdims=True)), axis=1))
    _keeps_its_scale(view, starts, sizes)
    usual = np.median(force, axis=0)
    counts = np.abs(usual) > 0.3 * np.max(np.abs(usual))
    against = counts & (np.abs(force + usual) < 0.3 * np.abs(force - usual))
    for start, row in zip(starts, against, strict=True):
        length, begin = longest_run(row)
        if length > _LONG * POINTS:
            raise _flip(view, start + begin * cycles.period / POINTS, 1, len(starts))


def _keeps_its_scale_in_strokes(view: View) -> None:
    """Refuse a motion without a period if, in its strokes of one length and duration, the force changes its scale."""
    strokes, force = view.strokes, view.run.force
    of_motion = np.array([strokes.lengths, strokes.durations])
    if strokes.lengths.size >= _FEWEST_STROKES:
        alike = np.all(np.abs(of_motion.T / np.median(of_motion, axis=1) - 1) < _SAME_STROKE, axis=1)
        if np.mean(alike) > _MOST_STROKES:
            high, low = (extreme.reduceat(force, strokes.reversals)[:-1] for extreme in (np.maximum, np.minimum))
            _keeps_its_scale(view, view.run.time[strokes.reversals[:-1][alike]], np.log((high - low)[alike]))


def _keeps_its_scale(view: View, starts: Floats, sizes: Floats) -> None:
    """Refuse a force whose size (logarithm), cycle by cycle or stroke by stroke, changes at some time and stays so."""
    if np.ptp(sizes) <= _GAIN or (view.record.current is not None and np.ptp(view.run.current) > _SAME_CURRENT):
        return
    for within in (0, 1):  # between two cycles, or within one
        for at in range(2, len(starts) - within):
            old, new = sizes[:at], sizes[at + within :]
            leap = float(np.mean(new) - np.mean(old))
            if max(np.ptp(old), np.ptp(new)) < _EVEN and abs(leap) > _GAIN:
                problem = (
                    f"the force is {number(np.exp(leap), 3)} times as large from about {number(starts[at])} s on: a "
                    "range, a unit or the current was changed over, or the record holds two tests"
                )
                raise view.refused("E_UNRELATED", problem, "cut the record there, or name the channel of the current")


def _flip(view: View, time: float, count: int, cycles: int) -> QualityError:
    problem = (
        f"the force changes its sign within the record, from {number(time)} s on ({count} of {cycles} cycles): the "
        "load cell or its amplifier was changed over"
    )
    return view.refused("E_DISSIPATION_SIGN", problem, "cut the record there")


@once_per_run
def damping_share(view: View) -> float:
    """Part of the force's standard deviation that opposes the velocity; negative where the loop gives energy.

    Of a record in segments, which may be tests of their own, the least of all that hold a cycle.
    """
    whole = _damping_share(view, view.steady_samples.start, view.steady_samples.stop)
    segments = view.run.segments or ()
    if len(segments) < 2 or view.strokes.period is None:
        return whole
    time = view.run.time
    cycles = [(a, b) for a, b in segments if time[b - 1] - time[a] >= LEAST_CYCLES * view.strokes.period]
    return min([whole, *(_damping_share(view, a, b) for a, b in cycles)])


def _damping_share(view: View, start: int, stop: int) -> float:
    return share_of_damping(view.moving.part(slice(start, stop)), view.run.force[start:stop])


def _exchanged(view: View) -> bool:
    """Check for a channel called force that moves like a sine while the one called displacement does not."""
    cycles = steady_cycles(view)
    if cycles is None or (not view.strokes.steady and cycles_of(view) < LEAST_CYCLES):
        return float(np.ptp(view.run.displacement)) > float(np.ptp(view.run.force))
    first, *others = np.abs([np.fft.rfft(channel.loop)[1:] for channel in (cycles.displacement, cycles.force)]).T
    distortion = np.linalg.norm(others, axis=0) / first
    return bool(distortion[0] > 1.5 * distortion[1])


def repeats(view: View) -> Iterator[Finding]:
    """Report cycles of a record that differ from each other by more than noise."""
    scatter, noise = repeatability(view) or (0.0, 0.0)
    beyond = float(np.sqrt(max(scatter**2 - noise**2, 0.0)))
    if beyond > POOR_REPEATABILITY and not current_changes(view):
        text = f"the force differs from cycle to cycle by {100 * scatter:.1f} % of its peak-to-peak value (limit"
        more = f"{100 * POOR_REPEATABILITY:g} % beyond noise): warm the damper up, or check the rig for play"
        yield Finding("W_REPEATABILITY", f"{text} {more}")


def repeatability(view: View) -> tuple[float, float] | None:
    """Cycle-to-cycle scatter of the force and its sample noise, over the peak-to-peak force.

    RMS deviation of the cycles from their mean, without the first of three or more, and the part of it that is noise
    from sample to sample. None under two cycles of a periodic motion.
    """
    cycles = steady_cycles(view)
    if cycles is None or len(cycles.starts) < 2 or cycles.force.span == 0.0:
        return None
    scatter = np.sqrt(np.mean(np.var(cycles.force.values, axis=0, ddof=1)))
    return float(scatter) / cycles.force.span, view.force_noise / cycles.force.span


def steady_part(view: View) -> SteadyPart:
    """Steady window and repeatability of a record."""
    scatter = repeatability(view)
    return SteadyPart(steady_window(view), None if scatter is None else round(scatter[0], 6))


def motion_is_told(view: View) -> None:
    """Refuse channels without memory from sample to sample, and a motion of fewer samples than its strokes need."""
    long = view.record.time.size > MOST_SAMPLES
    for name in ("displacement", "force"):
        values = getattr(view.run, name) if long else view.channels[name]
        if sample_noise(values) > _NOISE * float(np.nanstd(values)):
            remedy = "check the sensor's cable and amplifier, and that the record has enough samples per cycle"
            raise view.refused("E_NOISE", f"the {name} is noise: it does not go on from sample to sample", remedy)
    x = view.channels["displacement"]
    steps = np.abs(np.diff(x[np.isfinite(x)]))
    leaps = float(np.sum(steps[steps > _LEAP * float(np.nanmax(x) - np.nanmin(x))]))
    if leaps > _LEAPS * float(np.sum(steps)):
        problem = "the displacement leaps from sample to sample: the speed cannot be determined"
        remedy = "record at least eight samples per cycle, and a motion that the drive can follow"
        raise view.refused("E_UNRESOLVED", problem, remedy)


def force_follows(view: View) -> None:
    """Refuse a force that takes no energy, or that differs from cycle to cycle of the same motion and current."""
    if cycles_of(view) >= LEAST_CYCLES and abs(damping_share(view)) < _NO_ENERGY:
        problem = "the force takes no energy out of the motion: that of a spring, or of no damper"
        raise view.refused("E_NO_ENERGY", problem, "check the load cell, and that the damper is mounted")
    _force_rests_with_the_motion(view)
    scatter, _ = repeatability(view) or (0.0, 0.0)
    if scatter < _UNLIKE or view.noticed("W_FROZEN") or current_changes(view):
        return
    differs = f"the force differs from cycle to cycle by {100 * scatter:.0f} % of its peak-to-peak value"
    problem = f"{differs}: it does not follow the motion"
    remedy = "check that force and displacement are of the same test, and that the load cell does not drift"
    raise view.refused("E_UNRELATED", problem, remedy)


def _force_rests_with_the_motion(view: View) -> None:
    """Refuse a force that goes on through cycles in which the displacement stands still."""
    steady, period = view.strokes.steady, view.strokes.period
    if steady is None or period is None or view.noticed("W_FROZEN"):
        return
    time, run = view.run.time, view.run
    stroke, swing = float(np.ptp(view.steady.displacement)), float(np.ptp(view.steady.force))
    # The force may relax for half a cycle after the motion has stopped.
    relaxed = int(np.searchsorted(time, time[steady[1] - 1] + 0.5 * period, "right"))
    for rest in (slice(0, steady[0]), slice(relaxed, time.size)):
        if rest.stop - rest.start < _FEWEST_AT_REST or time[rest.stop - 1] - time[rest.start] < 0.4 * period:
            continue
        still = float(np.ptp(run.displacement[rest])) < _STILL * stroke
        if still and float(np.ptp(run.force[rest])) > _GOES_ON * swing:
            problem = f"the force goes on from {number(time[rest.start])} s on while the displacement rests"
            raise view.refused("E_UNRELATED", problem, "check the displacement channel there, or cut the record")
