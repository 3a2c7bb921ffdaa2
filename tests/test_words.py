"""Terms of docs/words.toml do not occur in texts that a person reads, file by file."""

import re
import tomllib

import pytest
from support.texts import ROOT, all_texts

TERMS = tomllib.loads((ROOT / "docs" / "words.toml").read_text(encoding="utf-8"))["term"]
READERS = {str(path.relative_to(ROOT)): (path, reader) for path, reader in all_texts()}


@pytest.mark.parametrize("name", READERS)
def test_every_text_uses_the_terms_of_the_field(name):
    path, reader = READERS[name]
    lines = [(number, text.lower()) for number, text in reader(path)]
    whole = "\n\0\n".join(text for _, text in lines)  # most files hold no term: one search each instead of one a line
    hits = [
        f"line {number}: {found[0]!r}; use {term['use']}"
        for term in TERMS
        if re.search(term["find"], whole, re.MULTILINE)
        for number, text in lines
        if (found := re.search(term["find"], text))
    ]
    assert hits == []


def test_the_search_finds_a_term_and_leaves_ordinary_uses_alone():
    def matches(text):
        return [term["use"] for term in TERMS if re.search(term["find"], text.lower())]

    assert matches("3 held-out runs") == ["validation runs (not used for identification)"]
    assert matches("error on line 12: the leak of a seal") == []
