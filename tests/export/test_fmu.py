"""FMUs: what they say of themselves, what they compute in an importer, and that they say no."""

import shutil
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from support.dampers import joint_damper
from support.fmu_files import COMPILERS, DAMPERS, FEW, fmu_bytes, unpacked

from mrdamper.dampers.streaming import FLAGS, stepper, stream
from mrdamper.errors import InputError
from mrdamper.exporters import all_exporters, toolchain
from mrdamper.exporters.c import reference_motion
from mrdamper.exporters.fmu import FMUExporter, reference
from mrdamper.exporters.fmu_description import base_powers, parameters_of_stream
from mrdamper.exporters.toolchain import PLATFORMS, build_library, compiler_for, here

FMIS = (2, 3)
needs_compiler = pytest.mark.skipif(not COMPILERS, reason="no C compiler on this machine")
BARE = [name for name in DAMPERS if name not in ("joint", "modified")]
few_or_slow = [n if n in FEW else pytest.param(n, marks=pytest.mark.slow) for n in DAMPERS]


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fmus")


def written(folder, name, fmi, compiled=True):
    path = folder / f"{abs(hash((name, compiled)))}_{fmi}.fmu"
    path.write_bytes(fmu_bytes(name, fmi, compiled))
    return str(path)


def variables(name, fmi=3):
    root = ElementTree.fromstring(unpacked(fmu_bytes(name, fmi, compiled=False))["modelDescription.xml"])
    return {v.get("name"): v for v in root.find("ModelVariables")}


def table(name, fmi, which):
    rows = unpacked(fmu_bytes(name, fmi, compiled=False))[f"resources/reference_{which}.csv"].decode().splitlines()
    return np.array(
        [tuple(map(float, row.split(","))) for row in rows[1:]], dtype=[(c, float) for c in rows[0].split(",")]
    )


def simulated(path, name, fmi, **more):
    """FMPy's result on the reference motion; its times are sums of the step, which is exact."""
    fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed")
    motion = table(name, fmi, "in")
    return fmpy.simulate_fmu(
        path,
        input=motion,
        output_interval=motion["time"][1],
        stop_time=motion["time"][-1],
        output=["force", "status", *(f"outside_{flag}" for flag in FLAGS)],
        **more,
    )


def test_the_exporter_is_found():
    assert all_exporters()["fmu"] is FMUExporter


@needs_compiler
@pytest.mark.parametrize(
    ("name", "fmi"),
    [
        (name, fmi)
        if (name, fmi) in (("joint", 2), ("modified", 3))
        else pytest.param(name, fmi, marks=pytest.mark.slow)
        for name in ("joint", "modified", *BARE)
        for fmi in FMIS
    ],
)
def test_fmpy_computes_what_the_stepper_does_to_the_last_bit(folder, name, fmi):
    result = simulated(written(folder, name, fmi), name, fmi)
    known = reference(stream(DAMPERS[name]))
    assert np.array_equal(result["force"], known.force)
    for bit, flag in enumerate(FLAGS):
        assert np.array_equal(result[f"outside_{flag}"] != 0, known.flags >> bit & 1)
    assert not result["status"].any()


@needs_compiler
@pytest.mark.parametrize("fmi", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_parameters_set_in_fmpy_are_those_set_in_the_stepper(folder, fmi):
    changed = {"c": 900.0, "beta": 3e5, "gamma": 1e5}
    result = simulated(written(folder, "bouc-wen", fmi), "bouc-wen", fmi, start_values=changed)
    assert np.array_equal(result["force"], reference(stream(replace(DAMPERS["bouc-wen"], **changed))).force)


@pytest.mark.parametrize("fmi", FMIS)
@pytest.mark.parametrize("name", few_or_slow)
def test_fmpy_finds_nothing_wrong_in_the_description(folder, name, fmi):
    validation = pytest.importorskip("fmpy.validation", reason="FMPy is not installed")
    assert validation.validate_fmu(written(folder, name, fmi, compiled=False)) == []


@pytest.mark.parametrize("name", DAMPERS)
def test_the_reference_is_the_stepper_on_exact_times(name):
    known, steps = reference(stream(DAMPERS[name])), stepper(DAMPERS[name])
    assert np.log2(known.step).is_integer()
    assert np.log2(known.internal_step).is_integer()
    count = round(known.step / known.internal_step)
    at = np.arange(count * (known.force.size - 2) + 1) / count
    rows = [np.interp(at, np.arange(known.force.size), channel) for channel in (known.displacement, known.current)]
    first = [(rows[0][0], rows[1][0])] * (count - 1)  # there is no row to come from: it is held
    samples = [*first, *zip(*rows, strict=True)]
    force = [steps.step(float(x), float(current), known.internal_step) for x, current in samples]
    # np.interp rounds the points between otherwise: the force follows by a few units in the last place.
    np.testing.assert_allclose(force[count - 1 :: count], known.force[1:], atol=1e-10 * np.abs(known.force).max())
    assert known.force[0] == stepper(DAMPERS[name]).step(float(known.displacement[0]), float(known.current[0]), 1.0)


def test_the_reference_stays_inside_the_tested_ranges():
    for name in ("joint", "modified"):
        assert not (reference(stream(DAMPERS[name])).flags & 0b111).any()


@pytest.mark.parametrize("fmi", FMIS)
def test_variables_say_their_unit_range_and_meaning(fmi):
    found = variables("joint", fmi)
    for info in DAMPERS["joint"].model.parameters():
        variable = found[info.name]
        facts = {**variable.attrib, **(variable[0].attrib if fmi == 2 else {})}
        assert (facts["causality"], facts["variability"]) == ("parameter", "tunable")
        assert facts["unit"] == (info.unit if info.unit != "-" else "1")
        assert float(facts["start"]) == getattr(DAMPERS["joint"].model, info.name)
        assert facts["description"].lower() == info.meaning.lower()
        for key, bound in zip(("min", "max"), info.bounds, strict=True):
            assert float(facts.get(key, "-inf" if key == "min" else "inf")) == bound


@pytest.mark.parametrize("name", ["bouc-wen", "bouc-wen, n = 1.6"])
def test_a_parameter_the_program_is_traced_on_is_a_constant(name):
    """The stroke map of one n is not that of another: it needs another program."""
    found = variables(name)
    assert (found["n"].get("causality"), found["n"].get("variability")) == ("local", "constant")
    assert {found[other].get("variability") for other in ("c", "alpha", "beta", "gamma")} == {"tunable"}


@pytest.mark.parametrize("name", few_or_slow)
def test_what_is_tunable_gives_what_a_damper_of_that_value_gives(name):
    damper = DAMPERS[name]
    made = stream(damper)
    rows = [*zip(*(c[:100].tolist() for c in reference_motion(made)[:2]), strict=True)]
    for info, free in parameters_of_stream(made):
        value = getattr(made.model, info.name)
        near = next(v for v in (value * 1.01 or 1e-3, value * 0.99) if info.bounds[0] <= v <= info.bounds[1])
        if free:
            model = replace(made.model, **{info.name: near})
            fresh, tuned = stepper(replace(damper, model=model) if name == "joint" else model), stepper(damper)
            tuned.set_parameters(**{info.name: near})
            assert [tuned.step(*row, 1e-3) for row in rows] == [fresh.step(*row, 1e-3) for row in rows]


def test_functions_of_the_condition_cannot_be_tuned():
    assert {n for n, v in variables("modified").items() if v.get("causality") == "parameter"} == {
        "drive",
        "internal_step",
    }


@pytest.mark.parametrize(
    ("unit", "powers"),
    [
        ("N s/m", {"kg": 1, "s": -1}),
        ("N s/m/A", {"kg": 1, "s": -1, "A": -1}),
        ("1/m^2", {"m": -2}),
        ("N/m^3", {"kg": 1, "m": -2, "s": -2}),
        ("1", {}),
    ],
)
def test_units_are_powers_of_the_base_units(unit, powers):
    assert dict(base_powers(unit)) == powers


def test_a_power_that_is_a_parameter_is_filled_in_where_it_is_whole():
    assert variables("bouc-wen")["beta"].get("unit") == "1/m^2"
    assert variables("bouc-wen, n = 1.6")["beta"].get("unit") == "m^-n"
    assert base_powers("m^-n") is None


def test_every_model_has_parameters_of_known_units_and_names_of_their_own():
    taken = set(variables("modified"))
    for name, damper in DAMPERS.items():
        for info in getattr(damper, "model", damper).parameters() if name not in ("modified", "conditioned") else ():
            assert info.unit in ("-", "m^-n") or base_powers(info.unit) is not None, (name, info)
            assert info.name not in taken


@pytest.mark.parametrize("fmi", FMIS)
def test_the_same_damper_gives_the_same_bytes(fmi):
    again = FMUExporter(fmi, ()).export(joint_damper(), "damper").files["damper.fmu"]
    assert again == fmu_bytes("joint", fmi, compiled=False)


@needs_compiler
def test_the_same_sources_give_the_same_binary():
    sources = {
        "a.c": b'#include <math.h>\n__attribute__((visibility("default"))) double f(double x) { return pow(x, x); }\n'
    }
    assert build_library(sources, here()) == build_library(sources, here())


def test_another_parameter_gives_another_token():
    other = replace(DAMPERS["bingham"], c=1501.0)
    texts = [FMUExporter(3, ()).export(d, "damper").files["damper.fmu"] for d in (DAMPERS["bingham"], other)]
    tokens = [ElementTree.fromstring(unpacked(t)["modelDescription.xml"]).get("instantiationToken") for t in texts]
    assert tokens[0] != tokens[1]


def test_texts_that_could_break_xml_c_or_html_stay_text(folder):
    rig = 'a "rig" <b>&amp; */ ]]> \x00\x0b\\ é\n#error'
    damper = replace(joint_damper(), rig=rig)
    files = unpacked(FMUExporter(3, ()).export(damper, "damper").files["damper.fmu"])
    root = ElementTree.fromstring(files["modelDescription.xml"])
    assert 'a "rig" <b>&amp; */ ]]>' in root.get("description")
    assert b"<b>" not in files["documentation/index.html"]
    assert b"*/ ]]>" not in files["sources/damper.h"]


def test_without_a_compiler_the_sources_leave_with_a_note(monkeypatch):
    monkeypatch.setattr(toolchain, "compiler_for", lambda platform: ())
    written = FMUExporter(2).export(joint_damper(), "damper")
    assert not [path for path in unpacked(written.files["damper.fmu"]) if path.startswith("binaries/")]
    assert written.notes == (
        "no binary for x86_64-linux, x86_64-windows, x86_64-darwin: no compiler for it; pip install ziglang",
        "the FMU holds sources alone; the importer has to compile them",
    )


@needs_compiler
def test_what_a_compiler_says_becomes_the_note():
    platform = PLATFORMS[0]
    built = build_library({"a.c": b"int f(void) { return nowhere; }\n"}, platform, (COMPILERS[0],))
    assert built.library is None
    assert "nowhere" in built.reason
    assert "No such file" in build_library({}, platform, ("/no/such/compiler",)).reason


@pytest.mark.parametrize(
    ("options", "code"), [({"fmi": 1}, "E_FMI_VERSION"), ({"platforms": ("amiga",)}, "E_PLATFORM")]
)
def test_options_that_do_not_exist_are_refused(options, code):
    with pytest.raises(InputError) as caught:
        FMUExporter(**options)
    assert caught.value.code == code


class Logged:
    """An instance in FMPy, step by step, with what it logs."""

    def __init__(self, path, fmi, folder):
        fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed")
        from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
        from fmpy.fmi3 import FMU3Slave

        described = fmpy.read_model_description(path)
        self.fmi, self.messages = fmi, []
        self.references = {v.name: v.valueReference for v in described.modelVariables}
        facts = dict(
            guid=described.guid if fmi == 2 else described.instantiationToken,
            unzipDirectory=fmpy.extract(path, str(folder)),
            modelIdentifier=described.coSimulation.modelIdentifier,
            instanceName="logged",
        )
        if fmi == 2:
            self.fmu = FMU2Slave(**facts)
            self.callbacks = fmi2CallbackFunctions()
            self.callbacks.logger = fmi2CallbackLoggerTYPE(lambda e, n, s, c, text: self.messages.append(text.decode()))
            self.fmu.instantiate(callbacks=self.callbacks)
            self.fmu.setupExperiment()
        else:
            self.fmu = FMU3Slave(**facts)
            self.fmu.instantiate(logMessage=lambda e, s, c, text: self.messages.append(text.decode()))
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def set(self, name, value):
        (self.fmu.setReal if self.fmi == 2 else self.fmu.setFloat64)([self.references[name]], [value])

    def get(self, name):
        return (self.fmu.getReal if self.fmi == 2 else self.fmu.getFloat64)([self.references[name]])[0]

    def step(self, dt, time=0.0):
        self.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=dt)


@pytest.fixture
def logged(folder, tmp_path, request):
    instance = Logged(written(folder, "joint", request.param), request.param, tmp_path)
    yield instance
    instance.fmu.terminate()
    instance.fmu.freeInstance()


@needs_compiler
@pytest.mark.parametrize("logged", FMIS, indirect=True)
def test_what_has_no_answer_is_refused_logged_and_leaves_the_state(logged):
    from fmpy.fmi1 import FMICallException

    def refused(text, action, *arguments):
        logged.messages.clear()
        with pytest.raises(FMICallException):
            action(*arguments)
        assert text in logged.messages[-1]
        assert logged.get("force") == force

    logged.set("displacement", 1e-3)
    logged.step(1e-3)
    force = logged.get("force")
    for bad in (np.nan, np.inf, -np.inf):
        refused("give a finite number", logged.set, "displacement", bad)
        refused("give a finite number", logged.set, "c0", bad)
    assert logged.get("displacement") == 1e-3
    refused("has to be positive", logged.step, 0.0)
    refused("has to be positive", logged.step, -1e-3)
    refused("give finite times", logged.step, np.nan)
    refused("give finite times", logged.step, 1e-3, np.inf)
    refused("too many internal steps", logged.step, 1e9)
    refused("outside its bounds", logged.set, "c0", -1.0)
    refused("has to be 1e-06 s or more", logged.set, "internal_step", 0.0)
    refused("no variable of this type", logged.set, "force", 1.0)
    logged.step(1e-3)
    expected = stepper(DAMPERS["joint"])
    assert [expected.step(1e-3, 0.0, 1e-3) for _ in range(2)][1] == logged.get("force")


@needs_compiler
@pytest.mark.parametrize("logged", FMIS, indirect=True)
def test_a_force_that_is_not_finite_is_an_error_and_not_a_number(logged):
    from fmpy.fmi1 import FMICallException

    logged.set("displacement", 1e308)
    with pytest.raises(FMICallException):
        logged.get("force")  # the look before the first step
    logged.set("displacement", 1e-3)
    logged.step(1e-3)
    force = logged.get("force")
    logged.set("displacement", 1e308)
    with pytest.raises(FMICallException):
        logged.step(1e-3)
    assert "no finite force" in logged.messages[-1]
    assert logged.get("force") == force


@needs_compiler
@pytest.mark.parametrize("logged", FMIS, indirect=True)
def test_parameters_tuned_between_steps_act_from_the_next_step(logged):
    expected = stepper(DAMPERS["joint"])
    for k in range(20):
        if k == 10:
            logged.set("c0", 900.0)
            expected.set_parameters(c0=900.0)
        logged.set("displacement", 1e-3 * k)
        logged.step(1e-3, k * 1e-3)
        assert logged.get("force") == expected.step(1e-3 * k, 0.0, 1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("fmi", FMIS)
def test_zig_adds_the_other_platforms(fmi, tmp_path):
    pytest.importorskip("ziglang", reason="ziglang is not installed")
    files = unpacked(FMUExporter(fmi).export(joint_damper(), "damper").files["damper.fmu"])
    magic = {".so": b"\x7fELF", ".dll": b"MZ", ".dylib": b"\xcf\xfa\xed\xfe"}
    for platform in PLATFORMS:
        if fmi == 3 or platform.fmi2:
            folder = platform.fmi2 if fmi == 2 else platform.name
            assert files[f"binaries/{folder}/damper{platform.suffix}"].startswith(magic[platform.suffix])


@pytest.mark.slow
def test_zig_stands_in_where_there_is_no_other_compiler(monkeypatch, folder, tmp_path):
    pytest.importorskip("ziglang", reason="ziglang is not installed")
    pytest.importorskip("fmpy", reason="FMPy is not installed")
    monkeypatch.setattr(shutil, "which", lambda name: None)
    platform = here()
    assert "ziglang" in compiler_for(platform)
    path = tmp_path / "zig.fmu"
    path.write_bytes(FMUExporter(3, (platform.name,)).export(joint_damper(), "damper").files["damper.fmu"])
    known = reference(stream(joint_damper()))
    # The C library's own functions are called, so even here no bit differs.
    assert np.array_equal(simulated(str(path), "joint", 3)["force"], known.force)
