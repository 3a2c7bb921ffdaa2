"""Progress on standard error."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from threading import Lock, Timer
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from mrdamper.data.progress import Progress

Item = TypeVar("Item")
_QUICK = 1.0  # seconds without progress


@contextmanager
def progress_on_stderr(quiet: bool = False) -> Iterator[Progress]:
    """Give a function of (step, share done 0...1) that shows progress and the remaining time on a terminal."""
    if quiet:
        yield lambda what, share: None
        return
    from rich import progress as bars
    from rich.console import Console

    columns = (
        bars.TextColumn("{task.description}"), bars.BarColumn(), bars.TimeElapsedColumn(), bars.TimeRemainingColumn()
    )  # fmt: skip
    console = Console(stderr=True)
    # Steps may last for minutes; a file or a pipe in place of a terminal would get the last bar only.
    with bars.Progress(*columns, console=console, disable=not console.is_terminal, speed_estimate_period=1e9) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda what, share: bar.update(task, description=what, completed=share)


@contextmanager
def progress_soon(what: str) -> Iterator[Progress]:
    """Show progress from the second second on: work, and the time it has taken."""
    lock, latest = Lock(), (what, 0.0)
    bar: Progress | None = None
    with ExitStack() as stack:

        def show() -> None:
            nonlocal bar
            with lock:
                if not over:
                    bar = stack.enter_context(progress_on_stderr())
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
