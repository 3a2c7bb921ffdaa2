"""What long commands say while they work."""

import re
from contextlib import contextmanager
from itertools import count
from threading import Event

import pytest

from mrdamper.cli import progress
from mrdamper.cli.progress import progress_on_stderr, progress_soon, watched


@pytest.mark.parametrize("terminal", [True, False], ids=["terminal", "pipe"])
def test_what_is_being_done_and_the_time_left_are_shown_on_a_terminal_only(terminal, capsys, monkeypatch):
    clock = count(0.0, 40.0)
    monkeypatch.setattr("rich.console.monotonic", lambda: next(clock))
    monkeypatch.setattr("rich.console.Console.is_terminal", terminal)
    with progress_on_stderr() as tell:
        for share in (0.1, 0.2, 0.3):
            tell("figures", share)
    shown = capsys.readouterr().err
    assert ("figures" in shown) == terminal
    assert bool(re.search(r"0:09:20\S* \S*0:04:40", shown)) == terminal  # elapsed and left


def test_quick_work_is_quiet(capsys):
    assert list(watched([1, 2, 3], "run")) == [1, 2, 3]
    assert capsys.readouterr().err == ""


def test_slow_work_is_shown_even_while_it_tells_nothing(monkeypatch):
    said, shown = [], Event()

    @contextmanager
    def bar(quiet=False):
        yield lambda what, share: (said.append((what, share)), shown.set())

    monkeypatch.setattr(progress, "progress_on_stderr", bar)
    monkeypatch.setattr(progress, "_QUICK", 0.0)
    with progress_soon("planning") as tell:
        assert shown.wait(20)  # nothing was told
        tell("choosing", 0.9)
    tell("too late", 1.0)
    assert said[0] == ("planning", 0.0)
    assert said[1] == ("choosing", 0.9)
