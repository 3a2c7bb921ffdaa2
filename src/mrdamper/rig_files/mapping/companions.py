"""Tests of several files beside each other: channels, results and legends that belong to them, and contradictions."""

from __future__ import annotations

import json
import re
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, combinations
from pathlib import Path

import numpy as np

from mrdamper.data import Floats, held_current
from mrdamper.data.arrays import rescale, take
from mrdamper.errors import InputError, QualityError, listed, printable
from mrdamper.rig_files.coil_current import NO_CHANNEL, as_data, current_of, with_stated_current, with_value_of_name
from mrdamper.rig_files.column_names import (
    RATING,
    SI,
    is_unit,
    names_condition,
    role_of,
    split_name,
    words,
    words_of,
)
from mrdamper.rig_files.columns import partly_assigned
from mrdamper.rig_files.conditions import amperes, series_in
from mrdamper.rig_files.file_records import digest_of, records_of_file
from mrdamper.rig_files.mapping.completion import completed, item_of
from mrdamper.rig_files.mapping.description import short_lines, with_notes, with_units_of_notes
from mrdamper.rig_files.mapping.rasters import with_joined_rasters, with_one_clock
from mrdamper.rig_files.mapping.results import NUMBER, Results, lines_of, results_in
from mrdamper.rig_files.profile import Channel, FileForm, Profile
from mrdamper.rig_files.quality.motion import stated_motion
from mrdamper.rig_files.quality.view import find_strokes
from mrdamper.rig_files.readers import ask_tables, raw_tables
from mrdamper.rig_files.readers.arrays import array_table
from mrdamper.rig_files.readers.base import RawTable, Source
from mrdamper.rig_files.record import REQUIRED, Finding, Record, part_of_record
from mrdamper.rig_files.rig_record import records_of

_FEWEST_ROWS = 50  # of a record
TEXTS = (".csv", ".txt", ".tsv", ".dat", ".md", ".log", ".json", ".yaml", ".yml")  # short ones
_LEGEND = re.compile(  # I1 = 0.3 A, cur0.8 = coil current 0.8 A (as set)
    r"[\s*`-]*(.{1,60}?)`?\s*(?:=|:|->)\s*([^\W\d_][^\d=:]{0,30}\s)?([0-9]{1,4}(?:[.,][0-9]{1,4})?)\s*(m?A)"
    r"\s*(?:\([^()]*\))?\s*$"
)
_DECIMAL_CODE = re.compile(r"(?<![a-z])[a-z]{1,6}[0-9]+\.[0-9]+(?![0-9])")
_SCHEME = re.compile(r"[\w.,+=-]*(?:<[^<>]{1,60}>[\w.,+=-]*)+")  # MRD_A<amplitude in mm>_I<coil current in A>.csv
_SCHEME_NUMBER = re.compile(r"[0-9]+(?:[.,xp][0-9]+)?")
_CODE = re.compile(r"([A-Za-z]{1,6})([0-9]{1,3})(?:\s*(?:-|–|to|bis)\s*\1([0-9]{1,3}))?")  # I1 or test01-test04
_DISCARDED, _DISCARDED_FLAG = (re.compile("(?i)" + "|".join(words(of))) for of in ("discarded", "discarded_flag"))
_FREQUENCY = re.compile(r"(?i)^(?:f\b|freq|frec|fréq|част|频率|周波数|częst)")
_OTHER_FREQUENCY = 0.15  # relative difference of the frequencies of two tests
_REMARKS = frozenset((*words("notes"), *words("remarks")))
_STAMP = re.compile(  # 20190603_140512, 2019-06-03T14:05:12
    r"(?<![0-9])20[0-9]{2}-?[01][0-9]-?[0-3][0-9][T_ -](?P<hour>[0-2][0-9])[:-]?(?P<minute>[0-5][0-9])"
    r"[:-]?(?P<second>[0-5][0-9])(?![0-9])"
)
_SAME_START = 0.02  # of a record: clocks of two loggers that are one
_ALIKE = 0.1  # relative difference of frequency and amplitude within which two motions are one
_ALIKE_A = 0.03  # difference of the current within which two tests have the same [A]
_FEWEST_AGREEING = 3  # tests of the amplitude that they state, for every one of half of it
_SEVERAL = 2.0  # ratio of peak-to-peak forces at equal conditions that no repetition explains
_ROUNDING = 1e-3  # of the largest value: two exports of one test differ by less, two tests by more
_ROUNDING_A = 5.5e-3  # [A] so much a current of two decimals differs from one of more
_MOST_SAMPLES = 20_000
_Point = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class Part:
    """Channels of a test that lie in a file of their own."""

    path: Path
    table: RawTable  # in memory, its columns named by their channels, in SI
    key: tuple[str, ...]  # by which parts of one test belong together
    test: Path  # of which the name is that of the test, where this part has its force
    columns: str  # what was taken for its channels


def holds_channels(path: Path, form: FileForm) -> bool:
    """Tell if a table of a file has columns of a displacement and a force."""
    channels = ask_tables(path, lambda tables: [{header.channel for header in t.headers} for t in tables], [], form)
    return any({"displacement", "force"} <= of_table for of_table in channels)


def part_of(path: Path, profile: Profile, run: str = "") -> Part | None:
    """Return the channels of a file that is no whole test: several with a time, or the only one, which its name tells.

    None if it has none, or several tables. Parts of one test have one `run`, or the same numbers in their names;
    files of one column lie in one folder and have one name beside the channel's: run7_force_N.txt, run7_time_s.txt.

    Raises `InputError` if the file of a `run` lacks a channel that the profile says is in it, or a time.
    """
    form = profile.file.model_copy(update={"separator": None, "decimal": None})  # it may be that of another file
    others = {role: channel for role, channel in profile.channels.items() if role != "time"}
    other_logger = profile.model_copy(update={"file": form, "channels": others})
    try:
        with raw_tables(path, profile.file) as tables:
            if len(tables) != 1:
                return None
            table, alone = completed(with_notes(tables[0], path, profile)), len(tables[0].names) == 1
            stated = [role for role, channel in profile.channels.items() if channel.file]
            assigned = partly_assigned(table, profile, ["time", *stated] if run and not alone else ())
            raw = table.read([entry.column for entry in assigned.values()])
            channels = {role: rescale(raw.values[e.column], e.factor, e.offset) for role, e in assigned.items()}
            current = None if alone else current_of(table, profile, path, channels.get("current"), slice(None))[0]
    except InputError:
        if run and other_logger != profile:
            return part_of(path, other_logger, run)
        if run:
            raise
        return None
    if not alone and "time" in channels:
        there = np.isfinite(channels["time"])
        channels = {role: values[there] for role, values in channels.items()}
    time = channels.get("time", np.empty(0))
    timed = len(channels) > 1 and time.size > 1 and bool(np.all(np.diff(time) > 0))
    if not channels or not (alone or timed):
        return part_of(path, other_logger, run) if run and other_logger != profile else None
    words = [word for word in words_of(split_name(path.stem).name) if role_of(word) not in assigned]
    test = (
        path.parent / "_".join(words) if alone and words else path.parent if alone else path.with_name(run or path.name)
    )
    remarks = [] if current is None else [f"current: {current!r} A"]
    columns = ", ".join(f"{role} = {e.name} in {e.unit}" for role, e in assigned.items())
    values = _table_of(table.source, channels, remarks)
    key = ("column", str(test)) if alone else (run,) if run else number_of(path)
    return Part(path, values.noted(*table.findings, *raw.findings), key, test, columns)


def _table_of(source: Source, channels: Mapping[str, Floats], remarks: Sequence[str]) -> RawTable:
    """Return channels in SI as a table."""
    units = [SI[role] for role in channels]
    table = array_table(source, list(channels), units, list(channels.values()).__getitem__)
    return replace(table, remarks=tuple(remarks))


def number_of(path: Path) -> tuple[str, ...]:
    """Return the numbers in a file's name, by which files of one test belong together: not those of its channel."""
    stem = re.sub(r"(?i)(?<![a-z])ch[ _]?[0-9]$|^c[0-9](?=--)|(?<![0-9a-z])[23]d(?![0-9a-z])", "", path.stem)
    return str(path.parent), *(str(int(number)) for number in re.findall(r"[0-9]+", stem))


def joined_files(parts: Sequence[Part], profile: Profile) -> Iterator[tuple[list[Part], list[Record] | InputError]]:
    """Yield the parts that together are a test, and its records or why it cannot be used."""
    groups: dict[tuple[str, ...], list[Part]] = defaultdict(list)
    for part in parts:
        groups[part.key].append(part)
    delays = {role: Channel(delay_ms=c.delay_ms) for role, c in profile.channels.items() if c.delay_ms}
    own = profile.model_copy(update={"channels": delays})  # all else is done
    for group in groups.values():
        group.sort(key=lambda part: "force" not in part.table.names)
        names = [part.path.name for part in group]
        columns = ", ".join(part.columns for part in group)
        files = {"file": group[0].test.name, "files": ", ".join(names), "columns": columns}
        try:
            table = _together(group)
            records = [] if table is None else records_of(table, own, group[0].test)
            records = [with_value_of_name(record, group[0].test, profile) for record in records]
        except InputError as error:
            yield group, error
            continue
        if records:
            remarks = {key: as_data(text) for key, text in files.items()} | {"sha256": digest_of(group[0].path)}
            yield group, [replace(record, provenance={**record.provenance, **remarks}) for record in records]


def _together(parts: Sequence[Part]) -> RawTable | None:
    """Return the table of a test of which each part holds other channels; None if it is not whole."""
    tables = [part.table for part in parts]
    columns = {role: values for table in tables for role, values in zip(table.names, _arrays(table), strict=True)}
    if all(len(table.names) == 1 for table in tables):
        whole = {"displacement", "force"} <= set(columns) and len(columns) == len(tables)
        if not whole or len({values.size for values in columns.values()}) > 1:
            return None
        folder = parts[0].test
        texts = sorted({*folder.iterdir()} - {part.path for part in parts}) if folder.is_dir() else []
        lines = [line for path in texts if path.suffix.lower() in TEXTS for line in short_lines(path)]
        return _table_of(tables[0].source, columns, lines[:_FEWEST_ROWS])
    clocks = [_arrays(table)[table.names.index("time")] for table in tables]
    moving = [time for time, table in zip(clocks, tables, strict=True) if {"displacement", "force"} & {*table.names}]
    span = clocks[0][-1] - clocks[0][0]
    if any(abs(time[i] - clocks[0][i]) > _SAME_START * span for time in moving for i in (0, -1)):
        return None
    joined = with_joined_rasters(tables) if len(tables) > 1 else []
    if len(joined) != 1:
        return None
    names = " and ".join(part.path.name for part in parts)
    findings = [finding for table in tables for finding in table.findings]
    table = with_one_clock(replace(joined[0], findings=tuple(findings)))
    return table.noted(Finding("W_RASTER", f"joined from {names}, on the force's clock"))


def _arrays(table: RawTable) -> list[Floats]:
    return list(table.read(range(len(table.names))).values.values())


def results_of(path: Path) -> Results | None:
    """Return the table of results that a file holds; None if it holds none."""
    if path.suffix.lower() in TEXTS:
        lines = short_lines(path)
        return results_in(lines) or results_in([with_units_of_notes(line, path) for line in lines[:1]] + lines[1:])
    tables_of_results = ask_tables(path, lambda tables: [r for t in tables[:20] if (r := results_in(lines_of(t)))], [])
    return tables_of_results[0] if len(tables_of_results) == 1 else None


def currents_beside(
    path: Path, results: Results | None, tests: Sequence[tuple[Path, Record]]
) -> list[tuple[float, str]] | None:
    """Return the current [A] of every test and where it stands, by a table of results or a legend: I1 = 0.3 A.

    None unless one of them names every test; a legend's codes stand in the names of files, between separators.
    """
    timed = results.rows_in_time([record.time for _, record in tests]) if results else {}
    by_test = {i: results.current[row] for i, (row, _) in timed.items()} if results else {}
    by_test = by_test or (results.by_test(_called(tests)) if results else {})
    folders = [(file.parent.name,) for file, _ in tests]
    if results and len({*folders}) == len(tests):
        by_test = by_test or results.by_test(folders, by_number=False)
    by_test = by_test or (results.by_folder([folder for (folder,) in folders], _called(tests)) if results else {})
    if results and len(by_test) == len(tests):
        if results.of_supply and not _grow([(tests[i][1], current) for i, current in by_test.items()], _ALIKE_A):
            return None
        return [(by_test[i], f"{path.name}, {results.title}") for i in range(len(tests))]
    lines = short_lines(path) if path.suffix.lower() in TEXTS else []
    rows = (
        zip(results.cells, results.current, strict=True) if results and not results.of_supply else ()
    )  # Level, Current (A): L1, 0.35
    lines += [f"{cells[1]}: {value:g} A" for cells, value in rows if len(cells) > 1]
    files = [{file.name.casefold(), file.stem.casefold()} for file, _ in tests]
    called = set().union(*files)
    stated, ratings = set(), False
    for line in lines:
        parts = re.split(r"\s*[;|]\s*|,\s+|[.:]\s+(?=\w+ ?=)", line)
        matches = [m for m in map(_LEGEND.match, parts) if m and (not m[2] or role_of(m[2]) == "current")]
        legends = [(name, amperes(m[3], m[4])) for m in matches for name in _meant(m[1], called)]
        rating = RATING.search(line) is not None
        stated |= {*legends} if not (rating or ratings) else set()
        if line.strip() and not legends:  # a heading: Fuses
            ratings = rating
    if by_scheme := _by_scheme(lines, results, [file for file, _ in tests]):
        return [(current, f"{path.name}, the names of files") for current in by_scheme]
    names_of = [f"{file.stem} {record.id}".casefold() for file, record in tests]
    stems = [re.sub(r"(?<=[A-Za-z])0+(?=[0-9])", "", name) for name in names_of]
    words = [[*re.split(r"[^0-9A-Za-z]+", s), *_DECIMAL_CODE.findall(s.replace(",", "."))] for s in stems]
    codes = _with_scale(dict(stated), {word for own in words for word in own})
    if len(codes) < 2 or len(codes) < len(stated):
        return None
    own = [[code for code in codes if code in {*parts} | names] for parts, names in zip(words, files, strict=True)]
    if any(len(of_test) != 1 for of_test in own):
        return None
    return [(codes[code], f"{path.name}, {code.upper()}") for (code,) in own]


def other_motions(path: Path, results: Results | None, tests: Sequence[tuple[Path, Record]]) -> InputError | None:
    """Return the refusal of a plan of which a test moves at another frequency than its row states."""
    headers = [split_name(key) for key in results.keys] if results else []
    columns = [
        i for i, header in enumerate(headers) if header.dimension == "frequency" and _FREQUENCY.search(header.name)
    ]
    cells = [row[columns[0]].replace(",", ".") for row in results.cells] if results and len(columns) == 1 else []
    if results is None or not cells or not all(map(NUMBER.fullmatch, cells)):
        return None
    rows = currents_beside(path, replace(results, current=tuple(map(float, cells)), of_supply=False), tests) or ()
    texts: list[str] = []
    for (stated, _), (_, record) in zip(rows, tests, strict=False):
        thinned = slice(None, None, max(1, record.time.size // _MOST_SAMPLES))
        strokes = find_strokes(record.time[thinned], record.displacement[thinned])
        if strokes.steady and strokes.period and stated and abs(1 / (strokes.period * stated) - 1) > _OTHER_FREQUENCY:
            moves = f"{record.id}, which moves at {1 / strokes.period:.3g} Hz"
            texts.append(f"{path.name} states {stated:g} Hz of {moves}")
    if not texts:
        return None
    problem = f"{listed(texts, 2)}: are its rows those of other tests?"
    remedy = "write the current of each test into tests.csv (--write-tests), or correct the plan"
    return QualityError(printable(problem), where=path.name, remedy=remedy, code="E_MOTION_CONTRADICTS")


def discarded_tests(path: Path, results: Results | None, tests: Sequence[tuple[Path, Record]]) -> dict[int, InputError]:
    """Return the refusal of each test that a remark in a plan calls invalid, aborted, repeated or a warm-up."""
    rows = [[*zip(results.keys, cells, strict=True)] for cells in results.cells] if results else []
    texts = [[f"{key}: {cell}" for key, cell in row if _discards(key, cell)] for row in rows]
    remarks = [next(iter(of), "") for of in texts]
    if results is None or results.of_supply or not any(remarks) or all(remarks):  # of all tests it is of none
        return {}
    numbered = replace(results, current=tuple(float(i) if remark else 0.0 for i, remark in enumerate(remarks, 1)))
    refused: dict[int, InputError] = {}
    files = [file for file, _ in tests]
    for i, (row, _) in enumerate(currents_beside(path, numbered, tests) or ()):
        file, record = tests[i]
        name = json.dumps(file.name if files.count(file) == 1 else record.id, ensure_ascii=False)
        if row:
            problem = f"{path.name} has the remark {remarks[int(row) - 1][:80]!r} on this test"
            remedy = f"set [file] leave_out = [{name}] in a profile, or correct the remark if the test is valid"
            refused[i] = QualityError(printable(problem), where=file.name, remedy=remedy, code="E_DISCARDED")
    return refused


def _discards(heading: str, cell: str) -> bool:
    of_remarks = not _REMARKS.isdisjoint(words_of(heading.casefold()))
    return bool(_DISCARDED_FLAG.search(f"{heading}: {cell}") or (of_remarks and _DISCARDED.search(cell)))


def gap_of_plan(path: Path, results: Results | None, tests: Sequence[tuple[Path, Record]]) -> Finding | None:
    """Return the finding that a plan, which names some of the tests without a current, lacks others."""
    cells = {cell.casefold() for row in (results.cells if results else ()) for cell in row if not cell.isdigit()}
    absent = [names[0] for names in _called(tests) if not cells & {name.casefold() for name in names}]
    if not 0 < len(absent) < len(tests):
        return None
    text = f"{path.name} names {len(tests) - len(absent)} of {len(tests)} tests and may lack {listed(absent, 3)}"
    return Finding("W_COLUMN", printable(f"{NO_CHANNEL}missing: {text}: if so, add what it lacks"))


def currents_listed(path: Path, tests: Sequence[tuple[Path, Record]]) -> list[tuple[float, str]] | None:
    """Return the current [A] of every test and where it stands, by the only list of currents in a text: 0, 0.5 and 1 A.

    None unless the names of the tests, or of those of each file, count as many, alike in motion, and their forces grow
    as the currents.
    """
    listed = {of for line in (short_lines(path) if path.suffix.lower() in TEXTS else []) if (of := series_in(line))}
    files = [file if len(listed) == 1 and len(tests) > len(min(listed)) else path for file, _ in tests]
    stated: dict[int, float] = {}
    for file in dict.fromkeys(files) if len(listed) == 1 else ():
        own = [i for i, of in enumerate(files) if of == file]
        rows = [Results(min(listed), tuple((f"{n + k}",) for n in range(len(min(listed)))), "", ("",)) for k in (0, 1)]
        by_test = next((of for row in rows if (of := row.by_test([(tests[i][1].id,) for i in own]))), {})
        currents = {own[at]: current for at, current in by_test.items()}
        if len(currents) == len(own) and _grow([(tests[i][1], current) for i, current in currents.items()]):
            stated |= currents
    title = f"{path.name}, a list of as many currents as tests"
    return [(stated[i], title) for i in range(len(tests))] if len(stated) == len(tests) else None


def _grow(stated: Sequence[tuple[Record, float]], repeated: float | None = None) -> bool:
    """Tell if the forces of tests alike in motion grow as the currents [A] that are stated of them.

    All have to be alike, or where the currents of some differ by no more than `repeated`, two of them.
    """
    points = [_point(with_stated_current(record, current, "", "")) for record, current in stated]
    rising = sorted((point for point in points if point), key=lambda point: point[2])
    pairs = list(combinations(rising, 2))
    alike = [(one, other) for one, other in pairs if _are_near(one, other) and other[2] - one[2] > (repeated or 0.0)]
    enough = len(alike) == len(pairs) if repeated is None else bool(alike)
    return len(rising) == len(points) and enough and all(one[3] < other[3] for one, other in alike)


def _with_scale(codes: dict[str, float], words: Collection[str]) -> dict[str, float]:
    """Add the codes of zero, and of decimals in amperes, by others of one scale: I00 by I05 = 0.5 A and I15 = 1.5 A."""
    parted = {code: m for code in {*codes, *words} if (m := re.fullmatch(r"([a-z]+)([0-9]+(?:\.[0-9]+)?)", code))}
    scales: dict[str, list[float]] = defaultdict(list)
    for code, current in codes.items():
        if code in parted and float(parted[code][2]):
            scales[parted[code][1]].append(round(current / float(parted[code][2]), 9))
    more = {}
    for code, match in parted.items():
        number, scale = float(match[2]), scales[match[1]]
        if len({*scale}) == 1 and ((number == 0 and len(scale) > 1) or ("." in code and scale[0] == 1)):
            more[code] = number * scale[0]
    return {**more, **codes}


def _by_scheme(lines: Sequence[str], results: Results | None, files: Sequence[Path]) -> list[float]:
    """Return the current [A] of each file by a scheme of their names, or by the number in it and a table of results.

    Thus <coil current in A>, or <duty %> with a table of the current by the duty; empty unless all files have one.
    """
    stated: set[tuple[float, ...]] = set()
    for parts in (re.split("<([^<>]*)>", m[0].rstrip(".,")) for line in lines for m in _SCHEME.finditer(line)):
        pattern = "".join("([^_]+?)" if i % 2 else re.escape(part) for i, part in enumerate(parts))
        names = [re.fullmatch(pattern, file.stem) or re.fullmatch(pattern, file.name) for file in files]
        for place, texts in zip(parts[1::2], zip(*(m.groups() for m in names if m), strict=True), strict=False):
            header = split_name(place)
            numbers = [amperes(text, "") for text in texts if _SCHEME_NUMBER.fullmatch(text)]
            at = [i for i, key in enumerate(results.keys if results else ()) if header.name and key == header.name]
            rows = zip(results.cells, results.current, strict=True) if results and len(at) == 1 else ()
            by_number = {amperes(m[0], ""): of for cells, of in rows if (m := _SCHEME_NUMBER.match(cells[at[0]]))}
            if header.dimension == "current" and names_condition(header.name, "current"):
                by_number = {number: header.factor * number for number in numbers}
            if len(numbers) == len(files) and {*numbers} <= {*by_number}:
                stated.add(tuple(by_number[number] for number in numbers))
    return [*stated.pop()] if len(stated) == 1 else []


def _meant(key: str, files: Collection[str]) -> list[str]:
    """Return the codes that the key of a legend names, or the file: I1, test01-test04, a.dat."""
    code = _CODE.fullmatch(key)
    if code is None and _DECIMAL_CODE.fullmatch(key.casefold().replace(",", ".")):
        return [key.casefold().replace(",", ".")]
    if code is None:
        return [key.casefold()] if key.casefold() in files else []
    return [f"{code[1].casefold()}{number}" for number in range(int(code[2]), int(code[3] or code[2]) + 1)]


def within_times(tests: Sequence[tuple[Path, Record]], results: Results | None) -> list[tuple[Path, Record]]:
    """Return the tests between the starts and the ends that a table of results states, if it states them."""
    timed = results.rows_in_time([record.time for _, record in tests]) if results else {}
    return [(file, part_of_record(record, timed[i][1]) if timed else record) for i, (file, record) in enumerate(tests)]


def _called(tests: Sequence[tuple[Path, Record]]) -> list[tuple[str, ...]]:
    """Names of each test: its own, that of its file, its own without that of its file, and when it was recorded."""
    stems = [re.sub(r"[^\w.+=-]+", "_", file.stem) for file, _ in tests]
    return [
        (record.id, file.name, file.stem, record.id.removeprefix(stem).lstrip("_"), *_clocks(record, file))
        for (file, record), stem in zip(tests, stems, strict=True)
    ]


def _clocks(record: Record, file: Path) -> set[str]:
    """Return the hour and minute, and with seconds, at which a test was recorded, by its lines or its file's name."""
    stated = map(_STAMP.search, (record.provenance.get("recorded_at", ""), file.stem))
    return {f"{m['hour']}:{m['minute']}{more}" for m in stated if m for more in ("", f":{m['second']}")}


def tests_by(path: Path, results: Results, profile: Profile) -> list[Record]:
    """The tests of a file whose column numbers them as a table of results does; empty if it has no such column."""
    try:
        with raw_tables(path, profile.file) as tables:
            column = results.column_of_tests(tables[0]) if len(tables) == 1 else None
        if column is None:
            return []
        form = profile.file.model_copy(update={"run_column": column})
        records, _ = records_of_file(path, profile.model_copy(update={"file": form}))
        return [r for r in records if not results.is_pause(r.id.removeprefix(path.stem).lstrip("_"))]
    except InputError:
        return []


def is_list(path: Path) -> bool:
    """Tell if a file holds only short tables without a time, or a displacement and a force: a plan, peak values."""

    def short(table: RawTable) -> bool:
        rows = table.words(0).codes.size if table.words is not None else _FEWEST_ROWS
        roles = {header.role for header in table.headers}
        record = "time" in roles or {"displacement", "force"} <= roles
        return any(table.names) and rows < _FEWEST_ROWS and not record

    return ask_tables(path, lambda tables: all(map(short, tables)), False)


def is_helper(path: Path, files: Collection[Path]) -> bool:
    """Tell if a short text is no damaged test: no other file is called alike, or has its first line.

    Nor does a line of it head two of the columns that a record has.
    """
    others = [other for other in files if other != path]
    called = {re.sub("[0-9]+", "0", other.stem) for other in others}
    lines = short_lines(path) if path.suffix.lower() in TEXTS else []
    cells = [[cell.strip() for cell in re.split(r"[,;\t|]", line)] for line in lines]
    roles = [{item_of(cell).role for cell in of if not is_unit(cell)} for of in cells]
    if not others or re.sub("[0-9]+", "0", path.stem) in called or any(len(of & {*REQUIRED}) > 1 for of in roles):
        return False
    words = 0 < len(lines) < _FEWEST_ROWS and re.search(r"[^\W\d_]", lines[0]) is not None
    return words and _first_line(path) not in map(_first_line, others)


def _first_line(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.readline(4096).strip()


def contradictions(records: Sequence[Record]) -> dict[int, QualityError]:
    """Return the tests that contradict each other, by their place, and the refusal of each.

    Equal conditions whose forces differ several-fold; and the same samples under several currents.
    """
    points = {i: point for i, record in enumerate(records) if (point := _point(record)) is not None}
    refused = _copies(records, points)
    groups: dict[tuple[str, int], list[int]] = defaultdict(list)
    for i, point in points.items():
        notes = records[i].provenance
        owner = " ".join((records[i].rig, notes.get("specimen", ""), notes.get("session", "")))
        groups[owner, round(point[2] / _ALIKE_A / 2)].append(i)
    for i, j in chain.from_iterable(combinations(members, 2) for members in groups.values()):
        (*_, current, force), (*_, other_current, other_force) = points[i], points[j]
        near = abs(current - other_current) <= _ALIKE_A and _are_near(points[i], points[j])
        if near and max(force, other_force) > _SEVERAL * min(force, other_force):
            refused.setdefault(i, _refusal(records[i], points[i], records[j], points[j]))
            refused.setdefault(j, _refusal(records[j], points[j], records[i], points[i]))
    return refused


def stated_as_amplitudes(records: Sequence[Record]) -> dict[int, Finding]:
    """Return, by their place, tests of half the amplitude that their name states, where names state no strokes."""
    stated = {i: length for i, record in enumerate(records) if (length := stated_motion(record, "mm")) is not None}
    points = {i: point for i in stated if (point := _point(records[i])) is not None}
    halves = {i for i, point in points.items() if abs(2e3 * point[1] / stated[i] - 1) < _ALIKE}
    agreeing = sum(abs(1e3 * point[1] / stated[i] - 1) < _ALIKE for i, point in points.items())
    if agreeing < _FEWEST_AGREEING * len(halves):
        return {}
    return {
        i: Finding(
            "W_NAME",
            f"the name or heading states {stated[i]:g} mm and the record has an amplitude of {1e3 * points[i][1]:.3g} "
            f"mm, where {agreeing} other tests have what theirs state: check the unit of displacement, or the name",
        )
        for i in halves
    }


def _copies(records: Sequence[Record], points: Mapping[int, _Point]) -> dict[int, QualityError]:
    """Return the tests that hold the samples of another test and have another current than it."""
    refused: dict[int, QualityError] = {}
    for members in _of_same_samples(records):
        currents = {i: points[i][2] for i in members if i in points}
        for i, current in currents.items():
            others = [records[j].id for j, its in currents.items() if abs(its - current) > _ALIKE_A]
            if not others:
                continue
            refused[i] = QualityError(
                f"has the same samples as {others[0]} and another current: {current:.3g} A",
                where=records[i].provenance.get("file", records[i].id),
                remedy="one of them is a copy under a wrong name: leave it out, or export the test again",
                code="E_CONDITIONS",
            )
    return refused


def repeated(records: Sequence[Record]) -> set[int]:
    """Return the tests that hold the samples, the current too, of one of a shorter name or before them: by place."""
    groups = _of_same_samples(records, with_current=True)
    return {i for group in groups for i in sorted(group, key=lambda i: len(records[i].id))[1:]}


def _of_same_samples(records: Sequence[Record], *, with_current: bool = False) -> list[list[int]]:
    """Group the tests whose force and displacement, or current too, differ by rounding at most, by their places."""
    groups: list[list[int]] = []
    peaks = [float(np.nanmax(np.abs(_sampled(record.force, record.time.size)))) for record in records]
    for i, record in enumerate(records):
        near = (group for group in groups if abs(peaks[group[0]] - peaks[i]) <= _ROUNDING * peaks[i])
        own = next((group for group in near if _same(records[group[0]], record, with_current)), None)
        if own is None:
            groups.append([i])
        else:
            own.append(i)
    return groups


def _same(one: Record, other: Record, with_current: bool) -> bool:
    size = min(one.time.size, other.time.size)  # the last row may be cut off

    def alike(a: Floats, b: Floats, limit: float | None = None) -> bool:
        a, b = _sampled(a, size), _sampled(b, size)
        return np.allclose(a, b, rtol=0, atol=limit or _ROUNDING * np.nanmax(np.abs(a)), equal_nan=True)

    same = max(one.time.size, other.time.size) <= size + 1
    same = same and alike(one.force, other.force) and alike(one.displacement, other.displacement)
    currents = (one.current, other.current) if with_current else ()
    return same and (not currents or alike(*currents, limit=_ROUNDING_A))  # type: ignore[arg-type]


def _sampled(channel: Floats, size: int) -> Floats:
    return take(channel, np.arange(0, size, max(1, size // _MOST_SAMPLES)))


def _are_near(one: _Point, other: _Point) -> bool:
    """Tell if two tests are alike in frequency and amplitude."""
    return all(abs(a - b) <= _ALIKE * max(a, b) for a, b in zip(one[:2], other[:2], strict=True))


def _refusal(record: Record, one: _Point, beside: Record, other: _Point) -> QualityError:
    whence = record.provenance.get("current_from", "its channel")
    return QualityError(
        f"at {one[2]:.3g} A (from {whence}), {one[0]:.3g} Hz and {1e3 * one[1]:.3g} mm its force is {one[3]:.4g} N "
        f"from peak to peak, that of {beside.id} at the same condition {other[3]:.4g} N",
        where=record.provenance.get("file", record.id),
        remedy="one of them has another current or another unit of force: state the current of each in tests.csv "
        "(where a name or heading states a wrong one, correct that), or leave one out",
        code="E_CONDITIONS",
    )


def _point(record: Record) -> _Point | None:
    """Frequency [Hz], amplitude [m], current [A] and peak-to-peak force [N] of a record; None without a period."""
    if record.current is None:
        return None
    there = np.flatnonzero(record.present)
    there = there[:: max(1, there.size // _MOST_SAMPLES)]
    time, x, force, current = (take(c, there) for c in (record.time, record.displacement, record.force, record.current))
    if time.size < 20:
        return None
    strokes = find_strokes(time, x)
    mean, change = held_current(current)
    if strokes.period is None or strokes.steady is None or change:
        return None
    inside = slice(*strokes.steady)
    low, high = np.percentile(force[inside], [2, 98])
    return 1 / strokes.period, float(np.ptp(x[inside])) / 2, abs(mean), float(high - low)
