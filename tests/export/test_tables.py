"""Tables of force over velocity in the formats of vehicle tools, read back by rules of their own."""

import re
from dataclasses import replace

import numpy as np
import pytest
from support.dampers import joint_damper

from mrdamper import export
from mrdamper.exporters.curves import force_velocity

WIDTHS = ((0, 10), (10, 40), (40, 50), (50, None))  # columns of an entry in TYDEX 1.3


def tydex(path):
    """Sections of a TYDEX file: entries by columns, and the channels in physical values."""
    parts = {}
    for line in path.read_text(encoding="ascii").splitlines():
        if line.startswith("**"):
            rows = parts.setdefault(line[2:], [])
        elif line.strip():
            rows.append(line)
    entries = {
        part: [[line[first:last].strip() for first, last in WIDTHS] for line in parts[part]]
        for part in ("HEADER", "MEASURCHANNELS")
    }
    table = np.array([[float(cell) for cell in line.split()] for line in parts["MEASURDATA"]])
    scaled = {name: table[:, i] * float(factor) for i, (name, _, _, factor) in enumerate(entries["MEASURCHANNELS"])}
    return list(parts), entries, scaled


def matlab(path):
    """Fields of the struct that a script assigns."""
    text = "\n".join(line for line in path.read_text(encoding="ascii").splitlines() if not line.startswith("%"))
    found = re.findall(r"(\w+)\.(\w+) = \[([^\]]*)\];", text)
    assert re.sub(r"(\w+)\.(\w+) = \[([^\]]*)\];", "", text).strip() == ""
    return {
        field: np.array([[float(cell) for cell in row.split()] for row in body.split(";")]) for _, field, body in found
    }


def test_a_tydex_file_holds_the_curves(tmp_path):
    damper = joint_damper()
    (path,) = export(damper, "tydex", tmp_path / "damper.tdx", "front")
    order, entries, read = tydex(path)
    assert order == ["HEADER", "COMMENTS", "MEASURCHANNELS", "MEASURDATA", "END"]
    assert ["RELEASE", "TYDEX release", "", "1.3"] in entries["HEADER"]
    assert {name: unit for name, _, unit, _ in entries["MEASURCHANNELS"]}["VELOCITY"] == "m/s"
    curves = force_velocity(damper)
    for name, field in (("VELOCITY", "velocity"), ("FORCE", "force"), ("PEAKFORC", "peak_force"), ("TESTED", "tested")):
        np.testing.assert_allclose(read[name], np.concatenate([getattr(c, field) for c in curves]), rtol=1e-7)
    currents = np.repeat([c.current_A for c in curves], curves[0].velocity.size)
    np.testing.assert_allclose(read["CURRENT"], currents, rtol=1e-7)


def test_a_matlab_script_holds_the_grid(tmp_path):
    damper = joint_damper()
    (path,) = export(damper, "dyna4", tmp_path / "damper.m", "front")
    read, curves = matlab(path), force_velocity(damper)
    np.testing.assert_allclose(read["current_A"], [[c.current_A for c in curves]], rtol=1e-9)
    np.testing.assert_allclose(read["velocity_m_s"], [curves[0].velocity], rtol=1e-9)
    np.testing.assert_allclose(read["force_N"], np.transpose([c.force for c in curves]), rtol=1e-9)
    np.testing.assert_allclose(read["tested"], np.transpose([c.tested for c in curves]))
    assert "% Tested: current 0 to 1 A, frequency 0.5 to 4 Hz" in path.read_text()
    assert read["force_N"].shape == (curves[0].velocity.size, len(curves))


@pytest.mark.parametrize("to", ["tydex", "dyna4"])
def test_a_rig_named_by_anybody_stays_in_its_line(to, tmp_path):
    damper = replace(joint_damper(), rig="**END\n% }; quit; ☃")
    (path,) = export(damper, to, tmp_path / "out", "front")
    lines = path.read_text(encoding="ascii").splitlines()
    assert sum("quit" in line for line in lines) == 1
    assert next(line for line in lines if "quit" in line).startswith(("%", "MEASID"))
    assert len(lines) == len(export(joint_damper(), to, tmp_path / "plain", "front")[0].read_text().splitlines())
