"""Plans: records inside the limits and the hours, each with a reason, that shrink the doubt."""

import csv
import sys
from pathlib import Path

import numpy as np
import pytest
from support.dampers import joint_damper
from support.sessions import session_runs
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.dampers.covariance import certain
from mrdamper.errors import InputError
from mrdamper.files.model_file import save_model
from mrdamper.files.motion import load_motion
from mrdamper.study.plan import Limits, first_matrix, plan_tests, read_limits

sys.path.insert(0, str(Path(__file__).parents[2]))
from benchmarks.planning import designs

LIMITS = Limits((0.0, 1.0), (0.5, 4.0), (2.0, 20.0), velocity_m_s=0.2, force_N=1500.0)


@pytest.fixture(scope="module")
def damper():
    return certain(joint_damper(), session_runs(joint_damper()))


def test_every_record_is_allowed_and_shrinks_the_doubt(damper):
    made = plan_tests(damper, LIMITS, 0.5)
    assert made
    assert sum(item.minutes for item in made) <= 30
    assert {item.session for item in made} == {1, 2}
    for item in made:
        assert item.condition.peak_velocity <= 0.2 * (1 + 1e-9)
        assert item.after < item.before
    steps = [item.before for item in made] + [made[-1].after]
    assert np.all(np.diff(steps) < 0)


def test_a_first_matrix_has_a_reason_for_every_row():
    made = first_matrix(LIMITS, 1.0)
    assert len({item.reason for item in made}) == len(made) > 8
    assert all(item.condition.peak_velocity <= 0.2 * (1 + 1e-9) for item in made)
    assert len(first_matrix(LIMITS, 0.1)) < len(made)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("current = [0, 1]", "current_A"),
        ("current_mA = [0, 1000]", "current_A"),
        ("current_A = [1, 0]\nfrequency_Hz = [1, 2]\namplitude_mm = [1, 2]", "in order"),
        ("current_A = [0, 1]\nfrequency_Hz = [1, 2]", "amplitude_mm"),
        ("current_A = [0, 1]\nfrequency_Hz = [1, 2]\namplitude_mm = [2000, 20000]", "µm"),
        ("current_A = [0, 1]\nfrequency_Hz = [1, 2]\namplitude_mm = [10, 20]\nvelocity_m_s = 0.001", "slowest"),
        ("current_A = [0, nan]\nfrequency_Hz = [1, 2]\namplitude_mm = [10, 20]", "current_A"),
        ("current_A = ", "E_LIMITS"),
    ],
)
def test_limits_that_are_none_are_refused(tmp_path, text, says):
    path = tmp_path / "limits.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_limits(path)
    assert "E_LIMITS" in str(caught.value)
    assert says in str(caught.value)


def test_hours_that_hold_no_record_and_models_that_know_nothing_are_refused(damper):
    for hours in (0.001, float("nan"), -1.0):
        with pytest.raises(InputError, match="E_LIMITS"):
            plan_tests(damper, LIMITS, hours)
    with pytest.raises(InputError, match="E_CERTAINTY"):
        plan_tests(joint_damper(), LIMITS, 1.0)


def test_the_records_are_read_back(damper, tmp_path):
    save_model(damper, tmp_path / "m.json")
    asked = ["plan", str(tmp_path / "m.json"), "--hours", "0.2", "--out", str(tmp_path / "next")]
    got = CliRunner().invoke(application(), asked)
    assert got.exit_code == 0, got.output
    assert "existing runs that taught least: r" in got.stdout
    with (tmp_path / "next" / "plan.csv").open() as file:
        listed = list(csv.DictReader(file))
    for row in listed:
        run = load_motion(tmp_path / "next" / row["file"])
        assert np.ptp(run.displacement) / 2 == pytest.approx(1e-3 * float(row["amplitude_mm"]), rel=0.02)
        assert run.current_A == pytest.approx(float(row["current_A"]))
    read = CliRunner().invoke(
        application(),
        ["import", *(str(tmp_path / "next" / row["file"]) for row in listed), "--out", str(tmp_path / "d")],
    )
    assert read.exit_code == 0, read.output


def test_a_plan_of_little_rig_time_beats_chance_and_the_factorial_grid():
    found = designs(0.2, seeds=9)
    assert found["plan"] < 0.7 * found["random records (median)"]
    assert found["plan"] < 0.7 * found["factorial grid"]
    assert found["plan"] < found["plan that ignores drift"] < found["before"]
