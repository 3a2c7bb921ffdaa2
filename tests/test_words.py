"""Terms of docs/words.toml do not occur in texts that a person reads, file by file as they are rewritten."""

import re
import tomllib

import pytest
from support.texts import ROOT, all_texts

TERMS = tomllib.loads((ROOT / "docs" / "words.toml").read_text(encoding="utf-8"))["term"]
REWRITTEN = (
    "CHANGELOG.md",
    "README.md",
    "docs/explanation/left-out.md",
    "docs/how-to/live-bench.md",
    "docs/index.md",
    "docs/nomenclature.md",
    "src/mrdamper/cli/commands/compare.py",
    "src/mrdamper/cli/commands/import_.py",
    "src/mrdamper/cli/commands/models.py",
    "src/mrdamper/cli/commands/plan.py",
    "src/mrdamper/cli/commands/predict.py",
    "src/mrdamper/cli/commands/reproduce.py",
    "src/mrdamper/cli/commands/simulate.py",
    "src/mrdamper/cli/commands/study.py",
    "src/mrdamper/cli/help.py",
    "src/mrdamper/report/comparison.py",
    "src/mrdamper/report/damper_tests.py",
    "src/mrdamper/report/fonts.py",
    "src/mrdamper/report/limitations.py",
    "src/mrdamper/report/summary.py",
    "src/mrdamper/report/templates/_glossary.html.j2",
    "src/mrdamper/report/templates/_tests.html.j2",
    "src/mrdamper/report/templates/comparison.html.j2",
    "src/mrdamper/report/templates/fleet.html.j2",
    "src/mrdamper/report/templates/reproduction.html.j2",
    "src/mrdamper/report/templates/simulation.html.j2",
    "src/mrdamper/report/templates/study.html.j2",
    "src/mrdamper/report/templates/tests.html.j2",
    "src/mrdamper/web/api/identify.py",
    "src/mrdamper/web/static/index.html",
    "src/mrdamper/web/static/js/views/compare.js",
    "src/mrdamper/web/static/js/views/data.js",
    "src/mrdamper/web/static/js/views/identify.js",
    "src/mrdamper/web/static/js/views/ride.js",
    "src/mrdamper/web/static/js/views/takeaway.js",
)
CORE = ("data", "export", "fleet", "identification", "models", "physics", "statistics", "systems", "tracing")
DECISIONS = tuple(str(path.relative_to(ROOT)) for path in sorted((ROOT / "docs" / "decisions").glob("*.md")))
READERS = {str(path.relative_to(ROOT)): (path, reader) for path, reader in all_texts()}
SOURCES = tuple(name for name in READERS if name.startswith(tuple(f"src/mrdamper/{package}/" for package in CORE)))


@pytest.mark.parametrize("name", REWRITTEN + DECISIONS + SOURCES)
def test_a_rewritten_file_uses_the_terms_of_the_field(name):
    path, reader = READERS[name]
    hits = [
        f"line {line}: {found[0]!r}; use {term['use']}"
        for line, text in reader(path)
        for term in TERMS
        if (found := re.search(term["find"], text.lower()))
    ]
    assert hits == []


def test_the_search_finds_a_term_and_leaves_ordinary_uses_alone():
    def matches(text):
        return [term["use"] for term in TERMS if re.search(term["find"], text.lower())]

    assert matches("3 held-out runs") == ["validation runs (not used for identification)"]
    assert matches("error on line 12: the leak of a seal") == []
