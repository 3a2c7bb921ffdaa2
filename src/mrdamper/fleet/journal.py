"""Journal of a fleet: results are durable before they count.

SQLite, write-ahead log, synchronous FULL: committed rows survive SIGKILL and a power failure, if the disk honours sync.
One writer holds a lock that ends with its process.
"""

from __future__ import annotations

import json
import os
import socket
import sqlite3
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from mrdamper.errors import InputError, OutputError, ResourceError

FORMAT = 2
_APPLICATION = 0x6D726466  # "mrdf"
_NETWORK = (
    "nfs", "cifs", "smb", "afs", "ceph", "gluster", "lustre", "beegfs", "gpfs", "ncp", "9p", "fuse.sshfs", "orangefs",
)  # fmt: skip
_TABLES = """
CREATE TABLE IF NOT EXISTS results (key TEXT PRIMARY KEY, row TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS plans (key TEXT PRIMARY KEY, plan TEXT NOT NULL) WITHOUT ROWID;
"""


class JournalError(InputError):
    """A journal that cannot be used: newer version, damaged, in use, or on a disk without reliable locks."""

    code = "E_JOURNAL"


class Journal:
    """Results by key, durable once `keep` returns.

    The folder holds `journal.sqlite` and its lock, and is made if missing. Raises `OutputError` if it cannot be written
    to, `JournalError`: E_JOURNAL_TAKEN if another process writes to it, E_JOURNAL_NEWER, E_JOURNAL_NETWORK, E_JOURNAL.
    """

    def __init__(self, folder: Path):
        self._path = folder / "journal.sqlite"
        self._base: sqlite3.Connection | None = None
        self._lock = -1
        try:
            folder.mkdir(parents=True, exist_ok=True)
            kind = file_system(folder)
            if kind.startswith(_NETWORK) and kind != "9p":  # a 9p disk may be local: its locks are tested
                raise _untrusted(folder, f"a network file system ({kind})")
            self._lock = _locked(folder / "journal.lock")
        except OSError as error:
            raise OutputError(
                error.strerror or str(error), where=str(folder), remedy="choose another folder"
            ) from error
        try:
            self._open()
        except BaseException:
            self.close()
            raise

    def result(self, key: str) -> dict[str, Any] | None:
        """Return the row stored under a key."""
        return json.loads(self._kept("SELECT row FROM results WHERE key = ?", key) or "null")

    def status(self, key: str) -> str | None:
        """Return the status of that row."""
        return self._kept("SELECT json_extract(row, '$.status') FROM results WHERE key = ?", key)

    def keep(self, rows: Iterable[tuple[str, dict[str, Any]]]) -> None:
        """Make rows durable, all or none of them; raises `ResourceError` (E_DISK_FULL) if the disk is full."""
        self._write("INSERT OR REPLACE INTO results VALUES (?, ?)", [(key, _text(row)) for key, row in rows])

    def plan(self, key: str) -> dict[str, Any] | None:
        """Return the plan stored under a key."""
        return json.loads(self._kept("SELECT plan FROM plans WHERE key = ?", key) or "null")

    def keep_plan(self, key: str, plan: dict[str, Any]) -> None:
        """Make a plan durable; raises as `keep`."""
        self._write("INSERT OR REPLACE INTO plans VALUES (?, ?)", [(key, _text(plan))])

    def close(self) -> None:
        """Release the lock; idempotent."""
        if self._base is not None:
            self._base.close()
            self._base = None
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1

    def _kept(self, query: str, key: str) -> str | None:
        assert self._base is not None
        try:
            kept = self._base.execute(query, (key,)).fetchone()
        except sqlite3.Error as error:
            raise self._refusal(error) from error
        return None if kept is None else kept[0]

    def _open(self) -> None:
        try:
            self._base = base = sqlite3.connect(self._path, isolation_level=None)
            # One connection with exclusive locking: the write-ahead log then needs no shared memory.
            base.execute("PRAGMA locking_mode = EXCLUSIVE")
            version = base.execute("PRAGMA user_version").fetchone()[0]
            if version > FORMAT:
                raise JournalError(
                    f"written by a newer mrdamper (format {version}, this one writes {FORMAT})",
                    where=str(self._path), remedy="update mrdamper, or choose another --out", code="E_JOURNAL_NEWER",
                )  # fmt: skip
            application = base.execute("PRAGMA application_id").fetchone()[0]
            if application not in (0, _APPLICATION):
                raise JournalError(
                    "a database of another program", where=str(self._path), remedy="move the file to another folder"
                )
            if base.execute("PRAGMA journal_mode = WAL").fetchone()[0] != "wal":
                raise JournalError("no write-ahead log here", where=str(self._path), remedy="choose a local disk")
            base.execute("PRAGMA synchronous = FULL")
            base.executescript(_TABLES)
            base.execute(f"PRAGMA application_id = {_APPLICATION}")
            base.execute(f"PRAGMA user_version = {FORMAT}")
        except sqlite3.Error as error:
            raise self._refusal(error) from error

    def _write(self, statement: str, rows: list[tuple[str, str]]) -> None:
        assert self._base is not None
        try:
            self._base.execute("BEGIN IMMEDIATE")
            self._base.executemany(statement, rows)
            self._base.execute("COMMIT")
        except sqlite3.Error as error:
            if self._base.in_transaction:
                self._base.execute("ROLLBACK")
            raise self._refusal(error) from error

    def _refusal(self, error: sqlite3.Error) -> InputError:
        name = getattr(error, "sqlite_errorname", "")
        if name == "SQLITE_FULL" or name.startswith("SQLITE_IOERR_WRITE"):
            return ResourceError(
                "the disk is full", where=str(self._path), code="E_DISK_FULL",
                remedy="make room and run the same command again; what was finished is safe",
            )  # fmt: skip
        if name.startswith(("SQLITE_CANTOPEN", "SQLITE_READONLY", "SQLITE_PERM")):
            return OutputError(str(error), where=str(self._path), remedy="choose a folder you may write to")
        return JournalError(str(error), where=str(self._path), remedy="move the file to another folder and run again")


def _text(document: dict[str, Any]) -> str:
    return json.dumps(document, sort_keys=True, ensure_ascii=False)


def _locked(path: Path) -> int:
    """Descriptor of the lock file, held until it is closed or this process ends."""
    import fcntl

    lock = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        owner = os.pread(lock, 200, 0).decode(errors="replace").strip() or "another process"
        os.close(lock)
        raise JournalError(
            f"in use by {owner}", where=str(path.parent), code="E_JOURNAL_TAKEN",
            remedy="wait until it ends, or choose another --out",
        ) from error  # fmt: skip
    second = os.open(path, os.O_RDWR)
    try:
        fcntl.flock(second, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        pass
    else:
        os.close(lock)
        raise _untrusted(path.parent, "locks are granted twice")
    finally:
        os.close(second)
    os.ftruncate(lock, 0)
    os.pwrite(lock, f"process {os.getpid()} on {socket.gethostname()}\n".encode(), 0)
    return lock


def _untrusted(folder: Path, why: str) -> JournalError:
    return JournalError(
        f"{why}: its locks cannot be trusted", where=str(folder), code="E_JOURNAL_NETWORK",
        remedy="choose an --out on a local disk and copy the results",
    )  # fmt: skip


def file_system(folder: Path, mounts: Path = Path("/proc/self/mountinfo")) -> str:
    """Type of the file system of a folder, as the system names it; empty if unknown."""
    try:
        lines = mounts.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    place, best = folder.resolve(), ("", "")
    for line in lines:
        before, _, after = line.partition(" - ")
        point = before.split()[4].encode().decode("unicode_escape")
        if place.is_relative_to(point) and len(point) >= len(best[0]):
            best = (point, after.split()[0])
    return best[1]
