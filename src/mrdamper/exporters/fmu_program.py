"""FMUs of control laws and inverse models, with the FMI functions of dampers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.encoding import c_comment
from mrdamper.exporters.base import identifier, write_export
from mrdamper.exporters.c import program_sources
from mrdamper.exporters.fmu import MOST_STEPS, FMUExporter, all_texts
from mrdamper.exporters.fmu_description import Variable, numbered, units_of
from mrdamper.tracing import Program
from mrdamper.tracing.compiled import RecordProgram

_REFERENCE_STEP_S = 2.0**-10  # s, of the reference if the program has no period
_REFERENCE_ROWS = 401
_USUAL = {"m": 0.01, "m/s": 0.1, "m/s2": 1.0, "N": 500.0}  # amplitudes of the inputs of the reference


def write_program_fmu(
    traced: Program,
    name: str,
    title: str,
    units: Mapping[str, str],
    out: str | Path,
    period: float = 0.0,
    start: Sequence[float] = (),
    exporter: FMUExporter | None = None,
) -> tuple[list[Path], tuple[str, ...]]:
    """Write a program as an FMU, atomically; return the files, and notes, such as missing platforms.

    dt is the program's last input; its parameters are written as constants. `units` are those of every input but dt,
    and every output; `period` the time between two samples [s], 0 for a sample every communication step; `start` the
    outputs before the first sample. Raises `OutputError` if it cannot be written.
    """
    kind, word = exporter or FMUExporter(), identifier(name)
    facts = _facts(traced, word, title, units, period, tuple(start) or (0.0,) * len(traced.outputs), kind.fmi)
    sources = program_sources(traced, word, facts["title"], units)
    written = kind.packed(all_texts(facts, sources, "fmu_program", "fmu_program", *_reference(traced, facts)), word)
    return write_export(written, out, kind.suffix), written.notes


def _facts(
    traced: Program,
    word: str,
    title: str,
    units: Mapping[str, str],
    period: float,
    start: Sequence[float],
    fmi: Literal[2, 3],
) -> dict[str, Any]:

    def described(name: str, causality: str, unit: str, start: float | None = None) -> Variable:
        return Variable(name, name.replace("_", " ").capitalize(), "real", causality, "continuous", unit, start)

    signals = [name for name in traced.tape.inputs if name != "dt"]
    signs = [described("time", "independent", "s"), *(described(name, "input", units[name], 0.0) for name in signals)]
    variables = numbered([*signs, *(described(name, "output", units[name]) for name in traced.outputs)], fmi)
    place = {"independent": "time", "input": "set.{}", "output": "held.{}"}
    readable = [(v.reference, place[v.causality].format(v.name)) for v in variables]
    serial = [("real", f"program.{member}") for member in traced.tape.starts]
    serial += [("real", where) for _, where in readable if where != "time"] + [("real", "due"), ("real", "time")]
    serial += [("int", "program.samples"), ("int", "phase")]
    return {
        "name": word,
        "upper": word.upper(),
        "title": c_comment(title),
        "about": f"{title}, written by mrdamper.",
        "version": version("mrdamper"),
        "fmi": fmi,
        "variables": variables,
        "units": units_of(v.unit for v in variables),
        "types": (),
        "most_steps": MOST_STEPS,
        "period": repr(float(period)),
        "sampled": period,
        "internal_step": repr(period or _REFERENCE_STEP_S),
        "stop_time": repr((period or _REFERENCE_STEP_S) * (_REFERENCE_ROWS - 1)),
        "held": [(name, repr(float(value))) for name, value in zip(traced.outputs, start, strict=True)],
        "readable": readable,
        "settable": [(v.reference, f"set.{v.name}") for v in variables if v.causality == "input"],
        "serial": serial,
        "serial_count": len(serial),
    }


def _reference(traced: Program, facts: dict[str, Any]) -> tuple[Floats, dict[str, Floats], dict[str, Floats]]:
    """Compute growing sines and the outputs of the program, each row for the inputs of the row before."""
    step = facts["sampled"] or _REFERENCE_STEP_S
    time = step * np.arange(_REFERENCE_ROWS, dtype=np.float64)
    given = {
        v.name: _USUAL.get(v.unit, 1.0) * time / time[-1] * np.sin(2 * math.pi * (2 + 0.37 * i) * time / time[-1] * 2)
        for i, v in enumerate(v for v in facts["variables"] if v.causality == "input")
    }
    record, channels = RecordProgram(traced), (*given.values(), np.full(time.size, step))
    along = record.interpreted_along(traced.given, record.prepare(traced.given) or (), record.starts, channels)
    before = np.array([[float(value)] for _, value in facts["held"]])
    outputs = np.hstack([before, along.outputs[:, :-1]])
    return time, given, dict(zip(traced.outputs, outputs, strict=True))
