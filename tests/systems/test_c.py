"""Inverse and control law as C: the same bits as Python, and the loop closed with the C comes out the same."""

import ctypes
import shutil
import subprocess

import numpy as np
import pytest
from support.dampers import joint_damper
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.errors import InputError
from mrdamper.export.c import program_sources
from mrdamper.files.model_file import save_model
from mrdamper.systems.controllers import controller_type
from mrdamper.systems.inputs import load_input
from mrdamper.systems.inverse import invert
from mrdamper.systems.simulate import Loop
from mrdamper.systems.structure import quarter_car
from mrdamper.tracing.python import python_functions

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


def compiled(program, folder, name):
    """A function like Python's step: from inputs to outputs, with its own memory."""
    for file, text in program_sources(program, name, f"test of {name}").items():
        (folder / file).write_text(text)
    library = folder / f"{name}.so"
    subprocess.run(
        ["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-O2", "-ffp-contract=off", "-shared", "-fPIC",
         str(folder / f"{name}.c"), "-o", str(library), "-lm"],
        check=True,
    )  # fmt: skip
    code = ctypes.CDLL(str(library))
    given = (ctypes.c_double * len(program.tape.inputs))()
    found = (ctypes.c_double * len(program.outputs))()
    memory = (ctypes.c_double * (len(program.tape.memory) + 1))()
    getattr(code, f"{name}_reset")(memory)

    def step(inputs):
        given[:] = inputs
        return getattr(code, f"{name}_step")(memory, given, found), tuple(found)

    return step


def test_the_inverse_in_c_has_pythons_bits_and_refuses_what_is_no_number(tmp_path):
    inverse = invert(joint_damper())
    step = compiled(inverse.program, tmp_path, "inverse")
    for i in range(1500):
        t = i * 1e-3
        sample = (0.01 * np.sin(9 * t), 0.09 * np.cos(9 * t), -0.81 * np.sin(9 * t), 900 * np.sin(13 * t), 1e-3)
        found = inverse.step(*sample)
        good, answer = step(sample)
        assert good == 1
        assert answer == (found.current, found.force, found.lowest, found.highest)
    assert step((float("nan"), 0, 0, 0, 1e-3))[0] == 0
    assert step((0, 0, 0, 0, 0))[0] == 0


@pytest.mark.parametrize("law", ["sh-add", "skyhook-continuous", "clipped-optimal"])
def test_a_loop_closed_with_the_c_is_pythons_loop(law, tmp_path):
    car = quarter_car("car", 300, 40, 20e3, 200e3)
    loop = Loop(car, load_input("bump", {"length_s": 0.6}), {"damper": joint_damper()}, controller_type(law)())
    ours = loop.run(1e-3, machine=False)
    step = compiled(loop.control.program, tmp_path, "law")
    stage = loop._controllers[0]
    python_step = python_functions(loop.control.program)[1]
    assert stage.step.__code__.co_code == python_step.__code__.co_code

    def in_c(given, derived, memory, inputs):
        good, answer = step(inputs)
        return 1 - good, answer, memory

    from dataclasses import replace

    other = Loop(loop.system, loop.source, {"damper": joint_damper()}, controller_type(law)())
    other.__dict__["_controllers"] = [replace(stage, step=in_c)]
    theirs = other.run(1e-3, machine=False)
    assert np.array_equal(theirs.current, ours.current)
    assert np.array_equal(theirs.x, ours.x)


def test_both_leave_by_the_command_line(tmp_path):
    save_model(joint_damper(), tmp_path / "model.json")
    model = ["--damper", str(tmp_path / "model.json")]
    chosen = ["simulate", "quarter-car", "--input", "bump:length_s=0.1", *model, "--json"]
    done = CliRunner().invoke(application(), [*chosen, "--control", "sh-add", "--c", str(tmp_path / "law")])
    assert done.exit_code == 0, done.output
    assert {path.name for path in (tmp_path / "law").iterdir()} == {"sh_add.h", "sh_add.c"}
    assert isinstance(CliRunner().invoke(application(), [*chosen, "--c", str(tmp_path / "no")]).exception, InputError)
    export = ["export", str(tmp_path / "model.json"), "--out", str(tmp_path / "inverse"), "--inverse", "--to"]
    assert CliRunner().invoke(application(), [*export, "c"]).exit_code == 0
    assert "wanted" in (tmp_path / "inverse/bench_inverse.h").read_text()
    assert isinstance(CliRunner().invoke(application(), [*export, "latex"]).exception, InputError)
