"""Which contradicting runs are named with their cause: `python -m benchmarks.contradictions [--sound N] [--seed S]`.

Every kind of contradicting folder with each synthetic damper, and sound folders of which none may be accused. With
`--models` a model is fitted to the runs that are left of every folder, and its peak forces are compared with those of
the model fitted to the same runs as they ought to be.
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
from mrdamper.study.contradictions import ContradictionError, find_contradictions
from mrdamper.study.workflow import accepted_runs

WORSE = 0.05  # difference of the peak forces of two models from which one is worse
_MODEL = "play-bypass"


def verdict(folder: Folder) -> tuple[bool, str, list[Run]]:
    """Tell whether a folder's wrong runs, and no others, are named with an accepted cause; what was found; the rest."""
    runs = accepted_runs(folder.runs)[0]
    try:
        found = find_contradictions(folder.runs)
        aside = {one.run_id for one in found if one.run_id in {run.id for run in runs}}
    except ContradictionError as refusal:
        return "refused" in folder.causes, str(refusal)[:80], []
    named = {one.run_id for one in found} == folder.wrong and all(one.cause in folder.causes for one in found)
    left = [run for run in runs if run.split == "train" and run.id not in aside]
    return named and bool(found), ", ".join(f"{one.run_id} {one.cause} {one.value:.3g}" for one in found), left


class Models:
    """Models of runs, and how far those of contradicting folders are from those of sound ones."""

    def __init__(self) -> None:
        self._sound: dict[tuple[int, ...], JointDamper] = {}

    def difference(self, left: Sequence[Run], sound: Sequence[Run]) -> float:
        """Median difference of the peak forces of the models of two sets of runs, at the motions of the second."""
        key = tuple(id(run) for run in sound)
        if key not in self._sound:
            self._sound[key] = JointProblem(sound, _MODEL).fit().damper
        try:
            damper = JointProblem(left, _MODEL).fit().damper
        except InputError:
            return 0.0  # no model is made
        own, sound_peaks = (_peaks(each, sound) for each in (damper, self._sound[key]))
        return float(np.median(np.abs(own / sound_peaks - 1)))


def _peaks(damper: JointDamper, runs: Sequence[Run]) -> Floats:
    """(R,) predicted peak forces [N]."""
    return np.array([peak_force(damper.predict_run(run).force[run.in_window]) for run in runs])


def main() -> None:
    """Print a line a folder, and the counts."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.contradictions", description=__doc__)
    arguments.add_argument("--sound", type=int, default=200, help="sound folders")
    arguments.add_argument("--first", type=int, default=0, help="number of the first sound folder: others are drawn")
    arguments.add_argument("--only", default="", help="kinds of folders whose name holds this")
    arguments.add_argument("--models", action="store_true", help="also how far models of these folders are off")
    given = arguments.parse_args()
    differences, tried, models, begin = [], [], Models(), time.process_time()
    for damper, make in [*((d, folders) for d in DAMPERS), *((d, second_folders) for d in SECOND)]:
        for folder in make(damper):
            if given.only in folder.name:
                good, found, left = verdict(folder)
                tried.append(good)
                text = ""
                if given.models and left:
                    differences.append(models.difference(left, folder.sound))
                    text = f" | model {100 * differences[-1]:.1f} %"
                print(
                    f"{'named' if good else 'not'} | {damper.kind} | {folder.name} | {found or 'nothing'}{text}",
                    flush=True,
                )
    accused = 0
    for number in range(given.first, given.first + given.sound):
        found = find_contradictions(sound_folder(number))
        accused += bool(found)
        if found:
            print(f"accused | {number} | {'; '.join(map(str, found))}", flush=True)
    print(f"{sum(tried)} of {len(tried)} contradicting folders named, {accused} of {given.sound} sound folders accused")
    if differences:
        worse = np.array(differences) > WORSE
        print(
            f"peak forces of the model differ by more than {100 * WORSE:.0f} % in {worse.sum()} of {worse.size} "
            f"folders; median {100 * np.median(differences):.2f} %, worst {100 * max(differences):.1f} %"
        )
    print(f"{(time.process_time() - begin) / max(len(tried) + given.sound, 1):.2f} s of processor time per folder")


if __name__ == "__main__":
    main()
