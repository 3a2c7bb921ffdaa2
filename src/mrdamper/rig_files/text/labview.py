"""LabVIEW measurement files (.lvm): two headers that say separator, decimal mark, units and where the names stand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from mrdamper.rig_files.file_form import FileForm
from mrdamper.rig_files.text.layout import Layout

_MARK = "LabVIEW Measurement"
_NAMES = "X_Value"
_SEPARATORS: Mapping[str, str] = {"tab": "\t", "comma": ",", "semicolon": ";"}


def is_labview(lines: Sequence[str]) -> bool:
    """Tell if a text is of this kind."""
    return bool(lines) and lines[0].lstrip("\ufeff").startswith(_MARK)


def stated_form(lines: Sequence[str], form: FileForm) -> FileForm:
    """Return the form with what the headers say, where the profile says nothing."""
    says = _entries(lines)
    names = next((i for i, line in enumerate(lines, 1) if line.startswith(_NAMES)), None)
    forms = {
        "separator": _SEPARATORS.get(says.get("Separator", "").lower()),
        "decimal": says.get("Decimal_Separator") if says.get("Decimal_Separator") in (".", ",") else None,
        "header_line": names,
    }
    return form.model_copy(update={k: v for k, v in forms.items() if v is not None and getattr(form, k) is None})


def named(layout: Layout, lines: Sequence[str]) -> Layout:
    """Return the layout with the time's name for every X_Value, and the units of the second header."""
    above = [line.split(layout.separator) for line in lines[: layout.header_line]]
    units = next((cells for cells in reversed(above) if cells[0] == "Y_Unit_Label"), [])
    dimension = next((cells[1:2] for cells in reversed(above) if cells[0] == "X_Dimension"), [])
    if dimension and dimension[0].strip() not in ("Time", ""):
        return layout
    stated = [unit.strip() for unit in units] + [""] * layout.width
    clocks = [name == _NAMES for name in layout.names]
    clock_name = "" if _entries(lines).get("X_Columns", "").casefold() == "no" else "Time"  # empty cells, or stamps
    return replace(
        layout,
        names=tuple(clock_name if clock else name for name, clock in zip(layout.names, clocks, strict=True)),
        units=tuple(
            ("s" if clock_name else "") if clock else (stated[i] if i else "") or own
            for i, (clock, own) in enumerate(zip(clocks, layout.units, strict=True))
        ),
    )


def _entries(lines: Sequence[str]) -> dict[str, str]:
    """Return the entries of the first header by key, with any separator."""
    entries = {}
    for line in lines[1:]:
        if line.startswith("***End_of_Header***"):
            break
        for mark in ("\t", ",", ";"):
            key, present, value = line.partition(mark)
            if present:
                entries[key.strip()] = value.strip() if key == "Decimal_Separator" else value.strip("\t ,;")
                break
    return entries
