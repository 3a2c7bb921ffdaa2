"""The command line: argument parsing only; the work is done by `workflow`.

Exit status: 0 done, 2 the user's input (one line says what, where and how to mend it),
1 our fault.
"""

from __future__ import annotations

import importlib
import os
import pkgutil
import sys
import traceback

import typer

from mrdamper.cli import commands
from mrdamper.errors import InputError


def main() -> None:
    """Run the command line."""
    # One thread for linear algebra: the matrices here are small, and the same bits come out
    # whatever the number of cores.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    try:
        application()(prog_name="mrdamper")
    except InputError as error:
        print(f"mrdamper: {error}", file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:
        sys.exit(0)
    except Exception:
        traceback.print_exc()
        print("mrdamper: this is our fault, not yours; please report the lines above", file=sys.stderr)
        sys.exit(1)


def application() -> typer.Typer:
    """The commands: every module in `commands` adds its own."""
    app = typer.Typer(
        name="mrdamper",
        help="From magnetorheological damper test records to a validated model.",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
    )
    app.callback()(_version)
    for module in sorted(pkgutil.iter_modules(commands.__path__), key=lambda m: m.name):
        importlib.import_module(f"{commands.__name__}.{module.name}").register(app)
    return app


def _version(
    version: bool = typer.Option(False, "--version", help="Show the version and stop.", is_eager=True),
) -> None:
    if version:
        from importlib.metadata import version as installed

        print(f"mrdamper {installed('mrdamper')}")
        raise typer.Exit()
