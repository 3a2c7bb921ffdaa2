"""Short text, notebook table and data frame of data and results."""

from __future__ import annotations

import importlib
import numbers
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from mrdamper.data.wording import number
from mrdamper.errors import MissingExtraError

_ROWS_SHOWN = 30  # of a table in a notebook


class Displayable(ABC):
    """Object with a headline for a notebook and a table that can be exported as a data frame."""

    @property
    @abstractmethod
    def headline(self) -> str:
        """The object in a line."""

    @property
    @abstractmethod
    def table(self) -> Mapping[str, Any]:
        """Columns by name, all of one length; units are part of the names."""

    @property
    def details(self) -> Sequence[str]:
        """Lines printed under the headline."""
        return ()

    def __repr__(self) -> str:
        return f"<{chr(10).join((self.headline, *self.details))}>"

    def _repr_html_(self) -> str:
        """Return the headline and the first rows, for notebooks."""
        head = "".join(f"<th>{escape(name)}</th>" for name in self.table)
        rows = list(zip(*self.table.values(), strict=True))
        body = "".join(
            f"<tr>{''.join(f'<td>{escape(_cell(value))}</td>' for value in row)}</tr>" for row in rows[:_ROWS_SHOWN]
        )
        more = f"<p>… {len(rows) - _ROWS_SHOWN} more rows</p>" if len(rows) > _ROWS_SHOWN else ""
        table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
        return f"<p><b>{escape(self.headline)}</b></p>{table}{more}"

    # By name, so that the numerics depend on no library of tables: the caller asks for one.
    def to_polars(self) -> Any:
        """Return the table as a `polars.DataFrame`."""
        return _library("polars").DataFrame(dict(self.table))

    def to_pandas(self) -> Any:
        """Return the table as a `pandas.DataFrame`; raises `MissingExtraError` if pandas is not installed."""
        return _library("pandas").DataFrame(dict(self.table))


def _library(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        raise MissingExtraError(f"to_{name} requires {name}", remedy=f"pip install {name}, or use .table") from error


def _cell(value: Any) -> str:
    if isinstance(value, numbers.Real) and not isinstance(value, numbers.Integral):
        return number(float(value))
    return "" if value is None else str(value)


def joined(parts: Sequence[Displayable]) -> dict[str, list[Any]]:
    """Return the rows of all parts, which have the same columns."""
    tables = [part.table for part in parts]
    return {name: [value for table in tables for value in table[name]] for name in tables[0]}
