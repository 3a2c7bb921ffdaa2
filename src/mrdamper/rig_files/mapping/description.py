"""Files beside a record that describe it: its columns, rate and current in XML or a short text, scales in a README."""

from __future__ import annotations

import os
import re
from dataclasses import replace
from itertools import islice
from pathlib import Path
from xml.etree import ElementTree

from mrdamper.rig_files.conditions import stated_by_lines
from mrdamper.rig_files.mapping.completion import scaled_columns, states_scale
from mrdamper.rig_files.readers.base import RawTable
from mrdamper.rig_files.text.short import short_lines
from mrdamper.rig_files.units import is_unit

_LARGEST = 2**16  # bytes
_PLACES = ("column", "number", "index", "no", "position", "channel")
_MOST = 200  # elements
_FEWEST_ROWS = 50  # of a record
_TEXTS = (".csv", ".txt", ".tsv", ".ini", ".cfg", ".par", ".set")
_README = re.compile(
    r"(?i)(?:read[_ ]?me|lies_?mich|lisez[-_ ]?moi|l[eé]eme|leggimi|leia[-_ ]?me|notes?|info|说明|説明|설명)\b.*"
)


def with_notes(table: RawTable, path: Path) -> RawTable:
    """Add the scales that a text beside the file states for readers, where the table has columns that need one."""
    if not scaled_columns(table):
        return table
    texts = sorted(p for p in path.parent.iterdir() if _README.fullmatch(p.name) and p.is_file() and p != path)
    texts = [text for text in texts if text.suffix.lower() in ("", ".txt", ".md", ".rst")]
    lines = [line for text in texts for line in short_lines(text) if states_scale(line)]
    return replace(table, remarks=(*table.remarks, *lines))


def with_description(table: RawTable, path: Path) -> RawTable:
    """Return the table with what the XML file of its name, or the only other file of its folder, states."""
    other = _only_other(path)
    if other is not None and is_description(other):
        return replace(table, remarks=(*table.remarks, *short_lines(other)))
    elements = _elements(path, other)
    if not elements:
        return table
    says = [(e, {key.casefold(): value.strip() for key, value in e.attrib.items()}) for e in elements]
    leaves = [(e, a) for e, a in says if e.text and e.text.strip() and not len(e)]
    lines = [f"{e.tag.rpartition('}')[2]}: {(e.text or '').strip()} {_unit(a)}".strip() for e, a in leaves]
    table = replace(table, remarks=(*table.remarks, *lines))
    channels = [a for _, a in says if a.get("name") and is_unit(_unit(a))]
    if any(table.names) or len(channels) != len(table.names):
        return table
    places = [next((a[key] for key in _PLACES if a.get(key, "").isdigit()), "") for a in channels]
    if sorted(places) == sorted(map(str, range(1, len(channels) + 1))):
        channels = [channel for _, channel in sorted(zip(map(int, places), channels, strict=True), key=lambda e: e[0])]
    elif any(places):
        return table
    units = tuple(map(_unit, channels))
    return replace(table, names=tuple(a["name"] for a in channels), units=units)


def _unit(attributes: dict[str, str]) -> str:
    return attributes.get("unit", attributes.get("units", ""))


def is_description(path: Path) -> bool:
    """Tell if a file is a short text that states quantities, and no record: Coil_Current, 0.5, A."""
    lines = short_lines(path) if path.suffix.lower() in _TEXTS and path.is_file() else []
    return sum(bool(line.strip()) for line in lines) < _FEWEST_ROWS and bool(stated_by_lines(lines, "."))


def _only_other(path: Path) -> Path | None:
    """Return the only other file of a file's folder; None if there is none, or several."""
    try:
        with os.scandir(path.parent) as folder:  # not read to its end: it may hold thousands of files
            visible = (file.name for file in folder if not file.name.startswith(".") and file.name != path.name)
            others = [path.with_name(name) for name in islice(visible, 2)]
    except OSError:
        return None
    return others[0] if len(others) == 1 else None


def _elements(path: Path, other: Path | None) -> list[ElementTree.Element]:
    """Return the elements of the description of a file; empty if it has none, or one that could be hostile."""
    beside = path.with_suffix(".xml")
    if not beside.is_file():
        beside = other if other and other.suffix.lower() == ".xml" and other.is_file() else path
    if beside == path or beside.stat().st_size > _LARGEST:
        return []
    content = beside.read_bytes()
    if b"<!" in content.replace(b"<!--", b""):  # definitions of entities grow without end
        return []
    try:
        return list(ElementTree.fromstring(content).iter())[:_MOST]
    except (ElementTree.ParseError, ValueError, LookupError):
        return []
