"""Which contradicting runs are named with their cause: `python -m benchmarks.contradictions [--sound N]`.

Every kind of contradicting folder with each synthetic damper, and sound folders of which none may be accused.
"""

from __future__ import annotations

import argparse
import time

from benchmarks.contradicting_folders import DAMPERS, Folder, folders, sound_folder
from benchmarks.contradicting_folders_two import DAMPERS as SECOND
from benchmarks.contradicting_folders_two import second_folders
from mrdamper.study.contradictions import ContradictionError, find_contradictions


def verdict(folder: Folder) -> tuple[bool, str]:
    """Tell whether a folder's wrong runs, and no others, are named with an accepted cause; and what was found."""
    try:
        found = find_contradictions(folder.runs)
    except ContradictionError as refusal:
        return "refused" in folder.causes, str(refusal)[:80]
    named = {one.run_id for one in found} == folder.wrong and all(one.cause in folder.causes for one in found)
    return named and bool(found), ", ".join(f"{one.run_id} {one.cause} {one.value:.3g}" for one in found)


def main() -> None:
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.contradictions", description=__doc__)
    arguments.add_argument("--sound", type=int, default=200, help="sound folders")
    arguments.add_argument("--only", default="", help="kinds of folders whose name holds this")
    given = arguments.parse_args()
    right = tried = 0
    begin = time.process_time()
    for damper, make in [*((d, folders) for d in DAMPERS), *((d, second_folders) for d in SECOND)]:
        for folder in make(damper):
            if given.only in folder.name:
                good, found = verdict(folder)
                tried, right = tried + 1, right + good
                print(
                    f"{'named' if good else 'not'} | {damper.kind} | {folder.name} | {found or 'nothing'}", flush=True
                )
    accused = sum(bool(find_contradictions(sound_folder(number))) for number in range(given.sound))
    print(f"{right} of {tried} contradicting folders named, {accused} of {given.sound} sound folders accused")
    print(f"{(time.process_time() - begin) / max(tried + given.sound, 1):.2f} s of processor time per folder")


if __name__ == "__main__":
    main()
