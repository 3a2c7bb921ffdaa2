"""Measures of a simulation: what a sine has, what a series has, units and ratios of a run to itself."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter, welch
from support.systems import quarter_car

from mrdamper.dampers.envelope import UNTESTED
from mrdamper.dampers.joint import JointDamper
from mrdamper.models.bingham import Bingham
from mrdamper.report.plots.simulation import power_spectral_density
from mrdamper.systems.controllers.passive import Passive
from mrdamper.systems.inputs import load_input
from mrdamper.systems.inputs.record import record
from mrdamper.systems.measures import benchmark_ratios, comfort, cost, measures, tyre_load
from mrdamper.systems.simulate import SystemLoop
from mrdamper.systems.structure import Link, shear_building
from mrdamper.systems.weighting import WEIGHTINGS, frequency_weighted

STEP = 0.005


def rms(series):
    return np.sqrt(np.mean(np.square(series), axis=0))


@pytest.fixture(scope="module")
def ride():
    car = quarter_car("car", 300, 40, 20e3, 200e3)
    car = replace(car, links=tuple(replace(k, damping=150.0) if k.role == "tyre" else k for k in car.links))
    road = load_input("sweep", {"amplitude_m": 0.08, "lowest_Hz": 3, "highest_Hz": 3, "length_s": 2})
    damper = JointDamper(Bingham(c=1500.0, fy=50.0), ("c",), rig="bench", envelope=UNTESTED)
    return SystemLoop(car, road, {"damper": damper}, Passive(0.3)).run(STEP, machine=False)


@pytest.fixture(scope="module")
def shaken():
    link = Link("d", "floor1", "ground")
    frame = shear_building("frame", [100.0, 80.0], [4e5, 3e5], [50.0, 40.0], [link])
    time = np.arange(0, 2, 0.01)
    base = record(time, 2 * np.sin(6 * np.pi * time) * (time < 1), "acceleration_m_s2")
    damper = JointDamper(Bingham(c=8e3, fy=0.0), ("c",), rig="bench", envelope=UNTESTED)
    return [SystemLoop(frame, base, given, Passive()).run(STEP, machine=False) for given in ({"d": damper}, {})]


@pytest.mark.parametrize(("weighting", "frequency"), [("Wk", 6.0), ("Wd", 1.0), ("Wf", 0.2)])
def test_comfort_of_a_sine_is_its_weighted_amplitude(weighting, frequency):
    time = np.arange(0, 80.0, STEP)
    grown = np.where(time < 30, np.sin(np.pi * time / 60) ** 2, 1.0)  # slowly: the filter starts at rest
    found = comfort(3.0 * grown * np.sin(2 * np.pi * frequency * time), STEP, weighting)
    amplitude = 3.0 * abs(WEIGHTINGS[weighting].response(frequency))
    assert found["a_w_m_s2"] == pytest.approx(amplitude * np.sqrt(np.mean(grown**2) / 2), rel=0.02)
    assert found["crest"] * found["a_w_m_s2"] == pytest.approx(amplitude, rel=0.02)
    assert found["vdv_m_s1.75"] == pytest.approx(amplitude * (3 / 8 * np.sum(grown**4) * STEP) ** 0.25, rel=0.02)
    # The square of a sine swings by all of itself, and by less behind a running mean over a second.
    swing = 1 / np.hypot(1.0, 4 * np.pi * frequency)
    assert found["mtvv_m_s2"] == pytest.approx(amplitude * np.sqrt((1 + swing) / 2), rel=0.02)


def test_comfort_scales_with_the_acceleration_and_rest_has_none():
    rng = np.random.default_rng(0)
    series = rng.standard_normal(800)
    once, twice = comfort(0.01 * series, STEP), comfort(-0.02 * series, STEP)
    assert twice == pytest.approx({name: value * (1 if name == "crest" else 2) for name, value in once.items()})
    assert set(comfort(np.zeros(50), STEP).values()) == {0.0}
    # The largest second is that after a shock, wherever it comes; the crest is its peak over the whole.
    shock = np.zeros(4000)
    shock[2000:2020] = 5.0
    assert comfort(shock, STEP)["mtvv_m_s2"] > 2 * comfort(shock, STEP)["a_w_m_s2"]


def test_running_mean_and_spectrum_are_those_of_scipy():
    series = np.cumsum(np.random.default_rng(1).standard_normal(3001))
    keep = np.exp(-STEP)
    running = lfilter([1 - keep], [1, -keep], frequency_weighted(series, STEP, "Wk") ** 2)
    assert comfort(series, STEP)["mtvv_m_s2"] == pytest.approx(np.sqrt(running.max()), rel=1e-12)
    for size in (3001, 500, 501):
        frequency, density = power_spectral_density(series, STEP, size)
        expected = welch(series, 1 / STEP, nperseg=size)
        assert np.allclose(frequency, expected[0], rtol=1e-12)
        assert np.allclose(density[1:-1], expected[1][1:-1], rtol=1e-9)


def test_every_measure_is_that_of_its_series(ride):
    found = measures(ride)
    body, wheel = ride.a.T
    for name, series in (("body", body), ("wheel", wheel)):
        assert found[f"{name}.peak_acceleration_m_s2"] == max(series.max(), -series.min())
        assert found[f"{name}.rms_acceleration_m_s2"] == pytest.approx(rms(series))
    travel = ride.x[:, 0] - ride.x[:, 1]
    assert found["travel.peak_span_m"] == pytest.approx(np.abs(travel).max())
    assert found["travel.rms_span_m"] == pytest.approx(rms(travel))
    force = ride.force[:, 0]
    assert found["damper.peak_force_N"] == max(force.max(), -force.min())
    assert found["damper.rms_force_N"] == pytest.approx(rms(force))
    assert found["damper.energy_J"] == pytest.approx(np.trapezoid(force * ride.stroke_rate[:, 0], ride.time), rel=0.02)
    assert found["damper.energy_J"] == ride.energy["damper"][-1]
    assert found["damper.mean_current_A"] == pytest.approx(0.3)
    assert {n: found[f"body.{n}"] for n in comfort(body, STEP)} == comfort(body, STEP)
    twice = replace(ride, x=2 * ride.x, a=2 * ride.a, road=2 * ride.road)
    assert measures(twice)["cost_m_s2"] == pytest.approx(2 * found["cost_m_s2"])
    assert cost(ride) == pytest.approx(found["cost_m_s2"] ** 2)
    turned = measures(replace(ride, a=-ride.a, force=-ride.force))
    for name in ("body.peak_acceleration_m_s2", "damper.peak_force_N"):
        assert turned[name] == found[name]


def test_a_tyre_carries_the_weight_and_what_it_is_pressed_by(ride):
    found, tyre = measures(ride), ride.links[1]
    weight = 9.81 * (300 + 40)
    assert tyre.stiffness * tyre.gap == pytest.approx(weight, rel=1e-3)
    pressed = weight - tyre.stiffness * (ride.x[:, 1] - ride.road[:, 0]) - 150 * (ride.v[:, 1] - ride.road_rate[:, 0])
    load = tyre_load(ride, 1)
    assert load == pytest.approx(np.maximum(pressed, 0.0), abs=1e-3 * weight)
    assert (load.min(), load.max() > weight) == (0.0, True)  # it leaves the road
    assert found["tyre.lowest_load_share"] == 0.0
    assert found["tyre.rms_load_share"] == pytest.approx(rms(load / weight - 1), rel=1e-3)
    still = replace(ride, x=0.1 * ride.x, road=0.1 * ride.road, v=0 * ride.v, road_rate=0 * ride.road_rate)
    lowest = 1 - 0.1 * tyre.stiffness * ride.stroke[:, 1].max() / weight
    assert measures(still)["tyre.lowest_load_share"] == pytest.approx(lowest, rel=1e-3)


def test_ratios_of_a_structure_are_of_peaks_and_root_mean_squares(shaken):
    done, bare = shaken
    itself = benchmark_ratios(bare, bare)
    assert itself == {f"J{i}": 1.0 for i in range(1, 7)}
    found = benchmark_ratios(done, bare)
    drifts = [np.column_stack([run.x[:, 0], run.x[:, 1] - run.x[:, 0]]) for run in shaken]
    base = [run.a @ [100.0, 80.0] for run in shaken]
    for i, (ours, theirs) in enumerate((drifts, [run.a for run in shaken], base), start=1):
        assert found[f"J{i}"] == pytest.approx(np.abs(ours).max() / np.abs(theirs).max())
        assert found[f"J{i + 3}"] == pytest.approx(rms(ours).max() / rms(theirs).max())
    (damper,) = (i for i, link in enumerate(done.links) if link.role == "damper")
    assert found["J7"] == pytest.approx(np.abs(done.force[:, damper]).max() / (180 * 9.81))
    assert found["J8"] == pytest.approx(np.abs(done.x[:, 0]).max() / np.abs(drifts[1]).max())
    turned = benchmark_ratios(replace(done, x=-done.x, a=-done.a, force=-done.force), bare)
    assert turned == pytest.approx(found)
    assert "floor1.a_w_m_s2" not in measures(done)  # nobody sits on the ground's building
