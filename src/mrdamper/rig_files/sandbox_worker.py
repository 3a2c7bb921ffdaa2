"""The child of `sandbox`: reads files with libraries that may not survive it."""

from __future__ import annotations

import json
import os
import signal
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from mrdamper.data.child import send, standard_output, writable_memory
from mrdamper.errors import CombinedError, MissingExtraError
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.base import NoTableError, RawTable, Reader, RigFileError, Source

_SAYS = ("names", "units", "line", "label", "form", "constants", "odd", "remarks", "over", "numbers")
_TOLD = ("code", "found", "line", "column", "remedy")


def serve() -> None:
    """Answer requests until the parent hangs up."""
    replies = standard_output()
    with ExitStack() as keep:
        tables: list[RawTable] = []
        for line in sys.stdin.buffer:
            request = json.loads(line)
            try:
                if "prepare" in request:
                    _library(request["prepare"])
                elif "reader" in request:
                    keep.close()
                    tables = _open(request, keep)
                    send(replies, {"tables": [{name: getattr(table, name) for name in _SAYS} for table in tables]})
                elif "words" in request:
                    _send_words(replies, tables[request["table"]], request["words"])
                else:
                    _send_columns(replies, tables[request["table"]], request["columns"])
            except MissingExtraError as error:
                if "prepare" in request:
                    continue
                send(replies, {"missing": error.found, "remedy": error.remedy})
            except (RigFileError, CombinedError) as error:
                errors = getattr(error, "errors", (error,))
                wrong = [{name: getattr(one, name) for name in _TOLD} for one in errors]
                send(replies, {"wrong": wrong, "no_table": [isinstance(one, NoTableError) for one in errors]})
            except MemoryError:
                os._exit(3)


def _library(name: str) -> Reader:
    from mrdamper.rig_files.readers import all_readers
    from mrdamper.rig_files.readers.arrays import load

    reader = all_readers()[name]()
    _limit(None)
    load(reader.library, reader.title)
    reader.warm_up()
    return reader


def _open(request: dict[str, Any], keep: ExitStack) -> list[RawTable]:
    reader = _library(request["reader"])
    _limit(request["seconds"], request["bytes"])
    path = Path(request["path"])
    file = keep.enter_context(path.open("rb"))
    source = Source(path, request["name"], request["suffix"], file, path.stat().st_size, keep)
    return reader.tables(source, FileForm.model_validate(request["form"]))


def _limit(seconds: float | None, size: float = 0) -> None:
    """From here on, this much processor time and memory; beyond, the system ends the process. None lifts it.

    Memory is what is written to (RLIMIT_DATA). Address space would be the wrong measure:
    allocators of many threads reserve half a gigabyte of it and use a tenth.
    """
    if not hasattr(signal, "setitimer"):
        return
    import resource

    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    signal.setitimer(signal.ITIMER_PROF, seconds or 0.0)
    hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
    now = writable_memory()
    resource.setrlimit(resource.RLIMIT_DATA, (hard if seconds is None or not now else now + int(size), hard))


def _send_columns(replies: BinaryIO, table: RawTable, columns: list[int]) -> None:
    content = table.read(columns)
    values = [content.values[column] for column in columns]
    lines = [] if content.lines is None else [content.lines]
    answer = {
        "sizes": [array.size for array in values],
        "lines": sum(array.size for array in lines),
        "findings": [[finding.code, finding.text] for finding in content.findings],
    }
    send(replies, answer, [*values, *lines])


def _send_words(replies: BinaryIO, table: RawTable, column: int) -> None:
    words = table.words(column)
    send(replies, {"size": words.codes.size, "labels": words.labels}, [words.codes.astype(np.float64)])
