"""What the tests say before any model: friction, bulge, energy, the force after a stroke end, F0 and its phase."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from itertools import pairwise

import numpy as np

from mrdamper.data import Condition, Floats, Run, same_motion
from mrdamper.errors import IdentificationError
from mrdamper.identification.harmonic_balance import SineRecord
from mrdamper.paper.recipes import CONSISTENT
from mrdamper.paper.results import SAME, Reproduction, amplitudes, motions, values
from mrdamper.paper.verdicts import Measured, measured, unknown
from mrdamper.physics.motion import equivalent_sine, measured_motion
from mrdamper.statistics.functions.fitting import fit_function


def gas_series(study: Reproduction) -> Measured:
    """How far the third-order series misses the gas force over the strokes tested."""
    if study.gas is None:
        return unknown("the gas spring of this rig is not known")
    X = max(loop.condition.amplitude_m for loop in study.loops)
    return measured("gas series", study.gas.taylor_error(X), evidence=f"within ±{1e3 * X:.0f} mm")


def friction(study: Reproduction) -> Measured:
    """Friction of the slow test, beside the smallest peak force."""
    if study.friction is None:
        return unknown("the data hold no friction test")
    _, found = friction_along(study.friction)
    share = float(np.mean(found)) / min(loop.peak_force for loop in study.loops)
    fluid = "with" if study.options.friction_test == "filled" else "without"
    return measured("friction", found.min(), found.max(), share, evidence=f"test {fluid} fluid")


def bulges(study: Reproduction) -> Measured:
    """Share of loops that are widest at mid-stroke."""
    ratios = np.array([bulge(run) for run in study.train])
    evidence = f"ratio of widths {ratios.min():.2f}–{ratios.max():.2f}"
    return measured("bulge", np.mean(ratios > 1), evidence=evidence)


def energy(study: Reproduction) -> Measured:
    """Shares of steps in current and frequency that raise the energy of a cycle."""
    energies = [loop.dissipated_energy for loop in study.loops]
    shares = rising_shares([loop.condition for loop in study.loops], energies)
    return measured("energy", *shares, evidence=f"{min(energies):.3g}–{max(energies):.3g} J a cycle")


def stroke_end(study: Reproduction) -> Measured:
    """Length without force after a reversal, at the fastest motion over the slowest, at the highest current."""
    consistent = study.contender(CONSISTENT)
    if consistent is None:
        return unknown("the viscous force is not known: the consistent way could not be followed")
    top = max(c.current_A for c in study.conditions)
    damping, k1, m = (values(study, CONSISTENT, name) for name in ("c", "k1", "m"))
    pairs = [
        (condition.peak_velocity, run, (c, k - mass * (2 * np.pi * condition.frequency_Hz) ** 2))
        for condition, run, c, k, mass in zip(
            study.conditions, study.train, damping.tolist(), k1.tolist(), m.tolist(), strict=True
        )
        if condition.current_A > top - 0.01
    ]
    slow, fast = min(pairs, key=lambda p: p[0]), max(pairs, key=lambda p: p[0])
    if fast[0] < 1.3 * slow[0]:
        return unknown("one speed at the highest current")
    lengths = [1e3 * lost_length(run, *linear) for _, run, linear in (slow, fast)]
    return measured(
        "stroke end",
        lengths[1] / lengths[0],
        evidence=f"at {top:g} A 90 % of the hysteretic force is back after {lengths[0]:.2f} mm at "
        f"{slow[0]:.2f} m/s and after {lengths[1]:.2f} mm at {fast[0]:.2f} m/s",
    )


def phase(study: Reproduction) -> Measured:
    """Where the lead of the force lies, and how much the current moves it."""
    found = np.array([r.phase for r in study.readings])
    several = [group for group in motions(study) if len(group) > 1]
    spread = max((float(np.ptp(found[group])) for group in several), default=float("nan"))
    inside = np.mean((found > 1.4) & (found < 1.5))
    evidence = f"{found.min():.3f}–{found.max():.3f} rad; smallest sine {np.sin(found).min():.3f}"
    return measured("phase", inside, spread, evidence=evidence)


def quadratic(study: Reproduction) -> Measured:
    """The motion on which a quadratic of the current says least of F0."""
    F0, fits = amplitudes(study), []
    for group in motions(study):
        if len({round(study.conditions[i].current_A, 3) for i in group}) < 4:
            continue
        with suppress(IdentificationError):  # currents too near each other to determine it
            fits.append(fit_function("quadratic-current", [study.conditions[i] for i in group], F0[group]).r2)
    if not fits:
        return unknown(f"{_tested_at(study, 4)}: a quadratic through three of them would prove nothing")
    return measured("quadratic", min(fits), evidence=f"up to {max(fits):.4f} over {len(fits)} motions")


def speed_shift(study: Reproduction) -> Measured:
    """One surface for F0 over current and f · A."""
    try:
        return measured("speed shift", fit_function("quadratic-current-speed", study.conditions, amplitudes(study)).r2)
    except IdentificationError as error:
        return unknown(str(error))


def saturation(study: Reproduction) -> Measured:
    """How much flatter F0 rises above 1.5 A than below 1 A."""
    currents, F0 = np.array([c.current_A for c in study.conditions]), amplitudes(study)
    levels = np.unique(np.round(currents, 3))
    low, high = levels[levels <= 1.0], levels[levels >= 1.5]
    if low.size < 2 or high.size < 2:
        return unknown(f"tested up to {levels.max():g} A: two currents at or above 1.5 A and two up to 1 A are needed")
    mean = {level: float(F0[np.abs(currents - level) < 1e-3].mean()) for level in levels}
    slopes = [float(np.polyfit(part, [mean[x] for x in part], 1)[0]) for part in (low, high)]
    return measured(
        "saturation",
        slopes[1] / slopes[0],
        evidence=f"F0 rises by {slopes[0]:.0f} N/A up to 1 A and by {slopes[1]:.0f} N/A above 1.5 A",
    )


def friction_along(run: Run) -> tuple[Floats, Floats]:
    """Positions [m] and friction [N] of a slow test: half the force between out-stroke and in-stroke.

    At one position the gas spring is the same in both strokes and drops out.
    """
    path = measured_motion(run).path
    longest = np.argsort(np.bincount(path.stroke))[-2:]
    sweeps = []
    for stroke in longest:
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
    """Distance [m] after a reversal in which the force is back at 90 % of its mid-stroke value; median.

    The viscous and the in-phase force, of a damping [N s/m] and a stiffness less mass [N/m], are subtracted: they
    differ between motions for other reasons.
    """
    steady = run.steady()
    motion, centre = measured_motion(steady), equivalent_sine(run).centre
    path, force = motion.path, steady.force - np.mean(steady.force) - damping * motion.velocity
    force = force - stiffness * (motion.displacement - centre)
    amplitude = float(np.ptp(motion.displacement)) / 2
    middle = np.abs(motion.displacement - centre) < 0.3 * amplitude
    full = 0.9 * float(np.median((path.direction * force)[middle]))
    found = []
    for stroke in range(1, path.stroke[-1]):
        inside = path.stroke == stroke
        back = np.flatnonzero(path.direction[inside] * force[inside] >= full)
        if back.size:
            found.append(path.distance[inside][back[0]])
    return float(np.median(found)) if found else float("nan")


def rising_shares(conditions: Sequence[Condition], energies: Sequence[float]) -> tuple[float, float]:
    """Shares of steps in current at one motion, and in frequency at one current and amplitude, that raise the energy.

    NaN where there is no such step.
    """
    by_current: list[bool] = []
    for group in same_motion(conditions, tolerance=SAME):
        ordered = sorted(group, key=lambda i: conditions[i].current_A)
        by_current += [energies[b] > energies[a] for a, b in pairwise(ordered)]
    by_frequency: list[bool] = []
    keys = [(round(c.current_A, 2), round(np.log(c.amplitude_m) / SAME)) for c in conditions]
    for key in sorted(set(keys)):
        ordered = sorted((i for i, k in enumerate(keys) if k == key), key=lambda i: conditions[i].frequency_Hz)
        by_frequency += [energies[b] > energies[a] for a, b in pairwise(ordered)]
    return _share(by_current), _share(by_frequency)


def _share(steps: Sequence[bool]) -> float:
    return float(np.mean(steps)) if steps else float("nan")


def bulge(run: Run) -> float:
    """Width of the force–displacement loop [N] at x = 0 over that at 0.8 X."""
    record = SineRecord.of(run)
    phase = np.degrees(record.theta)
    width = []
    for angle in (0.0, float(np.degrees(np.arcsin(0.8)))):
        out = np.abs((phase - angle + 180) % 360 - 180) < 5
        back = np.abs((phase - (180 - angle) + 180) % 360 - 180) < 5
        width.append(float(np.mean(record.force[out]) - np.mean(record.force[back])))
    return width[0] / width[1]


def _tested_at(study: Reproduction, least: int) -> str:
    """How many motions were tested at how many currents, in words."""
    counts = [len({round(study.conditions[i].current_A, 3) for i in group}) for group in motions(study)]
    enough = sum(count >= least for count in counts)
    return f"{enough} of {len(counts)} motions were tested at {least} currents or more"
