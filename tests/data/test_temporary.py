"""Nothing stays in the temporary folder, even of a process that was killed."""

import os
import signal
import subprocess
import sys
import tempfile

import pytest

from mrdamper.data.temporary import temporary_folder

HOLD = """
import tempfile, time
from mrdamper.data.temporary import temporary_folder
with temporary_folder() as folder:
    (folder / "a.csv").write_text("1")
    print(folder, flush=True)
    time.sleep(60)
"""


@pytest.mark.skipif(os.name != "posix", reason="the system frees no locks of killed processes")
def test_folders_of_killed_processes_go_and_others_stay(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    holders = [
        subprocess.Popen([sys.executable, "-c", HOLD], stdout=subprocess.PIPE, text=True, env=environment)
        for _ in range(2)
    ]
    try:
        killed, alive = (tmp_path / holder.stdout.readline().strip() for holder in holders)
        holders[0].send_signal(signal.SIGKILL)
        holders[0].wait()
        other, precious = tmp_path / "mrdamper-of-mine", tmp_path / "precious"
        other.mkdir()
        precious.mkdir()
        (killed / "link").symlink_to(precious)
        (tmp_path / "mrdamper-link.scratch").symlink_to(precious)
        with temporary_folder() as made:
            assert made.is_dir()
            assert not killed.exists()
            assert (alive / "a.csv").is_file()
            assert other.is_dir()
            assert precious.is_dir()
            assert (tmp_path / "mrdamper-link.scratch").is_symlink()
        assert not made.exists()
    finally:
        for holder in holders:
            holder.kill()
            holder.communicate()
