"""Numbers, ranges and counts are written for people in one way."""

import math

import pytest

from mrdamper.data.wording import counted, number, span


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (10420.3, 4, "10420"),
        (-1186.4, 2, "-1200"),
        (314549.0, 4, "314500"),
        (999999.9, 4, "1e6"),
        (2.005e7, 4, "20.05e6"),
        (850.4e9, 2, "850e9"),
        (0.00012, 4, "0.00012"),
        (5e-5, 4, "50e-6"),
        (0.5 + 1e-13, 4, "0.5"),
        (-0.0, 4, "0"),
        (0.0, 4, "0"),
        (math.inf, 4, "–"),
        (math.nan, 4, "–"),
        (None, 4, "–"),
    ],
)
def test_a_number_has_an_exponent_of_thousands_or_none(value, digits, text):
    assert number(value, digits) == text


def test_numbers_side_by_side_have_one_exponent_and_a_change_its_sign():
    assert [number(v, 3, beside=2e7) for v in (4e5, 2e7)] == ["0.4e6", "20e6"]
    assert [number(v, 3, sign="+") for v in (15000.0, -0.25)] == ["+15000", "-0.25"]


@pytest.mark.parametrize(
    ("ends", "text"), [((0.5, 4.0), "0.5–4 Hz"), ((11.996, 12.004), "12 Hz"), ((-0.0, 1.2), "0–1.2 Hz")]
)
def test_a_range_of_one_value_is_that_value(ends, text):
    assert span(*ends, "Hz") == text
    assert span(*ends, to=" to ") == text.removesuffix(" Hz").replace("–", " to ")


def test_one_of_a_thing_is_not_in_the_plural():
    assert [counted(n, "cross-validated run") for n in (0, 1, 2)] == [
        "0 cross-validated runs",
        "1 cross-validated run",
        "2 cross-validated runs",
    ]
