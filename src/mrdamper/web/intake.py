"""From dropped files to data on the bench: the one place that knows what can be dropped.

A drop is a dataset folder (`runs.csv` and samples) or the files of a test rig. Files arrive
under names made here; the names they came with are text to be shown and nothing else.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path, PurePosixPath

from mrdamper.data import Dataset
from mrdamper.errors import InputError
from mrdamper.io.dataset import SAMPLE_FILES, load_dataset

FILE_LIMIT = 20_000_000
FILE_COUNT_LIMIT = 1000
DROP_LIMIT = 1_000_000_000
RUNS_FILE = "runs.csv"
_NOT_SAFE = re.compile(r"[^A-Za-z0-9.+=_-]+")
_NAME_LENGTH = 100
_PROFILES_TRIED = 5  # files looked at for the first whose form can be guessed


class DropError(InputError):
    """Dropped files that cannot be taken."""

    code = "E_DROP"


@dataclass(frozen=True)
class Verdict:
    """What was said of one dropped file or run.

    Attributes
    ----------
    name : str
        File or run, as it was called.
    state : str
        "taken", "noticed" (taken, with findings) or "refused".
    findings : tuple of (code, text)
    """

    name: str
    state: str
    findings: tuple[tuple[str, str], ...] = ()

    def on_screen(self) -> dict[str, object]:
        """Ready for JSON."""
        return {"name": self.name, "state": self.state, "findings": self.findings}


class NothingTakenError(DropError):
    """Every dropped file was refused; the page shows why, and the profile to correct."""

    code = "E_DROP_REFUSED"

    def __init__(self, found: str, verdicts: tuple[Verdict, ...], profile: str):
        super().__init__(found, mend="see each file below; where the form was guessed wrongly, correct the rig profile")
        self.verdicts, self.profile = verdicts, profile


@dataclass(frozen=True, eq=False)
class Intake:
    """Data on the bench, and how it came there.

    Attributes
    ----------
    dataset : Dataset
    source : str
        "bundled" or "drop".
    verdicts : tuple of Verdict
        Of dropped rig files; empty for datasets.
    profile : str
        The rig profile the files were read with, as TOML; empty where none was needed.
    """

    dataset: Dataset
    source: str
    verdicts: tuple[Verdict, ...] = ()
    profile: str = ""


@dataclass(eq=False)
class Drop:
    """Files on their way in.

    Attributes
    ----------
    key : str
    folder : Path
        Made for this drop.
    names : dict of Path to str
        The name each stored file came with.
    size : int
        Bytes so far.
    """

    key: str
    folder: Path
    names: dict[Path, str] = field(default_factory=dict)
    size: int = 0

    def place(self, name: str) -> Path:
        """Where a file of that name is stored.

        Raises
        ------
        DropError
            If there are too many.
        """
        if len(self.names) >= FILE_COUNT_LIMIT:
            raise DropError(
                f"over {FILE_COUNT_LIMIT} files", mend="drop fewer at once, or use mrdamper import", code="E_DROP_COUNT"
            )
        # Run ids and currents are read off file names, so what is harmless of the name is kept.
        safe = _NOT_SAFE.sub("_", PurePosixPath(name.replace("\\", "/")).name).lstrip(".")[-_NAME_LENGTH:]
        folder = self.folder / f"{len(self.names):04d}"
        folder.mkdir()
        path = folder / (safe or "file")
        self.names[path] = name
        return path

    def named(self, text: str) -> str:
        """A message about stored files in the names they came with."""
        for path, name in self.names.items():
            text = text.replace(str(path), name)
        return text.replace(f"{self.folder}/", "").replace(str(self.folder), "the dropped files")


@cache
def bundled() -> Intake:
    """The bundled tests: read once, shared by every session, since runs are frozen."""
    return Intake(load_dataset(), "bundled")


def read_drop(drop: Drop, profile: str = "") -> Intake:
    """Make data of a drop.

    Parameters
    ----------
    drop : Drop
    profile : str
        Rig profile as TOML that replaces the guessed one; empty to guess.

    Raises
    ------
    InputError
        With the names the files came with.
    """
    if not drop.names:
        raise DropError("no files", mend="drop rig files, or a dataset folder")
    try:
        parts = _dataset_parts(drop.names)
        return _read_dataset(drop, parts) if parts else _read_rig_files(drop, profile)
    except NothingTakenError:
        raise
    except InputError as error:
        raise InputError(
            drop.named(error.found), where=drop.named(error.where), mend=drop.named(error.mend), code=error.code
        ) from error


def _dataset_parts(names: Mapping[Path, str]) -> dict[str, Path]:
    """The files of a dataset folder by the names they must have; empty if this is none."""
    wanted = (RUNS_FILE, *SAMPLE_FILES)
    parts = {PurePosixPath(name).name: path for path, name in names.items() if PurePosixPath(name).name in wanted}
    return parts if RUNS_FILE in parts else {}


def _read_dataset(drop: Drop, parts: Mapping[str, Path]) -> Intake:
    top = PurePosixPath(drop.names[parts[RUNS_FILE]]).parent.name
    folder = drop.folder / "dataset"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for name, path in parts.items():
        (folder / name).hardlink_to(path)
    drop.names[folder] = top or "the dropped dataset"
    found = load_dataset(folder)
    return Intake(Dataset(found.runs, top or "dropped dataset"), "drop")


def _read_rig_files(drop: Drop, toml: str) -> Intake:
    from mrdamper.io.profile import parse_profile
    from mrdamper.io.rig_import import import_files, to_dataset

    paths = list(drop.names)
    profile = parse_profile(toml) if toml.strip() else None
    result = import_files(paths, profile)
    called = {path.name: name for path, name in drop.names.items()}
    verdicts = tuple(
        Verdict(
            called.get(record.provenance.get("file", ""), record.id),
            "noticed" if record.findings else "taken",
            tuple((finding.code, finding.text) for finding in record.findings),
        )
        for record in result.records
    ) + tuple(
        Verdict(drop.named(r.file), "refused", ((r.error.code, drop.named(_reason(r.error, r.file))),))
        for r in result.refusals
    )
    shown = toml if toml.strip() else _guessed(paths)
    if not result.records:
        count = len(result.refusals)
        raise NothingTakenError(
            "the file was refused" if count == 1 else f"all {count} files were refused", verdicts, shown
        )
    top = {PurePosixPath(name).parts[0] for name in drop.names.values() if len(PurePosixPath(name).parts) > 1}
    name = top.pop() if len(top) == 1 else f"{len(result.records)} dropped tests"
    return Intake(to_dataset(result.records, name), "drop", verdicts, shown)


def _reason(error: InputError, file: str) -> str:
    """What an error says, without the file it names: the page says that beside it."""
    place = error.where.replace(file, "").removeprefix(Path(file).name).strip(" :,")
    text = f"{place}: {error.found}" if place else error.found
    return f"{text}; {error.mend}" if error.mend else text


def _guessed(paths: Sequence[Path]) -> str:
    """The profile of the first file whose form can be guessed; a bare one where none can."""
    from mrdamper.io.profile import parse_profile, profile_text
    from mrdamper.io.rig_import import guess_profile

    for path in paths[:_PROFILES_TRIED]:
        try:
            return profile_text(guess_profile(path))
        except InputError:
            continue
    return profile_text(parse_profile(""))
