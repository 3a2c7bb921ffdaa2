"""The house stays in order: imports go downward, nothing heavy is imported by the numerics."""

import re
import subprocess
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

from importlinter.cli import lint_imports

sys.path.insert(0, str(Path(__file__).parent.parent))
from benchmarks import house

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


def test_every_extra_is_imported_somewhere():
    """An extra nobody imports is a promise nobody keeps."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    text = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "src").rglob("*.py"))
    modules = packages_distributions()
    ours = [name for key in extras if key not in ("all", "dev", "docs", "release") for name in extras[key]]
    for wanted in {re.split(r"[>=\[]", name)[0] for name in ours}:
        provided = [module for module, dists in modules.items() if wanted.lower() in map(str.lower, dists)] or [wanted]
        assert any(re.search(rf'(import|from) {m}\b|"{m}"', text) for m in provided), wanted


def test_the_house_does_not_grow_again():
    """`python -m benchmarks.house` prints the table."""
    assert len(house.names_at_the_top()) <= 18
    assert len(house.floors()) <= 13
    assert house.isinstance_over_dampers() == []


def test_the_page_on_the_architecture_names_every_room_on_its_floor():
    rows = re.findall(r"^\| (`[^|]+) \|", (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8"), re.MULTILINE)
    named = [re.findall(r"`(\w+)`", row) for row in rows]
    assert sorted(room for row in named for room in row) == house.names_at_the_top()
    floor = {room.strip(): i for i, layer in enumerate(house.floors()) for room in layer.split("|")}
    order = [floor[room] for row in named for room in row]
    assert order == sorted(order)
