"""C99: one header, one source, and a self-test with reference vectors."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.joint import damper_of
from mrdamper.dampers.streaming import FLAGS, Stepper, Stream, stream
from mrdamper.data import Floats
from mrdamper.data.encoding import c_comment
from mrdamper.exporters.base import Exporter, Written, identifier, write_export
from mrdamper.exporters.templates import render
from mrdamper.models import Model
from mrdamper.tracing import Expression, Program
from mrdamper.tracing.c_writer import CWriter
from mrdamper.tracing.tape import LookupTable

TOLERANCE = 1e-9  # share of the largest force: tolerance of the self-test for other compilers and libraries
_TEST_SAMPLES = 400
_SINGLE_STRIDE = 4  # table points per point in single precision, still within its rounding


class CExporter(Exporter):
    """C99 for simulation and for real-time targets."""

    name: ClassVar[str] = "c"
    title: ClassVar[str] = "C99 source"

    def export(self, damper: Damper | Model, name: str) -> Written:
        stepping = stream(damper)
        files = {**c_sources(stepping, name, damper_of(damper).rig), f"{name}_test.c": self_test(stepping, name)}
        return Written({file: text.encode() for file, text in files.items()})


def c_sources(stepping: Stream, name: str, rig: str) -> dict[str, str]:
    """Header and source of a damper by file name, the rig in the comment at the top."""
    facts = c_facts(stepping, identifier(name), rig)
    return {f"{name}.h": render("model.h.j2", **facts), f"{name}.c": render("model.c.j2", **facts)}


class _ConstantsWriter(CWriter):
    """Writer of a program whose parameters keep their values."""

    def name(self, expression: Expression) -> str:
        return self.number(expression.value) if expression.op == "parameter" else super().name(expression)


def program_sources(traced: Program, name: str, title: str, units: Mapping[str, str]) -> dict[str, str]:
    """Header and source of any program of one sample, by file name: a control law, an inverse.

    dt is one of its inputs; its parameters are written as constants. The title is for the comment at the top, the
    units for those beside the inputs and outputs.
    """
    word, writer = identifier(name), _ConstantsWriter(traced)
    arguments = [(f"const {word}_derived *d", "d")] if traced.derived else []
    described = _program("model", writer, traced, [*arguments, (f"{word}_state *s", "s")])
    starts = [(member, repr(start)) for member, start in traced.tape.starts.items()]
    facts = _facts(word, title, writer, [described], starts) | {"units": {**units, "dt": "s"}}
    return {f"{word}.h": render("program.h.j2", **facts), f"{word}.c": render("program.c.j2", **facts)}


def write_program(traced: Program, name: str, title: str, units: Mapping[str, str], folder: str | Path) -> list[Path]:
    """Write the files of `program_sources` into a folder, atomically; raises `OutputError`."""
    files = {file: text.encode() for file, text in program_sources(traced, name, title, units).items()}
    return write_export(Written(files), folder, "")


def self_test(stepping: Stream, name: str) -> str:
    """Write a program that steps the model along a motion and compares the forces with a reference."""
    motion, force, dt = reference_force(stepping)
    rows = [f"{{{x!r}, {i!r}, {f!r}}}" for (x, i), f in zip(motion, force, strict=True)]
    return render("model_test.c.j2", name=name, upper=name.upper(), rows=rows, dt=repr(dt), tolerance=TOLERANCE)


def reference_motion(stepping: Stream, samples: int = _TEST_SAMPLES) -> tuple[np.ndarray, np.ndarray, float]:
    """Displacement [m] and current [A] (N,) of a growing sine inside the tested ranges, and its time step [s]."""
    envelope = stepping.envelope
    amplitude, frequency, (low, high) = 0.01, 1.0, (0.0, 1.0)
    if envelope is not None:
        amplitude, (low, high) = envelope.amplitude_m[1], envelope.current_A
        frequency = min(envelope.frequency_Hz[1], 0.5 * envelope.peak_velocity_m_s[1] / (2 * np.pi * amplitude))
    turns = np.linspace(0, 2, samples)
    x = amplitude * np.minimum(1.0, 0.2 + turns / 2) * np.sin(2 * np.pi * turns)
    current = np.where(turns % 1 < 0.6, low + 0.5 * (high - low), low + 0.8 * (high - low))
    return x, current, float(2 / (frequency * (samples - 1)))


def reference_force(
    stepping: Stream, samples: int = _TEST_SAMPLES
) -> tuple[list[tuple[float, float]], list[float], float]:
    """Displacement [m] and current [A] of `reference_motion`, the stepper's force [N] there, and the time step [s]."""
    x, current, dt = reference_motion(stepping, samples)
    steps, motion = Stepper(stepping), list(zip(x.tolist(), current.tolist(), strict=True))
    return motion, [steps.step(*sample, dt) for sample in motion], dt


def c_facts(stepping: Stream, name: str, rig: str, language: type[CWriter] = CWriter) -> dict[str, Any]:
    """Collect the template values of a damper, for C or a language that shares its grammar."""
    main, infos = language(stepping.step), stepping.model.parameters() if stepping.model else ()
    drives = {quantity: language(drive, f"from_{quantity}_") for quantity, drive in stepping.drives.items()}
    arguments = [(f"const {name}_parameters *p", "&m->p")] if infos else []
    arguments += [(f"const {name}_derived *d", "&m->d")] if stepping.step.derived else []
    described = _program("model", main, stepping.step, [*arguments, (f"{name}_state *s", "next")])
    described_drives = [
        {
            **_program(f"from_{quantity}", writer, writer.program, [(f"{name}_state *s", "&next")]),
            "quantity": quantity,
            "suffix": "" if quantity == "displacement" else f"_{quantity}",
        }
        for quantity, writer in drives.items()
    ]
    starts = [
        (writer.memory_prefix + member, repr(start))
        for writer in (main, *drives.values())
        for member, start in writer.program.tape.starts.items()
    ]
    equation = c_comment((type(stepping.model).__doc__ or "").split("\n\n")[0]) if stepping.model else ""
    return _facts(name, stepping.title, main, [described, *described_drives], starts) | {
        "rig": c_comment(rig),
        "equation": textwrap.wrap(equation, 96),
        "flags": FLAGS,
        "envelope": _envelope(stepping),
        "band": stepping.band,
        "parameters": [_parameter(info, getattr(stepping.model, info.name)) for info in infos],
        "drives": described_drives,
    }


def _facts(
    name: str, title: str, writer: CWriter, described: list[dict[str, Any]], starts: list[tuple[str, str]]
) -> dict[str, Any]:
    setup, program = writer.setup(), writer.program
    text = setup + "".join(part["body"] + part["results"] for part in described)
    return {
        "name": name,
        "upper": name.upper(),
        "title": c_comment(title),
        "version": version("mrdamper"),
        "derived": [
            ("int" if e.logical else f"{name}_real", writer.name(e).removeprefix(f"d{writer.member}"))
            for e in program.derived
        ],
        "members": [member for member, _ in starts],
        "starts": starts,
        "main": described[0],
        "setup": setup,
        "helpers": {call: f"{call}(" in text for call in ("signum", "lesser", "greater")},
        **_tables(program.tape.tables, writer.number),
    }


def shared_points(tables: Sequence[LookupTable]) -> list[Floats]:
    """Points at the nodes (K, 4), once for the tables that read them forwards and backwards."""
    return list({id(table.points): table.points for table in tables}.values())


def _tables(tables: Sequence[LookupTable], number: Callable[[float], str]) -> dict[str, Any]:
    shared = shared_points(tables)
    return {
        "curves": [
            {
                "points": [[number(v) for v in row] for row in points],
                "few": [[number(v) for v in row] for row in points[::_SINGLE_STRIDE]],
            }
            for points in shared
        ],
        "tables": [
            {"curve": next(i for i, p in enumerate(shared) if p is table.points), "backwards": table.backwards}
            for table in tables
        ],
    }


def _program(key: str, writer: CWriter, program: Program, arguments: list[tuple[str, str]]) -> dict[str, Any]:
    body, results = writer.sample(), writer.results()
    words = [argument.split("*")[1] for argument, _ in arguments] + ["u"]
    return {
        "key": key,
        "body": body,
        "results": results,
        "inputs": list(program.tape.inputs),
        "outputs": list(program.outputs),
        "arguments": ", ".join(argument for argument, _ in arguments),
        "call": ", ".join(value for _, value in arguments),
        "unused": [word for word in words if not re.search(rf"\b{word}->", body + results)],
    }


def _parameter(info: Any, value: float) -> Mapping[str, str]:
    low, high = (f"{bound:g}" for bound in info.bounds)
    return {
        "name": info.name,
        "meaning": c_comment(info.meaning),
        "unit": c_comment(info.unit),
        "low": low,
        "high": high,
        "value": repr(value),
    }


def _envelope(stepping: Stream) -> list[tuple[str, str, str]]:
    if stepping.envelope is None:
        return []
    names = ("current_A", "frequency_Hz", "amplitude_m", "peak_velocity_m_s")
    ranges = [(name, getattr(stepping.envelope, name)) for name in names]
    return [(name.upper(), repr(float(low)), repr(float(high))) for name, (low, high) in ranges]
