"""The form of a rig's files as a profile states it: what readers take for granted instead of sniffing it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, model_validator

NAME = Annotated[str, StringConstraints(min_length=1, max_length=200)]


class Table(BaseModel):
    """A table of a profile: no other keys, and never changed."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class FileForm(Table):
    """[file]: the form of the files.

    Attributes
    ----------
    separator, decimal, encoding : str, optional
        Of delimited text; a separator of one space stands for any run of spaces.
    header_line, units_line, data_line : int, optional
        Counted from one; a header_line of 0 says that there is none.
    names : tuple of str
        Names of all columns in order, where the files have none.
    sheet : str, optional
        Of workbooks.
    run_column : str or int, optional
        Column that says which test a row belongs to: its name, or its number counted from one.
    blocks : "join" or "split", optional
        Whether what looks like several tests (repeated headers, groups of columns beside each
        other, a column of runs, a time that starts again) is one test or several.
    leave_out : tuple of str
        Patterns with * of files and of tables within them that are no tests: `warmup*`, `*/calibration`.
    sample_rate_Hz : float, optional
        Of files without time stamps.
    """

    separator: Literal[",", ";", "\t", "|", " "] | None = None
    decimal: Literal[".", ","] | None = None
    encoding: NAME | None = None
    header_line: int | None = Field(default=None, ge=0, le=10_000)
    units_line: int | None = Field(default=None, ge=1, le=10_000)
    data_line: int | None = Field(default=None, ge=1, le=10_000)
    names: tuple[str, ...] = Field(default=(), max_length=1000, strict=False)
    sheet: NAME | None = None
    run_column: NAME | Annotated[int, Field(ge=1, le=1000)] | None = None
    blocks: Literal["join", "split"] | None = None
    leave_out: tuple[NAME, ...] = Field(default=(), max_length=100, strict=False)
    sample_rate_Hz: float | None = Field(default=None, gt=0, allow_inf_nan=False)

    @model_validator(mode="after")
    def _separator_is_not_the_mark(self) -> FileForm:
        if self.separator == "," and self.decimal == ",":
            raise ValueError("separator and decimal are both a comma")
        return self
