"""Many dampers in one loop; how fast one answers."""

import numpy as np
import pytest
from support.dampers import ENVELOPE, joint_damper

from mrdamper.dampers.coil import Coil
from mrdamper.dampers.modified import ModifiedModel
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.errors import InputError
from mrdamper.functions.forms import ParameterFunction
from mrdamper.models import model_type
from mrdamper.systems.controllers.passive import Passive
from mrdamper.systems.inputs import load_input
from mrdamper.systems.monte_carlo import drawn, monte_carlo
from mrdamper.systems.rise_time import rise_times
from mrdamper.systems.simulate import Loop
from mrdamper.systems.structure import quarter_car

CAR = quarter_car("car", 300, 40, 20e3, 200e3)
ROAD = load_input("bump", {"length_s": 1.0})


def test_other_numbers_in_one_loop_are_other_dampers():
    damper = joint_damper()
    loop = Loop(CAR, ROAD, {"damper": damper}, Passive(0.5))
    others = drawn(damper, ("c0", "c1"), np.diag([60.0, 100.0]) ** 2, 3, seed=4)
    bands = monte_carlo(loop, [{"damper": other} for other in others], 1e-3)
    for row, other in zip(bands.peaks["acceleration_m_s2"], others, strict=True):
        alone = Loop(CAR, ROAD, {"damper": other}, Passive(0.5)).run(1e-3, machine=False)
        assert row == pytest.approx(alone.peaks["acceleration_m_s2"], rel=1e-9)
    low, middle, high = bands.quantiles()["force_N"]
    assert low < middle < high


def test_draws_scatter_as_they_are_told():
    damper = joint_damper()
    covariance = np.array([[400.0, 300.0], [300.0, 900.0]])
    sets = np.array([[d.model.c0, d.model.c1] for d in drawn(damper, ("c0", "c1"), covariance, 4000)])
    assert np.cov(sets.T) == pytest.approx(covariance, rel=0.1)
    with pytest.raises(InputError):
        drawn(damper, ("c0",), covariance, 3)
    with pytest.raises(InputError):
        drawn(damper, ("c0", "nothing"), covariance, 3)


def test_rise_times_are_those_of_the_coil():
    functions = {
        "c": ParameterFunction("constant", (800.0,)),
        "fy": ParameterFunction("linear-current", (900.0, 40.0)),
        "f0": ParameterFunction("constant", (30.0,)),
    }
    parameters = ParameterMap(model_type("bingham"), functions)
    damper = ModifiedModel("bench", parameters, ENVELOPE, {}, coil=Coil(0.02, 0.05))
    found = rise_times(damper)
    assert found.rise_63 == pytest.approx(0.02, rel=0.02)
    assert found.rise_90 == pytest.approx(0.02 * np.log(10), rel=0.02)
    assert found.fall_63 == pytest.approx(0.05, rel=0.02)
    assert found.fall_90 == pytest.approx(0.05 * np.log(10), rel=0.02)
