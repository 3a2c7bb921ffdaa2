"""Dyke, Spencer, Sain and Carlson (1996): a three-storey frame, printed peaks."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.systems.controllers.passive import Passive
from mrdamper.systems.inputs import load_input
from mrdamper.systems.simulate import SystemLoop, simulate_system
from mrdamper.systems.system_file import load_system

# displacement [cm], drift [cm], acceleration [cm/s²], force [N]
PRINTED = {
    "uncontrolled": ((0.538, 0.820, 0.962), (0.538, 0.319, 0.201), (856, 1030, 1400), None),
    0.0: ((0.211, 0.357, 0.455), (0.211, 0.153, 0.103), (420, 480, 717), 258),
    2.25: ((0.076, 0.196, 0.306), (0.076, 0.158, 0.110), (281, 494, 767), 979),
}


@pytest.mark.parametrize("volts", ["uncontrolled", pytest.param(0.0, marks=pytest.mark.slow), 2.25])
def test_the_printed_table(volts):
    file = load_system("dyke1996")
    dampers = {} if volts == "uncontrolled" else file.dampers
    current = 0.0 if volts == "uncontrolled" else volts / 3
    loop = SystemLoop(file.system, load_input("elcentro", time_scale=5), dampers, Passive(current))
    found = loop.run(1e-3, machine=False)
    x, drift, a, force = PRINTED[volts]
    assert 100 * found.peaks["displacement_m"] == pytest.approx(x, rel=0.04)
    assert 100 * found.peaks["drift_m"] == pytest.approx(drift, rel=0.04)
    assert 100 * found.peaks["acceleration_m_s2"] == pytest.approx(a, rel=0.04)
    if force is not None:
        assert 100 * found.peaks["displacement_m"][1:] == pytest.approx(x[1:], rel=0.01)
        assert found.peaks["force_N"] == pytest.approx([force], rel=0.01)
    assert found.energy_gap < 1e-6


def test_the_command_prints_them(tmp_path):
    record = tmp_path / "slow.csv"
    time = np.arange(0, 3, 0.02)
    pulse = 0.3 * np.sin(2 * np.pi * time) * (time < 1)
    record.write_text(
        "time_s,acceleration_g\n" + "".join(f"{t:.2f},{a:.8g}\n" for t, a in zip(time, pulse, strict=True))
    )
    command = ["simulate", "dyke1996", "--input", str(record), "--time-scale", "5", "--volts", "2.25", "--json"]
    done = CliRunner().invoke(application(), command)
    printed = json.loads(done.stdout)
    file = load_system("dyke1996")
    same = simulate_system(file.system, load_input(record, time_scale=5), file.dampers, Passive(0.75))
    assert printed["peak_drift_m"] == same.peaks["drift_m"].tolist()
    assert printed["peak_force_N"] == same.peaks["force_N"].max()
    assert 0 < printed["step_halving_change"] < 5e-3
    metres = tmp_path / "si.csv"
    metres.write_text(
        "time_s,acceleration_m_s2\n" + "".join(f"{t:.2f},{9.81 * a:.8g}\n" for t, a in zip(time, pulse, strict=True))
    )
    again = json.loads(CliRunner().invoke(application(), [*command[:3], str(metres), *command[4:]]).stdout)
    assert again["peak_acceleration_m_s2"] == pytest.approx(printed["peak_acceleration_m_s2"], rel=1e-6)
