"""The C compiler of this machine for programs that run here, and what is known of it."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from mrdamper.data.temporary import temporary_folder
from mrdamper.tracing.compiled.toolchain import Built, compiled_file

VARIABLE = "MRDAMPER_COMPILER"  # a command, or "none": no compiler is used
_NAMES = ("cc", "gcc", "clang", "cl")
# No contraction and no unsafe mathematics: the same numbers as the interpreter's, on every processor.
_FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-fvisibility=hidden", "-fPIC", "-shared", "-w")
_VISUAL = ("/nologo", "/O2", "/fp:precise", "/LD", "/w")
_PATIENCE = 60.0  # s, after which a compiler is given up


@dataclass(frozen=True)
class Compiler:
    """A command that compiles C for this machine.

    Attributes
    ----------
    command : tuple of str
    identity : str
        Changes when the program behind the command, or its flags, are replaced.
    """

    command: tuple[str, ...]
    identity: str

    @property
    def is_visual(self) -> bool:
        """Whether it takes the options of Microsoft's compiler."""
        return Path(self.command[0]).stem.lower() == "cl"

    @property
    def title(self) -> str:
        """The command as it is typed."""
        return " ".join(self.command)

    def compile(self, source: str, patience: float = _PATIENCE) -> Built:
        """A shared library made of one source; gives up after `patience` [s]."""
        with temporary_folder() as folder:
            (folder / "program.c").write_text(source, encoding="utf-8")
            if self.is_visual:
                command = [*self.command, *_VISUAL, "program.c", "/Fe:program.lib.dll"]
                return compiled_file(command, folder, "program.lib.dll", patience)
            maths = () if sys.platform == "win32" else ("-lm",)
            command = [*self.command, *_FLAGS, "program.c", "-o", "program.lib", *maths]
            return compiled_file(command, folder, "program.lib", patience)


def find_compiler() -> Compiler | None:
    """The compiler the environment variable names, the system's, or zig (`pip install ziglang`); None without one."""
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
    """Hash of the command, its flags, the machine, and the size and time of the program behind it."""
    try:
        found = program.resolve()
        facts = (str(found), found.stat().st_size, found.stat().st_mtime_ns)
    except OSError:
        facts = (str(program), 0, 0)
    known = (*command, *_FLAGS, *_VISUAL, platform.machine(), sys.platform, *facts)
    return hashlib.sha256("\0".join(map(str, known)).encode()).hexdigest()[:16]
