"""Every verdict is driven to holds, agrees in part and differs by made numbers."""

import math

import pytest

from mrdamper.data.wording import number
from mrdamper.errors import UnknownNameError
from mrdamper.paper.claims import ROWS, ClaimLimit, _above, _below, steadiness, thresholds, verdict_on

LIMITS = {key: row.limits for key, row in ROWS.items()}

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
    return [pick(limit) for limit in LIMITS[key]]


def test_the_thresholds_are_those_that_were_settled():
    assert {key: [(x.sense, x.holds, x.near) for x in limits] for key, limits in LIMITS.items()} == KEPT


@pytest.mark.parametrize("key", LIMITS)
def test_a_claim_holds_at_its_limits_and_not_beyond_the_wider_ones(key):
    assert verdict_on(key, numbers(key, lambda x: x.holds)) == "agrees"
    assert verdict_on(key, numbers(key, lambda x: beyond(x, x.near))) == "differs"
    assert verdict_on(key, numbers(key, lambda x: math.nan)) == "cannot be checked"
    for limit in LIMITS[key]:
        assert limit.text in thresholds(key)
        assert number(limit.holds) in thresholds(key)


@pytest.mark.parametrize(("key", "place"), [(key, i) for key, limits in LIMITS.items() for i in range(len(limits))])
def test_one_number_that_misses_makes_a_claim_hold_in_part(key, place):
    good = numbers(key, lambda x: x.holds)
    limit = LIMITS[key][place]
    if limit.near != limit.holds:
        assert verdict_on(key, [*good[:place], beyond(limit, limit.holds), *good[place + 1 :]]) == "agrees in part"
    far = verdict_on(key, [*good[:place], beyond(limit, limit.near), *good[place + 1 :]])
    others = any(x.alone for x in LIMITS[key] if x is not limit)
    assert far == ("agrees in part" if others else "differs")
    assert verdict_on(key, [*good[:place], math.nan, *good[place + 1 :]]) == "cannot be checked"
    assert verdict_on(key, good[1:]) == "cannot be checked"


@pytest.mark.parametrize(("sense", "values"), [("below", (1.0, 1.5, 2.1)), ("above", (2.1, 1.5, 0.9))])
def test_a_limit_grades_by_its_sense(sense, values):
    limit = ClaimLimit("x", sense, 1.0 if sense == "below" else 2.0, 2.0 if sense == "below" else 1.0)
    assert [limit.grade(v) for v in values] == [2, 1, 0]


def test_unknown_claims_are_refused():
    with pytest.raises(UnknownNameError):
        verdict_on("weather", [])


def test_how_well_a_function_fits_says_nothing_by_itself():
    quiet = {(key, x.value) for key, limits in LIMITS.items() for x in limits if not x.alone}
    assert quiet == {
        ("mass", "R² of m over current and frequency"), ("alpha", "R²"), ("beta", "R² of ln β"),
        ("beta", "share of runs at the limit of the box"),
        ("generalisation", "median validation error over the median error of identification"),
        ("few parameters", "searched parameters a run over the Ali-type's"),
    }  # fmt: skip
    for key in ("mass", "alpha", "beta"):
        fits = numbers(key, lambda x: beyond(x, x.near) if x.alone else x.holds)
        assert verdict_on(key, fits) == "differs"
        misfits = numbers(key, lambda x: x.holds if x.alone else beyond(x, x.near))
        assert verdict_on(key, misfits) == "agrees in part"


def test_a_limit_without_a_wider_one_is_its_own():
    for make, sense in ((_below, "below"), (_above, "above")):
        assert make("a number", 2.0) == ClaimLimit("a number", sense, 2.0, 2.0)
        assert make("a number", 2.0, 3.0) == ClaimLimit("a number", sense, 2.0, 3.0)


@pytest.mark.parametrize(
    ("verdict", "others", "said"),
    [
        ("agrees", ["agrees"] * 3, "3 of 3"),
        ("agrees", [*["differs"] * 2, "agrees", "agrees in part"], "1 of 4; 2 differs; 1 agrees in part"),
        ("agrees in part", ["agrees", "agrees"], "0 of 2; 2 agrees"),
        ("agrees", ["cannot be checked"] * 2, ""),
        ("cannot be checked", ["cannot be checked"] * 2, ""),
        ("agrees", [], ""),
    ],
)  # fmt: skip
def test_a_verdict_is_counted_beside_those_of_other_seeds(verdict, others, said):
    assert steadiness(verdict, others) == said
