"""`mrdamper models`: list of the damper models."""

from __future__ import annotations

import json

import typer

from mrdamper.cli.output import aligned
from mrdamper.errors import UnknownNameError

app = typer.Typer()


@app.command(epilog="Example: mrdamper models spencer")
def models(
    name: str | None = typer.Argument(None, help="Show this model in full; default: list all."),
    as_json: bool = typer.Option(False, "--json", help="Print JSON."),
) -> None:
    """List the models, or show equation, parameters and source of one."""
    from mrdamper.dampers.published import all_published
    from mrdamper.models import all_models

    types = {**all_models(), **all_published()}
    if name and name not in types:
        raise UnknownNameError.of("model", name, types)
    chosen = [types[name]] if name else list(types.values())
    if as_json:
        print(json.dumps([_entry(model) for model in chosen], indent=1, ensure_ascii=False))
    elif name:
        print(_page(chosen[0]))
    else:
        print("\n".join(aligned([_cells(model) for model in chosen], (0, 1, 2))))
        print("\nmrdamper models NAME shows the equation, the parameters and the source.")


def _cells(model) -> tuple[str, str, str]:
    if not hasattr(model, "parameters"):
        start = (
            f"parameter functions; starts from individual fits of {model.basis}"
            if model.basis
            else "regression without a physical model"
        )
        return model.name, model.heading, start
    free = [info.name for info in model.parameters() if not info.preset]
    return model.name, model.title, f"{len(free):2} free: {' '.join(free)}"


def _page(model) -> str:
    notes = (model.__doc__ or "").strip().replace("\n    ", "\n")
    if hasattr(model, "parameters"):
        title, equation = model.title, model.equation
        rows = [("parameter", "unit", "bounds", "determined", "meaning")]
        for info in model.parameters():
            low, high = info.bounds
            way = "preset" if info.preset else "solved" if info.linear else "searched"
            if info.preset and info.default is not None:
                way += f" {info.default:g}"
            rows.append((info.name, info.unit, f"{low:g} ... {high:g}", way, info.meaning))
        facts = aligned(rows, range(len(rows[0])))
    else:
        title, equation = model.heading, model.__dict__.get("equation", "")
        facts = [f"limits: {model.limits}", f"source: {model.source}"]
        if unverified := getattr(model, "unverified", ""):
            facts.append(f"not verified against the publication: {unverified}")
    lines = [f"{model.name}: {title}", "", notes, "", *facts]
    return "\n".join([*lines, "", f"LaTeX: {equation}"] if equation else lines)


def _entry(model) -> dict:
    from mrdamper.data.encoding import finite

    if not hasattr(model, "parameters"):
        head = {"name": model.name, "title": model.heading, "equation": model.__dict__.get("equation", "")}
        unverified = getattr(model, "unverified", "") or None
        further = {"limits": model.limits, "unverified": unverified, "basis": model.basis or None}
        return head | {"source": model.source} | further | {"parameters": []}
    facts = ("name", "unit", "meaning", "bounds", "linear", "preset", "default")
    parameters = [
        {fact: getattr(info, fact) for fact in facts}
        | {"bounds": [finite(bound) for bound in info.bounds], "default": finite(info.default)}
        for info in model.parameters()
    ]
    head = {fact: getattr(model, fact) for fact in ("name", "title", "equation", "source")}
    return head | {"parameters": parameters}
