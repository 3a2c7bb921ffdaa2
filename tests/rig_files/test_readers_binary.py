"""Binary formats and archives: what must be read, refused, and never run."""

import gzip
import io
import pickle
import sys
import zipfile

import numpy as np
import pytest
from support.rig_files import (
    NAMES,
    RATE,
    cdf_bytes,
    channels,
    columns,
    feather_bytes,
    hdf5_bytes,
    mat73_bytes,
    mat_bytes,
    mf4_bytes,
    npz_bytes,
    parquet_bytes,
    rows,
    sqlite_bytes,
    tdms_bytes,
    text,
    write,
    xlsx_bytes,
)

from mrdamper.errors import InputError, MissingExtraError
from mrdamper.rig_files import sandbox
from mrdamper.rig_files.preview import guess_profile
from mrdamper.rig_files.profile import parse_profile
from mrdamper.rig_files.readers import all_readers
from mrdamper.rig_files.readers.hdf5 import Hdf5
from mrdamper.rig_files.rig_import import import_files, read_run, read_runs

CLEAN = text()
SHORT = dict(zip(("time", "disp", "force"), rows().T, strict=True))
MOVED = {name: SHORT[name] for name in ("disp", "force")}
UNITS = {"time": "s", "disp": "mm", "force": "N"}
SHEET = [list(NAMES), *rows().tolist()]


def zip_bytes(*members, link=False):
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members:
            info = zipfile.ZipInfo(name)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = 0o120777 << 16 if link else 0
            archive.writestr(info, content)
    return target.getvalue()


def blown_up(book):
    """A workbook whose sheet is mostly spaces."""
    target = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(book)) as old, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            content = old.read(name)
            new.writestr(name, content.replace(b"<sheetData>", b" " * 20_000_000 + b"<sheetData>"))
    return target.getvalue()


def datetimes():
    stamps = np.datetime64("2024-03-31T01:59:59") + (1e9 * SHORT["time"]).round().astype("timedelta64[ns]")
    return {"time": stamps, "displacement_mm": SHORT["disp"], "force_N": SHORT["force"]}


def typed_sheet():
    import datetime

    start = datetime.datetime(2024, 3, 31, 1, 59, 59)
    table = [[start + datetime.timedelta(milliseconds=5 * i), x, f] for i, (_, x, f) in enumerate(rows().tolist())]
    return [["Rig 7", None, None], ["Time", "Position", "Load"], [None, "mm", "N"], *table]


GOOD = {
    "a.xlsx": lambda: xlsx_bytes(SHEET),
    "notes.xlsx": lambda: xlsx_bytes(SHEET, {"Notes": [["by hand", 1], ["=1+1", 2]]}),
    "stamps.xlsx": lambda: xlsx_bytes(typed_sheet()),
    "a.parquet": lambda: parquet_bytes(columns()),
    "stamps.parquet": lambda: parquet_bytes(datetimes()),
    "a.sqlite": lambda: sqlite_bytes(samples=columns()),
    "logged.db": lambda: sqlite_bytes(samples=columns()).replace(b"\1\1", b"\2\2", 1),  # written by way of a log
    "a.mat": lambda: mat_bytes(columns()),
    "version4.mat": lambda: mat_bytes(columns(), format="4"),
    "packed.mat": lambda: mat_bytes(columns(), do_compression=True),
    "struct.mat": lambda: mat_bytes({"rig": "seven", "data": columns()}),
    "new.mat": lambda: mat73_bytes(columns()),
    "a.h5": lambda: hdf5_bytes(columns()),
    "group.h5": lambda: hdf5_bytes(SHORT, UNITS, "test/raw"),
    "a.npz": lambda: npz_bytes(**columns()),
    "stamps.npz": lambda: npz_bytes(**datetimes()),
    "a.tdms": lambda: tdms_bytes(SHORT, UNITS),
    "stamps.tdms": lambda: tdms_bytes({**SHORT, "time": datetimes()["time"].astype("datetime64[us]")}, UNITS),
    "wave.tdms": lambda: tdms_bytes(MOVED, UNITS, wave=True),
    "a.mf4": lambda: mf4_bytes([(SHORT["time"], MOVED)], UNITS),
    "two_groups.mf4": lambda: mf4_bytes(
        [(SHORT["time"], {"disp": SHORT["disp"]}), (SHORT["time"], {"force": SHORT["force"]})], UNITS
    ),
    "a.csv.gz": lambda: gzip.compress(CLEAN.encode()),
    "a.zip": lambda: zip_bytes(("inner/a.csv", CLEAN)),
    "mat.zip": lambda: zip_bytes(("a.mat", mat_bytes(columns()))),
    "xlsx.zip": lambda: zip_bytes(("a.xlsx", xlsx_bytes(SHEET))),
    "a.mf4.gz": lambda: gzip.compress(mf4_bytes([(SHORT["time"], MOVED)], UNITS)),
}

BAD = {
    "none.xlsx": (lambda: xlsx_bytes([list(NAMES)]), "E_NO_DATA"),
    "bomb.xlsx": (lambda: blown_up(xlsx_bytes(SHEET)), "E_ARCHIVE_RATIO"),
    "cut.xlsx": (lambda: xlsx_bytes(SHEET)[:-1000], "E_TRUNCATED"),
    "units.xlsx": (lambda: xlsx_bytes([["time", "disp", "force"], *rows().tolist()]), "E_UNITS_MISSING"),
    "word.xlsx": (lambda: xlsx_bytes([*SHEET[:50], ["over", 1.0, 2.0], *SHEET[50:]]), "E_NUMBER"),
    "cut.feather": (lambda: feather_bytes(columns())[:-100], "E_TRUNCATED"),
    "cut.nc": (lambda: cdf_bytes(columns())[:-3000], "E_FORMAT"),
    "cut.parquet": (lambda: parquet_bytes(columns())[:-100], "E_TRUNCATED"),
    "truth.parquet": (lambda: parquet_bytes({**columns(), "force_N": np.ones(600, dtype=bool)}), "E_NUMBER"),
    "text.parquet": (lambda: parquet_bytes({**columns(), "force_N": np.array(["a"] * 600)}), "E_NUMBER"),
    "bomb.parquet": (lambda: parquet_bytes({n: np.zeros(10_000_000) for n in NAMES}), "E_ARCHIVE_RATIO"),
    "cut.sqlite": (lambda: sqlite_bytes(samples=columns())[:-5000], "E_FORMAT"),
    "none.sqlite": (lambda: sqlite_bytes(samples={name: np.empty(0) for name in NAMES}), "E_NO_DATA"),
    "sqlite.csv": (lambda: sqlite_bytes(samples=columns()), "E_FORMAT"),
    "cut.mat": (lambda: mat_bytes(columns())[:-1000], "E_TRUNCATED"),
    "cells.mat": (lambda: mat_bytes({**columns(), "force_N": np.array([[1], "a"], dtype=object)}), "E_UNSAFE"),
    "lengths.mat": (lambda: mat_bytes({**columns(), "force_N": np.arange(5.0)}), "E_FIELD_COUNT"),
    "complex.mat": (lambda: mat_bytes({**columns(), "force_N": SHORT["force"] + 1j}), "E_NUMBER"),
    "text.h5": (lambda: hdf5_bytes({**columns(), "force_N": np.array([b"12.5"] * 600)}), "E_NUMBER"),
    "text.npz": (lambda: npz_bytes(**{**columns(), "force_N": np.array(["12.5"] * 600)}), "E_NUMBER"),
    "cut.h5": (lambda: hdf5_bytes(columns())[:-1000], "E_TRUNCATED"),
    "cut.npz": (lambda: npz_bytes(**columns())[:-1000], "E_TRUNCATED"),
    "pickled.npz": (lambda: npz_bytes(**columns(), meta=np.array([{}], dtype=object)), "E_UNSAFE"),
    "pickle.csv": (lambda: pickle.dumps({"time_s": [1, 2]}), "E_UNSAFE"),
    "pickle.pkl": (lambda: pickle.dumps([1.0, 2.0], protocol=2), "E_UNSAFE"),
    "volts.tdms": (lambda: tdms_bytes(SHORT, {**UNITS, "force": "V"}), "E_UNITS_DIMENSION"),
    "cut.tdms": (lambda: tdms_bytes(SHORT, UNITS)[:-1000], "E_TRUNCATED"),
    "cut.mf4": (lambda: mf4_bytes([(SHORT["time"], MOVED)], UNITS)[:-1000], "E_TRUNCATED"),
    "rasters.mf4": (
        lambda: mf4_bytes(
            [(SHORT["time"], {"disp": SHORT["disp"]}), (SHORT["time"] + 1000, {"force": SHORT["force"]})], UNITS
        ), "E_RASTER",
    ),
    "workbook.csv": (lambda: xlsx_bytes(SHEET), "E_FORMAT"),
    "parquet.txt": (lambda: parquet_bytes(columns()), "E_FORMAT"),
    "hdf5.dat": (lambda: hdf5_bytes(columns()), "E_FORMAT"),
    "packed.csv": (lambda: gzip.compress(CLEAN.encode()), "E_FORMAT"),
    "page.csv": (lambda: b"<html><table><tr><td>1</td></tr></table></html>", "E_FORMAT"),
    "document.csv": (lambda: b"%PDF-1.7\n1 0 obj", "E_FORMAT"),
    "data.csv": (lambda: b'{"time": [1, 2, 3]}', "E_FORMAT"),
    "cut.csv.gz": (lambda: gzip.compress(CLEAN.encode())[:-500], "E_TRUNCATED"),
    "wrong.csv.gz": (lambda: gzip.compress(CLEAN.encode())[:-8] + bytes(8), "E_ARCHIVE"),
    "members.csv.gz": (lambda: gzip.compress(CLEAN.encode()) * 2, "E_ARCHIVE"),
    "tail.csv.gz": (lambda: gzip.compress(CLEAN.encode()) + b"tail", "E_ARCHIVE"),
    "unnamed.zip": (lambda: zip_bytes(("", CLEAN)), "E_ARCHIVE"),
    "cut.zip": (lambda: zip_bytes(("a.csv", CLEAN))[:-500], "E_TRUNCATED"),
    "two.zip": (lambda: zip_bytes(("a.csv", CLEAN), ("b.csv", CLEAN)), "E_ARCHIVE"),
    "up.zip": (lambda: zip_bytes(("../a.csv", CLEAN)), "E_ARCHIVE_PATH"),
    "root.zip": (lambda: zip_bytes(("/etc/a.csv", CLEAN)), "E_ARCHIVE_PATH"),
    "windows.zip": (lambda: zip_bytes(("..\\a.csv", CLEAN)), "E_ARCHIVE_PATH"),
    "link.zip": (lambda: zip_bytes(("a.csv", "/etc/passwd"), link=True), "E_ARCHIVE"),
    "nested.zip": (lambda: zip_bytes(("b.zip", zip_bytes(("a.csv", CLEAN)))), "E_ARCHIVE"),
    "nested.gz.zip": (lambda: zip_bytes(("a.csv.gz", gzip.compress(CLEAN.encode()))), "E_ARCHIVE"),
    "nested.csv.gz": (lambda: gzip.compress(gzip.compress(CLEAN.encode())), "E_ARCHIVE"),
    "bomb.csv.gz": (lambda: gzip.compress(b"0,0,0\n" * 1_000_000), "E_ARCHIVE_RATIO"),
    "bomb.zip": (lambda: zip_bytes(("a.csv", b"0,0,0\n" * 1_000_000)), "E_ARCHIVE_RATIO"),
    "empty.zip": (lambda: zip_bytes(("a.csv", b"")), "E_EMPTY"),
}  # fmt: skip


@pytest.mark.parametrize("name", GOOD)
def test_every_format_gives_the_same_test(tmp_path, name):
    record = read_run(write(tmp_path, name, GOOD[name]()))
    truth = channels()
    assert not record.findings
    for channel in ("time", "displacement", "force"):
        # Microseconds of Excel's dates; text has six decimals; the others are exact.
        np.testing.assert_allclose(getattr(record, channel), truth[channel], rtol=0, atol=2e-6)


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_read_is_refused(tmp_path, name):
    make, code = BAD[name]
    with pytest.raises(InputError) as caught:
        read_run(write(tmp_path, name, make()))
    assert caught.value.code == code, str(caught.value)
    assert caught.value.remedy
    assert name in str(caught.value)


def test_raw_volts_are_read_with_a_calibration(tmp_path):
    volts = {**SHORT, "force": SHORT["force"] / 250.0 - 0.1}
    path = write(tmp_path, "a.tdms", tdms_bytes(volts, {**UNITS, "force": "V"}))
    profile = parse_profile('[channels.force]\nunit = "N"\nscale = 250.0\noffset = 25.0\n')
    # One rounding of the sum of two products.
    np.testing.assert_allclose(read_run(path, profile).force, channels()["force"], rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "make"),
    [
        ("a.mat", lambda: mat_bytes({**columns(), "current_mA": 500.0})),
        ("struct.mat", lambda: mat_bytes({"data": {**columns(), "current_A": 0.5}})),
        ("new.mat", lambda: mat73_bytes({**columns(), "current_A": np.array([0.5])})),
        ("a.h5", lambda: hdf5_bytes({**columns(), "current_A": np.float64(0.5)})),
        ("a.npz", lambda: npz_bytes(**columns(), current_A=0.5)),
        ("member.zip", lambda: zip_bytes(("run_0.5A.csv", CLEAN))),
    ],
)
def test_the_current_may_stand_beside_the_columns(tmp_path, name, make):
    path = write(tmp_path, name, make())
    record = read_run(path)
    assert record.current is not None
    # 500 mA times 1e-3 rounds once.
    np.testing.assert_allclose(record.current, 0.5, rtol=1e-15, atol=0)
    np.testing.assert_array_equal(read_run(path, guess_profile(path)).force, record.force)


def test_numbers_of_another_meaning_are_no_current(tmp_path):
    path = write(
        tmp_path, "a.mat", mat_bytes({**columns(), "amplitude_mm": 20.0, "current": 0.5, "current_set_A": 1.0})
    )
    assert read_run(path).current is None


@pytest.mark.skipif(sys.platform != "linux", reason="limits of processes differ elsewhere")
def test_a_fresh_reading_process_has_room_for_every_good_file(tmp_path):
    """Its memory is counted by what is written to: what allocators reserve differs from start to start."""
    path = write(tmp_path, "a.parquet", GOOD["a.parquet"]())
    for _ in range(2):
        sandbox.close()
        assert read_run(path).time.size == 600


def test_several_sheets_are_several_runs(tmp_path):
    path = write(tmp_path, "a.xlsx", xlsx_bytes(SHEET, {"Second": SHEET}))
    assert [record.id for record in read_runs(path)] == ["a_Data", "a_Second"]
    named = read_run(path, parse_profile('[file]\nsheet = "Second"\n'))
    np.testing.assert_allclose(named.time, np.arange(600) / RATE, rtol=0, atol=1e-12)


def test_tables_of_a_database_are_joined_and_a_log_that_is_not_in_it_is_refused(tmp_path):
    samples = [{"run": np.full(600, i), **columns(seed=i)} for i in (1, 2)]
    both = {name: np.concatenate([of[name] for of in samples]) for name in samples[0]}
    content = sqlite_bytes(runs={"run": np.array([1, 2]), "current_A": np.array([0.5, 1.0])}, samples=both)
    path = write(tmp_path, "rig.sqlite", content)
    records = import_files([path]).records
    assert [float(record.current[0]) for record in records] == [0.5, 1.0]
    for record, of in zip(records, samples, strict=True):
        np.testing.assert_allclose(record.force, of["force_N"], rtol=0, atol=1e-9)
    write(tmp_path, "rig.sqlite-wal", b"rows")
    with pytest.raises(InputError, match=r"rig\.sqlite-wal holds rows that are not in the database yet"):
        read_runs(path)


def test_a_sheet_that_lists_quantities_states_them_for_the_record_beside_it(tmp_path):
    info = [["Damper", "A7", ""], ["Coil current", 0.4, "A"], ["Frequency", 2.0, "Hz"]]
    peaks = [["Cycle", "Fmax [N]"], [1, 600.0], [2, 601.0]]
    record = read_run(write(tmp_path, "a.xlsx", xlsx_bytes(SHEET, {"Info": info, "Peaks": peaks})))
    assert float(np.mean(record.current)) == 0.4
    assert "Coil current" in record.provenance["current_from"]


def test_hdf5_does_not_follow_links_out_of_the_file(tmp_path):
    import h5py

    write(tmp_path, "secret.h5", hdf5_bytes({"force_N": SHORT["force"]}))
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["time_s"], file["displacement_mm"] = SHORT["time"], SHORT["disp"]
        file["force_N"] = h5py.ExternalLink(str(tmp_path / "secret.h5"), "/force_N")
    with pytest.raises(InputError, match="'force_N' holds objects or links") as caught:
        read_run(tmp_path / "a.h5")
    assert caught.value.code == "E_UNSAFE"


@pytest.mark.parametrize(("library", "name"), [("h5py", "a.h5"), ("python_calamine", "a.xlsx"), ("nptdms", "a.tdms")])
def test_a_missing_library_is_named_with_the_way_to_install_it(tmp_path, monkeypatch, library, name):
    path = write(tmp_path, name, GOOD[name]())
    write(tmp_path, f"{library}.py", f"raise ImportError('none', name='{library}')")
    monkeypatch.syspath_prepend(str(tmp_path))
    for module in [m for m in sys.modules if m.split(".")[0] == library]:
        monkeypatch.delitem(sys.modules, module)
    sandbox.close()  # the reading process took over the path when it was started
    with pytest.raises(MissingExtraError, match=rf"{library}.*mrdamper\[rig\]"):
        read_run(path)
    sandbox.close()


def test_a_reading_process_that_dies_is_replaced(tmp_path):
    good = write(tmp_path, "good.mat", mat_bytes(columns()))
    before = read_run(good)
    with sandbox.taken("mat") as child:
        assert child.read({"reader": "none such"}, 30.0) is None
        assert not child.alive
    np.testing.assert_array_equal(read_run(good).time, before.time)


@pytest.mark.skipif(sys.platform != "linux", reason="limits of processes differ elsewhere")
@pytest.mark.parametrize("limit", ["_SECONDS", "_BYTES"])
def test_a_file_that_takes_too_much_is_refused(tmp_path, monkeypatch, limit):
    # Read in a tenth of a second of processor time, which the system counts by ticks of some milliseconds.
    path = write(tmp_path, "a.h5", hdf5_bytes({name: np.arange(1_000_000.0) for name in NAMES}, packed=True))
    monkeypatch.setattr(sandbox, limit, 1e-4 if limit == "_SECONDS" else 0)
    monkeypatch.setattr(sandbox, "_BYTES_PER_BYTE", 0 if limit == "_BYTES" else 30)
    monkeypatch.setattr(Hdf5, "seconds_per_byte", 0.0)
    with pytest.raises(InputError, match="far more time or memory"):
        read_run(path)


def test_no_name_is_claimed_by_two_formats():
    """But .nc, which means both netCDF formats, and .xls, by which programs call pages and XML for Excel, too."""
    suffixes = [suffix for reader in all_readers().values() for suffix in reader.suffixes]
    assert {suffix for suffix in suffixes if suffixes.count(suffix) > 1} == {".nc", ".xls"}
    assert len(all_readers()) >= 8


def test_a_missing_file_and_a_folder_are_named(tmp_path):
    for path in (tmp_path / "nowhere.csv", tmp_path):
        with pytest.raises(InputError, match="E_FILE"):
            read_run(path)
