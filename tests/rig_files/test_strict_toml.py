"""TOML that would take minutes, or an error of another kind, is refused as TOML that cannot be read."""

import time
import tomllib

import pytest

from mrdamper.data.strict_text import read_toml
from mrdamper.rig_files.profile import ProfileError, parse_profile

HOSTILE = {
    "a name of 30,000 parts": "a." * 30_000 + "b = 1",
    "quoted parts": '"a" . ' * 400 + "b = 1",
    "nested lists": "a = " + "[" * 5000,
    "an integer of 5,000 digits": "a = " + "9" * 5000,
    "too long": "# " + "x" * 300_000,
}


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE)
def test_it_is_refused_at_once(text):
    begin = time.process_time()
    with pytest.raises(tomllib.TOMLDecodeError):
        read_toml(text)
    with pytest.raises(ProfileError):
        parse_profile(text)
    assert time.process_time() - begin < 1


def test_what_people_write_is_read():
    assert read_toml("x.y = [1.5, 2.5]\nd = 2024-01-01\n[a.b.c]\nnote = 'one. two. three.'")["x"] == {"y": [1.5, 2.5]}
    assert len(read_toml("numbers = [" + "1.5, " * 1000 + "]")["numbers"]) == 1000
