"""One damper of a fleet: where its records are stored, and the hash of their content."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from mrdamper.errors import InputError, printable
from mrdamper.fleet.profile import FACTS, FleetProfile
from mrdamper.rig_files.dataset_samples import SAMPLE_FILES

Kind = Literal["dataset", "rig files", "lake"]


class FleetError(InputError):
    """A fleet that cannot be read, or a damper that cannot be used; the code states why."""

    code = "E_FLEET"


@dataclass(frozen=True)
class Item:
    """One damper in one session, and where its records are stored."""

    serial: str  # its name together with the session: a master damper is tested in several sessions
    session: str = ""
    batch: str = ""  # these two: empty where nothing states them
    date: str = ""
    golden: bool = False  # master damper, tested in every session to monitor the rig
    kind: Kind = "dataset"
    paths: tuple[str, ...] = ()  # the dataset folder, the rig files, or the Parquet files
    rows: tuple[tuple[int, int], ...] = ()  # of Parquet files: first row and number of rows in each file
    # column and cell that identify its rows, where one table contains several dampers
    picks: tuple[tuple[str, str], ...] = ()
    error: InputError | None = None  # why it cannot be used, where this is known before reading

    @property
    def name(self) -> str:
        """Serial number, and the session if stated, printable on a terminal."""
        return printable(f"{self.serial}, session {self.session}" if self.session else self.serial)

    @property
    def facts(self) -> dict[str, Any]:
        """Columns of the tables that do not depend on the records."""
        return {name: getattr(self, name) for name in FACTS}


def make_item(facts: dict[str, str], profile: FleetProfile, **where: Any) -> Item:
    """Make an item from the facts that names or columns state; without a session, the date is the session."""
    facts = {k: v for k, v in facts.items() if v is not None}
    date = facts.get("date", "")
    return Item(
        serial=facts["serial"],
        session=facts.get("session", date),
        batch=facts.get("batch", ""),
        date=date,
        golden=profile.is_golden(facts),
        **where,
    )


def digest_of(item: Item) -> str:
    """Hash of the bytes of an item's files, and of the key of the damper in them."""
    states = [(path, path.stat()) for path in _files(item)]
    contents = [(path.name, _content(path, about.st_size, about.st_mtime_ns)) for path, about in states]
    return hash_of(contents, sorted(item.facts.items()), item.rows, item.picks)


@lru_cache  # a Parquet file contains many dampers
def _content(path: Path, size: int, changed_ns: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=20)).hexdigest()


def hash_of(*parts: Any) -> str:
    """Return the hash of a JSON value."""
    return hashlib.blake2b(json.dumps(parts, sort_keys=True).encode(), digest_size=20).hexdigest()


def _files(item: Item) -> list[Path]:
    if item.kind == "dataset":
        folder = Path(item.paths[0])
        return [folder / name for name in ("runs.csv", *SAMPLE_FILES) if (folder / name).is_file()]
    return [Path(path) for path in item.paths]
