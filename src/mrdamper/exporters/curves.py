"""Force over velocity, one curve for each current: as CSV tables, and in the layouts of vehicle tools.

The files were not tested in vehicle tools. The blocks of Adams are recalled from public examples. The layout of TYDEX
is that of release 1.3 (Unrau and Zamow, 1997), which defines channels of tyres only; the names of these channels are
defined here. DYNA4 takes vectors and matrices of MATLAB, under names that differ from model to model.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.joint import damper_of
from mrdamper.data import Condition, Floats
from mrdamper.data.encoding import c_comment, csv_text, rows_of
from mrdamper.errors import InputError
from mrdamper.exporters.base import Exporter, Written
from mrdamper.exporters.templates import render
from mrdamper.models import Model

_COLUMNS = ("velocity_m_s", "force_N", "peak_force_N", "tested")
_SPEEDS, _CURRENTS = 12, 6
_MIN_VELOCITY_SHARE = 0.02  # of the highest tested velocity


class TableExporter(Exporter):
    """One CSV of all currents, and one grid with a row per velocity and a column per current."""

    name: ClassVar[str] = "table"
    title: ClassVar[str] = "force–velocity tables (CSV)"

    def export(self, damper: Damper | Model, name: str) -> Written:
        curves = force_velocity(damper)
        rows = [row for curve in curves for row in curve.rows]
        grid = [
            {"velocity_m_s": float(v)} | {f"force_N_at_{c.current_A:g}_A": float(c.force[i]) for c in curves}
            for i, v in enumerate(curves[0].velocity)
        ]
        note = f"sines of {1e3 * curves[0].amplitude_m:.3g} mm, force at mid-stroke; no hysteresis in such a table"
        files = {f"{name}_force_velocity.csv": csv_text(rows), f"{name}_grid.csv": csv_text(grid)}
        return Written({file: text.encode() for file, text in files.items()}, (note,))


class AdamsExporter(Exporter):
    """Damper property files: mm/s and N, velocity and force positive in extension."""

    name: ClassVar[str] = "adams"
    title: ClassVar[str] = "Adams-style damper property files"

    def export(self, damper: Damper | Model, name: str) -> Written:
        files = {}
        for curve in force_velocity(damper):
            half = curve.velocity.size // 2
            outside = 1e3 * curve.velocity[~curve.tested]
            at_rest = float(curve.force[half - 1 : half + 1].mean())
            points = [*zip(1e3 * curve.velocity[:half], curve.force[:half], strict=True), (0.0, at_rest)]
            points += zip(1e3 * curve.velocity[half:], curve.force[half:], strict=True)
            text = render("damper.dmp.j2", tested=_tested(damper), outside=outside, curve=curve, points=points)
            files[f"{name}_{curve.current_A:.3g}A.dmp".replace("-", "minus")] = text.encode("ascii", "replace")
        return Written(files, ("the curves contain no hysteresis; c and fmu do",))


class TydexExporter(Exporter):
    """One TYDEX-style file with the curves of all currents."""

    name: ClassVar[str] = "tydex"
    title: ClassVar[str] = "TYDEX-style table of force over velocity"
    suffix: ClassVar[str] = ".tdx"

    def export(self, damper: Damper | Model, name: str) -> Written:
        rows = [row for curve in force_velocity(damper) for row in curve.rows]
        text = render("damper.tdx.j2", rig=c_comment(damper_of(damper).rig or name), rows=rows)
        note = "channel names are not part of the TYDEX standard; such a table has no hysteresis"
        return Written({f"{name}.tdx": text.encode("ascii", "replace")}, (note,))


class Dyna4Exporter(Exporter):
    """One MATLAB script that defines a struct with two axes and a matrix of forces."""

    name: ClassVar[str] = "dyna4"
    title: ClassVar[str] = "DYNA4-style lookup table of force (MATLAB script)"
    suffix: ClassVar[str] = ".m"

    def export(self, damper: Damper | Model, name: str) -> Written:
        curves, rig = force_velocity(damper), c_comment(damper_of(damper).rig or name)
        matrix = np.transpose([curve.force for curve in curves])
        inside = np.transpose([curve.tested for curve in curves]).astype(int)
        facts = {"tested": _tested(damper), "inside": inside, "matrix": matrix}
        text = render("damper.m.j2", rig=rig, name=name, curves=curves, **facts)
        note = "assign the vectors to the parameters of your vehicle model; such a table has no hysteresis"
        return Written({f"{name}.m": text.encode("ascii", "replace")}, (note,))


def _tested(damper: Damper | Model) -> str:
    return ", ".join(f"{title} {span}" for title, span in damper_of(damper).envelope.ranges(" to ").items())


@dataclass(frozen=True, eq=False)
class ForceVelocity:
    """Forces at mid-stroke of sines of one amplitude and rising frequency."""

    current_A: float
    amplitude_m: float
    velocity: Floats  # (K,) [m/s], from the highest in compression (negative) to the highest in extension
    force: Floats  # (K,) [N]
    peak_force: Floats  # (K,), largest force of the loop in the direction of that velocity [N]
    tested: np.ndarray  # (K,), whether the sine lies inside the tested ranges

    @property
    def rows(self) -> list[dict[str, float]]:
        """The curve as rows of a table."""
        head = {"current_A": self.current_A, "amplitude_m": self.amplitude_m}
        columns = (self.velocity, self.force, self.peak_force, self.tested.astype(int))
        return [head | row for row in rows_of(dict(zip(_COLUMNS, columns, strict=True)))]


def force_velocity(given: Damper | Model) -> list[ForceVelocity]:
    """Force over velocity at mid-stroke, as measured by a damper dynamometer.

    Six currents over the tested range; twelve peak velocities up to the highest tested, from a fiftieth of it, evenly
    in the logarithm. Raises `InputError` (E_EXPORT) if the damper has no tested ranges.
    """
    damper = damper_of(given)
    envelope = damper.envelope
    if not envelope.tested:
        raise InputError("a model without tested ranges", remedy="export a saved damper", code="E_EXPORT")
    amplitude = float(np.sqrt(np.prod(envelope.amplitude_m)))
    highest = envelope.peak_velocity_m_s[1]
    speeds = np.geomspace(_MIN_VELOCITY_SHARE * highest, highest, _SPEEDS)
    currents = np.unique(np.linspace(*envelope.current_A, _CURRENTS))
    return [_curve(damper, float(current), amplitude, speeds) for current in currents]


def _curve(damper: Damper, current: float, amplitude: float, speeds: Floats) -> ForceVelocity:
    rows = []
    for speed in speeds:
        prediction = damper.predict(Condition(current, float(speed / (2 * np.pi * amplitude)), amplitude))
        v, force = prediction.motion.velocity, prediction.force
        out, back = int(np.argmax(v)), int(np.argmin(v))
        rows.append((force[back], force[out], force.min(), force.max(), not prediction.extrapolation))
    back, out, lowest, highest, tested = (np.array(column) for column in zip(*rows, strict=True))
    return ForceVelocity(
        current,
        amplitude,
        np.concatenate([-speeds[::-1], speeds]),
        np.concatenate([back[::-1], out]),
        np.concatenate([lowest[::-1], highest]),
        np.concatenate([tested[::-1], tested]),
    )
