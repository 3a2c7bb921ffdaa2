"""Short texts beside records, as lines: legends, lists of tests, descriptions, also in Markdown, JSON, YAML and XML."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from mrdamper.errors import InputError
from mrdamper.rig_files.column_names import split_name, words_of
from mrdamper.rig_files.text.elements import Elements, numbers_in
from mrdamper.rig_files.text.stream import decoded
from mrdamper.rig_files.vocabulary import DIMENSION, is_unit, words

_LARGEST = 2**18  # bytes
_RULE = re.compile(r"[\s|:+=-]*")  # below the names of columns of a table in Markdown
_DEEPEST, _FEWEST_TESTS = 6, 2
_MOST_LEVELS = 50  # of a text in YAML
_MOST_LISTED = 200  # quantities or channels
_VALUE, _SCALE, _UNIT = words("value"), words("scale"), words("unit")
_EU = re.compile(r"(?i)\b(?:EU|units?)\b")  # engineering units, those of the row
_PER = re.compile(rf"{_EU.pattern} ?(?:/|per) ?m?V\b|\bm?V ?(?:/|per) ?{_EU.pattern[4:]}")
_SHIFT = re.compile(r"(?i)offset|zero")
_MEASURED = {*DIMENSION.values(), "frequency"}
_PLACES = ("column", "number", "index", "no", "position", "channel")  # of a column among the others


def short_lines(path: Path) -> list[str]:
    """Return the lines of a short text; none of a file that is long, or cannot be read.

    Of a structure, every quantity and every channel is a line, and a list of objects of one form a table. YAML that
    cannot be parsed has the lines of its text.
    """
    try:
        with path.open("rb") as file:
            content = file.read(_LARGEST + 1)
    except OSError:
        return []
    text = decoded(content) if len(content) <= _LARGEST else ""
    suffix = path.suffix.lower()
    if suffix in _STRUCTURED:
        try:
            return list(_stated(_STRUCTURED[suffix](text), ""))
        except (ValueError, RecursionError, SyntaxError, InputError):
            if suffix in (".json", ".xml"):
                return []
    text = text.replace("`", "") if suffix == ".md" else text
    lines = [line for line in text.splitlines() if "|" not in line or not _RULE.fullmatch(line)]
    return _by_headings(lines) if len(lines) <= _MOST_LISTED else lines


def _by_headings(lines: list[str]) -> list[str]:
    """Return lines, in those of a list the number and its unit last: Name, Unit, Value; Channel, Unit, Scale [unit/V].

    Where a heading does not tell what a scale is per, the unit beside it is omitted: it may be that of the product.
    """
    written, heads, number, unit = [], list[str](), 0, 0
    for line in lines:
        cells = [cell.strip(' "') for cell in re.split(r"[,;\t|]", line.strip(" |"))]
        keys = [{word.casefold() for word in words_of(cell)} for cell in cells]
        of, its = [next((i for i, key in enumerate(keys) if key & of), None) for of in (_VALUE | _SCALE, _UNIT)]
        if of is not None and its is not None:
            heads, number, unit = cells, of, its
        elif len(cells) == len(heads) and split_name("", cells[unit]).dimension in _MEASURED:
            head, per = heads[number], _PER.search(heads[number])
            rest = [
                f"{key} {cell}" if _SHIFT.search(key) else cell
                for i, (key, cell) in enumerate(zip(heads, cells, strict=True))
                if i not in (number, unit)
            ]
            more = [word for word in words_of(head) if word.casefold() not in _VALUE]
            if len(more) < len(words_of(head)):  # a value; what else is said may tell that it is that of no test
                texts = [cell for cell in rest if cell and not cell.isdigit()]
                line = f"{' '.join([*texts, *more])}: {cells[number]} {cells[unit]}"
            else:
                line = "; ".join([*rest, f"{cells[number]} {_EU.sub(cells[unit], per[0])}" if per else ""])
        written.append(line)
    return written


def _elements(text: str) -> dict[str, Any]:
    elements = Elements()
    elements.read(text)
    return elements.root


@lru_cache(maxsize=16)  # every file of a folder asks
def _tree_of_yaml(text: str) -> Any:
    """Return what the documents of a YAML text hold, its numbers as those of other texts: 010 is ten, on is a word.

    Raises `ValueError` for one with aliases, which can repeat a node without end, or nested too deeply.
    """
    import yaml

    loader, depth = getattr(yaml, "CBaseLoader", yaml.BaseLoader), 0
    try:
        for event in yaml.parse(text, loader):
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if depth > _MOST_LEVELS or isinstance(event, yaml.AliasEvent):
                raise ValueError("aliases, or nodes nested too deeply")
        documents = [_with_numbers(document) for document in yaml.load_all(text, loader)]
    except yaml.YAMLError as error:
        raise ValueError("no YAML") from error
    return documents[0] if len(documents) == 1 else dict(enumerate(documents))


def _with_numbers(node: Any) -> Any:
    if isinstance(node, dict):
        return {key: _with_numbers(value) for key, value in node.items()}
    return [_with_numbers(item) for item in node] if isinstance(node, list) else numbers_in(node)


_STRUCTURED: Mapping[str, Callable[[str], Any]] = MappingProxyType(
    {".json": json.loads, ".xml": _elements, ".yaml": _tree_of_yaml, ".yml": _tree_of_yaml}
)


def packaged_lines(path: Path) -> list[str]:
    """Return what the data package (datapackage.json) of a file's folder, or of the one above, states of the file."""
    for folder in path.parents[:2]:
        try:
            content = (folder / "datapackage.json").read_bytes()[:_LARGEST]
            entries = [e for e in json.loads(content)["resources"] if folder / e["path"] == path]
            fields = [field for entry in entries for field in entry.get("schema", {}).get("fields", [])]
            lines = ["; ".join(str(field.get(key, "")) for key in ("name", "title", "unit")) for field in fields]
            return [*lines, *(f"description: {entry['description']}" for entry in entries if "description" in entry)]
        except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
            continue  # none, or no data package
    return []


def _stated(node: Any, key: str, units: Mapping[str, Any] | None = None, depth: int = 0) -> Iterator[str]:
    """Yield what a node states as lines: "current: 400 mA", "x; displacement; mm", "time: s", rows of a table."""
    units = units or {}
    if isinstance(node, list) and len(node) >= _FEWEST_TESTS and all(isinstance(item, dict) for item in node):
        inner = [
            [(f"{k} {n}", v) for k, of in item.items() if isinstance(of, dict) for n, v in of.items()] for item in node
        ]
        node = [{**item, **dict(pairs)} for item, pairs in zip(node, inner, strict=True)]
        plain = [name for name in node[0] if all(isinstance(item.get(name), (str, int, float)) for item in node)]
        yield "\t".join(f"{name} [{units[name]}]" if isinstance(units.get(name), str) else name for name in plain)
        yield from _channels([{str(key).casefold(): value for key, value in item.items()} for item in node])
        for item in node:
            yield "\t".join(f"{v:g}" if isinstance(v := item[name], (int, float)) else v for name in plain)
    if not isinstance(node, dict) or depth > _DEEPEST:
        return
    lower = {str(name).casefold(): value for name, value in node.items()}
    unit = next((lower[name] for name in ("unit", "units") if isinstance(lower.get(name), str)), "")
    if unit and isinstance(lower.get("value"), (int, float)):
        yield f"{key}: {lower['value']:g} {unit}"
    elif unit:
        words = [key, *(str(value) for value in lower.values() if isinstance(value, (str, int, float)))]
        yield "; ".join(dict.fromkeys(words))
    lists = [value for value in lower.values() if isinstance(value, list) and all(isinstance(i, str) for i in value)]
    for its in [own for own in lists if own and all(map(is_unit, own))]:  # columns: [time, load], units: [s, N]
        for names in [other for other in lists if other is not its and len(other) == len(its)]:
            yield from (f"{i}={name};{own}" for i, (name, own) in enumerate(zip(names, its, strict=True), 1))
    own = next((lower[name] for name in ("units", "unit") if isinstance(lower.get(name), dict)), units)
    for name, value in node.items():
        if isinstance(value, (dict, list)):
            yield from _stated(value, str(name), own, depth + 1)
        elif not unit and not isinstance(value, np.ndarray):
            stated = own.get(name) if isinstance(own.get(name), str) and own is not node else None
            yield (
                f"{name}: {value:g} {stated or ''}".rstrip() if isinstance(value, (int, float)) else f"{name}: {value}"
            )


def _channels(items: list[dict[str, Any]]) -> Iterator[str]:
    """Yield the place, the name and the unit of each item, where every item has a name and a unit: 1=Force;kN."""
    units = [str(item.get("unit", item.get("units", ""))) for item in items]
    for at, (item, unit) in enumerate(zip(items, units, strict=True), 1):
        places = (item[key] for key in _PLACES if isinstance(item.get(key), (int, float)))
        if all(map(is_unit, units)) and isinstance(item.get("name"), str):
            yield f"{next(places, at):g}={item['name']};{unit}"
