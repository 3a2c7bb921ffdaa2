"""The command line as a user types it: exit status, one-line errors, whole files."""

import csv
import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.command import mrdamper
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.cli.commands import validate
from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.model_file import save_model
from mrdamper.dampers.modified import ModifiedModel
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.data import Dataset
from mrdamper.identification import identify
from mrdamper.models.bingham import Bingham
from mrdamper.physics.motion import equivalent_sine
from mrdamper.rig_files.dataset_folder import load_dataset, save_dataset
from mrdamper.statistics.functions.forms import ParameterFunction


@pytest.fixture
def model(tmp_path):
    functions = {
        "c": ParameterFunction("constant", (1000.0,)),
        "fy": ParameterFunction("linear-current", (900.0, 100.0)),
        "f0": ParameterFunction("constant", (50.0,)),
    }
    envelope = Envelope((0.0, 1.0), (0.5, 5.0), (0.002, 0.03), (0.03, 0.25))
    save_model(ModifiedModel(ParameterMap(Bingham, functions), rig="utfsm", envelope=envelope), tmp_path / "model.json")
    return tmp_path / "model.json"


@pytest.mark.parametrize("command", ["", "study", "identify", "predict", "validate"])
def test_help_has_an_example(command):
    done = mrdamper(*command.split(), "--help")
    assert done.returncode == 0
    assert "mrdamper" in done.stdout
    if command:
        assert f"Example: mrdamper {command}" in done.stdout


def test_every_command_has_one_uncut_line_in_a_terminal_of_80_columns():
    lines = mrdamper("--help").stdout.splitlines()
    commands = {line.split()[0]: line for line in lines if line.startswith("  ") and line[2:3].isalpha()}
    names = {c.name or c.callback.__name__ for c in application().registered_commands}
    assert {name.strip("_") for name in names} <= set(commands)
    for name in names:
        line = commands[name.strip("_")]
        assert len(line) <= 80
        assert line.endswith((".", "(2024)."))
        assert "..." not in line
    assert [line for line in lines if line.endswith(":") and not line.startswith(" ")] == [
        "Options:", "Data:", "Identify:", "Use:", "Export:", "More:",
    ]  # fmt: skip


def test_a_process_ends_with_the_same_status_and_line():
    """The other tests here share one process."""
    done = subprocess.run(
        [sys.executable, "-m", "mrdamper", "identify", "--fix", "n"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stderr == mrdamper("identify", "--fix", "n").stderr
    assert done.stderr.count("\n") == 1


def test_a_process_says_its_version_and_survives_that_nobody_can_hear():
    command = [sys.executable, "-m", "mrdamper"]
    said = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True).stdout
    assert said.startswith("mrdamper ")
    if Path("/dev/full").exists():
        with Path("/dev/full").open("w") as full:  # the last line does not reach the disk
            assert subprocess.run([*command, "models"], stdout=full, stderr=full, check=False).returncode == 2


def test_predict_at_a_condition(model, tmp_path):
    out = tmp_path / "force.csv"
    done = mrdamper("predict", model, "--current", 0.5, "--frequency", 2, "--amplitude", 10, "--out", out)
    assert done.returncode == 0, done.stderr
    with out.open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0])[:5] == ["time_s", "displacement_m", "velocity_m_s", "current_A", "force_N"]
    assert max(float(r["displacement_m"]) for r in rows) == pytest.approx(0.01)
    peak = 1000 * 2 * np.pi * 2 * 0.01 + 550 + 50
    assert max(float(r["force_N"]) for r in rows) == pytest.approx(peak, rel=1e-3)


def test_predict_along_a_motion_from_a_file(model, tmp_path):
    t = np.linspace(0, 2, 801)
    motion = tmp_path / "motion.csv"
    lines = [f"{a},{b}" for a, b in zip(t, 0.01 * np.sin(4 * np.pi * t), strict=True)]
    motion.write_text("time_s,displacement_m\n" + "\n".join(lines) + "\n")
    done = mrdamper("predict", model, "--motion", motion, "--current", 0.5, "--json")
    assert done.returncode == 0, done.stderr
    assert len(json.loads(done.stdout)["samples"]) == 801
    refused = mrdamper("predict", model, "--motion", motion)
    assert refused.returncode == 2
    assert "give --current A" in refused.stderr


def test_extrapolation_is_warned_of_and_flagged(model):
    done = mrdamper("predict", model, "--current", 2, "--frequency", 2, "--amplitude", 10, "--json")
    assert done.returncode == 0
    assert "warning: current 2 A lies above the tested range (" in done.stderr
    told = json.loads(done.stdout)
    assert told["samples"][0]["extrapolation"] == "current"
    assert told["peak_force_N"]["value"] > 0
    assert told["peak_force_N"]["low"] is None  # nothing is known of this model's errors


@pytest.mark.parametrize(
    ("option", "value", "remedy"),
    [("--frequency", "-1", "give a positive number"), ("--amplitude", "0", "give a positive number"),
     ("--frequency", "nan", "give a positive number"), ("--current", "-1", "give zero or more")],
)  # fmt: skip
def test_a_condition_that_no_test_has_is_refused_with_a_remedy_that_works(model, option, value, remedy):
    given = {"--current": "0.5", "--frequency": "2", "--amplitude": "10"} | {option: value}
    refused = mrdamper("predict", model, *(word for pair in given.items() for word in pair))
    assert refused.returncode == 2
    assert f"{option} {value}; {remedy}" in refused.stderr


def test_a_forgotten_prefix_of_a_unit_is_suggested(model):
    done = mrdamper("predict", model, "--current", 500, "--frequency", 2, "--amplitude", 0.01)
    assert "500 mA are 0.5 A" in done.stderr
    assert "0.01 m are 10 mm" in done.stderr


def test_a_gap_in_the_motion_and_coarse_sampling_are_said(model, tmp_path):
    t = np.concatenate([np.linspace(0, 1, 200), np.linspace(3, 4, 200)])
    rows = "".join(f"{a},{0.01 * np.sin(6 * a)},0.5\n" for a in t)
    (tmp_path / "gap.csv").write_text("time_s,displacement_m,current_A\n" + rows)
    done = mrdamper("predict", model, "--motion", tmp_path / "gap.csv")
    assert done.returncode == 2
    assert "a gap of 2 s after 1 s" in done.stderr
    assert "[E_TIME_GAP]" in done.stderr


def test_a_current_that_replaces_a_column_is_stated(model, tmp_path):
    time = np.arange(200) / 100
    columns = np.column_stack([time, 0.01 * np.sin(6 * time), np.full(200, 0.3)])
    np.savetxt(tmp_path / "m.csv", columns, delimiter=",", header="time_s,displacement_m,current_A", comments="")
    given = mrdamper("predict", model, "--motion", tmp_path / "m.csv", "--current", "0.8")
    assert "note: --current 0.8 replaces the column current_A" in given.stderr
    assert "replaces" not in mrdamper("predict", model, "--motion", tmp_path / "m.csv").stderr


def test_validate_scores_the_models_rig(model):
    done = mrdamper("validate", model, "--split", "validate", "--json")
    assert done.returncode == 0, done.stderr
    rows = json.loads(done.stdout)
    assert {r["run_id"][:3] for r in rows} == {"utf"}
    assert {"nrmse_pp", "nrmse_std", "wape", "energy_error", "extrapolation"} <= set(rows[0])
    assert "median nrmse_pp" in done.stderr
    assert "; runs corrected for their session: 0" in done.stderr
    other = mrdamper("validate", model, "--rig", "labcontrol", "--split", "validate")
    assert other.stdout.count("lab_") == 7


def test_a_lag_is_not_asked_of_constant_currents(tmp_path):
    done = mrdamper("study", "--lag", "--out", tmp_path / "result")
    assert done.returncode == 2
    assert "the current is constant in every identification run" in done.stderr
    assert "[E_LAG]" in done.stderr


def test_identify_chosen_runs_with_a_fixed_parameter(tmp_path):
    out = tmp_path / "i.csv"
    done = mrdamper("identify", "--run", "utf_5mm4Hz_1A", "--fix", "n=1", "--fix", "k3=0", "--out", out)
    assert done.returncode == 0, done.stderr
    with out.open() as file:
        (row,) = csv.DictReader(file)
    assert float(row["n [-]"]) == 1.0
    assert float(row["nrmse_pp"]) < 0.06


def test_identify_and_check_name_records_of_fewer_than_two_cycles(tmp_path):
    run = load_dataset()["utf_5mm4Hz_1A"].steady()
    short = run.part(0, int(1.5 / equivalent_sine(run).condition.frequency_Hz / (run.time[1] - run.time[0])))
    save_dataset(Dataset((replace(short, window=None), replace(run, id="long"))), tmp_path / "d")
    for command in ("identify", "check"):
        done = mrdamper(command, tmp_path / "d")
        assert done.stderr.count("Fewer than two whole cycles in 1 run: utf_5mm4Hz_1A;") == 1, command
    assert "fewer than two whole cycles" in " ".join(identify(short, "bingham").notes)
    assert "two whole cycles" not in " ".join(identify(run, "bingham").notes)


def test_the_papers_switches_and_a_known_gas_spring():
    run = ("--run", "utf_5mm4Hz_1A", "--json")
    switches = ("--method", "paper", "--set", "search=optimum", "--set", "force_amplitude=half-peak-to-peak")
    (literal,) = json.loads(mrdamper("identify", *run, *switches).stdout)
    (consistent,) = json.loads(mrdamper("identify", *run, "--method", "balance").stdout)
    assert literal["c [N s/m]"] > 1.5 * consistent["c [N s/m]"]
    (tied,) = json.loads(mrdamper("identify", *run, "--gas", "1.5,150,314").stdout)
    assert tied["k1 [N/m]"] == pytest.approx(1.4 * 1.5e6 * 314e-6**2 / 150e-6)


def test_bad_input_is_one_line_and_exit_two(model, tmp_path):
    (tmp_path / "file").write_text("x")
    newer = json.loads(model.read_text()) | {"version": "9.0"}
    (tmp_path / "newer.json").write_text(json.dumps(newer))
    cases = [
        (("study", "nowhere", "--out", tmp_path / "r"), "no such folder"),
        (("study", "--out", tmp_path / "file" / "r"), "choose a folder you may write to"),
        (("identify", "--model", "bouc"), "did you mean bouc-wen?"),
        (("identify", "--method", "projecton"), "did you mean projection?"),
        (("identify", "--fix", "n"), "NAME=VALUE"),
        (("identify", "--run", "utf_5mm4Hz_2A"), "did you mean"),
        (("identify", "--method", "paper", "--set", "phase=peak"), "did you mean peaks?"),
        (("identify", "--method", "paper", "--set", "phases=peaks"), "did you mean phase?"),
        (("identify", "--gas", "1.5,150"), "write --gas P,V,A"),
        (("predict", model), "give --current A --frequency Hz --amplitude mm"),
        (("predict", tmp_path / "newer.json", "--current", 1), "update mrdamper"),
        (("predict", model, "--current", 1, "--frequency", 0, "--amplitude", 10), "--frequency 0; give a positive"),
        (("predict", model, "--motion", tmp_path / "none.csv"), "no such file"),
        (("export", model, "--to", "matlab", "--out", tmp_path / "x"), "Simulink takes fmu or c"),
        (("validate", model, "--rig", "utfms"), "did you mean utfsm"),
        (("validate", model, "--split", "test"), "known: train, validate"),
    ]
    for arguments, text in cases:
        done = mrdamper(*arguments)
        assert done.returncode == 2, (arguments, done.stderr)
        assert text in done.stderr, (arguments, done.stderr)
        assert len([line for line in done.stderr.splitlines() if line.startswith("mrdamper: ")]) == 1, done.stderr
        assert "Traceback" not in done.stderr
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "model.json", "newer.json"]


@pytest.mark.skipif(os.name != "posix", reason="signals as POSIX knows them")
@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)])
def test_a_signal_ends_a_command_with_its_number_and_one_line(name, code):
    script = (
        "import time, mrdamper.cli as c\n"
        "def busy(prog_name):\n    print('up', flush=True)\n    time.sleep(60)\n"
        "c.application = lambda: busy\nc.main()"
    )
    number = getattr(signal, name)
    with subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(number, signal.SIG_DFL),  # under nohup the tests begin with it ignored
    ) as process:  # fmt: skip
        assert process.stdout.readline() == "up\n"
        process.send_signal(number)
        _, said = process.communicate(timeout=20)
    assert process.returncode == code
    assert said == f"mrdamper: ended by {name}; what was not finished is not written\n"


@pytest.mark.skipif(os.name != "posix", reason="limits as POSIX knows them")
def test_too_small_a_limit_of_memory_is_refused_at_once():
    """Under it, libraries for tables abort or sleep for ever."""
    done = subprocess.run(
        ["bash", "-c", f"ulimit -v 1000000; exec {sys.executable} -m mrdamper check"],
        capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert done.returncode == 2
    assert "[E_MEMORY]" in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_reader_that_goes_away_is_no_fault():
    done = subprocess.run(
        ["bash", "-c", f"{sys.executable} -m mrdamper models --json | head -c 1"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.stderr == ""


def test_a_prediction_is_drawn_and_another_kind_of_file_is_refused(model, tmp_path):
    sine = ("predict", model, "--current", 0.5, "--frequency", 2, "--amplitude", 5)
    picture, table, other = (tmp_path / name for name in ("force.svg", "force.csv", "other.csv"))
    assert mrdamper(*sine, "--plot", picture, "--out", table).returncode == 0
    assert "Displacement (mm)" in picture.read_text(encoding="utf-8")
    assert table.is_file()
    refused = mrdamper(*sine, "--plot", tmp_path / "force.gif", "--out", other)
    assert refused.returncode == 2
    assert "[E_OUTPUT]" in refused.stderr
    assert not other.exists()


@pytest.mark.parametrize("text", ["0,5", "0.5A"])
def test_a_number_with_a_comma_or_a_unit_is_refused_with_the_way_to_write_it(text):
    got = CliRunner().invoke(application(), ["predict", "m.json", "--current", text])
    assert (got.exit_code, "with a decimal point and without a unit" in got.stderr) == (2, True)


def test_a_rig_without_a_name_is_called_so(capsys):
    dataset = load_dataset().rig("utfsm")
    assert tuple(validate._rig(dataset, None, "").rigs) == ("utfsm",)
    assert capsys.readouterr().err.startswith("the model is of a rig without a name; scoring the dataset's only rig, ")
    assert tuple(validate._rig(dataset, "utfsm", "").rigs) == ("utfsm",)
    assert capsys.readouterr().err == ""
