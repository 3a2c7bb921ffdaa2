"""Parts of a limits file: force limits, limits of fleet columns and limits of the test rig in one TOML file."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any

from mrdamper.errors import InputError

FORCE_LIMITS = "limit"  # [[limit]] tables, for reports and studies
COLUMN_LIMITS = "limits"  # [limits.COLUMN] tables, for fleets
RIG_LIMITS = (
    "current_A", "frequency_Hz", "amplitude_mm", "velocity_m_s", "force_N", "cycles", "sample_rate_Hz",
    "minutes_between", "session_minutes", "sessions",
)  # fmt: skip
_KEYS = (FORCE_LIMITS, COLUMN_LIMITS, *RIG_LIMITS)


class LimitsError(InputError):
    """A limits file cannot be read, or a limit is impossible."""

    code = "E_LIMITS"


def require_known_keys(table: Mapping[str, Any], refuse: type[InputError], where: str) -> None:
    """Refuse the content of a limits file called `where` with a key of no part, by an error of the class `refuse`."""
    for name in table:
        if name not in _KEYS:
            same = [key for key in RIG_LIMITS if key.split("_")[0] == name.split("_")[0]]
            near = same[:1] or get_close_matches(name, _KEYS, 1, 0.5)
            unit = ": the unit is part of the name" if same else ""
            remedy = f"did you mean {near[0]}?{unit}" if near else "mrdamper init limits shows the keys"
            raise refuse(f"unknown key {name}", where=where, remedy=remedy)
