"""HDF5, and MATLAB files from 7.3 on, which are HDF5 inside: groups as nested structures."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from mrdamper.rig_files.column_names import is_unit, split_name
from mrdamper.rig_files.conditions import stated_clock
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers import arrays
from mrdamper.rig_files.readers.base import MOST_COLUMNS, RawTable, Reader, Source
from mrdamper.rig_files.readers.nested import DEEPEST, MOST_TEXT, nested_tables

# pyright: reportMissingImports=false, reportAttributeAccessIssue=false

HDF5_MARK = b"\x89HDF\r\n\x1a\n"
_MOST_OBJECTS = 10_000
MOST_STRUCTS = 2000  # of an array of structs
_OF_MATLAB = ("#refs#", "#subsystem#")  # what lies there is met where its reference stands


class Hdf5(Reader):
    """Datasets as columns, one table a group."""

    name = "hdf5"
    title = "HDF5"
    suffixes = (".h5", ".hdf5", ".hdf", ".he5", ".nxs", ".nc")
    library = "h5py"
    marks = (HDF5_MARK,)

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """One table a group of datasets."""
        return hdf5_tables(source, self.title)


def hdf5_tables(source: Source, title: str) -> list[RawTable]:
    """Return the groups of an HDF5 file as tables."""
    h5py = arrays.load("h5py", title)
    with arrays.refusing_damage(source, title):
        file = h5py.File(source.path, "r")
        source.keep.callback(file.close)
        tree = _Walk(source).group(file, 0)
    return nested_tables(source, tree, title)


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
            rows = [cells[row :: item.shape[-1]] for row in range(item.shape[-1] if cells and item.ndim == 2 else 0)]
            stored = all(isinstance(cell, arrays.Stored) for cell in cells)
            grid = stored and min(item.shape) > 1  # of tests by two conditions
            return {name: arrays.with_headings(rows) or (rows if grid else cells) or np.empty(2, dtype=object)}
        unit = arrays.unit_in(item.attrs)
        kind = getattr(h5py.check_vlen_dtype(item.dtype), "kind", "")  # of vectors of samples
        if kind and kind in "iuf" and len(item.shape) == 1 and len(item) <= MOST_STRUCTS:
            return {name: list(item[()]), f"{name}_unit": unit}
        value = self._dataset(name, item)
        if not isinstance(value, arrays.Stored):
            stated = f"{name} [{unit}]" if isinstance(value, float) and is_unit(unit) else name
            return {stated: value} if value is not None else {}
        attributes = _attributes(item)
        lists = {f"{name} {key}": words for key, words in attributes.items() if isinstance(words, list)}
        if names := item.dtype.names:  # a table of records states its conditions itself
            units = next((w for w in lists.values() if len(w) == len(names) and any(map(is_unit, w))), None)
            kinds, fields = item.dtype, dict[str, Any]()
            fields |= {of: arrays.Stored(item.shape, kinds[of], lambda of=of: item[of]) for of in names}
            fields |= {"units": dict(zip(names, units, strict=True))} if units else {}
            return attributes | fields if alone else {name: attributes | fields}
        numbers = {key: number for key, number in attributes.items() if isinstance(number, float)}
        packed = item.dtype.kind in "iu" and arrays.counts_of(item.attrs) is None
        says = {f"{name}_{key}": number for key, number in numbers.items()} if packed else {}
        clock = {} if timed or stated_clock(numbers) is None else numbers
        channel = {"name": name, "unit": unit, "data": value, **clock} if unit or clock else value
        return {name: channel, **says, **lists}

    def _dataset(self, name: str, dataset: Any) -> Any:
        """Return an array, or the number or the text of one item; None for what is empty."""
        import h5py

        kind, says = dataset.dtype, arrays.text_of(dataset.attrs.get("MATLAB_class"))
        if dataset.external or dataset.is_virtual:
            raise self._source.refuse("E_UNSAFE", f"{name!r} lies in another file", "export one whole file")
        if says == "char":
            return "".join(map(chr, np.reshape(dataset[()], -1)[:MOST_TEXT].tolist())) if kind.kind in "iu" else None
        if not dataset.size or says == "cell" or "MATLAB_empty" in dataset.attrs:
            return None
        if dataset.size == 1 and (kind.kind in "iufS" or h5py.check_string_dtype(kind)):
            value = np.reshape(dataset[()], -1)[0]
            return float(value) if kind.kind in "iuf" else arrays.text_of(value)[:MOST_TEXT]
        if dataset.size == 1:
            return None
        texts = h5py.check_string_dtype(kind) or kind.kind == "S"
        if texts and 1 < dataset.size <= MOST_COLUMNS and dataset.ndim == 1:
            return arrays.texts_in(dataset[()])
        arrays.check_unpacked(self._source, int(dataset.size) * max(8, kind.itemsize if not kind.names else 8))
        turned = bool(says) and dataset.ndim == 2  # MATLAB stores its matrices so
        shape = dataset.shape[::-1] if turned else dataset.shape

        def read() -> np.ndarray:
            values = arrays.unpacked(dataset.attrs, dataset[()])
            return values.T if turned else values

        return arrays.Stored(shape, kind, read)


def _is_matlab(item: Any) -> bool:
    """Tell if a dataset lies in a file of MATLAB, which writes a block of its own before the file."""
    return "MATLAB_class" in {*item.attrs, *item.parent.attrs} or bool(item.file.userblock_size)


def _is_field(item: Any) -> bool:
    """Tell if a dataset holds the references of one field of an array of structs."""
    import h5py

    references = isinstance(item, h5py.Dataset) and h5py.check_ref_dtype(item.dtype) is h5py.Reference
    return references and _is_matlab(item) and arrays.text_of(item.attrs.get("MATLAB_class")) != "cell"


def _frame(items: Mapping[str, Any]) -> dict[str, Any]:
    """Return the columns of a group that holds a pandas frame in its fixed format; empty if it holds none."""
    if not {"axis1", "block0_items"} <= set(items):
        return {}
    index = items["axis1"]
    name = arrays.text_of(index.attrs.get("name"))
    name = "index" if name in ("", "N.") else name
    framed: dict[str, Any] = {name: arrays.Stored(index.shape, index.dtype, index.__array__)}
    for key, block in items.items():
        if re.fullmatch(r"block[0-9]+_values", key) and key.replace("values", "items") in items:
            for i, item in enumerate(arrays.texts_in(items[key.replace("values", "items")][()])):
                framed[item] = arrays.Stored(block.shape[:1], block.dtype, lambda block=block, i=i: block[:, i])
    return framed


def _attributes(item: Any) -> dict[str, Any]:
    """Return the attributes of a group or a dataset that are a number, a short text or a list of words."""
    says: dict[str, Any] = {}
    for name in list(item.attrs)[:MOST_COLUMNS]:
        value = np.asarray(item.attrs[name])
        if value.size == 1 and value.dtype.kind in "iuf":
            unit = arrays.unit_in(item.attrs, f"{name}_")
            says[f"{name} [{unit}]" if is_unit(unit) else name] = float(value.reshape(-1)[0])
        elif value.size == 1 and value.dtype.kind in "SUO":
            says[name] = arrays.text_of(item.attrs[name])[:MOST_TEXT]
        elif words := arrays.texts_in(value):
            says[name] = words
    return says
