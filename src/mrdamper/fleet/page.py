"""Report of a population: one page from its table."""

from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from mrdamper.data import Floats
from mrdamper.data.atomic import write_file
from mrdamper.errors import ColumnError
from mrdamper.fleet.charts import Gauge, beyond, capability, ewma, gauge_study, individuals
from mrdamper.fleet.job import OTHER_RIG
from mrdamper.fleet.plan import Plan
from mrdamper.fleet.profile import ColumnLimits
from mrdamper.fleet.verdicts import FEATURES, clock_findings, drift, suspects, with_features
from mrdamper.report.page import render_page
from mrdamper.report.plots.figure import Figure, new_figure
from mrdamper.report.plots.style import PALETTE, picture_of

_MAX_CHART_POINTS = 500  # of a chart; with more dampers each point is the median of several
_WORST = 10
_MAX_LISTED = 50  # refused or failed dampers, and suspects, that the page lists


def write_page(table: Path, plan: Plan | None, limits: Mapping[str, ColumnLimits], path: Path) -> list[str]:
    """Write the page of a population; return the lines for the terminal: suspects, drift, limits.

    Pass and fail are stated only with limits (by column of the table). Raises `ColumnError` if a limit is for no column
    of numbers, `OutputError` if the page cannot be written.
    """
    kept = [c for c in pl.read_parquet_schema(table) if c != "loops"]
    whole = with_features(pl.read_parquet(table, columns=kept))
    unknown = [name for name in limits if name not in whole.columns or not whole[name].dtype.is_numeric()]
    if unknown:
        numbers = sorted(c for c in whole.columns if whole[c].dtype.is_numeric())
        raise ColumnError(f"no column {unknown[0]} to limit", where="limits", remedy=f"known: {', '.join(numbers)}")
    done = whole.filter(pl.col("status") == "done").sort("session", "serial", maintain_order=True)
    line, golden = done.filter(~pl.col("golden")), done.filter("golden")
    standing_out = suspects(line)
    features = {n: about for n, about in FEATURES.items() if line.height and line[n].null_count() < line.height}
    drifts = {n: _drift(done, n) for n in features if n.startswith("force")}
    verdicts = [_judged(line, name, limit) for name, limit in limits.items()]
    facts = {
        "counts": {s: whole.filter(pl.col("status") == s).height for s in ("done", "refused", "failed")},
        "dampers": whole["serial"].n_unique(),
        "plan": plan,
        "suspects": standing_out[:_MAX_LISTED],
        "more_suspects": max(0, len(standing_out) - _MAX_LISTED),
        "drifts": {features[n][0]: d for n, d in drifts.items()},
        "notes": [*clock_findings(done), *_other_rigs(done, plan)],
        "limits": verdicts,
        "gauge": {features[n]: g for n in features if (g := _gauge(golden, line, n)) is not None},
        "golden": sorted(set(golden["serial"].to_list())),
        "features": [_described(line, n, about) for n, about in features.items()],
        "worst": _worst(table, line, plan),
        "troubled": whole.filter(pl.col("status") != "done").head(_MAX_LISTED).rows(named=True),
    }
    with write_file(path) as target:
        text = render_page(
            "fleet.html.j2", "Fleet of dampers", f"mrdamper {version('mrdamper')}; {table.name}", **facts
        )
        target.write_text(text, encoding="utf-8")
    lines = [
        f"outlier: {s.serial} {s.session}: {s.cause} ({', '.join(s.findings)})" for s in standing_out[:_MAX_LISTED]
    ]
    lines += [f"and {len(standing_out) - _MAX_LISTED} more outliers"] * (len(standing_out) > _MAX_LISTED)
    lines += [f"{features[n][0]}: {d.text}" for n, d in drifts.items() if d.verdict != "none"]
    return lines + [f"limits of {v['name']}: {v['outside']} of {v['count']} outside" for v in verdicts] + facts["notes"]


def _other_rigs(done: pl.DataFrame, plan: Plan | None) -> list[str]:
    other = done.filter(pl.col("findings").str.contains(OTHER_RIG))
    if plan is None or not other.height:
        return []
    named = ", ".join(other["serial"].unique(maintain_order=True).to_list()[:_WORST])
    return [f"{other.height} dampers were not tested on rig {plan.rig!r} like most of the population: {named}"]


def _values(frame: pl.DataFrame, name: str) -> Floats:
    return frame[name].drop_nulls().to_numpy().astype(float)


def _drift(done: pl.DataFrame, name: str) -> Any:
    complete = done.drop_nulls(name)
    columns = (complete[c].to_list() for c in ("session", "serial", "golden"))
    return drift(_values(complete, name), *columns)


def _gauge(golden: pl.DataFrame, line: pl.DataFrame, name: str) -> Gauge | None:
    if not golden.height:
        return None
    wide = golden.pivot("session", index="serial", values=name, aggregate_function="mean").drop("serial")
    return gauge_study(wide.drop_nulls().to_numpy().astype(float), _values(line, name)) if wide.height else None


def _judged(line: pl.DataFrame, name: str, limit: ColumnLimits) -> dict[str, Any]:
    values = _values(line, name)
    serials = line.drop_nulls(name)["serial"].to_numpy()[beyond(values, limit.lower, limit.upper)].tolist()
    return {
        "name": name, "limit": limit, "capability": capability(values, limit.lower, limit.upper),
        "outside": len(serials), "count": values.size, "serials": serials[:_MAX_LISTED],
    }  # fmt: skip


def _described(line: pl.DataFrame, name: str, about: tuple[str, str]) -> dict[str, Any]:
    values = _values(line, name)
    charted, what = values, "dampers in the order of sessions and serial numbers"
    if values.size > _MAX_CHART_POINTS:
        together = -(-values.size // _MAX_CHART_POINTS)
        charted = np.array([np.median(values[i : i + together]) for i in range(0, values.size, together)])
        what = f"medians of {together} {what}"
    quantiles = np.quantile(values, [0.00135, 0.05, 0.5, 0.95, 0.99865]).tolist()
    first, ranges = individuals(charted)
    sigma = max((first.upper[0] - first.centre) / 3, 1e-12)
    average = ewma(charted, first.centre, sigma)
    return {
        "title": about[0], "unit": about[1], "quantiles": quantiles, "what": what,
        "signals": (len(first.signals), len(ranges.signals), len(average.signals)),
        "picture": picture_of(_chart(values, first, ranges, average, about))["svg"],
    }  # fmt: skip


def _chart(values: Floats, first: Any, ranges: Any, average: Any, about: tuple[str, str]) -> Figure:
    figure, *axes = new_figure(2, 2, 4.6)
    name = f"{about[0]} ({about[1]})"
    heights, edges = np.histogram(values, min(60, max(8, int(np.sqrt(values.size)))))
    axes[0].bars(edges, heights, PALETTE[1])
    axes[0].label(name, "dampers", "Distribution")
    for place, chart, title in (
        (axes[1], first, "Individuals"),
        (axes[2], ranges, "Moving range"),
        (axes[3], average, "EWMA"),
    ):
        at = np.arange(1, chart.values.size + 1)
        place.plot(at, chart.values, ".", ls="-", color=PALETTE[0], ms=3, lw=0.6)
        for limit in (chart.lower, chart.upper):
            place.plot(at, limit, ls="--", color=PALETTE[2], lw=0.8)
        place.line("x", chart.centre, color=PALETTE[1], lw=0.8)
        out = list(chart.signals)
        place.plot(at[out], chart.values[out], "o", color=PALETTE[2], ms=5, mfc="none")
        place.label("number", f"value ({about[1]})", title)
    return figure


def _worst(table: Path, line: pl.DataFrame, plan: Plan | None) -> dict[str, Any] | None:
    if plan is None or not line.height:
        return None
    far = line.drop_nulls("loop_deviation").sort("loop_deviation", descending=True).head(_WORST)
    keys = far.select("serial", "session")
    every = pl.scan_parquet(table).select("serial", "session", "loops")
    loops = every.join(keys.lazy(), on=["serial", "session"]).collect()
    by_name = {(serial, session): loop for serial, session, loop in loops.iter_rows()}
    figure, *axes = new_figure(1, min(4, len(plan.matrix)), 2.6)
    for number, place in enumerate(axes):
        current, frequency, amplitude = plan.matrix[number]
        phase = 2 * np.pi * (np.arange(len(plan.loops[number])) + 0.5) / len(plan.loops[number])
        speed = 1e3 * 2 * np.pi * frequency * amplitude * np.cos(phase)
        for key in keys.iter_rows():
            loop = by_name[key][number]
            if loop is not None:
                place.plot(speed, loop, color=PALETTE[2], lw=0.6, alpha=0.8)
        place.plot(speed, plan.loops[number], color=PALETTE[0], lw=1.4)
        place.label("velocity (mm/s)", "force (N)" if number == 0 else "", f"{current:g} A, {frequency:.3g} Hz")
    return {"rows": far.rows(named=True), "picture": picture_of(figure)["svg"]}
