"""The bundled rigs: individual fits of every sine run, and a global fit to all identification runs of a rig."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

from mrdamper.dampers.joint import JointProblem
from mrdamper.identification import identify
from mrdamper.rig_files.dataset_folder import load_dataset


@dataclass(frozen=True)
class RealRow:
    """What was identified and the processor time it took, motion analysis included."""

    name: str
    seconds: float


def real_rows() -> list[RealRow]:
    """Bouc–Wen run by run, play and bypass jointly."""
    dataset = load_dataset()
    sines = [run for run in dataset if run.excitation == "sine"]
    identify(sines[0])  # imports
    begin = time.process_time()
    for run in sines:
        identify(replace(run))
    rows = [RealRow(f"{len(sines)} individual fits, Bouc–Wen", time.process_time() - begin)]
    for rig in dataset.rigs:
        train = [run for run in dataset.rig(rig).split("train") if run.excitation == "sine"]
        begin = time.process_time()
        JointProblem(train, "play-bypass").fit()
        rows.append(RealRow(f"{len(train)} runs of {rig} at once, play and bypass", time.process_time() - begin))
    return rows
