"""`make bench`: one table, ours beside each peer that is installed, all in one run."""

from __future__ import annotations

import importlib.util
import platform
import resource
import subprocess
import sys
import time
from collections.abc import Callable

import numpy as np

X, F, BETA, PHASE = 0.02, 1.0, 2e5, 0.3  # with this phase every reversal falls between samples
T = np.arange(3000) / 1000.0


def median_time(function: Callable[[], object], most_seconds: float = 2.0) -> float:
    function()
    times: list[float] = []
    while len(times) < 3 or (sum(times) < most_seconds and len(times) < 200):
        begin = time.perf_counter()
        function()
        times.append(time.perf_counter() - begin)
    return float(np.median(times))


def simulation_rows() -> list[tuple[str, float, float]]:
    """Three thousand samples of z(t), n = 2: name, seconds, largest error over z_max."""
    from mrdamper.hysteresis import Path, Shape, follow

    shape = Shape.from_bouc_wen(BETA, BETA)
    scale, x = float(shape.yield_displacement), X * np.sin(2 * np.pi * F * T + PHASE)
    # Truth: the exact map on a grid that holds every reversal.
    fine = np.arange(3_000_001) / 1e6
    truth = follow(shape, Path.of(X * np.sin(2 * np.pi * F * fine + PHASE), peaks="samples"))[::1000][: T.size]
    path = Path.of(x)
    rows = [
        ("mrdamper, strokes at hand", median_time(lambda: follow(shape, path)), error(follow(shape, path), truth)),
        (
            "mrdamper, with cutting into strokes",
            median_time(lambda: follow(shape, Path.of(x))),
            error(follow(shape, Path.of(x)), truth),
        ),
    ]
    if importlib.util.find_spec("scipy"):
        rows += scipy_rows(truth, scale)
    return rows


def scipy_rows(truth: np.ndarray, scale: float) -> list[tuple[str, float, float]]:
    from scipy.integrate import odeint, solve_ivp

    omega = 2 * np.pi * F

    def rate(t: float, z: np.ndarray) -> np.ndarray:
        v = X * omega * np.cos(omega * t + PHASE)
        return v - BETA * abs(v) * np.abs(z) * z - BETA * v * z**2

    rows = []
    z = odeint(rate, [0.0], T, tfirst=True)[:, 0] / scale
    rows.append(("scipy odeint, defaults", median_time(lambda: odeint(rate, [0.0], T, tfirst=True)), error(z, truth)))
    for method, rtol in (("RK45", 1e-3), ("LSODA", 1e-3), ("RK45", 1e-8)):

        def solve(method: str = method, rtol: float = rtol):
            return solve_ivp(rate, (0, T[-1]), [0.0], method=method, t_eval=T, rtol=rtol, atol=rtol * 1e-3 * scale)

        rows.append((f"scipy solve_ivp {method} {rtol:g}", median_time(solve), error(solve().y[0] / scale, truth)))
    return rows


def error(found: np.ndarray, truth: np.ndarray) -> float:
    return float(np.abs(found - truth).max())


def identification_rows() -> list[tuple[str, float]]:
    from mrdamper.identification import identify
    from mrdamper.io.dataset import load_dataset
    from mrdamper.joint import JointProblem

    dataset = load_dataset()
    sines = [run for run in dataset if run.excitation == "sine"]
    one = dataset["utf_5mm4Hz_1A"]
    rows = [
        ("one run, Bouc–Wen (first time: with motion analysis)", first_time(lambda: identify(one))),
        ("52 runs, Bouc–Wen, one by one", first_time(lambda: [identify(run) for run in sines])),
        ("52 runs, Bingham, one by one", first_time(lambda: [identify(run, "bingham") for run in sines])),
    ]
    for rig in dataset.rigs:
        train = [run for run in dataset.rig(rig).split("train") if run.excitation == "sine"]
        rows.append(
            (
                f"{len(train)} runs jointly, play and bypass ({rig})",
                first_time(lambda train=train: JointProblem(train, "play-bypass").fit()),
            )
        )
    return rows


def first_time(function: Callable[[], object]) -> float:
    begin = time.perf_counter()
    function()
    return time.perf_counter() - begin


def command_rows() -> list[tuple[str, float, float]]:
    """Whole commands in fresh processes: name, seconds, peak memory [MB]."""
    import tempfile

    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, arguments in (
            ("mrdamper --help", ["--help"]),
            ("mrdamper study", ["study", "--out", f"{folder}/result"]),
        ):
            begin = time.perf_counter()
            subprocess.run([sys.executable, "-m", "mrdamper.cli", *arguments], check=True, capture_output=True)
            seconds = time.perf_counter() - begin
            rows.append((name, seconds, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024))
    return rows


def processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:  # noqa: PTH123
            return next(line.split(":", 1)[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def main() -> None:
    print(f"{processor()}, Python {platform.python_version()}, NumPy {np.__version__}\n")
    commands = command_rows()  # first: a child counts the memory of the process that starts it
    rows = simulation_rows()
    ours = rows[0][1]
    print("| 3,000 samples of z(t), n = 2 | times ours | ns a sample | largest error / z_max |\n|---|---|---|---|")
    for name, seconds, worst in rows:
        print(f"| {name} | {seconds / ours:,.0f} | {1e9 * seconds / T.size:,.0f} | {worst:.0e} |")
    print("\n| identification, real runs | seconds |\n|---|---|")
    for name, seconds in identification_rows():
        print(f"| {name} | {seconds:.3f} |")
    print("\n| command, fresh process | seconds | peak MB |\n|---|---|---|")
    for name, seconds, memory in commands:
        print(f"| {name} | {seconds:.2f} | {memory:.0f} |")


if __name__ == "__main__":
    main()
