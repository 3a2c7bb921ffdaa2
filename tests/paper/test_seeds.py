"""Noise seeds: the quick methods and the claims they allow once more, counted."""

import numpy as np
import pytest

from mrdamper.paper import study
from mrdamper.paper.claims import ROWS
from mrdamper.paper.options import CONSISTENT, HALF, JOINT, LITERAL, PaperOptions
from mrdamper.paper.virtual_rig import VirtualRig


def test_a_seed_gives_the_errors_and_the_verdicts_of_its_own_noise(monkeypatch):
    monkeypatch.setattr(study, "SEED_CURRENTS", (0.0, 2.0))
    loud = VirtualRig(force_noise=60.0)
    first, other = (study._one_seed(loud, PaperOptions(), seed, lambda what, share: None) for seed in (1, 2))
    assert set(first.verdicts) == set(ROWS)
    assert first.verdicts["viscosity"] == other.verdicts["viscosity"] == "differs"
    assert first.verdicts["search"] == "cannot be checked"
    for seed in (first, other):
        assert seed.errors[CONSISTENT] < 0.6 * seed.errors[LITERAL]
        assert not {JOINT, HALF} & set(seed.errors)
    assert first.errors[CONSISTENT] != other.errors[CONSISTENT]


@pytest.mark.parametrize("friction", ["dry", "filled"])
def test_every_seed_has_its_own_tests_and_its_own_friction_test(monkeypatch, friction):
    rig, options = VirtualRig(), PaperOptions(friction_test=friction)
    one, other = (
        study._tests(study.virtual_dataset(rig, (0.0,), seed, 2), rig, rig.gas, options, seed) for seed in (5, 6)
    )
    assert len(one.loops) == len(one.train) + len(one.held_out) == 7
    expected = study.friction_test(rig, 5, filled=friction == "filled")
    assert np.array_equal(one.friction.force, expected.force)
    assert not np.array_equal(one.friction.force, other.friction.force)
