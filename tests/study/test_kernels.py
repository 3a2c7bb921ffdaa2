"""The same tests give the same numbers, whatever kernels the linear algebra takes on a machine."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

# Twelve conditions of a made damper whose force grows with the current; every number of the dampers fitted to it.
FIT = """
import json, sys
import numpy as np
from support.synthetic import synthetic_run
from mrdamper.data import Condition
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.study.recipe import fit_and_score_all, jointly, modified

runs = []
for I in (0.0, 0.5, 1.0, 1.5):
    for f, A in ((1.0, 0.01), (2.0, 0.02), (0.5, 0.02)):
        law = {"c": 1400 + 700 * I, "yield_force": 200 + 900 * I - 150 * I**2, "yield_displacement": 9e-4, "f0": 90.0}
        noise = 0.015 * (2 * law["yield_force"] + 12 * law["c"] * f * A)
        made = {"model": BoucWen.build(law), "cycles": 3, "samples_per_cycle": 300}
        runs.append(synthetic_run(Condition(I, f, A), noise, len(runs), id=f"r{len(runs)}", rig="made", **made))
steps = [(make(m), runs) for m in ("bouc-wen", "bingham") for make in (modified, jointly)]
scored, refused = fit_and_score_all(steps, [])
assert len(scored) == 4, refused
numbers = {}
for c in scored:
    for name, function in c.damper.functions.items():
        key = f"{c.recipe.name} {name}"
        numbers[f"{key} form"] = function.form
        numbers[key] = [*function.coefficients, *function.rates]
    numbers[f"{c.recipe.name} scores"] = [r.scores.nrmse_pp for v in (c.train, c.cross_validated) for r in v.runs]
json.dump(numbers, sys.stdout)
"""

# The damper a study of the second bundled rig chooses.
PLAY_AND_BYPASS = """
import json, sys
from mrdamper.dampers.choice import identify_jointly
from mrdamper.rig_files.dataset_folder import load_dataset

found = identify_jointly([run for run in load_dataset().rig("utfsm") if run.split == "train"]).fit
json.dump({**found.damper.model.values(), "scores": found.nrmse_pp.tolist()}, sys.stdout)
"""


def fitted(kernel, what=FIT):
    path = os.pathsep.join([str(Path(__file__).parents[1]), *filter(None, sys.path)])
    environment = {**os.environ, "PYTHONPATH": path, "OPENBLAS_CORETYPE": kernel}
    done = subprocess.run([sys.executable, "-c", what], env=environment, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


@pytest.mark.slow
def test_numbers_do_not_depend_on_the_kernels_of_the_linear_algebra():
    """Forward differences of a search's residual once made 1e-6 of it; a form that fitted every point won by chance."""
    one, two = fitted("Haswell"), fitted("Nehalem")
    assert one.keys() == two.keys()
    for name, value in one.items():
        if name.endswith("form"):
            assert two[name] == value, name
        else:
            np.testing.assert_allclose(two[name], value, rtol=1e-9, atol=1e-9 * np.max(np.abs(value)), err_msg=name)


@pytest.mark.slow
def test_play_and_bypass_ends_where_its_gradient_vanishes():
    """Ended by its cost, it lay 2e-3 of a parameter elsewhere on another kernel."""
    one, two = fitted("Haswell", PLAY_AND_BYPASS), fitted("Nehalem", PLAY_AND_BYPASS)
    for name, value in one.items():
        np.testing.assert_allclose(two[name], value, rtol=1e-9, err_msg=name)
