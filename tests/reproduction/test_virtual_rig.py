"""The virtual rig obeys the physics its fields name, and is the same every time."""

from dataclasses import replace

import numpy as np
import pytest

from mrdamper.data import Condition
from mrdamper.errors import ParameterError
from mrdamper.metrics import dissipated_power
from mrdamper.motion import sine
from mrdamper.reproduction.virtual_rig import MOTIONS, SLOW_SPEED, VirtualRig, friction_test, true_runs, virtual_dataset

CONDITION = Condition(1.0, 1.0, 0.05)
BARE = VirtualRig(
    yield_off=0, yield_per_ampere=0, friction_low=0, friction_high=0, thinning=0, viscosity_per_ampere=0, mass=0,
    force_noise=0, force_step=0, force_delay=0, displacement_noise=0, displacement_step=0,
)  # fmt: skip


def last_cycle(rig: VirtualRig, condition: Condition = CONDITION):
    motion = sine(condition, 2, 1000)
    return motion.part(slice(-1001, None)), rig.force(motion)[-1001:]


def test_the_matrix_is_the_papers_with_the_largest_amplitude_held_out():
    dataset = virtual_dataset(currents=(0.0, 2.0))
    assert dataset.rigs == ("virtual",)
    train = {(run.nominal.amplitude_m, run.nominal.frequency_Hz) for run in dataset.split("train")}
    assert train == set(MOTIONS)
    assert {(r.nominal.amplitude_m, r.nominal.frequency_Hz) for r in dataset.split("validate")} == {(0.08, 1.0)}
    assert all("synthetic" in run.notes["provenance"] for run in dataset)


def test_the_same_seed_gives_the_same_bits_and_another_only_other_noise():
    one, same, other = (virtual_dataset(currents=(1.0,), seed=s).runs[0] for s in (3, 3, 4))
    assert np.array_equal(one.force, same.force)
    assert 0 < np.std(one.force - other.force) < 2 * VirtualRig().force_noise


def test_without_yield_and_friction_only_gas_and_viscosity_are_left():
    motion, force = last_cycle(BARE)
    expected = BARE.viscosity * motion.velocity - BARE.gas.force(-motion.displacement) + BARE.offset_force
    assert force == pytest.approx(expected, abs=1e-9)


def test_inertia_and_gas_give_no_energy_away_and_everything_else_takes_some():
    motion, force = last_cycle(replace(BARE, viscosity=0, mass=10))
    # The integral over one cycle of 1000 samples by trapezoids of a smooth periodic function.
    assert dissipated_power(force, motion.velocity, motion.time) == pytest.approx(0, abs=1e-6)
    power = [dissipated_power(f, m.velocity, m.time) for m, f in (last_cycle(BARE), last_cycle(VirtualRig()))]
    assert 0 < power[0] < power[1]


def test_the_yield_force_saturates():
    rig = VirtualRig()
    low, high = (np.diff(rig.yield_force(np.array(pair)))[0] for pair in ((0.0, 0.5), (2.0, 2.5)))
    assert high < 0.1 * low
    assert np.all(np.diff(rig.yield_force(np.linspace(0, 3, 50))) > 0)


def test_the_cavity_lengthens_with_the_speed_of_the_stroke_before():
    hollow = VirtualRig(knee=1e-4, knee_lag=0.0)
    filled = replace(hollow, cavity_depth=0.0)
    missing = []
    for frequency in (0.5, 1.5):
        motion, force = last_cycle(hollow, Condition(2.0, frequency, 0.05))
        _, whole = last_cycle(filled, Condition(2.0, frequency, 0.05))
        lost = np.abs(whole - force) > 0.2 * VirtualRig().yield_force(2.0)
        missing.append(float(np.sum(np.abs(np.diff(motion.displacement))[lost[1:]])) / 2)
    # Length = time · speed: three times the frequency, three times the length, less the knee at its start.
    assert missing[1] / missing[0] == pytest.approx(3, rel=0.2)


def test_the_slow_test_shows_friction_and_no_viscosity():
    run = friction_test()
    speed = np.abs(np.diff(run.displacement) / np.diff(run.time))
    assert np.mean(speed) == pytest.approx(SLOW_SPEED, rel=0.6)  # gauge noise moves it too
    assert np.ptp(run.force) < 300


def test_readable_parameters_are_checked():
    rig = VirtualRig()
    assert {info.name for info in rig.parameters()} == set(rig.__dataclass_fields__)
    assert all(info.meaning for info in rig.parameters())
    with pytest.raises(ParameterError, match="cavity_depth is 2"):
        VirtualRig(cavity_depth=2)
    with pytest.raises(ParameterError, match="no gas volume"):
        true_runs(VirtualRig(gas_volume=1e-5), (0.0,))
