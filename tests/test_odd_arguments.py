"""Whatever is given to a public function, what comes back is an answer or an error with a code."""

import inspect
from decimal import Decimal
from typing import TypeVar

import numpy as np
import pytest
from support.dampers import conditioned_damper, joint_damper, modified_damper

import mrdamper
from mrdamper import Condition, Dataset, GasSpring, InputError, Run
from mrdamper.errors import shown, validate_arguments
from mrdamper.models.bingham import Bingham
from mrdamper.physics.motion import sine
from mrdamper.study.processes import IN_PROCESS
from mrdamper.systems.structure import Link, System


def test_a_refused_argument_is_stated_in_a_line_with_what_is_wanted():
    joint = joint_damper()
    cases = (
        (lambda: mrdamper.validate(joint, joint), "give it as Iterable[Run]"),
        (lambda: mrdamper.plan_tests(joint, hour=1), "= ...); see help(plan_tests)"),
        (lambda: Condition(0.5, 2.0, 6.130609100440717), "amplitude is 6.1306091 m"),
    )
    for call, text in cases:
        with pytest.raises(InputError) as refusal:
            call()
        assert text in str(refusal.value)
        assert "\n" not in str(refusal.value)
        assert "\\x0a" not in str(refusal.value)
        assert " at 0x" not in str(refusal.value)


class Frame:
    """A table of another library: neither a number nor a sequence of them."""

    shape, columns = (2, 2), ["a", "b"]

    def __array__(self, *_, **__):
        raise TypeError("no plain array")


ODD = [
    None, True, "", "x", "1e5", "a\0b", "\ud800", "=cmd", "a" * 5000, b"x", -1, -0.0, 0.5, 1e300, 1e-300, 5e-324,
    float("nan"), float("inf"), -float("inf"), 1j, 10**5000, Decimal("1e-9"), [], [1.0, 2.0], ["a"],
    [[1.0], [1.0, 2.0]], [None], {}, {"a": 1}, {"c": "x"}, {1: 2.0}, (), (1.0,), {1, 2}, iter(()), object(),
    Frame(), int, len,
    np.array([]), np.array([None]), np.zeros((3, 3)), np.zeros(3), np.full(200, np.nan), np.array("a"),
    np.array([1j, 2]), np.ma.masked_array([1.0, 2.0], [True, False]), np.datetime64("2024-01-01"), np.zeros(10**5),
]  # fmt: skip


def made_run(name, current=0.5):
    motion = sine(Condition(current, 1.0, 0.01), 2, 100)
    force = 1e3 * motion.velocity + 300 * np.sign(motion.velocity)
    return Run(name, motion.time, motion.displacement, force, current, rig="bench")


def doors(folder):
    """Every public function and class, and the methods of what they give: each with arguments that suit it."""
    runs = made_run("r0", 0.0), made_run("r1", 0.5)
    run, condition = runs[0], Condition(0.5, 1.0, 0.01)
    dataset, bingham = Dataset(runs), Bingham(c=1e3, fy=300.0)
    t, motion = run.time, sine(condition, 1, 40)
    x, v, a = motion.displacement, motion.velocity, motion.acceleration
    joint, rides = joint_damper("bouc-wen"), joint_damper()
    system = mrdamper.load_system("quarter-car").system
    bump = mrdamper.load_input("bump", {"length_s": 0.3, "height_m": 0.01})
    dampers = {"damper": rides}
    simulation = mrdamper.simulate_system(system, bump, dampers, step=2e-3)
    identified = mrdamper.identify(run, "bingham")
    scores = mrdamper.validate(joint, runs)
    stepped, inverse = mrdamper.stepper(joint), mrdamper.invert(rides)
    gas = GasSpring(2e6, 1e-4, 8e-5)
    masses = {"name": "s", "title": "s", "coordinates": ("a",), "M": [[1.0]], "C": [[0.0]], "K": [[1.0]]}
    along = {"time": motion.time, "displacement": x, "velocity": v, "acceleration": a}
    found = {
        "Condition": (Condition, {"current_A": 0.5, "frequency_Hz": 1.0, "amplitude_m": 0.01}),
        "GasSpring": (
            GasSpring, {"pressure": 2e6, "volume": 1e-4, "rod_area": 8e-5, "force_area": None, "exponent": 1.4},
        ),
        "GasSpring.force": (gas.force, {"compression": 0.01}),
        "GasSpring.stiffnesses": (gas.stiffnesses, {"positive": "extension"}),
        "GasSpring.taylor_error": (gas.taylor_error, {"amplitude": 0.01}),
        "Run": (Run, {
            "id": "r", "time": t, "displacement": run.displacement, "force": run.force, "current": 0.5,
            "velocity": None, "rig": "", "excitation": "sine", "split": "train", "nominal": None,
            "window": None, "repeatability": None,
            "segments": (), "further": {}, "notes": {},
        }),
        "Run.part": (run.part, {"start": 0, "stop": 50}),
        "Dataset": (Dataset, {"runs": runs, "name": "d"}),
        "Dataset.rig": (dataset.rig, {"name": "bench"}),
        "Dataset.split": (dataset.split, {"split": "train"}),
        "Dataset.only": (dataset.only, {"runs": runs, "name": None}),
        "Dataset[]": (dataset.__getitem__, {"run_id": "r0"}),
        "identify": (mrdamper.identify, {
            "run": run, "model": "bingham", "method": "projection", "free": (), "fixed": None, "gas": None,
            "with_delay": False, "clipped": False,
        }),
        "Identification.interval": (identified.interval, {"name": "c", "level": 0.9}),
        "invert": (mrdamper.invert, {"damper": rides, "highest": None}),
        "Inverse.step": (inverse.step, {
            "displacement": 0.0, "velocity": 0.01, "acceleration": 0.0, "wanted": 200.0, "dt": 1e-3,
        }),
        "Inverse.along": (inverse.along, {**along, "wanted": 100 * v}),
        "load_dataset": (mrdamper.load_dataset, {"folder": folder / "none"}),
        "load_model": (mrdamper.load_model, {"path": folder / "none"}),
        "load_system": (mrdamper.load_system, {"name": "quarter-car"}),
        "load_input": (mrdamper.load_input, {"name": "bump", "values": {}, "time_scale": 1.0}),
        "save_model": (mrdamper.save_model, {"damper": joint, "path": folder / "none" / "m.json"}),
        "save_dataset": (mrdamper.save_dataset, {
            "dataset": dataset, "folder": folder / "d", "extra_files": None, "replace": True,
        }),
        "a model": (Bingham, {"c": 1e3, "fy": 300.0, "f0": 0.0}),
        "simulate": (mrdamper.simulate, {"model": bingham, "excitation": motion}),
        "simulate_system": (mrdamper.simulate_system, {
            "system": system, "source": bump, "dampers": dampers, "controller": None, "step": 2e-3, "highest": None,
        }),
        "Simulation.span": (simulation.span, {"name": "travel"}),
        "Simulation.acceleration_of": (simulation.acceleration_of, {"point": "body"}),
        "System": (System, masses | {
            "channels": ("ground",), "ground": None, "push": None, "behind": (0.0,), "links": (), "points": {},
            "spans": {},
        }),
        "System.point": (system.point, {"name": "body"}),
        "System.span": (system.span, {"above": "body", "below": "wheel"}),
        "Link": (Link, {
            "name": "a", "above": "a", "below": "b", "role": "stop", "stiffness": 1.0, "damping": 0.0, "gap": 0.0,
        }),
        "stepper": (mrdamper.stepper, {"damper": joint}),
        "Stepper.step": (stepped.step, {"displacement": 0.0, "current": 0.5, "dt": 1e-3}),
        "Stepper.step_velocity": (stepped.step_velocity, {"velocity": 0.1, "current": 0.5, "dt": 1e-3}),
        "Stepper.step_motion": (stepped.step_motion, {
            "displacement": 0.0, "velocity": 0.1, "acceleration": 0.0, "current": 0.5, "dt": 1e-3,
        }),
        "Stepper.run": (stepped.run, {**along, "current": 0.5}),
        "Stepper.set_parameters": (stepped.set_parameters, {"c": 1e3}),
        "Stepper.state": (lambda state: setattr(stepped, "state", state), {"state": stepped.state}),
        "validate": (mrdamper.validate, {"damper": joint, "runs": runs, "title": None, "sessions": None}),
        "Validation.median": (scores.median, {"name": "nrmse_pp"}),
        "Validation.worst": (scores.worst, {"name": "nrmse_pp"}),
        "Validation.worst_error": (scores.worst_error, {"name": "nrmse_pp"}),
        "Validation.only": (scores.only, {"run_ids": ["r0"]}),
        "Excitation.about": (motion.about, {"centre": 0.0}),
        "Excitation.delayed": (motion.delayed, {"delay": 0.01}),
        "Excitation.with_current": (motion.with_current, {"current": 0.5}),
        "run_study": (mrdamper.run_study, {
            "dataset": dataset, "progress": print, "model": "none such", "processes": IN_PROCESS, "keep": (),
        }),
        "check": (mrdamper.check, {"dataset": dataset}),
        "sine": (mrdamper.sine, {"condition": condition, "cycles": 1.0, "samples_per_cycle": 20}),
        "sweep": (mrdamper.sweep, {
            "start_Hz": 1.0, "end_Hz": 2.0, "duration": 1.0, "amplitude": 0.01, "current": 0.0, "sample_rate": 100.0,
        }),
        "export": (mrdamper.export, {"damper": joint, "to": "none such", "out": folder / "e", "name": "d"}),
        "register": (mrdamper.register, {"cls": Bingham}),
        "plot_loop": (mrdamper.plot_loop, {"what": run, "axes": None, "over": "displacement"}),
        "plot_force": (mrdamper.plot_force, {"what": run, "axes": None}),
    }  # fmt: skip
    for kind, damper in {"joint": joint, "modified": modified_damper(), "published": conditioned_damper()}.items():
        found |= {
            f"{kind}.predict": (damper.predict, {"at": condition}),
            f"{kind}.predict of a run": (damper.predict, {"at": run}),
            f"{kind}.loop": (damper.loop, {"condition": condition}),
            f"{kind}.force_along": (damper.force_along, {"motion": motion, "condition": condition}),
        }
    return found


RESULTS = ("Damper", "Excitation", "Prediction")  # classes that the functions return
LONG = (
    "compare",
    "import_files",
    "plan_tests",
    "reproduce",
    "run_fleet",
)  # tried by fuzz.attack through their commands


def said(error):
    """What an error says; NumPy and Python put the argument into it, which may have no text."""
    try:
        return f"{type(error).__name__} {error!s:.90}"
    except ValueError:
        return type(error).__name__


@pytest.mark.filterwarnings("ignore")
def test_every_argument_of_every_door_is_answered_or_refused_with_a_code(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    untyped = []
    for name, (call, suits) in doors(tmp_path).items():
        for argument in suits:
            for odd in ODD:
                try:
                    call(**{**suits, argument: odd})
                except InputError:
                    continue
                except Exception as error:
                    untyped.append(f"{name}({argument}={shown(odd)}): {said(error)}")
    assert not untyped, "\n".join(untyped)
    assert not list(tmp_path.rglob(".*"))  # nothing half-written


def test_no_door_and_no_argument_is_forgotten(tmp_path):
    known = doors(tmp_path)
    assert set(mrdamper.__all__) - {"InputError", *RESULTS, *LONG} <= set(known)
    for name, (call, suits) in known.items():
        try:
            parameters = inspect.signature(call).parameters.values()
        except ValueError:
            continue  # a model's own
        wanted = {p.name for p in parameters if p.kind is not p.VAR_KEYWORD}
        assert wanted <= set(suits), name


@pytest.mark.parametrize("name", [name for name in LONG if name != "import_files"])
def test_arguments_of_the_wrong_kind_are_refused_before_anything_long_begins(name):
    parameters = list(inspect.signature(getattr(mrdamper, name)).parameters)
    with pytest.raises(InputError, match=f"^{parameters[0]} is <object .*; give it as") as refusal:
        getattr(mrdamper, name)(**dict.fromkeys(parameters, object()))
    assert refusal.value.code == "E_ARGUMENT"


@pytest.mark.parametrize("paths", [None, 3, [3], [], object()])
def test_what_is_no_path_is_not_imported(paths):
    with pytest.raises(InputError, match="give it as a path or several") as refusal:
        mrdamper.import_files(paths)
    assert refusal.value.code == "E_ARGUMENT"


def test_a_folder_in_place_of_a_dataset_is_answered_with_what_reads_it():
    with pytest.raises(InputError, match=r"'rig/'; give it as Dataset, which mrdamper.load_dataset\(folder\) reads"):
        mrdamper.run_study("rig/")


def test_annotations_of_numpy_that_are_aliases_take_arrays():
    """NumPy 2.5 makes them aliases of their own kind, which an older one does not have."""

    def total(masses):
        return float(np.sum(masses))

    alias = TypeVar("alias")
    alias.__module__ = "numpy._typing._array_like"
    total.__annotations__["masses"] = alias
    assert validate_arguments()(total)([300.0, 40.0]) == validate_arguments()(total)(np.array([300.0, 40.0])) == 340.0
    with pytest.raises(InputError, match=r"masses is 'heavy'"):
        validate_arguments()(total)("heavy")


def test_arguments_that_a_function_does_not_have_are_answered_with_those_it_has():
    damper, t = joint_damper(), np.arange(100) / 100
    for call, says in (
        (lambda: damper.predict(t, t, t), r"Damper\.predict: too many positional .*; call predict\("),
        (lambda: mrdamper.identify(run="r", models="bingham"), r"identify: .*'models'; call identify\(run: Run, model"),
        (
            lambda: Condition(current=0.5, frequency=2, amplitude=10),
            "argument 'current'; write Condition.current_A=",
        ),
        (lambda: mrdamper.identify(t, t, t), "a ndarray in place of a run"),
        (lambda: mrdamper.data.Dataset("mine", ()), "runs is 'mine'; give it as"),
    ):
        with pytest.raises(InputError, match=says):
            call()
