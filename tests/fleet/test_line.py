"""One command for the whole line: its table, its bits, its refusals."""

import json
import os
import shutil
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import polars as pl
import pytest
from support.fleets import LINE, ROWS, planned, same_bits
from typer.testing import CliRunner

from benchmarks.synthetic_fleet import Population
from mrdamper.cli import application
from mrdamper.data import Dataset
from mrdamper.errors import InputError
from mrdamper.fleet.item import digest_of
from mrdamper.fleet.items import find_items
from mrdamper.fleet.job import Settings, as_job, attempt, read
from mrdamper.fleet.parquet_folder import parquet_dataset
from mrdamper.fleet.profile import FleetProfile
from mrdamper.fleet.run import run_fleet
from mrdamper.rig_files import sandbox
from mrdamper.rig_files.dataset_folder import load_dataset, save_dataset


def test_one_row_a_damper_and_session(identified):
    table = pl.read_parquet(identified.table)
    assert identified.done == identified.dampers == table.height == ROWS
    assert table["serial"].to_list() == [*(f"D{n:06}" for n in range(1, 5)), "G1", "G1"]
    assert table.filter(pl.col("golden"))["session"].to_list() == ["S001", "S002"]
    assert set(table["status"]) == {"done"}
    assert table["nrmse_pp"].max() < 0.1
    assert table["p_fy1"].is_not_null().all()


def test_the_number_of_workers_changes_no_bit(line, identified, tmp_path):
    found = run_fleet(line, planned(identified, tmp_path / "two"), workers=2)
    assert found.done == ROWS
    assert found.already == 1
    assert same_bits(tmp_path / "two") == same_bits(identified.table.parent)


def test_what_is_finished_is_not_done_again(line, identified):
    before = same_bits(identified.table.parent)
    identified.table.unlink()
    again = run_fleet(line, identified.table.parent, workers=1)
    assert again.already == again.done == ROWS
    assert same_bits(identified.table.parent) == before


def test_killed_while_it_measures_the_same_command_ends_with_the_same_bits(line, identified, tmp_path):
    out = planned(identified, tmp_path / "killed")
    before = _kept(out)
    assert _killed(line, out, before + 2) >= before + 2
    found = run_fleet(line, out, workers=1)
    assert found.already >= 3  # two, and the one that was studied in full
    assert same_bits(out) == same_bits(identified.table.parent)


@pytest.mark.slow
def test_killed_while_the_plan_is_made_the_same_command_ends_with_the_same_bits(line, identified, tmp_path):
    out = tmp_path / "killed"
    for rows in (2, 7):
        assert _killed(line, out, rows) >= rows
    run_fleet(line, out, workers=1)
    assert same_bits(out) == same_bits(identified.table.parent)


def _killed(source, out, rows):
    """Rows kept when the command was killed, which is when there were as many."""
    command = [sys.executable, "-m", "mrdamper", "fleet", str(source), "--out", str(out), "--workers", "2"]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    while _kept(out) < rows and process.poll() is None:
        time.sleep(0.02)
    process.kill()
    process.wait()
    return _kept(out)


def _kept(out):
    # A copy: the journal itself belongs to the process that writes it, and copies share no file with each other.
    try:
        with TemporaryDirectory() as folder:
            for path in out.glob("journal.sqlite*"):
                shutil.copyfile(path, Path(folder) / path.name)
            with closing(sqlite3.connect(Path(folder) / "journal.sqlite")) as base:
                return base.execute("SELECT count(*) FROM results").fetchone()[0]
    except (sqlite3.Error, OSError):
        return 0


def test_a_damper_that_cannot_be_used_is_named_and_the_others_go_on(identified, tmp_path):
    dampers = list(Population(dampers=6, sessions=1, golden=0))
    source = tmp_path / "records"
    for damper in dampers:
        save_dataset(damper.dataset(), source / damper.serial)
    (source / "D000001" / "samples.parquet").write_bytes(b"no table")
    shutil.copytree(source / "D000002", source / "twin")  # the same serial number in its column
    (source / "empty").mkdir()
    mixed = load_dataset(source / "D000003")
    runs = source / "D000003" / "runs.csv"
    runs.write_text(runs.read_text().replace("virtual", "another", 1))
    units = source / "D000004" / "samples.parquet"
    pl.read_parquet(units).rename({"force_N": "force_kN"}).write_parquet(units)
    found = run_fleet(source, planned(identified, tmp_path / "out"), workers=1)
    rows = {(r["serial"], r["code"]): r["status"] for r in pl.read_parquet(found.table).to_dicts()}
    assert rows == {
        ("D000001", "E_TRUNCATED"): "refused",
        ("D000002", "E_FLEET_SERIAL"): "refused",
        ("D000003", "E_FLEET_RIGS"): "refused",
        ("D000004", "E_UNITS"): "refused",
        ("D000005", ""): "done",
        ("D000006", ""): "done",
        ("empty", "E_NO_DATA"): "refused",
    }
    assert len(mixed.rigs) == 1
    assert found.done == 2
    assert len(found.troubled) == 6


def test_a_damper_with_one_test_takes_no_other_from_the_fleet(tmp_path):
    for number, damper in enumerate(Population(dampers=2, sessions=1, golden=0)):
        tests = damper.dataset()
        save_dataset(tests if number == 0 else tests.only(tests.runs[:1]), tmp_path / "records" / damper.serial)
    fleet = run_fleet(tmp_path / "records", tmp_path / "out")
    table = pl.read_parquet(fleet.table)
    assert table["status"].to_list() == ["done", "done"]
    assert table["runs"].to_list() == [4, 1]
    assert fleet.plan.references == ("D000001, session S001",)


def test_a_reading_process_that_is_killed_is_no_fault_of_the_records(line, identified, monkeypatch):
    watch, killed = sandbox._Sandbox._watch, []

    def kill_once(child, patience):
        if not killed:
            killed.append(child._process.kill())
        watch(child, patience)

    monkeypatch.setattr(sandbox._Sandbox, "_watch", kill_once)
    item = find_items(line, FleetProfile())[0]
    row = attempt(as_job(item, digest_of(item), Settings(), identified.plan))
    assert killed
    assert (row["status"], row["reason"]) == ("done", "")


def test_what_is_no_record_is_passed_by(line, tmp_path):
    shutil.copytree(line / "D000001", tmp_path / "a\tb")
    (tmp_path / "itself").symlink_to(tmp_path)
    os.mkfifo(tmp_path / "pipe.csv")
    out = tmp_path / "out"
    out.mkdir()
    (out / "journal.lock").touch()
    pl.DataFrame({"serial": ["D1"]}).write_parquet(out / "dampers.parquet")
    assert [item.name for item in find_items(tmp_path, FleetProfile())] == ["D000001, session S001"]


def test_one_dataset_of_many_sessions_is_a_damper_of_each(line, tmp_path):
    dataset = load_dataset(line / "D000001")
    runs = [replace(run, notes={"serial": "G1", "session": f"S{n // 2}"}) for n, run in enumerate(dataset)]
    save_dataset(Dataset(tuple(runs), "all"), tmp_path / "all")
    items = find_items(tmp_path, FleetProfile())
    assert [item.name for item in items] == ["G1, session S0", "G1, session S1"]
    assert [[run.id for run in read(item, Settings())[0]] for item in items] == [
        [run.id for run in runs[:2]],
        [run.id for run in runs[2:]],
    ]


def test_a_source_without_a_damper_is_refused(tmp_path):
    with pytest.raises(InputError) as refused:
        run_fleet(tmp_path, tmp_path / "out")
    assert refused.value.code == "E_FLEET_EMPTY"


def test_rig_files_of_a_folder_are_one_damper(identified, tmp_path):
    for damper in Population(dampers=2, sessions=1, golden=0):
        folder = tmp_path / "records" / damper.serial
        folder.mkdir(parents=True)
        for run in damper.dataset():
            table = pl.DataFrame({"time [s]": run.time, "displacement [m]": run.displacement, "force [N]": run.force})
            table.write_csv(folder / f"{run.id.split('-')[0]}_{run.current_A:g}A.csv")
    found = run_fleet(tmp_path / "records", planned(identified, tmp_path / "out"))
    table = pl.read_parquet(found.table)
    assert table["serial"].to_list() == ["D000001", "D000002"]
    assert table["runs"].to_list() == [4, 4]


def test_a_lake_gives_what_folders_give(line, identified, tmp_path):
    parts = []
    fault = next(damper.serial for damper in LINE if damper.fault)
    for folder in sorted(path for path in line.iterdir() if not path.name.startswith(fault)):
        dataset = load_dataset(folder)
        facts = pl.DataFrame([_facts(run) for run in dataset])
        parts.append(pl.read_parquet(folder / "samples.parquet").join(facts, on="run_id", maintain_order="left"))
    lake = tmp_path / "lake"
    lake.mkdir()
    pl.concat(parts[:3]).write_parquet(lake / "a.parquet")
    pl.concat(parts[3:]).write_parquet(lake / "b.parquet")
    (lake / "c.parquet").write_bytes(b"torn")
    found = run_fleet(lake, planned(identified, tmp_path / "out"))
    ours = pl.read_parquet(found.table)
    theirs = pl.read_parquet(identified.table).filter(pl.col("serial") != fault)
    assert ours.filter(pl.col("status") == "refused")["code"].to_list() == ["E_FORMAT"]
    same = ["serial", "session", "batch", "date", "golden", "rig", *(c for c in theirs.columns if c.startswith("p_"))]
    assert ours.filter(pl.col("status") == "done").select(same).rows() == theirs.select(same).rows()


def _facts(run):
    window = {"steady_t0_s": run.window[0], "steady_t1_s": run.window[1]}
    return {"run_id": run.id, "current_A": run.current_A, "rig": run.rig, **run.notes, **window}


def test_names_state_facts_by_a_pattern():
    profile = FleetProfile(names="{batch}_{serial}_*")
    assert profile.of_name("B01_D7_2024") == {"batch": "B01", "serial": "D7"}
    assert profile.of_name("D7") is None


def test_the_command_says_what_came_and_who_is_in_trouble(line, identified, tmp_path):
    source = tmp_path / "records"
    out = planned(identified, tmp_path / "out")
    shutil.copytree(line / "D000001", source / "D000001")
    (source / "empty").mkdir()
    done = CliRunner().invoke(application(), ["fleet", str(source), "--out", str(out), "--json"])
    assert done.exit_code == 0
    assert json.loads(done.stdout)["done"] == 1
    assert "empty" in done.stderr
    assert "E_NO_DATA" in done.stderr


def test_the_fast_lane_ends_where_a_cold_search_does(line, identified, tmp_path):
    source, names = tmp_path / "records", ["D000001", "D000004"]
    for name in names:
        shutil.copytree(line / name, source / name)
    found = run_fleet(source, planned(identified, tmp_path / "cold"), workers=1, cold=True)
    fast, cold = pl.read_parquet(identified.table).filter(pl.col("serial").is_in(names)), pl.read_parquet(found.table)
    assert set(fast["lane"]) == {"fast"}
    assert set(cold["lane"]) == {"cold"}
    assert fast["cost"].to_numpy() == pytest.approx(cold["cost"].to_numpy(), rel=1e-6)
    for name in ("p_fy1", "p_c0", "p_cb", "p_T"):
        assert fast[name].to_numpy() == pytest.approx(cold[name].to_numpy(), rel=3e-4), name


def test_what_a_damper_determines_has_a_standard_error(identified):
    table = pl.read_parquet(identified.table).filter(pl.col("lane") == "fast")
    for name in ("f0", "c0", "fy0", "fy1"):
        share = (table[f"se_{name}"] / table[f"p_{name}"]).to_numpy()
        assert ((share > 1e-5) & (share < 0.1)).all(), name
    assert table["se_d"].is_null().all()  # held at the line's value


def test_what_is_studied_in_full_stands_out(line, identified):
    table = pl.read_parquet(identified.table)
    fault = next(d.serial for d in LINE if d.fault)
    full = table.filter(pl.col("lane") == "full")
    assert full["serial"].to_list() == [fault]
    assert full["study"].is_not_null().all()
    assert table.sort("loop_deviation")["serial"].last() == fault


def test_forces_of_the_line_are_those_of_its_records(line, identified):
    table = pl.read_parquet(identified.table)
    truth = {(d.serial, d.session): d for d in LINE}
    names = [c for c in table.columns if c.startswith("rebound_N") and c.endswith("_1A")]
    top = max(names, key=lambda name: float(name.split("_")[2][:-1]))
    for row in table.iter_rows(named=True):
        damper = truth[row["serial"], row["session"]]
        run = next(r for r in damper.dataset() if r.id == "2Hz-1A")
        fastest = run.force[run.time > 1 / 2][::1]
        assert row[top] == pytest.approx(fastest.max(), rel=0.06)
        assert row["gas_force_N"] == pytest.approx(damper.rig.offset_force, abs=6)
        assert row["friction_N"] == pytest.approx(damper.rig.friction_high + damper.rig.yield_off, rel=0.3)


def test_a_damaged_lake_is_refused_by_file(tmp_path):
    t = np.arange(200) / 100
    channels = {"time_s": t, "displacement_m": 0.01 * np.sin(6 * t), "force_N": 300 * np.cos(6 * t), "current_A": 0 * t}
    table = pl.DataFrame({"serial": ["D1"] * 200, "run_id": ["a"] * 200, **channels})
    table.write_parquet(tmp_path / "a.parquet")
    whole = (tmp_path / "a.parquet").read_bytes()
    rng = np.random.default_rng(2)
    codes = set()
    for _ in range(40):
        content = bytearray(whole)
        for at in rng.integers(0, len(whole), 4):
            content[at] = rng.integers(256)
        (tmp_path / "b.parquet").write_bytes(content)
        for item in find_items(tmp_path, FleetProfile()):
            try:
                if item.error is not None:
                    raise item.error
                parquet_dataset(item)
            except InputError as error:
                codes.add(error.code)
    assert "E_FORMAT" in codes


@pytest.mark.parametrize(
    ("column", "value", "code"),
    [("force_N", pl.lit(None, pl.Float64), "E_NONFINITE"), ("steady_t0_s", pl.lit("soon"), "E_COLUMN")],
)
def test_what_a_lake_lacks_is_said_of_the_damper(line, tmp_path, column, value, code):
    dataset = load_dataset(line / next(path.name for path in sorted(line.iterdir())))
    facts = pl.DataFrame([{**_facts(run), "serial": "D1"} for run in dataset])
    samples = pl.concat([pl.DataFrame({"run_id": run.id, "time_s": run.time, "displacement_m": run.displacement,
                                       "force_N": run.force}) for run in dataset])  # fmt: skip
    samples.join(facts, on="run_id", maintain_order="left").with_columns(value.alias(column)).write_parquet(
        tmp_path / "a.parquet"
    )
    with pytest.raises(InputError) as refused:
        parquet_dataset(next(iter(find_items(tmp_path, FleetProfile()))))
    assert refused.value.code == code
