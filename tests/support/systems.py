"""Cars for tests, by positional parameters."""

from mrdamper.systems.cars import HalfCar, QuarterCar


def quarter_car(name, body, wheel, spring, tyre, *, stop=(None, 0.0)):
    """A quarter of a car, with bump stops of a free travel [m] and a stiffness [N/m]."""
    parts = {"body_kg": body, "wheel_kg": wheel, "spring_N_m": spring, "tyre_N_m": tyre}
    return QuarterCar(**parts, stop_gap_m=stop[0], stop_N_m=stop[1]).build(name)


def half_car(name, body, inertia, front, rear, wheels, springs, tyres):
    """Half a car."""
    sizes = {"body_kg": body, "pitch_inertia_kg_m2": inertia, "front_arm_m": front, "rear_arm_m": rear}
    return HalfCar(**sizes, wheel_kg=wheels, spring_N_m=springs, tyre_N_m=tyres).build(name)
