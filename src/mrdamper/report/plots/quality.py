"""The loops of a set of records, small, with the samples marked that the quality checks flagged."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrdamper.data import Floats
from mrdamper.report.plots.figure import Figure
from mrdamper.report.plots.style import MEASURED, MM, PALETTE

_COLUMNS = 4
_MOST_POINTS = 2000  # of a loop's line
_MOST_PANELS = 80  # of one figure
_FLAG, _REFUSED = PALETTE[2], PALETTE[4]


@dataclass(frozen=True, eq=False)
class LoopPanel:
    """One record's loop."""

    title: str  # name of the record
    note: str  # codes of findings; empty for a good record
    # displacement and force: (N,) [m], [N], NaN where a sample is missing
    displacement: Floats
    force: Floats
    flagged: np.ndarray  # (N,) samples to be marked
    refused: bool = False


def quality_figure(panels: Sequence[LoopPanel]) -> Figure:
    """Draw the loops of the first eighty records, refused ones in another colour, flagged samples marked."""
    shown = panels[:_MOST_PANELS]
    columns = min(_COLUMNS, max(1, len(shown)))
    rows = max(1, math.ceil(len(shown) / columns))
    figure = Figure(rows, columns, 0.75 + 1.95 * rows)
    for panel, place in zip(shown, figure.axes, strict=False):
        thin = slice(None, None, max(1, panel.displacement.size // _MOST_POINTS))
        place.plot(
            MM * panel.displacement[thin], panel.force[thin], color=_REFUSED if panel.refused else MEASURED, lw=0.6
        )
        if panel.flagged.any():
            place.plot(MM * panel.displacement[panel.flagged], panel.force[panel.flagged], ".", color=_FLAG, ms=3)
        place.title, place.size, place.tick_size, place.raised = _short(panel.title), 7.5, 6.5, 12.0
        place.text(0, 1.03, panel.note, size=6, color=_FLAG)
        place.x.most, place.y.most = 3, 4
    for i, place in enumerate(figure.axes):
        if i + columns >= len(shown):
            place.x.name = "Displacement (mm)"
        if i % columns == 0:
            place.y.name = "Force (N)"
    return figure


def _short(name: str) -> str:
    return name if len(name) <= 20 else name[:9] + "…" + name[-10:]
