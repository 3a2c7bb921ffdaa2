"""Inputs of a system: ground motions and roads, one file each."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path

from mrdamper.data.atomic import path_of
from mrdamper.data.parameters import parameters_of, with_values
from mrdamper.discovery import Registry
from mrdamper.errors import RecordError, UnknownNameError, validate_arguments
from mrdamper.systems.inputs.base import Input

__all__ = ["Input", "input_types", "load_input"]


_registry = Registry("mrdamper.inputs", Input, "input")
input_types = _registry.all


def bundled_records() -> dict[str, Path]:
    """List the records that ship with the package, by name."""
    folder = Path(str(files("mrdamper.data.bundled") / "records"))
    return {path.stem: path for path in sorted(folder.glob("*.csv"))}


def made_inputs() -> dict[str, tuple[type[Input], Mapping[str, float]]]:
    """List the synthetic inputs by all of their names, with the parameters of each name."""
    inputs: dict[str, tuple[type[Input], Mapping[str, float]]] = {}
    for name, kind in input_types().items():
        if parameters_of(kind):
            inputs |= {name: (kind, {}), **{variant: (kind, values) for variant, values in kind.variants().items()}}
    return inputs


@validate_arguments("name")
def load_input(name: str | Path, values: Mapping[str, float] | None = None, time_scale: float = 1.0) -> Input:
    """Return an input by name: a record's file, the name of a bundled record, or a synthetic input.

    Parameters
    ----------
    name : str or path
    values : mapping of str to float, optional
        Parameters of a synthetic input.
    time_scale : float
        Factor by which a record is played faster than recorded.

    Raises
    ------
    UnknownNameError, ParameterError, DatasetError, ColumnError, UnitError, RecordError
        If there is none of that name, or it cannot be used.

    Examples
    --------
    >>> from mrdamper import load_input
    >>> round(load_input("elcentro", time_scale=5).duration, 2)  # [s]
    10.75
    """
    from mrdamper.systems.inputs.record import load_record

    path_of(name)
    synthetic = made_inputs()
    if str(name) in synthetic:
        if time_scale != 1.0:
            raise RecordError("a time scale for a made input", where=str(name), remedy="set its own parameters instead")
        kind, preset = synthetic[str(name)]
        return with_values(kind, {**preset, **(values or {})})
    if values:
        raise RecordError(f"{', '.join(values)} for a record", where=str(name), remedy="leave them out")
    records = bundled_records()
    if str(name) not in records and Path(name).suffix != ".csv" and not Path(name).exists():
        raise UnknownNameError.of("input", str(name), [*synthetic, *records])
    return load_record(records.get(str(name), name), time_scale)
