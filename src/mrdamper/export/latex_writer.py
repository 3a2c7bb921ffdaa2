"""Expressions as LaTeX."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import Any

from mrdamper.export.formulas import Formulas
from mrdamper.tracing import Expression
from mrdamper.tracing.tape import Law

_GREEK = (
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "kappa", "lambda", "mu", "rho", "sigma", "tau", "phi",
    "omega",
)  # fmt: skip
_BINARY = {"add": ("{} + {}", 1), "subtract": ("{} - {}", 1), "multiply": (r"{} \, {}", 2)}
_CALLS = {
    "exp": r"\exp", "log": r"\ln", "tanh": r"\tanh", "arctan": r"\arctan", "tan": r"\tan", "minimum": r"\min",
    "maximum": r"\max", "sign": r"\mathrm{sgn}", "arctanh": r"\mathrm{artanh}",
}  # fmt: skip
_NEVER_SHARED = 4  # operations up to which a repeated expression is written out again


def equations(made: Formulas) -> list[str]:
    """One line of LaTeX an equation: force first, then laws, then what they share."""
    named = {id(law.value): symbol(law.symbol.name) for law in made.laws if law.kind == "is"}
    shared = [
        e
        for e in _shared([made.force, *(v for law in made.laws for v in (law.value, law.constant))])
        if id(e) not in named
    ]
    writer = _Latex({**named, **{id(part): f"q_{{{i + 1}}}" for i, part in enumerate(shared)}})
    lines = [f"F = {writer.text(made.force)}"]
    lines += [writer.law(law) for law in made.laws]
    lines += [f"{writer.names[id(part)]} = {writer.formula(part)[0]}" for part in shared]
    return lines


def symbol(name: str) -> str:
    """A parameter's name as LaTeX: alpha, fy0 and c0_ratio become letters with indices."""
    head, _, tail = name.partition("_")
    greek = next((g for g in _GREEK if head.startswith(g)), None)
    letter = greek or head[:1]
    index = head[len(letter) :] + (f",{tail}" if tail and head[len(letter) :] else tail)
    if greek is None and len(head) > 3 and head.isalpha():  # a word
        letter, index = head, tail
        return rf"\mathrm{{{letter}}}" + (rf"_\mathrm{{{index.replace('_', ' ')}}}" if index else "")
    text = rf"\{letter}" if greek else letter
    if index.isdigit():
        return f"{text}_{{{index}}}"
    return text + (rf"_\mathrm{{{index.replace('_', ' ')}}}" if index else "")


def number(value: float) -> str:
    """A number to five digits."""
    text = f"{value:.5g}"
    if "e" in text:
        digits, power = text.split("e")
        return (r"" if digits == "1" else rf"{digits} \cdot ") + f"10^{{{int(power)}}}"
    return text


class _Latex:
    """Writes expressions; `names` holds what is written out elsewhere."""

    def __init__(self, names: dict[int, str]):
        self.names = names

    def law(self, law: Law) -> str:
        """A law as an equation."""
        y = symbol(law.symbol.name)
        if law.kind == "is":
            own = self.formula(law.value)[0] if isinstance(law.value, Expression) else number(law.value)
            return f"{y} = {own}"
        value = self.text(law.value)
        if law.kind == "rate":
            return rf"\dot{{{y}}} = {value}"
        if law.kind == "lag":
            return rf"{self.text(law.constant, 3)} \, \dot{{{y}}} + {y} = {value}"
        if law.kind == "stop":
            limit = self.text(law.constant)
            return rf"\dot{{{y}}} = {value} \;\; \mathrm{{while}} \;\; |{y}| < {limit}, \;\; \mathrm{{else}} \;\; 0"
        return f"{value} = {self.text(law.constant)}"

    def text(self, value: Any, tightness: int = 0) -> str:
        """A value, in brackets where its operation binds less tightly than asked for."""
        if not isinstance(value, Expression):
            made, own = number(value), (4 if value >= 0 else 2)
        elif id(value) in self.names:
            made, own = self.names[id(value)], 5
        else:
            made, own = self.formula(value)
        return made if own >= tightness else rf"\left({made}\right)"

    def formula(self, e: Expression) -> tuple[str, int]:
        """The operation of an expression, and how tightly it binds."""
        if e.name:
            return symbol(e.name), 5
        if e.op in _BINARY:
            pattern, own = _BINARY[e.op]
            return pattern.format(self.text(e.args[0], own), self.text(e.args[1], own + (e.op == "subtract"))), own
        if e.op == "divide":
            return rf"\frac{{{self.text(e.args[0])}}}{{{self.text(e.args[1])}}}", 3
        if e.op == "power":
            return f"{self.text(e.args[0], 5)}^{{{self.text(e.args[1])}}}", 3
        if e.op == "negative":
            return f"-{self.text(e.args[0], 2)}", 1
        if e.op == "absolute":
            return rf"\left|{self.text(e.args[0])}\right|", 5
        if e.op == "sqrt":
            return rf"\sqrt{{{self.text(e.args[0])}}}", 4
        if e.op == "expm1":
            return rf"\exp\left({self.text(e.args[0])}\right) - 1", 1
        if e.op == "log1p":
            return rf"\ln\left(1 + {self.text(e.args[0], 1)}\right)", 4
        arguments = ", ".join(self.text(arg) for arg in e.args)
        return rf"{_CALLS[e.op]}\left({arguments}\right)", 4


def _shared(roots: Sequence[Any]) -> list[Expression]:
    """Larger expressions that are used more than once, each after those it contains."""
    count: Counter[int] = Counter()
    order: list[Expression] = []
    size: dict[int, int] = {}

    def visit(value: Any) -> int:
        if not isinstance(value, Expression) or value.name:
            return 0
        count[id(value)] += 1
        if count[id(value)] == 1:
            size[id(value)] = 1 + sum(visit(arg) for arg in value.args)
            order.append(value)
        return size[id(value)]

    for root in roots:
        visit(root)
    return [e for e in order if count[id(e)] > 1 and size[id(e)] > _NEVER_SHARED]


def unit_text(unit: str) -> str:
    """A unit with its powers raised."""
    return re.sub(r"\^(-?\w+)", r"$^{\1}$", unit)
