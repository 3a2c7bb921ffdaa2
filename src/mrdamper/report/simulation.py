"""A simulation as files: simulation.html, histories.csv, measures.csv and figures."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType

import numpy as np

from mrdamper.data.atomic import ResultRecord, publish
from mrdamper.data.encoding import csv_text, rows_of
from mrdamper.data.wording import number
from mrdamper.report.page import render_page
from mrdamper.report.plots.simulation import MOST_DRAWN, histories, spectra
from mrdamper.report.plots.style import picture_files, picture_of
from mrdamper.systems.controller_comparison import ControllerComparison
from mrdamper.systems.measures import benchmark_ratios, measures
from mrdamper.systems.monte_carlo import LEVELS, Bands
from mrdamper.systems.result import Simulation

_ROWS = 20_000  # of histories.csv
# unit and factor by the end of the name of a measure
_UNITS = {
    "_m_s2": ("m/s²", 1.0),
    "_m_s1.75": ("m/s^1.75", 1.0),
    "_share": ("%", 100.0),
    "_m": ("mm", 1e3),
    "_N": ("N", 1.0),
    "_J": ("J", 1.0),
    "_A": ("A", 1.0),
}


def write_simulation(
    done: Simulation,
    folder: str | Path,
    beside: ControllerComparison | None = None,
    bands: Bands | None = None,
    facts: Mapping[str, str] = MappingProxyType({}),
) -> list[Path]:
    """Write a simulation atomically, and return the files, the page first.

    `beside` contains controllers for comparison, `bands` the ranges over draws of its dampers, `facts` what the page
    states on the system and its input. The folder is made if missing. Raises `OutputError` if it cannot be written to.
    """
    runs: dict[str, Simulation] = {type(done.controller).title: done}
    if beside is not None:
        runs |= beside.runs
    spread = {name: bands.quantiles()[name] for name in bands.measures} if bands else {}
    pictures = {"histories": picture_of(histories(runs)), "spectra": picture_of(spectra(runs))}
    columns = {title: measures(run) for title, run in runs.items()}
    names = list(dict.fromkeys(name for column in columns.values() for name in column))
    page = render_page(
        "simulation.html.j2",
        done.headline,
        f"mrdamper {version('mrdamper')}; step {number(1e3 * done.step, 3)} ms",
        done=done,
        columns=columns,
        names={name: _readable(name) for name in names},
        facts=facts,
        drawn=min(len(runs), MOST_DRAWN),
        shares={title: beside.share(title) for title in beside.runs} if beside else {},
        bands=bands,
        spread=spread,
        ratios=_ratios(runs, beside),
        figures={name: picture["svg"] for name, picture in pictures.items()},
    )
    rows = [{"measure": name, **{title: column.get(name) for title, column in columns.items()}} for name in names]
    for row in rows if bands else []:
        row |= dict(zip((f"{100 * level:g} %" for level in LEVELS), spread[row["measure"]], strict=True))
    every = slice(None, None, -(-done.time.size // _ROWS))
    samples = rows_of({name: column[every] for name, column in done.table.items()})
    files = {"simulation.html": page, "measures.csv": csv_text(rows), "histories.csv": csv_text(samples)}
    return publish(folder, {**files, **picture_files(pictures)}, ResultRecord("simulate"))


def _readable(name: str) -> tuple[str, str, float]:
    """Return the words, the unit and the factor on SI of a measure, whose name ends in its unit."""
    for end, (unit, factor) in _UNITS.items():
        if name.endswith(end):
            return name.removesuffix(end).replace(".", ": ").replace("_", " "), unit, factor
    return name.replace(".", ": "), "–", 1.0


def _ratios(runs: Mapping[str, Simulation], beside: ControllerComparison | None) -> dict[str, dict[str, float]]:
    """J ratios of a building to no current; none for a car or a single run."""
    if beside is None or next(iter(runs.values())).system.ground is None:
        return {}
    still = beside.runs["no current"]
    return {
        title: {name: value for name, value in benchmark_ratios(run, still).items() if np.isfinite(value)}
        for title, run in runs.items()
    }
