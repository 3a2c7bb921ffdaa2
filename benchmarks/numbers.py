"""Comparison of the numbers in documents with computed ones: `python -m benchmarks.numbers [--write]`.

Without options the bundled study is repeated (README.md, docs/play-and-bypass.md). `--compare DIR` and `--reproduce
DIR` read folders that these commands wrote (docs/models.md, docs/paper-method.md). A table is found by its first cells,
a number in a sentence by its pattern. The exit status is 1 if a number differs by more than its tolerance; `--write`
writes the computed numbers.
"""

from __future__ import annotations

import argparse
import csv
import json
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrdamper.dampers.uncertainty import table as intervals
from mrdamper.study.recipe import catalogue
from mrdamper.study.validation import Validation
from mrdamper.study.workflow import RigStudy, Study

ROOT = Path(__file__).parent.parent
POINTS = 0.3  # percentage points a median may differ: another machine's last bits choose other terms
WORST = 0.2  # share by which the worst run and the time may differ
COUNT = 2  # numbers a model may have more or fewer, for the same reason
_MODELS, _COMPARED = "docs/models.md", "| model | individual fit"
_NUMBER = re.compile(r"\d+(?:\.\d+)?")


@dataclass(frozen=True)
class Table:
    """Rows of a document's table, from the row under its head.

    Attributes
    ----------
    page : str
    under : str
        Beginning of its head row; where several begin so, the one after `after`.
    rows : tuple of str
        As they ought to stand.
    after : str
        A line before it.
    whole : bool
        Whether these are all of its rows; else only rows of the same names are compared, and none is written.
    share : float
        By which every number may differ; zero: by points and counts.
    """

    page: str
    under: str
    rows: tuple[str, ...]
    after: str = ""
    whole: bool = True
    share: float = 0.0


@dataclass(frozen=True)
class Sentence:
    """Numbers in a sentence: the pattern's groups, in percentage points or as counted.

    Attributes
    ----------
    page, pattern : str
    values : tuple of float
    digits : int
    tolerance : float
    """

    page: str
    pattern: str
    values: tuple[float, ...]
    digits: int = 1
    tolerance: float = POINTS


Told = Table | Sentence


def of_study(study: Study) -> list[Told]:
    """What the README and the page of the model say of the bundled study."""
    rigs = {rig.rig: rig for rig in study.rigs}
    one, other = (rigs[name] for name in ("utfsm", "labcontrol"))
    rows = []
    for name in ("play-bypass", "bouc-wen:joint", "bouc-wen", "bingham:joint", "paper"):
        both = [next(c for c in rig.candidates if c.recipe.name == name) for rig in (one, other)]
        counts = " / ".join(dict.fromkeys(str(c.damper.parameter_count) for c in both))
        errors = [_median_worst(v) for c in both for v in (c.cross_validated, c.validation)]
        title = f"**{both[0].title}**" if both[0] in (one.chosen, other.chosen) else both[0].title
        rows.append(f"| {title} | {counts} | {' | '.join(errors)} |")
    floors = [
        f"{100 * np.median([r.repeatability for r in rig.dataset if r.repeatability]):.1f}" for rig in (one, other)
    ]
    rows.append(f"| cycle-to-cycle scatter of the rigs | | {floors[0]} | {floors[0]} | {floors[1]} | {floors[1]} |")
    readings = [rig.readings for rig in (other, one)]
    raw, offset, left = _sweep(one)
    page = "docs/play-and-bypass.md"
    gains = tuple(sorted(100 * float(np.std([r.gain for r in of])) for of in readings))
    rest = tuple(100 * float(np.median([r.error(r.gain, r.offset) for r in of])) for of in readings)
    return [
        Table("README.md", "| model | parameters | utfsm cross-validation", tuple(rows)),
        Table(page, "| parameter | utfsm | labcontrol |", _parameters(one, other), share=WORST),
        Sentence(page, r"gains of (\S+)–(\S+) % \(standard deviation\)", gains),
        Sentence(page, r"would leave (\S+) % \(labcontrol\) and (\S+) % \(utfsm\)", rest),
        Sentence(page, r"rig utfsm\): (\S+) % raw", (raw,), tolerance=3 * POINTS),
        Sentence(page, r"force zero lies (\S+) N from", (offset,), 0, 5.0),
        Sentence(page, r"own offset (\S+) % remain", (left,), tolerance=3 * POINTS),
    ]


def _parameters(*rigs: RigStudy) -> tuple[str, ...]:
    """Rows of the parameters of the chosen dampers with their intervals."""
    columns = [{str(row["name"]): str(row["written"]) for row in intervals(rig.damper)} for rig in rigs]
    names = list(dict.fromkeys(name for column in columns for name in column))
    return tuple(f"| {n} | {' | '.join(column.get(n, '–') for column in columns)} |" for n in names)


def of_comparison(folder: Path) -> list[Told]:
    """The tables of docs/models.md."""
    found = _read(folder / "comparison.csv")
    seconds = json.loads((folder / "made.json").read_text(encoding="utf-8"))["seconds"]
    tables = []
    for rig in dict.fromkeys(row["rig"] for row in found):
        rows = []
        for row in (r for r in found if r["rig"] == rig and r["rank"]):
            errors = [_percent(row[f"{name}_nrmse_pp"]) for name in ("per_run", "train")]
            for name in ("cv", "validation"):
                errors.append(f"{_percent(row[f'{name}_nrmse_pp'])} ({_percent(row[f'{name}_worst_nrmse_pp'])})")
            head, took = f"{row['rank']}. {row['title']}", f"{seconds[rig][row['model']]:.1f}"
            rows.append(f"| {' | '.join([head, *errors, row['parameters'], took])} |")
        tables.append(Table(_MODELS, _COMPARED, tuple(rows), f"### {rig}"))
    return tables


def of_both(study: Study) -> list[Told]:
    """Rows of docs/models.md that a study makes too: it follows some of the recipes of a comparison."""
    names = catalogue()
    tables = []
    for rig in study.rigs:
        rows = []
        for c in (c for c in rig.candidates if c.recipe.name in names):
            errors = [f"{100 * c.train.median():.1f}", _median_worst(c.cross_validated), _median_worst(c.validation)]
            rows.append(f"| {c.title} | {' | '.join(['', *errors, str(c.damper.parameter_count), ''])} |")
        tables.append(Table(_MODELS, _COMPARED, tuple(rows), f"### {rig.rig}", whole=False))
    return tables


SEEDS = 20  # noise seeds behind the ranges in docs/paper-method.md


def of_reproduction(folder: Path) -> list[Told]:
    """Return the table and the sentences of docs/paper-method.md on the virtual rig; ranges only of enough seeds."""
    methods = {row["method"]: row for row in _read(folder / "tables" / "methods.csv")}
    left = {r["parameter"]: r["left_after_identifying_anew"] for r in _read(folder / "tables" / "sensitivity.csv")}
    rows = tuple(
        f"| {name} | {_percent(row['nrmse_pp'])} | {_percent(row['worst_nrmse_pp'])} |" for name, row in methods.items()
    )
    page = "docs/paper-method.md"
    over_seeds = {
        "paper, literal": r"literal method stays within (\S+)–(\S+) %",
        "consistent": r"the consistent one within (\S+)–(\S+) %",
        "consistent, the paper's functions": r"the paper's functions (\S+)–(\S+) %",
    }
    enough = int(methods["paper, literal"]["seeds"] or 0) >= SEEDS
    ranges = [
        Sentence(
            page, pattern, tuple(100 * float(methods[name][f"seed_{end}_nrmse_pp"]) for end in ("lowest", "highest"))
        )
        for name, pattern in over_seeds.items()
        if enough
    ]
    return [
        Table(page, "| way | median | worst |", rows),
        *ranges,
        Sentence(page, r"identified anew, (\S+) % of the force's deviation", (100 * float(left["n"]),)),
        Sentence(page, r"with γ/β off by 0.1 (\S+) %", (100 * float(left["asymmetry"]),)),
    ]


def differences(told: Iterable[Told], root: Path = ROOT) -> list[str]:
    """What the documents say otherwise, beyond the tolerances."""
    return [text for one in told for text in _off(one, (root / one.page).read_text(encoding="utf-8"))]


def write(told: Iterable[Told], root: Path = ROOT) -> None:
    """Put what came out into the documents."""
    for one in told:
        path = root / one.page
        text = path.read_text(encoding="utf-8")
        if isinstance(one, Table) and not one.whole:
            continue
        if isinstance(one, Table):
            begin, end = _place(one, text)
            text = text[:begin] + "".join(f"{row}\n" for row in one.rows) + text[end:]
        else:
            found = re.search(one.pattern, text)
            assert found, one.pattern
            for group in range(found.re.groups, 0, -1):
                value = f"{one.values[group - 1]:.{one.digits}f}"
                text = text[: found.start(group)] + value + text[found.end(group) :]
        path.write_text(text, encoding="utf-8")


def _off(one: Told, text: str) -> list[str]:
    if isinstance(one, Sentence):
        found = re.search(one.pattern, text)
        if found is None:
            return [f"{one.page}: no sentence “{one.pattern}”"]
        return [
            f"{one.page}: “{found.group(0)}”: {value:.{one.digits}f} came out"
            for said, value in zip(found.groups(), one.values, strict=True)
            if abs(float(said) - value) > one.tolerance + 0.5 * 10**-one.digits
        ]
    begin, end = _place(one, text)
    said = text[begin:end].splitlines()
    if not one.whole:
        names = {_name(row) for row in one.rows}
        said = [row for row in said if _name(row) in names]
    if len(said) != len(one.rows):
        return [f"{one.page}: {len(said)} rows under “{one.under}”, {len(one.rows)} came out"]
    pairs = zip(_sorted(said), _sorted(one.rows), strict=True)
    return [f"{one.page}: {a}\n   came out: {b}" for a, b in pairs if not _near(a, b, one.share)]


def _sorted(rows: Sequence[str]) -> list[str]:
    """By name: near errors may change places."""
    return sorted(rows, key=_name)


def _name(row: str) -> str:
    """The first cell, without a rank before it."""
    return re.sub(r"^\d+\. ", "", row.strip("|").split("|")[0].strip(" *"))


def _near(said: str, out: str, share: float = 0.0) -> bool:
    """Whether the cells of two rows say about the same."""
    a, b = ([cell.strip(" *") for cell in row.strip("|").split("|")] for row in (said, out))
    if _name(said) != _name(out) or len(a) != len(b):
        return False
    for one, other in zip(a[1:], b[1:], strict=True):
        if not other:
            continue
        x, y = ([float(n) for n in _NUMBER.findall(cell)] for cell in (one, other))
        if len(x) != len(y) and (share or "." in one + other):
            return False
        if share:
            if any(abs(p - q) > share * max(p, q) for p, q in zip(x, y, strict=True)):
                return False
            continue
        for n, (p, q) in enumerate(zip(x, y, strict=False)):
            allowed = POINTS + WORST * q * (n > 0 or q > 25) if "." in one else COUNT
            if abs(p - q) > allowed + 1e-9:
                return False
    return True


def _place(table: Table, text: str) -> tuple[int, int]:
    """Where the rows of a table begin and end."""
    start = text.index(table.after) if table.after else 0
    head = text.index(table.under, start)
    begin = text.index("\n", text.index("\n", head) + 1) + 1
    end = begin
    while text.startswith("|", end):
        end = text.index("\n", end) + 1
    return begin, end


def _median_worst(validation: Validation) -> str:
    return f"{100 * validation.median():.1f} ({100 * validation.worst().scores.nrmse_pp:.1f})"


def _sweep(rig: RigStudy) -> tuple[float, float, float]:
    """Error on the 0 A sweep in %, how far its force zero lies [N], and the error with its own offset in %."""
    run = rig.dataset["utf_chirp15_0A"]
    inside = run.in_window
    measured = run.force[inside]
    rest = measured - rig.damper.predict(run).force[inside]
    offset = float(np.mean(rest))
    size = float(np.ptp(measured))
    return 100 * float(np.sqrt(np.mean(rest**2))) / size, abs(offset), 100 * float(np.std(rest)) / size


def _percent(fraction: str) -> str:
    return f"{100 * float(fraction):.1f}" if fraction else "–"


def _read(path: Path) -> list[Mapping[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def main() -> int:
    """Compare, or write."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.numbers", description=__doc__)
    parser.add_argument("--compare", type=Path, help="Folder written by mrdamper compare.")
    parser.add_argument("--reproduce", type=Path, help="Folder written by mrdamper reproduce.")
    parser.add_argument("--write", action="store_true", help="Put the numbers into the documents.")
    given = parser.parse_args()
    told: list[Told] = []
    if given.compare:
        told += of_comparison(given.compare)
    if given.reproduce:
        told += of_reproduction(given.reproduce)
    if not told:
        from mrdamper.rig_files.dataset_folder import load_dataset
        from mrdamper.study.workflow import run_study

        study = run_study(load_dataset())
        told += [*of_study(study), *of_both(study)]
    if given.write:
        write(told)
    found = differences(told)
    print("\n".join(found) or f"{len(told)} tables and sentences say what came out")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
