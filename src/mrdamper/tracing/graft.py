"""Copies of a program on another tape with other inputs.

A control law can thus evaluate the force of a damper at several currents: the evaluations share operations that do not
depend on the current, and the memory is updated once.
"""

from __future__ import annotations

from typing import Any

from mrdamper.tracing.expression import SAMPLE, Expression
from mrdamper.tracing.program import Program, dependencies, postorder
from mrdamper.tracing.tape import Tape, TracedLoop


class ProgramCopy:
    """A program on another tape, its parameters as they were traced.

    The names of its memory there begin with `prefix`; the input `varying` differs between evaluations, all others are
    given as expressions.
    """

    def __init__(self, source: Program, tape: Tape, prefix: str, varying: str, **inputs: Any):
        self.source, self.tape, self.varying = source, tape, varying
        self.inputs = inputs
        source_tape = source.tape
        self.memory = {name: tape.remember(f"{prefix}{name}", source_tape.starts[name]) for name in source_tape.memory}
        questions = [question for question, _ in source_tape.guards if question.stage == SAMPLE]
        self.order = postorder([*source.outputs.values(), *source_tape.updates.values(), *questions])
        self.moving = self._moving()
        self.still: dict[int, Any] = {}

    def answer(self, value: Any) -> dict[str, Any]:
        """Evaluate the outputs for this varying input without updating the memory."""
        return self._outputs(self._copied(value))

    def settle(self, value: Any) -> dict[str, Any]:
        """Evaluate the outputs for the present varying input, update the memory and check its conditions."""
        copies = self._copied(value)
        for name, memory in self.memory.items():
            if name in self.source.tape.updates:
                update = self.source.tape.updates[name]
                self.tape.update(memory, copies[id(update)] if isinstance(update, Expression) else update)
        for question, wanted in self.source.tape.guards:
            if question.stage == SAMPLE and wanted:
                self.tape.require(copies[id(question)])
        return self._outputs(copies)

    def _outputs(self, copies: dict[int, Any]) -> dict[str, Any]:
        outputs = self.source.outputs
        return {n: copies[id(value)] if isinstance(value, Expression) else value for n, value in outputs.items()}

    def _moving(self) -> set[int]:
        """Nodes that depend on the varying input; a loop's carried values do if the loop does."""
        moving: set[int] = set()
        while True:
            before = len(moving)
            for node in self.order:
                if isinstance(node, Expression) and node.op == "carry":
                    depends = id(node.args[0]) in moving
                elif isinstance(node, Expression) and node.op == "input":
                    depends = node.name == self.varying
                else:
                    depends = any(id(part) in moving for part, _ in dependencies(node))
                if depends:
                    moving.add(id(node))
            if len(moving) == before:
                return moving

    def _copied(self, value: Any) -> dict[int, Any]:
        copies, loops = dict(self.still), dict[int, TracedLoop]()
        for node in self.order:
            if id(node) not in copies:
                copies[id(node)] = self._copy(node, copies, loops, value)
                if id(node) not in self.moving:
                    self.still[id(node)] = copies[id(node)]
        return copies

    def _copy(self, node: Any, copies: dict[int, Any], loops: dict[int, TracedLoop], value: Any) -> Any:
        def of(part: Any) -> Any:
            return copies[id(part)] if isinstance(part, Expression) else part

        if isinstance(node, TracedLoop):
            loop = loops.setdefault(id(node), TracedLoop((), node.most, node.still))
            loop.start, loop.updates = tuple(map(of, node.start)), tuple(map(of, node.updates))
            loop.going = of(node.going)
            return loop
        if node.op == "carry":
            loop = loops.setdefault(id(node.args[0]), TracedLoop((), node.args[0].most, node.args[0].still))
            return Expression(self.tape, "carry", (loop, node.args[1]), SAMPLE)
        if node.op == "result":
            return Expression(self.tape, "result", (copies[id(node.args[0])], node.args[1]), SAMPLE)
        if node.op == "parameter":
            return float(node.value)
        if node.op == "input":
            return value if node.name == self.varying else self.inputs[node.name]
        if node.op == "memory":
            return self.memory[node.name]
        if node.op == "lookup":
            return self.tape.lookup(self.source.tape.tables[int(node.args[0])], of(node.args[1]))
        if node.op == "select":
            return self.tape.select(*map(of, node.args))
        return self.tape.apply(node.op, *map(of, node.args))
