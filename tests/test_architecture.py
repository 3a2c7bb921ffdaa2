"""Imports go downward, the numerics import nothing heavy, and the measures of the structure keep their limits."""

import re
import subprocess
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

from importlinter.cli import lint_imports

sys.path.insert(0, str(Path(__file__).parent.parent))
from benchmarks import structure

ROOT = Path(__file__).parent.parent


def test_imports_go_downward(monkeypatch):
    monkeypatch.chdir(ROOT)
    assert lint_imports(config_filename=str(ROOT / "pyproject.toml"), no_cache=True) == 0


def test_the_command_lines_help_needs_no_numerics():
    code = (
        "import sys, mrdamper.cli as c; c.application();"
        "print([m for m in ('numpy', 'scipy', 'matplotlib', 'polars', 'numba', 'pydantic') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_runs_are_identified_and_compared_without_scipy():
    """Its import takes as long as the identification of a dozen runs, the checks of the import included."""
    code = (
        "import sys; import numpy as np; from mrdamper import Run, identify;"
        "t = np.arange(3000) / 1000; noise = np.random.default_rng(0).standard_normal((2, t.size));"
        "x, v = 0.01 * np.sin(2 * np.pi * t), np.cos(2 * np.pi * t);"
        "force = 900 * v + 300 * np.tanh(9 * v) + 2 * noise[1];"
        "identify(Run('a', t, x + 1e-7 * noise[0], force, 0.5)).standard_errors;"
        "print([m for m in ('scipy', 'matplotlib', 'polars', 'pydantic') if m in sys.modules]);"
        "from mrdamper import check, load_dataset;"
        "tests = load_dataset().rig('utfsm'); check(tests.only(tests.runs[:8]));"
        "print('scipy' in sys.modules)"  # which brings threads of its own, too
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["[]", "False"]


def test_every_extra_is_imported_somewhere():
    """An extra nobody imports is a promise nobody keeps."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    text = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "src").rglob("*.py"))
    modules = packages_distributions()
    ours = [name for key in extras if key not in ("all", "dev", "docs", "release") for name in extras[key]]
    for wanted in {re.split(r"[>=\[]", name)[0] for name in ours}:
        provided = [module for module, dists in modules.items() if wanted.lower() in map(str.lower, dists)] or [wanted]
        assert any(re.search(rf'(import|from) {m}\b|"{m}"', text) for m in provided), wanted


def test_the_structure_keeps_its_limits():
    """`python -m benchmarks.structure` prints the lists; a limit is lowered when less is reached."""
    assert len(structure.top_level_names()) <= 18
    assert len(structure.layers()) <= 13
    assert structure.isinstance_over_dampers() == []
    assert structure.circles() == []
    assert len(structure.longest_chain()) <= 18
    assert structure.long_functions() == []
    assert structure.repeated_class_names() == {}


def test_docstrings_open_with_a_definition_or_an_imperative():
    assert structure.question_openings() == []


def test_local_variables_are_named_after_what_they_hold():
    assert len(structure.participle_names()) <= 2  # the parameter `found` of errors


def test_the_measures_find_what_they_look_for():
    assert "mrdamper.physics.motion.excitation" in structure.imports()["mrdamper.identification.problem"]
    assert structure.longest_chain()[-1] in ("mrdamper.errors", "mrdamper.tracing.expression")
    assert structure.long_functions(most=3)
    assert len(structure.modules()) > 300


def test_the_page_on_the_architecture_lists_every_package_in_its_layer():
    rows = re.findall(r"^\| (`[^|]+) \|", (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8"), re.MULTILINE)
    named = [re.findall(r"`(\w+)`", row) for row in rows]
    assert sorted(name for row in named for name in row) == structure.top_level_names()
    layer = {name.strip(): i for i, line in enumerate(structure.layers()) for name in line.split("|")}
    order = [layer[name] for row in named for name in row]
    assert order == sorted(order)


def test_every_decision_is_in_the_index_with_context_decision_and_consequences():
    folder = ROOT / "docs" / "decisions"
    records = sorted(path for path in folder.glob("*.md") if path.name != "index.md")
    listed = re.findall(r"^(\d{4}-[\w-]+)$", (folder / "index.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(listed) == [path.stem for path in records]
    for path in records:
        headings = re.findall(r"^## (.+)$", path.read_text(encoding="utf-8"), re.MULTILINE)
        assert headings[:3] == ["Context", "Decision", "Consequences"], path.name


def test_a_saved_model_is_read_without_the_other_kinds():
    code = (
        "import sys; from mrdamper.dampers import kind_named; kind = kind_named('joint').kind; "
        "others = [m for m in ('modified', 'kernel') if 'mrdamper.dampers.' + m in sys.modules]; "
        "print(kind, others, kind_named('conditioned').kind, kind_named('none'))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "joint [] conditioned None"
