"""Terms of docs/words.toml do not occur in texts that a person reads."""

import re
import tomllib

from support.texts import ROOT, all_texts

TERMS = tomllib.loads((ROOT / "docs" / "words.toml").read_text(encoding="utf-8"))["term"]


def hits(path, reader):
    """Lines of a file with a term that has another name; a file that holds none is searched once a term."""
    lines = [(number, text.lower()) for number, text in reader(path)]
    whole = "\n\0\n".join(text for _, text in lines)
    return [
        f"{path.relative_to(ROOT)}, line {number}: {found[0]!r}; use {term['use']}"
        for term in TERMS
        if re.search(term["find"], whole)
        for number, text in lines
        if (found := re.search(term["find"], text))
    ]


def test_every_text_uses_the_terms_of_the_field():
    assert [hit for path, reader in all_texts() for hit in hits(path, reader)] == []


def test_the_search_finds_a_term_and_leaves_ordinary_uses_alone():
    lines = [(3, "3 Held-out runs"), (12, "error on line 12: the leak of a seal")]
    (hit,) = hits(ROOT / "README.md", lambda _: lines)
    assert hit == "README.md, line 3: 'held-out'; use validation runs (not used for identification)"
    assert hits(ROOT / "README.md", lambda _: lines[1:]) == []
