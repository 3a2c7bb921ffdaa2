"""The files of folders and archives that may hold tests."""

from __future__ import annotations

import fnmatch
import os
from collections.abc import Iterable
from pathlib import Path

from mrdamper.errors import InputError
from mrdamper.rig_files.packed_folder import is_packed_folder
from mrdamper.rig_files.profile import Profile
from mrdamper.rig_files.readers import raw_tables, suffixes
from mrdamper.rig_files.readers.base import RigFileError
from mrdamper.rig_files.tests_table import NAME as TESTS


def is_left_out(name: str, profile: Profile) -> bool:
    """Return whether the profile leaves out files or tables of this name."""
    return any(fnmatch.fnmatch(name.casefold(), pattern.casefold()) for pattern in profile.file.leave_out)


def files_in(paths: Iterable[Path]) -> tuple[list[Path], list[Path]]:
    """Return the files to be read, and those of the folders that are of other kinds."""
    files: list[Path] = []
    others: list[Path] = []
    for path in paths:
        if not path.is_dir():
            files.append(path)
            continue
        inside = sorted(
            Path(folder) / name
            for folder, _, names in os.walk(path)
            for name in names
            if not name.startswith((".", "~$")) and name != TESTS
        )
        inside = [file for file in inside if file.is_file() and not is_packed_folder(file)]  # no pipes
        recognised = [file for file in inside if file.suffix.lower() in suffixes()]
        recognised = recognised or [
            file for file in inside if _is_table(file)
        ]  # suffixes of a laboratory's own: run.001
        files += recognised
        read = set(recognised)
        others += [file for file in inside if file not in read]
    if not files:
        where = ", ".join(path.name for path in paths)
        problem = f"no rig's file in this folder (found {', '.join(file.name for file in others[:5]) or 'nothing'})"
        remedy = "export them as CSV, or give another folder" if others else "give another folder"
        raise RigFileError("E_NO_DATA", problem, file=where, remedy=remedy)
    return files, others


def _is_table(path: Path) -> bool:
    try:
        with raw_tables(path) as tables:
            return any(table.names for table in tables)
    except InputError:
        return False
