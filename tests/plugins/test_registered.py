"""Classes that a script registers: what they may omit, what is refused, and studies in one process."""

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from mrdamper import identify, register
from mrdamper.data import Condition, Run
from mrdamper.errors import InputError, ParameterError
from mrdamper.models import Model, Scale, SearchAxis, param
from mrdamper.physics.motion import sine

PAGE = Path(__file__).parents[2] / "docs/how-to/own-model.md"
MOTION = sine(Condition(0.5, 1.0, 0.01), 3, 400)


@dataclass(frozen=True)
class Smooth(Model):
    """Viscous damping and smooth friction."""

    name: ClassVar[str] = "smooth"
    title: ClassVar[str] = "smooth friction"

    c: float = param("N s/m", "viscous damping", linear=True)
    fy: float = param("N", "friction force", linear=True)
    vs: float = param("m/s", "velocity in which friction is spent")

    def force(self, motion, state):
        return self.c * motion.velocity + self.fy * np.tanh(motion.velocity / self.vs)


def recorded(model):
    force = model.force(MOTION, model.state(MOTION)) + np.random.default_rng(1).normal(0, 1, MOTION.time.size)
    return Run("made", MOTION.time, MOTION.displacement, force, 0.5)


def test_a_length_or_a_velocity_is_searched_without_a_word_about_its_limits():
    truth = Smooth(c=800.0, fy=300.0, vs=0.004)
    model = identify(recorded(truth), Smooth).model
    assert model.vs == pytest.approx(truth.vs, rel=0.1)
    assert model.fy == pytest.approx(truth.fy, rel=0.05)


def refused(cls):
    with pytest.raises(ParameterError) as caught:
        identify(recorded(Smooth(c=800.0, fy=300.0, vs=0.004)), cls)
    return str(caught.value)


def test_a_parameter_that_is_neither_linear_nor_limited_is_refused_with_what_to_write():
    @dataclass(frozen=True)
    class Unlimited(Smooth):
        name: ClassVar[str] = "unlimited"
        k: float = param("N/m", "stiffness", default=0.0)

    assert "k has no limits for a search; mark it linear=True" in refused(Unlimited)


def test_a_linear_parameter_has_no_search_axis():
    @dataclass(frozen=True)
    class Twice(Smooth):
        name: ClassVar[str] = "twice"

        @classmethod
        def search_axes(cls, scale: Scale, free):
            return tuple(SearchAxis(name, 1e-3, 1e3, (1.0,), log=True) for name in free)

    assert "search axes of linear parameters: c, fy" in refused(Twice)


def test_a_class_without_a_title_is_refused():
    @dataclass(frozen=True)
    class Untitled(Model):
        name: ClassVar[str] = "untitled"

        def force(self, motion, state):
            return 0 * motion.velocity

    with pytest.raises(InputError, match="Untitled lacks title; define it in the class"):
        register(Untitled)


def test_a_script_compares_and_saves_its_own_model(tmp_path):
    """The page's script as a file: other processes do not import it."""
    code = PAGE.read_text(encoding="utf-8").split("```python\n")[1].split("```")[0]
    code += """
from mrdamper import save_model
save_model(compare(rig, ["smooth-friction"]).rigs[0].entries[0].damper, "own.json")
"""
    (tmp_path / "script.py").write_text(code)
    done = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert "smooth-friction" not in done.stderr
    assert json.loads((tmp_path / "own.json").read_text())["damper"]["model"] == "smooth-friction"
    asked = [sys.executable, "-m", "mrdamper", "predict", "own.json", "--current=1", "--frequency=1", "--amplitude=5"]
    done = subprocess.run(asked, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "register '__main__.SmoothFriction' before the file is loaded" in done.stderr
