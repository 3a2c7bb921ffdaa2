"""Nested structures (structs of MATLAB, objects of JSON) as tables: one a node that holds arrays of samples.

A node is a mapping, a list, an array, a number or a text. The path of a node becomes the label of its
table; single numbers, texts and lists of words of a node, of the nodes above it and of nodes beside it that
hold no arrays stand beside its columns. A mapping with data, a name and a unit is one channel, with an x of
its own where it has one: recordings of real-time systems, logged signals, exported time series.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mrdamper.rig_files.column_names import KEYS, RATING, is_unit, parse_unit, role_of, sentences, split_name, words
from mrdamper.rig_files.conditions import CELL, OTHER_DEVICE, stated_clock
from mrdamper.rig_files.readers.arrays import Array, array_table, columns_of
from mrdamper.rig_files.readers.base import MOST_COLUMNS, NoTableError, RawTable, RigFileError, Source
from mrdamper.rig_files.readers.several_tests import FEWEST_SAMPLES, MOST_ITEMS, with_tests_apart
from mrdamper.rig_files.record import REQUIRED
from mrdamper.rig_files.text.tokens import stamp

_VALUE, _NAMES = words("value"), words("channel")
DEEPEST = 8  # levels
MOST_TEXT = 200  # characters
_HEAD = re.compile(r"_?(?:header|info|properties|attributes|meta(?:data)?)$", re.IGNORECASE)
_BODY = re.compile(r"_?(?:data|values)$", re.IGNORECASE)
(_LISTING,) = sentences("listing")
_DIRECTION = re.compile(r":[+-]?[SXYZ]$")  # of a point of measurement
_CLOCK = re.compile(r"(^|[_. ])time[_. ]", re.IGNORECASE)
_OF_UNIT = re.compile(rf"(?i)[_. ](?:{'|'.join(map(re.escape, KEYS['unit']))})$")  # current_unit, Strom_Einheit


@dataclass(frozen=True)
class _Column:
    name: str
    unit: str
    array: Array
    over: str = ""  # the channel that a column of time belongs to


@dataclass
class _Node:
    """A table in the making."""

    label: str
    columns: list[_Column] = field(default_factory=list)
    lists: list[list[str]] = field(default_factory=list)
    constants: dict[str, float] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)
    units: Mapping[str, str] = field(default_factory=dict)  # by column, as this node or one above states them

    def add(self, key: str, array: Array) -> None:
        """Add the columns of an array."""
        columns = columns_of(key, array, self.lists, self.units.get(key, ""))
        self.columns += [_Column(name, unit or self.units.get(name, ""), values) for name, unit, values in columns]


def nested_tables(source: Source, tree: Mapping[str, Any], title: str, *, may_be_notes: bool = False) -> list[RawTable]:
    """Return the tables of a nested structure, in the order they appear; E_NO_DATA or E_UNSAFE if it holds no array.

    Of a document that may be notes it is a `NoTableError`, E_FORMAT, if none has two columns.
    """
    nodes = [node for node in _walk(tree, _Node("")) if node.columns]
    if may_be_notes and not any(len(node.columns) > 1 for node in nodes):
        remedy = "export it as CSV, or the samples of every channel as a list"
        raise NoTableError("E_FORMAT", f"{title} without lists of numbers", file=source.name, remedy=remedy)
    objects = [column.name for node in nodes for column in node.columns if column.array.dtype == object]
    if not any(column.array.dtype != object for node in nodes for column in node.columns):
        code, what = ("E_UNSAFE", f"only objects ({objects[0]})") if objects else ("E_NO_DATA", "no array of numbers")
        raise source.refuse(code, what, "save the channels as arrays of numbers")
    return [_table(source, node, title) for node in nodes]


def _walk(tree: Mapping[str, Any], node: _Node, depth: int = 0) -> Iterator[_Node]:
    tree = _with_functions({key: object_in(value) for key, value in tree.items()})
    texts = [value for value in tree.values() if isinstance(value, _JsonText)]
    lists = {f"{key} ": own.pop(key) for own in texts for key in list(own) if isinstance(own[key], list)}
    tree |= {key: own for key, own in lists.items() if all(isinstance(item, str) for item in own)}
    keys = {"name", "unit", "data"}  # of an array with its unit
    channels = {k: of for k, of in tree.items() if isinstance(of, Mapping) and {*of} == keys and of["name"] == k}
    tree = _with_own_axes(_by_test({**tree, **{key: channel["data"] for key, channel in channels.items()}}))
    node.units = {**node.units, **_stated_units(tree), **{key: str(of["unit"]) for key, of in channels.items()}}
    sizes = {value.size for value in tree.values() if isinstance(value, Array) and value.size >= FEWEST_SAMPLES}
    texts = [_LISTING.sub("", value) for value in tree.values() if isinstance(value, str)]
    node.lists += [re.split(r"\s*[,;]\s*", text.strip()) for text in texts if len(text) < MOST_TEXT]
    inner: list[tuple[str, Any]] = [(key, {"column": tree[key]}) for key in _matrices_of_tests(tree)]
    tree = {key: value for key, value in tree.items() if key not in dict(inner)}
    words = {k: v for k, v in tree.items() if isinstance(v, list) and all(isinstance(item, str) for item in v)}
    rows = {key for key, of in words.items() if split_name(key).role is not None or len(of) in sizes}
    node.lists += [of for key, of in words.items() if of and key not in rows]
    for key, value in _paired(tree, node.units).items():
        if key in rows:
            node.add(key, np.array([word[:MOST_TEXT] for word in value]))
        elif key in words:
            continue
        elif isinstance(value, list):
            inner += _items(key, value, node)
        elif isinstance(value, Array):
            node.add(key, value)
        elif isinstance(value, Mapping):
            channel = _channel(key, value, node.lists)
            if channel:
                node.columns += channel
            elif _is_plain(value):
                _tell(node, value, key)
            else:
                inner.append((key, value))
        else:
            _tell(node, {key: value}, "")
    if "signals" in tree and isinstance(tree.get("time"), Array):  # logged by Simulink, whose time is in seconds
        node.columns = [replace(c, unit="s") if c.name == "time" else c for c in node.columns]
    yield node
    for key, value in inner if depth < DEEPEST else ():
        label = f"{node.label}/{key}" if node.label and key else node.label or key
        beside = list(node.lists), dict(node.constants), list(node.remarks), node.units
        yield from _walk(value, _Node(label, [], *beside), depth + 1)


def _by_test(tree: dict[str, Any]) -> Mapping[str, Any]:
    """Return a node with its tests apart; those of a workspace, t_I0, x_I0, F_I0, t_I1, are nodes: a time each."""
    tests: dict[str, dict[str, Array]] = {}
    for key, value in tree.items():
        channel, _, test = key.partition("_")
        if isinstance(value, Array) and test and role_of(channel) in REQUIRED:
            tests.setdefault(test, {})[channel] = value
    whole = {test: own for test, own in tests.items() if {*REQUIRED} <= {*map(role_of, own)}}
    if len(whole) < 2:
        return with_tests_apart(tree)
    grouped = {f"{channel}_{test}" for test, own in whole.items() for channel in own}
    return {key: value for key, value in tree.items() if key not in grouped} | whole


def stated_beside(stated: Mapping[str, Any]) -> tuple[dict[str, str], dict[str, float], tuple[str, ...]]:
    """Return the units of columns, the numbers and the lines that keys of a file state, some by objects of JSON."""
    node, units = _Node(""), _stated_units(stated)
    for key, value in ((key, object_in(value)) for key, value in stated.items()):
        own = value if isinstance(value, Mapping) else {key: value}
        units |= _stated_units(own) | _stated_units({key: value})
        _tell(node, own, key if own is value else "")
    return units, node.constants, tuple(node.remarks)


def _stated_units(tree: Mapping[str, Any]) -> dict[str, str]:
    """Return the units of columns that a node states: in a mapping, a list of names and units, or a key a column."""
    stated = next((v for key, v in tree.items() if key.casefold() in KEYS["unit"] and isinstance(v, Mapping)), {})
    pairs = next((v for k, v in tree.items() if k.casefold() in KEYS["unit"] and isinstance(v, list)), [])
    pairs = pairs if all(isinstance(item, str) for item in pairs) and {*pairs[::2]} <= {*tree} else []
    stated = stated or dict(zip(pairs[::2], pairs[1::2], strict=False))
    tails = ((key[: tail.start()], unit) for key, unit in tree.items() if (tail := _OF_UNIT.search(key)))
    every = dict(tails) | dict(stated)
    return {key: unit for key, unit in every.items() if isinstance(unit, str) and is_unit(unit)}


def _matrices_of_tests(tree: Mapping[str, Any]) -> list[str]:
    """Return the keys of matrices that hold a test each: several, each a column a channel, whose names tell none."""
    shapes = {k: sorted(v.shape) for k, v in tree.items() if isinstance(v, Array) and v.ndim == 2}
    long = {key: shape[0] for key, shape in shapes.items() if shape[1] >= FEWEST_SAMPLES}
    of_tests = {key: channels for key, channels in long.items() if channels in range(3, 21)}
    alone = len(of_tests) > 1 and len({*of_tests.values()}) == 1 and not any(split_name(key).role for key in of_tests)
    return list(of_tests) if alone else []


class _JsonText(dict[str, Any]):
    """An object that a text beside arrays holds: its lists of words are those of the arrays."""


def object_in(value: Any) -> Any:
    """Return the object that a text holds as JSON; any other value as it is."""
    if not isinstance(value, str) or not value.lstrip().startswith("{"):
        return value
    try:
        return _JsonText(json.loads(value, parse_int=float))
    except (ValueError, RecursionError, OverflowError):
        return value


def _with_functions(tree: Mapping[str, Any]) -> dict[str, Any]:
    """Give functions that a vibration analyser exports, each x_values and y_values, the form of channels."""
    plain = {}
    for key, says in tree.items():
        inner = says if isinstance(says, Mapping) else {}
        parts = (inner.get(name) for name in ("x_values", "y_values", "function_record"))
        x, y, record = (part if isinstance(part, Mapping) else {} for part in parts)
        data, step = y.get("values"), x.get("increment")
        names = record["name"] if isinstance(record.get("name"), list) else [record.get("name")]
        fits = isinstance(data, Array) and (len(names) == 1 or data.shape[1:] == (len(names),))
        if not fits or not isinstance(step, float):
            plain[key] = says
            continue
        stated = y.get("quantity")  # one for all of them, or one each
        quantities = stated if isinstance(stated, list) and len(stated) == len(names) else [stated] * len(names)
        clock = _si_unit(x.get("quantity"))
        times = {f"x_start [{clock}]": x.get("start_value"), f"x_increment [{clock}]": step}
        across = [data] if len(names) == 1 else np.asarray(data).T
        for name, quantity, values in zip(names, quantities, across, strict=True):
            name = _DIRECTION.sub("", name) if isinstance(name, str) else key
            plain[f"{key} {name}"] = {"name": name, "unit": _si_unit(quantity), "data": values, **times}
    return plain


def _si_unit(quantity: Any) -> str:
    """Return the unit of a function if it is one of SI; of mm it is not known if the samples are in mm or in m."""
    unit = str(quantity.get("label", "")) if isinstance(quantity, Mapping) else ""
    si = parse_unit(unit)
    return unit if si is not None and si.factor == 1.0 and not si.offset else ""


def _with_own_axes(tree: Mapping[str, Any]) -> Mapping[str, Any]:
    """Give every channel of a real-time system's Y the axis of X whose number it states, if that is a time."""
    keys = {key.casefold(): key for key in tree}
    if not {"x", "y"} <= set(keys):
        return tree
    axes, channels = ([v] if isinstance(v := tree[keys[k]], Mapping) else v for k in "xy")
    if not all(isinstance(items, list) and all(isinstance(i, Mapping) for i in items) for items in (axes, channels)):
        return tree
    axes = [{key.casefold(): value for key, value in axis.items()} for axis in axes]
    units = [_unit_of(axis, KEYS["unit"], "") for axis in axes]
    other = any(split_name("", unit).dimension not in (None, "time") for unit in units)
    if other or not axes or not all(isinstance(axis.get("data"), Array) for axis in axes):
        return tree
    timed = []
    for channel in channels:
        number = _stated(channel, ("xindex",), float) or 1.0
        at = int(number) - 1 if 1 <= number <= len(axes) else 0
        timed.append({**channel, "xdata": axes[at]["data"], "xunit": units[at]})
    return {**{key: value for key, value in tree.items() if key not in (keys["x"], keys["y"])}, keys["y"]: timed}


def _paired(tree: Mapping[str, Any], units: Mapping[str, str]) -> Mapping[str, Any]:
    """Join arrays to what describes them: Channel_1_Data to Channel_1_Header, F to time_F, units by name."""
    heads = {_HEAD.sub("", key): key for key, value in tree.items() if _HEAD.search(key) and isinstance(value, Mapping)}
    bodies = {key: stem for key in tree if (stem := _BODY.sub("", key)) != key and isinstance(tree[key], Array)}
    pairs = {key: heads[stem] for key, stem in bodies.items() if stem in heads}
    clocks = {bare: key for key in tree if (bare := _CLOCK.sub(r"\1", key, count=1)) != key and bare in tree}
    seconds = {"sample_rate", "start_time"} <= {key.casefold() for key in tree}  # exported by Dewesoft, in seconds
    used = {*pairs.values(), *clocks.values()}
    partners = {}
    for key, value in tree.items():
        if key in pairs:
            partners[key] = {**tree[pairs[key]], "data": value}
        elif isinstance(value, Array) and key in clocks and isinstance(tree[clocks[key]], Array):
            clock = {"time": tree[clocks[key]], "timeunit": units.get(clocks[key], "s" if seconds else "")}
            partners[key] = {"name": key, "unit": units.get(key, ""), "data": value, **clock}
        elif key not in used:
            partners[key] = value
    return partners


def _items(key: str, items: list[Any], node: _Node) -> list[tuple[str, Mapping[str, Any]]]:
    """Nodes of their own among the items of a list; items that are channels become columns, records a table."""
    items = [cell for item in items for cell in (item if isinstance(item, list) else [item])]
    mappings = [item for item in items if isinstance(item, Mapping)]
    if _parameters(items):
        _tell(node, {key: items}, "")
        return []
    records = _records(mappings) if len(mappings) == len(items) else {}
    if records:
        return [(key, records)]
    if len(items) > MOST_ITEMS and any(isinstance(item, (Mapping, Array)) for item in items):
        problem = f"a list of {len(items)} objects or arrays that are no records of one form"
        remedy = f"export samples as records with the same keys, or tests, at most {MOST_ITEMS} a file"
        raise RigFileError("E_BLOCKS", problem, remedy=remedy)
    channels = [_channel("", item, node.lists) for item in mappings]
    if mappings and all(channels):
        node.columns += [column for channel in channels for column in channel]
        return []
    number = len(items) > 1
    nodes = [(f"{key}_{i}" if number else key, item) for i, item in enumerate(items, 1) if isinstance(item, Mapping)]
    nodes = [(name, item) for name, item in nodes if not _is_plain(item)]
    arrays = [item for item in items if isinstance(item, Array)]
    for i, array in enumerate(arrays, 1):
        node.add(f"{key}_{i}" if len(arrays) > 1 else key, array)
    return nodes


def _stated(says: Mapping[str, Any], names: Iterable[str], kind: Any) -> Any:
    """Return the first value of a kind that a mapping holds under one of some names; None if there is none."""
    lower = {key.casefold(): value for key, value in says.items()}
    return next((lower[name] for name in names if isinstance(lower.get(name), kind)), None)


def _parameters(items: list[Any]) -> dict[str, dict[str, Any]]:
    """Return value and unit by name of a list of parameters, some of them numbers; empty if it is no such list.

    The name stands under a known key, or is the only text beside the value and the unit; what a comment says of a limit
    or of another device belongs to it. An item with a number for a channel is a row of a table.
    """
    parameters: dict[str, dict[str, Any]] = {}
    for item in items:
        lower = {key.casefold(): value for key, value in item.items()} if isinstance(item, Mapping) else {}
        texts = {k: v for k, v in lower.items() if isinstance(v, str) and v and k not in (*_VALUE, *KEYS["unit"])}
        names = [text for key, text in texts.items() if key in KEYS["name"] or key in _NAMES] or [*texts.values()]
        value = _stated(lower, _VALUE, (float, str))
        row = any(isinstance(v, float) and split_name(key).role for key, v in lower.items())
        if len(names) == 1 and value is not None and not row:
            others = [text for text in texts.values() if text != names[0] and RATING.search(text)]
            parameters[" ".join([names[0], *others])] = {"value": value, "unit": _stated(lower, KEYS["unit"], str)}
    some = any(isinstance(item["value"], float) or CELL.fullmatch(item["value"]) for item in parameters.values())
    return parameters if some and len(parameters) == len(items) else {}


def _records(items: list[Mapping[str, Any]]) -> dict[str, Any]:
    """Columns of a list of records with the same keys, each value a number or a text; empty if they are none."""
    if len(items) < 3 or any(item.keys() != items[0].keys() for item in items):
        return {}
    columns: dict[str, Any] = {}
    for key in items[0]:
        cells = [item[key] for item in items]
        if all(cell is None or isinstance(cell, (int, float)) for cell in cells):
            columns[key] = np.array(cells, dtype=float)  # NaN for null
        elif all(isinstance(cell, str) for cell in cells) and (seconds := seconds_of(cells)) is not None:
            columns[key if split_name(key).unit else f"{key} [s]"] = seconds
        elif all(isinstance(cell, str) for cell in cells):
            columns[key] = np.array([cell[:MOST_TEXT] for cell in cells])
        else:
            return {}
    return columns


def seconds_of(cells: Sequence[str]) -> Array | None:
    """Return the seconds of time stamps after the first of them; None if a text is no stamp, or the zones differ."""
    stamps = [stamp(cell) for cell in cells] if cells and stamp(cells[0]) is not None else [None]
    whole = [entry[0] for entry in stamps if entry is not None and stamps[0] and entry[1] == stamps[0][1]]
    return np.array([own - whole[0] for own in whole]) / 1e9 if len(whole) == len(cells) else None


def _channel(key: str, says: Mapping[str, Any], lists: list[list[str]]) -> list[_Column]:
    """Return the columns of a mapping that is one channel: its data, and its own x before it; empty if it is none."""
    lower = {name.casefold(): value for name, value in says.items()}
    timed = any(name in lower for name in KEYS["time_unit"])
    for name in ("points", *KEYS["data"]):  # [time, value] each
        points = lower.get(name)
        if isinstance(points, Array) and points.ndim == 2 and points.shape[1] == 2 and (timed or name == "points"):
            across = np.asarray(points)
            lower |= {name: None, "time": across[:, 0], "data": across[:, 1]}
            break
    data = _stated(lower, KEYS["data"], Array)
    numbers = [split_name(name).dimension for name, value in says.items() if isinstance(value, float)]
    if data is not None and data.ndim == 2 and min(data.shape) > 1 and "current" in numbers:  # a test
        return []
    if data is None or data.size < 2:
        signals = lower.get("signals")
        data = signals.get("values") if isinstance(signals, Mapping) else None
        if not isinstance(data, Array):
            return []
    time = _stated(lower, KEYS["time"], Array)
    arrays = [value for value in lower.values() if isinstance(value, Array) and value.size >= data.size]
    others = [array for array in arrays if array is not data and array is not time]
    stated = next((text for name in KEYS["name"] if isinstance(text := lower.get(name), str) and text.strip()), "")
    if others or not (stated or key):
        return []
    unit = _unit_of(lower, KEYS["unit"], "datainfo")
    if not stated and not unit and time is None:
        return []
    name = _title(stated or key)
    if split_name(name).role is None and split_name(key).role is not None:
        name = key
    columns = [_Column(*column, name) for column in columns_of(name, data, lists, unit)]
    stated_step = stated_clock({key: value for key, value in says.items() if isinstance(value, float)})
    if time is None and stated_step is not None:
        step, start, clock = stated_step
        return [_Column("time", clock, start + step * np.arange(max(data.shape)), name), *columns]
    if time is None or time.size != max(data.shape):
        return columns
    clock = _unit_of(lower, KEYS["time_unit"], "timeinfo") or ("s" if "timeinfo" in lower else "")
    return [_Column("time", clock, time, name), *columns]


def _unit_of(lower: Mapping[str, Any], names: Sequence[str], inside: str) -> str:
    info = lower.get(inside)
    if isinstance(info, Mapping):
        lower = {**lower, **{name.casefold(): value for name, value in info.items()}}
    return next((lower[name].strip() for name in names if isinstance(lower.get(name), str)), "")


def _title(stated: str) -> str:
    """Return the part of a path in a model that names a channel: "Model Root"/"Load cell [N]"/"Out1"."""
    whole = '"/"' not in stated and (split_name(stated).unit or "/" not in stated)
    parts = [stated] if whole else stated.split("/")
    parts = [part.strip().strip('"').strip() for part in parts]
    parts = [part for part in parts if part]
    telling = [part for part in parts if split_name(part).role is not None or split_name(part).unit]
    plain = [part for part in parts if part.casefold() not in KEYS["port"]]
    return (telling or plain or parts or [stated])[-1]


def _is_plain(value: Any) -> bool:
    """Tell if nothing in a node is an array or a list of nodes: it only describes the nodes beside it."""
    if isinstance(value, Mapping):
        return all(_is_plain(item) for item in value.values())
    return not isinstance(value, (Array, list)) or (isinstance(value, list) and (not value or bool(_parameters(value))))


def _tell(node: _Node, says: Mapping[str, Any], above: str) -> None:
    """Keep single numbers and texts beside the columns of a node."""
    number, unit = _stated(says, _VALUE, (float, str)), _stated(says, KEYS["unit"], str)
    if above and isinstance(number, float) and unit is not None:  # {"current": {"value": 0.5, "unit": "A"}}
        says = {f"{above} [{unit}]": number}
    elif above and isinstance(number, str):
        says = {above: f"{number} {unit or ''}".rstrip()}
    elif above and isinstance(unit, str) and [float] == [type(v) for v in says.values() if not isinstance(v, str)]:
        says = {f"{key} [{unit}]" if isinstance(v, float) else key: v for key, v in says.items()}
    for key, value in says.items():
        key = f"{key} [{node.units[key]}]" if key in node.units and isinstance(value, (float, str)) else key
        if isinstance(value, Mapping):
            _tell(node, value, key)
        elif isinstance(value, float) and len(node.constants) < MOST_COLUMNS:
            value_of = node.constants.get(key, value)
            node.constants[key if value_of == value else f"{above} {key}"] = value
        elif isinstance(value, list):
            for name, item in _parameters(value).items():
                _tell(node, item, f"{key} {name}" if OTHER_DEVICE.search(key) else name)
        elif isinstance(value, str) and len(node.remarks) < MOST_COLUMNS:
            node.remarks.append(f"{key}: {value}"[:MOST_TEXT])


def _table(source: Source, node: _Node, title: str) -> RawTable:
    columns = _one_time(node.columns)
    names, units = [column.name for column in columns], [column.unit for column in columns]
    over = tuple(column.over or column.name for column in columns) if any(c.over for c in columns) else ()
    table = array_table(source, names, units, lambda column: np.asarray(columns[column].array), title)
    return replace(table, label=node.label, constants=node.constants, remarks=tuple(node.remarks), over=over)


def _one_time(columns: list[_Column]) -> list[_Column]:
    """Return the columns with one time in front, where every channel has the same."""
    times = [column for column in columns if column.over and column.name == "time"]
    arrays, units = [np.reshape(column.array, -1) for column in times], {column.unit for column in times}
    if len(times) < 2 or len(units) > 1 or not all(np.array_equal(array, arrays[0]) for array in arrays):
        return columns
    return [replace(c, over="") for c in (times[0], *(c for c in columns if not any(c is t for t in times)))]
