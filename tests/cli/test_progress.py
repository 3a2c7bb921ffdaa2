"""What long commands say while they work."""

from contextlib import contextmanager
from threading import Event
from types import SimpleNamespace

import pytest

from mrdamper.cli import progress
from mrdamper.cli.progress import progress_on_stderr, progress_soon, time_left, watched


@pytest.mark.parametrize(
    ("seconds", "share", "said"),
    [
        (1.0, 0.5, ""),  # too early to tell
        (30.0, 0.0, ""),
        (30.0, 1.0, ""),
        (30.0, 0.25, "about 90 s left"),
        (100.0, 0.2, "about 7 min left"),
    ],
)
def test_the_time_left_is_that_of_going_on_as_before(seconds, share, said):
    assert time_left(seconds, share) == said


def test_what_is_being_done_and_the_time_left_are_shown(capsys, monkeypatch):
    clock = iter([0.0] + [20.0] * 100)
    with monkeypatch.context() as patched:
        patched.setattr(progress, "time", SimpleNamespace(monotonic=lambda: next(clock)))
        with progress_on_stderr() as tell:
            tell("figures", 0.5)
    shown = capsys.readouterr().err
    assert "figures" in shown
    assert "about 20 s left" in shown


def test_quick_work_is_quiet(capsys):
    assert list(watched([1, 2, 3], "run")) == [1, 2, 3]
    assert capsys.readouterr().err == ""


def test_slow_work_is_shown_even_while_it_tells_nothing(monkeypatch):
    said, shown = [], Event()

    @contextmanager
    def bar(quiet=False, began=None):
        yield lambda what, share: (said.append((what, share)), shown.set())

    monkeypatch.setattr(progress, "progress_on_stderr", bar)
    monkeypatch.setattr(progress, "_QUICK", 0.0)
    with progress_soon("planning") as tell:
        assert shown.wait(20)  # nothing was told
        tell("choosing", 0.9)
    tell("too late", 1.0)
    assert said[0] == ("planning", 0.0)
    assert said[1] == ("choosing", 0.9)
