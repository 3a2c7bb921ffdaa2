"""Profile of a population: position of serial numbers, master dampers, limits."""

from __future__ import annotations

import re
from collections.abc import Collection
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import BaseModel, Field, field_validator, model_validator

from mrdamper.rig_files.profile import ProfileError
from mrdamper.rig_files.strict_toml import COLUMN_LIMITS, load_part, load_toml

COLUMNS: dict[str, tuple[str, ...]] = {
    "serial": ("serial", "serial_number", "serial_no", "sn"),
    "session": ("session", "session_id"),
    "batch": ("batch", "lot"),
    "date": ("date", "tested_at", "recorded_at"),
    "golden": ("golden",),
}
FACTS = tuple(COLUMNS)
_TRUE = ("true", "yes", "1")
_HELP = "correct it; docs/how-to/fleet.md shows every key"


class FleetProfile(BaseModel, extra="forbid", frozen=True):
    """The fleet profile, a TOML file; every key may be left out."""

    # pattern of the names of folders or files: {serial}, {session}, {batch}, {date}, and * for anything:
    # "{batch}_{serial}_*"
    names: str | None = None
    columns: dict[str, str] = Field(default_factory=dict)  # column of the table by fact: serial = "SN"
    golden: tuple[str, ...] = ()  # serial numbers of the master dampers, tested in every session to monitor the rig
    rig: str | None = None  # rig profile for rig files, relative to this file

    @field_validator("columns")
    @classmethod
    def _facts_exist(cls, columns: dict[str, str]) -> dict[str, str]:
        for name in columns:
            if name not in FACTS:
                raise ValueError(f"no fact is called {name!r}; known: {', '.join(FACTS)}")
        return columns

    @field_validator("names")
    @classmethod
    def _pattern_names_the_serial(cls, names: str | None) -> str | None:
        if names is not None:
            fields = re.findall(r"\{(\w*)\}", names)
            if "serial" not in fields or len(set(fields)) < len(fields) or not set(fields) <= set(FACTS):
                raise ValueError(f"a pattern needs {{serial}}, and each of {', '.join(FACTS)} at most once")
        return names

    @cached_property
    def _expression(self) -> re.Pattern[str] | None:
        if self.names is None:
            return None
        parts = re.split(r"(\{\w+\}|\*)", self.names)
        inner = "".join(
            ".*?" if p == "*" else f"(?P<{p[1:-1]}>[^_]+?)" if p.startswith("{") else re.escape(p) for p in parts
        )
        return re.compile(inner)

    def of_name(self, name: str) -> dict[str, str] | None:
        """Read the facts a name states; None if the pattern does not fit it."""
        if self._expression is None:
            return {"serial": name}
        match = self._expression.fullmatch(name)
        return None if match is None else match.groupdict()

    def of_columns(self, row: dict[str, Any]) -> dict[str, str]:
        """Read the facts a row of a table states; empty cells state nothing."""
        cells = {column: str(cell).strip() for column, cell in row.items() if cell is not None and str(cell).strip()}
        return {fact: cells[column] for fact in FACTS if (column := self.column_of(fact, cells))}

    def column_of(self, fact: str, columns: Collection[str]) -> str | None:
        """Return the column of a table that states a fact."""
        wanted = (self.columns[fact],) if fact in self.columns else COLUMNS[fact]
        return next((name for name in wanted if name in columns), None)

    def is_golden(self, facts: dict[str, str]) -> bool:
        """Tell if a damper is a master damper."""
        return facts["serial"] in self.golden or facts.get("golden", "").lower() in _TRUE


class ColumnLimits(BaseModel, extra="forbid", frozen=True):
    """Lowest and highest allowed value of a column; one of them may be left out."""

    lower: float | None = Field(default=None, allow_inf_nan=False)
    upper: float | None = Field(default=None, allow_inf_nan=False)

    @model_validator(mode="after")
    def _lower_lies_below(self) -> ColumnLimits:
        if self.lower is None and self.upper is None:
            raise ValueError("give lower, upper or both")
        if self.lower is not None and self.upper is not None and self.lower >= self.upper:
            raise ValueError(f"lower {self.lower:g} is not below upper {self.upper:g}")
        return self


def load_fleet_profile(path: str | Path | None) -> FleetProfile:
    """Read a fleet profile, the default without a path; raises `ProfileError` on an unknown key or value."""
    if path is None:
        return FleetProfile()
    profile = load_toml(Path(path), FleetProfile, ProfileError, _HELP)
    if profile.rig is None:
        return profile
    return profile.model_copy(update={"rig": str(Path(path).absolute().parent / profile.rig)})


def load_limits(path: str | Path) -> dict[str, ColumnLimits]:
    """Read the [limits.COLUMN] tables of a limits file; raises `LimitsError` on an unknown key or a wrong limit."""
    return load_part(path, {COLUMN_LIMITS: (dict[str, ColumnLimits], ...)})[COLUMN_LIMITS]
