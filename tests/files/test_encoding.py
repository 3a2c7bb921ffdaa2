"""Text from data stays text: parsed again, or compiled, it is what went in or harmless."""

import csv
import io
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from markdown_it import MarkdownIt

from mrdamper.data.encoding import c_comment, csv_cell, csv_text, csv_value, file_names, latex, markdown, xml

NASTY = [
    "*\\/ int canary(void); /*", "*/", "**//", "*??/\n/", "/*/", "???/", "\\", "\u2028*/", "]]>", "&lt;b>", "<script>",
    '"><x y="', "=cmd|' /C calc'!A0", "+1+cmd|x", "-2+3", "@SUM(1)", "\t=1", "a;=1", "a\n=1", "'=1", "''=1", "..", ".",
    "MTS 810/25kN", "a" * 300, "con", "COM1.txt", "\x1b[31m", "\u202e", "\\input{x}", "$\\input{x}$", "^^5cinput",
    "~#%&_{}", "\U0001f600" * 60,
    "`x`", "![a](javascript:b)", "|a|b|", "\x00", "", " ", "é̂",
]  # fmt: skip
names = st.one_of(st.sampled_from(NASTY), st.lists(st.sampled_from(NASTY), max_size=3).map("".join), st.text())


@given(names)
def test_a_comment_in_c_holds_no_mark_that_means_something(text):
    made = c_comment(text)
    assert re.fullmatch(r"[ -~]*", made)
    assert not re.search(r"[*/?][*/?]|\\", made)


@given(names)
def test_xml_gives_the_text_back(text):
    root = ElementTree.fromstring(f'<a b="{xml(text)}">{xml(text)}</a>')
    assert (root.text or "") == root.get("b")
    if text.isprintable():
        assert root.get("b") == re.sub(r"\s+", " ", text)
    assert len(root) == 0


@given(names)
def test_latex_holds_no_command_but_those_of_signs(text):
    rest = re.sub(r"\\(text[a-z]+\{\}|[&%$#_{}])|\$(-|\\[a-z]+)\$", "", latex(text))
    assert not re.search(r"[\\&%$#_{}^~\n]", rest)


@given(names)
def test_markdown_renders_as_the_text(text):
    token = MarkdownIt("commonmark").enable("table").parseInline(markdown(text))[0]
    assert {child.type for child in token.children} <= {"text", "text_special"}
    if text.isprintable() and text == text.strip():
        assert "".join(child.content for child in token.children) == " ".join(text.split())


@given(names)
@example("-")
def test_a_cell_is_no_formula_and_comes_back(text):
    cell = csv_cell(text)
    assert csv_value(cell) == text
    assert (
        cell == "-"
        or not re.match(r"[=+\-@\t\r]", cell)
        or re.fullmatch(r"[+-]?[\d.]+(e[+-]?\d+)?", cell, re.IGNORECASE)
    )


@given(st.lists(names, min_size=1, max_size=4))
def test_a_table_is_read_as_it_was_written(texts):
    text = csv_text([{str(i): value for i, value in enumerate(texts)}])
    assert list(csv.reader(io.StringIO(text, newline="")))[1:] in ([[csv_cell(t) for t in texts]], [[]])
    if not any(set("\n\r") & set(t) for t in texts):
        assert not re.search(r"(^|[;\t])\s*[=@]", re.sub(r'"[^"]*"', "", text.split("\n")[1]))


def test_numbers_in_tables_are_exact_and_nothing_is_empty():
    assert csv_text([{"a": np.float64(0.1 + 0.2), "b": None, "c": True}, {"d": -1}]) == (
        "a,b,c,d\n0.30000000000000004,,True,\n,,,-1\n"
    )


@given(st.lists(names, min_size=1, max_size=5, unique=True))
@example(["a/b", "a b", "A_B"])
def test_file_names_are_safe_and_no_two_alike(texts):
    made = file_names(texts)
    assert len({name.casefold() for name in made.values()}) == len(texts)
    for name in made.values():
        assert re.fullmatch(r"\w[\w.\-]*", name)
        assert len(f"identifications-{name}.json".encode()) <= 255
        assert name.lower() not in ("con", "nul", "com1")


@pytest.mark.parametrize("name", ["bench", "utfsm", "MTS-810", "Rig_2.1"])
def test_a_name_that_is_safe_stays(name):
    assert file_names([name]) == {name: name}
