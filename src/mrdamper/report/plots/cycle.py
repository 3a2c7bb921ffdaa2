"""The last cycle of a run: which samples it has, and its loops over displacement and velocity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mrdamper.data import Floats, Run
from mrdamper.physics.motion import Excitation
from mrdamper.report.plots.figure import Axes
from mrdamper.report.plots.style import MM, thin

T = TypeVar("T")


def last_cycle(run: Run, frequency_Hz: float) -> NDArray[np.bool_]:
    """(N,) mask of the last cycle in the steady window, a fiftieth longer than a period, so that the loop closes."""
    end = float(run.time[run.in_window][-1])
    return run.in_window & (run.time >= end - 1.02 / frequency_Hz)


def draw_loop(panels: Sequence[Axes], motion: Excitation, force: Floats, **look: Any) -> None:
    """Draw a force over displacement in the first panel, and over velocity in the second."""
    for panel, across in zip(panels, (MM * motion.displacement, motion.velocity), strict=True):
        panel.plot(thin(across), thin(force), **look)


def spread_out(ordered: Sequence[T], most: int) -> list[T]:
    """Select at most so many members, evenly over their order, the first and the last among them."""
    picks = np.unique(np.linspace(0, len(ordered) - 1, min(most, len(ordered))).round().astype(int))
    return [ordered[i] for i in picks]
