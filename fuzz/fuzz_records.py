"""Put physical faults into clean records: how often each kind is found, by how much it moves the result.

    python -m fuzz.fuzz_records --records 20 --clean 1000 --seed 1

Every kind of `fuzz.record_faults`, and of `fuzz.operator_faults` as a second set, is put into clean synthetic records, its size drawn evenly on a log
scale. Its effect is what it moves the damping c or the peak force by, whichever more, both by a fit
that shares nothing with the checks. Found: a finding or a refusal that the clean record does not have.
False alarms: findings on clean synthetic records and on the bundled runs. The table of
docs/rig-procedure.md is printed with `--table`. Exit status 1 if a goal is missed: 90 % of the faults
of the first set found whose effect is over 10 %, 60 % of those of 5 to 10 %, at most 0.5 % of the clean
records with a false alarm. The second set is counted without a goal.
"""

from __future__ import annotations

import argparse
import sys
import time
import traceback
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from fuzz import operator_faults
from fuzz.record_faults import KINDS, UNOBSERVABLE, Kind
from fuzz.synthetic_records import FAMILIES, OTHERS, clean_record
from mrdamper import load_dataset
from mrdamper.errors import InputError, QualityError
from mrdamper.physics.motion.harmonics import fundamental_frequency
from mrdamper.physics.motion.measured import smooth
from mrdamper.rig_files.quality import View, check_record
from mrdamper.rig_files.quality.table import record_of
from mrdamper.rig_files.record import Record

LARGE, MODERATE = 0.10, 0.05  # effects from which on faults are counted
GOALS = {"large": 0.90, "moderate": 0.60, "clean": 0.005}
CRASHED = "!"
_YIELD = np.geomspace(0.002, 0.5, 16)  # yield displacements tried, of the amplitude
_ROWS = 1500  # samples of the fit


@dataclass(frozen=True)
class Trial:
    """One fault in one record."""

    kind: Kind
    size: float
    effect: float
    codes: frozenset[str]  # beyond those of the clean record

    @property
    def found(self) -> bool:
        return bool(self.codes) and CRASHED not in self.codes


def codes_of(record: Record) -> frozenset[str]:
    """Return the codes of all findings, or of the refusal; CRASHED for any other exception."""
    try:
        return frozenset(finding.code for finding in check_record(record).findings)
    except QualityError as error:
        return frozenset({error.code})
    except Exception:
        traceback.print_exc()
        return frozenset({CRASHED})


def damping_and_peak(record: Record) -> tuple[float, float]:
    """Fit F = f0 + k x + c v + an elastic–plastic force of free yield displacement to the steady part.

    Returns
    -------
    (float, float)
        c [N s/m] and half the median peak-to-peak force of a cycle [N].
    """
    start, stop = View(record).strokes.steady or (0, record.time.size)  # of the rest nothing is identified
    record = replace(record, **{name: values[start:stop] for name, values in record.channels.items()})
    x, v, _ = smooth(record.time, record.displacement)
    amplitude = 0.5 * float(np.ptp(x))
    rows = slice(x.size // 10, None, max(1, x.size // _ROWS))
    best = (np.inf, 0.0)
    low, high = -_YIELD * amplitude, _YIELD * amplitude
    state, states = np.zeros(_YIELD.size), np.empty((x.size, _YIELD.size))
    for row, step in zip(states, np.diff(x, prepend=x[0]), strict=True):
        state = np.minimum(np.maximum(np.add(state, step, out=row), low, out=row), high, out=row)
    base = np.column_stack([np.ones_like(x), x / amplitude, v])[rows]
    for column in states.T:
        table = np.column_stack([base, column[rows] / amplitude])
        found, left, *_ = np.linalg.lstsq(table, record.force[rows], rcond=None)
        misfit = float(left[0]) if left.size else np.inf
        best = min(best, (misfit, float(found[2])))
    period = 1 / fundamental_frequency(record.time, x)
    bounds = np.searchsorted(record.time, np.arange(record.time[0], record.time[-1] - 0.99 * period, period))
    ends = np.searchsorted(record.time, record.time[bounds] + period)
    spans = [np.ptp(record.force[a:b]) for a, b in zip(bounds, ends, strict=True)]
    return best[1], 0.5 * float(np.median(spans))


def effect_of(clean: Record, faulty: Record) -> float:
    """Return the larger change of damping or peak force, as a share of the clean record's."""
    try:
        before, after = damping_and_peak(clean), damping_and_peak(faulty)
    except (InputError, np.linalg.LinAlgError, ValueError):
        return np.inf  # no damping can be stated at all
    return max(abs(b / a - 1) for a, b in zip(before, after, strict=True))


def trials(kinds: Iterable[Kind], records: int, seed: int) -> Iterator[Trial]:
    """Put every kind into a number of records, each drawn from its own stream."""
    for number, kind in enumerate(kinds):
        for index in range(records):
            rng = np.random.default_rng([seed, number, index])
            record = clean_record(index + number, rng, least_cycles=kind.cycles)
            size = float(np.exp(rng.uniform(np.log(kind.low), np.log(kind.high))))
            faulty = kind.change(record, size, rng)
            yield Trial(kind, size, effect_of(record, faulty), codes_of(faulty) - codes_of(record))


def false_alarms(records: Iterable[Record]) -> Counter[str]:
    """Count the codes found on clean records; "tried" counts the records, "records" those with a finding."""
    found: Counter[str] = Counter()
    for record in records:
        codes = codes_of(record)
        found.update(["tried", *codes, *["records"] * bool(codes)])
    return found


def clean_records(count: int, seed: int, families: tuple[str, ...] = FAMILIES) -> Iterator[Record]:
    """Draw clean synthetic records of some families."""
    for number in range(count):
        yield clean_record(number, np.random.default_rng([seed, 10**6, number]), families=families)


def share_found(tried: list[Trial], low: float, high: float = np.inf) -> tuple[int, int]:
    """Count the found and all of the trials whose effect lies in a range."""
    inside = [trial for trial in tried if low <= trial.effect < high]
    return sum(trial.found for trial in inside), len(inside)


def found_from(tried: list[Trial]) -> float | None:
    """Return the smallest size from which on nine in ten trials are found; None if there is none."""
    ordered = sorted(tried, key=lambda trial: trial.size)
    for at in range(len(ordered) - 2):
        rest = ordered[at:]
        if rest[0].found and sum(trial.found for trial in rest) >= 0.9 * len(rest):
            return rest[0].size
    return None


def table(tried: list[Trial]) -> str:
    """Return the table of detection against effect, one row a kind."""
    lines = [
        "| Fault | Size | Found from | Effect > 10 % | Effect 5–10 % | Effect < 5 % |",
        "|---|---|---|---|---|---|",
    ]
    for kind in dict.fromkeys(trial.kind for trial in tried):
        own = [trial for trial in tried if trial.kind is kind]
        size = found_from(own)
        cells = ["{} of {}".format(*share_found(own, *ends)) if share_found(own, *ends)[1] else "–"
                 for ends in ((LARGE,), (MODERATE, LARGE), (0.0, MODERATE))]  # fmt: skip
        start = "not found" if size is None else f"{size:.2g}"
        lines.append(f"| {kind.name} | {kind.size} | {start} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _said(false: Counter[str]) -> str:
    codes = {code: count for code, count in sorted(false.items()) if code not in ("tried", "records")}
    return f"{false['records']} of {false['tried']} with a false alarm {codes or ''}"


def main() -> int:
    parser = argparse.ArgumentParser(description="Put physical faults into clean records and count what is found.")
    parser.add_argument("--records", type=int, default=20, help="of every kind")
    parser.add_argument("--clean", type=int, default=1000, help="clean synthetic records")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--table", action="store_true", help="print only the table, as Markdown")
    parser.add_argument("--kind", help="only kinds whose name contains this")
    parser.add_argument("--missed", action="store_true", help="print the faults of large effect that are not found")
    arguments = parser.parse_args()
    begin = time.perf_counter()
    first, second = (
        list(trials([k for k in kinds if (arguments.kind or "") in k.name], arguments.records, arguments.seed))
        for kinds in (KINDS, operator_faults.KINDS)
    )
    print(f"{table(first)}\n\n{table(second)}")
    if arguments.table:
        return 0
    print("\nNot observable in a single record:\n")
    unobservable = (*UNOBSERVABLE, *operator_faults.UNOBSERVABLE)
    print(table(list(trials(unobservable, max(3, arguments.records // 4), arguments.seed))))
    tried = first + second
    crashed = sum(CRASHED in trial.codes for trial in tried)
    print(f"\n{len(tried)} faulty records, {crashed} exceptions without a code")
    failed = crashed > 0
    for name, low, high in (("large", LARGE, np.inf), ("moderate", MODERATE, LARGE)):
        found, of = share_found(first, low, high)
        failed |= found < GOALS[name] * of
        print(f"{name} effects: {found} of {of} found ({100 * found / max(of, 1):.1f} %, goal {100 * GOALS[name]:g} %)")
        found, of = share_found(second, low, high)
        print(f"    second set: {found} of {of} found ({100 * found / max(of, 1):.1f} %)")
    if arguments.missed:
        for trial in tried:
            if trial.effect > MODERATE and not trial.found:
                print(f"    missed: {trial.kind.name}, {trial.size:.3g} {trial.kind.size}: {100 * trial.effect:.0f} %")
    for families in (FAMILIES, OTHERS):
        false = false_alarms(clean_records(arguments.clean, arguments.seed, families))
        failed |= false["records"] > GOALS["clean"] * arguments.clean
        print(f"clean records of {', '.join(families)}: {_said(false)}")
    print(f"bundled runs, whose motion is partly no sine: {_said(false_alarms(map(record_of, load_dataset())))}")
    print(f"{time.perf_counter() - begin:.0f} s")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
