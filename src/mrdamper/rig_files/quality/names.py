"""Frequency and amplitude that a name or a heading states, against the motion that was measured."""

from __future__ import annotations

import re
from collections.abc import Iterator

from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding

_NUMBER = r"(?<![\d.,x])(?<!\dp)(\d{1,4}(?:[.,xp]\d{1,4})?)[ _]?"
_FREQUENCY = re.compile(_NUMBER + r"hz(?![a-z])", re.IGNORECASE)
_AMPLITUDE = re.compile(_NUMBER + r"mm(?![a-z/]|[ _]?s)", re.IGNORECASE)
_SAME_FREQUENCY = 0.2  # relative difference of what is measured
# Measured amplitude over the one stated, which may be the stroke peak to peak: a machine falls short of its command.
_AMPLITUDES = (0.25, 1.6)


def agrees_with_its_name(view: View) -> Iterator[Finding]:
    """Report a motion of another frequency or amplitude than a name or heading states.

    One of both is refused, and one of another frequency where time is nothing but a sampling rate that is stated.
    """
    motion = view.motion
    if motion is None:
        return
    notes = view.record.provenance
    name = f"{notes.get('file', '')} {view.record.id} {notes.get('motion_stated', '')}"
    measured = motion.condition
    frequency, amplitude = _stated(_FREQUENCY, name), _stated(_AMPLITUDE, name)
    contradictions = []
    if frequency is not None and abs(measured.frequency_Hz / frequency - 1) > _SAME_FREQUENCY:
        contradictions.append((f"{frequency:g} Hz", f"{measured.frequency_Hz:.3g} Hz", "time"))
    if amplitude is not None and not _AMPLITUDES[0] < 1e3 * measured.amplitude_m / amplitude < _AMPLITUDES[1]:
        contradictions.append(
            (f"{amplitude:g} mm", f"an amplitude of {1e3 * measured.amplitude_m:.3g} mm", "displacement")
        )
    rate = notes.get("time_from", "")
    if len(contradictions) == 1 and rate and contradictions[0][2] == "time":
        stated, has, _ = contradictions[0]
        problem = f"the name or heading states {stated}, and by the sampling rate ({rate}) the motion has {has}"
        raise view.refused(
            "E_MOTION_CONTRADICTS", problem, "set [file] sample_rate_Hz = ... in a profile, or correct the name"
        )
    if len(contradictions) > 1:
        stated, has, channels = (" and ".join(words) for words in zip(*contradictions, strict=True))
        problem = f"the name or heading states {stated}, and the record has {has}: the record of another test?"
        raise view.refused("E_MOTION_CONTRADICTS", problem, f"correct the name or heading, or the units of {channels}")
    for stated, has, channel in contradictions:
        text = f"the name or heading states {stated} and the record has {has}: check the unit of {channel}, or the name"
        yield Finding("W_NAME", text)


def _stated(pattern: re.Pattern[str], name: str) -> float | None:
    """Return the one value a name states; None for none, for several, and for zero."""
    values = {float(re.sub("[,xp]", ".", number.lower())) for number in pattern.findall(name)}
    return values.pop() if len(values) == 1 and 0.0 not in values else None
