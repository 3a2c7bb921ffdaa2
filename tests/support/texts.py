"""Texts of the project that a person reads, with their positions."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "mrdamper"
_CODE = re.compile(r"^(```|~~~)")
_SCRIPT = re.compile(
    r"""(?P<quote>["'`])(?P<text>(?:\\.|(?!(?P=quote)).)*)(?P=quote)|>(?P<between>[^<>{}]+)<""", re.DOTALL
)


def python_texts(path):
    """Yield (line, text) of every string literal that is no docstring and reads as words."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docs = {id(n.body[0].value) for n in ast.walk(tree) if isinstance(n, nodes) and ast.get_docstring(n, clean=False)}
    helps = {
        id(n.body[0].value) for n in ast.walk(tree) if isinstance(n, ast.FunctionDef) and _is_command(n) and n.body
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield node.lineno, "".join(p.value if isinstance(p, ast.Constant) else "1" for p in node.values)
        elif (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and (id(node) not in docs or id(node) in helps)
        ):
            yield node.lineno, node.value


def _is_command(function):
    """Commands of the command line show their docstring as help."""
    return any("command" in ast.unparse(d) for d in function.decorator_list)


def page_texts(path):
    """Yield (line, text) of a page outside its blocks of code."""
    inside = False
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        if _CODE.match(line.strip()):
            inside = not inside
        elif not inside:
            yield number, re.sub(r"\]\([^)]*\)|`[^`]*`", "", line)


def markup_texts(path):
    """Yield (line, text) of a template or of markup, tags left out."""
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        yield number, re.sub(r"\{[{%#].*?[}%#]\}|<[^>]*>", " ", line)


def script_texts(path):
    """Yield (line, text) of the strings of a script."""
    text = path.read_text(encoding="utf-8")
    for match in _SCRIPT.finditer(re.sub(r"(?m)^\s*(//|\*|/\*).*$", "", text)):
        words = match["text"] or match["between"] or ""
        if " " in words:
            yield text[: match.start()].count("\n") + 1, words


def all_texts():
    """Yield every file with such texts, and its reader."""
    for path in sorted(SOURCE.rglob("*.py")):
        yield path, python_texts
    for path in sorted([*SOURCE.rglob("*.j2"), *SOURCE.rglob("*.html")]):
        yield path, markup_texts
    for path in sorted(SOURCE.rglob("*.js")):
        if "vendor" not in path.parts and ".min." not in path.name:
            yield path, script_texts
    for path in [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        if "generated" not in path.parts and "_build" not in path.parts:
            yield path, page_texts
