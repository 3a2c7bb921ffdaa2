"""Every verdict is driven to holds, agrees in part and differs by made numbers."""

import math

import pytest

from mrdamper.errors import UnknownNameError
from mrdamper.paper.verdicts import LIMITS, Limit, _above, _below, judge, thresholds

# Every threshold once more, so that none moves unseen: sense, limit, wider limit.
KEPT = {
    "gas series": [("below", 0.02, 0.05)],
    "friction": [("above", 25, 15), ("below", 100, 150), ("below", 0.05, 0.15)],
    "bulge": [("above", 1, 0.8)],
    "energy": [("above", 1, 0.9), ("above", 1, 0.9)],
    "stroke end": [("above", 1.25, 1.15)],
    "phase": [("above", 1, 0.5), ("below", 0.02, 0.05)],
    "quadratic": [("above", 0.98, 0.9)],
    "speed shift": [("above", 0.98, 0.9)],
    "saturation": [("below", 0.4, 0.7)],
    "viscosity": [("below", 1.1, 1.5)],
    "mass": [("above", 0.9, 0.6), ("below", 0.2, 0.5), ("above", 0, 0)],
    "alpha": [("above", 1, 1), ("below", -1, -1), ("above", 0.9, 0.6)],
    "beta": [("below", 0.5, 0.8), ("above", 0.9, 0.6), ("below", 0.1, 0.3)],
    "presets": [("below", 0.02, 0.05), ("below", 0.02, 0.05), ("below", 1e-6, 1e-3)],
    "search": [("below", 1.1, 2), ("below", 1.1, 2)],
    "accuracy": [("below", 1.1, 1.5)] * 2,
    "few parameters": [("below", 1.1, 1.5), ("below", 0.99, 0.99)],
    "fast": [("below", 0.99, 1.5)],
    "generalisation": [("below", 1.5, 2.5), ("below", 0.1, 0.2)],
}


def beyond(limit, value):
    """A little on the wrong side of a value."""
    step = 1e-9 + 1e-6 * abs(value)
    return value + step if limit.sense == "below" else value - step


def numbers(key, pick):
    return {limit.number: pick(limit) for limit in LIMITS[key]}


def test_the_thresholds_are_those_that_were_settled():
    assert {key: [(x.sense, x.holds, x.near) for x in limits] for key, limits in LIMITS.items()} == KEPT


@pytest.mark.parametrize("key", LIMITS)
def test_a_claim_holds_at_its_limits_and_not_beyond_the_wider_ones(key):
    assert judge(key, numbers(key, lambda x: x.holds)) == "agrees"
    assert judge(key, numbers(key, lambda x: beyond(x, x.near))) == "differs"
    assert judge(key, numbers(key, lambda x: math.nan)) == "cannot be judged"
    for limit in LIMITS[key]:
        assert limit.text in thresholds(key)
        assert f"{limit.holds:g}" in thresholds(key)


@pytest.mark.parametrize(("key", "place"), [(key, i) for key, limits in LIMITS.items() for i in range(len(limits))])
def test_one_number_that_misses_makes_a_claim_hold_in_part(key, place):
    good = numbers(key, lambda x: x.holds)
    limit = LIMITS[key][place]
    if limit.near != limit.holds:
        assert judge(key, {**good, limit.number: beyond(limit, limit.holds)}) == "agrees in part"
    far = judge(key, {**good, limit.number: beyond(limit, limit.near)})
    others = any(x.alone for x in LIMITS[key] if x is not limit)
    assert far == ("agrees in part" if others else "differs")
    missing = {name: value for name, value in good.items() if name != limit.number}
    assert judge(key, missing) == "cannot be judged"


@pytest.mark.parametrize(("sense", "values"), [("below", (1.0, 1.5, 2.1)), ("above", (2.1, 1.5, 0.9))])
def test_a_limit_grades_by_its_sense(sense, values):
    limit = Limit("x", sense, 1.0 if sense == "below" else 2.0, 2.0 if sense == "below" else 1.0)
    assert [limit.grade(v) for v in values] == [2, 1, 0]


def test_unknown_claims_and_numbers_are_refused():
    with pytest.raises(UnknownNameError):
        judge("weather", {})
    with pytest.raises(UnknownNameError):
        judge("quadratic", {"R squared": 1.0})


def test_how_well_a_function_fits_says_nothing_by_itself():
    quiet = {(key, x.number) for key, limits in LIMITS.items() for x in limits if not x.alone}
    assert quiet == {
        ("mass", "R² of m over current and frequency"), ("alpha", "R²"), ("beta", "R² of ln β"),
        ("beta", "share of runs at the limit of the box"),
        ("generalisation", "median held-out error over the median error of identification"),
    }  # fmt: skip
    for key in ("mass", "alpha", "beta"):
        fits = numbers(key, lambda x: beyond(x, x.near) if x.alone else x.holds)
        assert judge(key, fits) == "differs"
        misfits = numbers(key, lambda x: x.holds if x.alone else beyond(x, x.near))
        assert judge(key, misfits) == "agrees in part"


def test_a_limit_without_a_wider_one_is_its_own():
    for make, sense in ((_below, "below"), (_above, "above")):
        assert make("a number", 2.0) == Limit("a number", sense, 2.0, 2.0)
        assert make("a number", 2.0, 3.0) == Limit("a number", sense, 2.0, 3.0)
