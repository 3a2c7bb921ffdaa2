"""What a script may import: the names at the top, model classes, the version."""

import ast
import doctest
import importlib
import inspect
from importlib.metadata import version
from pathlib import Path

import pytest

import mrdamper
from mrdamper.models import all_models


def test_the_list_the_types_and_the_homes_agree():
    tree = ast.parse(Path(mrdamper.__file__).read_text(encoding="utf-8"))
    block = next(n for n in tree.body if isinstance(n, ast.If) and ast.unparse(n.test) == "TYPE_CHECKING")
    typed = {a.name: n.module for n in block.body for a in n.names}
    assert typed == {name: f"mrdamper.{home}" for name, home in mrdamper._HOME.items()}
    assert mrdamper.__all__ == sorted(typed)
    for name in mrdamper.__all__:
        assert getattr(mrdamper, name) is not None


def test_completion_shows_every_public_name_and_the_version_and_nothing_of_the_mechanism():
    assert {name for name in dir(mrdamper) if not name.startswith("__")} == set(mrdamper.__all__)
    assert "__version__" in dir(mrdamper)
    assert mrdamper.__version__ == version("mrdamper")


def test_every_verb_that_gives_a_result_is_a_function_whatever_was_imported_before():
    for package in sorted(Path(mrdamper.__file__).parent.glob("*/__init__.py")):
        importlib.import_module(f"mrdamper.{package.parent.name}")
    for verb in ("check", "compare", "export", "identify", "import_files", "plan_tests", "reproduce", "validate"):
        assert inspect.isfunction(getattr(mrdamper, verb)), verb


def test_model_classes_are_imported_by_their_names():
    models = importlib.import_module("mrdamper.models")
    for cls in all_models().values():
        assert getattr(models, cls.__name__) is cls
        assert getattr(mrdamper, cls.__name__) is cls
        assert cls.__name__ in dir(models)


def test_a_name_that_does_not_exist_is_an_attribute_error():
    for name, near in (
        ("workflows", ""),
        ("_repr_html_", ""),  # asked for by notebooks
        ("plan", "; did you mean plan_tests?"),
        ("predict", "; did you mean Prediction?"),
        ("load_modl", "; did you mean load_model?"),
        ("run_sudy", "; did you mean run_study?"),
        ("dataset", "; did you mean Dataset or load_dataset or save_dataset?"),
        ("BoucWenn", "; did you mean BoucWen?"),
    ):
        with pytest.raises(AttributeError) as refusal:
            getattr(mrdamper, name)
        assert str(refusal.value) == f"module 'mrdamper' has no attribute '{name}'{near}"
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("mrdamper.workflows")


@pytest.mark.usefixtures("studied_once")
def test_the_example_of_the_package_runs():
    failures, tried = doctest.testmod(mrdamper)
    assert tried >= 4
    assert failures == 0
