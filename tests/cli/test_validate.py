"""`mrdamper validate` on runs of the damper itself, and on runs of another state of it."""

from dataclasses import replace

import pytest
from scipy.special import bdtr
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.cli.commands.validate import _chance
from mrdamper.dampers.model_file import save_model
from mrdamper.data import Dataset
from mrdamper.rig_files.dataset_folder import save_dataset
from mrdamper.web.imported_data import bundled_dampers


@pytest.mark.parametrize(("inside", "runs", "level"), [(0, 12, 0.9), (9, 12, 0.9), (20, 20, 0.8)])
def test_the_chance_of_so_few_runs_inside_is_that_of_the_binomial_distribution(inside, runs, level):
    assert _chance(inside, runs, level) == pytest.approx(bdtr(inside, runs, level), rel=1e-9)


@pytest.mark.parametrize(("gain", "note"), [(1.0, "(too few runs to tell a share)"), (1.6, "the band does not hold")])
def test_runs_outside_their_band_are_no_matter_of_their_number(bundled, tmp_path, gain, note):
    damper = bundled_dampers()[0]
    runs = list(bundled.rig(damper.rig).split("validate"))[:8]
    save_model(damper, tmp_path / "model.json")
    save_dataset(Dataset(tuple(replace(run, force=gain * run.force) for run in runs)), tmp_path / "rig")
    done = CliRunner().invoke(application(), ["validate", str(tmp_path / "model.json"), str(tmp_path / "rig")])
    assert note in done.output
