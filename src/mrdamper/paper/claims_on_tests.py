"""Measurements on the tests, without a model: friction, bulge, energy, stroke ends, F0 and its phase."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from itertools import pairwise

import numpy as np

from mrdamper.data import Condition, Floats, Run, same_motion
from mrdamper.data.wording import number, span
from mrdamper.errors import IdentificationError
from mrdamper.identification.harmonic_balance import SineRecord
from mrdamper.paper.assumptions import SAME
from mrdamper.paper.options import CONSISTENT
from mrdamper.paper.results import Measured, Reproduction, motions, unknown, values
from mrdamper.physics.motion import equivalent_sine, measured_motion
from mrdamper.statistics.functions.fitting import fit_function

_FULL = 0.9  # share of the mid-stroke force at which it counts as restored after a reversal


def gas_series(study: Reproduction) -> Measured:
    """Compare the third-order series with the gas force over the strokes tested."""
    if study.gas is None:
        return unknown("the gas spring of this rig is not known")
    X = max(loop.condition.amplitude_m for loop in study.loops)
    return Measured.of(study.gas.taylor_error(X), evidence=f"within ±{1e3 * X:.0f} mm")


def friction(study: Reproduction) -> Measured:
    """Measure the friction of the slow test, and its ratio to the smallest peak force."""
    if study.friction is None:
        return unknown("the data hold no friction test")
    _, forces = friction_along(study.friction)
    share = float(np.mean(forces)) / min(loop.peak_force for loop in study.loops)
    fluid = "with" if study.options.friction_test == "filled" else "without"
    return Measured.of(forces.min(), forces.max(), share, evidence=f"test {fluid} fluid")


def bulges(study: Reproduction) -> Measured:
    """Return the share of loops that are widest at mid-stroke."""
    ratios = np.array([bulge(run) for run in study.train])
    return Measured.of(np.mean(ratios > 1), evidence=f"ratio of widths {span(ratios.min(), ratios.max())}")


def energy(study: Reproduction) -> Measured:
    """Return the shares of steps in current and frequency that raise the energy of a cycle."""
    energies = [loop.dissipated_energy for loop in study.loops]
    shares = rising_shares([loop.condition for loop in study.loops], energies)
    return Measured.of(*shares, evidence=f"{span(min(energies), max(energies), 'J')} per cycle")


def stroke_end(study: Reproduction) -> Measured:
    """Compare the lost lengths at the highest current, fastest motion over slowest."""
    if study.contender(CONSISTENT) is None:
        return unknown("the viscous force is not known: the consistent method could not be followed")
    top = max(c.current_A for c in study.conditions)
    linear = zip(*(values(study, CONSISTENT, name).tolist() for name in ("c", "k1", "m")), strict=True)
    tests = [
        (condition.peak_velocity, (run, c, k1 - m * (2 * np.pi * condition.frequency_Hz) ** 2))
        for condition, run, (c, k1, m) in zip(study.conditions, study.train, linear, strict=True)
        if condition.current_A > top - 0.01
    ]
    ends = min(tests, key=lambda p: p[0]), max(tests, key=lambda p: p[0])
    slow, fast = (speed for speed, _ in ends)
    if fast < 1.3 * slow:
        return unknown("one speed at the highest current")
    short, long = (1e3 * lost_length(*test) for _, test in ends)
    return Measured.of(
        long / short,
        evidence=f"at {top:g} A 90 % of the hysteretic force is back after {short:.2f} mm at {slow:.2f} m/s and after "
        f"{long:.2f} mm at {fast:.2f} m/s",
    )


def phase(study: Reproduction) -> Measured:
    """Return the share of runs with a lead of 1.4–1.5 rad, and its largest change with the current."""
    leads = np.array([r.phase for r in study.readings])
    spread = max((float(np.ptp(leads[g])) for g in motions(study) if len(g) > 1), default=float("nan"))
    evidence = f"{span(leads.min(), leads.max(), 'rad')}; smallest sine {np.sin(leads).min():.3f}"
    return Measured.of(np.mean((leads > 1.4) & (leads < 1.5)), spread, evidence=evidence)


def quadratic(study: Reproduction) -> Measured:
    """Return the lowest R² of a quadratic of the current for F0 at a motion."""
    F0, fits, groups = values(study, "", "F0"), [], motions(study)
    for group in groups:
        if len({round(study.conditions[i].current_A, 3) for i in group}) > 3:
            with suppress(IdentificationError):  # currents too near each other to determine it
                fits.append(fit_function("quadratic-current", [study.conditions[i] for i in group], F0[group]).r2)
    if not fits:
        return unknown(
            f"none of {len(groups)} motions was tested at 4 currents or more: a quadratic through three points would "
            "prove nothing"
        )
    return Measured.of(min(fits), evidence=f"largest {number(max(fits), 3)} over {len(fits)} motions")


def speed_shift(study: Reproduction) -> Measured:
    """Fit one surface for F0 over current and f · A."""
    try:
        return Measured.of(fit_function("quadratic-current-speed", study.conditions, values(study, "", "F0")).r2)
    except IdentificationError as error:
        return unknown(str(error))


def saturation(study: Reproduction) -> Measured:
    """Compare the slopes of F0 above 1.5 A and below 1 A."""
    currents, F0 = np.array([c.current_A for c in study.conditions]), values(study, "", "F0")
    levels = np.unique(np.round(currents, 3))
    low, high = levels[levels <= 1.0], levels[levels >= 1.5]
    if low.size < 2 or high.size < 2:
        return unknown(f"tested up to {levels.max():g} A: two currents at or above 1.5 A and two up to 1 A are needed")
    means = [[float(F0[np.abs(currents - level) < 1e-3].mean()) for level in part] for part in (low, high)]
    below, above = (float(np.polyfit(part, mean, 1)[0]) for part, mean in zip((low, high), means, strict=True))
    return Measured.of(
        above / below, evidence=f"F0 rises by {below:.0f} N/A up to 1 A and by {above:.0f} N/A above 1.5 A"
    )


def friction_along(run: Run) -> tuple[Floats, Floats]:
    """Return positions [m] and friction [N] of a slow test: half of out-stroke less in-stroke, where gas cancels."""
    path, sweeps = measured_motion(run).path, []
    for stroke in np.argsort(np.bincount(path.stroke))[-2:]:
        inside = path.stroke == stroke
        order = np.argsort(run.displacement[inside])
        width = max(1, order.size // 60)
        keep = order.size // width * width
        x, force = (c[inside][order][:keep].reshape(-1, width).mean(1) for c in (run.displacement, run.force))
        sweeps.append((x, force, path.direction[inside][0]))
    (xa, fa, direction), (xb, fb, _) = sweeps
    low, high = max(xa[0], xb[0]), min(xa[-1], xb[-1])
    x = np.linspace(low + 0.05 * (high - low), high - 0.05 * (high - low), 80)
    return x, direction * (np.interp(x, xa, fa) - np.interp(x, xb, fb)) / 2


def lost_length(run: Run, damping: float, stiffness: float = 0.0) -> float:
    """Return the median distance [m] after a reversal at which 90 % of the mid-stroke force is restored.

    The viscous and the in-phase force, of a damping [N s/m] and a stiffness less mass [N/m], are subtracted: they
    differ between motions for other reasons.
    """
    steady = run.steady()
    motion, centre = measured_motion(steady), equivalent_sine(run).centre
    x, path = motion.displacement - centre, motion.path
    force = path.direction * (steady.force - np.mean(steady.force) - damping * motion.velocity - stiffness * x)
    full = _FULL * float(np.median(force[np.abs(x) < 0.3 * float(np.ptp(x)) / 2]))
    lengths = []
    for stroke in range(1, path.stroke[-1]):
        inside = path.stroke == stroke
        back = np.flatnonzero(force[inside] >= full)
        if back.size:
            lengths.append(path.distance[inside][back[0]])
    return float(np.median(lengths)) if lengths else float("nan")


def rising_shares(conditions: Sequence[Condition], energies: Sequence[float]) -> tuple[float, float]:
    """Return the shares of current steps, and of frequency steps, that raise the energy; NaN where there is none."""
    keys = [(round(c.current_A, 2), round(np.log(c.amplitude_m) / SAME)) for c in conditions]
    alike = [[i for i, k in enumerate(keys) if k == key] for key in sorted(set(keys))]

    def share(groups: Iterable[Sequence[int]], name: str) -> float:
        ordered = (sorted(group, key=lambda i: getattr(conditions[i], name)) for group in groups)
        steps = [energies[b] > energies[a] for group in ordered for a, b in pairwise(group)]
        return float(np.mean(steps)) if steps else float("nan")

    return share(same_motion(conditions, tolerance=SAME), "current_A"), share(alike, "frequency_Hz")


def bulge(run: Run) -> float:
    """Return the width of the force–displacement loop [N] at x = 0 over that at 0.8 X."""
    record = SineRecord.of(run)
    phase, width = np.degrees(record.theta), []
    for angle in (0.0, float(np.degrees(np.arcsin(0.8)))):
        out = np.abs((phase - angle + 180) % 360 - 180) < 5
        back = np.abs((phase - (180 - angle) + 180) % 360 - 180) < 5
        width.append(float(np.mean(record.force[out]) - np.mean(record.force[back])))
    return width[0] / width[1]
