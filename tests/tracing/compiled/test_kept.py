"""Results of slow inputs alone are computed where these change; records are computed at several places at once."""

import re
import shutil
from functools import partial

import numpy as np
import pytest

from mrdamper.models.play_bypass import PlayBypass
from mrdamper.models.recorded import CHANNELS, channel, traced_motion
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.tracing import Tape, program
from mrdamper.tracing.compiled import RecordProgram
from mrdamper.tracing.compiled.writer import functions, record_source
from mrdamper.tracing.tangent import with_tangents

MODEL = PlayBypass(
    f0=0.0, k=1.0, c0=1.0, c1=1.0, fy0=10.0, fy1=100.0, d=1e-3, e=5e-4, cb=100.0, h0=0.1, h1=0.1, vh=0.01, T=5e-3
)
NAMES = ("T", "fy1", "Ic", "d", "leak")


def traced_force(tape):
    motion = traced_motion(tape, [tape.input(name) for name in CHANNELS])
    free = PlayBypass(**{name: tape.parameter(name, value) for name, value in MODEL.values().items()})
    return program(tape, with_tangents(tape, free.force(motion, free.state(motion)), NAMES))


def test_a_number_that_is_kept_is_computed_in_one_place():
    places = re.findall(r"^ *(m\[\d+\]) = ", functions(traced_force(Tape()), keep=True), re.MULTILINE)
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


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize("leak", [0.0, 18.0])
def test_several_places_of_a_record_at_once_give_what_one_after_the_other_gives(leak):
    """Of all samples and of some, weighted or not; a memory that lasts longer than the warm-up is not replaced."""
    time = np.linspace(0.0, 40.0, 9_001)
    x = 4e-3 * np.sin(2 * np.pi * time)
    v, current = np.gradient(x, time), np.where(time < 15.0, 0.2, 0.7)
    motion = Excitation(time, x, v, np.gradient(v, time), current)
    record = RecordProgram(traced_force(Tape()))
    assert "step_lanes" in record_source(record.program)
    given = tuple({**MODEL.values(), "leak": leak}.values())
    inputs = [channel(motion, name) for name in record.program.tape.inputs]
    run = partial(record.compiled_along, given, record.prepare(given), record.starts)
    at_once, in_turn = run(inputs), run(inputs, begins=np.zeros(1, dtype=np.int64))
    size = np.abs(in_turn.outputs).max(axis=1, keepdims=True)
    assert np.all(np.abs(at_once.outputs - in_turn.outputs) <= 1e-11 * size)
    assert at_once.memory == pytest.approx(in_turn.memory, rel=1e-9, abs=1e-30)
    picked, places = np.array([0, 7, 2250, 2251, 6000, 8999, 9000]), np.array([4, 0])
    np.testing.assert_array_equal(run(inputs, picked).outputs, at_once.outputs[:, picked])
    factor = np.linspace(0.5, 2.0, picked.size)
    some = run(inputs, picked, weighted=(places, factor)).outputs
    np.testing.assert_allclose(some, factor * at_once.outputs[places][:, picked], rtol=1e-15)
    tape = Tape()
    lasting = tape.remember("total")
    tape.update(lasting, lasting + tape.input("x"))
    total = RecordProgram(program(tape, {"total": lasting + 0.0}))
    assert "step_lanes" in record_source(total.program)
    sums = [total.compiled_along((), (), total.starts, [x], None, at).outputs for at in (None, np.zeros(1, dtype=int))]
    np.testing.assert_array_equal(*sums)


@pytest.mark.parametrize(
    "function", [np.tanh, lambda x: x > 0.0, lambda x: 2.0 * (x > 0.0), lambda x: (x > 0.0) == 1.0]
)
def test_programs_that_vectors_do_not_compute_run_sample_by_sample(function):
    tape = Tape()
    held = tape.remember("held")
    tape.update(held, 0.5 * held + tape.input("x"))
    assert "step_lanes" not in record_source(program(tape, {"value": function(held)}))
