"""Common functions of the readers of binary formats: named arrays as a table, and damage as a refusal."""

from __future__ import annotations

import importlib
import math
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from types import ModuleType
from typing import IO, Any

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.wording import number
from mrdamper.errors import InputError, MissingExtraError
from mrdamper.rig_files.column_names import KEYS, UNIT_KEYS, is_unit, parse_unit, split_name
from mrdamper.rig_files.readers import base

_MOST_ACROSS = 50  # channels of a matrix that has its samples in rows
_PACKING = ("scale_factor", "add_offset", "_FillValue", "missing_value")
_FORMULA = re.compile(
    r"(?:raw|counts?|adc|digits?|data)\s*[*·×]\s*(gain|scale|factor|slope)(?:\s*\+\s*(offset|bias))?", re.IGNORECASE
)
_LARGEST_TEXT = 200 * 10**6  # bytes
_TELLING = 2  # words that name channels make a list of names
_NO_NUMBERS = {"b": "truth values", "c": "complex numbers", "V": "bytes"}
_EARLY_END = (
    "truncat", "end of file", "eof", "unexpected end", "could not read", "not enough", "incomplete", "short",
    "requires a buffer", "out of range", "no element found",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Stored:
    """An array that is read from its file when it is asked for."""

    shape: tuple[int, ...]
    dtype: np.dtype
    load: Callable[[], np.ndarray]

    @property
    def size(self) -> int:
        """Number of items."""
        return math.prod(self.shape)

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return len(self.shape)

    def __array__(self, dtype=None, copy=None) -> np.ndarray:
        return np.asarray(self.load(), dtype=dtype)


Array = np.ndarray | Stored


def array_table(
    source: base.Source, names: Sequence[str], units: Sequence[str], load: Callable[[int], np.ndarray], title: str = ""
) -> base.RawTable:
    """Return a table whose columns are loaded as arrays, one by one; E_TOO_MANY_COLUMNS beyond a thousand."""
    if len(names) > base.MOST_COLUMNS:
        raise source.refuse("E_TOO_MANY_COLUMNS", f"{len(names)} columns", "export only the channels needed")

    def read(columns: Sequence[int]) -> base.Content:
        values = {}
        for column in columns:
            with refusing_damage(source, title):
                array = load(column)
            values[column] = as_floats(source, array, names[column], column)
        sizes = {v.size for v in values.values()}
        if len(sizes) > 1:
            shown = ", ".join(f"{names[c]}: {v.size}" for c, v in values.items())
            raise source.refuse("E_FIELD_COUNT", f"columns differ in length ({shown})", "export them together")
        if not sizes or not max(sizes):
            raise source.refuse("E_NO_DATA", "columns without samples", "export the file again")
        return base.Content(values)

    def words(column: int) -> base.Words:
        with refusing_damage(source, title):
            cells = list(map(text_of, np.asarray(load(column)).reshape(-1).tolist()))
        codes = {cell: code for code, cell in enumerate(dict.fromkeys(cells))}
        return base.Words(np.array([codes[cell] for cell in cells], dtype=np.int32), tuple(codes))

    return base.RawTable(source, tuple(names), tuple(units), read, words)


def text_of(item: object) -> str:
    """Return one item, or the first of an array or an attribute, as text; empty where there is none."""
    if isinstance(item, np.ndarray):
        item = item.reshape(-1)[0] if item.size else None
    if isinstance(item, bytes):
        return item.decode("utf-8", "replace").strip()
    return f"{item:g}" if isinstance(item, float) else "" if item is None else str(item).strip()


def unit_in(says: Mapping[str, Any], of: str = "") -> str:
    """Return the unit that attributes or properties state, of all or of one of them; of a time without its date.

    A text that is no unit counts if there is none; where two contradict each other, it is both of them, N or kN.
    """
    names = {name.casefold(): name for name in says}
    keys = [key for key in (f"{of.casefold()}{unit}" for unit in KEYS["unit"]) if key in names]
    stated = [text.partition(" since ")[0] for key in keys if (text := text_of(says[names[key]]))]
    units = {parse_unit(text): text for text in reversed(stated) if is_unit(text)}
    return " or ".join(reversed(units.values())) if units else next(iter(stated), "")


def texts_in(values: Any) -> list[str]:
    """Return the texts of an array or an attribute of several; empty if it holds anything else."""
    array = np.asarray(values).reshape(-1)
    if array.dtype.kind not in "SUO" or not 1 < array.size <= base.MOST_COLUMNS:
        return []
    cells = [np.asarray(item) for item in array.tolist()]
    return [] if any(cell.dtype.kind not in "SU" or cell.size > 1 for cell in cells) else list(map(text_of, cells))


def with_headings(rows: Sequence[Sequence[Any]]) -> list[dict[str, Any]]:
    """Return the rows of cells below one of different texts as mappings; empty if the first is no such row."""
    heads = rows[0] if rows and all(isinstance(cell, str) and cell for cell in rows[0]) else []
    told_apart = len({*heads}) == len(heads) > 1
    return [dict(zip(heads, row, strict=True)) for row in rows[1:]] if told_apart else []


def value_of(array: np.ndarray) -> Any:
    """Return the number or the text of an array of one item, a list for one of words, any other array as it is."""
    if array.dtype.kind in "US" and array.size <= base.MOST_COLUMNS:
        words = [text_of(item) for item in array.reshape(-1).tolist()]
        return words if array.size > 1 else "".join(words)
    return float(array.reshape(-1)[0]) if array.size == 1 and array.dtype.kind in "iuf" else array


def as_floats(source: base.Source, array: np.ndarray, name: str, column: int) -> Floats:
    """Return a loaded column as (N,) doubles; date and time as seconds after the first.

    Objects are refused as E_UNSAFE, what else is no number as E_NUMBER, tables as E_FIELD_COUNT.
    """
    array = np.asarray(array)
    kind = array.dtype.kind
    place = {"column": column + 1, "remedy": "export plain numbers"}
    if kind == "O":
        raise source.refuse("E_UNSAFE", f"column {name!r} holds objects or links, not numbers", **place)
    if kind not in "iufMm":
        problem = _NO_NUMBERS.get(kind, "text or lists")
        raise source.refuse("E_NUMBER", f"column {name!r} holds {problem}, not plain numbers", **place)
    if array.ndim > 1:
        array = array.squeeze()
    if array.ndim != 1:
        if array.size == 1:
            return np.array([float(array.reshape(-1)[0])])
        raise source.refuse("E_FIELD_COUNT", f"column {name!r} is a table of {array.shape}", **place)
    if kind in "Mm":  # seconds after the first stamp, by integers: doubles cannot hold the nanoseconds of a date
        since = array - array[np.argmin(np.isnat(array))] if array.size else array.astype("timedelta64[ns]")
        return since.astype("timedelta64[ns]") / np.timedelta64(1, "s")
    with np.errstate(over="ignore"):
        return np.array(array, dtype=np.float64)


def columns_of(name: str, array: Array, texts: Iterable[Sequence[str]], unit: str = "") -> list[tuple[str, str, Array]]:
    """Return name, unit and values of each column of an array: one of a vector, a matrix with its samples the long way.

    The columns of a matrix have the names and units of the texts beside it that hold one a column, else numbers. The
    unit of a whole matrix is that of a column whose name states none, and of its time only if it is one of a time.
    """
    inner = [n for n in array.shape if n != 1]
    unit = "s" if array.dtype.kind in "Mm" else unit if all(map(parse_unit, unit.split(" or "))) else ""
    if len(inner) < 2 or array.dtype.kind == "O":
        return [(name, unit, array)]
    axis = 0 if inner[0] < inner[1] and inner[0] <= _MOST_ACROSS else 1
    width = inner[axis]
    if len(inner) > 2 or width > base.MOST_COLUMNS:
        return []
    own = re.split(r"\s*[,;]\s*", name.rpartition(": ")[2])  # data: t [s], s [mm], F [N]
    fitting = [words for words in (*texts, own) if len(words) == width]
    names = [words for words in fitting if sum(split_name(word).role is not None for word in words) >= _TELLING]
    units = [words for words in fitting if 2 * sum(map(is_unit, words)) >= width and words not in names]
    if not names or any(other != names[0] for other in names):
        names, units = [[name and f"{name}[{i}]" for i in range(1, width + 1)]], []
    parts = [Stored((inner[1 - axis],), array.dtype, partial(_part, array, i, axis)) for i in range(width)]
    heads, clock = [split_name(word) for word in names[0]], split_name("", unit).dimension == "time"
    own = ["" if head.unit or (head.role == "time" and not clock) else unit for head in heads]
    return list(zip(names[0], units[0] if units else own, parts, strict=True))


def _part(array: Array, i: int, axis: int) -> np.ndarray:
    return np.take(np.squeeze(np.asarray(array)), i, axis)


def unpacked(says: Mapping[str, Any], values: np.ndarray) -> np.ndarray:
    """Numbers as netCDF and others pack them: scale_factor, add_offset, and a code for missing ones."""
    if values.dtype.kind not in "iuf":
        return values
    formula = _formula_of(says) or counts_of(says) if values.dtype.kind in "iu" else None
    if formula is None and not any(name in says for name in _PACKING):
        return values
    numbers = values.astype(np.float64)
    for name in ("_FillValue", "missing_value"):
        if name in says:
            numbers[np.isin(values, np.asarray(says[name]))] = np.nan
    usual = (float(np.reshape(says.get(n, d), -1)[0]) for n, d in (("scale_factor", 1), ("add_offset", 0)))
    factor, offset = formula or usual
    return factor * numbers + offset


def counts_of(says: Mapping[str, Any]) -> tuple[float, float] | None:
    """Scale and offset of counts of a converter, where both and the unit that they lead to are stated together."""
    lower = {name.casefold(): np.reshape(value, -1) for name, value in says.items()}
    if not {"scale", "offset"} <= set(lower) or not UNIT_KEYS & set(lower):
        return None
    both = [lower[name] for name in ("scale", "offset")]
    if any(value.dtype.kind not in "iuf" or value.size != 1 for value in both) or both[0][0] in (0, 1):
        return None
    return float(both[0][0]), float(both[1][0])


def _formula_of(says: Mapping[str, Any]) -> tuple[float, float] | None:
    """Factor and offset of whole numbers whose conversion a text states: physical = raw * gain + offset."""
    lower = {name.casefold(): np.reshape(value, -1) for name, value in says.items()}
    texts = (text_of(value) for value in lower.values() if value.dtype.kind in "SUO" and value.size == 1)
    match = next(filter(None, map(_FORMULA.search, texts)), None)
    names = [name.casefold() for name in match.groups() if name] if match else []
    if not names or any(name not in lower for name in names):
        return None
    factor, offset = (float(lower[name][0]) for name in (*names, names[0])[:2])
    return factor, offset if len(names) > 1 else 0.0


def check_unpacked(source: base.Source, size: int) -> None:
    """Refuse tables that are far larger than their file: E_ARCHIVE_RATIO."""
    if size > base.RATIO_MATTERS_FROM and (size > base.MOST_RATIO * source.size or size > 10 * base.MOST_UNPACKED):
        problem = f"{size / 1e6:.0f} MB of numbers in a file of {number(source.size / 1e6, 3)} MB"
        raise source.refuse("E_ARCHIVE_RATIO", problem, "export only the channels and the time needed")


def whole(source: base.Source, title: str) -> bytes:
    """Return a text of numbers as a whole; E_FORMAT beyond 200 MB."""
    if source.size > _LARGEST_TEXT:
        raise source.refuse("E_FORMAT", f"{title} of over {_LARGEST_TEXT // 10**6} MB", "export it as CSV or Parquet")
    source.file.seek(0)
    return source.file.read()


def load(library: str, title: str) -> ModuleType:
    """Import a library that is an extra; `MissingExtraError` if it is not installed."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return importlib.import_module(library)
    except ImportError as error:
        problem, remedy = f"reading {title} needs {error.name or library}", 'install it: pip install "mrdamper[rig]"'
        raise MissingExtraError(problem, remedy=remedy) from error


@contextmanager
def refusing_damage(source: base.Source, title: str) -> Iterator[None]:
    """Turn whatever a library raises on a damaged file into a refusal; its warnings are not shown."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except (InputError, KeyboardInterrupt, SystemExit, GeneratorExit, MemoryError):
        raise
    except BaseException as error:  # a library's panic is no Exception
        raise damaged(source, title, str(error)) from error


def stated_array(source: base.Source, file: IO[bytes], what: str, size: int) -> tuple[tuple[int, ...], np.dtype]:
    """Shape and type of a NumPy array by its header; one of objects is refused, and one that the bytes do not hold."""
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, kind = read(file)
    if kind.hasobject:
        problem = f"{what} holds pickled objects, which run code when loaded"
        raise source.refuse("E_UNSAFE", problem, "save plain arrays of numbers")
    if math.prod(shape) * kind.itemsize > size:
        raise damaged(source, "NumPy file", f"{what} is incomplete")
    return shape, kind


def refuse_twice(source: base.Source, names: Sequence[str]) -> None:
    """Refuse a file that holds two things of one name, of which a library gives either."""
    if len(set(names)) < len(names):
        problem = f"{next(name for name in names if names.count(name) > 1)!r} is stored twice"
        raise source.refuse("E_DUPLICATE_COLUMN", problem, "save the file again, with one of them")


def damaged(source: base.Source, title: str, why: str) -> base.RigFileError:
    """Return the refusal of a file that starts as it should and does not go on so."""
    early = any(word in why.lower() for word in _EARLY_END)
    why = re.sub(r"'?<[^<>]*>'?( is)? ?", "", why)  # objects of the library's own
    reason = "".join(c if c.isprintable() else " " for c in (why.strip().splitlines() or ["unreadable"])[0])[:120]
    code = "E_TRUNCATED" if early else "E_FORMAT"
    return source.refuse(code, f"damaged {title} ({reason})", "copy or export the file again")
