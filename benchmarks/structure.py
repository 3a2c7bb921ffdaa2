"""Size and structure of the package: `python -m benchmarks.structure` prints what the architecture tests limit.

Lines of code, docstring and blank by top-level name (comments count as code); cycles and the longest chain of imports,
including those under TYPE_CHECKING and inside functions; long functions; class names with several meanings; docstrings
that open with a question word; local variables named after a participle. A layer is a line of pyproject.toml. An
isinstance over dampers tests for the kind of a damper, which its methods should decide.
"""

from __future__ import annotations

import ast
import tomllib
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
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


def packages() -> dict[str, Lines]:
    """Lines by name at the top level of the package."""
    sizes: dict[str, Lines] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE).parts[0]
        sizes[name] = sizes.get(name, Lines()) + lines_of(path)
    return sizes


def top_level_names() -> list[str]:
    """List the packages and modules directly in the package."""
    return sorted(
        path.stem
        for path in PACKAGE.iterdir()
        if path.suffix == ".py" or (path.is_dir() and any(path.glob("*.py")))
        if path.stem not in ("__init__", "__main__")
    )


def layers() -> list[str]:
    """List the layers, top to bottom."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    return settings["tool"]["importlinter"]["contracts"][0]["layers"]


def isinstance_over_dampers() -> list[str]:
    """List the places that test a damper for its kind."""
    kinds, places = _damper_kinds(), []
    for name, inside in nodes().items():
        for node in inside:
            asks = isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "isinstance"
            if asks and (_names(node.args[1]) & kinds or ast.unparse(node.args[0]).split(".")[-1] == "damper"):
                places.append(f"{name}:{node.lineno}: {ast.unparse(node)}")
    return places


def _damper_kinds() -> set[str]:
    """Find the classes that are dampers, by their bases' names."""
    bases = {
        node.name: {name for base in node.bases for name in _names(base)}
        for inside in nodes().values()
        for node in inside
        if isinstance(node, ast.ClassDef)
    }
    kinds = {"Damper"}
    while more := {name for name, above in bases.items() if above & kinds} - kinds:
        kinds |= more
    return kinds


def _names(node: ast.expr) -> set[str]:
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}


QUESTION_WORDS = ("What", "Whether", "How", "Where", "Which", "Who", "Why", "When")
PARTICIPLES = frozenset({"found", "known", "made", "told", "said", "seen"})
Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


@cache
def modules() -> dict[str, ast.Module]:
    """Parse every module, by its dotted name."""
    trees = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        trees[name] = ast.parse(path.read_text(encoding="utf-8"))
    return trees


@cache
def nodes() -> dict[str, tuple[ast.AST, ...]]:
    """List the nodes of every module, which several measures go through."""
    return {name: tuple(ast.walk(tree)) for name, tree in modules().items()}


@cache
def imports() -> dict[str, frozenset[str]]:
    """List the imports of every module within the package, except the lazily loaded names of the package itself."""
    names = modules()
    graph = {}
    for name, inside in nodes().items():
        targets = set()
        for node in inside:
            if isinstance(node, ast.Import):
                targets |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                inner = {f"{node.module}.{alias.name}" for alias in node.names}
                targets |= inner & names.keys() or {node.module or ""}
        ours = {t for t in targets & names.keys() if t not in (name, "mrdamper") and not name.startswith(f"{t}.")}
        graph[name] = frozenset(ours)
    return graph | {"mrdamper": frozenset()}


def circles() -> list[list[str]]:
    """List the sets of modules that import each other, directly or through others."""
    graph = imports()
    reached = {name: _reached(name, graph) for name in graph}
    sets = {frozenset(other for other in reached[name] if name in reached[other]) for name in graph}
    return sorted(sorted(circle) for circle in sets if circle)


def _reached(name: str, graph: dict[str, frozenset[str]]) -> set[str]:
    reached: set[str] = set()
    waiting = [name]
    while waiting:
        for target in graph[waiting.pop()] - reached:
            reached.add(target)
            waiting.append(target)
    return reached


def longest_chain() -> list[str]:
    """Return the longest chain of imports; modules of a circle count once."""
    graph, circle_of = imports(), {name: index for index, circle in enumerate(circles()) for name in circle}

    @cache
    def chain(name: str) -> tuple[str, ...]:
        beyond = (t for t in graph[name] if name not in circle_of or circle_of.get(t) != circle_of[name])
        return (name, *max((chain(target) for target in sorted(beyond)), key=len, default=()))

    return list(max(map(chain, graph), key=len))


def long_functions(most: int = 60) -> list[str]:
    """List the functions of more code lines than `most`, without their docstrings."""
    places = []
    for name, inside in nodes().items():
        for node in inside:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                first = node.body[0]
                text = (first.end_lineno or 0) - first.lineno + 1 if ast.get_docstring(node, clean=False) else 0
                size = (node.end_lineno or 0) - node.lineno + 1 - text
                places += [f"{name}.{node.name}: {size} lines"] * (size > most)
    return places


def repeated_class_names() -> dict[str, list[str]]:
    """List the class names that stand in several modules."""
    homes: dict[str, list[str]] = {}
    for name, inside in nodes().items():
        for node in inside:
            if isinstance(node, ast.ClassDef):
                homes.setdefault(node.name, []).append(name)
    return {name: places for name, places in homes.items() if len(places) > 1}


def question_openings() -> list[str]:
    """List the docstrings that begin with a question word instead of a definition or an imperative."""
    places = []
    for name, inside in nodes().items():
        for node in inside:
            text = ast.get_docstring(node) if isinstance(node, Definition | ast.Module) else None
            if text and text.split()[0].rstrip(",:") in QUESTION_WORDS:
                places.append(f"{name}.{getattr(node, 'name', '')}: {text.splitlines()[0]}")
    return places


def participle_names() -> list[str]:
    """List the functions with a local variable or parameter named found, known, made, told, said or seen."""
    places = []
    for name, inside in nodes().items():
        for function in inside:
            if isinstance(function, ast.FunctionDef):
                stored = (n for n in ast.walk(function) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store))
                names = {n.id for n in stored} | {n.arg for n in ast.walk(function) if isinstance(n, ast.arg)}
                places += [f"{name}.{function.name}: {word}" for word in sorted(PARTICIPLES & names)]
    return places


def main() -> None:
    """Print the table and the lists."""
    table = packages()
    print(f"{'package':24}{'code':>8}{'doc':>8}{'blank':>8}{'all':>8}")
    for name, lines in [*table.items(), ("all", sum(table.values(), Lines()))]:
        print(f"{name:24}{lines.code:8}{lines.docstring:8}{lines.blank:8}{lines.total:8}")
    chain, loops = longest_chain(), circles()
    print(f"\nnames at the top level: {len(top_level_names())}\nlayers: {len(layers())}")
    print(f"circles of imports: {len(loops)}", *map(", ".join, loops), sep="\n  ")
    print(f"longest chain of imports: {len(chain)}", *(f"{a} → {b}" for a, b in pairwise(chain)), sep="\n  ")
    lists = {
        "isinstance over dampers": isinstance_over_dampers(),
        "functions over 60 lines": long_functions(),
        "class names in several modules": [f"{n}: {', '.join(m)}" for n, m in repeated_class_names().items()],
        "docstrings that open with a question word": question_openings(),
        "functions with a participle as a name": participle_names(),
    }
    for title, rows in lists.items():
        print(f"{title}: {len(rows)}", *rows[:40], sep="\n  ")


if __name__ == "__main__":
    main()
