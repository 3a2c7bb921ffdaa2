"""Equations and parameter table for a wiki or a readme."""

from __future__ import annotations

from typing import ClassVar

from mrdamper.dampers.base import Damper
from mrdamper.export.base import Exporter, Written
from mrdamper.export.latex import document_facts
from mrdamper.export.templates import render
from mrdamper.files.encoding import markdown
from mrdamper.models import Model


class MarkdownExporter(Exporter):
    """Markdown with equations between dollar signs."""

    name: ClassVar[str] = "markdown"
    title: ClassVar[str] = "Markdown equations and parameters"
    suffix: ClassVar[str] = ".md"

    def export(self, damper: Damper | Model, name: str) -> Written:
        facts = document_facts(damper)
        facts["rig"] = markdown(facts["rig"])
        rows = [{**row, "meaning": row["meaning"].replace("|", r"\|")} for row in facts["parameters"]]
        text = render("equations.md.j2", **{**facts, "parameters": rows})
        return Written({f"{name}.md": text.encode()}, ("numbers are rounded to five digits; model.json has them all",))
