"""`mrdamper import`: a rig's own files become a dataset."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from mrdamper.rig_files.profile import Profile
    from mrdamper.rig_files.record import Record
    from mrdamper.rig_files.rig_import import ImportResult


def register(app: typer.Typer) -> None:
    """Add the command."""

    @app.command(
        "import",
        epilog="Example: mrdamper import tests/*.csv --profile rig.toml --out DATASET; "
        "mrdamper import tests/a.csv --write-profile rig.toml",
    )
    def import_(
        files: list[Path] = typer.Argument(..., help="Files of a rig, or folders of them."),
        out: Path | None = typer.Option(None, "--out", help="Dataset folder to write."),
        profile: Path | None = typer.Option(None, "--profile", help="Rig profile (TOML): what the files do not say."),
        write_profile: Path | None = typer.Option(
            None, "--write-profile", help="Write how the first file was read as a profile; - for standard output."
        ),
        skip_refused: bool = typer.Option(False, "--skip-refused", help="Write the good files, list the others."),
        as_json: bool = typer.Option(False, "--json", help="Print JSON a program can read."),
    ) -> None:
        """Read a rig's files, judge every test, and write them as a dataset: all, or nothing."""
        from mrdamper.errors import InputError
        from mrdamper.rig_files.profile import Profile, load_profile
        from mrdamper.rig_files.rig_import import import_files

        if out is None and write_profile is None:
            raise InputError("nothing to write", mend="give --out DATASET, --write-profile FILE or both")
        _refuse_taken(out)
        known = load_profile(profile) if profile is not None else Profile()
        if write_profile is not None:
            _write_profile(files, known, write_profile)
        if out is None:
            return
        result = import_files(files, known)
        wrong = bool(result.refusals) and not skip_refused
        written = bool(result.records) and not wrong
        if written:
            _write_dataset(result, known, out)
        if as_json:
            import json

            print(json.dumps(_summary(result, out if written else None), indent=1, ensure_ascii=False))
        else:
            _print(result, out if written else None)
        if wrong or not result.records:
            raise typer.Exit(2)


def _refuse_taken(out: Path | None) -> None:
    from mrdamper.errors import OutputError
    from mrdamper.files.atomic import require_writable

    if out is None:
        return
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise OutputError("exists already and is not empty", where=str(out), mend="choose another name or remove it")
    require_writable(out)


def _write_profile(files: list[Path], known: Profile, target: Path) -> None:
    from mrdamper.errors import InputError
    from mrdamper.files.atomic import write_file
    from mrdamper.rig_files.profile import profile_text
    from mrdamper.rig_files.rig_import import first_file, guess_profile, read_runs

    guess = guess_profile(first_file(files), known)
    text = profile_text(guess)
    try:
        read_runs(first_file(files), guess)
    except InputError as error:
        typer.echo(f"the profile does not suffice yet: {error}", err=True)
    if str(target) == "-":
        print(text, end="")
        return
    with write_file(target) as path:
        path.write_text(text, encoding="utf-8")


def _write_dataset(result: ImportResult, profile: Profile, out: Path) -> None:
    from mrdamper.files.dataset import save_dataset
    from mrdamper.rig_files.profile import Profile, profile_text
    from mrdamper.rig_files.rig_import import to_dataset

    extra = {"rig.toml": profile_text(profile)} if profile != Profile() else None
    save_dataset(to_dataset(result.records, out.name), out, extra_files=extra)


def _print(result: ImportResult, out: Path | None) -> None:
    for record in result.records:
        known = record.time[~(record.time != record.time)]
        seconds = float(known[-1] - known[0])
        current = "" if record.current is None else f"{_current(record)}, "
        print(f"{record.id}: {record.time.size} samples, {seconds:.4g} s, {current}{record.provenance['columns']}")
        for finding in record.findings:
            print(f"  {finding}")
    for refusal in result.refusals:
        print(f"refused: {refusal.error}")
    if any("profile" in refusal.error.mend for refusal in result.refusals):
        print(
            "a profile answers once for all files: mrdamper import FILE --write-profile rig.toml, "
            "correct rig.toml, import with --profile rig.toml"
        )
    if out is not None:
        print(f"dataset: {out} ({len(result.records)} runs)")
    else:
        print("nothing written; mend or leave out the refused files, or give --skip-refused")


def _current(record: Record) -> str:
    from mrdamper.data import held_current
    from mrdamper.rig_files.quality.current import current_in

    mean, change = held_current(current := current_in(record, None))
    return f"{current.min():.4g} to {current.max():.4g} A" if change else f"{mean:g} A"


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
        "refused": [
            {"file": refusal.file, "code": refusal.error.code, "text": str(refusal.error)}
            for refusal in result.refusals
        ],
    }
