"""Datasets made from arrays get the checks of imported files."""

from dataclasses import replace

import numpy as np
import pytest

from mrdamper import Dataset, Run, check, identify
from mrdamper.errors import QualityError


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


def test_a_loop_that_gives_energy_is_not_identified():
    t = np.arange(2000) / 500
    x = 0.01 * np.sin(2 * np.pi * t)
    force = 5000 * np.gradient(x, t) + 300 * np.sign(np.cos(2 * np.pi * t))
    identify(Run("right", t, x, force, 0.0), "bingham")
    with pytest.raises(QualityError, match="sign of force or displacement inverted") as refusal:
        identify(Run("left", t, -x, force, 0.0), "bingham")
    assert refusal.value.code == "E_DISSIPATION_SIGN"
