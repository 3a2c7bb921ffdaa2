"""Open benchmark of hysteretic dampers: scores of every model of `compare` and of submissions.

`python -m benchmarks.open` evaluates the models and writes docs/benchmark.md; `--data FOLDER` writes the records to
identify from and the inputs to predict; `--score FOLDER` scores the predictions in a folder.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

import numpy as np
import polars as pl
from pydantic import BaseModel, ConfigDict, Field

from benchmarks.hysteretic import RATE, identified, made_record, sweep
from mrdamper.dampers.bands import band
from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.data import Dataset, Floats, Run, current_levels, session_of
from mrdamper.data.atomic import write_file, write_folder
from mrdamper.errors import ColumnError, DatasetError, InputError, NonFiniteError, RunError, UnknownNameError
from mrdamper.physics.motion import equivalent_sine
from mrdamper.rig_files.dataset_folder import load_dataset, save_dataset
from mrdamper.rig_files.strict_toml import load_toml
from mrdamper.statistics.metrics import nrmse_pp
from mrdamper.study.comparison import compare
from mrdamper.study.cross_validation import stretches
from mrdamper.study.recipe import RecipeResult
from mrdamper.study.validation import score_run
from mrdamper.systems.oscillator import multisine

LEVEL = 0.9  # of the prediction intervals
RESULTS = Path(__file__).with_name("open_results.json")
PAGE = Path(__file__).parent.parent / "docs" / "benchmark.md"
HYSTERETIC = "hysteretic"  # name of the system of Noël and Schoukens among the rigs
COLUMNS = ("run_id", "time_s", "predicted")  # of predictions; `low` and `high` may follow
_RESULTS_HEADING = "## Results\n"  # of the page; what follows is written by this program
_CLOCK = 1e-6  # largest difference between two instants of one sample [s]
_USELESS = 10.0  # error from which its size says no more [-]
_FAST = 0.8  # quantile of the peak velocity, from which a run counts as fast
_SIZE = 8192  # samples of a period of the hysteretic system
_TAPS = 1500  # of the linear response


class About(BaseModel):
    """Statements of a submission: about.toml."""

    model_config = ConfigDict(extra="forbid", strict=True)

    name: str = Field(min_length=1, max_length=80)
    parameters: int = Field(ge=0)
    knows_structure: bool
    seconds: float | int | None = Field(default=None, ge=0)
    reference: str = Field(default="", max_length=200)


@dataclass(frozen=True)
class Target:
    """A record to predict.

    Attributes
    ----------
    run_id, rig : str
    time : (N,) array
        [s]
    measured : (N,) array
        Force [N]; displacement [m] of the hysteretic system.
    scored : (N,) array of bool
        Samples that count.
    """

    run_id: str
    rig: str
    time: Floats
    measured: Floats
    scored: np.ndarray


@dataclass(frozen=True)
class Forecast:
    """A predicted record, with its 90 % interval where there is one."""

    predicted: Floats
    low: Floats | None = None
    high: Floats | None = None


@dataclass(frozen=True)
class Row:
    """One model on one rig.

    Attributes
    ----------
    errors : mapping of kind to (median, lower, upper)
        Median error and its 95 % bootstrap interval: nrmse_pp; [m] for the hysteretic system.
    coverage : float or None
        Share of the scored validation samples inside the 90 % prediction interval.
    """

    rig: str
    name: str
    knows_structure: bool
    errors: Mapping[str, tuple[float, float, float]]
    coverage: float | None
    parameters: int
    seconds: float | None


# ---------------------------------------------------------------- targets and scores


@cache
def hysteretic_records() -> Mapping[str, tuple[Floats, Floats]]:
    """Force [N] and displacement [m] of the validation records of the hysteretic system."""
    force = multisine(np.random.default_rng(2), _SIZE, RATE, (5.0, 150.0), rms=50.0)
    swept = sweep(60.0)
    return {
        "multisine": (force, made_record(force, periodic=True)),
        "sweep": (swept, made_record(swept, periodic=False)),
    }


def targets(runs: Iterable[Run]) -> dict[str, Target]:
    """Every record to predict: the validation runs of the rigs, two records of the hysteretic system."""
    found = [Target(run.id, run.rig, run.time, run.force, run.in_window) for run in runs if run.split == "validate"]
    for name, (_, displacement) in hysteretic_records().items():
        every = np.ones(displacement.size, dtype=bool)
        found.append(Target(name, HYSTERETIC, np.arange(displacement.size) / RATE, displacement, every))
    return {target.run_id: target for target in found}


def error_of(target: Target, predicted: Floats) -> float:
    """RMS error over the peak-to-peak force; for the hysteretic system the RMS error [m]."""
    at = target.scored
    scale = float(np.ptp(target.measured[at])) if target.rig == HYSTERETIC else 1.0
    return scale * nrmse_pp(target.measured[at], predicted[at])


def coverage_of(wanted: Mapping[str, Target], forecasts: Mapping[str, Forecast]) -> float | None:
    """Share of the scored samples inside the intervals; None where a record has none."""
    inside = []
    for name, target in wanted.items():
        given = forecasts[name]
        if given.low is None or given.high is None:
            return None
        inside.append(((given.low <= target.measured) & (target.measured <= given.high))[target.scored])
    return float(np.mean(np.concatenate(inside)))


def summary(errors: Sequence[float]) -> tuple[float, float, float]:
    """Median, and its 95 % percentile interval of 2,000 bootstrap samples of the runs."""
    values = np.asarray(errors)
    draws = np.random.default_rng(0).integers(values.size, size=(2000, values.size))
    low, high = np.quantile(np.median(values[draws], axis=1), (0.025, 0.975))
    return float(np.median(values)), float(low), float(high)


def validation_errors(
    wanted: Mapping[str, Target], forecasts: Mapping[str, Forecast]
) -> dict[str, tuple[float, float, float]]:
    """Errors by kind: all validation runs of a rig, each record of the hysteretic system."""
    errors = {name: error_of(target, forecasts[name].predicted) for name, target in wanted.items()}
    if all(target.rig == HYSTERETIC for target in wanted.values()):
        return {name: (error, error, error) for name, error in errors.items()}
    return {"validation": summary(list(errors.values()))}


# ---------------------------------------------------------------- models of compare


def folds(runs: Sequence[Run]) -> dict[str, list[list[int]]]:
    """Folds of cross-validation beside single conditions: a current, a session, the fastest motions."""
    levels = current_levels([run.mean_current for run in runs])
    sessions = [session_of(run) for run in runs]
    speeds = np.array([equivalent_sine(run).condition.peak_velocity for run in runs])
    groups = {
        "current": [[i for i, level in enumerate(levels) if level == one] for one in dict.fromkeys(levels)],
        "session": [[i for i, session in enumerate(sessions) if session == one] for one in dict.fromkeys(sessions)],
        "fastest": [np.flatnonzero(speeds >= np.quantile(speeds, _FAST)).tolist()],
    }
    return {kind: parts for kind, parts in groups.items() if len(parts) > 1 or kind == "fastest"}


def left_out_errors(entry: RecipeResult, rig: Dataset) -> dict[str, list[float]]:
    """Errors of identification runs predicted by refits without their fold; a fold that allows no refit is missing."""
    ids = {score.run_id for score in entry.train.runs}
    runs = [run for run in rig.split("train") if run.id in ids]
    if entry.recipe.basis is None:
        runs = [piece for run in runs for piece in stretches(run)]
    made = entry.recipe.make(runs, entry.identifications)
    errors: dict[str, list[float]] = {"condition": [run.scores.nrmse_pp for run in entry.cross_validated.runs]}
    for kind, groups in folds(runs).items():
        for group in groups:
            try:
                damper = made.refit([i for i in range(len(runs)) if i not in set(group)])
                scores = [score_run(damper, runs[i]).scores.nrmse_pp for i in group]
            except InputError:
                errors.pop(kind, None)
                break
            errors.setdefault(kind, []).extend(scores)
    return errors


def forecasts_of(entry: RecipeResult, rig: Dataset) -> dict[str, Forecast]:
    """Validation runs of a rig as a model of `compare` predicts them."""
    ids = {score.run_id for score in entry.train.runs}
    calibrating = [score.predicted for score in entry.cross_validated.runs if score.predicted is not None]
    held = getattr(entry.fit, "at_bounds", ())
    damper = estimate_uncertainty(entry.damper, [run for run in rig.split("train") if run.id in ids], calibrating, held)
    forecasts = {}
    for run in rig.split("validate"):
        prediction = damper.predict(run)
        interval = band(damper, prediction, LEVEL, np.ones(run.time.size, dtype=bool))
        ends = (None, None) if interval is None else (interval.low, interval.high)
        forecasts[run.id] = Forecast(prediction.force, *ends)
    return forecasts


def evaluate(dataset: Dataset, names: Sequence[str] = (), jobs: int | None = None) -> list[Row]:
    """Models of `compare` on the rigs of a dataset."""
    wanted, rows = targets(dataset), []
    for rig in compare(dataset, names, jobs=jobs).rigs:
        own = {name: target for name, target in wanted.items() if target.rig == rig.rig}
        for entry in rig.entries:
            forecasts = forecasts_of(entry, rig.dataset)
            errors = {kind: summary(values) for kind, values in left_out_errors(entry, rig.dataset).items()}
            errors |= validation_errors(own, forecasts)
            numbers, coverage = entry.damper.parameter_count, coverage_of(own, forecasts)
            rows.append(Row(rig.rig, entry.title, False, errors, coverage, numbers, entry.seconds))
    return rows


def evaluate_hysteretic() -> list[Row]:
    """The hysteretic system: its own structure identified, and a linear response as reference."""
    wanted = {name: target for name, target in targets(()).items() if target.rig == HYSTERETIC}
    begin = time.process_time()
    system = identified(1, 0).oscillator
    spent = time.process_time() - begin
    known = {
        name: Forecast(system.response(force, RATE, periodic=name == "multisine"))
        for name, (force, _) in hysteretic_records().items()
    }
    begin = time.process_time()
    linear = linear_response()
    fast = time.process_time() - begin
    plain = {name: Forecast(_filtered(linear, force, name)) for name, (force, _) in hysteretic_records().items()}
    return [
        Row(HYSTERETIC, "Bouc–Wen oscillator", True, validation_errors(wanted, known), None, 7, spent),
        Row(HYSTERETIC, "linear impulse response", False, validation_errors(wanted, plain), None, _TAPS, fast),
    ]


def hysteretic_identification() -> tuple[Floats, Floats]:
    """Force [N] and displacement [m] to identify the hysteretic system from: one period, 1 % noise."""
    rng = np.random.default_rng(1)
    force = multisine(rng, _SIZE, RATE, (5.0, 150.0), rms=50.0)
    clean = made_record(force, periodic=True)
    return force, clean + 0.01 * np.std(clean) * rng.standard_normal(_SIZE)


def linear_response() -> Floats:
    """Impulse response by least squares [m/N]."""
    force, displacement = hysteretic_identification()
    shifted = np.stack([np.roll(force, lag) for lag in range(_TAPS)], axis=1)
    return np.linalg.lstsq(shifted, displacement, rcond=1e-3)[0]


def _filtered(response: Floats, force: Floats, name: str) -> Floats:
    record = np.concatenate([force, force]) if name == "multisine" else force
    return np.convolve(record, response)[record.size - force.size : record.size]


# ---------------------------------------------------------------- submissions


def read_forecasts(folder: Path, wanted: Mapping[str, Target]) -> dict[str, Forecast]:
    """Predictions of a folder: predictions.parquet or predictions.csv.

    Raises
    ------
    DatasetError
        If there is no such file, it cannot be read, or records of a rig that was begun are missing.
    ColumnError
        If a column is missing or no number.
    UnknownNameError
        If a record is none of the benchmark.
    NonFiniteError
        If a prediction is NaN or infinite.
    RunError
        If a record is predicted on another clock.
    """
    table = _table(folder)
    missing = [name for name in COLUMNS if name not in table.columns]
    if missing:
        raise ColumnError(f"no column {missing[0]}", where="predictions", remedy=f"write {', '.join(COLUMNS)}")
    try:
        table = table.with_columns(pl.col("run_id").cast(pl.String), pl.exclude("run_id").cast(pl.Float64))
    except pl.exceptions.PolarsError as error:
        raise ColumnError("a cell is no number", where="predictions", remedy="write plain numbers") from error
    parts = table.partition_by("run_id", as_dict=True, maintain_order=True)
    forecasts = {str(name): _forecast(str(name), part, wanted) for (name,), part in parts.items()}
    begun = {wanted[name].rig for name in forecasts}
    absent = [name for name, target in wanted.items() if target.rig in begun and name not in forecasts]
    if absent or not forecasts:
        listed = ", ".join(absent[:5]) or "all"
        raise DatasetError(
            f"runs without prediction: {listed}", where="predictions", remedy="predict every run of a rig"
        )
    return forecasts


def _table(folder: Path) -> pl.DataFrame:
    try:
        if (folder / "predictions.parquet").is_file():
            return pl.read_parquet(folder / "predictions.parquet")
        return pl.read_csv(folder / "predictions.csv", infer_schema=False)
    except (OSError, pl.exceptions.PolarsError) as error:
        remedy = "write predictions.csv or predictions.parquet there"
        raise DatasetError("no predictions that can be read", where=str(folder), remedy=remedy) from error


def _forecast(name: str, part: pl.DataFrame, wanted: Mapping[str, Target]) -> Forecast:
    if name not in wanted:
        raise UnknownNameError.of("run", name, list(wanted))
    target, where = wanted[name], f"run {name}"
    columns = {column: part[column].to_numpy() for column in part.columns if column in (*COLUMNS[1:], "low", "high")}
    if ("low" in columns) != ("high" in columns):
        raise ColumnError("an interval with one end", where=where, remedy="write both low and high, or neither")
    for column, values in columns.items():
        if not np.isfinite(values).all():
            raise NonFiniteError(
                f"{column} is not finite in {np.sum(~np.isfinite(values))} samples",
                where=where,
                remedy="write a number",
            )
    clock = columns["time_s"]
    if clock.size != target.time.size or np.abs(clock - target.time).max() > _CLOCK:
        raise RunError(
            f"{clock.size} samples on another clock than the {target.time.size} of the run",
            where=where,
            remedy="predict at time_s of the inputs",
        )
    return Forecast(columns["predicted"], columns.get("low"), columns.get("high"))


def score_folder(folder: Path, runs: Iterable[Run]) -> list[Row]:
    """Score a submission; a row for each rig that it predicts."""
    about = load_toml(folder / "about.toml", About, DatasetError, "docs/benchmark.md")
    wanted = targets(runs)
    forecasts = read_forecasts(folder, wanted)
    rows = []
    for rig in dict.fromkeys(wanted[name].rig for name in forecasts):
        own = {name: target for name, target in wanted.items() if target.rig == rig}
        errors, coverage = validation_errors(own, forecasts), coverage_of(own, forecasts)
        rows.append(Row(rig, about.name, about.knows_structure, errors, coverage, about.parameters, about.seconds))
    return rows


def write_data(folder: Path, dataset: Dataset) -> None:
    """Write what to identify from and the inputs to predict, whole or not at all."""
    force, displacement = hysteretic_identification()
    with write_folder(folder) as out:
        for rig in dataset.rigs:
            own = dataset.rig(rig)
            save_dataset(own.only(own.split("train")), out / rig)
        clock = np.arange(_SIZE) / RATE
        pl.DataFrame({"time_s": clock, "force_N": force, "displacement_m": displacement}).write_parquet(
            out / f"{HYSTERETIC}.parquet"
        )
        runs = [run for run in dataset if run.split == "validate"]
        pl.concat(
            pl.DataFrame({"displacement_m": run.displacement, "current_A": run.current}).select(
                pl.lit(run.rig).alias("rig"), pl.lit(run.id).alias("run_id"), pl.Series("time_s", run.time), pl.all()
            )
            for run in runs
        ).write_parquet(out / "inputs.parquet")
        pl.concat(
            pl.DataFrame({"time_s": np.arange(given.size) / RATE, "force_N": given}).select(
                pl.lit(name).alias("run_id"), pl.all()
            )
            for name, (given, _) in hysteretic_records().items()
        ).write_parquet(out / f"{HYSTERETIC}_inputs.parquet")


# ---------------------------------------------------------------- page


def page(rows: Sequence[Row]) -> str:
    """The page of documentation: what is written by hand, and the results anew."""
    text = PAGE.read_text(encoding="utf-8").partition(_RESULTS_HEADING)[0] + _RESULTS_HEADING
    for rig in dict.fromkeys(row.rig for row in rows):
        text += f"\n### {rig}\n\n{table([row for row in rows if row.rig == rig])}\n"
    return text


def table(rows: Sequence[Row]) -> str:
    """Rows of one rig as Markdown, the least validation error first."""
    kinds = list(dict.fromkeys(kind for row in rows for kind in row.errors))
    show = _metres if rows[0].rig == HYSTERETIC else _percent
    order = sorted(rows, key=lambda row: row.errors[kinds[-1]][0])
    heads = ["model", "knows the structure", *kinds, "coverage", "parameters", "s"]
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for row in order:
        cells = [show(*row.errors[kind]) if kind in row.errors else "–" for kind in kinds]
        coverage = "–" if row.coverage is None else f"{100 * row.coverage:.0f} %"
        spent = "–" if row.seconds is None else f"{row.seconds:.1f}"
        facts = [row.name, "yes" if row.knows_structure else "no", *cells, coverage, str(row.parameters), spent]
        lines.append("| " + " | ".join(facts) + " |")
    return "\n".join(lines)


def _percent(*errors: float) -> str:
    median, low, high = (f"{100 * error:.1f}" if error < _USELESS else f"> {100 * _USELESS:.0f}" for error in errors)
    return f"{median} ({low}–{high})"


def _metres(error: float, low: float, high: float) -> str:
    return f"{error:.1e} m"


def main() -> None:
    """Run what the arguments ask for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.open", description=__doc__)
    parser.add_argument("--data", type=Path, metavar="FOLDER", help="write records and inputs there")
    parser.add_argument("--score", type=Path, metavar="FOLDER", help="score the predictions there")
    parser.add_argument("--jobs", type=int, default=None, help="processes; default one per core")
    chosen = parser.parse_args()
    dataset = load_dataset()
    try:
        if chosen.data:
            write_data(chosen.data, dataset)
        elif chosen.score:
            for row in score_folder(chosen.score, dataset):
                print(f"{row.rig}\n{table([row])}\n")
        else:
            rows = [*evaluate(dataset, jobs=chosen.jobs), *evaluate_hysteretic()]
            with write_file(RESULTS) as out:
                out.write_text(json.dumps([asdict(row) for row in rows], indent=1, ensure_ascii=False) + "\n", "utf-8")
            with write_file(PAGE) as out:
                out.write_text(page(rows), encoding="utf-8")
    except InputError as error:
        raise SystemExit(f"{error}") from None


if __name__ == "__main__":
    main()
