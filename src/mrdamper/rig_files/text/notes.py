"""Notes beside the rows of a text: names with their values in columns that the samples leave free."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from mrdamper.rig_files.column_names import is_unit
from mrdamper.rig_files.text.tokens import looks_numeric

_ROWS = 60  # looked at


def with_notes_beside(
    rows: Sequence[Sequence[str]], names: tuple[str, ...], units: tuple[str, ...]
) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Return names and units of columns, and the notes beside the rows as lines: names with a number or a text.

    The notes of an oscilloscope state names and units of the two full columns beside them; texts count only there.
    """
    notes = _notes(rows, texts=not any(names))
    says = {key.casefold(): text for key, _, text in (note.partition(": ") for note in notes)}
    headings = [("time", says.get("horizontal units", "")), (says.get("source", ""), says.get("vertical units", ""))]
    full = [i for i in range(len(names)) if all(len(row) > i and row[i] for row in rows)]
    if any(names) or len(full) != len(headings) or not all(is_unit(unit) for _, unit in headings):
        return names, units, notes
    own = dict(zip(full, headings, strict=True))
    names, units = zip(*(own.get(i, ("", unit)) for i, unit in enumerate(units)), strict=True)
    return names, units, notes


def _notes(rows: Sequence[Sequence[str]], *, texts: bool) -> tuple[str, ...]:
    filled = Counter(i for row in rows for i, cell in enumerate(row) if cell)
    columns = {i for i, count in filled.items() if 2 * count > len(rows) > _ROWS}  # channels and labels, no notes
    stated = [
        (key, number, unit if is_unit(unit) else "")
        for row in rows[:_ROWS]
        for i, (key, number, unit) in enumerate(zip(row, row[1:], [*row[2:], ""], strict=False))
        if key and number and not {i, i + 1} & columns and not looks_numeric(key) and (texts or looks_numeric(number))
    ]
    return tuple(f"{key}: {number} {unit}".rstrip() for key, number, unit in stated)[:_ROWS]
