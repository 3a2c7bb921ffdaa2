"""Samples that are not those of their time: lost and numbered anew, written twice, or copied from elsewhere."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrdamper.data import Floats
from mrdamper.rig_files.quality.effects import REFUSED, percent
from mrdamper.rig_files.quality.view import View, runs_of, sample_noise
from mrdamper.rig_files.record import Finding

_FAST = 0.3  # of the peak step: slower, a lost sample does not show
_BEND = 8.0  # times the noise of a second difference
_WHOLE = 0.3  # steps by which a stretch may differ from a whole number of usual ones
_FEW = 0.004  # of the samples
_COPY = 24  # samples in a row equal to others a number of cycles earlier
_NOISY = 3e-5  # of the peak-to-peak value: without noise cycles repeat themselves


def lost_or_doubled(view: View) -> Iterator[Finding]:
    """Report or refuse a displacement with steps a whole number of times, or none of, those around them."""
    motion = view.motion
    if motion is None or view.noticed("W_FROZEN", "W_DISTURBED", "W_HELD"):
        return
    run = view.steady
    x, uneven = run.displacement, np.diff(run.time)
    if x.size < 50 or np.ptp(uneven) > 0.2 * float(np.median(uneven)):
        return
    steps = np.diff(x)
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(steps, 2, mode="wrap"), 5)
    usual = np.partition(windows, 2, axis=1)[:, 2]  # their medians
    noise = max(sample_noise(x) * np.sqrt(6), 1e-9 * float(np.ptp(x)))
    fast = np.abs(usual) > _FAST * float(np.max(np.abs(usual)))
    odd = fast & (np.abs(steps - usual) > np.maximum(_BEND * noise, 0.5 * np.abs(usual)))
    odd[:3] = odd[-3:] = False
    ratio = np.divide(steps, usual, out=np.ones_like(steps), where=fast)
    whole = odd & (np.abs(ratio - np.round(ratio)) < _WHOLE) & (ratio > -_WHOLE)
    count, of = int(np.count_nonzero(whole)), int(np.count_nonzero(fast))
    if count < max(2, _FEW * of) or count < 0.7 * np.count_nonzero(odd):
        return
    lost = float(np.sum(np.round(ratio[whole]) - 1)) / of
    share = count / of
    what = "lost and the rest numbered anew" if lost > 0 else "written twice"
    problem = f"{percent(share)} of the samples are {what}: speed and damping are off by as much or more"
    if share > REFUSED:
        raise view.refused("E_SAMPLES_LOST", problem, "export the samples with their own time stamps")
    yield Finding("W_SAMPLES_LOST", f"{problem}; export the samples with their own time stamps")


def copied(view: View) -> Iterator[Finding]:
    """Report or refuse a record in which cycles are copies of others: noise does not repeat itself."""
    motion = view.motion
    if motion is None:
        return
    run = view.steady
    if view.force_noise < _NOISY * float(np.ptp(run.force)):
        return
    period = 1 / motion.condition.frequency_Hz / view.step
    alike: dict[int, np.ndarray] = {}
    for cycles in range(1, int(motion.cycles) + 1):
        for lag in range(int(cycles * period) - 2, int(cycles * period) + 4):
            if not 2 < lag < run.time.size - _COPY:
                continue
            equal = run.force[lag:] == run.force[:-lag]
            if np.count_nonzero(equal) >= _COPY:
                equal &= run.displacement[lag:] == run.displacement[:-lag]
                alike |= {lag: equal} if np.count_nonzero(equal) >= _COPY else {}
    if not alike:
        return
    chance = max(float(np.mean(np.diff(run.force) == 0)), 0.5 * _level_share(run.force))
    least = _COPY if chance < 0.3 else int(np.ceil(-16 / np.log(min(chance, 0.97))))
    copies = np.zeros(run.time.size, dtype=bool)
    for lag, equal in alike.items():
        copies[lag:] |= _long_runs(equal, least)
    share = float(np.mean(copies))
    if not share:
        return
    problem = (
        f"{percent(share)} of the samples repeat earlier cycles exactly, noise included: the record holds "
        f"{motion.cycles * (1 - share):.2g} measured cycles of {motion.cycles:.2g}, and its scatter means nothing"
    )
    if share > REFUSED:
        raise view.refused("E_COPIED", problem, "export the cycles that were measured")
    yield Finding("W_COPIED", problem)


def _level_share(values: Floats) -> float:
    """Chance that two noisy samples of one expectation are equal, from the converter's steps."""
    noise = sample_noise(values)
    gaps = np.diff(np.unique(values[:2000]))
    return float(min(1.0, np.median(gaps) / (2 * np.sqrt(np.pi) * noise))) if gaps.size and noise else 0.0


def _long_runs(mask: np.ndarray, least: int) -> np.ndarray:
    """Keep the runs of true values of at least a length."""
    starts, stops = runs_of(mask)
    kept = np.zeros(mask.size, dtype=bool)
    for start, stop in zip(starts, stops, strict=True):
        kept[start:stop] = stop - start >= least
    return kept
