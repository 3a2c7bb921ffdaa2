"""The models that come with the bundled tests: they belong to them, and a study selects them."""

import numpy as np
import pytest

from mrdamper.study.validation import validate
from mrdamper.study.workflow import run_study
from mrdamper.web.imported_data import bundled_dampers


def test_there_is_one_per_rig_and_it_predicts_the_validation_runs(bundled):
    assert tuple(damper.rig for damper in bundled_dampers()) == bundled.rigs
    for damper in bundled_dampers():
        assert validate(damper, bundled.rig(damper.rig).split("validate")).median() < 0.05  # of the peak-to-peak force


@pytest.mark.slow
def test_they_are_those_that_a_study_selects(bundled):
    """Where this fails: `mrdamper study --out result` writes the models to put in data/bundled/models."""
    for damper, rig in zip(bundled_dampers(), run_study(bundled).rigs, strict=True):
        assert damper.title == rig.damper.title
        run = rig.dataset.split("validate")[0]
        forces = [d.predict(run).force for d in (damper, rig.damper)]
        np.testing.assert_allclose(*forces, atol=0.01 * np.ptp(forces[0]))
