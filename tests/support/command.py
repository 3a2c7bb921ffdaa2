"""The command line in this process: arguments and results."""

import contextlib
import io
import sys
from dataclasses import dataclass
from unittest.mock import patch

from mrdamper.cli import main

# A program that runs several commands in one process: lists of arguments as JSON on stdin, their results on stdout.
EACH = """
import json, sys
from support.command import mrdamper
print(json.dumps([vars(mrdamper(*words)) for words in json.load(sys.stdin)]))
"""


@dataclass(frozen=True)
class Done:
    """Result, with the names of `subprocess.CompletedProcess`."""

    returncode: int
    stdout: str
    stderr: str


def mrdamper(*arguments):
    """Run a command as `mrdamper ARGUMENTS`, without a process."""
    out, err = io.StringIO(), io.StringIO()
    with (
        patch.object(sys, "argv", ["mrdamper", *map(str, arguments)]),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            main()
            code = 0
        except SystemExit as end:
            code = end.code or 0
    return Done(code, out.getvalue(), err.getvalue())
