"""Fonts for characters that the bundled font does not contain: found where installed, named where not."""

import io

import pytest
from fontTools.fontBuilder import FontBuilder
from fontTools.pens.ttGlyphPen import TTGlyphPen
from pypdf import PdfReader

from mrdamper.errors import UnknownNameError
from mrdamper.report import fonts
from mrdamper.report.pdf import pdf_of

PAGE = "<html><body><header><h1>Report</h1></header><main><p>東京 damper</p></main><footer></footer></body></html>"


def font_with(characters, path):
    builder = FontBuilder(1000, isTTF=True)
    pen = TTGlyphPen(None)
    for point in ((0, 0), (0, 700), (600, 700), (600, 0)):
        (pen.moveTo if point == (0, 0) else pen.lineTo)(point)
    pen.closePath()
    names = [".notdef", *(f"g{ord(c):x}" for c in characters)]
    builder.setupGlyphOrder(names)
    builder.setupCharacterMap({ord(c): f"g{ord(c):x}" for c in characters})
    builder.setupGlyf(dict.fromkeys(names, pen.glyph()))
    builder.setupHorizontalMetrics(dict.fromkeys(names, (700, 0)))
    builder.setupHorizontalHeader(ascent=800, descent=-200)
    builder.setupNameTable({"familyName": "Test", "styleName": "Regular"})
    builder.setupOS2()
    builder.setupPost()
    builder.save(path)
    return str(path)


def text_of(pdf):
    return "".join(page.extract_text() for page in PdfReader(io.BytesIO(pdf)).pages)


def test_characters_of_an_installed_font_are_printed(monkeypatch, tmp_path):
    path = font_with("東京", tmp_path / "test.ttf")
    monkeypatch.setattr(fonts, "installed_fonts", lambda: [path])
    text = text_of(pdf_of(PAGE, {}))
    assert "東京" in text
    assert "Not printed" not in text


def test_characters_without_a_font_are_named(monkeypatch):
    monkeypatch.setattr(fonts, "installed_fonts", list)
    assert "Not printed, because no installed font contains them: U+4EAC" in text_of(pdf_of(PAGE, {}))


def test_a_word_of_another_type_is_not_broken_at_the_end_of_a_line():
    lines = "".join(f"<p>{'i' * n} (<b>Current laws</b>: <code>global</code>-fit)</p>" for n in range(100, 200))
    text = text_of(pdf_of(PAGE.replace("<p>東京 damper</p>", lines), {}))
    for word in ("(Current", "laws:", "global-fit)"):
        assert text.count(word) == 100, word


@pytest.mark.parametrize(("paper", "height"), [("a4", 841.89), ("letter", 792.0)])
def test_pages_have_the_size_asked_for(paper, height):
    (page,) = PdfReader(io.BytesIO(pdf_of(PAGE.replace("東京", ""), {}, paper))).pages
    assert float(page.mediabox.height) == pytest.approx(height, abs=0.1)


def test_another_paper_size_is_refused():
    with pytest.raises(UnknownNameError, match="known: a4, letter"):
        pdf_of(PAGE, {}, "foolscap")
