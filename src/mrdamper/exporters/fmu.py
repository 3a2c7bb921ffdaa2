"""FMI 2.0 and 3.0: a co-simulation FMU with sources, binaries, and a reference for checks."""

from __future__ import annotations

import hashlib
import io
import math
import uuid
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.joint import damper_of
from mrdamper.dampers.streaming import FLAGS, Stepper, Stream, stream
from mrdamper.data import Floats
from mrdamper.data.encoding import csv_text, rows_of
from mrdamper.errors import InputError
from mrdamper.exporters.base import Exporter, Written, identifier
from mrdamper.exporters.c import c_facts, c_sources, reference_motion
from mrdamper.exporters.fmu_description import description_facts
from mrdamper.exporters.templates import render
from mrdamper.exporters.toolchain import PLATFORMS, build_library
from mrdamper.models import Model

_SAMPLES_PER_CYCLE = 200
_INTERNAL_STEP = 2.0**-9  # s; two milliseconds, so that the usual communication step of 1 ms is one internal step
MOST_STEPS = 1_000_000  # internal ones, in a communication step
_DATE = (1980, 1, 1, 0, 0, 0)  # the earliest date of a zip file: the same FMU has the same bytes


@dataclass(frozen=True)
class FMUExporter(Exporter):
    """An FMU for co-simulation of FMI 2 or 3.

    Binaries are compiled for `platforms`, named as FMI 3.0 does; default: all that the compilers of this machine
    support. None gives sources alone.
    """

    name: ClassVar[str] = "fmu"
    title: ClassVar[str] = "FMU for co-simulation"
    suffix: ClassVar[str] = ".fmu"

    fmi: Literal[2, 3] = 2
    platforms: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        if self.fmi not in (2, 3):
            raise InputError(f"FMI {self.fmi}", remedy="give 2 or 3", code="E_FMI_VERSION")
        unknown = set(self.platforms or ()) - {p.name for p in PLATFORMS}
        if unknown:
            names = ", ".join(p.name for p in PLATFORMS)
            raise InputError(f"no platform {', '.join(sorted(unknown))}", remedy=f"known: {names}", code="E_PLATFORM")

    def export(self, damper: Damper | Model, name: str) -> Written:
        return self.packed(fmu_texts(damper, identifier(name), self.fmi), identifier(name))

    def packed(self, files: Mapping[str, bytes], name: str) -> Written:
        """Zip the texts of an FMU with binaries of their sources."""
        binaries, notes = self._binaries(files, name)
        return Written({f"{name}{self.suffix}": zipped({**files, **binaries})}, tuple(notes))

    def _binaries(self, files: Mapping[str, bytes], name: str) -> tuple[dict[str, bytes], list[str]]:
        sources = {path.removeprefix("sources/"): text for path, text in files.items() if path.startswith("sources/")}
        binaries: dict[str, bytes] = {}
        left_out: dict[str, list[str]] = {}
        for platform in (p for p in PLATFORMS if self.fmi == 3 or p.fmi2):
            if self.platforms is not None and platform.name not in self.platforms:
                continue
            built = build_library(sources, platform)
            if built.library is None:
                left_out.setdefault(built.reason, []).append(platform.name)
            else:
                folder = platform.fmi2 if self.fmi == 2 else platform.name
                binaries[f"binaries/{folder}/{name}{platform.suffix}"] = built.library
        notes = [f"no binary for {', '.join(names)}: {reason}" for reason, names in left_out.items()]
        if not binaries:
            notes.append("the FMU holds sources alone; the importer has to compile them")
        return binaries, notes


@dataclass(frozen=True, eq=False)
class Reference:
    """A motion and the force of the model, sample by sample."""

    step: float  # communication step [s], a power of two: times and their differences are exact
    internal_step: float  # [s], a power of two
    displacement: Floats  # (N,) input set at the samples [m]
    velocity: Floats  # (N,) the same [m/s]
    current: Floats  # (N,) the same [A]
    force: Floats  # (N,) output read at the samples [N]: at rest, then for the inputs set one sample before
    flags: np.ndarray  # (N,) bits in the order of `FLAGS`


def reference(stepping: Stream) -> Reference:
    """Compute two growing cycles inside the tested ranges, driven by the displacement."""
    _, _, dt = reference_motion(stepping)
    turn = dt * 399 / 2  # of that motion's 400 samples
    step = 2.0 ** math.floor(math.log2(turn / _SAMPLES_PER_CYCLE))
    internal_step = min(step, _INTERNAL_STEP)
    x, current, _ = reference_motion(stepping, round(2 * turn / step) + 1)
    samples = [*zip(x.tolist(), current.tolist(), strict=True)]
    rest = _walk(Stepper(stepping), samples[:1], internal_step, 1)
    moved = _walk(Stepper(stepping), samples[:-1], step, round(step / internal_step))
    force, flags = (np.array(column) for column in zip(*rest, *moved, strict=True))
    return Reference(step, internal_step, x, np.gradient(x, step), current, force, flags)


def _walk(steps: Stepper, samples: list[tuple[float, float]], step: float, count: int) -> list[tuple[float, int]]:
    """Compute force and flags after each sample, in equal internal steps with linear inputs."""
    last, answers = samples[0], []
    for sample in samples:
        force, flags = 0.0, 0
        for k in range(1, count + 1):
            x, current = (b if k == count else a + (b - a) * (k / count) for a, b in zip(last, sample, strict=True))
            force = steps.step(x, current, step / count)
            flags |= sum(1 << FLAGS.index(flag) for flag in steps.extrapolation)
        last = sample
        answers.append((force, flags))
    return answers


def fmu_texts(damper: Damper | Model, name: str, fmi: int) -> dict[str, bytes]:
    """Return the texts of the FMU of a damper by path."""
    stepping = stream(damper)
    expected = reference(stepping)
    rig = damper_of(damper).rig
    time = expected.step * np.arange(expected.force.size, dtype=np.float64)
    given = {"displacement": expected.displacement, "velocity": expected.velocity, "current": expected.current}
    outputs = {
        "force": expected.force,
        **{f"outside_{flag}": expected.flags >> bit & 1 for bit, flag in enumerate(FLAGS)},
    }
    facts = _facts(stepping, name, rig, fmi, expected)
    sources = c_sources(stepping, name, rig)
    return all_texts(facts, sources, "fmu_instance", "fmu_documentation", time, given, outputs)


def token_of(files: Mapping[str, bytes]) -> str:
    """Calculate the GUID of an FMU from its texts without a GUID."""
    digest = hashlib.sha256()
    for path in sorted(files):
        for part in (path.encode(), files[path]):
            digest.update(len(part).to_bytes(8, "little") + part)
    return f"{{{uuid.UUID(bytes=digest.digest()[:16], version=4)}}}"


def zipped(files: Mapping[str, bytes]) -> bytes:
    """Write a zip archive whose bytes depend on the files only."""
    archive_bytes = io.BytesIO()
    with zipfile.ZipFile(archive_bytes, "w") as archive:
        for path in sorted(files, key=lambda p: (p != "modelDescription.xml", p)):
            entry = zipfile.ZipInfo(path, _DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = (0o755 if path.startswith("binaries/") else 0o644) << 16
            archive.writestr(entry, files[path])
    return archive_bytes.getvalue()


def _facts(stepping: Stream, name: str, rig: str, fmi: int, expected: Reference) -> dict[str, Any]:
    facts, envelope = c_facts(stepping, name, rig), stepping.envelope
    facts |= description_facts(stepping, fmi, expected.internal_step, facts["members"])
    return facts | {
        "fmi": fmi,
        "envelope": envelope.ranges(" to ") if envelope else {},
        "most_steps": MOST_STEPS,
        "stop_time": repr(expected.step * (expected.force.size - 1)),
        "about": f"{stepping.title}{f' of rig {rig}' if rig else ''}, written by mrdamper.",
    }


def all_texts(
    facts: Mapping[str, Any],
    sources: Mapping[str, str],
    instance: str,
    page: str,
    time: Floats,
    given: Mapping[str, np.ndarray],
    outputs: Mapping[str, np.ndarray],
) -> dict[str, bytes]:
    """Collect the texts of an FMU by path: C sources and those of an instance, its description, its reference.

    The token in them is a hash of the others. `instance` and `page` are the templates of the FMI functions and of the
    documentation, `time` [s], `given` and `outputs` the reference, (N,) each.
    """
    tables = {
        "resources/reference_in.csv": csv_text(rows_of({"time": time, **given})).encode(),
        "resources/reference_out.csv": csv_text(rows_of({"time": time, **outputs})).encode(),
    }
    token = token_of(_texts({**facts, "token": ""}, sources, instance, page) | tables)
    return _texts({**facts, "token": token}, sources, instance, page) | tables


def _texts(facts: Mapping[str, Any], sources: Mapping[str, str], instance: str, page: str) -> dict[str, bytes]:
    name, fmi = facts["name"], facts["fmi"]
    sources = {
        **sources,
        f"{name}_fmu.h": render(f"{instance}.h.j2", **facts),
        f"{name}_fmu.c": render(f"{instance}.c.j2", **facts),
        f"{name}_fmi{fmi}.c": render(f"fmi{fmi}_functions.c.j2", **facts),
    }
    listed = sorted(file for file in sources if file.endswith(".c"))
    if fmi == 3:
        sources["buildDescription.xml"] = render("buildDescription.xml.j2", **facts, source_files=listed)
    texts = {
        "modelDescription.xml": render(f"modelDescription_fmi{fmi}.xml.j2", **facts, source_files=listed),
        **{f"sources/{file}": text for file, text in sources.items()},
        "documentation/index.html": render(f"{page}.html.j2", **facts),
    }
    return {path: text.encode() for path, text in texts.items()}
