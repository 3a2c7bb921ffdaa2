"""Saved models: a versioned JSON document without code, checked when it is read.

Numbers round-trip exactly. The document states units and the origin of the model.
"""

from __future__ import annotations

import json
import re
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from mrdamper.dampers import all_kinds, kind_named
from mrdamper.dampers.base import Damper
from mrdamper.dampers.calibration import Calibration, Growth
from mrdamper.dampers.coil import Coil
from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.sessions import Sessions
from mrdamper.dampers.uncertainty import Uncertainty
from mrdamper.data import require_name
from mrdamper.data.atomic import path_of, write_file
from mrdamper.data.strict_text import content_of, is_table, parse_json
from mrdamper.errors import InputError, ModelFileError, require
from mrdamper.models import model_parts

FORMAT = "mrdamper-model"
_PACKAGE = "package of the model"  # key of the provenance
_SCRIPT = "class of a script"  # that provides the model
MAJOR, MINOR = 1, 6
_MAX_FILE_BYTES = 64_000_000  # bytes of a file
_KIND = "a model.json written by mrdamper"
_MAX_DEVIATION = 1e4  # standard deviation of a parameter over its size, or of its logarithm
UNITS = {
    "time": "s",
    "displacement": "m",
    "velocity": "m/s",
    "force": "N",
    "current": "A",
    "frequency": "Hz",
    "amplitude": "m",
}


class _SavedPart(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def _ascending(range_: tuple[float, float]) -> tuple[float, float]:
    if range_[0] > range_[1]:
        raise ValueError(f"{range_[0]:g} to {range_[1]:g}: the lower end comes first")
    return range_


def _not_negative(range_: tuple[float, float]) -> tuple[float, float]:
    if range_[0] < 0:
        raise ValueError(f"{range_[0]:g} is negative")
    return range_


Signed = Annotated[tuple[float, float], AfterValidator(_ascending)]
Range = Annotated[Signed, AfterValidator(_not_negative)]


class _Envelope(_SavedPart):
    current_A: Signed
    frequency_Hz: Range
    amplitude_m: Range
    peak_velocity_m_s: Range
    any_motion: bool | None = None  # since 1.2; written where it applies
    any_record: bool | None = None
    conditions: tuple[tuple[float, float, float], ...] | None = None  # tested: [A], [Hz], [m]


# Standard deviations whose squares, and whose sums with a force, are finite.
Deviation = Annotated[float, Field(ge=0, le=1e12)]


class _Session(_SavedPart):
    gain: Deviation
    offset_N: Deviation
    degrees_of_freedom: Deviation


class _ModelError(_SavedPart):
    force: Deviation
    peak: Deviation
    energy: Deviation
    left_out: int


class _Covariance(_SavedPart):
    parameters: tuple[str, ...]
    logarithmic: tuple[bool, ...]
    matrix: tuple[tuple[float, ...], ...]
    degrees_of_freedom: tuple[float, ...]
    one_sided: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
    session: _Session
    model_error: _ModelError
    words: tuple[str, ...] = ()
    taught: dict[str, float] = {}
    effective: dict[str, float] = {}
    sessions: Sessions | None = None  # since 1.4
    runs: _Session | None = None  # since 1.5
    calibration: Calibration | None = None  # since 1.5
    growth: Growth = Growth()  # since 1.5
    interval_factors: tuple[float, ...] = ()  # on the standard errors; since 1.6


class _Document(_SavedPart):
    format: Literal["mrdamper-model"]
    version: str
    rig: str
    units: dict[str, str]
    envelope: _Envelope
    provenance: dict[str, str]
    coil: Coil | None = None  # since 1.2
    covariance: _Covariance | None = None  # since 1.3
    damper: dict[str, Any]  # its kind, and the data of that kind


def model_schema() -> dict[str, Any]:
    """Return the JSON Schema of a saved model, every kind of damper included."""
    schema = _Document.model_json_schema()
    kinds: list[dict[str, Any]] = []
    for name, kind in all_kinds().items():
        own = TypeAdapter(kind.saved).json_schema(ref_template="#/$defs/{model}")
        schema.setdefault("$defs", {}).update(own.pop("$defs", {}))
        own["properties"] = {"kind": {"const": name}, **own["properties"]}
        kinds.append({**own, "required": ["kind", *own.get("required", ())], "additionalProperties": False})
    schema["properties"]["damper"] = {"oneOf": kinds}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": f"{FORMAT} {MAJOR}.{MINOR}"}


def save_model(damper: Damper, path: str | Path) -> None:
    """Write a damper as JSON, atomically.

    Parameters
    ----------
    damper : Damper
    path : path
        Replaced if it exists.

    Raises
    ------
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> from mrdamper import identify, load_dataset, load_model, save_model
    >>> from mrdamper.dampers.modified import fit_modified
    >>> runs = load_dataset().rig("utfsm").split("train")[:8]
    >>> path = Path(mkdtemp()) / "model.json"
    >>> save_model(fit_modified([identify(run, "bingham") for run in runs]).damper, path)
    >>> load_model(path).title
    'modified Bingham'
    """
    with write_file(path_of(path)) as target:
        target.write_text(dump_model(damper), encoding="utf-8")


def dump_model(damper: Damper) -> str:
    """Return the JSON document of a damper; raises `InputError` if it was made without tests."""
    require(damper, Damper, "a damper")
    if not damper.envelope.tested:
        raise InputError("a damper without tested ranges", remedy="save one that compare or a study identified")
    document = _Document(
        format=FORMAT,
        version=f"{MAJOR}.{MINOR}",
        rig=damper.rig,
        units=UNITS,
        envelope=_Envelope(**{name: getattr(damper.envelope, name) or None for name in _Envelope.model_fields}),  # type: ignore[arg-type]
        provenance={**damper.provenance, **_outside_package(damper)},
        coil=damper.coil,
        covariance=_describe_uncertainty(damper.uncertainty),
        damper={"kind": damper.kind, **asdict(damper.to_saved())},
    )
    return json.dumps(document.model_dump(exclude_none=True), indent=1, ensure_ascii=False) + "\n"


def load_model(path: str | Path) -> Damper:
    """Read a saved damper.

    Parameters
    ----------
    path : path
        A model.json of `save_model` or `mrdamper study`, or a folder with one model.

    Raises
    ------
    ModelFileError
        If the file is missing, damaged, of a newer major version, or has unknown fields; if a folder has no
        model or several.

    Examples
    --------
    See `save_model`.

    >>> from mrdamper import load_model
    >>> load_model("nowhere.json")
    Traceback (most recent call last):
    mrdamper.errors.ModelFileError: nowhere.json: No such file or directory; give a model.json ...
    """
    path = path_of(path)
    if path.is_dir():
        models = sorted(path.glob("model*.json"))
        if len(models) != 1:
            names = " or ".join(model.name for model in models) or "no model.json"
            raise ModelFileError(f"a folder with {names}", where=str(path), remedy="give one model.json")
        path = models[0]
    try:
        text = content_of(path, _MAX_FILE_BYTES, ModelFileError, _KIND).decode("utf-8")
    except UnicodeDecodeError as error:
        raise ModelFileError("not a text file", where=str(path), remedy=f"give {_KIND}") from error
    return parse_model(text, where=str(path))


def parse_model(text: str, where: str = "model") -> Damper:
    """Read a damper from the text of its document; raises as `load_model`."""
    try:
        raw = parse_json(text)
    except ValueError as error:
        raise ModelFileError(str(error), where=where, remedy="copy the file again") from error
    if not is_table(raw) or raw.get("format") != FORMAT:
        raise ModelFileError("not a saved model", where=where, remedy=f"give {_KIND}")
    version = re.fullmatch(r"(\d{1,4})\.\d{1,4}", str(raw.get("version")))
    if version and int(version[1]) > MAJOR:
        raise ModelFileError(
            f"written by a newer mrdamper (format {raw['version']}, this one reads {MAJOR}.x)",
            where=where,
            remedy="update mrdamper",
        )
    if version is None or int(version[1]) < 1:
        raise ModelFileError(f"version is {raw.get('version')!r:.40}", where=where, remedy="write the model again")
    raw = _upgraded(raw)
    document = _checked(_Document, raw, "", where)
    if document.units != UNITS:
        raise ModelFileError("units are not those of the format", where=where, remedy="convert the model to SI units")
    kind, own = _kind(document.damper, where)
    saved = _checked(kind.saved, own, "damper.", where)
    try:
        require_name("rig", document.rig)
        envelope = Envelope(**document.envelope.model_dump(exclude_none=True))
        shared = {"rig": document.rig, "provenance": document.provenance, "coil": document.coil}
        damper = kind.from_saved(saved, envelope=envelope, **shared)
        return _with_uncertainty(damper, document.covariance, where) if document.covariance else damper
    except InputError as error:
        package, script = (document.provenance.get(key) for key in (_PACKAGE, _SCRIPT))
        remedy = f"install the package that the file names: {package!r:.80}" if package else error.remedy
        if script:
            remedy = f"register {script!r:.80} before the file is loaded; commands know classes of installed packages"
        raise ModelFileError(error.found, where=where, remedy=remedy) from error


def _outside_package(damper: Damper) -> dict[str, str]:
    """Name the installed package, or the class of a script, that provides the model of a damper if not mrdamper."""
    name = getattr(damper.to_saved(), "model", "")
    part = {part.name: part for part in model_parts()}.get(name)
    if part is None or part.target.startswith("mrdamper."):
        return {}
    return {_SCRIPT: part.target} if part.own else {_PACKAGE: part.package}


def _checked(schema: Any, raw: dict[str, Any], prefix: str, where: str) -> Any:
    try:
        # As JSON: there, strict takes arrays for tuples, and neither text nor truth for numbers.
        return TypeAdapter(schema).validate_json(json.dumps(raw), strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        field = prefix + ".".join(str(part) for part in first["loc"])
        inner = first.get("ctx", {}).get("error")
        problem = inner.found if isinstance(inner, InputError) else first["msg"]
        raise ModelFileError(f"{field}: {problem}", where=where, remedy="write the model again") from error


def _kind(described: dict[str, Any], where: str) -> tuple[type[Damper], dict[str, Any]]:
    name = str(described.get("kind"))
    if (kind := kind_named(name)) is None:
        raise ModelFileError(
            f"damper.kind is {name!r}", where=where, remedy=f"known: {', '.join(all_kinds())}; write the model again"
        )
    return kind, {key: value for key, value in described.items() if key != "kind"}


def _upgraded(raw: dict[str, Any]) -> dict[str, Any]:
    """Convert older minor versions. Before 1.2 a kernel regression was a condition-dependent damper."""
    described = raw.get("damper")
    if is_table(described) and described.get("kind") == "conditioned" and described.get("model") == "kernel":
        numbers, tables = described.get("coefficients"), described.get("tables")
        if is_table(numbers) and is_table(tables):
            spread = [numbers.get(f"spread_{n}") for n in ("displacement", "velocity", "acceleration", "current")]
            whole = {"mean": numbers.get("mean"), "size": numbers.get("size"), "spread": spread}
            return {**raw, "damper": {"kind": "kernel", **tables, **whole}}
    return raw


def _describe_uncertainty(uncertainty: Uncertainty | None) -> _Covariance | None:
    if uncertainty is None:
        return None
    return _Covariance(
        parameters=uncertainty.names,
        logarithmic=uncertainty.logs,
        matrix=tuple(tuple(row) for row in uncertainty.covariance.tolist()),
        degrees_of_freedom=tuple(uncertainty.dof.tolist()),
        one_sided=uncertainty.one_sided,
        unknown=uncertainty.unknown,
        session=_Session(
            gain=uncertainty.gain, offset_N=uncertainty.offset, degrees_of_freedom=uncertainty.session_dof
        ),
        model_error=_ModelError(
            force=uncertainty.force, peak=uncertainty.peak, energy=uncertainty.energy, left_out=uncertainty.left_out
        ),
        words=uncertainty.words,
        taught=dict(uncertainty.information),
        effective=dict(uncertainty.effective),
        interval_factors=tuple(np.broadcast_to(uncertainty.interval_factor, len(uncertainty.names)).tolist()),
        sessions=uncertainty.sessions,
        runs=_Session(
            gain=uncertainty.run_gain, offset_N=uncertainty.run_offset, degrees_of_freedom=uncertainty.run_dof
        ),
        calibration=uncertainty.calibration,
        growth=uncertainty.growth,
    )


def _with_uncertainty(damper: Damper, saved: _Covariance, where: str) -> Damper:
    """Return the damper with the covariance of its file, if it fits the damper."""
    size, session, model = len(saved.parameters), saved.session, saved.model_error
    square = len(saved.matrix) == size and all(len(row) == size for row in saved.matrix)
    matrix = np.array(saved.matrix, dtype=float).reshape(size, size) if square else np.zeros((0, 0))
    factors = np.array(saved.interval_factors or size * (1.0,))
    lengths = len(saved.logarithmic) == len(saved.degrees_of_freedom) == len(factors) == size
    named = all(name in damper.fitted_parameters for name in (*saved.parameters, *saved.one_sided, *saved.unknown))
    if (
        not (square and lengths and named)
        or not np.allclose(matrix, matrix.T, rtol=1e-6)
        or np.any(np.diag(matrix) < 0)
        or np.any(factors <= 0)
    ):
        raise ModelFileError("covariance: it does not fit the damper", where=where, remedy="write the model again")
    for name, log, variance in zip(saved.parameters, saved.logarithmic, np.diag(matrix).tolist(), strict=True):
        widest = 1.0 if log else max(abs(damper.fitted_parameters[name].value), 1.0)
        if variance > (_MAX_DEVIATION * widest) ** 2:
            raise ModelFileError(
                f"covariance: the variance of {name} is {variance:.3g}", where=where, remedy="write the model again"
            )
    runs = saved.runs or _Session(gain=0.0, offset_N=0.0, degrees_of_freedom=0.0)
    uncertainty = Uncertainty(
        saved.parameters, saved.logarithmic, matrix, np.array(saved.degrees_of_freedom), saved.one_sided, saved.unknown,
        session.gain, session.offset_N, session.degrees_of_freedom, runs.gain, runs.offset_N, runs.degrees_of_freedom,
        model.force, model.peak, model.energy, model.left_out, saved.words, saved.taught,
        saved.effective, factors, saved.sessions, saved.calibration, saved.growth,
    )  # fmt: skip
    return replace(damper, uncertainty=uncertainty)
