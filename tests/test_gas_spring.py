"""The air spring against the vectors, its own limits, and the laws of its series."""

import json
from pathlib import Path

import numpy as np
import pytest

from mrdamper.errors import ParameterError
from mrdamper.physics.gas_spring import GasSpring

CASES = json.loads((Path(__file__).parent / "vectors.json").read_text())["V01_gas_spring"]
ROUNDING = 1e-12  # closed forms on both sides


def spring(case: dict) -> GasSpring:
    p = case["params"]
    return GasSpring(p["p0"], p["V0"], p["Ar"], p["Af"], p["kappa"])


@pytest.mark.parametrize("case", CASES)
def test_the_series_and_the_exact_force_are_those_of_the_vectors(case):
    gas, x = spring(case), np.array(case["x"])
    k1, k2, k3 = gas.stiffnesses()
    assert (k1, k2, k3) == pytest.approx((case["k1"], case["k2"], case["k3"]), rel=ROUNDING)
    # Near x = 0 the force is a difference of numbers a thousand times its size.
    assert gas.force(x) == pytest.approx(case["F_exact"], rel=1e-10, abs=1e-9)
    assert k1 * x + k2 * x**2 + k3 * x**3 == pytest.approx(case["F_taylor123"], rel=ROUNDING, abs=1e-12)
    assert k1 * x + k3 * x**3 == pytest.approx(case["F_taylor13"], rel=ROUNDING, abs=1e-12)


def test_the_series_errs_in_fourth_order():
    gas = spring(CASES[0])
    k1 = gas.stiffnesses()[0]
    error = [gas.taylor_error(x) * abs(gas.force(x)) for x in (0.02, 0.01)]
    # Halving the amplitude divides an error of fourth order by 16; the fifth order adds a little.
    assert error[0] / error[1] == pytest.approx(16, rel=0.1)
    assert gas.force(1e-7) / 1e-7 == pytest.approx(k1, rel=1e-5)


def test_the_even_term_changes_sign_with_the_direction():
    k1, k2, k3 = spring(CASES[0]).stiffnesses("compression")
    assert spring(CASES[0]).stiffnesses("extension") == (k1, -k2, k3)


def test_the_rod_area_serves_where_no_force_area_is_given():
    p = CASES[0]["params"]
    assert GasSpring(p["p0"], p["V0"], p["Ar"]).stiffnesses() == spring(CASES[0]).stiffnesses()


def test_a_motion_that_leaves_no_gas_is_refused_with_the_limit():
    with pytest.raises(ParameterError, match=r"no gas volume \(limit 477"):
        spring(CASES[0]).force(0.5)


def test_an_impossible_spring_is_refused():
    with pytest.raises(ParameterError, match="gas volume is 0"):
        GasSpring(1e6, 0.0, 3e-4)
