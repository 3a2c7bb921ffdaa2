"""A process of its own for libraries that damaged files can crash, hang or fill the memory with.

Readers that name a `library` are run here. The child stops itself when a file takes more
processor time or memory than its size warrants, and a new one takes its place.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import shutil
import signal
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mrdamper.data.child import Child
from mrdamper.errors import CombinedError, MissingExtraError
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers import base
from mrdamper.rig_files.record import Finding

_SECONDS = 2.0  # processor time of the child for the smallest file: a busy machine counts several seconds for one
_BYTES, _BYTES_PER_BYTE = 96 * 2**20, 3 * base.MOST_RATIO  # memory the child may write to beyond what its library holds
_GLANCE, _GLANCES = 0.15, 4  # seconds between looks at a silent child, looks at which it sleeps until it is ended
_PATIENCE = 30  # real time over processor time, on a loaded machine


@contextlib.contextmanager
def guarded_tables(source: base.Source, reader: base.Reader, form: FileForm) -> Iterator[list[base.RawTable]]:
    """Yield the tables of a file, read by a process of its own.

    Raises what the reader raises; E_FORMAT if its library crashes, hangs or takes too much memory,
    E_READER_KILLED if somebody else ends it; `MissingExtraError` if the library is not installed.
    """
    with contextlib.ExitStack() as stack:
        path = _on_disk(source, stack)
        sandbox = stack.enter_context(taken(reader.name))
        # The child keeps the folder it was started in; this process may stand in another by now.
        request = {"reader": reader.name, "path": str(path.absolute()), "name": source.name, "suffix": source.suffix}
        seconds = _SECONDS + reader.seconds_per_byte * source.size
        limits = {"seconds": seconds, "bytes": _BYTES + _BYTES_PER_BYTE * source.size}
        patience = limits["seconds"] * _PATIENCE + 30

        def ask(request: dict[str, Any]) -> dict[str, Any]:
            answer = sandbox.read(request, patience)
            if answer is None and sandbox.slain:
                problem = "the process that reads it was killed from outside, or by a system short of memory"
                raise source.refuse("E_READER_KILLED", problem, "run the same command again")
            if answer is None:
                problem = "reading it crashes, or takes far more time or memory than its size warrants"
                raise source.refuse("E_FORMAT", f"damaged {reader.title}: {problem}", "copy or export the file again")
            if "missing" in answer:
                raise MissingExtraError(answer["missing"], where=source.name, remedy=answer["remedy"])
            CombinedError.raise_from(
                (base.NoTableError if no_table else base.RigFileError)(file=source.name, **wrong)
                for wrong, no_table in zip(answer.get("wrong", ()), answer.get("no_table", ()), strict=True)
            )
            return answer

        def read(index: int, columns: Sequence[int]) -> base.Content:
            answer = ask({"table": index, "columns": list(columns)})
            values = {c: sandbox.receive(n) for c, n in zip(columns, answer["sizes"], strict=True)}
            lines = sandbox.receive(answer["lines"]) if answer["lines"] else None
            return base.Content(values, lines, tuple(Finding(*finding) for finding in answer["findings"]))

        def words(index: int, column: int) -> base.Words:
            answer = ask({"table": index, "words": column})
            return base.Words(sandbox.receive(answer["size"]).astype(np.int32), tuple(answer["labels"]))

        tables = []
        for i, says in enumerate(ask({**request, **limits, "form": form.model_dump()})["tables"]):
            own: dict[str, Any] = {key: tuple(of) if isinstance(of, list) else of for key, of in says.items()}
            tables.append(base.RawTable(source, read=partial(read, i), words=partial(words, i), **own))
        yield tables


class _Sandbox(Child):
    slain = False  # by somebody else than us
    _ended = False  # by us

    def __init__(self) -> None:
        super().__init__("mrdamper.rig_files.sandbox_worker", polars_threads=2)

    def read(self, request: dict[str, Any], patience: float) -> dict[str, Any] | None:
        """Return the child's answer, None if it died over it."""
        answer = self.ask(request, lambda: self._watch(patience), _GLANCE)
        self.slain = answer is None and not self._ended and self.died == getattr(signal, "SIGKILL", None)
        return answer

    def _watch(self, patience: float) -> None:
        """Wait for an answer; end a child that sleeps on a lock of its own, or takes forever."""
        begin, asleep = time.monotonic(), 0
        while self.is_silent(_GLANCE):
            asleep = asleep + 1 if _sleeps(self.pid) else 0
            if asleep >= _GLANCES or time.monotonic() - begin > patience:
                self._ended = True
                self.kill()
                return

    def receive(self, size: int) -> np.ndarray:
        """Read the numbers that follow an answer."""
        try:
            return super().receive(size)
        except EOFError:
            raise base.RigFileError("E_FORMAT", "the reading process ended early") from None


@contextlib.contextmanager
def taken(reader: str) -> Iterator[_Sandbox]:
    """Yield the child of this process, for one file at a time; if it dies, the next one is prepared for that reader."""
    with _LOCK:
        process = os.getpid()
        sandbox = _CHILDREN.get(process)
        if sandbox is None or not sandbox.alive:
            sandbox = _CHILDREN[process] = _Sandbox()
        try:
            yield sandbox
        finally:
            if not sandbox.alive:
                _CHILDREN[process] = _Sandbox()
                with contextlib.suppress(OSError):  # it loads the reader's library while nobody waits
                    _CHILDREN[process].say({"prepare": reader})


def _sleeps(pid: int) -> bool:
    """Tell if every thread of a process waits for something else than a processor or a disk."""
    try:
        states = [stat.read_text().rpartition(")")[2].split()[0] for stat in Path(f"/proc/{pid}/task").glob("*/stat")]
    except (OSError, IndexError):
        return False
    return bool(states) and all(state == "S" for state in states)


def _on_disk(source: base.Source, stack: contextlib.ExitStack) -> Path:
    """Return a path of the unpacked content."""
    if source.name == source.path.name and source.size == source.path.stat().st_size:
        return source.path
    copy = stack.enter_context(tempfile.NamedTemporaryFile(prefix="mrdamper-"))  # noqa: SIM115
    source.file.seek(0)
    shutil.copyfileobj(source.file, copy)
    copy.flush()
    return Path(copy.name)


def close() -> None:
    """End the reading process; the next file starts another."""
    if sandbox := _CHILDREN.pop(os.getpid(), None):
        sandbox.close()


_LOCK = threading.Lock()
_CHILDREN: dict[int, _Sandbox] = {}  # by the process that started it: a fork must not share its parent's pipes
atexit.register(close)
