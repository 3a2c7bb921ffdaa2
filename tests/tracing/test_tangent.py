"""Tangents of traced programs: what a small change of a parameter does, memory included."""

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from mrdamper.dampers.concatenated_runs import JointResiduals
from mrdamper.dampers.joint import JointProblem
from mrdamper.data import Condition
from mrdamper.models import recorded
from mrdamper.models.lugre import LuGre
from mrdamper.models.play_bypass import PlayBypass
from mrdamper.models.spencer import Spencer
from mrdamper.physics.motion import Excitation, sine
from mrdamper.statistics.levenberg_marquardt import forward_differences
from mrdamper.tracing import Tape, TraceError, program
from mrdamper.tracing.compiled import RecordProgram
from mrdamper.tracing.tangent import with_tangents

NAMES = ("fy0", "fy1", "d", "e", "cb", "h0", "h1", "vh", "T", "qb", "Ic", "leak", "si")


@pytest.fixture(scope="module")
def motion():
    t = 1e-3 * np.arange(4000.0)
    x = 0.01 * np.sin(2 * np.pi * 1.3 * t) + 2e-3 * np.sin(2 * np.pi * 4.1 * t + 1)
    return Excitation(t, x, np.gradient(x, t), np.gradient(np.gradient(x, t), t), 0.6 + 0.4 * np.sin(t))


@pytest.fixture(scope="module")
def model():
    return PlayBypass(
        f0=1.0, k=1e3, c0=800.0, c1=200.0, fy0=150.0, fy1=600.0, d=2e-4, e=5e-5, cb=3e4, h0=0.4, h1=0.1, vh=0.01,
        T=0.005, asymmetry=0.05, cq=10.0, qb=0.1, Ic=0.2, leak=18.0, si=0.1,
    )  # fmt: skip


def test_tangents_of_a_damper_are_what_small_changes_do(motion, model):
    tangents = recorded.force_tangents(model, motion, NAMES)
    assert tangents is not None, "a compiler is needed"

    def force(**changed):
        moved = replace(model, **changed)
        return moved.force(motion, moved.state(motion))

    assert tangents[0] == pytest.approx(force(), abs=1e-9)
    for name, tangent in zip(NAMES, tangents[1:], strict=True):
        value = getattr(model, name)
        step = 1e-6 * value
        difference = (force(**{name: value + step}) - force(**{name: value - step})) / (2 * step)
        off = np.abs(tangent - difference) > 1e-6 * np.abs(difference).max()
        assert np.mean(off) < 0.01, name  # all but the samples that a corner lies between


def test_picked_samples_are_those_of_the_whole_record(motion, model):
    picked = np.array([0, 1, 7, 2000, 3998])
    some = recorded.force_tangents(model, motion, NAMES, picked)
    whole = recorded.force_tangents(model, motion, NAMES)
    assert some is not None
    assert whole is not None
    assert np.array_equal(some, whole[:, picked])


def test_every_operation_has_the_slope_of_its_values():
    tape = Tape()
    p, x = cast(Any, tape.parameter("p", 0.4)), cast(Any, tape.input("x"))
    held = tape.remember("held")
    mixed = np.tanh(p * x) + np.exp(-p) / (1 + p * x * x) - np.sqrt(p + x * x) + np.log1p(p * p) * np.arctan(p * x)
    mixed = mixed + np.abs(x - p) + np.maximum(p, x) * np.minimum(2 * p, x) + np.power(p + x * x, p) - np.expm1(p * x)
    mixed = mixed + 0.5 * held + np.log(p + x * x) + np.tan(0.3 * p) + np.arctanh(0.2 * p)
    tape.update(held, mixed)
    record = RecordProgram(program(tape, with_tangents(tape, mixed, ["p"])))
    xs = np.linspace(0.05, 1.0, 40)

    def along(value):
        derived = record.prepare((value,))
        assert derived is not None
        return record.interpreted_along((value,), derived, record.starts, [xs]).outputs

    difference = (along(0.4 + 1e-6)[0] - along(0.4 - 1e-6)[0]) / 2e-6
    assert along(0.4)[1] == pytest.approx(difference, rel=1e-7)


def test_a_branch_that_is_not_taken_has_no_part_in_a_slope():
    tape = Tape()
    p, x = cast(Any, tape.parameter("p", 0.4)), cast(Any, tape.input("x"))
    root = tape.select(x > 0.0, np.sqrt(p * x * x), 0.0)
    record = RecordProgram(program(tape, with_tangents(tape, 3 * root, ["p"])))
    xs = np.array([-1.0, 0.0, 0.25])
    along = record.interpreted_along((0.4,), record.prepare((0.4,)) or (), record.starts, [xs])
    assert along.failed == -1
    assert along.outputs[1] == pytest.approx([0.0, 0.0, 1.5 * 0.25 / np.sqrt(0.4)])


def test_a_loop_has_the_slope_of_its_passes():
    """Through what it carries and through memory; a carried value that measures its steps has none."""
    tape = Tape()
    p, x = cast(Any, tape.parameter("p", 0.4)), cast(Any, tape.input("x"))
    held = tape.remember("held", 0.1)

    def body(count, value):
        return count < 2.5, [count + 1.0, value + np.tanh(p * value - x) * p]

    _, value = tape.loop([0.0 * p, held], body, 10, still=1)
    tape.update(held, value)
    record = RecordProgram(program(tape, with_tangents(tape, value * p, ["p"])))
    xs = np.linspace(0.05, 1.0, 40)
    along = record.interpreted_along((0.4,), record.prepare((0.4,)), record.starts, [xs]).outputs

    def by_hand(p):
        value, out = 0.1, []
        for x in xs:
            for _ in range(4):
                value += np.tanh(p * value - x) * p
            out.append(value * p)
        return np.array(out)

    assert along[0] == pytest.approx(by_hand(0.4), rel=1e-12)
    assert along[1] == pytest.approx((by_hand(0.4 + 1e-6) - by_hand(0.4 - 1e-6)) / 2e-6, rel=1e-7)


def test_a_power_of_zero_has_a_slope():
    tape = Tape()
    p = cast(Any, tape.parameter("p", 2.0))
    x = cast(Any, tape.input("x"))
    record = RecordProgram(program(tape, with_tangents(tape, np.power(np.abs(p * x), p), ["p"])))
    along = record.interpreted_along((2.0,), record.prepare((2.0,)), record.starts, [np.array([0.0, 0.5])])
    assert along.outputs[1].tolist() == [0.0, 1.0]  # (p x)^p at p = 2, x = 1/2: ln(p x) + 1


def test_what_has_no_tangent_is_refused():
    tape = Tape()
    p = tape.parameter("p", 1.0)
    value = tape.lookup(cast(Any, None), p)
    with pytest.raises(TraceError):
        with_tangents(tape, value * p, ["p"])


@pytest.mark.parametrize(
    ("model", "names"),
    [
        (Spencer(1e4, 0.05, 1.0, 0.02, 3e-4), ("c0_ratio", "k0_rate", "creep", "yield_displacement")),
        (Spencer(1e4, 0.05, 1.0, 0.02, 3e-4, asymmetry=-0.3, n=1.6), ("creep", "asymmetry", "n")),
        (LuGre(1e3, 2e-4, 1.2, 0.01, 10.0, 100.0), ("presliding", "stribeck", "vs", "sigma1")),
    ],
)
def test_tangents_through_the_integrator_are_what_changes_do(model, names):
    motion = sine(Condition(0.0, 1.0, 0.01), 4, 200)
    tangents = recorded.force_tangents(model, motion, names)
    assert tangents is not None, "a compiler is needed"

    def force(**changed):
        moved = replace(model, **changed)
        return moved.force(motion, moved.state(motion))

    for name, tangent in zip(names, tangents[1:], strict=True):
        step = 1e-4 * getattr(model, name)
        both = (force(**{name: getattr(model, name) + sign * step}) for sign in (1, -1))
        difference = np.subtract(*both) / (2 * step)
        error = np.abs(tangent - difference) / np.abs(difference).max()
        # Steps that are taken for one value and not for the other cost a difference some digits, at a few samples.
        assert np.median(error) < 1e-4, name
        assert np.mean(error > 1e-2) < 0.01, name


@pytest.mark.parametrize("at_bound", [False, True])
def test_slopes_of_a_joint_fit_are_those_of_differences(bundled, at_bound):
    """At a bound, too, where the force may have a corner: there they are those from inside."""
    runs = [run for run in bundled.rig("utfsm").split("train") if run.excitation == "sine"][::4]
    problem = JointProblem(runs, "play-bypass", free=("leak", "qb", "Ic"))
    table, point = JointResiduals(problem.space, problem.parts), np.mean(problem.space.box(), axis=0)
    if at_bound:
        share = [axis.name for axis in problem.space.axes].index("seat_share")
        point[share] = problem.space.box()[1][share]
    solved = table.solve(point)
    by_axes, by_parameters = table._moved(point, solved.model, solved.residual)
    weights = table.weights[table.owner]
    near = forward_differences(
        lambda u: table.residual(u, solved.model) * weights, point, solved.residual, *problem.space.box()
    )
    for column, other in zip(by_axes @ by_parameters, near.T, strict=True):
        assert np.linalg.norm(column - other) < 0.02 * np.linalg.norm(other) + 1e-6
