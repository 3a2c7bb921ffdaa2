"""Share of future runs inside their 90 % prediction intervals: `python -m benchmarks.synthetic_coverage`.

Twelve synthetic rigs, twelve identification runs in six sessions each, with a gain and an offset of every session, a
gain of every run, and noise. One form is fitted to all of them, Bouc–Wen over the current; rigs of other forms have a
model error, which the interval has to contain. Counted are samples, peak forces and energies of forty runs, each at a
condition between the tested ones and in a session of its own. Runs of one repeat share a fit, so the standard error of
a share is that of a mean of repeats. The three rigs of a form differ by the scale of their forces alone: forms outside
85–95 % are listed.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from mrdamper.dampers.bands import band
from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.data import Condition, Floats, Run
from mrdamper.models import Model
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.models.herschel_bulkley import HerschelBulkley
from mrdamper.models.play_bypass import PlayBypass
from mrdamper.models.smooth_bingham import SmoothBingham
from mrdamper.physics.motion import sine
from mrdamper.physics.simulation import simulate
from mrdamper.statistics.metrics import dissipated_power, peak_force
from mrdamper.study.recipe import fit_and_score, identified, jointly

LEVEL = 0.9
WITHIN, QUANTITIES = (85.0, 95.0), ("samples", "peak", "energy")  # coverage that is asked of each form [%]
SESSION_GAIN, SESSION_OFFSET, RUN_GAIN, NOISE = 0.04, 0.01, 0.01, 0.005  # over the force, or half its peak-to-peak
CURRENTS, MOTIONS = (0.0, 0.33, 0.67, 1.0), ((0.5, 0.02), (1.0, 0.01), (2.0, 0.01))  # [A]; [Hz], [m]
SESSIONS, FUTURE = 6, 40
_PER_CYCLE = 200

Law = Callable[[float, float], Model]  # of a scale and the current [A]


def _bouc_wen(scale: float, I: float) -> Model:
    return BoucWen(c=scale * (900 + 900 * I), alpha=scale * (1e5 + 9e5 * I), beta=4e5, gamma=4e5, n=2.0, f0=40 * scale)


def _play(scale: float, I: float) -> Model:
    return PlayBypass(
        f0=40 * scale, k=800 * scale, c0=700 * scale, c1=1200 * scale, fy0=70 * scale, fy1=1000 * scale, d=2.5e-4,
        e=3e-5, cb=3.7e4 * scale, h0=0.4, h1=0.3, vh=4e-3, T=5e-3,
    )  # fmt: skip


def _bingham(scale: float, I: float) -> Model:
    return SmoothBingham(c=scale * (900 + 900 * I), fy=scale * (80 + 900 * I), f0=40 * scale, vs=0.01)


def _thinning(scale: float, I: float) -> Model:
    return HerschelBulkley(fy=scale * (80 + 900 * I), vc=0.3, m=0.5, f0=40 * scale)


FAMILIES: Mapping[str, Law] = {
    "Bouc–Wen, as fitted": _bouc_wen, "play and bypass": _play, "smooth Bingham": _bingham,
    "Herschel–Bulkley": _thinning,
}  # fmt: skip
RIGS = tuple((family, scale) for family in FAMILIES for scale in (0.2, 1.0, 5.0))


def record(law: Law, scale: float, condition: Condition, name: str, session: Floats, rng: np.random.Generator) -> Run:
    """A run of a rig in a session with a gain and an offset."""
    motion = sine(condition, 6, _PER_CYCLE)
    clean = simulate(law(scale, condition.current_A), motion).force
    half = peak_force(clean)
    gain = 1 + SESSION_GAIN * session[0] + RUN_GAIN * rng.standard_normal()
    force = gain * clean + SESSION_OFFSET * 500 * scale * session[1] + NOISE * half * rng.standard_normal(clean.size)
    window = (float(motion.time[2 * _PER_CYCLE]), float(motion.time[-1]))
    at, x = motion.time, motion.displacement
    notes = {"session": name.partition(" ")[0]}
    return Run(name, at, x, force, condition.current_A, rig="rig", window=window, notes=notes)


def covered(rig: tuple[str, float], seed: int = 0) -> tuple[Floats, float, float]:
    """Shares of samples, peaks and energies inside; the model error; half the interval over half the peak-to-peak."""
    (family, scale), rng = rig, np.random.default_rng((RIGS.index(rig), seed))
    law = FAMILIES[family]
    sessions = rng.standard_normal((SESSIONS, 2))
    conditions = [Condition(I, f, a) for I in CURRENTS for f, a in MOTIONS]
    order = rng.permutation(len(conditions))
    runs = [
        record(law, scale, conditions[i], f"s{k % SESSIONS} {i}", sessions[k % SESSIONS], rng)
        for k, i in enumerate(order.tolist())
    ]
    recipe = jointly("bouc-wen")
    scored = fit_and_score(recipe, runs, identified(recipe.basis, runs, {})[0], [])
    beside = [score.predicted for score in scored.cross_validated.runs if score.predicted is not None]
    damper = estimate_uncertainty(scored.damper, runs, beside)
    inside, widths = [], []
    for k in range(FUTURE):
        frequency, amplitude = rng.uniform(0.5, 2.0), rng.uniform(0.01, 0.02)
        condition = Condition(float(rng.choice(CURRENTS)), float(frequency), float(min(amplitude, 0.02 / frequency)))
        run = record(law, scale, condition, f"new{k} 0", rng.standard_normal(2), rng)
        prediction, at = damper.predict(run), run.in_window
        around = band(damper, prediction, LEVEL, at)
        assert around is not None
        velocity, force, predicted = prediction.motion.velocity[at], run.force[at], prediction.force[at]
        energy = dissipated_power(force, velocity, run.time[at]) / dissipated_power(predicted, velocity, run.time[at])
        inside.append(
            [
                np.mean((around.low <= force) & (force <= around.high)),
                around.peak[0] <= peak_force(force) <= around.peak[1],
                around.energy[0] <= energy - 1 <= around.energy[1],
            ]
        )
        widths.append(np.mean(around.high - around.low) / 2 / peak_force(predicted))
    assert damper.uncertainty is not None
    return np.mean(inside, axis=0), damper.uncertainty.force, float(np.median(widths))


def table(repeats: int, processes: int = 1) -> str:
    """A row a rig and the mean of all, as text."""
    begin = time.perf_counter()
    heads = "".join(f"{name:>15}" for name in QUANTITIES)
    lines = [f"{'rig':24}{heads}{'model error':>13}{'half width':>12}"]
    jobs = [(rig, seed) for rig in RIGS for seed in range(repeats)]
    with ProcessPoolExecutor(processes) as pool:
        found = list(pool.map(covered, *zip(*jobs, strict=True)))
    whole: dict[str, list[Floats]] = {family: [] for family in FAMILIES}
    for family, scale in RIGS:
        rows = [f for (rig, _), f in zip(jobs, found, strict=True) if rig == (family, scale)]
        shares, errors, widths = (np.array([row[i] for row in rows]) for i in range(3))
        whole[family].append(shares)
        sizes = f"{100 * errors.mean():>11.1f} %{100 * widths.mean():>10.1f} %"
        lines.append(f"{family}, {scale:g}".ljust(24) + _row(shares) + sizes)
    forms = {family: np.concatenate(members) for family, members in whole.items()}
    lines += [family.ljust(24) + _row(shares) for family, shares in forms.items()]
    outside = [
        f"{family} {name} {100 * share:.1f}"
        for family, shares in forms.items()
        for name, share in zip(QUANTITIES, shares.mean(axis=0), strict=True)
        if not WITHIN[0] <= 100 * share <= WITHIN[1]
    ]
    lines.append("all rigs".ljust(24) + _row(np.concatenate(list(forms.values()))))
    lines.append(f"outside {WITHIN[0]:g}–{WITHIN[1]:g} %: " + ("; ".join(outside) or "none"))
    lines.append(f"{repeats} repeats of {FUTURE} runs each, {time.perf_counter() - begin:.0f} s")
    return "\n".join(lines)


def _row(shares: Floats) -> str:
    """Means over repeats with their standard errors."""
    errors = shares.std(axis=0, ddof=1) / np.sqrt(len(shares)) if len(shares) > 1 else np.full(3, np.nan)
    pairs = zip(shares.mean(axis=0), errors, strict=True)
    return "".join(f"{100 * share:>8.1f} ± {100 * error:.1f}".rjust(15) for share, error in pairs)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=40)
    parser.add_argument("--processes", type=int, default=2)
    chosen = parser.parse_args()
    print(table(chosen.repeats, chosen.processes))


if __name__ == "__main__":
    main()
