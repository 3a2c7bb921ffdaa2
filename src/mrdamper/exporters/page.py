"""One HTML file with sliders and without a network: the damper as WebAssembly from C, and as JavaScript."""

from __future__ import annotations

import base64
import json
import math
from dataclasses import asdict
from importlib.metadata import version
from importlib.resources import files
from typing import Any, ClassVar

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.envelope import SLACK, Envelope
from mrdamper.dampers.joint import damper_of
from mrdamper.dampers.streaming import FLAGS, Stream, stream
from mrdamper.data.wording import number, span
from mrdamper.exporters.base import Exporter, Written, identifier
from mrdamper.exporters.c import TOLERANCE, c_facts, c_sources, reference_force, shared_points
from mrdamper.exporters.templates import render
from mrdamper.exporters.toolchain import build_webassembly
from mrdamper.models import Model
from mrdamper.statistics.functions.forms import form_named
from mrdamper.tracing.c_writer import JavaScriptWriter

_VECTORS = 240  # samples of the self-test
_SLIDER_STEPS = 100  # of a slider from the lowest to the highest tested value
# Field of the envelope, name, unit, its factor, and limits of the slider relative to the tested range.
_KNOBS = (
    ("current", "current_A", "Current", "A", 1.0, 0.0, 1.5),
    ("frequency", "frequency_Hz", "Frequency", "Hz", 1.0, 0.5, 1.5),
    ("amplitude", "amplitude_m", "Amplitude", "mm", 1e3, 0.5, 1.5),
)
_UNTESTED = Envelope((0.0, 1.0), (0.5, 4.0), (2e-3, 2e-2), (6e-3, 0.5))  # slider ranges of a model without tests
_SIGNS = "Displacement is measured from mid-stroke; displacement, velocity and force are positive in extension."
_FUNCTIONS = (
    "Its parameters are functions of current, frequency and amplitude, which are averaged over about a cycle of the "
    "slowest test and limited to the tested ranges."
)


class PageExporter(Exporter):
    """A web page with sliders, loops, motions from a file, and a self-test."""

    name: ClassVar[str] = "page"
    title: ClassVar[str] = "web page in one file"
    suffix: ClassVar[str] = ".html"

    def export(self, damper: Damper | Model, name: str) -> Written:
        stepping, name = stream(damper), identifier(name)
        wrapper = render("page_damper.c.j2", name=name, upper=name.upper())
        sources = {**c_sources(stepping, name, ""), f"{name}_page.c": wrapper}
        built = build_webassembly({file: text.encode() for file, text in sources.items()})
        notes = () if built.library else (f"computed in JavaScript, not WebAssembly: {built.reason}",)
        page = render("page.html.j2", **_facts(damper, stepping, name, built.library))
        return Written({f"{name}{self.suffix}": page.encode()}, notes)


def _facts(damper: Damper | Model, stepping: Stream, name: str, library: bytes | None) -> dict[str, Any]:
    rig = damper_of(damper).rig
    envelope = stepping.envelope
    computed = {
        "wasm": base64.b64encode(library).decode() if library else None,
        "curves": [_curve(points, library) for points in shared_points(stepping.step.tape.tables)],
        "test": _vectors(stepping),
        "tested": envelope and _tested(envelope),
        "slack": SLACK,
        "conditions": envelope.conditions if envelope else (),
        "flags": FLAGS,
        "band": stepping.band and asdict(stepping.band),
    }
    folder = files("mrdamper.exporters.templates")
    return {
        "heading": f"Damper of rig {rig}" if rig else stepping.title,
        "words": _words(damper, stepping),
        "knobs": _knobs(envelope),
        "parameters": [
            {fact: getattr(info, fact) for fact in ("meaning", "unit", "name")}
            | {"value": f"{getattr(stepping.model, info.name):.6g}"}
            for info in (stepping.model.parameters() if stepping.model else ())
        ],
        "facts": json.dumps(computed).replace("<", "\\u003c"),  # no text can end its element
        "damper": render("damper.js.j2", **c_facts(stepping, name, "", JavaScriptWriter)),
        "css": (folder / "page.css").read_text(encoding="utf-8"),
        "script": (folder / "page.js").read_text(encoding="utf-8"),
    }


def _vectors(stepping: Stream) -> dict[str, Any]:
    """Calculate a motion and the forces of the stepper with all digits, for the self-test of the page."""
    motion, force, step = reference_force(stepping, _VECTORS)
    columns = dict(zip(("displacement", "current", "force"), (*zip(*motion, strict=True), force), strict=True))
    packed = {name: base64.b64encode(np.array(values, "<f8").tobytes()).decode() for name, values in columns.items()}
    return {**packed, "step": step, "tolerance": TOLERANCE}


def _curve(points: np.ndarray, library: bytes | None) -> dict[str, Any]:
    """Return a table's doubles, or their position in the WebAssembly binary."""
    packed = np.ascontiguousarray(points, "<f8").tobytes()
    at = library.find(packed) if library else -1
    return {"size": points.size, "at": at} if at >= 0 else {"data": base64.b64encode(packed).decode()}


def _tested(envelope: Envelope) -> list[dict[str, Any]]:
    named = [(field, label.lower(), unit, factor) for _, field, label, unit, factor, *_ in _KNOBS]
    named.append(("peak_velocity_m_s", "peak velocity", "mm/s", 1e3))
    return [
        {
            "field": field,
            "low": low,
            "high": high,
            "said": f"{label} was tested {span(factor * low, factor * high, unit)}",
        }
        for field, label, unit, factor in named
        for low, high in (getattr(envelope, field),)
    ]


def _words(damper: Damper | Model, stepping: Stream) -> list[str]:
    sentence = f"{stepping.title[:1].upper()}{stepping.title[1:]}, exported by mrdamper {version('mrdamper')}"
    if count := getattr(damper, "parameter_count", 0):  # a model without tests
        facts = "; ".join(f"{key}: {value}" for key, value in getattr(damper, "provenance", {}).items())
        sentence += f" from a model with {count} parameters identified from tests"
        sentence += f" ({facts})" if facts else ""
    sentences = [f"{sentence}.", _SIGNS]
    if stepping.envelope is not None:
        *motion, _ = stepping.envelope.ranges().values()
        top = number(1e3 * stepping.envelope.peak_velocity_m_s[1], 3)
        sentences.append(
            f"Tested at {', '.join(motion)}, up to {top} mm/s; dashed curves are extrapolated beyond this range."
        )
        if stepping.model is None:
            forms = [form_named(function.form) for function in getattr(damper, "functions", {}).values()]
            of_motion = not forms or any(form.follows_motion for form in forms)
            sentences.append(_FUNCTIONS if of_motion else "Its parameters are functions of the current.")
        if stepping.band is not None:
            sentences.append(
                f"Shaded: {100 * stepping.band.level:g} % prediction interval of the force {stepping.band.scope}; at "
                "untested conditions the widest inside the tested ranges."
            )
    else:
        sentences.append("A model that was not identified from tests.")
    return sentences


def _knobs(envelope: Envelope | None) -> list[dict[str, Any]]:
    """Return sliders that exceed the tested range by half on either side and start in its middle."""
    ranges = envelope or _UNTESTED
    knobs = []
    for key, field, label, unit, factor, below, above in _KNOBS:
        low, high = (factor * bound for bound in getattr(ranges, field))
        step = 10.0 ** math.floor(math.log10(max(high, 1e-9) / _SLIDER_STEPS))
        middle = (low + high) / 2 if key == "current" else math.sqrt(low * high)
        least, most = _on(step, below * low, 0 if key == "current" else 1), _on(step, above * high)
        share = 100 / (most - least)
        knobs.append(
            {"key": key, "label": label, "unit": unit, "step": _short(step)}
            | {"low": _short(least), "high": _short(most), "start": _short(_on(step, middle))}
            | {"tested": [f"{share * (low - least):.4g}", f"{share * (high - low):.4g}"] if envelope else []}
            | {"said": f"tested {span(low, high, unit)}" if envelope else ""}
        )
    return knobs


def _on(step: float, value: float, least: int = 0) -> float:
    return max(round(value / step), least) * step


def _short(value: float) -> str:
    return f"{value:.6g}"
