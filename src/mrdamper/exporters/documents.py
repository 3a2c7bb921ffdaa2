"""Equations and parameter table: LaTeX, which requires amsmath only, and Markdown."""

from __future__ import annotations

from typing import Any, ClassVar

from mrdamper.dampers.base import Damper
from mrdamper.dampers.joint import damper_of
from mrdamper.data.encoding import latex, markdown
from mrdamper.data.parameters import latex_symbol
from mrdamper.exporters.base import Exporter, Written
from mrdamper.exporters.equations import equations, number, unit_text
from mrdamper.exporters.templates import render
from mrdamper.models import Model

_ROUNDED = ("numbers are rounded to five digits; model.json has them all",)


class LatexExporter(Exporter):
    """A section of LaTeX."""

    name: ClassVar[str] = "latex"
    title: ClassVar[str] = "LaTeX equations and parameters"
    suffix: ClassVar[str] = ".tex"

    def export(self, damper: Damper | Model, name: str) -> Written:
        facts = document_facts(damper)
        facts |= {key: latex(text) for key, text in facts.items() if isinstance(text, str)}
        for row in facts["parameters"]:
            row |= {"meaning": latex(row["meaning"]), "unit": unit_text(row["unit"])}
        return Written({f"{name}.tex": render("equations.tex.j2", **facts).encode()}, _ROUNDED)


class MarkdownExporter(Exporter):
    """Markdown with equations between dollar signs."""

    name: ClassVar[str] = "markdown"
    title: ClassVar[str] = "Markdown equations and parameters"
    suffix: ClassVar[str] = ".md"

    def export(self, damper: Damper | Model, name: str) -> Written:
        facts = document_facts(damper)
        facts["rig"] = markdown(facts["rig"])
        for row in facts["parameters"]:
            row["meaning"] = row["meaning"].replace("|", r"\|")
        return Written({f"{name}.md": render("equations.md.j2", **facts).encode()}, _ROUNDED)


def document_facts(given: Damper | Model) -> dict[str, Any]:
    """Collect the values of a page of equations, for any markup."""
    damper = damper_of(given)
    rows = [
        {"symbol": info.symbol, "value": number(value), "unit": info.unit, "meaning": info.meaning}
        for model in filter(None, [damper.one_model])
        for info, value in zip(model.parameters(), model.values().values(), strict=True)
    ]
    rows += [
        {"symbol": latex_symbol(name), "value": number(value), "unit": "", "meaning": "SI"}
        for name, value in damper.numbers.items()
    ]
    return {
        "title": damper.title,
        "source": damper.source,
        "rig": damper.rig,
        "equations": equations(damper),
        "parameters": rows,
        "ranges": list(damper.envelope.ranges(" to ").items()) if damper.envelope.tested else [],
    }
