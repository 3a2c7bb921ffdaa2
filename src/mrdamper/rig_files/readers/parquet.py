"""Parquet, Feather and Arrow, by polars."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.arrays import array_table, check_unpacked, damaged, refusing_damage
from mrdamper.rig_files.readers.base import RawTable, Reader, Source, Words
from mrdamper.rig_files.readers.nested import nested_tables, object_in, stated_beside
from mrdamper.rig_files.readers.several_tests import MOST_ITEMS

if TYPE_CHECKING:
    import polars as pl


class _Frame(Reader):
    """A file of polars: one table of typed columns, between two marks."""

    library = "polars"
    short: ClassVar[str]  # what polars calls it
    least: ClassVar[int]  # bytes of a whole file
    given: ClassVar[type[bytes | io.BytesIO]]  # how polars is given the content
    options: ClassVar[Mapping[str, bool]] = MappingProxyType({})

    def warm_up(self) -> None:
        """Start the threads and their allocators."""
        _warm()

    def metadata(self, content: bytes) -> Mapping[str, Any]:
        """Return what the file states beside its columns."""
        return {}

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """Return the one table."""
        import polars as pl

        source.file.seek(max(0, source.size - len(self.marks[0])))
        if source.size < self.least or source.file.read(len(self.marks[0])) != self.marks[0]:
            raise damaged(source, self.title, "the file ends early, truncated")
        source.file.seek(0)
        content = source.file.read()
        with refusing_damage(source, self.title):
            scan: pl.LazyFrame = getattr(pl, f"scan_{self.short}")(self.given(content), **self.options)
            schema = scan.collect_schema()
            rows = scan.select(pl.len()).collect().item() if len(schema) else 0
            units, constants, remarks = stated_beside(self.metadata(content))
        lists = [name for name, kind in schema.items() if isinstance(kind, pl.List) and kind.inner.is_numeric()]
        if len(lists) > 1 and rows <= MOST_ITEMS:
            with refusing_damage(source, self.title):
                frame = scan.collect()
                check_unpacked(source, sum(8 * int(frame[name].list.len().sum()) for name in lists))
                tests = [{k: _of_test(frame[k][i]) for k in schema} for i in range(rows)]
            return nested_tables(source, {"": tests}, self.title)
        if not rows:
            raise source.refuse("E_NO_DATA", "no rows", "export the file again")
        check_unpacked(source, 8 * rows)
        return [replace(_table(source, self.title, scan, units), constants=constants, remarks=remarks)]


class Parquet(_Frame):
    """Tables of columns as polars, pandas, Spark and others write them."""

    name = short = "parquet"
    title = "Parquet"
    suffixes = (".parquet", ".pq")
    marks, least, given = (b"PAR1",), 12, bytes
    options = MappingProxyType({"use_statistics": False})

    def metadata(self, content: bytes) -> Mapping[str, Any]:
        """Return the keys of the footer that a user wrote, among them the attributes of a table of pandas."""
        import polars as pl

        stated = pl.read_parquet_metadata(content)
        table = object_in(stated.get("pandas"))
        attributes = table.get("attributes") if isinstance(table, Mapping) else None
        own = {key: text for key, text in stated.items() if key not in ("ARROW:schema", "pandas", "r")}
        return own | ({"attributes": attributes} if isinstance(attributes, Mapping) else {})


class Feather(_Frame):
    """Feather and Arrow files: tables of columns as pandas, R and others hand them on."""

    name, short = "feather", "ipc"
    title = "Feather"
    suffixes = (".feather", ".arrow", ".ipc")
    marks, least, given = (b"ARROW1",), 24, io.BytesIO


@cache
def _warm() -> None:
    import polars as pl

    content = io.BytesIO()
    pl.DataFrame({"x": [0.0]}).write_parquet(content)
    pl.scan_parquet(content.getvalue()).collect()


def _table(source: Source, title: str, scan: pl.LazyFrame, units: Mapping[str, str]) -> RawTable:
    """Return a table of typed columns, each loaded by its name when it is asked for."""
    import polars as pl

    schema = scan.collect_schema()
    names = list(schema)

    def loaded(name: str) -> pl.Series:
        return scan.select(name).collect()[name]

    def column_of(column: int) -> np.ndarray:
        kind = schema[names[column]]
        plain = kind.is_numeric() or isinstance(kind, (pl.Datetime, pl.Duration, pl.Null))
        no_numbers = object if kind == pl.Object else bool if kind == pl.Boolean else "U1"
        return _plain(loaded(names[column])) if plain else np.empty(1, dtype=no_numbers)

    def words(column: int) -> Words:
        if schema[names[column]].is_nested():  # a list may hold anything any number of times
            raise source.refuse("E_NUMBER", f"column {names[column]!r} holds lists", column=column + 1)
        with refusing_damage(source, title):
            return words_in(loaded(names[column]))

    clocks = pl.Datetime, pl.Duration
    given = ["s" if isinstance(kind, clocks) else units.get(name, "") for name, kind in schema.items()]
    return replace(array_table(source, names, given, column_of, title), words=words)


def words_in(values: pl.Series) -> Words:
    """Return the words of a column; a missing one is empty."""
    import polars as pl

    if values.dtype.is_float():
        cells = [f"{cell:g}" if cell is not None else "" for cell in values.unique(maintain_order=True)]
        values = values.replace_strict(values.unique(maintain_order=True), cells, return_dtype=pl.String)
    values = values.cast(pl.String).fill_null("")
    labels = values.unique(maintain_order=True)
    codes = values.replace_strict(labels, pl.int_range(labels.len(), eager=True), return_dtype=pl.Int32)
    return Words(codes.cast(pl.Int32).to_numpy(), tuple(labels.to_list()))  # of no rows they have no kind


def _of_test(value: object) -> object:
    if isinstance(value, (int, float)):
        return float(value)
    return _plain(value) if hasattr(value, "dtype") else str(value)  # type: ignore[arg-type]


def _plain(values: pl.Series) -> np.ndarray:
    import polars as pl

    kind = values.dtype
    if kind.is_numeric() or kind == pl.Null:
        return values.cast(pl.Float64).fill_null(float("nan")).to_numpy()
    return values.to_numpy()
