"""States followed compiled are those of the array code, also where a motion turns twice between two samples."""

import shutil

import numpy as np
import pytest

from mrdamper.models import recorded
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.models.play_bypass import PlayBypass
from mrdamper.physics.motion.excitation import Excitation
from mrdamper.physics.simulation import simulate

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


def wandering(noise: float, samples: int = 4000) -> Excitation:
    rng = np.random.default_rng(3)
    time = np.cumsum(rng.uniform(0.5e-3, 2e-3, samples))
    x = 0.005 * np.sin(8 * time) + 0.002 * np.sin(2 * time) + noise * rng.normal(size=samples)
    x[1000:1200] = x[1000]  # a rest
    v = np.gradient(x, time)
    return Excitation(time, x, v, np.gradient(v, time), np.repeat(rng.uniform(0, 2, 8), samples // 8))


def damper(**changed: float) -> PlayBypass:
    values = {"f0": 1.0, "k": 1e3, "c0": 800.0, "c1": 200.0, "fy0": 150.0, "fy1": 600.0, "d": 2e-4, "e": 5e-5}
    values |= {"cb": 3e4, "h0": 0.4, "h1": 0.1, "vh": 0.01, "T": 0.005}
    return PlayBypass(**{**values, **changed})


@pytest.mark.parametrize("noise", [0.0, 1e-6, 1e-3])
@pytest.mark.parametrize("changed", [{}, {"T": 0.0}, {"leak": 5.0, "qb": 0.2}, {"si": 0.3, "Ic": 0.5}])
def test_compiled_states_are_those_of_the_arrays(noise, changed, monkeypatch):
    monkeypatch.setattr(recorded, "_MIN_COMPILED_SAMPLES", 0)
    motion, model = wandering(noise), damper(**changed)
    found, expected = model.state(motion), PlayBypass.state.__wrapped__(model, motion)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    "model", [damper(), BoucWen(c=900.0, alpha=4e5, beta=3e6, gamma=1e6, f0=20.0, k1=700.0, k3=1e6)]
)
def test_force_and_state_of_one_pass_are_those_of_two(model, monkeypatch):
    motion = wandering(1e-6)
    expected = model.force(motion, state := model.state(motion)), state
    recorded.response(model, motion)
    monkeypatch.delattr(type(model), "force")  # in one pass no array is given to it
    done = simulate(model, motion)
    for found, wanted in zip((done.force, done.state), expected, strict=True):
        np.testing.assert_allclose(found, wanted, rtol=1e-12, atol=1e-12 * np.ptp(wanted))


def test_without_a_compiler_the_arrays_answer(monkeypatch):
    monkeypatch.setattr(recorded, "_MIN_COMPILED_SAMPLES", 0)
    monkeypatch.setenv("MRDAMPER_COMPILER", "none")
    motion, model = wandering(1e-6), damper(cq=3.0)
    np.testing.assert_array_equal(model.state(motion), PlayBypass.state.__wrapped__(model, motion))


def test_the_moves_of_a_path_lead_from_sample_to_sample():
    """Whatever turns between two samples: the signed moves add up to the displacement, up to the peaks' own height."""
    motion = wandering(1e-3)
    moves = motion.path.moves
    assert np.count_nonzero(moves[1]) > 0
    total = np.cumsum(sum(moves))
    np.testing.assert_allclose(total, motion.displacement - motion.displacement[0], atol=1e-12)
    assert np.sum(np.abs(moves)) == pytest.approx(motion.path.travel[-1])
