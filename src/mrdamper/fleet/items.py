"""Find the dampers of a fleet in folders of datasets, of rig files, or in Parquet files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from mrdamper.errors import InputError
from mrdamper.fleet.item import FleetError, Item, Kind, make_item
from mrdamper.fleet.parquet_folder import is_parquet_folder, parquet_items
from mrdamper.fleet.profile import FleetProfile
from mrdamper.rig_files.dataset_folder import runs_table
from mrdamper.rig_files.dataset_samples import SAMPLE_FILES


def find_items(source: str | Path, profile: FleetProfile) -> list[Item]:
    """Find the dampers of a source, sorted by serial number and session.

    A source is a folder of dataset folders, of folders of rig files or of rig files, a dataset folder, or a Parquet
    file or a folder of such files with a column for the serial number. Raises `FleetError` (E_FLEET_EMPTY) if it
    contains no damper.
    """
    source = Path(source)
    if not source.exists():
        raise FleetError("no such folder", where=str(source), remedy="give a folder of datasets", code="E_FLEET_EMPTY")
    lake, problem = sorted(source.rglob("*.parquet")) if source.is_dir() else [source], "no damper in this folder"
    results = [p for p in lake if p.name == "dampers.parquet" and _holds_results(p.parent)]
    lake = [p for p in lake if p.name not in SAMPLE_FILES and p.is_file() and p not in results]
    if lake and is_parquet_folder(lake, profile):
        items = parquet_items(lake, profile)
    elif source.is_dir():
        items = list(_in_folder(source, profile))
    else:
        items, problem = [], "neither a folder nor a Parquet file with a serial number"
    if not items:
        raise FleetError(
            problem, where=str(source), code="E_FLEET_EMPTY",
            remedy="give a folder of dataset folders, of rig files, or of Parquet files",
        )  # fmt: skip
    return _without_twins(sorted(items, key=lambda item: (item.serial, item.session, item.paths)))


def _holds_results(folder: Path) -> bool:
    """Tell if a folder is an earlier `--out`."""
    return (folder / "journal.lock").is_file()


def _in_folder(folder: Path, profile: FleetProfile) -> Iterator[Item]:
    from mrdamper.rig_files.readers import suffixes

    if (folder / "runs.csv").is_file():
        yield from _of_dataset(folder, profile)
        return
    endings = suffixes()
    loose: list[Path] = []
    for path in sorted(folder.iterdir()):
        if path.name.startswith(".") or folder.resolve().is_relative_to(path.resolve()) or _holds_results(path):
            continue  # hidden, a link to a folder above, or results of this command
        if path.is_dir() and (path / "runs.csv").is_file():
            yield from _of_dataset(path, profile)
        elif path.is_dir():
            inside = [p for p in sorted(path.rglob("*")) if p.is_file() and p.suffix.lower() in endings]
            yield _named(path.name, profile, "rig files", tuple(map(str, inside)), path)
        elif path.suffix.lower() in endings and path.is_file():  # reading a pipe would wait
            loose.append(path)
    yield from _of_loose_files(loose, profile)


def _of_loose_files(paths: Sequence[Path], profile: FleetProfile) -> Iterator[Item]:
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
            remedy="rename it, or correct names in the fleet profile",
        )  # fmt: skip
        return Item(name, kind=kind, paths=paths, error=error)
    item = make_item(facts, profile, kind=kind, paths=paths)
    if not paths:
        error = FleetError("no rig's file in this folder", where=str(where), remedy="add them", code="E_NO_DATA")
        return replace(item, error=error)
    return item


def _of_dataset(folder: Path, profile: FleetProfile) -> Iterator[Item]:
    """Find the dampers of a dataset folder: one, unless columns name several serial numbers or sessions."""
    named = _named(folder.name, profile, "dataset", (str(folder),), folder)
    try:
        table = runs_table(folder)
    except InputError:
        table = []  # the job of this damper reports its error
    groups: dict[tuple[str, str], dict[str, str]] = {}
    for row in map(profile.of_columns, table):
        key = row.get("serial", ""), row.get("session", "")
        groups[key] = {**row, **groups.get(key, {})}
    if named.error is not None and not any(serial for serial, _ in groups):
        yield named
        return
    stated = {"serial": folder.name, **(profile.of_name(folder.name) or {})}
    columns = [profile.column_of(fact, table[0] if table else ()) for fact in ("serial", "session")]
    for key, facts in (groups or {("", ""): {}}).items():
        picks = [(c, cell) for c, cell in zip(columns, key, strict=True) if c] if len(groups) > 1 else []
        yield make_item({**stated, **facts}, profile, paths=(str(folder),), picks=tuple(picks))


def _without_twins(items: Sequence[Item]) -> list[Item]:
    """Refuse both of two records of one serial number in one session, which contradict each other."""
    items_by_key: dict[tuple[str, str], list[Item]] = {}
    for item in items:
        items_by_key.setdefault((item.serial, item.session), []).append(item)
    checked = []
    for twins in items_by_key.values():
        for item in twins:
            if len(twins) > 1 and item.error is None:
                others = ", ".join(sorted(Path(p).name for t in twins for p in t.paths[:1]))
                error = FleetError(
                    f"{len(twins)} datasets have serial number {item.name}: {others}",
                    where=item.paths[0], code="E_FLEET_SERIAL",
                    remedy="remove or rename all but one, or state the session of each",
                )  # fmt: skip
                item = replace(item, error=error)
            checked.append(item)
    return checked
