"""Parquet."""

from __future__ import annotations

import io
from typing import ClassVar

import numpy as np

from mrdamper.rig_files.file_form import FileForm
from mrdamper.rig_files.readers.arrays import array_table, check_unpacked, damaged, refusing_damage
from mrdamper.rig_files.readers.base import RawTable, Reader, Source

_MAGIC = b"PAR1"


class Parquet(Reader):
    """Tables of columns as polars, pandas, Spark and others write them."""

    name = "parquet"
    title = "Parquet"
    suffixes = (".parquet", ".pq")
    library = "polars"
    _warm: ClassVar[bool] = False

    def warm_up(self) -> None:
        """Start the threads and their allocators."""
        import polars as pl

        if not self._warm:
            content = io.BytesIO()
            pl.DataFrame({"x": [0.0]}).write_parquet(content)
            pl.scan_parquet(content.getvalue()).select(pl.len()).collect()
            pl.read_parquet(content.getvalue())
            Parquet._warm = True

    def recognises(self, source: Source) -> bool:
        """By the mark at the start."""
        return source.head(4) == _MAGIC

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """The one table."""
        import polars as pl

        source.file.seek(max(0, source.size - 4))
        if source.size < 12 or source.file.read(4) != _MAGIC:
            raise damaged(source, self.title, "the file ends early, truncated")
        source.file.seek(0)
        content = source.file.read()
        with refusing_damage(source, self.title):
            schema = pl.read_parquet_schema(content)
            rows = pl.scan_parquet(content).select(pl.len()).collect().item() if len(schema) else 0
        if not rows:
            raise source.refuse("E_NO_DATA", "no rows", mend="export the file again")
        names = list(schema)
        check_unpacked(source, 8 * rows)

        def column_of(column: int) -> np.ndarray:
            return _plain(pl.read_parquet(content, columns=[names[column]], use_statistics=False).to_series())

        units = ["s" if isinstance(kind, (pl.Datetime, pl.Duration)) else "" for kind in schema.values()]
        return [array_table(source, names, units, column_of, title=self.title)]


def _plain(values) -> np.ndarray:
    import polars as pl

    kind = values.dtype
    if kind.is_float():
        return values.cast(pl.Float64).fill_null(float("nan")).to_numpy()
    if kind.is_integer() or kind.is_decimal():
        return values.cast(pl.Float64).fill_null(float("nan")).to_numpy()
    if isinstance(kind, (pl.Datetime, pl.Duration)):
        return values.to_numpy()
    if kind == pl.Object:
        return np.empty(values.len(), dtype=object)
    if kind == pl.Null:
        return np.full(values.len(), np.nan)
    return np.empty(values.len(), dtype=bool if kind == pl.Boolean else "U1")  # no numbers: never asked for by name
