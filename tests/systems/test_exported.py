"""Inverse and control law as C and FMU: the same bits as Python, and a loop closed with them comes out the same."""

import ctypes
import shutil
import subprocess
import zipfile

import numpy as np
import pytest
from support.dampers import joint_damper
from support.systems import quarter_car
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.dampers.model_file import save_model
from mrdamper.dampers.streaming import stepper
from mrdamper.errors import InputError
from mrdamper.exporters.c import program_sources
from mrdamper.exporters.fmu import FMUExporter
from mrdamper.exporters.fmu_check import check_fmu
from mrdamper.exporters.fmu_program import write_program_fmu
from mrdamper.exporters.toolchain import here
from mrdamper.systems.controllers import controller_type
from mrdamper.systems.inputs import load_input
from mrdamper.systems.inverse import invert
from mrdamper.systems.simulate import SystemLoop

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")


def compiled(program, folder, name, units):
    """A function like Python's step: from inputs to outputs, with its own memory."""
    for file, text in program_sources(program, name, f"test of {name}", units).items():
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
    step = compiled(inverse.program, tmp_path, "inverse", inverse.units)
    for i in range(1500):
        t = i * 1e-3
        sample = (0.01 * np.sin(9 * t), 0.09 * np.cos(9 * t), -0.81 * np.sin(9 * t), 900 * np.sin(13 * t), 1e-3)
        found = inverse.step(*sample)
        good, answer = step(sample)
        assert good == 1
        assert answer == (found.current, found.force, found.lowest, found.highest)
    assert step((float("nan"), 0, 0, 0, 1e-3))[0] == 0
    assert step((0, 0, 0, 0, 0))[0] == 0


LAWS = ["sh-add", "skyhook-continuous", "clipped-optimal"]


def loop_of(law):
    car = quarter_car("car", 300, 40, 20e3, 200e3)
    return SystemLoop(car, load_input("bump", {"length_s": 0.5}), {"damper": joint_damper()}, controller_type(law)())


def closed_with(law, answer):
    """The loop with another hand at the control: `answer(inputs)` gives (good, currents)."""
    other = loop_of(law)
    (stage,) = other._controllers

    def step(given, derived, memory, inputs):
        good, currents = answer(inputs)
        return 1 - good, currents, memory

    stage.source.step = step
    return other.run(1e-3, machine=False)


@pytest.mark.parametrize("law", LAWS)
def test_a_loop_closed_with_the_c_is_pythons_loop(law, tmp_path):
    loop = loop_of(law)
    step = compiled(loop.control.program, tmp_path, "law", loop.control.units)
    ours, theirs = loop.run(1e-3, machine=False), closed_with(law, step)
    assert np.array_equal(theirs.current, ours.current)
    assert np.array_equal(theirs.x, ours.x)


class Importer:
    """An FMU in FMPy's hands."""

    def __init__(self, path):
        fmpy = pytest.importorskip("fmpy", reason="the fmu extra is not installed")
        self.folder = fmpy.extract(str(path))
        described = fmpy.read_model_description(self.folder)
        self.fmu = fmpy.instantiate_fmu(self.folder, described)
        self.fmi2 = described.fmiVersion == "2.0"
        if self.fmi2:
            self.fmu.setupExperiment()
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        self.refs = {v.name: v.valueReference for v in described.modelVariables}
        of = {
            way: [v.valueReference for v in described.modelVariables if v.causality == way]
            for way in ("input", "output")
        }
        self.inputs, self.outputs, self.time = of["input"], of["output"], 0.0

    def step(self, inputs):
        *values, dt = inputs
        put, get = (getattr(self.fmu, way + ("Real" if self.fmi2 else "Float64")) for way in ("set", "get"))
        put(self.inputs, values)
        self.fmu.doStep(self.time, dt)
        self.time += dt
        return 1, tuple(get(self.outputs))


@pytest.mark.parametrize(("law", "fmi"), [("skyhook-continuous", 2), ("clipped-optimal", 3)])
def test_a_loop_closed_with_the_fmu_is_pythons_loop(law, fmi, tmp_path):
    loop, control = loop_of(law), loop_of(law).control
    write_program_fmu(
        control.program, "law", "a law", control.units, tmp_path / "law.fmu", 1e-3, control.start, exporter(fmi)
    )
    assert check_fmu(tmp_path / "law.fmu") == []
    ours, theirs = loop.run(1e-3, machine=False), closed_with(law, Importer(tmp_path / "law.fmu").step)
    assert np.array_equal(theirs.current, ours.current)
    assert np.array_equal(theirs.x, ours.x)


def exporter(fmi):
    platform = here()
    if platform is None:
        pytest.skip("binaries cannot be run on this machine")
    return FMUExporter(fmi, (platform.name,))


def test_the_damper_s_fmu_in_a_car_is_the_stepper_in_that_car(tmp_path):
    content = exporter(2).export(joint_damper(), "damper").files["damper.fmu"]
    (tmp_path / "damper.fmu").write_bytes(content)
    fmu, steps = Importer(tmp_path / "damper.fmu"), stepper(joint_damper())
    put, get = fmu.fmu.setReal, fmu.fmu.getReal
    names = [fmu.refs[name] for name in ("displacement", "current")]

    def of_fmu(stroke, current, dt):
        put(names, [stroke, current])
        fmu.fmu.doStep(fmu.time, dt)
        fmu.time += dt
        return get([fmu.refs["force"]])[0]

    def ride(force_of):
        """A quarter car stepped as masters of co-simulation do: the force of the step before."""
        x, v, found, force, dt = np.zeros(2), np.zeros(2), [], 0.0, 2.0**-10
        for i in range(500):
            road = 0.02 * np.sin(10 * i * dt) ** 2
            pull = 20e3 * (x[0] - x[1]) + force
            v = v + dt * np.array([-pull / 300, (pull - 200e3 * (x[1] - road)) / 40])
            x = x + dt * v
            force = force_of(float(x[0] - x[1]), 0.5 if v[0] * (v[0] - v[1]) > 0 else 0.0, dt)
            found.append([*x, force])
        return np.array(found)

    assert np.array_equal(ride(of_fmu), ride(steps.step))


@pytest.mark.usefixtures("one_platform")
def test_both_leave_by_the_command_line(tmp_path):
    save_model(joint_damper(), tmp_path / "model.json")
    model = ["--damper", str(tmp_path / "model.json")]
    chosen = ["simulate", "quarter-car", "--input", "bump:length_s=0.1", *model, "--json"]
    done = CliRunner().invoke(
        application(),
        [*chosen, "--control", "sh-add", "--c", str(tmp_path / "law"), "--fmu", str(tmp_path / "law.fmu")],
    )
    assert done.exit_code == 0, done.output
    assert check_fmu(tmp_path / "law.fmu") == []
    assert {path.name for path in (tmp_path / "law").iterdir()} == {"sh_add.h", "sh_add.c"}
    assert isinstance(CliRunner().invoke(application(), [*chosen, "--c", str(tmp_path / "no")]).exception, InputError)
    export = ["export", str(tmp_path / "model.json"), "--out", str(tmp_path / "inverse"), "--inverse", "--to"]
    assert CliRunner().invoke(application(), [*export, "c"]).exit_code == 0
    header = (tmp_path / "inverse/bench_inverse.h").read_text()
    assert "wanted; /* N */" in header
    header = " ".join(header.replace(" * ", " ").split())
    assert "outside lowest to highest is answered by the nearer of them" in header
    low, high = joint_damper().envelope.current_A
    assert f"currents 0 to {high:g} A; tested current {low:g} to {high:g} A, frequency" in header
    export[3] = str(tmp_path / "inverse.fmu")
    assert CliRunner().invoke(application(), [*export, "fmu"]).exit_code == 0
    description = zipfile.ZipFile(tmp_path / "inverse.fmu").read("modelDescription.xml").decode()
    assert "wanted" in description
    assert "; tested current" in description
    assert isinstance(CliRunner().invoke(application(), [*export, "latex"]).exception, InputError)
