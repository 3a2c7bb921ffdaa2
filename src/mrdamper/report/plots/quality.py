"""The loops of a set of records, small, with the samples marked that the quality checks flagged."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from mrdamper.data import Floats
from mrdamper.report.plots.style import MEASURED, MM, PALETTE, house_style, new_figure

_COLUMNS = 4
_MOST_POINTS = 2000  # of a loop's line
_MOST_PANELS = 80  # of one figure
_FLAG, _REFUSED = PALETTE[2], PALETTE[4]


@dataclass(frozen=True, eq=False)
class LoopPanel:
    """One record's loop.

    Attributes
    ----------
    title : str
        Name of the record.
    note : str
        Codes of what was found; empty for a good record.
    displacement, force : (N,) arrays
        [m], [N], NaN where a sample is missing.
    flagged : (N,) bool array
        Samples to be marked.
    refused : bool
    """

    title: str
    note: str
    displacement: Floats
    force: Floats
    flagged: np.ndarray
    refused: bool = False


def quality_figure(panels: Sequence[LoopPanel]) -> Figure:
    """Force over displacement of every record, refused ones in another colour, flagged samples marked.

    Parameters
    ----------
    panels : sequence of LoopPanel
        The first eighty are drawn.
    """
    shown = panels[:_MOST_PANELS]
    columns = min(_COLUMNS, max(1, len(shown)))
    rows = max(1, math.ceil(len(shown) / columns))
    with house_style():
        figure, axes = new_figure(rows, columns, 0.75 + 1.95 * rows)
        for panel, place in zip(shown, axes, strict=False):
            thin = slice(None, None, max(1, panel.displacement.size // _MOST_POINTS))
            place.plot(
                MM * panel.displacement[thin],
                panel.force[thin],
                color=_REFUSED if panel.refused else MEASURED,
                lw=0.6,
            )
            if panel.flagged.any():
                place.plot(MM * panel.displacement[panel.flagged], panel.force[panel.flagged], ".", color=_FLAG, ms=3)
            # Names come from files: no mathematics in them.
            place.set_title(_short(panel.title), loc="left", fontsize=7.5, parse_math=False, pad=11)
            place.text(0, 1.02, panel.note, transform=place.transAxes, fontsize=6, color=_FLAG, parse_math=False)
            place.xaxis.set_major_locator(MaxNLocator(3))
            place.yaxis.set_major_locator(MaxNLocator(4))
            place.tick_params(labelsize=6.5)
        for i, place in enumerate(axes):
            place.set_visible(i < len(shown))
            if i + columns >= len(shown):
                place.set_xlabel("Displacement (mm)", fontsize=7.5)
            if i % columns == 0:
                place.set_ylabel("Force (N)", fontsize=7.5)
        return figure


def _short(name: str) -> str:
    return name if len(name) <= 20 else name[:9] + "…" + name[-10:]
