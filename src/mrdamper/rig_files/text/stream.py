"""Bytes of a text, whatever its encoding, as lines, and the blocks of rows between headers that are repeated."""

from __future__ import annotations

import codecs
import io
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import IO

import numpy as np

from mrdamper.rig_files.column_names import TABLES, role_of
from mrdamper.rig_files.conditions import stated_by_lines, stated_in_titles
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.base import RigFileError, Source, scratch
from mrdamper.rig_files.text.layout import Layout, is_footer, units_in
from mrdamper.rig_files.text.row_samples import SPACES, cells_of, is_comment, is_row
from mrdamper.rig_files.text.tokens import looks_numeric

LONGEST_LINE = 64 * 1024
CHUNK = 4 * 2**20
_HEAD = 2**18
_BOMS = (
    (codecs.BOM_UTF32_LE, "utf-32-le"), (codecs.BOM_UTF32_BE, "utf-32-be"), (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be"),
)  # fmt: skip
# A byte a character, as cp1252
_LOCAL = ("cp1250", "cp1251", "cp1253", "cp1254", "mac_roman", "koi8_r", "cp866", "iso8859_2")
_MULTIBYTE = ("cp932", "gb18030", "cp949", "big5", "shift_jis", "euc_jp", "gbk", "gb2312", "euc_kr")
_NAMES = 16 * 1024  # bytes in which the names of columns stand
_TEXT = bytes(b for b in range(256) if b >= 32 or b in b"\t\n\r\f\v")
_CTRL_Z = b"\x1a"
_BLANK = b" \t\r\n\xef\xbb\xbf\xff\xfe" + _CTRL_Z  # and marks of the order of bytes
_SEGMENT = re.compile(r"(?:Channels|Samples|Date|Time|Y_Unit_Label|X_Dimension|X0|Delta_X|\*{3}End_of_Header)\b")
# A line that may state a current.
_STATED = re.compile(rb"(?m)^[ \t]*(?:[#%\"A-Za-z]|//)[^\n]*[0-9] ?(?:m?A|amp)[^\n]*")
_WORD = re.compile(r"[^\W\d_]{2,}")
_KNOWN = frozenset(word for of in TABLES["words"].values() for word in of)
_NUMBERS = re.compile(r"[+-]?[0-9]+(?:[.,][0-9]+)*")
_TITLE_LINES = 20  # among which rows follow such a line
_LOOK_BACK = 64 * 1024  # bytes of remarks there may be above a repeated header


@dataclass(frozen=True, eq=False)
class TextStream:
    """A text whose lines end with a line feed and whose separators are ASCII."""

    source: Source
    file: IO[bytes]  # UTF-8 or a single-byte encoding
    encoding: str  # to decode a line with
    start: int  # bytes between which the text lies: no byte order mark, no end-of-file mark
    stop: int
    original_encoding: str  # what the file itself is in

    def decode(self, line: bytes) -> str:
        """Return a line as text; bytes that are no text become lone surrogates, which no number holds."""
        if self.encoding == "utf-8":
            return line.decode("utf-8", "surrogateescape")
        return line.decode(self.encoding, "replace")

    def is_odd(self, block: bytes) -> bool:
        """Return True where there are bytes that are not in the text's encoding."""
        if block.isascii() or self.encoding != "utf-8":
            return not block.isascii() and self.original_encoding == "cp1252"
        try:
            block.decode("utf-8")
        except UnicodeDecodeError:
            return True
        return False

    def head(self) -> bytes:
        """Return the start of the text, whole lines but for one that is too long."""
        self.file.seek(self.start)
        head = (self.file.read(_HEAD) + self.file.readline(LONGEST_LINE))[: self.stop - self.start]
        self.check(head, 1)
        return head

    def chunks(self, start: int, stop: int) -> Iterator[bytes]:
        """Yield the bytes between two places, cut after line feeds."""
        self.file.seek(start)
        while chunk := (self.file.read(CHUNK) + self.file.readline(CHUNK))[: max(0, stop - start)]:
            start += len(chunk)
            if not chunk.endswith(b"\n") and start < stop:
                raise too_long(self.source, None)
            yield chunk

    def numbered(self, start: int, stop: int, line: int) -> Iterator[tuple[bytes, int, int]]:
        """Yield the chunks between two places, each with its place and the line it starts at."""
        for chunk in self.chunks(start, stop):
            yield chunk, start, line
            start, line = start + len(chunk), line + line_feeds(chunk)

    def lines_at(self, start: int, count: int) -> list[bytes]:
        """So many lines from a place on, with their ends; reading goes on afterwards where it stood."""
        before = self.file.tell()
        self.file.seek(start)
        lines = [self.file.readline(LONGEST_LINE) for _ in range(count if start < self.stop else 0)]
        self.file.seek(before)
        return lines

    def check(self, block: bytes, line: int) -> None:
        """Refuse bytes no text holds; `line` is the line the block starts at."""
        if np.count_nonzero(np.frombuffer(block, dtype=np.uint8) < 32) == line_feeds(block):
            return
        strange = block.translate(None, _TEXT)
        if not strange:
            return
        at = block.index(strange[:1])
        line += block.count(b"\n", 0, at)
        if 0 in strange:
            problem = "zero bytes in the text"
            remedy = "export the file again: it was damaged while it was written or copied"
            raise self.source.refuse("E_NUL", problem, remedy, line=line + block.count(b"\n", at, block.index(0)))
        problem = f"byte 0x{strange[0]:02X}, which no text holds"
        raise self.source.refuse("E_ENCODING", problem, "export the file again as text", line=line)


def line_feeds(block: bytes) -> int:
    """Return number of line feeds: bytes.count takes three times as long where they are many."""
    return int(np.count_nonzero(np.frombuffer(block, dtype=np.uint8) == 10))


def open_text(source: Source, form: FileForm) -> TextStream:
    """Find the encoding, and give the text as UTF-8 or as it is."""
    head = source.head(_HEAD)
    if not head.strip(_BLANK):
        raise source.refuse("E_EMPTY", "the file is empty", "export it again")
    encoding, mark = _encoding(source, head, form)
    file, size, start = source.file, source.size, mark
    several = encoding.startswith(("utf-16", "utf-32")) or encoding in _MULTIBYTE
    if several or (b"\n" not in head and b"\r" in head):
        file, size = _as_utf8(source, encoding, mark)
        start, inner = 0, "utf-8"
    else:
        inner = encoding
    file.seek(max(0, size - 64))
    marks = len(end := file.read()) - len(end.rstrip(_CTRL_Z))  # with which old programs close a text
    return TextStream(source, file, inner, start, size - marks, encoding)


def too_long(source: Source, line: int | None) -> RigFileError:
    """Return the refusal of an endless line."""
    problem = f"a line over {LONGEST_LINE // 1024} KiB"
    return source.refuse("E_LINE_TOO_LONG", problem, "write one sample a line; is this a text file?", line=line)


def _encoding(source: Source, head: bytes, form: FileForm) -> tuple[str, int]:
    for mark, name in _BOMS:
        if head.startswith(mark):
            return name, len(mark)
    if form.encoding:
        try:
            return codecs.lookup(form.encoding).name, 0
        except LookupError as error:
            problem = f"no encoding is called {form.encoding!r}"
            raise source.refuse("E_PROFILE", problem, "use utf-8, utf-16 or cp1252") from error
    return _detected(head), 0


def decoded(content: bytes) -> str:
    """Return a whole short text, in the encoding of its mark or that in which most of its words name channels."""
    mark, encoding = next((entry for entry in _BOMS if content.startswith(entry[0])), (b"", ""))
    return content[len(mark) :].decode(encoding or _detected(content), "replace")


def _detected(head: bytes) -> str:
    """Name of the encoding of a text without a byte order mark."""
    start = head[:2048]
    if len(start) >= 8:
        odd, even = start[1::2].count(0) / len(start[1::2]), start[::2].count(0) / len(start[::2])
        if odd > 0.95 and even < 0.05:
            return "utf-16-le"
        if even > 0.95 and odd < 0.05:
            return "utf-16-be"
    # A character may be cut at the end of the head; only that is forgiven.
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head, final=len(head) < _HEAD)
    except UnicodeDecodeError:
        return _not_unicode(head)
    return "utf-8"


def _not_unicode(head: bytes) -> str:
    """UTF-8 with a few damaged bytes stays UTF-8; else what makes most of the names words of channels, else cp1252."""
    damaged = sum(0xDC80 <= ord(c) <= 0xDCFF for c in head.decode("utf-8", "surrogateescape"))
    sound = sum(byte >= 0xC2 for byte in head) - damaged
    if sound > damaged:
        return "utf-8"
    start = b"\n".join(line for line in head[:_NAMES].split(b"\n") if not line.isascii())
    words = {name: _telling_words(start, name) for name in ("cp1252", *_LOCAL, *_MULTIBYTE)}
    best = max(words, key=lambda name: words[name])
    return best if words[best] > 0 else "cp1252"


def _telling_words(text: bytes, encoding: str) -> int:
    """Words beyond ASCII that name channels, or mean something else known, were the text in this encoding."""
    try:
        words = re.findall(r"[^\W\d_]+", text.decode(encoding))
    except UnicodeDecodeError:
        return -1
    return sum(not w.isascii() and (role_of(w) is not None or w.casefold() in _KNOWN) for w in words)


def _as_utf8(source: Source, encoding: str, mark: int) -> tuple[IO[bytes], int]:
    """Return the text in UTF-8 with line feeds, in memory or, if large, in a temporary file."""
    source.file.seek(mark)
    target, line = scratch(source.keep), 1
    # Any line end is read as a line feed; half a character at the end, which a cut file has, is left out.
    decoder = io.IncrementalNewlineDecoder(codecs.getincrementaldecoder(encoding)(), translate=True)
    try:
        while block := source.file.read(CHUNK):
            text = decoder.decode(block)
            line += text.count("\n")
            target.write(text.encode("utf-8"))
    except UnicodeDecodeError as error:
        problem = f"bytes that are no {encoding} ({error.reason})"
        remedy = "export the file again, as UTF-8 if you can choose"
        raise source.refuse("E_ENCODING", problem, remedy, line=line) from error
    if decoder.getstate()[1] & 1:  # a carriage return at the end, which might have begun a line end of two characters
        target.write(b"\n")
    return target, target.tell()


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
    header = re.escape(layout.header.strip().encode(stream.encoding, "ignore"))
    repeated = re.compile(rb"(?m)^[ \t]*" + header + rb"\s*?$")
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
    cells = cells_of(text, layout.separator)
    heading = layout.separator == SPACES and len(cells) != layout.width and _WORD.match(cells[0])
    one = sum(map(looks_numeric, filter(None, cells))) == 1 < len(cells)  # a number and what it is of: 2;Sinus
    return not heading and not one and is_row(cells)  # MR DAMPER TEST 1  PAGE 2
