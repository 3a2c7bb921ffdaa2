"""Models saved by older versions load and give the forces they gave then."""

import json
from pathlib import Path

import numpy as np
import pytest

from mrdamper.dampers.model_file import MAJOR, MINOR, dump_model, load_model, parse_model
from mrdamper.data import Condition, Run

STORED = Path(__file__).parent / "stored"
FILES = sorted(path for path in STORED.rglob("*.json") if path.name != "forces.json")


def test_every_version_of_the_format_has_a_file():
    assert {path.parent.name for path in FILES} == {f"{MAJOR}.{minor}" for minor in range(MINOR + 1)}
    assert all(json.loads(path.read_text())["version"] == path.parent.name for path in FILES)


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name} {path.stem}")
def test_a_stored_model_gives_its_forces(path):
    known = json.loads((path.parent / "forces.json").read_text())[path.stem]
    damper = load_model(path)
    time = np.linspace(0, 2, 801)
    along = known.pop("run")
    motion = Run("sine", time, 0.008 * np.sin(2 * np.pi * 1.5 * time), np.zeros(time.size), np.array(0.25))
    np.testing.assert_allclose(damper.predict(motion).force[::40], along, atol=1e-9 * np.ptp(along))
    for text, force in known.items():
        found = damper.predict(Condition(*map(float, text.split()))).force[::50]
        np.testing.assert_allclose(found, force, atol=1e-9 * np.ptp(force))


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name} {path.stem}")
def test_a_stored_model_saved_again_is_the_same(path):
    damper = load_model(path)
    again = parse_model(dump_model(damper))
    at = damper.envelope.middle
    assert np.array_equal(again.predict(at).force, damper.predict(at).force)
    assert (again.rig, again.envelope, again.provenance) == (damper.rig, damper.envelope, damper.provenance)
