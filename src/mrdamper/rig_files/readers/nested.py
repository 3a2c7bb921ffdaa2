"""Nested structures (structs of MATLAB, objects of JSON) as tables: one a node that holds arrays of samples.

A node is a mapping, a list, an array, a number or a text. The path of a node becomes the label of its
table; single numbers, texts and lists of words of a node, of the nodes above it and of nodes beside it that
hold no arrays stand beside its columns. A mapping with data, a name and a unit is one channel, with an x of
its own where it has one: recordings of real-time systems, logged signals, exported time series.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from mrdamper.rig_files.column_names import names_condition, split_name
from mrdamper.rig_files.conditions import stated_clock
from mrdamper.rig_files.readers.arrays import Array, array_table, expand, pick, titles_of
from mrdamper.rig_files.readers.base import MOST_COLUMNS, RawTable, RigFileError, Source
from mrdamper.rig_files.units import is_unit, parse_unit
from mrdamper.rig_files.vocabulary import KEYS, words

_VALUE = words("value")
DEEPEST = 8  # levels
MOST_ITEMS = 2000  # of a list
_MOST_TEXT = 200  # characters
_FEWEST_SAMPLES = 50  # of channels beside which as many words are a column
_HEAD = re.compile(r"_?(?:header|info|properties|attributes|meta(?:data)?)$", re.IGNORECASE)
_BODY = re.compile(r"_?(?:data|values)$", re.IGNORECASE)
_OF_TESTS = re.compile(r"(?i)(?:s|_?(?:vec(?:tor)?|list|values|levels|array|grid|axis))(?=$|_m?a$|\s*[\[(])")
_CLOCK = re.compile(r"(^|[_. ])time[_. ]", re.IGNORECASE)


@dataclass(frozen=True)
class _Column:
    name: str
    unit: str
    array: Array
    part: int | None = None
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


def nested_tables(source: Source, tree: Mapping[str, Any], title: str, *, together: bool = False) -> list[RawTable]:
    """Return the tables of a nested structure, in the order they appear; E_NO_DATA or E_UNSAFE if it holds no array.

    The columns of all of them `together` are one more, for files with a node for each channel, if no node holds a test.
    """
    try:
        every = list(_walk(tree, _Node("")))
    except RigFileError as error:  # which names no file
        raise source.refuse(error.code, error.found, error.remedy) from None
    nodes = [node for node in every if node.columns]
    objects = [column.name for node in nodes for column in node.columns if column.array.dtype == object]
    if not any(column.array.dtype != object for node in nodes for column in node.columns):
        code, what = ("E_UNSAFE", f"only objects ({objects[0]})") if objects else ("E_NO_DATA", "no array of numbers")
        raise source.refuse(code, what, "save the channels as arrays of numbers")
    tables = [_table(source, node, title) for node in nodes]
    if together and len(nodes) > 1:
        whole = replace(every[0], columns=[column for node in nodes for column in node.columns], remarks=[])
        tables.append(replace(_table(source, whole, title), fallback=True))
    return tables


def _walk(tree: Mapping[str, Any], node: _Node, depth: int = 0) -> Iterator[_Node]:
    inner: list[tuple[str, Any]] = []
    tree = {key: _object_in(value) for key, value in tree.items()}
    texts = [value for value in tree.values() if isinstance(value, _JsonText)]
    lists = {f"{key} ": own.pop(key) for own in texts for key in list(own) if isinstance(own[key], list)}
    tree |= {key: own for key, own in lists.items() if all(isinstance(item, str) for item in own)}
    keys = {"name", "unit", "data"}
    channels = {key: value for key, value in tree.items() if isinstance(value, Mapping) and {*value} == keys}
    arrays = {**tree, **{key: value["data"] for key, value in channels.items()}}
    tests = _tests_of_rows(arrays)
    tests = _tests_of_arrays(arrays) if tests is arrays else tests
    tree = _with_own_axes(_spread(tree) if tests is arrays else tests)
    stated = next((v for key, v in tree.items() if key.casefold() in KEYS["unit"] and isinstance(v, Mapping)), {})
    pairs = next((v for k, v in tree.items() if k.casefold() in KEYS["unit"] and isinstance(v, list)), [])
    pairs = pairs if all(isinstance(item, str) for item in pairs) and {*pairs[::2]} <= {*tree} else []
    stated = stated or dict(zip(pairs[::2], pairs[1::2], strict=False))
    own = {key[:-5]: unit for key, unit in tree.items() if key.casefold().endswith("_unit")} | dict(stated)
    own |= {key: channel["unit"] for key, channel in channels.items()}
    node.units = {**node.units, **{key: u for key, u in own.items() if isinstance(u, str) and is_unit(u)}}
    sizes = {value.size for value in tree.values() if isinstance(value, Array) and value.size >= _FEWEST_SAMPLES}
    for key, value in _paired(tree, node.units).items():
        if isinstance(value, list) and all(isinstance(item, str) for item in value):
            if split_name(key).role is not None or len(value) in sizes:
                node.columns += _across(key, np.array([word[:_MOST_TEXT] for word in value]))
            elif value:
                node.lists.append(value)
        elif isinstance(value, list):
            inner += _items(key, value, node)
        elif isinstance(value, Array):
            node.columns += _across(key, value)
        elif isinstance(value, Mapping):
            channel = _channel(key, value)
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
        yield from _walk(
            value, _Node(label, [], list(node.lists), dict(node.constants), list(node.remarks), node.units), depth + 1
        )


class _JsonText(dict[str, Any]):
    """An object that a text beside arrays holds: its lists of words are those of the arrays."""


def _object_in(value: Any) -> Any:
    """Return the object that a text holds as JSON; any other value as it is."""
    if not isinstance(value, str) or not value.lstrip().startswith("{"):
        return value
    try:
        return _JsonText(json.loads(value, parse_int=float))
    except (ValueError, RecursionError, OverflowError):
        return value


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
    if any(split_name("", unit).dimension not in (None, "time") for unit in units):
        return tree
    if not axes or not all(isinstance(axis.get("data"), Array) for axis in axes):
        return tree
    timed = []
    for channel in channels:
        number = next((v for k, v in channel.items() if k.casefold() == "xindex" and isinstance(v, float)), 1.0)
        at = int(number) - 1 if 1 <= number <= len(axes) else 0
        timed.append({**channel, "xdata": axes[at]["data"], "xunit": units[at]})
    return {**{key: value for key, value in tree.items() if key not in (keys["x"], keys["y"])}, keys["y"]: timed}


def _grid_of(value: Any, channels: Mapping[int, int | None]) -> tuple[tuple[int, ...], list[Array]]:
    """Return the conditions' dimensions and the arrays of samples of a list, or of an array over conditions.

    The channels of such an array stand along the dimension of a length of `channels`, else along one of the last two.
    """
    if isinstance(value, Array) and value.ndim > 2 and min(value.shape) > 1 and value.dtype.kind in "iuf":
        array, along = np.asarray(value), int(np.argmax(value.shape))
        across = _dimension_of_channels(array, along, channels)
        if across is None and along < array.ndim - 2:
            return (), []
        array = np.moveaxis(array, (-2, -1) if across is None else (along, across), (-2, -1))
        outer = array.shape[:-2]
        matrices = np.reshape(array, (-1, *array.shape[-2:]))
        return (outer, [_unpadded(matrix) for matrix in matrices]) if len(matrices) <= MOST_ITEMS else ((), [])
    rows = value if isinstance(value, list) and len(value) > 1 else []
    flat = [item for row in rows for item in (row if isinstance(row, list) else [row])]
    if not flat or not all(isinstance(item, Array) for item in flat):
        return (), []
    return (len(rows), len(flat) // len(rows)) if len(flat) > len(rows) else (len(rows),), flat


def _dimension_of_channels(array: np.ndarray, along: int, channels: Mapping[int, int | None]) -> int | None:
    """Return the only dimension of a length of `channels`, the number and the place of the time; of two, whose time
    increases along the samples. None if there is none; E_AMBIGUOUS if both may be meant.
    """
    across = [i for i, n in enumerate(array.shape) if n in channels and i != along]
    if len(across) > 1:
        timed = [(i, time) for i in across if (time := channels[array.shape[i]]) is not None]
        steps = {i: np.diff(np.moveaxis(array, (i, along), (0, -1))[time].astype(float)) for i, time in timed}
        across = [i for i, step in steps.items() if not (step <= 0).any()]
        if len(across) != 1:
            problem = f"the channels may stand along two dimensions of an array of {' x '.join(map(str, array.shape))}"
            remedy = "save each test as an array of its own, or the time among the channels"
            raise RigFileError("E_AMBIGUOUS", problem, remedy=remedy)
    return across[0] if across else None


def _spread(tree: Mapping[str, Any]) -> Mapping[str, Any]:
    """Split lists of arrays, or arrays over conditions, into a node a test, each with its own of the numbers beside.

    These are a list of matrices, data[current, frequency, sample, channel], or several lists of vectors: T{i, j},
    X{i, j}. Beside them stand vectors of conditions, one for every test or one for every dimension.
    """
    words = {k: v for k, v in tree.items() if isinstance(v, list) and all(isinstance(i, str) for i in v)}
    named = [[split_name(name).role for name in names] for names in words.values()]
    channels = {len(r): r.index("time") if "time" in r else None for r in named if len(r) - r.count(None) > 1}
    grids = {key: grid for key, value in tree.items() if (grid := _grid_of(value, channels))[1]}
    shapes = {key: [tuple(n for n in item.shape if n > 1) for item in items] for key, (_, items) in grids.items()}
    flat = {k: grids[k][1] if k in grids and isinstance(v, list) else v for k, v in tree.items()}
    chosen = [key for key, of in shapes.items() if {len(shape) for shape in of} == {2}]
    vectors = [key for key, of in shapes.items() if {len(shape) for shape in of} == {1}]
    if not chosen and sum(split_name(key).role is not None for key in vectors) > 1:
        chosen = vectors if all(shapes[key] == shapes[vectors[0]] for key in vectors) else []
    if not chosen or len({grids[key][0] for key in chosen}) > 1 or (len(chosen) > 1 and chosen is not vectors):
        return flat
    outer, count = grids[chosen[0]][0], len(grids[chosen[0]][1])
    at = np.indices(outer).reshape(len(outer), -1)
    beside = {}
    for key, value in tree.items():
        value = value["data"] if isinstance(value, Mapping) and {*value} == {"name", "unit", "data"} else value
        if isinstance(value, Array) and value.dtype.kind in "iuf" and key not in chosen:
            shape = tuple(n for n in value.shape if n > 1)
            if shape == outer:
                beside[_of_one_test(key)] = np.reshape(value, -1)
            elif len(shape) == 1 and outer.count(*shape) == 1:
                beside[_of_one_test(key)] = np.reshape(value, -1)[at[outer.index(*shape)]]
    rest = {k: v for k, v in flat.items() if k not in chosen and _of_one_test(k) not in beside and k not in words}
    title = chosen[0] if len(chosen) == 1 else "test"
    own = [
        {**{k: grids[k][1][i] for k in chosen}, **words, **{k: float(v[i]) for k, v in beside.items()}}
        for i in range(count)
    ]
    return {**rest, **{f"{title}_{i}": node for i, node in enumerate(own, 1)}}


def _of_one_test(key: str) -> str:
    """Return the name of one of the currents of a vector, currents_A or I_vec_A, as that of a current."""
    one = _OF_TESTS.sub("", key, count=1)
    return one if names_condition(split_name(one).name, "current") else key


def _tests_of_arrays(tree: Mapping[str, Any]) -> Mapping[str, Any]:
    """Split arrays over conditions and samples, force[current, frequency, time], into a node a test.

    Two arrays or more, no two dimensions of one length, each but that of the samples with a vector of a condition.
    The time may be the same for all or some conditions: time[frequency, sample].
    """
    numeric = {k: v for k, v in tree.items() if isinstance(v, Array) and v.dtype.kind in "iuf" and v.size > 1}
    shapes = {key: tuple(n for n in array.shape if n != 1) for key, array in numeric.items()}
    shape = max(shapes.values(), key=len, default=())
    times = {own for key, own in shapes.items() if split_name(key).role == "time"}
    times -= {shape[:1]} if len(shape) == 2 else set()  # when each test began
    if len(shape) < 2 or len({*shape}) < len(shape) or len(times) != 1 or not {*max(times)} <= {*shape}:
        return tree
    samples = shape[-1] if len(shape) == 2 else max(max(times))
    outer = [n for n in shape if n != samples]
    tables = [key for key, own in shapes.items() if len(own) > 1 and samples in own and {*own} <= {*shape}]
    clocks = {key: numeric[key] for key, own in shapes.items() if own == (samples,)}
    conditions = {key: outer.index(*own) for key, own in shapes.items() if len(own) == 1 and own[0] in outer}
    if (
        {*conditions.values()} != {*range(len(outer))}
        or {*tables, *clocks, *conditions} != {*shapes}
        or len(tables) < 2
    ):
        return tree
    rows = []
    for key in tables:
        there = [n for n in (*outer, samples) if n in shapes[key]]
        array = np.transpose(np.squeeze(numeric[key]), [shapes[key].index(n) for n in there])
        array = np.reshape(array, [n if n in there else 1 for n in (*outer, samples)])
        rows.append(np.broadcast_to(array, (*outer, samples)).reshape(-1, samples))
    own = []
    for i, at in enumerate(np.ndindex(*outer)):
        test = np.array([row[i] for row in rows])
        values = {_of_one_test(key): float(np.reshape(numeric[key], -1)[at[of]]) for key, of in conditions.items()}
        own.append({**clocks, **dict(zip(tables, test if clocks else _unpadded(test), strict=True)), **values})
    rest = {key: value for key, value in tree.items() if key not in shapes}
    return {**rest, **{f"test_{i}": node for i, node in enumerate(own, 1)}}


def _tests_of_rows(tree: Mapping[str, Any]) -> Mapping[str, Any]:
    """Split tests behind each other in long arrays into a node a test, by an array of their numbers of samples."""
    numeric = {k: v for k, v in tree.items() if isinstance(v, Array) and v.dtype.kind in "iuf" and v.size in v.shape}
    samples = max((array.size for array in numeric.values()), default=0)
    long = [key for key, array in numeric.items() if array.size == samples]
    places = {key: _ends_of(a, samples) for key, a in numeric.items() if 1 < a.size < samples / _FEWEST_SAMPLES}
    counts = [key for key, ends in places.items() if ends is not None]
    if len(counts) != 1 or sum(split_name(key).role is not None for key in long) < 2:
        return tree
    ends = places[counts[0]]
    assert ends is not None
    parts = {key: np.split(np.reshape(numeric[key], -1), ends[:-1]) for key in long}
    short = {key: array for key, array in numeric.items() if array.size == ends.size and key != counts[0]}
    values = {_of_one_test(key): np.reshape(array, -1) for key, array in short.items()}
    clocks = [of for key, of in parts.items() if split_name(key).role == "time"]
    goes_on = any(after[0] > before[-1] for of in clocks for before, after in pairwise(of))
    if goes_on and not any(names_condition(split_name(key).name, "current") for key in values):  # cycles of one test
        return tree
    own = [
        {key: of[i] for key, of in parts.items()} | {key: float(of[i]) for key, of in values.items()}
        for i in range(ends.size)
    ]
    rest = {key: value for key, value in tree.items() if key not in (*long, *short, counts[0])}
    return {**rest, **{f"test_{i}": node for i, node in enumerate(own, 1)}}


def _ends_of(array: Array, samples: int) -> np.ndarray | None:
    """Return where tests end, by their numbers of samples or by where they start, with or without the end of all."""
    values = np.reshape(array, -1).astype(float)
    if np.any(values != np.floor(values)):
        return None
    ends = np.cumsum(values) if np.sum(values) == samples else np.unique([*values[1:], samples])
    apart = np.diff(ends, prepend=0).min() >= _FEWEST_SAMPLES and ends[-1] == samples
    starts = values[0] == 0 and np.all(np.diff(values) > 0)
    return ends.astype(int) if apart and (starts or np.sum(values) == samples) else None


def _unpadded(matrix: np.ndarray) -> np.ndarray:
    """Return the samples of some channels without those at the end that no channel has: other tests are longer."""
    matrix = matrix if matrix.shape[0] <= matrix.shape[1] else matrix.T
    there = np.flatnonzero(~np.isnan(matrix.astype(float)).all(axis=0))
    return matrix[:, : there[-1] + 1] if there.size else matrix


def _paired(tree: Mapping[str, Any], units: Mapping[str, str]) -> Mapping[str, Any]:
    """Join arrays to what describes them: Channel_1_Data to Channel_1_Header, F to time_F, units by name."""
    heads = {_HEAD.sub("", key): key for key, value in tree.items() if _HEAD.search(key) and isinstance(value, Mapping)}
    pairs = {
        key: heads[stem]
        for key in tree
        if (stem := _BODY.sub("", key)) in heads and _BODY.search(key) and isinstance(tree[key], Array)
    }
    clocks = {bare: key for key in tree if (bare := _CLOCK.sub(r"\1", key, count=1)) != key and bare in tree}
    seconds = {"sample_rate", "start_time"} <= {key.casefold() for key in tree}  # exported by Dewesoft, in seconds
    used = {*pairs.values(), *clocks.values()}
    partners = {}
    for key, value in tree.items():
        if key in pairs and isinstance(value, Array):
            partners[key] = {**tree[pairs[key]], "data": value}
        elif isinstance(value, Array) and isinstance(tree.get(clocks.get(key, "")), Array):
            own = {"name": key, "unit": units.get(key, ""), "data": value, "time": tree[clocks[key]]}
            partners[key] = {**own, "timeunit": "s"} if seconds else own
        elif isinstance(value, Array) and key in units:
            partners[key] = {"name": key, "unit": units[key], "data": value}
        elif key not in used:
            partners[key] = value
    return partners


def _items(key: str, items: list[Any], node: _Node) -> list[tuple[str, Mapping[str, Any]]]:
    """Nodes of their own among the items of a list; items that are channels become columns, records a table."""
    mappings = [item for item in items if isinstance(item, Mapping)]
    records = _records(mappings) if len(mappings) == len(items) else {}
    if records:
        return [(key, records)]
    if len(items) > MOST_ITEMS and any(isinstance(item, (Mapping, Array)) for item in items):
        problem = f"a list of {len(items)} objects or arrays that are no records of one form"
        raise RigFileError("E_BLOCKS", problem, remedy=f"export at most {MOST_ITEMS} tests a file")
    channels = [_channel("", item) for item in mappings]
    if mappings and all(channels):
        node.columns += [column for channel in channels for column in channel]
        return []
    number = len(items) > 1
    nodes = [(f"{key}_{i}" if number else key, item) for i, item in enumerate(items, 1) if isinstance(item, Mapping)]
    nodes = [(name, item) for name, item in nodes if not _is_plain(item)]
    arrays = [item for item in items if isinstance(item, Array)]
    node.columns += [
        column
        for i, array in enumerate(arrays, 1)
        for column in _across(f"{key}_{i}" if len(arrays) > 1 else key, array)
    ]
    return nodes


def _records(items: list[Mapping[str, Any]]) -> dict[str, Any]:
    """Columns of a list of records with the same keys, each value a number or a text; empty if they are none."""
    if len(items) < 3 or any(item.keys() != items[0].keys() for item in items):
        return {}
    columns: dict[str, Any] = {}
    for key in items[0]:
        cells = [item[key] for item in items]
        if all(cell is None or isinstance(cell, (int, float)) for cell in cells):
            columns[key] = np.array([np.nan if cell is None else cell for cell in cells], dtype=float)
        elif all(isinstance(cell, str) for cell in cells):
            columns[key] = np.array([cell[:_MOST_TEXT] for cell in cells])
        else:
            return {}
    return columns


def _channel(key: str, says: Mapping[str, Any]) -> list[_Column]:
    """Return the columns of a mapping that is one channel: its data, and its own x before it; empty if it is none."""
    lower = {name.casefold(): value for name, value in says.items()}
    timed = any(name in lower for name in KEYS["time_unit"])
    for name in ("points", *KEYS["data"]):  # [time, value] each
        points = lower.get(name)
        if isinstance(points, Array) and points.ndim == 2 and points.shape[1] == 2 and (timed or name == "points"):
            across = np.asarray(points)
            lower |= {name: None, "time": across[:, 0], "data": across[:, 1]}
            break
    data = next((lower[name] for name in KEYS["data"] if isinstance(lower.get(name), Array)), None)
    numbers = [split_name(name).dimension for name, value in says.items() if isinstance(value, float)]
    if data is not None and data.ndim == 2 and min(data.shape) > 1 and "current" in numbers:  # a test
        return []
    if data is None or data.size < 2:
        signals = lower.get("signals")
        data = signals.get("values") if isinstance(signals, Mapping) else None
        if not isinstance(data, Array):
            return []
    time = next((lower[name] for name in KEYS["time"] if isinstance(lower.get(name), Array)), None)
    arrays = [value for value in lower.values() if isinstance(value, Array) and value.size >= data.size]
    others = [array for array in arrays if array is not data and array is not time]
    stated = next(
        (lower[name] for name in KEYS["name"] if isinstance(lower.get(name), str) and lower[name].strip()), ""
    )
    if others or not (stated or key):
        return []
    unit = _unit_of(lower, KEYS["unit"], "datainfo")
    if not stated and not unit and time is None:
        return []
    name = _title(stated or key)
    if split_name(name).role is None and split_name(key).role is not None:
        name = key
    columns = [_Column(c.name, unit if parse_unit(unit) else "", c.array, c.part, name) for c in _across(name, data)]
    stated_step = stated_clock({key: value for key, value in says.items() if isinstance(value, float)})
    if time is None and stated_step is not None:
        step, start, clock = stated_step
        return [_Column("time", clock, start + step * np.arange(max(data.shape)), None, name), *columns]
    if time is None or time.size != max(data.shape):
        return columns
    clock = _unit_of(lower, KEYS["time_unit"], "timeinfo") or ("s" if "timeinfo" in lower else "")
    clock = {"seconds": "s", "milliseconds": "ms"}.get(clock, clock)
    return [_Column("time", clock, time, None, name), *columns]


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
    return not isinstance(value, (Array, list)) or (isinstance(value, list) and not value)


def _tell(node: _Node, says: Mapping[str, Any], above: str) -> None:
    """Keep single numbers and texts beside the columns of a node."""
    lower = {key.casefold(): value for key, value in says.items()}
    number, unit = (next((lower[key] for key in keys if key in lower), None) for keys in (_VALUE, KEYS["unit"]))
    if above and isinstance(number, float) and isinstance(unit, str):  # {"current": {"value": 0.5, "unit": "A"}}
        says = {f"{above} [{unit}]": number}
    elif above and isinstance(unit, str) and [float] == [type(v) for v in says.values() if not isinstance(v, str)]:
        says = {f"{key} [{unit}]" if isinstance(v, float) else key: v for key, v in says.items()}
    for key, value in says.items():
        if isinstance(value, Mapping):
            _tell(node, value, key)
        elif isinstance(value, float) and len(node.constants) < MOST_COLUMNS:
            key = f"{key} [{node.units[key]}]" if key in node.units else key
            value_of = node.constants.get(key, value)
            node.constants[key if value_of == value else f"{above} {key}"] = value
        elif isinstance(value, str) and len(node.remarks) < MOST_COLUMNS:
            node.remarks.append(f"{key}: {value}"[:_MOST_TEXT])


def _across(key: str, array: Array) -> list[_Column]:
    if array.dtype.kind == "O":
        return [_Column(key, "", array)]
    return [_Column(name, "", array, part) for name, part in expand(key, array.shape)]


def _table(source: Source, node: _Node, title: str) -> RawTable:
    columns: list[_Column] = []
    arrays = {id(column.array): column.array for column in node.columns}
    for key in arrays:
        across = [column for column in node.columns if id(column.array) == key]
        titles = titles_of(len(across), node.lists) if len(across) > 1 else None
        for i, column in enumerate(across):
            name, unit = (titles[0][i], titles[1][i]) if titles else (column.name, column.unit)
            columns.append(_Column(name, unit, column.array, column.part, column.over))
    columns = _one_time(columns)
    over = tuple(column.over or column.name for column in columns) if any(c.over for c in columns) else ()
    return array_table(
        source,
        [column.name for column in columns],
        [column.unit for column in columns],
        lambda column: pick(columns[column].array, columns[column].part),
        label=node.label,
        title=title,
        constants=node.constants,
        remarks=node.remarks,
        over=over,
    )


def _one_time(columns: list[_Column]) -> list[_Column]:
    """Return the columns with one time in front, where every channel has the same."""
    times = [column for column in columns if column.over and column.name == "time"]
    same = len(times) > 1 and all(
        t.unit == times[0].unit and np.array_equal(np.reshape(t.array, -1), np.reshape(times[0].array, -1))
        for t in times
    )
    if not same:
        return columns
    time = _Column("time", times[0].unit, times[0].array)
    return [time, *(_Column(c.name, c.unit, c.array, c.part) for c in columns if not any(c is t for t in times))]
