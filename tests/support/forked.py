"""Work in a fork of this process, in which libraries are already loaded."""

import os


def forked(work, *arguments):
    """Exit status of the work: 0, 1 where it raised, minus the signal that ended it."""
    child = os.fork()
    if child == 0:
        try:
            work(*arguments)
            os._exit(0)
        finally:
            os._exit(1)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
