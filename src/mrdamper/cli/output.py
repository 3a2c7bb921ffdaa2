"""Results on standard output or in a file, as CSV or JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from mrdamper.errors import InputError
from mrdamper.io.atomic import write_file

Rows = Sequence[Mapping[str, Any]]


def put(rows: Rows, out: Path | None, as_json: bool, as_csv: Callable[[Rows], str]) -> None:
    """Write rows where they were asked for; a file appears whole or not at all."""
    text = (
        json.dumps([{k: _plain(v) for k, v in row.items()} for row in rows], indent=1) + "\n"
        if as_json
        else as_csv(rows)
    )
    if out is None:
        print(text, end="")
        return
    with write_file(out) as target:
        target.write_text(text, encoding="utf-8")


def percent(share: float) -> str:
    """A share in per cent, or a dash where there is none."""
    return f"{100 * share:.2f} %" if math.isfinite(share) else "–"


def parse_fixed(pairs: Sequence[str]) -> dict[str, float]:
    """NAME=VALUE arguments as a mapping.

    Raises
    ------
    InputError
        If one is not of that form.
    """
    fixed = {}
    for pair in pairs:
        name, _, text = pair.partition("=")
        try:
            fixed[name.strip()] = float(text)
        except ValueError as error:
            raise InputError(f"--fix {pair}", mend="write --fix NAME=VALUE with a number in SI units") from error
    return fixed


def _plain(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
