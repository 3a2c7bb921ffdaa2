"""The guard against slower code: what it calls slower, and that it runs the tree it is given."""

from benchmarks import check


def test_a_ratio_above_the_limit_is_named_and_fails():
    text, good = check.report([("same", 1.0, 1.0), ("slower", 1.2, 1.0)])
    assert not good
    assert text.splitlines()[2].endswith("slower  SLOWER")
    assert "SLOWER" not in text.splitlines()[1]


def test_faster_and_as_fast_pass():
    assert check.report([("a", 0.4, 1.0), ("b", 1.1, 1.0)])[1]


def test_each_tree_is_asked_in_turn_and_the_first_turn_does_not_count(tmp_path):
    log = tmp_path / "log"
    code = f"import sys; open({str(log)!r}, 'a').write(sys.path[1][-1])"
    ours, stored = tmp_path / "1", tmp_path / "2"
    own, other = check.compared(ours, stored, code, turns=2)
    assert log.read_text() == "121212"
    assert own > 0
    assert other > 0
