"""Figures: panels of curves, marks and texts, laid out once, written as SVG here and as PDF and PNG by matplotlib.

Lengths on paper are points (1/72 inch) from the top left corner. A figure becomes a list of paths and texts in the
order in which they are drawn; both writers use that list, so that all files show the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mrdamper.data import Floats
from mrdamper.data.wording import raised
from mrdamper.report.plots.drawing import INCH, INK, Drawing, DrawnPath, DrawnText, Look, text_width

WIDTH = 7.2  # inches, two journal columns
_SIZE, _SMALL = 9.0, 8.0  # type sizes [pt]: names and titles; ticks and legends
_GRID = "#e3e3e3"
_FRAME = 0.7  # width of axes and ticks [pt]
_TICK, _GAP = 3.5, 3.5  # length of a tick, distance between a tick and its text [pt]
_SPACED = 1.4  # width of a tick's text and the gap to the next one, over the text in a narrow type
_WIDE_TYPE = 1.1  # width of a text in a wide type over that in a common one
_MARGIN = 0.05  # share of the range left free beside the data
_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)  # distances of ticks in a decade
_MAX_LABELLED_DECADES = 2.5  # of a logarithmic axis with ticks at 2 and 5, too
_FEWEST_TICKS = 3  # of a logarithmic axis; with fewer they are even numbers, as on a linear axis


@dataclass(frozen=True, eq=False)
class Curve:
    """A named curve in the units of its axes."""

    x: Floats
    y: Floats
    look: Look
    label: str = ""
    shift: float = 0.0  # to the right of its place [pt]


class Axis:
    """One direction of a panel: its limits, scale and ticks."""

    def __init__(self) -> None:
        self.name, self.log, self.reversed = "", False, False
        self.low: float | None = None
        self.high: float | None = None
        self.margin = _MARGIN
        self.places: Sequence[float] | None = None  # of ticks
        self.texts: Sequence[str] | None = None
        self.most = 9  # distances of ticks
        self.grid, self.labelled = True, True

    def limits(self, values: Sequence[Floats]) -> tuple[float, float]:
        """Return ends of the axis, where they are not given, a margin beyond the values."""
        every = np.concatenate([[end for end in (self.low, self.high) if end is not None], *values])
        every = every[np.isfinite(every) & ((every > 0) | np.full(every.size, not self.log))]
        low, high = (float(every.min()), float(every.max())) if every.size else (0.1, 1.0)
        if self.log:
            low, high = np.log10(low), np.log10(high)
        if high - low <= 1e-12 * max(abs(low), abs(high), 1e-300):
            low, high = low - (0.05 * abs(low) or 0.05), high + (0.05 * abs(high) or 0.05)
        reach = self.margin * (high - low)
        low, high = low - reach, high + reach
        if self.log:
            low, high = 10.0**low, 10.0**high
        return (low if self.low is None else self.low), (high if self.high is None else self.high)

    def share(self, values: ArrayLike, ends: tuple[float, float]) -> Floats:
        """Places between the ends, 0...1."""
        numbers = np.asarray(values, dtype=float)
        low, high = ends
        if self.log:
            numbers, low, high = np.log10(np.maximum(numbers, 1e-300)), np.log10(low), np.log10(high)
        share = (numbers - low) / (high - low)
        return 1 - share if self.reversed else share

    def ticks(self, ends: tuple[float, float], room: float = np.inf) -> tuple[Floats, Sequence[str]]:
        """Places of ticks inside the ends, and their texts, which fit side by side into a width [type sizes]."""
        if self.places is not None:
            places = np.asarray(self.places, dtype=float)
            return places, self.texts if self.texts is not None else [f"{p:g}" for p in places]
        if self.log:
            wide = np.log10(ends[1] / ends[0]) >= _MAX_LABELLED_DECADES
            for steps in ((1.0,), (1.0, 2.0, 5.0)) if wide else ((1.0, 2.0, 5.0),):
                places, texts = _decades(*ends, steps)
                if len(places) >= _FEWEST_TICKS:
                    return places, texts
        for most in range(self.most, 1, -1):
            places, texts = _even(*ends, most)
            if sum(text_width(text, _SPACED) for text in texts) < room:
                return places, texts
        return _even(*ends, 1)


def _even(low: float, high: float, most: int) -> tuple[Floats, list[str]]:
    power = 10.0 ** np.floor(np.log10(max(high - low, 1e-300) / (most + 2)))
    steps = (scale * power * step for scale in (1.0, 10.0) for step in _STEPS)
    step = next(step for step in steps if np.floor(high / step + 1e-9) - np.ceil(low / step - 1e-9) <= most)
    near = 1e-9 * step
    places = step * np.arange(np.ceil((low - near) / step), np.floor((high + near) / step) + 1)
    digits = next(d for d in range(20) if abs(step * 10.0**d - round(step * 10.0**d)) < 1e-6 * step * 10.0**d)
    return places, [f"{place + 0.0:.{digits}f}".replace("-", "−") for place in np.round(places, digits)]


def _decades(low: float, high: float, within: Sequence[float]) -> tuple[Floats, list[str]]:
    first, last = int(np.floor(np.log10(low))), int(np.ceil(np.log10(high)))
    every = max(1, round((last - first) / 6))
    places = np.array([s * 10.0**k for k in range(first, last + 1, every) for s in within])
    places = places[(places >= low * (1 - 1e-9)) & (places <= high * (1 + 1e-9))]
    plain = low > 1e-4 and high < 1e5
    return places, [f"{p:g}" if plain else _with_power_of_ten(p) for p in places]


def _with_power_of_ten(value: float) -> str:
    digit, power = f"{value:.0e}".split("e")
    return raised(f"{'' if digit == '1' else f'{digit}·'}10^{int(power)}")


@dataclass(eq=False)
class Axes:
    """A panel: curves over two axes, a title, texts, a legend."""

    # left, top, width and height: of the frame [pt]
    left: float
    top: float
    width: float
    height: float
    x: Axis = field(default_factory=Axis)
    y: Axis = field(default_factory=Axis)
    title: str = ""
    size: float = _SIZE  # of title and names [pt]
    raised: float = 6.0  # title over the frame [pt]
    tick_size: float = _SMALL
    series: list[Curve] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.x.most = int(np.clip(self.width / INCH / 0.42, 2, 6))
        self.y.most = int(np.clip(self.height / INCH / 0.22, 2, 9))
        self._lines: list[tuple[str, float, Look]] = []
        self._bars: list[tuple[Floats, Floats, str]] = []
        self._texts: list[tuple[float, float, str, str, float, str]] = []
        self._legend: tuple[str, float, int] | None = None

    @property
    def filled(self) -> bool:
        """True if something is drawn; an empty panel has no frame."""
        return bool(self.series or self._lines or self._bars or self._texts)

    def plot(
        self, x: ArrayLike, y: ArrayLike, mark: str = "", *, label: str = "", shift: float = 0.0, **look: Any
    ) -> None:
        """Draw a curve in a `Look`; a mark without a line style has no line. `shift` is to the right [inch]."""
        look.setdefault("ls", "" if mark else "-")
        across, up = (np.asarray(values, dtype=float).ravel() for values in (x, y))
        self.series.append(Curve(across, up, Look(mark=mark, **look), label, shift * INCH))

    def line(self, direction: str, at: float, color: str = INK, lw: float = 0.6, ls: str = "-") -> None:
        """Draw a straight line across the panel: "x" at a height, "y" at an abscissa."""
        self._lines.append((direction, at, Look(color, lw, ls)))

    def bars(self, edges: Floats, heights: Floats, color: str) -> None:
        """Draw a histogram."""
        self._bars.append((np.asarray(edges, dtype=float), np.asarray(heights, dtype=float), color))

    def text(
        self, x: float, y: float, text: str, *, anchor: str = "start", size: float = _SMALL, color: str = INK
    ) -> None:
        """Write at a place in shares of the panel from its lower left corner."""
        self._texts.append((x, y, text, anchor, size, color))

    def legend(self, place: str = "best", *, size: float = _SMALL, columns: int = 1) -> None:
        """List the named curves "right" of the panel, "above" the figure, at a corner, or where least is drawn."""
        self._legend = place, size, columns

    def label(self, x: str, y: str, title: str = "") -> None:
        """Name the axes; quantities first, units in brackets."""
        self.x.name, self.y.name = x, y
        self.title = title or self.title

    def ends(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Lower and upper ends of both axes."""
        x, y = [one.x for one in self.series], [one.y for one in self.series]
        for edges, heights, _ in self._bars:
            x, y = [*x, edges], [*y, np.append(heights, 0.0)]
        for direction, at, _ in self._lines:
            (y if direction == "x" else x).append(np.array([at]))
        return self.x.limits(x), self.y.limits(y)

    def drawn(self, letter: str, whole: tuple[float, float]) -> Iterator[DrawnPath | DrawnText]:
        """Lay out the panel; `letter` is that of the panel, `whole` the size of the figure [pt]."""
        (x_ends, y_ends), frame = self.ends(), (self.left, self.top, self.width, self.height)

        def placed(x: ArrayLike, y: ArrayLike) -> Floats:
            across = self.left + self.width * self.x.share(x, x_ends)
            return np.column_stack([across, self.top + self.height * (1 - self.y.share(y, y_ends))])

        bottom = self.top + self.height
        yield from self._ticked(x_ends, y_ends)
        for edges, heights, color in self._bars:
            for a, b, h in zip(edges[:-1], edges[1:], heights, strict=True):
                corners = placed([a, a, b, b], [max(0.0, y_ends[0]), h, h, max(0.0, y_ends[0])])
                yield DrawnPath(corners, Look(color, 0.0), frame, fill=color)
        for direction, at, look in self._lines:
            ends = placed(*(((x_ends, [at, at])) if direction == "x" else ([at, at], y_ends)))
            yield DrawnPath(ends, look, frame)
        curves = []
        for one in self.series:
            points = placed(one.x, one.y) + np.array([one.shift, 0.0])
            curves.append(points)
            if points.size:
                yield DrawnPath(points, one.look, None if one.look.mark and not one.look.ls else frame)
        edge = Look(INK, _FRAME)
        yield DrawnPath(np.array([[self.left, self.top], [self.left, bottom], [self.left + self.width, bottom]]), edge)
        yield DrawnText(self.left, self.top - self.raised, f"{letter}{self.title}".strip(), self.size)
        for x, y, text, anchor, size, color in self._texts:
            yield DrawnText(self.left + x * self.width, bottom - y * self.height, text, size, anchor, color=color)
        if self._legend is not None:
            yield from self._listed(whole, curves)

    def _ticked(self, x_ends: tuple[float, float], y_ends: tuple[float, float]) -> Iterator[DrawnPath | DrawnText]:
        bottom, right, widest = self.top + self.height, self.left + self.width, 0.0
        grid, edge, size = Look(_GRID, 0.5), Look(INK, _FRAME), self.tick_size
        places, texts = self.x.ticks(x_ends, self.width / size)
        down = bottom + _TICK + _GAP
        for place, text in zip(self.left + self.width * self.x.share(places, x_ends), texts, strict=True):
            if not self.left - 0.5 <= place <= right + 0.5:
                continue
            if self.x.grid:
                yield DrawnPath(np.array([[place, self.top], [place, bottom]]), grid)
            yield DrawnPath(np.array([[place, bottom], [place, bottom + _TICK]]), edge)
            for number, row in enumerate(text.split("\n")):
                yield DrawnText(place, down + (0.72 + 1.2 * number) * size, row, size, "middle")
        places, texts = self.y.ticks(y_ends)
        for place, text in zip(bottom - self.height * self.y.share(places, y_ends), texts, strict=True):
            if not self.top - 0.5 <= place <= bottom + 0.5:
                continue
            if self.y.grid:
                yield DrawnPath(np.array([[self.left, place], [right, place]]), grid)
            yield DrawnPath(np.array([[self.left - _TICK, place], [self.left, place]]), edge)
            if self.y.labelled:
                widest = max(widest, text_width(text, size))
                yield DrawnText(self.left - _TICK - _GAP, place + 0.35 * size, text, size, "end")
        rows = max((text.count("\n") + 1 for text in self.x.texts or ()), default=1)
        middle = self.left + self.width / 2, self.top + self.height / 2
        yield DrawnText(middle[0], down + (1.2 * rows + 0.95) * size, self.x.name, self.size, "middle")
        aside = self.left - _TICK - _GAP - _WIDE_TYPE * widest - 0.6 * self.size
        yield DrawnText(aside, middle[1], self.y.name, self.size, "middle", turned=True)

    def _listed(self, whole: tuple[float, float], curves: Sequence[Floats]) -> Iterator[DrawnPath | DrawnText]:
        assert self._legend is not None
        place, size, columns = self._legend
        named = [one for one in self.series if one.label]
        if not named:
            return
        rows, handle = -(-len(named) // columns), 2.0 * size
        widths = [
            max(text_width(one.label, size) for one in named[c * rows : (c + 1) * rows])
            for c in range(-(-len(named) // rows))
        ]
        steps = [handle + 0.8 * size + wide + 1.6 * size for wide in widths]
        box = sum(steps) - 1.6 * size, 1.3 * size * rows
        left, top = self._corner(place, box, whole, curves)
        for number, one in enumerate(named):
            column, row = divmod(number, rows)
            x, y = left + sum(steps[:column]), top + 1.3 * size * (row + 0.5)
            ends = np.array([[x, y], [x + handle, y]]) if one.look.ls else np.array([[x + handle / 2, y]])
            yield DrawnPath(ends, replace(one.look, mark="") if one.look.ls else one.look)
            if one.look.ls and one.look.mark:
                yield DrawnPath(np.array([[x + handle / 2, y]]), replace(one.look, ls=""))
            yield DrawnText(x + handle + 0.8 * size, y + 0.35 * size, one.label, size)

    def _corner(
        self, place: str, box: tuple[float, float], whole: tuple[float, float], curves: Sequence[Floats]
    ) -> tuple[float, float]:
        wide, high = box
        if place == "right":
            return self.left + self.width + 9.0, self.top + (self.height - high) / 2
        if place == "above":
            return (whole[0] - wide) / 2, 5.0
        inset = 5.0
        left, right = self.left + inset, self.left + self.width - wide - inset
        top, bottom = self.top + inset, self.top + self.height - high - inset
        middle = self.left + (self.width - wide) / 2, self.top + (self.height - high) / 2
        corners = {
            "upper right": (right, top), "upper left": (left, top), "lower left": (left, bottom),
            "lower right": (right, bottom), "center": middle, "lower center": (middle[0], bottom),
            "upper center": (middle[0], top),
        }  # fmt: skip
        if place in corners:
            return corners[place]
        points = np.concatenate([np.zeros((0, 2)), *curves])

        def covered(corner: tuple[float, float]) -> int:
            inside = (points >= np.array(corner) - 3.0) & (points <= np.array(corner) + np.array(box) + 3.0)
            return int(np.sum(inside.all(axis=1)))

        return min(corners.values(), key=covered)


def room_beside(texts: Iterable[str]) -> float:
    """Return the margin for the texts of a vertical axis [inch]."""
    return 0.2 + _WIDE_TYPE * max(text_width(text, _SMALL) for text in texts) / INCH


class Figure:
    """Panels in rows, on a sheet of two journal columns; all lengths in inches.

    With `share_y` all panels have one vertical axis, named on the left; `lettered` puts (a), (b), ... before the titles
    where there are several panels.
    """

    def __init__(
        self,
        rows: int,
        columns: int,
        height: float,
        *,
        left: float = 0.78,
        right: float = 0.12,
        top: float = 0.28,
        bottom: float = 0.46,
        gap: float = 0.78,
        share_y: bool = False,
        lettered: bool = True,
    ):
        self.width, self.height = WIDTH * INCH, height * INCH
        down = gap + 0.1 if gap > 0.3 else gap
        wide = (WIDTH - left - right - (columns - 1) * gap) / columns * INCH
        tall = (height - top - bottom - (rows - 1) * down) / rows * INCH
        self.axes = [
            Axes(left * INCH + column * (wide + gap * INCH), top * INCH + row * (tall + down * INCH), wide, tall)
            for row in range(rows)
            for column in range(columns)
        ]
        self._share_y, self._lettered = share_y, lettered
        self._scale: tuple[str, float, float, Sequence[str]] = "", 0.0, 1.0, ()

    def add_scale(self, text: str, low: float, high: float, colours: Sequence[str]) -> None:
        """Draw a scale of colours in the right margin."""
        self._scale = text, low, high, colours

    def drawn(self) -> Drawing:
        """Lay out the figure."""
        panels = [axes for axes in self.axes if axes.filled]
        if self._share_y:
            ends = np.array([axes.ends()[1] for axes in panels])
            for number, axes in enumerate(panels):
                axes.y.low, axes.y.high, axes.y.labelled = ends[:, 0].min(), ends[:, 1].max(), not number
        parts: list[DrawnPath | DrawnText] = []
        for number, axes in enumerate(panels):
            letter = f"({chr(ord('a') + number % 26) * (1 + number // 26)}) " if self._lettered and panels[1:] else ""
            parts += axes.drawn(letter, (self.width, self.height))
        return Drawing(self.width, self.height, [*parts, *self._scaled()])

    def _scaled(self) -> Iterator[DrawnPath | DrawnText]:
        text, low, high, colours = self._scale
        if not colours:
            return
        last = self.axes[-1]
        left, top = last.left + last.width + 0.35 * INCH, self.axes[0].top
        wide, high_pt = 0.12 * INCH, last.top + last.height - self.axes[0].top
        step = high_pt / len(colours)
        for number, colour in enumerate(colours):
            y = top + high_pt - number * step
            corners = np.array([[left, y], [left + wide, y], [left + wide, y - 1.1 * step], [left, y - 1.1 * step]])
            yield DrawnPath(corners, Look(colour, 0.0), (left, top, wide, high_pt), fill=colour)
        places, texts = _even(low, high, int(np.clip(high_pt / INCH / 0.3, 2, 9)))
        widest = max(text_width(t, _SMALL) for t in texts)
        for place, tick in zip(top + high_pt * (1 - (places - low) / (high - low)), texts, strict=True):
            yield DrawnPath(np.array([[left + wide, place], [left + wide + _TICK, place]]), Look(INK, _FRAME))
            yield DrawnText(left + wide + _TICK + _GAP, place + 0.35 * _SMALL, tick, _SMALL)
        aside = left + wide + _TICK + 2 * _GAP + widest + 0.8 * _SIZE
        yield DrawnText(aside, top + high_pt / 2, text, _SIZE, "middle", turned=True)


def new_figure(rows: int, columns: int, height: float, **layout: Any) -> tuple[Figure, *tuple[Axes, ...]]:
    """Return a figure in a layout of `Figure`, and its panels row by row."""
    figure = Figure(rows, columns, height, **layout)
    return figure, *figure.axes
