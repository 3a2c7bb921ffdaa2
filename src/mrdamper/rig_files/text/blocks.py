"""Acquisition blocks: testing machines repeat the header where they start to record again."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from mrdamper.rig_files.conditions import stated_by_lines, stated_in_titles
from mrdamper.rig_files.text.layout import SPACES, Layout, is_comment, is_footer, split, units_in
from mrdamper.rig_files.text.stream import TextStream, line_feeds
from mrdamper.rig_files.text.tokens import looks_numeric

_SEGMENT = re.compile(r"(?:Channels|Samples|Date|Time|Y_Unit_Label|X_Dimension|X0|Delta_X|\*{3}End_of_Header)\b")
_STATED = re.compile(
    rb"(?m)^[ \t]*(?:[#%\"A-Za-z]|//)[^\n]*[0-9] ?(?:m?A|amp)[^\n]*"
)  # a line that may state a current
_WORD = re.compile(r"[^\W\d_]{2,}")
_NUMBERS = re.compile(r"[+-]?[0-9]+(?:[.,][0-9]+)*")
_TITLE_LINES = 20  # among which rows follow such a line
_LOOK_BACK = 64 * 1024  # bytes of remarks there may be above a repeated header


@dataclass(frozen=True, slots=True)
class Block:
    """Bytes of the text between which rows stand, the line they start at, and the remarks above a repeated header."""

    start: int
    stop: int
    line: int
    remarks: tuple[str, ...] = ()


def find_blocks(stream: TextStream, layout: Layout, start: int, stop: int) -> list[Block]:
    """Return the blocks between two places of a text; one where the header is not repeated."""
    if not layout.header.strip():
        return _cut_at_currents(stream, layout, Block(start, stop, layout.data_line))
    repeated = re.compile(
        rb"(?m)^[ \t]*" + re.escape(layout.header.strip().encode(stream.encoding, "ignore")) + rb"\s*?$"
    )
    blocks: list[Block] = []
    begin, begin_line = start, layout.data_line
    tail, worded = b"", False
    remarks: tuple[str, ...] = ()
    for chunk, at, line in stream.numbered(start, stop, layout.data_line):
        stream.check(chunk, line)
        worded |= b"A" in chunk or b"amp" in chunk
        for match in repeated.finditer(chunk):
            line_start, line_end = match.start(), min(match.end() + 1, len(chunk))
            before = (tail + chunk[:line_start])[-_LOOK_BACK:]
            above = _remarks(before, stream, layout)
            blocks.append(Block(begin, at + line_start - above, begin_line, remarks))
            text = stream.decode(before[len(before) - above :]).replace("\r", "")
            remarks = tuple(line for line in text.split("\n") if line.strip())
            header_line = line + chunk.count(b"\n", 0, line_start)
            size, skipped = _units_below(stream, layout, at + line_end, header_line)
            begin, begin_line = at + line_end + size, header_line + 1 + skipped
        tail = chunk[-_LOOK_BACK:]
    blocks.append(Block(begin, stop, begin_line, remarks))
    blocks = [_with_head(block, layout) for block in blocks if block.stop > block.start]
    if not worded:
        return blocks
    cut = (part for block in blocks for part in _cut_at_currents(stream, layout, block))
    return [block for block in cut if block.stop > block.start]


def _with_head(block: Block, layout: Layout) -> Block:
    """Return a block with the lines of the file that stand above the first one repeated in the block's own remarks."""
    if not block.remarks:
        return block
    first, *shapes = (_NUMBERS.sub("0", line.strip()) for line in (block.remarks[0], *layout.remarks))
    head = layout.remarks[: shapes.index(first)] if first in shapes else ()
    head = tuple(line for line in head if not _currents([line])) if _currents(block.remarks) else head
    return replace(block, remarks=(*head, *block.remarks))


def _cut_at_currents(stream: TextStream, layout: Layout, block: Block) -> list[Block]:
    """Cut a block at the lines among its rows that state another current: tests one below the other.

    Raises `RigFileError`, E_BLOCKS, if none stands above the first of them: the lines may close their tests.
    """
    cuts: list[tuple[int, int, int, str]] = []  # start and end of a line, its number and text
    for chunk, at, line in stream.numbered(block.start, block.stop, block.line):
        for match in _STATED.finditer(chunk):
            text = stream.decode(match[0]).strip()
            if not _is_data(text, layout) and _currents([text]):
                below = [stream.decode(raw) for raw in stream.lines_at(at + match.end() + 1, _TITLE_LINES)]
                if any(_is_data(raw.rstrip("\r\n"), layout) for raw in below):
                    number = line + line_feeds(chunk[: match.start()])
                    cuts.append((at + match.start(), at + match.end() + 1, number, text))
    above = block.remarks or layout.remarks
    first = _currents(above)
    if len({*first, *(current for *_, text in cuts for current in _currents([text]))}) < 2 or not cuts:
        return [block]
    if not first:
        problem = "states a current among the rows, and no line above the first row does"
        raise stream.source.refuse("E_BLOCKS", problem, "split the file, a test a file", line=cuts[0][2])
    shared = tuple(text for text in above if not _currents([text]))
    starts = [(block.start, block.line, above), *((end, n + 1, (*shared, text)) for _, end, n, text in cuts)]
    stops = [*(start for start, *_ in cuts), block.stop]
    return [Block(start, stop, n, own) for (start, n, own), stop in zip(starts, stops, strict=True)]


def _currents(lines: Iterable[str]) -> list[float]:
    lines = list(lines)
    return [statement.amperes for statement in stated_by_lines(lines) or stated_in_titles(lines)]


def _units_below(stream: TextStream, layout: Layout, start: int, header_line: int) -> tuple[int, int]:
    """Bytes and lines between a repeated header and its rows: those of units, which must be the file's."""
    usual = layout.data_line - 1 - layout.header_line if layout.header_line else 0
    size = lines = 0
    for raw in stream.lines_at(start, max(0, usual)):
        text = stream.decode(raw).rstrip("\r\n")
        if _is_data(text, layout):
            break
        units = units_in(text, layout)
        if units and units != layout.units:
            problem = f"the block from here on is in {', '.join(units)}, the first is in {', '.join(layout.units)}"
            remedy = "split the file here, or export all blocks in one set of units"
            raise stream.source.refuse("E_AMBIGUOUS", problem, remedy, line=header_line)
        size, lines = size + len(raw), lines + 1
    return size, lines


def _remarks(before: bytes, stream: TextStream, layout: Layout) -> int:
    """Bytes of the lines right above a header that are no rows of data."""
    size = 0
    for raw in reversed(before.split(b"\n")[:-1]):
        if _is_data(stream.decode(raw).rstrip("\r"), layout):
            break
        size += len(raw) + 1
    return min(size, len(before))


def _is_data(text: str, layout: Layout) -> bool:
    """Tell if a line is a row, even a damaged one: those must not pass for remarks."""
    if not text.strip() or is_comment(text) or _SEGMENT.match(text) or is_footer(text, layout):
        return False
    try:
        cells = split(text, layout.separator)
    except csv.Error:
        return True
    if layout.separator == SPACES and len(cells) != layout.width and _WORD.match(cells[0]):  # MR DAMPER TEST 1  PAGE 2
        return False
    values = [cell for cell in cells if cell and looks_numeric(cell)]
    return len(values) >= 2 or (len(values) == 1 and len(cells) == 1)
