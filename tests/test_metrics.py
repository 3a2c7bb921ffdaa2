import numpy as np
import pytest

from mrdamper.statistics import metrics


def test_scores_match_the_vectors(vectors):
    case = vectors["V15_metrics"]
    measured, predicted = np.array(case["F_exp"]), np.array(case["F_pred"])
    expected = {
        "mean_relative_error": case["mean_rel"],
        "wape": case["wape"],
        "rmse": case["rmse"],
        "nrmse_pp": case["nrmse_range"],
        "nrmse_std": case["nrmse_std"],
    }
    for name, value in expected.items():
        assert getattr(metrics, name)(measured, predicted) == pytest.approx(value, rel=1e-12), name


def test_a_perfect_prediction_scores_zero_and_a_scaled_one_its_scale():
    t = np.linspace(0, 1, 1001)
    force, velocity = np.cos(2 * np.pi * t), np.cos(2 * np.pi * t)
    perfect = metrics.score(force, force, velocity, t)
    assert (perfect.nrmse_pp, perfect.wape, perfect.peak_error, perfect.energy_error) == (0, 0, 0, 0)
    scaled = metrics.score(force, 1.1 * force, velocity, t)
    assert scaled.wape == pytest.approx(0.1)
    assert scaled.peak_error == pytest.approx(0.1)
    assert scaled.energy_error == pytest.approx(0.1)


def test_dissipated_power_of_a_dashpot():
    t = np.linspace(0, 2, 4001)
    velocity = 0.3 * np.cos(2 * np.pi * t)
    assert metrics.dissipated_power(1000 * velocity, velocity, t) == pytest.approx(1000 * 0.3**2 / 2, rel=1e-6)


def test_peak_force_and_power_are_those_of_the_formula():
    time = 7.0 + np.linspace(0.0, 2.0, 2001)  # a clock that does not begin at zero
    velocity = np.sin(2 * np.pi * time)
    assert metrics.peak_force(np.array([-10.0, 3.0, 30.0])) == 20.0
    assert metrics.dissipated_power(5.0 * velocity, velocity, time) == pytest.approx(2.5, rel=1e-6)


def test_samples_without_force_have_no_relative_error():
    measured, predicted = np.array([0.0, 1.0, 2.0]), np.array([5.0, 1.5, 2.0])
    assert metrics.mean_relative_error(measured, predicted) == pytest.approx(0.25)


def test_a_force_that_takes_no_energy_has_no_energy_error():
    t = np.linspace(0, 1, 101)
    still = metrics.score(np.sin(t), np.cos(t), np.zeros(101), t)
    assert np.isnan(still.energy_error)
    assert np.isfinite(still.peak_error)


def test_the_share_of_variance_explained_and_none_of_what_does_not_vary():
    values, errors = np.array([-4.0, 1.0, 3.0]), np.array([0.5, -0.5, 1.0])
    assert metrics.explained_variance(values, values + errors) == pytest.approx(1 - 1.5 / 26, rel=1e-12)
    assert np.isnan(metrics.explained_variance(np.full(3, -2.0), np.array([-2.0, -1.0, -2.0])))
