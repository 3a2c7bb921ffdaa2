"""The curves a damper is drawn with elsewhere: force over velocity, one for each current."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.joint import damper_of
from mrdamper.data import Condition, Floats
from mrdamper.errors import InputError
from mrdamper.models import Model

_SPEEDS, _CURRENTS = 12, 6
_SLOWEST = 0.02  # of the highest tested velocity


@dataclass(frozen=True, eq=False)
class ForceVelocity:
    """Forces at mid-stroke of sines of one amplitude and rising frequency."""

    current_A: float
    amplitude_m: float
    velocity: Floats  # (K,) [m/s], from the highest in compression (negative) to the highest in extension
    force: Floats  # (K,) [N]
    peak_force: Floats  # (K,), largest force of the loop in the direction of that velocity [N]
    tested: np.ndarray  # (K,), whether the sine lies inside the tested ranges


def force_velocity(
    damper: Damper | Model, currents: Sequence[float] | None = None, speeds: Sequence[float] | None = None
) -> list[ForceVelocity]:
    """Force over velocity at mid-stroke, as a damper dynamometer gives it.

    Parameters
    ----------
    damper : Damper
    currents : sequence of float, optional
        [A]; default six over the tested range.
    speeds : sequence of float, optional
        Peak velocities [m/s]; default twelve up to the highest tested, from a fiftieth of it, evenly
        in the logarithm.

    Raises
    ------
    InputError
        E_EXPORT if the damper does not know where it was tested.
    """
    damper = damper_of(damper)
    if not damper.envelope.tested:
        raise InputError("a model without tested ranges", mend="export a saved damper", code="E_EXPORT")
    envelope = damper.envelope
    amplitude = float(np.sqrt(np.prod(envelope.amplitude_m)))
    highest = envelope.peak_velocity_m_s[1]
    chosen = (
        np.geomspace(_SLOWEST * highest, highest, _SPEEDS) if speeds is None else np.sort(np.asarray(speeds, float))
    )
    levels = np.unique(np.linspace(*envelope.current_A, _CURRENTS)) if currents is None else currents
    return [_curve(damper, float(current), amplitude, chosen) for current in levels]


def _curve(damper: Damper, current: float, amplitude: float, speeds: Floats) -> ForceVelocity:
    rows = []
    for speed in speeds:
        made = damper.predict(Condition(current, float(speed / (2 * np.pi * amplitude)), amplitude))
        v, force = made.motion.velocity, made.force
        out, back = int(np.argmax(v)), int(np.argmin(v))
        rows.append((force[back], force[out], force.min(), force.max(), not made.extrapolation))
    back, out, lowest, highest, tested = (np.array(column) for column in zip(*rows, strict=True))
    return ForceVelocity(
        current,
        amplitude,
        np.concatenate([-speeds[::-1], speeds]),
        np.concatenate([back[::-1], out]),
        np.concatenate([lowest[::-1], highest]),
        np.concatenate([tested[::-1], tested]),
    )
