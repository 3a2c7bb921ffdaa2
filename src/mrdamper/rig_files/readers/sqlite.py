"""SQLite databases, as data loggers and scripts write them: a table of the database is read as the text it shows."""

from __future__ import annotations

import sqlite3
from contextlib import closing

from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.arrays import refusing_damage
from mrdamper.rig_files.readers.base import RawTable, Reader, Source
from mrdamper.rig_files.readers.workbook import as_text, chosen_sheets, tables_of_sheets

_OWN = "type = 'table' AND name NOT LIKE 'sqlite\\_%' ESCAPE '\\' AND sql NOT LIKE 'CREATE VIRTUAL%'"
_VERSIONS = slice(18, 20)  # bytes of the header: 2, 2 where changes are written to a log beside the file first


class Sqlite(Reader):
    """Tables of samples, of tests and of channels, which are joined by their numbers as those of several files are."""

    name = "sqlite"
    title = "SQLite database"
    suffixes = (".sqlite", ".sqlite3", ".db", ".db3")
    marks = (b"SQLite format 3\0",)
    library = "sqlite3"
    seconds_per_byte = 5e-6

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """Return one table for each of the database; views and virtual tables are not computed.

        Raises `RigFileError`: E_TRUNCATED if the log beside the file holds rows that it does not contain yet.
        """
        log = source.path.with_name(f"{source.path.name}-wal")
        if log.is_file() and log.stat().st_size:
            problem = f"{log.name} holds rows that are not in the database yet"
            raise source.refuse("E_TRUNCATED", problem, "close the program that writes it, or export it again")
        source.file.seek(0)
        content = bytearray(source.file.read())
        content[_VERSIONS] = b"\1\1"
        sheets = []
        with refusing_damage(source, self.title), closing(sqlite3.connect(":memory:")) as database:
            database.deserialize(bytes(content))
            database.execute("PRAGMA trusted_schema = OFF")
            names = [
                name for (name,) in database.execute(f"SELECT name FROM sqlite_master WHERE {_OWN} ORDER BY rowid")
            ]
            for name in chosen_sheets(source, names, form):
                rows = database.execute('SELECT * FROM "{}"'.format(name.replace('"', '""')))
                heads = [column[0] for column in rows.description]
                cells = (["" if cell is None or isinstance(cell, bytes) else cell for cell in row] for row in rows)
                sheets.append((name, as_text(source, name, (row for part in ([heads], cells) for row in part))))
        return tables_of_sheets(source, sheets, form)
