"""Detection of contradicting runs and their causes: `python -m benchmarks.contradictions [--sound N] [--seed S]`.

Every kind of contradicting folder with each synthetic damper, and sound folders, in which no run may be excluded. With
`--models` a model is fitted to the remaining runs of every folder, and its peak forces at every condition of the folder
are compared with those of two models: of the folder's correct runs alone, which shows errors of the comparison of runs,
and of all runs without faults, which also shows the information of the excluded runs.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence

import numpy as np

from benchmarks.contradicting_folders import DAMPERS, Folder, folders, sound_folder
from benchmarks.contradicting_folders_two import DAMPERS as SECOND
from benchmarks.contradicting_folders_two import second_folders
from mrdamper.dampers.joint import JointDamper, JointProblem
from mrdamper.data import Floats, Run
from mrdamper.errors import InputError
from mrdamper.statistics.metrics import peak_force
from mrdamper.study.contradictions import ContradictionError, compare_runs
from mrdamper.study.usable_runs import accepted_runs

WORSE = 0.05  # difference of the peak forces of two models from which one is worse
_MODEL = "play-bypass"


def verdict(folder: Folder) -> tuple[bool, str, list[Run]]:
    """Tell whether a folder's wrong runs, and no others, are named with an accepted cause; what was found; the rest."""
    runs = accepted_runs(folder.runs)[0]
    try:
        found = compare_runs(folder.runs).contradictions
        aside = {one.run_id for one in found if one.run_id in {run.id for run in runs}}
    except ContradictionError as refusal:
        return "refused" in folder.causes, str(refusal)[:80], []
    named = {one.run_id for one in found} == folder.wrong and all(one.cause in folder.causes for one in found)
    left = [run for run in runs if run.split == "train" and run.id not in aside]
    return named and bool(found), ", ".join(f"{one.run_id} {one.cause} {one.value:.3g}" for one in found), left


class Models:
    """Models of runs, and how far those of contradicting folders are from those of sound ones."""

    def __init__(self) -> None:
        self._models: dict[tuple[int, ...], tuple[Sequence[Run], JointDamper]] = {}  # the runs keep their identity

    def differences(self, left: Sequence[Run], folder: Folder) -> tuple[float, float]:
        """Median differences of the peak forces of the model of the runs left.

        From the model of the folder's right runs, and from that of all its runs as they ought to be.
        """
        right = [run for run in folder.sound if run.id not in folder.wrong]
        try:
            own = self._peaks_of(left, folder.sound)
        except InputError:
            return 0.0, 0.0  # no model is made
        first, second = (
            float(np.median(np.abs(own / self._peaks_of(runs, folder.sound) - 1))) for runs in (right, folder.sound)
        )
        return first, second

    def _peaks_of(self, runs: Sequence[Run], sound: Sequence[Run]) -> Floats:
        key = tuple(id(run) for run in runs)
        if key not in self._models:
            self._models[key] = runs, JointProblem(runs, _MODEL).fit().damper
        return _peaks(self._models[key][1], sound)


def _peaks(damper: JointDamper, runs: Sequence[Run]) -> Floats:
    """(R,) predicted peak forces [N]."""
    return np.array([peak_force(damper.predict(run).force[run.in_window]) for run in runs])


def main() -> None:
    """Print a line a folder, and the counts."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.contradictions", description=__doc__)
    arguments.add_argument("--sound", type=int, default=200, help="sound folders")
    arguments.add_argument("--first", type=int, default=0, help="number of the first sound folder: others are drawn")
    arguments.add_argument("--only", default="", help="kinds of folders whose name holds this")
    arguments.add_argument("--models", action="store_true", help="also how far models of these folders are off")
    given = arguments.parse_args()
    differences, tried, models, begin = list[tuple[float, float]](), list[bool](), Models(), time.process_time()
    for damper, make in [*((d, folders) for d in DAMPERS), *((d, second_folders) for d in SECOND)]:
        for folder in make(damper):
            if given.only in folder.name:
                good, found, left = verdict(folder)
                tried.append(good)
                text = ""
                if given.models and left:
                    differences.append(models.differences(left, folder))
                    text = " | model {:.1f} % {:.1f} %".format(*(100 * one for one in differences[-1]))
                print(
                    f"{'named' if good else 'not'} | {damper.kind} | {folder.name} | {found or 'nothing'}{text}",
                    flush=True,
                )
    accused = 0
    for number in range(given.first, given.first + given.sound):
        found = compare_runs(sound_folder(number)).contradictions
        accused += bool(found)
        if found:
            print(f"accused | {number} | {'; '.join(map(str, found))}", flush=True)
    print(f"{sum(tried)} of {len(tried)} contradicting folders named, {accused} of {given.sound} sound folders accused")
    for what, column in zip(("right runs", "runs as they ought to be"), zip(*differences, strict=True), strict=False):
        print(
            f"peak forces of the model differ by more than {100 * WORSE:.0f} % from the model of the {what} in "
            f"{sum(one > WORSE for one in column)} of {len(column)} folders; "
            f"median {100 * np.median(column):.2f} %, worst {100 * max(column):.1f} %"
        )
    print(f"{(time.process_time() - begin) / max(len(tried) + given.sound, 1):.2f} s of processor time per folder")


if __name__ == "__main__":
    main()
