"""The report of the bundled study as a reader sees it: page, print and figures are looked at, not read."""

import csv
import io
import re
from pathlib import Path

import numpy as np
import pytest
from pypdf import PdfReader
from support.browser import AUDIT, WIDE
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.data.encoding import csv_text
from mrdamper.report.plots.comparison import ranking
from mrdamper.report.tables import score_rows
from mrdamper.study.comparison import compare

FIGURE_AUDIT = (Path(__file__).parents[1] / "support" / "figure_audit.js").read_text(encoding="utf-8")
CUT = """[...document.querySelectorAll(".scroll")]
    .filter((e) => e.scrollWidth > e.clientWidth + 1 && !e.closest("details")).map((e) => e.textContent.slice(0, 80))"""

PAST_THE_EDGE = """[...document.querySelectorAll("caption, figcaption")]
    .filter((e) => e.getBoundingClientRect().right > document.documentElement.clientWidth).map((e) => e.textContent)"""


@pytest.fixture(scope="session")
def drawings(written):
    return {path.stem: path.read_text(encoding="utf-8") for path in sorted((written / "figures").glob("*.svg"))}


@pytest.fixture
def shown(browser):
    """A page of the browser that complains of nothing."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    page = context.new_page()
    complaints = []
    page.on("console", lambda m: complaints.append(m.text) if m.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    yield page
    context.close()
    assert not complaints


def laid_out(drawings):
    bodies = (text[text.index("<svg") :].replace("<svg", f'<svg data-name="{n}"', 1) for n, text in drawings.items())
    return f"<!doctype html><body>{''.join(bodies)}</body>"


def test_no_text_of_a_figure_lies_over_another_or_past_the_edge(shown, drawings):
    assert len(drawings) >= 20
    long = ranking({"modified Herschel–Bulkley slot flow, individual fits": (0.01, 0.02, 0.03)}).drawn().file("svg")
    shown.set_content(laid_out({**drawings, "ranking": long.decode()}))
    assert shown.evaluate(FIGURE_AUDIT) == []


def test_the_audit_of_figures_sees_what_is_wrong(shown):
    text = '<text x="{x}" y="20">words that lie here</text>'
    figure = f'<svg width="200" height="40">{text.format(x=5)}{text.format(x=60)}{text.format(x=150)}</svg>'
    shown.set_content(laid_out({"bad": figure}))
    found = shown.evaluate(FIGURE_AUDIT)
    assert any("over" in said for said in found)
    assert any("past the edge" in said for said in found)


def test_panels_are_lettered_and_titled_in_plain_words(drawings):
    for name, text in drawings.items():
        panels = len(re.findall(r'd="M(?:[\d.]+ ){5}[\d.]+" fill="none"[^>]* stroke-width="0.7"', text))  # frames
        assert panels, name
        assert ("(b)" in text) == (panels > 1), name
        assert "quadratic" not in text
        assert "linear-current" not in text


@pytest.mark.parametrize("width", [1280, 390])
def test_the_page_passes_at_any_width(shown, written, width):
    shown.set_viewport_size({"width": width, "height": 800})
    shown.goto((written / "report.html").as_uri())
    assert shown.evaluate(AUDIT) == []
    shown.evaluate("document.querySelectorAll('details').forEach((part) => (part.open = true))")
    assert shown.evaluate("document.documentElement.scrollWidth") <= width
    assert shown.evaluate(PAST_THE_EDGE) == []
    assert min(shown.evaluate("[...document.querySelectorAll('figure img')].map((e) => e.clientWidth)")) > 500
    if width == 1280:
        assert shown.evaluate(CUT) == []
        axe = pytest.importorskip("axe_playwright_python.sync_playwright")
        assert axe.Axe().run(shown).response["violations"] == []


@pytest.fixture(scope="session")
def paper(written):
    return PdfReader(io.BytesIO((written / "report.pdf").read_bytes()))


@pytest.fixture(scope="session")
def texts(paper):
    """Of each page its text, and the pieces of it as (y from below, text) [pt]."""
    return [pieces_of(page) for page in paper.pages]


def pieces_of(page):
    found = []

    def take(text, cm, tm, font, size):
        if text.strip():
            found.append((tm[5], text.strip()))

    return page.extract_text(visitor_text=take), found


def headings_of(paper):
    flat, open_ = [], list(paper.outline)
    while open_:
        entry = open_.pop(0)
        if isinstance(entry, list):
            open_ = entry + open_
        else:
            flat.append((entry.title, paper.get_destination_page_number(entry)))
    return flat


def test_no_heading_ends_a_printed_page(paper, texts):
    headings = headings_of(paper)
    assert len(headings) > 12
    for title, number in headings:
        page = paper.pages[number]
        _, lines = texts[number]
        at = next((y for y, text in lines if title.startswith(text[:30]) or text.startswith(title[:30])), None)
        assert at is not None, title
        below = [text for y, text in lines if 60 < y < at - 5]  # the number of the page stands under 60
        drawn = any("/Figure" in name for name in page["/Resources"].get("/XObject", {}))
        assert below or drawn, f"{title} stands alone at the foot of page {number + 1}"


def test_every_printed_page_but_the_last_is_more_than_half_full(paper, texts):
    for number, (page, (_, lines)) in enumerate(zip(paper.pages[:-1], texts[:-1], strict=True), 1):
        lowest = min(y for y, _ in lines if y > 60)  # below is the footer; captions stand below their figures
        assert lowest < float(page.mediabox.height) / 2, f"page {number} ends {lowest:.0f} pt above its foot"
        assert page.mediabox.width < page.mediabox.height  # no page is turned


def test_figures_are_drawn_in_the_print(paper, drawings):
    objects = [
        form.get_object()
        for page in paper.pages
        for name, form in page["/Resources"].get("/XObject", {}).items()
        if name.startswith("/Figure")
    ]
    assert len(objects) == len(drawings)
    assert all(len(form.get_data()) > 2000 for form in objects)


def test_nothing_of_the_page_is_lost_in_the_print(texts, bundled_study):
    text = " ".join(whole for whole, _ in texts)
    squeezed = re.sub(r"\s", "", text)
    for run in bundled_study.dataset:
        if run.excitation == "sine":
            assert run.id in squeezed
    assert re.sub(r"\s", "", WIDE) in squeezed
    assert "Motion and loop of every run" in text  # folded on the page
    assert "not part of this model" in text
    for number, (whole, _) in enumerate(texts, 1):
        assert f"page {number} of {len(texts)}" in whole


def test_no_cell_of_a_printed_table_is_cut_inside_a_number(texts):
    text = "\n".join(whole for whole, _ in texts)
    assert not re.search(r"\de[+-]?\n\d", text)
    assert not re.search(r"\d\.\n\d", text)


def test_one_number_stands_everywhere(bundled, bundled_study, written, tmp_path, monkeypatch):
    """Terminal, table, page, comparison and app show the same scores of a model on the same runs."""
    from mrdamper.web.api.identify import _candidate

    monkeypatch.setattr("mrdamper.study.workflow.run_study", lambda *args, **options: bundled_study)
    monkeypatch.setattr("mrdamper.report.study.write_study", lambda *args, **options: [written / "report.html"])
    terminal = CliRunner().invoke(application(), ["study", "--verbose", "--out", str(tmp_path / "out")]).stdout
    page = (written / "report.html").read_text(encoding="utf-8")
    rows = list(csv.DictReader(io.StringIO((written / "validation.csv").read_text(encoding="utf-8"))))
    sets = ("cross-validation", "validation")
    scored = [r for rig in bundled_study.rigs for c in rig.candidates for r in score_rows(rig.dataset.name, c, *sets)]
    assert rows == list(csv.DictReader(io.StringIO(csv_text(scored))))
    compared = {rig.rig: rig for rig in compare(bundled.rig("utfsm"), ["bingham"], jobs=1).rigs}
    for rig in bundled_study.rigs:
        chapter = page[page.index(f">{rig.rig}</h2>") :]
        for candidate in rig.candidates:
            own = [r for r in rows if (r["rig"], r["model"]) == (rig.rig, candidate.recipe.name)]
            said = {}
            for name, scores in (("cross-validation", candidate.cross_validated), ("validation", candidate.validation)):
                values = [float(r["nrmse_pp"]) for r in own if r["set"] == name]
                said[name] = float(np.median(values))
                assert said[name] == scores.median()
            line = rf"{re.escape(candidate.title)}, [^:]*cross-validation {100 * said['cross-validation']:.2f} %"
            assert re.search(line, terminal, re.DOTALL) or candidate is rig.chosen, candidate.title
            if candidate is rig.chosen:
                assert f"cross-validation {100 * said['cross-validation']:.2f} %" in terminal
                assert f"validation {100 * said['validation']:.2f} %" in terminal
            cells = "".join(rf"<td>{100 * said[name]:.1f} \([^<]*</td>" for name in said)
            cells = rf"<td>{re.escape(candidate.title)}</td>.*?{cells}"
            assert re.search(cells, chapter), candidate.title
            shown = _candidate(candidate, "damper1")
            assert (shown["cross_validation"], shown["validation"]) == tuple(said.values())
            if rig.rig in compared and candidate.recipe.name == "bingham":
                entry = next(e for e in compared[rig.rig].entries if e.recipe.name == "bingham")
                assert entry.cross_validated.median() == pytest.approx(said["cross-validation"], rel=1e-9)
                assert entry.validation.median() == pytest.approx(said["validation"], rel=1e-9)
