"""Words, units and names of columns as laboratories write them, from `words.toml`; only here is a unit interpreted.

The field's units stand in a table, as a library of all units takes longer to import than
most files take to read; pint knows the rest.
"""

from __future__ import annotations

import re
import tomllib
import unicodedata
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from itertools import pairwise
from types import MappingProxyType
from typing import Any, NamedTuple

TABLES: Mapping[str, Any] = tomllib.loads(files("mrdamper.rig_files").joinpath("words.toml").read_text("utf-8"))
KEYS: Mapping[str, Sequence[str]] = TABLES["keys"]
UNIT_KEYS = frozenset(KEYS["unit"])
_LETTERS = str.maketrans("łøıđß", "loids")
_INVISIBLE = dict.fromkeys(map(ord, "\u200b\u200c\u200d\u200e\u200f\ufeff"))  # between or beside letters
_FEWEST_LETTERS = 4  # of a word that is known without its accents: cas is another word than čas


def words(kind: str) -> frozenset[str]:
    """Return the words of a kind: coil, computed, run, ..."""
    return frozenset(TABLES["words"][kind])


def sentences(kind: str) -> tuple[re.Pattern[str], ...]:
    """Return the forms of sentences or names of a kind: sampling rates of rows, names of files of notes, ..."""
    return tuple(re.compile(re.sub(r"(?:^|\n) *", "", form)) for form in TABLES["sentences"][kind])


def meanings(table: str) -> dict[str, str]:
    """Return what each word of a table stands for, also where it is written without its accents: prad, forta."""
    own = {word: meaning for meaning, of in TABLES[table].items() for word in of}
    plain = {_without_accents(word): meaning for word, meaning in own.items()}
    return {word: meaning for word, meaning in plain.items() if len(word) >= _FEWEST_LETTERS} | own


def _without_accents(word: str) -> str:
    return "".join(sign for sign in unicodedata.normalize("NFKD", word.translate(_LETTERS)) if sign.isascii())


@dataclass(frozen=True, slots=True)
class Unit:
    """Unit: SI value = factor * number + offset."""

    dimension: str  # "time", "length", "force", "velocity", ...
    factor: float
    offset: float = 0.0  # of temperatures [°C]


_UNITS = {
    name: Unit(dimension, *(factor if isinstance(factor, list) else [factor]))
    for dimension, units in TABLES["units"].items()
    for name, factor in units.items()
}
_WORDS = meanings("unit_names")
SI = MappingProxyType(
    {
        "time": "s", "displacement": "m", "force": "N", "velocity": "m/s", "acceleration": "m/s²", "current": "A",
        "voltage": "V", "temperature": "°C", "pressure": "Pa",
    }
)  # fmt: skip
DIMENSION = MappingProxyType({name: "length" if name == "displacement" else name for name in SI})  # of a channel
_PINT = {
    "[time]": "time", "[length]": "length", "[mass] * [length] / [time] ** 2": "force",
    "[length] / [time]": "velocity", "[length] / [time] ** 2": "acceleration", "[current]": "current",
    "[mass] * [length] ** 2 / [current] / [time] ** 3": "voltage",
}  # fmt: skip
_PLAIN = re.compile(r"[A-Za-zµμΩ°]{1,20}(?:\^?-?[1-4])?(?:[*/·⋅ ][A-Za-zµμΩ°]{1,20}(?:\^?-?[1-4])?){0,3}")


def parse_unit(text: str) -> Unit | None:
    """Return the unit a text states, None if it states none that is known."""
    return (_from_table(text) or _from_pint(text)) if len(text) <= 40 else None


def is_unit(text: str) -> bool:
    """Tell if a text is nothing but one of the field's units."""
    return len(text) <= 40 and _from_table(text) is not None


@lru_cache(maxsize=512)
def _from_table(text: str) -> Unit | None:
    text = _normal(text)
    text = _WORDS.get(text.lower(), text)
    if text in _UNITS:
        return _UNITS[text]
    if (part := re.fullmatch("1/(10+) (.+)", text)) and (whole := _from_table(part[2])):  # 1/100 mm
        return Unit(whole.dimension, whole.factor / int(part[1]))
    if text.isupper() and text.isascii():  # some programs write all of a header in capitals
        same = [unit for name, unit in _UNITS.items() if name.upper() == text]
        return same[0] if same and all(unit == same[0] for unit in same) else None
    return None


def shown_unit(text: str) -> str:
    """Return a unit as it is written where a program has all of its header in capitals: daN of DAN."""
    text = text.rstrip(".")
    capitals = text.isupper() and text not in _UNITS
    return next((name for name in _UNITS if name.upper() == text), text) if capitals else text


def _normal(text: str) -> str:
    """One writing for the many of m/s²: m/s^2, m s-2, m_s2, m/s**2, m·s⁻²."""
    text = " ".join(text.translate(_INVISIBLE).strip().rstrip(".").split())
    for old, new in (("µ", "u"), ("μ", "u"), ("²", "2"), ("³", "3"), ("⁻¹", "-1"), ("⁻", "-"), ("**", "^"), ("º", "°")):
        text = text.replace(old, new)
    text = text.replace("^", "").replace("_per_", "/").replace(" per ", "/").replace("° ", "°")
    text = re.sub("(?i)^deg(?:rees?)?[ _]?([CF])$", r"deg\1", text)
    if "/" not in text:
        text = re.sub(r"^([A-Za-z]{1,2})[ ·⋅*.]?s-([12])$", lambda m: f"{m[1]}/s{m[2].replace('1', '')}", text)
        text = re.sub(r"^([a-z]{1,2})_s([2]?)$", r"\1/s\2", text)
    return re.sub(r"/s/s$", "/s2", re.sub(r"(?i)/sec", "/s", re.sub(r"\s*/\s*", "/", text)))


@lru_cache(maxsize=512)
def _from_pint(text: str) -> Unit | None:
    if not _PLAIN.fullmatch(text) or len(text) < 2:
        return None
    import pint

    try:
        quantity = _registry().Quantity(1.0, text).to_base_units()
    except (pint.errors.PintError, ValueError, TypeError, KeyError, AttributeError, ArithmeticError, SyntaxError):
        return None
    dimension = _PINT.get(str(quantity.dimensionality), str(quantity.dimensionality))
    return Unit(dimension, float(quantity.magnitude))


@lru_cache(maxsize=1)
def _registry():
    import pint

    return pint.UnitRegistry(cache_folder=None)


WORDS = {role: frozenset(names) for role, names in TABLES["channels"].items()}
_ROLES, _SYMBOLS, _COMPOUNDS = meanings("channels"), meanings("symbols"), meanings("compounds")
_LABELS = words("run_number")
COIL, COMPUTED, WEIGHT = words("coil"), words("computed"), words("weight")
_SET, _NOT_MEASURED, _ELSEWHERE = words("set"), words("not_measured"), words("elsewhere")
_MEANINGFUL = frozenset().union(_ROLES, _NOT_MEASURED, COMPUTED, _ELSEWHERE, _SET)
_COMMANDED = re.compile("|".join(words("commanded")))
# Of a line or a number that is not the value of the test.
RATING = re.compile("(?i)" + "|".join(words("rating") | words("probe")))
_COMPRESSION = tuple(words("compression"))
_FACTOR = re.compile(r"[\s_][x×*·]\s?10+(?![0-9])|\bp-p\b")  # Force x10, Force p-p
_CONDITION = re.compile(r"=\s*[+-]?[0-9]")  # stroke = 40
_BRACKETED = re.compile(r"^(?P<name>.*?)\s*[\[({<](?P<unit>[^\[\](){}<>]{1,40})[\])}>]\s*$", re.DOTALL)
_INNER = re.compile(  # Position (mm) - Mod1/ai0; Force (N) Run #1, whose run is part of the name
    r"^(?P<name>[^\[({<]+?)\s*[\[({<](?P<unit>[^\[\](){}<>]{1,20})[\])}>]"
    r"\s*(?:(?:[-–:,;@|/]|(?:at|for|bei|mit|à|con|com)\b).*"
    rf"|(?P<run>(?i:{'|'.join(words('run'))})\W*[0-9].*))$",
    re.DOTALL,
)
_SLASHED = re.compile(r"^(?P<name>.*\S)\s*(?:\s/\s*|,\s*|\s+(?:in|en|em)\s+|\s*;\s*)(?P<unit>\S{1,20})$", re.DOTALL)
_EAST_ASIAN = re.compile("[\u3040-\u30ff\u4e00-\u9fff\uac00-\ud7af]")
_LONGEST_NAME = 200  # beyond, it is no name, and matching it could take long
# Time  1 - default sample rate
_RATE_GROUP = re.compile(r"\s+\d*\s*-\s*(?:default|fast|slow) sample rate", re.IGNORECASE)
_DEVICE = re.compile(r"\\[\w.-]{1,30}:[0-9]{1,3}$")  # F_rod\ES650:1
_NODE = re.compile(r'(?<![^\s",;|])nsu?=[^;,"]{1,80};([isgb])=')  # of OPC UA, before the name of a node: ns=4;s=
_NUMBER = re.compile("(?<![0-9])(?:0|[1-9][0-9]*)$")
_FUSED = re.compile(r"[ _.:-]+|(?<=[a-z])(?=k?Hz$)")  # sampleRateHz
_SET_OR_ACTUAL = re.compile(rf"(?i)(?<![^\W\d_])(soll|ist)(?=(?:{'|'.join(_COMPOUNDS)}))")  # Sollweg and Istweg
_AROUND_UNITS = words("around_units")
_NEXT = re.compile(r"[,;|\t()]| (?:and|und|et|y|e|oraz|och|og|и) ")  # between the units of two channels
_SMALL = MappingProxyType({"a": "current", "n": "force"})  # units of one letter in names in small letters
_BY_UNIT = MappingProxyType({"length": "displacement", "force": "force", "current": "current"})


class Header(NamedTuple):
    """Header of a column: name, unit and channel."""

    name: str  # without the unit
    unit: str

    @property
    def known(self) -> Unit | None:
        """The unit, if it is known."""
        return parse_unit(self.unit)

    @property
    def dimension(self) -> str | None:
        """Of the unit, if it is known."""
        return self.known.dimension if self.known else None

    @property
    def factor(self) -> float:
        """Of the unit to SI; one, if it is not known."""
        return self.known.factor if self.known else 1.0

    @property
    def role(self) -> str | None:
        """The channel the name stands for: of Time_Force in s the time."""
        role = role_of(self.name)
        if role in (None, "time") or self.dimension != "time":
            return role
        return "time" if "time" in map(role_of, words_of(self.name)) else role

    @property
    def channel(self) -> str | None:
        """The channel the name stands for, or its unit where the name says nothing: s_Daempfer in mm."""
        by_unit = _BY_UNIT.get(self.dimension or "")
        return self.role or (by_unit if by_unit and says_nothing(self.name) else None)


@lru_cache(maxsize=4096)
def split_name(header: str, unit: str = "") -> Header:
    """Name and unit of a column whose header may hold both: `force_N`, `Force [kN]`, `Kraft in kN`."""
    if len(header) > _LONGEST_NAME:
        return Header(header, unit)
    text = _DEVICE.sub("", unicodedata.normalize("NFKC", without_namespaces(header)).translate(_INVISIBLE).strip())
    if unit:
        match = _BRACKETED.match(text)
        return Header(match["name"] if match and (parse_unit(match["unit"]) or ":" in match["unit"]) else text, unit)
    for pattern in (_BRACKETED, _SLASHED):
        match = pattern.match(text)
        if match and parse_unit(match["unit"].strip()):
            return Header(match["name"].strip(), match["unit"].strip())
    inner = _INNER.match(text)
    if inner and parse_unit(inner["unit"].strip()):
        return Header(f"{inner['name'].strip()} {inner['run'] or ''}".rstrip(), inner["unit"].strip())
    # The longest tail that is a unit: velocity_m_s before velocity_m and s.
    for place in _FUSED.finditer(text):
        tail = text[place.end() :]
        if place.start() and is_unit(tail) and not text[: place.start()].endswith(" of"):  # time of day
            return Header(text[: place.start()].strip(), tail)
    name, slash, tail = text.partition("/")
    if slash and name and is_unit(tail) and not is_unit(text) and text.casefold() != "s/n":  # serial number
        return Header(name.strip(), tail.strip())
    match = _BRACKETED.match(text)
    own = parse_unit(text) if len(text) > 3 and is_unit(text) else None  # Amps, Newtons
    return Header(match["name"].strip() or text if match else text, text if own and own.dimension in _BY_UNIT else "")


def without_namespaces(text: str) -> str:
    """Return a text with the nodes of OPC UA by their names: Rig.Load of ns=4;s=Rig.Load, node 1042 of ns=2;i=1042."""
    return _NODE.sub(lambda match: "node " * (match[1] == "i"), text)


def headers_of(names: Sequence[str], units: Sequence[str]) -> tuple[Header, ...]:
    """Return the headers of a table's columns; a tail of one small letter is a unit where no other name has a like one.

    Thus `current_a` is in A, but not beside `current_b`.
    """
    headers = [split_name(name, unit) for name, unit in zip(names, units, strict=True)]
    heads = [name[:-2] for name in names if name[-2:-1] == "_"]
    for i, header in enumerate(headers):
        head, _, letter = header.name.rpartition("_")
        small = not header.unit and letter in _SMALL and header.name.islower() and heads.count(head) == 1
        if small and role_of(head) == _SMALL[letter]:
            headers[i] = Header(head, letter.upper())
    return tuple(headers)


def words_of(name: str) -> list[str]:
    """Return the words a name is made of: coil_current, coilCurrent, Coil current."""
    name = _SET_OR_ACTUAL.sub(r"\1 ", name[:_LONGEST_NAME])
    return [word for word in re.split(r"[^\w]+|_|(?<=[a-zà-ÿ])(?=[A-Z])", name) if word]


@lru_cache(maxsize=4096)
def role_of(name: str) -> str | None:
    """Return the channel a name stands for, None if it says nothing or names a command."""
    if len(name) > _LONGEST_NAME:
        return None
    name = _RATE_GROUP.sub("", name)
    words = words_of(name)
    lower = [w.casefold().rstrip("0123456789") or w for w in words]
    if any(word in _NOT_MEASURED or word in COMPUTED or word in _ELSEWHERE for word in lower) or _FACTOR.search(name):
        return None
    if _COMMANDED.search(name) or _CONDITION.search(name):
        return None
    if len(words) == 1 and words[0] in _SYMBOLS:
        return _SYMBOLS[words[0]]
    if len(words) == 1 and (symbol := _NUMBER.sub("", words[0])) in _SYMBOLS:  # t1, x1, F1; v01 is the first variable
        return _SYMBOLS[symbol]
    roles = [role for role in map(_role_of_word, lower) if role is not None]
    if not roles and words and _SYMBOLS.get(words[0]) == "current" and COIL & {*lower[1:]}:  # I_coil, iDmprCoil_FL
        return "current"
    # "load displacement" is a displacement: the last word is the noun in the languages at hand.
    return roles[-1] if roles else None


def _role_of_word(word: str) -> str | None:
    if word in _ROLES:
        return _ROLES[word]
    if _EAST_ASIAN.search(word):  # written without spaces: 线圈电流, 阻尼力; the longest ending, as 压力 is no 力
        ends = [(len(w), role) for w, role in _ROLES.items() if not w.isascii() and word.endswith(w)]
        return max(ends)[1] if ends else None
    if len(word) < 5:
        return None
    return next((role for end, role in _COMPOUNDS.items() if word.endswith(end) and word != end), None)


def holds(name: str, words: Collection[str]) -> bool:
    """Tell if a name holds one of some words: of `COIL`, `COMPUTED`, `WEIGHT`, in any case, numbered or not."""
    return any(word.casefold() in words or word.casefold().rstrip("0123456789") in words for word in words_of(name))


def is_called(name: str, words: Collection[str]) -> bool:
    """Tell if a name is one of some words, alone or with a word for a number or a label: Run, Run No., damper ID."""
    own = {*words_of(split_name(name).name.casefold())}
    return not own.isdisjoint(words) and own <= {*words, *_LABELS}


def units_in(line: str, names: Collection[str] = ()) -> list[tuple[str, str]]:
    """Return the channels of which a line states the unit and nothing else, and the units: the force column is in N.

    A letter stands for a channel only if it is one of some names of columns. Behind such a name other texts may stand:
    x; displacement; cm; LVDT, also as a row of a table: | x | displacement | cm |.
    """
    name, *others = (cell.strip(" `*") for cell in re.split(r"; |[|\t]", line.strip(" |")))
    if name.casefold() in names and (role := role_of(name)) and sum(map(is_unit, others)) == 1:
        unit = next(filter(is_unit, others))
        return [(role, unit)] if split_name("", unit).dimension == DIMENSION[role] else []
    line = re.sub(r"\(([^()]*)\)", lambda aside: aside[0] if is_unit(aside[1]) else "", line)
    return [stated for sentence in line.split(". ") for stated in _units_in_sentence(sentence, names)]


def _units_in_sentence(sentence: str, names: Collection[str]) -> list[tuple[str, str]]:
    cells = [cell.strip(' `*#"') for cell in _NEXT.split(sentence)]
    stated = []
    for cell, behind in pairwise([*cells, ""]):
        text = f"{cell} in {behind}" if is_unit(behind) else re.sub(r"\s*[:=]\s+", " in ", cell.rstrip("."))
        header = split_name(text)
        named = [word for word in words_of(header.name) if word.casefold() not in _AROUND_UNITS]
        if len({*map(role_of, named)}) == 1 < len(named) and named[0].casefold() in names:
            named = named[:1]  # f: force
        one = header.unit and len(named) == 1 and (len(named[0]) > 2 or named[0].casefold() in names)
        role = role_of(named[0].removesuffix("s")) if one else None  # forces
        if role and header.dimension == DIMENSION[role]:
            stated.append((role, header.unit))
        elif named and not is_unit(cell):
            return []  # of a table, a figure or another file
    return stated


def names_compression(name: str) -> bool:
    """Tell if a name contains compression, which rigs that use the word mostly count positive."""
    return any(word.casefold().startswith(_COMPRESSION) for word in words_of(name))


def names_condition(key: str, role: str) -> bool:
    """Tell if the name of a line or an attribute stands for a channel's value in the whole test, set or measured."""
    kept = [word for word in words_of(key) if word.casefold() not in _SET]
    return bool(kept) and role_of(" ".join(kept)) == role and not RATING.search(key)


def names_coil(header: Header) -> bool:
    """Tell if a column or number in A is named after the coil, measured or set, and nothing else: COIL_SET_A."""
    own = {word.casefold() for word in words_of(header.name)}
    return header.dimension == "current" and not own.isdisjoint(COIL) and own <= COIL | _SET


def names_command(name: str) -> bool:
    """Tell if a name states the command to a machine, or its error, rather than what was measured."""
    return holds(name, _NOT_MEASURED | _SET) or _COMMANDED.search(name) is not None


def says_nothing(name: str) -> bool:
    """Tell if a name holds no word of a channel, of a command or of another place."""
    return not any(w.casefold().rstrip("0123456789") in _MEANINGFUL for w in re.split(r"[^\w]+|_", name) if w)


def unknown_unit(header: str) -> str:
    """Return the text in brackets behind a name that is no known unit."""
    match = _BRACKETED.match(header[:_LONGEST_NAME])
    return "" if match is None or match["unit"].strip("- ") == "" else match["unit"].strip()


def find_name(line: str, name: str) -> re.Match[str] | None:
    """Return where a line has a name as a word of its own."""
    return re.search(rf"(?<!\w){re.escape(name)}(?!\w)", line, re.IGNORECASE) if name else None
