"""HDF5, and MATLAB files from 7.3 on, which are HDF5 inside."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mrdamper.rig_files.file_form import FileForm
from mrdamper.rig_files.readers.arrays import array_table, check_unpacked, expand, load, pick, refusing_damage
from mrdamper.rig_files.readers.base import MOST_COLUMNS, RawTable, Reader, Source

# pyright: reportMissingImports=false, reportAttributeAccessIssue=false

HDF5_MARK = b"\x89HDF\r\n\x1a\n"
_MOST_OBJECTS = 10_000
_DEEPEST = 8  # groups within groups
_PACKING = ("scale_factor", "add_offset", "_FillValue", "missing_value")
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


class Matlab73(Reader):
    """MATLAB 7.3."""

    name = "mat73"
    title = "MATLAB 7.3"
    suffixes = (".mat73",)
    library = "h5py"

    def recognises(self, source: Source) -> bool:
        """By the mark behind MATLAB's own header."""
        return source.head(520)[512:] == HDF5_MARK

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
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
        found = _Found(source)
        _walk(file, "", found)
    groups, objects = found.groups, found.objects
    tables = []
    for group, columns in groups.items():
        constants = {**found.constants.get("", {}), **found.constants.get(group, {})}
        tables.append(_table(source, columns, title, group, constants, remarks=_above(found.remarks, group)))
    if len(groups) > 1:
        every = [column for columns in groups.values() for column in columns]
        tables.append(_table(source, every, title, "", found.constants.get("", {}), fallback=True))
    if not tables:
        code, found = ("E_UNSAFE", f"only objects ({objects[0]})") if objects else ("E_NO_DATA", "no array of numbers")
        raise source.refuse(code, found, mend="save the channels as arrays of numbers")
    return tables


def _table(
    source: Source,
    columns: list[Any],
    title: str,
    label: str,
    constants: dict[str, float],
    *,
    fallback: bool = False,
    remarks: list[str] | None = None,
) -> RawTable:
    names = [name for name, _, _, _ in columns]
    units = [unit for _, unit, _, _ in columns]

    def column_of(column: int) -> np.ndarray:
        _, _, dataset, part = columns[column]
        if dataset is None:
            return np.empty(2, dtype=object)  # a link, refused if it is asked for
        if isinstance(part, str):
            return dataset[part]
        return _unpacked(dataset, pick(_upright(dataset), part))

    label = label.strip("/").replace("/", "_")
    return array_table(
        source, names, units, column_of, label=label, title=title, fallback=fallback, constants=constants,
        remarks=remarks or (),
    )  # fmt: skip


def _above(remarks: dict[str, list[str]], group: str) -> list[str]:
    """What the attributes of a group, and of the groups around it, say."""
    return [line for path, lines in remarks.items() if f"{group}/".startswith(f"{path}/") for line in lines]


def _unpacked(dataset: Any, values: np.ndarray) -> np.ndarray:
    """Numbers as netCDF and others pack them: scale_factor, add_offset, and a code for missing ones."""
    says = {name: dataset.attrs[name] for name in _PACKING if name in dataset.attrs}
    if not says or values.dtype.kind not in "iuf":
        return values
    numbers = values.astype(np.float64)
    for name in ("_FillValue", "missing_value"):
        if name in says:
            numbers[np.isin(values, np.asarray(says[name]))] = np.nan
    factor, offset = (float(np.reshape(says.get(n, d), -1)[0]) for n, d in (("scale_factor", 1), ("add_offset", 0)))
    return factor * numbers + offset


def _upright(dataset: Any) -> np.ndarray:
    """Samples down, as MATLAB stores its matrices turned."""
    array = dataset[()]
    return array.T if "MATLAB_class" in dataset.attrs and array.ndim == 2 else array


@dataclass
class _Found:
    """What a walk through a file meets: by group its columns and single numbers; what is never loaded."""

    source: Source
    groups: dict[str, list[tuple]] = field(default_factory=dict)
    constants: dict[str, dict[str, float]] = field(default_factory=dict)
    objects: list[str] = field(default_factory=list)
    remarks: dict[str, list[str]] = field(default_factory=dict)
    seen: int = 0
    numbers: int = 0


def _walk(group: Any, path: str, found: _Found) -> None:
    import h5py

    found.remarks[path] = _attributes(group)
    for name in group:
        found.seen += 1
        if found.seen > _MOST_OBJECTS or path.count("/") > _DEEPEST:
            raise found.source.refuse(
                "E_TOO_MANY_COLUMNS",
                f"over {_MOST_OBJECTS} objects, or groups within groups without end",
                mend="export fewer channels",
            )
        link = group.get(name, getlink=True)
        if isinstance(link, (h5py.ExternalLink, h5py.SoftLink)):  # leads elsewhere, and is not followed
            found.objects.append(f"{name}: a link")
            found.groups.setdefault(path, []).append((str(name), "", None, None))
            continue
        item = group.get(name)
        if isinstance(item, h5py.Group) and name != "#refs#" and name != "#subsystem#":
            _walk(item, f"{path}/{name}", found)
        elif isinstance(item, h5py.Dataset):
            columns = _columns(item, str(name), path, found)
            if columns:
                found.groups.setdefault(path, []).extend(columns)


def _attributes(item: Any) -> list[str]:
    """The attributes of a group or a dataset as lines: numbers and short texts."""
    lines = []
    for name in list(item.attrs)[:MOST_COLUMNS]:
        value = np.asarray(item.attrs[name])
        if value.size == 1 and value.dtype.kind in "iufSUO":
            lines.append(
                f"{name}: {_text(item.attrs[name]) if value.dtype.kind in 'SUO' else value.reshape(-1)[0]}"[:200]
            )
    return lines


def _columns(dataset: Any, name: str, path: str, found: _Found) -> list[tuple]:
    kind, source = dataset.dtype, found.source
    if dataset.external or dataset.is_virtual:
        raise source.refuse("E_UNSAFE", f"{name!r} lies in another file", mend="export one whole file")
    if kind.hasobject:
        found.objects.append(name)
        return [(name, "", dataset, None)] if dataset.size > 1 else []
    characters = _text(dataset.attrs.get("MATLAB_class")) in ("char", "cell")
    if dataset.size == 1 and kind.kind in "iuf" and not characters and found.numbers < MOST_COLUMNS:
        found.numbers += 1
        found.constants.setdefault(path, {})[name] = float(np.reshape(dataset[()], -1)[0])
    if dataset.size < 2 or characters:
        return []
    check_unpacked(source, int(dataset.size) * max(8, kind.itemsize if not kind.names else 8))
    if kind.names:
        return [(field, "", dataset, field) for field in kind.names]
    stated = [dataset.attrs[name] for name in _UNIT_NAMES if name in dataset.attrs]
    unit = next((_text(value) for value in stated if np.asarray(value).dtype.kind in "SUO"), "")
    shape = dataset.shape[::-1] if "MATLAB_class" in dataset.attrs else dataset.shape
    return [(column, unit, dataset, part) for column, part in expand(name, shape)]


def _text(value: object) -> str:
    if isinstance(value, np.ndarray):
        value = value.reshape(-1)[0] if value.size else ""
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value or "")
