"""Pages of the documentation: code blocks run in order, links lead somewhere."""

import re
import runpy
import shlex
from pathlib import Path

import pytest
from support.dampers import joint_damper
from support.fmu_files import fmu_bytes
from typer.testing import CliRunner

from mrdamper import discovery
from mrdamper.cli import application
from mrdamper.dampers.model_file import save_model

DOCS = Path(__file__).parent.parent / "docs"
FENCE = re.compile(r"(?P<slow><!-- slow -->\n)?^```(?P<kind>python|sh)\n(?P<body>.*?)^```", re.MULTILINE | re.DOTALL)
PAGES = sorted(p for p in DOCS.rglob("*.md") if FENCE.search(p.read_text(encoding="utf-8")))
LINK = re.compile(r"\]\(([^)#\s]+)")
NAMED = re.compile(r"`([\w/]+\.py)`")


def blocks(page, *, slow):
    found = FENCE.finditer(page.read_text(encoding="utf-8"))
    return [(m["kind"], m["body"]) for m in found if slow or not m["slow"]]


def _machine():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", ["04_your_own_rig.py", "--keep", "machine"])
        runpy.run_path(str(DOCS.parent / "examples" / "04_your_own_rig.py"), run_name="__main__")


def _fmu():
    pytest.importorskip("fmpy", reason="the fmu extra is not installed")
    Path("damper.fmu").write_bytes(fmu_bytes("joint", 2))


def _model():
    save_model(joint_damper(), "model.json")


GIVEN = {
    "your-own-rig": _machine,
    "fmpy": _fmu,
    "model-file": _model,
    "own-parts": _model,
}  # files that a page has from its own commands


def run_page(page, monkeypatch, folder, *, slow):
    """Python blocks share their names, commands their folder, as a reader's would; their classes end with them."""
    for registry in discovery._registries.values():
        registry.all()
        for name in ("_types", "_parts"):
            monkeypatch.setattr(registry, name, dict(getattr(registry, name)))
    monkeypatch.chdir(folder)
    GIVEN.get(page.stem, lambda: None)()
    monkeypatch.setenv("MPLBACKEND", "agg")
    names = {"__name__": "__main__"}
    for kind, body in blocks(page, slow=slow):
        if kind == "python":
            exec(compile(body, str(page), "exec"), names)
            continue
        for line in body.splitlines():
            program, *words = shlex.split(line, comments=True)
            assert program == "mrdamper"
            done = CliRunner().invoke(application(), words)
            assert done.exit_code == 0, f"{line}: {done.output} {done.exception}"


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
@pytest.mark.usefixtures("studied_once")
def test_the_blocks_of_a_page_run(page, monkeypatch, tmp_path):
    run_page(page, monkeypatch, tmp_path, slow=False)


def test_the_readme_runs_when_pasted(bundled_study, monkeypatch, tmp_path):
    """After `make study`, whose result stands in for a fresh one here."""
    monkeypatch.setattr("mrdamper.study.workflow.run_study", lambda dataset: bundled_study)
    (tmp_path / "result").mkdir()
    save_model(bundled_study.rig("utfsm").damper, tmp_path / "result" / "model-utfsm.json")
    run_page(DOCS.parent / "README.md", monkeypatch, tmp_path, slow=False)


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_the_slow_blocks_of_a_page_run_with_a_study_of_its_own(page, monkeypatch, tmp_path):
    run_page(page, monkeypatch, tmp_path, slow=True)


def test_links_lead_to_files():
    made = ("gallery/", "commands", "model-classes", "generated/", "codes.md", "../reference/codes.md")  # by the build
    links = [(p, target) for p in sorted(DOCS.rglob("*.md")) for target in LINK.findall(p.read_text(encoding="utf-8"))]
    assert len(links) > 20
    files = [link for link in links if not link[1].startswith(("http:", "https:", "mailto:", *made))]
    assert [(page.name, target) for page, target in files if not (page.parent / target).exists()] == []


def test_code_that_a_page_names_exists():
    root = DOCS.parent
    files = ["/" + path.relative_to(root).as_posix() for path in root.glob("[a-z]*/**/*.py")]
    pages = [*sorted(root.glob("*.md")), *sorted(DOCS.rglob("*.md"))]
    named = [(page.name, name) for page in pages for name in NAMED.findall(page.read_text(encoding="utf-8"))]
    assert len(named) > 40
    assert [one for one in named if not any(file.endswith("/" + one[1]) for file in files)] == []
