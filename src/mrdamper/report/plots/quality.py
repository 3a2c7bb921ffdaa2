"""The loops of a set of records, small, with the samples marked that the quality checks flagged."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mrdamper.report.plots.figure import Figure
from mrdamper.report.plots.style import MEASURED, MM, PALETTE, thin
from mrdamper.rig_files.quality.table import Quality

_COLUMNS = 4
_MOST_POINTS = 2000  # of a loop's line
_MOST_PANELS = 80  # of one figure
_FLAG, _REFUSED = PALETTE[2], PALETTE[4]


def quality_figure(panels: Sequence[tuple[Quality, NDArray[np.bool_]]]) -> Figure:
    """Draw the loops of the first eighty records, refused ones in another colour, with the samples that are flagged."""
    shown = panels[:_MOST_PANELS]
    columns = min(_COLUMNS, max(1, len(shown)))
    rows = max(1, math.ceil(len(shown) / columns))
    figure = Figure(rows, columns, 0.75 + 1.95 * rows)
    for (verdict, flagged), place in zip(shown, figure.axes, strict=False):
        x, force = MM * verdict.record.displacement, verdict.record.force
        colour = MEASURED if verdict.refusal is None else _REFUSED
        place.plot(thin(x, _MOST_POINTS), thin(force, _MOST_POINTS), color=colour, lw=0.6)
        if flagged.any():
            place.plot(x[flagged], force[flagged], ".", color=_FLAG, ms=3)
        place.title, place.size, place.tick_size, place.raised = _short(verdict.record.id), 7.5, 6.5, 12.0
        place.text(0, 1.03, " ".join(verdict.codes), size=6, color=_FLAG)
        place.x.most, place.y.most = 3, 4
    for i, place in enumerate(figure.axes):
        if i + columns >= len(shown):
            place.x.name = "Displacement (mm)"
        if i % columns == 0:
            place.y.name = "Force (N)"
    return figure


def _short(name: str) -> str:
    return name if len(name) <= 20 else name[:9] + "…" + name[-10:]
