"""What is read as a whole is read within bounds: files without an end, and those that unpack to a thousand times."""

import gzip
import os
import signal
from pathlib import Path

import pytest

from mrdamper.dampers.model_file import load_model
from mrdamper.data.atomic import MADE, write_result
from mrdamper.errors import InputError, OutputError
from mrdamper.fleet.profile import load_fleet_profile
from mrdamper.report.about import load_about, load_limits
from mrdamper.rig_files.dataset_folder import load_dataset, save_dataset
from mrdamper.rig_files.motion_file import load_motion
from mrdamper.rig_files.profile import load_profile
from mrdamper.rig_files.tests_table import load_tests
from mrdamper.systems.inputs import load_input
from mrdamper.systems.system_file import load_system

READ = {
    load_model: "model.json", load_limits: "limits.toml", load_about: "about.toml", load_profile: "rig.toml",
    load_fleet_profile: "fleet.toml", load_system: "car.toml", load_tests: "tests.csv", load_motion: "motion.csv",
    load_input: "quake.csv",
}  # fmt: skip


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="this system has no file without an end")
@pytest.mark.parametrize("read", READ, ids=lambda read: read.__name__)
def test_a_file_without_an_end_is_refused(read, tmp_path):
    endless = tmp_path / READ[read]
    endless.symlink_to("/dev/zero")
    with pytest.raises(InputError):
        read(endless)


@pytest.mark.parametrize("read", [load_motion, load_input])
def test_a_packed_table_is_not_unpacked_beyond_bounds(read, tmp_path):
    bomb = tmp_path / "table.csv"
    bomb.write_bytes(gzip.compress(b"time_s,displacement_m,acceleration_m_s2\n" + b"0,0,0\n" * 2_000_000, 1))
    packed = bomb.rename(tmp_path / "table.csv.gz") if read is load_motion else bomb
    with pytest.raises(InputError) as refused:
        read(packed)
    assert refused.value.code in ("E_DATASET", "E_ARCHIVE_RATIO")
    assert read is load_input or "times its size" in str(refused.value)


def test_further_files_of_a_dataset_stay_inside_it(tmp_path):
    with pytest.raises(InputError) as refused:
        save_dataset(load_dataset().rig("labcontrol"), tmp_path / "set", extra_files={"../licence.txt": "mine"})
    assert refused.value.code == "E_PATH"
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="this system has no file without an end")
def test_a_record_without_an_end_in_an_old_result_is_not_read(tmp_path):
    (tmp_path / MADE).symlink_to("/dev/zero")
    with pytest.raises(OutputError, match="exists already and is not empty"), write_result(tmp_path):
        pass


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
@pytest.mark.parametrize("read", READ, ids=lambda read: read.__name__)
def test_a_pipe_is_refused_without_waiting_for_a_writer(read, tmp_path):
    pipe = tmp_path / READ[read]
    os.mkfifo(pipe)

    def too_long(*_):
        raise TimeoutError(f"{read.__name__} waits for a writer")

    before = signal.signal(signal.SIGALRM, too_long)
    signal.alarm(10)
    try:
        with pytest.raises(InputError):
            read(pipe)
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
