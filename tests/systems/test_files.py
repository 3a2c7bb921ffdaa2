"""Systems as files, what is wrong with them, and results as files."""

import csv
import json
import re
from collections import Counter

import numpy as np
import pytest
from support.dampers import joint_damper
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.dampers.model_file import save_model
from mrdamper.errors import InputError
from mrdamper.systems.system_file import bundled_systems, load_system

TWO = """
[[storey]]
mass_kg = 100
stiffness_N_m = 4e5
damping_N_s_m = 50
[[storey]]
mass_kg = 80
stiffness_N_m = 3e5
damping_N_s_m = 40
[[damper]]
name = "east"
above = "floor1"
below = "ground"
"""
MATRICES = """
[building]
mass_kg = {M}
damping_N_s_m = {C}
stiffness_N_m = {K}
"""
GOOD = {"M": "[100, 80]", "C": "[[90, -40], [-40, 40]]", "K": "[[7e5, -3e5], [-3e5, 3e5]]"}


def test_storeys_are_the_matrices_they_stand_for(tmp_path):
    (tmp_path / "a.toml").write_text(TWO)
    (tmp_path / "b.toml").write_text(MATRICES.format(**GOOD))
    one, other = (load_system(tmp_path / name).system for name in ("a.toml", "b.toml"))
    for letter in "MCK":
        assert np.array_equal(getattr(one, letter), getattr(other, letter))


REFUSED = {
    "a mass of nothing": (MATRICES.format(**{**GOOD, "M": "[100, 0]"}), "E_MASS"),
    "a negative mass": (TWO.replace("mass_kg = 80", "mass_kg = -80"), "E_MASS"),
    "stiffness not symmetric": (MATRICES.format(**{**GOOD, "K": "[[7e5, -3e5], [-2e5, 3e5]]"}), "E_STIFFNESS"),
    "stiffness that pushes": (MATRICES.format(**{**GOOD, "K": "[[1e5, -3e5], [-3e5, 3e5]]"}), "E_STIFFNESS"),
    "damping that pushes": (MATRICES.format(**{**GOOD, "C": "[[-90, 0], [0, 40]]"}), "E_DAMPING"),
    "a shape that does not fit": (MATRICES.format(**{**GOOD, "C": "[[90]]"}), "E_STRUCTURE"),
    "rows of different length": (MATRICES.format(**{**GOOD, "C": "[[90, 1], [1]]"}), "E_STRUCTURE"),
    "a floor that is missing": (TWO.replace('"floor1"', '"floor7"'), "E_POINT"),
    "a damper between one floor": (TWO.replace('"ground"', '"floor1"'), "E_POINT"),
    "a unit that is wrong": (TWO.replace("mass_kg = 80", "mass_kg = 1e-300"), "E_STIFFNESS"),
    "a word that is unknown": (TWO + 'colour = "red"\n', "E_STRUCTURE"),
    "no structure": ('title = "nothing"\n', "E_STRUCTURE"),
    "no TOML": ("[[storey]\n", "E_STRUCTURE"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_system_that_is_impossible_is_refused(case, tmp_path):
    text, code = REFUSED[case]
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(InputError) as refused:
        load_system(tmp_path / "s.toml")
    assert refused.value.code == code
    assert refused.value.remedy


def test_what_ships_with_the_package_can_be_read():
    assert {"dyke1996", "quarter-car", "half-car"} <= set(bundled_systems())
    for name in bundled_systems():
        assert load_system(name).system.frequencies_Hz()[0] > 0
    with pytest.raises(InputError, match="dyke1996"):
        load_system("dyke96")


def test_a_report_with_controllers_side_by_side(tmp_path, monkeypatch):
    monkeypatch.setattr("mrdamper.report.plots.simulation._LOOP_POINTS", 300)
    save_model(joint_damper(), tmp_path / "model.json")
    (tmp_path / "frame.toml").write_text(TWO)
    time = np.arange(0, 1, 0.01)
    rows = "".join(f"{t:.2f},{np.sin(20 * t):.6f}\n" for t in time)
    (tmp_path / "quake.csv").write_text("time_s,acceleration_m_s2\n" + rows)
    done = CliRunner().invoke(
        application(),
        ["simulate", str(tmp_path / "frame.toml"), "--input", str(tmp_path / "quake.csv"), "--damper",
         str(tmp_path / "model.json"), "--control", "skyhook", "--compare", "sh-add:crossover_Hz=3",
         "--compare", "skyhook", "--out", str(tmp_path / "out"), "--json"],
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    printed = json.loads(done.stdout)
    with (tmp_path / "out/histories.csv").open(encoding="utf-8") as file:
        histories = list(csv.DictReader(file))
    assert max(abs(float(row["floor2.a"])) for row in histories) == printed["peak_acceleration_m_s2"][1]
    page = (tmp_path / "out/simulation.html").read_text(encoding="utf-8")
    assert "crossover_Hz 3" in page
    assert "J8" in page
    assert f'<tr><td>input</td><td class="wrap">{tmp_path / "quake.csv"}</td></tr>' in page
    assert "of the first 4 of 5 controllers" in page
    assert '<td class="text">floor1: peak span</td><td class="text">mm</td>' in page
    assert "ISO 2631" not in page  # a building
    with (tmp_path / "out/measures.csv").open(encoding="utf-8") as file:
        table = {row["measure"]: row for row in csv.DictReader(file)}
    with (tmp_path / "out/figures/spectra.csv").open(encoding="utf-8") as file:
        loops = Counter(row["y_is"] for row in csv.DictReader(file))["force (N)"]
    assert 300 < loops <= 6 * 300 < len(histories)  # those of all laws together
    peak = float(table["floor2.peak_acceleration_m_s2"]["skyhook, on and off"])
    assert peak == printed["peak_acceleration_m_s2"][1]  # the law simulated is the law compared
    best = min((float(v), k) for k, v in table["cost_m_s2"].items() if k != "measure")
    assert best[1] == "optimum with the whole record known"


def test_the_constant_current_and_the_comparison_are_printed(tmp_path):
    save_model(joint_damper(), tmp_path / "model.json")
    bare = ["simulate", "quarter-car", "--input", "bump"]
    assert "Quarter car, without dampers\n" in CliRunner().invoke(application(), [*bare, "--without-damper"]).output
    ask = [*bare, "--damper", str(tmp_path / "model.json")]
    assert "passive, constant current 0 A\npeak values:\n" in CliRunner().invoke(application(), ask).output
    given = [*ask, "--current", "0.3", "--compare", "skyhook-continuous", "--out", str(tmp_path / "out")]
    printed = CliRunner().invoke(application(), given).output
    assert "passive, constant current 0.3 A\n" in printed
    assert re.search(r"no current +0 %\n.*skyhook, continuous +-?\d+ %\n.*optimum.* 100 %\n", printed, re.DOTALL)


def test_options_that_contradict_each_other(tmp_path):
    save_model(joint_damper(), tmp_path / "model.json")
    base = ["simulate", "quarter-car", "--input", "bump"]
    for extra, word in (
        ([], "E_NO_DAMPER"),
        (["--damper", str(tmp_path / "model.json"), "--volts", "1"], "driver"),
        (["--damper", str(tmp_path / "model.json"), "--volts", "1", "--current", "1"], "--current beside"),
        (["--damper", str(tmp_path / "model.json"), "--control", "skyhok"], "skyhook"),
        (["--damper", str(tmp_path / "model.json"), "--current", "inf"], "--current inf"),
        (["--without-damper", "--damper", "m.json"], "E_OPTION"),
        (["--without-damper", "--step", "nan"], "E_STEP"),
        (["--without-damper", "--step", "0"], "E_STEP"),
        (["--without-damper", "--step", "1e-12"], "E_STEP"),
        (["--without-damper", "--draws", "10"], "--draws without a damper"),
        (["--damper", str(tmp_path / "model.json"), "--draws", "10"], "E_CERTAINTY"),
        (["--damper", str(tmp_path / "model.json"), "--fmu", str(tmp_path / "law.fmu")], "no law to export"),
        (["--without-damper", "--compare", "all"], "--out"),
        (["--without-damper", "--time-scale", "5"], "E_RECORD"),
    ):
        done = CliRunner().invoke(application(), base + extra)
        assert isinstance(done.exception, InputError)
        assert word in str(done.exception)


def test_a_tyre_in_a_wrong_unit_is_refused_instead_of_simulated_for_ever(tmp_path):
    text = bundled_systems()["quarter-car"].read_text()
    stiff = tmp_path / "car.toml"
    stiff.write_text(re.sub(r"tyre_N_m = .*", "tyre_N_m = 1e12", text))
    with pytest.raises(InputError, match="natural frequency") as caught:
        load_system(stiff)
    assert "units" in caught.value.remedy
