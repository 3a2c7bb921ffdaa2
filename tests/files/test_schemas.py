"""The published JSON Schemas accept what is written and refuse what is not of the format."""

import json

import jsonschema
import pytest
from support.dampers import conditioned_damper, joint_damper, modified_damper
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.dampers.model_file import dump_model


def schema(name):
    done = CliRunner().invoke(application(), ["schema", name])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


@pytest.mark.parametrize("name", ["model", "profile", "fleet", "system"])
def test_a_schema_is_valid(name):
    jsonschema.Draft202012Validator.check_schema(schema(name))


@pytest.mark.parametrize("make", [joint_damper, modified_damper, conditioned_damper])
def test_a_saved_model_follows_the_schema(make):
    document = json.loads(dump_model(make()))
    jsonschema.validate(document, schema("model"))
    for change in ({"units": {}, "extra": 1}, {"envelope": {}}, {"damper": {"kind": "none"}}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate({**document, **change}, schema("model"))
