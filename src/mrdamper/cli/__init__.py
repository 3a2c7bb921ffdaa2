"""The command line: argument parsing only; `study`, `report` and the other packages do the work.

Exit status: 0 done; 2 unusable input or exhausted resources (one line states what was found, where,
and what to do); 1 internal error; 128 plus the signal number where a signal ended the process.
"""

from __future__ import annotations

import gc
import os
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from types import FrameType
from typing import Any, NoReturn

import typer

from mrdamper.cli.help import CommandGroups, OptionGroups
from mrdamper.discovery import PluginWarning, fault_of_package, modules_with, skip
from mrdamper.errors import InputError, ResourceError, resource_error

_MIN_ADDRESS_SPACE = 2 * 2**30  # address space [bytes]; a study of the bundled data maps 1.3e9


def main() -> None:
    """Run the command line."""
    # One thread for linear algebra: the matrices here are small, and the same bits come out
    # for any number of cores.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    gc.set_threshold(50_000)  # what is imported stays; searching it for unused objects takes 3 % of a short command
    warnings.showwarning = _show_warning
    try:
        _require_memory()
        with _ended_by_signals():
            application()(prog_name="mrdamper")
    except BrokenPipeError:
        # The reader of the pipe has closed it: write nothing more, not even in the final flush.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    except _EndedError as end:
        _say(f"ended by {signal.Signals(end.number).name}; what was not finished is not written")
        sys.exit(128 + end.number)
    except SystemExit:
        raise
    except BaseException as error:  # a panic of a library in Rust is no Exception
        typed = error if isinstance(error, InputError) else resource_error(error)
        if typed is None and (fault := fault_of_package(error)):
            _say(fault)
            sys.exit(1)
        if typed is None:
            traceback.print_exc()
            _say("internal error; please report the lines above")
            sys.exit(1)
        _say(str(typed))
        sys.exit(2)


def _show_warning(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
    """Print a skipped plug-in on one line; any other warning as Python does."""
    if issubclass(category, PluginWarning):
        _say(str(message))
    else:
        print(warnings.formatwarning(message, category, *where[:2]), end="", file=sys.stderr)


def _require_memory() -> None:
    """Refuse an address-space limit under which the table libraries abort or hang."""
    try:
        import resource
    except ImportError:
        return  # no such limit on this system
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY and limit < _MIN_ADDRESS_SPACE and not {"--help", "--version"} & set(sys.argv):
        raise ResourceError(
            f"the limit of address space is {limit / 2**20:.0f} MiB",
            remedy=f"raise it to {_MIN_ADDRESS_SPACE / 2**20:.0f} MiB or more (ulimit -v)",
            code="E_MEMORY",
        )


class _EndedError(BaseException):
    """Request of a signal to end this process; `finally` and `with` still clean up."""

    def __init__(self, number: int):
        self.number = number
        super().__init__(number)


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    def end(number: int, frame: FrameType | None) -> NoReturn:
        for handled in before:
            signal.signal(handled, signal.SIG_IGN)  # a second signal would interrupt the clean-up
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
    with suppress(OSError):  # the full disk may be that of the standard output
        print(f"mrdamper: {text}", file=sys.stderr)


@cache
def application() -> typer.Typer:
    """Build the application; with the commands of every module of the entry points `mrdamper.commands`."""
    app = typer.Typer(
        name="mrdamper",
        cls=CommandGroups,
        help="Identify magnetorheological dampers from test-rig files; validate, predict and export the model.",
        epilog="A message ends with a code in brackets: mrdamper explain CODE explains it.",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
    )
    app.callback()(_root)
    for part, module in modules_with("mrdamper.commands", "app"):
        if isinstance(module.app, typer.Typer):
            app.registered_commands += module.app.registered_commands
        else:
            skip(part, "app is not a typer.Typer")
    for command in app.registered_commands:
        command.cls = OptionGroups
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
