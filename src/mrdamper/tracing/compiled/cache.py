"""Compiled libraries in the user's cache: published atomically, verified when loaded, limited in size.

The file name of a library contains the hash of its source, compiler and flags, and the hash of the file itself. A
folder that others can write to is not used; what cannot be cached is compiled for this process alone.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import shutil
import stat
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from mrdamper.tracing.compiled.compilers import SCRATCH, Compiler, find_compiler

FOLDER = "MRDAMPER_CACHE"  # environment variable: where compiled libraries are kept
_SUFFIX = ".lib"
_MAX_CACHE_BYTES = 64 * 2**20  # bytes of all libraries
_DAY = 86_400.0  # s
_GIVEN_UP = 3_600.0  # s for which a failed compiler is not tried again
_KEY = "mrdamper_source"  # name of the constant with the source of a library

_loaded: dict[tuple[str, str], ctypes.CDLL] = {}  # by compiler and source
_unusable: dict[str, str] = {}  # by compiler: why it is not used in this process


class CompilerWarning(UserWarning):
    """Models run in the interpreter, or are compiled anew in every process; results are the same."""


def cache_folder() -> Path:
    """Return the folder of compiled libraries."""
    if given := os.environ.get(FOLDER, ""):
        return Path(given)
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "mrdamper" / "compiled"


def load(source: str, holds: Callable[[ctypes.CDLL], bool]) -> ctypes.CDLL | None:
    """Load the library of a C source, compiled when it is not in the cache; None without a usable compiler.

    `holds`: whether a new library computes correct results.
    """
    compiler = find_compiler()
    if compiler is None:
        return None
    made_of = (compiler.identity, source)
    if made_of not in _loaded:
        key = hashlib.sha256((compiler.identity + source).encode()).hexdigest()[:32]
        library = _kept(key) or _compiled(compiler, key, source, holds)
        if library is None:
            return None
        _loaded[made_of] = library
    return _loaded[made_of]


def unusable_reason() -> str:
    """Return why the compiler of this machine is not used; empty if it is."""
    compiler = find_compiler()
    if compiler is None:
        return "no C compiler was found"
    return _unusable.get(compiler.identity) or _noted(compiler)


def clear_cache() -> int:
    """Remove all compiled libraries; how many there were."""
    files = [*(path for *_, path in _libraries(cache_folder())), *cache_folder().glob("failed-*.txt")]
    for path in files:
        with suppress(OSError):
            path.unlink()
    _unusable.clear()
    return sum(path.suffix == _SUFFIX for path in files)


def cache_size() -> tuple[int, int]:
    """Return the number of compiled libraries, and their size [bytes]."""
    sizes = [size for _, size, _ in _libraries(cache_folder())]
    return len(sizes), sum(sizes)


def private(folder: Path) -> bool:
    """Tell if a folder belongs to this user, and no other user can write to it."""
    try:
        status = folder.lstat()
    except OSError:
        return False
    if not stat.S_ISDIR(status.st_mode):
        return False
    if os.name != "posix":
        return True
    return status.st_uid == os.getuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _libraries(folder: Path) -> list[tuple[float, int, Path]]:
    """List time of the last use [s], size [bytes] and path of the libraries, the least recently used first."""
    files: list[tuple[float, int, Path]] = []
    for path in folder.glob(f"*-*{_SUFFIX}"):
        with suppress(OSError):
            files.append((path.stat().st_mtime, path.stat().st_size, path))
    return sorted(files)


def _kept(key: str) -> ctypes.CDLL | None:
    """Return the library in the cache, if its file has the hash of its name and this source."""
    folder = cache_folder()
    if not private(folder):
        return None
    for path in folder.glob(f"{key}-*{_SUFFIX}"):
        try:
            content = path.read_bytes()
            if hashlib.sha256(content).hexdigest() == path.stem.partition("-")[2]:
                library = ctypes.CDLL(str(path))
                if _made_of(library) == key:
                    _touch(path)
                    return library
            path.unlink()  # not what was published under this name
        except OSError:
            continue
    return None


def _made_of(library: ctypes.CDLL) -> str:
    try:
        return ctypes.string_at(ctypes.addressof(ctypes.c_char.in_dll(library, _KEY))).decode("ascii", "replace")
    except ValueError:
        return ""


def _touch(path: Path) -> None:
    """Record the use of a library, once per day: the oldest are removed first."""
    with suppress(OSError):
        if time.time() - path.stat().st_mtime > _DAY:
            path.touch()


def _compiled(compiler: Compiler, key: str, source: str, holds: Callable[[ctypes.CDLL], bool]) -> ctypes.CDLL | None:
    if compiler.identity in _unusable:
        return None
    if reason := _noted(compiler):
        return _give_up(compiler, reason, note=False)
    folder = cache_folder()
    built = compiler.compile(f'{source}\nEXPORT const char {_KEY}[] = "{key}";\n', folder if _usable(folder) else None)
    if built.library is None:
        return _give_up(compiler, built.reason)
    library = _tried(built.library, key, holds)
    if library is None:
        return _give_up(compiler, "what it compiled computes something else")
    _publish(built.library, key)
    return library


def _give_up(compiler: Compiler, reason: str, note: bool = True) -> None:
    """Use the interpreter from now on, with one warning."""
    _unusable[compiler.identity] = reason
    warnings.warn(
        f"models are not compiled, {compiler.title}: {reason}; the interpreter gives the same numbers, more slowly",
        CompilerWarning,
        stacklevel=2,
    )
    folder = cache_folder()
    if note and _usable(folder):
        with suppress(OSError):
            (folder / f"failed-{compiler.identity}.txt").write_text(reason, encoding="utf-8")


def _noted(compiler: Compiler) -> str:
    """Return why another process stopped using this compiler within the last hour."""
    path = cache_folder() / f"failed-{compiler.identity}.txt"
    try:
        recent = private(path.parent) and time.time() - path.stat().st_mtime < _GIVEN_UP
        return path.read_text(encoding="utf-8", errors="replace")[:200] if recent else ""
    except OSError:
        return ""


def _tried(content: bytes, key: str, holds: Callable[[ctypes.CDLL], bool]) -> ctypes.CDLL | None:
    """Load a library from a folder of this process, if it computes correct results."""
    with tempfile.TemporaryDirectory(prefix=SCRATCH, ignore_cleanup_errors=True) as folder:
        path = Path(folder) / f"{key}{_SUFFIX}"
        path.write_bytes(content)
        try:
            library = ctypes.CDLL(str(path))
            return library if _made_of(library) == key and holds(library) else None
        except (OSError, AttributeError):
            return None


def _usable(folder: Path) -> bool:
    """Make the folder if there is none; return whether it is private."""
    with suppress(OSError):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    return private(folder)


def _publish(content: bytes, key: str) -> None:
    """Put a library into the cache atomically; a cache that cannot be written to stays unchanged."""
    folder = cache_folder()
    if not _usable(folder):
        if folder.exists():
            warnings.warn(
                f"{folder} is not used, it is not yours alone: chmod 700 it, or set {FOLDER} to a folder of your own",
                CompilerWarning,
                stacklevel=2,
            )
        return
    try:
        handle, name = tempfile.mkstemp(prefix=".", suffix=".partial", dir=folder)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            Path(name).replace(folder / f"{key}-{hashlib.sha256(content).hexdigest()}{_SUFFIX}")
        except BaseException:
            with suppress(OSError):
                Path(name).unlink()
            raise
        _bound(folder)
    except OSError:
        return


def _bound(folder: Path) -> None:
    """Remove the least recently used libraries beyond the allowed size, and leftovers of killed processes."""
    for path in (*folder.glob(".*.partial"), *folder.glob(f"{SCRATCH}*")):
        with suppress(OSError):
            if time.time() - path.stat().st_mtime > _DAY:
                shutil.rmtree(path) if path.is_dir() else path.unlink()
    kept = 0
    for _, size, path in reversed(_libraries(folder)):
        kept += size
        if kept > _MAX_CACHE_BYTES:
            with suppress(OSError):
                path.unlink()
