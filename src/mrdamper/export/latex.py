"""Equations and parameter table for a paper: LaTeX that needs amsmath only."""

from __future__ import annotations

from typing import Any, ClassVar

from mrdamper.dampers.base import Damper
from mrdamper.export.base import Exporter, Written, rig_of
from mrdamper.export.formulas import formulas
from mrdamper.export.latex_writer import equations, number, symbol, unit_text
from mrdamper.export.templates import render
from mrdamper.files.encoding import latex
from mrdamper.models import Model


class LatexExporter(Exporter):
    """A section of LaTeX."""

    name: ClassVar[str] = "latex"
    title: ClassVar[str] = "LaTeX equations and parameters"
    suffix: ClassVar[str] = ".tex"

    def export(self, damper: Damper | Model, name: str) -> Written:
        facts = document_facts(damper)
        escaped = {key: latex(text) for key, text in facts.items() if isinstance(text, str)}
        rows = [
            {**row, "meaning": latex(row["meaning"]), "unit": unit_text(row["unit"])} for row in facts["parameters"]
        ]
        text = render("equations.tex.j2", **{**facts, **escaped, "parameters": rows})
        return Written({f"{name}.tex": text.encode()}, ("numbers are rounded to five digits; model.json has them all",))


def document_facts(damper: Damper | Model) -> dict[str, Any]:
    """What a page of equations says of a damper, for any markup."""
    made = formulas(damper)
    return {
        "title": made.title,
        "source": made.source,
        "rig": rig_of(damper),
        "equations": equations(made),
        "parameters": [
            {"symbol": symbol(info.name), "value": number(value), "unit": info.unit, "meaning": info.meaning}
            for info, value in made.parameters.items()
            if not (info.preset and value == info.default)
        ],
        "ranges": _ranges(damper),
    }


def _ranges(damper: Damper | Model) -> list[tuple[str, str]]:
    if isinstance(damper, Model):
        return []
    envelope = damper.envelope
    return [
        (title, f"{scale * low:.4g} to {scale * high:.4g} {unit}")
        for title, (low, high), scale, unit in (
            ("current", envelope.current_A, 1, "A"),
            ("frequency", envelope.frequency_Hz, 1, "Hz"),
            ("amplitude", envelope.amplitude_m, 1e3, "mm"),
            ("peak velocity", envelope.peak_velocity_m_s, 1, "m/s"),
        )
    ]
