"""Closed forms and consistent balance against the vectors, the Coulomb limit, and recovery."""

import json
from pathlib import Path

import numpy as np
import pytest

from mrdamper.data import Condition, Run
from mrdamper.errors import ExcitationError, IdentificationError
from mrdamper.identification import identify
from mrdamper.identification.harmonic_balance import (
    HarmonicProjection,
    SineRecord,
    damping_and_mass,
    double_counted,
    read_force,
    separate_mass,
)
from mrdamper.identification.methods.balance import Balance
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.physics.gas_spring import GasSpring
from mrdamper.physics.hysteresis import Shape, steady_loop
from mrdamper.physics.motion import sine

VECTORS = json.loads((Path(__file__).parents[1] / "vectors.json").read_text())
GAS = GasSpring(1.5e6, 1.5e-4, np.pi * 1e-4)
MOTIONS = [(0.02, 1.0), (0.02, 1.5), (0.02, 2.0), (0.05, 0.5), (0.05, 1.0), (0.05, 1.5), (0.08, 1.0)]


def synthetic(current: float) -> BoucWen:
    """The synthetic damper with which the bias of the recipe was measured; displacement positive in extension."""
    k1, k2, k3 = GAS.stiffnesses("extension")
    return BoucWen.build(
        {
            "c": 1200 + 300 * current - 60 * current**2,
            "yield_force": 300 + 1500 * current - 350 * current**2,
            "beta": 2e5,
            "f0": 120.0,
            "k1": k1,
            "k2": k2,
            "k3": k3,
            "m": 15.0,
        }
    )


def steady_run(model: BoucWen, amplitude: float, frequency: float, current: float = 0.0, samples: int = 1000) -> Run:
    """One exact steady cycle, a quarter cycle late so that the motion starts at a reversal."""
    motion = sine(Condition(current, frequency, amplitude), 1.25, samples)
    motion = motion.part(slice(samples // 4, -1))
    theta = 2 * np.pi * frequency * motion.time
    z = model.yield_displacement * steady_loop(model.shape, amplitude, theta)
    return Run("synthetic", motion.time, motion.displacement, model.force(motion, z), current)  # type: ignore[arg-type]


@pytest.mark.parametrize("case", VECTORS["V06_full_model_steady"]["cases"])
def test_the_closed_forms_are_those_of_the_vectors(case):
    model = BoucWen(**{k: case[k] for k in ("c", "m", "alpha", "beta", "gamma", "n", "f0", "k1", "k2", "k3")})
    record = SineRecord.of(steady_run(model, case["X"], case["f"]))
    omega = 2 * np.pi * case["f"]
    harmonic = read_force(record)
    # One cycle of 1000 samples: their FFT aliases harmonics that fall with k⁻³.
    assert harmonic.amplitude == pytest.approx(case["F0_harm"], rel=1e-7)
    assert harmonic.phase == pytest.approx(case["phi"], abs=1e-7)
    c, m = damping_and_mass(harmonic, case["X"], omega, case["k1"], case["k3"])
    assert (c, m) == pytest.approx((case["recipe_c_harm"], case["recipe_m_harm"]), rel=1e-6)
    half = read_force(record, "half-peak-to-peak")
    # The highest sample lies at most half a step off the peak.
    assert half.amplitude == pytest.approx(case["F0_pp"], rel=1e-5)
    assert half.offset == pytest.approx(case["recipe_f0"], abs=0.01)
    assert read_force(record, offset="mean").offset == pytest.approx(case["F_mean"], rel=1e-9)
    assert read_force(record, "maximum").amplitude == pytest.approx(case["F_max"], rel=1e-5)
    c, m = damping_and_mass(half, case["X"], omega, case["k1"], case["k3"])
    assert (c, m) == pytest.approx((case["recipe_c_pp"], case["recipe_m_pp"]), rel=1e-4)


@pytest.mark.parametrize("case", VECTORS["V06_full_model_steady"]["cases"])
def test_what_is_counted_twice_is_the_error_of_the_closed_forms(case):
    shape = Shape.from_bouc_wen(case["beta"], case["gamma"], case["n"])
    force = case["alpha"] * shape.yield_displacement
    c, m = double_counted(shape, force, case["X"], 2 * np.pi * case["f"])
    assert case["recipe_c_harm"] - case["c"] == pytest.approx(c, rel=1e-10)
    assert case["recipe_m_harm"] - case["m"] == pytest.approx(m, rel=1e-10)


@pytest.mark.parametrize("reading", ["harm", "pp"])
def test_in_the_coulomb_limit_the_recipe_has_the_bias_of_the_vector(reading):
    bias, X, omega, f_c = VECTORS["V08_coulomb_bias"], 0.05, 2 * np.pi, 1000.0
    theta = (np.arange(40_000) + 0.5) * 2 * np.pi / 40_000
    coulomb = f_c * np.sign(np.cos(theta))
    record = SineRecord("coulomb", Condition(0.0, 1.0, X), theta, coulomb)
    found = read_force(record, {"harm": "first-harmonic", "pp": "half-peak-to-peak"}[reading])
    c, m = damping_and_mass(found, X, omega, 0.0, 0.0)
    # A sampled step is known to a sample, 1/40000 of a cycle.
    assert c * X * omega / f_c == pytest.approx(bias["c_bias_over_fc_per_Xw"][reading], abs=1e-4)
    assert m == pytest.approx(0, abs=1e-2)
    left = coulomb - c * X * omega * np.cos(theta)
    ratio = np.mean(left * coulomb) / f_c**2
    assert ratio == pytest.approx(bias["alpha_ratio"][reading], abs=1e-4)
    assert np.sqrt(np.mean((left - ratio * coulomb) ** 2)) / f_c == pytest.approx(
        bias["rms_over_fc"][reading], abs=1e-4
    )


@pytest.mark.parametrize(("amplitude", "frequency"), MOTIONS)
@pytest.mark.parametrize("current", [0.0, 1.0, 2.0])
def test_the_consistent_balance_recovers_the_damper(amplitude, frequency, current):
    true = synthetic(current)
    found = identify(steady_run(true, amplitude, frequency, current), "bouc-wen", "balance", gas=GAS).model
    for name in ("c", "m", "yield_force", "beta"):
        assert getattr(found, name) == pytest.approx(getattr(true, name), rel=1e-6), name


def test_three_harmonics_suffice_and_free_shapes_are_recovered_too():
    plain = synthetic(1.0)
    found = identify(steady_run(plain, 0.05, 1.0), "bouc-wen", Balance(3), gas=GAS).model
    assert found.c == pytest.approx(plain.c, rel=1e-6)
    bent = BoucWen.build({**plain.values(), "gamma": 5e4, "n": 1.5})
    found = identify(steady_run(bent, 0.05, 1.0), "bouc-wen", "balance", gas=GAS, free=("gamma", "n")).model
    for name in ("c", "yield_force", "beta", "gamma", "n"):
        assert getattr(found, name) == pytest.approx(getattr(bent, name), rel=1e-4), name


def test_a_broken_last_cycle_does_not_disturb_the_balance():
    true, condition = synthetic(1.0), Condition(1.0, 1.0, 0.05)
    motion = sine(condition, 2.37, 1000)
    z = true.yield_displacement * steady_loop(true.shape, 0.05, 2 * np.pi * motion.time)
    run = Run("broken", motion.time, motion.displacement, true.force(motion, z), 1.0)  # type: ignore[arg-type]
    found = identify(run, "bouc-wen", "balance", gas=GAS).model
    assert found.c == pytest.approx(true.c, rel=1e-6)
    assert found.m == pytest.approx(15, rel=1e-5)


def test_the_projection_keeps_size_and_takes_drift_out():
    theta = np.linspace(0, 4 * np.pi, 400, endpoint=False)
    project = HarmonicProjection(theta, 3)
    wave = 2 + np.sin(theta) - 0.3 * np.cos(3 * theta)
    assert project.harmonics == 3
    # The drift itself is not orthogonal to the sines; what remains of the wave is a little less.
    assert np.sum(project(wave) ** 2) <= np.sum(wave**2) * (1 + 1e-12)
    assert project(theta - theta.mean()) == pytest.approx(np.zeros(7), abs=1e-9)


@pytest.mark.parametrize("begin", [0.0, 1.0, 2.5, 4.0, 5.5])
def test_a_record_is_read_as_a_sine_from_any_phase_on(begin):
    X, f, I = 0.02, 1.6, 0.7
    time = np.arange(0, 2.2, 2e-3)
    angle = 2 * np.pi * f * time + begin
    force = 900 * np.sin(angle + 0.6) + 40
    record = SineRecord.of(Run("sine", time, X * np.sin(angle), force, I))  # type: ignore[arg-type]
    assert np.sin(record.theta) == pytest.approx(np.sin(angle), abs=1e-6)
    assert 0 <= record.theta[0] < 2 * np.pi + 1e-9
    assert (record.condition.current_A, record.condition.frequency_Hz) == (I, pytest.approx(f))
    motion = record.motion
    assert motion.displacement == pytest.approx(X * np.sin(angle), abs=1e-8)
    assert motion.velocity == pytest.approx(2 * np.pi * f * X * np.cos(angle), abs=1e-6)
    assert motion.acceleration == pytest.approx(-((2 * np.pi * f) ** 2) * motion.displacement, abs=1e-6)
    assert motion.current.tolist() == [I] * time.size
    assert np.diff(motion.time) == pytest.approx(np.diff(time))
    for phase in ("harmonic", "peaks"):
        # Peaks are known to a sample, 1/312 of a cycle.
        assert read_force(record, phase=phase).phase == pytest.approx(0.6, abs=0.021 if phase == "peaks" else 1e-6)
    behind = SineRecord("late", record.condition, record.theta, -record.force)
    assert read_force(behind).phase == pytest.approx(0.6 - np.pi)
    assert read_force(behind, phase="peaks").phase == pytest.approx(0.6 - np.pi, abs=0.021)


@pytest.mark.parametrize("cycles", [3.0, 3.4])
def test_extremes_are_medians_over_whole_cycles(cycles):
    per = 100
    theta = 1.0 + 2 * np.pi * np.arange(int(cycles * per)) / per
    number = np.arange(theta.size) // per
    sizes, leads = np.array([1.0, 5.0, 1.5, 9.0])[number], np.array([0.2, 0.5, 1.2, 0.1])[number]
    record = SineRecord("drifting", Condition(0.0, 1.0, 0.02), theta, sizes * np.sin(theta + leads) + 0.1 * number)
    tops, bottoms = [], []
    for k in range(3):
        part = [i for i in range(theta.size) if number[i] == k]
        for best, found in ((max, tops), (min, bottoms)):
            found.append(best(part, key=lambda i: record.force[i]))
    top, bottom = (sorted(record.force[at])[1] for at in (tops, bottoms))
    found = read_force(record, "half-peak-to-peak", "peaks")
    assert (found.amplitude, found.offset) == (pytest.approx((top - bottom) / 2), pytest.approx((top + bottom) / 2))
    assert read_force(record, "maximum").amplitude == pytest.approx(top)
    places = [np.angle(sum(np.exp(1j * theta[i]) for i in at)) for at in (tops, bottoms)]
    middle = np.angle(np.exp(1j * places[0]) + np.exp(1j * (places[1] - np.pi)))
    assert np.exp(1j * found.phase) == pytest.approx(np.exp(1j * (np.pi / 2 - middle)))


def test_a_projection_keeps_every_wave_but_what_a_drift_takes():
    theta = np.linspace(0.3, 0.3 + 4.6 * np.pi, 400)
    project = HarmonicProjection(theta, 4)
    drift = (theta - theta.mean()) / np.linalg.norm(theta - theta.mean())
    for wave in (np.ones(400), np.sin(theta), np.cos(3 * theta), np.sin(4 * theta), np.cos(theta) - np.sin(2 * theta)):
        assert np.sum(project(wave) ** 2) == pytest.approx(np.sum(wave**2) - (drift @ wave) ** 2)
    gap = np.concatenate([np.arange(0, 6, 0.1), 60 + np.arange(0, 6, 0.1)])
    assert HarmonicProjection(gap, 50).harmonics == 31  # π over the middle step
    assert HarmonicProjection(np.arange(0, 40, 2.0), 50).harmonics == 1


def test_two_frequencies_a_thirtieth_apart_are_two():
    near, apart = ([Condition(0.0, f, 0.02) for f in (1.0, other)] for other in (1.0305, 1.1))
    with pytest.raises(IdentificationError, match="2 runs at one frequency"):
        separate_mass(near, [1.0, 2.0])
    found = separate_mass(apart, [1e3 - 15 * (2 * np.pi * c.frequency_Hz) ** 2 for c in apart])
    assert found == pytest.approx((1e3, 15.0))


def test_mass_is_told_from_stiffness_by_two_frequencies():
    conditions = [Condition(0.0, f, X) for f, X in ((0.5, 0.05), (1.0, 0.05), (2.0, 0.02))]
    in_phase = [1400 - 15 * (2 * np.pi * c.frequency_Hz) ** 2 for c in conditions]
    assert separate_mass(conditions, in_phase) == pytest.approx((1400, 15), rel=1e-9)
    with pytest.raises(IdentificationError, match=r"2 runs at one frequency.*give the gas spring"):
        separate_mass([Condition(0.0, 1.0, 0.02), Condition(0.0, 1.01, 0.05)], in_phase[:2])


def test_what_harmonic_balance_cannot_use_is_refused():
    time = np.arange(0, 4, 1e-3)
    saw = 0.02 * (2 * np.abs((time % 1) - 0.5) - 0.5)
    fast_back = np.where(time % 1 < 0.9, time % 1 / 0.9, (1 - time % 1) / 0.1) * 0.02
    force = 1e3 * np.sign(np.gradient(saw))
    with pytest.raises(ExcitationError, match=r"the motion is no sine.*method projection"):
        SineRecord.of(Run("saw", time, fast_back, force, 0.0))  # type: ignore[arg-type]
    two = 0.02 * np.sin(2 * np.pi * time) + 0.01 * np.sin(2 * np.pi * 1.618 * time)
    with pytest.raises(ExcitationError, match=r"at other frequencies [34]\d %"):
        SineRecord.of(Run("two tones", time, two, force, 0.0))  # type: ignore[arg-type]
    part = Run("part", time[:600], 0.02 * np.sin(2 * np.pi * time[:600]), force[:600], 0.0)  # type: ignore[arg-type]
    with pytest.raises(ExcitationError, match=r"0\.60 cycles.*at least one full cycle"):
        SineRecord.of(part)
    with pytest.raises(IdentificationError, match="use 3 or more"):
        Balance(1)
