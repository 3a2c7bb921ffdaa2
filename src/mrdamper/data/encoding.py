"""Encoding of text from data, with one function per output format.

Names, ids, notes and units come from rig files, profiles, tables and saved models, and are not trusted. Page templates
escape HTML, and `errors.printable` terminal output.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from hashlib import sha256
from html import escape
from typing import Any

_GREEK = {
    "α": "alpha", "β": "beta", "γ": "gamma", "δ": "delta", "η": "eta", "φ": "phi", "ζ": "zeta", "ω": "omega",
}  # fmt: skip
_SPELLED = str.maketrans(
    {"−": "-", "–": "-", "·": "*", "²": "^2", "³": "^3", "√": "sqrt", "≤": "<=", "≥": ">=", "∈": " in "} | _GREEK
)
_LATEX = str.maketrans(
    {c: rf"\{c}" for c in "&%$#_{}"}
    | {"~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\\": r"\textbackslash{}"}
    | {"<": r"\textless{}", ">": r"\textgreater{}", "|": r"\textbar{}"}
    | {"−": "$-$", "≤": r"$\le$", "≥": r"$\ge$", "∈": r"$\in$", "√": r"$\surd$"}  # not set up in a plain LaTeX
    | {letter: rf"$\{name}$" for letter, name in _GREEK.items()}
)
_MARKDOWN = str.maketrans({c: f"\\{c}" for c in "!\"#$%&'()*+,-./:;<=>?@[\\]^_`{|}~"})
_FORMULA = re.compile(r"'*\s*[=+\-@\t\r]")  # characters that begin a formula in a spreadsheet
_NUMBER = re.compile(r"-|[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)  # reserved by Windows
_MAX_NAME_PART = 48  # characters; of four bytes each, with prefix, suffix and hash, below 255


def c_comment(text: str) -> str:
    """Return one line of ASCII that cannot end a comment: a space separates characters with a meaning together."""
    plain = " ".join(text.translate(_SPELLED).split()).encode("ascii", "replace").decode()
    plain = re.sub(r"[^ -~]", "?", plain).replace("\\", "/")
    return re.sub(r"(?<=[*/?])(?=[*/?])", " ", plain)


def xml(text: str) -> str:
    """Text or attribute of XML: without the characters it forbids, on one line."""
    return escape(_one_line(text))


def latex(text: str) -> str:
    """Text of LaTeX, outside mathematics."""
    return _one_line(text).translate(_LATEX)


def markdown(text: str) -> str:
    """Text of Markdown, also in a table and between dollar signs: every mark is escaped."""
    return _one_line(text).translate(_MARKDOWN)


def finite(value: float | None) -> float | None:
    """Return a number for JSON: None if it is not finite."""
    return float(value) if value is not None and math.isfinite(value) else None


def csv_cell(text: str) -> str:
    """Write a cell that a spreadsheet does not evaluate; `csv_value` is the inverse.

    An apostrophe precedes =, +, -, @ and tab, as in spreadsheets; numbers and a single dash are unchanged.
    """
    return f"'{text}" if _FORMULA.match(text) and not _NUMBER.fullmatch(text) else text


def csv_value(cell: str) -> str:
    """Return the text that `csv_cell` was given."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def csv_text(rows: Sequence[Mapping[str, object]], names: Iterable[str] | None = None) -> str:
    """Rows as CSV, columns by first appearance; cells with ; or a tab are quoted, as some spreadsheets split there."""
    heads = list(names) if names is not None else list(dict.fromkeys(name for row in rows for name in row))
    lines = [",".join(map(_csv_field, heads))]
    for row in rows:  # most fields are numbers
        lines.append(",".join([repr(v) if type(v) is float else _csv_field(v) for v in map(row.get, heads)]))
    return "\n".join([*lines, ""])


def rows_of(columns: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return arrays (N,) by name as rows of a table."""
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


def file_names(texts: Iterable[str]) -> dict[str, str]:
    """Make a part of a file name for each text: safe on every system, and unique.

    Letters, digits, dot, dash and underscore stay; a text that was changed otherwise, or has the name of another, ends
    with a few digits of its hash.
    """
    names: dict[str, str] = {}
    taken: set[str] = set()
    for text in dict.fromkeys(texts):
        name = re.sub(r"[^\w.\-]+", "_", unicodedata.normalize("NFC", text)).strip("._-") or "_"
        if len(name) > _MAX_NAME_PART or name.casefold() in taken or _DEVICES.fullmatch(name):
            name = f"{name[:_MAX_NAME_PART]}_{sha256(text.encode('utf-8', 'replace')).hexdigest()[:8]}"
        taken.add(name.casefold())
        names[text] = name
    return names


def _csv_field(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, str):
        return _csv_words(value)
    return repr(float(value)) if isinstance(value, float) else str(value)  # NumPy's floats name their type


@lru_cache(maxsize=256)  # names of rigs, runs and axes are in every row
def _csv_words(text: str) -> str:
    text = csv_cell(text)
    return '"{}"'.format(text.replace('"', '""')) if re.search(r'[,"\n\r;\t]', text) else text


def _one_line(text: str) -> str:
    """Remove line breaks, control characters, and marks that change the direction of writing."""
    plain = re.sub(r"\s+", " ", text)
    return "".join("?" if unicodedata.category(c) in ("Cc", "Cf", "Cs", "Co", "Cn") else c for c in plain)
