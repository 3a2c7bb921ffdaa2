"""A drop of a rig's own files: each read with its profile, judged, and taken or refused by name.

One file of a rig may need another profile than the rest (a load cell connected the wrong way
round), so what was taken can be kept while the refused ones are read again.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath

from mrdamper.errors import InputError
from mrdamper.rig_files.record import Record
from mrdamper.web.drops import Drop, Intake, NothingTakenError, Verdict

_PROFILES_TRIED = 5  # files looked at for the first whose form can be guessed


def read_rig_files(drop: Drop, toml: str, refused_only: bool) -> Intake:
    """Read the files of a drop, or those refused before, with a profile as TOML; empty to guess.

    Raises
    ------
    InputError
        If the profile cannot be read.
    NothingTakenError
        If every file is refused.
    """
    from mrdamper.rig_files.profile import parse_profile
    from mrdamper.rig_files.rig_import import import_files, to_dataset

    profile = parse_profile(toml) if toml.strip() else None
    wanted = [path for path in drop.names if not refused_only or path in drop.refused]
    found = {path: import_files([path], profile) for path in wanted}
    drop.taken |= {path: result.records for path, result in found.items() if result.records}
    drop.refused = {path: r.error for path, result in found.items() for r in result.refusals}
    for path in drop.refused:
        drop.taken.pop(path, None)
    verdicts = _verdicts(drop)
    shown = toml if toml.strip() else _guessed(wanted)
    if not drop.taken:
        count = len(drop.refused)
        text = "the file was refused" if count == 1 else f"all {count} files were refused"
        raise NothingTakenError(text, verdicts, shown)
    records = _with_own_ids(record for path in _by_name(drop) for record in drop.taken.get(path, ()))
    return Intake(to_dataset(records, _name(drop, len(records))), "drop", verdicts, shown)


def _by_name(drop: Drop) -> list[Path]:
    return sorted(drop.names, key=lambda path: drop.names[path])


def _verdicts(drop: Drop) -> tuple[Verdict, ...]:
    """What is said of each file, those to be mended first."""
    refused = [
        Verdict(drop.names[path], "refused", ((error.code, drop.named(_reason(error, path))),))
        for path in _by_name(drop)
        if (error := drop.refused.get(path))
    ]
    taken = [
        Verdict(drop.names[path], "noted" if findings else "taken", findings)
        for path in _by_name(drop)
        if path in drop.taken
        for findings in (tuple((f.code, f.text) for record in drop.taken[path] for f in record.findings),)
    ]
    return (*refused, *sorted(taken, key=lambda verdict: verdict.state != "noted"))


def _reason(error: InputError, path: Path) -> str:
    """What an error says, without the file it names: the page says that beside it."""
    place = error.where.replace(str(path), "").removeprefix(path.name).strip(" :,")
    text = f"{place}: {error.found}" if place else error.found
    return f"{text}; {error.mend}" if error.mend else text


def _with_own_ids(records: Iterable[Record]) -> tuple[Record, ...]:
    """Files of different folders may share a name; their runs may not."""
    found: dict[str, Record] = {}
    for record in records:
        name, count = record.id, 2
        while name in found:
            name, count = f"{record.id}_{count}", count + 1
        found[name] = record if name == record.id else replace(record, id=name)
    return tuple(found.values())


def _name(drop: Drop, count: int) -> str:
    """What the data are called: the folder they came in, or the one file."""
    tops = {PurePosixPath(name).parts[0] for name in drop.names.values() if len(PurePosixPath(name).parts) > 1}
    if len(tops) == 1:
        return tops.pop()
    return PurePosixPath(next(iter(drop.names.values()))).stem if len(drop.names) == 1 else f"{count} dropped tests"


def _guessed(paths: Sequence[Path]) -> str:
    """The profile of the first file whose form can be guessed; a bare one where none can."""
    from mrdamper.rig_files.profile import parse_profile, profile_text
    from mrdamper.rig_files.rig_import import guess_profile

    for path in paths[:_PROFILES_TRIED]:
        try:
            return profile_text(guess_profile(path))
        except InputError:
            continue
    return profile_text(parse_profile(""))
