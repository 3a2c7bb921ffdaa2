"""Explanations of a run that contradicts the others: what is changed, and how probable the run is afterwards."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from mrdamper.study.contradictions.evidence import Moments, Posterior
from mrdamper.study.contradictions.tracks import Track

Cause = Literal["force", "offset", "current", "displacement", "time", "sign", "damper"]

FORCE_UNITS = {"lbf": 4.4482216, "kgf": 9.80665, "kN": 1e3, "daN": 10.0, "kip": 4448.2216}  # in newtons
LENGTH_UNITS = {"inch": 25.4, "cm": 10.0, "m": 1e3, "µm": 1e-3}  # in millimetres
_NAMED = 0.08  # difference of the logarithms up to which a factor is that of a unit
_FACTORS = (0.2, 0.25, 0.35, 0.5, 0.7, 1.4, 2.0, 2.8, 4.0, 5.0)  # of displacement or time, beside units
_TIMES = (0.02, 0.05, 0.1, 60 / 1000, 10.0, 20.0, 60.0)  # factors of time, beside these
_CURRENTS = 31  # currents that are tried

# Logarithms of prior odds against an explanation: one that names a unit or a tested level is simpler.
_UNIT, _LEVEL, _FREE, _SIGN, _ODD, _ALONE = 4.0, 4.0, 7.0, 4.0, 12.0, 10.0

# Sizes below which an explanation is no contradiction but what sessions and tests differ by.
LEAST_FACTOR = 1.25  # of a force or a displacement
LEAST_OFFSET = 0.2  # of the median half range of the force
LEAST_CURRENT_EFFECT = 0.15  # change of the force over the run's half range


@dataclass(frozen=True, eq=False)
class Explanation:
    """What would make a run agree with the others.

    Attributes
    ----------
    cause : str
        "force", "offset", "current", "displacement", "time", "sign", or "damper" for a run no change explains.
    value : float
        Factor that corrects the force, the displacement or the time; force to add [N]; current [A].
    unit : str
        Unit the channel is in, where the factor is that of a unit.
    gain : float
        Logarithm of the odds of the explanation against no explanation.
    moments : Moments
        Of the run as corrected.
    track : Track
        The run as corrected.
    """

    cause: Cause
    value: float
    unit: str
    gain: float
    moments: Moments
    track: Track


class _Trial(NamedTuple):
    cause: Cause
    value: float
    unit: str
    odds: float  # logarithm of the prior odds against it


class Candidate:
    """A run beside what the other runs determine.

    Parameters
    ----------
    track : Track
    others : Posterior
    """

    def __init__(self, track: Track, others: Posterior) -> None:
        self.track, self.others, self.evidence = track, others, others.evidence
        self._columns = self.evidence.elements([track])[0]
        self.own = self.evidence.moments_of(track, self._columns)
        self.least = others.log_probability(self.own)
        self.expected = others.force(track, self._columns)

    @property
    def alone(self) -> Explanation:
        """The last resort: the run is of another damper."""
        gain = self.evidence.prior.log_probability(self.own) - _ALONE - self.least
        return Explanation("damper", 1.0, "", gain, self.own, self.track)

    def explanations(self) -> list[Explanation]:
        """Explanations that are more than differences between sessions, the most probable first."""
        found = [*self._of_the_force(), *self._of_the_current(), *self._of_the_motion()]
        return [self.alone, *(e for e in sorted(found, key=lambda e: -e.gain) if self._is_large(e))]

    def _explanation(self, trial: _Trial, moments: Moments, track: Track) -> Explanation:
        cause, value, unit, odds = trial
        gain = self.others.log_probability(moments) - odds - self.least
        return Explanation(cause, value, unit, gain, moments, track)

    def _of_the_force(self) -> Iterator[Explanation]:
        """A factor or an offset of the force."""
        expected, measured = self.expected, self.track.force[self.track.rows]
        offset = float(np.mean(expected) - np.mean(measured))
        trials: list[_Trial] = [_Trial("offset", offset, "", _FREE)]
        swing = expected - np.mean(expected)
        along = float(swing @ (measured - np.mean(measured)))
        if along > 0:
            best = float(swing @ swing) / along
            trials.append(_Trial("force", best, "", _FREE))
            units = [(u, f) for u, f in _both_ways(FORCE_UNITS) if abs(np.log(best / f)) < 3 * _NAMED]
            trials += [_Trial("force", factor, unit, _UNIT) for unit, factor in units]
        for trial in trials:
            cause, value = trial.cause, trial.value
            track = self.track.with_force(value) if cause == "force" else self.track.with_force(1.0, value)
            yield self._explanation(trial, self.evidence.moments_of(track, self._columns), track)

    def _of_the_current(self) -> Iterator[Explanation]:
        """Another constant current."""
        if self.track.current_changes:
            return
        levels = self.evidence.nodes.tolist()
        free = np.linspace(0, levels[-1], _CURRENTS)[1:-1].tolist()
        trials: list[_Trial] = [_Trial("current", level, "", _LEVEL) for level in levels]
        trials += [_Trial("current", current, "", _FREE) for current in free]
        for trial, over in zip(trials, self.evidence.shares(np.array([*levels, *free])), strict=True):
            yield self._explanation(trial, replace(self.own, over=over), self.track.with_current(trial.value))

    def _of_the_motion(self) -> Iterator[Explanation]:
        """A factor of displacement or time; both channels inverted."""
        trials: list[_Trial] = [_Trial("sign", -1.0, "", _SIGN)]
        trials += [_Trial("displacement", factor, unit, _UNIT) for unit, factor in _both_ways(LENGTH_UNITS)]
        trials += [_Trial("displacement", factor, "", _ODD) for factor in _FACTORS]
        trials += [_Trial("time", factor, "", _ODD) for factor in (*_FACTORS, *_TIMES)]
        tracks = [self._moved(cause, value) for cause, value, *_ in trials]
        for trial, track, moments in zip(trials, tracks, self.evidence.moments(tracks), strict=True):
            yield self._explanation(trial, moments, track)

    def _moved(self, cause: Cause, value: float) -> Track:
        if cause == "sign":
            return self.track.scaled(-1.0).with_force(-1.0)
        return self.track.scaled(time=value) if cause == "time" else self.track.scaled(value)

    def _is_large(self, explanation: Explanation) -> bool:
        value, size = explanation.value, self.track.half_range
        if explanation.unit and explanation.cause == "displacement" and not self._is_nearer(value):
            return False
        if explanation.cause in ("force", "displacement"):
            return abs(np.log(value)) > np.log(LEAST_FACTOR)
        if explanation.cause == "offset":
            return abs(value) > LEAST_OFFSET * max(size, 0.3 * self.evidence.force)
        if explanation.cause == "current":
            change = self.others.force(self.track.with_current(value), self._columns) - self.expected
            return float(np.max(np.abs(change))) > LEAST_CURRENT_EFFECT * size
        return True

    def _is_nearer(self, factor: float) -> bool:
        """Tell whether a factor brings the stroke nearer to the usual one, as the right unit does."""
        stroke = float(np.ptp(self.track.displacement)) / 2 / self.evidence.amplitude
        return abs(np.log(stroke * factor)) < abs(np.log(stroke))


def _both_ways(units: dict[str, float]) -> list[tuple[str, float]]:
    """Units of a channel that was read as N or mm, and of one that was read as this unit and is in N or mm."""
    return [*units.items(), *((f"not {name}", 1 / factor) for name, factor in units.items())]
