import copy
import json
from dataclasses import replace

import pytest

from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.joint import damper_of
from mrdamper.dampers.model_file import dump_model, load_model, parse_model, save_model
from mrdamper.dampers.modified import ModifiedModel
from mrdamper.dampers.parameter_map import ParameterMap
from mrdamper.data import Condition
from mrdamper.errors import InputError, ModelFileError, OutputError
from mrdamper.models.bingham import Bingham
from mrdamper.statistics.functions.forms import ParameterFunction


@pytest.fixture
def damper():
    functions = {
        "c": ParameterFunction("linear-current", (1 / 3, 1e3 / 7)),
        "fy": ParameterFunction("saturating-current", (0.1, 0.2, 0.3), (3.3,)),
        "f0": ParameterFunction("constant", (5e-324,)),
    }
    envelope = Envelope((0.0, 1.0), (0.5, 2.0), (0.01, 0.02), (0.03, 0.25))
    return ModifiedModel(
        ParameterMap(Bingham, functions), rig="rig <b>", envelope=envelope, provenance={"dataset": "=cmd()"}
    )


def test_round_trip_is_bit_exact(damper, tmp_path):
    save_model(damper, tmp_path / "model.json")
    back = load_model(tmp_path / "model.json")
    assert dump_model(back) == dump_model(damper)
    assert back == damper == copy.deepcopy(damper)
    assert hash(back) == hash(damper)
    assert back != replace(damper, rig="another")
    assert back != damper_of(Bingham(c=1.0, fy=2.0, f0=0.0))
    assert back.parameters.functions == damper.parameters.functions
    condition = Condition(0.7, 1.1, 0.015)
    assert (back.predict(condition).force == damper.predict(condition).force).all()


def test_units_and_provenance_are_inside(damper):
    document = json.loads(dump_model(damper))
    assert document["units"]["force"] == "N"
    assert document["provenance"] == {"dataset": "=cmd()"}
    assert document["version"] == "1.6"


def change(document, path, value):
    *parents, last = path.split(".")
    for name in parents:
        document = document[name]
    document[last] = value


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        ("version", "2.0", "newer mrdamper"),
        ("coil", {"rise_s": -1.0, "fall_s": 0.01}, "coil: rise_s = -1 s; write"),
        ("surprise", 1, "surprise: Extra inputs are not permitted"),
        ("damper.model", "binghum", "no model is called 'binghum'; did you mean bingham"),
        ("damper.functions.c.form", "linear", "no parameter function is called 'linear'"),
        ("damper.functions.c.coefficients", [1.0], "it takes 2 and 0"),
        ("damper.functions.c.coefficients", ["x", 1.0], "damper.functions.c.coefficients"),
        ("damper.functions.wrong", {"form": "constant", "coefficients": [1.0]}, "do not fit the model"),
        ("envelope.current_A", [0.0, "inf"], "envelope.current_A"),
        ("format", "other", "not a saved model"),
    ],
)
def test_damaged_files_are_refused_in_one_line(damper, path, value, text):
    document = json.loads(dump_model(damper))
    change(document, path, value)
    with pytest.raises(ModelFileError) as caught:
        parse_model(json.dumps(document), where="m.json")
    assert text in str(caught.value)
    assert str(caught.value).startswith("m.json: ")
    assert "\n" not in str(caught.value)


def test_truncated_and_missing_files(damper, tmp_path):
    with pytest.raises(ModelFileError, match="not JSON at line"):
        parse_model(dump_model(damper)[:200])
    with pytest.raises(ModelFileError, match="No such file"):
        load_model(tmp_path / "gone.json")
    (tmp_path / "image.json").write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(ModelFileError, match="not a text file"):
        load_model(tmp_path / "image.json")


def test_a_folder_with_one_model_is_that_model(damper, tmp_path):
    with pytest.raises(ModelFileError, match=r"a folder with no model\.json; give one"):
        load_model(tmp_path)
    save_model(damper, tmp_path / "model-a.json")
    (tmp_path / "made.json").write_text("{}")
    assert dump_model(load_model(tmp_path)) == dump_model(damper)
    save_model(damper, tmp_path / "model-b.json")
    with pytest.raises(ModelFileError, match=r"a folder with model-a\.json or model-b\.json; give one"):
        load_model(tmp_path)


def test_a_folder_is_no_place_for_a_model(damper, tmp_path):
    with pytest.raises(OutputError, match="is a folder"):
        save_model(damper, tmp_path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[" * 100_000 + "]" * 100_000, "nested deeper"),
        ('{"a":' * 90 + "1" + "}" * 90, "nested deeper"),
        ('{"format": "mrdamper-model", "version": "1.2", "version": "1.2"}', "'version' stands twice"),
        ('{"format": NaN}', "NaN is no number"),
        ('{"format": -Infinity}', "-Infinity is no number"),
        ('{"format": 1e999}', "too large a number"),
        ('{"format": ' + "9" * 5000 + "}", "a whole number of 5000 digits"),
        ("", "not JSON at line 1"),
        ("null", "not a saved model"),
    ],
)
def test_json_that_readers_understand_differently_is_refused(text, said):
    with pytest.raises(ModelFileError, match=said):
        parse_model(text)


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("version", "", "version is ''"),
        ("version", "-1", "version is '-1'"),
        ("version", "0.9", "version is '0.9'"),
        ("version", 1.2, "version: "),
        ("version", "9" * 5000 + ".0", "version is '9999"),
        ("units.displacement", "mm", "units are not those"),
        ("units.more", "N", "units are not those"),
        ("rig", "a\x1b[31m", "the rig is"),
        ("rig", "a" * 300, "the rig is"),
        ("envelope.current_A", [1.0, 0.0], "the lower end comes first"),
        ("envelope.frequency_Hz", [-1.0, 2.0], "-1 is negative"),
        ("envelope.current_A", ["0", "1"], "envelope.current_A"),
        ("envelope.current_A", [False, True], "envelope.current_A"),
        ("damper.functions.c.coefficients", ["1", "2"], "damper.functions.c.coefficients"),
        ("damper.functions.c.log", "yes", "damper.functions.c.log"),
        ("damper.functions.c.coefficients", [True, 1.0], "damper.functions.c.coefficients"),
    ],
)
def test_what_only_looks_like_a_model_is_refused(damper, path, value, said):
    document = json.loads(dump_model(damper))
    change(document, path, value)
    with pytest.raises(ModelFileError, match=said):
        parse_model(json.dumps(document))


def test_a_damper_without_tests_is_not_saved():
    with pytest.raises(InputError, match="a damper without tested ranges; save one that compare or a study identified"):
        dump_model(damper_of(Bingham(c=1000.0, fy=300.0)))
