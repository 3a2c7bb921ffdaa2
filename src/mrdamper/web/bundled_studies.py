"""Studies of the bundled tests: calculated once for all sessions, which share these runs."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from mrdamper.study.workflow import Study

_MAX_STUDIES = 4  # with different heads of the report


class BundledStudies:
    """Finished studies by the head of their report; each session links the files into a folder of its own."""

    def __init__(self, folder: Path):
        self._folder = folder
        self._finished: dict[str, tuple[Study, Path, list[Path]]] = {}

    def find(self, head: str, folder: Path) -> tuple[Study, list[Path]] | None:
        """Return the study with a head, its files in a new folder; None where there is none yet."""
        if head not in self._finished:
            return None
        study, source, files = self._finished[head]
        shutil.copytree(source, folder, copy_function=os.link)
        return study, [folder / path for path in files]

    def keep(self, head: str, study: Study, folder: Path, files: list[Path]) -> None:
        """Keep a finished study; the oldest is removed where there are too many."""
        if head in self._finished:
            return
        copy = self._folder / f"{len(self._finished)}-{os.urandom(8).hex()}"
        shutil.copytree(folder, copy, copy_function=os.link)
        self._finished[head] = study, copy, [path.relative_to(folder) for path in files]
        if len(self._finished) > _MAX_STUDIES:
            _, oldest, _ = self._finished.pop(next(iter(self._finished)))
            shutil.rmtree(oldest, ignore_errors=True)
