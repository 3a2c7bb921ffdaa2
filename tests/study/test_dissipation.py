"""Every loop dissipates: a model that drives its motion beyond the tests is found, a sound one is not."""

import pytest
from support.dampers import joint_damper, modified_damper

from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.joint import JointDamper
from mrdamper.data import Condition
from mrdamper.models.bingham import Bingham
from mrdamper.study.dissipation import gains_energy

TESTED = Envelope.of([Condition(I, f, a) for I in (0.0, 1.0) for f, a in ((0.5, 0.02), (2.0, 0.005))])


@pytest.mark.parametrize("make", [joint_damper, modified_damper])
def test_sound_dampers_dissipate_everywhere(make):
    assert gains_energy(make()) == ""


class Fading(Bingham):
    """Drives its motion above the highest tested current alone."""

    def force(self, motion, state):
        return super().force(motion, state) * (1 if abs(motion.current[0]) <= 1.0 else -1)


def test_a_fifth_beyond_the_highest_current_is_looked_at():
    found = gains_energy(JointDamper(Fading(c=100.0, fy=50.0), ("c",), rig="rig", envelope=TESTED))
    assert "gains energy at 1.2 A" in found
