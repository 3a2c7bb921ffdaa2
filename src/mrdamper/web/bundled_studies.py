"""Studies of the bundled tests: calculated once for all sessions, which share these runs."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from mrdamper.study.workflow import Study

_MAX_STUDIES = 4  # with different heads of the report


class BundledStudies:
    """Finished studies by the head of their report; every session gets the files as links in a folder of its own."""

    def __init__(self, folder: Path):
        self._folder = folder
        self._finished: dict[str, tuple[Study, Path, list[Path]]] = {}

    def find(self, head: str, folder: Path) -> tuple[Study, list[Path]] | None:
        """Return the study with that head, its files in a new folder; None where there is none yet."""
        if head not in self._finished:
            return None
        study, kept, files = self._finished[head]
        shutil.copytree(kept, folder, copy_function=os.link)
        return study, [folder / path for path in files]

    def keep(self, head: str, study: Study, folder: Path, files: list[Path]) -> None:
        """Keep a finished study; the one kept longest goes where there are too many."""
        if head in self._finished:
            return
        kept = self._folder / f"{len(self._finished)}-{os.urandom(8).hex()}"
        shutil.copytree(folder, kept, copy_function=os.link)
        self._finished[head] = study, kept, [path.relative_to(folder) for path in files]
        if len(self._finished) > _MAX_STUDIES:
            _, oldest, _ = self._finished.pop(next(iter(self._finished)))
            shutil.rmtree(oldest, ignore_errors=True)
