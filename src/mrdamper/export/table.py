"""Lookup tables as CSV: force over velocity and current."""

from __future__ import annotations

import csv
import io
from typing import ClassVar

from mrdamper.dampers.base import Damper
from mrdamper.export.base import Exporter, Written
from mrdamper.export.curves import force_velocity
from mrdamper.models import Model

COLUMNS = ("current_A", "amplitude_m", "velocity_m_s", "force_N", "peak_force_N", "tested")


class TableExporter(Exporter):
    """One CSV of all currents, and one grid with a row a velocity and a column a current."""

    name: ClassVar[str] = "table"
    title: ClassVar[str] = "force–velocity tables (CSV)"

    def export(self, damper: Damper | Model, name: str) -> Written:
        curves = force_velocity(damper)
        rows = [
            (repr(c.current_A), repr(c.amplitude_m), repr(float(v)), repr(float(f)), repr(float(p)), int(t))
            for c in curves
            for v, f, p, t in zip(c.velocity, c.force, c.peak_force, c.tested, strict=True)
        ]
        heads = ["velocity_m_s", *(f"force_N_at_{c.current_A:g}_A" for c in curves)]
        grid = [[repr(float(v)), *(repr(float(c.force[i])) for c in curves)] for i, v in enumerate(curves[0].velocity)]
        note = f"sines of {1e3 * curves[0].amplitude_m:.3g} mm, force at mid-stroke; no hysteresis in such a table"
        files = {f"{name}_force_velocity.csv": _csv(COLUMNS, rows), f"{name}_grid.csv": _csv(heads, grid)}
        return Written(files, (note,))


def _csv(head, rows) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(rows)
    return text.getvalue().encode()
