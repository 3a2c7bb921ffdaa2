"""Test report of one or several specimens, without a model."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from mrdamper.data import Dataset, Run, same_motion
from mrdamper.data.atomic import ResultRecord, publish
from mrdamper.data.encoding import csv_text
from mrdamper.data.wording import counted, span
from mrdamper.errors import IdentificationError, InputError
from mrdamper.identification.characteristics import SIDES, Characteristics, Stroke
from mrdamper.report.about import About, Limit
from mrdamper.report.page import made_from, plain, render_page
from mrdamper.report.plots.characteristics import continuous_velocity_plot, figures_over_current, peak_velocity_plot
from mrdamper.report.plots.figure import Figure
from mrdamper.report.plots.style import picture_files, picture_of
from mrdamper.study.usable_runs import characterise_usable

_SOURCES = ("source", "file", "source_file")  # keys of a run's notes that name its source
_CURRENT_TOLERANCE = 0.03  # relative difference [-] up to which a current counts as that of a limit


def write_test_report(
    specimens: Mapping[str, Dataset],
    folder: str | Path,
    *,
    about: About | None = None,
    limits: Sequence[Limit] = (),
    ladder: Sequence[float] = (),
    png: bool = False,
    paper: str = "a4",
    tell: Callable[[str], None] = lambda line: None,
) -> list[Path]:
    """Write report.html, report.pdf, forces.csv, tests.csv and figures/ of one or several specimens.

    `specimens` are the tests of one damper each, by the name in the report. Pass or fail is stated only against
    `limits` of the damping force. `ladder` holds the velocities of the force table [m/s]; default: round values within
    the tests of the first specimen. `tell` is called with each test that is not evaluated, and why. Pages of report.pdf
    have the size `paper`, "a4" or "letter". Raises `IdentificationError` if a specimen has no steady cycle, or the
    tests of several dampers, and `OutputError` if the folder cannot be written to.
    """
    from mrdamper.report.pdf import pdf_of

    characteristics = {name: _characterised(name, dataset) for name, dataset in specimens.items()}
    passed_over = {run: why for one in characteristics.values() for run, why in one.passed_over.items()}
    for run, why in passed_over.items():
        tell(f"not evaluated: {run}: {why}")
    facts = facts_of_tests(characteristics, ladder, limits)
    first = next(iter(specimens.values()))
    about = about or About()
    also = ("pdf", "png") if png else ("pdf",)
    figures = figures_of_tests(first, characteristics, limits)
    pictures = {key: picture_of(figure, also) for key, figure in figures.items()}
    page = render_page(
        "tests.html.j2",
        about.title or f"Damper test report: {', '.join(characteristics)}",
        made_from(*specimens.values()) + ".",
        about=about,
        provenance=provenance(specimens),
        lead=facts["summary"],
        t=facts,
        pictures={key: picture["svg"] for key, picture in pictures.items()},
        passed_over=passed_over,
    )
    files = {
        "report.html": page,
        "report.pdf": pdf_of(page, {key: picture["pdf"] for key, picture in pictures.items()}, paper),
        "forces.csv": csv_text(force_rows(facts)),
        "tests.csv": csv_text(_test_rows(characteristics)),
    }
    return publish(folder, {**files, **picture_files(pictures)}, ResultRecord("report"))


def figures_of_tests(
    first: Dataset, specimens: Mapping[str, Characteristics], limits: Sequence[Limit] = ()
) -> dict[str, Figure]:
    """Draw the figures of a test report, by name; force through the cycle is that of the first specimen."""
    return {
        "peak_velocity": peak_velocity_plot(specimens, [_bar(limit) for limit in limits]),
        "cycle": continuous_velocity_plot(first, next(iter(specimens.values()))),
        "energy": figures_over_current(specimens),
    }


def _bar(limit: Limit) -> tuple[float, float, float, float]:
    """Return current [A], velocity [m/s], lower and upper force [N] of a limit as drawn: compression is negative."""
    sign = 1.0 if limit.side == "rebound" else -1.0
    return limit.current_A, limit.velocity_m_s, sign * limit.lower_N, sign * limit.upper_N


def facts_of_tests(
    specimens: Mapping[str, Characteristics], ladder: Sequence[float] = (), limits: Sequence[Limit] = ()
) -> dict[str, Any]:
    """Collect the values of the template: summary, set velocities, forces, currents, results against limits."""
    steps = tuple(ladder) or next(iter(specimens.values())).ladder()
    forces = [
        {
            "specimen": name,
            "current_A": current,
            "side": SIDES[side],
            "forces": [specimen.at_velocity(current, velocity, side) for velocity in steps],
        }
        for name, specimen in specimens.items()
        for current in specimen.currents
        for side in (0, 1)
    ]
    return {
        "summary": " ".join(_summary(name, specimen) for name, specimen in specimens.items()),
        "ladder": steps,
        "forces": forces,
        "currents": [_current_row(name, s, c) for name, s in specimens.items() for c in s.currents],
        "verdicts": [_verdict(name, s, limit) for name, s in specimens.items() for limit in limits],
    }


def force_rows(facts: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Tabulate the forces, one row per specimen, current, side and velocity."""
    return [
        {
            "specimen": row["specimen"],
            "current_A": row["current_A"],
            "side": row["side"],
            "velocity_m_s": velocity,
            "damping_force_N": None if np.isnan(force) else force,
        }
        for row in facts.get("forces", ())
        for velocity, force in zip(facts["ladder"], row["forces"], strict=True)
    ]


def provenance(specimens: Mapping[str, Dataset]) -> list[tuple[str, str]]:
    """List the sources of a report: runs, sampling rates, dates, files and a hash of the samples."""
    rows = []
    for name, dataset in specimens.items():
        rates = [(run.time.size - 1) / (run.time[-1] - run.time[0]) for run in dataset.runs]
        sampling = span(min(rates), max(rates), "Hz", 4, " to ")
        notes = [run.notes for run in dataset.runs]
        files = sorted({note[key] for note in notes for key in _SOURCES if note.get(key)})
        dates = sorted({note["recorded_at"][:10] for note in notes if note.get("recorded_at")})
        recorded = f", recorded {' to '.join(dict.fromkeys((dates[0], dates[-1])))}" if dates else ""
        rows.append((name, f"{counted(len(dataset), 'run')} at {sampling}{recorded}"))
        if files:
            rows.append((f"{name}: files", ", ".join(files)))
        rows.append((f"{name}: SHA-256 of the samples", data_hash(dataset.runs)))
    return [*rows, ("software", f"mrdamper {version('mrdamper')}")]


def data_hash(runs: Sequence[Run]) -> str:
    """Calculate a hash of the samples, independent of how they are stored."""
    digest = hashlib.sha256()
    for run in sorted(runs, key=lambda run: run.id):
        digest.update(run.id.encode())
        for channel in (run.time, run.displacement, run.force, run.current):
            digest.update(np.ascontiguousarray(channel, dtype="<f8").tobytes())
    return digest.hexdigest()


def _characterised(name: str, dataset: Dataset) -> Characteristics:
    if len(dataset.rigs) > 1:
        raise IdentificationError(
            f"holds the tests of {len(dataset.rigs)} dampers: {', '.join(dataset.rigs)}",
            where=name,
            remedy="name one: FOLDER:RIG",
        )
    try:
        return characterise_usable(dataset)
    except InputError as error:
        error.where = error.where or name
        raise


def _summary(name: str, specimen: Characteristics) -> str:
    friction = "" if np.isnan(specimen.friction) else f"{specimen.friction:.0f} N "
    return (
        f"{name}: {counted(len(specimen.strokes), 'test')} at {', '.join(plain(c) for c in specimen.currents)} A. "
        f"Gas force {specimen.gas_force:.0f} N ({specimen.gas_from}). Friction {friction}({specimen.friction_from})."
    )


def _current_row(name: str, specimen: Characteristics, current: float) -> dict[str, Any]:
    strokes = specimen.at(current)
    speeds = [s.condition.peak_velocity for s in strokes]
    energies = [s.energy for s in strokes]
    return {
        "specimen": name,
        "current_A": current,
        "tests": len(strokes),
        "slowest": min(speeds),
        "fastest": max(speeds),
        "rebound": max(specimen.damping_force(s, 0) for s in strokes),
        "compression": max(specimen.damping_force(s, 1) for s in strokes),
        "least_energy": min(energies),
        "most_energy": max(energies),
        "width": 1e3 * float(np.median([s.zero_force_velocity for s in strokes])),
        "dynamic_range": _dynamic_range(specimen, current),
    }


def _dynamic_range(specimen: Characteristics, current: float) -> float:
    lowest = specimen.currents[0]
    ratios = []
    for group in same_motion([s.condition for s in specimen.strokes]):
        members = {specimen.strokes[i].condition.current_A: specimen.strokes[i] for i in group}
        if lowest in members and current in members and (least := _both_sides(specimen, members[lowest])):
            ratios.append(_both_sides(specimen, members[current]) / least)
    return float(np.median(ratios)) if ratios else float("nan")


def _both_sides(specimen: Characteristics, stroke: Stroke) -> float:
    return (specimen.damping_force(stroke, 0) + specimen.damping_force(stroke, 1)) / 2


def _verdict(name: str, specimen: Characteristics, limit: Limit) -> dict[str, Any]:
    tolerance = 5e-3 + _CURRENT_TOLERANCE * abs(limit.current_A)
    near = [current for current in specimen.currents if abs(current - limit.current_A) <= tolerance]
    side = SIDES.index(limit.side)
    force = specimen.at_velocity(near[0], limit.velocity_m_s, side) if near else float("nan")
    verdict = "not tested" if np.isnan(force) else "pass" if limit.lower_N <= force <= limit.upper_N else "fail"
    return {"specimen": name, **limit.model_dump(), "measured_N": force, "verdict": verdict}


def _test_rows(specimens: Mapping[str, Characteristics]) -> list[dict[str, Any]]:
    return [
        {
            "specimen": name,
            "run_id": s.run_id,
            **asdict(s.condition),
            "peak_velocity_rebound_m_s": s.peak_velocity[0],
            "peak_velocity_compression_m_s": s.peak_velocity[1],
            "damping_force_rebound_N": specimen.damping_force(s, 0),
            "damping_force_compression_N": specimen.damping_force(s, 1),
            "gas_force_N": s.gas_force,
            "energy_J": s.energy,
            "zero_force_velocity_m_s": s.zero_force_velocity,
        }
        for name, specimen in specimens.items()
        for s in specimen.strokes
    ]
