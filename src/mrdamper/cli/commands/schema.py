"""`mrdamper schema`: the JSON Schema of a file format."""

from __future__ import annotations

import json

import typer

_FORMATS = ("model", "profile", "fleet", "system")


def register(app: typer.Typer) -> None:
    """Add the command."""

    @app.command(epilog="Example: mrdamper schema model > model.schema.json")
    def schema(
        name: str = typer.Argument(..., help=f"File format: {', '.join(_FORMATS)}."),
    ) -> None:
        """Print the JSON Schema of a saved model, profile or system."""
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
    elif name == "fleet":
        from mrdamper.fleet.profile import FleetProfile

        document = FleetProfile.model_json_schema()
    else:
        from mrdamper.systems.system_file import SystemDocument

        document = SystemDocument.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **document}
