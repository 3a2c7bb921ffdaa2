"""Planted faults of a module: small changes of the computation, by rule.

A rule changes one place inside a function: an operator, a limit, a number, an index, a function to its opposite, a name
to a similar one (train to validate, first to last), two columns of a table, two arguments. Docstrings, annotations and
messages are not changed. The list is the same every time.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

SOURCE = Path(__file__).parent.parent / "src"
_SWAPS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.And: ast.Or, ast.Or: ast.And, ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
}  # fmt: skip
_FUNCTIONS = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "mean": "median", "sin": "cos",
              "cos": "sin", "exp": "expm1", "median": "mean", "std": "var", "ptp": "max", "sqrt": "abs",
              "any": "all", "all": "any", "argmin": "argmax", "argmax": "argmin", "log": "log1p"}  # fmt: skip
_TWINS = (
    ("train", "validation"), ("current_A", "frequency_Hz"), ("frequency_Hz", "amplitude_m"), ("nrmse_pp", "nrmse_std"),
    ("wape", "mean_relative_error"), ("peak_error", "energy_error"), ("displacement", "velocity"),
    ("first", "total"), ("alpha", "beta"), ("gamma", "beta"), ("c", "k1"), ("low", "high"),
    ("per_run", "seconds"), ("cross_validated", "validation"), ("peak_force", "dissipated_energy"), ("effect", "left"),
    ("reached", "optimum"), ("measured", "predicted"), ("median", "worst"), ("split", "rig"), ("yield_off", "mass"),
)  # fmt: skip
_SYMMETRIC = {"max", "min", "maximum", "minimum", "hypot", "rmse", "isclose", "dict",
              "clip", "dissipated_power"}  # fmt: skip
_TEXTS = {"train": "validate", "validate": "train", "below": "above", "above": "below",
          "nrmse_pp": "nrmse_std", "energy_error": "peak_error", "peak_error": "energy_error"}  # fmt: skip
_BUDGETS = {"linspace", "geomspace"}  # resolution: their third argument, and the order of the ends
_GUARD = 1e-6  # a smaller number is only a guard of a division or a step
_STEPS = "most_steps"  # of a search
_TELLS = {"progress", "round", "isclose"}  # progress texts, and tolerances of equality
_TWIN = {a: b for a, b in _TWINS} | {b: a for a, b in reversed(_TWINS)}


@dataclass(frozen=True)
class Fault:
    """One change.

    Attributes
    ----------
    module : str
    place : int
        Index of the place in the module's tree.
    line : int
    text : str
        Text of its line.
    change : str
        In words.
    of : str
        The changed expression.
    """

    module: str
    place: int
    line: int
    text: str
    change: str
    of: str


def faults_of(module: str) -> list[Fault]:
    """Every fault of a module, in the order of its lines."""
    source = path_of(module).read_text(encoding="utf-8")
    lines = source.splitlines()
    found = [
        Fault(module, number, node.lineno, lines[node.lineno - 1].strip(), change, ast.unparse(node))
        for number, (node, change, _) in enumerate(_places(ast.parse(source)))
    ]
    return sorted(found, key=lambda fault: (fault.line, fault.place))


def planted(fault: Fault) -> ast.Module:
    """The module's tree with the fault in it; lines stay where they were."""
    tree = ast.parse(path_of(fault.module).read_text(encoding="utf-8"))
    _, _, plant = list(_places(tree))[fault.place]
    plant()
    return ast.fix_missing_locations(tree)


def path_of(module: str) -> Path:
    """The file of a module."""
    return SOURCE / f"{module.replace('.', '/')}.py"


_Place = tuple[ast.expr | ast.stmt, str, Callable[[], None]]


def _places(tree: ast.Module) -> Iterator[_Place]:
    """Places inside functions where a rule applies, with the description and the change."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and node.name not in ("__repr__", "__str__"):
            for statement in node.body:
                yield from _inside(statement)
        elif isinstance(node, ast.Lambda) and getattr(node, "top", True):
            yield from _inside(node.body)


def _inside(node: ast.AST) -> Iterator[_Place]:
    if isinstance(node, ast.Raise | ast.JoinedStr | ast.FunctionDef | ast.Assert):
        return  # messages, and nested functions, which are visited separately
    if (isinstance(node, ast.Call) and _called(node) in _TELLS) or (
        isinstance(node, ast.keyword) and node.arg == _STEPS
    ):
        return
    if isinstance(node, ast.Call) and _called(node) == "reshape":
        for argument in node.args:
            if ast.unparse(argument) != "-1":  # any other negative number has the same meaning
                yield from _inside(argument)
        yield from _inside(node.func)
        return
    if isinstance(node, ast.Call) and _called(node) in _BUDGETS:
        for argument in node.args[:2]:
            yield from _inside(argument)
        return
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return  # a docstring
    if isinstance(node, ast.expr | ast.stmt):
        yield from ((node, change, plant) for change, plant in _changes(node))
    for name, child in _children(node):
        if name not in ("annotation", "returns", "type") and not isinstance(child, ast.Lambda):
            yield from _inside(child)
        elif isinstance(child, ast.Lambda):
            child.top = False  # type: ignore[attr-defined]
            yield from _inside(child.body)


def _children(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    for name, value in ast.iter_fields(node):
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield name, child


def _changes(node: ast.expr | ast.stmt) -> Iterator[tuple[str, Callable[[], None]]]:
    """Changes of the rules in one node."""
    match node:
        case ast.BinOp(op=op, left=left, right=right) if type(op) in _SWAPS and not _text(left) and not _text(right):
            new = _SWAPS[type(op)]()
            yield f"{_name(op)} → {_name(new)}", lambda: setattr(node, "op", new)
        case ast.Compare(ops=[op, *_]) if type(op) in _SWAPS:
            new = _SWAPS[type(op)]()
            yield f"{_name(op)} → {_name(new)}", lambda: setattr(node, "ops", [new, *node.ops[1:]])
        case ast.BoolOp(op=op):
            new = _SWAPS[type(op)]()
            yield f"{_name(op)} → {_name(new)}", lambda: setattr(node, "op", new)
        case ast.UnaryOp(op=ast.USub() | ast.Not()):
            yield f"{_name(node.op)} dropped", lambda: _become(node, node.operand)
        case ast.Constant(value=str() as text) if text in _TEXTS:
            yield f"{text} → {_TEXTS[text]}", lambda: setattr(node, "value", _TEXTS[text])
        case ast.Constant(value=bool()) | ast.Constant(value=None) | ast.Constant(value=str()):
            return
        case ast.Constant(value=int() | float() as value) if value == 0 or abs(value) > _GUARD:
            other = type(value)(value * 10) if isinstance(value, float) or abs(value) > 9 else value + 1
            if other != value:
                yield f"{value} → {other}", lambda: setattr(node, "value", other)
        case ast.Call(func=func):
            yield from _call_changes(node, func)
        case ast.Dict(values=[_, _, *_]):
            yield from _exchanges("values", [v for k, v in zip(node.keys, node.values, strict=True) if k], node.values)
        case ast.Tuple(elts=[_, _, *_], ctx=ast.Load()):
            yield from _exchanges("items", node.elts)
        case ast.IfExp() | ast.If() | ast.While() if not isinstance(node.test, ast.Compare | ast.BoolOp | ast.UnaryOp):
            yield "condition turned", lambda: setattr(node, "test", ast.UnaryOp(ast.Not(), node.test))
        case ast.Attribute(attr=attr, ctx=ast.Load()) if attr in _TWIN:
            yield f".{attr} → .{_TWIN[attr]}", lambda: setattr(node, "attr", _TWIN[attr])


def _call_changes(node: ast.Call, func: ast.expr) -> Iterator[tuple[str, Callable[[], None]]]:
    if isinstance(func, ast.Attribute) and func.attr in _FUNCTIONS:
        yield f"{func.attr} → {_FUNCTIONS[func.attr]}", lambda: setattr(func, "attr", _FUNCTIONS[func.attr])
    if isinstance(func, ast.Name) and func.id in _FUNCTIONS:
        yield f"{func.id} → {_FUNCTIONS[func.id]}", lambda: setattr(func, "id", _FUNCTIONS[func.id])
    if _called(node) == "abs":
        yield "abs dropped", lambda: setattr(node, "func", ast.parse("__import__('operator').pos", mode="eval").body)
    if _called(node) == "sorted" and all(keyword.arg != "reverse" for keyword in node.keywords):
        yield "sorted backwards", lambda: node.keywords.append(_backwards())
    if len(node.args) > 1 and _called(node) not in _SYMMETRIC:
        yield from _exchanges("arguments", node.args)
    values = [keyword for keyword in node.keywords if not isinstance(keyword.value, ast.Constant)]
    for a, b in zip(values[:-1:2], values[1::2], strict=False):

        def exchange(a: ast.keyword = a, b: ast.keyword = b) -> None:
            a.value, b.value = b.value, a.value

        yield f"{a.arg} and {b.arg} exchanged", exchange


def _exchanges(
    what: str, among: list[ast.expr], items: list[ast.expr] | None = None
) -> Iterator[tuple[str, Callable[[], None]]]:
    """Exchange the first two that are no texts, the next two, and so on."""
    items = among if items is None else items
    places = [i for i, item in enumerate(items) if item in among and not _text(item) and not _starred(item)]
    for a, b in zip(places[::2], places[1::2], strict=False):
        if ast.dump(items[a]) == ast.dump(items[b]):
            continue

        def exchange(a: int = a, b: int = b) -> None:
            items[a], items[b] = items[b], items[a]

        yield f"{what} {a} and {b} exchanged", exchange


def _called(node: ast.Call) -> str:
    return node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")


def _starred(node: ast.expr) -> bool:
    return isinstance(node, ast.Starred)


def _text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str | type(None))
    )


def _backwards() -> ast.keyword:
    return ast.keyword("reverse", ast.Constant(True))


def _become(node: ast.UnaryOp, operand: ast.expr) -> None:
    """Remove a sign or a `not`."""
    node.op, node.operand = (ast.UAdd(), operand) if isinstance(node.op, ast.USub) else (
        ast.Not(), ast.UnaryOp(ast.Not(), operand))  # fmt: skip


def _name(op: ast.AST) -> str:
    return type(op).__name__
