"""Choice of the validation runs: as requested, or a stratified fifth of the conditions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from mrdamper.data import Condition, Dataset, Run, same_condition
from mrdamper.errors import InputError, UnknownNameError, listed
from mrdamper.physics.motion.sines import sine_condition

SHARE = 0.2  # of the conditions, by default
_MIN_CONDITIONS = 2  # conditions to identify from
_CURRENT_TOLERANCE_A, _CURRENT_TOLERANCE = 0.02, 0.05  # tolerance of a given current: [A], and relative


class SplitError(InputError):
    """A split that is not possible, or that leaves no identification runs."""

    code = "E_SPLIT"


@dataclass(frozen=True)
class Split:
    """Validation runs and the reason for their choice."""

    held_out: frozenset[str]  # ids of the runs
    reason: str
    shown: dict[str, str]  # by run, its condition


def hold_out(
    dataset: Dataset,
    *,
    runs: Sequence[str] = (),
    currents: Sequence[float] = (),
    conditions: Sequence[str] = (),
    every: int | None = None,
    none: bool = False,
    replace: bool = False,
) -> Split:
    """Choose the validation runs; by default a stratified fifth of the conditions.

    Runs with a clipped channel, which a study omits, are chosen by name, current or condition only, and are named then.
    Raises `SplitError` (E_SPLIT) if there are no runs to select, no identification runs would remain, or the dataset
    has a split that is not to be replaced; `UnknownNameError` if a run is not there; `ConditionError` if a condition is
    none.
    """
    where = f"dataset {dataset.name}"
    before = [run.id for run in dataset if run.split == "validate"]
    if before and not replace:
        raise SplitError(
            f"{len(before)} runs are validation runs already", where=where, remedy="give --replace to choose anew"
        )
    condition_of = {run.id: _condition(run) for run in dataset}
    held: set[str] = set()
    reasons: list[str] = []
    for name in runs:
        if name not in condition_of:
            raise UnknownNameError.of("run", name, condition_of)
        held.add(name)
    if runs:
        reasons.append("by hand")
    for amperes in currents:
        ids = [
            run.id
            for run in dataset
            if abs(abs(run.mean_current) - abs(amperes)) <= _CURRENT_TOLERANCE_A + _CURRENT_TOLERANCE * abs(amperes)
        ]
        if not ids:
            levels = sorted({round(abs(run.mean_current), 2) for run in dataset})
            raise SplitError(
                f"no run at {amperes:g} A", where=where, remedy=f"currents: {', '.join(map(str, levels))} A"
            )
        held.update(ids)
        reasons.append(f"all at {amperes:g} A")
    for text in conditions:
        wanted = Condition.of_text(text)
        ids = [name for name, c in condition_of.items() if c is not None and len(same_condition([wanted, c])) == 1]
        if not ids:
            raise SplitError(f"no run at {wanted}", where=where, remedy="mrdamper check shows the conditions")
        held.update(ids)
        reasons.append(f"all at {wanted}")
    clipped = {run.id for run in dataset if "W_CLIPPED" in run.findings}
    if every is not None:
        held.update([run.id for run in dataset if run.id not in clipped][every - 1 :: every])
        reasons.append(f"one run in {every}")
    if not reasons and not none:
        held, reason = _stratified({name: c for name, c in condition_of.items() if name not in clipped}, where)
        reasons.append(reason)
    left = [c for name, c in condition_of.items() if name not in held and c is not None]
    if held and len(same_condition(left)) < _MIN_CONDITIONS:
        raise SplitError(
            f"{len(same_condition(left))} conditions left to identify from", where=where, remedy="hold fewer runs out"
        )
    shown = {name: "no sine" if c is None else str(c) for name, c in condition_of.items()}
    omitted = f"; clipped, so that a study omits them: {listed(sorted(held & clipped), 4)}" if held & clipped else ""
    return Split(frozenset(held), (", ".join(reasons) or "nothing") + omitted, shown)


def _condition(run: Run) -> Condition | None:
    try:
        return sine_condition(run)
    except InputError:
        return None


def _stratified(condition_of: dict[str, Condition | None], where: str) -> tuple[set[str], str]:
    """Return a fifth of the conditions, spread over currents and motions, all of which stay in the identification."""
    names = [name for name, c in condition_of.items() if c is not None]
    conditions = [c for c in condition_of.values() if c is not None]
    current_of = _levels([Condition(c.current_A, 1.0, 1.0) for c in conditions])
    motion_of = _levels([Condition(0.0, c.frequency_Hz, c.amplitude_m) for c in conditions])
    by_current = sorted(range(len(conditions)), key=lambda i: conditions[i].current_A)
    ends = {current_of[i] for i in (*by_current[:1], *by_current[-1:])}
    groups = {group[0]: group for group in same_condition(conditions)}
    target, chosen = max(1, round(SHARE * len(groups))), list[int]()
    while len(chosen) < target:
        left = [first for first in groups if first not in chosen]
        # Conditions of each level, those that are left and those that are chosen.
        currents, taken_currents = (Counter(current_of[k] for k in part) for part in (left, chosen))
        motions, taken_motions = (Counter(motion_of[k] for k in part) for part in (left, chosen))
        free = [k for k in left if currents[current_of[k]] > 1 and motions[motion_of[k]] > 1]
        if not free:
            break
        taken = {k: taken_currents[current_of[k]] + taken_motions[motion_of[k]] for k in free}
        chosen.append(min(free, key=lambda k: (taken[k], current_of[k] in ends, k)))
    if not chosen:
        raise SplitError(
            "every choice of validation runs would lose a current or a motion", where=where,
            remedy="name the runs: --run, --current or --condition",
        )  # fmt: skip
    held = {names[i] for first in chosen for i in groups[first]}
    return held, f"stratified, {len(chosen)} of {len(groups)} conditions; every current and every motion stays in"


def _levels(conditions: Sequence[Condition]) -> dict[int, int]:
    return {i: level for level, group in enumerate(same_condition(conditions)) for i in group}
