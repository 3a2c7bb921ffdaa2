"""The quality checks of the import and the comparison of runs with each other, for a dataset made from arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import wraps
from typing import Any, Concatenate, Literal, ParamSpec

from mrdamper import identification
from mrdamper.data import Dataset, Displayable, Run
from mrdamper.data.wording import counted
from mrdamper.errors import InputError, is_a, validate_arguments
from mrdamper.rig_files.quality.table import check_run, with_findings
from mrdamper.study.contradictions import REPEATS_CODE, ContradictionError, compare_runs, tracks_of, unequal_repeats
from mrdamper.study.usable_runs import accepted_runs

Severity = Literal["refused", "set aside", "noted"]
P = ParamSpec("P")


@dataclass(frozen=True)
class DatasetFinding:
    """A finding on a run of a dataset."""

    run_id: str  # empty for a finding on a whole rig
    rig: str
    code: str  # stable: E_DISSIPATION_SIGN, W_CLIPPED, E_FORCE_SCALE, ...
    severity: Severity  # refused by its own record, set aside because it contradicts other runs, or noted only
    text: str  # values, and the remedy

    def __str__(self) -> str:
        return f"{self.run_id or (f'rig {self.rig}' if self.rig else 'dataset')}, {self.severity}: {self.text}"


@dataclass(frozen=True, eq=False, repr=False)
class DatasetCheck(Displayable):
    """The findings on a dataset."""

    dataset: Dataset
    findings: tuple[DatasetFinding, ...]

    @property
    def headline(self) -> str:
        """Number of runs and of findings of each severity."""
        counts = {
            kind: sum(one.severity == kind for one in self.findings) for kind in ("refused", "set aside", "noted")
        }
        listed = ", ".join(f"{count} {kind}" for kind, count in counts.items() if count)
        return f"check of {self.dataset.name}: {counted(len(self.dataset), 'run')}, {listed or 'nothing found'}"

    @property
    def table(self) -> Mapping[str, Sequence[Any]]:
        """One row per finding."""
        return {
            name: [getattr(one, name) for one in self.findings]
            for name in ("run_id", "rig", "code", "severity", "text")
        }

    @property
    def details(self) -> Sequence[str]:
        """One line per finding."""
        return [str(one) for one in self.findings]


@validate_arguments()
def check(dataset: Dataset) -> DatasetCheck:
    """Check every run of a dataset as the import checks files, and the runs of each rig against each other.

    Parameters
    ----------
    dataset : Dataset

    Returns
    -------
    DatasetCheck
        Findings as objects and as a table; `run_study` refuses and sets aside the same runs.

    Raises
    ------
    InputError
        E_ARGUMENT, if it is no dataset.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from mrdamper import check, load_dataset
    >>> tests = load_dataset().rig("utfsm")
    >>> wrong = replace(tests["utf_5mm4Hz_1A"], id="again", force=-tests["utf_5mm4Hz_1A"].force)
    >>> [finding.code for finding in check(tests.only([wrong])).findings]
    ['E_DISSIPATION_SIGN']
    """
    findings: list[DatasetFinding] = []
    for name in dataset.rigs:
        rig = dataset.rig(name)
        for run in rig:
            findings += _of_run(run)
        accepted, refused = accepted_runs(rig)
        refused_ids = {one.run_id for one in findings if one.severity == "refused"}
        for run_id, why in refused.items():
            if run_id not in refused_ids:
                findings.append(DatasetFinding(run_id, name, why.rsplit("[", 1)[-1].rstrip("]"), "set aside", why))
        findings += _of_rig(name, accepted)
    return DatasetCheck(dataset, tuple(findings))


def _of_run(run: Run) -> list[DatasetFinding]:
    refusal, noted = check_run(run)
    findings = [DatasetFinding(run.id, run.rig, finding.code, "noted", str(finding)) for finding in noted]
    if isinstance(refusal, InputError):
        findings.append(DatasetFinding(run.id, run.rig, refusal.code, "refused", str(refusal)))
    return findings


def _of_rig(rig: str, runs: Sequence[Run]) -> list[DatasetFinding]:
    try:
        comparison = compare_runs(runs)
    except ContradictionError as refusal:
        return [DatasetFinding("", rig, refusal.code, "refused", str(refusal))]
    aside = {one.run_id: one for one in comparison.contradictions}
    repeats = unequal_repeats(tracks_of([run for run in runs if run.id not in aside]))
    findings = [DatasetFinding(one.run_id, rig, one.code, "set aside", str(one)) for one in aside.values()]
    return [*findings, *(DatasetFinding("", rig, REPEATS_CODE, "noted", text) for text in repeats)]


def _of_accepted_runs(
    identify_run: Callable[Concatenate[Run, P], identification.Identification],
) -> Callable[Concatenate[Run, P], identification.Identification]:
    """Check the run as the import does before it is identified; findings are among the notes of the result."""

    @wraps(identify_run)
    def identify_accepted(run: Run, *args: P.args, **kwargs: P.kwargs) -> identification.Identification:
        if not is_a(run, Run):
            return identify_run(run, **kwargs)  # type: ignore[call-arg]  # states the correct argument
        refusal, noted = check_run(run)
        if refusal is not None:
            raise refusal
        result = identify_run(with_findings(run), *args, **kwargs)
        return replace(result, notes=(*result.notes, *map(str, noted)))

    return identify_accepted


identify = _of_accepted_runs(identification.identify)
