"""Currents that the names of tests state by a text beside them: a scheme of names, a legend of codes, an example."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from mrdamper.rig_files import conditions
from mrdamper.rig_files.column_names import RATING, Header, is_unit, names_condition, split_name
from mrdamper.rig_files.mapping.results import Results
from mrdamper.rig_files.record import Record

Tests = Sequence[tuple[Path, Record]]
_LEGEND = re.compile(  # I1 = 0.3 A, cur0.8 = coil current 0.8 A (as set)
    r"[\s*`-]*(.{1,60}?)`?\s*(?:=|:|->)\s*([^\W\d_][^\d=:]{0,30}\s)?([0-9]{1,4}(?:[.,][0-9]{1,4})?)\s*(m?A)"
    r"\s*(?:\([^()]*\))?\s*$"
)
_AT_SYMBOL = re.compile(r"(?<![^\W_])([A-Za-z]{1,8})([0-9]+(?:[.p][0-9]+)?)(?![^\W_])")  # I0p5
_DECIMAL_CODE = re.compile(  # i0.5; 1.5v of a driver
    r"(?<![a-z])[a-z]{1,6}[0-9]+\.[0-9]+(?![0-9])|(?<![0-9a-z.])[0-9]+(?:\.[0-9]+)?m?v(?![0-9a-z])"
)
_CODES, _OF_CODES = re.compile("(?:[a-z]{1,6}[0-9]+){2,}"), re.compile("[a-z]+[0-9]+")  # c2f1
_SCHEME = re.compile(r"[\w.,+=-]*(?:<[^<>]{1,60}>[\w.,+=-]*)+")  # MRD_A<amplitude in mm>_I<coil current in A>.csv
_ATTACHED, _JOINED = re.compile(r"(?<=\w)[(\[{]([^()\[\]{}<>]{1,60})[)\]}]"), re.compile(r"\w[(\[{][^_]*[)\]}]_")
_PLACE = re.compile(r"[\s*`-]*([^\W\d_]{1,12})`?(?:\s*[=:]|\s+[-–]\s|\s{2,})\s*([^\s<>][^<>]{0,58}[^\s<>])\s*$")
_NAME_IN_UNIT = re.compile(r"\b([^\W\d_]{3,})\s+(?:(?:is|are)\s+)?in\s+([^\W\d_]{1,3})\b")
_SHARES = {"d": "tenths?|zehntel|dixièmes?", "c": "hundredths?|hundertstel|centièmes?", "m": "thousandths?|tausendstel"}
_NUMBERS = re.compile(r"[\W\d_]*")
_IN_EXAMPLE = re.compile(  # (c05 = 0.5 A); , e.g. 05 = 0.5 A
    r"\s*\([^()]*\b[A-Za-z]*[0-9][^()]*\)|\s*[,;]\s*(?:i\.\s?e\.|e\.\s?g\.|z\.\s?b\.|d\.\s?h\.|p\.\s?ex\.).*", re.I
)
_TIMES = re.compile(r"(?P<name>.*?)(?:\s+x|\s*[×*·])\s*(?P<factor>[0-9]+(?:[.,][0-9]+)?)")  # coil current x 0.1, of A
_SCHEME_NUMBER = re.compile(r"[0-9]+(?:[.,xp][0-9]+)?")
_CODE = re.compile(r"([A-Za-z]{1,6})([0-9]{1,3})(?:\s*(?:-|–|to|bis)\s*\1([0-9]{1,3}))?")  # I1 or test01-test04


def by_legend(lines: Sequence[str], tests: Tests) -> list[tuple[float, str]]:
    """Return the current [A] and the code of every test, by a legend of codes that stand in names: I1 = 0.3 A."""
    files = [{file.name.casefold(), file.stem.casefold()} for file, _ in tests]
    called = set().union(*files)
    stated, ratings = set(), False
    for line in lines:
        parts = re.split(r"\s*[;|]\s*|,\s+(?![^()]*\))|[.:]\s+(?=\w+ ?=)", line)
        matches = [m for m in map(_LEGEND.match, parts) if m and (not m[2] or split_name(m[2]).role == "current")]
        legends = [(name, conditions.amperes(m[3], m[4])) for m in matches for name in _meant(m[1], called)]
        # A record has many rows of numbers.
        rating = not _NUMBERS.fullmatch(line) and RATING.search(line) is not None
        stated |= {*legends} if not (rating or ratings) else set()
        if line.strip() and not legends:  # a heading: Fuses
            ratings = rating
    names_of = [f"{file.stem} {record.id}".casefold() for file, record in tests]
    stems = [re.sub(r"(?<=[A-Za-z])0+(?=[0-9])", "", name) for name in names_of]
    words = [[*re.split(r"[^0-9A-Za-z]+", s), *_DECIMAL_CODE.findall(s.replace(",", "."))] for s in stems]
    words = [
        own + [code for word in own if _CODES.fullmatch(word) for code in _OF_CODES.findall(word)] for own in words
    ]
    codes = _with_scale(dict(stated), {word for own in words for word in own})
    if len(codes) < 2 or len(codes) < len(stated):
        return []
    own = [[code for code in codes if code in {*parts} | names] for parts, names in zip(words, files, strict=True)]
    # Without the 5v of 4.5v.
    own = [[code for code in of if not any(code in o and "." in o for o in of if o != code)] for of in own]
    return [(codes[of[0]], of[0].upper()) for of in own] if all(len(of) == 1 for of in own) else []


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


def by_scheme(lines: Sequence[str], results: Results | None, tests: Tests) -> list[tuple[float, str]]:
    """Return the current [A] of each test by a scheme of names of files, or the number in it and a table of results.

    Thus <coil current in A>, or <duty %> with a table of the current by the duty; empty unless all files have one.
    """
    stated = set[tuple[float, ...]]()
    for header, texts in fields_of_names(lines, tests):
        prefix = re.split("[^A-Za-z]", texts[0], maxsplit=1)[0]  # c of c05 and c10
        numbers = [t.removeprefix(prefix) for t in texts if t.startswith(prefix)]
        numbers = [conditions.amperes(number, "") for number in numbers if _SCHEME_NUMBER.fullmatch(number)]
        at = [i for i, key in enumerate(results.keys if results else ()) if header.name and key == header.name]
        rows = zip(results.cells, results.current, strict=True) if results and len(at) == 1 else ()
        matches = [(_SCHEME_NUMBER.match(cells[at[0]]), of) for cells, of in rows]
        by_number = {conditions.amperes(match[0], ""): of for match, of in matches if match}
        times = _TIMES.fullmatch(header.name)
        factor = header.factor * (conditions.amperes(times["factor"], "") if times else 1.0)
        name = times["name"] if times else header.name
        if header.dimension == "current" and names_condition(name, "current") and not name[-1:].isdigit():
            by_number = {number: factor * number for number in numbers}
        if len(numbers) == len(tests) and {*numbers} <= {*by_number}:
            stated.add(tuple(by_number[number] for number in numbers))
    return [(current, "the names of files") for current in stated.pop()] if len(stated) == 1 else []


def fields_of_names(lines: Sequence[str], tests: Tests) -> Iterator[tuple[Header, list[str]]]:
    """Yield the places in the names of files that a scheme of them has, each with what stands there in every name.

    Thus MRD_I<coil current in A>_f<Hz> or MRD_I(coil current, A)_f(Hz); what a letter or word stands for, a line of its
    own may tell, or its own name: MRD_iiii_ff.csv, iiii: coil current in mA; current_frequency with current in A.
    """
    for sign, share in _SHARES.items():  # hundredths of an ampere
        lines = [re.sub(rf"(?i)\b(?:{share}) (?:of )?(?:an? |d')?amp[eè]res?\b", f"{sign}A", line) for line in lines]
    named = (m.groups() for line in lines for m in _NAME_IN_UNIT.finditer(line))
    meant = {name: f"{name} in {unit}" for name, unit in named if is_unit(unit) or unit in ("cA", "dA")}
    meant |= {m[1]: _IN_EXAMPLE.sub("", m[2]) for m in map(_PLACE.match, lines) if m}
    names = [name for line in lines for name in re.findall(r"\w+_[\w.]+", line) if meant]
    schemes = [re.sub("[^\\W\\d_]+", lambda m: f"<{meant[m[0]]}>" if m[0] in meant else m[0], name) for name in names]
    schemes += [_ATTACHED.sub(r"<\1>", line) if _JOINED.search(line) else line for line in lines]
    stated = [match[0].rstrip(".,") for scheme in schemes if "<" in scheme for match in _SCHEME.finditer(scheme)]
    for parts in (re.split("<([^<>]*)>", scheme) for scheme in stated):
        pattern = "".join("([^_]+?)" if i % 2 else re.escape(part) for i, part in enumerate(parts))
        matches = [re.fullmatch(pattern, file.stem) or re.fullmatch(pattern, file.name) for file, _ in tests]
        texts = zip(*(m.groups() for m in matches if m), strict=True) if all(matches) else ()
        places = (split_name(meant.get(place, place)) for place in parts[1::2])
        yield from ((place, list(own)) for place, own in zip(places, texts, strict=False))
    keyed = [dict(part.split("=", 1) for part in file.stem.split("_") if "=" in part) for file, _ in tests]
    cells = [cell.strip(" `*-.") for line in lines for cell in re.split(r"[,;]\s|: ", line)]
    for key in set.intersection(*map(set, keyed)) if keyed else ():  # I=0.5_freq=2.csv, I coil current in A
        stated = {cell.removeprefix(key).strip("` ") for cell in cells if re.match(rf"{re.escape(key)}\W", cell)}
        yield from ((split_name(text), [own[key] for own in keyed]) for text in (stated if len(stated) == 1 else ()))


def by_example(lines: Sequence[str], tests: Tests) -> list[tuple[float, str]]:
    """Return the current [A] of each test by the number in its name, as a line explains one: I0p5_f2p5 means 0.5 A."""
    stated = set[float]()
    for line in filter(conditions.EXPLAINED.search, lines):
        currents, numbers = conditions.currents_in(line), _numbers_of_currents(line)
        stated |= {current / number for current in currents for number in numbers if len(numbers) == 1 and number}
    named = [_numbers_of_currents(record.id) for _, record in tests]
    whole = len(stated) == 1 and all(len(numbers) == 1 for numbers in named)
    return [(scale * of[0], "an example of names") for of in named for scale in stated] if whole else []


def _numbers_of_currents(name: str) -> list[float]:
    """Return the numbers behind symbols and words for a current in a name: I0p5_f2p5."""
    return [conditions.amperes(m[2], "A") for m in _AT_SYMBOL.finditer(name) if split_name(m[1]).role == "current"]


def _meant(key: str, files: Collection[str]) -> list[str]:
    """Return the codes that the key of a legend names, or the file: I1, test01-test04, a.dat."""
    code = _CODE.fullmatch(key)
    level = re.sub("(?<=[0-9]) (?=m?v$)", "", key.rpartition(": ")[2].casefold().replace(",", "."))  # driver: 1,5 V
    if code is None and _DECIMAL_CODE.fullmatch(level):
        return [level]
    if code is None:
        return [key.casefold()] if key.casefold() in files else []
    return [f"{code[1].casefold()}{number}" for number in range(int(code[2]), int(code[3] or code[2]) + 1)]
