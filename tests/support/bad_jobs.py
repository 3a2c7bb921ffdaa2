"""Jobs that violate the rules for jobs."""

import os
import signal
import time
from pathlib import Path

import numpy as np

from mrdamper.errors import ColumnError


def doubled(x):
    return 2 * x


def crash(_):
    os.kill(os.getpid(), signal.SIGSEGV)


def leave(_):
    os._exit(7)


def hang(_):
    time.sleep(60)


def spin(_):
    while True:
        pass


def want(size):
    return float(np.ones(size // 8).sum())


_LEAKED = []


def leak(size):
    _LEAKED.append(np.ones(size // 8))
    return len(_LEAKED)


def fork_and_want(size):
    for _ in range(2):  # each within the limit, both together over it
        if os.fork() == 0:
            os.setsid()
            _LEAKED.append(np.ones(size // 8))
            time.sleep(60)
    time.sleep(60)


def fork_and_return(_):
    return "parent" if os.fork() else "child"


def fork_and_leave_behind(_):
    child = os.fork()
    if child == 0:
        os.setsid()
        if os.fork() == 0:
            time.sleep(600)
        os._exit(0)
    os.waitpid(child, 0)
    return "left"


def killed_once(path):
    if not Path(path).exists():
        Path(path).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return "done"


def refuse(_):
    raise ColumnError("no force", where="a.csv", remedy="add it")


def slip(_):
    raise ZeroDivisionError("ours")
