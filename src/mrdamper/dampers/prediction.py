"""Predicted forces, with the motion they belong to and their flags of extrapolation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from mrdamper.dampers.distance import Distance, shares_between
from mrdamper.dampers.protocols import DamperLike
from mrdamper.data.conditions import Condition
from mrdamper.data.displayable import Displayable
from mrdamper.data.runs import Floats
from mrdamper.data.wording import number
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.physics.motion.made import sine
from mrdamper.physics.motion.strokes import steady_part
from mrdamper.statistics.metrics import peak_force

NOT_A_SINE = "not a sine"
_NO_DISTANCE = 1e-6  # from the hull of tested motions, by rounding
_CUT = 0.02  # of a cycle, by which a cut at a sample shortens the last one
_CYCLES, _SAMPLES = 2, 100  # of a sine from rest, and of each cycle: a steady loop may not close
_OF_HULL, _OF_VELOCITY = 0.1, 0.3  # of the distance from it, and of the logarithm of the velocity over the nearest's


@dataclass(frozen=True, eq=False, repr=False)
class Prediction(Displayable):
    """A predicted force.

    Attributes
    ----------
    motion : Excitation
    force : (N,) array
        [N]
    condition : Condition
        Of the prediction, or the equivalent condition of the motion.
    extrapolation : tuple of str
        Quantities outside the tested envelope; empty inside.
    steady : bool
        One closed loop of the steady response, not a motion from rest.
    is_sine : bool
        Whether the motion is the sine of the condition, at one current.
    untested_kind : bool
        The motion is no sine, and all tested motions are sines.

    Examples
    --------
    >>> from mrdamper import Condition, identify, load_dataset
    >>> from mrdamper.dampers.modified import fit_modified
    >>> runs = load_dataset().rig("utfsm").split("train")[:8]
    >>> damper = fit_modified([identify(run, "bingham") for run in runs]).damper
    >>> prediction = damper.predict(Condition(current_A=0.5, frequency_Hz=2.0, amplitude_m=0.01))
    >>> prediction.force.shape == prediction.motion.time.shape
    True
    """

    motion: Excitation
    force: Floats
    condition: Condition
    extrapolation: tuple[str, ...]
    steady: bool = False
    is_sine: bool = True
    untested_kind: bool = False

    @property
    def time(self) -> Floats:
        """(N,) of the motion [s]."""
        return self.motion.time

    @property
    def displacement(self) -> Floats:
        """(N,) of the motion [m]."""
        return self.motion.displacement

    @property
    def whole_cycles(self) -> slice | None:
        """Samples of the last whole cycles of the steady sine; None if the motion has no cycles at one current."""
        if self.steady:
            return slice(0, self.time.size)
        part = steady_part(self.time, self.displacement)
        first, last = self.time[part][[0, -1]]
        count = int((last - first) * self.condition.frequency_Hz + _CUT) if self.is_sine else 0
        begin = float(last - count / self.condition.frequency_Hz) if count else 0.0
        return slice(int(np.argmin(np.abs(self.time - begin))), part.stop) if count else None

    def corrected(self, gain: float, offset: float) -> Prediction:
        """Return the prediction with another gain and offset [N] of the force."""
        return replace(self, force=gain * self.force + offset)

    def distance(self, damper: DamperLike) -> Distance:
        """Distance from the tests of the damper that the prediction is of."""
        return distance_from_tests(damper, self.condition, self.motion.current)

    @property
    def headline(self) -> str:
        """Condition, peak forces and what is extrapolated."""
        low, high = float(np.min(self.force)), float(np.max(self.force))
        outside = f"; outside the tested range in {', '.join(self.extrapolation)}" if self.extrapolation else ""
        return f"prediction at {self.condition}: {number(low)} to {number(high)} N{outside}"

    @property
    def table(self) -> Mapping[str, Floats]:
        """One row per sample, SI."""
        motion = self.motion
        return {
            "time_s": motion.time,
            "displacement_m": motion.displacement,
            "velocity_m_s": motion.velocity,
            "current_A": motion.current,
            "force_N": self.force,
        }


def distance_from_tests(damper: DamperLike, condition: Condition, current: Floats) -> Distance:
    """Distance from the tests of a damper to a condition and the currents (N,) [A] along its motion.

    A motion outside the tested ones counts by how much faster it is than the nearest of them, and by how much of
    its peak force exceeds that of the nearest: what is unknown of the law of the force over the velocity grows
    with the force that the law adds. A current between two tested ones counts by how much the peak force changes
    between them: what is unknown of the law of the force over the current is a part of this change.
    """
    away = damper.envelope.distance(condition, current)
    if away.between > 0:
        away = replace(away, between=_between(damper, condition, np.abs(current)))
    if away.motion < _NO_DISTANCE:
        return away
    here, there = condition, damper.envelope.nearest(condition)
    faster = np.log(here.peak_velocity / there.peak_velocity)
    tested, peak = _peak(damper, there), _peak(damper, here)
    rise = 1 - tested / peak if peak > 0 else 0.0
    parts = [_OF_HULL * away.motion, max(_OF_VELOCITY * faster, 0.0), max(rise, 0.0)]
    return replace(away, motion=float(np.linalg.norm(parts)))


def _between(damper: DamperLike, condition: Condition, current: Floats) -> float:
    """Root mean square of the shares of currents (N,) [A] between tested ones, each times the change of the peak."""
    levels: Floats = damper.envelope.levels_A
    shares, after = shares_between(current, levels)
    change = np.zeros(levels.size)
    for k in np.unique(after[shares > 0]):
        lower, upper = (_peak(damper, replace(condition, current_A=float(levels[j]))) for j in (k - 1, k))
        change[k] = abs(upper - lower)
    peak = _peak(damper, replace(condition, current_A=float(np.max(current))))
    return float(np.sqrt(np.mean((shares * change[after]) ** 2))) / peak if peak > 0 else 0.0


def _peak(damper: DamperLike, at: Condition) -> float:
    """Half the peak-to-peak force [N] of a sine from rest."""
    return peak_force(damper.force_along(_from_rest(at), at))


@lru_cache(maxsize=256)
def _from_rest(at: Condition) -> Excitation:
    return sine(at, _CYCLES, _SAMPLES)
