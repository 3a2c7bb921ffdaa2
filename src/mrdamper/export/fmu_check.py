"""Whether an FMU of ours is what it says: its texts, its token, its binary, its reference.

`fmpy.validate_fmu` looks at the description alone. Here the binary is loaded too, in a
process of its own, and has to answer the reference motion with the reference force.
"""

from __future__ import annotations

import csv
import io
import json
import math
import re
import subprocess
import sys
import tempfile
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal
from xml.etree import ElementTree

from mrdamper.export import fmu_probe
from mrdamper.export.c import TOLERANCE
from mrdamper.export.fmu import token_of
from mrdamper.export.toolchain import Platform, build_library, here

_PATIENCE = 60  # s
_LARGEST = 200_000_000  # bytes, unpacked
_INPUTS = ("displacement", "velocity", "current")
_TYPES_2 = ("Real", "Integer", "Boolean", "String")
_TYPES_3 = (
    *("Float32", "Float64", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64"),
    *("Boolean", "String", "Binary", "Clock"),
)
# What the standards demand of a co-simulation binary, beside a getter and a setter for each type.
_FUNCTIONS_2 = re.findall(r"\w+", """
    GetTypesPlatform GetVersion SetDebugLogging Instantiate FreeInstance SetupExperiment EnterInitializationMode
    ExitInitializationMode Terminate Reset GetFMUstate SetFMUstate FreeFMUstate SerializedFMUstateSize
    SerializeFMUstate DeSerializeFMUstate GetDirectionalDerivative SetRealInputDerivatives
    GetRealOutputDerivatives DoStep CancelStep GetStatus GetRealStatus GetIntegerStatus GetBooleanStatus
    GetStringStatus
""")  # fmt: skip
_FUNCTIONS_3 = re.findall(r"\w+", """
    GetVersion SetDebugLogging InstantiateModelExchange InstantiateCoSimulation InstantiateScheduledExecution
    FreeInstance EnterInitializationMode ExitInitializationMode EnterEventMode Terminate Reset
    GetNumberOfVariableDependencies GetVariableDependencies GetFMUState SetFMUState FreeFMUState
    SerializedFMUStateSize SerializeFMUState DeserializeFMUState GetDirectionalDerivative GetAdjointDerivative
    EnterConfigurationMode ExitConfigurationMode GetIntervalDecimal GetIntervalFraction GetShiftDecimal
    GetShiftFraction SetIntervalDecimal SetIntervalFraction SetShiftDecimal SetShiftFraction EvaluateDiscreteStates
    UpdateDiscreteStates EnterContinuousTimeMode CompletedIntegratorStep SetTime SetContinuousStates
    GetContinuousStateDerivatives GetEventIndicators GetContinuousStates GetNominalsOfContinuousStates
    GetNumberOfEventIndicators GetNumberOfContinuousStates EnterStepMode GetOutputDerivatives DoStep
    ActivateModelPartition
""")  # fmt: skip


@dataclass(frozen=True)
class Finding:
    """Something about an FMU its user should know.

    Attributes
    ----------
    code : str
        Stable.
    text : str
        What was found.
    level : "error" or "note"
        A note says what could not be looked at.
    """

    code: str
    text: str
    level: Literal["error", "note"] = "error"

    def __str__(self) -> str:
        return f"{self.text} [{self.code}]"


def check_fmu(path: str | Path) -> list[Finding]:
    """Look at everything an FMU made by `FMUExporter` promises.

    The binary runs on this machine with this user's rights: check only FMUs you would run.

    Parameters
    ----------
    path : str or Path
        Of the .fmu file.

    Returns
    -------
    list of Finding
        Empty if all is well.
    """
    try:
        files = _unpacked(Path(path))
        description = _Description.read(files)
    except _UnusableError as error:
        return [error.finding]
    findings = [*_check_texts(files, description), *_check_standard(Path(path))]
    try:
        rows, forces = _reference(files)
    except _UnusableError as error:
        return [*findings, error.finding]
    library, where, more = _library(files, description)
    findings += more
    if library is not None:
        findings += _check_binary(library, where, description, rows, forces)
    return findings


class _UnusableError(Exception):
    """Carries the finding that ends the check."""

    def __init__(self, code: str, text: str):
        super().__init__(text)
        self.finding = Finding(code, text)


@dataclass(frozen=True)
class _Description:
    """What the rest of the check needs of modelDescription.xml."""

    fmi: int
    token: str
    identifier: str
    root: ElementTree.Element

    @classmethod
    def read(cls, files: Mapping[str, bytes]) -> _Description:
        if "modelDescription.xml" not in files:
            raise _UnusableError("E_FMU_DESCRIPTION", "there is no modelDescription.xml")
        try:
            root = ElementTree.fromstring(files["modelDescription.xml"])
        except ElementTree.ParseError as error:
            raise _UnusableError("E_FMU_DESCRIPTION", f"modelDescription.xml: {error}") from error
        version, simulation = root.get("fmiVersion", ""), root.find("CoSimulation")
        if version not in ("2.0", "3.0") or simulation is None:
            raise _UnusableError(
                "E_FMU_VERSION", f"FMI {version or 'of no version'}; co-simulation of 2.0 or 3.0 is checked"
            )
        fmi = int(version[0])
        token = root.get("guid" if fmi == 2 else "instantiationToken", "")
        found = cls(fmi, token, simulation.get("modelIdentifier", ""), root)
        for variable in found.variables:
            if not re.fullmatch(r"\d{1,9}", variable.get("valueReference", "")):
                name, reference = variable.get("name"), variable.get("valueReference")
                raise _UnusableError("E_FMU_DESCRIPTION", f"{name} has the value reference {reference}")
        return found

    @property
    def variables(self) -> list[ElementTree.Element]:
        found = self.root.find("ModelVariables")
        return [] if found is None else list(found)

    def references(self) -> dict[str, int]:
        """Value references by name."""
        return {v.get("name", ""): int(v.get("valueReference", "")) for v in self.variables}


def _unpacked(path: Path) -> dict[str, bytes]:
    try:
        with zipfile.ZipFile(path) as archive:
            entries = [entry for entry in archive.infolist() if not entry.is_dir()]
            if sum(entry.file_size for entry in entries) > _LARGEST:
                raise _UnusableError("E_FMU_ARCHIVE", f"{path.name} unpacks to over {_LARGEST // 10**6} MB")
            names = [entry.filename for entry in entries]
            for name in names:
                if names.count(name) > 1 or not re.fullmatch(r"(?!.*\.\.)\w[\w.\-/]*", name):
                    raise _UnusableError(
                        "E_FMU_ARCHIVE", f"{path.name} holds a path that is unsafe or twice there: {name!r}"
                    )
            return {entry.filename: archive.read(entry) for entry in entries}
    except (OSError, zipfile.BadZipFile, zlib.error, EOFError, ValueError, RuntimeError) as error:
        raise _UnusableError("E_FMU_ARCHIVE", f"{path.name} cannot be unpacked: {error}") from error


def _check_texts(files: Mapping[str, bytes], description: _Description) -> list[Finding]:
    """The token against the texts, and the description against itself."""
    token = description.token.encode()
    texts = {path: text.replace(token, b"") for path, text in files.items() if not path.startswith("binaries/")}
    findings = []
    if not token or token_of(texts) != description.token:
        text = f"the token {description.token} was not made from these texts: something was changed afterwards"
        findings.append(Finding("E_FMU_TOKEN", text))
    names = [v.get("name") for v in description.variables]
    references = [v.get("valueReference") for v in description.variables]
    units = {unit.get("name") for unit in description.root.iter("Unit")}
    for what, values in (("name", names), ("value reference", references)):
        findings += [
            Finding("E_FMU_DESCRIPTION", f"two variables have the {what} {value}")
            for value in sorted({str(v) for v in values if values.count(v) > 1})
        ]
    for element in (e for v in description.variables for e in (v, *v)):
        if element.get("unit") not in {None, *units}:
            findings.append(Finding("E_FMU_DESCRIPTION", f"the unit {element.get('unit')} is not defined"))
    findings += [
        Finding("E_FMU_DESCRIPTION", f"there is no variable {name}")
        for name in (*_INPUTS, "force")
        if name not in names
    ]
    listed = description.root.iter("File") if description.fmi == 2 else _built(files)
    findings += [
        Finding("E_FMU_SOURCES", f"sources/{file.get('name')} is listed but missing")
        for file in listed
        if f"sources/{file.get('name')}" not in files
    ]
    return findings


def _built(files: Mapping[str, bytes]) -> list[ElementTree.Element]:
    try:
        return list(ElementTree.fromstring(files.get("sources/buildDescription.xml", b"<none/>")).iter("SourceFile"))
    except ElementTree.ParseError:
        return []  # the token says that it was changed


def _check_standard(path: Path) -> list[Finding]:
    try:
        from fmpy.validation import validate_fmu  # pyright: ignore[reportMissingImports]
    except ModuleNotFoundError:
        text = "not held against the standard's schema: pip install 'mrdamper[fmu]'"
        return [Finding("N_FMU_SCHEMA", text, "note")]
    return [Finding("E_FMU_SCHEMA", " ".join(str(problem).split())) for problem in validate_fmu(str(path))]


def _reference(files: Mapping[str, bytes]) -> tuple[list[list[float]], list[float]]:
    """Rows of time and inputs, and forces."""
    tables = []
    for name, columns in (("in", ("time", *_INPUTS)), ("out", ("force",))):
        path = f"resources/reference_{name}.csv"
        try:
            table = csv.DictReader(io.StringIO(files[path].decode()))
            tables.append([[float(row[column]) for column in columns] for row in table])
        except (KeyError, ValueError, TypeError, csv.Error) as error:
            raise _UnusableError("E_FMU_REFERENCE", f"{path} cannot be read: {error!r}") from error
    rows, forces = tables
    if len(rows) != len(forces) or len(rows) < 3 or not all(math.isfinite(n) for row in rows + forces for n in row):
        raise _UnusableError("E_FMU_REFERENCE", "the reference tables do not fit together")
    return rows, [row[0] for row in forces]


def _library(files: Mapping[str, bytes], description: _Description) -> tuple[bytes | None, str, list[Finding]]:
    """The binary for this machine, or one made of the sources, and where it comes from."""
    platform = here()
    if platform is None:
        return None, "", [Finding("N_FMU_PLATFORM", "binaries cannot be run on this machine", "note")]
    folder = platform.fmi2 if description.fmi == 2 else platform.name
    path = f"binaries/{folder}/{description.identifier}{platform.suffix}"
    if path in files:
        return files[path], path, []
    missing = Finding("N_FMU_PLATFORM", f"there is no {path}; its sources were compiled instead", "note")
    built = _compiled(files, platform)
    if built.library is None:
        text = f"there is no {path}, and its sources were not compiled: {built.reason}"
        return None, "", [Finding("E_FMU_SOURCES" if "error" in built.reason else "N_FMU_PLATFORM", text, "note")]
    return built.library, "sources", [missing]


def _compiled(files: Mapping[str, bytes], platform: Platform) -> Any:
    sources = {
        path.removeprefix("sources/"): text
        for path, text in files.items()
        if re.fullmatch(r"sources/[\w.]+\.[ch]", path)
    }
    return build_library(sources, platform)


def _check_binary(
    library: bytes, where: str, description: _Description, rows: list[list[float]], forces: list[float]
) -> list[Finding]:
    """What a process that loads the binary and walks the reference sees."""
    prefix = f"fmi{description.fmi}"
    types, functions = (_TYPES_2, _FUNCTIONS_2) if description.fmi == 2 else (_TYPES_3, _FUNCTIONS_3)
    names = [*functions, *(f"{verb}{type_}" for type_ in types for verb in ("Get", "Set"))]
    references = description.references()
    platform = here()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        path = Path(folder) / f"probed{platform.suffix if platform else ''}"
        path.write_bytes(library)
        path.chmod(0o755)
        task = {
            "library": str(path),
            "fmi": description.fmi,
            "token": description.token,
            "symbols": [prefix + name for name in names],
            "inputs": [references.get(name, -1) for name in _INPUTS],
            "force": references.get("force", -1),
            "step": rows[1][0] - rows[0][0],
            "rows": [row[1:] for row in rows],
        }
        seen, end = _probe(task)
    stages: dict[str, Any] = {}
    for facts in seen:
        stages.setdefault(facts["stage"], {}).update(facts)
    findings = [Finding(code, f"{where}: {text}") for code, text in _judged(stages, forces)]
    if end and not findings:
        findings.append(Finding("E_FMU_BINARY", f"{where}: {end} at stage {seen[-1]['stage'] if seen else 'start'}"))
    return findings


def _probe(task: Mapping[str, Any]) -> tuple[list[dict[str, Any]], str]:
    """What the probe said, and how it ended if not well."""
    command = [sys.executable, "-I", str(fmu_probe.__file__)]
    try:
        done = subprocess.run(
            command, input=json.dumps(task).encode(), capture_output=True, timeout=_PATIENCE, check=False
        )
    except subprocess.TimeoutExpired:
        return [], f"the binary did not answer within {_PATIENCE} s"
    seen = []
    for line in done.stdout.decode(errors="replace").splitlines():
        if line.startswith('{"stage"'):
            seen.append(json.loads(line))
    if seen and seen[-1]["stage"] == "end":
        return seen, ""
    if done.returncode < 0:
        return seen, f"the binary crashed (signal {-done.returncode})"
    last = done.stderr.decode(errors="replace").strip().splitlines() or ["the probe ended early"]
    return seen, last[-1]


def _judged(stages: Mapping[str, Any], forces: list[float]) -> list[tuple[str, str]]:
    """Findings from what was seen; stages that were not reached are not judged."""
    found = []
    if "error" in stages.get("load", {}):
        found.append(("E_FMU_BINARY", f"cannot be loaded: {stages['load']['error']}"))
    if missing := stages.get("symbols", {}).get("missing"):
        found.append(("E_FMU_SYMBOL", f"lacks {', '.join(missing[:5])}{' and more' if len(missing) > 5 else ''}"))
    if stages.get("token", {}).get("wrong_accepted"):
        found.append(("E_FMU_TOKEN", "takes any token"))
    if not stages.get("instantiate", {"done": True})["done"]:
        found.append(("E_FMU_TOKEN", "refuses the token of modelDescription.xml"))
    if walked := stages.get("reference"):
        found += _judged_reference(walked, forces)
    refused = stages.get("refusals", {"passed": [], "moved": False})
    if refused["passed"] or refused["moved"]:
        found.append(
            ("E_FMU_REFUSAL", f"lets pass: {', '.join(refused['passed']) or 'a refused step moved the force'}")
        )
    for way, kept in stages.get("state", {}).items():
        if way != "stage" and not kept:
            found.append(("E_FMU_STATE", f"a {way} state does not lead to the same forces again"))
    return found


def _judged_reference(walked: Mapping[str, Any], forces: list[float]) -> list[tuple[str, str]]:
    if walked["status"]:
        return [("E_FMU_REFERENCE", f"answers row {walked['row']} of the reference with status {walked['status']}")]
    if None in walked["forces"]:
        return [("E_FMU_REFERENCE", f"gives no number at row {walked['forces'].index(None)} of the reference")]
    errors = [abs(a - b) for a, b in zip(walked["forces"], forces, strict=True)]
    worst, largest = max(errors), max(map(abs, forces))
    if worst <= TOLERANCE * largest:
        return []
    return [("E_FMU_REFERENCE", f"differs from the reference by {worst:.3g} N at row {errors.index(worst)}")]
