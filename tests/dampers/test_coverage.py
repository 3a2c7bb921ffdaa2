"""A seeded tenth of the joint part of `benchmarks/coverage.py`."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))
from benchmarks.coverage import jointly


@pytest.mark.slow
@pytest.mark.parametrize("rig", ["labcontrol", "utfsm"])
def test_joint_intervals_and_bands_hold_what_they_say(rig):
    found, (peak, force) = jointly(rig, repeats=50, seed=3)
    # 50 repeats of 95 %: three standard errors of a share are 9 points.
    assert np.all(found.ours >= 0.86), dict(zip(found.names, found.ours, strict=True))
    assert np.median(found.textbook) < 0.6
    assert peak >= 0.77  # of 90 %, three standard errors
    assert force >= 0.8
