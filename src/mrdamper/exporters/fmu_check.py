"""Check of an exported FMU: texts, token, binary, reference.

FMPy validates the description and simulates in a separate process, which isolates crashes. Further checks: a missing
binary, a wrong token or one that is not checked, refusals of inputs, and stored states.
"""

from __future__ import annotations

import importlib.util
import json
import re
import subprocess
import sys
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from mrdamper.data.temporary import temporary_folder
from mrdamper.errors import MissingExtraError
from mrdamper.exporters import fmu_probe
from mrdamper.exporters.c import TOLERANCE
from mrdamper.exporters.fmu import token_of
from mrdamper.exporters.toolchain import build_library, here

_CHECK_TIMEOUT_S = 60  # s
_MAX_UNPACKED_BYTES = 200_000_000  # bytes, unpacked
_UNREADABLE = (OSError, zipfile.BadZipFile, zlib.error, EOFError, ValueError, RuntimeError)
_TOKEN = re.compile(rb'(?:guid|instantiationToken)="([^"]*)"')


@dataclass(frozen=True)
class FmuFinding:
    """Finding of the check of an FMU; a note states what could not be checked."""

    code: str
    text: str
    level: Literal["error", "note"] = "error"

    def __str__(self) -> str:
        return f"{self.text} [{self.code}]"


def check_fmu(path: str | Path) -> list[FmuFinding]:
    """Check an FMU of `FMUExporter`; no findings if it is correct.

    The binary runs on this machine with this user's rights: check trusted FMUs only. Raises `MissingExtraError` without
    FMPy.
    """
    if importlib.util.find_spec("fmpy") is None:
        raise MissingExtraError("FMPy is not installed", remedy="pip install 'mrdamper[fmu]'")
    try:
        files = _unpacked(Path(path))
    except _UNREADABLE as error:
        return [FmuFinding("E_FMU_ARCHIVE", f"{Path(path).name} cannot be unpacked: {error}")]
    if "modelDescription.xml" not in files:
        return [FmuFinding("E_FMU_DESCRIPTION", "there is no modelDescription.xml")]
    binaries, notes = _binary_for_here(files)
    loadable = bool(binaries) or not notes
    return [*_token(files), *notes, *_probed({**files, **binaries}, loadable)]


def _unpacked(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        entries = [entry for entry in archive.infolist() if not entry.is_dir()]
        names = [entry.filename for entry in entries]
        if sum(entry.file_size for entry in entries) > _MAX_UNPACKED_BYTES:
            raise ValueError(f"it holds over {_MAX_UNPACKED_BYTES // 10**6} MB")
        if unsafe := [n for n in names if names.count(n) > 1 or not re.fullmatch(r"(?!.*\.\.)\w[\w.\-/]*", n)]:
            raise ValueError(f"a path in it is unsafe or twice there: {unsafe[0]!r}")
        return {entry.filename: archive.read(entry) for entry in entries}


def _token(files: Mapping[str, bytes]) -> list[FmuFinding]:
    match = _TOKEN.search(files["modelDescription.xml"])
    token = match[1] if match else b""
    texts = {path: text.replace(token, b"") for path, text in files.items() if not path.startswith("binaries/")}
    if token and token_of(texts).encode() == token:
        return []
    text = f"the token {token.decode(errors='replace')} was not made from these texts: something was changed afterwards"
    return [FmuFinding("E_FMU_TOKEN", text)]


def _binary_for_here(files: Mapping[str, bytes]) -> tuple[dict[str, bytes], list[FmuFinding]]:
    platform, described = here(), files["modelDescription.xml"]
    if platform is None:
        return {}, [FmuFinding("N_FMU_PLATFORM", "binaries cannot be run on this machine", "note")]
    folder = platform.fmi2 if b'fmiVersion="2' in described else platform.name
    name = re.search(rb'modelIdentifier="(\w+)"', described)
    path = f"binaries/{folder}/{name[1].decode() if name else ''}{platform.suffix}"
    if path in files:
        return {}, []
    sources = {p.removeprefix("sources/"): t for p, t in files.items() if re.fullmatch(r"sources/[\w.]+\.[ch]", p)}
    built = build_library(sources, platform)
    if built.library is None:
        text = f"there is no {path}, and its sources were not compiled: {built.reason}"
        return {}, [FmuFinding("N_FMU_PLATFORM", text, "note")]
    text = f"there is no {path}; its sources were compiled instead"
    return {path: built.library}, [FmuFinding("N_FMU_PLATFORM", text, "note")]


def _probed(files: Mapping[str, bytes], loadable: bool) -> list[FmuFinding]:
    with temporary_folder() as folder:
        unpacked, report = folder / "fmu", folder / "report"
        for name, content in files.items():
            (unpacked / name).parent.mkdir(parents=True, exist_ok=True)
            (unpacked / name).write_bytes(content)
        command = [sys.executable, "-I", fmu_probe.__file__, str(unpacked), str(report), repr(TOLERANCE)]
        try:
            command += ["binary"] if loadable else []
            done = subprocess.run(command, capture_output=True, timeout=_CHECK_TIMEOUT_S, check=False)
            died = f"crashed (signal {-done.returncode})" if done.returncode < 0 else "ended the check early"
        except subprocess.TimeoutExpired:
            died = f"did not answer within {_CHECK_TIMEOUT_S} s"
        lines = [json.loads(line) for line in report.read_text().splitlines()] if report.exists() else []
    findings = [FmuFinding(code, text) for code, text in lines if code.startswith("E_")]
    if lines and lines[-1][0] == "end":
        return findings
    return [*findings, FmuFinding("E_FMU_BINARY", f"the binary {died} at the {lines[-1][1] if lines else 'start'}")]
