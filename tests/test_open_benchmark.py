"""The open benchmark: submissions are scored as models are, bad ones are named, the page shows the stored results."""

import json
import sys
from pathlib import Path

import numpy as np
import polars as pl
import pytest

sys.path.insert(0, str(Path(__file__).parent.parent))

from benchmarks import open as benchmark
from mrdamper.cli.commands.explain import load_codes
from mrdamper.errors import InputError
from mrdamper.statistics.metrics import nrmse_pp

ABOUT = 'name = "Mine"\nparameters = 3\nknows_structure = false\n'


@pytest.fixture(autouse=True)
def short(monkeypatch):
    """A short record in place of the hysteretic system's, whose integration takes seconds."""
    monkeypatch.setattr(benchmark, "hysteretic_records", lambda: {"sweep": (np.zeros(9), np.arange(9.0))})
    monkeypatch.setattr(benchmark, "hysteretic_identification", lambda: (np.zeros(8192), np.zeros(8192)))


@pytest.fixture(scope="module")
def runs(bundled):
    return {run.id: run for run in bundled.rig("labcontrol") if run.split == "validate"}


@pytest.fixture
def submit(tmp_path, runs):
    """Write a submission for one rig, changed by a function, and score it."""

    def scored(change=lambda table: table, about=ABOUT, kind="csv"):
        table = pl.concat(
            pl.DataFrame({"run_id": [name] * run.time.size, "time_s": run.time, "predicted": 0.9 * run.force})
            for name, run in runs.items()
        )
        getattr(change(table), f"write_{kind}")(tmp_path / f"predictions.{kind}")
        (tmp_path / "about.toml").write_text(about)
        return benchmark.score_folder(tmp_path, runs.values())

    return scored


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_a_submission_has_the_errors_of_its_arrays(submit, runs, kind):
    (row,) = submit(kind=kind)
    errors = [nrmse_pp(run.force[run.in_window], 0.9 * run.force[run.in_window]) for run in runs.values()]
    median, low, high = row.errors["validation"]
    assert median == pytest.approx(np.median(errors), rel=1e-12)
    assert min(errors) <= low <= median <= high <= max(errors)
    assert (row.rig, row.name, row.parameters, row.coverage) == ("labcontrol", "Mine", 3, None)
    assert "Mine" in benchmark.table([row])


def test_coverage_counts_samples_inside(submit):
    def half(table):
        truth = table["predicted"] / 0.9
        inside = np.arange(len(table)) % 2 == 0
        return table.with_columns(low=truth - 1, high=pl.Series(np.where(inside, truth + 1, truth - 0.5)))

    (row,) = submit(half)
    assert row.coverage == pytest.approx(0.5, abs=0.01)


def _first(table):
    return table["run_id"][0]


def _begun_with(table, value):
    return table.with_columns(predicted=pl.when(pl.col("time_s") == 0).then(value).otherwise(0.0))


BAD = {
    "a missing run": (lambda t: t.filter(pl.col("run_id") != _first(t)), "E_DATASET", "without prediction"),
    "no run": (lambda t: t.head(0), "E_DATASET", "without prediction"),
    "NaN": (lambda t: _begun_with(t, np.nan), "E_NONFINITE", "not finite in 1 samples"),
    "an empty cell": (lambda t: _begun_with(t, None), "E_NONFINITE", "not finite"),
    "another clock": (lambda t: t.with_columns(pl.col("time_s") * 1.001), "E_RUN", "another clock"),
    "fewer samples": (lambda t: t.gather_every(2), "E_RUN", "another clock"),
    "an unknown run": (lambda t: t.with_columns(run_id=pl.lit("lab_X")), "E_NAME", "no run is called"),
    "a missing column": (lambda t: t.drop("predicted"), "E_COLUMN", "no column predicted"),
    "one end of an interval": (lambda t: t.with_columns(low=pl.lit(0.0)), "E_COLUMN", "one end"),
    "text": (lambda t: t.with_columns(predicted=pl.lit("high")), "E_COLUMN", "no number"),
}  # fmt: skip


@pytest.mark.parametrize("kind", BAD)
def test_a_bad_submission_is_named(submit, kind):
    change, code, words = BAD[kind]
    with pytest.raises(InputError, match=words) as refused:
        submit(change)
    assert refused.value.code == code
    assert code in load_codes()


@pytest.mark.parametrize(("about", "words"), [("nmae = 'x'\n" + ABOUT, "nmae"), ('name = "Mine"\n', "parameters")])
def test_a_bad_statement_is_named(submit, about, words):
    with pytest.raises(InputError, match=words) as refused:
        submit(about=about)
    assert refused.value.code == "E_DATASET"


def test_folds_leave_out_whole_currents_and_the_fastest(bundled):
    runs = list(bundled.rig("labcontrol").split("train"))
    found = benchmark.folds(runs)
    assert sorted(i for group in found["current"] for i in group) == list(range(len(runs)))
    for group in found["current"]:
        inside = {round(runs[i].mean_current, 1) for i in group}
        assert inside.isdisjoint({round(runs[i].mean_current, 1) for i in set(range(len(runs))) - set(group)})
    (fastest,) = found["fastest"]
    assert 0 < len(fastest) < len(runs) / 3


def test_the_page_shows_the_stored_results():
    rows = [benchmark.Row(**row) for row in json.loads(benchmark.RESULTS.read_text(encoding="utf-8"))]
    assert benchmark.PAGE.read_text(encoding="utf-8") == benchmark.page(rows)
    assert {row.rig for row in rows} == {"utfsm", "labcontrol", benchmark.HYSTERETIC}


def test_the_data_hold_no_validation_force(bundled, tmp_path):
    benchmark.write_data(tmp_path / "data", bundled)
    inputs = pl.read_parquet(tmp_path / "data" / "inputs.parquet")
    assert inputs.columns == ["rig", "run_id", "time_s", "displacement_m", "current_A"]
    assert set(inputs["run_id"]) == {run.id for run in bundled if run.split == "validate"}
    stored = pl.read_csv(tmp_path / "data" / "utfsm" / "runs.csv")
    assert set(stored["run_id"]).isdisjoint(inputs["run_id"])
