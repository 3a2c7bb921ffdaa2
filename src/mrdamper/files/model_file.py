"""Saved models: a versioned JSON document, checked on the way in, with no code in it.

Numbers round-trip bit by bit. The document states units and where the model came from.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, astuple, fields, replace
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from mrdamper.dampers.base import Damper, Envelope
from mrdamper.dampers.coil import Coil, Driver
from mrdamper.dampers.joint import JointDamper
from mrdamper.dampers.modified import ModifiedModel
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.dampers.published import ConditionedDamper, conditioned_type
from mrdamper.data import Condition
from mrdamper.errors import InputError, ModelFileError
from mrdamper.files.atomic import write_file
from mrdamper.functions.forms import ParameterFunction
from mrdamper.models import model_type
from mrdamper.motion import sine

FORMAT = "mrdamper-model"
MAJOR, MINOR = 1, 2
UNITS = {
    "time": "s",
    "displacement": "m",
    "velocity": "m/s",
    "force": "N",
    "current": "A",
    "frequency": "Hz",
    "amplitude": "m",
}


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


Range = tuple[float, float]


class _Envelope(_Strict):
    current_A: Range
    frequency_Hz: Range
    amplitude_m: Range
    peak_velocity_m_s: Range


class _Driver(_Strict):
    amperes_per_volt: float
    resistance_ohm: float = 0.0
    inductance_H: float = 0.0
    limit_A: float | None = None


class _Coil(_Strict):
    rise_s: float
    fall_s: float
    driver: _Driver | None = None


class _Function(_Strict):
    form: str
    coefficients: tuple[float, ...]
    rates: tuple[float, ...] = ()
    log: bool = False
    formula: str = ""  # for the reader; the coefficients count


class _Modified(_Strict):
    kind: Literal["modified"]
    model: str
    functions: dict[str, _Function]


class _Joint(_Strict):
    kind: Literal["joint"]
    model: str
    parameters: dict[str, float]
    parameter_units: dict[str, str]  # for the reader
    free: tuple[str, ...]


class _Conditioned(_Strict):
    kind: Literal["conditioned"]
    model: str
    coefficients: dict[str, float]
    reference: tuple[float, float, float]  # current [A], frequency [Hz], amplitude [m]
    tables: dict[str, list[float] | list[list[float]]] = {}


class _Document(_Strict):
    format: Literal["mrdamper-model"]
    version: str
    rig: str
    units: dict[str, str]
    envelope: _Envelope
    provenance: dict[str, str]
    coil: _Coil | None = None  # since 1.2
    damper: _Modified | _Joint | _Conditioned = Field(discriminator="kind")


def save_model(damper: Damper, path: str | Path) -> None:
    """Write a damper as JSON, whole or not at all.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    with write_file(path) as target:
        target.write_text(dump_model(damper), encoding="utf-8")


def dump_model(damper: Damper) -> str:
    """The JSON document of a damper."""
    document = _Document(
        format=FORMAT,
        version=f"{MAJOR}.{MINOR}",
        rig=damper.rig,
        units=UNITS,
        envelope=_Envelope(**{name: getattr(damper.envelope, name) for name in _Envelope.model_fields}),
        provenance=dict(damper.provenance),
        coil=_describe_coil(damper.coil),
        damper=_describe(damper),
    )
    return json.dumps(document.model_dump(exclude_none=True), indent=1, ensure_ascii=False) + "\n"


def load_model(path: str | Path) -> Damper:
    """Read a saved damper.

    Raises
    ------
    ModelFileError
        If the file is missing, damaged, of a newer major version, or has unknown fields.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise ModelFileError(reason, where=str(path), mend="give a model.json written by mrdamper") from error
    return parse_model(text, where=str(path))


def parse_model(text: str, where: str = "model") -> Damper:
    """Read a damper from the text of its document; raises as `load_model`."""
    try:
        raw = json.loads(text)
    except json.JSONDecodeError as error:
        raise ModelFileError(
            f"not JSON at line {error.lineno}: {error.msg}", where=where, mend="copy the file again"
        ) from error
    if not isinstance(raw, dict) or raw.get("format") != FORMAT:
        raise ModelFileError("not a saved model", where=where, mend="give a model.json written by mrdamper")
    major = str(raw.get("version", "")).split(".")[0]
    if major.isdecimal() and int(major) > MAJOR:
        raise ModelFileError(
            f"written by a newer mrdamper (format {raw['version']}, this one reads {MAJOR}.x)",
            where=where,
            mend="update mrdamper",
        )
    try:
        document = _Document.model_validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(str(part) for part in first["loc"] if part not in ("modified", "joint", "conditioned"))
        raise ModelFileError(f"{field}: {first['msg']}", where=where, mend="write the model again") from error
    try:
        damper = _restore(document)
        return replace(damper, coil=_restore_coil(document.coil)) if document.coil else damper  # type: ignore[type-var]
    except InputError as error:
        raise ModelFileError(error.found, where=where, mend=error.mend) from error


def _describe_coil(coil: Coil | None) -> _Coil | None:
    if coil is None:
        return None
    driver = coil.driver and _Driver(
        **{**asdict(coil.driver), "limit_A": None if coil.driver.limit_A == math.inf else coil.driver.limit_A}
    )
    return _Coil(rise_s=coil.rise_s, fall_s=coil.fall_s, driver=driver)


def _restore_coil(saved: _Coil) -> Coil:
    known = saved.driver.model_dump(exclude_none=True) if saved.driver else None
    return Coil(saved.rise_s, saved.fall_s, Driver(**known) if known else None)


def _describe(damper: Damper) -> _Modified | _Joint | _Conditioned:
    if isinstance(damper, JointDamper):
        return _Joint(
            kind="joint",
            model=damper.model.name,
            parameters=damper.model.values(),
            parameter_units={info.name: info.unit for info in damper.model.parameters()},
            free=damper.free,
        )
    if isinstance(damper, ModifiedModel):
        functions = {
            name: _Function(form=f.form, coefficients=f.coefficients, rates=f.rates, log=f.log, formula=f.formula)
            for name, f in damper.parameters.functions.items()
        }
        return _Modified(kind="modified", model=damper.parameters.model_type.name, functions=functions)
    if isinstance(damper, ConditionedDamper):
        values = {field.name: getattr(damper, field.name) for field in fields(damper)}
        return _Conditioned(
            kind="conditioned",
            model=damper.name,
            coefficients=dict(damper.coefficients),
            reference=astuple(damper.reference),
            tables={name: value.tolist() for name, value in values.items() if isinstance(value, np.ndarray)},
        )
    raise TypeError(f"no document for {type(damper).__name__}")


def _restore(document: _Document) -> Damper:
    described, envelope = document.damper, Envelope(**document.envelope.model_dump())
    if isinstance(described, _Joint):
        try:
            model = model_type(described.model)(**described.parameters)
        except TypeError as error:
            raise ModelFileError(f"parameters do not fit the model: {error}", mend="write the model again") from error
        return JointDamper(document.rig, model, described.free, envelope, document.provenance)
    if isinstance(described, _Conditioned):
        return _restore_conditioned(document, described, envelope)
    functions = {
        name: ParameterFunction(f.form, f.coefficients, f.rates, f.log) for name, f in described.functions.items()
    }
    damper = ModifiedModel(
        rig=document.rig,
        parameters=ParameterMap(model_type(described.model), functions),
        envelope=envelope,
        provenance=document.provenance,
    )
    middle = {name: (low + high) / 2 for name, (low, high) in document.envelope.model_dump().items()}
    try:
        damper.parameters.at(Condition(middle["current_A"], middle["frequency_Hz"], middle["amplitude_m"]))
    except TypeError as error:
        raise ModelFileError(f"functions do not fit the model: {error}", mend="write the model again") from error
    return damper


def _restore_conditioned(document: _Document, described: _Conditioned, envelope: Envelope) -> Damper:
    reference = Condition(*described.reference)
    tables = {name: np.array(table) for name, table in described.tables.items()}
    try:
        damper = conditioned_type(described.model)(
            document.rig, described.coefficients, reference, envelope, document.provenance, **tables
        )
        damper.force_along(sine(reference, 1, 8), reference)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise ModelFileError(f"coefficients do not fit the model: {error}", mend="write the model again") from error
    return damper
