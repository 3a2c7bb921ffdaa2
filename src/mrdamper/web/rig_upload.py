"""A drop of a rig's own files: each read with its profile, judged, and taken or refused by name.

One file of a rig may need another profile than the rest (a load cell connected the wrong way
round), so what was taken can be kept while the refused ones are read again.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath

from mrdamper.data import Dataset
from mrdamper.errors import InputError
from mrdamper.rig_files.profile import Profile
from mrdamper.rig_files.record import Refusal
from mrdamper.rig_files.rig_import import ImportResult
from mrdamper.rig_files.tests_table import NAME as TESTS
from mrdamper.rig_files.tests_table import StatedTest, TestsTable, load_tests
from mrdamper.web.uploads import ImportedData, NothingTakenError, Upload, Verdict

_PROFILES_TRIED = 5  # files looked at for the first whose form can be guessed


def read_rig_files(upload: Upload, toml: str, refused_only: bool, only: Path | None = None) -> ImportedData:
    """Read the files of a drop, those refused before or one, with a profile as TOML; empty to guess.

    Raises `InputError` if the profile cannot be read, and `NothingTakenError` if every file is refused.
    """
    from mrdamper.rig_files.profile import parse_profile
    from mrdamper.rig_files.rig_import import import_files, to_dataset, with_unique_ids

    profile = parse_profile(toml) if toml.strip() else None
    files = [path for path in upload.names if PurePosixPath(upload.names[path]).name != TESTS]
    wanted = [path for path in files if not refused_only or path in upload.refused]
    wanted = wanted if only is None else [only]
    table = _table_of(upload)
    for path in wanted:
        result = _imported(upload, path, profile, table, import_files)
        upload.taken[path], upload.refused[path] = result.records, result.refusals
    upload.taken = {path: records for path, records in upload.taken.items() if records}
    upload.refused = {path: refusals for path, refusals in upload.refused.items() if refusals}
    upload.toml = toml
    verdicts = _verdicts(upload)
    shown = toml if toml.strip() else _guessed(wanted)
    if not upload.taken:
        count = len(upload.refused)
        text = "the file was refused" if count == 1 else f"all {count} files were refused"
        raise NothingTakenError(text, verdicts, shown)
    records = with_unique_ids(record for path in _by_name(upload) for record in upload.taken.get(path, ()))
    dataset = to_dataset(records, _name(upload, len(records)))
    return ImportedData(split_again(dataset, upload.held_out), "drop", verdicts, shown)


def split_again(dataset: Dataset, held_out: Collection[str] | None) -> Dataset:
    """Return the dataset with those of its runs held out; as it is where nobody chose."""
    if held_out is None:
        return dataset
    runs = [replace(run, split="validate" if run.id in held_out else "train") for run in dataset]
    return dataset.only(runs)


def _table_of(upload: Upload) -> TestsTable | None:
    """Return the table of tests that was dropped beside the files."""
    tables = [path for path, name in upload.names.items() if PurePosixPath(name).name == TESTS]
    return load_tests(tables[0]) if tables else None


def _imported(
    upload: Upload, path: Path, profile: Profile | None, table: TestsTable | None, read: Callable[..., ImportResult]
) -> ImportResult:
    """Read a file with what the dropped table states of its tests, and the currents that the page states for them."""
    rows = () if table is None else table.of_file(Path(upload.names[path]))
    stated = [StatedTest(0, "", run, current) for (file, run), current in upload.currents.items() if file == path]
    if not rows and not stated:
        return read([path], profile)
    runs = {row.run for row in stated}
    statements = (*stated, *(replace(row, file="") for row in rows if row.run not in runs))
    return read([path], profile, tests=TestsTable(path.with_name(TESTS), statements))


def _by_name(upload: Upload) -> list[Path]:
    return sorted(upload.names, key=lambda path: upload.names[path])


def _verdicts(upload: Upload) -> tuple[Verdict, ...]:
    """List the result of every file, refused ones first."""
    refused = [
        Verdict(_named(upload.names[path], refusals), "refused", reasons(upload, path, refusals))
        for path in _by_name(upload)
        if (refusals := upload.refused.get(path))
    ]
    taken = [
        Verdict(upload.names[path], "noted" if findings else "taken", findings)
        for path in _by_name(upload)
        if path in upload.taken
        for findings in (tuple((f.code, f.text) for record in upload.taken[path] for f in record.findings),)
    ]
    return (*refused, *sorted(taken, key=lambda verdict: verdict.state != "noted"))


def _named(name: str, refusals: Sequence[Refusal]) -> str:
    runs = list(dict.fromkeys(refusal.run for refusal in refusals))
    return name if len(runs) == 1 else f"{name}, {len(runs)} tests"


def reasons(upload: Upload, path: Path, refusals: Iterable[Refusal]) -> tuple[tuple[str, str], ...]:
    """Code and text of refusals, each once."""
    return tuple(dict.fromkeys((r.error.code, upload.named(_reason(r.error, path))) for r in refusals))


def _reason(error: InputError, path: Path) -> str:
    """Return the text of an error without the name of its file, which the page shows beside it."""
    place = error.where.replace(str(path), "").removeprefix(path.name).strip(" :,")
    text = f"{place}: {error.found}" if place else error.found
    return f"{text}; {error.remedy}" if error.remedy else text


def _name(upload: Upload, count: int) -> str:
    """Return the name of the data: that of their folder, or of the only file."""
    tops = {PurePosixPath(name).parts[0] for name in upload.names.values() if len(PurePosixPath(name).parts) > 1}
    if len(tops) == 1:
        return tops.pop()
    return PurePosixPath(next(iter(upload.names.values()))).stem if len(upload.names) == 1 else f"{count} dropped tests"


def _guessed(paths: Sequence[Path]) -> str:
    """Return the profile of the first file whose form can be guessed; a bare one where none can."""
    from mrdamper.rig_files.preview import guess_profile
    from mrdamper.rig_files.profile import parse_profile, profile_text

    for path in paths[:_PROFILES_TRIED]:
        try:
            return profile_text(guess_profile(path))
        except InputError:
            continue
    return profile_text(parse_profile(""))
