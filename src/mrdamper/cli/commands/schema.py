"""`mrdamper schema`: the JSON Schema of a file format."""

from __future__ import annotations

import json

import typer

_FORMATS = ("model", "profile", "limits", "about", "fleet", "system", "plan", "results")


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command(epilog="Example: mrdamper schema model > model.schema.json")(schema)


def schema(name: str = typer.Argument(..., help=f"File format: {', '.join(_FORMATS)}.")) -> None:
    """Print the JSON Schema of a file format."""
    from mrdamper.errors import UnknownNameError

    if name not in _FORMATS:
        raise UnknownNameError.of("file format", name, _FORMATS)
    print(json.dumps(_schema(name), indent=1, ensure_ascii=False))


def _schema(name: str) -> dict:
    if name == "model":
        from mrdamper.dampers.model_file import model_schema

        return model_schema()
    if name == "profile":
        from mrdamper.rig_files.profile import Profile

        document = Profile.model_json_schema()
    elif name == "limits":
        document = _limits()
    elif name == "about":
        document = _about()
    elif name == "fleet":
        from mrdamper.fleet.profile import FleetProfile

        document = FleetProfile.model_json_schema()
    elif name in ("plan", "results"):
        document = _written(name)
    else:
        from mrdamper.systems.system_file import SystemDocument

        document = SystemDocument.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **document}


def _limits() -> dict:
    """Limits of the test rig, of the force and of the columns of a fleet, as one file holds them."""
    from pydantic import TypeAdapter

    from mrdamper.fleet.profile import ColumnLimits
    from mrdamper.report.about import Limit
    from mrdamper.rig_files.limits_file import COLUMN_LIMITS, FORCE_LIMITS
    from mrdamper.study.limits import Limits

    force = {**TypeAdapter(Limit).json_schema(), "additionalProperties": False}
    force["properties"]["side"]["enum"] = ["rebound", "compression"]
    parts = {
        FORCE_LIMITS: {"type": "array", "items": force},
        COLUMN_LIMITS: {"type": "object", "additionalProperties": ColumnLimits.model_json_schema()},
    }
    rig = TypeAdapter(Limits).json_schema()["properties"]
    return {"title": "Limits", "type": "object", "properties": {**rig, **parts}, "additionalProperties": False}


def _about() -> dict:
    """Fields of the head of a report: text or numbers."""
    from dataclasses import fields

    from mrdamper.report.about import About

    properties = {field.name: {"type": ["string", "number"]} for field in fields(About)}
    return {"title": "About", "type": "object", "properties": properties, "additionalProperties": False}


def _written(name: str) -> dict:
    """Return schema of the rows of plan.csv, or of made.json in the folder of a result."""
    from pydantic import TypeAdapter

    from mrdamper.data.atomic import ResultRecord
    from mrdamper.study.proposal import PlanRow

    adapter = TypeAdapter(list[PlanRow]) if name == "plan" else TypeAdapter(ResultRecord)
    return adapter.json_schema(mode="serialization")
