"""Faults that are planted, module by module: small changes to what the code computes, made by rule.

A rule changes one place: an operator, a comparison, a number, a function for its opposite. Text,
docstrings, annotations and messages are left alone. Where a module offers more places than its
share, places are taken at equal distances, so that the list is the same every time.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

SOURCE = Path(__file__).parent.parent / "src"
# Module, how many faults, and the tests that answer for it.
TARGETS: tuple[tuple[str, int, tuple[str, ...]], ...] = (
    ("mrdamper.validation", 14, ("tests/test_validation.py",)),
    ("mrdamper.metrics", 12, ("tests/test_metrics.py", "tests/test_validation.py")),
    ("mrdamper.identification.loop_analysis", 10, ("tests/identification/test_loop_analysis.py",)),
    ("mrdamper.identification.covariance", 12, ("tests/identification/test_covariance.py",)),
    ("mrdamper.functions.forms", 12, ("tests/functions",)),
    ("mrdamper.functions.fitting", 14, ("tests/functions",)),
    ("mrdamper.reproduction.verdicts", 14, ("tests/reproduction/test_verdicts.py",)),
    ("mrdamper.reproduction.claims", 16, ("tests/reproduction/test_claims.py",)),
    ("mrdamper.reproduction.sensitivity", 8, ("tests/reproduction/test_sensitivity.py",)),
    ("mrdamper.reproduction.virtual_rig", 12, ("tests/reproduction/test_virtual_rig.py",)),
    ("mrdamper.dampers.paper", 6, ("tests/dampers/test_paper.py",)),
    ("mrdamper.dampers.joint", 8, ("tests/dampers/test_joint.py",)),
    ("mrdamper.dampers.published.ali", 8, ("tests/dampers/test_published_laws.py",)),
    ("mrdamper.dampers.published.dominguez", 8, ("tests/dampers/test_published_laws.py",)),
    ("mrdamper.dampers.published.lei", 4, ("tests/dampers/test_published_laws.py",)),
    ("mrdamper.dampers.published.lv", 4, ("tests/dampers/test_published_laws.py",)),
    ("mrdamper.dampers.published.boada", 6, ("tests/dampers/test_published_laws.py",)),
    ("mrdamper.models.play_bypass", 10, ("tests/models/test_play_bypass.py",)),
    ("mrdamper.rig_files.quality.loop", 8, ("tests/rig_files/test_quality.py",)),
)
_SWAPS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.And: ast.Or, ast.Or: ast.And, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
_NAMES = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "mean": "sum", "sin": "cos",
          "cos": "sin", "exp": "expm1", "median": "max", "std": "var", "ptp": "std", "sqrt": "abs"}  # fmt: skip


@dataclass(frozen=True)
class Fault:
    """One change.

    Attributes
    ----------
    module : str
    place : int
        Which of the module's places, counted through its tree.
    line : int
    change : str
        In words.
    tests : tuple of str
    """

    module: str
    place: int
    line: int
    change: str
    tests: tuple[str, ...]


def all_faults() -> list[Fault]:
    """The whole list, the same every time."""
    found = []
    for module, share, tests in TARGETS:
        places = list(_places(ast.parse(path_of(module).read_text(encoding="utf-8"))))
        step = max(1.0, len(places) / share)
        for k in range(min(share, len(places))):
            place = int(k * step)
            node, change = places[place]
            found.append(Fault(module, place, getattr(node, "lineno", 0), change, tests))
    return found


def planted(fault: Fault) -> str:
    """The module's source with the fault in it."""
    tree = ast.parse(path_of(fault.module).read_text(encoding="utf-8"))
    node, _ = list(_places(tree))[fault.place]
    _change(node)
    return ast.unparse(ast.fix_missing_locations(tree))


def path_of(module: str) -> Path:
    """The file of a module."""
    return SOURCE / f"{module.replace('.', '/')}.py"


def _places(tree: ast.Module) -> Iterator[tuple[ast.AST, str]]:
    """Places where a rule applies inside functions, and module constants that are numbers in tables."""
    for function in ast.walk(tree):
        if not isinstance(function, ast.FunctionDef):
            continue
        for statement in function.body:
            yield from _inside(statement)


def _inside(node: ast.AST) -> Iterator[tuple[ast.AST, str]]:
    if isinstance(node, ast.Raise | ast.JoinedStr | ast.FunctionDef | ast.Assert):
        return  # messages, and functions that are walked themselves
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return  # a docstring
    change = _described(node)
    if change:
        yield node, change
    for child in ast.iter_child_nodes(node):
        yield from _inside(child)


def _described(node: ast.AST) -> str:
    if (
        isinstance(node, ast.BinOp)
        and type(node.op) in _SWAPS
        and not isinstance(node.right, ast.Constant | ast.JoinedStr)
    ):
        return f"{type(node.op).__name__} → {_SWAPS[type(node.op)].__name__}"
    if isinstance(node, ast.Compare) and type(node.ops[0]) in _SWAPS:
        return f"{type(node.ops[0]).__name__} → {_SWAPS[type(node.ops[0])].__name__}"
    if isinstance(node, ast.BoolOp):
        return f"{type(node.op).__name__} → {_SWAPS[type(node.op)].__name__}"
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not):
        return f"{type(node.op).__name__} dropped"
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in _NAMES:
        return f"{node.func.attr} → {_NAMES[node.func.attr]}"
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _NAMES:
        return f"{node.func.id} → {_NAMES[node.func.id]}"
    return ""


def _change(node: ast.AST) -> None:
    if isinstance(node, ast.BinOp):
        node.op = _SWAPS[type(node.op)]()  # type: ignore[assignment]
    elif isinstance(node, ast.Compare):
        node.ops = [_SWAPS[type(node.ops[0])](), *node.ops[1:]]  # type: ignore[list-item]
    elif isinstance(node, ast.BoolOp):
        node.op = _SWAPS[type(node.op)]()  # type: ignore[assignment]
    elif isinstance(node, ast.UnaryOp):
        node.op = ast.UAdd() if isinstance(node.op, ast.USub) else ast.Not()
        if isinstance(node.op, ast.Not):
            node.operand = ast.UnaryOp(ast.Not(), node.operand)
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        node.func.attr = _NAMES[node.func.attr]
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        node.func.id = _NAMES[node.func.id]
