"""The runs of a rig that models are identified from, and the reasons why others are not used."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from mrdamper.data import Dataset, Run
from mrdamper.data.wording import number
from mrdamper.errors import IdentificationError, InputError
from mrdamper.identification import refuse_unusable
from mrdamper.identification.characteristics import Characteristics, characterise
from mrdamper.physics.motion import analyse_motion, equivalent_sine
from mrdamper.rig_files.quality.table import check_run, with_findings
from mrdamper.study.contradictions import ContradictionError, RunComparison, compare_runs

_MIN_SAMPLES_PER_CYCLE = 8  # below, velocity and loop are not determined
_MAX_DISTORTION = 0.35  # harmonics over the fundamental: a triangle has 0.12, a square wave 0.48
_DUPLICATE_TOLERANCE = 1e-4  # share of the range within which two runs are copies
_UNIT_RATIO = 50  # to the other runs' size, from which another unit explains it
_MIN_RUNS = 4  # runs from which a usual value is known


@dataclass(frozen=True)
class _Quantity:
    """A size of runs, and the units that explain an outlier (empty: none)."""

    name: str
    unit: str
    largest_ratio: float  # to the median of all runs
    size_of: Callable[[Run], float]
    if_smaller: str
    if_larger: str = ""


_QUANTITIES: tuple[_Quantity, ...] = (
    _Quantity("peak-to-peak force", "N", 100, lambda run: float(np.ptp(run.force)), "kN"),
    _Quantity("stroke", "m", 300, lambda run: float(np.ptp(run.displacement)), "m"),
    _Quantity("current", "A", 12, lambda run: float(np.median(np.abs(run.current))), "", "mA"),
)


@dataclass(frozen=True, eq=False)
class UsableRuns:
    """The runs of one rig that models are identified from and tested on."""

    dataset: Dataset  # without those that contradict the others
    comparison: RunComparison  # of the runs with each other
    sines: Sequence[Run]  # steady, at one current
    train: Sequence[Run]  # of the sines, those to identify from
    everything: Sequence[Run]  # for a global fit: any motion and current
    held_out: Sequence[Run]
    unusable: Mapping[str, str]  # by run, why nothing is identified from it
    not_identified: Mapping[str, str]  # by run, why it is not identified by itself

    @classmethod
    def of(cls, dataset: Dataset, keep: Collection[str] = ()) -> UsableRuns:
        """Classify the runs of a rig; `keep` names some that may contradict the others."""
        dataset, comparison = without_contradictions(dataset, keep)
        sines, refused = usable_sines(dataset)
        accepted, reasons = accepted_runs(dataset)
        everything, unusable = runs_for_global_fit(run for run in accepted if run.split == "train")
        unusable |= reasons
        refused = {name: unusable.get(name, why) for name, why in refused.items()}
        return cls(
            dataset,
            comparison,
            sines,
            [run for run in sines if run.split == "train"],
            everything,
            [run for run in accepted if run.split == "validate"],
            unusable,
            {one.run_id: str(one) for one in comparison.contradictions} | refused,
        )


def without_contradictions(dataset: Dataset, keep: Collection[str] = ()) -> tuple[Dataset, RunComparison]:
    """Set aside the runs of a rig that contradict the others.

    Raises `ContradictionError` if more than a third of the identification runs contradict the others, or their forces
    differ as those of two dampers do.
    """
    comparison = compare_runs(accepted_runs(dataset)[0], keep)
    aside = {one.run_id for one in comparison.contradictions}
    return dataset.only([run for run in dataset if run.id not in aside]), comparison


def accepted_runs(dataset: Iterable[Run]) -> tuple[list[Run], dict[str, str]]:
    """Return the runs accepted by the physical checks, each once, and the reasons for rejecting the others."""
    kept: list[Run] = []
    refused: dict[str, str] = {}
    for run in dataset:
        twin = next((other.id for other in kept if _are_one_test(run, other)), None)
        error, _ = check_run(run)
        if twin is not None:
            refused[run.id] = f"the same samples as run {twin}: a test counts once [E_TWICE]"
        elif error is not None:
            refused[run.id] = _reason(error, run)
        else:
            kept.append(run)
    refused |= _of_another_size(kept)
    return [run for run in kept if run.id not in refused], refused


def _are_one_test(run: Run, other: Run) -> bool:
    """Tell if two runs hold the same samples, possibly rounded, cropped or shifted in time."""
    size = min(run.time.size, other.time.size)
    for channel in ("displacement", "force"):
        one, two = getattr(run, channel)[:size], getattr(other, channel)[:size]
        near = _DUPLICATE_TOLERANCE * float(np.ptp(one))
        if np.abs(one[::97] - two[::97]).max() > near or np.abs(one - two).max() > near:
            return False
    return True


def _of_another_size(runs: Sequence[Run]) -> dict[str, str]:
    """Return runs whose force, stroke or current differs so much from the others that its unit must be wrong."""
    reasons: dict[str, str] = {}
    for quantity in _QUANTITIES:
        sizes = {run.id: quantity.size_of(run) for run in runs}
        positive = [size for size in sizes.values() if size > 0]
        if len(positive) < _MIN_RUNS:
            continue
        usual, unit = float(np.median(positive)), quantity.unit
        for name, size in sizes.items():
            too_large = size > quantity.largest_ratio * usual
            too_small = bool(quantity.if_smaller) and size < usual / quantity.largest_ratio
            if too_large or too_small:
                other = quantity.if_smaller if too_small else quantity.if_larger * (size > _UNIT_RATIO * usual)
                reasons[name] = (
                    f"{quantity.name} of {number(size, 3)} {unit}, {number(usual, 3)} {unit} in the other runs"
                    f"{f', as if in {other}' if other else ''}; "
                    "state its unit when it is imported, or take it out of the dataset [E_OTHER_SIZE]"
                )
    return reasons


def runs_for_global_fit(runs: Iterable[Run]) -> tuple[list[Run], dict[str, str]]:
    """Return the runs that a global model accepts, any motion and current, and the reasons for excluding the others."""
    runs_used, refused = list[Run](), dict[str, str]()
    for run in runs:
        try:
            refuse_unusable(with_findings(run))
            equivalent_sine(run)  # refuses a run that does not move
            runs_used.append(run)
        except InputError as error:
            refused[run.id] = _reason(error, run)
    return runs_used, refused


def usable_sines(dataset: Dataset, clipped: bool = False) -> tuple[list[Run], dict[str, str]]:
    """Return the runs whose motion is a sine at one current, and why the others are not used."""
    sines: list[Run] = []
    kept, refused = accepted_runs(dataset)
    for run in kept:
        try:
            refuse_unusable(with_findings(run), clipped)
            run.current_A  # noqa: B018
            sine = equivalent_sine(run)
            rate = (run.time.size - 1) / float(run.time[-1] - run.time[0])
            if sine.is_sine and rate < _MIN_SAMPLES_PER_CYCLE * sine.condition.frequency_Hz:
                raise IdentificationError(
                    f"{rate / sine.condition.frequency_Hz:.1f} samples per cycle",
                    where=f"run {run.id}",
                    remedy=f"record at least {_MIN_SAMPLES_PER_CYCLE}",
                )
        except InputError as error:
            refused[run.id] = _reason(error, run)
            continue
        if sine.is_sine and analyse_motion(run).distortion < _MAX_DISTORTION:
            sines.append(run)
        else:
            refused[run.id] = "the motion is not a sine, which individual fits require"
    return sines, refused


def characterise_usable(dataset: Dataset, compared: bool = False) -> Characteristics:
    """Characterise the sound runs of one damper, those that contradict the others apart; the reasons are kept.

    A dataset that was `compared` before, as that of a study, has none that contradict.
    If runs contradict each other as those of two dampers do, all sound ones count. Raises `IdentificationError` as
    `characterise`.
    """
    kept, refused = accepted_runs(dataset)
    for run in kept:
        try:
            refuse_unusable(with_findings(run))
        except InputError as error:
            refused[run.id] = _reason(error, run)
    with suppress(ContradictionError):
        refused |= {} if compared else {one.run_id: str(one) for one in compare_runs(kept).contradictions}
    measured = characterise([run for run in dataset if run.id not in refused])
    return replace(measured, passed_over={**refused, **measured.passed_over})


def _reason(error: InputError, run: Run) -> str:
    """State an error of a run without its name: runs with one reason are listed together."""
    return str(error).removeprefix(f"run {run.id}: ")
