"""Timings with pytest-benchmark: `python -m pytest benchmarks/regressions.py`.

`--benchmark-autosave` stores a run, `--benchmark-compare` compares with the last one. The test suite does not collect
this file, because times depend on the load of the machine.
"""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import batches, conditions
from benchmarks.simulation import SHAPE, T, X
from mrdamper.identification import identify
from mrdamper.identification.methods.projection import Projection
from mrdamper.physics.hysteresis import follow
from mrdamper.physics.motion import Path

MOTION = X * np.sin(2 * np.pi * T + 0.3)


def test_cut_into_strokes(benchmark):
    benchmark(Path.of, MOTION)


def test_follow(benchmark):
    benchmark(follow, SHAPE, Path.of(MOTION))


def test_batch_cost(benchmark):
    benchmark(batches.batch_cost, *batches.loop(1000, 1), batches.shapes(100))


def test_search(benchmark):
    benchmark(Projection().solve, batches.prepared(conditions.run()))


@pytest.mark.parametrize("free", [(), ("gamma",), ("n",)], ids=str)
def test_identify(benchmark, free):
    benchmark(identify, conditions.run(), free=free)
