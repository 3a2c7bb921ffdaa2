"""The documentation site: built offline, opens from disk. `make docs`."""

from __future__ import annotations

import tomllib
from pathlib import Path

HERE = Path(__file__).parent
_project = tomllib.loads((HERE.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]

project = "mrdamper"
copyright = "the mrdamper developers"
version = release = _project["version"]

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_gallery.gen_gallery",
    "sphinx_llms_txt",
]
exclude_patterns = [
    "_build",
    "gallery/*.ipynb",
    "gallery/*.py",
    "gallery/*.zip",
    "gallery/*.json",
    "_live",
    "sg_execution_times.rst",
]
suppress_warnings = ["config.cache"]
myst_heading_anchors = 3
autosummary_generate = True
autodoc_typehints = "none"  # the docstrings say types, shapes and units
numpydoc_show_class_members = False
sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"/\d\d_",
    "ignore_pattern": r"__",
    "download_all_examples": False,
    "show_signature": False,
    "write_computation_times": False,
    "within_subsection_order": "FileNameSortKey",
    "min_reported_time": 1e9,
}
llms_txt_summary = _project["description"]

html_theme = "pydata_sphinx_theme"
html_title = "mrdamper"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = ["site.js"]
html_search_scorer = str(HERE / "_static" / "scorer.js")
html_extra_path = ["_live"]
html_show_sourcelink = False
html_theme_options = {
    "navigation_with_keys": False,
    "show_prev_next": False,
    "collapse_navigation": True,
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}


def _live_dampers() -> None:
    """The two bundled dampers as pages that the site embeds."""
    from mrdamper import load_dataset, run_study
    from mrdamper.exporters.base import write_export
    from mrdamper.exporters.page import PageExporter

    folder = HERE / "_live" / "dampers"
    folder.mkdir(parents=True, exist_ok=True)
    for rig in run_study(load_dataset()).rigs:
        write_export(PageExporter().export(rig.damper, rig.rig), folder / f"{rig.rig}.html", PageExporter.suffix)


def _commands() -> None:
    """One page with the help of every command, as the command line prints it."""
    from typer.testing import CliRunner

    from mrdamper.cli import application

    def told(*words: str) -> str:
        text = CliRunner().invoke(application(), [*words, "--help"], prog_name="mrdamper", terminal_width=100).output
        return "\n".join(line.rstrip() for line in text.strip().splitlines())

    names = [command.name or command.callback.__name__ for command in application().registered_commands]  # type: ignore[union-attr]
    parts = ["# Commands\n", f"```text\n{told()}\n```\n"]
    parts += [f"## mrdamper {name}\n\n```text\n{told(name)}\n```\n" for name in sorted(n.strip("_") for n in names)]
    (HERE / "reference" / "commands.md").write_text("\n".join(parts), encoding="utf-8")


def _models() -> None:
    """The class of every model that discovery finds."""
    from mrdamper.models import all_models

    listed = "\n".join(f"   {kind.__module__}.{kind.__qualname__}" for kind in all_models().values())
    text = (
        "# Model classes\n\n[Which to take](../models.md) · parameters, units, bounds, equation and source of each:\n\n"
        f"```{{eval-rst}}\n.. autosummary::\n   :toctree: generated\n\n{listed}\n```\n"
    )
    (HERE / "reference" / "model-classes.md").write_text(text, encoding="utf-8")


def _codes() -> None:
    """One page with every error and warning code."""
    (HERE / "reference" / "codes.md").write_text(codes_page(), encoding="utf-8")


def codes_page() -> str:
    """Return the page of all codes in Markdown."""
    from mrdamper.cli.commands.explain import load_codes

    parts = [
        "# Error and warning codes\n",
        "Every message ends with a code in brackets. `mrdamper explain E_LIMITS` prints one of the entries below. "
        "An error (E_) ends the command or excludes a file or run; a warning (W_) is reported with the result.\n",
    ]
    for title, prefix in (("Errors", "E_"), ("Warnings", "W_")):
        parts.append(f"## {title}\n")
        for name, entry in load_codes().items():
            if name.startswith(prefix):
                parts.append(f"### {name}\n\n{entry['meaning']}\n")
                parts.append(f"Example: `` {entry['example']} ``\n\nWhat to do: {entry['remedy']}\n")
    return "\n".join(parts)


def _plain_bars(app, what, name, thing, options, lines: list[str]) -> None:
    """|v| in an equation is a magnitude, not a substitution of reStructuredText."""
    lines[:] = [line if line.lstrip().startswith((">>>", "...")) else line.replace("|", "\\|") for line in lines]


def setup(app) -> None:
    """Write what is made from the program itself, before the pages are read."""
    app.connect("autodoc-process-docstring", _plain_bars)
    (HERE / "_live").mkdir(exist_ok=True)  # Sphinx looks for it before the first page is read
    _commands()
    _models()
    _codes()
    app.connect("builder-inited", lambda _: _live_dampers())
