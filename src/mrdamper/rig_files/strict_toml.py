"""TOML files that people write, by their schema: profiles, limits."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError, create_model

from mrdamper.data.strict_text import content_of, read_toml
from mrdamper.errors import InputError

T = TypeVar("T", bound=BaseModel)
FORCE_LIMITS = "limit"  # [[limit]] tables, for reports and studies
COLUMN_LIMITS = "limits"  # [limits.COLUMN] tables, for fleets
RIG_LIMITS = (
    "current_A", "frequency_Hz", "amplitude_mm", "velocity_m_s", "force_N", "cycles", "sample_rate_Hz",
    "minutes_between", "session_minutes", "sessions",
)  # fmt: skip


def load_toml(path: Path, kind: type[T], refuse: type[InputError], help: str, largest: int = 2**16) -> T:
    """Read a TOML file of at most so many bytes by its schema; `help` is where its keys are shown.

    Raises `refuse` if it cannot be read, is no TOML, or holds a key or value that is not known.
    """
    try:
        text = content_of(path, largest, refuse, "a TOML file").decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise refuse("is no UTF-8 text", where=path.name, remedy="save it as UTF-8") from error
    return parse_toml(text, kind, refuse, help, path.name)


def parse_toml(text: str, kind: type[T], refuse: type[InputError], help: str, where: str) -> T:
    """Parse a TOML text by its schema; arguments as `load_toml`, `where` names its origin."""
    try:
        table = read_toml(text)
    except tomllib.TOMLDecodeError as error:
        remedy = "write every section and every key once" if "Cannot" in str(error) else "correct the TOML"
        raise refuse(str(error) or "nested too deeply", where=where, remedy=remedy) from error
    return checked_table(table, kind, refuse, help, where)


def checked_table(table: Mapping[str, Any], kind: type[T], refuse: type[InputError], help: str, where: str) -> T:
    """Check a table by its schema; arguments as `parse_toml`. Of several errors a misspelt key is named first."""
    try:
        return kind.model_validate(table)
    except ValidationError as error:
        errors = error.errors(include_url=False, include_context=False)
        first = next((one for one in errors if one["type"] == "extra_forbidden"), errors[0])
        place = re.sub(r"\.(\d+)", lambda index: f" {int(index[1]) + 1}", ".".join(map(str, first["loc"])))
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        unknown = first["type"] == "extra_forbidden"
        problem = f"unknown key {place}" if unknown else f"{place}: {first['msg'].removeprefix('Value error, ')}"
        near = _nearest(kind, first["loc"]) if unknown else ""
        raise refuse(problem + near + more, where=where, remedy=help) from error


def _nearest(kind: type[BaseModel], place: tuple[int | str, ...]) -> str:
    """Return the known key that is written most like an unknown one, as a question; empty if none is near."""
    fields: Any = kind.model_fields
    for part in place[:-1]:
        types = _models(fields[part].annotation) if isinstance(part, str) and part in fields else []
        fields = types[0].model_fields if types else fields
    near = difflib.get_close_matches(str(place[-1]), list(fields), 1, 0.6)
    return f" (did you mean {near[0]}?)" if near else ""


def _models(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for inner in get_args(annotation) for model in _models(inner)]


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
