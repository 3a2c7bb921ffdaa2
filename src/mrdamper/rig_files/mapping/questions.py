"""Questions that a refusal leaves open, with numbered answers, and the profile that an answer makes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from mrdamper.errors import InputError
from mrdamper.rig_files.profile import Channel, CurrentSource, Profile
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
    """A possible answer: how it is shown, the lines of the profile it stands for, and the change it makes."""

    shown: str
    lines: str
    channel: str = ""
    change: tuple[tuple[str, object], ...] = ()

    def applied(self, profile: Profile) -> Profile:
        """Return the profile with this answer."""
        if not self.channel:
            return profile.model_copy(update={"current": CurrentSource(**dict(self.change))})  # type: ignore[arg-type]
        settings = profile.channel(self.channel).model_dump(exclude_unset=True, exclude_none=True)
        channel = Channel(**{**settings, **dict(self.change)})  # type: ignore[arg-type]
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
    if role not in DIMENSION:
        return None
    if error.code == "E_UNITS_MISSING":
        units = _UNITS.get(DIMENSION[role], ())
        return Question(f"{error.found}. Unit of the {role}?", tuple(_answer(role, "unit", unit) for unit in units))
    if error.code in ("E_COLUMN", "E_AMBIGUOUS", "E_DUPLICATE_COLUMN"):
        named = [name for name in columns if name and list(columns).count(name) == 1]
        answers = [_answer(role, "column", name) for name in named]
        answers += [_answer(role, "column", i) for i, name in enumerate(columns, 1) if name not in named]
        return Question(f"{error.found}. Which column is the {role}?", tuple(answers)) if answers else None
    if error.code in ("E_SIGN_CONVENTION", "E_DISSIPATION_SIGN"):
        return Question(f"{error.found}. Sign of the {role}?", (_answer(role, "sign", 1), _answer(role, "sign", -1)))
    return None


def _answer(role: str, key: str, value: str | int) -> Answer:
    shown = f'"{value}"' if isinstance(value, str) else str(value)
    return Answer(str(value), f"[channels.{role}] {key} = {shown}", role, ((key, value),))
