"""Bands: where the force of a damper lies in a session nobody has seen, and once its gain is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mrdamper.dampers.base import Damper, Prediction
from mrdamper.dampers.certainty import Certainty
from mrdamper.dampers.slopes import force_slopes
from mrdamper.data import Floats
from mrdamper.identification.intervals import student
from mrdamper.metrics import dissipated_power, peak_force


@dataclass(frozen=True, eq=False)
class Band:
    """Where the force of an unknown session lies.

    Attributes
    ----------
    low, high : (N,) arrays
        [N]
    parameter, session, model : (N,) arrays
        Standard deviations of the parts [N].
    peak : (float, float)
        Of half the peak-to-peak force [N].
    energy : (float, float)
        Relative, around the predicted dissipated energy.
    known_session : (float, float)
        Peak force once the session's gain is known [N].
    """

    low: Floats
    high: Floats
    parameter: Floats
    session: Floats
    model: Floats
    peak: tuple[float, float]
    energy: tuple[float, float]
    known_session: tuple[float, float]


def band(
    damper: Damper, prediction: Prediction, level: float = 0.9, shown: NDArray[np.bool_] | None = None
) -> Band | None:
    """Where the force lies at a level, in a session nobody has seen; None where that cannot be known.

    Parameters
    ----------
    damper : Damper
    prediction : Prediction
        Of this damper.
    level : float
    shown : (N,) array of bool, optional
        Samples the band is of, its peak and its energy among them; default all.

    Raises
    ------
    InputError
        E_LEVEL if the level is not between 0 and 1.
    """
    student(level, 1.0)
    known: Certainty | None = damper.certainty
    if known is None or known.one_session:
        return None
    seen_at = slice(None) if shown is None else shown
    force, motion = prediction.force[seen_at], prediction.motion.part(seen_at)
    slopes = force_slopes(damper, prediction, known.names)[seen_at]
    half = peak_force(force)
    parameter = np.einsum("np,pq,nq->n", slopes, known.covariance, slopes)
    session = (known.gain * force) ** 2 + known.offset**2
    model = np.full(force.size, (known.force * half) ** 2)
    top, bottom = int(np.argmax(force)), int(np.argmin(force))
    swing = (slopes[top] - slopes[bottom]) / 2
    own = float(swing @ known.covariance @ swing)
    worst = float(np.min(known.dof)) if known.names else 1.0
    dofs = (worst, max(known.session_dof, 1.0), max(known.left_out - 1.0, 1.0))

    def reach(parts: Sequence[float]) -> float:
        whole = sum(parts)
        if whole <= 0:
            return 0.0
        dof = whole**2 / sum(part**2 / d for part, d in zip(parts, dofs, strict=True))
        return student(level, dof) * float(np.sqrt(whole))

    t = reach([float(np.mean(v)) for v in (parameter, session, model)])
    mean = float(np.mean(parameter + session + model))
    width = (t / np.sqrt(mean) if mean > 0 else 0.0) * np.sqrt(parameter + session + model)
    unseen = reach([own, (known.gain * half) ** 2, (known.peak * half) ** 2])
    seen = reach([own, 0.0, (known.peak * half) ** 2])
    power = dissipated_power(force, motion.velocity, motion.time) or 1.0
    turned = np.array([dissipated_power(column, motion.velocity, motion.time) for column in slopes.T]) / power
    loss = reach([float(turned @ known.covariance @ turned), known.gain**2, known.energy**2])
    return Band(
        force - width, force + width, np.sqrt(parameter), np.sqrt(session), np.sqrt(model),
        (max(half - unseen, 0.0), half + unseen), (-loss, loss), (max(half - seen, 0.0), half + seen),
    )  # fmt: skip


def no_band(damper: Damper) -> str:
    """Why there is no band, in words."""
    if not damper.fitted_parameters:
        return "no band: how sure a model of this kind is cannot be worked out"
    if damper.certainty is None:
        return "no band: the model was saved without its covariance"
    return "no band: all its runs are of one session, and how far another one lies cannot be known; test on another day"


@dataclass(frozen=True)
class PortableBand:
    """A band in three numbers, for where a damper travels without its covariance.

    The force F of a loop with half its peak-to-peak force P lies within
    sqrt((gain F)² + offset_N² + (of_peak P)²) of the prediction, in a session nobody has seen.

    Attributes
    ----------
    level : float
    gain : float
        Of the force.
    offset_N : float
        [N]
    of_peak : float
        Of half the peak-to-peak force: the model's own error and that of its numbers.
    """

    level: float
    gain: float
    offset_N: float
    of_peak: float


def portable_band(damper: Damper, level: float = 0.9) -> PortableBand | None:
    """The band of a damper in three numbers, from loops at the lowest, middle and highest tested current.

    None where nothing is known of it. The error that comes from the damper's numbers is taken at
    its root mean square over these loops, so a band may differ by some per cent from `band`.

    Raises
    ------
    InputError
        E_LEVEL if the level is not between 0 and 1.
    """
    known, tested = damper.certainty, damper.envelope
    if known is None or not tested.tested:
        return None
    at = tested.middle
    if not 0 < at.peak_velocity <= tested.peak_velocity_m_s[1]:
        at = replace(at, amplitude_m=tested.peak_velocity_m_s[1] / (2 * np.pi * at.frequency_Hz))
    currents = sorted({*tested.current_A, at.current_A})
    own, quantile = [], []
    for current in currents:
        prediction = damper.predict(replace(at, current_A=current))
        found = band(damper, prediction, level)
        if found is None:
            return None
        parts = np.sqrt(found.parameter**2 + found.session**2 + found.model**2)
        own.append(np.mean(found.parameter**2) / peak_force(prediction.force) ** 2)
        quantile.append(np.mean(found.high - prediction.force) / (np.mean(parts) or 1.0))
    t = float(np.mean(quantile))
    return PortableBand(level, t * known.gain, t * known.offset, t * float(np.sqrt(known.force**2 + np.mean(own))))
