"""Quantities that laboratories keep beside the columns: coil current, rate, clock, motion.

A number counts only with a unit behind it or in its name; two writings that contradict each
other are refused, not chosen from.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from datetime import date, time
from functools import lru_cache
from types import MappingProxyType
from typing import NamedTuple

from mrdamper.rig_files import column_names
from mrdamper.rig_files.column_names import sentences, words
from mrdamper.rig_files.text.tokens import MONTHS

LARGEST_STATED = 15.0  # [A]: more is no coil current of a damper but another number
_AGREE = 0.05, 0.15  # a nominal and a measured current may differ by so much: [A], and of it
WRITTEN = 0.01, 0.02  # and two numbers written for one current
(_IN_NAME,) = sentences("current_in_name")
_BEHIND_DIGITS = re.compile(r"(?<![0-9])([0-9]|1[0-4])_([0-9]+)[ _]?A(?![A-Za-z0-9])")  # MRD-7_0A: 0 or 7.0 A
_BEFORE = re.compile("([A-Za-z]+)[-_ =]?$")  # letters before a label
_LEVELS, _RUNS = words("current_level"), words("run")
_CORNERS, _DAMPERS = words("corner"), words("damper")  # of a vehicle, each with a damper of its own; called by number
_BEHIND_LABEL = re.compile(  # MRD-7_0.5A: no decimal is written so
    r"(?<![0-9])[0-9]+_[0-9]+(?:[.,xp][0-9]+[ _]?m?|[ _]?m)A(?![A-Za-z0-9])"
)
_BEHIND_LONG_LABEL = re.compile(r"(?<![0-9])[0-9]{2,}_[0-9]+[ _]?A(?![A-Za-z0-9])")  # run12_1A
LETTER_AS_MARK = re.compile(  # the decimal mark may be the letter of the unit: 0A5, as 4K7 of a resistor
    r"(?<![A-Za-z0-9.,])([0-9]{1,2})A([0-9]{1,2})(?![A-Za-z0-9])"
)
_LARGEST_STEP = 5  # [A] of tests at whole amperes, from 0 A on
_NEXT_NUMBER = re.compile(r"_A_[0-9.]+(?:_|\.[a-z]{2,4}$|$)")  # 2_A_20: the name of the next number
_NEGATIVE = re.compile(r"[=:]\s*[-−]$")  # a dash elsewhere may stand between two parts of a name
_NUMERIC_CELL = re.compile(r"[,;]\s*\"?[+-]?[0-9.]+\"?\s*(?:[,;]|$)")
_LINE = re.compile(
    r"^[\s#%/\"]*(?P<key>[^:=;\t]{1,60}?)[\s\"]*(?:[:=;\t]|(?<![0-9]),|,(?![0-9]+(?![0-9.])))[\s:=;,\t\"]*(?P<number>[+-]?(?:\.[0-9]+|[0-9]+(?:[.,][0-9]+)?)(?:[eE][+-]?[0-9]{1,2})?)"
    r"[\s;,\t\"]*[\[(]?(?P<unit>(?:1/)?(?:[^\W\d_]|/){0,11}(?:-1)?)[\])]?[\s;,\t\"]*$"
)
CELL = re.compile(r"\s*([+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+))\s*((?:[^\W\d_]|°){0,8})\s*")  # with a unit
LONGEST_LINE, _LONGEST_NAME, _MOST_PARTS = 300, 255, 20
_TOLERANCE = re.compile(r"\s*(?:\+\s?/?\s?[-−]|±)\s*[0-9]+(?:[.,][0-9]+)?\s*%?")
_LEADERS = re.compile(r"(?<=[^\s\d.])\s*\.{4,}\s*")  # COIL CURRENT (A) ...... 0.5
FULL_SCALES = ("100", "1000", "255", "1023", "4095", "16383", "32767", "65535")  # largest numbers of converters
_OF_SCALE = r"(?:m?[VA]|k?N|[mµ]?m|bar|counts?|bits?)"  # units
_SCALE = re.compile(  # 60 mV = 10 A, 1 A per V, 0.5 A/V * U - 0.2 A, 2 A corresponds to 10 V, pwm 255 = 1.5 A
    r"[0-9]\s*(?:%|m?V\b|counts?\b|bits?\b)[^=:;]*=|\bper\b|\b100 ?%|A ?/ ?(?:m?V|%)[^=:;]*[-−–+] ?[0-9]"
    rf"|[0-9] ?{_OF_SCALE}\s*(?:=|[-=]>|→|≙|corresponds?(?: to)?|entspricht)\s*[0-9.,]+ ?{_OF_SCALE}\b"
    r"|[0-9] ?m?A at [0-9.,]+ ?m?V\b|[0-9] ?m?V at [0-9.,]+ ?m?A\b|\b4 ?(?:-|–|to|bis|\.{2,3}) ?20 ?mA\b|A nominal\b"
    rf"|(?:(?<![\w.,])(?:{'|'.join(FULL_SCALES)})|(?i:pwm|dac|adc|duty)[ =]+[0-9.]+)"
    r"\s*(?:=|->|entspricht)\s*[0-9.,]+ ?m?A\b"
    r"|=\s*(?:\([A-Za-z]\w* ?[-−–+] ?[0-9.,]+\)|[A-Za-z]\w*) ?[/*×·] ?[0-9]"
    r"|\b(?:[Tt]ype?|[Mm]odel)\b[ :=]*[A-Za-z]+-[0-9.,]+ ?m?A\b"
)
_NAMES = (*column_names.meanings("channels").items(), *column_names.meanings("symbols").items())
_CURRENTS = words("currents") | {word.casefold() for word, meaning in _NAMES if meaning == "current"}
_AROUND_CURRENTS = words("around_currents") | column_names.COIL
_NUMBER = r"[0-9]+(?:[.,xp][0-9]+)?"
_LISTED = re.compile(  # 0, 1, 2 A; 0 to 2 A; 0-2A; 0.5-2A: of 3-2A, 3 may be the number of a test
    rf"(?:(-?{_NUMBER})[\s_-]*(?:([,;/])\s*{_NUMBER}\s*\2|(?<![A-Za-z])(?:and|und|et|to|bis)(?![A-Za-z])"
    r"|\.{2,3})[\s_-]*"
    rf"|(?<![0-9A-Za-z.,-])(0|[0-9]+[.,xp][0-9]+)\s?[-–]\s?)({_NUMBER})[\s_]*(m?A)(?![A-Za-z0-9])"
)
_AND = r"(?:,?\s(?:and|und|et|y|e|en|och|og|i|и)\s|[;/、]\s*|,\s+)"
_SERIES = re.compile(
    rf"(?<![\w.,-])(?![0-9]/[0-9]\s?m?A)({_NUMBER}(?:(?:\s?m?A)?{_AND}{_NUMBER})+)\s?(m?A)(?![A-Za-z0-9/])"
)  # 0, 0.5 and 1 A
EXPLAINED = re.compile("|".join(words("explained")), re.IGNORECASE)
_LABELLED_RATING = re.compile(
    "|".join([r"fuse|suppl|amplif|rated|range|clamp|(?<![a-z])(?:max|limit)(?![a-z])", *words("probe")]), re.IGNORECASE
)
_MOTIONS = {  # an id has 0_5_Hz of the title 0,5 Hz
    unit: re.compile(rf"(?<![\d.,xX])(?<!\d[pP])(?<!\D0_)(\d{{1,4}}(?:[.,xpXP]\d{{1,4}})?)[ _]?{behind}")
    for unit, behind in (("Hz", "(m?)(?i:hz(?![a-z]))"), ("mm", "(?i:mm)()(?![A-Za-z/]|[ _]?[sS])"))  # MHz: a clock
}
_AMPERES = {  # in other scripts; a small letter counts tests: тест 5 а
    unit: "|".join(f"(?i:{name})" if len(name) > 1 else name.upper() for name in names if not name.isascii())
    for unit, names in column_names.TABLES["unit_names"].items() if unit in ("A", "mA")
}  # fmt: skip
_OTHER_SCRIPT = re.compile(rf"(?<=[0-9])\s?(?:(?P<mA>{_AMPERES['mA']})|(?P<A>{_AMPERES['A']}))(?!\w)")
(CHOICE,) = sentences("choice")
_SAMPLING = "|".join(words("sampling"))
_RATE = re.compile(rf"{_SAMPLING}|messrate|^(?:data )?rate$|scan|acquisition|^fs$|^f_s$", re.IGNORECASE)
OTHER_DEVICE = re.compile("|".join(words("other_device")), re.IGNORECASE)
_STEP = re.compile("|".join([sentences("step")[0].pattern, _SAMPLING]), re.IGNORECASE)
(_SHARE,) = sentences("share")
_WHOLE = re.compile(r"\b100 ?%[^=:]{0,30}[=:]\s*([0-9]+(?:[.,][0-9]+)?)\s*(m?A)\b")  # 100 % duty = 2 A
_RATE_IN_NAME = re.compile(
    r"(?<![A-Za-z0-9.])(?:fs[_=]?(?P<a>[0-9]+(?:[.,][0-9]+)?)[ _]?(?P<ka>k?)Hz"
    r"|(?P<b>[0-9]+(?:[.,][0-9]+)?)[ _]?(?P<kb>k?)Hz[_ ]?fs(?![A-Za-z]))"
)
_SPACED = re.compile(
    r"^[\s#%/\"]*(?P<key>[^\d:=;,\t]{1,60}?)\s+(?P<number>[+-]?[0-9]+(?:[.,][0-9]+)?(?:[eE][+-]?[0-9]{1,2})?)\s*(?P<unit>(?:1/)?(?:[^\W\d_]|/){1,11}(?:-1)?)\s*$"
)
BARE_RATE = re.compile(r"(?i)f_?s|(?:sampl(?:e|ing)|scan|abtast)[ _]?(?:rate|freq(?:uency)?)")
_BARE_STEP = re.compile(
    r"(?i)d_?t|delta_?t|(?:sampl(?:e|ing)|time|wf|x)[ _]?(?:delta|step|inc(?:r(?:ement)?)?|interval)|delta_?x"
)
PADDED = re.compile(r"(?<![0-9.,xpA-Za-z])0[0-9]A(?![A-Za-z0-9])")  # 05A: half an ampere, or five
_TWO_DIGITS = re.compile(r"(?<![0-9.,xpA-Za-z])[1-9][0-9]A(?![A-Za-z0-9])")
_START = re.compile(r"(?i)[tx]_?0|(?:start|x)[ _]?time|wf_start_offset|x_?start")
_DAYS = tuple(  # the surest form first: 2024-05-31, 31/5/2024, 31 May 2024 and May 31, 2024
    re.compile(rf"(?<!\d){form}(?!\d)")
    for form in (
        r"(?:19|20)\d\d(?P<mark>[-./])\d{1,2}(?P=mark)\d{1,2}",
        r"\d{1,2}(?P<mark>[-./])\d{1,2}(?P=mark)(?:19|20)\d\d",
        r"(?<!\w)(?P<mark>)(?:\d{1,2}[. -]+[^\W\d_]{3,9}|[^\W\d_]{3,9}[. ]+\d{1,2})[., -]+(?:19|20)\d\d",
    )
)
TIME_OF_DAY = re.compile(
    r"(?i)(?<![0-9:])([0-2]?[0-9]):([0-5][0-9])(?::([0-5][0-9])(?:[.,:]([0-9]{1,6})[0-9]*)?)?(?![0-9:])(?:\s*([ap])m\b)?"
)
(_FREQUENCY_KEY,) = sentences("frequency_key")
(_AMPLITUDE_KEY,) = sentences("amplitude_key")
_TURNS = re.compile(r"speed|rpm|drehzahl|crank|régime|vitesse|velocidad|giri|обороты|转速|回転", re.IGNORECASE)


class Statement(NamedTuple):
    """A current [A] that something beside the columns states, and where."""

    amperes: float
    whence: str


def currents_in(text: str) -> tuple[float, ...]:
    """Coil currents [A] in a title, a sheet's or a file's name: every distinct one.

    `1200mA`, `1.2 A`, `0p4A`, `0x25A`, `-0.3A-`, `I0.4A`; 0_5A may be five or half an ampere and states
    none, nor does what stands beside a fuse, a supply or a limit.
    """
    return _currents_in(text[:_LONGEST_NAME])


@lru_cache(4096)
def _currents_in(text: str) -> tuple[float, ...]:
    text = _in_ascii(text)
    text = _OTHER_SCRIPT.sub(lambda match: f" {match.lastgroup}", text)
    if behind_digits(text) or _LABELLED_RATING.search(text):
        return ()
    # 04A may be four or 0.4 amperes; 0400mA is padded.
    stated = [match for match in _IN_NAME.finditer(text) if match[2] or not re.fullmatch("0[1-9]+", match[1])]
    stated = [match for match in stated if not _NEXT_NUMBER.match(text, match.end(1))]
    stated = [m for m in stated if m[0] != f"{m[1]}_A" or amperes(m[1], "A") <= LARGEST_STATED]  # damper_7731_A: a code
    signs = [-1.0 if _NEGATIVE.search(text[: match.start()]) else 1.0 for match in stated]
    currents = [sign * amperes(match[1], f"{match[2]}A") + 0.0 for sign, match in zip(signs, stated, strict=True)]
    listed = _LISTED.search(text)
    currents += [amperes(number, listed[5]) for number in (listed[1] or listed[3], listed[4])] if listed else []
    return tuple(dict.fromkeys(currents))


def _in_ascii(text: str) -> str:
    """Return a text with the digits, colons and signs of numbers as in ASCII: of full width, Persian, a long minus."""
    text = unicodedata.normalize("NFKC", text)
    digits = text if text.isascii() else "".join(str(unicodedata.decimal(sign, sign)) for sign in text)
    return digits.replace("−", "-").replace("٫", ".")


def may_lack_point(name: str, names: Iterable[str]) -> bool:
    """Tell if the current of two digits in a name may lack its decimal point: 10A, beside a name such as 05A."""
    return bool(_TWO_DIGITS.search(name)) and any(map(PADDED.search, names))


def behind_digits(name: str) -> re.Match[str] | None:
    """Return the digits of a name that are a current or, with those before them, a decimal: MRD-7_0A, 0 or 7.0 A.

    Two digits before them begin a decimal only behind a word for a current: at10_5A, but not run10_1A. 0_0A is 0 A
    either way.
    """
    matches = (m for m in _BEHIND_DIGITS.finditer(name) if float(f"{m[1]}.{m[2]}") != float(m[2]))
    return next((m for m in matches if len(m[1]) == 1 or _means_current(_letters(name[: m.start()]))), None)


def _letters(before: str) -> str:
    match = _BEFORE.search(before)
    return match[1].casefold() if match else ""


def _means_current(letters: str) -> bool:
    return letters in _LEVELS or column_names.role_of(letters) == "current"


def current_behind_label(name: str, names: Collection[str]) -> float | None:
    """Return the current [A] behind a digit of a label by the other names: MRD-7_0A; None where it may not.

    Another name has a number with a point behind such a label; or the label is a word for a test with its number, and
    another has two digits or all count the tests, at whole amperes from 0 A on. A word for a current has no label.
    Where A is the decimal mark, as in MRD_0A5_2Hz, other names have 0A0 and a third number there.
    """
    match = behind_digits(name)
    if match is None:
        match, others = LETTER_AS_MARK.search(name), map(LETTER_AS_MARK.search, {*names})
        marked = [m for m in others if m and match and m.string[: m.start()] == name[: match.start()]]
        numbers = {float(f"{m[1]}.{m[2]}") for m in marked}
        fits = match and 0.0 in numbers and len(numbers) > 2 and max(numbers) <= LARGEST_STATED
        return float(f"{match[1]}.{match[2]}") if match and fits else None
    stated = currents_in(f"{name[: match.end(1)]} {name[match.start(2) :]}")
    letters = _letters(name[: match.start()])
    if len(stated) != 1 or stated[0] > LARGEST_STATED or _means_current(letters):
        return None

    def alike(pattern: re.Pattern[str]) -> list[re.Match[str]]:
        """Return what names have in the place of the label and the number."""
        form, matches = re.sub("[0-9]+", "0", name[: match.start()]), map(pattern.search, {*names})
        return [m for m in matches if m and re.sub("[0-9]+", "0", m.string[: m.start()]) == form]

    if alike(_BEHIND_LABEL) or (letters in _RUNS and alike(_BEHIND_LONG_LABEL)):
        return stated[0]
    both = {(m[1], m[2]) for m in alike(_BEHIND_DIGITS)}
    labels, amounts = ({*of} for of in zip(*both, strict=True))
    whole = amounts == {*map(str, range(len(amounts)))} and 3 <= len(amounts) <= _LARGEST_STEP + 1
    counted = len(labels) == len(both) and labels == {*map(str, range(1, len(labels) + 1))}
    return stated[0] if whole and counted and letters in _RUNS else None


def motions_in(text: str, unit: str) -> set[float]:
    """Frequencies in Hz or lengths in mm that a title or a name states: 0p5Hz, 500 mHz, 10mm."""
    stated = [(re.sub("[,xp]", ".", number.lower()), milli) for number, milli in _MOTIONS[unit].findall(text)]
    return {float(number) * (1e-3 if milli else 1.0) for number, milli in stated}


def damper_in(title: str) -> str:
    """Return the damper that a title names beside a current, empty if it names none: FL, rear left, Damper A, 0.5 A."""
    name = without_currents(title).strip(" ,;:@-_/")
    match = re.fullmatch(r"(?:[^\W\d_]+[ _-])?([^\W\d_]+)[\W_]*(?:[0-9]+|[A-Za-z])", name)
    numbered = match is not None and match[1].casefold() in _DAMPERS
    return name if numbered or name.replace("_", " ").casefold() in _CORNERS else ""


def states_motion(title: str) -> bool:
    """Tell if a title states a frequency or an amplitude."""
    return bool(motions_in(title, "Hz") or motions_in(title, "mm"))


def numbers_test(title: str) -> bool:
    """Tell if a title is a word for a test and its number: Test 1, run_02."""
    match = re.fullmatch(r"([^\W\d_]+)[\W_]*[0-9]+", title.strip())
    return match is not None and match[1].casefold() in _RUNS


def without_currents(text: str) -> str:
    """Return a title without the currents it states."""
    return re.sub(r"\(\s*\)|\[\s*\]|\s{2,}", " ", _IN_NAME.sub(" ", text[:255])).strip() if currents_in(text) else text


def named_after_currents(names: Sequence[str]) -> list[int]:
    """Return the columns whose names are nothing but a current each, where two or more differ: 0 A, 0.5 A."""
    stated = {i: currents_in(name) for i, name in enumerate(names) if not without_currents(name)}
    return [i for i, own in stated.items() if own] if len({*stated.values()} - {()}) > 1 else []


def amperes(number: str, unit: str) -> float:
    """Return a number with decimal point, comma, x or p, in A or mA."""
    value = float(re.sub("[,xp]", ".", number))
    return value / 1000 if unit == "mA" else value


def stated_by_lines(lines: Iterable[str], decimal: str | None = None) -> list[Statement]:
    """Currents that lines of the form "Spulenstrom:; 0,40 A", "Current [mA] = 400" state.

    With the file's decimal mark it is known which numbers have a thousands mark.
    """
    lines, currents, rated = list(lines), [], []
    for line in lines:
        for key, value, unit in _quantities(line, decimal):
            coil = column_names.holds(key, column_names.COIL) and not column_names.RATING.search(key)
            coil = coil or column_names.names_condition(key, "current")
            if unit.dimension == "current" and re.search("rated", key, re.IGNORECASE):
                rated.append(value)
            elif unit.dimension == "current" and coil and not _SCALE.search(line):
                currents.append(Statement(value, f"the line {line.strip()[:60]!r}"))
    rated += [amperes(match[1], match[2]) for line in lines if (match := _WHOLE.search(line[:LONGEST_LINE]))]
    shares = [(match, line) for line in lines if len(set(rated)) == 1 and (match := _SHARE.match(line[:LONGEST_LINE]))]
    for match, line in shares:
        share = float(match["number"].replace(",", ".")) / 100
        currents.append(Statement(share * rated[0], f"the line {line.strip()[:60]!r}"))
    return currents


def stated_in_titles(lines: Iterable[str]) -> list[Statement]:
    """Return the current in free text of lines that name no limit or meaning, if all state one: "Test 3: 0.4 A"."""
    statements = []
    for line in lines:
        no_test = column_names.RATING.search(line) or _SCALE.search(line) or EXPLAINED.search(line)
        stated = () if no_test else currents_in(_TOLERANCE.sub("", line))
        if len(stated) == 1:
            statements.append(Statement(stated[0], f"the line {line.strip()[:60]!r}"))
    possible = [statement for statement in statements if abs(statement.amperes) <= LARGEST_STATED]  # DCS-100A: a device
    statements = possible or statements
    return statements if len({statement.amperes for statement in statements}) == 1 else []


def why_not_taken(text: str) -> str:
    """Tell why a current that a text holds is not taken for that of the test; empty if the text holds none."""
    if not _IN_NAME.search(_in_ascii(text[:255])):
        return ""
    if column_names.RATING.search(text) or _LABELLED_RATING.search(text):
        return "of a limit, a supply or another device"
    several = f"one of several: {' and '.join(f'{current:g} A' for current in currents_in(text))}"
    return "a scale" if _SCALE.search(text) else "explains names" if EXPLAINED.search(text) else several


def series_in(line: str) -> tuple[float, ...]:
    """Return the different currents [A] that a line lists if it says nothing else: currents of tests: 0, 0.5, 1 A."""
    series = None if column_names.RATING.search(line) or _SCALE.search(line) else _SERIES.search(line[:LONGEST_LINE])
    if series is None or not names_only_currents(line[: series.start()]) or re.search(r"\w", line[series.end() :]):
        return ()
    listed = currents_in_order(series[0])
    return listed if len({*listed}) == len(listed) else ()


def currents_in_order(text: str) -> tuple[float, ...]:
    """Return the currents [A] of the first list of them in a text: 0, 0.5, 1 A; empty if there is none, or a limit."""
    series = None if column_names.RATING.search(text) or _SCALE.search(text) else _SERIES.search(text[:LONGEST_LINE])
    if series is None or {*re.findall("m?A", series[1])} - {series[2]}:  # 500 mA, 1 A
        return ()
    return tuple(amperes(number, series[2]) for number in re.findall(_NUMBER, series[1]))


def names_only_currents(text: str) -> bool:
    """Tell if a text names currents, of the coil, of tests, and nothing else: no device, other damper or negation."""
    words_of_text = re.findall(r"[^\W_]+", re.sub(r"\b[0-9]{1,2} (?=[^\W\d_]{4})", "", text.casefold()))  # the 5 tests
    return bool(_CURRENTS & {*words_of_text}) and {*words_of_text} <= _CURRENTS | _AROUND_CURRENTS


def rate_in_name(name: str) -> float | None:
    """Return sampling rate [Hz] in a file's name: 500Hz_fs, fs_2kHz; None if there is none."""
    match = _RATE_IN_NAME.search(name[:255])
    if match is None:
        return None
    number = float((match["a"] or match["b"]).replace(",", "."))
    return 1000 * number if match["ka"] or match["kb"] else number


class Quantity(NamedTuple):
    """A quantity that a line or a single number beside the columns states."""

    key: str
    value: float  # in SI
    unit: column_names.Unit


def quantity_in_cell(cell: str, unit: str) -> tuple[float, column_names.Unit] | None:
    """Return the number of a cell in SI and its unit, which stands behind it or is that of the column; else None."""
    match = CELL.fullmatch(cell)
    unit_of = column_names.parse_unit((match[2] if match else "") or unit)
    if match is None or unit_of is None:
        return None
    return unit_of.factor * float(match[1].replace(",", ".")) + unit_of.offset, unit_of


def stated_quantities(
    lines: Iterable[str], numbers: Mapping[str, float] = MappingProxyType({}), decimal: str | None = None
) -> Iterator[Quantity]:
    """Yield what lines, and numbers by their name, state with a unit."""
    for line in lines:
        yield from _quantities(line, decimal)
    for name, number in numbers.items():
        header = column_names.split_name(name)
        if header.known is not None:
            yield Quantity(header.name, header.known.factor * number, header.known)


def stated_rate(quantities: Iterable[Quantity]) -> float | None:
    """Return the sampling rate [Hz] that is stated, as a rate or a step, or None; ValueError if there are two."""
    rates = []
    for key, value, unit in quantities:
        if OTHER_DEVICE.search(key):
            continue
        if value > 0 and unit.dimension == "frequency" and _RATE.search(key):
            rates.append(value)
        elif value > 0 and unit.dimension == "time" and _STEP.search(key):
            rates.append(1 / value)
    return _only(rates, 1.001, 1.0, "Hz")


def _only(values: Sequence[float], agree: float, shown: float, unit: str) -> float | None:
    """Return the first of values that agree, or None; ValueError with the least and the largest where they do not."""
    if values and max(values) > agree * min(values):
        raise ValueError(f"{shown * min(values):g} {unit} and {shown * max(values):g} {unit}")
    return values[0] if values else None


def stated_clock(numbers: Mapping[str, float]) -> tuple[float, float, str] | None:
    """Step, start and unit of a channel's clock by the numbers beside its samples: dt, sampling_rate_Hz, t0.

    None if none states a step. The unit is empty where no name holds one.
    """
    clock, start = None, 0.0
    for name, number in numbers.items():
        header = column_names.split_name(name)
        dimension, factor = header.dimension, header.factor
        unit = "s" if dimension in ("time", "frequency") else ""
        if number > 0 and dimension in (None, "frequency") and BARE_RATE.fullmatch(header.name):
            clock = 1 / (factor * number), unit
        elif number > 0 and dimension in (None, "time") and _BARE_STEP.fullmatch(header.name):
            clock = factor * number, unit
        elif dimension in (None, "time") and _START.fullmatch(header.name):
            start = factor * number
    return None if clock is None else (clock[0], start, clock[1])


def stated_motion(quantities: Iterable[Quantity]) -> str:
    """Frequency and amplitude of the motion that is stated, as a name would: 2Hz 10mm; empty if neither is."""
    words = []
    for key, value, unit in quantities:
        if value > 0 and unit.dimension == "frequency" and _FREQUENCY_KEY.fullmatch(key):
            words.append(f"{value:g}Hz")
        elif value > 0 and unit.dimension == "length" and _AMPLITUDE_KEY.fullmatch(key):
            words.append(f"{1e3 * value:g}mm")
    return " ".join(dict.fromkeys(words))


def stated_speed(quantities: Iterable[Quantity]) -> float | None:
    """Speed of a crank [1/s] that is stated; None if none is; ValueError if there are two."""
    speeds = [v for key, v, unit in quantities if unit.dimension == "frequency" and v > 0 and _TURNS.search(key)]
    return _only(speeds, 1.01, 60, "rpm")


def _quantities(line: str, decimal: str | None) -> Iterator[Quantity]:
    """Yield what a line states: one quantity, or several behind each other."""
    line = _LEADERS.sub(": ", _TOLERANCE.sub("", _in_ascii(line[:LONGEST_LINE])))
    match = _LINE.match(line) or _SPACED.match(line)
    parts = [line] if match else re.split(r"[,;|]\s+|[{}\t]|\s{2,}", re.sub(r" *= +", "=", line))
    for part in parts[:_MOST_PARTS]:
        match = _LINE.match(part) or _SPACED.match(part)
        if match is None or _NUMERIC_CELL.search(match["key"]):  # a range or a calibration
            continue
        if decimal != "," and "," in match["key"] and "," in match["number"]:  # two cells: gain, offset
            continue
        whole = match["key"].strip().strip('"')
        key, unit = column_names.split_name(whole)
        key, unit = whole if column_names.RATING.search(whole) else key, match["unit"] or unit
        unit_of = column_names.parse_unit(unit)
        value = _value(match["number"], decimal)
        if unit_of is not None and value is not None:
            yield Quantity(key, unit_of.factor * value, unit_of)


def _value(number: str, decimal: str | None) -> float | None:
    grouped = re.fullmatch(r"[+-]?[1-9][0-9]{0,2}[.,][0-9]{3}", number)
    if grouped and decimal is None:
        return None
    if grouped and decimal is not None and decimal not in number:
        return float(re.sub("[.,]", "", number))
    return float(number.replace(",", "."))


def contradicts(one: float, other: float, limits: tuple[float, float] = _AGREE) -> bool:
    """Tell if a nominal and a measured current [A] contradict; a dash before a number may be a sign or none."""
    return abs(abs(one) - abs(other)) > limits[0] + limits[1] * min(abs(one), abs(other))


def time_in(text: str) -> time | None:
    """Return the first time of day that a text states; None if it states none."""
    match = TIME_OF_DAY.search(text)
    if match is None:
        return None
    hour = int(match[1]) % 12 + 12 * (match[5] in "pP") if match[5] else int(match[1])
    seconds = int(match[3] or 0), int((match[4] or "0").ljust(6, "0"))
    return time(hour, int(match[2]), *seconds) if hour < 24 else None


def day_in(text: str) -> tuple[str, str] | None:
    """Return a day as ISO 8601 ("?" and the text where day and month may be exchanged) and as written."""
    match = next(filter(None, (form.search(text) for form in _DAYS)), None)
    if match is None:
        return None
    parts = re.split(r"[-./, ]+", match[0].casefold())
    numbers = [MONTHS.get(part[:3], 0) if part.isalpha() else int(part) for part in parts]
    year_first = len(parts[0]) == 4 and parts[0].isdigit()
    year, month, day = numbers if year_first else reversed(numbers)
    if not year_first and match["mark"] in ("-", "/") and day != month and max(day, month) <= 12:
        return f"?{match[0]}", match[0]
    if parts[0].isalpha() or (not year_first and match["mark"] and month > 12):
        day, month = month, day
    try:
        return date(year, month, day).isoformat(), match[0]
    except ValueError:
        return None
