"""Data of a session: the bundled tests, or uploaded files of a dataset folder or a test rig.

Files are stored under names made here; the names on the user's computer are text to show and nothing else.
"""

from __future__ import annotations

import shutil
import threading
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path, PurePosixPath

from mrdamper.dampers.base import Damper
from mrdamper.dampers.model_file import parse_model
from mrdamper.data import Dataset
from mrdamper.errors import InputError
from mrdamper.rig_files.dataset_folder import load_dataset
from mrdamper.rig_files.dataset_samples import SAMPLE_FILES
from mrdamper.web.rig_upload import read_rig_files
from mrdamper.web.uploads import AllRefusedError, ImportedData, Upload, UploadError

RUNS_FILE = "runs.csv"
_READING = threading.Lock()


def bundled() -> ImportedData:
    """Return the bundled tests: read once, shared by every session, since runs are frozen."""
    with _READING:  # they are read ahead while a page may request them
        return _bundled()


@cache
def _bundled() -> ImportedData:
    return ImportedData(load_dataset(), "bundled")


@cache
def bundled_dampers() -> tuple[Damper, ...]:
    """Load the models that a study selects for the dampers of the bundled tests."""
    folder = files("mrdamper.data.bundled") / "models"
    paths = sorted((path for path in folder.iterdir() if path.name.endswith(".json")), key=lambda path: path.name)
    return tuple(parse_model(path.read_text(encoding="utf-8"), where=path.name) for path in paths)


def read_upload(
    upload: Upload, profile: str = "", refused_only: bool = False, only: Path | None = None
) -> ImportedData:
    """Read uploaded files; raises `InputError` with their names on the user's computer.

    `profile` is a rig profile as TOML that replaces the guessed one; empty to guess. With `refused_only` the refused
    rig files are read and those taken are kept; with `only`, that file is read, and the others are kept.
    """
    if not upload.names:
        raise UploadError("no files", remedy="drop rig files, or a dataset folder")
    wanted = (RUNS_FILE, *SAMPLE_FILES)
    parts = {name: path for path in upload.names if (name := PurePosixPath(upload.names[path]).name) in wanted}
    try:
        if RUNS_FILE in parts:
            return _read_dataset(upload, parts)
        return read_rig_files(upload, profile, refused_only, only)
    except AllRefusedError:
        raise
    except InputError as error:
        problem, where, remedy = map(upload.with_user_names, (error.found, error.where, error.remedy))
        raise InputError(problem, where=where, remedy=remedy, code=error.code) from error


def _read_dataset(upload: Upload, parts: Mapping[str, Path]) -> ImportedData:
    name = PurePosixPath(upload.names[parts[RUNS_FILE]]).parent.name
    folder = upload.folder / "dataset"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for part, path in parts.items():
        (folder / part).hardlink_to(path)
    upload.names[folder] = name or "the dropped dataset"
    dataset = load_dataset(folder)
    return ImportedData(Dataset(dataset.runs, name or "dropped dataset"), "upload")
