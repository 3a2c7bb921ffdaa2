"""The dampers of a fleet: what lies in a folder of datasets, of rig files, or in a Parquet lake."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from mrdamper.errors import InputError, printable
from mrdamper.files.dataset import runs_table
from mrdamper.files.samples import SAMPLE_FILES
from mrdamper.fleet.profile import FACTS, FleetProfile

Kind = Literal["dataset", "rig files", "lake"]


class FleetError(InputError):
    """A fleet cannot be read, or a damper of it cannot be used; the code says why."""

    code = "E_FLEET"


@dataclass(frozen=True)
class Item:
    """One damper of one session: where its records lie."""

    serial: str  # with the session its name: a golden damper comes again in other sessions
    session: str = ""
    batch: str = ""  # these two: empty where nothing states them
    date: str = ""
    golden: bool = False  # tested again and again to watch the rig
    kind: Kind = "dataset"
    paths: tuple[str, ...] = ()  # the dataset folder, the rig files, or the lake's files
    rows: tuple[tuple[int, int], ...] = ()  # of a lake: first row and number of rows in each file
    # column and cell of the rows that are its own, where one table holds several dampers
    picks: tuple[tuple[str, str], ...] = ()
    error: InputError | None = None  # why it cannot be used, known before it is read

    @property
    def name(self) -> str:
        """Serial number, and the session where one is stated, as a terminal may show them."""
        return printable(f"{self.serial}, session {self.session}" if self.session else self.serial)

    @property
    def facts(self) -> dict[str, Any]:
        """What the tables say of it whatever its records hold."""
        return {name: getattr(self, name) for name in FACTS}


def find_items(source: str | Path, profile: FleetProfile) -> list[Item]:
    """The dampers of a source, sorted by serial number and session.

    A source is a folder of dataset folders, of folders of rig files or of rig files, a dataset folder, or
    a Parquet lake (a file, or a folder of such files) with a column for the serial number. Raises
    `FleetError` (E_FLEET_EMPTY) if there is no damper in it.
    """
    source = Path(source)
    if not source.exists():
        raise FleetError("no such folder", where=str(source), mend="give a folder of datasets", code="E_FLEET_EMPTY")
    from mrdamper.fleet.lake import is_lake, lake_items

    lake = sorted(source.rglob("*.parquet")) if source.is_dir() else [source]
    results = [p for p in lake if p.name == "dampers.parquet" and _holds_results(p.parent)]
    lake = [p for p in lake if p.name not in SAMPLE_FILES and p.is_file() and p not in results]
    if lake and is_lake(lake, profile):
        found = lake_items(lake, profile)
    elif source.is_dir():
        found = list(_in_folder(source, profile))
    else:
        raise FleetError(
            "neither a folder nor a Parquet file with a serial number", where=str(source), mend="give a folder",
            code="E_FLEET_EMPTY",
        )  # fmt: skip
    if not found:
        raise FleetError(
            "no damper in this folder", where=str(source), code="E_FLEET_EMPTY",
            mend="a fleet is a folder of dataset folders, of rig files, or a Parquet lake",
        )  # fmt: skip
    return _without_twins(sorted(found, key=lambda item: (item.serial, item.session, item.paths)))


def digest_of(item: Item) -> str:
    """Hash of the bytes of an item's files, and of what names the damper in them."""
    seen = [(path, path.stat()) for path in _files(item)]
    contents = [(path.name, _content(path, about.st_size, about.st_mtime_ns)) for path, about in seen]
    return hash_of(contents, sorted(item.facts.items()), item.rows, item.picks)


@lru_cache  # a file of a lake holds many dampers
def _content(path: Path, size: int, changed_ns: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=20)).hexdigest()


def hash_of(*parts: Any) -> str:
    """Of anything that JSON holds."""
    return hashlib.blake2b(json.dumps(parts, sort_keys=True).encode(), digest_size=20).hexdigest()


def _files(item: Item) -> list[Path]:
    if item.kind == "dataset":
        folder = Path(item.paths[0])
        return [folder / name for name in ("runs.csv", *SAMPLE_FILES) if (folder / name).is_file()]
    return [Path(path) for path in item.paths]


def _holds_results(folder: Path) -> bool:
    """Whether a folder is an earlier `--out`."""
    return (folder / "journal.lock").is_file()


def _in_folder(folder: Path, profile: FleetProfile) -> Iterator[Item]:
    from mrdamper.rig_files.readers import suffixes

    if (folder / "runs.csv").is_file():
        yield from _of_dataset(folder, profile)
        return
    known = suffixes()
    loose: list[Path] = []
    for path in sorted(folder.iterdir()):
        if path.name.startswith(".") or folder.resolve().is_relative_to(path.resolve()) or _holds_results(path):
            continue  # hidden, a link to where it lies, or our own results
        if path.is_dir() and (path / "runs.csv").is_file():
            yield from _of_dataset(path, profile)
        elif path.is_dir():
            inside = [p for p in sorted(path.rglob("*")) if p.is_file() and p.suffix.lower() in known]
            yield _named(path.name, profile, "rig files", tuple(map(str, inside)), path)
        elif path.suffix.lower() in known and path.is_file():  # a pipe would be waited for
            loose.append(path)
    yield from _of_loose_files(loose, profile)


def _of_loose_files(paths: Sequence[Path], profile: FleetProfile) -> Iterator[Item]:
    """Files whose names state the same serial number and session are one damper's."""
    groups: dict[Item, list[str]] = {}
    for path in paths:
        stem = path.name.split(".")[0]
        item = _named(stem, profile, "rig files", (str(path),), path)
        if item.error is not None:
            yield item
        else:
            groups.setdefault(replace(item, paths=()), []).append(str(path))
    for item, files in groups.items():
        yield replace(item, paths=tuple(files))


def _named(name: str, profile: FleetProfile, kind: Kind, paths: tuple[str, ...], where: Path) -> Item:
    facts = profile.of_name(name)
    if facts is None:
        error = FleetError(
            f"the name does not follow the pattern {profile.names!r}", where=str(where), code="E_FLEET_NAME",
            mend="rename it, or correct names in the fleet profile",
        )  # fmt: skip
        return Item(name, kind=kind, paths=paths, error=error)
    item = make_item(facts, profile, kind=kind, paths=paths)
    if not paths:
        error = FleetError("no rig's file in this folder", where=str(where), mend="add them", code="E_NO_DATA")
        return replace(item, error=error)
    return item


def _of_dataset(folder: Path, profile: FleetProfile) -> Iterator[Item]:
    """The dampers of a dataset folder: one, unless columns name several serial numbers or sessions."""
    named = _named(folder.name, profile, "dataset", (str(folder),), folder)
    try:
        table = runs_table(folder)
    except InputError:
        table = []  # the job of this damper says what is wrong with it
    groups: dict[tuple[str, str], dict[str, str]] = {}
    for row in map(profile.of_columns, table):
        key = row.get("serial", ""), row.get("session", "")
        groups[key] = {**row, **groups.get(key, {})}
    if named.error is not None and not any(serial for serial, _ in groups):
        yield named
        return
    known = {"serial": folder.name, **(profile.of_name(folder.name) or {})}
    columns = [profile.column_of(fact, table[0] if table else ()) for fact in ("serial", "session")]
    for key, facts in (groups or {("", ""): {}}).items():
        picks = [(c, cell) for c, cell in zip(columns, key, strict=True) if c] if len(groups) > 1 else []
        yield make_item({**known, **facts}, profile, paths=(str(folder),), picks=tuple(picks))


def make_item(facts: dict[str, str], profile: FleetProfile, **where: Any) -> Item:
    """An item from what names or columns state; without a session, its date is one."""
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


def _without_twins(items: Sequence[Item]) -> list[Item]:
    """Two records of one serial number in one session: which is right nobody knows, so neither is used."""
    seen: dict[tuple[str, str], list[Item]] = {}
    for item in items:
        seen.setdefault((item.serial, item.session), []).append(item)
    checked = []
    for twins in seen.values():
        for item in twins:
            if len(twins) > 1 and item.error is None:
                others = ", ".join(sorted(Path(p).name for t in twins for p in t.paths[:1]))
                error = FleetError(
                    f"{len(twins)} datasets have serial number {item.name}: {others}",
                    where=item.paths[0], code="E_FLEET_SERIAL",
                    mend="remove or rename all but one, or state the session of each",
                )  # fmt: skip
                item = replace(item, error=error)
            checked.append(item)
    return checked
