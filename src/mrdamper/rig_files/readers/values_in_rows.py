"""Values of one channel, several a row, below their number and their step, as databases of records publish them."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from mrdamper.data.wording import counted
from mrdamper.rig_files.column_names import split_name
from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.arrays import array_table, whole
from mrdamper.rig_files.readers.base import RawTable, Reader, Source

_HEAD = re.compile(
    r"(?im)^.*?\bNPTS\s*=\s*(?P<points>[0-9]{1,9})\s*,\s*DT\s*=\s*(?P<step>[0-9]*\.?[0-9]+)\s*(?P<unit>[a-z]*).*$"
)
_IN_UNITS = re.compile(r"(?i)(?: time (?:series|history))?,?(?: in)? units of ")
_GLUED = re.compile(r"(?<=[0-9.])(?=[+-])")  # columns of a fixed width without a space between them


class ValuesInRows(Reader):
    """NPTS= 4000, DT= .0050 SEC, and rows of as many values; the line above says what they are."""

    name = "values-in-rows"
    title = "text with values of one channel in rows"
    suffixes = (".at2", ".vt2", ".dt2", ".ft2")
    binary = False

    def recognises(self, source: Source) -> bool:
        """By the line of the number and the step."""
        return _HEAD.search(source.head(4096).decode("latin-1")) is not None

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """Return one table of a time and the channel; E_TRUNCATED if the number of values is another."""
        text = whole(source, self.title).decode("latin-1")
        match = _HEAD.search(text)
        if match is None:
            raise source.refuse("E_FORMAT", "no line NPTS= ..., DT= ...", "export the file again")
        head, points = text[: match.start()].splitlines(), int(match["points"])
        try:
            values = np.array(_GLUED.sub(" ", text[match.end() :]).split(), dtype=float)
        except ValueError as error:
            raise source.refuse("E_NUMBER", f"a value is no number ({error})", "export the file again") from error
        if values.size != points:
            problem = f"{counted(values.size, 'value')} where the line of NPTS states {points}"
            raise source.refuse("E_TRUNCATED", problem, "copy or export the file again")
        name, _, unit = _IN_UNITS.sub("\n", head[-1] if head else "").partition("\n")
        channel = split_name(name.strip(), unit.strip())
        columns = (float(match["step"]) * np.arange(points), values)
        table = array_table(source, ["time", channel.name], [match["unit"], channel.unit], columns.__getitem__)
        return [replace(table, remarks=tuple(head))]
