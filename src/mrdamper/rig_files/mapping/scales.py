"""Scales that a file states of channels in volts, mV/V, counts or per cent, and senses in which it counts positive."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise, product

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.arrays import rescale
from mrdamper.rig_files import column_names
from mrdamper.rig_files.column_names import (
    DIMENSION,
    find_name,
    holds,
    parse_unit,
    role_of,
    split_name,
    words,
    words_of,
)
from mrdamper.rig_files.conditions import FULL_SCALES, LONGEST_LINE, stated_by_lines, stated_in_titles
from mrdamper.rig_files.readers.base import RawTable
from mrdamper.rig_files.record import SIGNED, Finding

_MONITOR = words("monitor")
_AROUND = r"(?:\+ ?/? ?[-−–]|±) ?"  # zero
SCALE = re.compile(
    rf"(?P<around>{_AROUND})?(?P<minus>(?<![\w.,)])[-−])?(?<![\w.,])(?P<one>[0-9]+(?:[.,][0-9]+)?)\s*(?P<unit>mV/V|[A-Za-zµ]{{1,6}}|%)"
    r"(?:\s*(?:PWM|duty(?: cycle)?|drive|output))?\s*(?:/|=|per|pro|entspricht|->)\s*"
    rf"(?(around)(?:{_AROUND})?)(?P<other>[0-9]+(?:[.,][0-9]+)?)?\s*(?P<volt>mV/V|[A-Za-zµ]{{1,6}}|%)(?![A-Za-z0-9/])"
)
_PER_COUNT = re.compile(
    r"(?P<number>[0-9]+(?:[.,][0-9]+)?(?:[eE][+-]?[0-9]+)?)\s*(?P<unit>[A-Za-zµ/]{1,6}?)(?:\s*(?:/|per)\s*"
    r"(?:counts?|cnts?|cts?|digits?|bits?|lsb|incs?|increments?|inkr?|steps?|pulses?|imp|ticks?))?",
    re.IGNORECASE,
)
_CHANNELS = {dimension: role for role, dimension in DIMENSION.items()}
_SIGNALS = ("voltage", "count", "ratio")  # what a scale leads from
_UNKNOWN = (None, "voltage")  # channels of columns that may be the monitor of a current
_AT = r"(?P<{}>[+-]?[0-9]{{1,10}}(?:\.[0-9]{{1,6}})?)(?![.,]?[0-9])\s*(?P<{}>[a-zµ]{{0,6}}|%)"
_ZERO = re.compile(  # zero at 32768; 0 A at 0.4 V; 0.5 A/V x (U - 0.4 V); 2.5 V at 0 A
    rf"(?i)(?<![\w.,])(?:zero|0(?:\.0+)? ?[a-z]{{1,3}}) (?:is )?(?:at|=) {_AT.format('at', 'its')}"
    rf"|\([^()]{{0,30}}[a-z_]\w{{0,30}} ?[-−–] ?{_AT.format('less', 'of')}\)"
    rf"|(?<![\w.,]){_AT.format('mid', 'volt')} (?:\w{{1,12}} )?(?:at|=) (?:zero|0(?:\.0+)? ?m?A)(?![\w.])"
)
(_SHIFT,) = column_names.sentences("shift")
_RANGE = re.compile(r"(?i)\b(?:range|max|limit|full|suppl|rated|bereich|plage|rango)")
_SIGNAL = re.compile(  # a number of volts or counts, and no end of a range
    r"(?P<before>(?:\.\.|[-−–±]|\b(?:to|bis|à|a)) ?)?(?<![\w.,])(?P<number>[0-9]+(?:[.,][0-9]+)?) ?"
    r"(?P<unit>[A-Za-zµ]{1,6})(?![\w/])"
)
_NUMBER_IS = re.compile(  # pwm 255 = 1.5 A
    r"(?<!\w)(?P<name>[^\W\d]\w{0,20})[ =]+(?P<number>[0-9]{1,5})"
    r"\s*(?:=|->|entspricht)\s*(?P<value>[0-9]+(?:[.,][0-9]+)?)\s*(?P<unit>m?A)(?![\w/])"
)
_MARKS = ' #%/*"\t-'
_CONVENTION = words("sign")
_SENSE_NAMES = words("sense") | _CONVENTION
_SENSES = {1: tuple(words("tension_stems")), -1: tuple(words("compression_stems"))}
_POLARITIES = {1: tuple(words("positive_stems")), -1: tuple(words("negative_stems"))}
_WORD = re.compile(r"[^\W\d_]+")
_WORD_OR_SIGN = re.compile(  # tension +, compression gives minus, but no plus between two things
    r"(?i)(?<![\w+/-])(?:(?P<plus>\+|plus)|(?P<minus>-|minus))(?=\s*(?:[,;.()=]|$))|[^\W\d_]+"
)
_PARTICLE = re.compile(r"とも|[とはがのを]")  # 変位と荷重は
_CLAUSE = re.compile(r"[,;|\t，；。]|\.\s")
_IS = {"i", "ist", "est", "e", "count"}  # without an s at the end: compression is positive
_SHORT = 2  # words of a heading
_MOVES = {"velocity": "displacement"}  # counts as


def with_counts(table: RawTable) -> RawTable:
    """Channels recorded in counts, by the scale in their heading: load_cnt [0.25 N/count]."""
    for i, name in enumerate(table.names):
        match = _PER_COUNT.fullmatch((table.units[i] or column_names.unknown_unit(name)).strip())
        if match and column_names.is_unit(match["unit"]):
            factor = float(match["number"].replace(",", "."))
            bare = re.sub(r"[\s_]*(?:counts?|cnts?|raw)$", "", table.headers[i].name, flags=re.IGNORECASE)
            text = f"column {name!r} is scaled as its heading states"
            table = scaled(table, i, bare or table.headers[i].name, match["unit"], factor, text)
    stated = {m.groups() for line in table.lines for m in _NUMBER_IS.finditer(line)}
    for i, header in enumerate(table.headers):
        own = [of for of in stated if of[0].casefold() == header.name.casefold()]  # two: which, or a line through both
        values = table.try_read(i) if len(own) == 1 and own[0][1] in FULL_SCALES and not header.unit else None
        if values is not None and not np.any(np.nan_to_num(values[i]) % 1):
            name, number, value, unit = own[0]
            table = replace(table, remarks=(*table.remarks, f"{name}: {number} counts = {value} {unit}"))
            table = table.named({i: (header.name, "counts")})
    return table


def with_scales(table: RawTable) -> RawTable:
    """Channels recorded in volts or per cent, by a scale the file states: amplifier monitor: 0.5 A/V; 100 % = 2 A."""
    volts = scaled_columns(table)
    for i in volts:
        other = _stated_scale(table, i, volts)
        if other is None:
            continue
        role, unit, factor, line = other
        header = table.headers[i]
        text = f"column {table.names[i]!r} is scaled as the file states: {line.strip()[:60]!r}"
        zero = _zero_of(line, header)
        if zero is None or _shifted_elsewhere(table, i, line, role):
            continue
        name = header.name if header.role == role else f"{role} {header.name}"
        name = name if role_of(name) == role else role
        table = scaled(table, i, name, unit, factor * header.factor, text, zero)
    return table


def counts_in(line: str, names: Collection[str]) -> bool:
    """Tell if a line states a current of a number in one of some columns, by their names in small letters."""
    return any(match["name"].casefold() in names for match in _NUMBER_IS.finditer(line))


def _zero_of(line: str, header: column_names.Header) -> float | None:
    """Return the number of a column that the line of its scale states for zero; None if that is unclear."""
    match = _ZERO.search(line)
    if match is None:
        others = [] if _RANGE.search(line) else _SIGNAL.finditer(SCALE.sub(" ", line))
        others = [m for m in others if not m["before"] and split_name("", m["unit"]).dimension == header.dimension]
        return None if _SHIFT.search(SCALE.sub(" ", line)) or any(m["number"].strip("0.,") for m in others) else 0.0
    groups = (match[key] for key in ("at", "less", "mid", "its", "of", "volt"))
    text, unit_text = (*filter(None, groups), "")[:2]
    number, unit = float(text), parse_unit(unit_text)
    if number and not any(re.search("/|per|pro", of[0]) for of in SCALE.finditer(line)):
        return None  # 10 % = 0 A, 50 % = 1 A: a line through two points
    if unit is None or not number:
        return number
    return number * unit.factor / header.factor if unit.dimension == header.dimension else None


def _shifted_elsewhere(table: RawTable, column: int, own: str, role: str) -> bool:
    """Tell if a line beside that of a column's scale, about the column or about none, states its zero or a gain."""
    label = re.split(r"[:=0-9]", own)[0].strip(_MARKS) or own
    for line in (part.strip(_MARKS) for part in _parts(table) if part not in own):
        match = _ZERO.search(line) or _SHIFT.search(SCALE.sub(" ", line))
        number = match and re.search(r"([0-9.,]+)\s*([^\W\d_]*|%)", match.string[match.start() :])
        if not match or not number or not re.search("[1-9]", match[0] + number[1]):
            continue
        if split_name("", number[2]).dimension not in (None, *_SIGNALS, DIMENSION.get(role)):
            continue
        columns = {i for i, header in enumerate(table.headers) if find_name(line, header.name)}
        roles = {role_of(word) for word in words_of(line) if len(word) > 2}
        about_none = not columns and not roles - {None, "voltage", role} and match.start() == 0
        if column in columns or find_name(line, label) or about_none:
            return True
    return False


def scaled_columns(table: RawTable) -> list[int]:
    """Return the columns in volts, mV/V, counts or per cent, which mean something by a scale alone."""
    return [i for i, header in enumerate(table.headers) if header.dimension in _SIGNALS]


def states_shift(line: str) -> bool:
    """Tell if a line states the zero or a gain of a scale, and no current: offset: 0.4 V; gain 100."""
    shift = _ZERO.search(line[:LONGEST_LINE]) or _SHIFT.search(line[:LONGEST_LINE])
    return bool(shift) and not (stated_by_lines([line], ".") or stated_in_titles([line]))


def _parts(table: RawTable) -> list[str]:
    """Return the lines beside a table, and the parts of those with several scales; without cells headed as ranges."""
    lines = list(table.lines)
    for head in (line for line in table.lines if _RANGE.search(line) and not re.search("[0-9]", line)):
        mark = next((mark for mark in "\t;," if head.count(mark) > 1), None)
        if mark is not None:
            kept, count = [i for i, cell in enumerate(head.split(mark)) if not _RANGE.search(cell)], head.count(mark)
            lines = [mark.join(t.split(mark)[i] for i in kept) if t.count(mark) == count else t for t in lines]
    return [part for t in lines for part in (re.split(r"[,;|\t]\s*", t) if len(scales_in(t)) > 1 else [t])]


def _stated_scale(table: RawTable, column: int, volts: Sequence[int]) -> tuple[str, str, float, str] | None:
    """Return channel, unit, number per volt and line of the scale that can only be meant for a column; else None."""
    name, signal = table.headers[column].name, table.headers[column].dimension
    own = [table.names[column], *table.over[column : column + 1]]
    for lines in (own, _parts(table)):
        scales = []
        for line in lines:
            for role, unit, factor in scales_in(line, (signal,)):
                meant = role_of(name) == role or lines is own or name.casefold() in line.casefold()
                alone = len(volts) == 1 or holds(name, _MONITOR)
                meant = meant or (role == "current" and role_of(name) in _UNKNOWN and alone)
                has = any(header.dimension == DIMENSION.get(role) for header in table.headers)
                if role not in ("", "voltage", "time") and meant and not has:
                    scales.append((role, unit, factor, line))
        scales = [entry for entry in scales if find_name(entry[3], name)] or scales
        if scales:
            return scales[0] if len({entry[:3] for entry in scales}) == 1 else None
    return None


def scales_in(line: str, of: Collection[str | None] = _SIGNALS) -> list[tuple[str, str, float]]:
    """Return channel, unit and number per signal of every scale that a line states: 0.5 A/V, 100 mV/A, 1 V = 2 A.

    The signals are of the given dimensions: what a load cell has per mV/V it has not per volt of its amplifier.
    """
    scales = []
    for match in SCALE.finditer(line[:LONGEST_LINE]):
        one, other = parse_unit(match["unit"]), parse_unit(match["volt"])
        if one is None or other is None or (one.dimension in _SIGNALS) == (other.dimension in _SIGNALS):
            continue
        if not {one.dimension, other.dimension} & {*of}:
            continue
        left, right = (float((match[key] or "1").replace(",", ".")) for key in ("one", "other"))
        if not left or not right:
            continue
        if other.dimension in _SIGNALS:
            scale = _CHANNELS.get(one.dimension, ""), match["unit"], left / (right * other.factor)
        else:
            scale = _CHANNELS.get(other.dimension, ""), match["volt"], right / (left * one.factor)
        scales.append((*scale[:2], -scale[2]) if match["minus"] and scale[0] in SIGNED else scale)
    return scales


def scaled(table: RawTable, column: int, name: str, unit: str, factor: float, text: str, zero: float = 0.0) -> RawTable:
    """Return the table with a column multiplied by a number, in another unit; a scale of the profile replaces it."""
    if role_of(name) in table.calibrated:
        return table.named({column: (name, unit)})
    computed = table.computed(column, (column,), lambda values: rescale(values[column], factor, -zero * factor))
    return computed.named({column: (name, unit)}).noted(Finding("W_SCALE", text))


def with_sense(table: RawTable) -> RawTable:
    """Return a force recorded as a magnitude, with the sign that a column of two words beside it states."""
    forces = table.columns("force")
    senses = [i for i, name in enumerate(table.names) if name.strip().casefold() in _SENSE_NAMES]
    if len(forces) != 1 or len(senses) != 1:
        return table
    words = table.words(senses[0])
    signs = [_sign_of(label, table.remarks) for label in words.labels]
    if sorted(signs) != [-1, 1]:
        return table
    sign, force = np.array(signs)[words.codes], forces[0]

    def signed(values: Mapping[int, Floats]) -> Floats:
        return values[force] if np.nanmin(values[force]) < 0 else sign * values[force]

    note = Finding("W_SCALE", f"the sign of the force is that of column {table.names[senses[0]]!r}")
    return table.computed(force, (force,), signed).noted(note)


def _sign_of(label: str, remarks: Sequence[str]) -> int:
    """1 for tension, -1 for compression, by the word itself or by a line that explains it; 0 if neither says."""
    explained = re.compile(rf"(?<!\w){re.escape(label)}\s*[=:]\s*([^\W\d]+)")
    words = [label, *(match[1] for line in remarks for match in explained.finditer(line))]
    signs = {_sign(_SENSES, word) for word in words} - {0}
    return signs.pop() if len(signs) == 1 else 0


def with_stated_signs(table: RawTable) -> RawTable:
    """Return the table with the senses in which lines count displacement and force: force positive in compression.

    A line of one sense holds for all that it names, unless clauses of it are about the sign of a channel each; else
    each clause does. A line about the sign that names no channel holds for those that no other states; what else may be
    about the sign leaves it unclear, as a clause does whose sense is none of the words known.
    """
    stated: dict[str, set[int]] = {}
    of_both: set[int] = set()  # by lines that name no channel
    for whole in (line for line in table.lines if not any(factor < 0 for *_, factor in scales_in(line))):
        counted, clauses = senses_in(whole), _CLAUSE.split(whole)
        each = [clause for clause in clauses if _signs(_POLARITIES, clause)]
        apart = len(each) > 1 and all(_named(clause) & {*SIGNED} for clause in each) and counted
        for clause in clauses if apart or len(counted) > 1 else [whole]:
            named, others = _named(clause), _others(clause)
            own = senses_in(clause) if not named or named & {*SIGNED} else set()  # a pressure counts otherwise
            if not own and clause in each and (apart or (others & _CONVENTION and (not named or named & {*SIGNED}))):
                own = {1, -1}  # in other words than those known
            general = others & _CONVENTION or others <= _IS | _SENSE_NAMES
            for role in named & {*SIGNED} or {""}:
                stated.setdefault(role, set()).update(own if named or general or -1 not in own else {1, -1})
            of_both |= set() if _named(whole) & {*SIGNED} else own
    if {*SIGNED} <= {*stated} and len(of_both) == 1:  # there is no channel of which such a line could be alone
        stated = {role: own | of_both for role, own in stated.items()}
    unnamed = stated.get("", set()) - {1} and stated[""]
    senses = {role: sum(own) for role in SIGNED if (own := stated.get(role) or unnamed)}
    text = "the file counts compression positive in the {}: its sign is changed unless a profile states it"
    notes = [Finding("W_SCALE", text.format(role)) for role, sense in senses.items() if sense == -1]
    return replace(table, senses=senses).noted(*notes)


def states_sign(line: str) -> bool:
    """Tell if a line may state in which sense a channel counts positive."""
    line = line[:LONGEST_LINE]
    others = _others(line)
    if others & _CONVENTION:
        return bool(_signs(_POLARITIES, line))
    return bool((others <= _IS | _SENSE_NAMES or _named(line) & {*SIGNED}) and senses_in(line))


def _others(clause: str) -> set[str]:
    """Return the words of a clause that are neither senses nor polarities, without an s at the end."""
    words = _WORD.findall(clause)
    return {w.casefold().rstrip("s") for w in words if not _sign(_SENSES, w) and not _sign(_POLARITIES, w)}


def _named(clause: str) -> set[str]:
    """Return the channels that a clause names, by words that are no senses themselves, nor letters before one: v tlaku.

    Such a letter counts where nothing else names a channel.
    """
    words = _WORD.findall(_PARTICLE.sub(" ", clause))
    letters = {letter for letter, word in pairwise(words) if len(letter) == 1 and _sign(_SENSES, word)}
    roles = {word: role for word in words if (role := role_of(word)) and (role == "force" or not _sign(_SENSES, word))}
    named = roles.keys() - letters or roles.keys()
    return {_MOVES.get(role, role) for word, role in roles.items() if word in named}


def _signs(stems: Mapping[int, tuple[str, ...]], clause: str) -> list[int]:
    texts = ("+" if m["plus"] else "-" if m["minus"] else m[0] for m in _WORD_OR_SIGN.finditer(clause))
    return [sign for text in texts if (sign := _sign(stems, text))]


def heads_senses(cell: str) -> bool:
    """Tell if the cells below a heading say in which sense channels count positive: positive, positive direction."""
    named = len(cell.split()) <= _SHORT and any(map(str.isalpha, cell))  # a dash stands for nothing
    return named and bool(_signs(_POLARITIES, cell)) and not _signs(_SENSES, cell)


def senses_in(clause: str) -> set[int]:
    """Return the senses that a clause counts positive: 1 for tension, -1 for compression."""
    senses, polarities = _signs(_SENSES, clause), _signs(_POLARITIES, clause)
    paired = zip(senses, polarities, strict=True) if len(senses) == len(polarities) else product(senses, polarities)
    return {sense * polarity for sense, polarity in paired}


def _sign(stems: Mapping[int, tuple[str, ...]], word: str) -> int:
    """Return 1 or -1 where a word begins with one of its stems, or has a Chinese or Japanese one in it; else 0."""
    low = word.casefold()
    return next((sign for sign, of in stems.items() if low.startswith(of) or any(s in low for s in of if s > "⺀")), 0)
