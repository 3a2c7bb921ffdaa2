"""Printed equations: written once by hand, nothing left out, the functions' numbers in them."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.mathtext import MathTextParser
from support.dampers import all_bare_models, all_dampers, joint_damper, modified_damper

from mrdamper.dampers.joint import damper_of
from mrdamper.dampers.kernel import KernelDamper, KernelLaw
from mrdamper.dampers.model_file import load_model
from mrdamper.dampers.published import all_conditioned
from mrdamper.data.parameters import latex_symbol
from mrdamper.errors import ParameterError
from mrdamper.exporters.documents import LatexExporter, MarkdownExporter
from mrdamper.exporters.equations import equations, function_text, number
from mrdamper.models import all_models
from mrdamper.statistics.functions.forms import FORMS, ParameterFunction

DAMPERS = all_dampers()
STORED = Path(__file__).parents[1] / "files" / "stored" / "1.1"


@pytest.mark.parametrize("name", all_models())
def test_every_parameter_stands_in_the_equation(name):
    model = all_models()[name]
    for info in model.parameters():
        assert re.search(rf"{re.escape(info.symbol)}(?![a-zA-Z0-9])", model.equation), (info.name, info.symbol)
    symbols = [info.symbol for info in model.parameters()]
    assert len(set(symbols)) == len(symbols)


@pytest.mark.parametrize("name", all_conditioned())
def test_every_coefficient_stands_in_the_law(name):
    damper = load_model(STORED / f"{name}.json")
    for key in damper.numbers:
        symbol = latex_symbol(key)
        if name == "boada-type":  # 74 weights: the law says what the tables are
            symbol = symbol.split("_")[0]
        if symbol != "I_r" or name in ("dominguez-type",):
            assert symbol in damper.equation or symbol in ("f_r", "A_r"), (key, symbol)


@pytest.mark.parametrize("name", DAMPERS)
def test_every_equation_can_be_set_and_no_sign_stands_twice(name):
    """Matplotlib's reader of TeX refuses what is not well formed."""
    lines = equations(damper_of(DAMPERS[name]))
    assert lines[0].startswith("F = ")
    for line in lines:
        MathTextParser("path").parse(f"${line}$")
        assert not re.search(r"[+-]\s*[+-]", line), line


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("log", [False, True])
def test_a_printed_function_gives_the_parameter(form, log):
    rng = np.random.default_rng(len(form))
    shape = FORMS[form]
    function = ParameterFunction(
        form, tuple(rng.normal(size=len(shape.terms))), tuple(rng.uniform(0.5, 2, len(shape.rate_bounds))), log
    )
    text = function_text(function)
    assert not re.search(r"[+-]\s*[+-]", text)
    I, f, A = 0.7, 1.3, 0.011
    code = text.replace(r"\left", "").replace(r"\right", "").replace(r"\exp", "np.exp").replace(r"\cdot", "*")
    code = code.replace(r" \, ", "*").replace(r"e^", "np.e**").replace("^", "**").replace("{", "(").replace("}", ")")
    printed, meant = eval(code, {"np": np, "I": I, "f": f, "A": A}), float(function(I, f, A))
    terms = shape.columns(*(np.array([value]) for value in (I, f, A)), function.rates)[0] * function.coefficients
    rounding = 2e-4 * np.sum(np.abs(terms))  # five digits of each, terms that cancel
    if log:
        printed, meant = np.log(printed), np.log(meant)
    assert printed == pytest.approx(meant, abs=rounding)


def test_a_modified_model_prints_its_coordinates_and_their_functions():
    lines = equations(modified_damper())
    assert any(line.startswith(r"\alpha = F_z") for line in lines)
    assert any(line.startswith(r"x_z = \exp\left(") for line in lines)
    assert r"f_0 = 30" in lines
    # What no function gives is a constant, or a relation of those that follow from functions.
    for name in (r"\rho", "n", "k_2", "m"):
        assert any(line.startswith(f"{name} = ") for line in lines), name
    assert r"\gamma - \beta = \rho (\beta + \gamma)" in lines


def test_latex_holds_no_character_that_needs_another_package():
    text = LatexExporter().export(DAMPERS["joint"], "damper").files["damper.tex"].decode()
    assert "2 (d $-$ e)" in text
    assert not re.search("[−√≤≥∈α-ω]", text)


def test_a_regression_has_no_equation():
    law = KernelLaw(np.zeros((1, 4)), np.ones(1), np.ones(4), 0.0, 1.0)
    with pytest.raises(ParameterError, match="no equations"):
        equations(KernelDamper(law, rig="bench", envelope=joint_damper().envelope))


def test_names_and_numbers_as_latex():
    assert latex_symbol("alpha") == r"\alpha"
    assert latex_symbol("k1") == "k_1"
    assert latex_symbol("fy") == "f_y"
    assert latex_symbol("fy0") == "f_{y0}"
    assert latex_symbol("kappa_w") == r"\kappa_w"
    assert number(1.5e-7) == r"1.5 \cdot 10^{-7}"
    assert number(1234.5678) == "1234.6"


@pytest.mark.parametrize("exporter", [LatexExporter, MarkdownExporter])
def test_a_page_holds_equations_parameters_and_ranges(exporter):
    (text,) = (content.decode() for content in exporter().export(DAMPERS["joint"], "damper").files.values())
    assert "yield force without current" in text
    assert "0.5 to 4 Hz" in text
    assert r"\dot\delta" in text


def test_markup_in_a_rig_name_is_text():
    damper = replace(DAMPERS["joint"], rig=r"a_b & \input{x} <script>")
    tex = LatexExporter().export(damper, "d").files["d.tex"].decode()
    assert r"\input" not in tex
    assert "<script>" not in MarkdownExporter().export(damper, "d").files["d.md"].decode()


def test_every_model_of_the_house_prints():
    for model in all_bare_models().values():
        assert equations(damper_of(model))
