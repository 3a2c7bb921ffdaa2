"""HDF5, classic netCDF, MATLAB files, which are HDF5 inside from 7.3 on, and Octave's texts, as nested structures."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mrdamper.rig_files.column_names import is_unit, split_name
from mrdamper.rig_files.conditions import stated_clock
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.arrays import (
    Stored,
    check_unpacked,
    counts_of,
    damaged,
    load,
    refuse_twice,
    refusing_damage,
    text_of,
    texts_in,
    unpacked,
    value_of,
    whole,
)
from mrdamper.rig_files.readers.base import MOST_COLUMNS, RawTable, Reader, Source
from mrdamper.rig_files.readers.nested import DEEPEST, MOST_TEXT, nested_tables
from mrdamper.rig_files.text.stream import decoded

# pyright: reportMissingImports=false, reportAttributeAccessIssue=false

HDF5_MARK = b"\x89HDF\r\n\x1a\n"
_MOST_OBJECTS = 10_000
MOST_STRUCTS = 2000  # of an array of structs
_UNIT_NAMES = ("units", "unit", "Units", "Unit", "UNIT", "UNITS", "unit_string")
_OF_MATLAB = ("#refs#", "#subsystem#")  # what lies there is met where its reference stands
_NUMERIC = ("double", "single", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64")
_OBJECTS = ("object", "opaque", "function", "unknown")
_MARKS = (b"# Created by Octave", b"# name: ")


class Hdf5(Reader):
    """Datasets as columns, one table a group."""

    name = "hdf5"
    title = "HDF5"
    suffixes = (".h5", ".hdf5", ".hdf", ".he5", ".nxs", ".nc")
    library = "h5py"
    marks = (HDF5_MARK,)

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """One table a group of datasets, and one of all together if no group holds a test."""
        return hdf5_tables(source, self.title)


def hdf5_tables(source: Source, title: str) -> list[RawTable]:
    """Return the groups of an HDF5 file as tables."""
    h5py = load("h5py", title)
    with refusing_damage(source, title):
        file = h5py.File(source.path, "r")
        source.keep.callback(file.close)
        tree = _Walk(source).group(file, 0)
    return nested_tables(source, tree, title, together=True)


class _Walk:
    """Walk through a file, within bounds of its depth and the number of its objects."""

    def __init__(self, source: Source):
        self._source, self._seen = source, 0

    def group(self, group: Any, depth: int) -> Any:
        """Return a group as a mapping, its attributes among its items; an array of structs as a list of mappings."""
        import h5py

        links = {name: group.get(name, getlink=True) for name in group if name not in _OF_MATLAB}
        elsewhere = {name for name, link in links.items() if isinstance(link, (h5py.ExternalLink, h5py.SoftLink))}
        items = {name: group.get(name) for name in links if name not in elsewhere}
        self._count(len(links), depth)
        fields = [item for item in items.values() if _is_field(item)]
        if fields and len(fields) == len(links) and len({item.size for item in fields}) == 1:
            rows = zip(*(np.reshape(item[()], -1)[:MOST_STRUCTS] for item in fields), strict=True)
            structs = [dict(zip(items, (self._at(group.file, r, depth) for r in row), strict=True)) for row in rows]
            return structs[0] if len(structs) == 1 else structs
        tree = {name: np.empty(2, dtype=object) for name in elsewhere}  # not followed, refused if it is asked for
        timed = any(split_name(name).role == "time" for name in items)
        for name, item in items.items():
            tree |= self._item(name, item, depth, timed=timed, alone=len(items) == 1)
        return {**_attributes(group), **(_frame(items) or tree)}

    def _count(self, objects: int, depth: int) -> None:
        self._seen += objects
        if self._seen > _MOST_OBJECTS or depth > DEEPEST:
            problem = f"over {_MOST_OBJECTS} objects, or groups within groups without end"
            raise self._source.refuse("E_TOO_MANY_COLUMNS", problem, "export fewer channels")

    def _at(self, file: Any, reference: Any, depth: int) -> Any:
        """Return what a reference of MATLAB leads to."""
        item = file[reference] if reference else None
        self._count(1, depth)
        return "" if item is None else self._item("", item, depth + 1, timed=True, alone=False).get("", "")

    def _item(self, name: str, item: Any, depth: int, *, timed: bool, alone: bool) -> dict[str, Any]:
        """Return the entries of a group that one of its items makes; of one `alone` those within it."""
        import h5py

        if isinstance(item, h5py.Group):
            return {name: self.group(item, depth + 1)}
        if not isinstance(item, h5py.Dataset):
            return {}
        if h5py.check_ref_dtype(item.dtype) is h5py.Reference:
            references = np.reshape(item[()], -1) if _is_matlab(item) else []
            cells = [self._at(item.file, r, depth) for r in references] if len(references) <= MOST_STRUCTS else []
            return {name: cells or np.empty(2, dtype=object)}
        unit = next((text_of(item.attrs[key]) for key in _UNIT_NAMES if key in item.attrs), "")
        kind = getattr(h5py.check_vlen_dtype(item.dtype), "kind", "")  # of vectors of samples
        if kind and kind in "iuf" and len(item.shape) == 1 and len(item) <= MOST_STRUCTS:
            return {name: list(item[()]), f"{name}_unit": unit}
        value = self._dataset(name, item)
        if not isinstance(value, Stored):
            stated = f"{name} [{unit}]" if isinstance(value, float) and is_unit(unit) else name
            return {stated: value} if value is not None else {}
        lists = {
            f"{name} {key}": words for key in list(item.attrs)[:MOST_COLUMNS] if (words := texts_in(item.attrs[key]))
        }
        if item.dtype.names:  # a table of records states its conditions itself
            units = next((w for w in lists.values() if len(w) == len(item.dtype.names) and any(map(is_unit, w))), None)
            fields: dict[str, Any] = {
                field: Stored(item.shape, item.dtype[field], lambda field=field: item[field])
                for field in item.dtype.names
            }
            fields |= {"units": dict(zip(item.dtype.names, units, strict=True))} if units else {}
            return {**_attributes(item), **fields} if alone else {name: {**_attributes(item), **fields}}
        numbers = {key: number for key, number in _attributes(item).items() if isinstance(number, float)}
        packed = item.dtype.kind in "iu" and counts_of(item.attrs) is None
        says = {f"{name}_{key}": number for key, number in numbers.items()} if packed else {}
        unit = unit.partition(" since ")[0]  # netCDF counts time from a date
        clock = {} if timed or stated_clock(numbers) is None else numbers
        channel = {"name": name, "unit": unit, "data": value, **clock} if unit or clock else value
        return {name: channel, **says, **lists}

    def _dataset(self, name: str, dataset: Any) -> Any:
        """Return an array, or the number or the text of one item; None for what is empty."""
        import h5py

        kind, says = dataset.dtype, text_of(dataset.attrs.get("MATLAB_class"))
        if dataset.external or dataset.is_virtual:
            raise self._source.refuse("E_UNSAFE", f"{name!r} lies in another file", "export one whole file")
        if says == "char":
            return "".join(map(chr, np.reshape(dataset[()], -1)[:MOST_TEXT].tolist())) if kind.kind in "iu" else None
        if not dataset.size or says == "cell" or "MATLAB_empty" in dataset.attrs:
            return None
        if dataset.size == 1 and (kind.kind in "iufS" or h5py.check_string_dtype(kind)):
            value = np.reshape(dataset[()], -1)[0]
            return float(value) if kind.kind in "iuf" else text_of(value)[:MOST_TEXT]
        if dataset.size == 1:
            return None
        texts = h5py.check_string_dtype(kind) or kind.kind == "S"
        if texts and 1 < dataset.size <= MOST_COLUMNS and dataset.ndim == 1:
            return texts_in(dataset[()])
        check_unpacked(self._source, int(dataset.size) * max(8, kind.itemsize if not kind.names else 8))
        turned = bool(says) and dataset.ndim == 2  # MATLAB stores its matrices so
        shape = dataset.shape[::-1] if turned else dataset.shape

        def read() -> np.ndarray:
            values = unpacked(dataset.attrs, dataset[()])
            return values.T if turned else values

        return Stored(shape, kind, read)


def _is_matlab(item: Any) -> bool:
    """Tell if a dataset lies in a file of MATLAB, which writes a block of its own before the file."""
    return "MATLAB_class" in {*item.attrs, *item.parent.attrs} or bool(item.file.userblock_size)


def _is_field(item: Any) -> bool:
    """Tell if a dataset holds the references of one field of an array of structs."""
    import h5py

    references = isinstance(item, h5py.Dataset) and h5py.check_ref_dtype(item.dtype) is h5py.Reference
    return references and _is_matlab(item) and text_of(item.attrs.get("MATLAB_class")) != "cell"


def _frame(items: Mapping[str, Any]) -> dict[str, Any]:
    """Return the columns of a group that holds a pandas frame in its fixed format; empty if it holds none."""
    if not {"axis1", "block0_items"} <= set(items):
        return {}
    index = items["axis1"]
    name = text_of(index.attrs.get("name"))
    framed: dict[str, Any] = {
        "index" if name in ("", "N.") else name: Stored(index.shape, index.dtype, index.__array__)
    }
    for key, block in items.items():
        if re.fullmatch(r"block[0-9]+_values", key) and key.replace("values", "items") in items:
            for i, item in enumerate(texts_in(items[key.replace("values", "items")][()])):
                framed[item] = Stored(block.shape[:1], block.dtype, lambda block=block, i=i: block[:, i])
    return framed


def _attributes(item: Any) -> dict[str, Any]:
    """Return the attributes of a group or a dataset that are a number, a short text or a list of words."""
    says: dict[str, Any] = {}
    for name in list(item.attrs)[:MOST_COLUMNS]:
        value = np.asarray(item.attrs[name])
        if value.size == 1 and value.dtype.kind in "iuf":
            unit = next((text_of(item.attrs[f"{name}_{u}"]) for u in _UNIT_NAMES if f"{name}_{u}" in item.attrs), "")
            says[f"{name} [{unit}]" if is_unit(unit) else name] = float(value.reshape(-1)[0])
        elif value.size == 1 and value.dtype.kind in "SUO":
            says[name] = text_of(item.attrs[name])[:MOST_TEXT]
        elif words := texts_in(value):
            says[name] = words
    return says


class NetCdf(Reader):
    """Variables as columns."""

    name = "netcdf"
    title = "classic netCDF"
    suffixes = (".nc", ".cdf")
    library = "scipy.io"
    marks = (b"CDF\x01", b"CDF\x02")

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """Return one table, or one a test where rows are tests: single numbers and attributes stand beside it."""
        with refusing_damage(source, self.title):
            from scipy.io import netcdf_file

            source.file.seek(0)
            file = netcdf_file(source.file, mmap=False)
            arrays = {name: variable for name, variable in file.variables.items() if np.prod(variable.shape) > 1}
            check_unpacked(source, 8 * sum(int(np.prod(variable.shape)) for variable in arrays.values()))
            single = {
                f"{name} [{_unit_of(variable)}]": float(np.reshape(variable[...], -1)[0])
                for name, variable in file.variables.items()
                if variable.shape == () and np.asarray(variable.data).dtype.kind in "iuf"
            }
            says = {name: text_of(value) for name, value in file._attributes.items()}
            columns = {
                name: unpacked(v._attributes, np.array(v[:]).astype(v[:].dtype.newbyteorder("=")))
                for name, v in arrays.items()
            }
        units = {name: _unit_of(variable) for name, variable in arrays.items()}
        return nested_tables(source, {**says, **columns, **single, "units": units}, self.title)


def _unit_of(variable: Any) -> str:
    """Return the unit of a variable: that of a time is followed by the date it counts from."""
    return text_of(getattr(variable, "units", "")).partition(" since ")[0]


class Matlab(Reader):
    """Variables and fields of structs as columns; 7.3 is handed on."""

    name = "mat"
    title = "MATLAB file"
    suffixes = (".mat", ".mat73")
    library = "scipy.io"

    def recognises(self, source: Source) -> bool:
        """By the text at the start; version 4 has none, so the name must say it."""
        head = source.head(520)
        return (
            head.startswith(b"MATLAB") or head[512:] == HDF5_MARK or (source.suffix == ".mat" and _is_version_4(head))
        )

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """Return the variables as one table, and one more a struct."""
        if source.head(520)[512:] == HDF5_MARK:
            return hdf5_tables(source, self.title)
        with refusing_damage(source, self.title):
            from scipy.io import loadmat, whosmat

            source.file.seek(0)
            variables = whosmat(source.file)
            names = [name for name, _, _ in variables]
            refuse_twice(source, names)
            check_unpacked(source, 8 * sum(int(np.prod(shape, dtype=object)) for _, shape, _ in variables))
            wanted = [name for name, _, kind in variables if kind in (*_NUMERIC, "struct", "char", "cell")]
            source.file.seek(0)
            values = loadmat(
                source.file, variable_names=wanted, struct_as_record=True, verify_compressed_data_integrity=True
            )
        others = [name for name, _, kind in variables if kind in _OBJECTS]
        tree = {name: _tree(values[name]) for name in wanted if name in values}
        objects = {name: np.empty(2, dtype=object) for name in others}  # refused if one is asked for
        return nested_tables(source, {**tree, **objects}, self.title)


def _tree(value: Any, depth: int = 0) -> Any:
    """Return a variable as a nested structure: mappings for structs, lists for arrays of them and for cells."""
    array = np.asarray(value)
    kind, size = array.dtype.kind, array.size
    if array.dtype.names:
        names = array.dtype.names
        items = array.reshape(-1)[:MOST_STRUCTS] if depth < DEEPEST else []
        members = [{name: _tree(item[name], depth + 1) for name in names} for item in items]
        return members[0] if len(members) == 1 else members
    if words := texts_in(array):
        return words
    if kind == "O" and size and depth < DEEPEST:
        cells = [np.asarray(cell) for cell in array.flat]
        if size == 1:
            return _tree(cells[0], depth + 1)
        if all(cell.dtype.names for cell in cells) or all(cell.dtype.kind in "iuf" and cell.size > 1 for cell in cells):
            trees = [_tree(cell, depth + 1) for cell in cells[:MOST_STRUCTS]]
            if cells[0].dtype.names or array.ndim != 2 or min(array.shape) < 2 or size > MOST_STRUCTS:
                return trees
            return [trees[i : i + array.shape[1]] for i in range(0, size, array.shape[1])]
        return array
    return value_of(array) if size else ""


def _is_version_4(head: bytes) -> bool:
    if len(head) < 21:
        return False
    for order in "<>":
        kind, rows, columns, imaginary, length = np.frombuffer(head[:20], dtype=f"{order}i4").tolist()
        if 0 <= kind < 5000 and rows > 0 and columns > 0 and imaginary in (0, 1) and 1 < length < 200:
            return head[20 : 20 + length][:-1].isascii()
    return False


class Octave(Reader):
    """Numbers, matrices and texts by their names; a field of a struct is a variable."""

    name = "octave"
    title = "Octave text"
    suffixes = (".octave",)
    binary = False

    def recognises(self, source: Source) -> bool:
        """By its first line, whatever it is called."""
        return source.head(32).startswith(_MARKS)

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """Return the variables as one table."""
        variables: dict[str, Any] = {}
        for name, kind, lines in _variables(decoded(whole(source, self.title)).splitlines()):
            try:
                value = _value(kind, lines)
            except ValueError as error:
                raise damaged(source, self.title, str(error)) from error
            variables |= {} if value is None else {name: value}
        return nested_tables(source, variables, self.title)


def _variables(lines: list[str]) -> Iterator[tuple[str, str, list[str]]]:
    """Yield the name of each variable, its type, and the lines that follow."""
    starts = [i for i, line in enumerate(lines) if line.startswith("# name: ")]
    for start, stop in zip(starts, [*starts[1:], len(lines)], strict=True):
        if start + 1 < stop and lines[start + 1].startswith("# type: "):
            yield lines[start][8:].strip(), lines[start + 1][8:].strip(), lines[start + 2 : stop]


def _value(kind: str, lines: list[str]) -> Any:
    """Return a number, a matrix or a text; None of another type. ValueError if it is not whole."""
    stated = {
        key[1:].strip(): number for key, colon, number in (x.partition(":") for x in lines if x[:1] == "#") if colon
    }
    body = [line for line in lines if line.strip() and not line.startswith("#")]
    if kind == "scalar":
        return float(body[0]) if body else None
    if kind in ("string", "sq_string"):
        return body[0].strip() if body else ""
    if kind != "matrix" or not {"rows", "columns"} <= set(stated):
        return None
    shape = int(stated["rows"]), int(stated["columns"])
    values = np.array([float(cell) for line in body for cell in line.split()])
    if values.size != shape[0] * shape[1]:
        raise ValueError(f"end of file after {values.size} of {shape[0] * shape[1]} values")
    return values.reshape(shape)
