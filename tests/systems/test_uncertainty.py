"""Many dampers in one loop; how fast one answers."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.dampers import ENVELOPE, joint_damper, modified_damper
from support.systems import quarter_car
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.dampers.coil import Coil
from mrdamper.dampers.model_file import save_model
from mrdamper.dampers.modified import ModifiedModel
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.dampers.uncertainty import Uncertainty
from mrdamper.errors import InputError
from mrdamper.models import model_type
from mrdamper.statistics.functions.forms import ParameterFunction
from mrdamper.systems import monte_carlo as many
from mrdamper.systems.controllers.passive import Passive
from mrdamper.systems.inputs import load_input
from mrdamper.systems.inputs.record import record
from mrdamper.systems.monte_carlo import Draw, draw, monte_carlo
from mrdamper.systems.rise_time import rise_times
from mrdamper.systems.simulate import SystemLoop
from mrdamper.systems.structure import Link, shear_building

CAR = quarter_car("car", 300, 40, 20e3, 200e3)
ROAD = load_input("bump", {"length_s": 1.0})


def certain(damper, names, sizes, gain=0.0, offset=0.0):
    logs = tuple(damper.fitted_parameters[name].log for name in names)
    many = np.full(len(names), 1e6)
    return replace(damper, uncertainty=Uncertainty(names, logs, np.diag(sizes) ** 2, many, (), (), gain, offset, 1e6))


DAMPERS = {"joint": (joint_damper(), ("c0", "c1")), "modified": (modified_damper(), ("c.0", "yield_force.3"))}


def test_a_covariance_that_rounding_makes_indefinite_is_drawn():
    """Standard deviations of 2 N and 1e9 N/m, nearly a line."""
    damper = certain(joint_damper(), ("f0", "k"), [2.0, 1e9])
    covariance = np.array([[4.0, 2e9 * (1 - 1e-9)], [2e9 * (1 - 1e-9), 1e18 * (1 - 1e-8)]])
    damper = replace(damper, uncertainty=replace(damper.uncertainty, covariance=covariance))
    offsets = [row["d"].numbers["f0"] - damper.model.f0 for row in draw({"d": damper}, 4000)]
    assert np.std(offsets) == pytest.approx(2.0, rel=0.06)


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_parameters_of_any_size_are_drawn_with_their_correlation(size):
    damper = certain(joint_damper(), ("f0", "k"), [2.0, size])
    damper = replace(damper, model=replace(damper.model, k=0.0))
    covariance = np.array([[4.0, size], [size, size**2]])  # a correlation of a half
    damper = replace(damper, uncertainty=replace(damper.uncertainty, covariance=covariance))
    drawn = np.array([[row["d"].numbers[n] for n in ("f0", "k")] for row in draw({"d": damper}, 4000)])
    assert np.std(drawn, axis=0) == pytest.approx([2.0, size], rel=0.06)
    assert np.corrcoef(drawn.T)[0, 1] == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("dof", [5.0, 40.0])
def test_draws_have_the_variance_of_student(dof):
    """Of d degrees of freedom: d / (d - 2) times the square of the spread, for numbers as for sessions."""
    damper = certain(joint_damper(), ("f0", "k"), [2.0, 30.0], gain=0.04, offset=6.0)
    few = replace(damper.uncertainty, dof=np.array([dof, 1e6]), session_dof=dof)  # the fewest count for all
    drawn = [row["d"] for row in draw({"d": replace(damper, uncertainty=few)}, 20_000, seed=3)]
    wider = np.sqrt(dof / (dof - 2))
    for values, spread in (
        ([one.numbers["f0"] - damper.model.f0 for one in drawn], 2.0),
        ([one.numbers["k"] - damper.model.k for one in drawn], 30.0),
        ([one.gain for one in drawn], 0.04),
        ([one.offset for one in drawn], 6.0),
    ):
        assert np.mean(values) == pytest.approx(0.0, abs=0.05 * spread)
        assert np.std(values) == pytest.approx(wider * spread, rel=0.06)


def test_draws_are_correlated_as_the_covariance_says_be_a_parameter_a_logarithm_or_not():
    damper = certain(joint_damper(), ("f0", "vh"), [2.0, 0.1])
    assert damper.uncertainty.logs == (False, True)
    covariance = np.array([[4.0, 0.16], [0.16, 0.01]])
    drawn = draw({"d": replace(damper, uncertainty=replace(damper.uncertainty, covariance=covariance))}, 4000)
    values = np.array([[row["d"].numbers["f0"], np.log(row["d"].numbers["vh"])] for row in drawn])
    assert np.corrcoef(values.T)[0, 1] == pytest.approx(0.8, abs=0.03)


@pytest.mark.parametrize(("found", "taken"), [(1e-4, 2.5e-4), (4e-4, 8e-4)])
def test_draws_take_twice_the_step_of_the_mean_but_not_less_than_half_the_first(monkeypatch, found, taken):
    steps = []
    monkeypatch.setattr(many, "measures", lambda done: {})
    monkeypatch.setattr(many, "changed", lambda coarse, fine: {})
    run = lambda step, **_: steps.append(step) or SimpleNamespace(peaks={})  # noqa: E731
    loop = SimpleNamespace(first_step=5e-4, run=run, links=(), stages=(), system=None)
    monkeypatch.setattr(many, "_numbers", lambda loop, one: one)
    bands = monte_carlo(loop, [{}, {}], SimpleNamespace(step=found, peaks={}))
    assert steps == pytest.approx([taken] * 3)
    assert bands.step == pytest.approx(taken)


def test_the_change_by_the_step_is_over_the_peaks_of_the_mean(monkeypatch):
    monkeypatch.setattr(many, "measures", lambda done: {})
    coarse = SimpleNamespace(peaks={"force_N": np.array([2.0, 5.0])})
    loop = SimpleNamespace(first_step=5e-4, run=lambda step, **_: coarse, links=(), stages=(), system=None)
    mean = SimpleNamespace(step=1e-4, peaks={"force_N": np.array([1.0, 4.0])})
    assert monte_carlo(loop, [{}, {}], mean).step_change == pytest.approx(1 / 4)


def test_two_draws_are_the_fewest():
    damper = certain(joint_damper(), ("f0",), [2.0])
    assert len(draw({"d": damper}, 2)) == 2
    for count in (1, 0, 10**9):
        with pytest.raises(InputError, match="E_DRAWS"):
            draw({"d": damper}, count)


@pytest.mark.parametrize("kind", DAMPERS)
def test_other_numbers_in_one_loop_are_other_dampers(kind):
    damper, names = DAMPERS[kind]
    damper = certain(damper, names, [0.05, 0.05] if damper.fitted_parameters[names[0]].log else [60.0, 40.0])
    loop = SystemLoop(CAR, ROAD, {"damper": damper}, Passive(0.5), free=True)
    draws = draw({"damper": damper}, 3, seed=4)
    bands = monte_carlo(loop, draws, loop.run(1e-3, machine=False))
    for row, one in zip(bands.peaks["acceleration_m_s2"], draws, strict=True):
        other = damper.with_parameters(one["damper"].numbers)
        alone = SystemLoop(CAR, ROAD, {"damper": other}, Passive(0.5)).run(bands.step, machine=False)
        assert row == pytest.approx(alone.peaks["acceleration_m_s2"], rel=1e-9)
    low, middle, high = bands.quantiles()["force_N"]
    assert low < middle < high
    assert bands.measures["body.a_w_m_s2"].shape == (3,)


def test_a_session_brings_a_gain_and_an_offset():
    frame = shear_building("still", [1e9], [1e12], [0.0], [Link("d", "floor1", "ground")])  # moves as it would alone
    damper = joint_damper()
    quake = record(np.arange(0, 0.5, 0.01), np.sin(20 * np.arange(0, 0.5, 0.01)), "acceleration_m_s2")
    loop = SystemLoop(frame, quake, {"d": damper}, Passive(0.5))
    bands = monte_carlo(loop, [{"d": Draw()}, {"d": Draw(gain=0.1)}, {"d": Draw(offset=50.0)}], loop.run(1e-3))
    plain, more, pushed = bands.peaks["force_N"][:, 0]
    assert more == pytest.approx(1.1 * plain, rel=1e-6)
    assert abs(pushed - plain) == pytest.approx(50.0, rel=1e-6)


def test_draws_scatter_as_the_damper_says():
    damper = certain(
        joint_damper(),
        ("c0", "fy0"),
        [0.02, 0.05] if joint_damper().fitted_parameters["c0"].log else [20.0, 5.0],
        0.03,
        7.0,
    )
    draws = draw({"front": damper, "rear": damper}, 4000)
    own = damper.fitted_parameters
    for i, name in enumerate(damper.uncertainty.names):
        values = np.array([row["front"].numbers[name] for row in draws])
        moved = np.log(values / own[name].value) if own[name].log else values - own[name].value
        assert np.std(moved) == pytest.approx(np.sqrt(damper.uncertainty.covariance[i, i]), rel=0.06)
    gains = np.array([[row[end].gain for end in ("front", "rear")] for row in draws])
    assert gains.std(axis=0) == pytest.approx([0.03, 0.03], rel=0.06)
    assert abs(np.corrcoef(gains.T)[0, 1]) < 0.1
    assert all(row["front"].numbers == row["rear"].numbers for row in draws)  # one model, two sessions
    for count, one, code in ((1, damper, "E_DRAWS"), (5, joint_damper(), "E_CERTAINTY")):
        with pytest.raises(InputError) as refused:
            draw({"d": one}, count)
        assert refused.value.code == code


def test_bands_by_the_command_line(tmp_path):
    save_model(certain(joint_damper(), ("c0",), [60.0], 0.05), tmp_path / "model.json")
    command = ["simulate", "quarter-car", "--input", "bump:length_s=0.3", "--damper", str(tmp_path / "model.json")]
    command += ["--draws", "5", "--out", str(tmp_path / "ride")]
    done = CliRunner().invoke(application(), [*command, "--json"])
    assert done.exit_code == 0, done.output
    printed = json.loads(done.stdout[done.stdout.index("{\n") :])
    low, middle, high = printed["bands"]["peak_force_N"]
    assert low[0] < middle[0] < high[0]
    assert 0.7 * printed["peak_force_N"] < middle[0] < 1.3 * printed["peak_force_N"]
    assert set(printed["bands"]["measures"]) == set(printed["measures"])
    assert "95 %" in (tmp_path / "ride/measures.csv").read_text()
    assert "5 draws" in (tmp_path / "ride/simulation.html").read_text()
    read = CliRunner().invoke(application(), command[:-2]).output.split("draws of the parameters")[1]
    ends = [1e3 * printed["bands"]["peak_drift_m"][end][0] for end in (0, -1)]
    assert f"travel       drift {ends[0]:9.3f} to {ends[1]:.3f} mm" in read


def test_rise_times_are_those_of_the_coil():
    functions = {
        "c": ParameterFunction("constant", (800.0,)),
        "fy": ParameterFunction("linear-current", (900.0, 40.0)),
        "f0": ParameterFunction("constant", (30.0,)),
    }
    parameters = ParameterMap(model_type("bingham"), functions)
    damper = ModifiedModel(parameters, rig="bench", envelope=ENVELOPE, coil=Coil(0.02, 0.05))
    found = rise_times(damper)
    assert found["rise_63"] == pytest.approx(0.02, rel=0.02)
    assert found["rise_90"] == pytest.approx(0.02 * np.log(10), rel=0.02)
    assert found["fall_63"] == pytest.approx(0.05, rel=0.02)
    assert found["fall_90"] == pytest.approx(0.05 * np.log(10), rel=0.02)
