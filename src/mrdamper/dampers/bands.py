"""Prediction intervals of the force along a motion, of its peak and of the dissipated energy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrdamper.dampers.base import Damper
from mrdamper.dampers.calibration import Growth, Quantity
from mrdamper.dampers.prediction import Prediction
from mrdamper.dampers.sessions import SessionCorrection
from mrdamper.dampers.slopes import force_slopes, relative_variances
from mrdamper.dampers.uncertainty import Uncertainty
from mrdamper.data import SESSIONS_NEEDED, Condition, Floats
from mrdamper.data.wording import counted, number, span
from mrdamper.errors import ParameterError
from mrdamper.identification.intervals import student
from mrdamper.physics.motion.made import sine
from mrdamper.statistics.metrics import peak_force

_LARGEST_FORCE_N = 1e100  # whose square is finite

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False, repr=False)
class Band:
    """Prediction intervals at one level."""

    low: Floats  # (N,) [N]
    high: Floats  # (N,) [N]
    # parameter, session, model: (N,) standard deviations of the parts [N]: of the parameters, between sessions, and
    # between runs of one session with the error of the form
    parameter: Floats
    session: Floats
    model: Floats
    peak: tuple[float, float]  # of half the peak-to-peak force [N]
    # relative, around the predicted dissipated energy, and not below -1, because a damper dissipates energy
    energy: tuple[float, float]
    known_session: tuple[float, float]  # peak force once the session's gain is known [N]

    def __repr__(self) -> str:
        return f"<prediction intervals of {counted(self.low.size, 'sample')}; peak force {span(*self.peak, 'N')}>"


def band(
    damper: Damper, prediction: Prediction, level: float = 0.9, shown: NDArray[np.bool_] | None = None
) -> Band | None:
    """Prediction intervals in a future test session; None if the runs do not determine the scatter between runs.

    Where fewer than three sessions are known they hold for sessions like the tested ones (`scope`). `shown` (N,) are
    the samples of the band, its peak and its energy; by default all. Raises `InputError` (E_LEVEL) if the level is not
    between 0 and 1, and `ParameterError` if the square of the force is not finite.
    """
    student(level, 1.0)
    uncertainty = damper.uncertainty
    if uncertainty is None or not (uncertainty.of_sessions or uncertainty.run_dof > 0):
        return None
    seen_at = slice(None) if shown is None else shown
    force, motion = prediction.force[seen_at], prediction.motion.part(seen_at)
    slopes = force_slopes(damper, prediction, uncertainty.names)[seen_at]
    distance = prediction.distance(damper)
    half = peak_force(force)
    if not half < _LARGEST_FORCE_N:
        raise ParameterError(f"the predicted force reaches {number(half, 3)} N", remedy="check the model's parameters")
    parameter = np.einsum("np,pq,nq->n", slopes, uncertainty.covariance, slopes)
    session = (uncertainty.gain * force) ** 2 + uncertainty.offset**2
    model = (uncertainty.run_gain * force) ** 2 + uncertainty.run_offset**2 + (uncertainty.force * half) ** 2
    own = relative_variances(slopes, uncertainty.covariance, force, motion.velocity, motion.time)
    if distance.motion > 0 and uncertainty.growth.force[2] > 0:
        # Beyond the tested motions growth contains the whole error of the folds, including that of their parameters.
        nearest = np.minimum(own, _by_parameters(damper, damper.predict(damper.envelope.nearest(prediction.condition))))
        parameter, own = parameter * nearest[0] / (own[0] or 1.0), nearest
    held = _by_motion(damper, prediction)[seen_at]
    alike = np.eye(held.shape[1]) / held.shape[1]  # each tested motion counts alike
    _, *of_kind = relative_variances(held, alike, force, motion.velocity, motion.time)
    of_samples = np.einsum("np,pq,nq->n", held, alike, held)
    dofs = _degrees_of_freedom(uncertainty, slopes, level)
    of_run, of_session = uncertainty.run_gain**2, uncertainty.gain**2

    def reach(quantity: Quantity, parts: Sequence[float]) -> float:
        whole = sum(parts)
        if whole <= 0:
            return 0.0
        dof = whole**2 / sum(part**2 / d for part, d in zip(parts, dofs, strict=True))
        factor = uncertainty.calibration.factor(quantity, level) if uncertainty.calibration else 1.0
        return factor * student(level, dof) * float(np.sqrt(whole))

    def with_growth(at_tests: Any, quantity: Quantity, of_kind: Any) -> Any:
        # The calibration holds at the tests; it scales neither growth nor the variance of another kind of motion.
        grown = uncertainty.growth.half_width(quantity, distance, level)
        return np.sqrt(at_tests**2 + grown**2 + student(level, np.inf) ** 2 * of_kind)

    variance: Floats = parameter + session + model
    t = reach("force", [float(np.mean(v)) for v in (variance - model, model)])
    t /= float(np.sqrt(np.mean(variance))) or 1.0
    width = half * with_growth(t * np.sqrt(variance) / (half or 1.0), "force", of_samples / (half or 1.0) ** 2)
    of_peak = own[1] + of_run + uncertainty.peak**2
    at_tests = reach("peak", [own[1] + of_session, of_run + uncertainty.peak**2])
    # For a known session its part of the variance is omitted, at the same quantile.
    own_session = at_tests * float(np.sqrt(of_peak / ((of_peak + of_session) or 1.0)))
    future, known_session = (half * with_growth(each, "peak", of_kind[0]) for each in (at_tests, own_session))
    loss = reach("energy", [own[2] + of_session, of_run + uncertainty.energy**2])
    loss = float(with_growth(loss, "energy", of_kind[1]))
    model = model + uncertainty.growth.variance("force", distance) * half**2 + of_samples
    return Band(
        force - width, force + width, np.sqrt(parameter), np.sqrt(session), np.sqrt(model),
        (max(half - future, 0.0), half + future), (-min(loss, 1.0), loss),
        (max(half - known_session, 0.0), half + known_session),
    )  # fmt: skip


def _by_motion(damper: Damper, prediction: Prediction) -> Floats:
    """(N, K) changes of a predicted force [N] if the parameters were those of one of K tested motions throughout.

    Parameters that depend on frequency and amplitude were identified on sines. Along another motion they are those of
    an equivalent sine, and no test shows how well it represents the motion. The changes are zero where the parameters
    do not depend on the motion, or where motions other than sines were tested.
    """
    hull = damper.tested_motions if prediction.untested_kind else None
    held = [
        replace(damper, envelope=replace(damper.envelope, frequency_Hz=(f, f), amplitude_m=(amplitude, amplitude)))
        for f, amplitude in (hull.corners if hull else ())
    ]
    forces = [each.force_for(prediction) - prediction.force for each in held]
    return np.column_stack(forces) if forces else np.zeros((prediction.force.size, 1))


def _variance_of_kind(damper: Damper, at: Condition) -> float:
    """Relative variance of the force along other motions than sines, taken at a condition; zero if some were tested."""
    if damper.tested_motions is None or damper.envelope.any_motion:
        return 0.0
    along = replace(damper.predict(sine(at, cycles=2)), is_sine=False, untested_kind=True)
    return float(np.mean(_by_motion(damper, along) ** 2)) / peak_force(along.force) ** 2


def _by_parameters(damper: Damper, loop: Prediction) -> Floats:
    """(3,) relative variances of the force, the peak and the energy of a loop by the parameters."""
    uncertainty = damper.uncertainty
    assert uncertainty is not None
    slopes, motion = force_slopes(damper, loop, uncertainty.names), loop.motion
    return relative_variances(slopes, uncertainty.covariance, loop.force, motion.velocity, motion.time)


def _degrees_of_freedom(uncertainty: Uncertainty, slopes: Floats, level: float) -> tuple[float, float]:
    """Degrees of freedom of the variance of parameters and sessions, and of the others, which calibration contains.

    Both the scatter between sessions and its effect on the parameters follow from the same few sessions, so these two
    variances are one part. For unknown sessions, those of the parameters are their harmonic mean, weighted by the
    variance of the force.
    """
    calibration = uncertainty.calibration
    runs = np.inf if calibration and level <= calibration.reachable else max(uncertainty.run_dof, 1.0)
    if uncertainty.of_sessions:
        return max(uncertainty.session_dof, 1.0), float(runs)
    shares = np.mean(slopes**2, axis=0) * np.diag(uncertainty.covariance)
    doubt = float(np.sum(shares / uncertainty.dof))
    return max(float(np.sum(shares)) / doubt if doubt > 0 else 0.0, 1.0), float(runs)


def scope(damper: Damper, level: float) -> str:
    """Sessions for which a band holds, and its calibration, as a phrase."""
    uncertainty = damper.uncertainty
    if uncertainty is None:
        return ""
    text = (
        "in a future test session"
        if uncertainty.of_sessions
        else f"for sessions like the tested ones (fewer than {SESSIONS_NEEDED} known)"
    )
    calibration = uncertainty.calibration
    if calibration is None:
        return f"{text}, not calibrated: no cross-validated runs"
    if level > calibration.reachable:
        units = counted(calibration.units, calibration.unit)
        text += f", calibrated up to {100 * calibration.reachable:.0f} %, as {units} allow, and extrapolated beyond "
        text += "by Student's distribution"
    return text


def no_band(damper: Damper) -> str:
    """Reason why there is no prediction interval."""
    if not damper.fitted_parameters:
        reason = "the uncertainty of a model of this kind is not known"
    elif damper.uncertainty is None:
        reason = "the model was saved without its covariance; mrdamper study --model NAME saves it"
    else:
        reason = "its runs are too few to show how runs differ; test more conditions, on another day too"
    return f"no prediction interval: {reason}"


@dataclass(frozen=True)
class PortableBand:
    """A band in four parameters, for exports of a damper without its covariance.

    The force F of a loop with half its peak-to-peak force P lies within
    sqrt((gain F)² + offset_N² + (of_peak P)²) of the prediction, in a future test session.
    """

    level: float
    gain: float  # of the force
    offset_N: float  # [N]
    of_peak: float  # of half the peak-to-peak force: model error and that of the parameters
    # in its place at untested combinations inside the tested ranges: that of the farthest one, and of motions that are
    # no sines where all tests are
    of_peak_untested: float
    scope: str = ""  # sessions it holds for, as a phrase


def portable_band(damper: Damper, level: float = 0.9) -> PortableBand | None:
    """Return the band of a damper in four parameters, from loops at the lowest, middle and highest tested current.

    None where there is no band. The error that comes from the damper's parameters is taken at its root mean square over
    these loops, so a band may differ by some per cent from `band`. Raises `InputError` (E_LEVEL) if the level is not
    between 0 and 1.
    """
    uncertainty, tested = damper.uncertainty, damper.envelope
    if uncertainty is None or not tested.tested:
        return None
    at = tested.middle
    if not 0 < at.peak_velocity <= tested.peak_velocity_m_s[1]:
        at = replace(at, amplitude_m=tested.peak_velocity_m_s[1] / (2 * np.pi * at.frequency_Hz))
    currents = sorted({*tested.current_A, at.current_A})
    at_tests = replace(damper, uncertainty=replace(uncertainty, growth=Growth()))
    own, quantile, of_kind = list[float](), list[float](), list[float]()
    for current in currents:
        prediction: Prediction = damper.predict(replace(at, current_A=current))
        interval = band(at_tests, prediction, level)
        if interval is None:
            return None
        parts = np.sqrt(interval.parameter**2 + interval.session**2 + interval.model**2)
        own.append(float(np.mean(interval.parameter**2)) / peak_force(prediction.force) ** 2)
        of_kind.append(_variance_of_kind(damper, replace(at, current_A=current)))
        quantile.append(float(np.mean(interval.high - prediction.force)) / (float(np.mean(parts)) or 1.0))
    t = float(np.mean(quantile))
    away = [damper.predict(condition).distance(damper) for condition in tested.farthest]
    grown = max((uncertainty.growth.half_width("force", distance, level) for distance in away), default=0.0)
    of_peak = t * float(np.sqrt(uncertainty.force**2 + np.mean(own)))
    untested = float(np.sqrt(of_peak**2 + grown**2 + student(level, np.inf) ** 2 * np.mean(of_kind)))
    return PortableBand(
        level, t * uncertainty.total_gain, t * uncertainty.total_offset, of_peak, untested, scope(damper, level)
    )


def session_band(
    expected: SessionCorrection, damper: Damper, prediction: Prediction, level: float, shown: Mask | None = None
) -> Band | None:
    """Calculate the interval of an uncorrected prediction about the corrected one, for a session of known runs.

    None where the damper has no uncertainty.
    """
    if damper.uncertainty is None:
        return None
    spreads = {"gain": expected.gain_spread, "offset": expected.offset_spread, "run_gain": 0.0, "run_offset": 0.0}
    left = replace(damper.uncertainty, **spreads)
    uncorrected = band(replace(damper, uncertainty=left), prediction, level, shown)
    if uncorrected is None:
        return None
    peaks = {n: tuple(expected.gain * v for v in getattr(uncorrected, n)) for n in ("peak", "known_session")}
    ends = {n: expected.gain * getattr(uncorrected, n) + expected.offset for n in ("low", "high")}
    return replace(uncorrected, **ends, **peaks)
