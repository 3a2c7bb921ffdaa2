"""Profiles and samples of a damper's numbers agree with its covariance where that holds, and say so where not."""

from dataclasses import replace

import numpy as np
import pytest
from support.dampers import joint_damper
from support.sessions import session_runs
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.dampers.likelihood import Likelihood, profile
from mrdamper.dampers.model_file import save_model
from mrdamper.dampers.posterior import posterior, split_rhat
from mrdamper.errors import InputError
from mrdamper.rig_files.dataset_folder import save_dataset

FEW = ("f0", "c0", "fy0")


@pytest.fixture(scope="module")
def few():
    truth = replace(joint_damper(), free=FEW)
    runs = session_runs(truth)
    made = estimate_uncertainty(truth, runs)
    return made, runs, Likelihood.of(made, runs)


def test_the_curvature_at_the_estimate_is_the_covariance(few):
    made, _, likelihood = few
    assert likelihood(likelihood.start) == pytest.approx(0.0, abs=1e-9)
    assert likelihood.covariance == pytest.approx(made.uncertainty.covariance)
    rng = np.random.default_rng(0)
    for _ in range(5):
        step = 0.05 * np.linalg.cholesky(likelihood.covariance) @ rng.standard_normal(3)
        expected = step @ np.linalg.solve(likelihood.covariance, step)
        assert likelihood(likelihood.start + step) == pytest.approx(expected, rel=0.02)
    assert likelihood(likelihood.start - [0.0, 1e9, 0.0]) == np.inf  # c0 below zero


def test_a_profile_is_bounded_one_sided_or_flat(few):
    made, _, likelihood = few
    found = profile(likelihood, "f0")
    low, high = made.uncertainty.interval(made, "f0")
    assert found.kind == "bounded"
    # Chi squared has no degrees of freedom to lose: a little inside Student's t, before draws narrow it.
    width = (high - low) / made.uncertainty.interval_factor[made.uncertainty.names.index("f0")]
    assert 0.8 * width < np.ptp(found.interval) <= width
    truth = replace(joint_damper(), free=(*FEW, "c1"))
    held = replace(truth, model=replace(truth.model, c1=0.0))
    runs = session_runs(held)
    at_zero = profile(Likelihood.of(estimate_uncertainty(held, runs), runs), "c1")
    assert (at_zero.kind, at_zero.interval[0]) == ("one-sided", 0.0)
    assert 0 < at_zero.interval[1] < np.inf
    still = [run for run in runs if run.current_A == 0.0]
    assert profile(Likelihood.of(estimate_uncertainty(truth, still), still), "c1").kind == "flat"
    with pytest.raises(InputError, match="E_CERTAINTY"):
        profile(likelihood, "nothing")


class Bell:
    """A likelihood whose samples are known: a bell over a logarithm and a number that is positive."""

    names, logs, start = ("a", "b"), (True, False), np.array([1.0, 0.5])
    covariance = np.array([[0.04, 0.02], [0.02, 0.25]])
    bounds = np.array([[-np.inf, np.inf], [0.0, np.inf]])

    def __call__(self, point):
        step = point - self.start
        return step @ np.linalg.solve(self.covariance, step) if point[1] >= 0 else np.inf


def test_samples_are_those_of_the_likelihood_and_short_chains_are_refused():
    pytest.importorskip("emcee", reason="the uq extra is not installed")
    with pytest.raises(InputError, match="E_CONVERGENCE"):
        posterior(Bell(), 100)
    drawn = posterior(Bell(), 2500)
    assert drawn.steps > 50 * drawn.time
    assert drawn.split_rhat <= 1.01
    assert drawn.values[:, 1].min() >= 0
    # A bell of mean and deviation 0.5 cut at one deviation: its mean moves by 0.288 deviations.
    assert drawn.values[:, 1].mean() == pytest.approx(0.5 + 0.288 * 0.5, abs=0.04)
    assert np.log(drawn.values[:, 0]).std() == pytest.approx(0.2, rel=0.1)


def test_chains_that_differ_do_not_pass():
    rng = np.random.default_rng(0)
    chains = rng.standard_normal((4000, 4, 2))
    assert split_rhat(chains) < 1.01
    assert split_rhat(chains + np.array([0.0, 0.0, 0.0, 1.0])[None, :, None]) > 1.05
    assert split_rhat(chains + np.linspace(0, 2, 4000)[:, None, None]) > 1.05  # still on its way


def test_the_command_says_and_draws(few, tmp_path):
    made, runs, _ = few
    save_model(made, tmp_path / "m.json")
    save_dataset(runs, tmp_path / "rig")
    asked = ["uncertainty", str(tmp_path / "m.json"), str(tmp_path / "rig"), "--profile", "f0"]
    got = CliRunner().invoke(application(), [*asked, "--out", str(tmp_path / "out")])
    assert got.exit_code == 0, got.output
    assert "profile of f0: bounded" in got.stdout
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "made.json",
        "parameters.csv",
        "profile.csv",
        "profile.svg",
    }
