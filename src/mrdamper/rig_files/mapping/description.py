"""Texts beside records, as lines, and what they state: columns, rate and current, signs and scales."""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from contextvars import ContextVar
from dataclasses import replace
from functools import lru_cache, partial
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from mrdamper.errors import InputError
from mrdamper.rig_files import column_names
from mrdamper.rig_files.column_names import (
    UNIT_KEYS,
    find_name,
    is_unit,
    names_condition,
    sentences,
    split_name,
    words,
    words_of,
)
from mrdamper.rig_files.conditions import (
    OTHER_DEVICE,
    currents_in,
    stated_by_lines,
    stated_in_titles,
    stated_motion,
    stated_quantities,
)
from mrdamper.rig_files.mapping import scales
from mrdamper.rig_files.mapping.completion import NUMBERED, item_of, said_of_file, states_si, states_volts
from mrdamper.rig_files.mapping.result_tables import numbered_tests, with_small_units
from mrdamper.rig_files.profile import Profile
from mrdamper.rig_files.readers.base import RawTable
from mrdamper.rig_files.record import REQUIRED, SIGNED, Finding
from mrdamper.rig_files.text.elements import numbers_in, root_of, tree_of
from mrdamper.rig_files.text.row_samples import cells_of_list
from mrdamper.rig_files.text.stream import decoded

_MARKDOWN = (".md", ".rmd", ".qmd")
_MOST = 200  # lines
_FEWEST_ROWS = 50  # of a record
_FEW_FILES = 10  # that describe a folder, not a test each
_STRUCTURES = (".json", ".yaml", ".yml", ".toml")
SHORT_TEXTS = (".csv", ".txt", ".tsv", ".dat", *_MARKDOWN, ".log", ".tex", ".m", *_STRUCTURES)
_NAMED = (*_STRUCTURES, ".xml")  # structures that describe the record of their name
_READ = (".txt", *_MARKDOWN, ".rst", ".csv", ".tsv", ".m", *_STRUCTURES)
_HYDRA = ".hydra/config.yaml"  # beside the record of a job, by the program of that name
_LARGEST_LIST = 4096  # bytes of a list of channels
_TEXTS = (".csv", ".txt", ".tsv", ".ini", ".cfg", ".par", ".set", ".m")
_RATES = sentences("rates")
(_OTHER_RATES,) = sentences("other_rates")
_DEVICE_BEFORE = re.compile(rf"(?i)(?:{OTHER_DEVICE.pattern})\w*,?[^.;,]*$")  # Camera, scan rate 300 Hz
_DEVICE_BEHIND = re.compile(rf"(?i)[^.;,]{{0,30}}(?:{OTHER_DEVICE.pattern})(?![^.;,]*[0-9] ?k?Hz)")  # moving average
_LABEL = re.compile(r"([^.;,:]+):\s*$")
_RECORDER = re.compile(
    rf"(?i)daq|logg|acqui|record|erfass|mess|data|daten|\badc\b|system|channel|kan[aä]l|rate|{'|'.join(words('sampling'))}"
)
(_README,) = sentences("readme")
(_GENERAL,) = sentences("general")
_LARGEST = 2**18  # bytes
_TEX = re.compile(r"\\\\.*|[${}]")  # around the cells of a table in LaTeX
_ITEM = re.compile(r"(\w+[({]\d+[)}])\.(\w+) *= *['\"]?([^;'\"\n]+)")  # d(1).current = 0.5;
_ARRAY = re.compile(r"(?m)^\s*(\w+) *= *\[([-+0-9.eE,; \t]+)\] *;? *%+ *(\S.*)$")  # I = [0 0.5 1];  % coil current, A
_RULE = re.compile(r"[\s|:+=-]*")  # below the names of columns of a table in Markdown
_DEEPEST, _FEWEST_TESTS = 6, 2
_MOST_LEVELS = 50  # of a text in YAML
_MOST_LISTED = 200  # quantities or channels
_VALUE, _SCALE, _UNIT = words("value"), words("scale"), UNIT_KEYS
_EU = re.compile(r"(?i)\b(?:EU|units?)\b")  # engineering units, those of the row
_PER = re.compile(rf"{_EU.pattern} ?(?:/|per) ?m?V\b|\bm?V ?(?:/|per) ?{_EU.pattern[4:]}")
_SHIFT = re.compile(r"(?i)offset|zero")
_MEASURED = {*column_names.DIMENSION.values(), "frequency"}
READ_FOLDERS: ContextVar[Sequence[Path]] = ContextVar("folders that are read, with all texts in them", default=())
_PLACES = ("column", "number", "index", "no", "position", "channel")  # of a column among the others


def with_notes(table: RawTable, path: Path, profile: Profile) -> RawTable:
    """Add what short texts beside the file state of signs, and of names, units and scales where they lack."""
    lacking = bool(scales.scaled_columns(table)) or _lacks_names_or_units(table)
    # A text above the folders that are read may be of another rig: only a README there is used, and that is told.
    above = [f for f in path.parents[1:] if any(top == f or top in f.parents for top in READ_FOLDERS.get())]
    folders = [_texts_in(f, f.stat().st_mtime_ns) for f in (path.parent, *above)]
    texts = next((readme for readme, *_ in folders if readme), [])
    outer = [] if texts or above else _texts_in(top := path.parent.parent, top.stat().st_mtime_ns)[0]
    readme, structures, listing = folders[0]
    if above:
        structures = structures or folders[1][1]
        listing = listing if readme else [*listing, *folders[1][2]]
    texts = texts + outer + (structures if lacking or len(structures) <= _FEW_FILES else [])
    texts = texts + [p for p in listing if lacking and p.stat().st_size <= _LARGEST_LIST]
    texts = [p for p in {*texts} if p.is_file() and p != path and not profile.leaves_out(*p.parts)]
    own = (short_lines(text) for text in sorted(texts))
    lines = [column_names.without_namespaces(line) for of in own if len(of) <= _MOST for line in of]
    names = {header.name.casefold() for header in table.headers}
    counts, of_file = partial(scales.counts_in, names=names), partial(said_of_file, name=path.name)
    several = [i for i, h in enumerate(table.headers) if h.role in SIGNED and len(table.columns(h.role)) > 1]
    alike = {name for i in several for name in (table.names[i], table.headers[i].name)}

    def of_several(line: str) -> bool:
        return any(find_name(line, name) for name in alike)

    about = [scales.states_sign, counts, partial(column_names.units_in, names=names), of_file, of_several]
    # A current may be that of one test, or an example, unless one line without labels states those of several columns.
    of_columns = re.sub("[:=]", " ", "; ".join(line for line in lines if of_several(line) and currents_in(line)))
    lines = [line for line in lines if not (stated_by_lines([line], ".") or stated_in_titles([line]))]
    stated = [of_columns] if len(currents_in(of_columns)) > 1 else []
    stated += [(lacking and _of_channels(line)) or line * any(tells(line) for tells in about) for line in lines]
    if outer and any(stated):
        text = f"{outer[0].name} in the folder above is read for what it states of columns"
        table = table.noted(Finding("W_CHOSEN", text))
    force = profile.channel("force")
    stated += [f"force [{force.unit}]"] if force.unit and force.column is None else []  # heads columns 0 A, 0.5 A, ...
    timed = profile.file.sample_rate_Hz or profile.channel("time").unit
    timed = timed or any(h.dimension == "time" or (h.role == "time" and h.unit) for h in table.headers)
    if table.names and not timed and not any(map(_OTHER_RATES.search, lines)):
        rates = list(_rates_of_rows(lines))
        stated += [f"sample rate: {match['number']} {match['kilo']}Hz" for match in rates]
        table = table.noted(*(Finding("W_CHOSEN", f"a text beside the file says {match[0]!r}") for match in rates[:1]))
    calibrated = frozenset(role for role, channel in profile.channels.items() if channel.scale is not None)
    return replace(table, remarks=(*table.remarks, *filter(None, stated)), calibrated=calibrated)


def _rates_of_rows(lines: Iterable[str]) -> Iterator[re.Match[str]]:
    """Yield the rates that lines state, but those of other devices: on their line, behind their name, below it."""
    of_device = False
    for line in lines:
        if line.startswith("#") or line.rstrip(" *").endswith(":") or not line.strip():
            of_device = OTHER_DEVICE.search(line) is not None
        for match in (match for pattern in _RATES for match in pattern.finditer(line) if not of_device):
            before = line[: match.start()]
            label = _LABEL.search(before) if match.re is _RATES[-1] else None  # DAQ: 200 scans per second
            other = label is not None and not _RECORDER.search(label[1])
            if not (other or _DEVICE_BEFORE.search(before) or _DEVICE_BEHIND.match(line, match.end())):
                yield match


@lru_cache(maxsize=64)  # every file of a folder asks
def _texts_in(folder: Path, changed_ns: int) -> tuple[list[Path], list[Path], list[Path]]:
    """Return the files of a folder that may describe its records: by their names, structures, and other texts."""
    names: list[str] = []
    with suppress(PermissionError), os.scandir(folder) as entries:  # nothing of a folder that may not be read
        names = [e.name for e in entries if "." not in e.name or e.name.lower().endswith(_READ)]
    stems = Counter(name.rpartition(".")[0] or name for name in names)
    structures = [name for name in names if name.lower().endswith(_STRUCTURES)]
    structures = [folder / name for name in structures if stems[name.rpartition(".")[0]] == 1]  # else of one test
    listing = [folder / name for name in names if name.lower().endswith(_TEXTS)]
    return [folder / name for name in names if _README.fullmatch(name)], structures, listing


def is_readme(path: Path) -> bool:
    """Tell if a file is one of notes by its name: README.md, LIESMICH.txt."""
    return _README.fullmatch(path.name) is not None


def _lacks_names_or_units(table: RawTable) -> bool:
    """Tell if a column that may be needed has no unit, or a number for a name."""
    bare = [i for i, header in enumerate(table.headers) if not header.unit]
    roles = {header.channel for header in table.headers}
    lacking = (table.headers[i].role in REQUIRED or NUMBERED.fullmatch(table.names[i].strip()) for i in bare)
    return not {"displacement", "force"} <= roles or any(lacking)


def _of_channels(line: str) -> str:
    """Return what a line states of channels: a scale, a unit, or as "channel 2: load N" what a number stands for."""
    cells = cells_of_list(line.strip(" |"))
    numbered = len(cells) > 2 and cells[0].isascii() and cells[0].isdigit()
    if numbered and (split_name("", cells[-1]).known or scales.scales_in(cells[-1])):
        senses = [cell for cell in cells if scales.senses_in(cell)]  # positive in compression
        meaning = " ".join(cell for cell in cells[1:] if cell not in senses)
        return ", ".join([f"channel {cells[0]}: {meaning}", *senses])
    if len(cells) > 1 and split_name(cells[0]).role and all(c.isascii() and c.isdigit() for c in cells[1:]):
        return f"channel {cells[1]}: {cells[0]}"  # a tag with its index, and its type
    units = [item_of(cell).unit or cell.rpartition(":")[2].strip() for cell in (*cells, line.partition(": ")[2])]
    stated = scales.scales_in(line) or scales.states_shift(line) or states_si(line) or states_volts(line)
    of_tests = stated_by_lines([line], ".") or stated_motion(stated_quantities([line]))
    return line if stated or (any(map(is_unit, units)) and not of_tests) else ""


def with_description(table: RawTable, path: Path, profile: Profile) -> RawTable:
    """Return the table with what the text or structure of its name, or the only other file of its folder, states."""
    beside = [*(path.with_suffix(suffix) for suffix in (*_NAMED, *_TEXTS)), path.parent / _HYDRA, *_only_other(path)]
    named = [p for p in beside if p != path and p.is_file() and not profile.leaves_out(*p.parts)]
    named = [p for p in named if p.suffix.lower() in _NAMED or is_description(p)]
    lines = short_lines(named[0]) if named else packaged_lines(path)
    lines = [*lines, *_head_in_yaml(table.remarks)]
    return replace(table, remarks=(*table.remarks, *lines))


def is_description(path: Path) -> bool:
    """Tell if a file is a short text that states quantities or lists channels, and no record: Coil_Current, 0.5, A."""
    lines = short_lines(path) if path.suffix.lower() in _TEXTS and path.is_file() else []
    if sum(bool(line.strip()) for line in lines) >= _FEWEST_ROWS or numbered_tests(lines):
        return False
    listed = [re.split(r"[,;\t|]", of) for line in lines if (of := _of_channels(line))]
    listed = [of for of in listed if of[0].startswith("channel ") or any(split_name(cell).role for cell in of[1:])]
    return len(listed) > 1 or bool(stated_by_lines(lines, "."))


def _only_other(path: Path) -> list[Path]:
    """Return the only other file of a file's folder, if its name may be that of a description of the record.

    Thus meta.xml or run1_info.json, but no run2.json of run1.csv.
    """
    others = list[Path]()
    with suppress(OSError), os.scandir(path.parent) as folder:  # not read to its end: it may hold thousands of files
        visible = (file.name for file in folder if not file.name.startswith(".") and file.name != path.name)
        others = [path.with_name(name) for name in islice(visible, 2)]
    if len(others) == 1 and others[0].suffix.lower() in _NAMED:
        return others if _GENERAL.fullmatch(others[0].stem.removeprefix(path.stem).strip(" ._-")) else []
    alike = {re.sub("[0-9]+", "0", p.stem) for p in (*others, path)}
    return others if len(others) == 1 and (others[0].stem == path.stem or len(alike) > 1) else []


def short_lines(path: Path) -> list[str]:
    """Return the lines of a short text; none of a file that is long, of mrdamper's own, or cannot be read.

    Of a structure, every quantity and every channel is a line, and a list of objects of one form a table. YAML that
    cannot be parsed has the lines of its text.
    """
    try:
        with path.open("rb") as file:
            content = file.read(_LARGEST + 1)
    except OSError:
        return []
    text = decoded(content) if len(content) <= _LARGEST else ""
    suffix = path.suffix.lower()
    if suffix in _STRUCTURED:
        try:
            tree = _STRUCTURED[suffix](text)
            ours = isinstance(tree, dict) and str(tree.get("format", "")).startswith("mrdamper-")  # a saved model
            ours |= suffix == ".toml" and {*tree} <= {*Profile.model_fields}
            return [] if ours else list(_stated(tree, ""))
        except (ValueError, RecursionError, SyntaxError, InputError):
            if suffix in (".json", ".xml"):
                return []
    text = text.replace("`", "") if suffix in _MARKDOWN else text
    text = _TEX.sub("", text).replace("&", "|") if suffix == ".tex" else text
    text = re.sub(r"(?<=\w)_\*", "", text)  # t_* time (s), of t_I0, t_I1
    lines = [line for line in text.splitlines() if "|" not in line or not _RULE.fullmatch(line)]
    lines += (*_items_assigned(text), *_arrays_assigned(text)) if suffix == ".m" else ()
    return _by_headings(lines) if len(lines) <= _MOST_LISTED else lines


def _items_assigned(text: str) -> Iterator[str]:
    """Yield the items of arrays of structs that a script assigns, as a table, with the units of a comment: akim: A."""
    items: dict[str, dict[str, Any]] = {}
    for item, key, value in _ITEM.findall(text):
        items.setdefault(item, {})[key] = numbers_in(value)
    units = {key: unit for key, unit in re.findall(r"(\w+)\s*[:=]\s*([^\W\d]+)", text) if is_unit(unit)}
    yield from _stated([*items.values()], "", units)


def _arrays_assigned(text: str) -> Iterator[str]:
    """Yield as a table the arrays of one length that a script assigns, with the name and unit of a comment each."""
    arrays: dict[int, dict[str, list[str]]] = {}
    for name, numbers, comment in _ARRAY.findall(text):
        header = item if (item := item_of(comment)).unit else column_names.Header(name, comment.strip())
        if is_unit(header.unit):
            own = numbers.replace(",", " ").replace(";", " ").split()
            arrays.setdefault(len(own), {})[f"{header.name} [{header.unit}]"] = own
    for columns in (of for size, of in arrays.items() if size >= _FEWEST_TESTS):
        yield from ("\t".join(row) for row in (columns, *zip(*columns.values(), strict=True)))


def _by_headings(lines: list[str]) -> list[str]:
    """Return lines, in those of a list the number and its unit last: Name, Unit, Value; Channel, Unit, Scale [unit/V].

    Where a heading does not tell what a scale is per, the unit beside it is omitted: it may be that of the product.
    """
    written, heads, number, unit = [], list[str](), 0, 0
    sense, width, place = "", 0, 0  # heading above the senses in which channels count, cells of its line, its place
    for line in lines:
        cells = [cell.strip(' "') for cell in re.split(r"[,;\t|]", line.strip(" ").removeprefix("|").removesuffix("|"))]
        at = next((i for i, cell in enumerate(cells) if len(cells) > 2 and scales.heads_senses(cell)), None)
        if at is not None or not line.strip():
            sense, width, place = (cells[at], len(cells), at) if at is not None else ("", 0, 0)
        elif sense and len(cells) == width and cells[place]:
            cells[place] = f"{cells[place]} {sense}"
            line = " | ".join(cells)
        keys = [{word.casefold() for word in words_of(cell)} for cell in cells]
        of, its = [next((i for i, key in enumerate(keys) if key & of), None) for of in (_VALUE | _SCALE, _UNIT)]
        if of is not None and its is not None:
            heads, number, unit = cells, of, its
        elif len(cells) == len(heads) and split_name("", cells[unit]).dimension in _MEASURED:
            head, per = heads[number], _PER.search(heads[number])
            others = [of for i, of in enumerate(zip(heads, cells, strict=True)) if i not in (number, unit)]
            rest = [f"{key} {cell}" if _SHIFT.search(key) else cell for key, cell in others]
            more = [word for word in words_of(head) if word.casefold() not in _VALUE]
            if len(more) < len(words_of(head)):  # a value; what else is said may tell that it is that of no test
                texts = [cell for cell in rest if cell and not cell.isdigit()]
                line = f"{' '.join([*texts, *more])}: {cells[number]} {cells[unit]}"
            else:
                line = "; ".join([*rest, f"{cells[number]} {_EU.sub(cells[unit], per[0])}" if per else ""])
        written.append(line)
    return written


@lru_cache(maxsize=16)  # every file of a folder asks
def _tree_of_yaml(text: str) -> Any:
    """Return what the documents of a YAML text hold, its numbers as those of other texts: 010 is ten, on is a word.

    Raises `ValueError` for one with aliases, which can repeat a node without end, or nested too deeply.
    """
    import yaml

    loader, depth = getattr(yaml, "CBaseLoader", yaml.BaseLoader), 0
    try:
        for event in yaml.parse(text, loader):
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if depth > _MOST_LEVELS or isinstance(event, yaml.AliasEvent):
                raise ValueError("aliases, or nodes nested too deeply")
        documents = [_with_numbers(document) for document in yaml.load_all(text, loader)]
    except yaml.YAMLError as error:
        raise ValueError("no YAML") from error
    return documents[0] if len(documents) == 1 else dict(enumerate(documents))


def _with_numbers(node: Any) -> Any:
    if isinstance(node, dict):
        return {key: _with_numbers(value) for key, value in node.items()}
    return [_with_numbers(item) for item in node] if isinstance(node, list) else numbers_in(node)


_STRUCTURED: Mapping[str, Callable[[str], Any]] = MappingProxyType(
    {
        ".json": json.loads,
        ".xml": lambda text: tree_of(root_of(text)),
        ".yaml": _tree_of_yaml,
        ".yml": _tree_of_yaml,
        ".toml": tomllib.loads,
    }
)


def packaged_lines(path: Path) -> list[str]:
    """Return what the data package (datapackage.json) of a file's folder, or of the one above, states of the file."""
    for folder in path.parents[:2]:
        try:
            content = (folder / "datapackage.json").read_bytes()[:_LARGEST]
            entries = [e for e in json.loads(content)["resources"] if folder / e["path"] == path]
            fields = [field for entry in entries for field in entry.get("schema", {}).get("fields", [])]
            lines = ["; ".join(str(field.get(key, "")) for key in ("name", "title", "unit")) for field in fields]
            own = ({key: of for key, of in entry.items() if key != "schema"} for entry in entries)
            return [*lines, *(line for entry in own for line in _stated(entry, ""))]
        except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
            continue  # none, or no data package
    return []


def _head_in_yaml(lines: Iterable[str]) -> list[str]:
    """Return what lines below three dashes, down to the next, state, commented out or not: of a CSVY or ECSV file."""
    bare = [line.lstrip().removeprefix("#") for line in lines]
    marks = [i for i, line in enumerate(bare) if line.strip() == "---"]
    marks += [len(bare)] if bare and bare[0].startswith(" %ECSV") else []
    with suppress(ValueError, RecursionError):
        return list(_stated(_tree_of_yaml("\n".join(bare[marks[0] + 1 : marks[1]])), "")) if len(marks) == 2 else []
    return []


def _stated(node: Any, key: str, units: Mapping[str, Any] | None = None, depth: int = 0) -> Iterator[str]:
    """Yield what a node states as lines: "current: 400 mA", "x; displacement; mm", "time: s", rows of a table."""
    units = units or {}
    if isinstance(node, list) and len(node) >= _FEWEST_TESTS and all(isinstance(item, dict) for item in node):
        kinds: dict[tuple[str, ...], list[Any]] = {}
        for item in node:
            kinds.setdefault((*item,), []).append(item)
        node = [{**item, **_properties(item)} for item in node]
        plain = [name for name in node[0] if all(isinstance(item.get(name), (str, int, float)) for item in node)]
        if not any(isinstance(node[0][name], (int, float)) for name in plain) and len(kinds) > 1:  # of several things
            for items in kinds.values():
                yield from _stated(items if len(items) > 1 else items[0], "", units, depth + 1)
            return
        yield "\t".join(f"{name} [{units[name]}]" if isinstance(units.get(name), str) else name for name in plain)
        yield from _channels([{str(key).casefold(): value for key, value in item.items()} for item in node])
        for item in node:
            yield "\t".join(f"{v:g}" if isinstance(v := item[name], (int, float)) else v for name in plain)
    if not isinstance(node, dict) or depth > _DEEPEST:
        return
    lower = {str(name).casefold(): value for name, value in node.items()}
    both = (lower.get(name) for name in ("unit", "units"))
    both = (of.get("unit") if isinstance(of, dict) else of for of in both)  # of astropy an object
    unit = next((of for of in both if isinstance(of, str)), "")
    numbers = {name: value for name, value in lower.items() if isinstance(value, (int, float))}
    one = [value for name, value in numbers.items() if names_condition(name, split_name("", unit).dimension or "")]
    if unit and ("value" in numbers or len(numbers) == len(one) == 1):  # L1: {current: 0.5, unit: A}
        yield f"{key}: {numbers.get('value', one[0] if one else 0.0):g} {unit}"
    elif unit:
        words = [key, *(str(value) for value in lower.values() if isinstance(value, (str, int, float)))]
        yield "; ".join(dict.fromkeys(words))
    lists = [value for value in lower.values() if isinstance(value, list) and all(isinstance(i, str) for i in value)]
    for its in [own for own in lists if own and all(map(is_unit, own))]:  # columns: [time, load], units: [s, N]
        for names in [other for other in lists if other is not its and len(other) == len(its)]:
            yield from (f"{i}={name};{own}" for i, (name, own) in enumerate(zip(names, its, strict=True), 1))
    own = next((lower[name] for name in ("units", "unit") if isinstance(lower.get(name), dict)), units)
    for (name, value), heading in zip(node.items(), with_small_units([*map(str, node)]), strict=True):
        whole = f"{key} {name}" if OTHER_DEVICE.search(key) else heading  # camera: {sample rate: 300 Hz}
        if isinstance(value, (dict, list)):
            yield from _stated(value, whole, own, depth + 1)
        elif not unit and not isinstance(value, np.ndarray):
            stated = own.get(name) if isinstance(own.get(name), str) and own is not node else None
            text = f"{value:g} {stated or ''}".rstrip() if isinstance(value, (int, float)) else value
            yield f"{whole}: {text}"


def _properties(item: Mapping[str, Any]) -> dict[str, Any]:
    """Return what objects within an object state of it, and a list of them with a name, a value and a unit each."""
    own = {f"{key} {name}": of for key, value in item.items() if isinstance(value, dict) for name, of in value.items()}
    listed = (of for value in item.values() if isinstance(value, list) for of in value if isinstance(of, dict))
    for entry in [{str(key).casefold(): of for key, of in entry.items()} for entry in listed]:
        unit = next((f" [{entry[key]}]" for key in column_names.KEYS["unit"] if key in entry), "")
        own |= {f"{entry['name']}{unit}": entry["value"]} if {"name", "value"} <= {*entry} else {}
    return own


def _channels(items: list[dict[str, Any]]) -> Iterator[str]:
    """Yield the place, the name and the unit of each item, where every item has a name and a unit: 1=Force;kN."""
    units = [next((str(item[key]) for key in column_names.KEYS["unit"] if key in item), "") for item in items]
    for at, (item, unit) in enumerate(zip(items, units, strict=True), 1):
        places = (item[key] for key in _PLACES if isinstance(item.get(key), (int, float)))
        if all(map(is_unit, units)) and isinstance(item.get("name"), str):
            yield f"{next(places, at):g}={item['name']};{unit}"
