"""The published JSON Schemas accept what is written and refuse what is not of the format."""

import json
import re
import tomllib

import jsonschema
import polars as pl
import pytest
from support.dampers import conditioned_damper, joint_damper, modified_damper
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.dampers.model_file import dump_model


def schema(name):
    done = CliRunner().invoke(application(), ["schema", name])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


@pytest.mark.parametrize("name", ["model", "profile", "limits", "about", "fleet", "system", "plan", "results"])
def test_a_schema_is_valid(name):
    jsonschema.Draft202012Validator.check_schema(schema(name))


@pytest.mark.parametrize("make", [joint_damper, modified_damper, conditioned_damper])
def test_a_saved_model_follows_the_schema(make):
    document = json.loads(dump_model(make()))
    jsonschema.validate(document, schema("model"))
    for change in ({"units": {}, "extra": 1}, {"envelope": {}}, {"damper": {"kind": "none"}}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate({**document, **change}, schema("model"))


@pytest.mark.parametrize("name", ["about", "limits"])
def test_a_template_follows_the_schema_and_a_misspelt_key_does_not(name):
    template = CliRunner().invoke(application(), ["init", name]).stdout
    document = tomllib.loads(re.sub(r"^#(?=[\w\[])", "", template, flags=re.MULTILINE))
    assert document
    jsonschema.validate(document, schema(name))
    for key in document:
        misspelt = {(f"{k}x" if k == key else k): value for k, value in document.items()}
        with pytest.raises(jsonschema.ValidationError, match=f"{key}x"):
            jsonschema.validate(misspelt, schema(name))


def test_a_limit_of_another_side_violates_the_schema():
    limit = {"current_A": 0.5, "velocity_m_s": 0.1, "side": "rebound", "lower_N": 300.0, "upper_N": 420.0}
    jsonschema.validate({"limit": [limit]}, schema("limits"))
    for change in ({"side": "extension"}, {"lower": 1.0}, {"upper_N": "high"}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate({"limit": [{**limit, **change}]}, schema("limits"))


def test_the_record_of_a_result_and_the_rows_of_a_plan_follow_their_schemas(tmp_path):
    limits = tmp_path / "limits.toml"
    limits.write_text("current_A = [0, 1]\nfrequency_Hz = [0.5, 2]\namplitude_mm = [5, 20]\n", encoding="utf-8")
    out = tmp_path / "next"
    done = CliRunner().invoke(application(), ["plan", "--limits", str(limits), "--hours", "1", "--out", str(out)])
    assert done.exit_code == 0, done.output
    record = json.loads((out / "made.json").read_text(encoding="utf-8"))
    jsonschema.validate(record, schema("results"))
    with pytest.raises(jsonschema.ValidationError, match="3 is not of type"):
        jsonschema.validate({**record, "files": 3}, schema("results"))
    rows = pl.read_csv(out / "plan.csv").to_dicts()
    assert rows
    assert [row["file"] for row in rows] == [name for name in record["files"] if name != "plan.csv"]
    jsonschema.validate(rows, schema("plan"))
    with pytest.raises(jsonschema.ValidationError, match="'late' is not of type"):
        jsonschema.validate([{**rows[0], "minutes": "late"}], schema("plan"))
