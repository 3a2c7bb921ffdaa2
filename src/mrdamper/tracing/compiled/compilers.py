"""The C compiler of this machine."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path

SCRATCH = ".mrdamper-compiling-"  # prefix of folders for compilation
VARIABLE = "MRDAMPER_COMPILER"  # a command, or "none": no compiler is used
_NAMES = ("cc", "gcc", "clang", "cl")
# No contraction and no unsafe mathematics: the same numbers as the interpreter's, on every processor.
_FLAGS = ("-std=c99", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fvisibility=hidden", "-fPIC", "-shared", "-w")
_VISUAL = ("/nologo", "/O2", "/fp:precise", "/LD", "/w")
_COMPILE_TIMEOUT_S = 60.0  # s, after which a compiler is stopped


@dataclass(frozen=True)
class Built:
    """A library, or why there is none."""

    library: bytes | None
    reason: str = ""


@dataclass(frozen=True)
class Compiler:
    """A command that compiles C for this machine."""

    command: tuple[str, ...]
    identity: str  # changes with the program of the command and its flags

    @property
    def is_visual(self) -> bool:
        """True if it takes the options of Microsoft's compiler."""
        return Path(self.command[0]).stem.lower() == "cl"

    @property
    def title(self) -> str:
        """The command as it is typed."""
        return " ".join(self.command)

    def compile(self, source: str, parent: Path | None = None) -> Built:
        """Make a shared library of one source in a folder beneath `parent`."""
        with tempfile.TemporaryDirectory(prefix=SCRATCH, dir=parent, ignore_cleanup_errors=True) as name:
            folder = Path(name)
            (folder / "program.c").write_text(source, encoding="utf-8")
            if self.is_visual:
                command = [*self.command, *_VISUAL, "program.c", "/Fe:program.lib.dll"]
                return compiled_file(command, folder, "program.lib.dll", _COMPILE_TIMEOUT_S)
            maths = () if sys.platform == "win32" else ("-lm",)
            command = [*self.command, *_FLAGS, "program.c", "-o", "program.lib", *maths]
            return compiled_file(command, folder, "program.lib", _COMPILE_TIMEOUT_S)


def find_compiler() -> Compiler | None:
    """Find the compiler of the environment variable, the system's, or zig (`pip install ziglang`); None without one."""
    return _found(os.environ.get(VARIABLE, "").strip(), os.environ.get("PATH", ""))


@cache
def _found(wanted: str, path: str) -> Compiler | None:
    if wanted.lower() == "none":
        return None
    for name in (wanted,) if wanted else _NAMES:
        if place := shutil.which(name, path=path or None):
            return Compiler((place,), _identity((place,), Path(place)))
    zig = importlib.util.find_spec("ziglang") if wanted in ("", "zig") else None
    if zig is None or zig.origin is None:
        return None
    command = (sys.executable, "-m", "ziglang", "cc")
    return Compiler(command, _identity(command[1:], Path(zig.origin)))


def _identity(command: Sequence[str], program: Path) -> str:
    """Hash of the command, its flags, the machine, and the size and time of its program."""
    try:
        resolved = program.resolve()
        facts = (str(resolved), resolved.stat().st_size, resolved.stat().st_mtime_ns)
    except OSError:
        facts = (str(program), 0, 0)
    parts = (*command, *_FLAGS, *_VISUAL, platform.machine(), sys.platform, *facts)
    return hashlib.sha256("\0".join(map(str, parts)).encode()).hexdigest()[:16]


def compiled_file(command: Sequence[str], folder: Path, output: str, patience: float) -> Built:
    """Run a compiler in a folder that holds its sources, for at most `patience` [s]; return its output or the error.

    Messages of the compiler are written to a file, because a process that it leaves could keep a pipe open.
    """
    printed = folder / "printed.txt"
    try:
        with printed.open("wb") as log:
            process = subprocess.Popen(
                command, cwd=folder, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True
            )
            try:
                status = process.wait(patience)
            except BaseException as error:
                _end(process)
                if not isinstance(error, subprocess.TimeoutExpired):
                    raise
                return Built(None, f"the compiler did not end within {patience:g} s")
        library = folder / output
        if status or not library.is_file():
            return Built(None, _first_error(printed.read_text(encoding="utf-8", errors="replace")))
        return Built(library.read_bytes())
    except OSError as error:
        return Built(None, str(error).splitlines()[0])


def _end(process: subprocess.Popen[bytes]) -> None:
    """Kill a compiler with all processes it has started."""
    with suppress(OSError):
        if os.name == "posix":
            os.killpg(process.pid, signal.SIGKILL)
    process.kill()
    process.wait()


def _first_error(text: str) -> str:
    lines = text.strip().splitlines() or ["the compiler failed"]
    return next((line for line in lines if "error" in line.lower()), lines[0])
