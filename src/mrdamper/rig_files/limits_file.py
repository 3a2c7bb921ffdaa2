"""Parts of a limits file: force limits, limits of fleet columns and limits of the test rig in one TOML file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ConfigDict, create_model

from mrdamper.errors import InputError
from mrdamper.rig_files.strict_toml import load_toml

FORCE_LIMITS = "limit"  # [[limit]] tables, for reports and studies
COLUMN_LIMITS = "limits"  # [limits.COLUMN] tables, for fleets
RIG_LIMITS = (
    "current_A", "frequency_Hz", "amplitude_mm", "velocity_m_s", "force_N", "cycles", "sample_rate_Hz",
    "minutes_between", "session_minutes", "sessions",
)  # fmt: skip


class LimitsError(InputError):
    """A limits file cannot be read, or a limit is impossible."""

    code = "E_LIMITS"


def load_part(path: str | Path, part: Mapping[str, Any], refuse: type[InputError] = LimitsError) -> dict[str, Any]:
    """Read the keys of one part of a limits file, each given by its type and default; keys of other parts may be there.

    Raises `refuse` if the file cannot be read, is no TOML, or a key is unknown, missing or of another kind.
    """
    others: dict[str, Any] = {name: (Any, None) for name in (FORCE_LIMITS, COLUMN_LIMITS, *RIG_LIMITS)}
    kind = create_model("Limits", __config__=ConfigDict(extra="forbid"), **{**others, **part})
    content = load_toml(Path(path), kind, refuse, "mrdamper init limits shows the keys")
    return {name: getattr(content, name) for name in part}
