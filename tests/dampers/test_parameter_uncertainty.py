"""Uncertainty of a damper: saved, in prediction intervals, in messages, and wide far from the tests."""

import json
from dataclasses import replace

import numpy as np
import pytest
from support.dampers import joint_damper, modified_damper
from support.sessions import session_runs
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.dampers.bands import band, no_band, portable_band
from mrdamper.dampers.calibration import PredictedRun
from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.dampers.model_file import dump_model, parse_model, save_model
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.dampers.uncertainty import Uncertainty, table, uncertainty_warnings
from mrdamper.data import Condition
from mrdamper.errors import InputError, ModelFileError
from mrdamper.models import model_type
from mrdamper.statistics.functions.forms import ParameterFunction
from mrdamper.study.validation import validate


@pytest.fixture(scope="module")
def damper():
    truth = joint_damper()
    return estimate_uncertainty(truth, named(session_runs(truth)))


def named(runs):
    """Runs with a session of its own stated for each."""
    return [replace(run, notes={"session": f"day {number}"}) for number, run in enumerate(runs)]


def test_gains_of_sessions_are_found():
    truth = joint_damper()
    found = [estimate_uncertainty(truth, named(session_runs(truth, seed=s, repeats=2))).uncertainty for s in range(2)]
    # 18 sessions know their spread to a sixth, two repeats to a ninth: three standard errors.
    assert np.sqrt(np.mean([c.gain**2 for c in found])) == pytest.approx(0.045, rel=0.35)
    still = estimate_uncertainty(truth, named(session_runs(truth, gain=0.0))).uncertainty
    assert still.gain < 0.01
    assert np.all(np.diag(still.covariance) < np.diag(found[0].covariance))


def test_a_certainty_is_saved_bit_by_bit(damper):
    back = parse_model(dump_model(damper)).uncertainty
    assert np.array_equal(back.covariance, damper.uncertainty.covariance)
    assert np.array_equal(back.dof, damper.uncertainty.dof)
    for name in (
        "names",
        "gain",
        "offset",
        "run_gain",
        "run_dof",
        "calibration",
        "words",
        "information",
        "unknown",
        "one_sided",
    ):
        assert getattr(back, name) == getattr(damper.uncertainty, name)
    assert back.standard_errors == pytest.approx(damper.uncertainty.standard_errors)
    assert sum(back.information.values()) == pytest.approx(1.0)
    assert "covariance" not in json.loads(dump_model(joint_damper()))


@pytest.mark.parametrize(
    "damage", [{"parameters": ["x"]}, {"matrix": [[1.0]]}, {"degrees_of_freedom": []}, {"interval_factors": [1.0]}]
)
def test_a_covariance_that_does_not_fit_is_refused(damper, damage):
    document = json.loads(dump_model(damper))
    document["covariance"] |= damage
    with pytest.raises(ModelFileError, match="covariance"):
        parse_model(json.dumps(document))


def test_a_higher_level_is_wider_and_an_unknown_session_wider_than_a_known(damper):
    prediction = damper.predict(Condition(0.5, 1.0, 0.01))
    narrow, wide = (band(damper, prediction, level) for level in (0.5, 0.95))
    assert np.all(wide.high - wide.low > narrow.high - narrow.low)
    assert np.all((wide.low < prediction.force) & (prediction.force < wide.high))
    assert wide.peak[0] < wide.known_session[0] < wide.known_session[1] < wide.peak[1]
    for bad in (0.0, 1.0, 90.0, float("nan")):
        with pytest.raises(InputError, match="E_LEVEL"):
            band(damper, prediction, bad)


def test_three_numbers_say_nearly_what_the_whole_covariance_says(damper):
    three = portable_band(damper, 0.9)
    for condition in (Condition(0.1, 1.0, 0.01), Condition(0.5, 2.0, 0.008), Condition(1.4, 1.0, 0.012)):
        prediction = damper.predict(condition)
        whole = band(damper, prediction, 0.9)
        force, half = prediction.force, np.ptp(prediction.force) / 2
        width = np.sqrt((three.gain * force) ** 2 + three.offset_N**2 + (three.of_peak * half) ** 2)
        assert np.mean(width) == pytest.approx(np.mean(whole.high - force), rel=0.15)
    assert portable_band(joint_damper()) is None


def test_the_band_of_the_peak_holds_new_sessions():
    truth = joint_damper()
    made = estimate_uncertainty(truth, named(session_runs(truth, seed=5, repeats=2)))
    inside = []
    for run in session_runs(truth, seed=6, repeats=3):
        prediction = made.predict(run)
        low, high = band(made, prediction, 0.9).peak
        inside.append(low <= np.ptp(run.force) / 2 <= high)
    assert np.mean(inside) >= 0.75  # 27 of 90 %: three standard errors are 17 points


def test_what_left_out_conditions_were_wrong_by_widens_the_band():
    truth = joint_damper()
    runs = session_runs(truth)
    steps = [np.sign(np.diff(r.displacement, prepend=0.0)) * 0.3 * np.ptp(r.force) for r in runs]
    wrong = [
        PredictedRun.of(r, r.force + s, np.gradient(r.displacement, r.time)) for r, s in zip(runs, steps, strict=True)
    ]
    sure, uncertainty_warnings = estimate_uncertainty(truth, runs), estimate_uncertainty(truth, runs, wrong)
    prediction = truth.predict(Condition(0.5, 1.0, 0.01))
    assert uncertainty_warnings.uncertainty.force > 2 * sure.uncertainty.force
    assert uncertainty_warnings.uncertainty.calibration.units == 9
    assert np.ptp(band(uncertainty_warnings, prediction).peak) > np.ptp(band(sure, prediction).peak)


def test_what_a_bound_holds_and_what_nothing_tells_apart_has_no_interval():
    truth = joint_damper()
    held = replace(truth, model=replace(truth.model, c1=0.0))
    runs = [
        run for run in session_runs(held, gain=0.0) if run.current_A == 0.0
    ]  # without current nothing shows fy1 and h1
    made = estimate_uncertainty(held, runs)
    assert "c1" in made.uncertainty.one_sided
    assert {"fy1", "h1"} <= set(made.uncertainty.unknown)
    said = " ".join(uncertainty_warnings(made))
    assert "c1 ended at its lower limit 0" in said
    assert "fy1 and h1: not identifiable without current" in said
    for name in ("c1", "fy1"):
        with pytest.raises(InputError, match="E_CERTAINTY"):
            made.uncertainty.interval(made, name)


def test_functions_have_a_spread_too():
    truth = modified_damper()
    made = estimate_uncertainty(truth, session_runs(truth))
    low, high = made.uncertainty.interval(made, "f0.0")
    assert low < 30.0 < high
    assert isinstance(parse_model(dump_model(made)).uncertainty, Uncertainty)


def test_a_damper_saves_itself_and_scores_runs_as_the_functions_do(tmp_path):
    truth, path = joint_damper(), tmp_path / "m.json"
    runs = session_runs(truth)
    truth.save(path)
    assert path.read_text() == dump_model(truth)
    assert truth.score(runs[:3]).median("nrmse_pp") == validate(truth, runs[:3]).median("nrmse_pp")


def test_the_command_writes_the_band(damper, tmp_path):
    path = tmp_path / "m.json"
    runner, ask = CliRunner(), ["--current", "0.5", "--frequency", "1", "--amplitude", "10"]
    save_model(damper, path)
    got = runner.invoke(application(), ["predict", str(path), *ask, "--level", "0.8", "--out", str(tmp_path / "a.csv")])
    assert got.exit_code == 0
    head = (tmp_path / "a.csv").read_text().splitlines()[0].split(",")
    assert {"force_N", "force_low_N", "force_high_N"} <= set(head)
    got = runner.invoke(application(), ["predict", str(path), *ask, "--json", "--out", str(tmp_path / "a.json")])
    peak = json.loads((tmp_path / "a.json").read_text())["peak_force_N"]
    assert peak["low"] < peak["value"] < peak["high"]
    assert f"{peak['value']:.4g} N, 90 % prediction interval {peak['low']:.4g} to {peak['high']:.4g} N" in got.stderr
    save_model(joint_damper(), path)
    got = runner.invoke(application(), ["predict", str(path), *ask, "--out", str(tmp_path / "b.csv")])
    assert "force_low_N" not in (tmp_path / "b.csv").read_text()
    assert "no prediction interval" in got.stderr
    assert f"{peak['value']:.4g} N\ndissipated energy" in got.stderr


def test_one_session_gives_a_band_for_sessions_like_it_and_one_run_none(tmp_path):
    truth = joint_damper()
    runs = [replace(run, notes={"session": "monday"}) for run in session_runs(truth)]
    ask = ["predict", str(tmp_path / "m.json"), "--current", "0.5", "--frequency", "1", "--amplitude", "10"]
    for few in (runs, runs[:1]):
        made = estimate_uncertainty(truth, few)
        assert made.uncertainty.gain == made.uncertainty.offset == made.uncertainty.session_dof == 0.0
        assert "Fewer than three known sessions" in " ".join(uncertainty_warnings(made))
        save_model(made, tmp_path / "m.json")
        got = CliRunner().invoke(application(), ask)
        assert got.exit_code == 0
        around = band(made, made.predict(Condition(0.5, 1.0, 0.01)))
        if few is runs:
            assert around is not None
            assert "for sessions like the tested ones" in got.stderr
            assert "session corrected" not in got.stderr
            assert "session 0 N" not in got.stderr
            assert "force_low_N" in got.stdout
        else:
            assert around is None
            assert "too few to show how runs differ" in got.stderr
            assert "force_low_N" not in got.stdout
    assert no_band(made) != no_band(truth)


def test_a_perfect_fit_claims_nothing_infinite_and_writes_zero():
    truth = joint_damper()
    made = estimate_uncertainty(truth, session_runs(truth, gain=0.0, noise=0.0))
    ends = np.array([made.uncertainty.interval(made, name) for name in made.uncertainty.names])
    assert np.isfinite(ends).all()
    assert f"f0 = {truth.model.f0:g}" in repr(made)


def test_numbers_held_by_the_search_are_one_sided():
    truth = joint_damper()
    made = estimate_uncertainty(truth, session_runs(truth), held=("h0",))
    assert made.uncertainty.one_sided == ("h0",)
    state = {row["name"]: row["state"] for row in table(made)}
    assert state["h0"] == "one-sided: at a limit of what was searched"
    assert "(one-sided" in repr(made)


def test_what_does_the_same_to_the_force_has_no_interval_though_the_rest_has():
    truth = joint_damper()
    made = estimate_uncertainty(truth, [run for run in session_runs(truth, gain=0.0) if run.current_A == 0.5])
    said = " ".join(uncertainty_warnings(made))
    for pair in ("c0 and c1", "fy0 and fy1", "h0 and h1"):
        assert f"{pair} are not both identifiable from one current" in said
    assert set(made.uncertainty.unknown) == {"c0", "c1", "fy0", "fy1", "h0", "h1"}
    low, high = made.uncertainty.interval(made, "f0")
    assert low < truth.model.f0 < high


def test_a_yield_displacement_too_small_to_show_is_not_identifiable_and_widens_nothing():
    functions = {
        "c": ParameterFunction("linear-current", (500.0, 1000.0)),
        "yield_force": ParameterFunction("linear-current", (1000.0, 60.0)),
        "yield_displacement": ParameterFunction("constant", (-13.5,), log=True),  # no sample lies on its branch
    }
    truth = replace(modified_damper(), parameters=ParameterMap(model_type("bouc-wen"), functions))
    made = estimate_uncertainty(truth, named(session_runs(truth, noise=30.0)))
    assert made.uncertainty.unknown == ("yield_displacement.0",)
    around = band(made, made.predict(Condition(0.5, 1.0, 0.01)))
    assert np.all(around.parameter < 0.1 * around.peak[1])


def test_the_share_of_a_coefficient_in_a_logarithm_is_the_change_of_its_parameter():
    damper, step = modified_damper(), 1e-4
    corners = damper.envelope.corners
    for i, exponent in enumerate(damper.fitted_parameters[f"yield_displacement.{i}"].exponent for i in range(2)):
        name = f"yield_displacement.{i}"
        moved = damper.with_parameters({name: damper.fitted_parameters[name].value + step})
        before, after = (
            [d.functions["yield_displacement"](c.current_A, c.frequency_Hz, c.amplitude_m) for c in corners]
            for d in (damper, moved)
        )
        assert exponent == pytest.approx(np.max(np.abs(np.log(np.divide(after, before)))) / step, rel=1e-6)
    assert damper.fitted_parameters["c.0"].exponent == 0
