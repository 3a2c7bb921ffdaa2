"""How large the house is: `python -m benchmarks.house` prints lines by room and what the architecture test holds.

Lines of code, docstring and blank by top-level name; comments count as code. A floor is a
layer of pyproject.toml. An isinstance over dampers asks a damper for its kind, which its
methods should answer.
"""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "src" / "mrdamper"


@dataclass(frozen=True)
class Lines:
    """Lines of code, of docstrings, and blank ones."""

    code: int = 0
    docstring: int = 0
    blank: int = 0

    def __add__(self, other: Lines) -> Lines:
        return Lines(self.code + other.code, self.docstring + other.docstring, self.blank + other.blank)

    @property
    def total(self) -> int:
        return self.code + self.docstring + self.blank


def lines_of(path: Path) -> Lines:
    """Count one file."""
    text = path.read_text(encoding="utf-8")
    rows = text.splitlines()
    in_docstring: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and ast.get_docstring(
            node, clean=False
        ):
            first = node.body[0]
            in_docstring |= set(range(first.lineno, (first.end_lineno or first.lineno) + 1))
    blank = sum(not row.strip() for number, row in enumerate(rows, 1) if number not in in_docstring)
    return Lines(len(rows) - blank - len(in_docstring), len(in_docstring), blank)


def rooms() -> dict[str, Lines]:
    """Lines by name at the top level of the package."""
    found: dict[str, Lines] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        room = path.relative_to(PACKAGE).parts[0]
        found[room] = found.get(room, Lines()) + lines_of(path)
    return found


def names_at_the_top() -> list[str]:
    """What a newcomer sees on opening the package."""
    return sorted(
        path.stem
        for path in PACKAGE.iterdir()
        if path.suffix == ".py" or (path.is_dir() and any(path.glob("*.py")))
        if path.stem != "__init__"
    )


def floors() -> list[str]:
    """Layers, top to bottom."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    return settings["tool"]["importlinter"]["contracts"][0]["layers"]


def isinstance_over_dampers() -> list[str]:
    """Places that ask a damper for its kind."""
    trees = {path: ast.parse(path.read_text(encoding="utf-8")) for path in sorted(PACKAGE.rglob("*.py"))}
    kinds = _damper_kinds(trees.values())
    places = []
    for path, tree in trees.items():
        for node in ast.walk(tree):
            asks = isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "isinstance"
            if asks and (_names(node.args[1]) & kinds or ast.unparse(node.args[0]).split(".")[-1] == "damper"):
                places.append(f"{path.relative_to(ROOT)}:{node.lineno}: {ast.unparse(node)}")
    return places


def _damper_kinds(trees: Iterator[ast.Module] | object) -> set[str]:
    """Classes that are dampers, by their bases' names."""
    bases = {
        node.name: {name for base in node.bases for name in _names(base)}
        for tree in trees  # type: ignore[attr-defined]
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
    }
    kinds = {"Damper"}
    while more := {name for name, above in bases.items() if above & kinds} - kinds:
        kinds |= more
    return kinds


def _names(node: ast.expr) -> set[str]:
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}


def main() -> None:
    """Print the table."""
    table = rooms()
    print(f"{'room':24}{'code':>8}{'doc':>8}{'blank':>8}{'all':>8}")
    for room, lines in [*table.items(), ("all", sum(table.values(), Lines()))]:
        print(f"{room:24}{lines.code:8}{lines.docstring:8}{lines.blank:8}{lines.total:8}")
    asked = isinstance_over_dampers()
    print(f"\nnames at the top level: {len(names_at_the_top())}\nfloors: {len(floors())}")
    print(f"isinstance over dampers: {len(asked)}", *asked, sep="\n  ")


if __name__ == "__main__":
    main()
