"""Local minima of global fits: `python -m benchmarks.local_minima [--starts 50]`.

Random starts are drawn over the whole search box. One descent runs from each, and from every fifth the search, which
also uses the model's own starts. A result within half a per cent of the least error of all counts as found. The data
are the steady ends of the identification runs of the bundled rigs and of a synthetic damper.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from benchmarks.virtual_dampers import DAMPERS
from mrdamper.dampers.joint import JointFit, JointProblem
from mrdamper.data import Run
from mrdamper.rig_files.dataset_folder import load_dataset

_SAME = 1.005  # times the least error
_TERMS = ("leak", "cq", "qb", "Ic", "si")  # free in the first search of a study too


def ends(problem: JointProblem, starts: int) -> tuple[list[JointFit], list[JointFit]]:
    """Ends of single descents, and of the search, from the same wide starts."""
    lower, upper = problem.box()
    wide = lower + (upper - lower) * np.random.default_rng(1).uniform(size=(starts, lower.size))
    how = {"rounds": 2, "most_steps": 15, "settled": 1e-4}
    return [problem.fit(start=u, **how) for u in wide], [problem.search(u, **how) for u in wide[::5]]


def main() -> None:
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.local_minima", description=__doc__)
    arguments.add_argument("--starts", type=int, default=50)
    arguments.add_argument("--only", default="", help="rigs whose name holds this")
    given = arguments.parse_args()
    made = DAMPERS[0]
    rigs: dict[str, list[Run]] = {name: list(load_dataset().rig(name).split("train")) for name in load_dataset().rigs}
    rigs[f"made: {made.name}"] = made.runs()
    print("| rig | least error | one descent finds it | the search finds it | second minimum | CPU s |")
    print("|---|---|---|---|---|---|")
    for name, runs in rigs.items():
        if given.only not in name:
            continue
        begin = time.process_time()
        problem = JointProblem(runs, "play-bypass", free=_TERMS)
        steady = [part.steady_end() for part in problem.parts]
        problem = JointProblem(runs, "play-bypass", free=_TERMS, parts=steady)
        single, searched = ends(problem, given.starts)
        least = min(end.error for end in [*single, *searched])
        shares = [np.mean([end.error <= _SAME * least for end in found]) for found in (single, searched)]
        second = problem.search(rounds=2, most_steps=15, settled=1e-4).second
        other = (
            "none"
            if second is None
            else f"yield displacement {1e3 * second.yield_length:.2f} mm: {100 * second.error:.2f} %"
        )
        spent = time.process_time() - begin
        print(
            f"| {name} | {100 * least:.3f} % | {shares[0]:.0%} | {shares[1]:.0%} | {other} | {spent:.0f} |", flush=True
        )


if __name__ == "__main__":
    main()
