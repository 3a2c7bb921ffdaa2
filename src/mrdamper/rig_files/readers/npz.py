"""NumPy archives; arrays of Python objects are refused, as loading them runs code."""

from __future__ import annotations

import zipfile
from itertools import groupby

import numpy as np

from mrdamper.rig_files.column_names import split_name
from mrdamper.rig_files.file_form import FileForm
from mrdamper.rig_files.readers.archive import UNREADABLE_ZIP, check_sizes, is_arrays, zipped_names
from mrdamper.rig_files.readers.arrays import array_table, damaged, expand, pick, refusing_damage, titles_of, twice
from mrdamper.rig_files.readers.base import MOST_COLUMNS, RawTable, Reader, Source

_Column = tuple[str, str, tuple[str, int | str | None]]


class Npz(Reader):
    """Arrays by name."""

    name = "npz"
    title = "NumPy archive"
    suffixes = (".npz",)

    def recognises(self, source: Source) -> bool:
        """A zip of arrays, or a damaged zip of that name."""
        if not source.head(4).startswith(b"PK"):
            return False
        try:
            return is_arrays(zipped_names(source))
        except UNREADABLE_ZIP:
            return source.suffix in self.suffixes

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """The arrays as columns; a matrix gives numbered ones, a structured array its fields."""
        with refusing_damage(source, self.title):
            columns, single, worded = _columns(source)
            source.file.seek(0)
            with np.load(source.file, allow_pickle=False) as archive:
                constants = {name: float(archive[name].reshape(-1)[0]) for name in single[:MOST_COLUMNS]}
                lists = [[str(word).strip() for word in archive[name].reshape(-1)] for name in worded]
            columns = _titled(columns, lists) if lists else columns
        names, units, places = [c[0] for c in columns], [c[1] for c in columns], [c[2] for c in columns]

        def load(column: int) -> np.ndarray:
            member, part = places[column]
            source.file.seek(0)
            with np.load(source.file, allow_pickle=False) as archive:
                array = archive[member]
            return array[part] if isinstance(part, str) else pick(array, part)

        return [array_table(source, names, units, load, title=self.title, constants=constants)]


def _titled(columns: list[_Column], lists: list[list[str]]) -> list[_Column]:
    """The columns with the names and units that lists of words give those of a matrix."""
    titled = []
    for member, group in groupby(columns, key=lambda column: column[2][0]):
        across = list(group)
        titles = titles_of(len(across), lists) if isinstance(across[0][2][1], int) else None
        names, units = titles or ([c[0] for c in across], [c[1] for c in across])
        titled += [(n, u, (member, c[2][1])) for n, u, c in zip(names, units, across, strict=True)]
    return titled


def _columns(source: Source) -> tuple[list[_Column], list[str], list[str]]:
    """Name, unit and place of every column, the arrays of one number and those of words, by the arrays' headers."""
    try:
        archive = zipfile.ZipFile(source.file)
    except UNREADABLE_ZIP as error:
        raise damaged(source, Npz.title, "end of file not found") from error
    with archive:
        check_sizes(source, archive.infolist())
        columns: list[_Column] = []
        single: list[str] = []
        worded: list[str] = []
        names = [member.filename for member in archive.infolist()]
        if len(set(names)) < len(names):
            raise twice(source, next(name for name in names if names.count(name) > 1).removesuffix(".npy"))
        for member in archive.infolist():
            name = member.filename.removesuffix(".npy")
            with archive.open(member) as stream:
                version = np.lib.format.read_magic(stream)
                read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
                shape, _, dtype = read(stream)
            if dtype.hasobject:
                raise source.refuse(
                    "E_UNSAFE",
                    f"array {name!r} holds pickled objects, which run code when loaded",
                    "save plain arrays of numbers",
                )
            if int(np.prod(shape, dtype=object)) * dtype.itemsize > member.file_size:
                raise damaged(source, Npz.title, f"array {name!r} is incomplete")
            if dtype.kind == "U" and split_name(name).role is None and 1 < np.prod(shape, dtype=object) <= MOST_COLUMNS:
                worded.append(name)
            elif dtype.names:
                columns += [(field, "", (name, field)) for field in dtype.names]
            elif np.prod(shape, dtype=object) > 1:
                unit = "s" if dtype.kind in "Mm" else ""
                columns += [(column, unit, (name, part)) for column, part in expand(name, shape)]
            elif dtype.kind in "iuf" and np.prod(shape, dtype=object) == 1:
                single.append(name)
    if not columns:
        raise source.refuse("E_NO_DATA", "no array of numbers", "save the channels as arrays")
    return columns, single, worded
