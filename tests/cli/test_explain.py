"""Codes: every one in the source is explained, and nothing else; the command and the page have them all."""

import ast
import re
import runpy
from pathlib import Path

import pytest
from typer.testing import CliRunner

import mrdamper
from mrdamper.cli import application
from mrdamper.cli.commands.explain import load_codes
from mrdamper.errors import InputError, UnknownNameError

SOURCE = Path(mrdamper.__file__).parent
CODE = re.compile(r"(?<![A-Za-z0-9_])[EW]_[A-Z0-9]+(?:_[A-Z0-9]+)*(?![A-Za-z0-9_])")


def prefixes(tree):
    """Texts that are compared with the beginning of a code."""
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)]
    return {id(word) for call in calls if call.func.attr == "startswith" for word in ast.walk(call)}


def codes_of(path):
    text = path.read_text(encoding="utf-8")
    codes = set(CODE.findall(text))
    if path.suffix != ".py" or not codes:
        return codes
    tree = ast.parse(text)
    words = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    known = prefixes(tree)
    return {code for word in words if id(word) not in known for code in CODE.findall(word.value)}


def invoke(*words):
    return CliRunner().invoke(application(), ["explain", *words])


def test_every_code_of_the_source_is_explained_and_no_other():
    files = [path for kind in ("*.py", "*.js", "*.html") for path in SOURCE.rglob(kind)]
    found = set().union(*map(codes_of, files))
    assert len(found) > 150
    assert found == set(load_codes())


@pytest.mark.parametrize("key", ["meaning", "example", "remedy"])
def test_every_explanation_is_complete(key):
    for code, told in load_codes().items():
        assert set(told) == {"meaning", "example", "remedy"}, code
        assert len(told[key]) > 5, code
        assert "\n" not in told[key], code
        assert key == "example" or told[key].endswith("."), code


def test_codes_are_in_alphabetical_order_errors_first():
    assert list(load_codes()) == sorted(load_codes())


def test_the_command_prints_meaning_example_and_remedy():
    codes = load_codes()
    told = codes["E_LIMITS"]
    for spelling in ("E_LIMITS", "e_limits", "[E_LIMITS]"):
        printed = invoke(spelling).output
        assert printed.startswith("E_LIMITS\n")
        assert all(text in printed for text in told.values())
    lines = invoke().output.splitlines()
    assert [line.split()[0] for line in lines] == list(codes)


def test_an_unknown_code_gives_the_near_matches():
    error = invoke("E_LIMIT").exception
    assert isinstance(error, UnknownNameError)
    assert "E_LIMITS" in str(error)
    assert "mrdamper explain lists all codes" in str(invoke("banana").exception)


def test_the_page_holds_every_code():
    page = runpy.run_path("docs/conf.py")["codes_page"]()
    assert re.findall(r"^### (\w+)$", page, flags=re.MULTILINE) == list(load_codes())


def test_an_error_keeps_its_one_line():
    assert str(InputError("no tables", where="a.toml", remedy="write one", code="E_LIMITS")) == (
        "a.toml: no tables; write one [E_LIMITS]"
    )
