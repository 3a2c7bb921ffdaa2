"""Processor time of a study of the bundled data, by part."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

from mrdamper.rig_files.dataset_folder import load_dataset

_IMPORTS = "import time; t = time.process_time(); import mrdamper.report.study; print(time.process_time() - t)"


@dataclass(frozen=True)
class PartRow:
    """Processor seconds of one part, rig by rig where it is of a rig."""

    name: str
    seconds: tuple[float, ...]


def part_rows() -> list[PartRow]:
    """Parts in the order they are done; the command studies the rigs in one process each, at once."""
    from mrdamper.report.plots.style import save_figure
    from mrdamper.report.study import _figures, write_study
    from mrdamper.study.workflow import Study, study_rig

    rows = [PartRow("imports, in every process", (_imports(),))]
    begin = time.process_time()
    dataset = load_dataset()
    rows.append(PartRow("read the dataset", (time.process_time() - begin,)))
    spent: dict[str, list[float]] = defaultdict(list)
    rigs = []
    for rig in dataset.rigs:
        clock = _Clock([run.id for run in dataset])
        rigs.append(study_rig(dataset.rig(rig), clock.tell))
        for what, seconds in clock.stopped().items():
            spent[what].append(seconds)
        begin = time.process_time()
        figures = _figures(rigs[-1], ())
        spent["figures: made"].append(time.process_time() - begin)
        with tempfile.TemporaryDirectory() as folder:
            begin = time.process_time()
            for name, figure in figures.items():
                save_figure(figure, Path(folder) / name)
            spent["figures: drawn"].append(time.process_time() - begin)
    rows += [PartRow(what, tuple(seconds)) for what, seconds in spent.items()]
    with tempfile.TemporaryDirectory() as folder:
        begin = time.process_time()
        write_study(Study(dataset, tuple(rigs), 0.0), Path(folder) / "out")
        written = time.process_time() - begin
    drawn = sum(sum(seconds) for what, seconds in spent.items() if what.startswith("figures"))
    return [*rows, PartRow("page, tables and models", (max(written - drawn, 0.0),))]


def _imports() -> float:
    commands = [[sys.executable, "-c", _IMPORTS]] * 3
    return min(float(subprocess.run(c, capture_output=True, text=True, check=True).stdout) for c in commands)


class _Clock:
    """Adds up processor time by what a study says it is doing; runs count together."""

    def __init__(self, runs: list[str]):
        self.runs, self.spent = runs, defaultdict(float)
        self.last, self.what = time.process_time(), "motions and loops"

    def tell(self, what: str, share: float) -> None:
        now = time.process_time()
        self.spent[self.what] += now - self.last
        for run in self.runs:
            what = what.replace(f"run {run}", "per-run fits") if what.endswith(run) else what
        self.last, self.what = now, what if what != "loops" else self.what

    def stopped(self) -> dict[str, float]:
        self.tell("", 1.0)
        return dict(self.spent)
