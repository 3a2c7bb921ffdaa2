"""`mrdamper doctor`: the state of the installation; `mrdamper cache`: compiled programs on disk."""

from __future__ import annotations

import json
import platform
import time
import warnings
from functools import partial
from importlib.metadata import version
from timeit import repeat
from typing import Any

import typer

app = typer.Typer()


@app.command(epilog="Example: mrdamper doctor")
def doctor(as_json: bool = typer.Option(False, "--json", help="Print JSON.")) -> None:
    """Show versions, the C compiler in use and what it gains.

    Integrated models (Spencer, LuGre), play and bypass, and simulated systems are compiled with the C compiler of
    this machine. Without one they run in the interpreter, more slowly, with the same results.
    """
    facts = _facts()
    if as_json:
        print(json.dumps(facts, indent=1))
        return
    for name, value in facts.items():
        print(f"{name.replace('_', ' '):24} {value}")
    if not facts["compiled"]:
        print(
            "remedy: install a C compiler (gcc, clang, Visual C++), or pip install 'mrdamper[compiler]';\n"
            "  after a repair: mrdamper cache --clear"
        )


@app.command(epilog="Example: mrdamper cache --clear")
def cache(
    clear: bool = typer.Option(False, "--clear", help="Remove all compiled programs."),
    as_json: bool = typer.Option(False, "--json", help="Print JSON."),
) -> None:
    """Show or remove the compiled programs kept on disk."""
    from mrdamper.tracing.compiled.cache import cache_folder, cache_size, clear_cache

    removed = clear_cache() if clear else 0
    count, size = cache_size()
    if as_json:
        print(json.dumps({"folder": str(cache_folder()), "programs": count, "bytes": size, "removed": removed}))
        return
    print(f"{cache_folder()}: {count} compiled programs, {size / 1e6:.1f} MB")
    if clear:
        print(f"removed {removed}")


def _facts() -> dict[str, Any]:
    from mrdamper.tracing.compiled.cache import cache_folder, cache_size, private, unusable_reason
    from mrdamper.tracing.compiled.compilers import find_compiler

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the reason is printed below
        gain = _gain()
    compiler, folder = find_compiler(), cache_folder()
    count, size = cache_size()
    return {
        "mrdamper": version("mrdamper"),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "compiler": compiler.title if compiler else "none",
        "compiled": gain is not None,
        "reason": "" if gain is not None else unusable_reason(),
        "gain": f"{gain:.0f} times faster, Spencer's model along a record" if gain is not None else "",
        "cache": str(folder),
        "cache_is_private": private(folder),
        "compiled_programs": count,
        "cache_bytes": size,
    }


def _gain() -> float | None:
    """Measure how many times faster an integrated model runs compiled; None without a usable compiler."""
    import numpy as np

    from mrdamper.dampers.causal import trace
    from mrdamper.dampers.joint import damper_of
    from mrdamper.models.spencer import Spencer
    from mrdamper.tracing.compiled import RecordProgram

    model = Spencer(c1=1e4, c0_ratio=0.1, k0_rate=1.0, creep=0.01, yield_displacement=1e-4)
    record = RecordProgram(trace(damper_of(model)))
    given = record.program.given
    derived = record.prepare(given) or ()
    turns = np.linspace(0.0, 30.0, 1500)
    motion = (0.01 * np.sin(turns), 0.06 * np.cos(turns), -0.36 * np.sin(turns), np.zeros(1500), np.full(1500, 2e-3))
    if record.compiled_along(given, derived, record.starts, motion) is None:
        return None
    interpreted, compiled = (
        min(repeat(partial(run, given, derived, record.starts, motion), timer=time.process_time, repeat=3, number=1))
        for run in (record.interpreted_along, record.compiled_along)
    )
    return interpreted / max(compiled, 1e-9)
