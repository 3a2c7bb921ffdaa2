"""What runs in worker processes: each task calls the package and reports on the way."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.joint import JointFit, JointProblem
from mrdamper.dampers.modified import fit_modified, fit_modified_jointly
from mrdamper.data import Dataset
from mrdamper.errors import IdentificationError, InputError
from mrdamper.export import exporter
from mrdamper.export.base import identifier, write_export
from mrdamper.identification import Identification, identify
from mrdamper.report.study import write_study
from mrdamper.study.comparison import Comparison, compare
from mrdamper.study.workflow import JOINTLY, Study, run_study, usable_sines
from mrdamper.validation import Validation, validate

Tell = Callable[[str, float], None]
ALL_AT_ONCE = "joint"
RUN_BY_RUN = "functions"


def study(tell: Tell, dataset: Dataset, folder: Path) -> tuple[Study, list[Path]]:
    """The whole method, and its report, models, tables and figures in a folder."""
    result = run_study(dataset, lambda what, share: tell(what, 0.6 * share))
    return result, write_study(result, folder, lambda what, share: tell(what, 0.6 + 0.4 * share))


@dataclass(frozen=True, eq=False)
class Identified:
    """One model identified from the train runs of one rig.

    Attributes
    ----------
    run_ids : tuple of str
        Runs it was identified from.
    identifications : tuple of Identification
        Run by run; empty for a joint identification of the runs themselves.
    damper : Damper or None
        Over all conditions, where the runs allow one.
    no_damper : str
        Why there is none.
    joint : JointFit or None
    held_out : Validation or None
    refused : mapping of run id to the reason
    """

    run_ids: tuple[str, ...]
    identifications: tuple[Identification, ...]
    damper: Damper | None
    no_damper: str
    joint: JointFit | None
    held_out: Validation | None
    refused: dict[str, str]

    @property
    def median(self) -> float:
        """Median nrmse_pp over the runs."""
        errors = self.joint.nrmse_pp if self.joint else [i.scores.nrmse_pp for i in self.identifications]
        return float(np.median(errors))


def identify_rig(
    tell: Tell, dataset: Dataset, run_ids: Sequence[str], model: str, method: str, over: str
) -> Identified:
    """Identify a model from runs of one rig, then over their conditions.

    Parameters
    ----------
    tell : callable
    dataset : Dataset
        Of one rig.
    run_ids : sequence of str
        Runs to identify from; empty for all train runs with a steady sine.
    model, method : str
    over : str
        How one damper is made of them: "functions" through the identified values, or "joint",
        all forces at once.
    """
    sines, refused = usable_sines(dataset)
    runs = [run for run in sines if (run.id in run_ids if run_ids else run.split == "train")]
    if not runs:
        reason = next((refused[i] for i in run_ids if i in refused), "no train run is a steady sine")
        raise IdentificationError(reason, where=f"rig {dataset.name}", mend="choose other runs")
    ids = tuple(run.id for run in runs)
    if model == JOINTLY:
        tell(f"{model} from {len(runs)} runs at once", 0.1)
        fit = JointProblem(runs, model).fit()
        return Identified(ids, (), fit.damper, "", fit, validate(fit.damper, dataset.split("validate")), refused)
    found = []
    for number, run in enumerate(runs):
        tell(f"run {run.id}", 0.8 * number / len(runs))
        found.append(identify(run, model, method))
    tell("over all conditions", 0.8)
    damper, why = None, ""
    try:
        damper = fit_modified_jointly(runs, found)[0].damper if over == ALL_AT_ONCE else fit_modified(found).damper
    except InputError as error:
        why = str(error)
    tell("held-out runs", 0.95)
    held_out = validate(damper, dataset.split("validate")) if damper else None
    return Identified(ids, tuple(found), damper, why, None, held_out, refused)


def compare_models(tell: Tell, dataset: Dataset, names: Sequence[str], jobs: int) -> Comparison:
    """Models on the same runs."""
    return compare(dataset, names, jobs=jobs, progress=tell)


@dataclass(frozen=True)
class Exported:
    """Files an export made, and what to know about them."""

    paths: list[Path]
    notes: tuple[str, ...]


def export_damper(tell: Tell, damper: Damper, form: str, folder: Path) -> Exported:
    """A damper in an export format, as files in a folder."""
    tell(f"making {form}", 0.1)
    kind, name = exporter(form), export_name(damper.rig)
    written = kind().export(damper, name)
    folder.mkdir()
    out = folder / f"{name}{kind.suffix}" if kind.suffix else folder / f"{name}-{form}"
    return Exported(write_export(written, out, kind.suffix), written.notes)


def export_name(rig: str) -> str:
    """A name for files and symbols: of the rig, where its letters make one."""
    try:
        return identifier(rig)
    except InputError:
        return "damper"
