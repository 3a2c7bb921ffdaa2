"""Currents of tests that other files state: plans, tables of results, legends, lists and schemes of names."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mrdamper.data.wording import number
from mrdamper.errors import InputError, QualityError, listed, printable
from mrdamper.rig_files import conditions
from mrdamper.rig_files.coil_current import NO_CHANNEL
from mrdamper.rig_files.column_names import is_called, split_name, words, words_of
from mrdamper.rig_files.file_records import records_of_file
from mrdamper.rig_files.mapping.comparisons import forces_grow
from mrdamper.rig_files.mapping.completion import completed
from mrdamper.rig_files.mapping.description import SHORT_TEXTS, short_lines, with_notes
from mrdamper.rig_files.mapping.name_schemes import Tests, by_example, by_legend, by_scheme, fields_of_names
from mrdamper.rig_files.mapping.result_tables import lines_of, results_in
from mrdamper.rig_files.mapping.results import Results, rows_below_heads
from mrdamper.rig_files.profile import Profile, toml
from mrdamper.rig_files.quality.motion import moves
from mrdamper.rig_files.quality.view import View, strokes_of
from mrdamper.rig_files.readers import ask_tables, raw_tables
from mrdamper.rig_files.readers.base import RawTable
from mrdamper.rig_files.record import HEAD, Finding, Record, last_parts, part_of_record

_DISCARDED, _DISCARDED_FLAG, _NOT_DISCARDED = (
    re.compile("(?i)" + "|".join(words(of))) for of in ("discarded", "discarded_flag", "not_discarded")
)
_REST = 0.1  # of the largest motion: less is that of no test
_SLACK = 0.01  # of a record, by which a start or an end is rounded
_MOTIONS = (  # dimension and name of a column, relative difference of two tests, unit of messages and its number per SI
    ("frequency", re.compile(r"(?i)^(?:f\b|freq|frec|fréq|част|频率|周波数|częst)"), 0.15, "Hz", 1.0),
    (
        "length",
        re.compile(r"(?i)ampl|(?:^|[_ ])amp$|^x_?0$|^(?:stroke|hub|course|carrera|corsa)$|振幅|행정|行程"),
        0.5,
        "mm",
        1e3,
    ),
)
_PEAK = re.compile(r"(?i)peak|pico|picco|crête|spitze|max|峰|최대|пик|макс")
_FEWEST_PEAKS = 3  # tests whose peak forces are compared with a plan
_PEAK_RATIO = 1.3  # largest peak force of a plan over the smallest from which they tell tests apart
_ALIKE = 0.5  # correlation of the logarithms of peak forces below which their orders differ
_REMARKS = frozenset((*words("notes"), *words("remarks")))
_LABELS = words("specimen") | words("rig")
_STAMP = re.compile(  # 20190603_140512, 2019-06-03T14:05:12
    r"(?<![0-9])(20[0-9]{2})-?([01][0-9])-?([0-3][0-9])[T_ -]([0-2][0-9])[:-]?([0-5][0-9])[:-]?([0-5][0-9])(?![0-9])"
)


def results_of(path: Path) -> Results | None:
    """Return the table of results that a file holds; None if it holds none."""
    if path.suffix.lower() in SHORT_TEXTS and (stated := results_in(short_lines(path))):
        arrays = path.suffix.lower() == ".m" and all(split_name(key).unit for key in stated.keys)  # of a script
        return replace(stated, of_supply=stated.of_supply or arrays)

    def results_apart(tables: Sequence[RawTable]) -> list[tuple[str, Results]]:
        every = ((t.label, results_in(lines_of(completed(with_notes(t, path, Profile()))))) for t in tables[:20])
        beside = results_in([*dict.fromkeys(line for table in tables for line in table.remarks)])
        return [(label, of) for label, of in every if of] or ([("", beside)] if beside else [])

    sheets = ask_tables(path, results_apart, [])
    if len({(of.keys, of.title, of.of_supply) for _, of in sheets}) != 1:
        return None
    shared = set.intersection(*({*label.split()} for label, _ in sheets))  # Damper FL, Damper RR: FL, RR
    named = [(" ".join(word for word in label.split() if word not in shared), of) for label, of in sheets]
    every = tuple(current for _, of in named for current in of.current)
    cells = tuple((name, *row) for name, of in named for row in of.cells)
    first = sheets[0][1]
    several = replace(first, current=every, cells=cells, keys=("", *first.keys), pauses=())
    return several if len(sheets) > 1 else first


def currents_beside(path: Path, results: Results | None, tests: Tests) -> list[tuple[float, str]] | None:
    """Return the current [A] of every test and where it stands, by the first statement of a file that has each of them.

    The statements are those of its table of results, of a scheme of names and of a legend. None if there is none.
    """
    inside = {file.name for file, _ in tests if path.parent in file.parents}
    if any(file.name in inside and path.parent not in file.parents for file, _ in tests):
        return None  # those of a folder beside its own, called alike, may be other tests
    records = [record for _, record in tests]
    one_record = len({file for file, _ in tests}) == 1 < len(tests)
    if results and one_record and results.on_clock(records) and not results.rows_in_range(records):
        return None
    stated = next((of for of in _by_rows(results, tests) if len(of) == len(tests)), None) if results else None
    if results and stated is not None:
        grow = results.of_supply and forces_grow([(tests[i][1], of) for i, of in stated.items()], repeated=True)
        titled = [(stated[i], f"{path.name}, {results.title}") for i in range(len(tests))]
        return titled if grow or not results.of_supply else None
    lines = short_lines(path) if path.suffix.lower() in SHORT_TEXTS else []
    rows = zip(results.cells, results.current, strict=True) if results and not results.of_supply else ()
    named = [([*filter(None, cells)], value) for cells, value in rows]  # Level, Current (A): L1, 0.35
    lines += [f"{names[0]}: {value:g} A" for names, value in named if names]
    titled = by_scheme(lines, results, tests) or by_legend(lines, tests) or by_example(lines, tests)
    return [(current, f"{path.name}, {title}") for current, title in titled] or None


def _by_rows(results: Results, tests: Tests) -> Iterator[Mapping[int, float]]:
    """Yield the current [A] of tests, by their place, by each way in which the rows of a table may name them."""
    called, files, folders = _called(tests), [file.name for file, _ in tests], [file.parent.name for file, _ in tests]

    def by_range(rows: Results, own: Sequence[int]) -> dict[int, float]:
        ranges = rows.rows_in_range([tests[i][1] for i in own])
        stated = {own[i]: rows.current[row] for i, row, _ in ranges}
        return stated if len(stated) == len(ranges) else {}

    def by_name(rows: Results, own: Sequence[int]) -> dict[int, float]:
        one = len(rows.current) == len(own) == 1
        if one:
            return {own[0]: rows.current[0]}
        names = [called[i] for i in own]
        starts = [(_start(tests[i]), float(np.ptp(tests[i][1].time))) for i in own]
        heads = [tests[i][1].provenance.get(HEAD, "").split("; ") for i in own]  # lines above a test: name and value
        by_head = rows.by_test(heads, whole_names=True)
        by_file = rows.by_test(names, whole_names=True)
        if len(by_head) == len(by_file) == len(own) and by_head != by_file:
            return {}
        stated = by_head if len(by_head) == len(own) else by_file or rows.by_clock(starts) or rows.by_test(names)
        return {own[i]: current for i, current in stated.items()}

    def by_group(groups: Sequence[str], by: Callable[[Results, Sequence[int]], dict[int, float]]) -> dict[int, float]:
        every = [{i: c for rows, own in of for i, c in by(rows, own).items()} for of in results.apart(groups)]
        whole = [of for of in every if len(of) == len(tests)]
        return whole[0] if whole and all(of == whole[0] for of in whole) else {}

    yield by_range(results, range(len(tests)))
    yield by_group(files, by_range)
    yield by_name(results, range(len(tests)))
    yield by_group(folders, by_name)


def other_motions(path: Path, results: Results | None, tests: Tests) -> InputError | None:
    """Return the refusal of a plan of which a test moves at another frequency, or by another amplitude, than its row.

    Amplitudes, which may be strokes peak to peak, are compared with each other.
    """
    texts: list[str] = []
    for dimension, called, limit, unit, size in _MOTIONS:
        values = results.numbers(dimension, called.search) if results else []
        rows = rows_beside(path, results, tests) if values else ()
        pairs = [(r, values[row], _motion(r)[unit]) for row, (_, r) in zip(rows, tests, strict=False)]
        pairs = [pair for pair in pairs if pair[1] > 0 and pair[2] > 0]
        if unit == "mm" and len({stated for _, stated, _ in pairs}) < 2:
            continue  # may be the damper's stroke, or a tolerance
        usual = 1.0 if unit == "Hz" or not pairs else float(np.median([ours / theirs for _, theirs, ours in pairs]))
        for record, stated, own in pairs:
            if max(share := own / stated / usual, 1 / share) > 1 + limit:
                moving = f"{record.id}, which moves {'at' if unit == 'Hz' else 'by'} {number(size * own, 3)} {unit}"
                texts.append(f"{path.name} states {size * stated:g} {unit} of {moving}")
    texts += _other_peaks(path, results, tests)
    if not texts:
        return None
    problem = f"{listed(texts, 2)}: are its rows those of other tests?"
    remedy = "write the current of each test into tests.csv (--write-tests), or correct the plan"
    return QualityError(printable(problem), where=path.name, remedy=remedy, code="E_MOTION_CONTRADICTS")


def _other_peaks(path: Path, results: Results | None, tests: Tests) -> list[str]:
    """Tell if the peak forces of a plan's rows are in another order than those of their tests.

    Peaks are with or without the gas force, or peak to peak, so their sizes are not compared.
    """
    stated = results.numbers("force", _PEAK.search) if results else []
    rows = rows_beside(path, results, tests) if stated else []
    theirs, own = np.array([stated[row] for row in rows]), np.array([np.ptp(r.force[r.present]) / 2 for _, r in tests])
    if len(rows) < _FEWEST_PEAKS or min(theirs.min(), own.min()) <= 0 or theirs.max() < _PEAK_RATIO * theirs.min():
        return []
    sizes = np.log([theirs, own])
    if np.corrcoef(sizes)[0, 1] > _ALIKE:
        return []
    at = int(np.argmax(np.abs(sizes[0] - sizes[1])))
    both = f"{number(theirs[at], 3)} N stated, {number(own[at], 3)} N half peak to peak in {tests[at][1].id}"
    return [f"peak forces of {path.name} are in another order than those of the tests ({both})"]


def _motion(record: Record) -> dict[str, float]:
    """Return the frequency [Hz] and amplitude [m] of a steady motion; zero where there is none."""
    strokes = strokes_of(record)
    if not strokes.steady or not strokes.period:
        return {"Hz": 0.0, "mm": 0.0}
    return {"Hz": 1 / strokes.period, "mm": float(np.median(strokes.lengths)) / 2}


def rows_beside(path: Path, results: Results | None, tests: Tests) -> list[int]:
    """Return the row of each test in a table of results; empty unless every test has one."""
    if results is None:
        return []
    numbers = tuple(map(float, range(len(results.cells))))
    stated = currents_beside(path, replace(results, current=numbers, of_supply=False), tests) or ()
    return [int(row) for row, _ in stated] if {row for row, _ in stated} <= {*numbers} else []


def labels_of(path: Path, results: Results | None, tests: Tests, kind: str) -> list[str]:
    """Return the specimen or rig of each test by a column of a plan or a scheme of names; empty unless all have one."""
    called = words(kind)
    rows = rows_beside(path, results, tests)
    heads = enumerate(results.keys if results else ())
    stated = [[results.cells[row][i] for row in rows] for i, key in heads if results and is_called(key, called)]
    lines = short_lines(path) if path.suffix.lower() in SHORT_TEXTS else []
    stated += [texts for header, texts in fields_of_names(lines, tests) if is_called(header.name, called)]
    stated = [texts for texts in stated if texts and all(texts) and (len({*texts}) < len(texts) or len(texts) == 1)]
    return stated[0] if len(stated) == 1 else []


def discarded_tests(path: Path, results: Results | None, tests: Tests) -> dict[int, InputError]:
    """Return the refusal of each test that a remark in a plan calls invalid, aborted, repeated or a warm-up."""
    rows = [[*zip(results.keys, cells, strict=True)] for cells in results.cells] if results else []
    texts = [[f"{key}: {cell}" for key, cell in row if _discards(key, cell)] for row in rows]
    remarks = [next(iter(of), "") for of in texts]
    if results is None or results.of_supply or not any(remarks) or all(remarks):  # of all tests it is of none
        return {}
    files = [file for file, _ in tests]
    parts = [file.parts if files.count(file) == 1 else (*file.parts, record.id) for file, record in tests]
    refused = {i: remarks[row] for i, row in enumerate(rows_beside(path, results, tests)) if remarks[row]}
    names = last_parts(parts)
    left_out = toml([names[parts[i]] for i in refused])
    remedy = (
        "to keep a test that is valid, write its current into tests.csv (--write-tests), or correct the remark; to "
        f"omit those that are not, set [file] leave_out = {left_out} in a profile"
    )
    problems = {i: printable(f"{path.name} has the remark {of[:80]!r} on this test") for i, of in refused.items()}
    where = {i: files[i].name for i in refused}
    return {i: QualityError(of, where=where[i], remedy=remedy, code="E_DISCARDED") for i, of in problems.items()}


def _discards(heading: str, cell: str) -> bool:
    parts = () if _REMARKS.isdisjoint(words_of(heading.casefold())) else _DISCARDED.finditer(cell)
    applies = any(not _NOT_DISCARDED.search(cell[: part.start()]) for part in parts)
    return applies or _DISCARDED_FLAG.search(f"{heading}: {cell}") is not None


def remarks_of(path: Path) -> Results | None:
    """Return the table of tests with remarks or specimens and no currents that a file holds; its currents are zero."""
    lines = short_lines(path) if path.suffix.lower() in SHORT_TEXTS else []
    lines = lines or ask_tables(path, lambda tables: [line for t in tables[:20] for line in lines_of(t)], [])
    for heads, rows in rows_below_heads(lines):
        flags = (_DISCARDED_FLAG.search(f"{head}: {answer}") for head in heads for answer in ("yes", "no"))
        remarks = any(flags) or not _REMARKS.isdisjoint(word for head in heads for word in words_of(head.casefold()))
        table = Results((0.0,) * len(rows), tuple(map(tuple, rows)), "", tuple(heads))
        if remarks or table.ranges[1] or any(is_called(head, _LABELS) for head in heads):
            return table
    return None


def cut_to_windows(path: Path, results: Results | None, tests: Tests) -> dict[int, Record]:
    """Return the tests of which a plan states a start and an end on each one's own clock or rows, cut to that.

    Those of another clock, which some of them do not have, stay whole, with a finding.
    """
    cut = within_ranges(tests, results)
    if len(cut) == len(tests) and any(own[1] is not other[1] for own, other in zip(cut, tests, strict=True)):
        return {i: part for i, (_, part) in enumerate(cut) if part.time.size < tests[i][1].time.size}
    if results is None or len(cut) != len(tests) or not (windows := results.ranges[1]):
        return {}
    rows, inside = rows_beside(path, results, tests), dict[int, slice]()
    clocks = results.clocks([record for _, record in tests])
    for i, (row, clock) in enumerate(zip(rows, clocks, strict=False)):
        (begin, end), slack = windows[row], _SLACK * (clock[-1] - clock[0])
        if clock[0] - slack <= begin < end <= clock[-1] + slack:
            inside[i] = slice(int(np.searchsorted(clock, begin)), int(np.searchsorted(clock, end, side="right")))
    if len(inside) < len(rows):
        text = printable(f"starts and ends in {path.name} are not all on the clocks of the tests, and are not used")
        note = Finding("W_CUT", text)
        return {i: tests[i][1].noticed(note) for i in range(len(rows))}
    note = Finding("W_CUT", printable(f"cut to its start and end in {path.name}"))
    parts = {i: part_of_record(tests[i][1], s) for i, s in inside.items()}
    return {i: part.noticed(note) for i, part in parts.items() if part.time.size < tests[i][1].time.size}


def named_tests(results: Results | None, tests: Tests) -> list[int]:
    """Return the places of the tests that a table of results names, by more than a number."""
    cells = {cell.casefold() for row in (results.cells if results else ()) for cell in row if not cell.isdigit()}
    return [i for i, names in enumerate(_called(tests)) if (cells - {""}) & {name.casefold() for name in names}]


def names_files(results: Results, files: Sequence[Path]) -> bool:
    """Tell if the rows of a table of results name files, or the folder of each test, that cannot be read yet."""
    folders = [(folder.name,) for folder in dict.fromkeys(file.parent for file in files)]
    names = [(file.stem, file.name, "\\".join(file.parts[-2:])) for file in files]
    stated = [(results.by_test(of, whole_names=True) or results.by_test(of), of) for of in (names, folders)]
    return not results.of_supply and any(len(rows) == len(of) for rows, of in stated)


def misfit_of_plan(path: Path, results: Results | None, tests: Tests) -> Finding | None:
    """Return the finding that a plan, which names most tests without a current, has one twice or lacks others."""
    text = results.misfit(_called(tests)) if results else ""
    problem = printable(f"{NO_CHANNEL}missing: {path.name} {text}: if so, correct the plan")
    return Finding("W_COLUMN", problem) if text else None


def currents_listed(path: Path, tests: Tests) -> list[tuple[float, str]] | None:
    """Return the current [A] of every test and where it stands, by the only list of currents in a text: 0, 0.5 and 1 A.

    None unless the names of the tests, or of those of each file, count as many, alike in motion, and their forces grow
    as the currents.
    """
    lines = short_lines(path) if path.suffix.lower() in SHORT_TEXTS else []
    listed = {of for line in lines if (of := conditions.series_in(line))}
    files = [file if len(listed) == 1 and len(tests) > len(min(listed)) else path for file, _ in tests]
    stated: dict[int, float] = {}
    for file in dict.fromkeys(files) if len(listed) == 1 else ():
        own = [i for i, of in enumerate(files) if of == file]
        rows = [Results(min(listed), tuple((f"{n + k}",) for n in range(len(min(listed)))), "", ("",)) for k in (0, 1)]
        by_test = next((of for row in rows if (of := row.by_test([(tests[i][1].id,) for i in own]))), {})
        currents = {own[at]: current for at, current in by_test.items()}
        if len(currents) == len(own) and forces_grow([(tests[i][1], current) for i, current in currents.items()]):
            stated |= currents
    title = f"{path.name}, a list of as many currents as tests"
    return [(stated[i], title) for i in range(len(tests))] if len(stated) == len(tests) else None


def within_ranges(tests: Tests, results: Results | None) -> Tests:
    """Return the tests that have a row in a table of results, between the starts and ends it states, if it does.

    A record of several rows is cut into a test for each. Where a column names the files, each has to have a row.
    """
    if results is None:
        return tests

    def cuts_of(rows: Results, own: Sequence[int]) -> list[tuple[int, slice]]:
        return [(own[i], samples) for i, _, samples in rows.rows_in_range([tests[i][1] for i in own])]

    groups = results.apart([file.name for file, _ in tests])
    by_file = ([cut for rows, own in group for cut in cuts_of(rows, own)] for group in groups)
    whole = (cuts for cuts in by_file if len({i for i, _ in cuts}) == len(tests))
    cuts, records = cuts_of(results, range(len(tests))) or next(whole, []), list[tuple[Path, Record]]()
    for i, (file, record) in enumerate(tests):
        parts = [samples for at, samples in cuts if at == i]
        for n, samples in enumerate(parts, 1):
            part = part_of_record(record, samples, f"{record.id}_{n}" if len(parts) > 1 else "")
            records.append((file, part.noticed(_cut_at(parts, record))))
    return records or tests


def _cut_at(parts: Sequence[slice], record: Record) -> Finding:
    """Return the finding on a cut, with the motion in none of the parts for as long as the shortest of them."""
    text, least = "cut at the starts and ends that a plan states", min(part.stop - part.start for part in parts)
    starts, stops = [0, *(part.stop for part in parts)], [*(part.start for part in parts), record.time.size]
    for start, stop in zip(starts, stops, strict=True):
        inner = slice(start + (stop - start) // 4, stop - (stop - start) // 4)
        if stop - start >= least and not rests(part_of_record(record, inner)):
            text += f"; no row has the motion from {record.time[start]:.4g} to {record.time[stop - 1]:.4g} s"
    return Finding("W_CUT", text)


def _called(tests: Tests) -> list[tuple[str, ...]]:
    """Names of each test: its own, of its file, its own without that, of its block, and with its folders."""
    names = []
    for file, record in tests:
        stem = re.sub(r"[^\w.+=-]+", "_", file.stem)
        own, blocks = record.id.removeprefix(stem).lstrip("_"), record.provenance.get("block", "").split("; ")
        paths = ["\\".join((*file.parts[-n:-1], name)) for n in (2, 3, 4) for name in (file.name, file.stem)]
        names.append((record.id, file.name, file.stem, own, *blocks, *paths))
    return names


def _start(test: tuple[Path, Record]) -> str:
    """Return the day and time at which a test began, by its lines or its file's name; empty where none is stated."""
    match = _STAMP.search(test[1].provenance.get("recorded_at", "")) or _STAMP.search(test[0].stem)
    return "{}-{}-{} {}:{}:{}".format(*match.groups()) if match else ""


def rests(record: Record) -> bool:
    """Tell if a record holds no motion."""
    try:
        return moves(View(record)) is not None
    except QualityError:
        return True


def tests_by(path: Path, results: Results, profile: Profile) -> list[Record]:
    """The tests of a file whose column numbers them as a table of results does, without pauses in which it rests.

    Empty if it has no such column, or one that numbers motions without a row.
    """
    try:
        with raw_tables(path, profile.file) as tables:
            columns = [results.column_of_tests(*tables, with_rests=of) for of in (False, True) if len(tables) == 1]
        column = next(filter(None, columns), None)
        if column is None:
            return []
        form = profile.file.model_copy(update={"run_column": column})
        records, _ = records_of_file(path, profile.model_copy(update={"file": form}))
        largest = max(float(np.ptp(record.displacement)) for record in records)
        moving = [record for record in records if not rests(record)]
        rows = None if columns[0] else len(results.cells)  # and rests without one
        far = (np.ptp(record.displacement) > _REST * largest for record in moving)
        tests = [r for r, of in zip(moving, far, strict=True) if of or not (rows or results.lacks_current(path, r.id))]
        return tests if rows in (None, len(tests)) else []
    except InputError:
        return []
