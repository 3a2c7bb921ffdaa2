"""The commands of "Your own rig in ten minutes", one after the other, on files made here."""

import runpy
import shutil
from pathlib import Path

import numpy as np
import pytest
from support import lab_exports
from support.lab_exports import Lab, campaign
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.rig_files.dataset_folder import load_dataset

HOUSE = Path(__file__).parents[2]


def commands(page: Path) -> list[tuple[list[str], str]]:
    """Every command of the page, with what is printed below it there."""
    found: list[tuple[list[str], str]] = []
    inside = False
    for line in page.read_text(encoding="utf-8").splitlines():
        if line.startswith("```"):
            inside = not inside
        elif inside and line.startswith("$ mrdamper "):
            found.append((line.removeprefix("$ mrdamper ").split(), ""))
        elif inside and line.startswith("$ "):
            found.append(([], ""))
        elif inside and found:
            found[-1] = found[-1][0], found[-1][1] + line + "\n"
    return [(arguments, printed) for arguments, printed in found if arguments]


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Where the page begins: the example's folder of a machine, a file of many tests, files without a current."""
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(HOUSE / "examples" / "04_your_own_rig.py"))["make_folder"](tmp_path / "machine")
    lab = Lab(campaign(4, currents=(0.0, 0.5, 1.0), points=60, cycles=3), "de", "mm-kN")
    for name, kind in (("one-file", lab_exports.run_column), ("no-current", lab_exports.tests_table)):
        (tmp_path / name).mkdir()
        kind(lab, tmp_path / name)
    (tmp_path / "no-current" / "tests.csv").unlink()
    (tmp_path / "later").mkdir()
    shutil.copy(tmp_path / "machine" / "1Hz_20mm_1A.txt", tmp_path / "later" / "1Hz_20mm_1A_warm.txt")
    return tmp_path


@pytest.mark.parametrize("last", ["split", pytest.param("study", marks=pytest.mark.slow)])
def test_the_commands_of_the_page_do_what_it_says(place, last):
    """From the import to the split, and to the study behind it."""
    tried = []
    for arguments, printed in commands(HOUSE / "docs" / "how-to" / "your-own-rig.md"):
        if arguments[0] == "study" and last == "split":
            continue
        done = CliRunner().invoke(application(), arguments)
        expected = 2 if "nothing written" in printed else 0
        assert done.exit_code == expected, (arguments, done.output)
        for line in printed.splitlines():
            if (
                line.startswith(("dataset: ", "table of ", "my-rig: ", "  force error ", "further models"))
                or "validation runs: " in line
            ):
                assert line in done.output, (arguments, done.output)
        if "--write-tests" in arguments:
            table = place / "no-current" / "tests.csv"
            lines = table.read_text().splitlines()
            amperes = np.repeat([0.0, 0.5, 1.0], 3)
            filled = [line.replace(",,,train", f",{a},,train", 1) for line, a in zip(lines[1:], amperes, strict=True)]
            table.write_text("\n".join([lines[0], *filled]) + "\n")
        tried.append(arguments[0])
    assert set(tried) == {"import", "check", "split", last}
    assert [run.current_A for run in load_dataset("lab")] == [0.0] * 3 + [0.5] * 3 + [1.0] * 4
    if last == "split":
        return
    assert (place / "result" / "report.html").is_file()
    ranked = [*done.output.splitlines()[-1].partition(": mrdamper ")[2].split(), "--models", "kwok"]
    assert "hyperbolic tangent" in CliRunner().invoke(application(), ranked).output
    scored = CliRunner().invoke(application(), ["validate", "result/model.json", "my-rig"])
    assert "runs with names of the model's identification runs: 8" in scored.output
    bundled = CliRunner().invoke(application(), ["validate", "result/model.json"])
    assert "give a dataset folder after the model" in str(bundled.exception)
