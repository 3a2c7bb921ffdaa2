"""Questions that a refusal leaves open, with numbered answers, and the profile that an answer makes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from mrdamper.errors import InputError
from mrdamper.rig_files.profile import Channel, Profile
from mrdamper.rig_files.units import DIMENSION

_ROLE = re.compile(r"\[channels\.(\w+)\]")
_UNITS = {
    "time": ("s", "ms", "us"),
    "length": ("mm", "m", "in", "cm"),
    "force": ("N", "kN", "lbf", "kgf"),
    "current": ("A", "mA"),
    "velocity": ("m/s", "mm/s"),
}


@dataclass(frozen=True, slots=True)
class Answer:
    """A possible answer: what a channel's key in the profile is then."""

    channel: str
    key: str
    value: str | int

    def applied(self, profile: Profile) -> Profile:
        """Return the profile with this answer."""
        settings = profile.channel(self.channel).model_dump(exclude_unset=True, exclude_none=True)
        channel = Channel(**{**settings, self.key: self.value})
        return profile.model_copy(update={"channels": {**profile.channels, self.channel: channel}})


@dataclass(frozen=True, slots=True)
class Question:
    """Question that a file leaves open, and its possible answers."""

    text: str
    answers: tuple[Answer, ...]


def question_of(error: InputError, columns: Sequence[str] = ()) -> Question | None:
    """Return the question behind a refusal that a profile answers; None where the file itself must be corrected.

    The columns are the names of those of the refused file, in order, empty where there is none.
    """
    match = _ROLE.search(error.remedy or "")
    role = match[1] if match else ""
    if role not in DIMENSION or " scale = " in error.remedy:  # with its unit: two keys
        return None
    if error.code == "E_UNITS_MISSING":
        units = _UNITS.get(DIMENSION[role], ())
        return Question(f"{error.found}. Unit of the {role}?", tuple(Answer(role, "unit", unit) for unit in units))
    if error.code in ("E_COLUMN", "E_AMBIGUOUS", "E_DUPLICATE_COLUMN"):
        named = [name for name in columns if name and list(columns).count(name) == 1]
        answers = [Answer(role, "column", name) for name in named]
        answers += [Answer(role, "column", i) for i, name in enumerate(columns, 1) if name not in named]
        return Question(f"{error.found}. Which column is the {role}?", tuple(answers)) if answers else None
    if error.code in ("E_SIGN_CONVENTION", "E_DISSIPATION_SIGN"):
        return Question(f"{error.found}. Sign of the {role}?", (Answer(role, "sign", 1), Answer(role, "sign", -1)))
    return None
