"""A traced model in the order in which it is computed: blocks, branches and loops; and the base class of its writers.

Every operation is placed in the innermost block that all its users share, so a branch that is not taken is not
computed. Operations on parameters alone are computed once, before the first sample.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from mrdamper.tracing.expression import PARAMETER, Expression
from mrdamper.tracing.tape import Tape, TracedLoop

_LEAVES = ("parameter", "input", "memory", "carry")
Scope = tuple[tuple[int, int], ...]
Use = tuple[Scope, bool]  # block in which a node is needed, and if that is before the first sample


@dataclass
class Let:
    """Give an expression a name."""

    expression: Expression


@dataclass
class Branch:
    """Compute one of two values."""

    select: Expression
    then: list[Statement]
    otherwise: list[Statement]


@dataclass
class Repeat:
    """Repeat a block until its condition fails."""

    loop: TracedLoop
    body: list[Statement]


Statement = Let | Branch | Repeat


@dataclass
class Program:
    """Operations before the first sample, and at each sample."""

    tape: Tape
    outputs: Mapping[str, Any]
    setup: list[Statement] = field(default_factory=list[Statement])
    step: list[Statement] = field(default_factory=list[Statement])
    derived: list[Expression] = field(default_factory=list[Expression])  # values from `setup` for `step`
    # name of an expression by its id; expressions without a name are written where they are used
    names: dict[int, str] = field(default_factory=dict[int, str])

    @property
    def given(self) -> tuple[float, ...]:
        """Values of the parameters as they were traced."""
        return tuple(float(parameter.value) for parameter in self.tape.parameters.values())

    def guards(self, stage: int) -> list[tuple[Expression, bool]]:
        """Guards that can be evaluated at a stage."""
        return [(question, answer) for question, answer in self.tape.guards if question.stage == stage]


def program(tape: Tape, outputs: Mapping[str, Any]) -> Program:
    """Order the operations of a tape into a program with these outputs."""
    result = Program(tape, outputs)
    roots = [(value, False) for value in (*outputs.values(), *tape.updates.values())]
    roots += [(question, question.stage <= PARAMETER) for question, _ in tape.guards]
    order = postorder([root for root, _ in roots])
    scopes, uses = _scopes(roots, order)
    _name(result, order, scopes, uses)
    _fill(result, order, scopes)
    return result


def dependencies(node: Expression | TracedLoop) -> Iterator[tuple[Any, int | None]]:
    """List the nodes a node is computed from; a number marks the inner block in which each is needed."""
    if isinstance(node, TracedLoop):
        yield from ((value, None) for value in node.start)
        yield node.going, 0
        yield from ((value, 0) for value in node.updates)
    elif node.op == "select":
        yield from zip(node.args, (None, 0, 1), strict=True)
    elif node.op == "result":
        yield node.args[0], None
    elif node.op != "carry":
        yield from ((arg, None) for arg in node.args)


def postorder(roots: list[Any]) -> list[Any]:
    """Return nodes in topological order."""
    visited: set[int] = set()
    order: list[Any] = []
    stack: list[tuple[Any, bool]] = [(root, False) for root in reversed(roots)]
    while stack:
        node, done = stack.pop()
        if not isinstance(node, Expression | TracedLoop):
            continue
        if done:
            order.append(node)
        elif id(node) not in visited:
            visited.add(id(node))
            stack.append((node, True))
            stack.extend((part, False) for part, _ in reversed(list(dependencies(node))))
    return order


def _scopes(roots: list[tuple[Any, bool]], order: list[Any]) -> tuple[dict[int, Scope], dict[int, list[Use]]]:
    """Find the innermost block that all users of a node share, and the uses."""
    scopes: dict[int, Scope] = {}
    uses: dict[int, list[Use]] = defaultdict(list)

    def used(part: Any, scope: Scope, early: bool) -> None:
        if isinstance(part, Expression | TracedLoop):
            uses[id(part)].append((scope, early))
            scopes[id(part)] = _common(scopes.get(id(part), scope), scope)

    for root, early in roots:
        used(root, (), early)
    for node in reversed(order):
        here = scopes[id(node)]
        early = all(early for _, early in uses[id(node)]) if here else _early(node)
        for part, block in dependencies(node):
            used(part, here if block is None else (*here, (id(node), block)), early)
    return scopes, uses


def _common(a: Scope, b: Scope) -> Scope:
    length = 0
    while length < min(len(a), len(b)) and a[length] == b[length]:
        length += 1
    return a[:length]


def _early(node: Any) -> bool:
    return isinstance(node, Expression) and node.stage <= PARAMETER


def _name(result: Program, order: list[Any], scopes: dict[int, Scope], uses: dict[int, list[Use]]) -> None:
    """Name leaves, branches, loops, and what is used more than once or in another block.

    Expressions computed before the first sample and used later are derived constants; an expression used once, in its
    own block, is written where it is used.
    """
    stored = {id(value) for value in result.tape.updates.values()}
    for node in order:
        if isinstance(node, TracedLoop):
            continue
        if node.op in ("parameter", "input", "memory"):
            result.names[id(node)] = node.name
            continue
        users, scope = uses[id(node)], scopes[id(node)]
        derived = not scope and _early(node) and not all(early for _, early in users)
        if derived:
            result.derived.append(node)
        elsewhere = len(users) > 1 or users[0][0] != scope
        if derived or elsewhere or node.op in ("select", "carry", "result") or id(node) in stored:
            result.names[id(node)] = f"{'d' if derived else 't'}{len(result.names)}"


def _fill(result: Program, order: list[Any], scopes: dict[int, Scope]) -> None:
    """Put named expressions into blocks."""
    blocks: dict[tuple[Scope, bool], list[Statement]] = defaultdict(list)
    early_blocks: set[int] = set()
    for node in reversed(order):  # outer before inner: an inner block is computed early if its branch is
        scope = scopes[id(node)]
        if scope[0][0] in early_blocks if scope else _early(node):
            early_blocks.add(id(node))
    for node in order:
        scope, early = scopes[id(node)], id(node) in early_blocks
        home = blocks[scope, early]
        if isinstance(node, TracedLoop):
            home.append(Repeat(node, blocks[(*scope, (id(node), 0)), early]))
        elif node.op == "select":
            home.append(Branch(node, *(blocks[(*scope, (id(node), side)), early] for side in (0, 1))))
        elif id(node) in result.names and node.op not in (*_LEAVES, "result"):
            home.append(Let(node))
    result.setup, result.step = blocks[(), True], blocks[(), False]


_SAME_NAME = ("sqrt", "exp", "expm1", "log", "log1p", "tan", "tanh")
FUNCTIONS = dict(zip(_SAME_NAME, _SAME_NAME, strict=True)) | {"arctan": "atan", "arctanh": "atanh"}  # in C, JS, Python
_MARKS = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/"} | {
    "less": "<", "less_equal": "<=", "greater": ">", "greater_equal": ">=", "equal": "==", "not_equal": "!="
}  # fmt: skip


class Writer(ABC):
    """Writer of the expressions of a program; subclasses define the operations and numbers of a language."""

    formats: ClassVar[Mapping[str, str]] = {  # common to C, JavaScript and Python
        **{op: f"({{}} {mark} {{}})" for op, mark in _MARKS.items()},
        "negative": "(-{})",
    }

    def __init__(self, program: Program):
        self.program = program
        self._loops: dict[int, int] = {}

    @abstractmethod
    def number(self, value: float) -> str:
        """Write a number with all its digits."""

    def name(self, expression: Expression) -> str:
        """Return the name of an expression."""
        if expression.op in ("carry", "result"):
            loop, index = expression.args
            return self.carry(loop, index)
        return self.program.names[id(expression)]

    def carry(self, loop: TracedLoop, index: int) -> str:
        """Return the name of a loop variable."""
        return f"loop{self._loops.setdefault(id(loop), len(self._loops))}_{index}"

    def lines(self, block: list[Statement], indent: int) -> list[str]:
        """Write the lines of a block."""
        lines: list[str] = []
        for statement in block:
            if isinstance(statement, Let):
                lines.append(self.let(statement.expression))
            else:
                lines += self.branch(statement) if isinstance(statement, Branch) else self.repeat(statement)
        return [f"{'    ' * indent}{line}" for line in lines]

    @abstractmethod
    def let(self, expression: Expression) -> str:
        """Assign an expression to its name."""

    @abstractmethod
    def branch(self, statement: Branch) -> list[str]:
        """Write a choice between two blocks."""

    @abstractmethod
    def repeat(self, statement: Repeat) -> list[str]:
        """Write a loop."""

    def text(self, value: Any) -> str:
        """Write an expression where it is used: its name, or its formula."""
        if not isinstance(value, Expression):
            return self.number(value)
        if value.op in ("carry", "result") or id(value) in self.program.names:
            return self.name(value)
        return self.formula(value)

    def formula(self, expression: Expression) -> str:
        """Write the operation of an expression on its arguments."""
        if expression.op == "lookup":
            return f"lookup{expression.args[0]}({self.text(expression.args[1])})"
        return self.formats[expression.op].format(*(self.text(arg) for arg in expression.args))
