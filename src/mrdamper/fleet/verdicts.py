"""Outliers and their causes, and drift of the rig or of production, from the table of a population."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from typing import Any

import numpy as np
import polars as pl
from scipy.stats import linregress, trim_mean

from mrdamper.data import Floats

FEATURES = {  # title and unit by column
    "force_off_N": ("damping force at the lowest current", "N"),
    "force_rise_N": ("rise of the damping force with current", "N"),
    "gas_force_N": ("gas force", "N"),
    "friction_N": ("friction", "N"),
}
_SHAPE = "shape_deviation"
_MIN_DAMPERS = 8  # smallest number of dampers of a population for outliers, and of a session as a reference
_OUTLIER_DEVIATIONS = 4.0  # robust standard deviations
_SIGNIFICANCE = 0.01  # significance of a drift
_MIN_DRIFT = 0.005  # relative drift over the whole time below which none is reported
_CAUSES = (
    ("gas_force_N", -1, "low gas"),
    ("force_rise_N", -1, "wrong coil or weak fluid"),
    ("friction_N", -1, "worn seal"),
)


def with_features(frame: pl.DataFrame) -> pl.DataFrame:
    """Add half the difference of rebound and compression at the highest speed, at the lowest current and its rise."""
    ladder = [c for c in frame.columns if c.startswith("rebound_N_")]
    if not ladder:
        return frame.with_columns(force_off_N=pl.lit(None, pl.Float64), force_rise_N=pl.lit(None, pl.Float64))
    # rebound_N_0.25m_s_1A
    speeds = {c: float(c.split("_")[2].removesuffix("m")) for c in ladder}
    currents = {c: float(c.split("_")[4].removesuffix("A")) for c in ladder}
    top = [c for c in ladder if speeds[c] == max(speeds.values())]
    low, high = min(top, key=currents.__getitem__), max(top, key=currents.__getitem__)

    def half(column: str) -> pl.Expr:
        return (pl.col(column) - pl.col(column.replace("rebound", "compression"))) / 2

    return frame.with_columns(force_off_N=half(low), force_rise_N=half(high) - half(low))


@dataclass(frozen=True)
class Suspect:
    """An outlier of the population."""

    serial: str
    session: str
    cause: str  # most common cause
    findings: tuple[str, ...]  # quantities with their distances, the largest first


def suspects(frame: pl.DataFrame) -> list[Suspect]:
    """Return dampers more than four robust standard deviations from the population, sessions of the rig subtracted."""
    if frame.height < _MIN_DAMPERS:
        return []
    names = [name for name in (*FEATURES, _SHAPE) if frame[name].null_count() < frame.height]
    sessions = np.array(frame["session"].to_list())
    away = {}
    for name in names:
        values = frame[name].cast(float).fill_null(np.nan).to_numpy().astype(float)
        values = np.log(np.maximum(values, 1e-12)) if name == _SHAPE else values
        away[name] = _away(values, sessions)
    suspected = []
    for i, row in enumerate(frame.iter_rows(named=True)):
        far = {n: z[i] for n, z in away.items() if (z[i] if n == _SHAPE else abs(z[i])) > _OUTLIER_DEVIATIONS}
        if not far:
            continue
        order = sorted(far, key=lambda n: -abs(far[n]))
        cause = next((text for n, sign, text in _CAUSES if far.get(n, 0) * sign > 0), "")
        cause = cause or ("odd loop: air in the oil, a valve" if _SHAPE in far else "look at it")
        text = tuple(f"{FEATURES[n][0] if n in FEATURES else 'loop shape'} {away[n][i]:+.0f} σ" for n in order)
        suspected.append(Suspect(row["serial"], row["session"] or "", cause, text))
    return suspected


def _away(values: Floats, sessions: np.ndarray) -> Floats:
    """Robust standard deviations from the median, of the session where it has enough dampers."""
    centred = values - np.nanmedian(values)
    for session in np.unique(sessions):
        inside = sessions == session
        if np.sum(inside) >= _MIN_DAMPERS:
            centred[inside] = values[inside] - np.nanmedian(values[inside])
    spread = 1.4826 * np.nanmedian(np.abs(centred))
    return np.nan_to_num(centred / max(spread, 1e-300))


@dataclass(frozen=True)
class Drift:
    """Drift from the first session to the last."""

    verdict: str  # "rig", "line", "both", "none" or "cannot tell"
    rig: float  # relative change of the rig; NaN if unknown
    line: float  # relative change of production, that of the rig subtracted
    text: str


def drift(values: Floats, sessions: Sequence[str], serials: Sequence[str], golden: Sequence[bool]) -> Drift:
    """Separate the drift of the rig, measured with master dampers, from that of production.

    `values` (N,): positive, for example a force; `sessions`: in the order of time when sorted.
    """
    order = sorted(set(sessions))
    if len(order) < 3:
        return Drift("cannot tell", np.nan, np.nan, f"sessions: {len(order)}; a drift needs three or more.")
    logs, at = np.log(np.maximum(values, 1e-12)), np.array([order.index(s) for s in sessions])
    watch = np.array(golden, dtype=bool)
    everyone = _by_session(logs, at, ~watch, len(order))
    names = np.array(serials)
    own = logs.copy()
    for name in np.unique(names[watch]):
        own[names == name] -= np.mean(logs[names == name])
    watched = _by_session(own, at, watch, len(order))
    share = np.arange(len(order)) / (len(order) - 1)
    if np.sum(np.isfinite(watched)) < 3:
        change, sure = _trend(share, everyone)
        if not sure:
            return Drift("none", np.nan, change, "No drift is found; without master dampers, drifts could cancel.")
        text = f"Forces change by {100 * change:+.1f} %, but cannot tell drift of the rig apart: test master dampers."
        return Drift("cannot tell", np.nan, np.nan, text)
    rig, rig_sure = _trend(share, watched)
    line, line_sure = _trend(share, everyone - watched)
    verdict = {(True, False): "rig", (False, True): "line", (True, True): "both"}.get((rig_sure, line_sure), "none")
    certain = "neither is certain" if verdict == "none" else f"certain: {verdict}"
    text = f"From the first session to the last the rig changes by {100 * rig:+.1f} %"
    return Drift(verdict, rig, line, f"{text}, the line beside it by {100 * line:+.1f} %; {certain}.")


def _by_session(logs: Floats, at: np.ndarray, chosen: np.ndarray, count: int) -> Floats:
    """Mean of each session without the highest and the lowest tenth, robust against faulty dampers."""
    inside = [logs[chosen & (at == i)] for i in range(count)]
    return np.array([trim_mean(values, 0.1) if values.size else np.nan for values in inside])


def _trend(share: Floats, means: Floats) -> tuple[float, bool]:
    """Change over the whole time, and whether it is significant."""
    finite = np.isfinite(means)
    if np.sum(finite) < 3:
        return np.nan, False
    line: Any = linregress(share[finite], means[finite])
    return float(line.slope), bool(line.pvalue < _SIGNIFICANCE and abs(line.slope) > _MIN_DRIFT)


def clock_findings(frame: pl.DataFrame) -> list[str]:
    """List dates that cannot be read, or that run backwards from session to session."""
    last, findings = None, []
    for session, text in frame.select("session", "date").unique(maintain_order=True).sort("session").iter_rows():
        if not text:
            continue
        try:
            day = date.fromisoformat(text[:10])
        except ValueError:
            findings.append(f"session {session}: {text!r} is no date like 2024-05-31")
            continue
        if last is not None and day < last[1]:
            findings.append(f"the clock jumps back from {last[1]} in session {last[0]} to {day} in session {session}")
        last = (session, day)
    return list(dict.fromkeys(findings))
