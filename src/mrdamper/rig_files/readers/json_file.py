"""JSON: records, columns, and nested objects, as loggers, web services and scripts write them."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.arrays import damaged, refuse_twice, whole
from mrdamper.rig_files.readers.base import NoTableError, RawTable, Reader, Source
from mrdamper.rig_files.readers.nested import nested_tables, seconds_of
from mrdamper.rig_files.readers.several_tests import FEWEST_SAMPLES

_SAVED_MODEL = "mrdamper-model"
_FEWEST_ROWS = 8  # samples of a test
_CELL = (int, float, type(None))


class Json(Reader):
    """Objects of lists, lists of records, and these within each other; one record a line, too."""

    name = "json"
    title = "JSON"
    suffixes = (".json", ".jsonl", ".ndjson")
    library = "json"

    def recognises(self, source: Source) -> bool:
        """By the first signs; a list may begin a text of another kind, so that its second sign counts, too."""
        start = source.head(512).lstrip(b"\xef\xbb\xbf \t\r\n")
        return start[:1] == b"{" or (start[:1] == b"[" and start[1:].lstrip()[:1] in (b"{", b"[", b'"'))

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """One table a node that holds lists of numbers."""
        tree = _of_figure(_tree(_parsed(source, whole(source, self.title))))
        if isinstance(tree, Mapping) and _SAVED_MODEL in map(str, tree.values()):
            remedy = "give it to mrdamper predict, validate or export; tests are what import reads"
            raise NoTableError("E_FORMAT", "a saved model", file=source.name, remedy=remedy)
        tree = tree if isinstance(tree, Mapping) else {"": tree}
        return nested_tables(source, tree, self.title, may_be_notes=True)


def _parsed(source: Source, content: bytes) -> Any:
    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        members = dict(pairs)
        if len(members) < len(pairs):
            refuse_twice(source, [name for name, _ in pairs])
        return members

    text, decode = "", partial(json.loads, object_pairs_hook=unique)
    try:
        text = content.decode("utf-8-sig")
        try:
            return decode(text)
        except json.JSONDecodeError as error:
            if not error.msg.startswith("Extra data"):
                raise
            return _with_notes([decode(line) for line in text.splitlines() if line.strip()])
    except json.JSONDecodeError as error:
        early = error.pos >= len(text.rstrip()) - 1
        raise damaged(source, Json.title, "truncated" if early else f"{error.msg}, line {error.lineno}") from error
    except UnicodeDecodeError as error:
        raise source.refuse("E_ENCODING", "bytes that are no UTF-8", "save it as UTF-8") from error
    except (RecursionError, ValueError) as error:  # or a whole number of thousands of digits
        problem = "nested too deeply, or a number without end"
        raise source.refuse("E_FORMAT", problem, "export the samples as lists") from error


def _of_figure(tree: Any) -> Any:
    """Return the curves of a figure of Plotly by their names, each called by the title of its axis; else the tree."""
    traces, layout = (tree.get("data"), tree.get("layout")) if isinstance(tree, Mapping) else (None, None)
    listed = isinstance(traces, list) and all(isinstance(trace, Mapping) for trace in traces)
    if not listed or not traces or not isinstance(layout, Mapping):
        return tree
    curves: dict[str, dict[str, Any]] = {}
    for trace in traces:
        for axis in "xy":
            own = layout.get(str(trace.get(f"{axis}axis", axis)).replace(axis, f"{axis}axis", 1))
            title = own.get("title", "") if isinstance(own, Mapping) else ""
            title = title.get("text", "") if isinstance(title, Mapping) else title
            curve, values = curves.setdefault(str(trace.get("name", "")), {}), trace.get(axis)
            if not title or not isinstance(values, np.ndarray) or not np.array_equal(curve.get(title, values), values):
                return tree  # no figure, or two curves of one name
            curve[title] = values
    return curves


def _with_notes(lines: list[Any]) -> Any:
    """Return the records of a text with one a line, under what its other lines state: of start and end, of an event.

    Between or below the records words count only: a current that stands there is not that of all records.
    """
    forms = Counter(frozenset(line) for line in lines if isinstance(line, dict))
    keys, count = forms.most_common(1)[0] if forms else (frozenset(), 0)
    others = [line for line in lines if not isinstance(line, dict) or line.keys() != keys]
    if not 0 < len(others) < count >= _FEWEST_ROWS or any(not isinstance(o, dict) or o.keys() & keys for o in others):
        return lines
    stated = {key: [other[key] for other in others if key in other] for other in others for key in other}
    records = [line for line in lines if line.keys() == keys]
    above = {key for other in lines[: lines.index(records[0])] for key in other}
    same = {key: values[0] for key, values in stated.items() if values.count(values[0]) == len(values)}
    words = {key for key, value in same.items() if isinstance(value, str) and not any(map(str.isdigit, value))}
    notes = {key: same[key] for key in same if key in above | words}
    return {**notes, **{key: [record[key] for record in records] for key in records[0]}}


def _flat(record: dict[str, Any]) -> dict[str, Any]:
    """Return a record with the cells of an object within it as its own: {"coil": {"set_A": 1}} has coil set_A."""
    inner = {key: value for key, value in record.items() if isinstance(value, dict)}
    cells = {f"{key} {name}": cell for key, own in inner.items() for name, cell in own.items()}
    plain = all(isinstance(cell, (*_CELL, str)) for cell in cells.values()) and not cells.keys() & record.keys()
    return {**{key: value for key, value in record.items() if key not in inner}, **cells} if plain else record


def _tree(value: Any) -> Any:
    """Return the document with arrays for its lists of numbers; mappings from row numbers are lists."""
    if isinstance(value, dict):
        if len(value) >= _FEWEST_ROWS and all(key.isdigit() for key in value):
            return _tree(list(value.values()))
        return {key: _tree(item) for key, item in value.items()}
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, (int, float)):
        return float(value) if abs(value) < 1e308 else float("inf")
    if not isinstance(value, list):
        return "" if value is None else value
    if len(value) > 1 and all(isinstance(item, str) for item in value):
        seconds = seconds_of(value)
        return value if seconds is None else seconds
    even = all(isinstance(item, list) and len(item) == len(value[0]) for item in value)
    if value and all(isinstance(cell, _CELL) for row in (value if even else [value]) for cell in row):
        return np.array(value, dtype=float)  # NaN for null
    items = [item for item in value if item is not None]
    records = len(items) >= _FEWEST_ROWS and all(isinstance(item, dict) for item in items)
    items = list(map(_flat, items)) if records and len(items) >= FEWEST_SAMPLES else items
    if records and all(isinstance(v, (*_CELL, str)) for item in items for v in item.values()):
        return items
    return [_tree(item) for item in items]
