"""The house stays in order: imports go downward, nothing heavy is imported by the numerics."""

import subprocess
import sys
from pathlib import Path

from importlinter.cli import lint_imports

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


def test_public_names_exist():
    import mrdamper

    for name in mrdamper.__all__:
        assert getattr(mrdamper, name) is not None
