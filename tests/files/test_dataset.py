import gzip
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from support.synthetic import synthetic_run

from mrdamper.data import Condition, Dataset, Run
from mrdamper.errors import (
    ColumnError,
    DatasetError,
    InputError,
    NonFiniteError,
    OutputError,
    RunError,
    TimeOrderError,
    UnitError,
)
from mrdamper.rig_files import dataset_samples
from mrdamper.rig_files.dataset_folder import load_dataset, save_dataset


def dataset():
    nominal = Condition(0.5, 1.0, 0.01)
    steady = synthetic_run(nominal, id="a", rig="r", nominal=nominal, repeatability=0.004, notes={"licence": "MIT"})
    t = np.linspace(0, 1, 200)
    varying = Run("b", t, 0.01 * np.sin(7 * t), np.cos(7 * t), t, velocity=0.07 * np.cos(7 * t), rig="r",
                  excitation="chirp", split="validate")  # fmt: skip
    return Dataset((steady, varying), "two")


def test_round_trip_keeps_every_bit(tmp_path):
    before = dataset()
    save_dataset(before, tmp_path / "d")
    after = load_dataset(tmp_path / "d")
    for a, b in zip(before, after, strict=True):
        for name in ("time", "displacement", "force", "current"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
        for name in ("id", "rig", "excitation", "split", "nominal", "window", "repeatability"):
            assert getattr(a, name) == getattr(b, name), name
        assert dict(a.notes) == dict(b.notes)
    np.testing.assert_array_equal(before["b"].velocity, after["b"].velocity)
    assert after["a"].velocity is None
    assert (after, hash(after)) == (before, hash(before))
    run = after.runs[0]
    fast = replace(run, velocity=run.force)
    assert run != fast != run
    changed = [replace(run, force=-run.force), replace(run, split="validate"), replace(run, notes={"a": "b"})]
    assert [run == other for other in (*changed, "text", replace(run, further={"T_C": run.force}))] == [False] * 5
    warm = [replace(run, further={"T_C": np.where(run.force > 0, np.nan, 20.0)}) for _ in range(2)]
    assert warm[0] == warm[1]
    assert Dataset((changed[0], *after.runs[1:])) != after


def test_the_result_of_a_study_is_no_dataset_and_no_rig_files(tmp_path):
    for name in ("identifications.csv", "model-utfsm.json", "report.html"):
        (tmp_path / name).write_text("{}")
    with pytest.raises(DatasetError, match="this is the result of a study"):
        load_dataset(tmp_path)


def test_a_constant_current_is_corrected_in_the_table_of_runs_beside_a_measured_one(tmp_path, bundled):
    still, other = (replace(run, id=name) for run, name in zip(list(bundled)[:2], "ab", strict=True))
    still = replace(still, current=np.full(still.time.size, 1.0))
    measured = replace(other, current=1.0 + 0.01 * np.sin(other.time))
    save_dataset(Dataset((still, measured)), tmp_path / "ds")
    np.testing.assert_array_equal(load_dataset(tmp_path / "ds")["b"].current, measured.current)
    table = tmp_path / "ds" / "runs.csv"
    lines = table.read_text().splitlines()
    at = lines[0].split(",").index("current_A")
    cells = lines[1].split(",")
    cells[at] = "0.5"
    table.write_text("\n".join([lines[0], ",".join(cells), *lines[2:]]) + "\n")
    assert load_dataset(tmp_path / "ds")["a"].current_A == 0.5


def test_records_too_long_for_one_table_are_stored_with_the_channels_of_each(tmp_path, monkeypatch):
    """What is larger than some pieces is written piece by piece; no piece stays behind."""
    monkeypatch.setattr("mrdamper.rig_files.dataset_folder._SAMPLES_PER_CHUNK", 60)
    time = np.arange(1000.0)
    warm = Run("warm", time, np.sin(time), np.cos(time), 0.5, further={"oil_C": 20 + time})
    fast = Run("fast", time, np.sin(time), np.cos(time), np.linspace(0, 1, 1000), velocity=np.cos(time))
    save_dataset(Dataset((warm, fast)), tmp_path / "ds")
    assert sorted(path.name for path in (tmp_path / "ds").iterdir()) == ["runs.csv", "samples.parquet"]
    for stored, run in zip(load_dataset(tmp_path / "ds"), (warm, fast), strict=True):
        for name, values in run.table.items():
            np.testing.assert_array_equal(stored.table[name], values)
        assert set(stored.table) == set(run.table)
        assert set(stored.further) == set(run.further)
    np.testing.assert_array_equal(load_dataset(tmp_path / "ds").runs[0].further["oil_C"], 20 + time)


def test_a_relative_path_is_of_the_folder_one_stands_in(tmp_path, monkeypatch):
    for name in ("first", "second"):  # the process that reads was started in the first
        (tmp_path / name).mkdir()
        monkeypatch.chdir(tmp_path / name)
        save_dataset(dataset(), f"{name}-tests")
        assert len(load_dataset(f"{name}-tests")) == 2


def test_a_killed_save_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(pl.DataFrame, "write_parquet", lambda *a, **k: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        save_dataset(dataset(), tmp_path / "d")
    assert list(tmp_path.iterdir()) == []


def test_an_existing_dataset_is_not_overwritten(tmp_path):
    save_dataset(dataset(), tmp_path / "d")
    with pytest.raises(OutputError, match="not empty"):
        save_dataset(dataset(), tmp_path / "d")


def test_bundled_data_is_what_its_table_says(bundled):
    assert bundled.rigs == ("labcontrol", "utfsm")
    assert len(bundled) == 53
    assert len(bundled.split("train")) == 41
    assert sum(run.time.size for run in bundled) == 247_012 or sum(run.time.size for run in bundled) > 200_000
    assert bundled["utf_10mm2Hz_1A"].current_A == 1.0


HEADER = "run_id,current_A\n"
SAMPLES = "run_id,time_s,displacement_m,force_N\n"


def rows(*lines):
    return SAMPLES + "".join(f"{line}\n" for line in lines)


GOOD = rows("a,0,0,0", "a,1,1,1", "a,2,0,0", "a,3,1,1")
WITH_CURRENT = GOOD.replace("force_N", "force_N,current_A").replace("0,0\n", "0,0,0.5\n").replace("1,1\n", "1,1,0.5\n")


@pytest.mark.parametrize(
    ("runs", "samples", "error", "text"),
    [
        (None, GOOD, DatasetError, "runs.csv is missing; write one row a run"),
        (HEADER + "a,1\n", None, DatasetError, "none of samples.parquet"),
        ("name,current_A\na,1\n", GOOD, ColumnError, "column run_id is missing"),
        (HEADER, GOOD, DatasetError, "no rows"),
        (HEADER + "a,1\nb,1\n", GOOD, DatasetError, "run b has no samples"),
        (HEADER + "a,1\n", rows(), DatasetError, "run a has no samples"),
        (HEADER + "b,1\n", GOOD.replace("a,0", "b,0"), DatasetError, "samples name run 'a'"),
        (HEADER + "a,\n", GOOD, ColumnError, "no current_A"),
        (HEADER + "a,x\n", GOOD, ColumnError, "current_A is 'x'"),
        ("run_id\na\n", GOOD, ColumnError, "no current_A"),
        (HEADER + "a,1\n", GOOD.replace("force_N", "force_kN"), UnitError, "'force_kN' where 'force_N'"),
        (HEADER + "a,1\n", GOOD.replace(",force_N", ",load"), ColumnError, "column force_N is missing"),
        (HEADER + "a,1\n", GOOD.replace("a,1,1,1", "a,1,1,x"), InputError, "force_N"),
        (HEADER + "a,1\n", GOOD.replace("a,1,1,1", "a,1,1,nan"), NonFiniteError, "1 values"),
        (HEADER + "a,1\n", GOOD.replace("a,1,1,1", "a,1,1,"), NonFiniteError, "1 values"),
        (HEADER + "a,1\n", GOOD.replace("a,2,", "a,1,"), TimeOrderError, "at sample 2"),
        (HEADER + "a,1\na,1\n", GOOD, RunError, "two runs are called a"),
        (HEADER + "a,1\n", WITH_CURRENT, ColumnError, "current_A is 1 A, and 0.5 A in the samples; if the samples"),
        ("run_id,current_A,split\na,1,test\n", GOOD, RunError, "use train or validate"),
    ],
)
def test_bad_folders_are_refused_with_place_and_remedy(tmp_path, runs, samples, error, text):
    if runs is not None:
        (tmp_path / "runs.csv").write_text(runs)
    if samples is not None:
        (tmp_path / "samples.csv").write_text(samples)
    with pytest.raises(error) as caught:
        load_dataset(tmp_path)
    assert text in str(caught.value)
    assert "[E_" in str(caught.value)


@pytest.mark.parametrize("cell", ["0.5", "-0.51", ""])
def test_a_current_of_the_samples_may_stand_in_the_table_too(tmp_path, cell):
    (tmp_path / "runs.csv").write_text(f"{HEADER}a,{cell}\n")
    (tmp_path / "samples.csv").write_text(WITH_CURRENT)
    np.testing.assert_array_equal(load_dataset(tmp_path)["a"].current, 0.5)


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(DatasetError, match="no such folder"):
        load_dataset(tmp_path / "nowhere")


@pytest.mark.parametrize("cell", ["1_0", "٣", "nan", "1,5", "0x10"])
def test_a_number_is_what_a_laboratory_writes(tmp_path, bundled, cell):
    save_dataset(bundled.only([bundled["utf_5mm4Hz_1A"]]), tmp_path / "set")
    table = tmp_path / "set" / "runs.csv"
    head, row = table.read_text().splitlines()
    at = head.split(",").index("current_A")
    cells = row.split(",")
    cells[at] = f'"{cell}"'
    table.write_text(f"{head}\n{','.join(cells)}\n", encoding="utf-8")
    with pytest.raises(ColumnError, match="current_A is"):
        load_dataset(tmp_path / "set")


def constant(count, **columns):
    table = {"run_id": pl.repeat("a", count, eager=True)}
    return pl.DataFrame(table | {c: pl.repeat(0.0, count, eager=True) for c in (*CHANNELS, *columns)})


CHANNELS = ("time_s", "displacement_m", "force_N")


@pytest.mark.parametrize("name", ["samples.parquet", "samples.csv.gz"])
def test_samples_that_unpack_without_end_are_refused_before(tmp_path, monkeypatch, name):
    monkeypatch.setattr(dataset_samples, "_UNPACKED", 2**24)
    (tmp_path / "runs.csv").write_text("run_id,current_A\na,0\n")
    if name.endswith("parquet"):
        constant(2**20).write_parquet(tmp_path / name, compression="zstd")
    else:
        with gzip.open(tmp_path / name, "wb", compresslevel=1) as file:
            file.write(b"run_id,time_s,displacement_m,force_N\n" + b"a,0,0,0\n" * 2**21)
    with pytest.raises(DatasetError) as error:
        load_dataset(tmp_path)
    assert error.value.code == "E_ARCHIVE_RATIO"


def test_many_columns_together_are_no_way_around_the_bound(tmp_path, monkeypatch):
    monkeypatch.setattr(dataset_samples, "_UNPACKED", 2**24)
    (tmp_path / "runs.csv").write_text("run_id,current_A\na,0\n")
    constant(2**17, **{f"c{i}": 0 for i in range(20)}).write_parquet(tmp_path / "samples.parquet", compression="zstd")
    with pytest.raises(DatasetError) as error:
        load_dataset(tmp_path)
    assert error.value.code == "E_ARCHIVE_RATIO"


def test_a_further_channel_does_not_replace_a_channel(tmp_path):
    time = np.arange(0.0, 4.0, 0.01)
    run = Run("a", time, np.sin(time), np.cos(time), 0.5, further={"force_N": 2 * np.cos(time)})
    with pytest.raises(OutputError, match="called force_N"):
        save_dataset(Dataset((run,)), tmp_path / "ds")
    assert not (tmp_path / "ds").exists()


def test_lists_and_text_in_further_columns_are_not_unpacked(tmp_path):
    (tmp_path / "runs.csv").write_text("run_id,current_A\na,0\n")
    t = np.arange(4.0)
    lists = [np.zeros(2**21)] * 4
    table = {"run_id": ["a"] * 4, "time_s": t, "displacement_m": t, "force_N": t, "list": lists, "text": ["x"] * 4}
    pl.DataFrame(table).write_parquet(tmp_path / "samples.parquet", compression="zstd")
    assert load_dataset(tmp_path)["a"].further == {}
    pl.DataFrame({**table, "force_N": lists}).write_parquet(tmp_path / "samples.parquet", compression="zstd")
    with pytest.raises(ColumnError, match="force_N holds text"):
        load_dataset(tmp_path)


def test_damaged_samples_are_refused_or_read(tmp_path):
    save_dataset(dataset(), tmp_path / "d")
    path = tmp_path / "d" / "samples.parquet"
    whole = path.read_bytes()
    rng = np.random.default_rng(1)
    refused = 0
    for _ in range(25):
        content = bytearray(whole)
        for at in rng.integers(len(whole) - 400, len(whole), 3):
            content[at] = rng.integers(256)
        path.write_bytes(content)
        try:
            load_dataset(tmp_path / "d")
        except InputError:
            refused += 1
    assert refused > 5


@pytest.mark.parametrize(
    ("table", "found"),
    [
        ("run_id,current_A," + ",".join(f"c{i}" for i in range(1000)), "1002 columns"),
        ("run_id,current_A,current_A\na,1,2", "2 of different names"),
        ("run_id,current_A\na,1,2", "3 cells under 2 columns in the row of run a"),
        ("run_id,current_A\n" + "a,1\n" * 100_001, "over 100,000 runs"),
    ],
)
def test_a_table_of_runs_has_bounds(tmp_path, table, found):
    (tmp_path / "runs.csv").write_text(table)
    with pytest.raises(DatasetError, match=found):
        load_dataset(tmp_path)


def test_rows_of_a_run_need_not_stand_together(tmp_path):
    (tmp_path / "runs.csv").write_text("run_id,current_A\na,0\nb,1\n")
    (tmp_path / "samples.csv").write_text(rows(*(f"{r},{t},{t % 2},{t}" for t in range(4) for r in "ba")))
    assert [run.force.tolist() for run in load_dataset(tmp_path)] == [[0, 1, 2, 3]] * 2


def written_with_volts(folder, **columns):
    time = np.arange(200) / 100
    volts = np.where(time > 1, 2.0, 0.5)
    table = pl.DataFrame(
        {"run_id": "a", "time_s": time, "displacement_m": np.sin(time), "force_N": time, "voltage_V": volts}
    )
    folder.mkdir()
    table.write_csv(folder / "samples.csv")
    (folder / "runs.csv").write_text(f"{','.join(['run_id', *columns])}\n{','.join(['a', *columns.values()])}\n")
    return time, volts


def test_a_voltage_is_a_current_once_its_gain_is_stated(tmp_path):
    _, volts = written_with_volts(tmp_path / "plain", amperes_per_volt="0.5")
    np.testing.assert_allclose(load_dataset(tmp_path / "plain")["a"].current, 0.5 * volts)
    time, _ = written_with_volts(tmp_path / "coil", amperes_per_volt="0.5", resistance_ohm="5", inductance_H="0.5")
    current = load_dataset(tmp_path / "coil")["a"].current
    after = time > 1.02
    np.testing.assert_allclose(current[after], 1 - 0.75 * np.exp(-(time[after] - 1) / 0.1), atol=0.05)
    save_dataset(load_dataset(tmp_path / "coil"), tmp_path / "again")
    np.testing.assert_array_equal(load_dataset(tmp_path / "again")["a"].current, current)


def test_volts_without_a_gain_are_refused(tmp_path):
    written_with_volts(tmp_path / "d")
    with pytest.raises(ColumnError, match="voltage_V without a gain") as caught:
        load_dataset(tmp_path / "d")
    assert caught.value.code == "E_DRIVER"
