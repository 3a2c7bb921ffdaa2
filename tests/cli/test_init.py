"""Templates: each is accepted by its reader, holds every key of it, and is never written over a file."""

import re
from dataclasses import fields

import pytest
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.cli.commands.init import template
from mrdamper.errors import InputError, OutputError, UnknownNameError
from mrdamper.fleet.profile import load_limits as load_column_limits
from mrdamper.report.about import About, AboutError, Limit, load_about, load_limits
from mrdamper.rig_files.profile import Channel, Correction, CurrentSource, FileForm, Profile, load_profile
from mrdamper.rig_files.strict_toml import RIG_LIMITS
from mrdamper.rig_files.tests_table import COLUMNS, load_tests
from mrdamper.study.limits import Limits


def completed(kind):
    """The template with every optional line in use."""
    return re.sub(r"^#(?=[\w\[])", "", template(kind), flags=re.MULTILINE)


def keys(text):
    return set(re.findall(r"^#? ?(\w+) = ", text, flags=re.MULTILINE))


def written(tmp_path, kind, text):
    path = tmp_path / f"{kind}.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_an_empty_head_of_a_report_states_nothing(tmp_path):
    assert load_about(written(tmp_path, "about", template("about"))) == About()
    text = template("about").replace('serial = ""', 'serial = "SN 1"')
    assert load_about(written(tmp_path, "about", text)).serial == "SN 1"
    assert keys(template("about")) == set(About.model_fields)


def test_one_limits_file_serves_three_readers(tmp_path):
    path = written(tmp_path, "limits", completed("limits"))
    assert load_limits(path) == (Limit(current_A=0.5, velocity_m_s=0.1, side="rebound", lower_N=300.0, upper_N=420.0),)
    column = load_column_limits(path)["gas_force_N"]
    assert (column.lower, column.upper) == (110.0, 130.0)
    assert Limits.read(path).amplitude_mm == (2.0, 20.0)
    assert {field.name for field in fields(Limits)} == set(RIG_LIMITS)
    assert keys(template("limits")) == {*RIG_LIMITS, *Limit.model_fields, "lower", "upper"}


@pytest.mark.parametrize("read", [load_limits, load_column_limits, Limits.read])
@pytest.mark.parametrize(("wrong", "right"), [("limis.x = 1", "limits"), ("curent_A = 1", "current_A")])
def test_a_misspelt_limit_is_refused_by_every_reader(tmp_path, read, wrong, right):
    path = written(tmp_path, "limits", f"{wrong}\n{completed('limits')}")
    with pytest.raises(InputError, match=f"unknown key .*did you mean {right}") as refused:
        read(path)
    assert refused.value.code == ("E_ABOUT" if refused.type is AboutError else "E_LIMITS")


def test_limits_without_the_part_of_a_command_are_refused(tmp_path):
    path = written(tmp_path, "limits", template("limits"))
    for read, part in ((load_limits, "limit"), (load_column_limits, "limits"), (Limits.read, "current_A")):
        with pytest.raises(InputError, match=part):
            read(path)


def test_a_profile_holds_every_key(tmp_path):
    assert load_profile(written(tmp_path, "empty", template("profile"))) == Profile()
    profile = load_profile(written(tmp_path, "profile", completed("profile")))
    assert profile.channel("displacement").unit == "mm"
    assert profile.current == CurrentSource(value=0.5, unit="A")
    parts = (FileForm, Channel, CurrentSource, Correction)
    known = {name for part in parts for name in part.model_fields} | {"rig", "excitation", "split"}
    assert keys(template("profile")) == known
    tables = set(re.findall(r"^#\[(\w+)", template("profile"), flags=re.MULTILINE))
    assert tables | {"rig", "excitation", "split"} == set(Profile.model_fields)


def test_a_table_of_tests_is_read(tmp_path):
    path = tmp_path / "tests.csv"
    path.write_text(template("tests"), encoding="utf-8")
    (row,) = load_tests(path).rows
    assert (row.file, row.current, row.split) == ("test_01.csv", 0.5, "train")
    assert template("tests").splitlines()[0] == ",".join(COLUMNS)


def test_a_template_is_never_written_over_a_file(tmp_path):
    def init(*words):
        return CliRunner().invoke(application(), ["init", *map(str, words)])

    out = tmp_path / "about.toml"
    assert init("about", "--out", out).exit_code == 0
    assert out.read_text(encoding="utf-8") == template("about") == init("about").output
    out.write_text("mine")
    assert isinstance(init("about", "--out", out).exception, OutputError)
    assert out.read_text() == "mine"
    assert isinstance(init("abuot").exception, UnknownNameError)
