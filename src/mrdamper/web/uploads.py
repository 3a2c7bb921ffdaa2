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
_NOT_SAFE = re.compile(r"[^A-Za-z0-9.+=_-]+")
_NAME_LENGTH = 100


class UploadError(InputError):
    """Dropped files that cannot be taken."""

    code = "E_DROP"


@dataclass(frozen=True)
class Verdict:
    """Result of checking one file or run."""

    name: str  # file or run, as it was called
    state: str  # "taken", "noted" (taken, with findings) or "refused"
    findings: tuple[tuple[str, str], ...] = ()


class NothingTakenError(UploadError):
    """Every dropped file was refused; the page shows why, and the profile to correct."""

    code = "E_DROP_REFUSED"

    def __init__(self, problem: str, verdicts: tuple[Verdict, ...], profile: str):
        super().__init__(
            problem, remedy="see each file below; where the form was guessed wrongly, correct the rig profile"
        )
        self.verdicts, self.profile = verdicts, profile


@dataclass(frozen=True, eq=False)
class ImportedData:
    """Data on the bench, and how it came there."""

    dataset: Dataset
    source: str  # "bundled" or "drop"
    verdicts: tuple[Verdict, ...] = ()  # of dropped rig files; empty for datasets
    profile: str = ""  # the rig profile the files were read with, as TOML; empty where none was needed


@dataclass(eq=False)
class Upload:
    """Files on their way in."""

    key: str
    folder: Path  # made for this drop
    names: dict[Path, str] = field(default_factory=dict)  # the name each stored file came with
    places: int = 0  # made so far
    size: int = 0  # bytes so far
    taken: dict[Path, tuple[Record, ...]] = field(default_factory=dict)  # of rig files, the tests that were taken
    refused: dict[Path, tuple[Refusal, ...]] = field(default_factory=dict)  # of rig files or of some of their tests
    toml: str = ""  # profile they were last read with; empty where it was guessed
    # coil current of a test of a file, where it was stated on the page [A]
    currents: dict[tuple[Path, str], float] = field(default_factory=dict)
    held_out: frozenset[str] | None = None  # runs held out on the page; None where nobody chose

    def place(self, name: str) -> Path:
        """Reserve the path of a file of that name; raises `UploadError` if there are too many."""
        if self.places >= FILE_COUNT_LIMIT:
            raise UploadError(
                f"over {FILE_COUNT_LIMIT} files",
                remedy="drop fewer at once, or use mrdamper import",
                code="E_DROP_COUNT",
            )
        # Run ids and currents are read off file names, so what is harmless of the name is kept.
        safe = _NOT_SAFE.sub("_", PurePosixPath(name.replace("\\", "/")).name).lstrip(".")[-_NAME_LENGTH:]
        folder = self.folder / f"{self.places:04d}"
        self.places += 1  # counted, not looked up: a file that broke off leaves its place unused
        folder.mkdir()
        path = folder / (safe or "file")
        self.names[path] = name
        return path

    def named(self, text: str) -> str:
        """Return a message about stored files in the names they came with."""
        for path, name in self.names.items():
            text = text.replace(str(path), name)
        return text.replace(f"{self.folder}/", "").replace(str(self.folder), "the dropped files")
