"""From a rig's files to records and datasets: `read_run`, `import_files`, `to_dataset`."""

from __future__ import annotations

import contextlib
import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from itertools import chain
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from mrdamper.data import Dataset
from mrdamper.data.displayable import Displayable
from mrdamper.data.progress import Progress, silent
from mrdamper.data.temporary import without_temporary_folder
from mrdamper.data.wording import counted
from mrdamper.errors import ColumnError, CombinedError, InputError, is_a, shown, validate_arguments
from mrdamper.rig_files import coil_current
from mrdamper.rig_files.conditions import may_lack_point
from mrdamper.rig_files.file_records import clock_of, files_in, headings_of, records_of_file, unpacked
from mrdamper.rig_files.mapping import plans
from mrdamper.rig_files.mapping.companions import holds_channels, is_helper, is_list, joined_files, number_of, part_of
from mrdamper.rig_files.mapping.comparisons import contradictions, in_another_unit, repeated, stated_as_amplitudes
from mrdamper.rig_files.mapping.description import SHORT_TEXTS, is_description, is_readme, short_lines
from mrdamper.rig_files.mapping.proposals import is_integrated
from mrdamper.rig_files.mapping.result_tables import WITHIN
from mrdamper.rig_files.mapping.results import Results
from mrdamper.rig_files.parts import IDLE
from mrdamper.rig_files.profile import Profile, profile_of
from mrdamper.rig_files.quality import check_long_record
from mrdamper.rig_files.quality.table import to_run
from mrdamper.rig_files.readers import suffixes
from mrdamper.rig_files.readers.base import NoTableError, RigFileError
from mrdamper.rig_files.record import Finding, Record, Refusal, last_parts, unique_names
from mrdamper.rig_files.sequences import clock_goes_on, follows, goes_on, is_next, tests_of_files
from mrdamper.rig_files.tests_table import NAME as TESTS
from mrdamper.rig_files.tests_table import TestsTable, applied, load_tests, names_tests

_Tests = list[tuple[Path, Record]]
_SomeTests = Sequence[tuple[Path, Record]]
_AS_NOTES = "read for what it states of the columns"
_LARGEST_LIST = 2**16  # bytes of a plan of tests that states the current of none that was read
_MAY_BE_PARTS = (
    "E_COLUMN", "E_UNITS_MISSING", "E_UNITS_DIMENSION", "E_AMBIGUOUS", "E_NO_DATA", "E_NUMBER", "E_FIELD_COUNT",
    "E_TRUNCATED", "E_QUOTE",
)  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class ImportResult(Displayable):
    """Result of the import of a set of files."""

    records: tuple[Record, ...]  # accepted, with their findings, in the order of the files
    refusals: tuple[Refusal, ...] = ()
    left_out: tuple[str, ...] = ()  # files of the folders that are no rig's: of other kinds, or texts without a table
    reasons: Mapping[str, str] = field(default_factory=dict)  # by those of them that were read, why they are no tests

    @property
    def headline(self) -> str:
        """Numbers of accepted and refused tests."""
        return f"import: tests accepted: {len(self.records)}, refused: {len(self.refusals)}"

    @property
    def details(self) -> list[str]:
        """The refusals."""
        return [f"refused: {refusal.error}" for refusal in self.refusals]

    @property
    def table(self) -> dict[str, list[Any]]:
        """The accepted tests."""
        return {
            "run_id": [record.id for record in self.records],
            "samples": [record.time.size for record in self.records],
            "findings": [" ".join(finding.code for finding in record.findings) for record in self.records],
        }


def read_run(path: str | Path, profile: Profile | str | Path | None = None) -> Record:
    """Read one test from a rig's file and check it: SI channels, NaN where a sample is missing, with findings.

    Its current is None where neither file, name nor profile states one. Raises `InputError` with a stable code, the
    file, the line and column where there is one, and the remedy.
    """
    records = read_runs(path, profile)
    if len(records) != 1:
        remedy = 'use read_runs, or set blocks = "join" under [file] of a profile'
        raise RigFileError("E_BLOCKS", f"holds {len(records)} tests", file=Path(path).name, remedy=remedy)
    return records[0]


def read_runs(path: str | Path, profile: Profile | str | Path | None = None) -> tuple[Record, ...]:
    """Read every test of a rig's file and check it: testing machines record several blocks; as `read_run`."""
    with np.errstate(all="ignore"):  # numbers near the end of the range overflow in sums and are refused as such
        records, problems = records_of_file(Path(path), profile_of(profile))
        CombinedError.raise_from([*problems, *(record.doubt for record in records if record.doubt)])
        return tuple(check_long_record(record) for record in records)


@validate_arguments("paths")
def import_files(
    paths: str | Path | Iterable[str | Path],
    profile: Profile | str | Path | None = None,
    *,
    tests: str | Path | TestsTable | None = None,
    other_names: Collection[str] = (),
    progress: Progress = silent,
) -> ImportResult:
    """Read and check files and folders of files; a refused file or test does not stop the others.

    Parameters
    ----------
    paths : path or iterable of path
        Of a folder, every file with a suffix of a known format is read, in the order of names.
    profile : Profile or path, optional
        For all of them.
    tests : TestsTable or path, optional
        Table of tests; default: `tests.csv` of the folder, also that of single files.
    other_names : collection of str
        Names of further files of these tests, which are not read: they show which digits of a name are its current.
    progress : callable
        Is told the file and the share done.

    Raises
    ------
    InputError
        If the profile or the table of tests cannot be read, or a folder holds no rig's file; E_ARGUMENT if `paths`
        are no paths.

    Examples
    --------
    >>> import numpy as np
    >>> from mrdamper import import_files
    >>> t = np.arange(0.0, 4.0, 0.002)
    >>> table = np.column_stack([t, 10 * np.sin(2 * np.pi * t), 400 * np.cos(2 * np.pi * t)])
    >>> np.savetxt("test_0.5A.csv", table, delimiter=",", header="time_s,displacement_mm,force_N", comments="")
    >>> [record.id for record in import_files(["test_0.5A.csv"]).records]
    ['test_0.5A']
    """
    profile = profile_of(profile)
    several = [paths] if isinstance(paths, (str, Path)) else [*paths] if is_a(paths, Iterable) else []
    if not several or not all(is_a(path, (str, Path)) for path in several):
        raise InputError(f"paths is {shown(paths)}", remedy="give it as a path or several", code="E_ARGUMENT")
    with unpacked(several) as given:
        folders = dict.fromkeys(path if path.is_dir() else path.parent for path in given)
        beside = [folder / TESTS for folder in folders if (folder / TESTS).is_file()]
        files, left_out = files_in(given)
        stems = [path.stem for path in files]
        lists = [path for path in beside if not names_tests(path, stems)]  # a laboratory's own, under the same name
        tests = next((path for path in beside if path not in lists), None) if tests is None else tests
        table = tests if tests is None or isinstance(tests, TestsTable) else load_tests(tests)
        texts = [*lists, *(path for path in left_out if path.suffix.lower() in SHORT_TEXTS)]
        left_out += [*lists, *(path for path in files if profile.leaves_out(*path.parts))]
        files, texts = ([path for path in of if not profile.leaves_out(*path.parts)] for of in (files, texts))
        intake = _Intake(profile, table, (path.name for path in files))
        for number, path in enumerate(files):
            progress(path.name, number / len(files))
            intake.read(path, given=path in given)
        used = intake.join(texts, other_names)
        left_out = [path for path in left_out if path not in used]
        if table is not None and (table.path not in beside or table.path.parent in given):  # else some of its tests
            unread = [Path(refusal.file) for refusal in intake.refusals if not refusal.run]
            table.require_found(intake.met, unread)
        profile.require_matches([*intake.met, *((path, "") for path in files)])
        refusals = intake.refusals or ([] if intake.tests() else intake.notes)
        named = tuple(replace(refusal, file=without_temporary_folder(refusal.file)) for refusal in refusals)
        left_out += [] if refusals is intake.notes else dict.fromkeys(Path(note.file) for note in intake.notes)
        left_out += intake.omitted
        names = last_parts(path.parts for path in left_out)
        why = {path: _AS_NOTES for path in left_out if is_readme(path) and not profile.leaves_out(*path.parts)}
        why |= intake.omitted | {Path(note.file): intake.reason(note) for note in intake.notes}
        reasons = {names[path.parts]: text for path, text in why.items() if text and path.parts in names}
        left_out_names = tuple(names[path.parts] for path in left_out)
        return ImportResult(with_unique_ids(_with_folders(intake.tests())), named, left_out_names, reasons)


class _Intake:
    """The tests of a set of files: checked, refused, or still without a current that another file may state."""

    def __init__(self, profile: Profile, table: TestsTable | None, names: Iterable[str]):
        self._profile, self._table, self._names = profile, table, [*names]  # of all files
        self._order: dict[Path, int] = {}
        self._parts: list[tuple[Path, list[Record]]] = []  # the last file and those that it continues, with their tests
        self._pending: list[tuple[Path, Record]] = []
        self._found: list[tuple[Path, Record]] = []
        self.unchecked: list[tuple[Path, Record]] = []  # every test, also those refused
        self.disputed: dict[tuple[Path, str], InputError] = {}  # by file and test: currents, remarks
        self.refusals: list[Refusal] = []
        self.notes: list[Refusal] = []  # texts of a folder that hold no table
        self.omitted: dict[Path, str] = {}  # tests that the profile leaves out, files of those that repeat another: why
        self.met: list[tuple[Path, str]] = []
        self._given: set[Path] = set()
        self._shares: dict[Path, tuple[str, Profile]] = {}  # files of some channels each, by the profile
        self._results = cache(plans.results_of)  # the table of results that a file holds
        self._plans: list[Path] = []  # which gave tests their current
        self._awaited: set[Path] = set()  # plans of the tests of files that lack columns
        self._folders: list[Path] = []  # of tests with a plan of their own each, where every test lies in one of them

    def read(self, path: Path, *, given: bool) -> None:
        """Read a file, and check the tests in it whose current is known."""
        self._order[path] = len(self._order)
        self._given |= {path} if given else set()
        run, profile = self._profile.of_file(path)
        if run:
            self._shares[path] = run, profile
            return
        records, refusals = _unchecked(path, profile)
        if refusals and self._parts and is_next(self._parts[-1][0], path):
            records, refusals = self._without_heading(path, profile) or (records, refusals)
            if refusals and clock_goes_on(self._parts[-1][1][-1].time, clock_of(path, profile)):
                self._refuse_parts(path, refusals[0].error)
        self.met += [] if records else [(path, "")]
        no_table = not records and not given and [type(refusal.error) for refusal in refusals] == [NoTableError]
        no_table |= not records and not given and is_readme(path) and not holds_channels(path, profile.file)
        (self.notes if no_table else self.refusals).extend(refusals)
        split = profile.file.blocks == "split" or (self._table and self._table.of_file(path))
        whole = refusals or split or not goes_on(records)
        if whole or not (self._parts and follows(*self._parts[-1], path, records)):
            self._take_parts()
        self._parts.append((path, records))
        if whole:
            self._take_parts()

    def _refuse_parts(self, path: Path, error: InputError) -> None:
        """Refuse the parts of a record that goes on in a file which cannot be used: they are no whole test."""
        problem = f"goes on in {path.name}, which cannot be used: {error.found}"
        parts = [part for part, _ in self._parts]
        torn = {part: RigFileError(error.code, problem, file=part.name, remedy=error.remedy) for part in parts}
        self.refusals += [Refusal(str(part), why) for part, why in torn.items()]
        self.met += [(part, "") for part in parts]
        self._parts = []

    def _without_heading(self, path: Path, profile: Profile) -> tuple[list[Record], list[Refusal]] | None:
        """Return the tests of a part of a record of which the first names the columns; None if it does not go on."""
        names = [f"{header.name} [{header.unit}]" for _, header in headings_of(self._parts[0][0], profile).values()]
        form = profile.file.model_copy(update={"names": tuple(names)})
        records, refusals = _unchecked(path, profile.model_copy(update={"file": form}))
        return (records, []) if records and not refusals and follows(*self._parts[-1], path, records) else None

    def _take_parts(self) -> None:
        """Take the tests of the last file, or those of the files that are parts of one record."""
        parts, self._parts = self._parts, []
        if len(parts) > 1:
            self.met += [(path, record.id) for path, records in parts for record in records]
            parts = [(parts[0][0], tests_of_files(parts))]
        for path, records in parts:
            self._take(path, records)

    def _take(self, path: Path, records: list[Record]) -> None:
        """Check tests with what the table of tests says of them, or keep them until another file states the current."""
        runs = {row.run for row in (self._table.of_file(path) if self._table else ()) if row.file}
        as_listed = runs <= {"", *(record.id for record in records)}  # else by the numbers of a plan of tests
        idle = [r for r in records if len(records) > 1 and IDLE.search(r.id) and plans.rests(r)]
        self.omitted |= {Path(record.id): "it rests" for record in idle}
        records = [record for record in records if record not in idle] or records
        for record in self._without_doubtful_points(path, records):
            self.met += [(path, record.id)] * as_listed
            record = applied(record, path, self._table) if as_listed else record
            if record.current is None or record.doubt:
                self._pending.append((path, record))
            else:
                self._check(path, record, several=len(records) > 1)

    def _check(self, path: Path, record: Record, *, several: bool) -> None:
        """Check a test that the profile does not leave out: only here, as plans count those that it does."""
        if self._profile.leaves_out(*path.parts, record.id):
            self.omitted[Path(record.id)] = "omitted by the profile"
            return
        self.unchecked.append((path, record))
        checked, problems = record, list[InputError]()
        steps = (partial(coil_current.require_current, path=path), check_long_record)
        for step in steps if record.doubt is None else steps[:1]:
            try:
                with np.errstate(all="ignore"):
                    checked = step(checked)
            except InputError as error:
                problems.append(error)
        where = f"{path}: {record.id}" if several else str(path)
        self.refusals += [Refusal(where, problem, record.id) for problem in problems]
        if not problems:
            self._found.append((path, checked))

    def join(self, texts: Sequence[Path], other_names: Collection[str] = ()) -> set[Path]:
        """Join tests with what other files and texts state, check and compare them; return the files that were used."""
        self._take_parts()
        others = [Path(refusal.file) for refusal in self.refusals if refusal.error.code in _MAY_BE_PARTS]
        others = [path for path in dict.fromkeys(others) if path.is_file()]
        self._folders = self._folders_with_plans((*others, *(Path(note.file) for note in self.notes), *texts))
        used = self._join_channels(others, texts)
        counts = Counter(path for path, _ in self._pending)
        names = {*other_names, *(name for path, run in self.met for name in (*path.parts, run))}
        met = {*self.met}
        for path, record in self._pending:
            if (path, record.id) not in met:
                self.met.append((path, record.id))
                record = applied(record, path, self._table)
            record = coil_current.with_current_behind_label(record, path, names)
            self._check(path, record, several=counts[path] > 1)
        whence = {file: record.provenance.get("current_from", "") for file, record in self._found}
        notes = [Path(note.file) for note in self.notes]
        every = dict.fromkeys((*others, *notes, *texts, *self._plans))
        unused = [path for path in every if path not in used - {*self._plans}]
        for path in [path for path in unused if self._found or path.stat().st_size <= _LARGEST_LIST]:
            if self._compare(path, self._results(path)):
                self._drop_refusals({path})
            elif path in others and path not in self._given and self._is_beside_tests(path):
                self.notes += [refusal for refusal in self.refusals if Path(refusal.file) == path][:1]
                self._drop_refusals({path})
        for path in [path for path, of in whence.items() if of.startswith(WITHIN)]:
            self._compare(path, plans.results_of(path))
        if self._table and (windows := plans.remarks_of(self._table.path)):
            tests = self.tests()
            self._cut(self._table.path, windows, [tests[i] for i in plans.named_tests(windows, tests)])
        tests = self.tests()
        again = repeated([record for _, record in tests])
        self.omitted |= {path: "the same samples as another" for i, (path, _) in enumerate(tests) if i in again}
        self._found = [test for i, test in enumerate(tests) if i not in again]
        self._refuse(contradictions([record for _, record in self.tests()]))
        records = [record for _, record in self.tests()]
        for i, finding in (*stated_as_amplitudes(records).items(), *in_another_unit(records).items()):
            self._exchange(records[i], records[i].noticed(finding))
        self._await_columns(every)
        return used

    def reason(self, note: Refusal) -> str:
        """Tell why a file of the folder is no test and, where it lists currents, why they were not used."""
        path = Path(note.file)
        results = self._results(path)
        if results is None:
            return _AS_NOTES if is_readme(path) or is_description(path) else note.error.found
        if path in self._awaited:
            return f"currents under {results.title!r}, used once the columns are known"
        keys = ", ".join(filter(None, results.keys))
        missing = [refusal for refusal in self.refusals if refusal.error.code == "E_CURRENT_MISSING"]
        counts = f"{counted(len(results.cells), 'row')} for {counted(len(missing), 'test')}, "
        counts *= len(results.cells) != len(missing)
        why = f": {counts}no column beside it names every test ({keys or 'none'})" if missing else ""
        return f"currents under {results.title!r}, not used{why}"

    def _await_columns(self, paths: Iterable[Path]) -> None:
        """Ask for no currents beside columns, where the table of a file names every file that lacks these."""
        asked = {Path(r.file): r.error for r in self.refusals if coil_current.CURRENT_TOO in r.error.remedy}
        stated = ((path, self._results(path)) for path in (paths if asked else ()))
        self._awaited = {path for path, results in stated if results and plans.names_files(results, [*asked])}
        for error in asked.values() if self._awaited else ():
            error.remedy = error.remedy.partition(f"; {coil_current.CURRENT_TOO}")[0]

    def _is_beside_tests(self, path: Path) -> bool:
        alone = [other.suffix for other in self._order].count(path.suffix) == 1 < len(self._order)
        script = alone and path.suffix[1:].isalpha() and path.suffix.lower() not in suffixes()  # calibrate.tcl
        plan = self._results(path)
        listed = plan is not None and plans.misfit_of_plan(path, plan, [(p, r) for p, r in self.unchecked]) is not None
        return script or listed or is_list(path) or is_description(path) or is_helper(path, self._order)

    def _compare(self, path: Path, results: Results | None) -> bool:
        """Refuse accepted tests that contradict a plan, in its own file those of that, or that a remark in it discards.

        Tell if it states currents of tests that move as it says.
        """
        tests = [(i, test) for i, test in enumerate(self.tests()) if test[0] == path] or [*enumerate(self.tests())]
        if path.parent in self._folders:
            tests = [(i, test) for i, test in tests if path.parent in test[0].parents]
        own, remarks = [test for _, test in tests], results or plans.remarks_of(path)
        if plans.currents_beside(path, remarks, own) is None:  # of some tests, by their names
            tests = [tests[i] for i in plans.named_tests(remarks, own)]
            own = [test for _, test in tests]
        for kind in ("specimen", "rig"):
            for (_, record), label in zip(own, plans.labels_of(path, remarks, own, kind), strict=False):
                text = coil_current.as_data(label)
                notes = {"specimen": text, **record.provenance} if kind == "specimen" else record.provenance
                self._exchange(record, replace(record, rig=record.rig or text * (kind == "rig"), provenance=notes))
            own = [self.tests()[i] for i, _ in tests]
        stated, other = plans.currents_beside(path, results, own), plans.other_motions(path, results, own)
        answers = [self._table.path.name] if self._table else []
        refused = self._unanswered(own, plans.discarded_tests(path, remarks, own), answers)
        own = [self.tests()[i] for i, _ in tests]
        if other is not None:
            refused = dict.fromkeys(range(len(own)), other) if own[0][0] == path else {}
        answers += ["profile"] if other else []
        near = dict[int, InputError]()
        for i, ((file, record), (current, whence)) in enumerate(zip(own, stated or (), strict=False)):
            differs: InputError | None = coil_current.other_statement(record, current, whence, file.name)
            far = False
            try:
                coil_current.with_stated_current(record, current, whence, file.name)
            except InputError as error:
                differs, far = error, True
            unanswered = self._unanswered({i: (file, record)}, {i: differs}, answers) if differs else {}
            near |= unanswered
            refused |= unanswered if far else {}
        if any(error.code == "E_CURRENT_CONTRADICTS" for error in refused.values()):
            refused = near | refused  # a plan of another version
        for i in {*near} - {*refused}:
            text = f"of two statements the first is taken: {near[i].found}"
            self._exchange(own[i][1], own[i][1].noticed(Finding("W_CHOSEN", text)))
        self._refuse({tests[i][0]: error for i, error in refused.items()})
        if path not in self._plans:
            self._cut(path, remarks, [test for i, test in enumerate(own) if i not in refused])
        return bool(stated) and other is None

    def _unanswered(
        self,
        tests: Mapping[int, tuple[Path, Record]] | _SomeTests,
        refused: Mapping[int, InputError],
        answers: list[str],
    ) -> dict[int, InputError]:
        """Return the refusals of tests but of those that have their current by an answer, which is noted with them."""
        unanswered = dict[int, InputError]()
        for i, error in refused.items():
            file, record = tests[i]
            if (answer := record.provenance.get("current_from", "")) in answers:
                self._exchange(record, record.noticed(Finding("W_CHOSEN", f"{answer} decides: {error.found}")))
                continue
            unanswered[i] = error
            self.disputed[file, record.id] = error
        return unanswered

    def _exchange(self, record: Record, other: Record) -> None:
        self._found = [(path, other if own is record else own) for path, own in self._found]

    def _cut(self, path: Path, results: Results | None, tests: _Tests) -> None:
        """Check tests again that a plan gives a start and an end, cut to these."""
        whole = [next(of for of in self.unchecked if (of[0], of[1].id) == (p, r.id)) for p, r in tests]
        for i, part in plans.cut_to_windows(path, results, whole).items():
            self.unchecked.remove(whole[i])
            self._found = [of for of in self._found if (of[0], of[1].id) != (whole[i][0], part.id)]
            self._check(whole[i][0], part, several=True)

    def _join_channels(self, others: list[Path], texts: Sequence[Path]) -> set[Path]:
        """Join channels of several files, and currents that other files state; the files that were used."""
        refused: list[Path] = []
        parts = [part_of(path, self._profile.of_file(path)[1]) for path in others if not self._lists_tests(path)]
        for path, (run, own) in self._shares.items():
            try:
                parts.append(part_of(path, own, run))
            except InputError as error:
                refused.append(path)
                self.refusals.append(Refusal(str(path), error))
        wanted = {part.key: part.table.names for part in parts if part is not None}
        whole = [path for path, _ in self._pending if number_of(path) in wanted]
        whole += [  # the displacement that is measured is surer than the integral
            path for path, record in self.tests()
            if is_integrated(record) and "displacement" in wanted.get(number_of(path), ())
        ]  # fmt: skip
        parts += [part_of(path, self._profile.of_file(path)[1]) for path in dict.fromkeys(whole)]
        used = {*refused}
        for group, records in joined_files([part for part in parts if part is not None], self._profile):
            paths = {part.path for part in group}
            used |= paths
            self._drop_refusals(paths)
            self._pending = [(path, record) for path, record in self._pending if path not in paths]
            self._found = [(path, record) for path, record in self._found if path not in paths]
            self.unchecked = [(path, record) for path, record in self.unchecked if path not in paths]
            if isinstance(records, InputError):
                self.refusals.append(Refusal(str(group[0].path), records))
            else:
                self._take(group[0].path, records)
        for path in [path for path in self._shares if path not in used]:
            problem = f"no other file of test {self._shares[path][0]!r} has the rest of its channels on the same clock"
            remedy = 'set file = "...{run}..." for each of displacement and force with a file of its own, or correct it'
            self.refusals.append(Refusal(str(path), ColumnError(problem, where=path.name, remedy=remedy)))
        doubtful = [test for test in self._pending if test[1].doubt and "current_from" not in test[1].provenance]
        self._pending = [test for test in self._pending if test not in doubtful]
        notes = [Path(note.file) for note in self.notes]
        paths = [path for path in (*others, *notes, *texts) if self._pending and path not in used]
        pending, joined = self._pending, list[tuple[Path, Record]]()
        for folder in self._folders or [None]:
            own = [path for path in paths if folder in (None, path.parent) or path.parent not in self._folders]
            self._pending = [test for test in pending if folder is None or folder in test[0].parents]
            used |= self._join_currents(sorted(own, key=lambda path, folder=folder: path.parent != folder))
            joined += self._pending
        self._pending = joined
        open_tests = [test for test in self._pending if test[1].current is None]
        gaps = tuple(filter(None, (plans.misfit_of_plan(path, self._results(path), open_tests) for path in paths)))
        self._pending = [(path, r.noticed(*gaps) if r.current is None else r) for path, r in self._pending] + doubtful
        return used

    def _lists_tests(self, path: Path) -> bool:
        """Tell if a table has a row for each test that a column of a record beside it names: it is no logger."""
        results = self._results(path)
        files = dict.fromkeys(file for file, _ in self._pending if number_of(file) == number_of(path))
        return any(plans.tests_by(file, results, self._profile.of_file(file)[1]) for file in files if results)

    def _folders_with_plans(self, paths: Sequence[Path]) -> list[Path]:
        """Return the folders that hold a plan each, of days or dampers, where every test lies in one of them."""
        files = {path for path, _ in (*self._pending, *self._found)}
        folders = dict.fromkeys(path.parent for path in paths if any(path.parent in file.parents for file in files))
        plans_of = [folder for folder in folders if any(p.parent == folder and self._results(p) for p in paths)]
        once = all(sum(folder in file.parents for folder in plans_of) == 1 for file in files)
        return plans_of if len(plans_of) > 1 and once else []

    def _join_currents(self, paths: Sequence[Path]) -> set[Path]:
        """Give the tests without a current those that one of some files states; the file that was used.

        A list or a supply's current counts only where no table or legend states the coil's, and no other such file
        states others.
        """
        candidates: list[tuple[Path, Results | None, _Tests, _Tests, _SomeTests, list[tuple[float, str]]]] = []
        own = ((path, self._results(path)) for path in paths)
        linked = (
            (path, joined) for path in paths if (results := self._results(path)) for other in paths
            if other != path and (joined := results.joined(short_lines(other)))
        )  # fmt: skip
        for path, results in chain(own, linked):
            every = self._numbered(results) if results else self._pending
            open_tests = [t for t in every if results and results.lacks_current(t[0], t[1].id)]
            cut = [test for test in every if any(finding.code == "W_CUT" for finding in test[1].findings)]
            if results and cut and len({file for file, _ in every}) == 1 and not results.ranges[1]:
                moving = [test for test in cut if test in open_tests and not plans.rests(test[1])]
                if moving or len(results.cells) > len(every):
                    continue  # its rows count the rests between the tests, too
            tests = plans.within_ranges([test for test in every if test not in open_tests], results)
            stated = plans.currents_beside(path, results, tests)
            if stated and not (results and results.of_supply):
                candidates = [(path, results, every, open_tests, tests, stated)]
                break
            stated = stated or plans.currents_listed(path, tests)
            candidates += [(path, results, every, open_tests, tests, stated)] if stated else []
        if len({tuple(current for current, _ in stated) for *_, stated in candidates}) != 1:
            return set()
        path, results, every, self._pending, tests, stated = candidates[0]
        other = plans.other_motions(path, results, tests)
        refused = dict.fromkeys(range(len(tests)), other) if other else plans.discarded_tests(path, results, tests)
        self._pending = [test for test in self._pending if not plans.rests(test[1])]  # a reading of zero
        self.met += [(file, record.id) for file, record in (*every, *tests)]
        ids = {name for _, r in (*tests, *self._pending) for name in (r.id, re.sub("_[0-9]+$", "", r.id))}
        why = f"in no range of {path.name}" if results and results.ranges[1] else "it rests"
        self.omitted |= {Path(record.id): why for _, record in every if record.id not in ids}
        windows = plans.cut_to_windows(path, results, tests)
        tests = [(file, windows.get(i, record)) for i, (file, record) in enumerate(tests)]
        for i, ((file, record), (current, whence)) in enumerate(zip(tests, stated, strict=True)):
            with contextlib.suppress(InputError):  # its doubt stays
                note = f"its current is the {current:g} A of {whence}"
                record = coil_current.with_stated_current(record, current, whence, file.name, note)
            self._pending.append((file, replace(record, doubt=refused.get(i, record.doubt))))
        self._plans.append(path)
        self.notes = [note for note in self.notes if Path(note.file) != path]
        self._drop_refusals({path})
        return {path}

    def _drop_refusals(self, paths: Collection[Path]) -> None:
        self.refusals = [refusal for refusal in self.refusals if Path(refusal.file) not in paths]

    def _numbered(self, results: Results) -> list[tuple[Path, Record]]:
        """Return the tests without a current, apart for those of a file that a column numbers as results do."""
        tests: list[tuple[Path, Record]] = []
        for path in dict.fromkeys(path for path, _ in self._pending):
            numbered = plans.tests_by(path, results, self._profile.of_file(path)[1])
            own = [test for test in self._pending if test[0] == path]
            tests += [(path, applied(test, path, self._table)) for test in numbered] or own
        return tests

    def _without_doubtful_points(self, path: Path, records: list[Record]) -> list[Record]:
        """Return tests without a current that a name states in two digits, where its decimal point may be missing."""
        names = [*self._names, *(record.id for record in records)]
        problem = "a current of two digits, beside names such as 05A: is the decimal point missing?"
        remedy = "write the currents into tests.csv (--write-tests)"
        doubt = ColumnError(problem, where=path.name, remedy=remedy, code="E_AMBIGUOUS")
        named = [r for r in records if r.provenance.get("current_from", "").startswith(coil_current.OF_NAME)]
        doubtful = [r.id for r in named if may_lack_point(path.name, names) or may_lack_point(r.id, names)]
        return [replace(r, current=None, doubt=r.doubt or doubt) if r.id in doubtful else r for r in records]

    def tests(self) -> list[tuple[Path, Record]]:
        """The accepted tests with their files, in the order of these."""
        return self.in_order(self._found)

    def in_order(self, tests: Sequence[tuple[Path, Record]]) -> list[tuple[Path, Record]]:
        """Return tests in the order of their files."""
        return sorted(tests, key=lambda entry: self._order[entry[0]])

    def _refuse(self, errors: Mapping[int, InputError]) -> None:
        tests = self.tests()
        self.refusals += [Refusal(str(tests[i][0]), error, tests[i][1].id) for i, error in errors.items()]
        self._found = [test for i, test in enumerate(tests) if i not in errors]


def _unchecked(path: Path, profile: Profile) -> tuple[list[Record], list[Refusal]]:
    """Return the tests of a file before they are checked, and why others of it, or the whole file, cannot be read."""
    try:
        with np.errstate(all="ignore"):  # numbers near the end of the range overflow in sums and are refused as such
            records, problems = records_of_file(path, profile)
    except InputError as error:
        records, problems = [], getattr(error, "errors", (error,))
    return records, [Refusal(str(path), problem) for problem in problems]


def found_tests(
    paths: Iterable[str | Path], profile: Profile | str | Path | None = None
) -> tuple[tuple[Record, ...], tuple[Refusal, ...]]:
    """Every test that files hold, with the currents that other files state, and the files that cannot be read.

    The tests are not yet checked: they are those of a table that is to be completed.
    """
    with unpacked(paths) as given:
        files, others = files_in(given)
        files = [path for path in files if not profile_of(profile).leaves_out(path.name)]
        intake = _Intake(profile_of(profile), None, (path.name for path in files))
        for path in files:
            intake.read(path, given=path in given)
        intake.join([path for path in others if path.suffix.lower() in SHORT_TEXTS])
        refusals = [refusal for refusal in intake.refusals if not refusal.run]
        tests = intake.in_order(intake.unchecked)
        tests = [(path, replace(r, doubt=intake.disputed.get((path, r.id), r.doubt))) for path, r in tests]
    return tuple(_with_folders(tests)), tuple(refusals)


def _with_folders(tests: Sequence[tuple[Path, Record]]) -> list[Record]:
    """Return records whose file is told with its folders, where files of several folders have one name."""
    names = last_parts(path.parts for path, _ in tests)
    files = [coil_current.as_data(names[path.parts]) if names[path.parts] != path.name else "" for path, _ in tests]
    both = zip(files, (record for _, record in tests), strict=True)
    return [replace(r, provenance={**r.provenance, "file": file}) if file else r for file, r in both]


def to_dataset(records: Sequence[Record], name: str = "dataset") -> Dataset:
    """Return the runs of checked records, with their provenance as notes.

    Raises `InputError` if a record has no current, or there is no record.
    """
    return Dataset(tuple(to_run(coil_current.require_current(record)) for record in records), name)


def with_unique_ids(records: Iterable[Record]) -> tuple[Record, ...]:
    """Return records told apart by their names: files of different folders may share one, and have those of these."""
    records = tuple(records)
    counts = Counter(record.id for record in records)
    paths = (PurePosixPath(record.provenance.get("file", "")).parent / record.id for record in records)
    longer = [re.sub(r"[^\w.+=-]+", "_", str(path)).lstrip("_=+-.") for path in paths]
    own = (long if counts[record.id] > 1 else record.id for long, record in zip(longer, records, strict=True))
    names = unique_names(own)
    return tuple(r if r.id == name else replace(r, id=name) for r, name in zip(records, names, strict=True))
