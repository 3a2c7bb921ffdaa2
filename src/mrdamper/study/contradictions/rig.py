"""The contradictions among the runs of one rig."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NoReturn

import numpy as np

from mrdamper.data import Run
from mrdamper.data.wording import span
from mrdamper.errors import InputError, listed
from mrdamper.rig_files.quality.flat import flat_ends
from mrdamper.rig_files.quality.table import record_of, with_findings
from mrdamper.rig_files.quality.view import View
from mrdamper.statistics.linear import on_one_blas_thread
from mrdamper.study.contradictions.copies import find_copies
from mrdamper.study.contradictions.findings import (
    Contradiction,
    corrected_unit,
    describe,
    describe_clipped,
    describe_copy,
)
from mrdamper.study.contradictions.repeats import unequal_repeats
from mrdamper.study.contradictions.search import Search
from mrdamper.study.contradictions.tracks import SAME_CURRENT, Track, tracks_of

MIN_RUNS = 4  # identification runs from which one can contradict the others
_MAX_SHARE = 0.34  # share of the runs that may contradict the others; beyond, the correct ones cannot be identified
_REFUSED_SHARE = 0.2  # share of the runs from which they are refused if the others do not agree either
_MAX_MISFIT_FACTOR = 4.0  # factor of the usual model error at which runs do not agree
_INVERSE_TOLERANCE = 0.1  # logarithm of the product of two factors up to which one is the inverse of the other
_MIN_GAIN = 1e-3  # gain of a run at least, for its logarithm
_CLUSTERS_REMEDY = "tests of two dampers need two names in the column rig of runs.csv; --keep RUN keeps a run as it is"
_MIN_CLIPPED = 2  # runs cut off at a level that show the end of a range there
_SAME_LEVEL = 0.02  # relative difference of two levels that are one
_MAX_MOTIONS = 4  # motions named in one sentence
_MILLIAMPERE_RATIO = 50.0  # ratio of a current to the usual one from which it is in milliamperes


class ContradictionError(InputError):
    """Too many runs contradict each other to identify the wrong ones."""

    code = "E_CONTRADICTIONS"


@dataclass(frozen=True)
class RunComparison:
    """Result of a comparison of the runs of one rig with each other."""

    contradictions: list[Contradiction]
    # sentences on repeated tests that differ in force, and on the motions at which the model of the comparison fails
    notes: tuple[str, ...] = ()


@on_one_blas_thread
def compare_runs(runs: Sequence[Run], keep: Collection[str] = ()) -> RunComparison:
    """Find the runs of one rig, accepted by the quality checks, that contradict the others, except those to keep.

    The comparison is of identification runs with each other. A validation run is compared with them afterwards, and
    only what has a named cause is found; it never takes part in the comparison. Raises `ContradictionError` if more
    than a third of the identification runs contradict the others, or their forces differ by factors that currents,
    motions and sessions do not explain.
    """
    copies = find_copies(runs)
    validated = {run.id for run in runs if run.split == "validate"}
    described = [describe_copy(copy, copy.run_id in validated) for copy in copies]
    contradictions = {one.run_id: one for one in described if one.run_id not in keep}
    clipped = [run for run in runs if run.split == "train" and "W_CLIPPED" in with_findings(run).findings]
    contradictions |= {one.run_id: one for one in _clipped_alike(runs, clipped) if one.run_id not in keep}
    aside = {*contradictions, *(run.id for run in clipped)} - {*keep}
    tracks, milliamperes = _in_amperes(tracks_of([run for run in runs if run.id not in aside]), keep)
    contradictions |= milliamperes
    train, undescribed = [track for track in tracks if track.run.split == "train"], ""
    if len(train) >= MIN_RUNS:
        among, undescribed = _among(train, keep)
        contradictions |= among
        trusted = [track for track in train if track.run.id not in contradictions]
        validation = [
            t for t in tracks if t.run.split != "train" and t.run.id not in keep and t.run.id not in contradictions
        ]
        contradictions |= _beside(validation, trusted)
        # A force may have been copied from one test to another: the copy stays if the original is excluded.
        of_wrong = {copy.run_id for copy in copies if copy.original in contradictions}
        doubted = tracks_of([run for run in runs if run.id in of_wrong and run.split == "train"])
        if len(trusted) >= MIN_RUNS:
            agreeing = {track.run.id for track in doubted} - set(_beside(doubted, trusted))
            contradictions = {name: one for name, one in contradictions.items() if name not in agreeing}
    repeats = unequal_repeats([track for track in tracks if track.run.id not in contradictions])
    notes = (*repeats, *filter(None, [undescribed]))
    return RunComparison([contradictions[run.id] for run in runs if run.id in contradictions], notes)


def _clipped_alike(runs: Sequence[Run], clipped: Sequence[Run]) -> Iterator[Contradiction]:
    """Find runs whose force is flat at the level at which several runs are cut off, the largest at a current."""
    ends = {run.id: flat_ends(View(record_of(run))) for run in runs} if len(clipped) >= _MIN_CLIPPED else {}
    levels = [level for run in clipped for level in ends.get(run.id, [])]
    for run in runs if levels else ():
        at_current = [one for one in runs if abs(one.mean_current - run.mean_current) <= SAME_CURRENT]
        for level in ends[run.id] if run not in clipped else ():
            alike = sum(abs(other - level) < _SAME_LEVEL * abs(level) for other in levels)
            beyond = max(float(np.max(one.force * np.sign(level))) for one in at_current) / abs(level) - 1
            if alike >= _MIN_CLIPPED and beyond < _SAME_LEVEL:
                yield describe_clipped(run, level, alike)
                break


def _among(train: Sequence[Track], keep: Collection[str]) -> tuple[dict[str, Contradiction], str]:
    """Contradictions among identification runs, and a sentence on the motions that their comparison fails at."""
    search = Search(train)
    search.run(int(_MAX_SHARE * len(train)))
    contradictions = {
        train[i].run.id: describe(train[i].run, e, len(train) - 1) for i, e in sorted(search.found.items())
    }
    contradictions = {name: one for name, one in contradictions.items() if name not in keep}
    groups = _parted(train, search.differing)
    if groups and not any(set(keep) >= set(group) for group in groups):
        return _without_few(train, min(groups, key=len), keep) or _refuse_differing(train, groups)
    causes = {e.cause for i, e in search.found.items() if train[i].run.id in contradictions}
    incoherent = len(contradictions) > _REFUSED_SHARE * len(train) and (
        search.evidence.spread.misfit >= _MAX_MISFIT_FACTOR or ("damper" in causes and len(causes) > 1)
    )
    # Some runs need a factor and others its inverse: the correct ones cannot be identified.
    factors = [one.value for one in contradictions.values() if one.cause == "force"]
    opposed = any(abs(np.log(a * b)) < _INVERSE_TOLERANCE for a, b in combinations(factors, 2))
    if len(contradictions) > _MAX_SHARE * len(train) or incoherent or opposed:
        raise _disagreement(train, contradictions)
    return contradictions, _undescribed([train[k] for k in sorted(search.unproven)])


def _undescribed(tracks: Sequence[Track]) -> str:
    if not tracks:
        return ""
    motions = dict.fromkeys(f"{track.frequency:.3g} Hz and {1e3 * track.amplitude:.3g} mm" for track in tracks)
    return (
        f"At {listed(list(motions), _MAX_MOTIONS)}, the current changes the force otherwise than at the other "
        "motions, which the comparison of the runs does not describe: a wrong current may not be found there."
    )


def _beside(validation: Sequence[Track], trusted: Sequence[Track]) -> dict[str, Contradiction]:
    if not validation or len(trusted) < MIN_RUNS:
        return {}
    search = Search(trusted)
    explained = [(track.run, search.explain(track)) for track in validation]
    return {run.id: describe(run, e, len(trusted)) for run, e in explained if e is not None}


def _in_amperes(tracks: Sequence[Track], keep: Collection[str]) -> tuple[list[Track], dict[str, Contradiction]]:
    """Return the runs, those in amperes whose current is a thousand times the others', which are in milliamperes."""
    sizes = [float(np.median(track.current)) for track in tracks]
    usual = float(np.median([size for size in sizes if size > 0] or [0.0]))
    kept, contradictions = list[Track](), dict[str, Contradiction]()
    for track, size in zip(tracks, sizes, strict=True):
        run = track.run
        if usual <= 0 or size < _MILLIAMPERE_RATIO * usual or run.id in keep:
            kept.append(track)
            continue
        text = f"its current of {size:.4g} A is {size / usual:.3g} times that of the others: it looks like milliamperes"
        remedy = corrected_unit(run, size / 1e3)
        kept.append(replace(track, current=track.current / 1e3))
        contradictions[run.id] = Contradiction(run.id, "current", size / 1e3, float("inf"), text, remedy)
    return kept, contradictions


def _parted(train: Sequence[Track], gains: Mapping[int, float]) -> list[dict[str, float]]:
    if not gains:
        return []
    ranked = sorted(gains, key=gains.__getitem__)
    steps = np.diff(np.log([max(gains[k], _MIN_GAIN) for k in ranked]))
    cut = 1 + int(np.argmax(steps))
    return [{train[k].run.id: gains[k] for k in part} for part in (ranked[:cut], ranked[cut:])]


def _without_few(
    train: Sequence[Track], few: Collection[str], keep: Collection[str]
) -> tuple[dict[str, Contradiction], str] | None:
    """Compare the other runs without a few; None unless they agree, and each of the few has a factor of the force.

    Beside such a run, another with a wrong current may look like a factor of its own.
    """
    others = [track for track in train if track.run.id not in few]
    if len(few) > _REFUSED_SHARE * len(train) or len(others) < MIN_RUNS:
        return None
    try:
        among, undescribed = _among(others, keep)
    except ContradictionError:
        return None
    apart = _beside([t for t in train if t.run.id in few], [t for t in others if t.run.id not in among])
    scaled = {name for name, one in apart.items() if one.cause == "force"}
    whole = scaled == {*few} and len(among) + len(apart) <= _MAX_SHARE * len(train)
    return ({**among, **apart}, undescribed) if whole else None


def _refuse_differing(train: Sequence[Track], groups: Sequence[Mapping[str, float]]) -> NoReturn:
    low, high = (
        f"{', '.join(sorted(group))} ({span(min(group.values()), max(group.values()), 'times', 2, ' to ')}"
        for group in groups
    )
    raise ContradictionError(
        f"the forces of {sum(map(len, groups))} of {len(train)} runs differ by factors that neither currents, motions "
        f"nor sessions explain: {low} what the others show) against {high})",
        where=_rig(train),
        remedy=_CLUSTERS_REMEDY,
    )


def _rig(train: Sequence[Track]) -> str:
    return f"rig {train[0].run.rig}" if train[0].run.rig else "the dataset"


def _disagreement(train: Sequence[Track], contradictions: dict[str, Contradiction]) -> ContradictionError:
    rest = [track.run.id for track in train if track.run.id not in contradictions]
    causes = sorted({one.code for one in contradictions.values()})
    first = next(iter(contradictions.values()))
    return ContradictionError(
        f"{len(contradictions)} of {len(train)} runs contradict the other {len(rest)} ({', '.join(causes)}): "
        f"{', '.join(sorted(contradictions))} against {', '.join(rest)}; "
        f"the first, {first.run_id}, {first.explanation}",
        where=_rig(train),
        remedy=_CLUSTERS_REMEDY,
    )
