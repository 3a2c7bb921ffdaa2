"""
A damper in a closed loop
=========================

A body on a spring and a damper: passive, at full current, and under skyhook control.

The damper is identified from the bundled tests and evaluated sample by sample, as the exported C
on a real-time target.
"""

import math

from mrdamper import load_dataset, stepper
from mrdamper.dampers.joint import JointProblem

runs = load_dataset().rig("labcontrol").split("train")
damper = stepper(JointProblem(runs, "play-bypass").fit().damper)

MASS, STIFFNESS, ROAD = 2000.0, 2.0e5, 0.004  # kg, N/m, m
DT, END = 5e-4, 6.0
LOW, HIGH = 0.0, 0.7  # A


def ride(current_of):
    """RMS acceleration of the body [m/s²] over a road that sweeps through its resonance."""
    damper.reset()
    body, speed, squares, steps = 0.0, 0.0, 0.0, int(END / DT)
    for i in range(steps):
        t = i * DT
        road = ROAD * math.sin(2 * math.pi * (0.5 * t + 0.25 * t**2))
        road_speed = (ROAD * math.sin(2 * math.pi * (0.5 * (t + DT) + 0.25 * (t + DT) ** 2)) - road) / DT
        stroke, rate = body - road, speed - road_speed
        force = damper.step(stroke, current_of(speed, rate), DT)
        acceleration = -(STIFFNESS * stroke + force) / MASS
        speed += acceleration * DT
        body += speed * DT
        squares += acceleration**2
    return math.sqrt(squares / steps)


for name, law in {
    "no current": lambda speed, rate: LOW,
    "full current": lambda speed, rate: HIGH,
    "skyhook": lambda speed, rate: HIGH if speed * rate > 0 else LOW,
}.items():
    print(f"{name:13} {ride(law):.3f} m/s²")
