"""Drawings: paths and texts on paper, written as SVG here, and as PDF and PNG by matplotlib.

Lengths are points (1/72 inch) from the upper left corner.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from mrdamper.data import Floats

INCH = 72.0  # points
INK = "#000000"
_PRINTED: Mapping[str, Mapping[str, Any]] = {  # the same drawing has the same bytes
    "pdf": {"metadata": {"CreationDate": None}},
    "png": {"dpi": 150, "pil_kwargs": {"compress_level": 2}},  # a fifth faster, a twentieth larger
}
_FAMILY = "Arial, Helvetica, 'DejaVu Sans', sans-serif"
_DASHES = {"-": (), "--": (3.7, 1.6), ":": (1.0, 1.65)}  # in widths of the line
# Outlines of marks, in half sizes; a circle is an arc.
_MARKS: Mapping[str, tuple[tuple[float, float], ...]] = {
    "s": ((-1, -1), (1, -1), (1, 1), (-1, 1)),
    "^": ((0, -1), (1, 1), (-1, 1)),
    "v": ((0, 1), (1, -1), (-1, -1)),
    ">": ((1, 0), (-1, 1), (-1, -1)),
    "D": ((0, -1.3), (1.3, 0), (0, 1.3), (-1.3, 0)),
    "P": ((-0.33, -1), (0.33, -1), (0.33, -0.33), (1, -0.33), (1, 0.33), (0.33, 0.33), (0.33, 1), (-0.33, 1),
          (-0.33, 0.33), (-1, 0.33), (-1, -0.33), (-0.33, -0.33)),
    "|": ((0, -1), (0, 1)),
    "_": ((-1, 0), (1, 0)),
}  # fmt: skip
_DOTS = {".": 0.5, ",": 0.15}  # marks that are small circles, and their share of the size


@dataclass(frozen=True)
class Look:
    """Style of a curve: sizes in points, an empty `ls` for marks alone, an empty `mark` for the line alone."""

    color: str = INK
    lw: float = 1.2
    ls: str = "-"
    mark: str = ""
    ms: float = 6.0
    mfc: str = ""  # of the marks inside: "none" for hollow ones; default the colour of the curve
    mew: float = 1.0
    alpha: float = 1.0


@dataclass(frozen=True, eq=False)
class DrawnPath:
    """A curve on paper; `fill` closes and fills it."""

    points: Floats  # (N, 2) [pt]
    look: Look
    clip: tuple[float, float, float, float] | None = None  # left, top, width, height
    fill: str = ""


@dataclass(frozen=True)
class DrawnText:
    """A line of text on paper: its anchor, at "start", "middle" or "end", is on the baseline."""

    x: float
    y: float
    text: str
    size: float
    anchor: str = "start"
    turned: bool = False  # upwards
    color: str = INK


def text_width(text: str, size: float) -> float:
    """Width of a line of text [pt], in a common sans-serif type."""
    narrow, wide, capital = "ijlft.,:;'|!()[] I/", "mwMW%@–−→", "ABCDEFGHKNOPQRSUVXYZ"
    units = sum(0.3 if c in narrow else 0.86 if c in wide else 0.69 if c in capital else 0.56 for c in text)
    return units * size


@dataclass(frozen=True, eq=False)
class Drawing:
    """Paths and texts on a sheet."""

    # width and height: [pt]
    width: float
    height: float
    parts: Sequence[DrawnPath | DrawnText]  # in the order in which they are drawn

    def file(self, kind: str) -> bytes:
        """Write an "svg", "pdf" or "png"; the same drawing has the same bytes."""
        return self._svg() if kind == "svg" else self._printed(kind)

    def _svg(self) -> bytes:
        size = f'width="{self.width:g}pt" height="{self.height:g}pt" viewBox="0 0 {self.width:g} {self.height:g}"'
        lines = [f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="{_FAMILY}">']
        lines.append('<rect width="100%" height="100%" fill="#ffffff"/>')
        clip = None
        for part in self.parts:
            inside = part.clip if isinstance(part, DrawnPath) else None
            if inside != clip:
                lines += ["</svg>"] * (clip is not None)
                if inside is not None:
                    x, y, w, h = (f"{value:.2f}" for value in inside)
                    lines.append(f'<svg x="{x}" y="{y}" width="{w}" height="{h}" viewBox="{x} {y} {w} {h}">')
                clip = inside
            lines += _svg_path(part) if isinstance(part, DrawnPath) else [_svg_text(part)]
        lines += ["</svg>"] * (1 + (clip is not None))
        return "\n".join(lines).encode()

    def _printed(self, kind: str) -> bytes:
        from matplotlib import rc_context
        from matplotlib.figure import Figure

        buffer = io.BytesIO()
        with rc_context({"font.family": "DejaVu Sans"}):
            sheet = Figure(figsize=(self.width / INCH, self.height / INCH))
            for part in self.parts:
                sheet.add_artist(self._artist(part, sheet))
            sheet.savefig(buffer, format=kind, **_PRINTED[kind])
        return buffer.getvalue()

    def _artist(self, part: DrawnPath | DrawnText, sheet: Any) -> Any:
        from matplotlib.lines import Line2D
        from matplotlib.patches import Polygon
        from matplotlib.text import Text
        from matplotlib.transforms import Bbox, TransformedBbox

        if isinstance(part, DrawnText):
            return Text(
                part.x / self.width, 1 - part.y / self.height, part.text, fontsize=part.size, color=part.color,
                ha={"start": "left", "middle": "center", "end": "right"}[part.anchor], va="baseline",
                rotation=90.0 * part.turned, rotation_mode="anchor", parse_math=False, transform=sheet.transFigure,
            )  # fmt: skip
        look, points = part.look, part.points / (self.width, self.height)
        points[:, 1] = 1 - points[:, 1]
        if part.fill:
            artist: Any = Polygon(points, facecolor=part.fill, edgecolor="none", transform=sheet.transFigure)
        else:
            artist = Line2D(
                *points.T, color=look.color, lw=look.lw, ls=look.ls or "none", alpha=look.alpha,
                marker=look.mark or "none", ms=look.ms, mfc=look.mfc or look.color, mec=look.color, mew=look.mew,
                transform=sheet.transFigure,
            )  # fmt: skip
        if part.clip is not None:
            left, top, wide, high = part.clip
            box = np.array([[left, top + high], [left + wide, top]]) / (self.width, self.height)
            artist.set_clip_box(TransformedBbox(Bbox(np.column_stack([box[:, 0], 1 - box[:, 1]])), sheet.transFigure))
        return artist


def _svg_text(words: DrawnText) -> str:
    turned = f' transform="rotate(-90 {words.x:.2f} {words.y:.2f})"' if words.turned else ""
    anchor = f' text-anchor="{words.anchor}"' if words.anchor != "start" else ""
    colour = f' fill="{words.color}"' if words.color != INK else ""
    place = f'x="{words.x:.2f}" y="{words.y:.2f}" font-size="{words.size:g}"'
    return f"<text {place}{anchor}{colour}{turned}>{escape(words.text)}</text>" if words.text else ""


def _svg_path(stroke: DrawnPath) -> list[str]:
    look, points = stroke.look, stroke.points
    if stroke.fill:
        return [f'<path d="M{_numbers(points)}z" fill="{stroke.fill}"/>']
    finite = np.isfinite(points).all(axis=1)
    faint = "" if look.alpha == 1 else f' stroke-opacity="{look.alpha:g}" fill-opacity="{look.alpha:g}"'
    lines = []
    if look.ls:
        ends = np.flatnonzero(np.diff(np.concatenate([[False], finite, [False]])))
        path = "".join(f"M{_numbers(points[a:b])}" for a, b in ends.reshape(-1, 2))
        dashes = " ".join(f"{look.lw * part:.3g}" for part in _DASHES[look.ls])
        dashed = f' stroke-dasharray="{dashes}"' if dashes else ""
        style = f'stroke="{look.color}" stroke-width="{look.lw:g}"{dashed}{faint}'
        lines.append(f'<path d="{path}" fill="none" stroke-linejoin="round" {style}/>')
    if look.mark:
        outline = _outline(look.mark, look.ms / 2)
        style = f'fill="{look.mfc or look.color}" stroke="{look.color}" stroke-width="{look.mew:g}"{faint}'
        lines += [f"<g {style}>", *(f'<path d="M{x:.2f} {y:.2f}{outline}"/>' for x, y in points[finite]), "</g>"]
    return lines


def _numbers(points: Floats) -> str:
    return str(np.round(points, 2).ravel().tolist())[1:-1].replace(",", "")


def _outline(mark: str, half: float) -> str:
    if mark not in _MARKS:
        r = half * _DOTS.get(mark, 1.0)
        return f"m{-r:g} 0a{r:g} {r:g} 0 1 0 {2 * r:g} 0a{r:g} {r:g} 0 1 0 {-2 * r:g} 0z"
    corners = half * np.array(_MARKS[mark])
    return f"m{_numbers(corners[:1])}l{_numbers(np.diff(corners, axis=0))}" + "z" * (len(corners) > 2)
