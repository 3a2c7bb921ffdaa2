"""Uploads: the files, the result of checking each, and the data read from them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from mrdamper.data import Dataset
from mrdamper.errors import InputError
from mrdamper.rig_files.record import Record, Refusal

FILE_LIMIT = 20_000_000
FILE_COUNT_LIMIT = 1000
UPLOAD_LIMIT = 1_000_000_000
_UNSAFE = re.compile(r"[^A-Za-z0-9.+=_-]+")
_NAME_LENGTH = 100


class UploadError(InputError):
    """Uploaded files that cannot be used."""

    code = "E_UPLOAD"


@dataclass(frozen=True)
class Verdict:
    """Result of checking one file or run."""

    name: str  # of the file or run on the user's computer
    state: str  # "taken", "noted" (taken, with findings) or "refused"
    findings: tuple[tuple[str, str], ...] = ()


class AllRefusedError(UploadError):
    """Refusal of every uploaded file; the page shows the reasons, and the profile to correct."""

    code = "E_UPLOAD_REFUSED"

    def __init__(self, problem: str, verdicts: tuple[Verdict, ...], profile: str):
        remedy = "see each file below; where the format was guessed wrongly, correct the rig profile"
        super().__init__(problem, remedy=remedy)
        self.verdicts, self.profile = verdicts, profile


@dataclass(frozen=True, eq=False)
class ImportedData:
    """Loaded data and their source."""

    dataset: Dataset
    source: str  # "bundled" or "upload"
    verdicts: tuple[Verdict, ...] = ()  # on uploaded rig files; empty for datasets
    profile: str = ""  # the rig profile the files were read with, as TOML; empty where none was needed


@dataclass(eq=False)
class Upload:
    """Uploaded files, with the choices that the user made for them."""

    key: str
    folder: Path  # of this upload
    names: dict[Path, str] = field(default_factory=dict)  # of each stored file on the user's computer
    places: int = 0  # reserved so far
    size: int = 0  # bytes so far
    taken: dict[Path, tuple[Record, ...]] = field(default_factory=dict)  # tests of rig files
    refused: dict[Path, tuple[Refusal, ...]] = field(default_factory=dict)  # rig files or some of their tests
    toml: str = ""  # profile they were last read with; empty where it was guessed
    currents: dict[tuple[Path, str], float] = field(default_factory=dict)  # of tests, as stated on the page [A]
    validation: frozenset[str] | None = None  # validation runs chosen on the page; None without a choice

    def place(self, name: str) -> Path:
        """Reserve the path of a file of a name; raises `UploadError` if there are too many."""
        if self.places >= FILE_COUNT_LIMIT:
            remedy = "drop fewer at once, or use mrdamper import"
            raise UploadError(f"over {FILE_COUNT_LIMIT} files", remedy=remedy, code="E_UPLOAD_COUNT")
        # Run ids and currents are read from file names, so the safe part of the name stays.
        safe = _UNSAFE.sub("_", PurePosixPath(name.replace("\\", "/")).name).lstrip(".")[-_NAME_LENGTH:]
        folder = self.folder / f"{self.places:04d}"
        self.places += 1  # counted, as an interrupted file leaves its place unused
        folder.mkdir()
        path = folder / (safe or "file")
        self.names[path] = name
        return path

    def with_user_names(self, text: str) -> str:
        """Replace the paths of stored files in a message by their names on the user's computer."""
        for path, name in self.names.items():
            text = text.replace(str(path), name)
        return text.replace(f"{self.folder}/", "").replace(str(self.folder), "the dropped files")

    def paths_by_name(self) -> list[Path]:
        """List the stored files in the order of their names."""
        return sorted(self.names, key=lambda path: self.names[path])
