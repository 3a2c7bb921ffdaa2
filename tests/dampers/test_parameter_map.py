"""Parameter functions lead to a model everywhere, not only where they were fitted."""

import numpy as np
import pytest
from support.dampers import ENVELOPE

from mrdamper.dampers.modified import ModifiedModel
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.dampers.streaming import stepper
from mrdamper.data import Condition
from mrdamper.models import model_type
from mrdamper.statistics.functions.forms import ParameterFunction

FALLING = ParameterFunction("linear-current", (-1000.0, 400.0))  # below zero beyond 0.4 A
CASES = {
    "bouc-wen": ("yield_force", "alpha", {"c": 900.0, "yield_displacement": 2e-4, "k1": 0.0, "k3": 0.0, "f0": 0.0}),
    "spencer": (
        "yield_force", "creep", {"c1": 2e4, "c0": 900.0, "yield_displacement": 2e-4, "k0": 2e4, "k1": 0.0, "f0": 0.0}
    ),
    "dahl": ("kappa_w", "kappa_w", {"kappa_x": 900.0, "yield_displacement": 2e-4, "f0": 0.0}),
    "bingham": ("fy", "fy", {"c": 900.0, "f0": 0.0}),
}  # fmt: skip


def falling(name):
    coordinate, _, values = CASES[name]
    functions = {key: ParameterFunction("constant", (value,)) for key, value in values.items()}
    return ModifiedModel(ParameterMap(model_type(name), {**functions, coordinate: FALLING}), envelope=ENVELOPE)


@pytest.mark.parametrize("name", CASES)
def test_a_function_below_zero_stops_at_the_bound(name):
    damper, condition = falling(name), Condition(1.0, 1.0, 0.01)
    info = {i.name: i for i in model_type(name).parameters()}[CASES[name][1]]
    assert getattr(damper.model_at(condition), info.name) == pytest.approx(info.bounds[0], abs=1e-12)
    if not model_type(name).integrated:  # the loop of those takes seconds, and the stream solves the same equations
        loop = damper.predict(condition)
        assert np.all(np.isfinite(loop.force))
        assert np.ptp(loop.force) > 0
    stream = stepper(damper)
    assert np.isfinite([stream.step(x, 1.0, 1e-3) for x in 0.01 * np.sin(np.linspace(0, 6, 200))]).all()


@pytest.mark.parametrize("name", [name for name in CASES if not model_type(name).integrated])
def test_a_current_counts_by_its_magnitude(name):
    damper = falling(name)
    forward, backward = (damper.predict(Condition(current, 1.0, 0.01)) for current in (0.2, -0.2))
    assert np.array_equal(forward.force, backward.force)
    assert forward.extrapolation == backward.extrapolation == ()
