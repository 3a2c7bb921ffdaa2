"""The command line: argument parsing only; the work is done by `workflow`.

Exit status: 0 done, 2 the user's input or a machine that has run out of something (one line says
what, where and how to mend it), 1 our fault, 128 and the number of the signal that ended it.
"""

from __future__ import annotations

import importlib
import os
import pkgutil
import signal
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, NoReturn

import typer

from mrdamper.cli import commands
from mrdamper.errors import InputError, ResourceError, resource_error

_LEAST_MEMORY = 2 * 2**30  # bytes; a study of the bundled data maps 1.3e9


def main() -> None:
    """Run the command line."""
    # One thread for linear algebra: the matrices here are small, and the same bits come out
    # whatever the number of cores.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    try:
        _require_memory()
        with _ended_by_signals():
            application()(prog_name="mrdamper")
    except BrokenPipeError:
        # Whoever read has gone; nothing more is said, not even by the flush at the end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    except _EndedError as end:
        _say(f"ended by {signal.Signals(end.number).name}; what was not finished is not written")
        sys.exit(128 + end.number)
    except SystemExit:
        raise
    except BaseException as error:  # a panic of a library in Rust is no Exception
        typed = error if isinstance(error, InputError) else resource_error(error)
        if typed is None:
            traceback.print_exc()
            _say("this is our fault, not yours; please report the lines above")
            sys.exit(1)
        _say(str(typed))
        sys.exit(2)


def _require_memory() -> None:
    """Refuse a limit of address space under which the libraries for tables abort, or sleep for ever."""
    try:
        import resource
    except ImportError:
        return  # no such limit on this system
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY and limit < _LEAST_MEMORY and not {"--help", "--version"} & set(sys.argv):
        raise ResourceError(
            f"the limit of address space is {limit / 2**20:.0f} MiB",
            mend=f"raise it to {_LEAST_MEMORY / 2**20:.0f} MiB or more (ulimit -v)",
            code="E_MEMORY",
        )


class _EndedError(BaseException):
    """A signal asked this process to end; `finally` and `with` still clean up."""

    def __init__(self, number: int):
        self.number = number
        super().__init__(number)


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    def end(number: int, frame: FrameType | None) -> NoReturn:
        for known in before:
            signal.signal(known, signal.SIG_IGN)  # a second one would come between the cleaning up
        raise _EndedError(number)

    before: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():
        for name in ("SIGINT", "SIGTERM", "SIGHUP"):
            number = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) is not signal.SIG_IGN:  # as nohup asks
                before[number] = signal.signal(number, end)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _say(text: str) -> None:
    with suppress(OSError):  # the disk that is full may be the one this goes to
        print(f"mrdamper: {text}", file=sys.stderr)


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
    app.callback()(_root)
    for module in sorted(pkgutil.iter_modules(commands.__path__), key=lambda m: m.name):
        importlib.import_module(f"{commands.__name__}.{module.name}").register(app)
    return app


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(f"mrdamper {version('mrdamper')}")
        raise typer.Exit()


def _root(
    version: bool = typer.Option(
        False, "--version", help="Show the version and stop.", is_eager=True, callback=_show_version
    ),
) -> None:
    pass
