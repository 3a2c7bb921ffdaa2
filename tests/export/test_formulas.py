"""The printed equations are the computed ones: their rates and forces are those of the stream."""

import math

import numpy as np
import pytest
from support.dampers import all_bare_models, all_dampers, modified_damper

from mrdamper.export.formulas import formulas
from mrdamper.export.latex import LatexExporter
from mrdamper.export.latex_writer import equations, number, symbol
from mrdamper.export.markdown import MarkdownExporter
from mrdamper.models import all_models
from mrdamper.motion import random_motion
from mrdamper.streaming import stepper
from mrdamper.tracing import Expression
from mrdamper.tracing.expression import OPERATIONS

MODELS, DAMPERS = all_bare_models(), all_dampers()
MEMORY = {"zeta": "zeta", "S": "lagged", "delta": "play", "y1": "state0", "y2": "state1"}


def evaluate(value, known):
    if not isinstance(value, Expression):
        return value
    if value.name:
        return known[value.name]
    return OPERATIONS[value.op].value(*(evaluate(arg, known) for arg in value.args))


@pytest.mark.parametrize("name", MODELS)
def test_the_printed_laws_move_the_state_as_the_stream_does(name):
    """A short step's change of every state is its printed rate times the step, and the force is the printed force."""
    model, made = MODELS[name], formulas(MODELS[name])
    motion, stream = random_motion(np.random.default_rng(2), 0.8, 0.006, (0.3, 4.0)), stepper(model)
    rows = np.column_stack([motion.displacement, motion.velocity, motion.acceleration])
    dt, checked = 1e-8, 0
    for i, (x, v, a) in enumerate(rows.tolist()):
        stream.step_motion(x, v, a, 0.4, 1e-3)
        if i % 40 != 39 or abs(v) < 1e-3:
            continue
        before = stream.state
        force = stream.step_motion(x + v * dt, v, a, 0.4, dt)
        after = stream.state
        known = {info.name: value for info, value in made.parameters.items()} | {"x": x, "v": v, "a": a, "I": 0.4}
        known |= {symbol: before[memory] for symbol, memory in MEMORY.items() if memory in before}
        for law in made.laws:
            value = evaluate(law.value, known) if law.kind != "equals" else None
            if law.kind == "is":
                known[law.symbol.name] = value
            elif law.kind == "equals":
                known["u"] = math.log(abs(force - known["f0"]) / known["fy"] - 1)
                assert evaluate(law.value, known) == pytest.approx(evaluate(law.constant, known), abs=1e-9)
            else:
                memory = MEMORY[law.symbol.name]
                rate = (after[memory] - before[memory]) / dt
                if law.kind == "lag":
                    value = (value - before[memory]) / evaluate(law.constant, known)
                elif law.kind == "stop" and abs(after[memory]) >= evaluate(law.constant, known):
                    value = 0.0
                # First order in dt; rounding of a state of order one, 2e-16, over a step of 1e-8 s.
                assert rate == pytest.approx(value, rel=2e-4, abs=1e-6)
                checked += 1
        assert evaluate(made.force, known) == pytest.approx(force, rel=1e-5, abs=1e-3)
    assert checked or not [law for law in made.laws if law.kind in ("rate", "lag", "stop")]


def test_the_functions_of_the_modified_model_are_printed_as_they_are():
    damper, made = modified_damper(), formulas(modified_damper())
    point = {"I": 0.7, "f": 1.3, "A": 0.011}
    printed = {
        law.symbol.name: evaluate(law.value, point)
        for law in made.laws
        if law.symbol.name in damper.parameters.functions
    }
    assert printed == pytest.approx({n: float(f(*point.values())) for n, f in damper.parameters.functions.items()})


@pytest.mark.parametrize("name", DAMPERS)
def test_every_equation_can_be_set(name):
    """Matplotlib's reader of TeX refuses what is not well formed."""
    from matplotlib.mathtext import MathTextParser

    lines = equations(formulas(DAMPERS[name]))
    assert lines[0].startswith("F = ")
    for line in lines:
        MathTextParser("path").parse(f"${line}$")


def test_bouc_wen_reads_as_in_the_textbook():
    lines = equations(formulas(MODELS["bouc-wen, n = 1.6"]))
    assert r"\kappa = \left(\beta + \gamma\right)^{\frac{1}{n}}" in lines
    assert lines[-1].startswith(r"\dot{\zeta} = \kappa")


def test_names_and_numbers_as_latex():
    assert symbol("alpha") == r"\alpha"
    assert symbol("k1") == "k_{1}"
    assert symbol("fy0") == r"f_\mathrm{y0}"
    assert symbol("kappa_w") == r"\kappa_\mathrm{w}"
    assert number(1.5e-7) == r"1.5 \cdot 10^{-7}"
    assert number(1234.5678) == "1234.6"


@pytest.mark.parametrize("exporter", [LatexExporter, MarkdownExporter])
def test_a_page_holds_equations_parameters_and_ranges(exporter):
    (text,) = (content.decode() for content in exporter().export(DAMPERS["joint"], "damper").files.values())
    assert "yield force without current" in text
    assert "0.5 to 4 Hz" in text
    assert r"\dot{\delta}" in text


def test_markup_in_a_rig_name_is_text():
    from dataclasses import replace

    damper = replace(DAMPERS["joint"], rig=r"a_b & \input{x} <script>")
    tex = LatexExporter().export(damper, "d").files["d.tex"].decode()
    assert r"\input" not in tex
    assert "<script>" not in MarkdownExporter().export(damper, "d").files["d.md"].decode()


def test_every_model_of_the_house_prints():
    assert {model.name for model in MODELS.values()} == set(all_models())
