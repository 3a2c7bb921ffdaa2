"""A parameter held at a value stays there, in every model and method."""

import pytest

from mrdamper import identify, load_dataset
from mrdamper.errors import IdentificationError
from mrdamper.models import all_models

RUN = "utf_5mm4Hz_1A"


@pytest.fixture(scope="module")
def run():
    return load_dataset()[RUN]


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=pytest.mark.slow if m.integrated else ()) for n, m in all_models().items()],
)
def test_what_is_held_stays(run, name):
    """One by one; of a model of many parameters every third at a time."""
    found = identify(run, name).model
    infos = found.parameters()
    for group in [infos[i::3] for i in range(3)] if len(infos) > 12 else [[info] for info in infos]:
        held = {}
        for info in group:
            value, (low, high) = getattr(found, info.name), info.bounds
            held[info.name] = min(max(1.1 * value if value else 0.1, low), high)
        model = identify(run, name, fixed=held).model
        assert {key: getattr(model, key) for key in held} == held


@pytest.mark.parametrize("method", ["projection", "balance"])
@pytest.mark.parametrize("gamma", [-1e5, 1e3, 1e6, 1e9])  # from far below to above the free fit's beta + gamma
def test_a_held_gamma_leaves_beta_in_its_bounds(run, method, gamma):
    found = identify(run, "bouc-wen", method=method, fixed={"gamma": gamma})
    assert found.model.gamma == gamma
    assert found.model.beta >= 0
    assert found.scores.nrmse_pp < 0.05  # the free fit reaches 3 %


@pytest.mark.parametrize("method", ["projection", "balance"])
def test_a_held_beta_leaves_gamma_to_the_search(run, method):
    beta = identify(run, "bouc-wen", method=method).model.beta
    found = identify(run, "bouc-wen", method=method, fixed={"beta": beta}, free=["gamma"])
    assert found.model.beta == beta
    # gamma = beta is one of the points that were searched
    assert found.scores.nrmse_pp <= identify(run, "bouc-wen", method=method).scores.nrmse_pp * 1.01


def test_gamma_cannot_be_held_in_a_unit_that_changes(run):
    with pytest.raises(IdentificationError, match="m\\^-n"):
        identify(run, "bouc-wen", fixed={"gamma": 1e5}, free=["n"])
