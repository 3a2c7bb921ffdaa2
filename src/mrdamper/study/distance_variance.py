"""Variance of the force by the distance from the tests, once planned records are among them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.distance import Distance
from mrdamper.dampers.prediction import distance_from_tests
from mrdamper.data import Condition, Floats
from mrdamper.identification.intervals import student
from mrdamper.physics.motion import Excitation

DISTANCES = ("between the tested currents", "beyond the tested currents", "outside the tested motions")


def distance_variance(
    damper: Damper, at: Sequence[Condition], records: Sequence[Condition], level: float
) -> Callable[[Sequence[int]], Floats]:
    """Return a function of the indices of records that gives the variances (3,) of the force by `DISTANCES` after them.

    They are those of the interval at `level`, mean over the conditions `at`, of the force over half its peak-to-peak
    value.
    """
    uncertainty, envelope = damper.uncertainty, damper.envelope
    if not at or uncertainty is None or not any(uncertainty.growth.force) or not envelope.conditions:
        return lambda rows: np.zeros(len(DISTANCES))
    half = [uncertainty.growth.half_width("force", Distance(*unit), level) for unit in np.eye(len(DISTANCES)).tolist()]
    factors = np.square(half) / student(level, np.inf) ** 2
    first, forces = Condition(*envelope.conditions[0]), dict[Condition, Floats]()

    def force_along(motion: Excitation, condition: Condition) -> Floats:
        if condition not in forces:
            forces[condition] = damper.force_along(motion, condition)
        return forces[condition]

    def squares(tests: Sequence[Condition], currents: Sequence[float]) -> Floats:
        tested: Any = SimpleNamespace(envelope=envelope.with_tests(tests), force_along=force_along)
        pairs = zip(at, currents, strict=True)
        return np.mean([distance_from_tests(tested, c, np.array([current])).squares for c, current in pairs], axis=0)

    @cache
    def by_current(currents: frozenset[float]) -> Floats:
        tests = [Condition(current, first.frequency_Hz, first.amplitude_m) for current in currents]
        return squares(tests, [c.current_A for c in at])[:2]

    @cache
    def by_motion(motions: frozenset[tuple[float, float]]) -> Floats:
        return squares([Condition(first.current_A, *motion) for motion in motions], [first.current_A] * len(at))[2:]

    away = [envelope.distance(c, np.array([c.current_A])) for c in records]
    currents = [c.current_A if d.between or d.beyond else None for c, d in zip(records, away, strict=True)]
    motions = [(c.frequency_Hz, c.amplitude_m) if d.motion else None for c, d in zip(records, away, strict=True)]

    def variances(rows: Sequence[int]) -> Floats:
        # Currents and motions of records change different distances; those of tests change none.
        new_currents = frozenset(currents[i] for i in rows if currents[i] is not None)
        new_motions = frozenset(motions[i] for i in rows if motions[i] is not None)
        return np.append(by_current(new_currents), by_motion(new_motions)) * factors

    return variances
