"""A seeded subset of the joint part of `benchmarks/coverage.py`."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))
from benchmarks.coverage import jointly
from benchmarks.synthetic_coverage import FAMILIES, covered

LEVEL, REPEATS = 0.95, 30


def least(share):
    """Return the share of repeats three standard errors below one that is expected."""
    return share - 3 * np.sqrt(share * (1 - share) / REPEATS)


@pytest.mark.slow
@pytest.mark.parametrize("rig", ["labcontrol", "utfsm"])
def test_joint_intervals_and_bands_hold_what_they_say(rig):
    found, (peak, force) = jointly(rig, repeats=REPEATS, seed=3)
    assert np.all(found.ours >= least(LEVEL)), dict(zip(found.names, found.ours, strict=True))
    assert np.median(found.textbook) < 0.6
    assert peak >= least(0.9)
    assert force >= 0.8


@pytest.mark.slow
def test_intervals_widen_where_the_form_is_another():
    (right, small, narrow), (other, large, wide) = (covered((family, 1.0)) for family in list(FAMILIES)[:2])
    assert large > 4 * small
    assert wide > 1.5 * narrow
    # One draw of six sessions each: their scatter is known to a third.
    assert np.all(right >= 0.6)
    assert np.all(other >= 0.8)
