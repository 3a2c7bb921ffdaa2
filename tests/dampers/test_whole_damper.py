"""Models of a whole damper with optional terms, on records of known laws over the current."""

from dataclasses import replace

import numpy as np
import pytest

from mrdamper.dampers.choice import identify_jointly
from mrdamper.dampers.fold_fits import FoldFits
from mrdamper.data import Condition, Run
from mrdamper.models.play_bypass import PlayBypass
from mrdamper.physics.motion import sine
from mrdamper.physics.simulation import simulate, steady_loop

MOTIONS = ((0.5, 0.025), (1.0, 0.025), (2.0, 0.010))


def tangent(current, x, v):
    return 80 + 800 * x + (600 + 500 * current) * v + (60 + 900 * current) * np.tanh(25 * (v + 1.2 * x))


def arctangent(current, x, v):
    slid = v + 0.8 * x
    yielded = np.arctan(80 * slid) * 2 / np.pi
    return 60 + 600 * x + (700 + 300 * current) * slid + (70 + 600 * current) * yielded


def saturating(current, x, v):
    """Stronger in extension by a quarter, with a yield force that saturates exponentially."""
    strength = 80 + 1100 * (1 - np.exp(-1.5 * current))
    return 50 + 300 * x + np.where(v > 0, 1.0, 0.8) * ((400 + 250 * current) * v + strength * np.tanh(v / 0.02))


def thinning(current, x, v):
    viscous = np.sign(v) * (1200 + 800 * current) * np.abs(v) ** 0.6
    return 100 + 900 * x + viscous + (60 + 700 * (1 - np.exp(-1.2 * current))) * np.tanh(v / 0.008)


def motion(frequency, amplitude):
    t = np.arange(int(5 * 500 / frequency)) / 500
    phase = 2 * np.pi * frequency * t
    return t, amplitude * np.sin(phase), 2 * np.pi * frequency * amplitude * np.cos(phase)


def rig(law, currents=(0.0, 0.5, 1.0, 1.5)):
    noise = np.random.default_rng(5)
    runs = []
    for current in currents:
        for frequency, amplitude in MOTIONS:
            t, x, v = motion(frequency, amplitude)
            force = law(current, x, v) + noise.normal(0, 4, t.size)
            runs.append(Run(id=f"{current}-{frequency}", time=t, displacement=x, force=force, current=current))
    return runs


@pytest.mark.parametrize("law", [tangent, arctangent, saturating, thinning])
def test_untested_corners_and_currents_are_predicted(law):
    """At twice the tested velocity, and between and beyond the tested currents, within 3 % of the peak."""
    damper = identify_jointly(rig(law), "tanh").fit.damper
    for current, frequency, amplitude in ((0.0, 2.0, 0.025), (1.5, 2.0, 0.025), (0.75, 1.5, 0.02), (1.7, 1.0, 0.02)):
        _, x, v = motion(frequency, amplitude)
        truth = np.ptp(law(current, x, v))
        found = np.ptp(damper.predict(Condition(current, frequency, amplitude)).force)
        assert found == pytest.approx(truth, rel=0.03), (current, frequency, amplitude)


@pytest.mark.parametrize("gain", [1.0, 1.1])
def test_its_parameters_are_found_and_absent_terms_are_removed(gain):
    """Also where the force of one run is too large: the sum of the run errors counts, not of their squares."""
    runs = rig(tangent)
    runs[3] = replace(runs[3], force=gain * runs[3].force)
    choice = identify_jointly(runs, "tanh")
    values = choice.fit.damper.model.values()
    known = {"c0": 600, "c1": 500, "fy0": 60, "fy1": 900, "vy": 0.04, "shift": 1.2, "k0": 800, "f0": 80}
    assert {name: values[name] for name in known} == pytest.approx(known, rel=0.03)
    assert not {"tail", "si", "asymmetry"} & set(choice.problem.free)
    assert "arctangent" not in choice.fit.damper.provenance["terms"]


def test_terms_that_the_runs_show_are_kept_and_named():
    choice = identify_jointly(rig(saturating), "tanh")
    assert {"si", "asymmetry"} <= set(choice.problem.free)
    assert "surplus of the yield force in extension" in choice.fit.damper.provenance["terms"]
    assert choice.left_out["condition"] < 0.02


def test_effects_of_the_current_need_its_levels():
    """One level determines no rise with current, two determine no saturation."""
    one = identify_jointly(rig(tangent, (1.0,)), "tanh")
    assert not {"c1", "k1", "fy1", "si"} & set(one.problem.free)
    two = identify_jointly(rig(saturating, (0.0, 1.0)), "tanh")
    assert {"c1", "fy1"} <= set(two.problem.free)
    assert "si" not in two.problem.free
    assert "si" in identify_jointly(rig(saturating, (0.0, 0.5, 1.5)), "tanh").problem.free


def test_runs_of_two_levels_of_three_are_fitted_without_saturation():
    choice = identify_jointly(rig(saturating, (0.0, 0.5, 1.5)), "tanh")
    without = FoldFits(choice.problem, [[0, 1, 2], [3, 4, 5], [6, 7, 8]]).refit(range(6))
    assert choice.fit.damper.model.si > 0.1
    assert without.damper.model.si == 0.0


def test_three_levels_determine_the_saturation_of_play_and_bypass():
    """And the force at 1.2 times the highest tested current is predicted."""
    truth = PlayBypass(
        f0=50.0, k=900.0, c0=700.0, c1=500.0, fy0=100.0, fy1=1600.0, d=2e-4, e=2.5e-5, cb=3.5e4, h0=0.4, h1=0.2,
        vh=3e-3, T=5e-3, Ic=1e-4, si=0.9,
    )  # fmt: skip
    noise, runs = np.random.default_rng(7), []
    for current in (0.0, 0.75, 1.5):
        for frequency, amplitude in MOTIONS:
            motion = sine(Condition(current, frequency, amplitude), 4, 300)
            force = simulate(truth, motion).force + noise.normal(0, 4, len(motion))
            name, window = f"{current}-{frequency}", (1 / frequency, 4 / frequency)
            runs.append(Run(name, motion.time, motion.displacement, force, motion.current, window=window))
    choice = identify_jointly(runs)
    beyond = Condition(1.8, 1.0, 0.025)
    assert choice.fit.damper.model.si == pytest.approx(0.9, rel=0.15)
    found, known = (np.ptp(loop.force) for loop in (choice.fit.damper.predict(beyond), steady_loop(truth, beyond)))
    assert found == pytest.approx(known, rel=0.02)
