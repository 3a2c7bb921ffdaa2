"""Temperature, pressure and second sensors stay with the run; a corrected force keeps the raw one beside it."""

import json

import numpy as np
import pytest
import scipy.io
from support.rig_files import AMPLITUDE, FREQUENCY, channels, rows, text, write

from mrdamper.data import Run
from mrdamper.errors import InputError, RunError
from mrdamper.rig_files.dataset_folder import load_dataset, save_dataset
from mrdamper.rig_files.preview import columns_of, question_of, tree_lines
from mrdamper.rig_files.profile import parse_profile, profile_text
from mrdamper.rig_files.profile_template import profile_template
from mrdamper.rig_files.rig_import import read_run, read_runs, to_dataset

HEADER = "time [s],disp [mm],force [N],oil temperature [°C],gas pressure [bar],LVDT 2 [in],body temp [°F]"


@pytest.fixture
def path(tmp_path):
    plain = rows()
    more = [20 + 0.01 * np.arange(len(plain)), np.full(len(plain), 12.5), plain[:, 1] / 25.4, np.full(len(plain), 68.0)]
    return write(tmp_path, "a_1A.csv", text(np.column_stack([plain, *more]), (HEADER,)))


def test_further_channels_are_kept_in_si_and_summarised(path, tmp_path):
    dataset = to_dataset([read_run(path)])
    save_dataset(dataset, tmp_path / "ds")
    run = load_dataset(tmp_path / "ds").runs[0]
    np.testing.assert_allclose(run.further["oil_temperature_C"], 20 + 0.01 * np.arange(run.time.size), atol=1e-6)
    np.testing.assert_allclose(run.further["pressure_Pa"], 12.5e5)
    np.testing.assert_allclose(run.further["lvdt_2_m"], run.displacement, atol=1e-7)
    np.testing.assert_allclose(run.further["body_temp_C"], 20.0, atol=1e-9)
    assert float(run.notes["body_temp_C"]) == pytest.approx(20.0)
    assert "ignored_columns" not in run.notes
    save_dataset(load_dataset(tmp_path / "ds"), tmp_path / "again")
    assert load_dataset(tmp_path / "again").runs[0].notes == run.notes
    part = run.part(10, 50)
    assert all(values.size == 40 for values in part.further.values())


EQUAL = ("time [s]", "Position [mm]", "Force [N]", "Force [N]", "Position [mm]", "temperature [°C]", "temperature [°C]")
FACTORS = {"displacement": 1e-3, "force": 1.0, "temperature": 1.0}


def equal_headings(tmp_path, suffix):
    """Return a file whose headings repeat, and its numbers by column."""
    plain = rows()
    more = [0.7 * plain[:, 2], 0.6 * plain[:, 1], 20 + plain[:, 0], 40 + plain[:, 0]]
    table = np.column_stack([plain, *more])
    if suffix == "csv":
        return write(tmp_path, "a_1A.csv", text(table, (",".join(EQUAL),))), table
    path = tmp_path / f"a_1A.{suffix}"
    if suffix == "xlsx":
        book = pytest.importorskip("openpyxl").Workbook()
        for row in (EQUAL, *table.tolist()):
            book.active.append(row)
        book.save(path)
    elif suffix == "json":
        path.write_text(json.dumps({"names": EQUAL, "data": table.tolist()}), encoding="utf-8")
    else:
        scipy.io.savemat(path, {"data": table, "names": np.array(EQUAL, dtype=object)})
    return path, table


@pytest.mark.parametrize("suffix", ["csv", "xlsx", "json", "mat"])
@pytest.mark.parametrize("numbers", [(2, 3, 6), (2, 4, 7), (5, 3, 7), (5, 4, 6)])
def test_a_column_given_by_its_number_is_that_column_in_the_dataset(numbers, suffix, tmp_path):
    path, table = equal_headings(tmp_path, suffix)
    columns = dict(zip(FACTORS, numbers, strict=True))
    channels = "".join(f"[channels.{role}]\ncolumn = {number}\n" for role, number in columns.items())
    profile = parse_profile(f"[channels.time]\ncolumn = 1\n{channels}")
    written, _ = profile_template([path], profile)
    for own in (profile, parse_profile(written)):
        folder = tmp_path / f"ds{len(list(tmp_path.iterdir()))}"
        save_dataset(to_dataset([read_run(path, own)]), folder)
        run = load_dataset(folder).runs[0]
        stored = {"displacement": run.displacement, "force": run.force, "temperature": run.further["temperature_C"]}
        for role, number in columns.items():
            np.testing.assert_allclose(stored[role], FACTORS[role] * table[:, number - 1], atol=1e-5, err_msg=role)
        assert len(run.further) == 4, "the other sensor of each kind stays, under a name of its own"


def test_a_temperature_of_another_length_is_left_out_and_named(tmp_path):
    needed = dict(zip(("time_s", "displacement_mm", "force_N"), rows().T, strict=True))
    np.savez(tmp_path / "a_1A.npz", **needed, temperature_C=np.full(9, 20.0))
    record = read_run(tmp_path / "a_1A.npz")
    assert record.temperature is None
    texts = [finding.text for finding in record.findings]
    assert "the temperature channel is not used: it has 9 samples, the force 600" in texts


def test_a_further_channel_of_another_length_is_refused():
    time = np.arange(5.0)
    with pytest.raises(RunError, match="temperature_C has 4 samples"):
        Run("a", time, time, time, np.array(0.0), further={"temperature_C": np.zeros(4)})


def test_inertia_and_gas_force_are_taken_off_as_stated(path, tmp_path):
    """A mass that moves with the load cell adds m a; gas pushes the rod out, against the force's sign."""
    mass, gas = 8.0, 150.0
    true = channels()
    omega = 2 * np.pi * FREQUENCY
    inertia = -mass * omega**2 * AMPLITUDE * np.sin(omega * true["time"])
    table = rows()
    table[:, 2] += inertia - gas
    heavy = write(tmp_path, "b_1A.csv", text(table))
    profile = parse_profile(f"[correction]\nmoving_mass_kg = {mass}\ngas_force_N = {gas}\n")
    assert parse_profile(profile_text(profile)) == profile
    record = read_run(heavy, profile)
    inside = slice(20, -20)  # a parabola at the ends of the record sees one side only
    np.testing.assert_allclose(record.force[inside], true["force"][inside], atol=0.3)
    np.testing.assert_allclose(record.further["force_raw_N"], table[:, 2], atol=1e-5)
    assert "8 kg" in record.provenance["force_correction"]


def test_numbers_of_columns_are_those_of_the_file_whatever_is_left_out(tmp_path):
    """A column of runs in front, columns beside a test and empty columns of a sheet do not shift the numbers."""
    plain = rows()
    table = np.column_stack([plain, 0.7 * plain[:, 2]])
    runs = np.vstack([np.column_stack([np.full(len(table), number), number * table]) for number in (1, 2)])
    runs = write(tmp_path, "runs_1A.csv", text(runs, ("run," + ",".join(EQUAL[:4]),)))
    book = pytest.importorskip("openpyxl").Workbook()
    for i, row in enumerate((EQUAL[:4], *table.tolist()), 3):
        for j, cell in enumerate(row, 2):
            book.active.cell(i, j, cell)
    sheet = tmp_path / "sheet_1A.xlsx"
    book.save(sheet)
    assert [line.split()[0] for line in tree_lines([sheet])[1:5]] == ["2", "3", "4", "5"]
    for path in (runs, sheet):
        with pytest.raises(InputError, match=r"set its number: \[channels.force\] column = 4 or 5 ") as refused:
            read_runs(path)
        question = question_of(refused.value, columns_of(path))
        assert question is not None
        assert [answer.value for answer in question.answers][-2:] == [4, 5]
        written, _ = profile_template([path], parse_profile(""))
        assert '#   5  "Force [N]"' in written
        for number, factor in ((4, 1.0), (5, 0.7)):
            profile = parse_profile(written.replace("[channels.force]", f"[channels.force]\ncolumn = {number}"))
            for i, record in enumerate(read_runs(path, profile), 1):
                np.testing.assert_allclose(record.force, i * factor * table[:, 2], atol=1e-4)
            again, _ = profile_template([path], profile)
            assert parse_profile(again).channels["force"].column == number
    with pytest.raises(InputError, match="no column 1: there are of the test: 2, 3, 4, 5"):
        read_runs(runs, parse_profile("[channels.force]\ncolumn = 1\n"))
