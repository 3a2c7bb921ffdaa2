"""The virtual rig obeys the physics its fields name, and is the same every time."""

from dataclasses import replace

import numpy as np
import pytest

from mrdamper.data import Condition
from mrdamper.errors import ParameterError
from mrdamper.paper.virtual_rig import (
    MOTIONS,
    SLOW_SPEED,
    VirtualRig,
    _follow_lag,
    _speed_before,
    friction_test,
    true_runs,
    virtual_dataset,
)
from mrdamper.physics.gas_spring import GasSpring
from mrdamper.physics.motion import sine
from mrdamper.statistics.metrics import dissipated_power

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
    run = friction_test(VirtualRig())
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


def test_shear_thinning_is_that_of_the_formula():
    rig = replace(BARE, thinning=0.4, thinning_speed=0.2, viscosity=1000, viscosity_per_ampere=300)
    motion, force = last_cycle(rig)
    v = motion.velocity
    coefficient = 1000 + 300 * rig.magnetisation(1.0)
    expected = coefficient * v * (1 + (v / 0.2) ** 2) ** -0.2 - rig.gas.force(-motion.displacement) + rig.offset_force
    assert force == pytest.approx(expected, abs=1e-9)
    assert rig.magnetisation(1.0) == pytest.approx(1.0 / (1 + (1 / 1.5) ** 6) ** (1 / 6))
    assert rig.gas == GasSpring(1.5e6, 1.5e-4, np.pi * 0.020**2 / 4)


def test_seal_friction_waves_along_the_stroke_and_the_mass_is_inertia():
    rig = replace(BARE, viscosity=0, friction_low=20, friction_high=80, friction_knee=1e-7, mass=7.0)
    motion, force = last_cycle(rig)
    x, v = motion.displacement, motion.velocity
    size = 50 + 30 * np.sin(2 * np.pi * x / rig.friction_wave)
    expected = size * np.sign(v) + 7.0 * motion.acceleration - rig.gas.force(-x) + rig.offset_force
    moving = np.abs(v) > 0.02
    assert force[moving] == pytest.approx(expected[moving], abs=0.1)


def test_until_the_cavity_closes_a_share_of_the_yield_force_is_missing_and_the_lag_delays_it():
    rig = replace(BARE, viscosity=0, yield_off=500, knee=1e-7, knee_lag=0, cavity_depth=0.3, cavity_time=6e-3)
    motion, force = last_cycle(rig)
    hysteretic = force + rig.gas.force(-motion.displacement) - rig.offset_force
    path = motion.path
    length = 6e-3 * 2 * np.pi * 0.05  # time · peak speed of the stroke before
    share = 1 - 0.3 / (1 + (path.distance / length) ** 8)
    inner = (path.distance > 1e-4) & (path.stroke > 0)
    assert np.abs(hysteretic)[inner] == pytest.approx(500 * share[inner], rel=2e-3)
    late = replace(rig, knee_lag=4e-3, cavity_depth=0.0)
    whole = sine(CONDITION, 2, 1000)
    plain = replace(late, knee_lag=0.0).force(whole) - late.offset_force + late.gas.force(-whole.displacement)
    lagged = late.force(whole) - late.offset_force + late.gas.force(-whole.displacement)
    keep, state, expected = np.exp(-(whole.time[1] - whole.time[0]) / 4e-3), plain[0], []
    for value in plain:
        state = value + (state - value) * keep
        expected.append(state)
    assert lagged == pytest.approx(np.array(expected), abs=1e-9)


def test_the_yield_force_builds_up_over_the_knee_and_the_seal_breaks_away_over_its_own():
    rig = replace(BARE, yield_off=100.0, cavity_depth=0.0, friction_low=30.0, friction_high=30.0)
    tiny = sine(Condition(0.0, 1.0, 1e-6), 0.2, 2000)
    assert rig._hysteretic(tiny) == pytest.approx(100 * tiny.displacement / rig.knee, rel=0.01, abs=1e-9)
    motion = sine(Condition(0.0, 1.0, 2e-4), 2, 500)
    x, state, expected = motion.displacement, 0.0, []
    for i in range(x.size):  # n = 1, beta alone: what is missing of the full force fades over the knee
        way = x[i] - x[max(i - 1, 0)]
        state = np.sign(way) + (state - np.sign(way)) * np.exp(-abs(way) / rig.friction_knee)
        expected.append(30 * state)
    # A reversal lies between two samples, of 2.5 µm at most.
    assert rig._friction(x, motion.path) == pytest.approx(np.array(expected), abs=0.3)


def test_currents_magnetise_either_way():
    rig = VirtualRig()
    assert rig.magnetisation(-1.2) == rig.magnetisation(1.2) > 0
    assert replace(rig, saturation_current=1.0).magnetisation(-9.0) == pytest.approx(1.0, rel=1e-3)


def test_the_stroke_before_is_the_one_before():
    velocity = np.array([0.1, -0.3, 0.2, -0.5, 0.4, 0.1, 0.2])
    stroke = np.array([0, 0, 1, 1, 1, 2, 3])
    assert _speed_before(velocity, stroke).tolist() == [0, 0, 0.3, 0.3, 0.3, 0.5, 0.1]
    force, time = np.array([0.0, 1.0, 3.0]), np.arange(3) / 10
    assert _follow_lag(force, time + 7.0, 0.2) == pytest.approx(_follow_lag(force, time, 0.2))


def test_noise_is_that_of_the_given_generator():
    motion = sine(CONDITION, 1, 100)
    noisy = replace(BARE, force_noise=6.0, displacement_noise=5e-6)
    run = noisy.sense(motion, np.zeros(100 + 1)[: len(motion)], np.random.default_rng(4), id="one")
    gauge, cell = np.random.default_rng(4).standard_normal((2, len(motion)))
    assert run.displacement == pytest.approx(motion.displacement + 5e-6 * gauge)
    assert run.force == pytest.approx(6.0 * cell)


def test_sensors_delay_quantise_and_add_noise():
    motion = sine(CONDITION, 2, 500)
    force = 1000 * np.sin(2 * np.pi * motion.time)
    rng = np.random.default_rng(0)
    clean = replace(BARE, force_delay=4e-3)
    run = clean.sense(motion, force, rng, id="one")
    assert run.force == pytest.approx(np.interp(motion.time - 4e-3, motion.time, force))
    assert run.displacement == pytest.approx(motion.displacement)
    coarse = replace(BARE, force_step=50.0, displacement_step=1e-3).sense(motion, force, rng, id="two")
    assert coarse.force == pytest.approx(50 * np.round(force / 50))
    assert coarse.displacement == pytest.approx(1e-3 * np.round(motion.displacement / 1e-3))
    noisy = replace(BARE, force_noise=6.0, displacement_noise=5e-6).sense(motion, force, rng, id="three")
    assert np.std(noisy.force - force) == pytest.approx(6.0, rel=0.1)
    assert np.std(noisy.displacement - motion.displacement) == pytest.approx(5e-6, rel=0.1)
    assert (noisy.rig, noisy.id) == ("virtual", "three")


def test_runs_are_named_after_their_condition_and_hold_steady_cycles_after_a_run_in():
    runs = {run.id: run for run in virtual_dataset(currents=(0.25,), cycles=3)}
    assert set(runs) == {f"{1e3 * A:g}mm-{f:g}Hz-0.25A" for A, f in (*MOTIONS, (0.08, 1.0))}
    run = runs["20mm-2Hz-0.25A"]
    assert run.nominal == Condition(0.25, 2.0, 0.02)
    assert run.window == pytest.approx((0.5, 2.0))
    assert run.time[-1] == pytest.approx(2.0)
    assert run.time.size == pytest.approx(4 * 250, abs=1)
    # Every run draws noise of its own.
    true = {f"{1e3 * c.amplitude_m:g}": f for c, _, f in true_runs(VirtualRig(), (0.25,), 3) if c.frequency_Hz == 1}
    noise = [r.force - np.interp(r.time - 5e-4, r.time, true[a]) for r, a in
             ((runs["20mm-1Hz-0.25A"], "20"), (runs["50mm-1Hz-0.25A"], "50"))]  # fmt: skip
    assert abs(np.corrcoef(*noise)[0, 1]) < 0.15


def test_the_dry_friction_test_holds_neither_yield_nor_viscous_force():
    dry, filled = friction_test(VirtualRig()), friction_test(VirtualRig(), filled=True)
    assert np.ptp(filled.force) - np.ptp(dry.force) == pytest.approx(2 * VirtualRig().yield_off, abs=15)
    assert dry.id == "friction-0.01mm-s"
    assert dry.time[-1] == pytest.approx(1.25 * 0.08 / SLOW_SPEED)
    assert dry.nominal == Condition(0.0, SLOW_SPEED / 0.08, 0.020)
    assert np.array_equal(friction_test(VirtualRig(), seed=2).force, friction_test(VirtualRig(), seed=2).force)
    assert not np.array_equal(friction_test(VirtualRig(), seed=2).force, dry.force)
