"""What hangs on the time step or the current alone is computed where these change, and nowhere else."""

import re

from mrdamper.models.play_bypass import PlayBypass
from mrdamper.models.recorded import CHANNELS, traced_motion
from mrdamper.tracing import Tape, program
from mrdamper.tracing.compiled.writer import record_source
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
