"""Charts, capability and gauge study against published numbers."""

import numpy as np
import pytest

from mrdamper.fleet.charts import beyond, capability, ewma, gauge_study, individuals, is_normal


def test_individuals_of_the_nist_handbook():
    """NIST/SEMATECH e-Handbook 6.3.2.2, flow rates."""
    flow = np.array([49.6, 47.6, 49.9, 51.3, 47.8, 51.2, 52.6, 52.4, 53.6, 52.1])
    first, ranges = individuals(flow)
    assert first.centre == pytest.approx(50.81, abs=1e-9)
    assert ranges.centre == pytest.approx(1.8778, abs=5e-5)
    assert first.upper[0] == pytest.approx(55.8041, abs=5e-5)
    assert first.lower[0] == pytest.approx(45.8159, abs=5e-5)
    assert first.signals == ()


def test_ewma_of_the_nist_handbook():
    """NIST/SEMATECH e-Handbook 6.3.2.4: averages to the printed digits, limits as they settle."""
    values = np.array([52.0, 47.0, 53.0, 49.3, 50.1, 47.0, 51.0, 50.1, 51.2, 50.5, 49.6, 47.6, 49.9, 51.3, 47.8, 51.2,
                       52.6, 52.4, 53.6, 52.1])  # fmt: skip
    printed = [50.60, 49.52, 50.56, 50.18, 50.16, 49.21, 49.75, 49.85, 50.26, 50.33, 50.11, 49.36, 49.52, 50.05, 49.38,
               49.92, 50.73, 51.23, 51.94, 51.99]  # fmt: skip
    chart = ewma(values, 50.0, 2.0539, 0.3)
    assert chart.values == pytest.approx(printed, abs=0.0051)
    assert chart.upper[-1] == pytest.approx(52.5884, abs=1e-3)
    assert chart.lower[-1] == pytest.approx(47.4115, abs=1e-3)
    assert chart.signals == ()


def test_values_beyond_each_limit_are_counted():
    values = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0])
    counts = [beyond(values, *limits).sum() for limits in ((2.5, 6.5), (2.5, None), (None, 6.5), (1.0, 7.0))]
    assert counts == [3, 2, 1, 0]


def test_limits_of_an_average_are_those_of_the_sum_of_its_weights():
    """Of independent values: the average of i of them has the variance Σ λ² (1 - λ)^2k."""
    chart = ewma(np.zeros(6), 50.0, 2.0, 0.3, 2.5)
    for i in range(6):
        deviation = 2.0 * np.sqrt(sum((0.3 * 0.7**k) ** 2 for k in range(i + 1)))
        assert chart.upper[i] - 50 == pytest.approx(2.5 * deviation)
        assert 50 - chart.lower[i] == pytest.approx(2.5 * deviation)
    assert chart.signals == (0, 1, 2, 3, 4, 5)


def test_too_few_or_equal_values_are_no_distribution():
    assert is_normal(np.full(50, 3.0))
    assert is_normal(np.array([1.0, 2.0]))
    assert capability(np.array([1.0]), 0.0, 3.0) is None
    assert capability(np.full(9, 2.0), 0.0, 3.0) is None
    assert capability(np.array([1.0, 2.0]), 0.0, 3.0).ppk == pytest.approx(1.5 / (3 * np.sqrt(0.5)))


def test_capability_of_a_sample_with_known_moments():
    """NIST 6.1.6: limits 8 and 20, mean 16, deviation 2 give 0.6667; its interval after Bissell."""
    base = np.random.default_rng(1).standard_normal(50)
    values = 16 + 2 * (base - base.mean()) / base.std(ddof=1)
    found = capability(values, 8.0, 20.0)
    assert found.way == "normal"
    assert found.ppk == pytest.approx(2 / 3, abs=1e-12)
    half = 1.96 * np.sqrt(1 / 450 + (2 / 3) ** 2 / 98)
    assert (found.low, found.high) == pytest.approx((2 / 3 - half, 2 / 3 + half), abs=1e-4)
    assert capability(values, None, 20.0).ppk == pytest.approx(2 / 3, abs=1e-12)


def test_what_is_not_normal_goes_by_percentiles():
    values = np.random.default_rng(0).exponential(1.0, 8000)
    found = capability(values, None, 10.0)
    assert not is_normal(values)
    assert found.way == "percentiles"
    top = -np.log(0.00135)  # the exact quantile
    truth = (10 - np.log(2)) / (top - np.log(2))
    assert found.ppk == pytest.approx(truth, rel=0.15)
    assert found.low < truth < found.high
    # Whatever side is limited, and in any unit; of two limits the nearer one counts.
    turned = capability(-3 * values, -30.0, None)
    assert (turned.ppk, turned.low, turned.high) == pytest.approx((found.ppk, found.low, found.high), rel=0.02)
    assert capability(values, -1e3, 10.0).ppk == pytest.approx(found.ppk)


@pytest.mark.parametrize(("count", "given"), [(50, False), (200, False), (7407, False), (7408, True)])
def test_percentiles_that_the_sample_cannot_hold_are_refused(count, given):
    found = capability(np.random.default_rng(1).lognormal(0.0, 1.0, count), None, 10.0)
    assert np.isfinite([found.ppk, found.low, found.high]).all() == given
    assert ("percentiles need 7408 values" in found.way) == (not given)


def test_the_bootstrap_interval_of_percentiles_holds_the_truth():
    rng, held = np.random.default_rng(7), 0
    truth = (10 - np.log(2)) / (-np.log(0.00135) - np.log(2))
    for _ in range(60):
        found = capability(rng.exponential(1.0, 7500), None, 10.0)
        held += found.low <= truth <= found.high
    assert held >= 51  # of 95 %, three standard errors of 60 are 9 points


def test_the_interval_holds_what_it_promises():
    rng = np.random.default_rng(3)
    truth = 4 / 3
    held = 0
    for _ in range(300):
        found = capability(rng.standard_normal(60), -4.0, 4.0)
        held += np.isnan(found.ppk) or found.low <= truth <= found.high + 0.05
    assert held > 270


def test_a_gauge_study_is_the_two_way_analysis_of_variance():
    rng = np.random.default_rng(6)
    table, line = rng.normal(0, 1, (3, 5)) + 4 * np.arange(5), rng.normal(0, 9, 40)
    found = gauge_study(table, line)
    left = table - table.mean(axis=1, keepdims=True) - table.mean(axis=0) + table.mean()
    repeat, sessions = np.sum(left**2) / (2 * 4), 3 * np.var(table.mean(axis=0), ddof=1)
    assert found.repeatability == pytest.approx(np.sqrt(repeat))
    assert found.reproducibility == pytest.approx(np.sqrt((sessions - repeat) / 3))
    assert found.gauge**2 + found.parts**2 == pytest.approx(np.var(line, ddof=1))
    # Labels and what a damper's own level is change nothing.
    turned = gauge_study(table[::-1, [3, 1, 0, 4, 2]] + [[7.0], [0.0], [-2.0]], line)
    assert vars(turned) == pytest.approx(vars(found))
    # One damper cannot tell repeats from sessions: all of it is counted as that of sessions.
    alone = gauge_study(table[:1], line)
    assert (alone.repeatability, alone.reproducibility) == (0.0, pytest.approx(np.std(table[0], ddof=1)))
    assert gauge_study(table[:, :1], line) is None


def test_gauge_study_finds_the_parts_of_the_variation():
    rng = np.random.default_rng(5)
    table = 100 + rng.normal(0, 5, (30, 1)) + rng.normal(0, 2, (1, 300)) + rng.normal(0, 1, (30, 300))
    line = 100 + np.sqrt(25 + 4 + 1) * rng.standard_normal(20000)
    found = gauge_study(table, line)
    assert found.repeatability == pytest.approx(1, rel=0.05)
    assert found.reproducibility == pytest.approx(2, rel=0.1)
    assert found.parts == pytest.approx(5, rel=0.05)
    assert found.share == pytest.approx(np.sqrt(5 / 30), rel=0.1)
