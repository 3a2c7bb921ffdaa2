"""What `mrdamper doctor` and `mrdamper cache` say, with a compiler, without one, and after one failed."""

import json
import shutil

import pytest
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.tracing.compiled import cache


def call(*arguments: str) -> str:
    result = CliRunner().invoke(application(), list(arguments))
    assert result.exit_code == 0, result.output
    return result.stdout


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv(cache.FOLDER, str(tmp_path / "cache"))
    for name in ("_loaded", "_unusable"):
        monkeypatch.setattr(cache, name, {})


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_with_a_compiler_the_gain_is_measured_and_the_cache_can_be_cleared():
    found = json.loads(call("doctor", "--json"))
    assert found["compiled"]
    assert float(found["gain"].split()[0]) > 5
    assert json.loads(call("cache", "--json"))["programs"] == 1
    assert json.loads(call("cache", "--clear", "--json"))["removed"] == 1
    assert json.loads(call("cache", "--json"))["programs"] == 0


def test_without_a_compiler_the_remedy_is_said(monkeypatch):
    monkeypatch.setenv("MRDAMPER_COMPILER", "none")
    printed = call("doctor")
    assert "no C compiler was found" in printed
    assert "mrdamper[compiler]" in printed


def test_a_compiler_that_fails_is_named_with_its_reason(tmp_path, monkeypatch):
    place = tmp_path / "brokencc"
    place.write_text("#!/bin/sh\necho 'error: licence expired' >&2; exit 3\n")
    place.chmod(0o755)
    monkeypatch.setenv("MRDAMPER_COMPILER", str(place))
    found = json.loads(call("doctor", "--json"))
    assert not found["compiled"]
    assert "licence expired" in found["reason"]
