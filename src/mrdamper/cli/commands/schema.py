"""`mrdamper schema`: the JSON Schema of a file format."""

from __future__ import annotations

import json
from pkgutil import resolve_name
from typing import Any

import typer

from mrdamper.errors import UnknownNameError

_FORMATS = ("model", "profile", "limits", "about", "fleet", "system", "plan", "results")
_TYPES = {
    "profile": "rig_files.profile:Profile",
    "about": "report.about:About",
    "fleet": "fleet.profile:FleetProfile",
    "system": "systems.system_file:SystemDocument",
    "plan": "study.proposal:PlanRow",
    "results": "data.atomic:ResultRecord",
}
_WRITTEN = ("plan", "results")  # by mrdamper; the others are read


app = typer.Typer()


@app.command(epilog="Example: mrdamper schema model > model.schema.json")
def schema(name: str = typer.Argument(..., help=f"File format: {', '.join(_FORMATS)}.")) -> None:
    """Print the JSON Schema of a file format."""
    if name not in _FORMATS:
        raise UnknownNameError.of("file format", name, _FORMATS)
    print(json.dumps(_schema(name), indent=1, ensure_ascii=False))


def _schema(name: str) -> dict:
    from pydantic import TypeAdapter

    if name == "model":
        from mrdamper.dampers.model_file import model_schema

        return model_schema()
    if name == "limits":
        document = _limits()
    else:
        kind: Any = resolve_name(f"mrdamper.{_TYPES[name]}")
        adapter = TypeAdapter(list[kind] if name == "plan" else kind)  # pyright: ignore[reportInvalidTypeForm]
        document = adapter.json_schema(mode="serialization" if name in _WRITTEN else "validation")
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **document}


def _limits() -> dict:
    """Limits of the test rig, of the force and of the columns of a fleet, as one file holds them."""
    from pydantic import TypeAdapter

    from mrdamper.fleet.profile import ColumnLimits
    from mrdamper.report.about import Limit
    from mrdamper.rig_files.strict_toml import COLUMN_LIMITS, FORCE_LIMITS
    from mrdamper.study.limits import Limits

    parts = {
        FORCE_LIMITS: {"type": "array", "items": Limit.model_json_schema()},
        COLUMN_LIMITS: {"type": "object", "additionalProperties": ColumnLimits.model_json_schema()},
    }
    rig = TypeAdapter(Limits).json_schema()["properties"]
    return {"title": "Limits", "type": "object", "properties": {**rig, **parts}, "additionalProperties": False}
