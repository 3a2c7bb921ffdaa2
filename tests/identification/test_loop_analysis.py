"""Figures of a loop against those worked out by hand: viscous, Coulomb, spring, offset."""

from dataclasses import replace

import numpy as np
import pytest

from mrdamper.data import Condition, Run
from mrdamper.identification.characteristics import characterise
from mrdamper.identification.loop_analysis import analyse_loop, at_levels, damping_share, dynamic_ranges, whole_cycles
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.physics.motion import sine
from mrdamper.physics.simulation import simulate
from mrdamper.study.validation import measured_peak


def run_of(force, condition, name="one"):
    motion = sine(condition, 4, 1000)
    return Run(
        name, motion.time, motion.displacement, force(motion), condition.current_A,
        window=(1 / condition.frequency_Hz, float(motion.time[-1])), split="train",
    )  # fmt: skip


@pytest.mark.parametrize("condition", [Condition(0.5, 2.0, 0.01), Condition(0.0, 0.5, 0.03)], ids=str)
def test_a_dashpot_with_spring_and_offset(condition):
    c, k, f0 = 1500.0, 2000.0, 70.0
    loop = analyse_loop(run_of(lambda m: c * m.velocity + k * m.displacement + f0, condition))
    omega, X = 2 * np.pi * condition.frequency_Hz, condition.amplitude_m
    assert loop.dissipated_energy == pytest.approx(np.pi * c * omega * X**2, rel=1e-3)
    assert loop.equivalent_damping == pytest.approx(c, rel=1e-3)
    assert loop.peak_force == pytest.approx(X * np.hypot(c * omega, k), rel=1e-3)
    assert loop.mean_force == pytest.approx(f0, abs=0.1)
    assert (loop.run_id, loop.split) == ("one", "train")
    assert loop.condition.current_A == condition.current_A


@pytest.mark.parametrize(("noise", "bias"), [(0.0, 1e-3), (4e-3, 3e-3), (0.03, 0.01)])
@pytest.mark.parametrize(
    "shape", [{"c": 200.0, "k1": 2e5, "n": 8.0}, {"c": 2000.0, "k1": 3e4, "n": 1.5}, {"c": 2e4, "k1": 0.0, "n": 2.0}],
    ids=["sharp at the reversals", "round", "viscous"],
)  # fmt: skip
def test_noise_does_not_raise_the_peak_force_and_sharp_peaks_remain(shape, noise, bias):
    fixed = {"k2": 0.0, "k3": 0.0, "m": 0.0, "f0": 50.0, "asymmetry": -0.3}
    model = BoucWen.build(fixed | shape | {"yield_force": 800.0, "yield_displacement": 5e-4})
    force = simulate(model, sine(Condition(0.5, 2.0, 0.01), 4, 1000)).force
    half = np.ptp(force[1000:]) / 2
    forces = []
    for seed in range(20 if noise else 1):
        noisy = force + np.random.default_rng(seed).normal(0.0, noise * half, force.size)
        run = run_of(lambda m, noisy=noisy: noisy, Condition(0.5, 2.0, 0.01))
        (stroke,) = characterise([run]).strokes
        forces.append((analyse_loop(run).peak_force, measured_peak(run), *np.abs(np.subtract(stroke.peak_force, 50.0))))
    study, interval, rebound, compression = np.mean(forces, axis=0)
    assert [study, interval, (rebound + compression) / 2] == pytest.approx(3 * [half], rel=bias)
    assert rebound == pytest.approx(np.max(force[1000:]) - 50.0, rel=2 * bias)


def test_the_damping_share_is_that_of_the_dashpot_beside_spring_offset_and_drift():
    motion = sine(Condition(0.5, 2.0, 0.01), 4, 1000)

    def share(c, unit=1.0):
        force = c * motion.velocity + 2e4 * motion.displacement + 70.0 + 9.0 * motion.time
        return damping_share(motion, unit * force), c * np.std(motion.velocity) / np.std(force)

    for c in (1500.0, -400.0, 20.0):
        found, expected = share(c)
        assert found == pytest.approx(expected, rel=1e-6)
        assert share(c, 1e-3)[0] == pytest.approx(found)
    assert damping_share(motion, -80.0 * motion.velocity) == pytest.approx(-1.0)


def test_dry_friction_dissipates_four_amplitudes_of_it():
    condition = Condition(0.5, 1.0, 0.02)
    loop = analyse_loop(run_of(lambda m: 300.0 * np.sign(m.velocity), condition))
    assert loop.dissipated_energy == pytest.approx(4 * 300 * 0.02, rel=5e-3)
    assert loop.equivalent_damping == pytest.approx(4 * 300 / (np.pi * 2 * np.pi * 0.02), rel=5e-3)


def test_the_dynamic_range_counts_from_the_lowest_current_of_the_same_motion():
    forces = {(0.0, 0.02): 100.0, (1.0, 0.02): 350.0, (0.5, 0.02): 200.0, (1.0, 0.005): 900.0}
    runs = [
        run_of(lambda m, size=size: size * np.sign(m.velocity), Condition(I, 1.0, X), f"{I}{X}")
        for (I, X), size in forces.items()
    ]
    (found,) = dynamic_ranges([analyse_loop(run) for run in runs])
    assert found.currents_A == (0.0, 0.5, 1.0)
    assert found.ratios == pytest.approx((1.0, 2.0, 3.5))
    assert (found.frequency_Hz, found.amplitude_m) == pytest.approx((1.0, 0.02), rel=1e-3)


def test_the_peak_force_is_the_median_over_cycles():
    condition = Condition(0.5, 1.0, 0.02)
    grown = run_of(lambda m: 100.0 * m.displacement / 0.02 * (1 + 9 * ((m.time > 1) & (m.time < 2))), condition)
    assert analyse_loop(grown).peak_force == pytest.approx(100.0, rel=0.01)


def test_whole_cycles_are_counted_from_the_first_sample_and_what_is_left_is_not_used():
    time = 3.0 + np.arange(0, 3501) / 1000
    assert whole_cycles(time, 1.0) == slice(0, 3001)
    assert whole_cycles(time[:1851], 1.0) == slice(0, 1001)
    assert whole_cycles(time[:1991], 1.0) == slice(0, 1991)  # a sample short of two cycles is two cycles
    assert whole_cycles(time[:1301], 2.0) == slice(0, 1001)


def test_part_of_a_cycle_at_the_end_changes_no_figure():
    condition = Condition(0.5, 1.0, 0.02)
    whole = run_of(lambda m: 5e3 * m.displacement + 70.0, condition)
    loop = analyse_loop(replace(whole, window=(1.0, 2.6)))
    assert loop.mean_force == pytest.approx(70.0, abs=0.5)
    assert loop.peak_force == pytest.approx(100.0, rel=0.01)


def test_loops_take_the_level_of_their_current_and_keep_the_rest():
    loops = [
        analyse_loop(run_of(lambda m: 9.0 * m.velocity, Condition(I, f, 0.02), f"{I}"))
        for I, f in ((0.99, 1.0), (1.01, 2.0), (0.0, 1.0))
    ]
    levelled = at_levels(loops)
    assert [loop.run_id for loop in levelled] == ["0.99", "1.01", "0.0"]
    currents = [loop.condition.current_A for loop in levelled]
    assert currents[0] == currents[1] == pytest.approx(1.0, abs=0.011)
    assert currents[2] == 0.0
    assert [loop.condition.frequency_Hz for loop in levelled] == [loop.condition.frequency_Hz for loop in loops]


def test_two_currents_make_a_dynamic_range_named_by_the_lowest():
    runs = [
        run_of(lambda m, size=size: size * np.sign(m.velocity), Condition(I, f, X), f"{I}")
        for I, f, X, size in ((2.0, 1.0, 0.0201, 300.0), (0.0, 1.002, 0.02, 100.0))
    ]
    (found,) = dynamic_ranges([analyse_loop(run) for run in runs])
    assert found.currents_A == (0.0, 2.0)
    assert (found.amplitude_m, found.frequency_Hz) == pytest.approx((0.02, 1.002), rel=1e-4)
