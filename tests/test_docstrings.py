"""Public names say what they take and raise, and their examples run."""

import doctest
import inspect

import pytest

import mrdamper

RAISES_NOTHING = ("Condition", "Damper", "Prediction")
STUDIES = ("run_study", "compare")  # of many runs: seconds


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow) if n in STUDIES else n for n in mrdamper.__all__]
)
def test_every_public_name_has_an_example_that_runs(name, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    thing = getattr(mrdamper, name)
    text = inspect.getdoc(thing)
    takes = [p for p in inspect.signature(thing).parameters.values() if p.kind is not p.VAR_KEYWORD]
    assert not takes or "Parameters\n---" in text or "Attributes\n---" in text
    assert name in RAISES_NOTHING or issubclass(_type(thing), Exception) or "Raises\n---" in text
    examples = doctest.DocTestFinder(recurse=False).find(thing, name, globs={})
    assert sum(len(one.examples) for one in examples) >= 1
    runner, printed = doctest.DocTestRunner(optionflags=doctest.IGNORE_EXCEPTION_DETAIL), []
    for one in examples:
        runner.run(one, out=printed.append)
    assert runner.failures == 0, "".join(printed)


def _type(thing):
    return thing if isinstance(thing, type) else object
