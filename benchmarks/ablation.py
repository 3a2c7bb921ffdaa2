"""Effect of each element of the play-and-bypass model: `python -m benchmarks.ablation`.

Each row refits both bundled rigs without one element, on identification runs only, and scores them by cross-validation
over conditions and interior currents.
"""

from __future__ import annotations

import numpy as np

from mrdamper.dampers.fold_fits import FoldFits
from mrdamper.dampers.joint import JointProblem
from mrdamper.data import current_levels, same_condition
from mrdamper.rig_files.dataset_folder import load_dataset
from mrdamper.study.validation import leave_out, validate

WITHOUT = {
    "nothing: the whole model": {},
    "viscous bypass": {"cb": 1.0},
    "Stribeck effect": {"h0": 0.0, "h1": 0.0},
    "rise of the fading with current": {"h1": 0.0},
    "lag": {"T": 0.0},
    "stiffness": {"k": 0.0},
    "asymmetry": {"asymmetry": 0.0},
    "inertia": {"m": 0.0},
    "free play (series spring as long as the play)": {"d": 2e-5, "e": 2e-5},
}


def main() -> None:
    dataset = load_dataset()
    print("| without | " + " | ".join(f"{rig}: train / condition / current left out" for rig in dataset.rigs) + " |")
    print("|---|" + "---|" * len(dataset.rigs))
    for name, fixed in WITHOUT.items():
        print(f"| {name} | " + " | ".join(scores(dataset.rig(rig), fixed) for rig in dataset.rigs) + " |", flush=True)


def scores(dataset, fixed) -> str:
    train = [run for run in dataset.split("train") if run.excitation == "sine"]
    problem = JointProblem(train, "play-bypass", fixed)
    fit = problem.fit(most_steps=25)
    conditions = [part.condition for part in problem.parts]
    levels = current_levels([c.current_A for c in conditions])
    inner = [[i for i, own in enumerate(levels) if own == level] for level in sorted(set(levels))[1:-1]]
    groups = same_condition(conditions)
    without = FoldFits(problem, [*groups, *inner])
    left_out = leave_out(train, groups, lambda rest: without.refit(rest).damper, name(fixed))
    errors = []
    for level in inner:
        damper = without.refit([i for i in range(len(train)) if i not in level]).damper
        errors += [run.scores.nrmse_pp for run in validate(damper, [train[i] for i in level]).runs]
    figures = (validate(fit.damper, train).median(), left_out.median(), float(np.median(errors)))
    return " / ".join(f"{100 * f:.2f}" for f in figures)


def name(fixed) -> str:
    return "play-bypass without " + ", ".join(fixed)


if __name__ == "__main__":
    main()
