"""Noise seeds: the same ways and claims once more, counted."""

from types import SimpleNamespace

import numpy as np
import pytest

from mrdamper.paper import seeds
from mrdamper.paper.options import PaperOptions
from mrdamper.paper.recipes import CONSISTENT, LITERAL
from mrdamper.paper.seeds import Seed, by_seed, one_seed
from mrdamper.paper.verdicts import LIMITS, steadiness
from mrdamper.paper.virtual_rig import VirtualRig


@pytest.mark.parametrize(
    ("verdict", "others", "said"),
    [
        ("agrees", ["agrees"] * 3, "3 of 3"),
        ("agrees", [*["differs"] * 2, "agrees", "agrees in part"], "1 of 4; 2 differs; 1 agrees in part"),
        ("agrees in part", ["agrees", "agrees"], "0 of 2; 2 agrees"),
        ("agrees", ["cannot be judged"] * 2, ""),
        ("cannot be judged", ["cannot be judged"] * 2, ""),
        ("agrees", [], ""),
    ],
)  # fmt: skip
def test_a_verdict_is_counted_beside_those_of_other_seeds(verdict, others, said):
    assert steadiness(verdict, others) == said


def test_every_seed_keeps_its_numbers():
    found = [Seed({"a": n / 10, "b": n / 100}, {"phase": f"said {n}"}) for n in (1, 2, 3)]
    errors, verdicts = by_seed(found)
    assert np.array_equal(errors["a"], [0.1, 0.2, 0.3])
    assert np.array_equal(errors["b"], [0.01, 0.02, 0.03])
    assert verdicts == {"phase": ("said 1", "said 2", "said 3")}
    assert by_seed([]) == ({}, {})


@pytest.mark.parametrize("friction", ["dry", "filled"])
def test_a_seed_is_judged_on_held_out_runs_and_with_its_own_friction_test(monkeypatch, friction):
    asked = {}

    def judged(study):
        asked.update(study=study)
        return [SimpleNamespace(key="phase", verdict="agrees")]

    def way(median):
        scores = {name: SimpleNamespace(median=lambda value=value: value) for name, value in median.items()}
        return SimpleNamespace(recipe=SimpleNamespace(title="one"), **scores)

    monkeypatch.setattr(seeds, "CURRENTS", (0.0,))
    monkeypatch.setattr(seeds, "judge_all", judged)
    monkeypatch.setattr(seeds, "fit_and_score_all", lambda *_, **__: ([way({"train": 0.9, "validation": 0.1})], {}))
    monkeypatch.setattr(seeds, "friction_test", lambda rig, **more: asked.update(more) or "slow")
    found = one_seed(VirtualRig(force_noise=7.0), PaperOptions(friction_test=friction), 5, lambda what, share: None)
    assert found == Seed({"one": 0.1}, {"phase": "agrees"})
    assert (asked["seed"], asked["filled"], asked["study"].friction) == (5, friction == "filled", "slow")
    assert len(asked["study"].loops) == len(asked["study"].train) + len(asked["study"].held_out)


def test_a_seed_gives_the_errors_and_the_verdicts_of_its_own_noise(monkeypatch):
    monkeypatch.setattr(seeds, "CURRENTS", (0.0, 1.0, 2.0))
    loud = VirtualRig(force_noise=60.0)
    found = [one_seed(loud, PaperOptions(), seed, lambda what, share: None) for seed in (1, 2)]
    assert set(found[0].verdicts) == set(LIMITS)
    assert found[0].verdicts["viscosity"] == found[1].verdicts["viscosity"] == "differs"
    assert found[0].verdicts["search"] == "cannot be judged"
    for seed in found:
        assert seed.errors[CONSISTENT] < 0.6 * seed.errors[LITERAL]
    assert found[0].errors[CONSISTENT] != found[1].errors[CONSISTENT]
