"""From dropped files to data on the bench: a dataset folder, or the files of a test rig.

Files arrive under names made here; the names they came with are text to be shown and nothing else.
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
from mrdamper.web.uploads import ImportedData, NothingTakenError, Upload, UploadError

RUNS_FILE = "runs.csv"
_READING = threading.Lock()


def bundled() -> ImportedData:
    """Return the bundled tests: read once, shared by every session, since runs are frozen."""
    with _READING:  # the bench reads them ahead while a page may ask
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
    """Make data of a drop; raises `InputError` with the names the files came with.

    `profile` is a rig profile as TOML that replaces the guessed one; empty to guess. With `refused_only` the rig files
    that were taken before are kept and the refused ones read; with `only`, that file is, and the others stay.
    """
    if not upload.names:
        raise UploadError("no files", remedy="drop rig files, or a dataset folder")
    try:
        parts = _dataset_parts(upload.names)
        return _read_dataset(upload, parts) if parts else read_rig_files(upload, profile, refused_only, only)
    except NothingTakenError:
        raise
    except InputError as error:
        raise InputError(
            upload.named(error.found),
            where=upload.named(error.where),
            remedy=upload.named(error.remedy),
            code=error.code,
        ) from error


def _dataset_parts(names: Mapping[Path, str]) -> dict[str, Path]:
    """Return the files of a dataset folder by the names they must have; empty if this is none."""
    wanted = (RUNS_FILE, *SAMPLE_FILES)
    parts = {PurePosixPath(name).name: path for path, name in names.items() if PurePosixPath(name).name in wanted}
    return parts if RUNS_FILE in parts else {}


def _read_dataset(upload: Upload, parts: Mapping[str, Path]) -> ImportedData:
    top = PurePosixPath(upload.names[parts[RUNS_FILE]]).parent.name
    folder = upload.folder / "dataset"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for name, path in parts.items():
        (folder / name).hardlink_to(path)
    upload.names[folder] = top or "the dropped dataset"
    dataset = load_dataset(folder)
    return ImportedData(Dataset(dataset.runs, top or "dropped dataset"), "drop")
