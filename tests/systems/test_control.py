"""Laws of control: the inverse gives the force, nothing beats the preview, a wrong sign shows."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from support.dampers import ENVELOPE, joint_damper, modified_damper
from support.systems import quarter_car

from mrdamper.dampers.coil import Coil
from mrdamper.dampers.modified import ModifiedModel
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.dampers.streaming import stepper
from mrdamper.errors import InputError, ParameterError
from mrdamper.models import model_type
from mrdamper.statistics.functions.forms import ParameterFunction
from mrdamper.systems.controllers import controller_type, controller_types
from mrdamper.systems.controllers.base import Controller
from mrdamper.systems.controllers.passive import Passive
from mrdamper.systems.controllers.preview import NonCausalOptimum
from mrdamper.systems.inputs import load_input
from mrdamper.systems.inverse import check_monotone, invert
from mrdamper.systems.measures import cost
from mrdamper.systems.simulate import SystemLoop
from mrdamper.systems.system_file import load_system

CAR = quarter_car("car", 300, 40, 20e3, 200e3)
ROAD = load_input("iso8608-b", {"length_s": 3.0, "speed_m_s": 15.0})
LAWS = [name for name in controller_types() if name != "preview"]


@pytest.fixture(scope="module")
def preview():
    return SystemLoop(CAR, ROAD, {"damper": joint_damper()}, NonCausalOptimum()).run(1e-3)


@pytest.mark.parametrize(
    "name",
    [n if n in ("hybrid", "clipped-optimal") else pytest.param(n, marks=pytest.mark.slow) for n in LAWS],
)
def test_nothing_beats_the_preview(name, preview):
    done = SystemLoop(CAR, ROAD, {"damper": joint_damper()}, controller_type(name)()).run(1e-3, machine=False)
    assert cost(preview) < cost(done)
    assert done.energy_gap < 1e-6
    assert done.current.min() >= 0
    assert done.current.max() <= 1.0 + 1e-12
    assert ("damper" in done.unreachable) == (name in ("skyhook-continuous", "hybrid"))
    if name != "passive":
        assert np.ptp(done.current[:, 0]) > 0.3


def test_the_preview_is_where_its_cost_is_flat(preview):
    loop = SystemLoop(CAR, ROAD, {"damper": joint_damper()}, NonCausalOptimum())
    rng = np.random.default_rng(1)
    for _ in range(2):
        way = np.cumsum(rng.standard_normal((preview.time.size, 1)), axis=0)
        way[0] = 0

        @dataclass(frozen=True)
        class Nudged(NonCausalOptimum):
            share: float = 0.0

            def forces(self, *given):
                return NonCausalOptimum.forces(self, *given) + self.share * way  # noqa: B023

        loop.controller = Nudged(share=1.0)
        more = cost(loop.run(1e-3))
        loop.controller = Nudged(share=-1.0)
        less = cost(loop.run(1e-3))
        base = cost(preview)
        assert min(more, less) > base
        assert abs(more - less) < 1e-6 * (more + less - 2 * base)  # a parabola with its vertex here


def test_a_skyhook_with_its_sign_exchanged_lets_energy_into_the_body():
    @dataclass(frozen=True)
    class Wrong(controller_type("skyhook")):
        name: ClassVar[str] = "wrong"

        def law(self, see):
            return see.on_off(see("above", "velocity") * see.stroke_rate < 0)

    right, wrong = (
        SystemLoop(CAR, ROAD, {"damper": joint_damper()}, law()).run(1e-3, machine=False)
        for law in (controller_type("skyhook"), Wrong)
    )
    assert right.timing["damper"] > 0.2
    assert wrong.timing["damper"] < -0.2
    assert cost(wrong) > cost(right)


DAMPERS = {
    "joint": (joint_damper(), 0.01),
    "joint, coil": (replace(joint_damper(), coil=Coil(5e-3, 5e-3)), 0.04),
    "spencer, coil": (load_system("dyke1996").dampers["mr"], 0.04),
}


@pytest.mark.parametrize("case", DAMPERS)
def test_the_inverse_gives_the_force_that_is_wanted(case):
    damper, tolerance = DAMPERS[case]
    highest, dt = damper.envelope.current_A[1], 1e-3
    amplitude = 0.8 * damper.envelope.amplitude_m[1]
    omega = 2 * np.pi * min(2.0, damper.envelope.frequency_Hz[1])
    t = np.arange(0, 1.2, dt)
    x, v, a = (
        amplitude * np.sin(omega * t),
        amplitude * omega * np.cos(omega * t),
        -(omega**2) * amplitude * np.sin(omega * t),
    )
    known = highest * (0.5 + 0.35 * np.sin(2 * np.pi * 2.3 * t))
    steps = stepper(damper)
    wanted = np.array([steps.step_motion(*s, dt) for s in zip(x, v, a, known, strict=True)])
    current, force, lowest, most = invert(damper).along(t, x, v, a, wanted)
    steps.reset()
    given = np.array([steps.step_motion(*s, dt) for s in zip(x, v, a, current, strict=True)])
    assert given == pytest.approx(force, rel=1e-5, abs=1e-5 * np.abs(force).max())  # it knows what the damper does
    inside = (wanted >= lowest) & (wanted <= most) & (t > 0.2)
    assert inside.mean() > 0.6
    assert np.sqrt(np.mean((given - wanted)[inside] ** 2)) < tolerance * np.sqrt(np.mean(wanted[inside] ** 2))
    assert current.min() >= 0
    assert current.max() <= highest
    if damper.coil is None:  # no spike at a reversal: the current moves as the one that was there
        assert np.abs(np.diff(current[200:])).max() < 0.12 * highest


def linear_in_current(*fy, c=(800.0,), f0=(30.0,), coil=None):
    """A damper of 800 N s/m, an offset of 30 N, and friction by its current; of its square first, where three."""
    forms = ("constant", "linear-current", "quadratic-current")
    functions = {name: ParameterFunction(forms[len(values) - 1], values)
                 for name, values in (("c", c), ("fy", fy), ("f0", f0))}  # fmt: skip
    return ModifiedModel(ParameterMap(model_type("bingham"), functions), rig="bench", envelope=ENVELOPE, coil=coil)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_the_inverse_is_the_same_for_forces_of_any_size(size):
    """Of a friction that rises with the square of the current, beside which viscous force and offset are nothing."""
    made = linear_in_current(500.0 * size, 100.0 * size, 0.0, c=(0.0,), f0=(0.0,))
    plain = linear_in_current(500.0, 100.0, 0.0, c=(0.0,), f0=(0.0,))
    for wanted in (30.0, 150.0, 400.0):
        found, expected = (invert(m).step(0.001, 0.1, 0.0, s * wanted, 1e-3) for m, s in ((made, size), (plain, 1.0)))
        assert found.current == pytest.approx(expected.current, rel=1e-9)


def test_the_width_is_that_of_the_direction_in_which_the_force_changes_most():
    """An offset that rises with the current adds to the friction in extension, and takes from it in compression."""
    for rise in (200.0, -200.0):
        assert check_monotone(linear_in_current(600.0, 100.0, f0=(rise, 0.0))) == pytest.approx(800.0)


def test_a_coil_faster_than_the_samples_is_led_by_its_share_of_two_of_them():
    """Of 0.8 ms beside samples of 1 ms, from 0.4 A to 0.5 A: 0.1 A (1 + 0.8 / 2) over what it had."""
    inverse = invert(linear_in_current(600.0, 100.0, coil=Coil(0.8e-3, 0.8e-3)))
    asked = [30 + 80 + 100 + 600 * wanted for wanted in (0.4, 0.5)]
    for _ in range(40):
        before = inverse.step(0.001, 0.1, 0.0, asked[0], 1e-3).current
    after = inverse.step(0.001, 0.1, 0.0, asked[1], 1e-3).current
    assert before == pytest.approx(0.4, rel=1e-3)
    assert after - before == pytest.approx(0.1 * 1.4, rel=1e-3)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_the_inverse_of_a_force_linear_in_the_current_is_that_line(size):
    """Found at once, and taken but for a share of a ten thousandth: the current is kept where none is told."""
    made = linear_in_current(600.0, 100.0)
    assert (check_monotone(made), check_monotone(made, 0.5)) == pytest.approx((600.0, 300.0))
    inverse, last = invert(made), 0.0
    for way, wanted in ((1, 0.4), (1, 0.4), (-1, 0.7), (-1, 0.1), (1, 0.9)):
        v = way * 0.1 * size
        asked = 30 + way * (800 * abs(v) + 100 + 600 * wanted)
        found = inverse.step(0.001, v, 0.0, asked, 1e-3)
        last += (wanted - last) / (1 + 0.01**2)
        assert found.current == pytest.approx(last, rel=1e-9)
        assert found.force == pytest.approx(30 + way * (800 * abs(v) + 100 + 600 * last))
        ends = sorted(30 + way * (800 * abs(v) + 100 + more) for more in (0.0, 600.0))
        assert (found.lowest, found.highest) == pytest.approx(tuple(ends))
    assert inverse.step(0.0, 0.0, 0.0, 500.0, 1e-3).current == pytest.approx(last)  # at rest every current does


def test_a_slow_coil_starts_at_the_first_force_that_is_asked_for():
    inverse = invert(linear_in_current(600.0, 100.0, coil=Coil(5e-3, 20e-3)))
    steps = [inverse.step(0.001, 0.1, 0.0, 450.0, 1e-3) for _ in range(30)]
    assert [step.force for step in steps] == pytest.approx([450.0] * 30, rel=1e-3)


def test_the_inverse_drives_a_slow_coil_ahead_of_its_field():
    """From 0.4 to 0.2 A a field that falls by 20 ms is there after 20 ln 2 = 14 ms without current, and stays."""
    inverse = invert(linear_in_current(600.0, 100.0, coil=Coil(0.0, 20e-3)))
    steps = [inverse.step(0.001, 0.1, 0.0, 30 + 80 + 100 + 600 * (0.4 if k < 20 else 0.2), 1e-3) for k in range(45)]
    force, current = (np.array([getattr(step, name) for step in steps]) for name in ("force", "current"))
    assert force[:20] == pytest.approx(450.0, rel=1e-3)
    assert current[20:30] == pytest.approx(0.0)
    assert force[30] > 340
    assert force[38:] == pytest.approx(330.0, rel=5e-3)
    turned = invert(linear_in_current(600.0, 100.0, coil=Coil(20e-3, 0.0)))
    rising = [turned.step(0.001, 0.1, 0.0, 30 + 80 + 100 + 600 * (0.1 if k < 60 else 0.4), 1e-3) for k in range(85)]
    assert max(step.current for step in rising[60:66]) > 0.8  # ahead: 20 ln(9/6) = 8 ms instead of 60
    assert [step.force for step in rising[78:]] == pytest.approx([450.0] * 7, rel=5e-3)


@pytest.mark.parametrize(
    ("fy", "said"), [((-1000.0, 1600.0, 400.0), "above 0.8 A"), ((-1500.0, 1500.0, 400.0), "falls back")]
)
def test_a_force_that_falls_back_is_refused_with_its_current(fy, said):
    """The second comes back whole: at the highest current it is that of none."""
    with pytest.raises(ParameterError, match=said) as refused:
        check_monotone(linear_in_current(*fy))
    assert refused.value.code == "E_NOT_MONOTONE"


@pytest.mark.parametrize("highest", [-1.0, 0.0])
def test_a_highest_current_of_an_inverse_is_above_zero(highest):
    with pytest.raises(ParameterError, match="give a current above 0 A"):
        invert(linear_in_current(600.0, 100.0), highest=highest)


def test_an_inverse_beyond_the_tested_currents_is_flagged_as_a_prediction_there():
    damper = linear_in_current(600.0, 100.0)
    tested = damper.envelope.current_A[1]
    inside, beyond = invert(damper), invert(damper, highest=2 * tested)
    assert inside.extrapolation == ()
    assert beyond.extrapolation == damper.predict(replace(damper.envelope.middle, current_A=2 * tested)).extrapolation
    assert "outside the tested range in current" in repr(beyond)
    assert "outside" not in repr(inside)


def test_a_force_that_falls_back_at_high_velocities_only_is_refused_with_its_current():
    """Friction alone rises least at low currents; with a viscous part that falls, the force turns back at high ones."""
    with pytest.raises(ParameterError, match=r"above 0\.8 A"):
        check_monotone(linear_in_current(100.0, 300.0, 100.0, c=(-1100.0, 0.0, 3000.0)))


@pytest.mark.parametrize("way", [1, -1])
def test_a_force_that_dips_by_over_half_a_per_cent_in_either_direction_is_refused(way):
    """Of 1000 I² − a I at currents in steps of 0.2 A, in extension or in compression alone."""
    for a, dips in ((211.0, False), (227.0, True)):
        damper = linear_in_current(500.0, -a / 2, 400.0, f0=(way * 500.0, -way * a / 2, 30.0))
        if dips:
            with pytest.raises(ParameterError, match="above 0 A"):
                check_monotone(damper)
        else:
            assert check_monotone(damper) == pytest.approx(1000 - a + 0.2 * a - 40)


def test_the_reachable_interval_of_a_hysteretic_damper_is_that_of_the_sine():
    """500 N s/m per ampere at 0.3 m/s and 600 N of yield force, which has the sign of the velocity at mid-stroke."""
    assert check_monotone(modified_damper()) == pytest.approx(500 * 0.3 + 600, rel=1e-4)


@pytest.mark.parametrize("sample", [(np.nan, 0.1, 0.0, 300.0, 1e-3), (0.0, 0.1, 0.0, np.inf, 1e-3),
                                    (0.0, 0.1, 0.0, 300.0, 0.0), (0.0, 0.1, 0.0, 300.0, -1e-3)])  # fmt: skip
def test_samples_that_are_no_numbers_or_have_no_step_are_refused(sample):
    with pytest.raises(ParameterError, match="positive time step"):
        invert(linear_in_current(600.0, 100.0)).step(*sample)


@pytest.mark.parametrize("frequency_Hz", [0.8, 3.0])
def test_the_reachable_interval_is_that_at_the_highest_velocity_of_the_tests(frequency_Hz):
    """A viscous part of 500 N s/m per ampere: the tested frequency or the tested velocity is what limits it."""
    damper = linear_in_current(100.0, c=(500.0, 800.0))
    slow = replace(damper, envelope=replace(ENVELOPE, frequency_Hz=(0.5, frequency_Hz)))
    highest = min(2 * np.pi * frequency_Hz * ENVELOPE.amplitude_m[1], ENVELOPE.peak_velocity_m_s[1])
    assert check_monotone(slow) == pytest.approx(500.0 * ENVELOPE.current_A[1] * highest, rel=1e-4)


@pytest.mark.parametrize("damper", [joint_damper(), DAMPERS["spencer, coil"][0]], ids=["no number", "no program"])
def test_a_sample_without_an_answer_is_refused_and_forgotten(damper):
    inverse, other = invert(damper), invert(damper)
    for each in (inverse, other):
        each.step(0.001, 0.1, 0.0, 300.0, 1e-3)
    with pytest.raises(ParameterError, match="no force at"):
        inverse.step(1e300, 1e300, 1e300, 300.0, 1e-3)
    assert inverse.step(0.0011, 0.1, 0.0, 300.0, 1e-3) == other.step(0.0011, 0.1, 0.0, 300.0, 1e-3)


def test_out_of_reach_is_clipped_and_said():
    damper = joint_damper()
    inverse = invert(damper)
    for k in range(60):
        found = inverse.step(0.01 * np.sin(0.02 * k), 0.2 * np.cos(0.02 * k), 0.0, 1e6, 1e-3)
    assert found.force == pytest.approx(found.highest)
    assert found.current == pytest.approx(1.0, rel=1e-3)
    with pytest.raises(ParameterError):
        inverse.step(float("nan"), 0, 0, 0, 1e-3)


def test_a_damper_whose_force_does_not_rise_with_current_is_refused():
    falling = modified_damper()
    functions = {
        **falling.parameters.functions,
        "yield_force": ParameterFunction("quadratic-current-linear-speed", (-1500.0, 1500.0, 400.0, 0.0)),
    }
    turned = replace(falling, parameters=replace(falling.parameters, functions=functions))
    for damper in (turned, joint_damper("bouc-wen")):  # the second does not follow the current at all
        with pytest.raises(InputError) as refused:
            invert(damper)
        assert refused.value.code == "E_NOT_MONOTONE"


def test_every_law_says_where_it_comes_from():
    for name, kind in controller_types().items():
        assert issubclass(kind, Controller)
        assert kind.title
        assert kind.source or name == "passive"
        assert kind.__doc__
    assert Passive(0.3).current_A == 0.3


def test_a_demand_that_is_never_in_reach_is_counted():
    kind = controller_type("skyhook-continuous")
    done = SystemLoop(CAR, ROAD, {"damper": joint_damper()}, kind(c_sky=1e9)).run(1e-3, machine=False)
    assert done.unreachable["damper"] > 0.9
