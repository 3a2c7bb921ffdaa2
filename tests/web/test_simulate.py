"""The Ride view's answers: what it offers, what it computes, and that names never become paths."""

import json
import struct

import numpy as np
import pytest
from support.dampers import joint_damper

from mrdamper.dampers.model_file import dump_model


@pytest.fixture
def damper(client, session):
    """Key of a damper that was dropped as a file."""
    found = client.post(f"{session}/dampers", json={"text": dump_model(joint_damper())})
    found.raise_for_status()
    return found.json()["damper"]


def test_a_ride_is_the_simulation_it_stands_for(client, session, damper):
    choices = client.get(f"{session}/simulate/choices").json()
    assert {"quarter-car", "half-car", "dyke1996"} <= {row["name"] for row in choices["systems"]}
    assert "elcentro@5" in {row["name"] for row in choices["sources"]["ground"]}
    ask = {"damper": damper, "system": "dyke1996", "source": "elcentro@5", "control": "passive", "current_A": 0.5}
    body = client.post(f"{session}/simulate", json=ask).content
    (length,) = struct.unpack("<I", body[:4])
    head = json.loads(body[4 : 4 + length])
    arrays, at = {}, 4 + length
    for name, size in head["arrays"]:
        arrays[name], at = np.frombuffer(body, "<f4", size, at), at + 4 * size
    assert head["converged"]
    assert head["gain"] > 0  # half an ampere calms this frame
    assert np.abs(arrays["a.floor3"]).max() == pytest.approx(head["peaks"]["acceleration_m_s2"][2], rel=0.1)
    assert arrays["current.mr"][5] == pytest.approx(0.5)
    assert np.abs(arrays["input.ground"]).max() < 0.05  # no drift
    assert arrays["passive.floor3"].size == arrays["time"].size


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"system": "../../frame.toml"}, "E_NAME"),
        ({"source": "/etc/passwd"}, "E_NAME"),
        ({"source": "elcentro@5"}, "E_NAME"),  # a quake for a car
        ({"control": "skyhok"}, "E_NAME"),
        ({"current_A": -1}, "E_REQUEST"),
    ],
)
def test_what_is_not_offered_is_refused(client, session, damper, change, code):
    ask = {"damper": damper, "system": "quarter-car", "source": "bump", "control": "passive", "current_A": 0.5}
    found = client.post(f"{session}/simulate", json={**ask, **change})
    assert found.status_code == 422
    assert found.json()["code"] == code
