"""`python -m benchmarks.fleet`: what a fleet costs, and whether it survives being killed.

Virtual dampers, four records each. Processor time counts; wall time only beside another wall time.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict
from pathlib import Path

import polars as pl

from mrdamper.fleet.generator import Line, write_fleet
from mrdamper.fleet.guard import descendants
from mrdamper.fleet.items import digest_of, find_items
from mrdamper.fleet.job import Plan, as_job, attempt
from mrdamper.fleet.line import run_fleet
from mrdamper.fleet.profile import FleetProfile
from mrdamper.fleet.table import TIMES


def table_hash(out: Path) -> str:
    """Of everything but times and hosts."""
    rows = pl.read_parquet(out / "dampers.parquet").drop(TIMES).rows()
    return hashlib.sha256(repr(rows).encode()).hexdigest()[:16]


def cost(folder: Path, dampers: int) -> None:
    """Processor time a damper, wall time on one worker and two, memory, and the bare loop."""
    source = folder / f"records-{dampers}"
    write_fleet(Line(dampers=dampers, sessions=4, golden=0), source)
    walls = {}
    for workers in (1, 2):
        out = folder / f"out-{dampers}-{workers}"
        begin = time.perf_counter()
        found = run_fleet(source, out, workers=workers)
        walls[workers] = time.perf_counter() - begin
    table = pl.read_parquet(found.table)
    fast = table.filter(pl.col("lane") == "fast")
    held = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{dampers} dampers: {fast.height} in the fast lane, processor time each {fast['cpu_time_s'].median():.4f} s")
    print(f"  one worker {walls[1]:.1f} s, two {walls[2]:.1f} s: {walls[1] / walls[2]:.2f} times as fast")
    print(f"  {1e3 * walls[1] / dampers:.0f} ms a damper on one worker; supervisor's memory {held:.0f} MB")
    assert table_hash(folder / f"out-{dampers}-1") == table_hash(folder / f"out-{dampers}-2")
    assert found.plan is not None
    _overhead(source, folder / "again", found.plan)


def _overhead(source: Path, out: Path, plan: Plan) -> None:
    """The same jobs in a loop without guard and journal; the plan's own jobs are taken off."""
    items = find_items(source, FleetProfile())
    from mrdamper.fleet.job import Settings

    begin = time.process_time()
    for item in items:
        attempt(as_job(item, digest_of(item), Settings(), plan))
    bare = time.process_time() - begin
    before = resource.getrusage(resource.RUSAGE_SELF)
    first = resource.getrusage(resource.RUSAGE_CHILDREN)
    found = run_fleet(source, out, workers=1)
    after, last = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    own = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    children = last.ru_utime + last.ru_stime - first.ru_utime - first.ru_stime
    print(f"  processor time: bare loop {bare:.1f} s; fleet {own + children:.1f} s, of that the supervisor {own:.1f} s")
    print(f"  (the fleet's holds the plan: {len(asdict(plan)['references'])} reference dampers, searched four times)")
    assert found.done == len(items)


def kills(folder: Path, dampers: int, count: int, seed: int) -> None:
    """Kill supervisor, worker or both at random moments, run again until done: one hash."""
    source = folder / "records-kills"
    write_fleet(Line(dampers=dampers, sessions=4, golden=0), source)
    run_fleet(source, folder / "calm", workers=1)
    rng, out, killed = random.Random(seed), folder / "killed", {"supervisor": 0, "worker": 0}
    while sum(killed.values()) < count:
        command = [sys.executable, "-m", "mrdamper.cli", "fleet", str(source), "--out", str(out), "--workers", "2"]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        if sum(killed.values()) >= count:
            break
        while process.poll() is None and sum(killed.values()) < count:
            time.sleep(rng.uniform(0.2, 6.0))
            below = descendants(process.pid)
            who = rng.choice(["supervisor", "worker"]) if below else "supervisor"
            with contextlib.suppress(OSError):
                os.kill(process.pid if who == "supervisor" else rng.choice(below), signal.SIGKILL)
                killed[who] += 1
        process.wait()
        if (out / "dampers.parquet").exists() and rng.random() < 0.7 and sum(killed.values()) < count:
            for path in out.iterdir():  # all done: begin anew, so that all kills fall into work
                path.unlink()
    found = run_fleet(source, out, workers=2)
    same = table_hash(out) == table_hash(folder / "calm")
    print(f"{sum(killed.values())} kills ({killed}): {found.done} of {dampers}, the same hash: {same}")
    assert same


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--dampers", type=int, nargs="*", default=[50, 500])
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--of", type=int, default=500, help="dampers of the line that is killed")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for dampers in options.dampers:
            cost(Path(folder), dampers)
        if options.kills:
            kills(Path(folder), options.of, options.kills, seed=1)


if __name__ == "__main__":
    main()
