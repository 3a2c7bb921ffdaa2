"""A profile that a person completes: how a file was read, and what its folder leaves open, as comments."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from glob import escape
from itertools import chain
from pathlib import Path

from mrdamper.data.temporary import without_temporary_folder
from mrdamper.errors import InputError
from mrdamper.rig_files.coil_current import CHANNEL_RIGHT, CURRENT_TOO
from mrdamper.rig_files.column_names import SI, Header
from mrdamper.rig_files.file_records import files_in, headings_of, unpacked
from mrdamper.rig_files.mapping.companions import files_by_kind, with_files
from mrdamper.rig_files.mapping.description import is_readme
from mrdamper.rig_files.preview import columns_of, guess_profile, unset_keys
from mrdamper.rig_files.profile import Channel, Profile, profile_text, toml
from mrdamper.rig_files.record import Refusal
from mrdamper.rig_files.rig_import import ImportResult, import_files, read_runs

_OF_MOTION = re.compile(r"(?i)0[ _]?m?(?:hz|mm)|(?<![a-z])(?:f|freq|hz|a|amp|x|run|test|t|n|no|nr)[ _=-]*0")
_COLUMN_OF_CURRENT = re.compile(r'\[channels\.current\] column = ("(?:[^"\\.]|\\.)(?:[^"\\]|\\.)*")')  # not "..."
_OF_CURRENT = re.compile(r"(?i)(?<![a-z])(?:i|cur\w*|amps?|coil)[ _=-]*$")

_MOST_ROUNDS = 3  # of questions that follow from answers
_OF_COLUMNS = ("E_UNITS", "E_AMBIGUOUS", "E_COLUMN", "E_DUPLICATE_COLUMN")  # codes of questions

_FORM = (
    'names = ["time [s]", "displacement [mm]", "force [N]"]  # of all columns, in order',
    "data_line =  # number of the first line of numbers",
)


def profile_template(paths: Sequence[str | Path], profile: Profile) -> tuple[str, list[str]]:
    """Return the text of a profile for files, and the problems that reading one of them with it still has.

    Where the form of the file cannot be found its keys are those that a person may state.
    """
    problems: Sequence[InputError] = ()
    with _file_for_profile(paths, profile) as (first, refused):
        try:
            guess, columns = guess_profile(first, profile), columns_of(first, profile)
        except InputError as error:
            return profile_text(profile, {"file": _FORM}) + _alternatives({}, {}), [str(error)]
        kinds = {kind: headings_of(path, profile) for kind, path in files_by_kind(refused, profile).items()}
        if kinds:
            guess = with_files(guess, kinds)
            refusals = import_files(paths, guess).refusals
            errors = (refusal.error for refusal in reversed(refusals))
            alike = {re.sub("[0-9]+", "#", e.found): f"{e.found}; {e.remedy} [{e.code}]" for e in errors}
            open_tests = () if guess.current or "current" in guess.channels else _of_tests(refusals, kinds)
            text = profile_text(guess) + _alternatives(columns, kinds) + _missing_currents(open_tests, {})
            return text, [*alike.values()][::-1]
        try:
            read_runs(first, guess)
        except InputError as error:
            problems = getattr(error, "errors", (error,))
    refusals = import_files(paths, guess).refusals
    unset, without_current = _open_keys(paths, guess, [*problems, *(r.error for r in refusals)], columns)
    refusals = without_current or refusals
    if any(CHANNEL_RIGHT in refusal.error.remedy for refusal in refusals):
        # The pattern of the names contradicts the channel.
        guess = guess.model_copy(update={"current": profile.current})
    missing = _missing_currents(refusals if guess.current is None else (), columns)
    text = profile_text(guess, unset) + _alternatives(columns, {}) + missing
    return text, list(dict.fromkeys(map(str, problems)))


def _open_keys(
    paths: Sequence[str | Path], guess: Profile, errors: Sequence[InputError], columns: Mapping[int, str]
) -> tuple[dict[str, list[str]], list[Refusal]]:
    """Return the keys that are asked for, also once others are answered, and the tests without a current by then."""
    unset, without = dict[str, list[str]](), list[Refusal]()
    taken = [channel.column for channel in guess.channels.values()]
    for _ in range(_MOST_ROUNDS):
        asked = unset_keys(errors, columns, taken)
        unset = {key: list(dict.fromkeys([*unset.get(key, ()), *asked.get(key, ())])) for key in {**unset, **asked}}
        keys = {section: {line.partition(" ")[0] for line in lines} for section, lines in asked.items()}
        units = [role for role in guess.channels if "unit" in keys.get(f"channels.{role}", ())]
        si = {role: guess.channel(role).model_copy(update={"unit": SI[role], "scale": 1.0}) for role in units}
        file = guess.file.model_copy(update={"blocks": "split"} if "blocks" in keys.get("file", ()) else {})
        before, guess = guess, guess.model_copy(update={"channels": {**guess.channels, **si}, "file": file})
        if guess == before:
            break
        refusals = import_files(paths, guess).refusals
        without = [r for r in refusals if r.error.code == "E_CURRENT_MISSING"]
        errors = [r.error for r in refusals if r.error.code.startswith(_OF_COLUMNS)]
    return unset, without


@contextlib.contextmanager
def _file_for_profile(paths: Sequence[str | Path], profile: Profile) -> Iterator[tuple[Path, list[Path]]]:
    """Yield the first refused file among files, folders and archives, and all refused, for as long as the block goes.

    Where none is refused the first is that which holds a test, else the first that is no README.
    """
    with unpacked(paths) as given:
        files = [file for file in files_in(given)[0] if not is_readme(file)] or files_in(given)[0]
        result = import_files(given, profile) if len(files) > 1 else ImportResult(())
        refused = {r.file.removesuffix(f": {r.run}") for r in result.refusals if r.error.code != "E_NO_DATA"}
        first = [file for file in files if without_temporary_folder(str(file)) in refused]
        names = {Path(record.provenance["file"]).name for record in result.records}
        tests = (file for file in files if file.name in names or (not names and file.name not in result.left_out))
        yield next(chain(first, tests), files[0]), first


def _of_tests(refusals: Sequence[Refusal], kinds: Collection[str]) -> list[Refusal]:
    """Return the refusals of files of some channels as those of their tests, one a test."""
    of_kinds = [Profile(channels={"force": Channel(file=kind)}) for kind in kinds]
    tests: dict[tuple[Path, str], Refusal] = {}
    for refusal in (r for r in refusals if r.error.code == "E_CURRENT_MISSING" or CURRENT_TOO in r.error.remedy):
        path = Path(refusal.file)
        run = next(filter(None, (refusal.run, *(of_kind.of_file(path)[0] for of_kind in of_kinds))), path.stem)
        tests.setdefault((path.parent, run), replace(refusal, file=str(path.with_name(f"*{run}")), run=run))
    return [*tests.values()]


def _missing_currents(refusals: Sequence[Refusal], columns: Mapping[int, str]) -> str:
    """List what a person fills in for tests without a current, as comments: their currents, or a column's scale."""
    asked = [r for r in refusals if CURRENT_TOO in r.error.remedy]  # beside units
    missing = [
        r for r in refusals if r.error.code == "E_CURRENT_MISSING" or CHANNEL_RIGHT in r.error.remedy or r in asked
    ]
    if not missing:
        return ""
    lines = []
    reasons = ["" if r in asked else r.error.found for r in missing]
    named = chain.from_iterable(_COLUMN_OF_CURRENT.findall(r.error.remedy) for r in missing)
    refused = (toml(name) for name in columns.values() if name and any(f"column {name!r}" in why for why in reasons))
    if shown := next(chain(named, refused), None):
        lines = ["# Or this column or number as the current; scale: A for 1 of it:", "#[channels.current]"]
        lines += [f"#column = {shown}", '#unit = "A"', "#scale =", ""]
    runs = [r.run or Path(r.file).stem for r in missing]
    paths = [escape("/".join(Path(r.file).parts[-2:]).replace(": ", "/")) for r in missing]
    names = [escape(run) if runs.count(run) == 1 else f"*/{path}" for run, path in zip(runs, paths, strict=True)]
    heading = '# Tests without a current, or with two: remove the #, write it [A] behind each =, or "*" = ... for all:'
    lines += [heading, "#[current.values]"]
    own = len({*reasons}) > 1  # one reason of all tests stands in their refusal
    whys = [f"  # {text}" if own and text and not text.startswith("no coil current") else "" for text in reasons]
    stated = dict(zip(_by_level(names), whys, strict=True))
    lines += [f"#{toml(name)} ={why}" for name, why in stated.items()]
    return "\n".join(["", *lines, ""])


def _by_level(names: Sequence[str]) -> Sequence[str]:
    """Return the pattern of each name's level, duty20_*, where only one number that several names have may be that."""
    parts = [re.split(r"([0-9]+(?:[.,][0-9]+)?)", name) for name in names]
    if len({tuple(own[::2]) for own in parts}) > 1:
        return names
    shared = [i for i in range(1, len(parts[0]), 2) if 1 < len({own[i] for own in parts}) < len(names)]
    levels = [i for i in shared if not _OF_MOTION.search(f"{parts[0][i - 1]}0{parts[0][i + 1]}")]
    levels = [i for i in levels if _OF_CURRENT.search(parts[0][i - 1])] or levels
    if len(levels) != 1:
        return names
    (i,) = levels
    first, behind = "*" * (i > 1) + parts[0][i - 1], parts[0][i + 1][:1]
    return [f"{first}{own[i]}{behind}{'*' * bool(behind)}" for own in parts]


def _alternatives(columns: Mapping[int, str], kinds: Mapping[str, Mapping[int, tuple[str, Header]]]) -> str:
    """List the columns of the file, or of each kind of file, and the most used keys of a profile as comments."""

    def named(names: Mapping[int, str]) -> list[str]:
        return [f"#   {number}  {toml(name)}" for number, name in names.items() if name]

    several = "# Every test has several files; give each channel its column, its unit, and its file, of which {run} is"
    lines = [several, "# the name of the test. Columns:"] if kinds else []
    for kind, headings in kinds.items():
        lines += [f"#  of {kind}", *named({number: name for number, (name, _) in headings.items()})]
    return "\n".join(
        [
            "", *(lines or ["# Columns of the file, for column = \"...\" or column = NUMBER:", *named(columns)]),
            "# One current for all files ([current] value), or one in their names or folders:",
            '# pattern = "*_{current}A_*" or "*/{current}A/*"; {run}, {frequency}, {amplitude} stand for other numbers',
            '# Files and tables that are no tests, and columns without use: [file] leave_out = ["warmup*"]',
            '# Several tests in one table: [file] run_column = "...", the column that numbers or names them', "",
        ]
    )  # fmt: skip
