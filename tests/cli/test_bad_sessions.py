"""Sessions and uncertainties that cannot be: a code, one line, nothing written."""

import json
from dataclasses import replace

import numpy as np
import pytest
from support.dampers import joint_damper
from support.sessions import session_runs
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.dampers.model_file import dump_model, parse_model
from mrdamper.data import Dataset
from mrdamper.errors import InputError, ModelFileError
from mrdamper.study.workflow import run_study


@pytest.fixture(scope="module")
def text():
    """A saved model with its uncertainty."""
    truth = joint_damper()
    return dump_model(estimate_uncertainty(truth, session_runs(truth)))


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("matrix", 0, 0), 1e308),
        (("session", "gain"), 1e308),
        (("session", "offset_N"), -1.0),
        (("model_error", "force"), 1e300),
        (("runs", "degrees_of_freedom"), 1e308),
        (("degrees_of_freedom", 0), 1e999),
    ],
)
def test_an_uncertainty_that_is_no_number_of_a_damper_is_refused(text, tmp_path, place, value):
    document = json.loads(text)
    inner = document["covariance"]
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    with pytest.raises(ModelFileError):
        parse_model(json.dumps(document))
    (tmp_path / "m.json").write_text(json.dumps(document), encoding="utf-8")
    ask = ["--current", "0.5", "--frequency", "1", "--amplitude", "10", "--out", str(tmp_path / "f.csv")]
    got = CliRunner().invoke(application(), ["predict", str(tmp_path / "m.json"), *ask])
    assert got.exit_code == 2 or isinstance(got.exception, ModelFileError)
    assert not (tmp_path / "f.csv").exists()


def _numbers(part, place=()):
    """Every place of a number in a document."""
    for key in part if isinstance(part, dict) else range(len(part)) if isinstance(part, list) else ():
        yield from _numbers(part[key], (*place, key))
    if isinstance(part, float):
        yield place


def test_a_model_with_any_coefficient_of_1e308_is_refused_or_predicts_and_never_overflows(text, tmp_path):
    places = [place for place in _numbers(json.loads(text)) if not {"covariance", "envelope", "conditions"} & {*place}]
    assert len(places) >= 5
    for place in places:
        document = json.loads(text)
        inner = document
        for key in place[:-1]:
            inner = inner[key]
        inner[place[-1]] = 1e308
        path = tmp_path / "m.json"
        path.write_text(json.dumps(document), encoding="utf-8")
        ask = ["--current", "0.5", "--frequency", "1", "--amplitude", "10", "--out", str(tmp_path / "f.csv")]
        with np.errstate(all="ignore"):
            got = CliRunner().invoke(application(), ["predict", str(path), *ask])
        assert got.exit_code in (0, 2) or isinstance(got.exception, InputError), (place, got.exception)


def test_a_clock_that_is_no_date_ends_a_study_with_its_code():
    truth = joint_damper()
    runs = [replace(run, notes={"recorded_at": "25:61 yesterday"}) for run in session_runs(truth)]
    with pytest.raises(InputError) as caught:
        estimate_uncertainty(truth, runs)
    assert caught.value.code == "E_CLOCK"


def test_one_run_and_two_runs_are_refused_or_studied_with_their_limits(bundled):
    sines = [run for run in bundled.rig("utfsm") if run.excitation == "sine" and run.split == "train"]
    with pytest.raises(InputError, match="at least two"):
        run_study(Dataset((sines[0],)))
