"""Results on standard output or in a file, as CSV or JSON."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from mrdamper.errors import InputError, OutputError

if TYPE_CHECKING:
    from mrdamper.physics.gas_spring import GasSpring
    from mrdamper.report.plots.figure import Figure
    from mrdamper.rig_files.record import Finding

Rows = Sequence[Mapping[str, Any]]


def put(rows: Rows, out: Path | None, as_json: bool, as_csv: Callable[[Rows], str]) -> None:
    """Write rows to standard output or, atomically, to a file."""
    put_text(json.dumps(json_rows(rows), indent=1) + "\n" if as_json else as_csv(rows), out)


def json_rows(rows: Rows) -> list[dict[str, Any]]:
    """Return rows for JSON, which has no number that is not finite."""
    from mrdamper.data.encoding import finite

    return [{k: finite(v) if isinstance(v, float) else v for k, v in row.items()} for row in rows]


def put_text(text: str, out: Path | None) -> None:
    """Print a text if no file or "-" is given; otherwise write the file atomically."""
    if out is None or str(out) == "-":
        print(text, end="")
        return
    from mrdamper.data.atomic import write_file

    with write_file(out) as target:
        target.write_text(text, encoding="utf-8")


def warn(lines: Iterable[object]) -> None:
    """Print lines on standard error."""
    for line in lines:
        typer.echo(line, err=True)


def figure_kind(path: Path) -> str:
    """Return the kind of a figure from its file's name; raises `OutputError` where figures are of no such kind."""
    from mrdamper.report.plots.style import KINDS

    kind = path.suffix.lower().removeprefix(".")
    if kind not in KINDS:
        remedy = f"end the name in {', '.join(f'.{name}' for name in KINDS)}"
        raise OutputError(f"{path.suffix or 'no suffix'}", where=str(path), remedy=remedy)
    return kind


def put_figure(figure: Figure, out: Path) -> None:
    """Write a figure of the kind of its file's suffix, atomically."""
    from mrdamper.data.atomic import write_file

    kind = figure_kind(out)
    with write_file(out) as target:
        target.write_bytes(figure.drawn().file(kind))


def shortened(lines: Sequence[str], most: int, verbose: bool = False) -> list[str]:
    """Return the first lines, and the number of those that `--verbose` prints as well."""
    if verbose or len(lines) <= most:
        return list(lines)
    return [*lines[: most - 1], f"  {len(lines) - most + 1} more with --verbose"]


def aligned(rows: Sequence[Sequence[str]], left: Collection[int] = (0,)) -> list[str]:
    """Return the lines of a table; the columns of these numbers stand to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            cell.ljust(width) if i in left else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]


def finding_lines(findings: Iterable[tuple[str, Finding]], verbose: bool) -> list[str]:
    """List the findings of tests, those of one code once with the number of its tests unless all are asked for."""
    alike: dict[str, list[tuple[str, Finding]]] = {}
    for name, finding in findings:
        text = f"{finding}" if finding.code in ("W_SCALE", "W_CHOSEN") else finding.code  # of every column and plan
        told_apart = re.sub("[0-9]+([.,][0-9]+)*", "#", text) if finding.code == "W_CHOSEN" else text
        alike.setdefault(f"{name}: {finding}" if verbose else told_apart, []).append((name, finding))
    counts = [len({name for name, _ in group}) for group in alike.values()]
    return [
        f"{group[0][0]}: {group[0][1]}" + (f", in {count} tests" if count > 1 else "")
        for group, count in zip(alike.values(), counts, strict=True)
    ]


def percent(share: float) -> str:
    """Return a share in per cent, or a dash where there is none."""
    return f"{100 * share:.2f} %" if math.isfinite(share) else "–"


def parse_pairs(pairs: Sequence[str], option: str) -> dict[str, str]:
    """NAME=VALUE arguments as text; raises `InputError` if one is not of that form."""
    values = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not equals or not name.strip():
            raise InputError(f"{option} {pair}", remedy=f"write {option} NAME=VALUE")
        values[name.strip()] = text.strip()
    return values


def parse_named(text: str, option: str) -> tuple[str, dict[str, float]]:
    """NAME or NAME:KEY=VALUE,KEY=VALUE as the name and its numbers; raises `InputError` if it is not of that form."""
    name, colon, rest = text.partition(":")
    if not colon or "=" not in rest:
        return text, {}
    return name, parse_numbers(rest.split(","), option)


def parse_numbers(pairs: Sequence[str], option: str, remedy: str = "give a number in SI units") -> dict[str, float]:
    """NAME=VALUE arguments as numbers; raises `InputError` if one is not of that form."""
    values = {}
    for name, text in parse_pairs(pairs, option).items():
        try:
            values[name] = float(text)
        except ValueError as error:
            raise InputError(f"{option} {name}={text}", remedy=remedy) from error
    return values


def parse_gas(text: str | None) -> GasSpring | None:
    """P,V,A in MPa, cm³ and mm² as a gas spring; raises `InputError` if it is not three positive numbers."""
    if text is None:
        return None
    from mrdamper.physics.gas_spring import GasSpring

    try:
        pressure, volume, area = (float(part) for part in text.split(","))
    except ValueError as error:
        raise InputError(
            f"--gas {text}", remedy="write --gas P,V,A in MPa, cm³ and mm², for example 1.5,150,314"
        ) from error
    return GasSpring(1e6 * pressure, 1e-6 * volume, 1e-6 * area)
