"""HDF5, and MATLAB files from 7.3 on, which are HDF5 inside."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import Any, ClassVar

import numpy as np

from mrdamper.rig_files.column_names import split_name
from mrdamper.rig_files.conditions import stated_clock
from mrdamper.rig_files.file_form import FileForm
from mrdamper.rig_files.readers.arrays import (
    array_table,
    check_unpacked,
    counts_of,
    expand,
    load,
    pick,
    refusing_damage,
    titles_of,
    unpacked,
)
from mrdamper.rig_files.readers.base import MOST_COLUMNS, RawTable, Reader, Source
from mrdamper.rig_files.record import Finding
from mrdamper.rig_files.units import is_unit

# pyright: reportMissingImports=false, reportAttributeAccessIssue=false

HDF5_MARK = b"\x89HDF\r\n\x1a\n"
_MOST_OBJECTS = 10_000
MOST_STRUCTS = 2000  # of an array of structs
_DEEPEST = 8  # groups within groups
_UNIT_NAMES = ("units", "unit", "Units", "Unit", "UNIT", "UNITS", "unit_string")


class Hdf5(Reader):
    """Datasets as columns, one table a group."""

    name = "hdf5"
    title = "HDF5"
    suffixes = (".h5", ".hdf5", ".hdf", ".he5", ".nxs", ".nc")
    library = "h5py"

    def recognises(self, source: Source) -> bool:
        """By the mark at the start."""
        return source.head(8) == HDF5_MARK

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """One table a group of datasets, and one of all together if no group holds a test."""
        return hdf5_tables(source, self.title)


def hdf5_tables(source: Source, title: str) -> list[RawTable]:
    """Return the groups of an HDF5 file as tables."""
    h5py = load("h5py", title)
    with refusing_damage(source, title):
        file = h5py.File(source.path, "r")
        source.keep.callback(file.close)
        content = _Found(source)
        _walk(file, "", content)
    groups = {
        group: _with_clocks(
            _frame(columns) or _titled(_with_units(columns, group, content), content.lists.get(group, []))
        )
        for group, columns in content.groups.items()
    }
    objects = content.objects
    tables = []
    for group, columns in groups.items():
        constants = {**content.constants.get("", {}), **content.constants.get(group, {})}
        above = [lines for path, lines in content.remarks.items() if f"{group}/".startswith(f"{path}/")]
        tables.append(_table(source, columns, title, group, constants, [line for lines in above for line in lines]))
    if len(groups) > 1:
        every = [column for columns in groups.values() for column in columns]
        tables.append(_table(source, every, title, "", content.constants.get("", {}), fallback=True))
    if not tables:
        code, problem = (
            ("E_UNSAFE", f"only objects ({objects[0]})") if objects else ("E_NO_DATA", "no array of numbers")
        )
        raise source.refuse(code, problem, "save the channels as arrays of numbers")
    return tables


def _table(
    source: Source,
    columns: list[Any],
    title: str,
    label: str,
    constants: dict[str, float],
    remarks: Sequence[str] = (),
    *,
    fallback: bool = False,
) -> RawTable:
    def column_of(column: int) -> np.ndarray:
        _, _, dataset, part = columns[column]
        if dataset is None:
            return np.empty(2, dtype=object)  # a link, refused if it is asked for
        if isinstance(part, str):
            return dataset[part]
        array = dataset[()]
        turned = "MATLAB_class" in dataset.attrs and array.ndim == 2  # MATLAB stores its matrices so
        return unpacked(dataset.attrs, pick(array.T if turned else array, part))

    table = array_table(
        source, [c[0] for c in columns], [c[1] for c in columns], column_of, label=label.strip("/"),
        title=title, fallback=fallback, constants=constants, remarks=remarks,
    )  # fmt: skip
    counts = [name for name, _, d, _ in columns if d is not None and "dtype" in dir(d) and counts_of(d.attrs)]
    text = f"{', '.join(map(repr, counts))}: scale * counts + offset, by the attributes"
    return replace(table, findings=(Finding("W_SCALE", text),)) if counts else table


@dataclass
class _Found:
    """Content of a file: by group its columns and single numbers; and objects that are never loaded."""

    source: Source
    groups: dict[str, list[tuple]] = field(default_factory=lambda: defaultdict(list))
    constants: dict[str, dict[str, float]] = field(default_factory=lambda: defaultdict(dict))
    objects: list[str] = field(default_factory=list)
    remarks: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    lists: dict[str, list[list[str]]] = field(default_factory=lambda: defaultdict(list))
    units: dict[str, dict[str, str]] = field(default_factory=dict)  # of a group and those below it, by column
    seen: int = 0
    numbers: int = 0


def _walk(group: Any, path: str, content: _Found) -> None:
    import h5py

    content.remarks[path] = _attributes(group)
    for name in group:
        content.seen += 1
        if content.seen > _MOST_OBJECTS or path.count("/") > _DEEPEST:
            raise content.source.refuse(
                "E_TOO_MANY_COLUMNS",
                f"over {_MOST_OBJECTS} objects, or groups within groups without end",
                "export fewer channels",
            )
        link = group.get(name, getlink=True)
        if isinstance(link, (h5py.ExternalLink, h5py.SoftLink)):  # leads elsewhere, and is not followed
            content.objects.append(f"{name}: a link")
            content.groups[path].append((str(name), "", None, None))
            continue
        item = group.get(name)
        if isinstance(item, h5py.Group) and name in _UNIT_NAMES and all(map(_is_text, item.values())):
            content.units[path] = {key: _text(value[()]) for key, value in item.items()}
        elif isinstance(item, h5py.Group) and name != "#refs#" and name != "#subsystem#":
            _walk(item, f"{path}/{name}", content)
        elif isinstance(item, h5py.Dataset) and h5py.check_ref_dtype(item.dtype) is h5py.Reference:
            _follow(item, str(name), path, content)
        elif isinstance(item, h5py.Dataset):
            if _is_words(item):
                content.lists[path].append(_words(item[()]))
            if columns := _columns(item, str(name), path, content):
                content.groups[path] += columns
            if item.dtype.names:  # a table of records states its conditions itself
                content.remarks[path] += _attributes(item)


def _follow(references: Any, name: str, path: str, content: _Found) -> None:
    """Arrays of structs and cells of MATLAB 7.3: what lies in #refs# is met where its reference stands."""
    import h5py

    cells = references.size if references.size <= MOST_STRUCTS else 0
    if path.count("/") > _DEEPEST or not cells or "MATLAB_class" not in _file_marks(references):
        content.objects.append(name)
        content.groups[path].append((name, "", None, None))
        return
    cell = _text(references.attrs.get("MATLAB_class")) == "cell"  # else a field of an array of structs
    words: list[str] = []
    for number, reference in enumerate(np.reshape(references[()], -1), 1):
        content.seen += 1
        item = references.file[reference] if reference else None
        if content.seen > _MOST_OBJECTS:
            raise content.source.refuse("E_TOO_MANY_COLUMNS", f"over {_MOST_OBJECTS} objects", "export fewer")
        inner = f"{path}_{number}" if cells > 1 and not cell else path
        if isinstance(item, h5py.Group):
            _walk(item, f"{inner}/{name}_{number}" if cell else f"{inner}/{name}", content)
        elif isinstance(item, h5py.Dataset) and _text(item.attrs.get("MATLAB_class")) == "char":
            text = "".join(map(chr, np.reshape(item[()], -1)[:200].tolist())) if item.dtype.kind in "iu" else ""
            words.append(text)
            content.remarks[inner].append(f"{name}: {text}")
        elif isinstance(item, h5py.Dataset) and not cell and (columns := _columns(item, name, inner, content)):
            content.groups[inner] += columns
    if cell and len(words) == cells:
        content.lists[path].append(words)


def _frame(columns: list[tuple]) -> list[tuple]:
    """Return the columns of a group that holds a pandas frame in its fixed format; empty if it holds none."""
    datasets = {dataset.name.rpartition("/")[2]: dataset for _, _, dataset, _ in columns if dataset is not None}
    if "axis1" not in datasets or "block0_items" not in datasets:
        return []
    index = datasets["axis1"]
    name = _text(index.attrs.get("name"))
    framed: list[tuple] = [("index" if name in ("", "N.") else name, "", index, None)]
    for key, dataset in datasets.items():
        if not re.fullmatch(r"block[0-9]+_values", key) or key.replace("values", "items") not in datasets:
            continue
        items = _words(datasets[key.replace("values", "items")][()])
        parts = [None] if len(items) == 1 else range(len(items))
        framed += [(item, "", dataset, part) for item, part in zip(items, parts, strict=True)]
    return framed


@dataclass(frozen=True)
class _Clock:
    """The times of a dataset's samples, as a dataset."""

    step: float
    start: float
    size: int
    attrs: ClassVar[dict[str, Any]] = {}

    def __getitem__(self, _: tuple) -> np.ndarray:
        return self.start + self.step * np.arange(self.size)


def _with_clocks(columns: list[Any]) -> list[Any]:
    """Return the columns with the times that attributes of datasets state: one for all, or one before each channel."""
    if any(split_name(name).role == "time" for name, *_ in columns):
        return columns
    clocks: list[Any] = []
    for _, _, dataset, part in columns:
        if dataset is None or part is not None or (clock := stated_clock(_numbers(dataset.attrs))) is None:
            clocks.append(None)
        else:
            clocks.append((_Clock(*clock[:2], int(np.prod(dataset.shape))), clock[2]))
    if not any(clocks):
        return columns
    if len(set(clocks)) == 1:
        clock, unit = clocks[0]
        return [("time", unit, clock, None), *columns]
    timed = [(column, clock) for column, clock in zip(columns, clocks, strict=True) if clock]
    return [entry for column, (clock, unit) in timed for entry in (("time", unit, clock, None), column)]


def _numbers(says: Any) -> dict[str, float]:
    """Return the attributes that are one number each."""
    values = {key: np.asarray(says[key]) for key in list(says)[:MOST_COLUMNS]}
    return {k: float(v.reshape(-1)[0]) for k, v in values.items() if v.dtype.kind in "iuf" and v.size == 1}


def _titled(columns: list[tuple], words: list[list[str]]) -> list[tuple]:
    """Return the columns with the names and units that lists of words give those of a matrix."""
    named = []
    for dataset, across in ((d, list(group)) for d, group in groupby(columns, key=lambda column: column[2])):
        says = {} if dataset is None else dataset.attrs
        lists = [*words, *(_words(says[key]) for key in list(says)[:MOST_COLUMNS])]
        titles = titles_of(len(across), lists) if isinstance(across[0][3], int) else None
        units = [column[1] for column in across]
        if isinstance(across[0][3], str):  # fields of records
            stated = next((words for words in lists if len(words) == len(across) and any(map(is_unit, words))), units)
            titles = [column[0] for column in across], stated
        for column, name, unit in zip(across, *(titles or ([c[0] for c in across], units)), strict=True):
            named.append((name, unit or column[1], *column[2:]))
    return named


def _file_marks(item: Any) -> set[str]:
    """Names of the attributes of a dataset and of the group it lies in, and whether its file is MATLAB's."""
    marks = {*item.attrs, *item.parent.attrs}
    return marks | {"MATLAB_class"} if item.file.userblock_size else marks


def _attributes(item: Any) -> list[str]:
    """Return the attributes of a group or a dataset as lines: numbers and short texts."""
    lines = []
    for name in list(item.attrs)[:MOST_COLUMNS]:
        value = np.asarray(item.attrs[name])
        if value.size == 1 and value.dtype.kind in "iufSUO":
            shown = _text(item.attrs[name]) if value.dtype.kind in "SUO" else value.reshape(-1)[0]
            unit = next((_text(item.attrs[f"{name}_{u}"]) for u in _UNIT_NAMES if f"{name}_{u}" in item.attrs), "")
            shown = f"{shown} {unit}" if is_unit(unit) and value.dtype.kind in "iuf" else shown
            lines.append(f"{name}: {shown}"[:200])
    return lines


def _columns(dataset: Any, name: str, path: str, content: _Found) -> list[tuple]:
    kind, source = dataset.dtype, content.source
    if dataset.external or dataset.is_virtual:
        raise source.refuse("E_UNSAFE", f"{name!r} lies in another file", "export one whole file")
    if kind.hasobject:
        content.objects.append(name)
        return [(name, "", dataset, None)] if dataset.size > 1 else []
    characters = _text(dataset.attrs.get("MATLAB_class")) in ("char", "cell")
    if dataset.size == 1 and kind.kind in "iuf" and not characters and content.numbers < MOST_COLUMNS:
        content.numbers += 1
        content.constants[path][name] = float(np.reshape(dataset[()], -1)[0])
    if dataset.size < 2 or characters:
        return []
    check_unpacked(source, int(dataset.size) * max(8, kind.itemsize if not kind.names else 8))
    if kind.names:
        return [(field, "", dataset, field) for field in kind.names]
    stated = [dataset.attrs[name] for name in _UNIT_NAMES if name in dataset.attrs]
    if kind.kind in "iu" and counts_of(dataset.attrs) is None:
        content.constants[path] |= {f"{name}_{key}": number for key, number in _numbers(dataset.attrs).items()}
    unit = next((_text(value) for value in stated if np.asarray(value).dtype.kind in "SUO"), "")
    unit = unit.partition(" since ")[0]  # netCDF counts time from a date
    shape = dataset.shape[::-1] if "MATLAB_class" in dataset.attrs else dataset.shape
    return [(column, unit, dataset, part) for column, part in expand(name, shape)]


def _with_units(columns: list[tuple], group: str, content: _Found) -> list[tuple]:
    """Return the columns with the units that a group of texts beside or above them gives them by name: units/F = N."""
    above = [units for path, units in content.units.items() if f"{group}/".startswith(f"{path}/")]
    stated = {key: unit for units in above for key, unit in units.items() if is_unit(unit)}
    return [(name, unit or stated.get(name, ""), *rest) for name, unit, *rest in columns]


def _is_text(item: Any) -> bool:
    """Tell if a dataset is a single text."""
    import h5py

    return isinstance(item, h5py.Dataset) and item.size == 1 and h5py.check_string_dtype(item.dtype) is not None


def _is_words(item: Any) -> bool:
    """Tell if a dataset is a short list of texts."""
    import h5py

    if not isinstance(item, h5py.Dataset) or item.ndim != 1 or not 1 < len(item) <= MOST_COLUMNS:
        return False
    return item.dtype.kind == "S" or h5py.check_string_dtype(item.dtype) is not None


def _words(values: Any) -> list[str]:
    """Return the texts of an attribute or a dataset; empty if it holds anything else."""
    array = np.asarray(values).reshape(-1)
    texts = array.dtype.kind in "SU" or all(isinstance(item, str | bytes) for item in array[:MOST_COLUMNS])
    return [_text(item).strip() for item in array[:MOST_COLUMNS].tolist()] if texts else []


def _text(value: object) -> str:
    if isinstance(value, np.ndarray):
        value = value.reshape(-1)[0] if value.size else ""
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value or "")
