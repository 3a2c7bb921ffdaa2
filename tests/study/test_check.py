"""Datasets made from arrays get the checks of imported files."""

from dataclasses import replace

import numpy as np
import pytest

from mrdamper import Dataset, Run, check, identify
from mrdamper.errors import IdentificationError, QualityError


@pytest.fixture(scope="module")
def runs(bundled):
    return [run for run in bundled.rig("utfsm") if run.excitation == "sine"][:5]


def test_nothing_is_found_in_sound_runs(runs):
    found = check(Dataset(tuple(runs)))
    assert found.findings == ()
    assert "nothing found" in found.headline


def test_findings_are_objects_and_a_table(runs):
    inverted = replace(runs[0], id="inverted", force=-runs[0].force)
    clipped = replace(runs[1], id="clipped", force=runs[1].force.clip(max=0.8 * runs[1].force.max()))
    again = replace(runs[2], id="again", split="validate")
    found = check(Dataset((*runs[2:], inverted, clipped, again)))
    assert {(one.run_id, one.code, one.severity) for one in found.findings} >= {
        ("inverted", "E_DISSIPATION_SIGN", "refused"),
        ("clipped", "W_CLIPPED", "noted"),
        ("again", "E_TWICE", "set aside"),
    }
    assert found.table["run_id"] == [one.run_id for one in found.findings]


def test_a_run_of_another_unit_is_set_aside(bundled):
    runs = [run for run in bundled.rig("utfsm") if run.excitation == "sine" and run.split == "train"]
    wrong = replace(runs[4], force=runs[4].force / 4.448)
    (finding,) = check(Dataset((*runs[:4], wrong, *runs[5:]))).findings
    assert (finding.run_id, finding.code, finding.severity) == (wrong.id, "E_FORCE_SCALE", "set aside")
    assert "lbf" in finding.text


@pytest.fixture
def channels():
    t = np.arange(2000) / 500
    x = 0.01 * np.sin(2 * np.pi * t)
    return t, x, 5000 * np.gradient(x, t) + 300 * np.sign(np.cos(2 * np.pi * t))


def test_arrays_that_the_import_refuses_are_not_identified(channels):
    t, x, force = channels
    identify(Run("right", t, x, force, 0.0), "bingham")
    noise = np.random.default_rng(0).normal(size=t.size)
    for code, made in {
        "E_DISSIPATION_SIGN": Run("left", t, -x, force, 0.0),
        "E_RECTIFIED": Run("absolute", t, x, np.abs(force), 0.0),
        "E_NOISE": Run("noise", t, x, noise, 0.0),
    }.items():
        with pytest.raises(QualityError) as refusal:
            identify(made, "bingham")
        assert refusal.value.code == code
        assert [one.code for one in check(Dataset((made,))).findings] == [code]


def test_findings_on_arrays_are_noted_or_refused_by_identification(channels):
    t, x, force = channels
    drifting = Run("drifts", t, x + 0.002 * t, force, 0.0)
    (finding,) = (one for one in check(Dataset((drifting,))).findings if one.code == "W_DRIFT")
    assert finding.text in identify(drifting, "bingham").notes
    clipped = Run("clipped", t, x, force.clip(max=0.8 * force.max()), 0.0)
    with pytest.raises(IdentificationError, match="W_CLIPPED"):
        identify(clipped, "bingham")
    identify(clipped, "bingham", clipped=True)
