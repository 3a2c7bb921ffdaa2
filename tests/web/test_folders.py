"""Nothing of a bench stays in the temporary folder, even of one that was killed."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from mrdamper.web.folders import bench_folder


@pytest.mark.skipif(os.name != "posix", reason="folders of killed benches are told by process ids")
def test_folders_of_killed_benches_go_and_others_stay(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    left = tmp_path / f"mrdamper-bench-{gone.pid}-abc"
    mine = tmp_path / f"mrdamper-bench-{os.getpid()}-abc"
    other = tmp_path / "mrdamper-bench-of-somebody"
    for folder in (left, mine, other):
        folder.mkdir()
        (folder / "a.csv").write_text("1")
    precious = tmp_path / "precious"
    precious.mkdir()
    (left / "link").symlink_to(precious)
    link = tmp_path / f"mrdamper-bench-{gone.pid}-link"
    link.symlink_to(precious)
    made = bench_folder()
    assert made.is_dir()
    assert not left.exists()
    assert mine.is_dir()
    assert other.is_dir()
    assert link.is_symlink()
    assert precious.is_dir()


def test_a_folder_that_goes_while_it_is_looked_at_is_no_fault(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(Path, "glob", lambda folder, pattern: [tmp_path / "mrdamper-bench-1-gone"])
    assert bench_folder().is_dir()
