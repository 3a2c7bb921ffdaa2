"""CSV, TXT and DAT: delimited text in any usual encoding, separator and decimal mark."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from mrdamper.data.wording import counted
from mrdamper.errors import printable
from mrdamper.rig_files.column_names import Header, split_name
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.base import Content, RawTable, Reader, Source, Words
from mrdamper.rig_files.record import Finding
from mrdamper.rig_files.text.cells import LINES, RowFormat, Spool, field_count, read_bulk, read_cells, split_rows
from mrdamper.rig_files.text.layout import Layout, find_layout, is_footer
from mrdamper.rig_files.text.programs import as_plain_table, turned_table
from mrdamper.rig_files.text.row_samples import is_comment, split_strictly
from mrdamper.rig_files.text.stream import LONGEST_LINE, Block, TextStream, find_blocks, line_feeds, open_text, too_long
from mrdamper.rig_files.text.tokens import looks_numeric

_ODD = re.compile("[\udc80-\udcff\ufffd\x80-\x9fÿþðÞÐ¤¦¬¸¨÷×]")  # bytes of another encoding, as they come out
_HEADER_LINES, _BREAKS = 200, 12  # lines in which a quoted name may be broken, and into how many
_FOOTER = 8192  # bytes in which lines of words below the rows are looked for
_ARRIVED = re.compile(rb"^\[?[0-9]{2}:[0-9]{2}:[0-9]{2}[.,][0-9]{1,6}\]? -> ?")
_LATEX_ROW = re.compile(rb"^.*&.*\\\\\s*(?:\\hline)?\s*$")
_LATEX = re.compile(  # separators, ends of rows, lines of commands, lines and colours before a row, words in bold
    rb" *(&) *|\$|\s*\\\\[^&]*$|^\s*\\(?!caption)(?:(?:begin|end|multi)[a-z]*.*|[a-z]+[^&]*)$"
    rb"|^(?:\s*\\[a-z]*(?:rule|line|color|space|style)\b(?:\s*[\[({][^\])}]*[\])}])*)+\s*"
    rb"|\\(?:text|math)[a-z]{2}\{([^{}&]*)\}"
)
_KEYED = re.compile(
    rb"(?:(?<=[\s;,|])|^)[ \t]*([A-Za-z_\x80-\xff][^=:;,|\t]{0,30}?)[ \t]*[=:][ \t]*"
    rb"([+-]?[0-9]+(?:[.,][0-9]+)?(?:[eE][+-]?[0-9]+)?)[ \t]?([A-Za-z\x80-\xff/%]{1,6}(?![=:]))?"
    rb"[ \t]*(?:[;,|\t]|(?=[ \r\n])|$)"
)
_FEWEST_KEYED = 20  # rows
_HEAD_LINES = 4000  # in which the data must have begun
BULK_FROM = 2**16  # bytes; below, reading cell by cell takes less time than loading the fast reader


class DelimitedText(Reader):
    """Text with separators; also the blocks of testing machines' .dat files."""

    name = "text"
    title = "delimited text"
    suffixes = (".csv", ".txt", ".dat", ".tsv", ".asc", ".prn", ".log", ".tab", ".lvm", ".tra", ".vbo")
    binary = False

    def recognises(self, source: Source) -> bool:
        """Text is what no other format claims."""
        return True

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """One table a block of rows."""
        stream = open_text(_with_keys_above(_plain(as_plain_table(source))), form)
        head = stream.head()
        whole = stream.start + len(head) >= stream.stop
        raw = head.split(b"\n", _HEAD_LINES)
        if max(map(len, raw[:_HEAD_LINES])) > LONGEST_LINE:
            raise too_long(source, next(i for i, line in enumerate(raw, 1) if len(line) > LONGEST_LINE))
        end = len(head) if whole and len(raw) <= _HEAD_LINES else -len(raw[-1]) - 1
        lines = stream.decode(head[:end]).split("\n")
        lines = _with_whole_quotes([line.rstrip("\r") for line in lines] if b"\r" in head else lines)
        turned = turned_table(source, lines) if whole and form == FileForm() else None
        if turned is not None:
            return [turned]
        layout = find_layout(lines, source, form)
        start = stream.start + sum(len(line) + 1 for line in raw[: layout.data_line - 1])
        blocks = find_blocks(stream, layout, start, stream.stop)
        return [self._table(stream, layout, block, i, len(blocks)) for i, block in enumerate(blocks)]

    def _table(self, stream: TextStream, layout: Layout, block: Block, index: int, count: int) -> RawTable:
        units = tuple("s" if k == "stamp" else u for k, u in zip(layout.kinds, layout.units, strict=True))
        # What a profile may keep: not the place of the header, which differs from file to file.
        form: dict[str, str | int] = {"separator": layout.separator, "decimal": layout.decimal}
        form |= {} if stream.original_encoding.startswith("utf") else {"encoding": stream.original_encoding}
        return RawTable(
            stream.source,
            layout.names,
            units,
            lambda columns: _read(stream, layout, block, tuple(dict.fromkeys(columns))),
            lambda column: _words(stream, layout, block, column),
            layout.header_line,
            f"block {index + 1}" if count > 1 else "",
            form,
            odd=layout.odd,
            remarks=block.remarks or layout.remarks,
            over=layout.over,
            numbers=tuple(range(before + 1, before + len(units) + 1)) if (before := stream.source.before) else (),
        )


def _plain(source: Source) -> Source:
    """Return the text without what a serial monitor or LaTeX adds to every row: 16:05:12.005 -> 1;2."""
    lines = [line for line in source.head(_FOOTER).splitlines()[:-1] if line.strip()]
    arrived = len(lines) > 1 and all(map(_ARRIVED.match, lines))
    if not arrived and 2 * sum(map(bool, map(_LATEX_ROW.match, lines))) <= len(lines):
        return source
    source.file.seek(0)
    if arrived:
        return source.rewritten(_ARRIVED.sub(b"", line) for line in source.file)
    cells = partial(_LATEX.sub, lambda of: b"\t" if of[1] else of[2] or b"")
    return source.rewritten(cells(line.rstrip()) + b"\n" for line in source.file)


def _with_keys_above(source: Source) -> Source:
    """Return a text of rows in which every value has its name, t=120 ms; F=-3.1 N, with the names above the rows."""
    lines = source.head(_FOOTER).splitlines()[:-1]
    keys = Counter(keyed for line in lines if (keyed := _keyed(line)[0]))
    names, count = keys.most_common(1)[0] if keys else ((), 0)
    if count < max(_FEWEST_KEYED, 0.5 * len(lines)):
        return source
    source.file.seek(0)
    return source.rewritten(_under_names(source, names), added=1)


def _under_names(source: Source, names: tuple[bytes, ...]) -> Iterator[bytes]:
    """Yield the lines of a file, the first row of values below their names; other names in another unit are scaled."""
    above = b"\t".join(names) + b"\n"
    for at, line in enumerate(source.file, 1):
        own, values = _keyed(line)
        if own != names and len(own) == len(names) and line.endswith(b"\n"):  # else the row may be cut
            headers = [[split_name(name.decode(errors="replace")) for name in of] for of in (own, names)]
            if all(one.name == other.name for one, other in zip(*headers, strict=True)):
                values = [_rescaled(*each, source, at) for each in zip(values, *headers, strict=True)]
                own = names
        yield above + b"\t".join(values) + b"\n" if own == names else line
        above = b"" if own == names else above


def _keyed(line: bytes) -> tuple[tuple[bytes, ...], list[bytes]]:
    """Return the names with their units and the values of a line of at least two of them and nothing else."""
    pieces = list(_KEYED.finditer(line[:LONGEST_LINE])) if b"=" in line or b":" in line else []
    if len(pieces) < 2 or _KEYED.sub(b"", line).strip():
        return (), []
    names = (piece[1].strip() + (b" [" + piece[3] + b"]" if piece[3] else b"") for piece in pieces)
    return tuple(names), [piece[2] for piece in pieces]


def _rescaled(value: bytes, own: Header, channel: Header, source: Source, line: int) -> bytes:
    """Return a value in the unit that most rows have: 0.39 kN among N."""
    if own.unit == channel.unit:
        return value
    if own.dimension != channel.dimension or any(u is None or u.offset for u in (own.known, channel.known)):
        problem = f"{own.name} in {own.unit or 'no unit'}, in other rows in {channel.unit or 'no unit'}"
        raise source.refuse("E_UNITS_DIMENSION", problem, "export all rows with the same units", line=line)
    scaled = repr(float(value.replace(b",", b".")) * own.factor / channel.factor).encode()
    return scaled.replace(b".", b",") if b"," in value else scaled


def _with_whole_quotes(lines: list[str]) -> list[str]:
    """Join a quoted cell of the header that was broken over lines; the earlier lines become empty."""
    lines = list(lines)
    for i, line in enumerate(lines[:_HEADER_LINES]):
        if line.count('"') % 2 == 0 or is_comment(line):
            continue
        for j in range(i + 1, min(i + _BREAKS + 1, len(lines))):
            whole = " ".join(lines[i : j + 1])
            if whole.count('"') % 2 == 0:
                if not any(looks_numeric(cell) for cell in whole.replace('"', "").replace(";", ",").split(",")):
                    lines[i:j] = [""] * (j - i)
                    lines[j] = whole
                break
    return lines


def _read(stream: TextStream, layout: Layout, block: Block, columns: tuple[int, ...]) -> Content:
    form = RowFormat(stream, layout, columns)
    block, findings = _without_footer(form, block)
    block, cut = _without_cut_row(form, block)
    findings += cut
    spool, odd = Spool((*columns, LINES), stream.source.keep), False
    fast = block.stop - block.start > BULK_FROM
    for chunk, at, line in stream.numbered(block.start, block.stop, block.line):
        stream.check(chunk, line)
        rows = read_bulk(chunk, line, form) if fast else None
        spool.add(rows or read_cells(chunk, line, form, final=at + len(chunk) >= stream.stop))
        odd |= stream.is_odd(chunk)  # in a cell that was not asked for: others are refused
    form.refuse_wrong()
    values = spool.arrays()
    lines = values.pop(LINES)
    if not lines.size:
        raise stream.source.refuse("E_NO_DATA", "a header without data", "export the file again")
    if form.messages:
        line, text = next(iter(form.messages.items()))
        shown = f"lines of words among the rows, taken for messages and left out: {len(form.messages)}, the first "
        findings = (*findings, Finding("W_CHOSEN", printable(f"{shown}(line {line}) {text[:40]!r}")))
    damaged = any(_ODD.search(name) for i, name in enumerate(layout.names) if i not in columns)
    if odd or damaged:
        text = f"bytes that are no {'UTF-8' if stream.encoding == 'utf-8' else 'ASCII'} in columns that are not needed"
        findings = (*findings, Finding("W_ENCODING", text))
    return Content(values, lines, findings)


def _words(stream: TextStream, layout: Layout, block: Block, column: int) -> Words:
    form = RowFormat(stream, layout, (column,))
    block, _ = _without_cut_row(form, _without_footer(form, block)[0])
    indices: dict[str, int] = {}
    codes: list[np.ndarray] = []
    for chunk, at, line in stream.numbered(block.start, block.stop, block.line):
        rows, _ = split_rows(stream.decode(chunk).split("\n"), line, form, at + len(chunk) >= stream.stop)
        codes.append(np.array([indices.setdefault(row[column], len(indices)) for row in rows], dtype=np.int32))
    form.refuse_wrong()
    return Words(np.concatenate(codes) if codes else np.empty(0, dtype=np.int32), tuple(indices))


def _without_footer(form: RowFormat, block: Block) -> tuple[Block, tuple[Finding, ...]]:
    """Leave out lines of words below the last row: statistics, the end of a page."""
    stream = form.stream
    size = min(block.stop - block.start, _FOOTER)
    stream.file.seek(block.stop - size)
    lines = stream.file.read(size).splitlines(keepends=True)
    stop, left = block.stop, []
    for raw in reversed(lines[1:]):
        text = stream.decode(raw).rstrip("\r\n")
        if text.strip() and not is_footer(text, form.layout):
            break
        stop -= len(raw)
        left += [text.strip()[:40]] if text.strip() else []
    if not left:
        return block, ()
    shown = f"{counted(len(left), 'line')} below the last row omitted: {left[-1]!r}"
    return replace(block, stop=stop), (Finding("W_FOOTER", printable(shown)),)


def _without_cut_row(form: RowFormat, block: Block) -> tuple[Block, tuple[Finding, ...]]:
    """Leave out a last row that no line end closes: its last number may be cut."""
    stream = form.stream
    size = min(block.stop - block.start, LONGEST_LINE + 2)
    stream.file.seek(block.stop - size)
    tail = stream.file.read(size)
    last = tail[tail.rfind(b"\n") + 1 :]
    if block.stop < stream.stop or not last.strip() or last.lstrip()[:1] in b"#%":
        return block, ()
    text = stream.decode(last)
    line = block.line + sum(line_feeds(chunk) for chunk in stream.chunks(block.start, block.stop))
    stream.check(last, line)
    if len(last) > LONGEST_LINE:
        raise too_long(stream.source, line)
    width = form.layout.width
    cells = split_strictly(text, form.layout.separator, stream.source, line, "copy or export the file again")
    before = stream.decode(tail[: len(tail) - len(last)].rstrip(b"\r\n").rpartition(b"\n")[2])
    ends_empty = len(cells) == width and before.rstrip().endswith(form.layout.separator)  # as the row above does
    cut = len(cells) < width or (len(cells) == width and not cells[-1] and not ends_empty)
    if cut or len(cells) > width + 1:
        raise field_count(form, sum(map(bool, cells)) if cut else len(cells), line, True)
    finding = Finding("W_NO_EOL", f"the last row (line {line}) has no line end and may be cut: left out")
    return replace(block, stop=block.stop - len(last)), (finding,)
