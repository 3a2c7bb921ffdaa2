"""State of a hysteresis along one motion at 3,000 samples, by every installed method."""

from __future__ import annotations

import ctypes
import importlib.util
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.timing import race
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.physics.hysteresis import Shape, follow
from mrdamper.physics.motion import Path

X, F, BETA, PHASE = 0.02, 1.0, 2e5, 0.3  # with this phase every reversal falls between samples
T = np.arange(3000) / 1000.0
OMEGA = 2 * np.pi * F
SHAPE = Shape.from_bouc_wen(BETA, BETA)
OURS = "mrdamper, closed form per stroke"


@dataclass(frozen=True)
class SimulationRow:
    """Time a sample and largest error over z_max of one way to the state."""

    name: str
    ratio: float
    nanoseconds: float
    error: float


def simulation_rows(quick: bool) -> list[SimulationRow]:
    """Ours first, then the peers by time."""
    ways = {**_ours(), **_hand_written_c(), **_numba_rk4(), **_scipy(), **_jax(), **_opensees()}
    truth = _truth()
    errors = {name: float(np.abs(way() - truth).max()) for name, way in ways.items()}
    times = race(ways, 0.15 if quick else 1.0)
    return [
        SimulationRow(name, times[name] / times[OURS], 1e9 * times[name] / T.size, errors[name])
        for name in sorted(times, key=lambda n: times[n])
    ]


def _truth() -> np.ndarray:
    """The exact map on a grid a thousand times finer, which holds every reversal to 1e-9."""
    fine = np.arange((T.size - 1) * 1000 + 1) / 1e6
    return follow(SHAPE, Path.of(X * np.sin(OMEGA * fine + PHASE)))[::1000]


def _ours() -> dict[str, Callable[[], np.ndarray]]:
    x = X * np.sin(OMEGA * T + PHASE)
    path = Path.of(x)
    ways = {
        OURS: lambda: follow(SHAPE, path),
        "mrdamper, cutting the motion into strokes included": lambda: follow(SHAPE, Path.of(x)),
    }
    return ways | _streaming(x)


def _streaming(x: np.ndarray) -> dict[str, Callable[[], np.ndarray]]:
    """The state as force of a model with nothing else in it, one sample after the other."""
    try:
        from mrdamper.dampers.streaming import stepper
    except ModuleNotFoundError:
        return {}
    scale = float(SHAPE.yield_displacement)
    stream = stepper(BoucWen(c=0.0, alpha=1 / scale, beta=BETA, gamma=BETA, n=2.0))
    nothing, dt = np.zeros(T.size), 1e-3
    samples = x.tolist()

    def compiled() -> np.ndarray:
        stream.reset()
        return stream.run(T, x, nothing, nothing, nothing)

    def one_by_one() -> np.ndarray:
        stream.reset()
        return np.array([stream.step_motion(value, 0.0, 0.0, 0.0, dt) for value in samples])

    # The first sample only says where the motion starts: a stream knows no peaks between samples.
    return {"mrdamper streaming, compiled": compiled, "mrdamper streaming, Python, one call per sample": one_by_one}


def _numba_rk4() -> dict[str, Callable[[], np.ndarray]]:
    from benchmarks.rk4 import rk4

    v = X * OMEGA * np.cos(OMEGA * T + PHASE)
    scale = float(SHAPE.yield_displacement)
    return {"numba RK4 as usually written": lambda: rk4(v, 1e-3, 1.0, BETA, BETA, 2.0) / scale}


def _hand_written_c() -> dict[str, Callable[[], np.ndarray]]:
    """RK4 with numbers of this motion only, and the closed form as a sum of arguments of tanh."""
    if (compiler := shutil.which("cc")) is None:
        return {}
    with tempfile.TemporaryDirectory() as folder:
        library = f"{folder}/by_hand.so"
        command = [compiler, "-O3", "-march=native", "-shared", "-fPIC", "-x", "c", "-", "-o", library, "-lm"]
        subprocess.run(command, input=_C_SOURCE, text=True, check=True)
        loaded = ctypes.CDLL(library)
    scale = float(SHAPE.yield_displacement)
    x, v = X * np.sin(OMEGA * T + PHASE), X * OMEGA * np.cos(OMEGA * T + PHASE)
    numbers = np.ctypeslib.ndpointer(dtype=float, flags="C")

    def way(function: Callable[..., None], motion: np.ndarray, second: float) -> Callable[[], np.ndarray]:
        function.argtypes = [numbers, numbers, ctypes.c_int, ctypes.c_double, ctypes.c_double]  # type: ignore[attr-defined]

        def run() -> np.ndarray:
            z = np.empty(T.size)
            function(motion, z, T.size, second, scale)
            return z

        return run

    return {
        "hand-written C, RK4 at the sample step": way(loaded.rk4, v, 1e-3),
        "hand-written C, closed form per sample": way(loaded.closed, x, BETA),
    }


_C_SOURCE = """
#include <math.h>
static double rate(double z, double v, double b) { return v - b * fabs(v) * fabs(z) * z - b * v * z * z; }
void rk4(const double *v, double *out, int n, double dt, double scale) {
    double z = 0, b = 0.5 / (scale * scale);
    for (int i = 0; i < n; i++) {
        out[i] = z / scale;
        if (i + 1 == n) return;
        double middle = 0.5 * (v[i] + v[i + 1]);
        double k1 = rate(z, v[i], b), k2 = rate(z + 0.5 * dt * k1, middle, b);
        double k3 = rate(z + 0.5 * dt * k2, middle, b), k4 = rate(z + dt * k3, v[i + 1], b);
        z += dt * (k1 + 2 * k2 + 2 * k3 + k4) / 6;
    }
}
void closed(const double *x, double *out, int n, double unused, double scale) {
    double z = 0, u = 0, step;  /* z = tanh(u) while loading, a straight line while unloading */
    int loading = 1;
    out[0] = 0;
    for (int i = 1; i < n; i++) {
        step = (x[i] - x[i - 1]) / scale;
        if (z * step < 0) {
            z += step, loading = 0;
            if (z * step > 0) u = z, z = tanh(u), loading = 1;
        } else {
            if (!loading) u = atanh(z), loading = 1;
            u += step, z = tanh(u);
        }
        out[i] = z;
    }
}
"""


def _jax() -> dict[str, Callable[[], np.ndarray]]:
    """RK4 as one compiled scan, and the solvers of diffrax, in double precision."""
    if importlib.util.find_spec("diffrax") is None:
        return {}
    import diffrax
    import jax

    jax.config.update("jax_enable_x64", True)
    scale, np_ = float(SHAPE.yield_displacement), jax.numpy
    v = np_.asarray(X * OMEGA * np.cos(OMEGA * T + PHASE))

    def rate(v: jax.Array, z: jax.Array) -> jax.Array:
        return v - BETA * abs(v) * abs(z) * z - BETA * v * z**2

    def step(z: jax.Array, ends: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        first, last = ends
        k1 = rate(first, z)
        k2 = rate((first + last) / 2, z + 5e-4 * k1)
        k3 = rate((first + last) / 2, z + 5e-4 * k2)
        k4 = rate(last, z + 1e-3 * k3)
        return z + 1e-3 * (k1 + 2 * k2 + 2 * k3 + k4) / 6, z

    scan = jax.jit(lambda v: jax.lax.scan(step, np_.float64(0.0), (v, np_.append(v[1:], v[-1])))[1])
    term = diffrax.ODETerm(lambda t, z, _: rate(X * OMEGA * np_.cos(OMEGA * t + PHASE), z))
    times = diffrax.SaveAt(ts=np_.asarray(T))

    def solver(rtol: float) -> Callable[[], np.ndarray]:
        control = diffrax.PIDController(rtol=rtol, atol=rtol * 1e-3 * scale)

        @jax.jit
        def solve(first: jax.Array) -> jax.Array | None:
            return diffrax.diffeqsolve(
                term,
                diffrax.Tsit5(),
                0.0,
                T[-1],
                1e-3,
                first,
                saveat=times,
                stepsize_controller=control,
                max_steps=10**6,
            ).ys

        return lambda: np.asarray(solve(np_.float64(0.0))) / scale

    return {
        "JAX, RK4 as a compiled scan": lambda: np.asarray(scan(v)) / scale,
        "diffrax Tsit5, rtol 1e-3": solver(1e-3),
        "diffrax Tsit5, rtol 1e-8": solver(1e-8),
    }


def _rate(t: float, z: np.ndarray) -> np.ndarray:
    v = X * OMEGA * np.cos(OMEGA * t + PHASE)
    return v - BETA * abs(v) * np.abs(z) * z - BETA * v * z**2


def _scipy() -> dict[str, Callable[[], np.ndarray]]:
    from scipy.integrate import odeint, solve_ivp

    scale = float(SHAPE.yield_displacement)
    ways = {"scipy odeint, defaults": lambda: odeint(_rate, [0.0], T, tfirst=True)[:, 0] / scale}
    for method in ("RK45", "LSODA"):
        for rtol, name in ((1e-3, "defaults"), (1e-8, "rtol 1e-8")):

            def solve(method: str = method, rtol: float = rtol) -> np.ndarray:
                # An absolute tolerance that fits a state of a millimetre; the default one is the state itself.
                found = solve_ivp(
                    _rate, (0, T[-1]), [0.0], method=method, t_eval=T, rtol=rtol, atol=rtol * 1e-3 * scale
                )
                return found.y[0] / scale

            ways[f"scipy solve_ivp {method}, {name}"] = solve
    return ways


def _opensees() -> dict[str, Callable[[], np.ndarray]]:
    if importlib.util.find_spec("openseespy") is None:
        return {}
    try:
        import openseespy.opensees as ops
    except (ImportError, RuntimeError):  # a wheel whose system libraries are missing
        return {}
    scale = float(SHAPE.yield_displacement)

    def walk(substeps: int) -> np.ndarray:
        fine = np.linspace(T[0], T[-1], (T.size - 1) * substeps + 1)
        x = X * np.sin(OMEGA * fine + PHASE)
        ops.wipe()
        ops.uniaxialMaterial("BoucWen", 1, 0.0, 1.0, 2.0, BETA, BETA, 1.0, 0.0, 0.0, 0.0)
        ops.testUniaxialMaterial(1)
        z = np.empty(x.size)
        for i, displacement in enumerate((x - x[0]).tolist()):
            ops.setStrain(displacement)
            z[i] = ops.getStress()
        return z[::substeps] / scale

    return {f"openseespy BoucWen, {n} step{'s' * (n > 1)} a sample": lambda n=n: walk(n) for n in (1, 20)}
