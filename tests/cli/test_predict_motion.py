"""`mrdamper predict --motion`: the motion as it stands in its file, its cycles, and what a file may be refused for."""

import json
import re
from types import MappingProxyType

import numpy as np
import pytest
from support.command import mrdamper
from support.dampers import joint_damper, modified_damper

from mrdamper.dampers.model_file import save_model
from mrdamper.dampers.streaming import stepper
from mrdamper.data import Condition
from mrdamper.errors import InputError
from mrdamper.physics.motion import measured_motion, sine
from mrdamper.physics.simulation import simulate
from mrdamper.rig_files.motion_file import load_motion
from mrdamper.study.limits import Limits
from mrdamper.study.proposal import Proposal

TIME = np.arange(2001) / 500
BUMP = 8e-3 * np.exp(-(((TIME - 1.5) / 0.15) ** 2))
TONES = 6e-3 * np.sin(2 * np.pi * TIME) + 4e-3 * np.sin(2 * np.pi * 2.6 * TIME)
MOTIONS = MappingProxyType({"sine": 9e-3 * np.sin(5 * TIME), "bump": BUMP, "tones": TONES, "ramp": 2e-3 * TIME})


@pytest.fixture(scope="module", params=["joint", "modified"])
def damper(request):
    return joint_damper() if request.param == "joint" else modified_damper()


@pytest.fixture
def predicted(damper, tmp_path):
    """A function from the columns of a motion to the JSON of its prediction, and its messages."""
    save_model(damper, tmp_path / "model.json")

    def predict(name="motion.csv", *options, **columns):
        rows = np.column_stack(list(columns.values()))
        np.savetxt(tmp_path / name, rows, "%.12g", ",", header=",".join(columns), comments="")
        done = mrdamper("predict", tmp_path / "model.json", "--motion", tmp_path / name, "--json", *options)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout), done.stderr

    return predict


def forces(told):
    return np.array([row["force_N"] for row in told["samples"]])


@pytest.mark.parametrize("shift", [0.0, 0.010])
@pytest.mark.parametrize("name", MOTIONS)
def test_the_force_is_that_of_the_motion_as_it_stands(predicted, damper, tmp_path, name, shift):
    x = MOTIONS[name] + shift
    told, said = predicted("motion.csv", "--current", 0.4, time_s=TIME, displacement_m=x)
    motion = measured_motion(load_motion(tmp_path / "motion.csv", 0.4))
    assert np.max(np.abs(np.array([row["displacement_m"] for row in told["samples"]]) - x)) < 2e-5  # smoothed alone
    expected = damper.predict(motion)
    np.testing.assert_allclose(forces(told), expected.force, rtol=1e-9, atol=1e-9)
    assert ("mm from mid-stroke" in said) == (shift > 0 or name in ("bump", "ramp"))
    if damper.one_model is not None:
        arrays = simulate(damper.one_model, motion).force
        np.testing.assert_allclose(forces(told), arrays, rtol=1e-9, atol=1e-9)
    if damper.one_model is not None or not expected.is_sine:
        stream, steps = stepper(damper), np.diff(TIME, prepend=TIME[0] - 2e-3)
        channels = (motion.displacement, motion.velocity, motion.acceleration, motion.current, steps)
        stepped = [stream.step_motion(*sample) for sample in zip(*(c.tolist() for c in channels), strict=True)]
        most = 1e-9 if damper.conditional else 3e-3  # arrays may put a reversal elsewhere between two samples
        np.testing.assert_allclose(forces(told), stepped, rtol=0, atol=most * np.ptp(stepped))


def test_another_middle_of_the_motion_changes_the_force_by_the_stiffness():
    damper = joint_damper("bouc-wen")
    at = sine(Condition(0.4, 1.0, 0.008), cycles=3)
    one, other = (damper.predict(at.about(-shift)).force for shift in (0.0, 0.010))
    assert np.ptp(other - one) < 1e-6 * np.ptp(one)
    assert np.mean(other - one) == pytest.approx(damper.fitted_parameters["k1"].value * 0.010, rel=1e-6)


@pytest.mark.parametrize(("frequency", "amplitude"), [(0.5, 0.018), (3.0, 0.004)])
def test_a_planned_record_has_the_amplitude_and_the_energy_of_its_condition(predicted, damper, frequency, amplitude):
    limits = Limits((0, 1), (0.1, 10), (1e-3, 0.1))
    condition = Condition(0.4, frequency, amplitude)
    motion, force = Proposal(1, condition, 1.0, "").record(limits, damper)
    columns = {"time_s": motion.time, "displacement_m": motion.displacement}
    told, said = predicted(**columns, force_N=force, current_A=motion.current)
    seen = damper.predict(motion)
    assert seen.is_sine
    assert (seen.condition.frequency_Hz, seen.condition.amplitude_m) == pytest.approx((frequency, amplitude), rel=2e-3)
    assert "mid-stroke" not in said
    np.testing.assert_allclose(forces(told), force, atol=0.02 * np.ptp(force))
    loop = damper.predict(condition)
    energy = np.trapezoid(loop.force * loop.motion.velocity, loop.motion.time)
    assert told["energy_per_cycle_J"]["value"] == pytest.approx(energy, rel=0.01)


@pytest.mark.parametrize("name", ["bump", "tones", "ramp"])
def test_a_motion_without_cycles_has_the_energy_of_its_record(predicted, name):
    told, said = predicted("motion.csv", "--current", 0.4, time_s=TIME, displacement_m=MOTIONS[name])
    assert told.keys() == {"peak_force_N", "dissipated_energy_J", "level", "samples"}
    x = np.array([row["displacement_m"] for row in told["samples"]])
    assert told["dissipated_energy_J"]["value"] == pytest.approx(np.trapezoid(forces(told), x), rel=1e-2)
    assert told["dissipated_energy_J"]["low"] is None
    assert "J over the record" in said
    assert "per cycle" not in said


def written(path, heading, rows, separator=","):
    path.write_text("\n".join([heading, *(separator.join(row) for row in rows)]) + "\n", encoding="utf-8")
    return path


ROWS = [[f"{t:.3f}", f"{1e3 * x:.6f}", "0.4"] for t, x in zip(TIME, TONES, strict=True)]
METRES = [[t, f"{float(x) / 1e3:.9f}", a] for t, x, a in ROWS]
DECIMAL_COMMAS = [[cell.replace(".", ",") for cell in row] for row in ROWS]


@pytest.mark.parametrize(
    ("heading", "rows", "separator"),
    [
        ("time_s,displacement_m,current_A", METRES, ","),
        ("Time [s],Displacement [mm],Current [A]", ROWS, ","),
        ("time_s;displacement_mm;current_A", DECIMAL_COMMAS, ";"),
        ("Zeit in s\tWeg in mm\tStrom in A", ROWS, "\t"),
    ],
)
def test_headings_and_units_are_read_as_an_import_reads_them(tmp_path, heading, rows, separator):
    run = load_motion(written(tmp_path / "motion.csv", heading, rows, separator))
    np.testing.assert_allclose(run.displacement, TONES, atol=1e-9)
    assert (run.time[-1], run.current_A) == pytest.approx((TIME[-1], 0.4))


SI = "time_s,displacement_m,current_A"


@pytest.mark.parametrize(
    ("heading", "rows", "says"),
    [
        (SI, [*METRES[:70], [METRES[70][0], "nan", "0.4"], *METRES[71:]], r"displacement of 1 .* missing.* line 72"),
        (SI, [*METRES[:70], [METRES[70][0], "", "0.4"], *METRES[71:]], r"displacement of 1 .* missing.* line 72"),
        (SI, ROWS, r"motion\.csv: column displacement moves 20 m peak to peak; .*displacement_mm"),
        ("time,displacement,current", METRES, r"'time' has no unit; name the columns and their units"),
        ("time_s,velocity_m_s,current_A", METRES, r"displacement .*; name the columns and their units"),
        ("time_s,displacement_m,temperature_C", METRES, "no current; give --current A"),
        (SI, [*METRES[:70], [METRES[70][0], "broken", "0.4"], *METRES[71:]], "line 72"),
    ],
)
def test_a_refused_motion_names_the_place_and_a_remedy_that_works(tmp_path, heading, rows, says):
    save_model(joint_damper(), tmp_path / "model.json")
    file = written(tmp_path / "motion.csv", heading, rows)
    done = mrdamper("predict", tmp_path / "model.json", "--motion", file)
    assert done.returncode == 2
    assert re.search(says, done.stderr), done.stderr
    assert "profile" not in done.stderr


@pytest.mark.parametrize(
    ("option", "name", "says"),
    [("--plot", "loop.gif", "end the name in"), ("--out", "typo/force.csv", "no such folder; make it")],
)
def test_a_place_that_cannot_be_written_to_is_refused_before_the_prediction(tmp_path, option, name, says):
    save_model(joint_damper(), tmp_path / "model.json")
    at = ("--current", 0.4, "--frequency", 1, "--amplitude", 8)
    done = mrdamper("predict", tmp_path / "model.json", *at, option, tmp_path / name)
    assert done.returncode == 2
    assert says in done.stderr
    assert done.stderr.count("\n") == 1
    assert [file.name for file in tmp_path.iterdir()] == ["model.json"]


def test_a_condition_or_damper_in_place_of_a_prediction_or_model_has_a_remedy():
    damper, at = joint_damper(), Condition(0.4, 1.0, 0.008)
    with pytest.raises(InputError, match=r"a Condition in place of a prediction; give damper\.predict"):
        damper.prediction_interval(at)
    with pytest.raises(InputError, match=r"a JointDamper in place of a model; .*damper\.predict\(motion\)"):
        simulate(damper, sine(at))
