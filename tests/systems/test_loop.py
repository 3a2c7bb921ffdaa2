"""Laws of the loop: what a quarter car does to a sine, energy, step, contacts, couplings."""

import numpy as np
import pytest
from support.systems import half_car, quarter_car

from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.joint import JointDamper
from mrdamper.errors import StepError
from mrdamper.models import model_type
from mrdamper.systems import result, simulate
from mrdamper.systems.controllers import controller_type
from mrdamper.systems.controllers.passive import Passive
from mrdamper.systems.inputs import load_input
from mrdamper.systems.inputs.record import record
from mrdamper.systems.simulate import SystemLoop, simulate_system
from mrdamper.systems.structure import Link, building, shear_building

ENVELOPE = Envelope((0.0, 1.0), (0.5, 4.0), (0.004, 0.02), (0.02, 0.3))


def dashpot(c=1500.0, fy=0.0):
    return JointDamper(model_type("bingham")(c=c, fy=fy), ("c",), rig="bench", envelope=ENVELOPE)


def pulse(peak=2.0, end=2.0):
    time = np.arange(0, end, 0.01)
    return record(time, peak * np.sin(2 * np.pi * 3 * time) * (time < 1), "acceleration_m_s2")


@pytest.mark.parametrize("frequency", [3.0, *(pytest.param(f, marks=pytest.mark.slow) for f in (0.8, 11.0))])
def test_a_quarter_car_passes_on_what_its_transfer_function_says(frequency):
    car = quarter_car("car", 300, 40, 20e3, 200e3)
    dt, c = 1e-3, 1500.0
    road = load_input("sweep", {"amplitude_m": 1e-3, "lowest_Hz": frequency, "highest_Hz": frequency, "length_s": 12})
    done = SystemLoop(car, road, {"damper": dashpot(c)}, Passive()).run(dt, machine=False)
    last = done.time > 12 - 3 / frequency
    columns = np.column_stack([np.exp(2j * np.pi * frequency * done.time), np.exp(-2j * np.pi * frequency * done.time)])
    body = np.linalg.lstsq(columns[last], done.x[last].astype(complex), rcond=None)[0][0] / (1e-3 / 2j)
    # The trapezoidal rule answers exactly, at the frequency that it sees for this step.
    p = 2j / dt * np.tan(np.pi * frequency * dt)
    dynamic = p**2 * car.M + p * c * np.array([[1, -1], [-1, 1]]) + car.K
    assert body == pytest.approx(np.linalg.solve(dynamic, [0, 200e3]), rel=1e-6)


def test_energy_balances_and_steps_converge_with_order_two():
    frame = shear_building("frame", [100.0, 80.0], [4e5, 3e5], [50.0, 40.0], [Link("d", "floor1", "ground")])
    loop = SystemLoop(frame, pulse(), {"d": dashpot(8e4)}, Passive())  # damping a thousand times critical
    runs = [loop.run(dt, machine=False) for dt in (2e-3, 1e-3, 5e-4)]
    assert max(run.energy_gap for run in runs) < 1e-9
    fine = runs[2].x
    error = [np.sqrt(np.mean((run.x - fine[:: round(run.step / runs[2].step)]) ** 2)) for run in runs[:2]]
    assert error[0] / error[1] == pytest.approx(5.0, rel=0.15)  # (1 − 1/16)/(1/4 − 1/16)
    assert runs[2].energy["d"][-1] > 0


def test_a_jump_of_the_force_holds_the_structure_still():
    frame = shear_building("frame", [100.0], [4e5], [0.0], [Link("d", "floor1", "ground")])
    stuck = SystemLoop(frame, pulse(1.0), {"d": dashpot(0.0, fy=500.0)}, Passive()).run(1e-3, machine=False)
    assert np.abs(stuck.x).max() < 1e-9  # 100 N of inertia against 500 N of friction
    slips = SystemLoop(frame, pulse(20.0), {"d": dashpot(0.0, fy=500.0)}, Passive()).run(1e-3, machine=False)
    assert np.abs(slips.x).max() > 1e-3
    assert np.abs(slips.force).max() == pytest.approx(500.0, rel=1e-6)
    assert slips.energy_gap < 1e-9


def test_dampers_side_by_side_share_the_force_of_one():
    def frame(*links):
        return shear_building("frame", [100.0, 80.0], [4e5, 3e5], [50.0, 40.0], links)

    one = SystemLoop(frame(Link("a", "floor1", "ground")), pulse(), {"a": dashpot(4e3)}, Passive()).run(
        1e-3, machine=False
    )
    two = SystemLoop(
        frame(Link("a", "floor1", "ground"), Link("b", "floor1", "ground")),
        pulse(), {"a": dashpot(1e3), "b": dashpot(3e3)}, Passive(),
    ).run(1e-3, machine=False)  # fmt: skip
    assert two.x == pytest.approx(one.x, rel=1e-6, abs=1e-9)
    assert two.force.sum(axis=1) == pytest.approx(one.force[:, 0], rel=1e-5, abs=1e-4)


def test_tyres_lift_off_and_stops_are_touched_and_energy_still_balances():
    car = quarter_car("car", 300, 40, 20e3, 200e3, stop=(0.03, 2e5))
    bump = load_input("bump", {"height_m": 0.12, "bump_m": 1.0, "speed_m_s": 8.0, "length_s": 2.0})
    done = SystemLoop(car, bump, {"damper": dashpot()}, Passive()).run(5e-4, machine=False)
    tyre = [link.name for link in done.links].index("tyre")
    assert set(done.outside) >= {"stop", "tyre"}
    in_air = done.flags[:, tyre] == 1
    total = done.links[tyre].stiffness * done.stroke[:, tyre] + done.force[:, tyre]
    assert total[in_air] == pytest.approx(340 * 9.81, rel=1e-6)  # nothing holds the wheel but its weight
    assert done.energy_gap < 1e-9


@pytest.mark.parametrize("machine", [False, True])
def test_a_record_walked_in_parts_is_the_record_walked_at_once(machine, monkeypatch):
    car = quarter_car("car", 300, 40, 20e3, 200e3, stop=(0.03, 2e5))
    bump = load_input("bump", {"height_m": 0.12, "bump_m": 1.0, "speed_m_s": 8.0, "length_s": 1.0})
    values = {"f0": 0, "k": 1e3, "c0": 800, "c1": 200, "fy0": 150, "fy1": 600, "d": 2e-4, "e": 5e-5, "cb": 3e4}
    model = model_type("play-bypass").build({**values, "h0": 0.4, "h1": 0.1, "vh": 0.01, "T": 5e-3})
    damper = JointDamper(model, ("c0",), rig="bench", envelope=ENVELOPE)
    loop = SystemLoop(car, bump, {"damper": damper}, controller_type("skyhook")(), 0.5)
    whole = loop.run(5e-4, machine)
    for module in (simulate, result):
        monkeypatch.setattr(module, "PART", 50)
    parts = loop.run(5e-4, machine)
    assert np.ptp(whole.current) > 0
    assert np.count_nonzero(whole.flags) > 0
    for name in ("x", "v", "a", "force", "stroke", "current", "flags", "load"):
        assert getattr(parts, name) == pytest.approx(getattr(whole, name), rel=1e-9, abs=1e-12), name
    assert parts.energy["damper"] == pytest.approx(whole.energy["damper"], rel=1e-9)


def test_the_rear_axle_follows_the_front():
    car = half_car("car", 690, 1222, 1.3, 1.5, (40, 45), (18e3, 22e3), (192e3, 192e3))
    bump = load_input("bump", {"height_m": 0.02, "speed_m_s": 7.0, "length_s": 1.5})
    done = SystemLoop(car, bump, {name: dashpot() for name in ("damper_front", "damper_rear")}, Passive()).run(
        1e-3, machine=False
    )
    assert done.road[600, 1] == pytest.approx(done.road[200, 0], abs=1e-9)  # 2.8 m at 7 m/s
    mirrored = half_car("car", 690, 1222, 1.4, 1.4, (40, 40), (18e3, 18e3), (192e3, 192e3))
    heave = SystemLoop(
        mirrored, load_input("bump", {"speed_m_s": 150.0, "bump_m": 100.0, "height_m": 0.02, "length_s": 1.5}), {},
        Passive(),
    ).run(1e-3, machine=False)  # fmt: skip
    assert np.abs(heave.x[:, 1]).max() < 0.1 * np.abs(heave.x[:, 0]).max()


def test_compiled_code_and_interpreter_agree():
    frame = building("frame", ["a"], np.eye(1) * 100, np.eye(1) * 10, np.eye(1) * 1e5, [Link("d", "a", "ground")])
    loop = SystemLoop(frame, pulse(end=0.3), {"d": dashpot(2e3, fy=50.0)}, Passive())
    slow, fast = loop.run(1e-3, machine=False), loop.run(1e-3, machine=True)
    assert fast.x == pytest.approx(slow.x, rel=1e-12, abs=1e-15)


def test_a_step_that_is_too_coarse_is_refused_with_the_one_that_is_needed():
    frame = shear_building("frame", [100.0, 80.0], [4e6, 3e6], [50.0, 40.0])
    with pytest.raises(StepError, match="E_STEP_COARSE") as refused:
        simulate_system(frame, pulse(), {}, step=0.02)
    needed = float(str(refused.value).split("--step ")[1].split()[0])
    assert simulate_system(frame, pulse(), {}, step=needed).halving < 5e-3
    with pytest.raises(StepError):
        simulate_system(frame, pulse(), {}, step=-1.0)


def test_peaks_that_no_step_settles_are_called_so():
    hops = quarter_car("car", 300, 40, 20e3, 200e3, stop=(0.03, 2e6))  # nothing takes energy out
    rough = load_input("iso8608-e", {"length_s": 4.0})
    done = simulate_system(hops, rough, {})
    assert not done.settled
    assert done.step > 5e-5  # it was not halved in vain
    assert simulate_system(hops, load_input("bump", {"length_s": 0.5, "height_m": 1e-3}), {}).settled
