"""Progress on standard error."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from threading import Lock, Timer
from typing import TypeVar

Item = TypeVar("Item")
Progress = Callable[[str, float], None]
_QUICK = 1.0  # seconds in which nothing needs to be said
_SOON = 2.0  # seconds before which the time left is a guess nobody needs


@contextmanager
def progress_on_stderr(quiet: bool = False, began: float | None = None) -> Iterator[Progress]:
    """Give a function (what is being done, share done 0...1) that shows progress and the time left on stderr."""
    if quiet:
        yield lambda what, share: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TextColumn("{task.fields[left]}"))
    began = time.monotonic() if began is None else began
    with Progress(*columns, console=Console(stderr=True), transient=False) as bar:
        task = bar.add_task("", total=1.0, left="")

        def tell(what: str, share: float) -> None:
            bar.update(task, description=what, completed=share, left=time_left(time.monotonic() - began, share))

        yield tell


@contextmanager
def progress_soon(what: str) -> Iterator[Progress]:
    """Show progress from the second second on: work, and the time it has taken."""
    began, lock, latest = time.monotonic(), Lock(), (what, 0.0)
    bar: Progress | None = None
    with ExitStack() as stack:

        def show() -> None:
            nonlocal bar
            with lock:
                if not over:
                    bar = stack.enter_context(progress_on_stderr(began=began))
                    bar(*latest)

        def tell(what: str, share: float) -> None:
            nonlocal latest
            with lock:
                latest = what, share
                if bar is not None:
                    bar(what, share)

        over, timer = False, Timer(_QUICK, show)
        timer.daemon = True
        timer.start()
        try:
            yield tell
        finally:
            timer.cancel()
            with lock:
                over = True


def in_two(progress: Progress, share: float) -> tuple[Progress, Progress]:
    """Split progress between two tasks, the first of which takes this share of the time."""
    return (
        lambda what, done: progress(what, share * done),
        lambda what, done: progress(what, share + (1 - share) * done),
    )


def watched(items: Sequence[Item], what: str) -> Iterator[Item]:
    """Items one after the other, with progress from the second second on."""
    with progress_soon(what) as tell:
        for number, item in enumerate(items):
            tell(f"{what} {number + 1} of {len(items)}", number / len(items))
            yield item
        tell(f"{len(items)} {what}s", 1.0)


def time_left(seconds: float, share: float) -> str:
    """Estimate the time left at the pace so far; empty while it cannot be estimated.

    Examples
    --------
    >>> time_left(30.0, 0.25)
    'about 90 s left'
    """
    if seconds < _SOON or not 0.02 < share < 1:
        return ""
    left = seconds * (1 - share) / share
    return f"about {left / 60:.0f} min left" if left >= 100 else f"about {left:.0f} s left"
