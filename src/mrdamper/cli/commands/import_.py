"""`mrdamper import`: conversion of test-rig files to a dataset."""

from __future__ import annotations

import json
import os
import re
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from mrdamper.cli.output import finding_lines, put_text, shortened, warn
from mrdamper.cli.progress import progress_on_stderr
from mrdamper.errors import InputError, OutputError, listed

if TYPE_CHECKING:
    from mrdamper.rig_files.profile import Profile
    from mrdamper.rig_files.record import Record, Refusal
    from mrdamper.rig_files.rig_import import ImportResult

_OF_FORM = ("W_NO_EOL", "W_FOOTER", "W_ENCODING")  # codes of notes that change nothing
_MOST_QUESTIONS = 12  # of one import

app = typer.Typer()


@app.command(
    "import",
    epilog="Example: mrdamper import tests/*.csv --profile rig.toml --out DATASET; "
    "mrdamper import tests/a.csv --write-profile rig.toml; mrdamper import tests --write-tests tests/tests.csv",
)
def import_(
    files: list[Path] = typer.Argument(..., help="Test-rig files, or folders of them."),
    out: Path | None = typer.Option(None, help="Dataset folder to write."),
    add: bool = typer.Option(False, "--add", help="Add to the dataset there instead of writing a new one."),
    profile: Path | None = typer.Option(None, help="Rig profile (TOML): columns and units (mrdamper init profile)."),
    tests: Path | None = typer.Option(
        None, help="Table of tests: current, split, session of each; default: tests.csv of the folder."
    ),
    write_profile: Path | None = typer.Option(
        None, help="Write how the first refused file, or the first file, was read as a profile; - for standard output."
    ),
    write_tests: Path | None = typer.Option(
        None, help="Write the tests found as a table to be completed; - for standard output."
    ),
    skip_refused: bool = typer.Option(False, "--skip-refused", help="Write the accepted files, list the refused ones."),
    ask: bool | None = typer.Option(
        None, "--ask/--no-ask", help="Ask for information missing in the files; default: on a terminal."
    ),
    verbose: bool = typer.Option(False, "--verbose", help="Print every test and all findings."),
    quiet: bool = typer.Option(False, "--quiet", help="No progress."),
    as_json: bool = typer.Option(False, "--json", help="Print JSON a program can read."),
) -> None:
    """Read test-rig files, check every test and write a dataset.

    Without --skip-refused nothing is written if one test is refused.
    """
    from mrdamper.rig_files.profile import Profile, load_profile
    from mrdamper.rig_files.rig_import import import_files

    _refuse_taken(out, add)
    settings = load_profile(profile) if profile is not None else Profile()
    if write_profile is not None:
        _write_profile(files, settings, write_profile)
    if write_tests is not None:
        _write_tests(files, settings, write_tests)
    dry = out is None
    if dry and (write_profile is not None or write_tests is not None):
        return
    if dry and not as_json:
        from mrdamper.rig_files.preview import tree_lines

        print("\n  ".join(["In the files:", *tree_lines(files, settings)]))
    with progress_on_stderr(quiet or as_json) as progress:
        result = import_files(files, settings, tests=tests, progress=progress)
        on_terminal = sys.stdin is not None and sys.stdin.isatty() and sys.stdout.isatty()
        if (on_terminal if ask is None else ask) and not as_json:
            settings, result = _asked(files, settings, result, tests)
    wrong = bool(result.refusals) and not skip_refused
    written = bool(result.records) and not wrong and out is not None
    total, new = _write_dataset(result, settings, out, add) if written and out is not None else (0, 0)
    if as_json:
        print(json.dumps(_summary(result, out if written else None), indent=1, ensure_ascii=False))
    else:
        _print(result, out if written else None, total, new, profile=profile, dry=dry, verbose=verbose)
    if not result.records or (wrong and not dry):
        raise typer.Exit(2)


def _refuse_taken(out: Path | None, add: bool) -> None:
    from mrdamper.data.atomic import require_free, require_writable

    if out is None:
        return
    if add and not (out / "runs.csv").is_file():
        raise OutputError("no dataset to add to", where=str(out), remedy="leave --add out to write a new one")
    if not add:
        require_free(out, hint=", or add to it with --add" if (out / "runs.csv").is_file() else "")
    require_writable(out)


def _write_tests(files: list[Path], settings: Profile, target: Path) -> None:
    """Every test that can be read, also those whose current is not known yet."""
    from mrdamper.data.wording import counted
    from mrdamper.rig_files.rig_import import found_tests
    from mrdamper.rig_files.tests_table import tests_text

    records, refusals = found_tests(files, settings)
    warn(f"not in the table: {line}" for line in _refused_lines(refusals))
    if not records:
        raise InputError("no test can be read", remedy="correct the files listed above, or give a profile")
    warn(f"current_A of {record.id} left empty: {record.doubt.found}" for record in records if record.doubt)
    put_text(tests_text(records), target)
    if str(target) != "-":
        print(f"table of {counted(len(records), 'test')}: {target}; complete it, then import with it")


def _write_profile(files: list[Path], settings: Profile, target: Path) -> None:
    from mrdamper.rig_files.profile_template import profile_template

    text, problems = profile_template(files, settings)
    warn(f"the profile does not suffice yet: {problem}" for problem in problems)
    put_text(text, target)


def _write_dataset(result: ImportResult, profile: Profile, out: Path, add: bool) -> tuple[int, int]:
    """Write or add; return the number of runs in the dataset, and of new ones."""
    from mrdamper.rig_files.dataset_folder import load_dataset, save_dataset, with_tests
    from mrdamper.rig_files.profile import Profile, profile_text
    from mrdamper.rig_files.rig_import import to_dataset

    dataset = to_dataset(result.records, out.name)
    if add:
        before = load_dataset(out)
        dataset, replaced, beside = with_tests(before, dataset)
        if replaced:
            warn([f"read otherwise than before and replaced: {listed(replaced, 5)}"])
        if beside:
            why = "of files that are there already, by other columns or of another rig, and added as further tests"
            warn([f"{why}: {listed(beside, 5)}"])
        save_dataset(dataset, out, replace=True)
        return len(dataset), len(dataset) - len(before)
    extra = {"rig.toml": profile_text(profile)} if profile != Profile() else None
    save_dataset(dataset, out, extra_files=extra)
    return len(dataset), len(dataset)


def _asked(
    files: list[Path], settings: Profile, result: ImportResult, tests: Path | None
) -> tuple[Profile, ImportResult]:
    """Ask for missing information, one question at a time, and read the files again with each answer."""
    from mrdamper.rig_files.preview import columns_of, question_of
    from mrdamper.rig_files.profile import profile_text
    from mrdamper.rig_files.rig_import import import_files

    before = settings
    for _ in range(_MOST_QUESTIONS):
        questions = (question_of(refusal.error, columns_of(refusal.file, settings)) for refusal in result.refusals)
        question = next((question for question in questions if question is not None), None)
        if question is None:
            break
        typer.echo(question.text)
        for number, answer in enumerate(question.answers, 1):
            typer.echo(f"  {number}  {answer.value}")
        chosen = typer.prompt("Number, 0 to stop", type=int, default=0)
        if not 1 <= chosen <= len(question.answers):
            break
        settings = question.answers[chosen - 1].applied(settings)
        result = import_files(files, settings, tests=tests)
    if settings != before:
        typer.echo(f"The answers as a profile:\n{profile_text(settings)}")
    return settings, result


def _print(
    result: ImportResult, out: Path | None, total: int, new: int, *, profile: Path | None, dry: bool, verbose: bool
) -> None:
    from mrdamper.data.wording import counted, number

    columns = {record.provenance["columns"] for record in result.records}
    if dry and result.records:
        print("Taken for tests:")
    if len(columns) == 1 and len(result.records) > 1:
        print(f"columns: {columns.pop()}")
    unused = {record.provenance.get("ignored_columns", "") for record in result.records} - {""}
    if unused:
        print(f"columns not used: {listed(sorted(unused), 3)}")
    lines = []
    for record in result.records:
        valid = record.time[~(record.time != record.time)]
        seconds = float(valid[-1] - valid[0])
        current = "" if record.current is None else f", {_current(record)}"
        more = f", {record.provenance['columns']}" if columns else ""
        lines.append(f"{record.id}: {counted(record.time.size, 'sample')}, {number(seconds)} s{current}{more}")
    every = (
        (record.id, finding)
        for record in result.records
        for finding in record.findings
        if verbose or finding.code not in _OF_FORM
    )
    findings = [f"  {line}" for line in finding_lines(every, verbose)]
    for some, most in ((lines, 7), (findings, 4), (_refused_lines(result.refusals), 4)):
        print("".join(f"{line}\n" for line in shortened(some, most, verbose)), end="")
    if result.left_out:
        by_reason: dict[str, list[str]] = {}
        for name in result.left_out:
            by_reason.setdefault(result.reasons.get(name, ""), []).append(name)
        whys = [listed(names, 3) + f" ({reason})" * bool(reason) for reason, names in by_reason.items()]
        print(f"not imported as tests: {listed(whys, 5)}")
    _print_next_step(result, profile)
    tests = {record.provenance.get("file", "") for record in result.records}
    if out is not None:
        whence = f", {new} of them new" if total > new else f" from {counted(len(tests), 'file')}"
        print(f"dataset: {out} ({counted(total, 'run')}{whence})")
    elif dry:
        would = counted(len(result.records), "test")
        print(f"{would} would be written, {_refused_tests(result.refusals)} refused; --out DATASET writes")
    else:
        print("nothing written; correct or leave out the refused files, or give --skip-refused")


def _print_next_step(result: ImportResult, profile: Path | None) -> None:
    """Print the command that answers what the refusals ask for, with the profile in use."""
    from mrdamper.rig_files.mapping.companions import files_by_kind
    from mrdamper.rig_files.profile import Profile

    given = "" if profile is None else f" --profile {shlex.quote(str(profile))}"
    if result.refusals and all(refusal.error.remedy.startswith("write the ") for refusal in result.refusals):
        print(
            f"a table takes the current of each test: mrdamper import FILES{given} --write-tests tests.csv, "
            f"fill in current_A, import with{given} --tests tests.csv"
        )
    elif any("profile" in refusal.error.remedy for refusal in result.refusals):
        answer = f"correct {profile}, which mrdamper import FILE{given} --write-profile - shows completed"
        if profile is None:
            answer = "mrdamper import FILE --write-profile rig.toml, correct rig.toml, import with --profile rig.toml"
        kinds = files_by_kind([Path(refusal.file) for refusal in result.refusals if not refusal.run], Profile())
        if kinds:
            print(f"every test has {len(kinds)} files, {', '.join(kinds)}; the profile states that of each channel")
        print(
            f"a profile answers once for all files: {answer}"
            + ("; if it is for the refused files only, import the others with --skip-refused, then these on their own "
               "with it and --add" if result.records else "")
        )  # fmt: skip


def _refused_lines(all_refused: Sequence[Refusal]) -> list[str]:
    """One line a refusal; those of several files that differ in numbers only are one, with folder and number."""
    from mrdamper.data.wording import counted

    alike: dict[tuple[str, ...], list[Refusal]] = {}
    for refusal in all_refused:
        error = refusal.error
        kind = (re.sub(r"[0-9]+([.,][0-9]+)*", "#", text) for text in (error.found, error.remedy))
        alike.setdefault((error.code, *kind), []).append(refusal)
    lines = []
    for refusals in alike.values():
        error = refusals[0].error
        if len(refusals) == 1:
            lines.append(f"refused: {error}")
            continue
        files = [Path(refusal.file) for refusal in refusals]
        if not all(file.is_absolute() for file in files):
            files = [Path(os.path.relpath(file)) for file in files]
        folder = Path(os.path.commonpath([file.parent for file in files]))
        shown = listed(list(dict.fromkeys(str(file.relative_to(folder)) for file in files)), 3)
        line = getattr(error, "line", None)
        texts = {(refusal.error.found, getattr(refusal.error, "line", None)) for refusal in refusals}
        first = "" if len(texts) == 1 else f"the first of them{f', line {line}' if line else ''}: "
        remedy = f"; {error.remedy}" if error.remedy else ""
        tests = f"{counted(_refused_tests(refusals), 'test')} in {folder} ({shown})"
        again = any(line.startswith(f"refused {tests}: ") for line in lines)
        lines.append(f"refused {'the same tests' if again else tests}: {first}{error.found}{remedy} [{error.code}]")
    return lines


def _refused_tests(refusals: Sequence[Refusal]) -> int:
    """Return the number of tests that are refused, each for one reason or several."""
    return len({(refusal.file, refusal.run) for refusal in refusals})


def _current(record: Record) -> str:
    from mrdamper.data import held_current
    from mrdamper.data.wording import span
    from mrdamper.rig_files.quality.motion import current_in

    mean, change = held_current(current := current_in(record, None))
    return span(current.min(), current.max(), "A", 4, " to ") if change else f"{round(mean, 3) + 0.0:g} A"


def _summary(result: ImportResult, out: Path | None) -> dict:
    return {
        "dataset": None if out is None else str(out),
        "runs": [
            {
                "run_id": record.id,
                "samples": int(record.time.size),
                "findings": [{"code": finding.code, "text": finding.text} for finding in record.findings],
                "provenance": dict(record.provenance),
            }
            for record in result.records
        ],
        "left_out": list(result.left_out),
        "refused": [
            {"file": refusal.file, "code": refusal.error.code, "text": str(refusal.error)}
            for refusal in result.refusals
        ],
    }
