"""What figures compute before they draw."""

import numpy as np
import pytest

from mrdamper.data import Condition
from mrdamper.paper.figures import beside_current_law
from mrdamper.statistics.functions.fitting import fit_function
from mrdamper.statistics.functions.forms import ParameterFunction, features

CONDITIONS = [
    Condition(I, f, A) for f, A in ((1.0, 0.02), (2.0, 0.02), (0.5, 0.05), (1.5, 0.05)) for I in (0, 0.7, 2.0)
]


def test_beside_its_current_law_a_parameter_is_what_its_motion_makes_it():
    function = ParameterFunction("plane", (100.0, 700.0, 30.0, -900.0, 5.0))
    left = beside_current_law(function, CONDITIONS, function(*features(CONDITIONS)))
    assert left == pytest.approx([30 * c.frequency_Hz - 900 * c.amplitude_m + 5 for c in CONDITIONS])


def test_the_levels_of_a_figure_are_fitted_by_the_function_of_all_runs():
    speed = np.array([c.frequency_Hz * c.amplitude_m for c in CONDITIONS])
    currents = np.array([c.current_A for c in CONDITIONS])
    values = 200 + 6e3 * speed + 900 * currents - 150 * currents**2
    found = fit_function("quadratic-current-speed", CONDITIONS, values).function
    assert beside_current_law(found, CONDITIONS, values) == pytest.approx(200 + 6e3 * speed)
