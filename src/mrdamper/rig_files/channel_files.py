"""Files of which every test has several, each with some of its channels: their names and columns for a profile."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from mrdamper.rig_files.column_names import role_of
from mrdamper.rig_files.file_records import Heading, headings_of
from mrdamper.rig_files.mapping.companions import holds_channels
from mrdamper.rig_files.profile import Channel, Profile
from mrdamper.rig_files.record import REQUIRED

_ROLES = (*REQUIRED[1:], "current")
_MOST_KINDS = 12


def files_by_kind(files: Sequence[Path], profile: Profile) -> dict[str, Path]:
    """Return the first file of each kind by what a profile calls it, {run}/force.csv or force_{run}.csv.

    Empty unless two tests or more have a file of every kind; kinds of the same columns hold no whole tests.
    """
    for in_folders in (True, False):
        kinds = _kinds(files, in_folders)
        if 1 < len(kinds) <= _MOST_KINDS and len(set.intersection(*map(set, kinds.values()))) > 1:
            first = {pattern: next(iter(of.values())) for pattern, of in kinds.items()}
            alike = len({tuple(headings_of(path, profile).values()) for path in first.values()}) == 1
            return {} if alike and any(holds_channels(path, profile.file) for path in first.values()) else first
    return {}


def _kinds(files: Sequence[Path], in_folders: bool) -> dict[str, dict[str, Path]]:
    """Return files by what a profile calls their kind, and by their test: its folder, or a number in their names."""
    kinds: dict[str, dict[str, Path]] = {}
    for path in [path for path in files if not re.search(r"[{}*]", path.name)]:
        number = re.search("[0-9]+", path.stem)
        if in_folders:
            kinds.setdefault(f"{{run}}/{path.name}", {})[str(path.parent)] = path
        elif number is not None:
            kind = f"{path.name[: number.start()]}{{run}}{path.name[number.end() :]}"
            kinds.setdefault(kind, {})[f"{path.parent}/{number[0]}"] = path
    return kinds


def with_files(guess: Profile, columns: Mapping[str, Mapping[int, Heading]]) -> Profile:
    """Return a profile with the file of each channel by the columns of each kind of file, as far as they tell it."""
    headings = {kind: [*of.values()] for kind, of in columns.items()}
    channels, free = dict(guess.channels), [*headings]
    for role in _ROLES:
        own = {kind: [name for name in of if name[1].role == role] for kind, of in headings.items()}
        stem = [kind for kind in free if role_of(Path(kind).stem.replace("{run}", "")) == role]
        kinds = [kind for kind in free if own[kind]] or stem
        if len(kinds) != 1:
            continue
        free.remove(kinds[0])
        channels[role] = _channel(kinds[0], own[kinds[0]] or headings[kinds[0]])
    open_roles = [role for role in _ROLES if not channels.get(role, Channel()).file]
    if len(free) == len(open_roles) == 1:
        channels[open_roles[0]] = _channel(free[0], headings[free[0]])
    time = channels.get("time", Channel()).column
    if not all(any(time in (name, header.name) for name, header in of) for of in headings.values()):
        channels.pop("time", None)
    return guess.model_copy(update={"channels": channels})


def _channel(kind: str, columns: Sequence[Heading]) -> Channel:
    """Return a channel of a file, with the only column of it that is no time."""
    others = [(name, header) for name, header in columns if header.role != "time"]
    if len(others) != 1:
        return Channel(file=kind)
    return Channel(file=kind, column=others[0][0], unit=others[0][1].unit or None)
