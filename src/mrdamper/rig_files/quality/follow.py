"""Checks that the samples determine the motion and that the force follows it; without either nothing is identified."""

from __future__ import annotations

import numpy as np

from mrdamper.rig_files.quality.current import held_in
from mrdamper.rig_files.quality.loop import damping_share, repeatability
from mrdamper.rig_files.quality.motion import LEAST_CYCLES, cycles_of, steady_window
from mrdamper.rig_files.quality.view import MOST_SAMPLES, View, sample_noise

_NOISE = 0.7  # of a channel's standard deviation: white noise has 1, a noisy load cell 0.1
_LEAP, _LEAPS = 0.4, 0.4  # a step of such a share of the range, and the part of the path in such steps
_NO_ENERGY = 0.002  # share of the force that opposes the velocity: a spring's
_STILL, _GOES_ON = 0.01, 0.5  # of the steady stroke and of the steady force, peak to peak
_FEWEST = 5  # samples
_UNLIKE = 0.25  # scatter from cycle to cycle over the peak-to-peak force; beyond, it is no answer to the motion


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
    repeated = repeatability(view)
    if (
        repeated is None
        or repeated[0] < _UNLIKE
        or view.noticed("W_FROZEN")
        or held_in(view.record, steady_window(view))[1]
    ):
        return
    raise view.refused(
        "E_UNRELATED",
        f"the force differs from cycle to cycle by {100 * repeated[0]:.0f} % of its peak-to-peak value: it does not "
        "follow the motion",
        "check that force and displacement are of the same test, and that the load cell does not drift",
    )


def _force_rests_with_the_motion(view: View) -> None:
    """Refuse a force that goes on through cycles in which the displacement stands still."""
    steady, period = view.strokes.steady, view.strokes.period
    if steady is None or period is None or view.noticed("W_FROZEN"):
        return
    time, run = view.run.time, view.run
    stroke, swing = (float(np.ptp(values[slice(*steady)])) for values in (run.displacement, run.force))
    for start, stop in ((0, steady[0]), (steady[1], time.size)):
        if stop - start < _FEWEST:
            continue
        # The force may relax for half a cycle after the motion has stopped.
        rest = slice(int(np.searchsorted(time, time[start] + 0.5 * period)) if start else 0, stop)
        if stop - rest.start < _FEWEST or time[stop - 1] - time[rest.start] < 0.4 * period:
            continue
        still = float(np.ptp(run.displacement[rest])) < _STILL * stroke
        if still and float(np.ptp(run.force[rest])) > _GOES_ON * swing:
            problem = f"the force goes on from {time[rest.start]:.4g} s on while the displacement rests"
            raise view.refused("E_UNRELATED", problem, "check the displacement channel there, or cut the record")
