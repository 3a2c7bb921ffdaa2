"""mrdamper: from magnetorheological damper test records to a validated model.

>>> from mrdamper import load_dataset, run_study
>>> study = run_study(load_dataset())
>>> study.rig("utfsm").damper.predict(Condition(0.5, 2.0, 0.01)).force
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mrdamper.data import Condition, Dataset, Run
    from mrdamper.errors import InputError
    from mrdamper.files.dataset import load_dataset, save_dataset
    from mrdamper.files.model_file import load_model, save_model
    from mrdamper.gas_spring import GasSpring
    from mrdamper.identification import identify
    from mrdamper.simulation import simulate
    from mrdamper.streaming import stepper
    from mrdamper.study.workflow import run_study
    from mrdamper.validation import validate

_HOME = {
    "Condition": "data",
    "Dataset": "data",
    "GasSpring": "gas_spring",
    "InputError": "errors",
    "Run": "data",
    "identify": "identification",
    "load_dataset": "files.dataset",
    "load_model": "files.model_file",
    "run_study": "study.workflow",
    "save_dataset": "files.dataset",
    "save_model": "files.model_file",
    "simulate": "simulation",
    "stepper": "streaming",
    "validate": "validation",
}
__all__ = [
    "Condition",
    "Dataset",
    "GasSpring",
    "InputError",
    "Run",
    "identify",
    "load_dataset",
    "load_model",
    "run_study",
    "save_dataset",
    "save_model",
    "simulate",
    "stepper",
    "validate",
]


def __getattr__(name: str) -> Any:
    # Names are looked up on first use: the command line's --help needs none of them.
    if name in _HOME:
        return getattr(importlib.import_module(f"mrdamper.{_HOME[name]}"), name)
    raise AttributeError(f"module 'mrdamper' has no attribute {name!r}")
