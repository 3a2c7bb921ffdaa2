"""What hangs on the time step or the current alone is computed where these change, and nowhere else."""

import re
import shutil

import numpy as np
import pytest

from mrdamper.models.play_bypass import PlayBypass
from mrdamper.models.recorded import CHANNELS, traced_motion
from mrdamper.tracing import Tape, program
from mrdamper.tracing.c_writer import record_source
from mrdamper.tracing.compiled import RecordProgram
from mrdamper.tracing.tangent import with_tangents

MODEL = PlayBypass(
    f0=0.0, k=1.0, c0=1.0, c1=1.0, fy0=10.0, fy1=100.0, d=1e-3, e=5e-4, cb=100.0, h0=0.1, h1=0.1, vh=0.01, T=5e-3
)


def test_a_number_that_is_kept_is_computed_in_one_place():
    tape = Tape()
    motion = traced_motion(tape, [tape.input(name) for name in CHANNELS])
    free = PlayBypass(**{name: tape.parameter(name, value) for name, value in MODEL.values().items()})
    traced = with_tangents(tape, free.force(motion, free.state(motion)), ("T", "fy1", "Ic"))
    places = re.findall(r"^ *(m\[\d+\]) = ", record_source(program(tape, traced)), re.MULTILINE)
    assert len(places) > 5
    assert len(places) == len(set(places))


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize("remembers", [False, True])
def test_picked_samples_are_those_of_the_whole_record(remembers):
    """A program without memory computes them alone: a sample without an answer that is not picked does not end it."""
    tape = Tape()
    x = tape.assume(tape.input("x"), 0.5)
    value = 2.0 * x if x > -0.5 else x
    if remembers:
        total = tape.remember("total")
        tape.update(total, total + x)
        value = value + total
    record = RecordProgram(program(tape, {"value": value}))
    channel, picked = np.linspace(0.0, 1.0, 50), np.array([3, 4, 20, 48])
    whole, some = (record.compiled_along((), (), record.starts, [channel], which) for which in (None, picked))
    np.testing.assert_array_equal(some.outputs, whole.outputs[:, picked])
    channel[10] = -1.0
    assert record.compiled_along((), (), record.starts, [channel]).failed == 10
    assert record.compiled_along((), (), record.starts, [channel], picked).failed == (10 if remembers else -1)
