"""Whatever is given to a public function, what comes back is an answer or an error with a code."""

import numpy as np
import pytest

import mrdamper
from mrdamper import Condition, Dataset, GasSpring, InputError, Run
from mrdamper.models.bingham import Bingham

ODD = [
    None, "x", "=cmd", b"x", 1j, float("nan"), float("inf"), -1, 0, 1e300, 1e-300, 10**5000, True, [], {}, (), object(),
    np.array([]), np.array([None]), np.zeros((3, 3)),
]  # fmt: skip


def doors():
    """Every public function and class, and the methods a damper is asked by, each with one argument left open."""
    dataset = mrdamper.load_dataset()
    run, damper = dataset["utf_5mm4Hz_1A"], mrdamper.load_system("dyke1996").dampers["mr"]
    t, x, F = run.time, run.displacement, run.force
    stepped, inverse = mrdamper.stepper(damper), mrdamper.invert(damper)
    motion = damper.predict_run(run).motion
    frame, quake = mrdamper.load_system("dyke1996").system, mrdamper.load_input("elcentro")
    return {
        "Condition": [lambda o: Condition(o, 1.0, 0.01), lambda o: Condition(0, o, 0.01), lambda o: Condition(0, 1, o)],
        "GasSpring": [
            lambda o: GasSpring(o, 1.0, 1.0), lambda o: GasSpring(1e5, o, 1.0), lambda o: GasSpring(1e5, 1.0, o),
        ],
        "Run": [
            lambda o: Run(o, t, x, F, 0.0), lambda o: Run("a", o, x, F, 0.0), lambda o: Run("a", t, o, F, 0.0),
            lambda o: Run("a", t, x, o, 0.0), lambda o: Run("a", t, x, F, o),
        ],
        "Dataset": [Dataset, lambda o: Dataset([o]), lambda o: dataset[o], dataset.rig],
        "predict": [damper.predict, damper.predict_run],
        "identify": [
            lambda o: mrdamper.identify(o, "bingham"), lambda o: mrdamper.identify(run, o),
            lambda o: mrdamper.identify(run, "bingham", o),
        ],
        "stepper": [
            mrdamper.stepper, lambda o: stepped.step(o, 0.5, 1e-3), lambda o: stepped.step(0.0, o, 1e-3),
            lambda o: stepped.step(0.0, 0.5, o), lambda o: stepped.step_velocity(o, 0.5, 1e-3),
            lambda o: stepped.step_motion(0.0, o, 0.0, 0.5, 1e-3),
        ],
        "invert": [mrdamper.invert, lambda o: inverse.step(o, 0.01, 0.0, 200.0, 1e-3)],
        "a model": [lambda o: Bingham(c=o, fy=300.0)],
        "simulate": [lambda o: mrdamper.simulate(o, motion), lambda o: mrdamper.simulate(Bingham(c=1e3, fy=300.0), o)],
        "simulate_system": [
            lambda o: mrdamper.simulate_system(o, quake, {}), lambda o: mrdamper.simulate_system(frame, o, {}),
            lambda o: mrdamper.simulate_system(frame, quake, o) if not isinstance(o, dict) else None,
        ],
        "validate": [
            lambda o: mrdamper.validate(o, [run]), lambda o: mrdamper.validate(damper, o),
            lambda o: mrdamper.validate(damper, [o]),
        ],
        "files": [
            mrdamper.load_model, mrdamper.load_input, mrdamper.load_system, lambda o: mrdamper.save_model(o, "x.json"),
            lambda o: mrdamper.save_model(damper, o) if not isinstance(o, str | bytes) else None,
            lambda o: mrdamper.save_dataset(o, "x"), lambda o: mrdamper.load_dataset(o) if o is not None else None,
        ],
        "run_study": [mrdamper.run_study],
        "plots": [mrdamper.plot_loop, mrdamper.plot_force, lambda o: mrdamper.plot_loop(run, over=o)],
    }  # fmt: skip


@pytest.mark.filterwarnings("ignore")
def test_every_door_answers_or_refuses_with_a_code(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    untyped = []
    for name, calls in doors().items():
        for number, call in enumerate(calls):
            for odd in ODD:
                try:
                    call(odd)
                except InputError:
                    continue
                except Exception as error:
                    untyped.append(f"{name} {number} of a {type(odd).__name__}: {error!r:.120}")
    assert not untyped, "\n".join(untyped)
    assert not list(tmp_path.iterdir())
