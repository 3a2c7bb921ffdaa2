"""Atomic writing of files and folders, also if the process is killed.

A result is written and synced in a hidden folder beside its destination, named `.NAME.….partial` and locked by its
process, and moved by one rename or exchange. Leftovers of a killed process are not locked and are removed when the same
destination is written next.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import json
import os
import shutil
import sys
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

from mrdamper.data.temporary import temporary_folder
from mrdamper.errors import OutputError, is_a, resource_error, shown

MADE = "made.json"  # files of a result in a folder, and computing times
_MAX_NAME_BYTES = 255  # bytes, of a file or folder
_MAX_FOREIGN_FILES = 200  # foreign files of a folder that are carried over into its successor
_REMEDY = "choose a folder you may write to"


@dataclass(frozen=True)
class ResultRecord:
    """Contents of `made.json`: the kind of a result, its files and its computing times."""

    kind: str = ""  # name of the command that writes such results: study, compare, plan, ...
    files: tuple[str, ...] = ()  # paths relative to the folder, sorted
    # durations [s] by computation, or by rig and model
    seconds: Mapping[str, float | Mapping[str, float]] = field(default_factory=dict[str, float])
    processes: int | None = None


def path_of(path: str | os.PathLike[str]) -> Path:
    """Convert a path of the user; raises `OutputError` (E_PATH) if it is none."""
    if is_a(path, (str, os.PathLike)):
        with contextlib.suppress(UnicodeEncodeError):
            parts = os.fsencode(path).split(os.sep.encode())
            if b"\0" not in os.fsencode(path) and max(map(len, parts)) <= _MAX_NAME_BYTES:
                return Path(path)
    raise OutputError(f"{shown(path)} is no path", remedy="give the name of a file or folder", code="E_PATH")


@contextmanager
def write_folder(folder: str | Path, *, replace: bool = False) -> Generator[Path]:
    """Give a temporary folder that takes the final name when the block ends without an error.

    An existing folder is replaced only if it is empty or on request: its other files then move into the new one. Raises
    `OutputError` if the folder exists and is not empty, or cannot be made.
    """
    if replace:
        with write_into(folder) as work:
            yield work
        return
    final = path_of(folder)
    require_free(final)
    with _beside(final) as work:
        yield work
        _sync(work)
        require_free(final)
        work.replace(final)
        _sync_entry(final.absolute().parent)


@contextmanager
def write_into(folder: str | Path) -> Generator[Path]:
    """Give a temporary folder whose files move into `folder`, beside others, in one step; raises `OutputError`."""
    final = path_of(folder)
    with _beside(final) as work:
        yield work
        _sync(work)
        _put(work, final, frozenset())


@contextmanager
def write_result(folder: str | Path, record: ResultRecord | None = None) -> Generator[Path]:
    """Give a temporary folder whose files replace an earlier result in one step when the block ends.

    Further files of the earlier result are removed; other files stay. `made.json` lists the files of a result, and
    holds the kind, durations and processes of a record. Raises `OutputError` if the folder cannot be made or written
    to, or holds other files and no earlier result of the kind.
    """
    final, record = Path(folder), record or ResultRecord()
    require_free(final, record.kind)
    with _beside(final) as work:
        yield work
        files = tuple(sorted(p.relative_to(work).as_posix() for p in work.rglob("*") if p.is_file()))
        contents = asdict(replace(record, files=files))
        (work / MADE).write_text(json.dumps(contents, indent=1) + "\n", encoding="utf-8")
        _sync(work)
        earlier = _earlier(final)
        _put(work, final, frozenset(earlier.files if earlier else ()))


def publish(folder: str | Path, files: Mapping[str, str | bytes], record: ResultRecord | None = None) -> list[Path]:
    """Write a result, given by the contents of its files, as `write_result` does; return the paths, the page first."""
    with write_result(folder, record) as work:
        for name, content in files.items():
            (work / name).parent.mkdir(exist_ok=True)
            (work / name).write_bytes(content.encode() if isinstance(content, str) else content)
    page, *others = map(Path, files)
    return [Path(folder) / p for p in (page, *sorted(others, key=lambda p: (len(p.parts), str(p))))]


@contextmanager
def write_file(path: str | Path) -> Generator[Path]:
    """Give a temporary path that takes the final name when the block ends without an error; raises `OutputError`."""
    final = Path(path).resolve() if Path(path).is_symlink() else Path(path)
    if final.is_dir():
        raise OutputError("is a folder", where=str(final), remedy="give a file name")
    if final.exists() and not final.is_file():  # a device or a pipe: nothing to replace
        with _coded(final), temporary_folder() as folder:
            yield folder / final.name
            final.write_bytes((folder / final.name).read_bytes())
        return
    with _beside(final) as work:
        inner = work / final.name
        yield inner
        _sync(work)
        inner.replace(final)
        _sync_entry(final.absolute().parent)


def require_writable(path: str | Path | None, result: str | None = None, *, makes_folders: bool = True) -> None:
    """Raise `OutputError`, before work begins, for a path that cannot be written to; None is no path.

    A folder for a kind of result must be free for it, as `require_free` decides. Missing folders above it are made, or
    else refused.
    """
    if path is not None and result is not None:
        require_free(path, result)
    if path is None or ((final := Path(path)).exists() and not final.is_dir() and not final.is_file()):
        return
    if not makes_folders and not final.absolute().parent.exists():
        raise OutputError("no such folder", where=str(final.parent), remedy="make it, or correct the path")
    with _beside(final) as work:
        (work / "tried").write_bytes(b"\0")
    if final.exists() and not os.access(final, os.W_OK):
        raise OutputError("not writable", where=str(final), remedy=_REMEDY)


def require_free(path: str | Path, kind: str | None = None, hint: str = "") -> None:
    """Raise `OutputError` for a folder that is not empty, unless it holds an earlier result of a kind; or for a file.

    A `hint` is appended to the remedy.
    """
    final = Path(path)
    with _coded(final):
        if not final.exists() or (final.is_dir() and not any(final.iterdir())):
            return
    earlier = _earlier(final)
    if earlier is None or earlier.kind != kind:
        other = f", a result of mrdamper {earlier.kind}" if earlier and earlier.kind else ""
        remedy = f"choose another name or remove it{hint}"
        raise OutputError(f"exists already and is not empty{other}", where=str(final), remedy=remedy)


@contextmanager
def _beside(final: Path) -> Generator[Path]:
    """Give a scratch folder on the same file system, so that a rename suffices."""
    parent = final.absolute().parent
    with _coded(final):
        parent.mkdir(parents=True, exist_ok=True)
        with temporary_folder(parent, f".{final.name[:40]}.", ".partial") as work:
            umask = os.umask(0)
            os.umask(umask)
            work.chmod(0o777 & ~umask)
            if final.is_dir():
                with contextlib.suppress(OSError):
                    shutil.copymode(final, work)
            yield work


@contextmanager
def _coded(final: Path) -> Generator[None]:
    """Convert errors of the system on writing to errors with a code; others pass."""
    try:
        yield
    except OSError as error:
        typed = resource_error(error, str(final))
        if typed is not None:
            raise typed from error
        place = final.absolute().parent
        names = [os.fsdecode(name) for name in (error.filename, error.filename2) if isinstance(name, str | bytes)]
        if any(Path(name).absolute().is_relative_to(place) for name in names):
            raise OutputError(error.strerror or str(error), where=str(final), remedy=_REMEDY) from error
        raise


def _earlier(final: Path) -> ResultRecord | None:
    """Kind and files of the present result, if any."""
    if not (final / MADE).is_file():  # nothing, or a file without an end
        return None
    try:
        contents = json.loads((final / MADE).read_text(encoding="utf-8"))
        return ResultRecord(contents.get("kind", ""), (MADE, *(str(name) for name in contents["files"])))
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None


def _put(work: Path, final: Path, stale: frozenset[str]) -> None:
    """Move the finished folder to its destination: by a rename, by an exchange, or file by file."""
    final = final.absolute()
    if not final.exists():
        try:
            work.rename(final)
            return _sync_entry(final.parent)
        except OSError:
            if not final.is_dir():  # else another process was first
                raise
    if not final.is_dir():
        raise OutputError("is no folder", where=str(final), remedy=_REMEDY)
    final = final.resolve()
    if _carried(final, work, stale) and _exchange(work, final):
        _sync_entry(final.parent)
        _carried(work, final, stale)  # files that were added in between
        return None
    return _move(work, final, stale)


def _carried(old: Path, new: Path, stale: frozenset[str]) -> bool:
    """Link other files into the new folder; False if there are too many, or folders."""
    if old == Path.cwd() or old in Path.cwd().parents or os.path.ismount(old):
        return False
    foreign: list[Path] = []
    for folder, folders, files in os.walk(old):
        here = Path(folder).relative_to(old)
        names = [here / name for name in files]
        foreign += [p for p in names if p.as_posix() not in stale and not os.path.lexists(new / p)]
        if len(foreign) > _MAX_FOREIGN_FILES or any((old / here / name).is_symlink() for name in folders):
            return False
        if not names and not folders and str(here) != "." and not (new / here).exists():
            foreign.append(here)
    try:
        for path in foreign:
            (new / path).parent.mkdir(parents=True, exist_ok=True)
            if (old / path).is_dir():
                (new / path).mkdir(exist_ok=True)
            else:
                os.link(old / path, new / path, follow_symlinks=False)
    except OSError:
        return False
    return True


def _exchange(one: Path, other: Path) -> bool:
    """Swap two folders in one step, where the system can."""
    if sys.platform != "linux":
        return False
    with contextlib.suppress(OSError, AttributeError):
        here, swap = -100, 2  # AT_FDCWD, RENAME_EXCHANGE
        return ctypes.CDLL(None).renameat2(here, os.fsencode(one), here, os.fsencode(other), swap) == 0
    return False


def _move(work: Path, final: Path, stale: frozenset[str]) -> None:
    """Move file by file, the page last, for a folder that must keep its identity."""
    moved = sorted((p.relative_to(work) for p in work.rglob("*") if p.is_file()), key=lambda p: -len(p.parts))
    for path in moved:
        (final / path).parent.mkdir(parents=True, exist_ok=True)
        (work / path).replace(final / path)
    for name in stale - {path.as_posix() for path in moved}:
        inside = final / name
        if ".." not in Path(name).parts and not Path(name).is_absolute():
            inside.unlink(missing_ok=True)
    _sync_entry(final)


def _sync(folder: Path) -> None:
    """Sync a folder and its contents to disk."""
    for path in [*folder.rglob("*"), folder]:
        if path.is_file() and not path.is_symlink():
            with path.open("rb") as file:
                os.fsync(file.fileno())
        elif path.is_dir():
            _sync_entry(path)


def _sync_entry(folder: Path) -> None:
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP, errno.EBADF):  # file systems that know none for folders
            raise
    finally:
        os.close(descriptor)
