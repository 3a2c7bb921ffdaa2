"""Numbers of the documents are those that come out; the comparison itself notices what is off."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))
from benchmarks.numbers import Sentence, Table, differences, of_both, of_study, write


def test_what_the_documents_say_of_the_bundled_study_is_what_comes_out(bundled_study):
    assert differences(of_study(bundled_study)) == [], "put them right with python -m benchmarks.numbers --write"
    shared = of_both(bundled_study)
    assert all(len(table.rows) >= 3 for table in shared)
    assert differences(shared) == [], "put them right with python -m benchmarks.numbers --compare DIR --write"


PAGE = """# Title
| model | errors |
|---|---|
| other | 9 |

### here
| model | errors | count |
|---|---|---|
| 1. **best** | 2.0 (4.0) | 15 |
| 2. plain | 5.0 (9.0) | 6 / 9 |

Gains of 3.6–5.1 % were seen.
"""


def told(rows, values=(3.6, 5.1)):
    return [
        Table("page.md", "| model | errors", rows, "### here"),
        Sentence("page.md", r"Gains of (\S+)–(\S+) %", values),
    ]


SAME = ("| 1. **best** | 2.2 (4.4) | 16 |", "| 2. plain | 4.9 (9.3) | 6 / 9 |")


@pytest.mark.parametrize(
    ("rows", "values", "off"),
    [
        (SAME, (3.6, 5.1), 0),
        ((SAME[0].replace("2.2", "2.4"), SAME[1]), (3.6, 5.1), 1),  # a median
        ((SAME[0].replace("4.4", "6.0"), SAME[1]), (3.6, 5.1), 1),  # the worst run
        ((SAME[0], SAME[1].replace("6 / 9", "6 / 12")), (3.6, 5.1), 1),  # a count
        ((SAME[0].replace("best", "worst"), SAME[1]), (3.6, 5.1), 1),
        (SAME[:1], (3.6, 5.1), 1),
        (SAME, (3.6, 4.6), 1),
        # Near ones may change ranks.
        (("| 1. plain | 4.9 (9.3) | 6 / 9 |", "| 2. **best** | 2.2 (4.4) | 15 |"), (3.6, 5.1), 0),
    ],
)
def test_what_is_off_is_named_and_can_be_put_right(tmp_path, rows, values, off):
    (tmp_path / "page.md").write_text(PAGE, encoding="utf-8")
    assert len(differences(told(rows, values), tmp_path)) == off
    write(told(rows, values), tmp_path)
    text = (tmp_path / "page.md").read_text(encoding="utf-8")
    assert differences(told(rows, values), tmp_path) == []
    assert all(row in text for row in rows)
    assert f"Gains of {values[0]}–{values[1]} % were seen." in text
    assert text.startswith(PAGE[:60])


def test_some_rows_of_a_table_are_compared_by_name_and_left_as_they_are(tmp_path):
    (tmp_path / "page.md").write_text(PAGE, encoding="utf-8")
    for row, off in (("| plain | 4.9 (9.3) | 6 / 9 |", 0), ("| plain | | 6 / 9 |", 0), ("| plain | 4.0 (9.0) | |", 1),
                     ("| new | 1.0 (2.0) | 3 |", 1)):  # fmt: skip
        some = [Table("page.md", "| model | errors", (row,), "### here", whole=False)]
        assert len(differences(some, tmp_path)) == off, row
        write(some, tmp_path)
    assert (tmp_path / "page.md").read_text(encoding="utf-8") == PAGE


def test_a_sentence_that_is_gone_is_missed(tmp_path):
    (tmp_path / "page.md").write_text("nothing\n", encoding="utf-8")
    assert "no sentence" in differences([Sentence("page.md", r"Gains of (\S+)", (1.0,))], tmp_path)[0]
