"""Coverage of nominal 95 % intervals, compared with the textbook formula: `python -m benchmarks.coverage`.

Individual fits with `identify`: correlated noise, and model error that repeats with every cycle. Global fits on the
motions of the bundled rigs: noise, and a gain and an offset of every session; also the 90 % prediction intervals of the
peak force and of the force in a future session. Parameters outside 92–98 % and bands outside 85–95 % are listed, with
the standard error of a coverage.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np
from scipy.signal import lfilter

from mrdamper.dampers.bands import band
from mrdamper.dampers.base import Damper
from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.dampers.joint import JointDamper, JointFit, JointProblem
from mrdamper.data import SESSIONS_NEEDED, Condition, Floats, Run, session_of
from mrdamper.identification import identify
from mrdamper.identification.intervals import interval_about
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.physics.motion import sine
from mrdamper.physics.simulation import simulate
from mrdamper.rig_files.dataset_folder import load_dataset

LEVEL = 0.95
WITHIN, BAND_WITHIN = (92.0, 98.0), (85.0, 95.0)  # coverage that is asked of parameters and of bands [%]
# Correlation of neighbouring samples of the noise, cycles, and whether model error repeats with every one of them.
CASES = {
    "white": (0.0, 5, False),
    "AR 0.9": (0.9, 5, False),
    "AR 0.99": (0.99, 5, False),
    "AR 0.998, shorter than its memory": (0.998, 5, False),
    "repeats every cycle, 5 cycles": (0.0, 5, True),
    "repeats every cycle, 20 cycles": (0.0, 20, True),
}
TRUTH = BoucWen(c=1440.0, alpha=9e5, beta=2e5, gamma=2e5, n=2.0, f0=120.0, k1=1381.0, k3=8e6)
CONDITION = Condition(0.5, 1.0, 0.02)
GAIN, OFFSET, NOISE = 0.045, 0.01, 0.01  # of a session, over half the peak-to-peak force; of a sample
_SAMPLES = 200  # a cycle
_INSIDE = 0.1  # of a search axis: a truth at its end would have one-sided intervals
_SETTLED = 1e-4  # of the cost; a standard error is some hundredths of it
_RATE = 250.0  # samples a second that are kept [Hz]
_SIZE = 20.0  # of the error [N]; half the peak-to-peak force is some 900 N


@dataclass(frozen=True)
class Covered:
    """Shares of repeats in which the truth was inside.

    Attributes
    ----------
    names : tuple of str, length P
    ours, textbook : (P,) arrays
    warned : float
        Share of repeats that warned of a record shorter than its memory.
    """

    names: tuple[str, ...]
    ours: Floats
    textbook: Floats
    warned: float = 0.0


def error_of(case: tuple[float, int, bool], rng: np.random.Generator) -> Floats:
    """Draw a residual of a record [N], of one size whatever its correlation."""
    correlation, cycles, repeats = case
    noise = rng.standard_normal(_SAMPLES * cycles + 5000)
    if not repeats:
        return _SIZE * np.sqrt(1 - correlation**2) * lfilter([1], [1, -correlation], noise)[5000:]
    spectrum = np.fft.rfft(rng.standard_normal(_SAMPLES))
    spectrum[1:] /= np.arange(1, spectrum.size)
    spectrum[0] = 0
    shape = np.fft.irfft(spectrum, _SAMPLES)
    return _SIZE * (np.tile(shape / shape.std(), cycles) + 0.1 * noise[5000:])


def run_by_run(case: tuple[float, int, bool], repeats: int, seed: int = 0) -> Covered:
    """Coverage of `identify` on one condition."""
    rng = np.random.default_rng(seed)
    motion = sine(CONDITION, case[1] + 1, _SAMPLES).part(slice(_SAMPLES * (case[1] + 1)))
    clean = simulate(TRUTH, motion).force
    first = slice(_SAMPLES, None)
    names = ("c", "alpha", "beta", "f0", "k1", "k3")
    columns = [_moved(motion, clean, name)[first] for name in names]
    inverse = np.linalg.inv(np.array(columns) @ np.transpose(columns))
    ours, textbook, warned = np.zeros(len(names)), np.zeros(len(names)), 0
    window = (float(motion.time[_SAMPLES]), float(motion.time[-1]))
    for _ in range(repeats):
        force = clean.copy()
        force[first] += error_of(case, rng)
        found = identify(Run("r", motion.time, motion.displacement, force, CONDITION.current_A, window=window))
        variance = float(found.residual @ found.residual) / (found.residual.size - len(names))
        plain = 1.96 * np.sqrt(variance * np.diag(inverse))
        for i, name in enumerate(names):
            truth, value = getattr(TRUTH, name), getattr(found.model, name)
            low, high = found.interval(name, LEVEL) or (-np.inf, np.inf)
            ours[i] += low <= truth <= high
            textbook[i] += abs(value - truth) <= plain[i]
        warned += any("correlation time" in note for note in found.doubts)
    return Covered(names, ours / repeats, textbook / repeats, warned / repeats)


def _moved(motion, clean: Floats, name: str) -> Floats:
    value = getattr(TRUTH, name)
    both = ("beta", "gamma") if name == "beta" else (name,)  # gamma follows beta
    step = 1e-5 * value
    return (simulate(replace(TRUTH, **{n: value + step for n in both}), motion).force - clean) / step


@dataclass(frozen=True, eq=False)
class Rig:
    """The motions of a bundled rig, and a damper that is the truth there."""

    problem: JointProblem
    runs: tuple[Run, ...]
    truth: JointDamper
    point: Floats

    @classmethod
    def of(cls, name: str) -> Rig:
        sines = [r for r in load_dataset().rig(name) if r.split == "train" and r.excitation == "sine"]
        runs = [_slower(run) for run in sines]
        problem = JointProblem(runs, "play-bypass")
        fit = problem.fit()
        lower, upper = problem.space.box()
        point = np.clip(fit.point, lower + _INSIDE * (upper - lower), upper - _INSIDE * (upper - lower))
        truth = replace(fit.damper, model=problem.space.with_linear_of(fit.damper.model, point))
        clean = tuple(replace(r, force=truth.predict(r).force) for r in runs)
        return cls(JointProblem(clean, "play-bypass"), clean, truth, point)

    def fit(self, runs: Sequence[Run]) -> tuple[JointProblem, JointFit]:
        """The joint fit to other forces on the same motions, what was prepared of these used again."""
        parts = [
            replace(part, target=run.force[np.searchsorted(run.time, part.motion.time[part.picked])])
            for part, run in zip(self.problem.parts, runs, strict=True)
        ]
        problem = JointProblem(runs, "play-bypass", parts=parts)
        return problem, problem.fit(start=self.point, settled=_SETTLED)

    def draw(self, rng: np.random.Generator) -> list[Run]:
        """The runs with noise, and a gain and an offset of every session; of every run where sessions are too few.

        Of fewer sessions than `SESSIONS_NEEDED` no scatter is estimated: intervals are for sessions like the tested
        ones, so that only what differs from run to run is drawn.
        """
        groups = {run.id: session_of(run) for run in self.runs}
        if len(set(groups.values())) < SESSIONS_NEEDED:
            groups = {run.id: run.id for run in self.runs}
        drawn = {group: rng.standard_normal(2) for group in dict.fromkeys(groups.values())}
        made = []
        for run in self.runs:
            gain, offset = drawn[groups[run.id]]
            half = np.ptp(run.force[run.in_window]) / 2
            error = OFFSET * self.size * offset + NOISE * half * rng.standard_normal(run.force.size)
            made.append(replace(run, force=run.force * (1 + GAIN * gain) + error))
        return made

    @property
    def size(self) -> float:
        """Median of half the peak-to-peak force [N]."""
        return float(np.median([np.ptp(run.force[run.in_window]) / 2 for run in self.runs]))


def _slower(run: Run) -> Run:
    step = max(1, int(1 / (_RATE * float(np.median(np.diff(run.time))))))
    channels = ("time", "displacement", "force", "current")
    return replace(run, velocity=None, **{name: getattr(run, name)[::step] for name in channels})


def jointly(name: str, repeats: int, seed: int = 0) -> tuple[Covered, Floats]:
    """Coverage of the joint fit on a rig's motions; shares of new sessions in the 90 % bands of peak, energy, force."""
    rig, rng = Rig.of(name), np.random.default_rng(seed)
    names = tuple(rig.truth.fitted_parameters)
    ours, textbook, inside, counted = np.zeros(len(names)), np.zeros(len(names)), [], np.zeros(len(names))
    for repeat in range(repeats):
        runs = rig.draw(rng)
        problem, fit = rig.fit(runs)
        made = estimate_uncertainty(fit.damper, runs, held=fit.at_bounds)
        plain = _textbook(problem, fit)
        for i, n in enumerate(names):
            own, truth = made.fitted_parameters[n], rig.truth.fitted_parameters[n].value
            if made.uncertainty is None or n not in made.uncertainty.names:
                continue
            counted[i] += 1
            low, high = made.uncertainty.interval(made, n, LEVEL)
            ours[i] += low <= truth <= high
            low, high = interval_about(own.value, plain[n], 1e9, LEVEL, own.log)
            textbook[i] += low <= truth <= high
        inside.append(_in_bands(rig, made, rng, repeat))
    return Covered(names, ours / counted, textbook / counted), np.mean(inside, axis=0)


def _textbook(problem: JointProblem, fit: JointFit) -> dict[str, float]:
    """Standard errors by s² (JᵀJ)⁻¹ of the weighted residual, in the damper's own numbers."""
    known = problem.linearised(fit)
    residual, jacobian = known.residual, known.jacobian
    axes = [axis.name for axis in problem.space.axes]
    names = [*axes, *(info.name for info in problem.space.linear)]
    turned = np.eye(len(names))
    if "seat_share" in axes:  # e = share · d
        turned[axes.index("seat_share"), axes.index("d")] = 1.0
        names[axes.index("seat_share")] = "e"
    covariance = turned @ np.linalg.pinv(jacobian.T @ jacobian) @ turned.T
    variance = float(residual @ residual) / (residual.size - len(names))
    return dict(zip(names, np.sqrt(variance * np.diag(covariance)), strict=True))


def _in_bands(rig: Rig, made: Damper, rng: np.random.Generator, repeat: int) -> Floats:
    """One if the peak of a run of a new session lies in its 90 % prediction interval, and the share of its samples."""
    run = rig.runs[repeat % len(rig.runs)]
    gain, offset = rng.standard_normal(2)
    noise = NOISE * np.ptp(run.force[run.in_window]) / 2 * rng.standard_normal(run.force.size)
    force = (run.force * (1 + GAIN * gain) + OFFSET * rig.size * offset + noise)[run.in_window]
    known = band(made, made.predict(run), 0.9, shown=run.in_window)
    assert known is not None
    return np.array(
        [known.peak[0] <= np.ptp(force) / 2 <= known.peak[1], np.mean((known.low <= force) & (force <= known.high))]
    )


def _share(job: tuple[str, int, int]) -> tuple[str, Covered, Floats]:
    """A part of the repeats of one case."""
    title, repeats, seed = job
    if title in CASES:
        return title, run_by_run(CASES[title], repeats, seed), np.zeros(0)
    return title, *jointly(title, repeats, seed)


def table(repeats: int, workers: int = 1, only: Sequence[str] = ()) -> str:
    """The table as text, of all cases or some."""
    begin = time.perf_counter()
    titles = only or [*CASES, *load_dataset().rigs]
    jobs = [(title, repeats // workers, seed) for title in titles for seed in range(workers)]
    # Started anew: where the parent has read a dataset, Polars waits forever in a forked process.
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        found = list(pool.map(_share, jobs)) if workers > 1 else list(map(_share, jobs))
    lines, outside = list[str](), list[str]()
    for title in titles:
        parts = [(c, inside) for t, c, inside in found if t == title]
        names = parts[0][0].names
        ours, textbook = (np.mean([getattr(c, n) for c, _ in parts], axis=0) for n in ("ours", "textbook"))
        lines += _lines(title, names, ours, textbook)
        outside += _outside(title, dict(zip(names, ours, strict=True)), WITHIN)
        if (warned := np.mean([c.warned for c, _ in parts])) > 0:
            lines.append(f"  warned of a record shorter than its memory: {100 * warned:.0f} %")
        if parts[0][1].size:
            bands = dict(zip(("peak force", "samples"), np.mean([i for _, i in parts], axis=0), strict=True))
            lines.append(
                "  a new session in its 90 % prediction interval: "
                + ", ".join(f"{k} {100 * v:.1f} %" for k, v in bands.items())
            )
            outside += _outside(title, bands, BAND_WITHIN)
    error = 100 * np.sqrt(LEVEL * (1 - LEVEL) / repeats)
    lines.append(
        f"outside {WITHIN[0]:g}–{WITHIN[1]:g} % (parameters) or {BAND_WITHIN[0]:g}–{BAND_WITHIN[1]:g} % (bands): "
        + ("; ".join(outside) or "none")
    )
    lines.append(f"standard error of a coverage of 95 %: {error:.1f} points")
    lines.append(f"{repeats} repeats each, {time.perf_counter() - begin:.0f} s on {workers} processes")
    return "\n".join(lines)


def _outside(title: str, shares: Mapping[str, float], limits: tuple[float, float]) -> list[str]:
    low, high = limits
    return [f"{title} {name} {100 * s:.1f}" for name, s in shares.items() if not low <= round(100 * s, 6) <= high]


def _lines(title: str, names: Sequence[str], ours: Floats, textbook: Floats) -> list[str]:
    return [
        title,
        "  " + "".join(f"{name:>10}" for name in names),
        "  " + "".join(f"{100 * share:>10.1f}" for share in ours) + "  ours, %",
        "  " + "".join(f"{100 * share:>10.1f}" for share in textbook) + "  textbook, %",
    ]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=500)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--only", action="append", default=[], help="a case or a rig; may be repeated")
    chosen = parser.parse_args()
    print(table(chosen.repeats, chosen.processes, chosen.only))


if __name__ == "__main__":
    main()
