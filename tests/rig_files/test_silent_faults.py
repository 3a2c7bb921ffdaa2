"""Files that were once read wrongly without a word: each is refused for its reason, or read right."""

import io
import warnings
import zipfile

import numpy as np
import pytest
from support.rig_files import channels, mat_bytes, tdms_bytes, text, write, xlsx_bytes
from support.rig_records import clean_record, codes_of, random_record, with_channel

from mrdamper.errors import InputError
from mrdamper.rig_files.conditions import currents_in
from mrdamper.rig_files.mapping.result_tables import results_in
from mrdamper.rig_files.preview import guess_profile
from mrdamper.rig_files.profile import Channel, Profile, parse_profile
from mrdamper.rig_files.rig_import import import_files, read_run
from mrdamper.rig_files.rig_record import thousands_in

TRUE = channels()
T, X, F = TRUE["time"], 1e3 * TRUE["displacement"], TRUE["force"]
NAMES = {"time [s]": T, "disp [mm]": X, "force [N]": F}


def table(columns, separator=","):
    cells = [[v if isinstance(v, str) else f"{v:.6f}" for v in values] for values in columns.values()]
    return "\n".join([separator.join(columns), *map(separator.join, zip(*cells, strict=True))]) + "\n"


def code(path):
    with pytest.raises(InputError) as caught:
        read_run(path)
    return caught.value.code


BIG = 20 * F


@pytest.mark.parametrize(
    ("written", "separator"),
    [
        (lambda v: f'"{v:,.1f}"', ","),
        (lambda v: f"{v:,.1f}".replace(",", "'"), ";"),
        (lambda v: f"{v:,.1f}".replace(",", "\u202f"), ";"),
        (lambda v: f"{v:,.1f}".replace(",", " "), ";"),
        (lambda v: f"{v:+,.1f}".replace("-", "- ").replace("+", "+ "), ";"),
    ],
    ids=["English", "Swiss", "French", "spaces", "signs apart"],
)
def test_marks_of_thousands_beside_a_decimal_mark_are_read(written, separator, tmp_path):
    columns = {**NAMES, "force [N]": [written(v) for v in BIG]}
    record = read_run(write(tmp_path, "a_0.5A.csv", table(columns, separator)))
    np.testing.assert_allclose(record.force, np.round(BIG, 1), atol=1e-9)


@pytest.mark.parametrize(("mark", "other"), [".,", ",."])
def test_marks_of_thousands_alone_are_read_where_a_profile_states_the_decimal_mark(mark, other, tmp_path):
    columns = {name: [f"{v:.4f}".replace(".", mark) for v in values] for name, values in NAMES.items()}
    columns["force [N]"] = [f"{v:,.0f}".replace(",", other) for v in BIG]
    path = write(tmp_path, "a_0.5A.csv", table(columns, ";"))
    with pytest.raises(InputError, match="decimal"):
        read_run(path)
    record = read_run(path, parse_profile(f'[file]\ndecimal = "{mark}"'))
    np.testing.assert_allclose(record.force, np.round(BIG))


@pytest.mark.parametrize(
    ("columns", "separator", "codes"),
    {
        "English thousands of one column": (
            {**NAMES, "force [N]": [f"{v:,.0f}" for v in BIG]}, ";", {"E_AMBIGUOUS", "E_NUMBER"}),
        "German thousands beside points": (
            {**NAMES, "force [N]": [f"{v:,.0f}".replace(",", ".") for v in BIG]}, "\t", {"E_AMBIGUOUS"}),
        "RMS of the force": ({"time [s]": T, "disp [mm]": X, "force RMS [N]": np.abs(F)}, ",", {"E_COLUMN"}),
        "filtered force": ({"time [s]": T, "disp [mm]": X, "Kraft gefiltert [N]": F}, ",", {"E_COLUMN"}),
        "set point": ({"time [s]": T, "disp [mm]": X, "force setpoint [N]": F}, ",", {"E_COLUMN"}),
        "compression": ({"time [s]": T, "compression [mm]": X, "force [N]": F}, ",", {"E_SIGN_CONVENTION"}),
        "compressive force": ({"time [s]": T, "disp [mm]": X, "compressive force [N]": F}, ",", {"E_SIGN_CONVENTION"}),
        "two clocks": ({**NAMES, "timestamp [s]": 1.1 * T}, ",", {"E_AMBIGUOUS"}),
        "another current than the name": ({**NAMES, "current [A]": 0 * T + 1}, ",", {"E_CURRENT_CONTRADICTS"}),
        "a force that wraps": ({**NAMES, "force [N]": (F + 900) % 1800 - 900}, ",",
                               {"E_LEAP", "E_DISSIPATION_SIGN", "E_SPIKE"}),
        "a displacement that wraps once": (
            {**NAMES, "disp [mm]": X - 65.536 * (np.arange(T.size) > 300)}, ",", {"E_LEAP"}),
        "a sign that flips": ({**NAMES, "force [N]": np.where(T < 2, F, -F)}, ",", {"E_DISSIPATION_SIGN"}),
        "a sign that flips for a quarter cycle": (
            {**NAMES, "force [N]": np.where((T > 2.25) & (T < 2.5), -F, F)}, ",", {"E_DISSIPATION_SIGN"}),
        "a spike of 100 mm": ({**NAMES, "disp [mm]": X + 100 * (np.arange(T.size) == 222)}, ",", {"E_SPIKE"}),
        "a range that is changed over": ({**NAMES, "force [N]": np.where(T < 2, F, 4.448 * F)}, ",", {"E_UNRELATED"}),
        "a unit that changes": ({**NAMES, "disp [mm]": np.where(T < 2, X, 1e-3 * X)}, ",", {"E_UNRELATED"}),
        "a folded force": ({**NAMES, "force [N]": np.abs(F)}, ",", {"E_RECTIFIED", "E_NO_ENERGY"}),
        "a spike of force": ({**NAMES, "force [N]": F + 2e4 * (np.arange(T.size) == 222)}, ",", {"E_SPIKE"}),
    }.values(),
)  # fmt: skip
def test_text_is_refused_for_its_reason(columns, separator, codes, tmp_path):
    assert code(write(tmp_path, "a_0.5A.csv", table(columns, separator))) in codes


def test_what_is_named_beside_the_force_does_not_disturb(tmp_path):
    more = {**NAMES, "force peak [N]": np.abs(F), "force filtered [N]": 0.5 * F, "time of day [s]": T + 36000}
    record = read_run(write(tmp_path, "a_0.5A.csv", table(more)))
    np.testing.assert_allclose(record.force, F, atol=1e-5)


@pytest.mark.parametrize("measured", ["disp feedback [mm]", "disp_ist [mm]", "disp (actual) [mm]"])
def test_a_channel_called_measured_is_taken_before_one_that_may_be_its_command(measured, tmp_path):
    write(tmp_path, "a_0.5A.csv", table({"time [s]": T, "disp [mm]": np.roll(X, 6), measured: X, "force [N]": F}))
    record = read_run(tmp_path / "a_0.5A.csv")
    np.testing.assert_allclose(1e3 * record.displacement, X, atol=1e-5)
    assert [finding.code for finding in record.findings] == ["W_CHOSEN"]


def test_what_is_abbreviated_act_may_be_of_the_actuator(tmp_path):
    columns = {"Time (s)": T, "Damper disp (mm)": X, "Force (N)": F, "Act disp (mm)": 1.01 * X}
    assert code(write(tmp_path, "a_0.5A.csv", table(columns))) == "E_AMBIGUOUS"


def test_a_sign_that_is_stated_settles_compression(tmp_path):
    path = write(tmp_path, "a_0.5A.csv", table({"time [s]": T, "compression [mm]": -X, "force [N]": F}))
    profile = guess_profile(path)
    assert "sign" not in profile.channels["displacement"].model_fields_set
    with pytest.raises(InputError, match=r"set \[channels.displacement\] sign = -1 in a profile"):
        read_run(path, profile)
    stated = parse_profile("[channels.displacement]\nsign = -1\n")
    np.testing.assert_allclose(read_run(path, stated).displacement, 1e-3 * X, atol=1e-8)


def test_a_current_in_per_cent_is_no_current(tmp_path):
    record = read_run(write(tmp_path, "a.csv", table({**NAMES, "current [%]": 0 * T + 50})))
    assert record.current is None
    assert [finding.code for finding in record.findings] == ["W_COLUMN"]


def test_a_current_in_the_first_row_only_is_compared_with_the_name_and_may_not_be_zero(tmp_path):
    half, zero = (table({**NAMES, "current [A]": [first, *[""] * (T.size - 1)]}) for first in ("0.5", "0.0"))
    assert codes_of(read_run(write(tmp_path, "t_0.5A.csv", half))) == ["W_DECIMATED"]
    assert code(write(tmp_path, "t_1.0A.csv", half)) == "E_CURRENT_CONTRADICTS"
    assert code(write(tmp_path, "t.csv", zero)) == "E_MISSING"


def test_a_line_break_in_a_quoted_name_is_read(tmp_path):
    names = {'"time\n[s]"': T, '"disp\n[mm]"': X, '"force\n[N]"': F}
    record = read_run(write(tmp_path, "a_0.5A.csv", table(names)))
    np.testing.assert_allclose(record.force, F, atol=1e-5)


def test_odd_bytes_in_a_name_nobody_needs_are_said(tmp_path):
    content = table({**NAMES, "n\udcffte": 0 * T}).encode("utf-8", "surrogateescape")
    record = read_run(write(tmp_path, "a_0.5A.csv", content))
    assert [finding.code for finding in record.findings] == ["W_ENCODING"]


def test_thousands_are_told_from_three_decimals():
    assert thousands_in(np.array([998.0, 999.0, 1.004, 1.012] * 50))
    for step in (0.125, 0.5, 0.001, 0.2):
        assert not thousands_in(np.round(40 * np.sin(np.linspace(0, 20, 4000)) / step) * step)
    assert not thousands_in(np.round(-30 + 20 * np.sin(np.linspace(0, 20, 4000)), 3))


def test_a_variable_stored_twice_is_refused(tmp_path):
    from scipy.io import savemat

    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as archive, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, values in (("time_s", T), ("disp_mm", X), ("force_N", F), ("force_N", 2 * F)):
            member = io.BytesIO()
            np.save(member, values)
            archive.writestr(f"{name}.npy", member.getvalue())
    assert code(write(tmp_path, "a_0.5A.npz", target.getvalue())) == "E_DUPLICATE_COLUMN"
    one, two = io.BytesIO(), io.BytesIO()
    savemat(one, {"time_s": T, "disp_mm": X, "force_N": F})
    savemat(two, {"force_N": 2 * F})
    assert code(write(tmp_path, "a_0.5A.mat", one.getvalue() + two.getvalue()[128:])) == "E_DUPLICATE_COLUMN"


def test_packed_numbers_are_unpacked(tmp_path):
    import h5py

    path = tmp_path / "a_0.5A.nc"
    with h5py.File(path, "w") as file:
        for name, unit, values in (("time", "s", T), ("disp", "mm", X)):
            file.create_dataset(name, data=values).attrs["units"] = unit
        packed = np.round((F - 100) / 0.5).astype("i2")
        packed[50] = -32768
        force = file.create_dataset("force", data=packed)
        force.attrs.update({"units": "N", "scale_factor": 0.5, "add_offset": 100.0, "_FillValue": np.int16(-32768)})
    record = read_run(path)
    assert np.flatnonzero(np.isnan(record.force)).tolist() == [50]
    np.testing.assert_allclose(np.delete(record.force, 50), np.delete(F, 50), atol=0.26)


def tdms_of_two_clocks(path, moved, force, *, force_values):
    from nptdms import ChannelObject, RootObject, TdmsWriter

    of_channels = (("disp", "mm", X, moved), ("force", "N", force_values, force))
    with TdmsWriter(path) as writer:
        channels_of = [
            ChannelObject("T", name, values, properties={"unit_string": unit, "wf_start_offset": 0.0, **clock})
            for name, unit, values, clock in of_channels
        ]
        writer.write_segment([RootObject(), *channels_of])
    return path


@pytest.mark.parametrize(
    "clock",
    [
        {"wf_increment": 0.005, "wf_start_offset": 0.1},
        {"wf_increment": 0.006},
        {"wf_increment": 0.005, "wf_start_time": np.datetime64("2024-05-02T10:00:00.100")},
    ],
)
def test_waveforms_of_different_clocks_are_put_on_that_of_the_force(clock, tmp_path):
    moved = {"wf_increment": 0.005, "wf_start_time": np.datetime64("2024-05-02T10:00:00")}
    begin = 0.1 if len(clock) > 1 else 0.0
    own = np.arange(begin, T[-1], clock["wf_increment"])
    if "wf_start_time" not in clock:
        moved.pop("wf_start_time")
    path = tdms_of_two_clocks(tmp_path / "a_0.5A.tdms", moved, clock, force_values=np.interp(own, T, F))
    record = read_run(path)
    assert [finding.code for finding in record.findings] == ["W_RASTER"]
    np.testing.assert_allclose(record.displacement, np.interp(record.time, T, 1e-3 * X), atol=1e-6)
    np.testing.assert_allclose(record.force, np.interp(record.time, T, F), atol=1e-6)


def test_waveforms_without_a_clock_are_refused(tmp_path):
    unset = {"wf_increment": 1.0}
    assert code(tdms_of_two_clocks(tmp_path / "a_0.5A.tdms", unset, unset, force_values=F)) == "E_COLUMN"
    good = write(tmp_path, "b_0.5A.tdms", tdms_bytes({"disp": X, "force": F}, {"disp": "mm", "force": "N"}, wave=True))
    assert read_run(good).force.size == F.size


def test_invalid_samples_of_a_measuring_system_are_missing(tmp_path):
    from asammdf import MDF, Signal

    bits = np.zeros(T.size, dtype=bool)
    bits[[40, 90]] = True
    file = MDF(version="4.10")
    file.append([Signal(X, T, unit="mm", name="disp"), Signal(F, T, unit="N", name="force", invalidation_bits=bits)])
    file.save(tmp_path / "a_0.5A.mf4")
    file.close()
    record = read_run(tmp_path / "a_0.5A.mf4")
    assert np.flatnonzero(np.isnan(record.force)).tolist() == [40, 90]


def test_the_comment_of_a_group_of_channels_states_the_current_of_its_test(tmp_path):
    from asammdf import MDF, Signal

    file = MDF(version="4.10")
    for i, current in enumerate((0.0, 0.5)):
        loads = (1 + current) * F
        signals = [Signal(X, T, unit="mm", name="disp"), Signal(loads, T, unit="N", name="force")]
        file.append(signals, comment=f"T{i + 1:02d} coil current {current:.1f} A")
    file.save(tmp_path / "session.mf4")
    file.close()
    records = import_files([tmp_path]).records
    assert [record.current[0] for record in records] == [0.0, 0.5]


def test_clean_records_show_no_leaps_and_no_spikes():
    for seed in range(40):
        record = clean_record(seed, sensor=5e-6 * (seed % 3))
        assert codes_of(record) == []
    assert codes_of(random_record()) == ["W_NOT_SINE"]
    coarse = with_channel(clean_record(2, points=100), "displacement", lambda x: np.round(x, 3, out=x))
    assert not {"E_SPIKE", "E_LEAP"} & set(codes_of(coarse))


def test_a_number_in_a_pattern_with_another_unit_is_refused(tmp_path):
    from mrdamper.rig_files.profile import parse_profile

    path = write(tmp_path, "run_20mm_1Hz.csv", text())
    for pattern, said in (("run_{current}*", "followed by 'mm'"), ("run_20mm_{current}*", "followed by 'Hz'")):
        with pytest.raises(InputError, match=said) as caught:
            read_run(path, parse_profile(f'[current]\npattern = "{pattern}"\n'))
        assert caught.value.code == "E_AMBIGUOUS"
    bare = write(tmp_path, "run_20_1.csv", text())
    with pytest.raises(InputError, match="no unit behind it"):
        read_run(bare, parse_profile('[current]\npattern = "run_{current}_*"\n'))
    with pytest.raises(InputError, match="no coil current of a damper"):
        read_run(bare, parse_profile('[current]\npattern = "run_{current}_*"\nunit = "A"\n'))


@pytest.mark.parametrize(
    ("columns", "noticed"),
    [
        ({"disp [mm]": 1e-3 * X}, "W_RANGE"),
        ({"force [N]": 1e-3 * F}, "W_RANGE"),
        ({"time [s]": 1e3 * T}, "W_RANGE"),
        ({"force [N]": 300 * np.round(F / 300)}, "W_COARSE"),
    ],
)
def test_what_may_be_a_slip_of_the_unit_is_said(columns, noticed, tmp_path):
    record = read_run(write(tmp_path, "a_0.5A.csv", table({**NAMES, **columns}, ",").replace(".000000,", ".0,")))
    assert noticed in {finding.code for finding in record.findings}


@pytest.mark.parametrize(
    "name",
    [
        *("2A_fuse_1", "supply 5A max", "run_04A", "specimen1A", "0.5A_1.0A", "0A8", "−0.5 to 0.5 A", "1.2.3 to 4A"),
        *("sweep 0 to 0.6 A", "0_to_0p6A", "0to2A", "0 and 0.6 A", "0-600mA", "0.2-0.6A", "I0..0.6A", "0.3, 0.6, 1 A"),
    ],
)
def test_a_name_that_may_mean_another_current_states_none(name):
    assert len(currents_in(name)) != 1


def test_whole_numbers_beside_their_scale_are_refused(tmp_path):
    counts = np.round(10 * F).astype(np.int16)
    path = write(tmp_path, "a_0.5A.mat", mat_bytes({"time_s": T, "disp_mm": X, "force_N": counts, "force_scale": 0.1}))
    assert code(path) == "E_AMBIGUOUS"


@pytest.mark.parametrize(
    "head", ["Scale;1;1;0.5\n{}", "{}Gain;;;0.5\n", "# Gain Load = 0.5\n{}", "# Load sensitivity: 0.5 N/digit\n{}"]
)
def test_whole_numbers_of_a_text_beside_their_scale_are_refused_until_a_profile_states_it(head, tmp_path):
    columns = {"time [s]": T, "disp [mm]": X, "load [N]": [f"{v:.0f}" for v in 2 * F]}
    lines = table(columns, ";").splitlines(keepends=True)
    if "Gain;;" in head:
        lines = [f"{i};{line}" for i, line in enumerate(lines)]
        lines[0] = lines[0].replace("0;", "channel;", 1)
    path = write(tmp_path, "a_0.5A.csv", head.format(lines[0]) + "".join(lines[1:]))
    assert code(path) == "E_AMBIGUOUS"
    stated = Profile(channels={"force": Channel(unit="N", scale=0.5)})
    np.testing.assert_allclose(read_run(path, stated).force, np.round(2 * F) / 2)


def test_a_line_that_states_a_current_heads_no_table_of_results():
    assert results_in(["Test 1;coil current 0.5 A", "Scale;0.004;0.0125", "Offset;0;-25"]) is None


def test_a_filtered_sheet_beside_the_measured_one_is_left_out_and_said(tmp_path):
    rows = [["time [s]", "disp [mm]", "force [N]"], *np.column_stack([T, X, F]).tolist()]
    record = read_run(write(tmp_path, "a_0.5A.xlsx", xlsx_bytes(rows, {"Filtered": rows})))
    assert "W_TABLE" in {finding.code for finding in record.findings}


def test_of_two_files_of_the_same_samples_that_of_the_shorter_name_is_the_test(tmp_path):
    for name in ("run_0.5A - Copy.csv", "run_0.5A.csv"):
        write(tmp_path, name, table(NAMES, ","))
    result = import_files([tmp_path])
    assert [record.id for record in result.records] == ["run_0.5A"]
    assert result.left_out == ("run_0.5A - Copy.csv",)


@pytest.mark.parametrize("name", ["run_0.5A", "run_raw_0.5A"])
@pytest.mark.parametrize("copy", ["filtered/run_0.5A.csv", "run_filtered_0.5A.csv", "run_0.5A (Peak-Valley).csv"])
def test_a_filtered_copy_of_a_file_is_no_second_test(name, copy, tmp_path):
    write(tmp_path, f"{name}.csv", table(NAMES))
    (tmp_path / copy).parent.mkdir(exist_ok=True)
    write(tmp_path, copy, table({**NAMES, "force [N]": 0.9 * F}))
    found = import_files([tmp_path])
    assert [record.id for record in found.records] == [name]
    assert found.left_out == (copy.rpartition("/")[2],)


def test_two_exports_of_a_test_with_other_decimals_are_one(tmp_path):
    rows = np.column_stack([T, X, F])
    write(tmp_path, "run_0.5A.xlsx", xlsx_bytes([["time [s]", "disp [mm]", "force [N]"], *rows.tolist()]))
    np.savetxt(tmp_path / "a_0.5A.csv", rows, "%.4f", ",", header="time [s],disp [mm],force [N]", comments="")
    found = import_files([tmp_path])
    assert ([record.id for record in found.records], found.left_out) == (["a_0.5A"], ("run_0.5A.xlsx",))


def test_a_copy_of_a_file_in_another_folder_is_no_second_test(tmp_path):
    for name in ("run_0.5A.csv", "backup/run_0.5A.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        write(tmp_path, name, table(NAMES))
    found = import_files([tmp_path])
    assert [record.id for record in found.records] == ["run_0.5A"]
    assert found.left_out == ("run_0.5A.csv",)


def test_the_same_motion_and_nearly_the_same_force_at_another_current_is_a_test_of_its_own(tmp_path):
    write(tmp_path, "a.csv", table({**NAMES, "current [A]": 0 * T + 0.5}))
    write(tmp_path, "b.csv", table({**NAMES, "force [N]": 1.0005 * F, "current [A]": 0 * T + 0.52}))
    assert [record.id for record in import_files([tmp_path]).records] == ["a", "b"]


@pytest.mark.parametrize("title", ["# {} A", "Test at {} A", "Coil current: {} A"])
def test_lines_among_the_rows_that_state_other_currents_begin_other_tests(title, tmp_path):
    head = table(NAMES).partition("\n")[0] + "\n"
    rows = {i: table({**NAMES, "force [N]": (1 + i) * F}).partition("\n")[2] for i in (0.5, 1.0)}
    tests = "".join(f"{title.format(current)}\n{own}" for current, own in rows.items())
    found = import_files([write(tmp_path, "a.csv", head + tests)])
    assert [record.current[0] for record in found.records] == [0.5, 1.0]
    (refusal,) = import_files([write(tmp_path, "b.csv", head + rows[1.0] + tests)]).refusals
    assert refusal.error.code == "E_BLOCKS"


@pytest.mark.parametrize(
    ("line", "current"),
    [
        ("# coil current = 0.5 A/V x (U_cmd - 0.4 V)", 1.0),
        ("# driver: 0.5 A/V, 0 A at 400 mV", 1.0),
        ("# driver: 0.5 A/V, zero at 0.4", 1.0),
        ("# driver: 0.5 A/V, zero at 0 V", 1.2),
        ("# LEM current sensor: 625 mV/A, 2.5 V at 0 A", -0.16),
        ("# driver: 0.5 A/V for 0-5 V", 1.2),
        ("# driver: 0.5 A/V, range -10 V to 10 V, supply 24 V", 1.2),
        ("# driver: 0.5 A/V, offset 0.4 V", None),
        ("# driver: 1 V = 0 A, 3 V = 1 A", None),
        ("# LEM current sensor: 625 mV/A, 2.5 V quiescent", None),
        ("# coil current = 0.25 A/V x (5 V - U_cmd)", None),
        ("# coil current = 0.5 A/V * U_cmd - 0.2 A", None),
        ("# coil current: 1.0 V = 2 A, range -10 to 10 V", 4.8),
        ("# driver: 0.5 A/V\n# driver offset: 0.4 V", None),
        ("# coil current: 0.5 A/V\n# U_cmd zero: 0.4 V", None),
        ("# scale: 0.5 A/V\n# offset: 0.4 V", None),
        ("# driver: 0.5 A/V\n# 0 A = 0.4 V", None),
        ("# driver: 0.5 A/V\n# 0 A = 0 V", 1.2),
        ("# driver: 0.5 A/V\n# force offset: 0.4 N\n# offset: 2 mm\n# 3 x 5 cycles", 1.2),
        ("# driver gain: 0.5 A/V", 1.2),
        ("# driver: 0.5 A/V, gain 1", 1.2),
        ("# driver: 0.5 A/V, gain 100", None),
        ("# driver: 0.5 A/V x 100", None),
        ("# driver: 0.5 A/V\n# amplifier: gain 0.1", None),
    ],
)
def test_a_scale_with_a_zero_of_its_own_is_applied_about_it_or_asked_for(line, current, tmp_path):
    columns = {**NAMES, "U_cmd (V)": np.full_like(T, 2.4)}
    record = read_run(write(tmp_path, "a.csv", f"{line}\n{table(columns)}"))
    assert (record.current is None) == (current is None)
    if current is not None:
        np.testing.assert_allclose(record.current, current, rtol=1e-6)


@pytest.mark.parametrize("line", ["gain 100", "0 N = 0.4 V", "load cell zero: 0.4 V"])
def test_a_gain_or_a_zero_in_a_text_beside_the_file_makes_its_scale_unclear(line, tmp_path):
    write(
        tmp_path, "a_0.5A.csv", table({**{n: v for n, v in NAMES.items() if "[N]" not in n}, "load cell [V]": F / 500})
    )
    write(tmp_path, "README.txt", "load cell: 2 mV/N\n")
    assert len(import_files([tmp_path]).records) == 1
    write(tmp_path, "README.txt", f"load cell: 2 mV/N\n{line}\n")
    assert not import_files([tmp_path]).records


def test_a_scale_of_the_profile_replaces_that_of_the_file(tmp_path):
    path = write(tmp_path, "a.csv", f"# driver: 0.5 A/V\n{table({**NAMES, 'U_cmd (V)': np.full_like(T, 2.4)})}")
    np.testing.assert_allclose(read_run(path).current, 1.2)
    for column in ("U_cmd (V)", 4, None):
        profile = Profile(channels={"current": Channel(column=column, unit="A", scale=0.4)})
        np.testing.assert_allclose(read_run(path, profile).current, 0.96, err_msg=str(column))


def test_notes_beside_the_tests_are_refused_by_no_profile(tmp_path):
    write(tmp_path, "a_0.5A.csv", table(NAMES, ";"))
    write(tmp_path, "README.txt", "A dataset of tests.\nC0 = none; C1 = one half; C2 = one\nD1 = 10; D2 = 20; D3 = 5\n")
    profile = Profile.model_validate({"file": {"separator": ";"}})
    imported = import_files([tmp_path], profile)
    assert (len(imported.records), imported.refusals, imported.left_out) == (1, (), ("README.txt",))
    write(tmp_path, "info 3 0.3A.csv", table(NAMES, ";").replace("0.400000;", "zzz;"))
    assert [refusal.error.code for refusal in import_files([tmp_path]).refusals] == ["E_NUMBER"]
