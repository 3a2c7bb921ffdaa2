"""mrdamper: from magnetorheological damper test records to a validated model.

>>> from mrdamper import Condition, load_dataset, run_study
>>> study = run_study(load_dataset())
>>> prediction = study.rig("utfsm").damper.predict(Condition(current_A=0.5, frequency_Hz=2.0, amplitude_m=0.01))
>>> prediction.force.shape == prediction.motion.time.shape
True
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # here type checkers find the names, which "as" exports; everybody else in _HOME
    from mrdamper.dampers.base import Damper as Damper
    from mrdamper.dampers.model_file import load_model as load_model
    from mrdamper.dampers.model_file import save_model as save_model
    from mrdamper.dampers.prediction import Prediction as Prediction
    from mrdamper.dampers.streaming import stepper as stepper
    from mrdamper.data import Condition as Condition
    from mrdamper.data import Dataset as Dataset
    from mrdamper.data import Run as Run
    from mrdamper.discovery import register as register
    from mrdamper.errors import InputError as InputError
    from mrdamper.exporters import export as export
    from mrdamper.fleet.run import run_fleet as run_fleet
    from mrdamper.paper.study import reproduce as reproduce
    from mrdamper.physics.gas_spring import GasSpring as GasSpring
    from mrdamper.physics.motion import Excitation as Excitation
    from mrdamper.physics.motion import sine as sine
    from mrdamper.physics.motion import sweep as sweep
    from mrdamper.physics.simulation import simulate as simulate
    from mrdamper.report.plots.loops import plot_force as plot_force
    from mrdamper.report.plots.loops import plot_loop as plot_loop
    from mrdamper.rig_files.dataset_folder import load_dataset as load_dataset
    from mrdamper.rig_files.dataset_folder import save_dataset as save_dataset
    from mrdamper.rig_files.rig_import import import_files as import_files
    from mrdamper.study.check import check as check
    from mrdamper.study.check import identify as identify
    from mrdamper.study.comparison import compare as compare
    from mrdamper.study.plan import plan_tests as plan_tests
    from mrdamper.study.validation import validate as validate
    from mrdamper.study.workflow import run_study as run_study
    from mrdamper.systems.inputs import load_input as load_input
    from mrdamper.systems.inverse import invert as invert
    from mrdamper.systems.simulate import simulate_system as simulate_system
    from mrdamper.systems.system_file import load_system as load_system

_HOME = {
    "Condition": "data",
    "Damper": "dampers.base",
    "Dataset": "data",
    "Excitation": "physics.motion",
    "GasSpring": "physics.gas_spring",
    "InputError": "errors",
    "Prediction": "dampers.prediction",
    "Run": "data",
    "check": "study.check",
    "compare": "study.comparison",
    "export": "exporters",
    "identify": "study.check",
    "import_files": "rig_files.rig_import",
    "invert": "systems.inverse",
    "load_dataset": "rig_files.dataset_folder",
    "load_input": "systems.inputs",
    "load_model": "dampers.model_file",
    "load_system": "systems.system_file",
    "plan_tests": "study.plan",
    "plot_force": "report.plots.loops",
    "plot_loop": "report.plots.loops",
    "register": "discovery",
    "reproduce": "paper.study",
    "run_fleet": "fleet.run",
    "run_study": "study.workflow",
    "save_dataset": "rig_files.dataset_folder",
    "save_model": "dampers.model_file",
    "simulate": "physics.simulation",
    "simulate_system": "systems.simulate",
    "sine": "physics.motion",
    "stepper": "dampers.streaming",
    "sweep": "physics.motion",
    "validate": "study.validation",
}
__all__ = list(_HOME)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    # Names are looked up on first use: the command line's --help needs none of them.
    if name in _HOME:
        return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
    if name == "__version__":
        return importlib.import_module("importlib.metadata").version(__name__)
    models = importlib.import_module(f"{__name__}.models") if name[:1].isupper() else None
    if models and name in dir(models):  # the class of a model: from mrdamper import BoucWen
        return getattr(models, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}{_near(name, dir(models) if models else [])}")


def _near(name: str, classes: list[str]) -> str:
    """Return the public names that begin or end so, or whose spelling is near, as the end of an error message."""
    spelled = {public.lower(): public for public in (*_HOME, *(c for c in classes if c[:1].isupper()))}
    close = importlib.import_module("difflib").get_close_matches(name.lower(), spelled, n=2, cutoff=0.85)
    near = [
        public
        for lower, public in spelled.items()
        if lower in close or (len(name) > 3 and (lower.startswith(name.lower()) or lower.endswith(f"_{name.lower()}")))
    ]
    return f"; did you mean {' or '.join(near)}?" if near else ""


def __dir__() -> list[str]:
    return sorted([*_HOME, "__version__", *(name for name in globals() if name.startswith("__"))])
