"""Texts of programs that keep names, units and samples apart, or channels in rows, as plain tables."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice, zip_longest

import numpy as np

from mrdamper.rig_files.column_names import is_unit, split_name
from mrdamper.rig_files.readers.arrays import array_table
from mrdamper.rig_files.readers.base import RawTable, Source
from mrdamper.rig_files.text.row_samples import cells_of
from mrdamper.rig_files.text.tokens import looks_numeric, number

_HEAD = 8192  # bytes
_LARGEST = 50 * 10**6  # bytes
_ARFF = re.compile(r"(?ims)^@relation\b.*?^@attribute\b.*?^@data\b[^\n]*\n")
_ATTRIBUTE = re.compile(r"(?im)^@attribute\s+(?:'([^']+)'|\"([^\"]+)\"|(\S+))")
_WAVES = re.compile(r"(?im)^waves(?:/\w+)*\s+([^\n]+)\nbegin\n(.*?)\nend\b", re.DOTALL)
_NUMBER = r"([+-]?[0-9]+(?:\.[0-9]*)?(?:[eE][+-]?[0-9]{1,2})?)"
_X_SCALE = re.compile(rf"(?i)setscale */p *x +{_NUMBER}, *{_NUMBER}, *\"([^\"\n]*)\" *, *(\w+)")
_Y_SCALE = re.compile(r"(?i)setscale *(?:/\w+ *)?[yd] +[^,\n]+,[^,\n]+, *\"([^\"\n]*)\" *, *(\w+)")
_CLOCK = r"[0-9]{6}(?:\.[0-9]+)?"  # 142003.25
_BLOCK = re.compile(r"(?m)^\{ChannelBlock\}\n(?:Time)\t([^\n]+)\n([^{]*)")
_MOST_LINES, _FEWEST_SAMPLES = 60, 30
_TELLING = 2  # rows whose names tell what they are


def as_plain_table(source: Source) -> Source:
    """Return a text of one of these programs as names above rows; any other as it is."""
    head = source.head(_HEAD)
    way = next((way for mark, way in _WAYS.items() if re.search(mark, head)), None)
    if way is None or source.size > _LARGEST:
        return source
    source.file.seek(0)
    text = source.file.read().decode("latin-1").replace("\r\n", "\n").replace("\r", "\n")
    lines = [f"{line}\n".encode("latin-1") for line in way(text)]
    return source.rewritten(lines) if lines else source


def _arff(text: str) -> Iterator[str]:
    head = _ARFF.search(text)
    if head is None:
        return
    above = text[: head.end()].splitlines()[:-1]  # as comments, so that the numbers of lines stay
    yield from (f"# {line.lstrip('%')}" if line.strip() else line for line in above)
    yield ",".join(next(filter(None, match.groups())) for match in _ATTRIBUTE.finditer(head[0]))
    yield text[head.end() :].rstrip("\n")


def _igor(text: str) -> Iterator[str]:
    waves = [(names.replace(",", " ").split(), rows.splitlines()) for names, rows in _WAVES.findall(text)]
    units = {name: unit for unit, name in _Y_SCALE.findall(text)}
    clocks = {name: scale for *scale, name in _X_SCALE.findall(text)}
    names = [name for own, _ in waves for name in own]
    if not waves or len({len(rows) for _, rows in waves}) > 1:
        return
    yield from (f"# {line}" for line in re.findall(r"(?im)^x +note[^\n]*?\"([^\"\n]*)\"", text))
    step = {tuple(clocks.get(name, ())) for name in names}
    start, dt, unit = step.pop() if len(step) == 1 and () not in step else ("", "", "")
    yield "\t".join(([f"time [{unit}]"] if unit else []) + [f"{n} [{units[n]}]" if n in units else n for n in names])
    for i, rows in enumerate(zip(*(rows for _, rows in waves), strict=True)):
        yield "\t".join(([f"{float(start) + i * float(dt):.12g}"] if unit else []) + [row.strip() for row in rows])


def _blocks(text: str) -> Iterator[str]:
    blocks = [(name, [row.split("\t") for row in rows.strip().splitlines()]) for name, rows in _BLOCK.findall(text)]
    if not blocks or any(len(row) != 2 for _, rows in blocks for row in rows):
        return
    yield "\t".join(f"Time_{name.partition('[')[0].strip()} [s]\t{name}" for name, _ in blocks)
    for cells in zip_longest(*(rows for _, rows in blocks), fillvalue=("", "")):
        yield "\t".join(cell for pair in cells for cell in pair)


def _sections(text: str) -> Iterator[str]:
    sections = re.findall(r"(?m)^\[([^\]\n]+)\]\n((?:[^\[\n][^\n]*\n|\n)*)", f"{text}\n")
    says = {name: body.strip() for name, body in sections}
    names, units = says.get("column names", "").split(), says.get("channel units", "").splitlines()
    rows = [line.split() for line in says.get("data", "").splitlines() if line.strip()]
    at, first = names.index("time") if "time" in names else -1, len(names) - len(units)
    if at < 0 or at >= first or any(len(row) <= at or not re.fullmatch(_CLOCK, row[at]) for row in rows):
        return
    first = first if units else at + 1
    yield from (f"# {line}" for name in ("comments", "session data") for line in says.get(name, "").splitlines())
    yield "\t".join(["time", *names[first:]])
    yield "\t".join(["s", *units])  # those of the last columns: the others are of the vehicle
    for row in rows:
        yield "\t".join([f"{row[at][:2]}:{row[at][2:4]}:{row[at][4:]}", *row[first:]])


_WAYS = {
    rb"(?m)^\[column names\]\r?$": _sections,
    rb"(?im)^@relation\s": _arff,
    rb"^IGOR\s": _igor,
    rb"(?m)^\{ChannelBlock\}": _blocks,
}


def turned_table(source: Source, lines: Sequence[str]) -> RawTable | None:
    """Return the table of a text with its channels in rows; None if it is none.

    Raises `RigFileError`, its code E_NUMBER, if a cell of such a row is no number.
    """
    filled = list(islice((line for line in lines if line.strip()), _MOST_LINES + 1))
    for separator in ("\t", ";", ",") if 1 < len(filled) <= _MOST_LINES else ():
        cells = [[cell.strip('"') for cell in cells_of(line.rstrip(separator), separator)] for line in filled]
        width = max(map(len, cells))
        rows = [row for row in cells if len(row) == width and not looks_numeric(row[0]) and looks_numeric(row[-1])]
        roles = {split_name(row[0]).role for row in rows} - {None}
        if width <= _FEWEST_SAMPLES or len(roles) < _TELLING:
            continue
        united = all(is_unit(row[1].strip("[]()")) for row in rows)
        headers = [split_name(row[0], row[1].strip("[]()") if united else "") for row in rows]
        remarks = [line for line, row in zip(filled, cells, strict=True) if row not in rows]
        rows = [[row[0], *row[2:]] for row in rows] if united else rows
        commas = separator != "," and any("," in cell for row in rows for cell in row[1:])
        mark = "," if commas and not any("." in cell for row in rows for cell in row[1:]) else "."

        def load(column: int, rows: list[list[str]] = rows, mark: str = mark, shift: int = 2 + united) -> np.ndarray:
            values = [number(cell, mark) for cell in rows[column][1:]]
            if None in values:
                at = values.index(None)
                problem = f"{rows[column][at + 1][:40]!a} in row {rows[column][0]!r} is no number"
                raise source.refuse("E_NUMBER", problem, "correct the cell", column=at + shift)
            return np.array(values, dtype=float)

        names, units = [header.name for header in headers], [header.unit for header in headers]
        return replace(array_table(source, names, units, load), remarks=tuple(remarks))
    return None
