"""Integrated models at the bounds of their search: a tighter tolerance and a finer motion change nothing."""

import numpy as np
import pytest

from mrdamper.data import Condition
from mrdamper.models import Scale
from mrdamper.models.lugre import LuGre, bristle_rate
from mrdamper.models.spencer import Spencer, series_rate
from mrdamper.physics.integrator import integrate
from mrdamper.physics.motion import sine

AMPLITUDE = 0.01
FINE = sine(Condition(0.0, 1.0, AMPLITUDE), 1, 400)
COARSE = FINE.part(slice(None, None, 2))


def corners(model_type, names):
    axes = model_type.search_axes(Scale.of(FINE, np.zeros(len(FINE)), AMPLITUDE), names)
    grid = np.meshgrid(*[(axis.lower, axis.upper) for axis in axes])
    points = np.array(grid).reshape(len(axes), -1).T.tolist()
    return [dict(zip([axis.name for axis in axes], point, strict=True)) for point in points]


LUGRE = corners(LuGre, ("presliding", "stribeck", "vs"))
SPENCER = corners(Spencer, ("c0_ratio", "k0_rate", "creep", "yield_displacement"))


@pytest.mark.parametrize("values", LUGRE, ids=lambda v: "-".join(f"{x:.0e}" for x in v.values()))
def test_lugre_at_the_corners_does_not_depend_on_the_step(values):
    model = LuGre.build({**values, "fc": 1e3, "sigma1": 0.0, "sigma2": 100.0})
    coarse, fine = (model.force(motion, model.state(motion)) for motion in (COARSE, FINE))
    assert np.isfinite(fine).all()
    # Between samples the motion is a cubic; twice as many of them move the peak speed by 1e-4.
    assert np.abs(coarse - fine[::2]).max() < 2e-3 * np.abs(fine).max()


def tolerances_agree(model, rate, parameters, scale):
    channels = (FINE.time, FINE.displacement, FINE.velocity, FINE.current)
    forces = []
    for tolerance in (1e-5, 1e-8):
        state = integrate(
            rate, np.array(parameters), channels, np.zeros(len(scale)), np.array(scale), tolerance=tolerance
        )
        forces.append(model.force(FINE, state[:, 0] if len(scale) == 1 else state))
    # The tolerance holds for each step; the errors of a few hundred steps add up.
    assert np.abs(forces[0] - forces[1]).max() < 1e-3 * np.abs(forces[1]).max()


@pytest.mark.parametrize("values", LUGRE, ids=lambda v: "-".join(f"{x:.0e}" for x in v.values()))
def test_lugre_at_the_corners_does_not_depend_on_the_tolerance(values):
    model = LuGre.build({**values, "fc": 1e3, "sigma1": 0.0, "sigma2": 100.0})
    tolerances_agree(model, bristle_rate, [1 / values["presliding"], values["stribeck"], 1 / values["vs"]], [1.0])


@pytest.mark.parametrize("values", SPENCER, ids=lambda v: "-".join(f"{x:.0e}" for x in v.values()))
def test_spencer_at_the_corners_does_not_depend_on_the_tolerance(values):
    length = values["yield_displacement"]
    parameters = [1 / (1 + values["c0_ratio"]), values["k0_rate"], values["creep"], 1 / length, 0.0, 2.0]
    tolerances_agree(Spencer.build({**values, "c1": 1e4}), series_rate, parameters, [length, 1.0])
