"""What is written appears in one step, whenever the process is killed."""

import errno
import itertools
import json
import os
import signal

import pytest
from support.command import mrdamper
from support.forked import forked

from mrdamper.data import atomic
from mrdamper.data.atomic import (
    MADE,
    ResultRecord,
    publish,
    require_writable,
    write_file,
    write_folder,
    write_into,
    write_result,
)
from mrdamper.errors import InputError, OutputError, ResourceError, resource_error

posix = pytest.mark.skipif(os.name != "posix", reason="kills and locks as POSIX knows them")


def files(folder):
    return {p.relative_to(folder).as_posix(): p.read_text() for p in folder.rglob("*") if p.is_file()}


@pytest.mark.parametrize("here", [False, True], ids=["exchanged", "file by file"])
def test_a_result_takes_the_place_of_the_earlier_one_and_files_of_others_stay(tmp_path, monkeypatch, here):
    out = tmp_path / "out"
    publish(out, dict.fromkeys(["page", "model-a.json", "model-b.json", "figures/a.svg"], "old"))
    (out / "mine.txt").write_text("mine")
    (out / "figures" / "mine.svg").write_text("mine")
    if here:
        monkeypatch.chdir(out)
    record = ResultRecord(seconds={"in all": 1.5})
    listed = publish(out, dict.fromkeys(["page", "model.json", "figures/b.svg"], "new"), record)
    assert [p.relative_to(out).as_posix() for p in listed] == ["page", "model.json", "figures/b.svg"]
    found = files(out)
    written = {
        "kind": "",
        "files": ["figures/b.svg", "model.json", "page"],
        "seconds": {"in all": 1.5},
        "processes": None,
    }
    assert json.loads(found.pop(MADE)) == written
    new = dict.fromkeys(["page", "model.json", "figures/b.svg"], "new")
    assert found == new | dict.fromkeys(["mine.txt", "figures/mine.svg"], "mine")
    assert os.listdir(tmp_path) == ["out"]  # noqa: PTH208  hidden ones too


def test_an_error_leaves_what_stood_there(tmp_path):
    publish(tmp_path / "out", dict.fromkeys(["page"], "old"))
    before = files(tmp_path / "out")

    def fail():
        with write_result(tmp_path / "out") as work:
            (work / "page").write_text("new")
            raise RuntimeError("a fault")

    with pytest.raises(RuntimeError):
        fail()
    assert files(tmp_path) == {f"out/{name}": text for name, text in before.items()}


def written_until(at, out):
    """Write a result in this process; it is killed at this call of the system."""
    calls = itertools.count(1)

    def counted(real):
        def call(*arguments, **named):
            if next(calls) == at:
                os.kill(os.getpid(), signal.SIGKILL)
            return real(*arguments, **named)

        return call

    for name in ("mkdir", "rename", "replace", "link", "fsync", "unlink", "rmdir"):
        setattr(os, name, counted(getattr(os, name)))
    atomic._exchange = counted(atomic._exchange)
    publish(out, dict.fromkeys(["page", "model.json", "figures/a.svg"], "new"))


@posix
def test_killed_at_any_step_it_is_the_old_result_or_the_new_one(tmp_path):
    out, at = tmp_path / "out", 0
    seen = set()
    while True:
        at += 1
        publish(out, dict.fromkeys(["page", "model-a.json", "figures/b.svg"], "old"))
        (out / "mine.txt").write_text("mine")
        ended = forked(written_until, at, out)
        found = files(out)
        assert found.pop("mine.txt") == "mine"
        found.pop(MADE)
        old = dict.fromkeys(["page", "model-a.json", "figures/b.svg"], "old")
        new = dict.fromkeys(["page", "model.json", "figures/a.svg"], "new")
        assert found in (old, new), (at, found)
        seen.add(found == new)
        if ended == 0:
            break
        assert ended == -signal.SIGKILL
    assert at > 10
    assert seen == {True, False}
    publish(out, dict.fromkeys(["page"], "old"))  # sweeps what the killed ones left
    assert os.listdir(tmp_path) == ["out"]  # noqa: PTH208


@posix
def test_litter_of_the_living_stays(tmp_path):
    with write_into(tmp_path / "out") as work:
        (work / "a").write_text("first")
        with write_into(tmp_path / "out") as other:
            (other / "b").write_text("second")
        assert (work / "a").read_text() == "first"
    assert files(tmp_path / "out") == {"a": "first", "b": "second"}


def test_the_second_of_two_processes_gets_a_code(tmp_path):
    def write(text, meanwhile=lambda: None):
        with write_folder(tmp_path / "out") as work:
            (work / "a").write_text(text)
            meanwhile()

    with pytest.raises(OutputError):
        write("mine", lambda: write("other's"))
    assert files(tmp_path) == {"out/a": "other's"}


def test_a_device_is_written_to_and_not_replaced(tmp_path):
    with write_file(os.devnull) as path:
        path.write_text("x")
    require_writable(os.devnull)
    (tmp_path / "target.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to(tmp_path / "target.txt")
    with write_file(tmp_path / "link.txt") as path:
        path.write_text("new")
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "target.txt").read_text() == "new"


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (OSError(errno.ENOSPC, "full"), "E_DISK_FULL"),
        (OSError(errno.EFBIG, "big"), "E_FILE_SIZE"),
        (MemoryError(), "E_MEMORY"),
        (RuntimeError("can't start new thread"), "E_PROCESSES"),
        (OSError("No space left on device (os error 28)"), "E_DISK_FULL"),
        (RuntimeError("called `unwrap()` on `Err`: Os { code: 24, kind: TooManyOpenFiles }"), "E_OPEN_FILES"),
        (FileNotFoundError(errno.ENOENT, "No usable temporary directory found in ['/tmp']"), "E_TEMP"),
    ],
)
def test_what_runs_out_has_a_code(tmp_path, error, code):
    assert resource_error(error).code == code
    if isinstance(error, OSError) and code != "E_TEMP":
        with pytest.raises(ResourceError, match=code), write_into(tmp_path / "out"):
            raise error
    assert not list(tmp_path.iterdir())


def test_what_has_not_run_out_is_not_said_to(tmp_path):
    assert resource_error(OSError(errno.ENOENT, "no")) is None
    with pytest.raises(FileNotFoundError), write_into(tmp_path / "out"):
        (tmp_path.parent / "elsewhere").read_text()


@pytest.mark.parametrize("place", ["file/out", "file"])
def test_what_cannot_be_a_folder_is_refused_with_a_code(tmp_path, place):
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError) as caught, write_into(tmp_path / place) as work:
        (work / "a").write_text("x")
    assert caught.value.code == "E_OUTPUT"


def test_without_an_exchange_the_files_move_one_by_one(tmp_path, monkeypatch):
    monkeypatch.setattr(atomic, "_exchange", lambda one, other: False)
    publish(tmp_path / "out", dict.fromkeys(["page", "a"], "old"))
    publish(tmp_path / "out", dict.fromkeys(["page"], "new"))
    assert {k: v for k, v in files(tmp_path / "out").items() if k != MADE} == {"page": "new"}


def test_without_a_descriptor_to_look_into_folders_the_scratch_folder_still_goes(tmp_path, monkeypatch):
    monkeypatch.setattr("shutil.rmtree", lambda *_, **__: None)  # what it comes to, as it ignores errors
    with pytest.raises(ResourceError), write_file(tmp_path / "a.csv"):
        raise OSError(errno.EMFILE, "Too many open files")
    assert list(tmp_path.iterdir()) == []


def test_a_shorter_plan_leaves_no_record_of_the_longer_one(tmp_path):
    (tmp_path / "limits.toml").write_text("current_A = [0, 1]\nfrequency_Hz = [0.5, 4]\namplitude_mm = [4, 20]\n")
    for time in ("0.6", "0.2"):
        done = mrdamper("plan", "--limits", tmp_path / "limits.toml", "--hours", time, "--out", tmp_path / "plan")
        assert done.returncode == 0, done.stderr
    named = (tmp_path / "plan" / "plan.csv").read_text()
    records = [path.name for path in (tmp_path / "plan").glob("plan_*.csv")]
    assert records
    assert all(name in named for name in records)


@pytest.mark.parametrize("earlier", [None, "compare", "study"])
def test_a_result_is_put_into_no_folder_of_other_files(tmp_path, earlier):
    if earlier is None:
        (tmp_path / "test_1A.csv").write_text("time_s")
    else:
        publish(tmp_path, {"page": "old"}, ResultRecord(earlier))
    before = files(tmp_path)
    if earlier == "study":
        require_writable(tmp_path, "study")
        publish(tmp_path, {"page": "new"}, ResultRecord("study"))
        assert files(tmp_path)["page"] == "new"
        return
    with pytest.raises(OutputError, match="exists already and is not empty"):
        require_writable(tmp_path, "study")
    with pytest.raises(OutputError, match="exists already"):
        publish(tmp_path, {"page": "new"}, ResultRecord("study"))
    assert files(tmp_path) == before
