"""Force over velocity and current as a MATLAB script: the lookup table of a damper in a Simulink vehicle model.

DYNA4 takes characteristics of dampers as vectors and matrices of MATLAB. The names of its parameters differ from
model to model and are not published; those written here are this program's, and no vehicle tool was tried.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

from mrdamper.dampers.base import Damper
from mrdamper.dampers.joint import damper_of
from mrdamper.data.encoding import c_comment
from mrdamper.export.base import Exporter, Written
from mrdamper.export.curves import force_velocity
from mrdamper.models import Model


class Dyna4Exporter(Exporter):
    """One MATLAB script that defines a struct with two axes and a matrix of forces."""

    name: ClassVar[str] = "dyna4"
    title: ClassVar[str] = "DYNA4-style lookup table of force (MATLAB script)"
    suffix: ClassVar[str] = ".m"

    def export(self, damper: Damper | Model, name: str) -> Written:
        curves = force_velocity(damper)
        matrix = ";\n  ".join(_numbers(row) for row in zip(*(curve.force for curve in curves), strict=True))
        lines = [
            f"% {c_comment(damper_of(damper).rig or name)}: computed by mrdamper from an identified model",
            f"% Sines of {1e3 * curves[0].amplitude_m:.4g} mm: force at mid-stroke, positive in extension",
            f"{name}.current_A = [{_numbers(curve.current_A for curve in curves)}];",
            f"{name}.velocity_m_s = [{_numbers(curves[0].velocity)}];",
            f"% A row for each velocity, a column for each current [N]:\n{name}.force_N = [\n  {matrix}];\n",
        ]
        note = "assign the vectors to the parameters of your vehicle model; such a table has no hysteresis"
        return Written({f"{name}.m": "\n".join(lines).encode("ascii", "replace")}, (note,))


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{value:.10g}" for value in values)
