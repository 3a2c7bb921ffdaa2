"""Cross-validation of the global model: `python -m benchmarks.left_out [RIG ...]`.

A condition (every run of it), an interior current (every run at it) and a whole record, including ramps and rests, are
each predicted by a fit to the other identification runs, with start values from these runs alone; medians of nrmse_pp.
Validation runs are not used.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.choice import JointChoice, identify_jointly
from mrdamper.dampers.fold_fits import FoldFits
from mrdamper.data import Dataset, Run, condition_groups, level_groups
from mrdamper.rig_files.dataset_folder import load_dataset

GOALS = {  # interior current, condition, whole record [-]
    "utfsm": (0.026, 0.034, 0.032),
    "labcontrol": (0.030, 0.025, 0.032),
}


def errors(rig: Dataset) -> tuple[JointChoice, dict[str, list[float]]]:
    """The joint model of a rig's train runs, and its errors on what was left out."""
    runs = rig.split("train")
    choice = identify_jointly(runs)
    problem, fit = choice.problem, choice.fit
    found: dict[str, list[float]] = {"current": [], "condition": [], "whole record": []}
    levels = [*level_groups(problem.currents).values()][1:-1]
    conditions = condition_groups([part.condition for part in problem.parts])
    fits = FoldFits(problem, [*levels, *conditions], choice.searched)
    for level in levels:
        damper = _without(fits, level)
        found["current"] += [_error(damper, runs[i]) for i in level]
    for group in conditions:
        damper = _without(fits, group)
        found["condition"] += [_error(damper, runs[i]) for i in group]
        found["whole record"] += [_error(damper, runs[i], whole=True) for i in group]
    found["train"] = [_error(fit.damper, run) for run in runs]
    return choice, found


def _without(fits: FoldFits, group: list[int]) -> Damper:
    return fits.refit([i for i in range(len(fits.problem.parts)) if i not in group]).damper


def _error(damper: Damper, run: Run, whole: bool = False) -> float:
    inside = np.ones(run.time.size, dtype=bool) if whole else run.in_window
    missed = (damper.predict(run).force - run.force)[inside]
    return float(np.sqrt(np.mean(missed**2)) / np.ptp(run.force[inside]))


def main(names: list[str]) -> None:
    dataset = load_dataset()
    print("| rig | left out | median | mean | goal | |\n|---|---|---|---|---|---|")
    for name in names or dataset.rigs:
        begin = time.process_time()
        choice, found = errors(dataset.rig(name))
        for (what, values), goal in zip(found.items(), (*GOALS[name], None), strict=True):
            median = float(np.median(values))
            verdict = "" if goal is None else "met" if median <= goal else "missed"
            limit = "" if goal is None else f"{100 * goal:.1f} %"
            print(f"| {name} | {what} | {100 * median:.2f} % | {100 * np.mean(values):.2f} % | {limit} | {verdict} |")
        kept = "; ".join(t.term for t in choice.tried if t.kept)
        print(f"{name}: {kept}; at a bound: {', '.join(choice.fit.at_bounds) or 'none'}; "
              f"{time.process_time() - begin:.0f} s of processor time", flush=True)  # fmt: skip


if __name__ == "__main__":
    main(sys.argv[1:])
