"""Every writing command killed, or starved of disk, memory and files: old or new, never mixed, and a code.

The process that attacks has loaded the libraries once and forks for every try; it never uses them
itself, so that no thread of theirs is lost in a fork.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import importlib
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from fuzz.counting import Count, sample_damper, within

# What each writes, and how it is asked; {n} is 1 or 2: the second replaces what the first wrote.
COMMANDS = {
    "identify": ("i.csv", "identify ../data{n} --model bingham --out i.csv"),
    "predict": ("p.csv", "predict ../model.json --current {n} --frequency 1 --amplitude 10 --out p.csv"),
    "validate": ("v.csv", "validate ../model.json ../data{n} --out v.csv"),
    "export": ("c", "export ../model{n}.json --to c --out c"),
    "page": ("d.html", "export ../model{n}.json --to page --out d.html"),
    "fmu": ("d.fmu", "export ../model{n}.json --to fmu --out d.fmu"),
    "import": ("set{n}", "import ../files{n} --out set{n}"),
    "add": ("set", "import ../files{n} --add --out set"),
    "split": ("set", "split set --run {n}Hz-0A --replace"),
    "check": ("loops.svg", "check ../data{n} --figure loops.svg"),
    "study": ("s", "study ../data{n} --out s"),
    "compare": ("m", "compare ../data{n} --models bingham --models biviscous --out m"),
    "uncertainty": ("sure", "uncertainty ../study{n}/model.json ../data{n} --out sure"),
    "report": ("r", "report ../data{n} --out r"),
    "plan": ("plan", "plan --limits ../limits.toml --hours 0.{n}9 --out plan"),
    "simulate": (
        "ride",
        "simulate quarter-car --input bump --damper ../model.json --current 0.{n} --step 0.002 --out ride",
    ),
    "law": (
        "law",
        "simulate quarter-car --input bump --damper ../model.json --current 0.{n} --step 0.002 --control skyhook --c law",
    ),
    "reproduce": ("claims", "reproduce --data ../data{n} --no-comparators --jobs 1 --out claims"),
}
_CHANGE = ("add", "split")  # what they find there: a copy of the first dataset
_DEAR = {"reproduce": 0.4, "fmu": 0.5}  # of the usual number of tries
_LOADED = (
    "numpy", "scipy.optimize", "scipy.special", "polars", "matplotlib.pyplot", "matplotlib.backends.backend_svg", "jinja2",
    "pydantic", "mrdamper.cli.output", "mrdamper.study.workflow", "mrdamper.study.comparison", "mrdamper.report.study",
    "mrdamper.report.comparison", "mrdamper.report.damper_tests", "mrdamper.report.simulation", "mrdamper.exporters",
    "mrdamper.rig_files.dataset_folder", "mrdamper.dampers.model_file", "mrdamper.study.validation", "mrdamper.rig_files.rig_import",
    "mrdamper.systems.simulate", "mrdamper.study.plan", "mrdamper.paper.output",
)  # fmt: skip
_STEPS = ("os.rename", "os.link", "os.remove", "os.rmdir", "os.mkdir", "ctypes.dlsym")  # the last: before an exchange
_POINTS = {"disk": 20, "memory": 20, "file size": 10, "files": 4, "temporary folder": 1}  # of each command
_TIMES = {"made", "seconds"}  # hold when a result was made and how long it took
_GONE_S = 2.0  # in which children of a killed command must be gone


def attack_kills(share: float, only: Sequence[str] = ()) -> list[Count]:
    """SIGKILL at every rename and at random: nothing half-written or mixed, no orphan, no litter after the next run."""
    if os.name != "posix":
        return []
    rng, counts = random.Random(6), {what: Count(f"SIGKILL: {what}") for what in ("old or new", "orphans", "litter")}
    with workplace() as root:
        _adopt_orphans()
        for name, (out, line) in within(_chosen(only)):
            folder, broken = root / name, sum(len(count.broke) for count in counts.values())
            folder.mkdir()
            said, span, wholes = [], 0.0, []
            for n in (1, 2):
                _begin_anew(folder, n)
                began = time.monotonic()
                said += [run_command(folder, line.format(n=n))]
                span = time.monotonic() - began
                wholes.append(_content(folder / out.format(n=n)))
            runs = said == [None, None] and all(wholes) and wholes[0] != wholes[1]
            counts["litter"].check(runs, (name, "does not run, or writes the same twice", said))
            each = max(2, round(200 * share * _DEAR.get(name, 1.0) / len(COMMANDS))) if runs else 0
            steps = _steps(folder, line.format(n=1))
            wanted = sorted(rng.sample(range(steps), min(steps, each - each // 3)))
            for i in range(each):
                n, step = 1 + i % 2, wanted[i] if i < len(wanted) else None
                _begin_anew(folder, n, empty=step is None and rng.random() < 0.5)
                before = _content(folder / out.format(n=n))
                limit = _kill_at(folder, step) if step is not None else None
                pid = _begin(folder, line.format(n=n), limit)
                if step is None:
                    time.sleep(rng.uniform(0, 1.05) * span)
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(pid, signal.SIGKILL)
                _wait(pid)
                left = _orphans()
                counts["orphans"].check(not left, (name, step, left))
                found = _content(folder / out.format(n=n))
                counts["old or new"].check(found in (before, wholes[n - 1]), (name, step, sorted(found)))
            for n in (1, 2):
                if name != "split":  # sweeps inside the dataset
                    _begin_anew(folder, n)
                run_command(folder, line.format(n=n))
            left = sorted(path.name for path in [*folder.rglob(".*"), *(root / "tmp").iterdir()])
            counts["litter"].check(not left and _content(folder / out.format(n=2)) == wholes[1], (name, left))
            broken = sum(len(count.broke) for count in counts.values()) - broken
            print(f"    {name:12}{each:4} kills, {len(wanted)} before one of {steps} steps; {broken} broke", flush=True)
    return list(counts.values())


def _chosen(only: Sequence[str]) -> list[tuple[str, tuple[str, str]]]:
    return [(name, how) for name, how in COMMANDS.items() if name in (only or COMMANDS)]


def _begin_anew(folder: Path, n: int, empty: bool = False) -> None:
    """Files a command needs: the dataset it changes, no dataset where it makes one, the other result or nothing."""
    out = folder / COMMANDS[folder.name][0].format(n=n)
    if folder.name in _CHANGE or empty or "{n}" in COMMANDS[folder.name][0]:
        shutil.rmtree(out) if out.is_dir() else out.unlink(missing_ok=True)
    if folder.name in _CHANGE:
        shutil.copytree(folder.parent / "data1", out)


def _adopt_orphans() -> None:
    """Make this process the parent of processes that a killed command leaves running."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(36, 1, 0, 0, 0)  # PR_SET_CHILD_SUBREAPER


def _orphans() -> list[str]:
    """Command lines of what still runs once it had its time to end."""
    until = time.monotonic() + _GONE_S
    while True:
        with contextlib.suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
        left = _descendants(os.getpid())
        if not left or time.monotonic() > until:
            return [Path(f"/proc/{pid}/cmdline").read_text()[:200] for pid in left]
        time.sleep(0.02)


def _steps(folder: Path, line: str) -> int:
    """Count the steps of publishing that a run takes."""
    _begin_anew(folder, 1)
    seen = folder.parent / "steps"
    seen.write_bytes(b"")
    run_command(folder, line, lambda: _at_steps(folder, lambda: _add_to(seen)))
    return seen.stat().st_size


def _add_to(path: Path) -> None:
    with path.open("ab") as file:
        file.write(b".")


def _kill_at(folder: Path, wanted: int) -> Callable[[], None]:
    def limit() -> None:
        count = iter(range(10**6))
        _at_steps(folder, lambda: os.kill(os.getpid(), signal.SIGKILL) if next(count) == wanted else None)

    return limit


def _at_steps(folder: Path, tell: Callable[[], object]) -> None:
    """Call before each step a command takes on the files of its folder."""

    def hook(event: str, arguments: tuple[object, ...]) -> None:
        if event in _STEPS and (str(folder) in str(arguments[0]) or "renameat2" in arguments[:2]):
            tell()

    process = os.getpid()
    sys.addaudithook(lambda event, arguments: hook(event, arguments) if os.getpid() == process else None)


def attack_limits(share: float, only: Sequence[str] = ()) -> list[Count]:
    """Full disks, limits of memory, file size and open files, no temporary folder: done, or a code, nothing half-written."""
    if os.name != "posix":
        return []
    counts = {kind: Count(f"starved of {kind}") for kind in _POINTS}
    with workplace() as root:
        for name, (out, line) in within(_chosen(only)):
            folder, before_it = root / name, [len(count.broke) for count in counts.values()]
            folder.mkdir()
            _begin_anew(folder, 1)
            run_command(folder, line.format(n=1))
            tries = list(_amounts(folder, share * _DEAR.get(name, 1.0)))
            for kind, value in tries:
                with _starved(folder, kind, value) as (where, limit):
                    if where is None or (where != folder and name in _CHANGE):  # no room for the dataset to be changed
                        continue
                    if where == folder:
                        _begin_anew(folder, 2)
                    before = _content(where / out.format(n=2))
                    said = run_command(where, line.format(n=2), limit)
                    whole = said is None or _content(where / out.format(n=2)) == before
                    left = [path.name for path in [*where.rglob(".*"), *(root / "tmp").iterdir()]]
                    typed = said is None or re.search(r"\[E_\w+\]\s*$", said) is not None
                    counts[kind].check(typed and whole and not left, (name, f"{value:.3g}", said, left))
            shutil.rmtree(folder)
            broke = [len(count.broke) - n for count, n in zip(counts.values(), before_it, strict=True)]
            print(f"    {name:12}{len(tries):4} starved; {sum(broke)} broke", flush=True)
    return list(counts.values())


def _amounts(folder: Path, share: float) -> Iterator[tuple[str, float]]:
    """Resources left to a command: most points where there is little."""
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    most = {"disk": 1.2 * size, "memory": 4 * 2**30, "file size": 1.1 * size, "files": 16, "temporary folder": 0}
    for kind, points in _POINTS.items():
        count = max(1, round(points * share))
        yield from ((kind, most[kind] * ((i + 1) / count) ** 2) for i in range(count))


@contextlib.contextmanager
def workplace() -> Iterator[Path]:
    """Two datasets, their rig files and models, and the libraries loaded."""
    for name in _LOADED:
        importlib.import_module(name)
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        (root / "tmp").mkdir()
        os.environ["TMPDIR"] = str(root / "tmp")
        _wait(_fork(lambda: _prepare(root), 2))
        for n in (1, 2):
            run_command(root / "data1", f"study ../data{n} --out ../study{n}")
        yield root


def _prepare(root: Path) -> None:
    from dataclasses import replace

    from benchmarks.synthetic_fleet import Population
    from mrdamper.dampers.model_file import save_model
    from mrdamper.rig_files.dataset_folder import save_dataset

    for n, made in enumerate(Population(dampers=2, sessions=1, golden=0), start=1):
        save_dataset(made.dataset(), root / f"data{n}")
        (root / f"files{n}").mkdir()
        for run in made.dataset():
            rows = zip(run.time, 1e3 * run.displacement, run.force, strict=True)
            text = "time [s],displacement [mm],force [N]\n" + "".join(f"{t},{x},{f}\n" for t, x, f in rows)
            (root / f"files{n}" / f"{run.id.split('-')[0]}_{run.current_A:g}A.csv").write_text(text)
        save_model(replace(sample_damper(), rig=f"rig {n}"), root / f"model{n}.json")
    shutil.copyfile(root / "model1.json", root / "model.json")
    limits = "current_A = [0.0, 1.0]\nfrequency_Hz = [0.5, 4.0]\namplitude_mm = [4, 20]\n"
    (root / "limits.toml").write_text(limits)


def _fork(work: Callable[[], object], errors: int | None) -> int:
    pid = os.fork()
    if pid:
        return pid
    status = 1
    try:
        os.setsid()
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere if errors is None else errors, 2)
        work()
        status = 0
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 1
    finally:
        os._exit(status)


def _begin(folder: Path, line: str, limit: Callable[[], None] | None = None, errors: int | None = None) -> int:
    def work() -> None:
        os.chdir(folder)
        sys.argv = ["mrdamper", *line.split()]
        if limit is not None:
            limit()
        from mrdamper.cli import main

        main()

    return _fork(work, errors)


def _wait(pid: int) -> int:
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


def run_command(folder: Path, line: str, limit: Callable[[], None] | None = None) -> str | None:
    """Output of a command that failed; None if it did not."""
    reading, writing = os.pipe()  # no file: a limit of the size of files would hold for it too
    status = _wait(_begin(folder, line, limit, writing))
    os.set_blocking(reading, False)
    with contextlib.suppress(BlockingIOError):  # nothing said, or by somebody who still lives
        os.write(writing, b"\n")
    said = os.read(reading, 2**16).decode(errors="replace").strip().splitlines()
    os.close(writing)
    os.close(reading)
    if status == 0:
        return None
    return said[-1] if status == 2 and said else f"status {status}: {' / '.join(said[-3:])}"


@contextlib.contextmanager
def _starved(folder: Path, kind: str, value: float) -> Iterator[tuple[Path | None, Callable[[], None] | None]]:
    """A folder to work in, and what limits the process; no folder where this system cannot starve it."""
    import resource

    def limited(what: int, most: int) -> Callable[[], None]:
        return lambda: resource.setrlimit(what, (most, resource.getrlimit(what)[1]))

    if kind == "temporary folder":
        yield folder, lambda: setattr(tempfile, "_candidate_tempdir_list", lambda: ["/proc/none"])
    elif kind != "disk":
        what = {"file size": resource.RLIMIT_FSIZE, "memory": resource.RLIMIT_AS, "files": resource.RLIMIT_NOFILE}[kind]
        yield folder, limited(what, int(value))
    else:
        with _small_disk(folder.parent / "small disk", value) as where:
            yield where, None


@contextlib.contextmanager
def _small_disk(where: Path, size: float) -> Iterator[Path | None]:
    where.mkdir(exist_ok=True)
    mount = ["mount", "-t", "tmpfs", "-o", f"size={max(4096, int(size))}", "tmpfs", str(where)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True, check=False).returncode:
        yield None  # only the administrator may
        return
    try:
        yield where
    finally:
        subprocess.run(["umount", "-l", str(where)], check=True)


def _content(path: Path) -> dict[str, str]:
    """Hash of every file by its name; empty where there is nothing."""
    files = [path] if path.is_file() else path.rglob("*") if path.is_dir() else []
    return {
        file.relative_to(path.parent).as_posix(): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in files
        if file.is_file() and file.stem not in _TIMES and "/." not in f"/{file.relative_to(path.parent).as_posix()}"
    }


def _descendants(process: int) -> list[int]:
    from mrdamper.data.child import descendants

    return descendants(process)
