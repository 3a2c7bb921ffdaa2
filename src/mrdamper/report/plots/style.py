"""Style of figures: engineers' units, colours distinct in colour blindness and grey print; figures as files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mrdamper.data import Condition, Floats, current_levels
from mrdamper.data.encoding import csv_text
from mrdamper.data.wording import raised
from mrdamper.report.plots.figure import Figure

# Okabe and Ito's palette, black first.
PALETTE = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#F0E442")
MEASURED, PREDICTED = PALETTE[0], PALETTE[2]
MM, KN = 1e3, 1e-3
MOST_NAMED = 10  # motions in a legend; with more a scale is drawn
KINDS = ("svg", "pdf", "png")  # of files
# The dark 85 % of viridis at equal distances, distinct in grey print, too.
_SHADES = ("440154", "482677", "3f4788", "32648e", "277e8e", "1f988b", "2cb17e", "5ac864", "9bd93c")


def _shade(share: float) -> str:
    channels = np.array([[int(shade[i : i + 2], 16) for i in (0, 2, 4)] for shade in _SHADES])
    at = share * (len(_SHADES) - 1)
    return "#" + "".join(f"{round(float(np.interp(at, range(len(_SHADES)), c))):02x}" for c in channels.T)


def current_colours(values: Sequence[float]) -> dict[float, str]:
    """Return one colour per value, from dark to light with rising value."""
    steps = sorted(set(values))
    return {step: _shade(number / max(len(steps) - 1, 1)) for number, step in enumerate(steps)}


def motion_name(condition: Condition) -> str:
    """Name a motion by its frequency and amplitude."""
    return f"{condition.frequency_Hz:.2g} Hz, {MM * condition.amplitude_m:.3g} mm"


def levels(currents: Sequence[float]) -> list[float]:
    """Return the level of the test matrix of each current [A]: currents that differ by noise alone have one colour."""
    return current_levels([abs(current) for current in currents])


def motion_colours(figure: Figure, conditions: Sequence[Condition]) -> dict[float, str]:
    """Return one colour per peak velocity of some motions: on a scale in the right margin where they are many."""
    speeds = [condition.peak_velocity for condition in conditions]
    if len(speeds) <= MOST_NAMED:
        return current_colours(speeds)
    low, high = min(speeds), max(speeds)
    high = high if high > low else low + 1
    figure.add_scale("Peak velocity (m/s)", low, high, [_shade(share) for share in np.linspace(0, 1, 64)])
    return {speed: _shade((speed - low) / (high - low)) for speed in speeds}


def powered(text: str, largest: float) -> tuple[str, float]:
    """Return an axis title with its unit in a power of a thousand, and the factor to multiply values by."""
    power = 3 * int(np.floor(np.log10(largest) / 3)) if largest >= 1e5 or 0 < largest < 1e-3 else 0
    if not power:
        return text, 1.0
    name, _, unit = text.rpartition("(")
    return raised(f"{name}(10^{power} {unit}"), 10.0**-power


def thin(array: Floats, most: int = 400) -> Floats:
    """Return every n-th sample, so that a curve has at most so many points."""
    return array[:: max(1, array.size // most)]


Picture = Mapping[str, bytes]  # files of a figure by their suffix: an SVG, its data as CSV, further formats


def picture_of(figure: Figure, also: Sequence[str] = ()) -> Picture:
    """Draw a figure; `also` "png" or "pdf" beside the SVG, each of which takes fifty times as long."""
    drawing = figure.drawn()
    return {kind: drawing.file(kind) for kind in ("svg", *also)} | {"csv": figure_data(figure).encode()}


def picture_files(pictures: Mapping[str, Picture], suffix: str = "", folder: str = "figures/") -> dict[str, bytes]:
    """Return the files of figures by their paths; the names end in a suffix."""
    files = ((f"{folder}{name}{suffix}", picture) for name, picture in pictures.items())
    return {f"{stem}.{kind}": data for stem, picture in files for kind, data in picture.items()}


def figure_data(figure: Figure) -> str:
    """Return the points of all curves and marks of a figure as CSV, one row per point."""
    names, rows = ("panel", "x_is", "y_is", "series"), ["panel,x_is,y_is,series,x,y\n"]
    head = csv_text([], names)
    for number, axes in enumerate(figure.axes, 1):
        for one in axes.series:
            about = dict(zip(names, (number, axes.x.name, axes.y.name, one.label), strict=True))
            begin = csv_text([about]).removeprefix(head).removesuffix("\n")
            rows += [f"{begin},{x!r},{y!r}\n" for x, y in zip(one.x.tolist(), one.y.tolist(), strict=True)]
    return "".join(rows)
