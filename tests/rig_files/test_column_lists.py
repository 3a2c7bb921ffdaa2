"""Formats of laboratories as lists of columns: recognised by a mark, named by channel, with the file's own units."""

from collections.abc import Mapping

import numpy as np
import pytest

from mrdamper import register
from mrdamper.discovery import _registries
from mrdamper.errors import InputError
from mrdamper.rig_files.profile import Channel, FileForm, Profile
from mrdamper.rig_files.readers.laboratories import ColumnList
from mrdamper.rig_files.rig_import import import_files, read_run, read_runs


def loop(amplitude: float = 10.0, scale: float = 1.0) -> Mapping[str, np.ndarray]:
    """A test of 4 s at 1 Hz: time [s], displacement [mm], force [N]."""
    t = np.arange(0.0, 4.0, 0.004)
    noise = np.random.default_rng(1).normal(0, 2, t.size)
    v = np.cos(2 * np.pi * t)
    return {
        "t": t,
        "x": amplitude * np.sin(2 * np.pi * t),
        "f": scale * (500 * np.tanh(6 * v) + 100 * v) + noise,
        "v": 2 * np.pi * amplitude * v,
    }


def rows(*columns: np.ndarray, separator: str = "\t") -> str:
    return "".join(separator.join(f"{v:.5f}" for v in row) + "\n" for row in zip(*columns, strict=True))


def test_blocks_of_a_servohydraulic_station_are_tests_with_the_currents_of_their_names(tmp_path):
    text, begin = "MTS793|MPT|ENU|1|2|.|/|:|1|0|0|A\n", 0.0
    for amperes in (0.0, 0.4, 0.8):
        test = loop(scale=1 + amperes)
        text += f"\nData Acquisition: Cyclic {amperes} A 1 Hz\tTime:\t{begin:.4f}\tSec\n"
        text += "Running Time\tAxial Count\tAxial Stroke\tAxial Load\nSec\tcycles\tmm\tkN\n"
        text += rows(test["t"] + begin, np.floor(test["t"]), test["x"], test["f"] / 1e3)
        begin += 40.0
    (tmp_path / "campaign.txt").write_text(text)
    tests = read_runs(tmp_path / "campaign.txt")
    assert [round(float(np.mean(test.current)), 3) for test in tests] == [0.0, 0.4, 0.8]
    assert max(tests[0].force) == pytest.approx(max(loop()["f"]), rel=1e-4)


def test_tests_of_a_shock_dynamometer_beside_each_other_have_the_currents_of_their_titles(tmp_path):
    tests = [loop(), loop(scale=2.0)]
    names = ",".join("Position (in),Force (lbf),Velocity (in/sec)," for _ in tests)
    text = (
        "Shock Dyno 5VS\nSample Rate (Hz),250\n,Test 1: 0.2 A coil, 1 Hz,,,,Test 2: 0.7 A coil, 1 Hz,,,\n,"
        + names
        + "\n"
    )
    cells = [c for test in tests for c in (test["x"] / 25.4, test["f"] / 4.4482216, test["v"] / 25.4)]
    for row in zip(*cells, strict=True):
        text += "," + ",".join(",".join(f"{v:.5f}" for v in row[i : i + 3]) + "," for i in (0, 3)) + "\n"
    (tmp_path / "left.csv").write_text(text)
    found = read_runs(tmp_path / "left.csv")
    assert [round(float(np.mean(test.current)), 3) for test in found] == [0.2, 0.7]
    assert max(found[1].displacement) == pytest.approx(0.010, rel=1e-3)


def test_rows_of_headings_of_a_real_time_recorder_name_channels_whose_names_say_nothing(tmp_path):
    test = loop()
    head = '"sampletime";"0.004 s";;\n"name";"xPiston";"FRod";"iMeas"\n"unit";"mm";"N";"A"\n'
    head += '"data_type";"Float64";"Float64";"Float64"\n"xaxis_unit";"s";;\n"xaxis";"trace_values";;\n'
    current = 0.5 + np.random.default_rng(2).normal(0, 0.005, test["t"].size)
    (tmp_path / "run.csv").write_text(head + rows(test["t"], test["x"], test["f"], current, separator=";"))
    record = read_run(tmp_path / "run.csv")
    assert np.mean(record.current) == pytest.approx(0.5, abs=1e-3)
    assert np.ptp(record.displacement) == pytest.approx(0.020, rel=1e-3)


@pytest.fixture
def own_format():
    """A format of a script, forgotten afterwards."""

    @register
    class OwnRig(ColumnList):
        name = "own-rig"
        title = "our rig's text"
        mark = r"^OURRIG"
        form = FileForm(separator=";", decimal=",")
        columns = (
            ("time", "Ch1 (*)"),
            ("displacement", "Ch2 (mm)"),
            ("force", "Ch3 (*)"),
        )

    yield OwnRig
    registry = _registries["mrdamper.readers"]
    registry._types.pop("own-rig")
    registry._parts.pop("own-rig")


def text_of_own_rig() -> str:
    test = loop()
    return "OURRIG 7\nCh1;Ch2;Ch3\ns;;kN\n" + rows(test["t"], test["x"], test["f"] / 1e3, separator=";").replace(
        ".", ","
    )


def test_a_format_of_a_few_lines_names_the_channels_and_takes_the_units_of_the_file(tmp_path, own_format):
    (tmp_path / "run_0.3A.txt").write_text(text_of_own_rig())
    record = read_run(tmp_path / "run_0.3A.txt")
    assert np.ptp(record.displacement) == pytest.approx(0.020, rel=1e-3)
    assert max(record.force) == pytest.approx(max(loop()["f"]), rel=1e-3)


def test_a_profile_overrules_what_a_format_lists(tmp_path, own_format):
    (tmp_path / "run_0.3A.txt").write_text(text_of_own_rig())
    profile = Profile(channels={"force": Channel(column=3, unit="N")})
    assert max(read_run(tmp_path / "run_0.3A.txt", profile).force) == pytest.approx(max(loop()["f"]) / 1e3, rel=1e-3)


def test_without_the_format_the_same_text_is_refused(tmp_path):
    (tmp_path / "run_0.3A.txt").write_text(text_of_own_rig())
    with pytest.raises(InputError):
        read_run(tmp_path / "run_0.3A.txt")
    assert import_files([tmp_path / "run_0.3A.txt"]).records == ()
