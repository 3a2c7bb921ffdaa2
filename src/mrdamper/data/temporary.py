"""Temporary folders, locked while their process runs, and removed later if it was killed."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path

_PREFIX, _SUFFIX = "mrdamper-", ".scratch"


@contextmanager
def temporary_folder(parent: Path | None = None, prefix: str = _PREFIX, suffix: str = _SUFFIX) -> Generator[Path]:
    """Give a new folder that is removed after the block; those of its kind whose process was killed are removed before.

    It is made in the system's folder for temporary files, unless another is given; prefix and suffix are those of the
    names of the kind.
    """
    parent = Path(tempfile.gettempdir()) if parent is None else parent
    _sweep(parent, prefix, suffix)
    folder, lock = _locked(parent, prefix, suffix)
    try:
        yield folder
    finally:
        if lock is not None:
            os.close(lock)  # first: listing a folder needs a descriptor, and this may be the last one
        shutil.rmtree(folder, ignore_errors=True)
        with suppress(OSError):
            folder.rmdir()  # takes none


def without_temporary_folder(path: str) -> str:
    """Return a path from behind such a folder on, as that of a file of an archive that is unpacked there."""
    return re.sub(rf"^.*[/\\]{_PREFIX}[^/\\]*\{_SUFFIX}[/\\]", "", path)


def _locked(parent: Path, prefix: str, suffix: str) -> tuple[Path, int | None]:
    while True:
        folder = Path(tempfile.mkdtemp(prefix=prefix, suffix=suffix, dir=parent))
        lock = _lock(folder)
        if folder.exists():  # otherwise another process removed it before it was locked
            return folder, lock


def _lock(folder: Path) -> int | None:
    """Open a lock on a folder; None if another process has one, or the system provides none."""
    if os.name != "posix":
        return None
    import fcntl

    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except OSError:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        return None
    return descriptor


def _sweep(parent: Path, prefix: str, suffix: str) -> None:
    with os.scandir(parent) as entries:
        left = [e.path for e in entries if e.name.startswith(prefix) and e.name.endswith(suffix)]
    for path in left:
        lock = _lock(Path(path))
        if lock is not None:
            shutil.rmtree(path, ignore_errors=True)
            os.close(lock)
