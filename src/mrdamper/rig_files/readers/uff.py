"""Universal files: data sets of number 58, functions at a point, as modal and measuring systems write them."""

from __future__ import annotations

import numpy as np

from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.arrays import damaged, refusing_damage, whole
from mrdamper.rig_files.readers.base import RawTable, Reader, Source
from mrdamper.rig_files.readers.nested import nested_tables

_DELIMITER = "-1"
# Kinds of data of the format, for axes without a label.
_KINDS = {8: "displacement", 11: "velocity", 12: "acceleration", 13: "force", 9: "force", 17: "time", 15: "pressure"}
_HEADER = 11  # lines of a data set above its values
_REAL = {2: 4, 4: 8}  # types of real numbers and their bytes


class Uff(Reader):
    """Functions of time, each a channel; texts of their headers stand beside them."""

    name = "uff"
    title = "universal file"
    suffixes = (".uff", ".unv", ".uf", ".58", ".ufb")
    library = "numpy"

    def recognises(self, source: Source) -> bool:
        """By the delimiter and the number of the first data set."""
        lines = source.head(200).split(b"\n")
        return len(lines) > 2 and lines[0].strip() == b"-1" and lines[1][:6].strip().isdigit()

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """One table of the functions that share a clock."""
        lines = whole(source, self.title).decode("latin-1").splitlines()
        marks = [i for i, line in enumerate(lines) if line.strip() == _DELIMITER]
        if len(marks) % 2:
            raise damaged(source, self.title, "truncated: a data set is not closed")
        trees: list[dict[str, object]] = [{}]
        with refusing_damage(source, self.title):
            for start, stop in zip(marks[::2], marks[1::2], strict=True):
                kind = lines[start + 1].split()[0]
                if kind.startswith("58b"):
                    raise source.refuse("E_FORMAT", "a binary data set", "export it as text (ASCII)")
                if kind == "58":
                    texts, channel = _function(lines[start + 2 : stop])
                    if channel["name"] in trees[-1]:  # the next test begins
                        trees.append({})
                    above = {f"{channel['name']} {key}": text for key, text in texts.items()}
                    trees[-1] |= {**above, str(channel["name"]): channel}
        inner = {f"test {i}": tree for i, tree in enumerate(trees, 1)} if len(trees) > 1 else trees[0]
        return nested_tables(source, inner, self.title)


def _function(lines: list[str]) -> tuple[dict[str, object], dict[str, object]]:
    heads = {f"text {i}": line.strip() for i, line in enumerate(lines[:5], 1)}
    texts: dict[str, object] = {key: text for key, text in heads.items() if text not in ("", "NONE")}
    kind, count, even = (int(lines[6][at : at + 10]) for at in (0, 10, 20))
    begin, step = float(lines[6][30:43]), float(lines[6][43:56])
    (_, x_unit), (name, unit) = _axis(lines[7]), _axis(lines[8])
    numbers = np.array(" ".join(lines[_HEADER:]).split(), dtype=float)
    if kind not in _REAL or (not even and numbers.size < 2 * count) or numbers.size < count:
        raise ValueError("truncated: fewer values than its header states, or complex ones")
    values = numbers[:count] if even else numbers[1 : 2 * count : 2]
    time = begin + step * np.arange(count) if even else numbers[: 2 * count : 2]
    return texts, {"name": name, "unit": unit, "data": values, "time": time, "xunit": x_unit or "s"}


def _axis(line: str) -> tuple[str, str]:
    name, unit = line[26:46].strip(), line[47:67].strip()
    kind = _KINDS.get(int(line[:10]), "")
    return kind if name in ("", "NONE") else name, "" if unit == "NONE" else unit
