"""Time per sample in the interpreter, compiled, and as generated C."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.simulation import BETA, OMEGA, SHAPE, T, X
from benchmarks.timing import race
from mrdamper.dampers.streaming import stepper, stream
from mrdamper.exporters.c import c_sources
from mrdamper.models import Model
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.models.play_bypass import PlayBypass

# Steps through a sine that the program makes itself, and prints the least nanoseconds a step of some rounds.
DRIVER = r"""
#define _POSIX_C_SOURCE 199309L
#include "m.h"
#include <math.h>
#include <stdio.h>
#include <time.h>
enum { SAMPLES = 3000, ROUNDS = %(rounds)d };
static double x[SAMPLES];
static double now(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}
int main(void)
{
    m_model model;
    volatile m_real sink = 0;
    double least = 1e300;
    for (int i = 0; i < SAMPLES; ++i) {
        x[i] = %(amplitude)r * sin(%(omega)r * i * 1e-3 + 0.3);
    }
    for (int round = 0; round < ROUNDS; ++round) {
        m_real force = 0;
        if (m_init(&model) != M_OK) {
            return 1;
        }
        double begin = now();
        for (int i = 0; i < SAMPLES; ++i) {
            (void)m_step(&model, (m_real)x[i], (m_real)0.5, (m_real)1e-3, &force);
            sink = force;
        }
        double took = (now() - begin) / SAMPLES;
        least = took < least ? took : least;
    }
    (void)sink;
    printf("%%g\n", least);
    return 0;
}
"""


@dataclass(frozen=True)
class StreamRow:
    """Nanoseconds a step; None where there is no compiler to build C with.

    `bytes` is the code and the constant tables of the C object at -Os, in double and in single precision.
    """

    name: str
    python: float
    compiled: float
    c: float | None
    bytes: tuple[int, int] | None


def dampers() -> dict[str, Model]:
    """What streams: closed forms, a table, a whole damper."""
    scale = float(SHAPE.yield_displacement)
    play = {"f0": 40.0, "k": 800.0, "c0": 600.0, "c1": 3800.0, "fy0": 140.0, "fy1": 1000.0, "d": 2e-4, "e": 2.5e-5}
    return {
        "Bouc–Wen, n = 2": BoucWen(c=1e3, alpha=1 / scale, beta=BETA, gamma=BETA, n=2.0),
        "Bouc–Wen, n = 1.5": BoucWen(c=1e3, alpha=1 / scale, beta=2e4, gamma=1e4, n=1.5),
        "play and bypass": PlayBypass(**play, cb=3.6e4, h0=0.4, h1=0.3, vh=3e-3, T=5e-3),
    }


def stream_rows(quick: bool) -> list[StreamRow]:
    """Every damper from displacement and current to force, one sample a step."""
    compiler = next((name for name in ("gcc", "clang", "cc") if shutil.which(name)), None)
    share = 0.1 if quick else 1.0
    rows = []
    for name, model in dampers().items():
        here = _here(model, share)
        there = (_in_c(model, compiler, 200 if quick else 2000), _sizes(model, compiler)) if compiler else (None, None)
        rows.append(StreamRow(name, *here, *there))
    return rows


def _here(model: Model, share: float) -> tuple[float, float]:
    x = X * np.sin(OMEGA * T + 0.3)
    v = X * OMEGA * np.cos(OMEGA * T + 0.3)
    current, samples = np.full(T.size, 0.5), x.tolist()
    stepped = stepper(model)

    def one_by_one() -> None:
        stepped.reset()
        for value in samples:
            stepped.step(value, 0.5, 1e-3)

    def compiled() -> None:
        stepped.reset()
        stepped.run(T, x, v, -(OMEGA**2) * x, current)

    times = race({"python": one_by_one, "compiled": compiled}, share)
    return 1e9 * times["python"] / T.size, 1e9 * times["compiled"] / T.size


def _in_c(model: Model, compiler: str, rounds: int) -> float:
    driver = DRIVER % {"rounds": rounds, "amplitude": X, "omega": OMEGA}
    with tempfile.TemporaryDirectory() as folder:
        sources = _written(model, Path(folder))
        (sources / "driver.c").write_text(driver)
        _compile(compiler, sources, "-O3", "-march=native", "m.c", "driver.c", "-lm", "-o", "run")
        return float(subprocess.run([sources / "run"], capture_output=True, text=True, check=True).stdout)


def _sizes(model: Model, compiler: str) -> tuple[int, int] | None:
    if shutil.which("size") is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        sources = _written(model, Path(folder))
        found = []
        for flags in ((), ("-DM_SINGLE",)):
            _compile(compiler, sources, "-Os", *flags, "-c", "m.c", "-o", "m.o")
            told = subprocess.run(["size", sources / "m.o"], capture_output=True, text=True, check=True).stdout
            text, data = told.splitlines()[1].split()[:2]
            found.append(int(text) + int(data))
    return found[0], found[1]


def _written(model: Model, folder: Path) -> Path:
    for name, text in c_sources(stream(model), "m", "bench").items():
        (folder / name).write_text(text)
    return folder


def _compile(compiler: str, folder: Path, *arguments: str) -> None:
    subprocess.run([compiler, "-std=c99", *arguments], cwd=folder, check=True)
