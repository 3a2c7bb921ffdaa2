"""`mrdamper export` as its user meets it."""

import pytest
from support.dampers import joint_damper
from support.fmu_files import COMPILERS, fmu_bytes
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.dampers.model_file import save_model
from mrdamper.exporters import all_exporters

run = CliRunner()


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    path = tmp_path_factory.mktemp("model") / "model.json"
    save_model(joint_damper(), path)
    return path


@pytest.mark.parametrize("to", sorted(set(all_exporters()) - {"fmu"}))  # test_fmu.py compiles those
def test_what_is_printed_is_what_was_written(model, to, tmp_path):
    result = run.invoke(application(), ["export", str(model), "--to", to, "--out", str(tmp_path / "out")])
    assert result.exit_code == 0
    written = {line for line in result.stdout.splitlines() if line}
    assert written == {str(path) for path in tmp_path.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    ("more", "code"),
    [
        (["--to", "fmx"], "E_NAME"),
        (["--to", "c", "--fmi", "3"], "E_OPTION"),
        (["--to", "fmu", "--fmi", "4"], "E_FMI_VERSION"),
        (["--to", "c", "--name", "äöü"], "E_EXPORT_NAME"),
    ],
)
def test_a_wrong_option_is_one_error_and_no_file(model, more, code, tmp_path):
    result = run.invoke(application(), ["export", str(model), "--out", str(tmp_path / "out"), *more])
    assert result.exception is not None
    assert getattr(result.exception, "code", "") == code
    assert not list(tmp_path.iterdir())


def test_names_cannot_leave_the_folder_or_the_comment(model, tmp_path):
    result = run.invoke(
        application(), ["export", str(model), "--to", "c", "--out", str(tmp_path), "--name", '../*/ "x']
    )
    assert result.exit_code == 0
    assert {path.name for path in tmp_path.iterdir()} == {"x.h", "x.c", "x_test.c"}


@pytest.mark.skipif(not COMPILERS, reason="no C compiler, so no binary to check")
def test_check_takes_an_fmu(tmp_path):
    pytest.importorskip("fmpy", reason="FMPy is not installed")
    path = tmp_path / "damper.fmu"
    path.write_bytes(fmu_bytes("joint", 2))
    good = run.invoke(application(), ["check", str(path)])
    assert (good.exit_code, good.stdout) == (0, "nothing found\n")
    path.write_bytes(path.read_bytes()[:3000])
    broken = run.invoke(application(), ["check", str(path)])
    assert broken.exit_code == 2
    assert "E_FMU_ARCHIVE" in broken.stdout
