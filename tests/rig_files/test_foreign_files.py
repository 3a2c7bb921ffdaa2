"""Files that are no tests are told what they are, and where they belong."""

import zipfile

import pytest

from mrdamper.errors import InputError
from mrdamper.rig_files.dataset_folder import load_dataset
from mrdamper.rig_files.readers import raw_tables


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("model.json", b'{\n "format": "mrdamper-model",\n "version": "1.3"}', "mrdamper predict, validate or export"),
        ("loop.png", b"\x89PNG\r\n\x1a\n" + bytes(60), "the numbers it was drawn from"),
        ("loop.jpg", b"\xff\xd8\xff\xe0" + bytes(60), "the numbers it was drawn from"),
        ("other.json", b'{"a": 1}', "export it as CSV"),
        ("damper.fmu", None, "mrdamper check reads it"),
        ("bundle.tar", None, "rename it to .zip"),
    ],
)
def test_what_is_no_test_is_sent_where_it_belongs(tmp_path, name, content, said):
    path = tmp_path / name
    if content is None:
        with zipfile.ZipFile(path, "w") as made:
            made.writestr("modelDescription.xml", "<fmiModelDescription/>")
    else:
        path.write_bytes(content)
    with pytest.raises(InputError, match=said) as refused, raw_tables(path):
        pass
    assert refused.value.code == "E_FORMAT"
    with pytest.raises(InputError, match="a file, no dataset folder"):
        load_dataset(path)
