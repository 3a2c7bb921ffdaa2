"""Tasks for the tests of worker processes; a spawned process imports them by name."""

import multiprocessing
import os
import time
from pathlib import Path

from mrdamper.errors import IdentificationError


def count(steps, progress):
    for step in range(steps):
        progress(f"step {step}", step / steps)
        time.sleep(0.06)
    return steps


def niceness(progress):
    return os.nice(0)


def refuse(progress):
    raise IdentificationError("too few runs", where="rig x", remedy="record more")


def break_down(progress):
    raise RuntimeError("a fault of ours")


def sleep_with_child(folder, progress):
    """Start a process of its own and sleep; both write down who they are."""
    child = multiprocessing.get_context("spawn").Process(target=_sleep)
    child.start()
    (Path(folder) / "child").write_text(str(child.pid))
    progress("sleeping", 0.5)
    time.sleep(60)


def _sleep():
    time.sleep(60)
