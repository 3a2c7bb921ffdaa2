"""Compilers of this machine, and shared libraries from them."""

from __future__ import annotations

import importlib.util
import platform
import shutil
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mrdamper.data.temporary import temporary_folder
from mrdamper.tracing.compiled.compilers import Built, compiled_file

# Results are those of the Python stepper to the last bit: no contraction, no unsafe mathematics.
_EXACT = ("-std=c99", "-O2", "-ffp-contract=off")
FLAGS = (*_EXACT, "-fvisibility=hidden", "-fPIC", "-shared")
_WEB = (*_EXACT, "-target", "wasm32-wasi", "-mexec-model=reactor", "-Wl,--no-entry", "-s")
_BUILD_TIMEOUT_S = 600  # s; a cross compiler builds its C library at the first use


@dataclass(frozen=True)
class Platform:
    """A platform of a binary in an FMU."""

    name: str  # name in FMI 3.0
    fmi2: str  # name in FMI 2.0; empty if it has none
    suffix: str  # of its shared libraries
    target: str  # name in zig


PLATFORMS = (
    Platform("x86_64-linux", "linux64", ".so", "x86_64-linux-gnu.2.17"),
    Platform("aarch64-linux", "", ".so", "aarch64-linux-gnu.2.17"),
    Platform("x86_64-windows", "win64", ".dll", "x86_64-windows-gnu"),
    Platform("x86_64-darwin", "darwin64", ".dylib", "x86_64-macos"),
    Platform("aarch64-darwin", "", ".dylib", "aarch64-macos"),
)


def here() -> Platform | None:
    """Return the platform of this machine, if FMI names it."""
    machine = {"amd64": "x86_64", "x86_64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}
    name = f"{machine.get(platform.machine().lower(), '')}-{platform.system().lower()}"
    return next((p for p in PLATFORMS if p.name == name), None)


def compiler_for(wanted: Platform) -> tuple[str, ...]:
    """Return the command that compiles for a platform: that of the system, else zig (ziglang); empty without one."""
    if wanted == here() and wanted.suffix != ".dll":
        compilers = (path for name in ("cc", "gcc", "clang") if (path := shutil.which(name)))
        if path := next(compilers, None):
            return (path,)
    if importlib.util.find_spec("ziglang"):
        return (sys.executable, "-m", "ziglang", "cc", "-target", wanted.target)
    return ()


def build_library(sources: Mapping[str, bytes], wanted: Platform, compiler: Sequence[str] | None = None) -> Built:
    """Compile C sources, by file name, into a shared library; by default with a compiler found on this machine."""
    command = tuple(compiler) if compiler is not None else compiler_for(wanted)
    if not command:
        return Built(None, "no compiler for it; pip install ziglang")
    # Without symbols, debug data and build paths the same sources give the same bytes.
    strip = () if wanted.suffix == ".dylib" and "ziglang" not in command else ("-s",)
    maths = () if wanted.suffix == ".dll" else ("-lm",)
    return _built(sources, [*command, *FLAGS, *strip], maths)


def build_webassembly(sources: Mapping[str, bytes]) -> Built:
    """Compile C sources to a WebAssembly module without imports, with zig, which has a C library for it."""
    if not importlib.util.find_spec("ziglang"):
        return Built(None, "no compiler for it; pip install ziglang")
    return _built(sources, [sys.executable, "-m", "ziglang", "cc", *_WEB], ())


def _built(sources: Mapping[str, bytes], command: Sequence[str], libraries: Sequence[str]) -> Built:
    with temporary_folder() as folder:
        for name, text in sources.items():
            (folder / name).write_bytes(text)
        files = sorted(name for name in sources if name.endswith(".c"))
        return compiled_file([*command, *files, "-o", "library", *libraries], folder, "library", _BUILD_TIMEOUT_S)
