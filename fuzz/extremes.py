"""Tests no rig makes, through every command that reads tests: done, or a code, and never a score that is no number."""

from __future__ import annotations

import csv
import json
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fuzz.counting import Count, within
from fuzz.stops import run_command, workplace

COMMANDS = (
    "check {set}", "study {set} --out study", "identify {set} --model bingham --out i.csv", "report {set} --out report",
    "identify {set} --model spencer --out s.csv", "identify {set} --model bouc-wen --method balance --out b.csv",
    "compare {set} --models bingham --models biviscous --out m", "validate model.json {set} --out v.csv",
    "uncertainty model.json {set} --out sure", "split {set} --every 3 --replace", "reproduce --data {set} --jobs 1 --out claims",
)  # fmt: skip
FILES = "import {set} --out made"


def attack_extremes(share: float, only: Sequence[str] = ()) -> list[Count]:
    """Forces, motions, currents and clocks beyond all dampers, and files of a rig that say so."""
    if os.name != "posix":
        return []
    count, finite = Count("extreme tests through commands"), Count("figures of extreme tests")
    cases = [*_datasets(), *_rig_files()]
    with workplace() as root:
        for name, write in within(cases[:: max(1, round(1 / share))]):
            if only and name not in only:
                continue
            folder = root / re.sub(r"\W", "_", name)
            (folder / "set").mkdir(parents=True)
            (folder / "model.json").write_bytes((root / "model.json").read_bytes())
            commands = COMMANDS if write(folder / "set") else (FILES,)
            for line in commands:
                said = run_command(folder, line.format(set="set"))
                count.check(said is None or re.search(r"\[E_\w+\]\s*$", said) is not None, (name, line, said))
            for path in folder.rglob("*"):
                if path.suffix == ".csv" and "set" not in path.relative_to(folder).parts:
                    finite.check(_finite_scores(path), (name, path.name))
            print(f"    {name}", flush=True)
    return [count, finite]


def _finite_scores(path: Path) -> bool:
    """Check that every score in a table is a number; an interval of a parameter may be infinite."""
    with path.open(newline="", encoding="utf-8", errors="replace") as file:
        rows = list(csv.DictReader(file))
    scores = [row[name] for row in rows for name in row if name and name.startswith(("nrmse", "wape"))]
    return not any("inf" in str(score) for score in scores)


def _datasets() -> Iterator[tuple[str, Any]]:
    t = np.arange(400) / 100
    x, v = 0.01 * np.sin(2 * np.pi * t), 0.02 * np.pi * np.cos(2 * np.pi * t)
    force = 1e3 * v + 300 * np.sign(v)
    usual: dict[str, Any] = {"t": t, "x": x, "F": force, "currents": (0.0, 0.5, 1.0), "motions": (1.0, 2.0)}
    changes: dict[str, dict[str, Any]] = {
        "three samples": {"t": t[:3], "x": x[:3], "F": force[:3]},
        "three samples a cycle": {"t": np.arange(12) / 3, "x": np.tile([0.0, 0.01, -0.01], 4), "F": np.tile([1.0, 300, -300], 4)},
        "forces of 1e-300": {"F": 1e-300 * force}, "forces of 1e300": {"F": 1e297 * force}, "a force of 1e300": {"F": _one(force, 1e300)},
        "no force": {"F": 0 * force}, "motion of 1e298": {"x": 1e300 * x}, "motion of 1e-300": {"x": 1e-298 * x},
        "motion of 1.9 m": {"x": 190 * x}, "no motion": {"x": 0 * x}, "currents of 1e300": {"currents": (0.0, 1e300)},
        "currents of 1e-300": {"currents": (0.0, 1e-300, 2e-300)}, "negative currents": {"currents": (-1.0, -0.5, 0.0)},
        "1 ns": {"t": 1e-9 * np.arange(400)}, "1e9 s": {"t": 1e9 * np.arange(400)}, "late": {"t": 1e15 + t},
        "reversed": {"t": t[::-1]}, "twice the same time": {"t": _one(t, t[150])}, "noise": {"F": np.random.default_rng(1).normal(size=400)},
        "one condition five times": {"currents": (0.5,), "motions": (1.0,) * 5}, "a square wave": {"x": 0.01 * np.sign(v)},
        "current 1_0": {"currents": ("1_0", "0")}, "current of 5,000 digits": {"currents": ("9" * 5000, "0")},
        "current in other digits": {"currents": ("٣", "0")},
    }  # fmt: skip
    for name, change in changes.items():
        yield name, lambda folder, made={**usual, **change}: _write(folder, **made)


def _one(channel: Any, value: float) -> Any:
    made = channel.copy()
    made[151] = value
    return made


def _write(folder: Path, t: Any, x: Any, F: Any, currents: Sequence[Any], motions: Sequence[float]) -> bool:
    rng = np.random.default_rng(2)
    runs: list[list[Any]] = [
        ["run_id", "rig", "current_A", "excitation", "split", "nominal_frequency_Hz", "nominal_amplitude_m"]
    ]
    samples: list[list[Any]] = [["run_id", "time_s", "displacement_m", "force_N"]]
    for number, (current, speed) in enumerate((c, m) for c in currents for m in motions):
        runs.append([f"r{number}", "a", current, "sine", "train", speed, 0.01])
        noisy = F * (1 + 1e-3 * rng.normal(size=len(F)))
        samples += [
            [f"r{number}", repr(float(a)), repr(float(b)), repr(float(c))]
            for a, b, c in zip(t / speed, x, noisy, strict=True)
        ]
    for name, rows in (("runs.csv", runs), ("samples.csv", samples)):
        with (folder / name).open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(rows)
    return True


def _rig_files() -> Iterator[tuple[str, Any]]:
    rows = "".join(f"{i / 100},{10 * np.sin(i / 16):.5f},{300 * np.cos(i / 16):.3f}\n" for i in range(400))
    head = "time [s],displacement [mm],force [N]\n"

    def profile(text: str | bytes) -> Any:
        def write(folder: Path) -> bool:
            (folder / "0A.csv").write_text(head + rows)
            (folder / "rig.toml").write_bytes(text if isinstance(text, bytes) else text.encode())
            return False

        return write

    yield "profile: encoding hex", profile('[file]\nencoding = "hex"\n')
    yield "profile: encoding rot13", profile('[file]\nencoding = "rot13"\n')
    yield "profile: encoding idna", profile('[file]\nencoding = "idna"\n')
    yield "profile: dotted names", profile(".".join(["a"] * 30_000) + " = 1\n")
    yield "profile: deep", profile("a = " + "[" * 5000 + "]" * 5000 + "\n")
    yield "profile: a number of 5,000 digits", profile("[file]\nskip = " + "9" * 5000 + "\n")
    yield "profile: no text", profile(bytes(range(256)))
    yield "a time of 5,000 digits", lambda folder: bool((folder / "0A.csv").write_text(head + "9" * 5000 + rows) < 0)
    yield "JSON", lambda folder: bool((folder / "0A.json").write_text(json.dumps({"time": [1e308] * 3})) < 0)
