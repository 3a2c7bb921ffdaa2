"""Check of a damper against the second law: every steady loop in and a fifth beyond the tests dissipates energy."""

from __future__ import annotations

from dataclasses import replace

from mrdamper.dampers.base import Damper
from mrdamper.errors import InputError
from mrdamper.statistics.functions.selection import BEYOND
from mrdamper.statistics.metrics import dissipated_power


def gains_energy(damper: Damper) -> str:
    """Find a condition at which a steady loop of a damper does not dissipate, as a sentence; empty if every loop does.

    Checked are the lowest and the highest tested current and a fifth more, at the corners of the tested ranges of
    frequency and amplitude and a fifth beyond these.
    """
    tested = damper.envelope
    if not tested.tested:
        return ""
    lowest, highest = tested.current_A
    corners = [c for c in tested.farthest if c.frequency_Hz > 0 and c.amplitude_m > 0]
    looked_at = [
        replace(corner, current_A=current, amplitude_m=share * corner.amplitude_m)
        for corner in corners
        if corner.current_A in (lowest, highest)
        for current in {corner.current_A, BEYOND * highest}
        for share in (1.0, BEYOND)
    ]
    for at in dict.fromkeys(looked_at):
        try:
            loop = damper.predict(at)
        except InputError as error:
            return f"no force at {at}: {error.found}"
        if dissipated_power(loop.force, loop.motion.velocity, loop.motion.time) <= 0:
            return f"a loop that gains energy at {at}"
    return ""
