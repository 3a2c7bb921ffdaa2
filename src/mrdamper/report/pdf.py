"""PDF of a report page: the same text and tables, numbered pages, figures as vector graphics.

The HTML of `render_page` is converted element by element; folded parts are shown in full. fpdf2
sets the text; figures are PDF pages that are placed into the space reserved for them.
"""

from __future__ import annotations

import io
import logging
from base64 import b64decode
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cached_property
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

from fpdf import FPDF, FontFace
from fpdf.enums import Align, TableBordersLayout, TextEmphasis
from fpdf.text_region import TextColumns
from pypdf import PdfReader, PdfWriter
from pypdf.generic import ArrayObject, DecodedStreamObject, DictionaryObject, NameObject

from mrdamper.report.fonts import Fallback, fallback_fonts
from mrdamper.report.page import paper_size

_MARGIN = 18.0  # mm
_INK, _FAINT, _RULE = (27, 31, 36), (91, 101, 112), (217, 222, 227)
_SIZES = {"h1": 18.0, "h2": 14.0, "h3": 11.0, "p": 9.5, "table": 8.0, "caption": 8.0}  # pt
_SMALLEST = 6.0  # type size [pt] below which a table is split by columns
_MIN_SCALE = 0.7  # smallest scale of a figure that is reduced to fit the rest of a page [-]
_PADDING = 3.0  # mm beside a cell's text
_NARROWEST = 28.0  # mm of a column whose text runs over lines
_LINE_HEIGHT = 1.28  # of running text over its type size [-]
_LOGO = (50.0, 14.0)  # mm, largest size of a logo
_KEEP = 42.0  # mm required below a heading, so that it does not end a page
_VOID = frozenset({"br", "img", "meta", "link", "hr", "input"})
_INLINE = frozenset({"b", "strong", "code", "a", "span", "br", "em", "i", "sup", "sub"})


@dataclass
class _Element:
    tag: str
    attributes: Mapping[str, str | None] = field(default_factory=dict)
    children: list[_Element | str] = field(default_factory=list)

    def elements(self, *tags: str) -> Iterator[_Element]:
        """Return the elements below of some kinds, in the order of the page."""
        for child in self.children:
            if isinstance(child, _Element):
                if child.tag in tags:
                    yield child
                else:
                    yield from child.elements(*tags)

    @property
    def name(self) -> str:
        """Return the id of the element; empty if it has none."""
        return self.attributes.get("id") or ""

    @cached_property
    def classes(self) -> set[str]:
        """Return the classes of the element."""
        return set((self.attributes.get("class") or "").split())

    @cached_property
    def text(self) -> str:
        """Return the text inside, with line breaks."""
        parts = [c if isinstance(c, str) else "\n" if c.tag == "br" else c.text for c in self.children]
        lines = "".join(p if p == "\n" else " ".join(p.split(" ")).replace("\n", " ") for p in parts).split("\n")
        return "\n".join(" ".join(line.split()) for line in lines).strip()


class _Tree(HTMLParser):
    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.root = _Element("page")
        self._open = [self.root]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        element = _Element(tag, dict(attrs))
        self._open[-1].children.append(element)
        if tag not in _VOID:
            self._open.append(element)

    def handle_endtag(self, tag: str) -> None:
        if any(element.tag == tag for element in self._open[1:]):
            while self._open.pop().tag != tag:
                continue

    def handle_data(self, data: str) -> None:
        self._open[-1].children.append(data)


class _Paper(FPDF):
    def __init__(self, footer: str, paper: str, fallback: Fallback) -> None:
        super().__init__(format=paper)
        fonts = _fonts()
        for style, name in (("", "DejaVuSans.ttf"), ("B", "DejaVuSans-Bold.ttf")):
            self.add_font("text", style, str(fonts / name))
        self.add_font("code", "", str(fonts / "DejaVuSansMono.ttf"))
        for number, (path, index) in enumerate(fallback.files):
            self.add_font(f"fallback{number}", "", path, collection_font_number=index)
        if fallback.files:
            names = [f"fallback{number}" for number in range(len(fallback.files))]
            self.set_fallback_fonts(names, exact_match=False)
        self.set_margins(_MARGIN, _MARGIN)
        self.set_auto_page_break(True, _MARGIN)
        self.alias_nb_pages()
        self._footer_text = footer

    def footer(self) -> None:
        self.set_y(-_MARGIN + 5)
        self.set_font("text", size=7)
        self.set_text_color(*_FAINT)
        half = self.epw / 2
        self.cell(half, 4, self._footer_text)
        self.cell(half, 4, f"page {self.page_no()} of {{nb}}", align="R")
        self.set_text_color(*_INK)


def pdf_of(page: str, figures: Mapping[str, bytes], paper: str = "a4") -> bytes:
    """Convert a page of `render_page` to PDF, with bookmarks and numbered pages of a size "a4" or "letter".

    Each figure of the page is given as a PDF of one page, by the `id` of its `figure` element. Characters that the
    bundled font does not contain are set in an installed font; those of no installed font are named on the last page.
    Raises `UnknownNameError` if there is no such paper size.
    """
    tree = _Tree()
    tree.feed(page)
    logging.getLogger("fpdf").setLevel(logging.ERROR)  # a character without a font is drawn as a box
    logging.getLogger("fontTools").setLevel(logging.ERROR)
    title = next(tree.root.elements("h1")).text
    fallback = fallback_fonts(tree.root.text, str(_fonts() / "DejaVuSans.ttf"))
    sheet = _Paper(title, paper_size(paper), fallback)
    sheet.set_title(title)
    sheet.set_creation_date(datetime(1980, 1, 1, tzinfo=UTC))  # fixed date: the same page gives the same bytes
    sheet.set_text_color(*_INK)
    writer = _Writer(sheet, figures)
    sheet.add_page()
    for part in ("header", "main", "footer"):
        for element in tree.root.elements(part):
            writer.block(element)
    writer.place_waiting(all_of_them=True)
    if fallback.missing:
        writer.paragraph(_Element("p", {"class": "faint"}, [fallback.sentence]))
    return _with_figures(bytes(sheet.output()), writer.places, figures)


class _Writer:
    def __init__(self, paper: _Paper, figures: Mapping[str, bytes]) -> None:
        self.paper, self.figures = paper, figures
        self.kept = 0.0  # mm required below a heading for the element that follows
        self.waiting: list[_Element] = []  # figures that did not fit the rest of their page
        self.places: list[tuple[str, int, float, float, float]] = []  # figure, page, left, bottom [mm], width

    def block(self, element: _Element) -> None:
        """Set an element; children of an element that is no block are set separately."""
        if element.tag in ("style", "script", "nav"):
            return
        writers = {"h1": self.heading, "h2": self.heading, "h3": self.heading, "table": self.table, "img": self.logo}
        writers |= {"figure": self.figure, "li": self.item, "p": self.paragraph, "summary": self.folded}
        if element.tag in writers:
            writers[element.tag](element)
        elif "big" in element.classes:
            self.numbers(element)
        else:
            loose = [c for c in element.children if isinstance(c, str) or c.tag in _INLINE]
            if any(c.strip() if isinstance(c, str) else True for c in loose) and element.tag != "page":
                self.paragraph(_Element("p", element.attributes, list(loose)))
            blocks = [c for c in element.children if isinstance(c, _Element) and c.tag not in _INLINE]
            for child, following in zip(blocks, [*blocks[1:], None], strict=False):
                self.kept = _MIN_SCALE * self._height(following)
                self.block(child)
                if child.tag not in ("h2", "h3", "summary"):
                    self.place_waiting()

    def place_waiting(self, *, all_of_them: bool = False) -> None:
        """Set waiting figures that fit; before a chapter ends, set all of them on further pages."""
        waiting, self.waiting = self.waiting, []
        for number, element in enumerate(waiting):
            if not all_of_them and not self._scale(element):
                self.waiting += waiting[number:]  # they keep their order
                return
            if not self._scale(element):
                self.paper.add_page()
            self.figure(element)

    def reserve(self, height: float) -> None:
        """Begin a page, with waiting figures at its top, if the rest of this one is lower [mm]."""
        while self.paper.will_page_break(height):
            self.paper.add_page()
            self.place_waiting()

    def _scale(self, element: _Element) -> float:
        """Return the scale at which a figure fits the rest of the page; 0 if that is too small to read."""
        room = self.paper.page_break_trigger - self.paper.get_y() - self._height(element, caption_only=True)
        scale = min(1.0, room / (self._height(element) - self._height(element, caption_only=True)))
        return scale if scale >= _MIN_SCALE else 0.0

    def logo(self, element: _Element) -> None:
        """Draw a picture embedded in the page, at the right margin."""
        picture = b64decode((element.attributes.get("src") or "").partition("base64,")[2])
        top = self.paper.get_y()
        self.paper.image(picture, Align.R, top, _LOGO[0], _LOGO[1], keep_aspect_ratio=True, alt_text="logo")
        self.paper.set_y(top + _LOGO[1] + 2)

    def heading(self, element: _Element) -> None:
        """Draw a heading, with space below it for the next element."""
        paper, size = self.paper, _SIZES[element.tag]
        if element.tag == "h2":
            self.place_waiting(all_of_them=True)
        self.reserve(max(_KEEP, self.kept + 0.8 * size) if element.tag != "h1" else 0.0)
        if paper.get_y() > _MARGIN + 1:
            paper.ln(0.35 * size)
        paper.set_font("text", "B", size)
        if element.tag != "h1":
            paper.start_section(element.text, level=int(element.tag[1]) - 2)
        paper.multi_cell(0, 0.45 * size, element.text, align="L", new_x="LMARGIN", new_y="NEXT")
        paper.ln(0.12 * size)

    def paragraph(self, element: _Element, size: float = _SIZES["p"], indent: float = 0.0) -> None:
        """Draw running text, with bold and code inside."""
        paper = self.paper
        paper.set_text_color(*(_FAINT if {"faint", "caption"} & element.classes else _INK))
        with paper.text_columns(l_margin=_MARGIN + indent, line_height=_LINE_HEIGHT) as column:
            self._runs(column, element, size, "")
        paper.set_x(_MARGIN)
        paper.ln(0.2 * size)
        paper.set_text_color(*_INK)

    def _runs(self, column: TextColumns, element: _Element, size: float, style: str) -> None:
        for child in element.children:
            if isinstance(child, str):
                words = " ".join(child.split())
                lead = " " if child[:1].isspace() and words else ""
                trail = " " if child[-1:].isspace() else ""
                self.paper.set_font("code" if style == "code" else "text", "B" if style == "B" else "", size)
                column.write(lead + words + trail)
            elif child.tag == "br":
                column.write("\n")
            else:
                self._runs(column, child, size, {"b": "B", "strong": "B", "code": "code"}.get(child.tag, style))

    def folded(self, element: _Element) -> None:
        """Set the title of a folded part of the page; in print the part is open."""
        self.reserve(_KEEP)
        self.paragraph(_Element("p", {}, [_Element("b", {}, [element.text])]))

    def _height(self, element: _Element | None, *, caption_only: bool = False) -> float:
        """Height of a figure with its caption, or of the caption [mm]; 0 of other blocks, which may run over pages."""
        if element is None or element.tag != "figure" or not (figure := self.figures.get(element.name)):
            return 0.0
        wide, tall = _size_of(figure)
        caption = next(element.elements("figcaption"), None)
        lines = len(caption.text) // 110 + 1 if caption else 0
        return 6.0 + 4.0 * lines + (0.0 if caption_only else tall * min(1.0, self.paper.epw / wide))

    def item(self, element: _Element) -> None:
        """Draw an item of a list."""
        self.paragraph(_Element("p", element.attributes, ["•  ", *element.children]), indent=3.0)

    def numbers(self, element: _Element) -> None:
        """Draw the key figures of a summary, one per line."""
        for box in element.elements("div"):
            value = next(box.elements("b")).text
            self.paragraph(_Element("p", {}, [_Element("b", {}, [value]), f"  {next(box.elements('span')).text}"]))

    def figure(self, element: _Element) -> None:
        """Draw a figure and its caption, on one page: reduced if it nearly fits, otherwise later."""
        paper, figure, caption = self.paper, self.figures.get(element.name), next(element.elements("figcaption"), None)
        if figure:
            scale = self._scale(element)
            if not scale:
                self.waiting.append(element)
                return
            wide, tall = _size_of(figure)
            width = scale * min(paper.epw, wide)
            height = tall * width / wide
            bottom = paper.h - paper.get_y() - height
            self.places.append((element.name, paper.page_no() - 1, _MARGIN, bottom, width))
            paper.set_y(paper.get_y() + height + 1)
        if caption:
            self.paragraph(_Element("p", {"class": "caption"}, caption.children), _SIZES["caption"])

    def table(self, element: _Element) -> None:
        """Draw a table with its headings on every page."""
        caption = next(element.elements("caption"), None)
        rows = [list(row.elements("th", "td")) for row in element.elements("tr")]
        if not rows:
            return
        parts = self._parts(rows)
        self.reserve(14 + 0.5 * _SIZES["table"] * min(len(rows), 4))
        if caption:
            self.paragraph(_Element("p", {"class": "caption"}, caption.children), _SIZES["caption"])
        for part in parts:
            self._part(part)

    def _parts(self, rows: list[list[_Element]]) -> list[list[list[_Element]]]:
        """Split the columns of a table that is too wide for the page; every part has the first column."""
        columns = len(rows[0])
        if columns < 4 or any(len(row) != columns for row in rows) or self._fitted(rows)[0] >= _SMALLEST:
            return [rows]
        half = (columns + 1) // 2
        left, right = [row[:half] for row in rows], [[row[0], *row[half:]] for row in rows]
        return [*self._parts(left), *self._parts(right)]

    def _part(self, rows: list[list[_Element]]) -> None:
        paper, (size, widths) = self.paper, self._fitted(rows)
        size = max(size, _SMALLEST)
        paper.set_font("text", size=size)
        paper.set_draw_color(*_RULE)
        headed = bool(rows[0]) and rows[0][0].tag == "th"
        with paper.table(
            col_widths=tuple(widths),
            width=min(sum(widths), paper.epw),
            align="LEFT",
            borders_layout=TableBordersLayout.HORIZONTAL_LINES,
            first_row_as_headings=headed,
            headings_style=FontFace(emphasis=TextEmphasis.B),
            line_height=0.5 * size,
            padding=(0.4, 0.8),
        ) as table:
            for row in rows:
                line = table.row()
                for cell in row:
                    left = cell is row[0] or {"text", "wrap"} & cell.classes
                    line.cell(cell.text, align="LEFT" if left else "RIGHT")
        paper.ln(2)

    def _fitted(self, rows: list[list[_Element]]) -> tuple[float, list[float]]:
        """Size of type at which a table fits the page, and its columns' widths [mm]."""
        paper, size = self.paper, _SIZES["table"]
        columns = max(len(row) for row in rows)
        while True:
            paper.set_font("text", "B", size)
            widths, words, wraps = [0.0] * columns, [0.0] * columns, [False] * columns
            for i, cell in ((i, cell) for row in rows for i, cell in enumerate(row)):
                wraps[i] |= "wrap" in cell.classes
                widths[i] = max(widths[i], *(paper.get_string_width(line) + _PADDING for line in cell.text.split("\n")))
                words[i] = max([words[i], *(paper.get_string_width(word) + _PADDING for word in cell.text.split())])
            free = sum(w for w, wrap in zip(widths, wraps, strict=True) if wrap)
            kept = sum(w for w, wrap in zip(widths, wraps, strict=True) if not wrap)
            room = paper.epw - kept
            if free <= room:
                return size, widths
            least = {i: max(_NARROWEST, words[i]) for i, wrap in enumerate(wraps) if wrap}
            spare = room - sum(least.values())
            if least and spare >= 0:  # distributed over the columns by the width they lack
                lack = {i: max(0.0, widths[i] - least[i]) for i in least}
                share = spare / (sum(lack.values()) or 1.0)
                return size, [least[i] + share * lack[i] if i in least else w for i, w in enumerate(widths)]
            if size <= _SMALLEST:
                fair = [min(width, paper.epw / columns) for width in widths]  # a long word leaves space for others
                more = sum(widths) - sum(fair) or 1.0
                share = (paper.epw - sum(fair)) / more
                return _SMALLEST - 0.1, [f + share * (w - f) for f, w in zip(fair, widths, strict=True)]
            size -= 0.5


def _size_of(figure: bytes) -> tuple[float, float]:
    """Width and height [mm] of a PDF of one page."""
    box = PdfReader(io.BytesIO(figure)).pages[0].mediabox
    return float(box.width) * 25.4 / 72, float(box.height) * 25.4 / 72


def _with_figures(text: bytes, places: list[Any], figures: Mapping[str, bytes]) -> bytes:
    """Place figures, each as one object, because parsing their drawing takes seconds."""
    whole = PdfWriter(clone_from=io.BytesIO(text))
    whole.metadata = {key: value for key, value in (whole.metadata or {}).items() if key != "/CreationDate"}
    point = 72 / 25.4
    drawn: dict[int, list[tuple[str, Any, str]]] = {}
    for number, (name, page, left, bottom, width) in enumerate(places):
        figure = PdfReader(io.BytesIO(figures[name])).pages[0]
        form, content = DecodedStreamObject(), figure.get_contents()
        form.set_data(content.get_data() if content is not None else b"")
        form[NameObject("/Type")], form[NameObject("/Subtype")] = NameObject("/XObject"), NameObject("/Form")
        form[NameObject("/BBox")] = ArrayObject(figure.mediabox)
        form[NameObject("/Resources")] = figure["/Resources"].clone(whole)  # type: ignore[union-attr]
        scale = width * point / float(figure.mediabox.width)
        put = f"q {scale:.5f} 0 0 {scale:.5f} {left * point:.3f} {bottom * point:.3f} cm /Figure{number} Do Q"
        drawn.setdefault(page, []).append((f"/Figure{number}", whole._add_object(form.flate_encode()), put))
    for page, objects in drawn.items():
        sheet = whole.pages[page]
        shared: Any = sheet["/Resources"].get_object()
        resources = DictionaryObject(shared)  # resources of this page: pages share theirs
        registered = resources.get("/XObject", DictionaryObject()).get_object()
        resources[NameObject("/XObject")] = DictionaryObject(
            {**registered, **{NameObject(name): reference for name, reference, _ in objects}}
        )
        sheet[NameObject("/Resources")] = resources
        more = DecodedStreamObject()
        more.set_data("\n".join(put for _, _, put in objects).encode())
        before = sheet.raw_get("/Contents")
        before = list(before) if isinstance(before, ArrayObject) else [before]
        sheet[NameObject("/Contents")] = ArrayObject([*before, whole._add_object(more)])
    packed = io.BytesIO()
    whole.write(packed)
    return packed.getvalue()


def _fonts() -> Path:
    import matplotlib

    return Path(matplotlib.get_data_path()) / "fonts" / "ttf"
