"""Blocks of plain rows to numbers at the speed of the disk.

A block is taken only if every line has the same number of separators and nothing is
quoted. Cells that do not come out as finite numbers are read again one by one, so that the
strict reader has the last word on them.
"""

from __future__ import annotations

import numpy as np

from mrdamper.rig_files.text.cells import RowFormat, Rows, read_row
from mrdamper.rig_files.text.layout import SPACES
from mrdamper.rig_files.text.stream import LONGEST_LINE

_MOST_STRAY = 0.05  # above this share, reading the whole block cell by cell is no slower
_ALLOWED = bytes(range(256))
_COMMA_MARK = _ALLOWED.replace(b",", b"\0").replace(b".", b"\x01").replace(b"\0", b".")


def read_bulk(block: bytes, line: int, form: RowFormat) -> Rows | None:
    """Read a block of whole lines; None if it is not plain enough."""
    layout = form.layout
    slow = any(layout.kinds[c] == "stamp" or layout.behind[c] for c in form.wanted)
    if slow or layout.separator == SPACES or b'"' in block:
        return None
    ends = _even_lines(block, ord(layout.separator), layout.width - 1 + layout.trailing)
    if ends is None:
        return None
    values = _columns(_cleaned(block, form), form)
    stray = np.flatnonzero(~np.logical_and.reduce([np.isfinite(v) for v in values]))
    if stray.size > _MOST_STRAY * ends.size:
        return None
    for row in stray:
        start = int(ends[row - 1]) + 1 if row else 0
        cells = read_row(form.stream.decode(block[start : int(ends[row])]), line + int(row), form)
        if not cells:
            return None
        for value, cell in zip(values, cells, strict=True):
            value[row] = cell
    lines = np.arange(line, line + ends.size, dtype=float)
    return Rows(dict(zip(form.wanted, values, strict=True)), lines, form.stream.is_odd(block))


def _even_lines(block: bytes, separator: int, count: int) -> np.ndarray | None:
    """Places of the line feeds, if every line holds `count` separators and is short enough."""
    data = np.frombuffer(block, dtype=np.uint8)
    ends = np.flatnonzero(data == 10)
    if count < 1 or not ends.size or ends[-1] != data.size - 1:
        return None
    starts = np.concatenate(([0], ends[:-1] + 1))
    if int(np.max(ends - starts)) > LONGEST_LINE:
        return None
    places = np.flatnonzero(data == separator)
    if places.size != count * ends.size:
        return None
    places = places.reshape(ends.size, count)
    even = np.all(places[:, 0] >= starts) and np.all(places[:, -1] < ends)
    return ends if even else None


def _cleaned(block: bytes, form: RowFormat) -> bytes:
    """Return the block in UTF-8, with decimal points and plain line feeds."""
    if not block.isascii():
        block = block.decode(form.stream.encoding, "replace").encode("utf-8")
    if form.layout.decimal == ",":
        block = block.translate(_COMMA_MARK)
    for sign, meant in form.layout.writes:
        block = block.replace(sign.encode(), meant.encode())
    return block.replace(b"\r\n", b"\n") if b"\r" in block else block


def _columns(block: bytes, form: RowFormat) -> list[np.ndarray]:
    """Return the wanted columns; NaN where polars finds no number, which is at least where we find none."""
    import polars as pl

    width = form.layout.width + form.layout.trailing
    table = pl.read_csv(
        block,
        has_header=False,
        separator=form.layout.separator,
        quote_char=None,
        schema={f"c{i}": pl.Float64 if i in form.wanted else pl.String for i in range(width)},
        columns=list(form.wanted),
        ignore_errors=True,
    )
    return [table[f"c{i}"].to_numpy(writable=True) for i in form.wanted]
