"""`python -m benchmarks.fleet`: processor time of a fleet, results after kills, detection of planted faults and drifts.

Virtual dampers, four records each. Processor time is that of the command and of all it started, ended
or orphaned, start-up and libraries included. `--folder` keeps the records for the next time.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import hashlib
import json
import os
import random
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from benchmarks.synthetic_fleet import FAULTS, Population, write_fleet
from mrdamper.data.child import descendants
from mrdamper.fleet import engine
from mrdamper.fleet.item import digest_of
from mrdamper.fleet.items import find_items
from mrdamper.fleet.job import Settings, as_job, attempt
from mrdamper.fleet.plan import Plan
from mrdamper.fleet.profile import FleetProfile
from mrdamper.fleet.run import run_fleet
from mrdamper.fleet.table import TIMES
from mrdamper.fleet.verdicts import drift, suspects, with_features
from mrdamper.paper.virtual_rig import VirtualRig

STRONG = VirtualRig(  # another make, four times as strong
    gas_pressure=4e6, gas_volume=3e-4, rod_diameter=0.03, offset_force=400.0, yield_off=60.0, yield_per_ampere=3200.0,
    viscosity=4000.0, viscosity_per_ampere=900.0, friction_low=90.0, friction_high=260.0, force_noise=20.0,
    force_step=2.0, mass=9.0, knee=5e-4,
)  # fmt: skip
_START_UP = 1.5  # seconds, about, before a command begins with its work


@dataclass(frozen=True)
class Took:
    """Processor and wall time [s], and the most memory of one of its processes [MB]."""

    cpu: float
    wall: float
    memory: float


def took(*arguments: str) -> Took:
    """What a Python command and everything it starts takes."""
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    one = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "POLARS_MAX_THREADS": "1"}
    command, quiet = [sys.executable, "-m", *arguments], {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    subprocess.run(command, check=True, env=one, **quiet)  # type: ignore[call-overload]
    wall = time.perf_counter() - begin
    with contextlib.suppress(ChildProcessError):  # orphans count too
        while True:
            os.wait()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Took(cpu, wall, after.ru_maxrss / 1024)


def table_hash(out: Path) -> str:
    """Of everything but times and hosts."""
    rows = pl.read_parquet(out / "dampers.parquet").drop(TIMES).rows()
    return hashlib.sha256(repr(rows).encode()).hexdigest()[:16]


def records(folder: Path, dampers: int) -> Path:
    """Records of a line, written once."""
    source = folder / f"records-{dampers}"
    if not source.exists():
        making = source.with_suffix(".part")
        shutil.rmtree(making, ignore_errors=True)
        write_fleet(Population(dampers=dampers, sessions=4, golden=0), making)
        making.rename(source)
    return source


def cost(folder: Path, sizes: Sequence[int]) -> None:
    """Processor time a damper on one worker and two, at every size; the overhead over the bare loop."""
    walls: dict[int, list[float]] = {}
    for dampers in sizes:
        source, outs = records(folder, dampers), [folder / f"out-{dampers}-{workers}" for workers in (1, 2)]
        for workers, out in zip((1, 2), outs, strict=True):
            shutil.rmtree(out, ignore_errors=True)
            plan_of(records(folder, min(sizes)), out)
            spent = took("mrdamper", "fleet", str(source), "--out", str(out), "--workers", str(workers))
            walls.setdefault(dampers, []).append(spent.wall)
            print(f"{dampers} dampers, {workers} workers: {spent.cpu:.2f} s of processor time = "
                  f"{1e3 * spent.cpu / dampers:.1f} ms each, {spent.wall:.1f} s of wall, {spent.memory:.0f} MB",
                  flush=True)  # fmt: skip
        assert table_hash(outs[0]) == table_hash(outs[1])
        print(f"  1 to 2 workers: {walls[dampers][0] / walls[dampers][1]:.2f} times as fast; the same bits")
    most = max(sizes)
    bare = took("benchmarks.fleet", "--bare", str(folder / f"records-{most}"), str(folder / f"out-{most}-1"))
    print(f"the bare loop over {most} dampers, without journal, guard and page: {bare.cpu:.2f} s of processor time")


def plan_of(source: Path, out: Path) -> None:
    """Put the plan of a line into a new journal: what is then measured is the dampers alone."""
    kept = source.with_name("plan.sqlite")
    if not kept.exists():
        made = source.with_name("plan")
        run_fleet(source, made, workers=2)
        shutil.copy(made / "journal.sqlite", kept)
        with contextlib.closing(sqlite3.connect(kept)) as base:
            base.execute("DELETE FROM results")
            base.commit()
    out.mkdir(parents=True)
    shutil.copy(kept, out / "journal.sqlite")


def bare(source: Path, out: Path) -> None:
    """The same jobs one after the other in this process."""
    with contextlib.closing(sqlite3.connect(out / "journal.sqlite")) as base:
        plan = Plan(**json.loads(base.execute("SELECT plan FROM plans").fetchone()[0]))
    for item in find_items(source, FleetProfile()):
        attempt(as_job(item, digest_of(item), Settings(), plan))


def cheap(job: dict[str, Any]) -> dict[str, Any]:
    """A job that does nothing but answer with the row of another damper."""
    row = json.loads(Path(os.environ["CHEAP_ROW"]).read_text())
    return {**row, "gas_force_N": 100 + int(job["digest"][:4], 16) / 65536}


def machinery(folder: Path, sizes: Sequence[int]) -> None:
    """Supervisor, guards, journal, table and page over jobs that cost nothing: linear, and memory flat?"""
    first = records(folder, 10)
    if not (folder / "row.json").exists():
        found = run_fleet(first, folder / "row", workers=1)
        with contextlib.closing(sqlite3.connect(found.table.with_name("journal.sqlite"))) as base:
            kept = base.execute("SELECT row FROM results WHERE json_extract(row, '$.lane') = 'fast'").fetchone()[0]
        (folder / "row.json").write_text(kept)
    os.environ["CHEAP_ROW"] = str(folder / "row.json")
    for dampers in sizes:
        source = folder / f"cheap-{dampers}"
        for number in range(dampers):
            (source / f"D{number:06}").mkdir(parents=True, exist_ok=True)
            (source / f"D{number:06}" / "runs.csv").write_text(f"run_id\n{number}\n")
        out = folder / f"cheap-out-{dampers}"
        shutil.rmtree(out, ignore_errors=True)
        plan_of(first, out)
        spent = took("benchmarks.fleet", "--with-cheap-jobs", str(source), str(out))
        sizes_of = {path.name: f"{path.stat().st_size / dampers:.0f}" for path in out.iterdir() if path.stat().st_size}
        print(f"{dampers} jobs that cost nothing: {spent.cpu:.2f} s of processor time = {1e3 * spent.cpu / dampers:.2f}"
              f" ms each, {spent.wall:.1f} s of wall, {spent.memory:.0f} MB; bytes a damper: {sizes_of}",
              flush=True)  # fmt: skip


def with_cheap_jobs(source: str, out: str) -> None:
    """The command itself, its jobs replaced."""
    from mrdamper.cli import application

    engine._ATTEMPT = "benchmarks.fleet:cheap"
    application()(["fleet", source, "--out", out, "--workers", "2"])


def kills(folder: Path, dampers: int, count: int, seed: int) -> None:
    """Kill supervisor or worker at random moments, and between the last commit and the roll-up: one hash."""
    source, calm, out = records(folder, dampers), folder / "calm", folder / "killed"
    if not (calm / "dampers.parquet").exists():
        begin = time.perf_counter()
        run_fleet(source, calm, workers=2)
        (folder / "calm.seconds").write_text(str(time.perf_counter() - begin))
    seconds, rows = float((folder / "calm.seconds").read_text()), _kept(calm)
    shutil.rmtree(out, ignore_errors=True)
    rng, killed = random.Random(seed), dict.fromkeys(("supervisor", "worker", "between commit and roll-up"), 0)
    command = [sys.executable, "-m", "mrdamper", "fleet", str(source), "--out", str(out), "--workers", "2"]
    while sum(killed.values()) < count:
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for pause in _pauses(rng, _START_UP + seconds / count):
            time.sleep(pause)
            below = descendants(process.pid)
            if process.poll() is not None or sum(killed.values()) >= count:
                break
            who = rng.choice(["supervisor", "worker"]) if below else "supervisor"
            with contextlib.suppress(ProcessLookupError):
                os.kill(process.pid if who == "supervisor" else rng.choice(below), signal.SIGKILL)
                killed[who] += 1
            if who == "supervisor":
                break
        if process.poll() is None and sum(killed.values()) >= count:
            break
        process.wait()
        if _kept(out) == rows and not (out / "dampers.parquet").exists():
            killed["supervisor"] -= 1
            killed["between commit and roll-up"] += 1
        elif _kept(out) == rows and killed["between commit and roll-up"] < count / 10:
            (out / "dampers.parquet").unlink()  # nothing but the roll-up is left to be done
        elif _kept(out) == rows:
            shutil.rmtree(out)
    process.wait()
    found = run_fleet(source, out, workers=2)
    same = table_hash(out) == table_hash(calm)
    print(f"{sum(killed.values())} kills ({killed}): {found.done} of {dampers}, the same hash: {same}")
    assert same


def _pauses(rng: random.Random, mean: float) -> Iterator[float]:
    while True:
        yield rng.uniform(0, 2 * mean)


def _kept(out: Path) -> int:
    """Rows in a journal that nobody writes to."""
    if not (out / "journal.sqlite").exists():
        return 0
    with contextlib.closing(sqlite3.connect(out / "journal.sqlite")) as base:
        try:
            return base.execute("SELECT count(*) FROM results").fetchone()[0]
        except sqlite3.Error:
            return 0  # killed before its tables were made


def truth(folder: Path, dampers: int, seeds: Sequence[int]) -> None:
    """Planted faults and drifts, through the records, the identification and the table, on two makes."""
    for name, base in (("usual", VirtualRig()), ("four times as strong", STRONG)):
        found = planted = alarms = sound = named = 0
        for seed in seeds:
            line = Population(dampers=dampers, sessions=5, golden=1, base=base, seed=seed,
                        faults=dict.fromkeys(FAULTS, 3))  # fmt: skip
            table = _identified(folder / f"truth-{name[:2]}-{seed}", line)
            told = {s.serial: s.cause for s in suspects(with_features(table).filter(~pl.col("golden")))}
            fault_of = {d.serial: d.fault for d in line if not d.golden}
            faulty = {serial for serial, fault in fault_of.items() if fault}
            found, planted = found + len(faulty & set(told)), planted + len(faulty)
            alarms, sound = alarms + len(set(told) - faulty), sound + len(fault_of) - len(faulty)
            named += sum(fault_of[s].split()[-1] in told[s] for s in faulty & set(told))
        print(f"{name}: {found} of {planted} planted faults found, {named} by their name; "
              f"{alarms} false alarms among {sound} sound dampers", flush=True)  # fmt: skip


def drifts(folder: Path, dampers: int, seeds: Sequence[int]) -> None:
    """3 % of drift in the rig, in the line, in neither, told from records; without golden dampers too."""
    for planted, change in (("rig", {"rig_drift": 0.03}), ("line", {"line_drift": 0.03}), ("none", {})):
        told, blind = [], []
        for seed in seeds:
            line = replace(Population(dampers=dampers, sessions=8, golden=2, seed=seed), **change)
            table = with_features(_identified(folder / f"drift-{planted}-{seed}", line)).sort("session", "serial")
            told.append(_told(table))
            blind.append(_told(table.filter(~pl.col("golden"))))
        print(f"drift of {planted}: told {told}; without golden dampers {blind}", flush=True)


def _told(table: pl.DataFrame) -> str:
    columns = (table[c].to_list() for c in ("session", "serial", "golden"))
    return drift(np.array(table["force_rise_N"].to_list()), *columns).verdict


def _identified(folder: Path, line: Population) -> pl.DataFrame:
    if not (folder / "out" / "dampers.parquet").exists():
        shutil.rmtree(folder, ignore_errors=True)
        write_fleet(line, folder / "records")
        run_fleet(folder / "records", folder / "out", workers=2)
        shutil.rmtree(folder / "records")
    return pl.read_parquet(folder / "out" / "dampers.parquet")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--dampers", type=int, nargs="*", default=[10, 100, 1000], help="sizes of lines to measure")
    parser.add_argument("--cheap", type=int, nargs="*", default=[1000, 10_000], help="numbers of jobs that do nothing")
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--of", type=int, default=500, help="dampers of the line that is killed")
    parser.add_argument("--faults", type=int, nargs="*", default=[21, 22], help="seeds of lines with planted faults")
    parser.add_argument("--drifts", type=int, nargs="*", default=[31], help="seeds of lines that drift")
    parser.add_argument("--folder", type=Path, help="keep the records here for the next time")
    parser.add_argument("--bare", nargs=2, metavar=("SRC", "OUT"), help=argparse.SUPPRESS)
    parser.add_argument("--with-cheap-jobs", nargs=2, metavar=("SRC", "OUT"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.bare:
        return bare(*map(Path, options.bare))
    if options.with_cheap_jobs:
        return with_cheap_jobs(*options.with_cheap_jobs)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(36, 1, 0, 0, 0)  # PR_SET_CHILD_SUBREAPER: orphans are waited for here
    with contextlib.ExitStack() as held:
        folder = (options.folder or Path(held.enter_context(tempfile.TemporaryDirectory()))).absolute()
        folder.mkdir(parents=True, exist_ok=True)
        parts: list[tuple[Any, Callable[[], None]]] = [
            (options.dampers, lambda: cost(folder, options.dampers)),
            (options.cheap, lambda: machinery(folder, options.cheap)),
            (options.kills, lambda: kills(folder, options.of, options.kills, seed=1)),
            (options.faults, lambda: truth(folder, 150, options.faults)),
            (options.drifts, lambda: drifts(folder, 120, options.drifts)),
        ]
        for wanted, part in parts:
            if wanted:
                part()


if __name__ == "__main__":
    main()
