"""Intervals as numbers and as text; quantiles of Student's t against SciPy's, which is slow to import."""

import math

import numpy as np
import pytest
from scipy.special import fdtrc, stdtrit

from mrdamper.data import Condition
from mrdamper.errors import InputError
from mrdamper.identification.intervals import (
    dof_of_quantile,
    f_exceedance,
    interval_about,
    student,
    weaknesses,
    written,
)


@pytest.mark.parametrize("level", [0.5, 0.9, 0.95, 0.999])
@pytest.mark.parametrize("dof", [1, 1.3, 2, 5.5, 40, 999.0, 1001.0, 1e6])
def test_quantiles_are_scipys(level, dof):
    assert student(level, dof) == pytest.approx(float(stdtrit(dof, (1 + level) / 2)), rel=1e-10)


@pytest.mark.parametrize("level", [0.5, 0.95])
def test_where_the_series_begins_its_last_term_is_seen(level):
    assert student(level, 1000.5) == pytest.approx(float(stdtrit(1000.5, (1 + level) / 2)), rel=1e-11)


@pytest.mark.parametrize("level", [0.5, 0.95])
def test_degrees_of_freedom_are_those_whose_quantile_was_given(level):
    for dof in (1.0, 1.7, 4.0, 60.0, 2e4):
        assert dof_of_quantile(student(level, dof), level) == pytest.approx(dof, rel=1e-6)
    assert dof_of_quantile(2 * student(level, 1.0), level) == pytest.approx(
        1.0
    )  # wider than with one: one all the same
    assert dof_of_quantile(0.9 * student(level, 1e6), level) == pytest.approx(1e6, rel=1e-9)


@pytest.mark.parametrize("dof", [(1, 1), (1, 12), (4, 22), (7, 2), (30, 1000), (900, 5)])
@pytest.mark.parametrize("ratio", [0.0, 1e-4, 0.7, 1.0, 1.3, 5.0, 40.0, 1e5])
def test_the_exceedance_of_a_ratio_of_variances_is_scipys(dof, ratio):
    assert f_exceedance(ratio, *dof) == pytest.approx(fdtrc(*dof, ratio), rel=1e-10, abs=1e-13)


@pytest.mark.parametrize("level", [0.0, 1.0, -1.0, float("nan")])
def test_a_level_that_is_no_share_is_refused(level):
    with pytest.raises(InputError, match="E_LEVEL"):
        student(level, 5.0)


def test_what_the_tests_have_one_of_is_the_reason():
    one = [Condition(0.5, 1.0, a) for a in (0.01, 0.02)]
    said = weaknesses(["k1", "m", "c"], np.diag([np.inf, np.inf, 1.0]), [(0, 1)], one)
    assert said == [
        "k1 and m are not both identifiable from one frequency and one current: they do the same to the force"
    ]
    still = [Condition(0.0, f, a) for f, a in ((1.0, 0.01), (2.0, 0.02))]
    assert "fy1: not identifiable without current" in weaknesses(["fy1"], np.diag([np.inf]), (), still)[0]
    varied = [Condition(0.0, 1.0, 0.01), Condition(1.0, 2.0, 0.02)]
    for conditions, reason in ((varied, "from these runs"), (varied[1:], "from one condition"), ([], "")):
        (said,) = weaknesses(["k1", "m"], np.eye(2), [(0, 1)], conditions)
        assert said == f"k1 and m are not both identifiable {reason}".strip() + ": they do the same to the force"
    near = [Condition(1.0, f, a) for f, a in ((1.0, 0.01), (1.0305, 0.02), (1.0, 0.03))]  # 3 % of the higher frequency
    assert "from one frequency and one current" in weaknesses(["m"], np.diag([np.inf]), (), near)[0]
    both_ways = [Condition(1.0, 1.0, 0.01), Condition(-1.0, 2.0, 0.02)]  # a coil does not know its sign
    assert "not identifiable from one current" in weaknesses(["fy1"], np.diag([np.inf]), (), both_ways)[0]


def test_correlations_are_stated_once_per_group_of_parameters():
    chain = np.array([[1.0, 0.99, 0.5, 0.0], [0.99, 1.0, -0.985, 0.0], [0.5, -0.985, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    assert weaknesses("abcd", chain) == ["a, b and c are strongly correlated (|r| up to 0.990)"]
    pair = np.array([[4.0, -5.97], [-5.97, 9.0]])
    assert weaknesses("xy", pair) == ["x and y are strongly correlated (r = -0.995)"]
    turned = np.diag([1.0, -1.0, 1.0, 1.0])
    strong = np.array([[1.0, -0.99, 0.5, 0.0], *chain[1:].tolist()])
    strong[1] = [-0.99, 1.0, 0.985, 0.0]
    strong[2, 1] = 0.985
    for signed in (strong, turned @ strong @ turned):
        assert weaknesses("abcd", signed) == ["a, b and c are strongly correlated (|r| up to 0.990)"]
    nothing = np.array([[0.0, 1.0, 1.0], [1.0, np.inf, 1.0], [1.0, 1.0, 1.0]])
    assert weaknesses("xyz", nothing) == ["y: not identifiable, the force does not depend on it"]


@pytest.mark.parametrize(
    ("value", "ends", "unit", "text"),
    [
        (727.4, (617.0, 837.8), "N s/m", "730 ± 110 N s/m"),
        (10812.3, (3012.0, 18612.6), "N", "10800 ± 7800 N"),
        (-10812.3, (-18612.6, -3012.0), "N", "-10800 ± 7800 N"),
        (0.28, (0.027, 2.8), "A", "0.28 (0.027 to 2.8) A"),
        (0.0, (-0.5, 0.5), "N", "0 ± 0.5 N"),
        (2e-4, (1.96e-4, 2.04e-4), "m", "0.2 ± 0.004 mm"),
        (4.9e-3, (3.6e-3, 6.5e-3), "m/s", "4.9 (3.6 to 6.5) mm/s"),
        (0.3, (0.2, 0.4), "-", "0.3 ± 0.1"),
        (0.3, (0.1, 0.35), "-", "0.3 (0.1 to 0.35)"),
        (100.0, (90.5, 110.0), "N", "100 ± 9.8 N"),  # shifted by a twentieth of its half width
        (5.0, (1.0, math.inf), "N", "5 N"),
        (5.0, (4.0, 6.0), "N", "5 ± 1 N"),
        (-727.4, (-837.8, -617.0), "N s/m", "-730 ± 110 N s/m"),
        (-3456789.0, None, "Pa", "-3.457e6 Pa"),
        (-84e4, (-384e4, 216e4), "N/m^3", "-0.84e6 ± 3e6 N/m^3"),
        (2.2e7, (2e6, 9e7), "N/m^3", "22e6 (2e6 to 90e6) N/m^3"),
        (0.5, None, "m", "500 mm"),
    ],
)
def test_a_number_is_written_as_an_engineer_reads_it(value, ends, unit, text):
    assert written(value, ends, unit) == text


def test_an_interval_over_three_decades_is_none():
    assert interval_about(2200.0, 1.7, 30.0, 0.95, log=True) is None
    assert interval_about(2200.0, np.inf, 30.0, 0.95, log=False) is None
    low, high = interval_about(2200.0, 1.7, 1e9, 0.95, log=True)
    assert high / low == pytest.approx(np.exp(3.4 * 1.96), rel=1e-3)
    assert np.sqrt(low * high) == pytest.approx(2200.0)
    for unit in (1e-3, 1.0, 1e3):  # an estimate's half width in a thousand of it, in whatever unit
        assert interval_about(2.0 * unit, 500.0 * unit, 1e9, 0.95, log=False) is not None
        assert interval_about(-2.0 * unit, 1100.0 * unit, 1e9, 0.95, log=False) is None
    for factor in (999.5, 1000.5):
        ends = interval_about(1.0, math.log(factor) / 2 / student(0.95, 5.0), 5.0, 0.95, log=True)
        assert (ends is None) == (factor > 1000)
    assert interval_about(7.0, 2.0, 5.0, 0.9, log=False) == pytest.approx(
        (7 - 2 * student(0.9, 5.0), 7 + 2 * student(0.9, 5.0))
    )
    assert interval_about(0.0, 0.0, 5.0, 0.95, log=False) == (0.0, 0.0)
    assert interval_about(0.0, 1e-9, 5.0, 0.95, log=False) is None


@pytest.mark.parametrize("multiple", [0.5, 1.0, 4.0])
@pytest.mark.parametrize("half", [3.4, 3.5, 6.8, 7.0, 400.0])  # half of ln 1000 is 3.45
def test_a_coefficient_of_a_logarithm_is_identifiable_as_what_it_multiplies(half, multiple):
    error = half / multiple / student(0.95, 8.0)
    parameter = interval_about(1e-6, multiple * error, 8.0, 0.95, log=True)
    for coefficient in (0.0, -13.8, 2000.0):
        assert (interval_about(coefficient, error, 8.0, 0.95, False, multiple) is None) == (parameter is None)
