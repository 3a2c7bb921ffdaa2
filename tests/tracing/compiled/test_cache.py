"""Compiled programs: the same numbers as the interpreter, and no library is loaded that was not published whole."""

import ctypes
import os
import shutil
import stat
import subprocess
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import pytest

from mrdamper.tracing import Tape, program
from mrdamper.tracing.c_writer import record_source
from mrdamper.tracing.compiled import RecordProgram, cache, compilers, record

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
TIME = np.linspace(0, 3, 200)


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    """A cache of this test, and nothing remembered from another."""
    monkeypatch.setenv(cache.FOLDER, str(tmp_path / "cache"))
    monkeypatch.delenv(compilers.VARIABLE, raising=False)
    monkeypatch.setattr(record, "_MIN_COMPILED_LINES", 0)
    for name in ("_loaded", "_unusable"):
        monkeypatch.setattr(cache, name, {})
    return tmp_path / "cache"


def lag(gain: float = 3.0) -> RecordProgram:
    """A first-order lag of a sine, its gain written into the program."""
    tape = Tape()
    x, dt, rate = tape.input("x"), tape.input("dt"), tape.parameter("rate", 2.0)
    held = tape.remember("held")
    value = held + (np.tanh(gain * x) - held) * (1 - np.exp(-rate * dt))
    tape.update(held, value)
    return RecordProgram(program(tape, {"y": value}))


def along(made: RecordProgram) -> np.ndarray:
    derived = made.prepare((2.0,))
    assert derived is not None
    return made.along((2.0,), derived, made.starts, (np.sin(TIME), np.full(TIME.size, 0.01))).outputs[0]


def interpreted(made: RecordProgram) -> np.ndarray:
    return made.interpreted_along(
        (2.0,), made.prepare((2.0,)), made.starts, (np.sin(TIME), np.full(TIME.size, 0.01))
    ).outputs[0]


def libraries(folder):
    return sorted(folder.glob("*.lib"))


def fake_compiler(folder, script: str, monkeypatch) -> None:
    """A program that is called like a compiler."""
    place = folder / "fakecc"
    place.write_text(f"#!/bin/sh\n{script}\n")
    place.chmod(0o755)
    monkeypatch.setenv(compilers.VARIABLE, str(place))


def test_compiled_code_gives_the_interpreters_numbers_and_is_kept(own_cache):
    found = along(lag())
    np.testing.assert_array_equal(found, interpreted(lag()))
    assert len(libraries(own_cache)) == 1
    assert stat.S_IMODE(own_cache.stat().st_mode) == 0o700


def test_a_kept_library_is_loaded_and_not_compiled_again(own_cache, monkeypatch):
    along(lag())
    monkeypatch.setattr(cache, "_loaded", {})
    monkeypatch.setattr(compilers.Compiler, "compile", lambda *_: pytest.fail("compiled again"))
    assert along(lag()).size == TIME.size


@pytest.mark.parametrize(
    ("script", "reason"),
    [
        ("echo 'error: disk on fire' >&2; exit 1", "disk on fire"),
        ("exit 0", "failed"),
        ('for a; do last="$out"; [ "$prev" = -o ] && out="$a"; prev="$a"; done; echo nonsense > "$out"', "computes"),
        ('for a; do case "$a" in *.c) sed -i "s/tanh/sin/" "$a";; esac; done; exec cc "$@"', "computes something else"),
    ],
)
def test_a_compiler_that_fails_or_computes_something_else_is_given_up_with_one_warning(
    own_cache, tmp_path, monkeypatch, script, reason
):
    fake_compiler(tmp_path, script, monkeypatch)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found, _ = along(lag()), along(lag(4.0))
    assert [w.category for w in said] == [cache.CompilerWarning]
    assert reason in str(said[0].message)
    np.testing.assert_array_equal(found, interpreted(lag()))
    assert not libraries(own_cache)


def test_a_compiler_that_hangs_is_ended_with_its_children_and_not_tried_by_the_next_process(
    own_cache, tmp_path, monkeypatch
):
    fake_compiler(tmp_path, f"sleep 60 & echo $! > {tmp_path}/child; wait", monkeypatch)
    monkeypatch.setattr(compilers, "_COMPILE_TIMEOUT_S", 0.5)
    begin = time.monotonic()
    with pytest.warns(cache.CompilerWarning, match="did not end"):
        along(lag())
    assert time.monotonic() - begin < 10
    state = subprocess.run(["ps", "-o", "stat=", "-p", (tmp_path / "child").read_text().strip()], capture_output=True)
    assert state.stdout.decode().strip()[:1] in ("", "Z")
    monkeypatch.setattr(cache, "_unusable", {})  # as another process begins
    monkeypatch.setattr(compilers.Compiler, "compile", lambda *_: pytest.fail("tried again"))
    with pytest.warns(cache.CompilerWarning, match="did not end"):
        along(lag())
    assert cache.unusable_reason()
    cache.clear_cache()
    assert not cache.unusable_reason()


@pytest.mark.parametrize("harm", ["other bytes", "cut short", "library of another program"])
def test_a_library_that_is_not_what_was_published_is_rebuilt(own_cache, monkeypatch, harm):
    expected = along(lag())
    (place,) = libraries(own_cache)
    if harm == "other bytes":
        place.write_bytes(b"\x7fELF" + bytes(500))
    elif harm == "cut short":
        place.write_bytes(place.read_bytes()[:-100])
    else:
        along(lag(5.0))
        (other,) = (path for path in libraries(own_cache) if path != place)
        key, content = place.stem.partition("-")[0], other.read_bytes()
        place.unlink()
        (own_cache / f"{key}-{other.stem.partition('-')[2]}.lib").write_bytes(content)
    monkeypatch.setattr(cache, "_loaded", {})
    np.testing.assert_array_equal(along(lag()), expected)
    monkeypatch.setattr(cache, "_loaded", {})
    monkeypatch.setattr(compilers.Compiler, "compile", lambda *_: pytest.fail("not rebuilt for good"))
    np.testing.assert_array_equal(along(lag()), expected)


def test_a_folder_that_others_can_write_to_is_refused(own_cache):
    along(lag())
    (place,) = libraries(own_cache)
    poisoned = place.read_bytes()
    own_cache.chmod(0o777)
    cache._loaded.clear()
    with pytest.warns(cache.CompilerWarning, match="not yours alone"):
        along(lag(6.0))
    assert libraries(own_cache) == [place]
    assert place.read_bytes() == poisoned


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_a_cache_that_cannot_be_written_to_is_done_without(own_cache):
    own_cache.mkdir(mode=0o500)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_array_equal(along(lag()), interpreted(lag()))


def test_a_full_disk_leaves_nothing_half_written(own_cache, monkeypatch):
    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(cache.os, "fsync", full)
    np.testing.assert_array_equal(along(lag()), interpreted(lag()))
    assert not list(own_cache.iterdir())


def test_the_cache_is_bounded_and_the_oldest_go_first(own_cache, monkeypatch):
    along(lag())
    (old,) = libraries(own_cache)
    os.utime(old, (1, 1))
    monkeypatch.setattr(cache, "_MAX_CACHE_BYTES", int(1.5 * old.stat().st_size))
    along(lag(7.0))
    assert len(libraries(own_cache)) == 1
    assert not old.exists()


def test_clear_removes_all(own_cache):
    along(lag())
    assert cache.cache_size()[0] == 1
    assert cache.clear_cache() == 1
    assert cache.cache_size() == (0, 0)


def test_two_processes_compile_the_same_at_once(own_cache):
    """Both get the library; one file is left."""
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); import test_cache as t;"
        "from mrdamper.tracing.compiled import record;"
        "record._MIN_COMPILED_LINES = 0; import hashlib; print(hashlib.sha256(t.along(t.lag()).tobytes()).hexdigest())"
    )
    command = [sys.executable, "-c", code, str(Path(__file__).parent)]
    running = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    answers = [process.communicate(timeout=60)[0] for process in running]
    assert answers[0] == answers[1] != ""
    assert len(libraries(own_cache)) == 1


def test_what_a_killed_process_left_is_never_loaded(own_cache):
    own_cache.mkdir(mode=0o700)
    left = own_cache / ".half.partial"
    left.write_bytes(b"\x7fELF")
    os.utime(left, (1, 1))
    along(lag())
    assert not left.exists()


def test_the_library_says_what_it_was_made_of(own_cache):
    along(lag())
    (place,) = libraries(own_cache)
    assert cache._made_of(ctypes.CDLL(str(place))) == place.stem.partition("-")[0]
    assert "step_0" in record_source(lag().program)
