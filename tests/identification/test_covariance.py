"""Intervals hold what they say, whatever the residual is made of; a seeded tenth of `benchmarks/coverage.py`."""

import pickle
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter
from support.synthetic import synthetic_run

from mrdamper import identification
from mrdamper.data import Condition
from mrdamper.identification import identify
from mrdamper.identification.covariance import spread
from mrdamper.identification.intervals import written
from mrdamper.identification.problem import RunUncertainty
from mrdamper.identification.uncertainty import uncertainty_of_run
from mrdamper.models.bingham import Bingham

sys.path.insert(0, str(Path(__file__).parents[2]))
from benchmarks.coverage import CASES, CONDITION, TRUTH, run_by_run


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, marks=pytest.mark.slow if case in ("AR 0.9", "AR 0.99") else [])
        for case in CASES
        if "20 cycles" not in case
    ],
)
def test_intervals_cover_what_they_say(case):
    found = run_by_run(CASES[case], repeats=50, seed=2)
    # 50 repeats of 95 %: three standard errors of the share are 9 points.
    assert np.all(found.ours >= 0.86), (case, found.ours)
    if case != "white":
        assert found.textbook.min() < 0.7
    assert (found.warned > 0.5) == ("memory" in case)


def test_a_wrong_form_is_not_made_sure_by_more_cycles():
    truth = replace(TRUTH, n=4.0, beta=TRUTH.beta**2, gamma=TRUTH.gamma**2)
    errors = [
        identify(synthetic_run(CONDITION, 2.0, cycles=cycles + 1, samples_per_cycle=200, model=truth)).standard_errors
        for cycles in (2, 32)
    ]
    for name in ("c", "alpha", "beta"):
        assert errors[1][name] > 0.5 * errors[0][name]  # by noise alone: a quarter


def test_beta_has_an_interval_of_its_own_though_it_is_searched_as_a_length():
    found = identify(synthetic_run(CONDITION, 5.0, model=TRUTH), "bouc-wen")
    assert set(found.free) <= set(found.standard_errors)
    low, high = found.interval("beta")
    assert low < TRUTH.beta < high
    # beta = 1 / (2 z_y²): its relative error is twice that of the length.
    relative = {n: found.standard_errors[n] / v for n, v in (("beta", found.model.beta), *found.end.items())}
    assert relative["beta"] == pytest.approx(2 * relative["yield_displacement"], rel=1e-3)
    assert f"beta = {written(found.model.beta, (low, high), 'm^-n')} (" in repr(found)


def test_a_motion_that_never_yields_says_so():
    # A tenth of the yield displacement: the hysteresis is a spring, and many a curve in it fits as well.
    found = identify(synthetic_run(Condition(0.0, 1.0, 2e-4), 1.0, model=TRUTH))
    assert "no yielding in this motion: beta not identifiable" in found.doubts
    assert found.interval("beta") is None
    assert identify(synthetic_run(CONDITION, 30.0, model=TRUTH)).doubts == ()


def test_more_cycles_do_not_average_model_error_away():
    def error(cycles):
        phase = 2 * np.pi * np.arange(200 * cycles) / 200
        residual = 30 * np.cos(3 * phase) + 12 * np.cos(5 * phase + 1) + 5 * np.cos(7 * phase) + 2 * np.cos(9 * phase)
        residual += np.random.default_rng(1).standard_normal(phase.size)
        jacobian = np.column_stack([np.cos(phase), np.sin(phase), np.tanh(8 * np.cos(phase))])
        residual = residual - jacobian @ np.linalg.lstsq(jacobian, residual, rcond=None)[0]
        return spread(jacobian, residual, phase / (2 * np.pi), 1.0).errors

    assert np.all(error(64) > 0.5 * error(2))


def test_what_nothing_says_is_infinite():
    phase = np.linspace(0, 20, 500)
    column = np.cos(phase)
    noise = np.random.default_rng(0).standard_normal(500)
    found = spread(np.column_stack([column, 2 * column, np.sin(phase), 0 * phase]), noise)
    assert np.isinf(found.errors[[0, 1, 3]]).all()
    assert np.isfinite(found.errors[2])


def test_a_record_shorter_than_its_memory_shows_it():
    rng = np.random.default_rng(4)
    walk = np.cumsum(rng.standard_normal(1000))
    phase = 2 * np.pi * np.arange(1000) / 200
    jacobian = np.column_stack([np.cos(phase), np.sin(phase), np.ones(1000)])
    residual = walk - jacobian @ np.linalg.lstsq(jacobian, walk, rcond=None)[0]
    assert spread(jacobian, residual, phase / (2 * np.pi), 1.0).memory < 10


def test_an_exact_fit_has_no_spread():
    phase = np.linspace(0, 20, 300)
    found = spread(np.column_stack([np.cos(phase), np.sin(phase)]), np.zeros(300), phase, 1 / (2 * np.pi))
    assert np.array_equal(found.errors, [0.0, 0.0])
    assert found.memory == pytest.approx(300)  # every sample is independent of what is none


def test_white_noise_gives_the_textbook_errors():
    rng = np.random.default_rng(3)
    J = rng.standard_normal((4000, 3)) * [1.0, 50.0, 0.02]
    residual = 2.0 * rng.standard_normal(4000)
    textbook = np.sqrt(np.sum(residual**2) / (4000 - 3) * np.diag(np.linalg.inv(J.T @ J)))
    # White noise has an autocorrelation time of one, estimated from 4000 samples to some per cent.
    assert spread(J, residual).errors == pytest.approx(textbook, rel=0.08)
    assert np.isinf(spread(np.column_stack([J, np.zeros(4000)]), residual).errors[3])


@pytest.mark.parametrize(("rho", "time"), [(0.0, 1.0), (0.5, 3.0), (0.8, 9.0)])
def test_the_memory_is_that_of_an_autoregressive_process(rho, time):
    series = lfilter([1], [1, -rho], np.random.default_rng(5).standard_normal(4_000))
    found = spread(np.ones((4_000, 1)), series)
    assert 4_000 / found.memory == pytest.approx(time, rel=0.25)  # (1 + rho)/(1 - rho)


def test_standard_errors_are_the_scatter_of_repeated_identifications():
    condition = Condition(1.0, 1.0, 0.02)
    truth = Bingham(fy=300.0, c=1500.0, f0=20.0)
    found = [  # no sample stands still, where friction has no value
        identify(synthetic_run(condition, 30.0, seed=s, cycles=3, samples_per_cycle=999, model=truth), "bingham")
        for s in range(60)
    ]
    for name in ("c", "f0"):
        scatter = float(np.std([getattr(i.model, name) for i in found], ddof=1))
        said = float(np.median([i.standard_errors[name] for i in found]))
        assert said == pytest.approx(scatter, rel=0.25), name  # 60 repeats know their scatter to 9 %


def test_what_is_known_is_computed_when_asked_and_travels_without_the_run(monkeypatch):
    run = synthetic_run(CONDITION, 5.0, model=TRUTH)
    asked = []
    monkeypatch.setattr(identification, "uncertainty_of_run", lambda *a: asked.append(1) or uncertainty_of_run(*a))
    found = identify(run)
    assert not asked
    there = pickle.loads(pickle.dumps(found))
    assert found.interval("c") == there.interval("c")
    assert asked == [1]
    assert there.ask is RunUncertainty
    assert repr(there) == repr(found)
    assert f"({found.uncertainty.effective['c']:.0f} of {found.residual.size} samples independent)" in repr(found)


def test_a_certainty_that_cannot_be_computed_says_so():
    def fails():
        raise np.linalg.LinAlgError("Singular matrix")

    found = replace(identify(synthetic_run(CONDITION, 5.0, model=TRUTH)), ask=fails)
    assert found.interval("c") is None
    assert "c = " in repr(found)
    assert "(not identifiable from these runs)" in repr(found)
    assert found.table["state"][0] == "not identifiable from these runs"
    assert "not identifiable from these runs: Singular matrix" in found.doubts[0]
