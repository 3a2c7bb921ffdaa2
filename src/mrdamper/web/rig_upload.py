"""Upload of the files of a rig: each is read with a profile, checked, and taken or refused.

One file of a rig may need another profile than the rest (a load cell connected the wrong way
round), so the taken files can be kept while the refused ones are read again.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath

from mrdamper.data import Dataset
from mrdamper.errors import InputError
from mrdamper.rig_files.preview import guess_profile, unset_keys
from mrdamper.rig_files.profile import Profile, parse_profile, profile_text
from mrdamper.rig_files.record import Refusal
from mrdamper.rig_files.rig_import import ImportResult, import_files, to_dataset, with_unique_ids
from mrdamper.rig_files.tests_table import NAME as TESTS
from mrdamper.rig_files.tests_table import StatedTest, TestsTable, load_tests
from mrdamper.web.uploads import AllRefusedError, ImportedData, Upload, Verdict

_MAX_GUESSES = 5  # files searched for the first whose format can be guessed


def read_rig_files(upload: Upload, toml: str, refused_only: bool, only: Path | None = None) -> ImportedData:
    """Read files of an upload with a profile as TOML, empty to guess; raises `AllRefusedError` if all are refused."""
    profile = parse_profile(toml) if toml.strip() else None
    tables = [path for path, name in upload.names.items() if PurePosixPath(name).name == TESTS]
    wanted = [path for path in upload.names if path not in tables and (not refused_only or path in upload.refused)]
    wanted = wanted if only is None else [only]
    table = load_tests(tables[0]) if tables else None
    for path in wanted:
        result = _imported(upload, path, profile, table)
        upload.taken[path], upload.refused[path] = result.records, result.refusals
    upload.taken = {path: records for path, records in upload.taken.items() if records}
    upload.refused = {path: refusals for path, refusals in upload.refused.items() if refusals}
    upload.toml = toml
    verdicts = _verdicts(upload)
    shown = toml if toml.strip() else _guessed_profile(wanted)
    if not upload.taken:
        count = len(upload.refused)
        text = "the file was refused" if count == 1 else f"all {count} files were refused"
        raise AllRefusedError(text, verdicts, shown)
    records = with_unique_ids(record for path in upload.paths_by_name() for record in upload.taken.get(path, ()))
    dataset = to_dataset(records, _dataset_name(upload, len(records)))
    return ImportedData(with_split(dataset, upload.validation), "upload", verdicts, shown)


def with_split(dataset: Dataset, validation: Collection[str] | None) -> Dataset:
    """Return the dataset with other validation runs; unchanged for None."""
    if validation is None:
        return dataset
    return dataset.only([replace(run, split="validate" if run.id in validation else "train") for run in dataset])


def _imported(upload: Upload, path: Path, profile: Profile | None, table: TestsTable | None) -> ImportResult:
    """Read a file with the statements of the uploaded table, and the currents stated on the page."""
    rows = () if table is None else table.of_file(Path(upload.names[path]))
    stated = [StatedTest(0, "", run, current) for (file, run), current in upload.currents.items() if file == path]
    runs = {row.run for row in stated}
    statements = (*stated, *(replace(row, file="") for row in rows if row.run not in runs))
    tests = TestsTable(path.with_name(TESTS), statements) if statements else None
    return import_files([path], profile, tests=tests, other_names=[other.name for other in upload.names])


def _verdicts(upload: Upload) -> tuple[Verdict, ...]:
    refused, taken = [], []
    for path in upload.paths_by_name():
        name = upload.names[path]
        if refusals := upload.refused.get(path):
            tests = {refusal.run for refusal in refusals}
            title = name if len(tests) == 1 else f"{name}, {len(tests)} tests"
            refused.append(Verdict(title, "refused", reasons(upload, path, refusals)))
        if records := upload.taken.get(path):
            findings = tuple((f.code, f.text) for record in records for f in record.findings)
            taken.append(Verdict(name, "noted" if findings else "taken", findings))
    return (*refused, *sorted(taken, key=lambda verdict: verdict.state != "noted"))


def reasons(upload: Upload, path: Path, refusals: Iterable[Refusal]) -> tuple[tuple[str, str], ...]:
    """Return code and text of refusals, each once."""
    return tuple(dict.fromkeys((r.error.code, upload.with_user_names(_reason(r.error, path))) for r in refusals))


def _reason(error: InputError, path: Path) -> str:
    """Return the text of an error without the name of its file, which the page shows beside it."""
    place = error.where.replace(str(path), "").removeprefix(path.name).strip(" :,")
    text = f"{place}: {error.found}" if place else error.found
    return f"{text}; {error.remedy}" if error.remedy else text


def _dataset_name(upload: Upload, count: int) -> str:
    names = [PurePosixPath(name) for name in upload.names.values()]
    tops = {name.parts[0] for name in names if len(name.parts) > 1}
    if len(tops) == 1:
        return tops.pop()
    return names[0].stem if len(names) == 1 else f"{count} dropped tests"


def _guessed_profile(paths: Sequence[Path]) -> str:
    for path in paths[:_MAX_GUESSES]:
        try:
            return profile_text(guess_profile(path), unset_keys(()))
        except InputError:
            continue
    return profile_text(parse_profile(""))
