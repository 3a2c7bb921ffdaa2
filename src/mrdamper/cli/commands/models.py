"""`mrdamper models`: what there is to choose from."""

from __future__ import annotations

import typer


def register(app: typer.Typer) -> None:
    """Add the command."""

    @app.command(epilog="Example: mrdamper models spencer")
    def models(
        name: str | None = typer.Argument(None, help="Show this model in full; default: list all."),
        as_json: bool = typer.Option(False, "--json", help="Print JSON a program can read."),
    ) -> None:
        """List the damper models, or show one: equation, parameters with units and bounds, source."""
        from mrdamper.models import all_models, model_type

        chosen = [model_type(name)] if name else list(all_models().values())
        if as_json:
            import json

            print(json.dumps([_entry(model) for model in chosen], indent=1, ensure_ascii=False))
        elif name:
            print(_page(chosen[0]))
        else:
            print("\n".join(_line(model) for model in chosen))
            print("\nmrdamper models NAME shows the equation, the parameters and the source.")


def _line(model) -> str:
    free = [info.name for info in model.parameters() if not info.preset]
    return f"{model.name:18} {model.title:30} {len(free):2} free: {' '.join(free)}"


def _page(model) -> str:
    rows = [("parameter", "unit", "bounds", "determined", "meaning")]
    for info in model.parameters():
        low, high = info.bounds
        way = "preset" if info.preset else "solved" if info.linear else "searched"
        if info.preset and info.default is not None:
            way += f" {info.default:g}"
        rows.append((info.name, info.unit, f"{low:g} ... {high:g}", way, info.meaning))
    widths = [max(len(row[i]) for row in rows) for i in range(4)]
    table = ["  ".join([*(cell.ljust(w) for cell, w in zip(row, widths, strict=False)), row[4]]) for row in rows]
    notes = (model.__doc__ or "").strip()
    return "\n".join(
        [f"{model.name}: {model.title}", "", notes.replace("\n    ", "\n"), "", *table, "", f"LaTeX: {model.equation}"]
    )


def _entry(model) -> dict:
    import math

    def plain(value):
        return value if value is not None and math.isfinite(value) else None

    return {
        "name": model.name,
        "title": model.title,
        "equation": model.equation,
        "source": model.source,
        "parameters": [
            {
                "name": info.name,
                "unit": info.unit,
                "meaning": info.meaning,
                "bounds": [plain(bound) for bound in info.bounds],
                "linear": info.linear,
                "preset": info.preset,
                "default": plain(info.default),
            }
            for info in model.parameters()
        ],
    }
