"""HDF5, and MATLAB files from 7.3 on, which are HDF5 inside."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrdamper.io.readers.arrays import array_table, check_unpacked, expand, load, pick, refusing_damage
from mrdamper.io.readers.base import Hints, RawTable, Reader, Source

# pyright: reportMissingImports=false, reportAttributeAccessIssue=false

HDF5_MARK = b"\x89HDF\r\n\x1a\n"
_MOST_OBJECTS = 10_000
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

    def tables(self, source: Source, hints: Hints) -> list[RawTable]:
        """One table a group of datasets, and one of all together if no group holds a test."""
        return hdf5_tables(source, self.title)


class Matlab73(Reader):
    """MATLAB 7.3."""

    name = "mat73"
    title = "MATLAB 7.3"
    suffixes = (".mat73",)
    library = "h5py"

    def recognises(self, source: Source) -> bool:
        """By the mark behind MATLAB's own header."""
        return source.head(520)[512:] == HDF5_MARK

    def tables(self, source: Source, hints: Hints) -> list[RawTable]:
        """As of HDF5: a struct is a group."""
        return hdf5_tables(source, self.title)


def hdf5_tables(source: Source, title: str) -> list[RawTable]:
    """The groups of an HDF5 file as tables.

    Raises
    ------
    RigFileError
        E_FORMAT, E_TRUNCATED, E_UNSAFE, E_ARCHIVE_RATIO, E_NO_DATA.
    """
    h5py = load("h5py", title)
    with refusing_damage(source, title):
        file = h5py.File(source.path, "r")
        source.keep.callback(file.close)
        groups: dict[str, list[Any]] = {}
        objects: list[str] = []
        _walk(file, "", groups, objects, source, [0])
    tables = []
    for group, columns in groups.items():
        tables.append(_table(source, columns, title, group))
    if len(groups) > 1:
        tables.append(_table(source, [c for columns in groups.values() for c in columns], title, "", fallback=True))
    if not tables:
        code, found = ("E_UNSAFE", f"only objects ({objects[0]})") if objects else ("E_NO_DATA", "no array of numbers")
        raise source.refuse(code, found, mend="save the channels as arrays of numbers")
    return tables


def _table(source: Source, columns: list[Any], title: str, label: str, *, fallback: bool = False) -> RawTable:
    names = [name for name, _, _, _ in columns]
    units = [unit for _, unit, _, _ in columns]

    def column_of(column: int) -> np.ndarray:
        _, _, dataset, part = columns[column]
        if isinstance(part, str):
            return dataset[part]
        return pick(_upright(dataset), part)

    return array_table(
        source, names, units, column_of, label=label.strip("/").replace("/", "_"), title=title, fallback=fallback
    )


def _upright(dataset: Any) -> np.ndarray:
    """Samples down, as MATLAB stores its matrices turned."""
    array = dataset[()]
    return array.T if "MATLAB_class" in dataset.attrs and array.ndim == 2 else array


def _walk(group: Any, path: str, groups: dict, objects: list[str], source: Source, seen: list[int]) -> None:
    import h5py

    for name in group:
        seen[0] += 1
        if seen[0] > _MOST_OBJECTS or path.count("/") > 8:
            raise source.refuse("E_TOO_MANY_COLUMNS", f"over {_MOST_OBJECTS} objects", mend="export fewer channels")
        link = group.get(name, getlink=True)
        if isinstance(link, (h5py.ExternalLink, h5py.SoftLink)):
            if isinstance(link, h5py.ExternalLink):
                objects.append(f"{name}: a link to another file")
            continue  # a path of its own is not followed
        item = group.get(name)
        if isinstance(item, h5py.Group) and name != "#refs#" and name != "#subsystem#":
            _walk(item, f"{path}/{name}", groups, objects, source, seen)
        elif isinstance(item, h5py.Dataset):
            groups.setdefault(path, []).extend(_columns(item, str(name), objects, source))
            if not groups[path]:
                del groups[path]


def _columns(dataset: Any, name: str, objects: list[str], source: Source) -> list[tuple]:
    kind = dataset.dtype
    if dataset.external or dataset.is_virtual:
        raise source.refuse("E_UNSAFE", f"{name!r} lies in another file", mend="export one whole file")
    if kind.hasobject:
        objects.append(name)
        return [(name, "", dataset, None)] if dataset.size > 1 else []
    if dataset.size < 2:
        return []
    check_unpacked(source, int(dataset.size) * max(8, kind.itemsize if not kind.names else 8))
    if kind.names:
        return [(field, "", dataset, field) for field in kind.names]
    if kind.kind not in "iuf" or _text(dataset.attrs.get("MATLAB_class")) in ("char", "cell"):
        return []
    unit = next((_text(dataset.attrs[a]) for a in _UNIT_NAMES if a in dataset.attrs), "")
    shape = dataset.shape[::-1] if "MATLAB_class" in dataset.attrs else dataset.shape
    return [(column, unit, dataset, part) for column, part in expand(name, shape)]


def _text(value: object) -> str:
    if isinstance(value, np.ndarray):
        value = value.reshape(-1)[0] if value.size else ""
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value or "")
