"""Files and folders that appear whole or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from mrdamper.errors import OutputError


@contextmanager
def write_folder(folder: str | Path) -> Iterator[Path]:
    """Give a temporary folder that takes the final name when the block ends without an error.

    An existing folder is replaced only if it is empty.

    Raises
    ------
    OutputError
        If the folder exists and is not empty, or cannot be made.
    """
    final = Path(folder)
    if final.exists() and (not final.is_dir() or any(final.iterdir())):
        raise OutputError("exists already and is not empty", where=str(final), mend="choose another name or remove it")
    with _temporary_beside(final) as work:
        yield work
        if final.exists():
            final.rmdir()
        work.replace(final)


@contextmanager
def write_into(folder: str | Path) -> Iterator[Path]:
    """Give a temporary folder whose files move into `folder` together when the block ends.

    Files of the same name are replaced; others stay.

    Raises
    ------
    OutputError
        If the folder cannot be made or written to.
    """
    final = Path(folder)
    with _temporary_beside(final) as work:
        yield work
        try:
            for source in sorted(p for p in work.rglob("*") if p.is_file()):
                target = final / source.relative_to(work)
                target.parent.mkdir(parents=True, exist_ok=True)
                source.replace(target)
        except OSError as error:
            raise OutputError(error.strerror or str(error), where=str(final), mend="choose another folder") from error


def publish(folder: str | Path, first: str, fill: Callable[[Path], None]) -> list[Path]:
    """Have `fill` write files that move into a folder together, as `write_into`.

    Parameters
    ----------
    folder : path
    first : str
        Name of the page that comes first in the list.
    fill : callable
        Writes into the temporary folder it is given.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    OutputError
        As `write_into`.
    """
    with write_into(folder) as work:
        fill(work)
        written = [p.relative_to(work) for p in work.rglob("*") if p.is_file()]
    return [Path(folder) / p for p in sorted(written, key=lambda p: (p.name != first, len(p.parts), str(p)))]


@contextmanager
def write_file(path: str | Path) -> Iterator[Path]:
    """Give a temporary path that takes the final name when the block ends without an error.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    final = Path(path)
    if final.is_dir():
        raise OutputError("is a folder", where=str(final), mend="give a file name")
    with _temporary_beside(final) as work:
        inner = work / final.name
        yield inner
        inner.replace(final)


def require_writable(path: str | Path) -> None:
    """Refuse at once what could not be written after minutes of work.

    Raises
    ------
    OutputError
        If the path lies in a place that cannot be written to.
    """
    with _temporary_beside(Path(path)):
        pass
    if Path(path).is_dir() and not os.access(path, os.W_OK):
        raise OutputError("not writable", where=str(path), mend="choose a folder you may write to")


@contextmanager
def _temporary_beside(final: Path) -> Iterator[Path]:
    """Make a scratch folder on the same file system, so that a rename suffices."""
    parent = final.absolute().parent
    try:
        parent.mkdir(parents=True, exist_ok=True)
        work = Path(tempfile.mkdtemp(prefix=f".{final.name}.", dir=parent))
        work.chmod(0o755)
    except OSError as error:
        raise OutputError(
            error.strerror or str(error), where=str(final), mend="choose a folder you may write to"
        ) from error
    try:
        yield work
    finally:
        shutil.rmtree(work, ignore_errors=True)
