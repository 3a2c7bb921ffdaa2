"""The equations of a damper as LaTeX: those of its model, then its parameter functions."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.data import Condition
from mrdamper.errors import ParameterError
from mrdamper.statistics.functions.forms import ParameterFunction, form_named

_SAME_VALUE = 1e-9  # relative difference of values that are one
NOWHERE = Condition(0.0, 1.0, 0.01)  # any condition: a damper without ranges has one model for all


def equations(damper: Damper) -> list[str]:
    """One line of LaTeX per equation: force, state, parameter functions; raises `ParameterError` if there is none."""
    if not damper.equation:
        raise ParameterError(
            "no equations to print", where=damper.title, remedy="export a damper with a model behind it"
        )
    model: Any = damper.model_at(damper.envelope.middle if damper.envelope.tested else NOWHERE)
    symbols = {name: letter for name, (letter, *_) in type(model).coordinates.items()}
    symbols |= {info.name: info.symbol for info in model.parameters()}
    lines = [line.strip() for line in damper.equation.split(r",\quad")]
    lines += [f"{symbols[name]} = {function_text(function)}" for name, function in damper.functions.items()]
    lines += _constants(damper, model, symbols) if damper.functions else []
    if damper.tested_motions is not None:
        corners = ",\\; ".join(
            rf"({number(f)}\,\mathrm{{Hz}},\ {number(1e3 * A)}\,\mathrm{{mm}})"
            for f, A in damper.tested_motions.corners
        )
        lines.append(
            rf"(f, A) \to \text{{nearest motion, in }}(\ln f, \ln A)\text{{, of the convex hull of }} {corners}"
        )
    return lines


def _constants(damper: Damper, model: Any, symbols: Mapping[str, str]) -> list[str]:
    """Write the parameters that no function gives: constant ones, and constant coordinates of those that vary."""
    others = [damper.model_at(condition) for condition in damper.envelope.corners] if damper.envelope.tested else []

    def is_constant(name: str) -> bool:
        values = [getattr(one, name) for one in (model, *others)]
        return bool(np.ptp(values) <= _SAME_VALUE * np.max(np.abs(values)))

    rest = [info.name for info in model.parameters() if info.name not in damper.functions]
    constants, lines = [name for name in rest if is_constant(name)], list[str]()
    if len(constants) < len(rest):
        for name, (_, relation, _) in type(model).coordinates.items():
            if name not in damper.functions and hasattr(model, name) and is_constant(name):
                lines.append(relation)
                constants.append(name)
    return [*lines, *(f"{symbols[name]} = {number(float(getattr(model, name)))}" for name in constants)]


def function_text(function: ParameterFunction) -> str:
    """Write a parameter function of I, f and A as LaTeX, with its numbers."""
    parts = []
    for value, term in zip(function.coefficients, form_named(function.form).terms, strict=True):
        powers = {"I": term.current, "f": term.frequency, "A": term.amplitude}
        factors = [name if power == 1 else f"{name}^{{{power}}}" for name, power in powers.items() if power]
        if term.onset_I is not None:
            factors.append(rf"\left(1 + {number(function.rates[term.onset_I])} \, I\right)")
        exponents = [(term.decay_I, "I"), (term.onset_I, "I"), (term.decay_f, "f")]
        factors += [f"e^{{{number(-function.rates[i])} \\, {name}}}" for i, name in exponents if i is not None]
        if term.power_f is not None:
            factors.append(f"f^{{{number(-function.rates[term.power_f])}}}")
        product = r" \, ".join([number(abs(value)), *factors])
        parts.append(f"- {product}" if value < 0 else f"+ {product}" if parts else product)
    text = " ".join(parts).strip()
    return rf"\exp\left({text}\right)" if function.log else text


def number(value: float) -> str:
    """Write a number to five digits."""
    text = f"{value:.5g}"
    if "e" not in text:
        return text
    digits, power = text.split("e")
    ten = f"10^{{{int(power)}}}"
    return {"1": ten, "-1": f"-{ten}"}.get(digits, rf"{digits} \cdot {ten}")


def unit_text(unit: str) -> str:
    """Write a unit with its powers raised."""
    return re.sub(r"\^(-?\w+)", r"$^{\1}$", unit)
