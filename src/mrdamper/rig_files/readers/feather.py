"""Feather and Arrow files, by polars."""

from __future__ import annotations

import io

from mrdamper.rig_files.file_form import FileForm
from mrdamper.rig_files.readers.arrays import damaged, refusing_damage
from mrdamper.rig_files.readers.base import RawTable, Reader, Source
from mrdamper.rig_files.readers.parquet import Parquet, frame_table

_MAGIC = b"ARROW1"


class Feather(Reader):
    """Tables of columns as pandas, R and others hand them on."""

    name = "feather"
    title = "Feather"
    suffixes = (".feather", ".arrow", ".ipc")
    library = "polars"

    def warm_up(self) -> None:
        """Start the threads and their allocators."""
        Parquet().warm_up()

    def recognises(self, source: Source) -> bool:
        """By the mark at the start."""
        return source.head(6) == _MAGIC

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """The one table."""
        import polars as pl

        source.file.seek(max(0, source.size - 6))
        if source.size < 24 or source.file.read(6) != _MAGIC:
            raise damaged(source, self.title, "the file ends early, truncated")
        source.file.seek(0)
        content = source.file.read()
        with refusing_damage(source, self.title):
            schema = pl.read_ipc_schema(io.BytesIO(content))
            rows = pl.scan_ipc(io.BytesIO(content)).select(pl.len()).collect().item() if len(schema) else 0

        def loaded(name: str) -> pl.Series:
            return pl.read_ipc(io.BytesIO(content), columns=[name])[name]

        return [frame_table(source, self.title, schema, rows, loaded)]
