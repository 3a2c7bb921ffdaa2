"""mrdamper: from magnetorheological damper test records to a validated model.

>>> from mrdamper import Condition, load_dataset, run_study
>>> study = run_study(load_dataset())
>>> prediction = study.rig("utfsm").damper.predict(Condition(current_A=0.5, frequency_Hz=2.0, amplitude_m=0.01))
>>> prediction.force.shape == prediction.motion.time.shape
True
"""

from __future__ import annotations

# ruff: noqa: F401  type checkers take the names from the imports, everybody else from _HOME
import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mrdamper.dampers.base import Damper
    from mrdamper.dampers.model_file import load_model, save_model
    from mrdamper.dampers.prediction import Prediction
    from mrdamper.dampers.streaming import stepper
    from mrdamper.data import Condition, Dataset, Run
    from mrdamper.discovery import register
    from mrdamper.errors import InputError
    from mrdamper.export import export_model
    from mrdamper.fleet.run import run_fleet
    from mrdamper.paper.study import reproduce
    from mrdamper.physics.gas_spring import GasSpring
    from mrdamper.physics.motion import Excitation, sine, sweep
    from mrdamper.physics.simulation import simulate
    from mrdamper.report.plots.loops import plot_force, plot_loop
    from mrdamper.rig_files.dataset_folder import load_dataset, save_dataset
    from mrdamper.rig_files.rig_import import import_files
    from mrdamper.study.check import check, identify
    from mrdamper.study.comparison import compare
    from mrdamper.study.plan import plan_tests
    from mrdamper.study.validation import validate
    from mrdamper.study.workflow import run_study
    from mrdamper.systems.inputs import load_input
    from mrdamper.systems.inverse import invert
    from mrdamper.systems.simulate import simulate_system
    from mrdamper.systems.system_file import load_system

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
    "export_model": "export",
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
    if name[:1].isupper():  # the class of a model: from mrdamper import BoucWen
        return getattr(importlib.import_module(f"{__name__}.models"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME, "__version__"])
