"""The temporary folder of a bench, and those of benches that were killed and could not remove theirs."""

from __future__ import annotations

import os
import re
import shutil
import stat
import tempfile
from pathlib import Path

_PREFIX = "mrdamper-bench-"
_OURS = re.compile(rf"{_PREFIX}(\d+)-\w+")


def bench_folder() -> Path:
    """Make the folder of this process, after removing those of this user's processes that are gone."""
    for path in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*"):
        found = _OURS.fullmatch(path.name)
        if found and _is_mine(path) and not _runs(int(found[1])):
            shutil.rmtree(path, ignore_errors=True)
    return Path(tempfile.mkdtemp(prefix=f"{_PREFIX}{os.getpid()}-"))


def _is_mine(path: Path) -> bool:
    if os.name != "posix":  # without process ids that can be asked for, nothing is removed
        return False
    try:
        status = path.lstat()
    except FileNotFoundError:  # its own bench, or another that sweeps, was faster
        return False
    return stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid()


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (PermissionError, OverflowError):
        pass  # another user's, or no number of a process: not ours to judge
    return True
