"""Closed loops: an earthquake on three storeys and a road under a quarter car, compared with solve_ivp and openseespy.

`python -m benchmarks.closed_loop`. Peers solve the same frame with a linear viscous damper, because they have no damper
with memory. Results of mrdamper with its dampers are listed, too.
"""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable

import numpy as np

from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.joint import JointDamper, JointProblem
from mrdamper.models import model_type
from mrdamper.rig_files.dataset_folder import load_dataset
from mrdamper.systems.controllers import controller_type
from mrdamper.systems.controllers.passive import Passive
from mrdamper.systems.inputs import load_input
from mrdamper.systems.monte_carlo import draw, monte_carlo
from mrdamper.systems.simulate import SystemLoop
from mrdamper.systems.system_file import load_system

C = 2000.0  # N s/m


def best(call: Callable[[], object], repeats: int = 5) -> float:
    """Shortest time of a call, after one that compiles [s]."""
    call()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return min(times)


def solve_ivp_peak(system, quake, rtol: float) -> tuple[float, float]:
    """Time and peak drift of the frame with a dashpot."""
    from scipy.integrate import solve_ivp

    n, inverse = len(system.coordinates), np.linalg.inv(system.M)
    damping = system.C.copy()
    damping[0, 0] += C

    def rate(t, z):
        a = -inverse @ (damping @ z[n:] + system.K @ z[:n]) - np.interp(t, quake.times, quake.values)
        return np.concatenate([z[n:], a])

    def run():
        return solve_ivp(rate, (0, quake.duration), np.zeros(2 * n), rtol=rtol, atol=1e-9, max_step=quake.step)

    return best(run, 2), float(np.abs(run().y[0]).max())


def openseespy_peak(system, quake, dt: float) -> tuple[float, float]:
    """Time and peak drift by OpenSees: matrices as zero-length elements are out of reach; a chain of springs."""
    import openseespy.opensees as ops

    k = [5.16e5, 6.84e5, 6.84e5]

    def run():
        ops.wipe()
        ops.model("basic", "-ndm", 1, "-ndf", 1)
        ops.node(0, 0.0)
        ops.fix(0, 1)
        for i in range(3):
            ops.node(i + 1, 0.0)
            ops.mass(i + 1, 98.3)
            ops.uniaxialMaterial("Elastic", i + 1, k[i], 50.0 + (C + 75.0 if i == 0 else 0.0))
            ops.element("zeroLength", i + 1, i, i + 1, "-mat", i + 1, "-dir", 1)
        ops.timeSeries("Path", 1, "-dt", quake.step, "-values", *quake.values.tolist())
        ops.pattern("UniformExcitation", 1, 1, "-accel", 1)
        for command, *arguments in (
            ("constraints", "Plain"), ("numberer", "Plain"), ("system", "BandGeneral"), ("algorithm", "Linear"),
            ("integrator", "Newmark", 0.5, 0.25), ("analysis", "Transient"),
        ):  # fmt: skip
            getattr(ops, command)(*arguments)
        peak = 0.0
        for _ in range(int(quake.duration / dt)):
            ops.analyze(1, dt)
            peak = max(peak, abs(ops.nodeDisp(1, 1)))
        return peak

    return best(run, 2), run()


def main() -> None:
    """Print the table."""
    file, quake = load_system("dyke1996"), load_input("elcentro", time_scale=5)
    spread = load_input("elcentro", time_scale=53.74 / 30)
    envelope = Envelope((0.0, 1.0), (0.5, 4.0), (0.004, 0.02), (0.02, 0.3))
    dashpot = JointDamper(model_type("bingham")(c=C, fy=0.0), ("c",), rig="bench", envelope=envelope)
    real = JointProblem(load_dataset().rig("labcontrol").split("train"), "play-bypass").fit().damper
    car, road = load_system("quarter-car").system, load_input("iso8608-b", {"length_s": 60.0})
    rows = []

    def ours(title, system, source, dampers, law, dt):
        loop = SystemLoop(system, source, dampers, law)
        seconds = best(lambda: loop.run(dt, machine=True))
        rows.append((title, seconds, loop.run(dt, machine=True).peaks["drift_m"][0]))

    ours("frame, dashpot, 10.7 s at 1 ms", file.system, quake, {"mr": dashpot}, Passive(), 1e-3)
    for rtol in (1e-3, 1e-8):
        rows.append((f"  solve_ivp RK45, rtol {rtol:g}", *solve_ivp_peak(file.system, quake, rtol)))
    if importlib.util.find_spec("openseespy"):
        rows.append(("  openseespy Newmark, 1 ms", *openseespy_peak(file.system, quake, 1e-3)))
    ours("frame, Spencer damper, 30 s at 1 ms", file.system, spread, file.dampers, Passive(0.75), 1e-3)
    ours("frame, play and bypass, 30 s at 1 ms", file.system, spread, {"mr": real}, Passive(0.5), 1e-3)
    ours("quarter car, passive, 60 s of road at 1 ms", car, road, {"damper": real}, Passive(0.2), 1e-3)
    ours("quarter car, skyhook, 60 s of road at 1 ms", car, road, {"damper": real}, controller_type("skyhook")(), 1e-3)
    for title, seconds, peak in rows:
        print(f"{title:45} {1e3 * seconds:9.1f} ms   peak drift {1e3 * peak:8.4f} mm")
    loop = SystemLoop(file.system, spread, {"mr": real}, Passive(0.5), free=True)
    draws = draw({"mr": estimate_uncertainty(real, load_dataset().rig("labcontrol").split("train"))}, 1000)
    begin = time.perf_counter()
    monte_carlo(loop, draws, loop.run(5e-4))
    print(f"{'1,000 draws of it, compilation included':45} {time.perf_counter() - begin:9.1f} s")


if __name__ == "__main__":
    main()
