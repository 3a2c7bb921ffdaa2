"""The journal: durable, one writer, and it says why it cannot be used."""

import errno
import sqlite3
import subprocess
import sys

import pytest

from mrdamper.errors import ResourceError
from mrdamper.fleet import journal as journals
from mrdamper.fleet.journal import Journal, JournalError, file_system
from mrdamper.fleet.table import write_table


def test_what_is_kept_is_there_again(tmp_path):
    first = Journal(tmp_path)
    first.keep([("a", {"x": 0.1}), ("b", {"x": [1, 2]})])
    first.close()
    second = Journal(tmp_path)
    assert second.result("a") == {"x": 0.1}
    assert second.result("b") == {"x": [1, 2]}
    assert second.result("c") is None
    second.close()


def test_it_is_durable_as_it_says(tmp_path):
    kept = Journal(tmp_path)
    assert kept._base.execute("PRAGMA synchronous").fetchone()[0] == 2
    assert kept._base.execute("PRAGMA journal_mode").fetchone()[0] == "wal"
    kept.close()


def test_a_second_writer_is_told_the_owner(tmp_path):
    code = (
        "import sys, pathlib; from mrdamper.fleet.journal import Journal;"
        "Journal(pathlib.Path(sys.argv[1])); print('open', flush=True); sys.stdin.read()"
    )
    owner = subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert owner.stdout.readline() == "open\n"
    with pytest.raises(JournalError, match=f"process {owner.pid} on ") as refused:
        Journal(tmp_path)
    assert refused.value.code == "E_JOURNAL_TAKEN"
    owner.kill()
    owner.communicate()
    Journal(tmp_path).close()  # the lock ends with its process


def test_a_newer_journal_is_left_alone(tmp_path):
    Journal(tmp_path).close()
    base = sqlite3.connect(tmp_path / "journal.sqlite")
    base.execute("PRAGMA user_version = 99")
    base.close()
    before = (tmp_path / "journal.sqlite").read_bytes()
    with pytest.raises(JournalError) as refused:
        Journal(tmp_path)
    assert refused.value.code == "E_JOURNAL_NEWER"
    assert (tmp_path / "journal.sqlite").read_bytes() == before


@pytest.mark.parametrize("content", [b"not a database, but long enough to be read as one" * 20, b"\0" * 5000])
def test_a_damaged_journal_is_refused(tmp_path, content):
    (tmp_path / "journal.sqlite").write_bytes(content)
    with pytest.raises(JournalError):
        Journal(tmp_path)


def test_a_full_disk_is_one_error_and_loses_nothing(tmp_path):
    kept = Journal(tmp_path)
    kept.keep([("a", {"x": 1})])
    pages = kept._base.execute("PRAGMA page_count").fetchone()[0]
    kept._base.execute(f"PRAGMA max_page_count = {pages}")
    with pytest.raises(ResourceError) as refused:
        kept.keep([(f"key {n}", {"x": "x" * 1000}) for n in range(100)])
    assert refused.value.code == "E_DISK_FULL"
    assert kept.result("a") == {"x": 1}
    assert kept.result("key 0") is None
    kept.close()


def test_a_table_that_does_not_fit_leaves_the_old_one(tmp_path, monkeypatch):
    import polars as pl

    path = tmp_path / "dampers.parquet"
    write_table([{"serial": "a"}], [], None, path)
    before = path.read_bytes()

    def full(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(pl.LazyFrame, "sink_parquet", full)
    with pytest.raises(ResourceError) as refused:
        write_table([{"serial": "b"}], [], None, path)
    assert refused.value.code == "E_DISK_FULL"
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["dampers.parquet"]


def test_where_locks_cannot_be_trusted_there_is_no_journal(tmp_path, monkeypatch):
    mounts = tmp_path / "mountinfo"
    mounts.write_text(
        "22 1 8:1 / / rw - ext4 /dev/sda1 rw\n"
        f"23 22 0:5 / {str(tmp_path).replace(' ', chr(92) + '040')} rw - nfs4 server:/x rw\n"
    )
    assert file_system(tmp_path / "out", mounts) == "nfs4"
    assert file_system(tmp_path.parent, mounts) == "ext4"
    monkeypatch.setattr(journals, "file_system", lambda folder: "nfs4")
    with pytest.raises(JournalError) as refused:
        Journal(tmp_path / "out")
    assert refused.value.code == "E_JOURNAL_NETWORK"


def test_locks_that_are_granted_twice_are_found_out(tmp_path, monkeypatch):
    import fcntl

    monkeypatch.setattr(fcntl, "flock", lambda *_: None)
    with pytest.raises(JournalError) as refused:
        Journal(tmp_path)
    assert refused.value.code == "E_JOURNAL_NETWORK"
