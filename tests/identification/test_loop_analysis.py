"""Figures of a loop against those worked out by hand: viscous, Coulomb, spring, offset."""

import numpy as np
import pytest

from mrdamper.data import Condition, Run
from mrdamper.identification.loop_analysis import analyse_loop, dynamic_ranges
from mrdamper.motion import sine


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
