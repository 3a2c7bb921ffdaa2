"""mrdamper: from magnetorheological damper test records to a validated model.

>>> from mrdamper import load_dataset, run_study
>>> study = run_study(load_dataset())
>>> study.rig("utfsm").damper.predict(Condition(0.5, 2.0, 0.01)).force
"""

from __future__ import annotations

# ruff: noqa: F401  type checkers take the names from the imports, everybody else from _HOME
import importlib
import sys
from typing import TYPE_CHECKING, Any

from mrdamper.discovery import MovedNames

if TYPE_CHECKING:
    from mrdamper.data import Condition, Dataset, Run
    from mrdamper.errors import InputError
    from mrdamper.files.dataset import load_dataset, save_dataset
    from mrdamper.files.model_file import load_model, save_model
    from mrdamper.gas_spring import GasSpring
    from mrdamper.identification import identify
    from mrdamper.report.plots.loops import plot_force, plot_loop
    from mrdamper.simulation import simulate
    from mrdamper.streaming import stepper
    from mrdamper.study.workflow import run_study
    from mrdamper.systems.inputs import load_input
    from mrdamper.systems.inverse import invert
    from mrdamper.systems.simulate import simulate_system
    from mrdamper.systems.system_file import load_system
    from mrdamper.validation import validate

_HOME = {
    "Condition": "data",
    "Dataset": "data",
    "GasSpring": "gas_spring",
    "InputError": "errors",
    "Run": "data",
    "identify": "identification",
    "invert": "systems.inverse",
    "load_dataset": "files.dataset",
    "load_input": "systems.inputs",
    "load_model": "files.model_file",
    "load_system": "systems.system_file",
    "plot_force": "report.plots.loops",
    "plot_loop": "report.plots.loops",
    "run_study": "study.workflow",
    "save_dataset": "files.dataset",
    "save_model": "files.model_file",
    "simulate": "simulation",
    "simulate_system": "systems.simulate",
    "stepper": "streaming",
    "validate": "validation",
}
__all__ = list(_HOME)  # pyright: ignore[reportUnsupportedDunderAll]

_moved = MovedNames(__name__)
sys.meta_path.insert(0, _moved)  # type: ignore[arg-type]


def __getattr__(name: str) -> Any:
    # Names are looked up on first use: the command line's --help needs none of them.
    if name in _HOME:
        return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
    if _moved.new_name(f"{__name__}.{name}"):
        return importlib.import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
