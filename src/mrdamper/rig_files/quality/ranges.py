"""Magnitudes no damper test has: a wrong unit, or columns exchanged."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding

LONGEST_STROKE = 3.0  # [m] peak to peak; the longest test rigs have about 1.5 m
LARGEST_FORCE = 2e7  # [N]; the largest seismic test machines
SMALLEST_FORCE = 0.5  # [N] peak to peak; a load cell of a damper rig resolves about 1 N
LARGEST_CURRENT = 200.0  # [A]
FASTEST = 30.0  # [m/s]
SHORT_STROKE, LONG_STROKE = 0.15e-3, 0.9  # [m] peak to peak: beyond, a slip of the unit is likelier than a test
SMALL_FORCE, LARGE_FORCE = 8.0, 1.5e6  # [N] peak to peak
SLOW = 300.0  # [s] of a cycle
FEWEST_LEVELS, _MANY = 16, 8  # values of a channel, and samples for each


def exchanged_or_out_of_range(view: View) -> None:
    """Refuse channels whose size says that a unit is wrong or that columns are exchanged."""
    record, strokes = view.record, view.strokes
    stroke, force = _peak_to_peak(record.displacement), _peak_to_peak(record.force)
    largest, current = (
        0.0 if values is None else max(float(np.nanmax(values)), -float(np.nanmin(values)))
        for values in (record.force, record.current)
    )
    speed = float(np.median(strokes.lengths / strokes.durations)) if strokes.durations.size else 0.0
    unit = "set its unit in a profile: [channels.{}] unit{}"
    if stroke > LONGEST_STROKE:
        problem, remedy = f"displacement moves {stroke:.4g} m peak to peak", unit.format("displacement", ' = "mm"?')
        if force < LONGEST_STROKE:
            problem += f", force {force:.4g} N"
            remedy = "displacement and force look exchanged: name the columns the other way round"
    elif largest > LARGEST_FORCE:
        problem, remedy = f"force reaches {largest:.4g} N", unit.format("force", "")
    elif force < SMALLEST_FORCE:
        problem = f"force changes by {force:.3g} N in the whole record"
        remedy = "check the load cell, the unit of force (kN?), or whether columns are exchanged"
    elif current > LARGEST_CURRENT:
        problem, remedy = f"current reaches {current:.4g} A", unit.format("current", ' = "mA"?')
    elif speed > FASTEST:
        problem = f"the mean speed of the strokes is {speed:.4g} m/s"
        remedy = "check the units of time and displacement"
    else:
        return
    raise view.refused("E_RANGE", problem, remedy)


def unusual(view: View) -> Iterator[Finding]:
    """Report values that hardly occur in a damper test: sizes of a slipped unit, and channels of a few levels."""
    record, period = view.record, view.strokes.period
    stroke, force = _peak_to_peak(record.displacement), _peak_to_peak(record.force)
    sizes = (
        (stroke < SHORT_STROKE or stroke > LONG_STROKE, f"displacement moves {1e3 * stroke:.3g} mm peak to peak"),
        (force < SMALL_FORCE or force > LARGE_FORCE, f"force changes by {force:.3g} N in all"),
        (period is not None and period > SLOW, f"a cycle takes {period or 0:.3g} s"),
    )
    for odd, text in sizes:
        if odd:
            yield Finding("W_RANGE", f"{text}: is its unit right?")
    for name in ("displacement", "force"):
        values = getattr(view.run, name)
        levels = np.unique(values[: _MANY * FEWEST_LEVELS]).size
        levels = levels if levels >= FEWEST_LEVELS else np.unique(values).size
        if levels < FEWEST_LEVELS and view.run.time.size > _MANY * levels:
            yield Finding(
                "W_COARSE", f"{name} has {levels} different values only: a sensor of so few steps hides the loop"
            )


def _peak_to_peak(values: np.ndarray) -> float:
    return float(np.nanmax(values) - np.nanmin(values))
