"""Criteria of a simulation: comfort, tyre load, travel, and ratios to the uncontrolled structure."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mrdamper.data import Floats
from mrdamper.physics.motion.lag import decaying_sum
from mrdamper.systems.linear import aims
from mrdamper.systems.result import Simulation
from mrdamper.systems.structure import GRAVITY
from mrdamper.systems.weighting import frequency_weighted

_WINDOW = 1.0  # s, of the running mean square behind MTVV


def comfort(acceleration: Floats, step: float, weighting: str = "Wk") -> dict[str, float]:
    """Measures of ISO 2631-1 for one axis.

    `acceleration` (N,) [m/s²]; `step` [s]; `weighting`: "Wk" (seat, vertical), "Wd" (seat, horizontal), "Wf" (motion
    sickness). Returns dict: a_w [m/s²], mtvv [m/s²], vdv [m/s^1.75], crest factor [-].
    """
    weighted = frequency_weighted(acceleration, step, weighting)
    squares = weighted**2
    keep = float(np.exp(-step / _WINDOW))
    running = decaying_sum((1 - keep) * squares, keep)
    a_w = float(np.sqrt(squares.mean()))
    return {
        "a_w_m_s2": a_w,
        "mtvv_m_s2": float(np.sqrt(running.max())),
        "vdv_m_s1.75": float((np.sum(squares**2) * step) ** 0.25),
        "crest": float(np.abs(weighted).max() / a_w) if a_w > 0 else 0.0,
    }


def measures(done: Simulation) -> dict[str, float]:
    """Return every measure of a run by name, with its unit in the name."""
    values: dict[str, float] = {}
    for name, column in zip(done.system.coordinates, done.a.T, strict=True):
        values[f"{name}.peak_acceleration_m_s2"] = float(np.abs(column).max())
        values[f"{name}.rms_acceleration_m_s2"] = _rms(column)
    for name in done.system.spans:
        series = done.span(name)
        values[f"{name}.peak_span_m"], values[f"{name}.rms_span_m"] = float(np.abs(series).max()), _rms(series)
    for i, link in enumerate(done.links):
        if link.role == "damper":
            values[f"{link.name}.peak_force_N"] = float(np.abs(done.force[:, i]).max())
            values[f"{link.name}.rms_force_N"] = _rms(done.force[:, i])
            values[f"{link.name}.energy_J"] = float(done.energy[link.name][-1])
            values[f"{link.name}.mean_current_A"] = float(done.current[:, i].mean())
        elif link.role == "tyre":
            load = tyre_load(done, i)
            static = link.stiffness * link.gap
            values[f"{link.name}.rms_load_share"] = _rms(load / static - 1)
            values[f"{link.name}.lowest_load_share"] = float(load.min() / static)
    if done.system.ground is None:
        for name in dict.fromkeys(link.above for link in done.system.dampers):
            values |= {f"{name}.{k}": v for k, v in comfort(done.acceleration_of(name), done.step).items()}
    values["cost_m_s2"] = cost(done) ** 0.5
    return values


def cost(done: Simulation) -> float:
    """Mean square of all objectives [m²/s⁴], which optimal control minimises; see `linear.aims`."""
    total = 0.0
    for aim in aims(done.system):
        series = done.acceleration_of(aim.name) if aim.kind == "acceleration" else done.span(aim.name)
        total += float(np.mean((aim.weight * series) ** 2))
    return total


def tyre_load(done: Simulation, link: int) -> Floats:
    """(N,) load of a tyre on the road [N]; zero in the air."""
    tyre = done.links[link]
    moved = tyre.stiffness * done.stroke[:, link] + tyre.damping * done.stroke_rate[:, link]
    return np.maximum(tyre.stiffness * tyre.gap - moved, 0.0)


def benchmark_ratios(done: Simulation, uncontrolled: Simulation) -> dict[str, float]:
    """Calculate the J ratios of the structural control benchmarks: controlled over uncontrolled, peaks and RMS.

    J1 drift, J2 acceleration, J3 base force (M a summed), J4 to J6 their RMS; J7 damper force over
    weight, J8 damper stroke over the peak drift uncontrolled.

    References
    ----------
    Ohtori, Christenson, Spencer and Dyke (2004), "Benchmark control problems for seismically excited
    nonlinear buildings", J. Engineering Mechanics 130, 366–385 (drift as displacement, undivided by height).
    """

    def three(run: Simulation) -> Mapping[str, Floats]:
        drifts = np.column_stack([run.span(name) for name in run.system.spans])
        return {"drift": drifts, "acceleration": run.a, "base": (run.a @ run.system.M).sum(axis=1, keepdims=True)}

    ours, theirs = three(done), three(uncontrolled)
    ratios = {f"J{i}": np.abs(ours[k]).max() / np.abs(theirs[k]).max() for i, k in enumerate(ours, start=1)}
    ratios |= {
        f"J{i}": np.sqrt((ours[k] ** 2).mean(axis=0)).max() / np.sqrt((theirs[k] ** 2).mean(axis=0)).max()
        for i, k in enumerate(ours, start=4)
    }
    if dampers := done.damper_columns:
        weight = GRAVITY * float(np.trace(done.system.M))
        ratios["J7"] = np.abs(done.force[:, dampers]).max() / weight
        ratios["J8"] = np.abs(done.stroke[:, dampers]).max() / np.abs(theirs["drift"]).max()
    return {name: float(value) for name, value in ratios.items()}


def _rms(series: Floats) -> float:
    return float(np.sqrt(np.mean(series**2)))
