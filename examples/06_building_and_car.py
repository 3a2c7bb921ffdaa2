"""
A building in an earthquake
===========================

A frame with and without a damper, and the current for a required force."""

import math

from mrdamper import invert, load_input, load_system
from mrdamper.systems.controllers import controller_type
from mrdamper.systems.controllers.passive import Passive
from mrdamper.systems.simulate import SystemLoop

file = load_system("dyke1996")
quake = load_input("elcentro", time_scale=5)
STEP = 1e-3  # s; simulate_system finds one by halving

for title, dampers, law in (
    ("no damper", {}, Passive()),
    ("2.25 V", file.dampers, Passive(0.75)),
    ("clipped-optimal", file.dampers, controller_type("clipped-optimal")()),
):
    done = SystemLoop(file.system, quake, dampers, law).run(STEP)
    drift, acceleration = done.peaks["drift_m"].max(), done.peaks["acceleration_m_s2"].max()
    print(f"{title:16} drift {1e3 * drift:5.2f} mm   acceleration {acceleration:5.2f} m/s²")

inverse = invert(file.dampers["mr"])
for i in range(100):
    t = i * 1e-3
    motion = 0.01 * math.sin(10 * t), 0.1 * math.cos(10 * t), -math.sin(10 * t)
    found = inverse.step(*motion, wanted=600.0, dt=1e-3)
print(f"600 N: {found.force:.0f} N at {found.current:.3f} A, reachable {found.lowest:.0f} to {found.highest:.0f} N")
