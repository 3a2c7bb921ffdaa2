"""Uncertainty of a damper in three parts: parameters, future test sessions, and model error.

The identified parameters are uncertain (*parameter*): noise and model error within the runs, and
gains and offsets that differ from session to session. A future test session has a gain and an
offset of its own (*session*). The equations do not describe the damper exactly (*model*): the
error at cross-validated conditions in excess of the other two.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from mrdamper.dampers.calibration import Calibration, Growth
from mrdamper.dampers.sessions import Sessions
from mrdamper.data import Displayable, Floats
from mrdamper.data.wording import number
from mrdamper.errors import InputError, listed
from mrdamper.identification.intervals import NOT_IDENTIFIABLE, interval_about, weaknesses, written

if TYPE_CHECKING:
    from mrdamper.dampers.protocols import DamperLike as Damper
_MAX_LISTED = 6  # number of parameters named in one sentence
_MAX_RELATIVE_ERROR = 0.5  # standard error over the estimate from which a parameter is not significant


@dataclass(frozen=True)
class FittedParameter:
    """A parameter of a damper determined from data; `log` where its logarithm is searched.

    A coefficient of the logarithm of a parameter enters it, at the tests, as at most `exponent` times itself.
    """

    value: float
    bounds: tuple[float, float] = (-np.inf, np.inf)
    log: bool = False
    unit: str = ""
    exponent: float = 0.0

    @property
    def at_bound(self) -> str:
        """The bound that its value is, "lower" or "upper"; empty inside them."""
        near = np.isclose(self.value, self.bounds, rtol=1e-6, atol=1e-12)
        return "lower" if near[0] else "upper" if near[1] else ""

    def moved(self, step: float) -> float:
        """Return the value after a step, of its logarithm where this is searched, within the bounds."""
        return float(np.clip(self.value * math.exp(step) if self.log else self.value + step, *self.bounds))


@dataclass(frozen=True, eq=False, repr=False)
class Uncertainty(Displayable):
    """Uncertainty of the P parameters and the predictions of a damper."""

    names: tuple[str, ...]  # parameters determined from the data
    logs: tuple[bool, ...]  # whether the covariance is that of the logarithm
    covariance: Floats  # (P, P)
    dof: Floats  # (P,) degrees of freedom of each variance
    one_sided: tuple[str, ...] = ()  # parameters held at a bound: their interval is one-sided
    # parameters not identifiable from these runs; for those among `names` the variance holds with the others fixed
    unknown: tuple[str, ...] = ()
    # gain, offset: standard deviations between sessions, of the force as a share and as a shift [N]
    gain: float = 0.0
    offset: float = 0.0
    # their degrees of freedom; zero with fewer than three known sessions: then intervals are for sessions like these
    session_dof: float = 0.0
    # run_gain, run_offset: standard deviations between runs of one session [-] and [N]
    run_gain: float = 0.0
    run_offset: float = 0.0
    run_dof: float = 0.0  # their degrees of freedom; zero if the runs do not determine them
    # force, peak, energy: standard deviations after a gain and an offset are fitted to each run: of the force over half
    # its peak-to-peak value, of the peak force and of the dissipated energy, relative
    force: float = 0.0
    peak: float = 0.0
    energy: float = 0.0
    left_out: int = 0  # cross-validated runs behind them; zero where the residuals of the fit are used instead
    # findings that need the runs: correlated parameters, and parameters determined mainly by one run
    words: tuple[str, ...] = ()
    # share of each run in the information on the parameters
    information: Mapping[str, float] = field(default_factory=dict[str, float])
    # independent samples with the same standard error of each parameter, without sessions and correlated noise
    effective: Mapping[str, float] = field(default_factory=dict[str, float])
    # (P,) factor on the standard errors, for curvature (above one) and few sessions (below one); prediction intervals
    # of the force do not use it
    interval_factor: Floats | float = 1.0
    sessions: Sessions | None = None  # variation between sessions, days and hours, where the tests determine it
    calibration: Calibration | None = None  # of prediction intervals, on cross-validated runs
    growth: Growth = field(default_factory=Growth)  # of the model's error with the distance from the tests

    @property
    def headline(self) -> str:
        """Number of parameters, scatter between sessions and prediction intervals."""
        sessions = f"gain {number(100 * self.gain, 2)} % between sessions, " if self.of_sessions else "gain "
        coverage = f"; {self.calibration.summary}" if self.calibration else ""
        return (
            f"uncertainty of {len(self.names)} parameters: {sessions}{number(100 * self.run_gain, 2)} % "
            f"between runs, model error of the force {number(100 * self.force, 2)} %{coverage}"
        )

    @property
    def table(self) -> Mapping[str, Sequence[Any]]:
        """Standard error of each parameter, or of its logarithm, and the degrees of freedom behind it."""
        errors = self.standard_errors.tolist()
        names, logs, dof = list(self.names), list(self.logs), self.dof.tolist()
        return {"parameter": names, "logarithm": logs, "standard_error": errors, "degrees_of_freedom": dof}

    @property
    def of_sessions(self) -> bool:
        """True where the scatter between sessions is known, so that intervals hold in future sessions."""
        return self.session_dof > 0

    @property
    def total_gain(self) -> float:
        """Standard deviation of the gain of a run in a future session."""
        return math.hypot(self.gain, self.run_gain)

    @property
    def total_offset(self) -> float:
        """Standard deviation of the offset of a run in a future session [N]."""
        return math.hypot(self.offset, self.run_offset)

    @property
    def standard_errors(self) -> Floats:
        """(P,) of the parameters, or of their logarithms."""
        return self.interval_factor * np.sqrt(np.diag(self.covariance))

    def ends(self, damper: Damper, name: str, level: float = 0.95) -> tuple[float, float] | None:
        """Return the ends of a parameter's interval; None where it is at a bound or not identifiable."""
        if name not in self.names or name in self.unknown:
            return None
        i = self.names.index(name)
        own, error = damper.fitted_parameters[name], float(self.standard_errors[i])
        return interval_about(own.value, error, self.dof[i], level, self.logs[i], own.exponent)

    def interval(self, damper: Damper, name: str, level: float = 0.95) -> tuple[float, float]:
        """Return the ends of a parameter's interval; raises `InputError` (E_CERTAINTY) if its variance is not known."""
        if ends := self.ends(damper, name, level):
            return ends
        why = "is held by a bound" if name in self.one_sided else NOT_IDENTIFIABLE
        raise InputError(f"{name} {why}", remedy="test where it matters", code="E_CERTAINTY")


def uncertainty_warnings(damper: Damper) -> list[str]:
    """State the parameters that are not identifiable or badly determined, and the missing sessions."""
    uncertainty: Uncertainty | None = damper.uncertainty
    if uncertainty is None:
        return ["The uncertainty of the parameters is not known: the model was saved without it."]
    numbers = damper.fitted_parameters
    ended: dict[str, list[str]] = {}
    for name in uncertainty.one_sided:
        ended.setdefault(_limit(numbers[name]), []).append(name)
    sentences = [
        f"{', '.join(names)} ended at {limit}; {('its interval is', 'their intervals are')[len(names) > 1]} one-sided."
        for limit, names in ended.items()
    ]
    sentences += [f"{text}." for text in uncertainty.words]
    mentioned = " ".join(uncertainty.words)
    if silent := [name for name in uncertainty.unknown if name not in mentioned]:
        sentences.append(f"{', '.join(silent)} {NOT_IDENTIFIABLE}.")
    if not uncertainty.of_sessions:
        sentences.append(
            "Fewer than three known sessions: the scatter between sessions is not estimated, and intervals hold for "
            "sessions like the tested ones."
        )
    elif uncertainty.session_dof < 2:
        sentences.append("The scatter between sessions rests on fewer than two degrees of freedom.")
    sentences += [
        f"The forces of session {session} are {number(100 * abs(ratio - 1), 2)} % "
        f"{'above' if ratio > 1 else 'below'} those of the other sessions, which differ less from each other: check "
        "its load cell, temperature and preload."
        for session, ratio in (uncertainty.sessions.deviating() if uncertainty.sessions else {}).items()
    ]
    apart, wide, weak = list[int](), list[tuple[str, str]](), list[tuple[str, str]]()
    for i, name in enumerate(uncertainty.names):
        ends = uncertainty.ends(damper, name)
        if ends is None:
            continue
        apart.append(i)
        error = float(uncertainty.standard_errors[i])
        if uncertainty.logs[i] and error > _MAX_RELATIVE_ERROR:
            wide.append((name, written(float(f"{ends[1] / ends[0]:.2g}"), None)))
        elif not uncertainty.logs[i] and error > _MAX_RELATIVE_ERROR * abs(numbers[name].value):
            about = written(numbers[name].value, ends, numbers[name].unit)
            weak.append((name, about))
    sentences += _grouped(weak, "{} is not significant ({})", "Not significant")
    sentences += _grouped(wide, "95 % interval of {} spans a factor of {}", "95 % intervals span a factor of")
    names, block = [uncertainty.names[i] for i in apart], uncertainty.covariance[np.ix_(apart, apart)]
    return [*sentences, *(f"{text}." for text in weaknesses(names, block))]


def _grouped(entries: list[tuple[str, str]], single: str, several: str) -> list[str]:
    """State one entry in a sentence of its own, several in one sentence."""
    if len(entries) < 2:
        return [single.format(*entry) + "." for entry in entries]
    return [f"{several}: {listed([f'{name} ({value})' for name, value in entries], _MAX_LISTED)}."]


def _limit(own: FittedParameter) -> str:
    if not own.at_bound:
        return "a limit of what was searched"
    return f"its {own.at_bound} limit {own.bounds[own.at_bound == 'upper']:g}"


def table(damper: Damper, level: float = 0.95) -> list[dict[str, Any]]:
    """Return the parameters with the ends of their intervals and their state, one row per parameter.

    Keys: name, value, unit, low, high (NaN where there are none), effective_samples (NaN where not
    known), state, written (as on a screen).
    """
    uncertainty: Uncertainty | None = damper.uncertainty
    rows: list[dict[str, Any]] = []
    for name, own in damper.fitted_parameters.items():
        ends = uncertainty.ends(damper, name, level) if uncertainty else None
        if uncertainty is None:
            state = "no covariance"
        elif name in uncertainty.one_sided:
            state = f"one-sided: at {_limit(own)}"
        else:
            state = "determined" if ends else NOT_IDENTIFIABLE
        low, high = ends or (math.nan, math.nan)
        row = {"name": name, "value": own.value, "unit": own.unit, "low": low, "high": high}
        row["effective_samples"] = uncertainty.effective.get(name, math.nan) if uncertainty and ends else math.nan
        text = written(own.value, ends, own.unit) + ("" if ends else f" ({state})")
        if state == NOT_IDENTIFIABLE:
            text = state  # the estimate is one of many with the same fit
        rows.append({**row, "state": state, "written": text})
    return rows
