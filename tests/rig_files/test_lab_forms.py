"""Forms in which laboratories keep what belongs to a record: beside it, in codes, in formulas, in other files."""

import json
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
from support.rig_files import tdms_bytes

from mrdamper.errors import InputError
from mrdamper.rig_files import tests_table
from mrdamper.rig_files.column_names import units_in
from mrdamper.rig_files.preview import guess_profile
from mrdamper.rig_files.profile import parse_profile, profile_text
from mrdamper.rig_files.profile_template import profile_template
from mrdamper.rig_files.readers.arrays import unit_in
from mrdamper.rig_files.rig_import import found_tests, import_files, read_run, read_runs

T = np.arange(0.0, 3.0, 0.01)
V = np.cos(2 * np.pi * T)
X = 10 * np.sin(2 * np.pi * T)  # [mm]


def force(amperes: float, seed: int = 0) -> np.ndarray:
    """Force [N] of a damper at a current."""
    return (200 + 500 * amperes) * np.tanh(6 * V) + 100 * V + np.random.default_rng(seed).normal(0, 2, T.size)


def rows(*columns: np.ndarray, separator: str = ",") -> str:
    return "".join(separator.join(f"{v:.5f}" for v in row) + "\n" for row in zip(*columns, strict=True))


def currents(records) -> list[float]:
    return sorted(round(float(np.mean(record.current)), 3) for record in records)


def test_codes_in_names_are_read_by_a_legend_beside_the_files(tmp_path):
    for code, amperes in (("I1", 0.0), ("I2", 0.6)):
        (tmp_path / f"MRD_{code}_F1.csv").write_text("time (s),disp (mm),force (N)\n" + rows(T, X, force(amperes)))
    (tmp_path / "legend.txt").write_text("Names of files\nI1 = 0 A\nI2 = 0.6 A\nF1 = 1 Hz\n")
    assert currents(import_files([tmp_path]).records) == [0.0, 0.6]


DUTIES = "| duty | current |\n|---|---|\n| 0 % | 0 A |\n| 50 % | 1.1 A |"


@pytest.mark.parametrize(
    ("names", "text", "stated"),
    [
        (["K7_I00", "K7_I05", "K7_I15"], "I05 = 0.5 A, I15 = 1.5 A (tenths of ampere)\nF10 = 1.0 Hz", [0.0, 0.5, 1.5]),
        (["K7_I05", "K7_I10", "K7_I15"], "I05 = 0.5 A, I15 = 1.5 A", []),
        (["G3_cur0.0", "G3_cur0.8"], "G3 is the damper.\ncur0.8 = coil current 0.8 A, f2 = 2 Hz.", [0.0, 0.8]),
        (["G3_cur0.0", "G3_cur0.8"], "cur0.8 = supply 0.8 A", []),
        (["m_A5_I0,00", "m_A5_I1,20"], "Dateinamen: m_A<Amplitude in mm>_I<Spulenstrom in A>.csv", [0.0, 1.2]),
        (["m_000", "m_500"], "names: m_<coil current [mA]>", [0.0, 0.5]),
        (["m_0", "m_2"], "names: m_<current>", []),
        *(
            (["m_c00", "m_c05"], f"m_cCC.csv\n`cCC`: coil current {meaning}", stated)
            for meaning, stated in (
                ("in tenths of an ampere (c05 = 0.5 A)", [0.0, 0.5]), ("x 0.1 A", [0.0, 0.5]),
                ("2 in A", []), ("max 2 A", []),
                ("in tenths of an ampere (e.g. c05 is 0.5 A)", [0.0, 0.5]),
                ("in tenths of an ampere, i.e. 05 = 0.5 A", [0.0, 0.5]),
            )
        ),
        (["m_0000_1", "m_0500_2"], "File names: m_iiii_f.csv\n  iiii  coil current in mA\n  f  frequency", [0.0, 0.5]),
        (["m_0000_1", "m_0500_2"], "File names: m_iiii_f.csv\n  iiii  number\n  f  coil current", []),
        (["0_2", "0.5_2"], "A name is *current_frequency* with current in A, frequency in Hz", [0.0, 0.5]),
        (["0_2", "0.5_2"], "A name is *current_frequency* with frequency in Hz", []),
        (["m_d00", "m_d50"], f"Names: m_d<duty %>.csv.\n\n{DUTIES}", [0.0, 1.1]),
        (["m_d00", "m_d75"], f"Names: m_d<duty %>.csv.\n\n{DUTIES}", []),
    ],
)  # fmt: skip
def test_a_readme_gives_the_codes_and_the_scheme_of_names(tmp_path, names, text, stated):
    for i, name in enumerate(names):
        (tmp_path / f"{name}.csv").write_text("Time [s],disp [mm],force [N]\n" + rows(T, X, force(i / 2, i)))
    (tmp_path / "README.Rmd").write_text(text + "\n")
    result = import_files([tmp_path])
    assert currents(result.records) == stated
    assert len(result.refusals) == (0 if stated else len(names))


def test_without_a_legend_codes_state_no_current(tmp_path):
    (tmp_path / "MRD_I2_F1.csv").write_text("time (s),disp (mm),force (N)\n" + rows(T, X, force(0.6)))
    assert [r.error.code for r in import_files([tmp_path]).refusals] == ["E_CURRENT_MISSING"]


def test_a_magnitude_has_the_sign_of_the_sense_beside_it(tmp_path):
    measured = force(0.5)
    text = "T = tension, C = compression\nCoil current: 0.5 A\n\nTime s,Displacement mm,Load N,Sense\n"
    text += "".join(
        f"{t:.4f},{x:.4f},{abs(f):.3f},{'CT'[int(f > 0)]}\n" for t, x, f in zip(T, X, measured, strict=True)
    )
    (tmp_path / "frame.csv").write_text(text)
    assert np.allclose(read_run(tmp_path / "frame.csv").force, measured, atol=1e-3)


@pytest.mark.parametrize("behind", ["{} [{}]", "{};{}", "{};[{}]"], ids=["one cell", "two cells", "brackets"])
def test_channels_in_rows_are_turned(behind, tmp_path):
    cells = [("Time", "s", T), ("Displacement", "mm", X), ("Force", "N", force(0.5))]
    cells = [(behind.format(name, unit), values) for name, unit, values in cells]
    text = "Test;7\nCoil current [A];0.5\n" + "".join(
        f"{n};" + ";".join(f"{v:.4f}" for v in c) + "\n" for n, c in cells
    )
    (tmp_path / "rows.csv").write_text(text)
    record = read_run(tmp_path / "rows.csv")
    assert record.time.size == T.size
    assert currents([record]) == [0.5]


def test_an_xml_file_beside_a_record_names_columns_rate_and_current(tmp_path):
    (tmp_path / "data.csv").write_text(rows(X, force(0.5) / 1e3))
    meta = """<test><samplingRate unit="Hz">100</samplingRate><coilCurrent unit="A">0.5</coilCurrent>
    <channel column="2" name="Force" unit="kN"/><channel column="1" name="Displacement" unit="mm"/></test>"""
    (tmp_path / "meta.xml").write_text(meta)
    (record,) = import_files([tmp_path]).records
    assert np.ptp(record.displacement) == pytest.approx(0.020, rel=1e-3)
    assert record.time[-1] == pytest.approx(T[-1])
    (tmp_path / "meta.xml").write_text('<!DOCTYPE t [<!ENTITY a "b">]>' + meta)
    assert import_files([tmp_path]).records == ()


def test_numbered_keys_state_names_units_scales_and_the_step(tmp_path):
    head = "DELTA_T=5.0E-03\nDESC.CHAN_1=Actuator displacement\nUNITS.CHAN_1=mm\nSCALE.CHAN_1=1.25E-03\n"
    head += (
        "DESC.CHAN_2=Damper force\nUNITS.CHAN_2=N\nSCALE.CHAN_2=9.0E-02\nDESCRIPTION=sine, coil current 0.5 A\nDATA\n"
    )
    counts = zip(np.round(X / 1.25e-3).astype(int), np.round(force(0.5) / 9e-2).astype(int), strict=True)
    (tmp_path / "road.txt").write_text(head + "".join(f"{a}\t{b}\n" for a, b in counts))
    record = read_run(tmp_path / "road.txt")
    assert np.ptp(record.displacement) == pytest.approx(0.020, rel=1e-3)
    assert currents([record]) == [0.5]


def test_curves_of_a_figure_are_channels_by_the_titles_of_their_axes(tmp_path):
    axes = {"xaxis": "Time [s]", "yaxis": "Stroke [mm]", "xaxis2": "Time [s]", "yaxis2": "Force [N]"}
    data = [
        {"name": f"{a} A", "x": T.tolist(), "y": y.tolist(), "xaxis": f"x{n}", "yaxis": f"y{n}"}
        for a in (0.2, 0.9)
        for n, y in (("", X), ("2", force(a)))
    ]
    layout = {axis: {"title": {"text": title}} for axis, title in axes.items()}
    (tmp_path / "fig.json").write_text(json.dumps({"data": data, "layout": layout}))
    records = import_files([tmp_path]).records
    assert currents(records) == [0.2, 0.9]
    np.testing.assert_allclose(records[1].force, force(0.9), rtol=0, atol=1e-9)


def test_points_of_time_and_value_are_channels(tmp_path):
    tests = [
        {
            "setpoints": {"coilCurrent": {"value": 1e3 * amperes, "unit": "mA"}},
            "series": [
                {
                    "channel": name,
                    "unit": unit,
                    "timeUnit": "ms",
                    "points": [list(p) for p in zip(1e3 * T, c, strict=True)],
                }
                for name, unit, c in (("piston.position", "mm", X), ("rod.force", "N", force(amperes)))
            ],
        }
        for amperes in (0.0, 0.6)
    ]
    (tmp_path / "export.json").write_text(json.dumps({"tests": tests}))
    assert currents(read_runs(tmp_path / "export.json")) == [0.0, 0.6]


def test_a_cell_of_matrices_takes_its_numbers_from_the_vectors_beside_it(tmp_path):
    savemat = pytest.importorskip("scipy.io").savemat
    data = np.empty((2, 1), object)
    data[0, 0], data[1, 0] = (np.column_stack([T, X, force(amperes)]) for amperes in (0.0, 0.5))
    names = np.array(["t [s]", "s [mm]", "F [N]"], object)
    savemat(tmp_path / "m.mat", {"data": data, "columns": names, "I_coil_A": np.array([[0.0], [0.5]])})
    tests = read_runs(tmp_path / "m.mat")
    assert currents(tests) == [0.0, 0.5]
    assert np.ptp(tests[1].force) > np.ptp(tests[0].force)


@pytest.mark.parametrize("order", [1, -1], ids=["current first", "frequency first"])
def test_arrays_over_two_conditions_take_a_number_of_each_from_the_vectors_beside_them(order, tmp_path):
    savemat, conditions = pytest.importorskip("scipy.io").savemat, {"I_vec_A": [0.0, 0.3, 0.6], "f_vec_Hz": [1, 2]}
    loops = [[np.column_stack([T, X, force(i)])[: T.size // f] for f in (1, 2)] for i in conditions["I_vec_A"]]
    cells = {name: np.empty((3, 2), object) for name in ("t_s", "x_mm", "F_N")}
    for at in np.ndindex(3, 2):
        for column, of in enumerate(cells.values()):
            of[at] = loops[at[0]][at[1]][:, [column]]
    savemat(tmp_path / "cells.mat", conditions | {name: of.T if order < 0 else of for name, of in cells.items()})
    padded = np.full((3, 2, T.size, 3), np.nan)
    for at in np.ndindex(3, 2):
        padded[at][: len(loops[at[0]][at[1]])] = loops[at[0]][at[1]]
    padded = padded.swapaxes(0, 1) if order < 0 else padded
    columns = np.array(["time_s", "disp_mm", "force_N"])
    np.savez(tmp_path / "grid.npz", data=padded, currents_A=[0.0, 0.3, 0.6], freqs_Hz=[1, 2], columns=columns)
    np.savez(tmp_path / "first.npz", data=np.moveaxis(padded, -1, 0), current_A=[0.0, 0.3, 0.6], columns=columns)
    for name in ("cells.mat", "grid.npz"):
        tests = read_runs(tmp_path / name)
        assert sorted((round(t.current[0], 2), t.time.size) for t in tests) == [
            (i, T.size // f) for i in (0.0, 0.3, 0.6) for f in (2, 1)
        ]
        assert all(np.ptp(t.force) == pytest.approx(2 * (300 + 500 * t.current[0]), rel=0.02) for t in tests)
    two = np.moveaxis(np.array([loops[0][0], loops[2][0]]), -1, 0)
    np.savez(tmp_path / "two.npz", data=two, current_A=[0.0, 0.6], columns=columns)
    assert currents(read_runs(tmp_path / "two.npz")) == [0.0, 0.6]
    tests = read_runs(tmp_path / "first.npz")  # three currents, three channels: the time increases along the latter
    assert currents(tests) == [0.0, 0.0, 0.3, 0.3, 0.6, 0.6]


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)])
def test_as_many_tests_as_channels_are_told_apart_by_their_time_and_refused_without_it(order, tmp_path):
    cube = np.array([np.column_stack([T, X, force(amperes)]) for amperes in (0.0, 0.3, 0.6)]).transpose(order)
    for names in (["t [s]", "x [mm]", "F [N]"], ["x [mm]", "F [N]", "v [mm/s]"]):
        np.savez(tmp_path / f"{names[0][0]}.npz", data=cube, names=np.array(names), currents_A=[0.0, 0.3, 0.6])
    tests = read_runs(tmp_path / "t.npz")
    assert [(t.current[0], t.time.size) for t in tests] == [(0.0, T.size), (0.3, T.size), (0.6, T.size)]
    with pytest.raises(InputError, match=r"x.npz: .* two dimensions of an array .* save each test"):
        read_runs(tmp_path / "x.npz")


@pytest.mark.parametrize("units", [[{"name": "force", "unit": "N"}], [["force", "N"]]])
def test_units_in_lists_beside_named_columns_are_no_damage(units, tmp_path):
    columns = {"time_s": [*T], "disp_mm": [*X], "force_N": [*force(0.6)], "current_A": 0.6}
    (tmp_path / "a.json").write_text(json.dumps({**columns, "units": units}))
    np.testing.assert_allclose(read_run(tmp_path / "a.json").force, force(0.6))


def test_structs_with_a_matrix_and_its_conditions_are_tests_and_no_channels(tmp_path):
    savemat = pytest.importorskip("scipy.io").savemat
    tests = np.zeros((1, 2), dtype=[("Name", "O"), ("I_A", "O"), ("data", "O")])
    for k, amperes in enumerate((0.0, 0.6)):
        tests[0, k] = f"exp_{k}", amperes, np.column_stack([T, X, force(amperes)])
    savemat(tmp_path / "m.mat", {"experiment": tests, "columns": np.array(["t (s)", "x (mm)", "F (N)"], object)})
    assert currents(read_runs(tmp_path / "m.mat")) == [0.0, 0.6]


def test_counts_are_scaled_by_the_formula_that_a_text_states_and_refused_without_it(tmp_path):
    h5py = pytest.importorskip("h5py")
    for name, says in (("stated", "physical = raw * gain + offset"), ("open", "see the manual")):
        with h5py.File(tmp_path / f"{name}.h5", "w") as file:
            file.attrs["coil_current_A"], file.attrs["sample_rate_Hz"] = 0.5, 200.0
            for channel, values, unit, gain in (("displacement", X, "mm", 5e-4), ("force", force(0.5), "N", 0.125)):
                counts = file.create_dataset(channel, data=np.round((values - 0.5) / gain).astype("<i4"))
                counts.attrs.update({"unit": unit, "gain": gain, "offset": 0.5, "conversion": says})
    assert np.ptp(read_run(tmp_path / "stated.h5").displacement) == pytest.approx(0.020, rel=1e-3)
    assert [r.error.code for r in import_files([tmp_path / "open.h5"]).refusals] == ["E_AMBIGUOUS"] * 2


@pytest.mark.parametrize("names", [("2D_force", "VBOX_pos"), ("logger1_F", "logger2_x")])
def test_channels_of_two_loggers_of_other_form_are_joined(tmp_path, names):
    for i in (1, 2):
        head = f"# coil {i / 2} A\nTIME[s];LOADCELL[N]\n"
        (tmp_path / f"T{i:02d}_{names[0]}.csv").write_text(head + rows(T, force(i / 2, i), separator=";"))
        (tmp_path / f"T{i:02d}_{names[1]}.csv").write_text("Time (s),Position (mm)\n" + rows(T[::2], X[::2]))
    channels = {"displacement": ("Position (mm)", names[1], "mm"), "force": ("LOADCELL[N]", names[0], "N")}
    lines = ['[file]\nseparator = ";"\ndecimal = "."', '[channels.time]\ncolumn = "TIME[s]"\nunit = "s"']
    for role, (column, name, unit) in channels.items():
        lines += [f'[channels.{role}]\ncolumn = "{column}"\nunit = "{unit}"\nfile = "T{{run}}_{name}.csv"']
    for profile in [None] * ("2D" in names[0]) + [parse_profile("\n".join(lines))]:
        result = import_files([tmp_path], profile)
        assert not result.refusals
        assert currents(result.records) == [0.5, 1.0]


def test_rows_of_a_netcdf_table_are_tests(tmp_path):
    netcdf_file = pytest.importorskip("scipy.io").netcdf_file
    with netcdf_file(tmp_path / "t.nc", "w") as file:
        file.createDimension("test", 2), file.createDimension("time", T.size)
        for name, unit, shape, values in (
            ("time", "s", ("time",), T),
            ("coil_current", "A", ("test",), np.array([0.0, 0.5])),
            ("displacement", "mm", ("test", "time"), np.stack([X, X])),
            ("force", "N", ("test", "time"), np.stack([force(0.0), force(0.5)])),
        ):
            variable = file.createVariable(name, "d", shape)
            variable[:], variable.units = values, unit
    assert currents(read_runs(tmp_path / "t.nc")) == [0.0, 0.5]


def test_a_profile_joins_files_of_one_channel_each_and_refuses_a_file_without_its_other(tmp_path):
    for run, amperes in (("01", 0.0), ("02", 0.5)):
        (tmp_path / f"C1--{run}.csv").write_text("Time,Ampl\n" + rows(T, X / 2.5))
        (tmp_path / f"C2--{run}.csv").write_text("Time,Ampl\n" + rows(T, force(amperes) / 50))
    (tmp_path / "readme.txt").write_text("trace  coil current\n01  0.0 A\n02  0.5 A\n")
    profile = parse_profile(
        '[channels.time]\ncolumn = 1\nunit = "s"\n'
        '[channels.displacement]\nfile = "C1--{run}.csv"\ncolumn = 2\nunit = "mm"\nscale = 2.5\n'
        '[channels.force]\nfile = "C2--{run}.csv"\ncolumn = 2\nunit = "N"\nscale = 50\n'
    )
    imported = import_files([tmp_path], profile)
    assert [record.id for record in imported.records] == ["01", "02"]
    assert currents(imported.records) == [0.0, 0.5]
    (tmp_path / "C2--02.csv").unlink()
    assert {r.error.code for r in import_files([tmp_path], profile).refusals} >= {"E_COLUMN"}


def test_a_profile_integrates_a_velocity(tmp_path):
    text = "# Coil current: 0.5 A\nTime (s),Velocity (mm/s),Force (N)\n" + rows(T, 20 * np.pi * V, force(0.5))
    (tmp_path / "lvt.csv").write_text(text)
    profile = parse_profile('[channels.displacement]\ncolumn = "Velocity (mm/s)"\nunit = "mm/s"\nintegrate = true\n')
    assert np.ptp(read_run(tmp_path / "lvt.csv", profile).displacement) == pytest.approx(0.020, rel=2e-3)


@pytest.mark.parametrize(
    ("heading", "factor", "code"),
    [
        ("Amplitude: 10 mm", 1 / 5, "W_NAME"), ("Amplitude: 10 mm", 1.0, ""), ("Stroke: 20 mm", 1.0, ""),
        ("Amplitude: 10 mm", 10, "E_MOTION_CONTRADICTS"), ("target amplitude: 10 mm, 1 Hz", 10, "E_MOTION_CONTRADICTS"),
        ("Stroke: 20 mm", 25.4, "E_MOTION_CONTRADICTS"),
        ("Stroke: 100 mm", 1.0, "W_NAME"), ("Length 254 mm", 1.0, ""),
    ],
)  # fmt: skip
def test_a_heading_of_another_amplitude_is_reported_and_refused_at_the_factor_of_a_unit(
    tmp_path, heading, factor, code
):
    head = f"{heading}\nCurrent: 0.5 A\nTime (s),Displacement (mm),Force (N)\n"
    (tmp_path / "a.csv").write_text(head + rows(T, factor * X, force(0.5)))
    result = import_files([tmp_path])
    codes = [r.error.code for r in result.refusals] or [f.code for r in result.records for f in r.findings]
    assert [c for c in codes if c in ("W_NAME", "E_MOTION_CONTRADICTS")] == [code] * bool(code)


def test_a_frequency_with_a_decimal_comma_in_a_heading_is_compared(tmp_path):
    channels = {"time [s]": T.tolist(), "displacement [mm]": X.tolist()}
    titles = {"I = 0,5 A, f = 2,5 Hz": 0.5, "I = 1,5 A": 1.5}
    tests = {title: {**channels, "force [N]": force(amperes).tolist()} for title, amperes in titles.items()}
    (tmp_path / "a.json").write_text(json.dumps(tests))
    first = import_files([tmp_path]).records[0]
    assert first.id == "a_I_=_0.5_A_f_=_2.5_Hz"
    assert ["states 2.5 Hz and the record has" in f.text for f in first.findings if f.code == "W_NAME"] == [True]


@pytest.mark.parametrize(("others", "codes"), [(10, {"W_NAME"}), (12, set())])
def test_an_amplitude_that_only_one_test_of_a_frequency_does_not_reach_is_reported(tmp_path, others, codes):
    for i, stated in enumerate((others, others, others, 15)):
        head = f"Amplitude: {stated} mm\nTime (s),Displacement (mm),Force (N)\n"
        (tmp_path / f"t{i}_{i / 2}A.csv").write_text(head + rows(T, X, force(i / 2)))
    found = [{f.code for f in record.findings} & {"W_NAME"} for record in import_files([tmp_path]).records]
    assert found == [set(), set(), set(), codes]


@pytest.mark.parametrize("stated", [10, 20])
def test_half_the_length_of_a_name_is_reported_where_the_other_names_state_amplitudes(tmp_path, stated):
    head = "Time (s),Displacement (mm),Force (N)\n"
    for k in range(4):
        (tmp_path / f"{stated}mm_0.{k}A.csv").write_text(head + rows(T, X, force(0.1 * k, k)))
    (tmp_path / "20mm_0.5A.csv").write_text(head + rows(T, X, force(0.5, 5)))
    found = {r.id: [f.code for f in r.findings] for r in import_files([tmp_path]).records}
    assert ["W_NAME" in codes for codes in found.values()] == [stated == 10 and run == "20mm_0.5A" for run in found]


def test_channels_in_volts_are_refused_with_the_scale_that_is_missing(tmp_path):
    head = "Vertical Units,V,V,\nLabel,LVDT,Load cell,\n\nTIME,CH1,CH2\n"
    (tmp_path / "tek_0.5A.csv").write_text(head + rows(T, X / 2, force(0.5) / 200))
    (refusal,) = {str(r.error) for r in import_files([tmp_path]).refusals if "force" in str(r.error)}
    assert "CH1, CH2 in volts or counts without a scale" in refusal
    assert "unit and scale (unit per V of its column)" in refusal


def test_a_channel_in_counts_is_asked_for_with_all_that_it_needs_at_once(tmp_path):
    (tmp_path / "a_0.5A.csv").write_text("t_ms,encoder_counts,force_N\n" + rows(1000 * T, np.round(40 * X), force(0.5)))
    (refusal,) = import_files([tmp_path]).refusals
    assert "encoder_counts in volts or counts without a scale" in str(refusal.error)
    assert 'set [channels.displacement] column = "...", unit and scale (unit per counts of its column)' in str(
        refusal.error
    )
    answer = '[channels.displacement]\ncolumn = "encoder_counts"\nunit = "mm"\nscale = 0.025'
    assert currents(import_files([tmp_path], parse_profile(answer)).records) == [0.5]


def motion(frequency: float, amperes: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Displacement [mm] and force [N] of four strokes or more."""
    v = np.cos(2 * np.pi * frequency * T)
    noise = np.random.default_rng(seed).normal(0, 2, T.size)
    return 10 * np.sin(2 * np.pi * frequency * T), (200 + 500 * amperes) * np.tanh(6 * v) + 100 * v + noise


STEPS = [(1.0, 0.0), (1.0, 0.5), (2.0, 0.0), (2.0, 0.5)]  # frequency [Hz], current [A]


def test_a_column_that_numbers_the_tests_is_joined_with_the_plan_by_its_key(tmp_path):
    text = "Time (s),Step,Disp (mm),Force (N)\n"
    for number, (frequency, amperes) in enumerate(STEPS, 1):
        x, f = motion(frequency, amperes, number)
        text += rows(T + 30 * number, np.full(T.size, number), x, f)
    (tmp_path / "record_1.csv").write_text(text)
    plan = "Step,Frequency (Hz),Coil Current (A)\n" + "".join(f"{n},{f},{i}\n" for n, (f, i) in enumerate(STEPS, 1))
    (tmp_path / "method.csv").write_text(plan)
    assert currents(import_files([tmp_path]).records) == [0.0, 0.0, 0.5, 0.5]
    (tmp_path / "record_1.csv").write_text("time (s),disp (mm),force (N)\n" + rows(T, X, force(0.5)))
    result = import_files(
        [tmp_path]
    )  # rows of several currents are no one value, whatever number the file's name ends in
    assert not result.records
    assert "E_CURRENT_MISSING" in {r.error.code for r in result.refusals}


@pytest.mark.parametrize("keys", [("test_id", "id"), ("exp_key", "exp_key"), ("Step", "Step")])
def test_a_table_with_a_row_for_each_test_is_no_logger_though_it_has_the_start_of_each(tmp_path, keys):
    samples, tests = f"{keys[0]},ts,disp_mm,force_N\n", f"{keys[1]},started_at,current_mA\n"
    for number, (frequency, amperes) in enumerate(STEPS, 11):
        x, f = motion(frequency, amperes, number)
        stamps = [f"2025-03-04 10:{number}:{t:06.3f}" for t in T]
        cells = zip(stamps, rows(x, f).splitlines(), strict=True)
        samples += "".join(f"{number},{stamp},{row}\n" for stamp, row in cells)
        tests += f"{number},{stamps[0]},{1e3 * amperes:g}\n"
    (tmp_path / "samples.csv").write_text(samples)
    (tmp_path / "tests_done.csv").write_text(tests)
    assert by_id(import_files([tmp_path])) == {f"samples_{n}": i for n, (_, i) in enumerate(STEPS, 11)}


@pytest.mark.parametrize("shared", [(), ("x",)])
def test_variables_at_each_current_have_the_unit_that_a_text_gives_their_letter(tmp_path, shared):
    tree = {"t": T, "info": "time t in s, displacement x in m, force F in N"} | ({"x": X / 1e3} if shared else {})
    for n, amperes in enumerate((0.0, 0.5, 1.5)):
        tag = f"{amperes:.1f}A".replace(".", "p")
        tree |= {f"F_{tag}": force(amperes, n)} | ({} if shared else {f"x_{tag}": X / 1e3 + 1e-4 * n})
    scipy.io.savemat(tmp_path / "sine.mat", tree)
    result = import_files([tmp_path])
    assert not result.refusals
    assert currents(result.records) == [0.0, 0.5, 1.5]


@pytest.mark.parametrize(("between", "joined"), [(0.0, True), (1.0, False)])
def test_rests_between_the_numbered_tests_have_no_row_in_a_plan_and_motions_without_one_are_not_joined(
    tmp_path, between, joined
):
    text = "Time (s),Step,Disp (mm),Force (N)\n"
    for number, (frequency, amperes) in enumerate(STEPS):
        x, f = motion(frequency, amperes, number)
        text += rows(T + 60 * number, np.full(T.size, 2 * number + 1), x, f)
        text += rows(T + 60 * number + 30, np.full(T.size, 2 * number + 2), between * x, between * f)
    (tmp_path / "record.csv").write_text(text)
    plan = "Step  Current/A  Freq/Hz\n" + "".join(f"{2 * n + 1}  {i}  {f}\n" for n, (f, i) in enumerate(STEPS))
    (tmp_path / "README.txt").write_text(f"Odd steps are tests.\n\n{plan}")
    result = import_files([tmp_path])
    assert currents(result.records) == ([0.0, 0.0, 0.5, 0.5] if joined else [])
    assert ("E_CURRENT_MISSING" in {refusal.error.code for refusal in result.refusals}) is not joined


@pytest.mark.parametrize("gap", [0.0, 9.0])
def test_parts_of_a_record_without_the_heading_of_the_first_go_on_by_their_clock(tmp_path, gap):
    for part, inside in enumerate((slice(0, 150), slice(150, 230), slice(230, None)), 1):
        head = "Tempo (s),Deslocamento (mm),Força (N)\n" if part == 1 else ""
        table = rows(T[inside] + gap * part, X[inside], force(0.5)[inside])
        (tmp_path / f"E_0.5A_parte{part}.txt").write_text(head + table, encoding="utf-8")
    result = import_files([tmp_path])
    assert [(r.id, r.time.size) for r in result.records] == ([("E_0.5A_parte1", 150)] if gap else [("E_0.5A", T.size)])
    assert currents(result.records) == [0.5]
    assert [refusal.error.code for refusal in result.refusals] == ["E_UNITS_MISSING"] * (2 if gap else 0)


@pytest.mark.parametrize("damaged", [2, 3])
def test_parts_before_one_that_cannot_be_used_are_no_test(tmp_path, damaged):
    for part, inside in enumerate((slice(0, 150), slice(150, 230), slice(230, None)), 1):
        table = rows(T[inside], X[inside], force(0.5)[inside])
        table = table[:-1] + "x\n" if part == damaged else table
        (tmp_path / f"a_0.5A_part{part}.csv").write_text("Time (s),Displacement (mm),Force (N)\n" + table)
    refused = {refusal.file[-9:]: refusal.error for refusal in import_files([tmp_path]).refusals}
    assert [*refused] == [f"part{part}.csv" for part in range(1, damaged + 1)]
    before = [error.found for error in refused.values()][:-1]
    assert all(f"goes on in a_0.5A_part{damaged}.csv, which cannot be used" in found for found in before)


@pytest.mark.parametrize(("numbers", "reasons"), [((0, 1, 2), {"bag_0": "it rests"}), ((0, 1, 0, 2), {})])
def test_the_rest_that_a_column_of_tests_numbers_zero_is_omitted_beside_them(tmp_path, numbers, reasons):
    text, noise = (
        "time (s),test_id,disp (mm),force (N),current (A)\n",
        1e-4 * np.random.default_rng(0).normal(size=T.size),
    )
    for part, number in enumerate(numbers):
        x, f = (X, force(0.5 * number)) if number else (noise, 60 + noise)
        text += rows(T + 4.0 * part, np.full(T.size, number), x, f, np.full(T.size, 0.5 * number))
    (tmp_path / "bag.csv").write_text(text)
    result = import_files([tmp_path])
    assert (result.refusals, currents(result.records), result.reasons) == ((), [0.5, 1.0], reasons)


def test_a_session_is_cut_at_rests_at_steps_of_the_current_and_where_the_logger_was_off(tmp_path):
    x, f, i = [], [], []
    for number, frequency in enumerate((1.0, 2.0)):
        for amperes in (0.0, 0.5):
            moved, force_of = motion(frequency, amperes, number)
            x, f, i = [*x, moved], [*f, force_of], [*i, np.full(T.size, amperes)]
        x, f, i = [*x, np.zeros(400)], [*f, np.zeros(400)], [*i, np.zeros(400)]
    x, f, i = (np.concatenate(channel) for channel in (x, f, i))
    path = tmp_path / "session.csv"
    path.write_text("time (s),disp (mm),force (N),current (A)\n" + rows(0.005 * np.arange(x.size), x, f, i))
    assert currents(read_runs(path)) == [0.0, 0.0, 0.5, 0.5]
    text = "time (s),disp (mm),force (N),current (A)\n"
    for number, (frequency, amperes) in enumerate(STEPS):
        text += rows(T + 60 * number, *motion(frequency, amperes, number), np.full(T.size, amperes))
    path.write_text(text)
    assert currents(read_runs(path)) == [0.0, 0.0, 0.5, 0.5]


def test_a_sheet_of_the_plan_states_the_rate_and_a_sheet_of_quantities_the_share_of_a_current(tmp_path):
    book = pytest.importorskip("openpyxl").Workbook()
    for row in (["Test series"], ["Sampling rate:", 100, "Hz"], [], ["TN số", "Dòng điện (A)"], [1, 0], [2, 0.5]):
        book.active.append(row)
    sheet = book.create_sheet("Data")
    sheet.append(["TN số", "Mẫu số", "Chuyển vị (mm)", "Lực (N)"])
    for number, amperes in ((1, 0.0), (2, 0.5)):
        for i, (x, f) in enumerate(zip(X, force(amperes), strict=True), 1):
            sheet.append([number, i, round(x, 5), round(f, 4)])
    (tmp_path / "a").mkdir()
    book.save(tmp_path / "a/tests.xlsx")
    tests = import_files([tmp_path / "a"]).records
    assert (currents(tests), [round(t.time[-1], 3) for t in tests]) == ([0.0, 0.5], [round(T[-1], 3)] * 2)
    book = pytest.importorskip("openpyxl").Workbook()
    for row in (
        ["Report"],
        ["Date", "9 June"],
        [],
        ["Bestromung [%]", 25],
        ["Endstufe", "100 % = 1,6 A"],
        ["f [Hz]", 1],
    ):
        book.active.append(row)
    sheet = book.create_sheet("Data")
    for row in (["Zeit", "Weg", "Kraft"], ["s", "mm", "N"], *zip(T, X, force(0.4), strict=True)):
        sheet.append([*row])
    (tmp_path / "b").mkdir()
    book.save(tmp_path / "b/test.xlsx")
    assert currents(import_files([tmp_path / "b"]).records) == [0.4]


def test_a_channel_a_file_in_the_folder_of_its_test_may_have_decimal_commas(tmp_path):
    for n, amperes in enumerate((0.0, 0.5), 1):
        folder = tmp_path / f"Опыт_{n:02d}"
        folder.mkdir()
        for name, unit, values in (("Сила", "кН", force(amperes) / 1e3), ("Перемещение", "мм", X)):
            head = f"ZETLAB\nКанал: {name}\nЕдиница измерения: {unit}\nЧастота дискретизации, Гц: 200\n"
            head += f"Начало записи: 14.05.2023 11:2{n}:31,000\nЧисло отсчётов: {T.size}\n\n"
            (folder / f"{name}.txt").write_text(head + "".join(f"{v:.5f}\n".replace(".", ",") for v in values))
    (tmp_path / "журнал.csv").write_text("№ опыта;Ток, А\n1;0,0\n2;0,5\n")
    (tmp_path / "說明.txt").write_text("時間: 秒, 位移: 公分, 出力: 公噸\n")
    result = import_files([tmp_path])
    assert not [str(r.error) for r in result.refusals]
    assert currents(result.records) == [0.0, 0.5]
    np.testing.assert_allclose(result.records[1].force, force(0.5), rtol=0, atol=0.01)


def test_a_shorter_test_beside_others_with_a_clock_a_channel_has_no_sample_more(tmp_path):
    pytest.importorskip("nptdms")
    tests = {"Stroke_01": X, "Load_01": force(0.5), "Stroke_02": X[:-100], "Load_02": 1.2 * force(0.5)[:-100]}
    units = {name: "mm" if "Stroke" in name else "N" for name in tests}
    (tmp_path / "series_0.5A.tdms").write_bytes(tdms_bytes(tests, units, wave=True))
    tests = import_files([tmp_path], parse_profile('[file]\nblocks = "split"\n')).records
    assert [record.time.size for record in tests] == [T.size, T.size - 100]


@pytest.mark.parametrize("late", [False, True], ids=["a mark a test", "a mark before its test begins"])
def test_marks_among_the_rows_of_a_session_state_the_currents_where_each_test_has_one(tmp_path, late):
    x, f, marks = [], [], []
    for number, amperes in enumerate((0.0, 0.25, 0.5)):
        moved, force_of = motion(1.0 + number, amperes, number)
        own = [""] * (T.size + 400)
        own[-350 if late else 60] = f"{amperes + 0.25 * late:.2f} A  {number + 1} Hz"
        x, f, marks = [*x, moved, np.zeros(400)], [*f, force_of, np.zeros(400)], [*marks, *own]
    marks = ["0.00 A  1 Hz" if late and not i else mark for i, mark in enumerate(marks)]
    t, x, f = 0.005 * np.arange(len(marks)), np.concatenate(x), np.concatenate(f)
    rows_of = (f"{a:.3f},{c:.3f},{b:.4f},{mark}\n" for a, b, c, mark in zip(t, x, f, marks, strict=True))
    (tmp_path / "session.csv").write_text("Time,Load,Stroke,Event Markers\nsec,N,mm,\n" + "".join(rows_of))
    result = import_files([tmp_path])
    assert currents(result.records) == ([] if late else [0.0, 0.25, 0.5])
    assert {r.error.code for r in result.refusals} == ({"E_CURRENT_MISSING"} if late else set())


def test_rows_of_a_cell_array_below_their_names_are_tests(tmp_path):
    from scipy.io import savemat

    cells = np.empty((3, 4), dtype=object)
    cells[0] = ["Current (A)", "Time (s)", "Displacement (mm)", "Force (N)"]
    for row, amperes in ((1, 0.0), (2, 0.6)):
        cells[row] = [[amperes, T, X, force(amperes)][i] for i in range(4)]
    savemat(tmp_path / "results.mat", {"results": cells})
    assert currents(read_runs(tmp_path / "results.mat")) == [0.0, 0.6]
    cells = cells[:, :2]
    cells[:, 1] = ["data: t [s], s [mm], F [N]", *(np.column_stack([T, X, force(i)]) for i in cells[1:, 0])]
    savemat(tmp_path / "results.mat", {"results": cells})
    assert currents(read_runs(tmp_path / "results.mat")) == [0.0, 0.6]


@pytest.mark.parametrize("kind", ["h5", "mat"])
@pytest.mark.parametrize(
    "places",
    [("clock/t_s", "rod/x_mm", "cell/F_N"), ("rig/time_s", "rig/x_mm", "cell/F_N"), ("t_s", "rig/x_mm", "a/b/F_N")],
)
def test_channels_of_several_groups_follow_the_only_time(places, kind, tmp_path):
    import h5py
    from scipy.io import savemat

    tree: dict = {}
    with h5py.File(tmp_path / "run_0.5A.h5", "w") as file:
        for place, values in zip(places, (T, X, force(0.5)), strict=True):
            *groups, name = place.split("/")
            node = tree
            for group in groups:
                node = node.setdefault(group, {})
            node[name] = file[place] = values
    savemat(tmp_path / "run_0.5A.mat", tree)
    record = read_run(tmp_path / f"run_0.5A.{kind}")
    np.testing.assert_allclose((record.time, 1e3 * record.displacement, record.force), (T, X, force(0.5)), atol=1e-9)


@pytest.mark.parametrize(
    ("cut", "amperes", "problem"),
    [
        (1, (0.5, 0.5), "E_FIELD_COUNT: columns differ in length (time [s]: {0}, "),
        (T.size - 9, (0.5, 0.5), "E_COLUMN: no column is known to be force"), (0, (0.0, 1.0), "E_COLUMN: no column"),
    ],
)  # fmt: skip
def test_groups_of_other_length_or_of_another_current_are_not_joined(cut, amperes, problem, tmp_path):
    import h5py

    with h5py.File(tmp_path / "tests.h5", "w") as file:
        file["run_01/time [s]"], file["run_01/displacement [mm]"] = T, X
        file["run_02/force [N]"] = force(1.0)[: T.size - cut]
        for name, current in zip(("run_01", "run_02"), amperes, strict=True):
            file[name].attrs["current_A"] = current
    (error,) = (refusal.error for refusal in import_files([tmp_path]).refusals)
    assert f"{error.code}: {error.found}".startswith(problem.format(T.size, T.size - cut))


@pytest.mark.parametrize("readme", ["D{i,j}: frequency f_Hz(i), coil current I_A(j)", "D{i,j} at f_Hz and I_A"])
def test_a_text_beside_cells_of_as_many_rows_as_columns_states_which_are_of_which_current(tmp_path, readme):
    import h5py

    def saved(file, name, values, kind="double"):
        item = file.create_dataset(name, data=values)
        item.attrs["MATLAB_class"] = np.bytes_(kind)
        return item

    with h5py.File(tmp_path / "grid.mat", "w", userblock_size=512) as file:
        rows = np.empty((2, 2), h5py.ref_dtype)
        for i, j in np.ndindex(2, 2):
            test = np.array([T / (1 + i), X, (1 + 0.1 * i) * force(j / 2)])
            rows[j, i] = saved(file, f"#refs#/r{i}{j}", test).ref
        saved(file, "D", rows, "cell")
        names = [
            saved(file, f"#refs#/n{n}", [[ord(c)] for c in name], "char").ref
            for n, name in enumerate(("time_s", "x_mm", "F_N"))
        ]
        saved(file, "columns", np.array([names], h5py.ref_dtype), "cell")
        saved(file, "f_Hz", [[1.0, 2.0]]), saved(file, "I_A", [[0.0], [0.5]])
        saved(file, "readme", [[ord(c)] for c in readme], "char")
    with (tmp_path / "grid.mat").open("r+b") as head:
        head.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    result = import_files([tmp_path])
    found = [(record.current[0], round(record.time[-1], 3)) for record in result.records]
    ends = [round(T[-1], 3), round(T[-1] / 2, 3)]
    assert found == ([(i, end) for end in ends for i in (0.0, 0.5)] if "(i)" in readme else [])
    assert {r.error.code for r in result.refusals} == (set() if "(i)" in readme else {"E_CURRENT_MISSING"})


@pytest.mark.parametrize("key", ["current_A", "Current"])
def test_structs_of_tests_by_current_and_frequency_are_tests(tmp_path, key):
    from scipy.io import savemat

    tests = np.empty((3, 2), object)
    for i, k in np.ndindex(3, 2):
        time = T / (1 + k)
        tests[i, k] = {"time_s": time, "displacement_mm": X, "force_N": (1 + k) * force(i / 2), key: i / 2}
        tests[i, k] |= {"CurrentUnit": "A"} if key == "Current" else {}
    savemat(tmp_path / "tests.mat", {"tests": tests})
    assert sorted(currents(import_files([tmp_path]).records)) == [0.0, 0.0, 0.5, 0.5, 1.0, 1.0]


@pytest.mark.parametrize(
    ("attributes", "unit"),
    [
        ({"units": "N", "unit": "Damper 7"}, "N"), ({"Unit": "UUT-3", "units": "kN"}, "kN"),
        ({"unit": "V", "units": "N"}, "V or N"), ({"unit": "N", "Einheit": "N"}, "N"),
    ],
)  # fmt: skip
def test_an_attribute_that_is_no_unit_is_passed_over_and_two_that_contradict_are_named(attributes, unit):
    assert unit_in(attributes) == unit


@pytest.mark.parametrize("line", ["2;Sinus", ";2", "2;;", "Nr. 2"])
def test_a_number_above_the_names_of_a_further_test_is_no_row_of_the_test_before(line, tmp_path):
    blocks = [
        f"Spulenstrom [A];{i / 2}\n{line}\nZeit [s];Weg [mm];Kraft [N]\n" + rows(T, X, force(i / 2), separator=";")
        for i in range(3)
    ]
    (tmp_path / "versuche.csv").write_text("".join(blocks))
    assert currents(import_files([tmp_path]).records) == [0.0, 0.5, 1.0]


def test_a_list_of_forces_beside_a_motion_is_no_channel_of_it(tmp_path):
    from scipy.io import savemat

    limits = {"rating": T[:3], "F_N": np.array([0.0, 500.0, 1000.0])}
    savemat(tmp_path / "run_0.5A.mat", {"rig": {"time_s": T, "x_mm": X, "ch3": X}, "cell": limits})
    with pytest.raises(InputError) as refusal:
        read_run(tmp_path / "run_0.5A.mat")
    assert "no column is known to be force" in str(refusal.value)


def test_channels_of_other_lengths_in_one_group_are_no_table_of_results(tmp_path):
    import h5py

    with h5py.File(tmp_path / "campaign.h5", "w") as file:
        file["force"], file["current"] = np.arange(400.0), np.arange(40.0)
        file["position"] = np.arange(200.0)
    assert {r.error.code for r in import_files([tmp_path]).refusals} >= {"E_COLUMN"}


@pytest.mark.parametrize(
    ("heading", "codes"),
    [
        ("Sample rate: 400 Hz\nFrequency: 4 Hz\n", ["E_AMBIGUOUS"]),
        ("Sample rate: 400 Hz\n", ["E_AMBIGUOUS"]),
        ("Sample rate: 400 Hz\nFrequency: 1 Hz\n", []),  # every fourth sample was exported
        ("Sample rate: 100 Hz\n", []),
    ],
)
def test_a_stated_rate_that_contradicts_the_time_column_is_refused(tmp_path, heading, codes):
    path = tmp_path / "run_0.5A.txt"
    path.write_text(heading + "Time [s],Stroke [mm],Force [N]\n" + rows(T, X, force(0.5)))
    assert [r.error.code for r in import_files([path]).refusals] == codes
    by_column = import_files([path], parse_profile('[channels.time]\ncolumn = "Time [s]"\n'))
    assert [r.error.code for r in by_column.refusals] == (codes if "4 Hz" in heading else [])
    by_rate = import_files([path], parse_profile("[file]\nsample_rate_Hz = 400\n"))
    assert [r.error.code for r in by_rate.refusals] == ["E_MOTION_CONTRADICTS"] * ("1 Hz" in heading)


def test_a_profile_that_answers_for_one_channel_leaves_the_others_to_physics(tmp_path):
    text = "time (s),pos (mm),Force 1 (N),Force 2 (N)\n" + rows(T, X, force(0.5), 1.2 * force(0.5, 1))
    (tmp_path / "run_0.5A.csv").write_text(text)
    stated = parse_profile('[channels.time]\ncolumn = "time (s)"\n')
    assert [r.error.code for r in import_files([tmp_path], stated).refusals] == ["E_AMBIGUOUS"]
    stated = parse_profile('[channels.time]\ncolumn = "time (s)"\n[channels.force]\ncolumn = "Force 2 (N)"\n')
    assert len(import_files([tmp_path], stated).records) == 1


def test_a_written_profile_does_not_leave_out_the_other_sheets(tmp_path):
    from openpyxl import Workbook

    book = Workbook()
    book.remove(book.active)
    for number, amperes in enumerate((0.0, 0.5)):
        sheet = book.create_sheet(f"{amperes} A")
        sheet.append(["time (s)", "disp (mm)", "force (N)"])
        for row in zip(T, X, force(amperes, number), strict=True):
            sheet.append([float(v) for v in row])
    book.save(tmp_path / "tests.xlsx")
    profile = guess_profile(tmp_path / "tests.xlsx")
    assert currents(import_files([tmp_path / "tests.xlsx"], profile).records) == [0.0, 0.5]


@pytest.mark.parametrize("form", ["numbers", "starts", "vectors"])
def test_tests_of_hdf5_of_other_lengths(tmp_path, form):
    h5py = pytest.importorskip("h5py")
    sizes, amperes = [T.size - 200, T.size], [0.3, 0.8]
    channels = {"time": ("s", [T, T]), "stroke": ("mm", [X, X]), "load": ("N", [force(a) for a in amperes])}
    with h5py.File(tmp_path / "t.h5", "w") as file:
        for name, (unit, values) in {**channels, "coil_current": ("A", [])}.items():
            own = [v[:n] for v, n in zip(values, sizes, strict=False)]
            if form == "vectors" and own:
                data = file.create_dataset(name, (2,), dtype=h5py.vlen_dtype("f8"))
                data[0], data[1] = own
            else:
                file[name] = np.concatenate(own) if own else np.array(amperes)
            file[name].attrs["units"] = unit
        if form != "vectors":
            file["of_test"] = np.array(sizes if form == "numbers" else [0, sizes[0]])
    records = import_files([tmp_path]).records
    assert currents(records) == amperes
    for record, a, n in zip(records, amperes, sizes, strict=True):
        np.testing.assert_allclose(record.force, force(a)[:n], rtol=0, atol=1e-9)


@pytest.mark.parametrize("form", ["rows behind each other", "lists in rows", "an object in a text"])
def test_tests_of_other_lengths_in_one_table_and_their_conditions(tmp_path, form):
    tests = {0.3: slice(0, T.size - 200), 0.8: slice(0, T.size)}
    if form == "rows behind each other":
        with pytest.importorskip("scipy.io").netcdf_file(tmp_path / "t.nc", "w") as file:
            file.createDimension("test", 2)
            file.createDimension("obs", 2 * T.size - 200)
            file.createVariable("row_size", "i4", ("test",))[:] = [T.size - 200, T.size]
            file.createVariable("coil_current", "f8", ("test",))[:] = list(tests)
            file.variables["coil_current"].units = "A"
            for name, unit, values in (("time", "s", T), ("stroke", "mm", X), ("load", "N", None)):
                own = [force(amperes)[part] if values is None else values[part] for amperes, part in tests.items()]
                file.createVariable(name, "f8", ("obs",))[:] = np.concatenate(own)
                file.variables[name].units = unit
    elif form == "lists in rows":
        rows = {"current_A": list(tests), "t_s": [T[p].tolist() for p in tests.values()]}
        rows |= {"stroke_mm": [X[p].tolist() for p in tests.values()]}
        rows |= {"load_N": [force(amperes)[p].tolist() for amperes, p in tests.items()]}
        pytest.importorskip("polars").DataFrame(rows).write_parquet(tmp_path / "t.parquet")
    else:
        for amperes, part in tests.items():
            says = {"columns": ["stroke", "load"], "units": ["mm", "N"], "coil": {"current": amperes, "unit": "A"}}
            y = np.c_[X, force(amperes)][part]
            np.savez(tmp_path / f"{amperes * 10:.0f}.npz", y=y, fs_Hz=200.0, meta=json.dumps(says))
    records = import_files([tmp_path]).records
    assert [float(np.mean(record.current)) for record in records] == pytest.approx(list(tests))
    for record, (amperes, part) in zip(records, tests.items(), strict=True):
        np.testing.assert_allclose(record.force, force(amperes)[part], rtol=0, atol=1e-9)
        np.testing.assert_allclose(record.displacement, 1e-3 * X[part], rtol=0, atol=1e-9)


def test_texts_that_hold_no_usable_object_are_texts(tmp_path):
    arrays = {"time_s": T, "disp_mm": X, "force_N": force(0.5)}
    for text in ("{broken", '{"a": 1' + "0" * 400 + "}", '{"a": [1, 2], "b": null}'):
        np.savez(tmp_path / "run_0.5A.npz", **arrays, units=np.array(text))
        assert currents(import_files([tmp_path]).records) == [0.5]


FOLDERS = (
    '[channels.displacement]\nfile = "{run}/wire.csv"\ncolumn = "position"\nunit = "mm"\n'
    '[channels.force]\nfile = "{run}/cell.csv"\ncolumn = "load"\nunit = "N"\n'
)


def test_a_profile_joins_files_of_one_name_in_a_folder_for_each_test(tmp_path):
    for amperes in (0.0, 0.5):
        folder = tmp_path / f"run {amperes} A"
        folder.mkdir()
        (folder / "wire.csv").write_text("time [s],number,position\n" + rows(T, np.arange(T.size), X))
        (folder / "cell.csv").write_text("time [s],load\n" + rows(T, force(amperes)))
    assert currents(import_files([tmp_path], parse_profile(FOLDERS)).records) == [0.0, 0.5]
    with pytest.raises(InputError, match="no file is called 'wire_"):
        import_files([tmp_path], parse_profile(FOLDERS.replace("{run}/wire", "wire_{run}")))


@pytest.mark.parametrize("mark", [";", "#"])
@pytest.mark.parametrize("rate", ["", "sample_rate_Hz = 100.0\n"])
def test_a_profile_joins_files_of_one_channel_each_by_the_rate_that_it_or_they_state(tmp_path, mark, rate):
    head = "" if rate else f"{mark} Sample rate: 100 Hz\n"
    for run in ("a", "b"):
        for name, values in (("ch1", X / 5), ("ch2", force(0.5))):
            text = f"{mark} Unit: V\n{head}{mark} Samples: {T.size}\n{rows(values)}"
            (tmp_path / f"{run}_{name}.asc").write_text(text)
    profile = (
        f"[file]\n{rate}[current]\nvalue = 0.5\n"
        '[channels.displacement]\ncolumn = 1\nunit = "mm"\nscale = 5.0\nfile = "{run}_ch1.asc"\n'
        '[channels.force]\ncolumn = 1\nunit = "N"\nscale = 1.0\nfile = "{run}_ch2.asc"\n'
    )
    found = import_files([tmp_path], parse_profile(profile))
    assert [record.id for record in found.records] == ["a"], [str(r.error) for r in found.refusals]  # b is a copy
    np.testing.assert_allclose(found.records[0].time, T, atol=1e-9)
    np.testing.assert_allclose(found.records[0].displacement, 1e-3 * X, atol=1e-6)


def test_a_file_of_a_profile_without_its_channel_or_a_time_is_refused_with_what_it_lacks(tmp_path):
    for folder in (tmp_path / "1", tmp_path / "2"):
        folder.mkdir()
        (folder / "wire.csv").write_text("clock,position\n" + rows(T, X))
        (folder / "cell.csv").write_text("time [s],load cell\n" + rows(T, force(0.5)))
    refusals = import_files([tmp_path], parse_profile(FOLDERS)).refusals
    assert {("channels.time" in r.error.remedy, "no column 'load'" in r.error.found) for r in refusals} == {
        (True, False),
        (False, True),
    }


@pytest.mark.parametrize("line", ["Stage {}: sine 1 Hz, coil at {} A", "stage {} = {} A", "* Stage {}) {} A, 10 mm",
                                  "Stage {}: sine 1 Hz, 8 cycles. Coil supply {} A"])  # fmt: skip
def test_a_text_that_lists_the_stages_of_a_record_gives_each_its_current(tmp_path, line):
    both = (np.r_[T, T + 9], np.r_[X, X], np.r_[force(0.2), force(0.8)], np.repeat([1, 2], T.size))
    (tmp_path / "night.csv").write_text("time [s],stroke [mm],load [N],Stage\n" + rows(*both))
    (tmp_path / "schedule.txt").write_text(
        "Schedule\n" + "".join(line.format(*of) + "\n" for of in ((1, 0.2), (2, 0.8)))
    )
    assert currents(import_files([tmp_path]).records) == [0.2, 0.8]


def test_a_text_that_a_profile_leaves_out_states_nothing(tmp_path):
    (tmp_path / "a.csv").write_text("time [s],stroke [mm],load [N]\n" + rows(T, X, force(0.5)))
    (tmp_path / "wrong.txt").write_text("Coil current: 0.9 A\n")
    assert currents(import_files([tmp_path]).records) == [0.9]
    profile = parse_profile('[file]\nleave_out = ["wrong*"]\n[current]\nvalue = 0.5')
    assert currents(import_files([tmp_path], profile).records) == [0.5]


def test_a_column_that_a_profile_leaves_out_is_not_read(tmp_path):
    """A current channel that was not connected: the remedy of the refusal names the way, and it works."""
    head = "time [s],stroke [mm],coil current [A],load [N]\n"
    (tmp_path / "a_0.5A.csv").write_text(head + rows(T, X, 0 * T + 0.012, force(0.5)))
    (refusal,) = import_files([tmp_path]).refusals
    line = 'leave_out = ["coil current [A]"]'
    assert f"[file] {line}" in str(refusal.error)
    for stated in (line, line.replace("[A]", "*")):
        (record,) = import_files([tmp_path], parse_profile(f"[file]\n{stated}")).records
        assert currents([record]) == [0.5]
        np.testing.assert_allclose(record.force, force(0.5), atol=0.01)
    written, _ = profile_template([tmp_path], parse_profile(""))
    answered = written.replace("#[current", "[current").replace('#"a_0.5A" =', '"a_0.5A" = 0.012')
    assert currents(import_files([tmp_path], parse_profile(answered)).records) == [0.012]
    assert "load [N]" in record.provenance["columns"]


def test_sentences_between_commas_are_no_heading(tmp_path):
    (tmp_path / "a_0.5A.csv").write_text("time [s],stroke [mm],load [N]\n" + rows(T, X, force(0.5)))
    prose = "The stroke is that of the actuator, the load that of the cell below, and the current was not measured.\n"
    (tmp_path / "remarks.txt").write_text(prose)
    found = import_files([tmp_path])
    assert (currents(found.records), found.refusals, found.left_out) == ([0.5], (), ("remarks.txt",))


def test_lines_above_the_first_part_of_a_file_hold_for_all_of_its_parts(tmp_path):
    head = "; rig B\n; coil current = 0.3 A\n"
    parts = [f"; part {n}, started {n}:00\ntime [s],stroke [mm],load [N]\n" + rows(T, X, force(0.3, n)) for n in (1, 2)]
    (tmp_path / "a.csv").write_text(head + "".join(parts))
    assert currents(import_files([tmp_path]).records) == [0.3, 0.3]


def test_a_number_before_a_letter_that_is_no_current_of_a_coil_is_a_code(tmp_path):
    (tmp_path / "specimen_4411_A.csv").write_text(
        "Current: 0.5 A\ntime [s],stroke [mm],load [N]\n" + rows(T, X, force(0.5))
    )
    assert currents(import_files([tmp_path]).records) == [0.5]


def test_clocks_beside_each_other_belong_to_the_channels_of_as_many_samples(tmp_path):
    slow = T[::50]
    head = "Clock A [s]\tClock B [s]\tHousing [degC]\tStroke [mm]\tLoad [N]\n"
    cells = [
        f"{slow[i]:.4f}\t{T[i]:.4f}\t{20 + 0.1 * i:.2f}" if i < slow.size else f"\t{T[i]:.4f}\t" for i in range(T.size)
    ]
    body = zip(cells, X, force(0.5), strict=True)
    (tmp_path / "a_0.5A.txt").write_text(head + "".join(f"{c}\t{x:.5f}\t{f:.4f}\n" for c, x, f in body))
    (record,) = import_files([tmp_path]).records
    assert np.ptp(record.time) == pytest.approx(np.ptp(T), abs=1e-3)
    assert np.ptp(record.displacement) == pytest.approx(0.020, rel=1e-3)


def test_one_step_of_all_channels_in_lines_of_another_language_is_the_step_of_time(tmp_path):
    head = "Signal;Weg;Kraft\nX-Einheit;ms;ms\nX-Delta;5,0;5,0\nEinheit;mm;N\n"
    body = zip(X, force(0.5), strict=True)
    (tmp_path / "a_0.5A.csv").write_text(head + "".join(f";{x:.5f};{f:.4f}\n".replace(".", ",") for x, f in body))
    (record,) = import_files([tmp_path]).records
    assert np.median(np.diff(record.time)) == pytest.approx(0.005)


@pytest.mark.parametrize("notes", ["I = {} A", "Current: {} A", "{} A"])
@pytest.mark.parametrize("keys", [("Name\t", "Unit\t", "Notes\t"), ("", "", "")])
def test_a_row_of_notes_states_the_current_of_every_column(tmp_path, keys, notes):
    rows_of = rows(T, X, force(0.2), T, X, force(0.8), separator="\t").splitlines()
    lines = ("t\tx\tF\tt\tx\tF", "s\tmm\tN\ts\tmm\tN", "\t".join(notes.format(i) for i in [0.2] * 3 + [0.8] * 3))
    head = "".join(f"{key}{line}\n" for key, line in zip(keys, lines, strict=True))
    if keys[0]:
        head += "Comments\t\t\t\t\t\t\n"  # which says nothing
        rows_of = [f"{i}\t{row}" for i, row in enumerate(rows_of)]
    (tmp_path / "both.txt").write_text(head + "\n".join(rows_of) + "\n")
    assert currents(import_files([tmp_path]).records) == [0.2, 0.8]


@pytest.mark.parametrize("line", ["Damper: B  Amps: 0.5  Bath: 20 C", "AMPERES = 0.5"])
def test_a_unit_written_out_names_its_quantity(tmp_path, line):
    head = f"{line}\nScan rate: 200 scans/sec\nstroke,load\ninches,newtons\n"
    (tmp_path / "a.csv").write_text(head + rows(X / 25.4, force(0.5)))
    (record,) = import_files([tmp_path]).records
    assert (currents([record]), np.ptp(record.displacement)) == ([0.5], pytest.approx(0.02, rel=1e-3))
    assert np.median(np.diff(record.time)) == pytest.approx(0.005)


def test_a_time_of_a_netcdf_table_may_be_the_same_for_some_conditions(tmp_path):
    netcdf_file = pytest.importorskip("scipy.io").netcdf_file
    shape = {"amplitude": 2, "sample": T.size, "coil_current": 3}
    loads = np.array([[force(i), 2 * force(i)] for i in (0.0, 0.4, 0.8)])
    with netcdf_file(tmp_path / "t.nc", "w") as file:
        for name, size in shape.items():
            file.createDimension(name, size)
        for name, unit, dimensions, values in (
            ("coil_current", "A", ("coil_current",), np.array([0.0, 0.4, 0.8])),
            ("amplitude", "mm", ("amplitude",), np.array([10.0, 20.0])),
            ("time", "s", ("sample", "amplitude"), np.column_stack([T, T])),
            ("time_of_day", "s", ("sample", "amplitude"), 3600 + np.column_stack([T, T])),
            ("displacement", "mm", ("amplitude", "sample"), np.stack([X, 2 * X])),
            ("force", "N", ("coil_current", "amplitude", "sample"), loads),
        ):
            variable = file.createVariable(name, "d", dimensions)
            variable[:], variable.units = values, unit
    records = read_runs(tmp_path / "t.nc")
    assert currents(records) == [0.0, 0.0, 0.4, 0.4, 0.8, 0.8]
    assert [round(1e3 * np.ptp(record.displacement)) for record in records] == [20, 40] * 3


def test_a_number_of_hdf5_beside_the_channels_has_the_unit_of_its_attribute(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "t.h5", "w") as file:
        for group, amperes in (("a", 0.2), ("b", 0.8)):
            for name, unit, values in (("time", "s", T), ("stroke", "mm", X), ("load", "N", force(amperes))):
                file.create_dataset(f"{group}/raw/{name}", data=values).attrs["units"] = unit
            file.create_dataset(f"{group}/set/coil_current", data=1e3 * amperes).attrs["units"] = "mA"
    assert currents(import_files([tmp_path]).records) == [0.2, 0.8]


NODES = "Node;Meaning;Unit\nPLC.PT07;Stroke;mm\nPLC.LC02;Load;kN\nPLC.FT01;Coil current;mA\n"


def test_a_table_of_tags_beside_says_what_their_indices_mean(tmp_path):
    columns = {"Main.Damper_Force_N": force(0.5), "Main.Position_mm": X, "Main.Coil_Current_A": np.full(T.size, 0.5)}
    clock = [f"05/03/2023,14:20:0{int(t)},{round(t * 1e3) % 1000}" for t in T]
    body = [f"{at},{i},{v:.6f}" for i, of in enumerate(columns.values()) for at, v in zip(clock, of, strict=True)]
    (tmp_path / "1 (Float).csv").write_text("\n".join(["Date,Time,Millitm,TagIndex,Value", *body, ""]))
    tags = [f'"[PLC]{name}","{i}","2"' for i, name in enumerate(columns)]
    (tmp_path / "1 (Tagname).csv").write_text("\n".join(["TagName,TTagIndex,TagType", *tags, ""]))
    (record,) = import_files([tmp_path]).records
    np.testing.assert_allclose(record.force, force(0.5), rtol=0, atol=1e-6)
    np.testing.assert_allclose(record.time, T, rtol=0, atol=1e-9)
    assert currents([record]) == [0.5]


def test_numbers_of_samples_of_the_cycles_of_a_test_split_no_test(tmp_path):
    np.savez(tmp_path / "0.5A.npz", time_s=T, disp_mm=X, force_N=force(0.5), per_cycle=np.full(4, T.size // 4))
    assert [record.time.size for record in import_files([tmp_path]).records] == [T.size]


@pytest.mark.parametrize("long", [True, False], ids=["a row a value", "a column a node"])
def test_a_list_beside_says_what_the_names_of_a_controller_mean(tmp_path, long):
    names, columns = ("PLC.PT07", "PLC.LC02", "PLC.FT01"), (X, 1e-3 * force(0.5), np.full(T.size, 500.0))
    if long:
        body = "".join(
            f"{name};{t:.3f};{v:.6f};OK\n"
            for name, of in zip(names, columns, strict=True)
            for t, v in zip(T, of, strict=True)
        )
        (tmp_path / "export.csv").write_text("Tag;Time [s];Value;Status\n" + body)
    else:
        (tmp_path / "export.csv").write_text(";".join(("Time [s]", *names)) + "\n" + rows(T, *columns, separator=";"))
    (tmp_path / "nodes.csv").write_text(NODES)
    found = import_files([tmp_path])
    assert not found.refusals
    assert currents(found.records) == [0.5]
    assert np.ptp(found.records[0].displacement) == pytest.approx(0.02, rel=1e-3)
    assert np.max(found.records[0].force) == pytest.approx(np.max(force(0.5)), rel=1e-2)


def test_a_list_of_stages_above_the_columns_gives_each_its_current(tmp_path):
    head = "# Stage 1) 0.2 A, 1 Hz\n# Stage 2) 0.8 A, 1 Hz\ntime [s],stroke [mm],load [N],Stage\n"
    both = (np.r_[T, T + 9], np.r_[X, X], np.r_[force(0.2), force(0.8)], np.repeat([1, 2], T.size))
    (tmp_path / "night.csv").write_text(head + rows(*both))
    assert currents(import_files([tmp_path]).records) == [0.2, 0.8]
    assert len(import_files([tmp_path], parse_profile('[file]\nblocks = "join"\n[current]\nvalue = 0.5')).records) == 1


def test_the_remedy_for_a_velocity_against_the_motion_is_the_sign_that_it_has_not(tmp_path):
    own = -np.gradient(X, T)
    for convention, sign in (("", 1), ("# compression positive\n", -1)):
        head = f"{convention}time [s],stroke [mm],velocity [mm/s],load [N]\n"
        (tmp_path / "a_0.5A.csv").write_text(head + rows(T, sign * X, sign * own, sign * force(0.5)))
        (refused,) = import_files([tmp_path]).refusals
        remedy = f"set [channels.velocity] sign = {-sign} in a profile"
        assert (refused.error.code, remedy in refused.error.remedy) == ("E_CHANNEL_LAG", True)
        (record,) = import_files([tmp_path], parse_profile(f"[channels.velocity]\nsign = {-sign}")).records
        assert np.corrcoef(record.velocity, np.gradient(record.displacement, T))[0, 1] > 0.99


def test_days_that_a_text_counts_are_no_tests(tmp_path):
    (tmp_path / "diary.txt").write_text("Day 1: filled, warmed up at 0.2 A\nDay 2: coil tried at 0.8 A\n")
    for run in (1, 2):
        (tmp_path / f"rec_{run}.csv").write_text("time [s],stroke [mm],load [N]\n" + rows(T, X, force(0.5, run)))
    assert [r.error.code for r in import_files([tmp_path]).refusals] == ["E_CURRENT_MISSING"] * 2


@pytest.mark.parametrize("last", ["A. Keller, operator", "n = 800 samples; end of record", "X scale per division 5 mm"])
def test_lines_of_words_below_the_rows_may_begin_with_one_letter(tmp_path, last):
    head = "Coil current: 0.5 A\ntime [s],stroke [mm],load [N]\n"
    (tmp_path / "a.csv").write_text(head + rows(T, X, force(0.5)) + f"END\n{last}\n")
    (record,) = import_files([tmp_path]).records
    assert record.time.size == T.size
    assert "W_FOOTER" in [finding.code for finding in record.findings]


@pytest.mark.parametrize(
    "metadata",
    [
        {"coil_current_A": "0.5", "units": '{"t": "s", "x": "mm", "F": "kN"}'},
        {"I": "0.5 A", "t_unit": "s", "x_unit": "mm", "F_unit": "kN", "r": "A\n3\n262657"},
        {"rig": '{"current_A": 0.5, "units": {"t": "s", "x": "mm", "F": "kN"}}', "note": "{broken"},
        {"pandas": '{"columns": [], "attributes": {"current_A": 0.5, "units": {"t": "s", "x": "mm", "F": "kN"}}}'},
    ],
    ids=["units of columns", "a key a unit", "one object", "attributes of pandas"],
)
def test_the_footer_of_a_parquet_file_states_units_and_current(tmp_path, metadata):
    frame = pytest.importorskip("polars").DataFrame({"t": T, "x": X, "F": 1e-3 * force(0.5)})
    frame.write_parquet(tmp_path / "test.parquet", metadata=metadata)
    (record,) = import_files([tmp_path]).records
    assert float(np.mean(record.current)) == 0.5
    np.testing.assert_allclose(record.force, force(0.5), rtol=0, atol=1e-9)


@pytest.mark.parametrize("over", [(0, 1, 2), (1, 2)], ids=["every column", "dependent columns"])
@pytest.mark.parametrize("separator", ["\t", ";"])
def test_a_decimal_comma_in_a_row_over_columns_parts_no_cells(tmp_path, separator, over):
    levels = ("0 A", "0,5 A", "1,5 A")
    head = [
        ["Zeit", "Weg", "Kraft"] * 3,
        ["s", "mm", "N"] * 3,
        [f"I = {level}" * (i in over) for level in levels for i in range(3)],
    ]
    columns = [column for amperes in (0.0, 0.5, 1.5) for column in (T, X, force(amperes))]
    text = "".join(separator.join(cells) + "\n" for cells in head) + rows(*columns, separator=separator).replace(
        ".", ","
    )
    (tmp_path / "session.txt").write_text(text)
    assert currents(import_files([tmp_path]).records) == [0.0, 0.5, 1.5]


@pytest.mark.parametrize("began", [False, True], ids=["a time", "a time and when each test began"])
@pytest.mark.parametrize("across", [False, True], ids=["tests in rows", "tests in columns"])
def test_samples_of_tests_stand_in_rows_or_columns_of_matrices(tmp_path, across, began):
    levels = [0.0, 0.5, 1.5]
    matrices = {"disp_mm": np.array([X] * 3), "force_N": np.array([force(amperes) for amperes in levels])}
    channels = {name: of.T if across else of for name, of in matrices.items()} | {"time_s": T, "current_A": levels}
    channels |= {"start_time_s": [0.0, 60.0, 120.0]} if began else {}
    pytest.importorskip("scipy.io").savemat(tmp_path / "tests.mat", channels)
    records = import_files([tmp_path]).records
    assert currents(records) == levels
    for record, amperes in zip(records, levels, strict=True):
        np.testing.assert_allclose(record.force, force(amperes), rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    "head",
    [
        [",,Damping force (N) at coil current,,", "Time (s),Disp (mm),0 A,0.5 A,1.5 A"],  # merged over its columns
        ["Damping force [N],,,,", "Time (s),Disp (mm),0 A,0.5 A,1.5 A"],
        ["Time (s),Disp (mm),Force (N),,", ",,0 A,0.5 A,1.5 A"],
        ["Time (s),Disp (mm),Force,,", ",,0 A,500 mA,1500 mA", "s,mm,N,N,N"],
    ],
)
def test_columns_named_after_currents_under_a_heading_of_the_force_are_tests(tmp_path, head):
    table = rows(T, X, *map(force, (0.0, 0.5, 1.5)))
    (tmp_path / "motion.csv").write_text("\n".join([*head, table]))
    assert currents(import_files([tmp_path]).records) == [0.0, 0.5, 1.5]


@pytest.mark.parametrize(
    "heading", ["", "Force (N) vs displacement", "Preload force (N)", "Static force in N", "Maximum force (N)"]
)
def test_columns_named_after_currents_are_asked_about_and_none_is_left_out_in_silence(tmp_path, heading):
    table = rows(T, X, *map(force, (0.0, 0.5, 1.5)))
    (tmp_path / "motion.csv").write_text(f"{heading}\nTime (s),Disp (mm),0 A,0.5 A,1.5 A\n{table}")
    (refusal,) = import_files([tmp_path]).refusals
    assert 'if columns named after currents are the force at each, unit = "..." alone' in str(refusal.error)
    answered = import_files([tmp_path], parse_profile('[channels.force]\nunit = "N"'))
    assert currents(answered.records) == [0.0, 0.5, 1.5]
    one = '[channels.force]\nunit = "N"\ncolumn = "1.5 A"\n'
    (record,) = import_files([tmp_path], parse_profile(one)).records
    assert currents([record]) == [1.5]
    assert any("2 columns named after other currents are not taken: 0 A, 0.5 A" in f.text for f in record.findings)
    (refusal,) = import_files([tmp_path], parse_profile(f"{one}[current]\nvalue = 0.0")).refusals
    assert refusal.error.code == "E_CURRENT_CONTRADICTS"


@pytest.mark.parametrize(
    "conditions",
    [
        [
            {"parameter": "Coil current", "value": 500, "unit": "mA"},
            {"parameter": "Operator", "value": "K", "unit": ""},
        ],
        [{"grandeur": "Courant bobine", "valeur": "0,5", "unité": "A", "incertitude": 0.01}],
        {"parameter": [{"item": "Spulenstrom", "wert": 0.5, "einheit": "A"}]},
    ],
    ids=["a parameter in words beside it", "French, as text", "below a key"],
)
def test_a_list_of_parameters_states_the_current_under_whatever_key_its_name_stands(tmp_path, conditions):
    named = (("Time", "s", T), ("Stroke", "mm", X), ("Force", "N", force(0.5)))
    channels = [{"name": name, "unit": unit, "data": values.tolist()} for name, unit, values in named]
    (tmp_path / "S-1.json").write_text(json.dumps({"conditions": conditions, "channels": channels}))
    assert currents(import_files([tmp_path]).records) == [0.5]
    text = json.dumps({"conditions": conditions, "channels": channels})
    for word in ("Coil current", "Courant bobine", "Spulenstrom"):
        text = text.replace(word, f"Max. {word}")
    (tmp_path / "S-1.json").write_text(text)
    assert [r.error.code for r in import_files([tmp_path]).refusals] == ["E_CURRENT_MISSING"]


@pytest.mark.parametrize(
    "conditions",
    [
        [{"parameter": "current", "comment": "of the pump", "value": 2, "unit": "A"}],
        [{"name": "current", "value": ".5", "unit": "A"}, {"name": "Current", "value": "2", "unit": "A"}],
        [{"name": "current", "value": 0.5, "unit": "A"}, {"name": "Current", "value": 2, "unit": "A"}],
    ],
)
def test_parameters_of_a_pump_or_that_contradict_each_other_are_no_coil_current(tmp_path, conditions):
    table = {"time [s]": T.tolist(), "stroke [mm]": X.tolist(), "force [N]": force(0.5).tolist()}
    (tmp_path / "S-1.json").write_text(json.dumps({"conditions": conditions, "data": table}))
    (refusal,) = import_files([tmp_path]).refusals
    assert refusal.error.code in ("E_CURRENT_MISSING", "E_AMBIGUOUS")


def test_the_sampling_rate_of_cameras_among_the_parameters_is_not_that_of_the_rows(tmp_path):
    rates = [{"name": "sample rate", "value": 300, "unit": "Hz"}, {"name": "exposure", "value": 5, "unit": "ms"}]
    table = {"stroke [mm]": X.tolist(), "force [N]": force(0.5).tolist()}
    (tmp_path / "a_0.5A.json").write_text(json.dumps({"cameras": rates, **table}))
    assert [r.error.code for r in import_files([tmp_path]).refusals] == ["E_COLUMN"]
    (tmp_path / "a_0.5A.csv").write_text("stroke [mm],force [N]\n" + rows(X, force(0.5)))
    (tmp_path / "a_0.5A.json").write_text(json.dumps({"camera": {"sample rate": "300 Hz"}}))
    assert [r.error.code for r in import_files([tmp_path / "a_0.5A.csv"]).refusals] == ["E_COLUMN"]
    (tmp_path / "a_0.5A.csv").unlink()
    (tmp_path / "a_0.5A.json").write_text(json.dumps({"parameters": rates, **table}))
    assert import_files([tmp_path]).records[0].time[-1] == pytest.approx((T.size - 1) / 300)


@pytest.mark.parametrize("key", ["stamp", "name"])
def test_rows_with_a_text_and_a_reading_beside_the_channels_are_no_list_of_parameters(tmp_path, key):
    named = zip(("time [s]", "stroke [mm]", "force [N]"), (T, X, force(0.5)), strict=True)
    columns = {name: values.tolist() for name, values in named} | {"reading": (7 + T).tolist()}
    cells = enumerate(zip(*columns.values(), strict=True))
    items = [{key: f"S{i}"} | dict(zip(columns, row, strict=True)) for i, row in cells]
    (tmp_path / "a_0.5A.json").write_text(json.dumps({"data": items}))
    (record,) = import_files([tmp_path]).records
    np.testing.assert_allclose(record.force, force(0.5))


def test_a_written_profile_has_the_sign_that_a_text_beside_states(tmp_path):
    (tmp_path / "a_0.5A.csv").write_text("Time [s],disp [mm],force [N]\n" + rows(T, X, -force(0.5)))
    (tmp_path / "README.txt").write_text("Damper bench. Force: compression positive.")
    written = guess_profile(tmp_path / "a_0.5A.csv")
    assert written.channel("force").sign == -1
    (record,) = import_files([tmp_path], written).records
    assert np.array_equal(record.force, import_files([tmp_path]).records[0].force)


def test_a_pattern_of_folders_is_refused_under_the_path_as_it_was_given(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lvl3").mkdir()
    (tmp_path / "lvl3" / "t.csv").write_text("Time [s],disp [mm],force [N]\n" + rows(T, X, force(0.5)))
    pattern = '[current]\npattern = "*/lvl{current}/*"\n'
    (refusal,) = import_files(["lvl3/t.csv"], parse_profile(pattern)).refusals
    assert str(refusal.error).startswith("lvl3/t.csv: the pattern")
    assert currents(import_files(["lvl3/t.csv"], parse_profile(f'{pattern}unit = "A"')).records) == [3.0]


@pytest.mark.parametrize("line", ["# 0.5 A,1 A", "# 0.5 A, 1 A", "# 0.5 A;1 A", "0.5 A,1 A"])
def test_two_currents_in_a_line_over_one_test_are_asked_about(tmp_path, line):
    (tmp_path / "a.csv").write_text(f"{line}\nTime [s],disp [mm],force [N]\n" + rows(T, X, force(0.5)))
    (refusal,) = import_files([tmp_path]).refusals
    assert refusal.error.code == "E_CURRENT_MISSING"
    assert "set one of these in a profile: [current] value" in refusal.error.remedy  # only one may stand


def test_columns_of_one_name_below_their_conditions_are_tests_and_a_number_leaves_none_out_in_silence(tmp_path):
    head = ["test,I=0A,I=0A,I=0.5A,I=0.5A", "signal,x_mm,F_N,x_mm,F_N", "t_s,,,,"]  # pandas: columns of two levels
    table = rows(T, X, force(0.0), X + 0.01, force(0.5))
    (tmp_path / "sine.csv").write_text("\n".join([*head, table]))
    assert currents(import_files([tmp_path]).records) == [0.0, 0.5]
    (tmp_path / "sine.csv").write_text("\n".join(["t_s,x_mm,F_N,x_mm,F_N", table]))
    assert {r.error.code for r in import_files([tmp_path]).refusals} == {"E_DUPLICATE_COLUMN"}
    numbers = "[channels.displacement]\ncolumn = 2\n[channels.force]\ncolumn = 3\n[current]\nvalue = 0.0"
    (record,) = import_files([tmp_path], parse_profile(numbers)).records
    (told,) = [finding.text for finding in record.findings if finding.code == "W_COLUMN"]
    assert told.startswith("x_mm (column 4) and F_N (column 5) not taken; if they are further tests, ")


@pytest.mark.parametrize(("sense", "sign"), [("extension (tension)", 1), ("compression", -1)])
def test_a_table_of_channels_in_a_readme_gives_names_scales_and_senses(tmp_path, sense, sign):
    (tmp_path / "a_0.5A.csv").write_text("time_s,ai0,ai1\n" + rows(T, X / 4, sign * force(0.5) / 250))
    table = "| channel | quantity | sensor | sensitivity | positive |\n|---|---|---|---|---|\n"
    table += f"| ai0 | displacement | LVDT DC25 | 4 mm/V | extension |\n| ai1 | force | cell | 250 N/V | {sense} |\n"
    (tmp_path / "README.md").write_text(f"# Tests\n\nAll channels in volts as acquired.\n\n{table}")
    (record,) = import_files([tmp_path]).records
    np.testing.assert_allclose(1e3 * record.displacement, X, atol=1e-3)
    np.testing.assert_allclose(record.force, force(0.5), atol=1e-2)
    (tmp_path / "README.md").write_text(f"# Tests\n\n{table}")
    assert {r.error.code for r in import_files([tmp_path]).refusals} == {"E_UNITS_MISSING"}


def test_the_force_and_currents_of_ambiguous_names_are_asked_for_at_once_and_a_zero_either_way_is_read(tmp_path):
    for name, amperes in (("m_0_0A_1Hz", 0.0), ("m_0_5A_1Hz", 0.5)):
        table = rows(T, X, force(amperes), force(amperes, 1))
        (tmp_path / f"{name}.csv").write_text("t [s],x [mm],force upper [N],force lower [N]\n" + table)
    zero, half = (refusal.error for refusal in import_files([tmp_path]).refusals)
    assert (zero.code, half.code) == ("E_AMBIGUOUS", "E_AMBIGUOUS")
    assert "and give the current of each test" in half.remedy
    assert "current" not in zero.remedy
    answer = '[channels.force]\ncolumn = "force upper [N]"\n[current.values]\n"m_0_5A*" = 0.5'
    assert currents(import_files([tmp_path], parse_profile(answer)).records) == [0.0, 0.5]


def test_samples_of_several_tests_as_objects_with_stamps_and_objects_within_are_rows(tmp_path):
    lines = []
    for run, amperes in (("r01", 0.0), ("r02", 0.5)):
        for t, x, f in zip(T, X, force(amperes), strict=True):
            stamp = f"2024-05-06T09:{14 + (run == 'r02')}:{22 + t:06.3f}Z"
            coil = {"set_A": amperes, "meas_A": amperes + 1e-3 * np.sin(9 * t)}
            lines.append(json.dumps({"ts": stamp, "run": run, "pos_mm": x, "force_N": f, "coil": coil}))
    (tmp_path / "telemetry.jsonl").write_text("\n".join(lines))
    records = import_files([tmp_path]).records
    assert currents(records) == [0.0, 0.5]
    np.testing.assert_allclose(records[1].time - records[1].time[0], T, atol=1e-9)
    np.testing.assert_allclose(records[1].force, force(0.5))
    uneven = [line.replace("pos_mm", "x") if i % 2 else line for i, line in enumerate(4 * lines)]
    (tmp_path / "telemetry.jsonl").write_text("\n".join(uneven))
    (refusal,) = import_files([tmp_path]).refusals
    assert "samples as records with the same keys" in str(refusal.error)


def test_a_plan_of_tests_states_their_currents_by_the_day_that_is_their_folder_and_their_number(tmp_path):
    plan = {("2024-06-12", 1): 0.0, ("2024-06-12", 2): 0.4, ("2024-06-13", 1): 0.8, ("2024-06-13", 2): 0.6}
    for (day, number), amperes in plan.items():
        (tmp_path / day).mkdir(exist_ok=True)
        (tmp_path / day / f"{number:02d}.csv").write_text("t [s],s [mm],F [N]\n" + rows(T, X, force(amperes)))
    lines = [f"{day};{number};{amperes};10\n" for (day, number), amperes in plan.items()]
    (tmp_path / "Versuchsplan.csv").write_text("".join(["Datum;Nr;Strom / A;Amplitude / mm\n", *lines]))
    assert [round(float(np.mean(r.current)), 3) for r in import_files([tmp_path]).records] == [0.0, 0.4, 0.8, 0.6]
    (tmp_path / "Versuchsplan.csv").write_text("".join(["Datum;Nr;Strom / A;Amplitude / mm\n", *lines[:-1]]))
    assert {r.error.code for r in import_files([tmp_path]).refusals} == {"E_CURRENT_MISSING"}
    from openpyxl import Workbook

    (tmp_path / "Versuchsplan.csv").unlink()
    book = Workbook()
    for day in dict.fromkeys(day for day, _ in plan):
        sheet = book.create_sheet(f"Tag {day}")
        sheet.append(["Nr", "Strom / A"])
        for number in (1, 2):
            sheet.append([number, plan[day, number]])
    book.save(tmp_path / "Versuchsplan.xlsx")
    assert [round(float(np.mean(r.current)), 3) for r in import_files([tmp_path]).records] == [0.0, 0.4, 0.8, 0.6]


def test_a_plan_that_lacks_tests_is_named_with_them(tmp_path):
    for i in (1, 2, 3):
        (tmp_path / f"run0{i}.csv").write_text("Time [s],disp [mm],force [N]\n" + rows(T, X, force(i / 2, i)))
    (tmp_path / "plan.csv").write_text("run,current (A)\nrun01,0.5\nrun02,1\n")
    errors = [refusal.error for refusal in import_files([tmp_path]).refusals]
    assert len(errors) == 3
    assert all("plan.csv names 2 of 3 tests and may lack run03" in error.found for error in errors)
    assert all(error.remedy.startswith("if so, correct the plan; else write the currents") for error in errors)


@pytest.mark.parametrize(
    ("heading", "cell", "files"),
    [
        *((heading, cell, ["run_1", "run_2", "run_3"]) for heading, cell in (
            ("Remark", "INVALID - plug came off, repeated as run 3"), ("Bemerkung", "abgebrochen"), ("note", "warm-up"),
            ("valid", "no"), ("备注", "无效"), ("Status", "cancelled, oil leak"), ("Discard", "yes"), ("Include", "no"),
            ("Valid", "0.0"), ("valid (1/0)", "0"), ("Remark", "repeat of run 1, aborted"),
            ("Bemerkung", "ungueltig, Stecker lose"), ("remarks", "not valid, plug loose"), ("Notes", "run-in"),
            ("Remarks", "repeat of the first run aborted"), ("Remarks", "repeat, first one aborted, aborted again"),
        )),
        *((heading, cell, ["a_0A", "b_0.5A", "c_0.5A"]) for heading, cell in (
            ("Remark", "INVALID - plug came off, repeated as run 3"), ("Include", "no"), ("Valid", "0.0"),
        )),
    ],
)  # fmt: skip
def test_a_test_that_a_plan_calls_invalid_or_a_warm_up_is_asked_about(tmp_path, heading, cell, files):
    for i, name in enumerate(files):
        (tmp_path / f"{name}.csv").write_text("Time [s],disp [mm],force [N]\n" + rows(T, X, force(i / 4, i)))
    remarks = [
        f"{file},{0.5 * bool(i)},{of}"
        for i, (file, of) in enumerate(zip(files, ("", f'"{cell}"', "repeat of run 2"), strict=True))
    ]
    (tmp_path / "plan.csv").write_text("\n".join([f"Run,Coil current [A],{heading}", *remarks, ""]))
    (refusal,) = import_files([tmp_path]).refusals
    assert (refusal.error.code, refusal.run) == ("E_DISCARDED", files[1])
    assert repr(f"{heading}: {cell}") in refusal.error.found
    remedy = parse_profile("[file]\n" + refusal.error.remedy.split("set [file] ")[1].removesuffix(" in a profile"))
    result = import_files([tmp_path], remedy)
    assert not result.refusals
    assert currents(result.records) == [0.0, 0.5]


@pytest.mark.parametrize(
    ("heading", "cells"),
    [
        ("Procedure", ["3 warm-up cycles, then 6 measured cycles"] * 3), ("Warm-up done", ["yes"] * 3),
        ("Use cooling", ["no"] * 3), ("Used before [h]", ["0", "3", "3"]), ("Repeated", ["", "yes", ""]),
        ("Remark", ["", "after warm-up", ""]), ("Bemerkung", ["", "nach 10 Einlaufzyklen", ""]),
        ("Bemerkung", ["", "Warmlauf davor", ""]),
        ("Remark", ["", "thermocouple failed, forces valid", ""]), ("Specimen", ["Void ratio 0.2"] * 3),
        ("Remark", ["warm-up"] * 3), ("Remark", ["", "not aborted, valid", ""]),
        ("Remark", ["", "replaces run 7 (invalid)", ""]), ("Bemerkung", ["", "Wiederholung von ungültigem Lauf 1", ""]),
        ("Remarks", ["", "repeat, first one aborted", ""]),
        ("Bemerkung", ["", "Wiederholung (erster Versuch abgebrochen)", ""]),
    ],
)  # fmt: skip
def test_a_remark_on_something_else_or_on_every_test_discards_none(tmp_path, heading, cells):
    for i in range(3):
        (tmp_path / f"run_{i + 1}.csv").write_text("Time [s],disp [mm],force [N]\n" + rows(T, X, force(i / 4)))
    lines = [f'{i + 1},{i / 4},"{cell}"' for i, cell in enumerate(cells)]
    (tmp_path / "plan.csv").write_text("\n".join([f"Run,Coil current [A],{heading}", *lines, ""]))
    assert currents(import_files([tmp_path]).records) == [0.0, 0.25, 0.5]


@pytest.mark.parametrize("day", ["08-10-2024", "08/10/2024", "08.10.2024", "2024-10-08"])
def test_stamps_count_seconds_whatever_the_order_of_day_and_month(day, tmp_path):
    stamps = [f"{day} 13:05:{12 + t:06.3f}" for t in T]
    lines = [f"{stamp};{x:.4f};{f:.3f}\n" for stamp, x, f in zip(stamps, X, force(0.5), strict=True)]
    (tmp_path / "meting_0.5A.csv").write_text("Tijd;Weg [mm];Kracht [N]\n" + "".join(lines))
    np.testing.assert_allclose(read_run(tmp_path / "meting_0.5A.csv").time, T, atol=1e-9)


def test_samples_of_a_current_over_time_are_no_plan(tmp_path):
    for i in range(3):
        (tmp_path / f"T{i + 1:02}.csv").write_text("Time [s],disp [mm],force [N]\n" + rows(T, X, force(i / 2)))
    (tmp_path / "ramp.csv").write_text("Time [s],Current [A]\n" + "".join(f"{k / 10},{k / 100}\n" for k in range(60)))
    assert not import_files([tmp_path]).records


@pytest.mark.parametrize(
    ("frequencies", "amplitudes", "refused", "amplitude"),
    [
        ([1, 2, 1], [10, 10, 5], False, "x_amp_mm"), ([1, 2, 1], [20, 20, 10], False, "Amplitude [mm]"),
        ([1, 1, 1], [10, 10, 5], True, "Amplitude [mm]"), ([2, 1, 1], [10, 10, 5], True, "Amplitude [mm]"),
        ([1, 2, 1], [5, 10, 10], True, "Amplitude [mm]"), ([1, 2, 1], [5, 10, 10], True, "x_amp_mm"),
    ],
)  # fmt: skip
def test_a_plan_whose_rows_state_other_motions_gives_no_currents_until_they_are_answered(
    frequencies, amplitudes, refused, amplitude, tmp_path
):
    for i, (factor, size) in enumerate(((1, 1.0), (2, 1.0), (1, 0.5))):
        record = rows(T / factor, size * X, force(i / 2))
        (tmp_path / f"run_{i + 1}.csv").write_text("Time [s],disp [mm],force [N]\n" + record)
    lines = [f"{i + 1},{i / 2},{f},{a}\n" for i, (f, a) in enumerate(zip(frequencies, amplitudes, strict=True))]
    (tmp_path / "plan.csv").write_text(f"Nr,Current [A],Frequency [Hz],{amplitude}\n" + "".join(lines))
    found = import_files([tmp_path])
    assert {r.error.code for r in found.refusals} == ({"E_MOTION_CONTRADICTS"} if refused else set())
    profile = parse_profile('[current.values]\n"run_1*" = 0\n"run_2*" = 0.5\n"run_3*" = 1.0\n')
    assert currents(import_files([tmp_path], profile).records) == [0.0, 0.5, 1.0]
    (tmp_path / "run_2.csv").rename(tmp_path / "1.5A_run_2.csv")  # its name contradicts the plan, whatever moves
    assert "E_CURRENT_CONTRADICTS" in {refusal.error.code for refusal in import_files([tmp_path]).refusals} or refused


HEAD = "Time [s],disp [mm],force [N]\n"


def write_tests(folder, amperes, name="run_{}.csv", heads=HEAD):
    """Write a file for each current, in the order of their numbers."""
    folder.mkdir(exist_ok=True)
    for i, current in enumerate(amperes, 1):
        (folder / name.format(i)).write_text(heads.format(current) + rows(T, X, force(current, i)))


def by_id(result) -> dict[str, float]:
    return {record.id: round(float(np.mean(record.current)), 3) for record in result.records}


@pytest.mark.parametrize(
    ("name", "text", "heads"),
    [
        ("notes.txt", "Run 1: 0.25 A\nRun 2: 0.5 A, INVALID - plug came off\nRun 3: 0.75 A\n", HEAD),
        ("plan.csv", "Run,Frequency [Hz],Remark\n1,1,\n2,1,INVALID\n3,1,\n", "# coil current: {} A\n" + HEAD),
        ("plan.csv", "Run,Valid\n1,1\n2,0\n3,1\n", "# coil current: {} A\n" + HEAD),
    ],
    ids=["in a line", "without currents", "as numbers"],
)
def test_a_remark_beside_no_column_of_currents_discards_a_test_too(tmp_path, name, text, heads):
    write_tests(tmp_path, (0.25, 0.5, 0.75), heads=heads)
    (tmp_path / name).write_text(text)
    result = import_files([tmp_path])
    assert [(refusal.error.code, refusal.run) for refusal in result.refusals] == [("E_DISCARDED", "run_2")]
    assert by_id(result) == {"run_1": 0.25, "run_3": 0.75}


def test_one_remedy_leaves_out_every_test_that_a_plan_discards(tmp_path):
    write_tests(tmp_path, (0.25, 0.5, 0.75))
    (tmp_path / "plan.csv").write_text("Run,Current [A],Remark\n1,0.25,void\n2,0.5,\n3,0.75,aborted\n")
    remedies = {refusal.error.remedy for refusal in import_files([tmp_path]).refusals}
    assert [remedy[remedy.index("set [file]") :].split(" in a profile")[0] for remedy in remedies] == [
        'set [file] leave_out = ["run_1.csv", "run_3.csv"]'
    ]
    records, _ = found_tests([tmp_path])
    assert [line.split(",")[2] for line in tests_table.tests_text(records).splitlines()] == ["current_A", "", "0.5", ""]
    (tmp_path / "tests.csv").write_text("file,current_A\nrun_1.csv,0.25\nrun_3.csv,0.75\n")  # both are valid
    result = import_files([tmp_path])
    assert by_id(result) == {"run_1": 0.25, "run_2": 0.5, "run_3": 0.75}
    assert any("tests.csv decides: plan.csv has the remark" in finding.text for finding in result.records[0].findings)


@pytest.mark.parametrize("line", ["damper force = Load_1 + Load_2", "Load_1, Load_2: force is the sum of both"])
def test_a_force_that_is_a_sum_of_columns_is_asked_for_and_added_up(tmp_path, line):
    f = force(0.5)
    text = "Time (s),Stroke (mm),Load_1 (kN),Load_2 (N)\n" + rows(T, X, 0.6e-3 * f, 0.4 * f)
    (tmp_path / "a_0.5A.csv").write_text(f"# {line}\n{text}")
    for half in ("", 'column = "Load_2 (N)"'):
        (refusal,) = import_files([tmp_path], parse_profile(f"[channels.force]\n{half}")).refusals
        assert refusal.error.code == "E_AMBIGUOUS"
        assert line in refusal.error.found
    remedy = refusal.error.remedy.removeprefix("set [channels.force] ").split(" in a profile")[0].replace(" and ", "\n")
    (record,) = import_files([tmp_path], parse_profile(f"[channels.force]\n{remedy}")).records
    assert record.force == pytest.approx(f, abs=0.02)
    alone = parse_profile('[channels.force]\ncolumn = "Load_2 (N)"\nadd = []')
    assert parse_profile(profile_text(alone)) == alone
    (record,) = import_files([tmp_path], alone).records
    assert record.force == pytest.approx(0.4 * f, abs=0.02)
    (tmp_path / "a_0.5A.csv").write_text("# Load = Load_1 + Load_2\n" + text.replace("Load_2 (N)", "Load (N)"))
    (record,) = import_files([tmp_path]).records
    assert record.force == pytest.approx(0.4 * f, abs=0.02)


def test_what_a_readme_states_of_columns_that_may_be_one_channel_is_quoted(tmp_path):
    heads = "Time (s),Crosshead Disp (mm),Rod LVDT (mm),Force (N)\n"
    (tmp_path / "a_0.5A.csv").write_text(heads + rows(T, 1.1 * X, X, force(0.5)))
    (tmp_path / "README.txt").write_text("Rod LVDT: stroke of the damper\nCrosshead Disp: with the frame's, not used\n")
    (refusal,) = import_files([tmp_path]).refusals
    assert "with the frame's, not used" in refusal.error.found
    assert "stroke of the damper" in refusal.error.found


def test_a_profile_can_be_written_for_a_file_whose_form_is_not_found(tmp_path):
    path = tmp_path / "a_0.5A.csv"
    path.write_text("time,disp,load,extra\n" + rows(T, X, force(0.5)))
    text, (problem,) = profile_template([path], parse_profile(""))
    assert "E_FIELD_COUNT" in problem
    answered = text.replace("#names", "names").replace("#data_line =", "data_line = 2")
    (record,) = import_files([path], parse_profile(answered)).records
    assert record.force == pytest.approx(force(0.5), abs=1e-4)


def test_lines_above_the_rows_may_begin_with_a_label_each(tmp_path):
    heads = '"No","Elapsed","CH-1","CH-2"\n"Name","","Stroke","Load"\n"Range","","OFF","5000"\n"Unit","s","mm","kN"\n'
    (tmp_path / "a_0.5A.csv").write_text(heads + rows(T, X, force(0.5) / 1e3))
    (record,) = import_files([tmp_path]).records
    assert record.force == pytest.approx(force(0.5), abs=0.02)


def test_units_in_an_object_are_those_of_columns_in_a_list_beside_it(tmp_path):
    runs = [
        {"id": n, "params": {"current": i}, "rows": np.column_stack([T, X, force(i, n)]).round(4).tolist()}
        for n, i in enumerate((0.0, 0.5))
    ]
    heads = {"columns": ["time", "displacement", "force"], "units": {"time": "s", "displacement": "mm", "force": "N"}}
    heads["units"]["current"] = "A"
    (tmp_path / "rig.json").write_text(json.dumps({**heads, "runs": runs}))
    assert currents(import_files([tmp_path]).records) == [0.0, 0.5]


@pytest.mark.parametrize("plan", ["Run,Current [A],Remark\n{}", "Current [A],Remark\n{}"], ids=["numbered", "in order"])
@pytest.mark.parametrize("pattern", ["all_2", "block 2"])
def test_a_test_that_is_left_out_of_a_file_leaves_the_others_their_numbers(tmp_path, plan, pattern):
    stated = dict(enumerate((0.0, 0.25, 0.5, 0.75), 1))
    (tmp_path / "all.csv").write_text("\n".join(HEAD + rows(T, X, force(i, n)) for n, i in stated.items()))
    lines = [f"{n},{i},{'aborted' * (n == 2)}\n"[0 if "Run" in plan else 2 :] for n, i in stated.items()]
    (tmp_path / "plan.csv").write_text(plan.format("".join(lines)))
    (refusal,) = import_files([tmp_path]).refusals
    assert 'leave_out = ["all_2"]' in refusal.error.remedy
    result = import_files([tmp_path], parse_profile(f'[file]\nleave_out = ["{pattern}"]'))
    if pattern == "all_2" or "Run" in plan:
        assert by_id(result) == {"all_1": 0.0, "all_3": 0.5, "all_4": 0.75}
        assert not result.refusals
    else:
        assert {refusal.error.code for refusal in result.refusals} == {"E_CURRENT_MISSING"}
    assert ("all_2" in result.left_out) == (pattern == "all_2")


def test_files_and_tests_of_one_name_are_left_out_with_their_folder(tmp_path):
    for day in ("mon", "tue"):
        write_tests(tmp_path / day, (0.1, 0.2 if day == "mon" else 0.3))
        (tmp_path / day / "run_2.csv").write_text(HEAD + rows(T, X, force(len(day + day[0]), ord(day[0]))))
    lines = "".join(
        f"{day},{n},{n / 10},{'void' * (day == 'tue' and n == 2)}\n" for day in ("mon", "tue") for n in (1, 2)
    )
    (tmp_path / "plan.csv").write_text(f"Day,Run,Current [A],Remark\n{lines}")
    (tmp_path / "tue" / "run_1.csv").write_text(HEAD + rows(T, X, force(0.11, 7)))
    refused = [refusal for refusal in import_files([tmp_path]).refusals if refusal.error.code == "E_DISCARDED"]
    assert ['leave_out = ["tue/run_2.csv"]' in refusal.error.remedy for refusal in refused] == [True]
    left = import_files([tmp_path], parse_profile('[file]\nleave_out = ["tue/run_2.csv"]')).left_out
    assert left.count("run_2.csv") == 1


@pytest.mark.parametrize("warm_up", [False, True])
@pytest.mark.parametrize("heads", ["first row,last row", "start [s],end [s]"])
def test_a_plan_of_the_ranges_of_one_record_gives_each_test_the_current_of_its_range(tmp_path, heads, warm_up):
    motions = [(0.5, 1.0), (0.0, 1.0), (None, 0.4), (1.0, 1.4), (0.25, 1.4)]
    motions = [motion for motion in motions if warm_up or motion[0] is not None]
    rest, parts, plan, at = np.zeros(300), [], [], 0
    for n, (current, size) in enumerate(motions):
        parts.append((np.r_[size * X, rest], np.r_[force(current or 0.0, n), rest]))
        end = at + T.size + rest.size
        bounds = (at + 1, end) if "row" in heads else (at * 0.005, end * 0.005)
        plan += [] if current is None else [(current, *bounds)]
        at = end
    x, f = (np.concatenate(channel) for channel in zip(*parts, strict=True))
    (tmp_path / "session.csv").write_text(HEAD + rows(0.005 * np.arange(x.size), x, f))
    lines = [f"{n},{a:g},{b:g},{current}\n" for n, (current, a, b) in enumerate(sorted(plan), 1)]  # in no order of time
    (tmp_path / "protocol.csv").write_text("".join([f"No.,{heads},current [A]\n", *lines]))
    result = import_files([tmp_path])
    assert list(by_id(result).values()) == [0.5, 0.0, 1.0, 0.25]
    assert result.left_out == (("session_3",) if warm_up else ())
    assert result.reasons.get("session_3", "") == "in no range of protocol.csv" * warm_up
    lines = [line.replace(f"{n},", f"{n},9", 1) for n, line in enumerate(lines, 1)]  # ranges that are not there
    (tmp_path / "protocol.csv").write_text("".join([f"No.,{heads},current [A]\n", *lines]))
    assert not import_files([tmp_path]).records


@pytest.mark.parametrize(
    ("plan", "text", "heads", "sizes"),
    [
        (
            "plan.csv",
            "File,Start row,End row,Current (A)\nrun_1.csv,1,150,0.25\nrun_2.csv,1,300,0.5\n",
            HEAD,
            [150, 300],
        ),
        ("plan.csv", "Test,Start (s),End (s),Current (A)\n1,1,2,0.25\n2,1,3,0.5\n", HEAD, [101, 200]),
        ("plan.csv", "Test,Start (s),End (s)\n1,1,2\n2,1,3\n", "# coil current: {} A\n" + HEAD, [101, 200]),
        ("plan.csv", "Test,Start (s),End (s),Current (A)\n1,1,2,0.25\n2,11,12,0.5\n", HEAD, [300, 300]),
        ("tests.csv", "file,current_A,start_s,end_s\nrun_1.csv,0.25,1,2\nrun_2.csv,0.5,1,3\n", HEAD, [101, 200]),
    ],
)
def test_each_test_is_cut_to_its_start_and_end_in_a_plan_if_they_are_on_its_own_clock(
    tmp_path, plan, text, heads, sizes
):
    write_tests(tmp_path, (0.25, 0.5), heads=heads)
    (tmp_path / plan).write_text(text)
    records = import_files([tmp_path]).records
    assert [record.time.size for record in records] == sizes
    assert all("W_CUT" in {f.code for f in r.findings} for r in records if r.time.size < T.size or sizes[0] == T.size)


@pytest.mark.parametrize("line", ["Vertical Units,V", "# Amplitude,V", "Unit: V", "# V"])
def test_a_unit_of_a_profile_against_volts_above_the_numbers_is_refused_without_a_scale(tmp_path, line):
    text = "[channels.{}]\ncolumn = 1\nunit = '{}'\nfile = '{{run}}_{}.csv'\n"
    of = (("displacement", "mm", "CH1", X / 5, 5.0), ("force", "N", "CH2", force(0.5) / 300, 300.0))
    for _, _, name, values, _ in of:
        (tmp_path / f"t_0.5A_{name}.csv").write_text(f"{line}\n{rows(values)}")
    profile = "[file]\nsample_rate_Hz = 200\n" + "".join(text.format(r, u, n) for r, u, n, *_ in of)
    assert {r.error.code for r in import_files([tmp_path], parse_profile(profile)).refusals} == {"E_UNITS_DIMENSION"}
    for _, unit, *_, scale in of:
        profile = profile.replace(f"unit = '{unit}'", f"unit = '{unit}'\nscale = {scale}")
    assert currents(import_files([tmp_path], parse_profile(profile)).records) == [0.5]


def test_a_step_without_a_current_is_a_pause_only_where_the_record_rests(tmp_path):
    motions = [X, 0 * X, X, 1.4 * X, 1.4 * X]
    loads = [force(i, n) * (n != 1) for n, i in enumerate((0.0, 0.0, 0.5, 1.0, 0.25))]
    steps = np.repeat(np.arange(1, 6), T.size)
    columns = (0.005 * np.arange(steps.size), np.concatenate(motions), np.concatenate(loads), steps)
    (tmp_path / "ses.csv").write_text(HEAD.strip() + ",Step\n" + rows(*columns))
    (tmp_path / "plan.csv").write_text("Step,Type,Current [A]\n1,sine,0\n2,pause,\n3,sine,0.5\n4,sine,\n5,sine,0.25\n")
    result = import_files([tmp_path])
    assert [(refusal.error.code, refusal.run) for refusal in result.refusals] == [("E_CURRENT_MISSING", "ses_4")]
    assert by_id(result) == {"ses_1": 0.0, "ses_3": 0.5, "ses_5": 0.25}
    (tmp_path / "tests.csv").write_text("file,run,current_A\nses.csv,ses_4,1\nses.csv,ses_5,0.25\n")
    assert by_id(import_files([tmp_path])) == {"ses_1": 0.0, "ses_3": 0.5, "ses_4": 1.0, "ses_5": 0.25}


def test_names_of_columns_in_a_line_give_none_of_them_the_unit_of_another(tmp_path):
    step = np.repeat([1, 2], T.size // 2)
    lines = "# Step,Type,Current [A]\n# 1,sine,0\n# 2,sine,0.5\n"
    (tmp_path / "a.csv").write_text(lines + HEAD.strip() + ",Step\n" + rows(T, X, force(0.5), step))
    assert not import_files([tmp_path]).records


def test_a_plan_on_a_sheet_of_its_tests_is_compared_with_their_motion_and_its_remarks_count(tmp_path):
    def workbook(frequencies, remarks):
        book = openpyxl.Workbook()
        book.active.append(["Test", "Current (A)", "Frequency (Hz)", "Remark"])
        for n, (frequency, remark) in enumerate(zip(frequencies, remarks, strict=True), 1):
            book.active.append([n, n / 4, frequency, remark])
            sheet = book.create_sheet(f"Test {n}")
            sheet.append(["Time (s)", "Stroke (mm)", "Force (N)"])
            for row in zip(T / (1 + (n == 2)), X, force(n / 4, n), strict=True):
                sheet.append(list(map(float, row)))
        book.save(tmp_path / "all.xlsx")
        return import_files([tmp_path])

    openpyxl = pytest.importorskip("openpyxl")
    assert list(by_id(workbook((1, 2, 1), ("", "", ""))).values()) == [0.25, 0.5, 0.75]
    assert [refusal.error.code for refusal in workbook((2, 1, 1), ("", "", "")).refusals] == [
        "E_MOTION_CONTRADICTS"
    ] * 3
    (refusal,) = workbook((1, 2, 1), ("", "", "aborted")).refusals
    assert (refusal.error.code, refusal.run) == ("E_DISCARDED", "all_Test_3")


@pytest.mark.parametrize(
    ("line", "contradicts"),
    [
        ("Note: the force column is in N (the header of the template says kN).", True), ("Force: N", True),
        ("All forces in N.", True), ("| force | load cell | N |", True),
        ("Columns: time: t in s; force: load in N", True),
        ("Spalten: Zeit in s, Kraft in N", True), ("Columnas: tiempo en s, fuerza en N.", True),
        ("| force | peak | 900 N |", False),
        ("Colonnes du tableau 2: force en N", False),
        ("| force | N |", True), ("Kraft in kN", False), ("load cell: 25 N", False), ("peak forces in N", False),
        ("The forces of the paper are in N", False), ("Force in N (until 2020); force in kN (since 2021)", False),
    ],
)  # fmt: skip
def test_a_unit_that_a_text_states_otherwise_than_the_heading_is_asked_about(tmp_path, line, contradicts):
    (tmp_path / "a_0.5A.csv").write_text(HEAD.replace("[N]", "(kN)") + rows(T, X, force(0.5)))
    (tmp_path / "README.md").write_text(f"# Tests\n\n{line}\n")
    refusals = import_files([tmp_path]).refusals
    assert [(r.error.code, "in kN" in r.error.found, "in N" in r.error.found) for r in refusals] == (
        [("E_AMBIGUOUS", True, True)] * contradicts
    )
    for unit, factor in (("N", 1.0), ("kN", 1e3)):
        (record,) = import_files([tmp_path], parse_profile(f'[channels.force]\nunit = "{unit}"')).records
        assert record.force == pytest.approx(factor * force(0.5), abs=1e-2 * factor)


def test_a_test_without_a_channel_among_others_in_a_structure_is_refused_and_other_tables_are_named(tmp_path):
    with h5py.File(tmp_path / "rig.h5", "w") as file:
        for n, amperes in enumerate((0.0, 0.5, 1.0), 1):
            group = file.create_group(f"run_{n}")
            group.attrs["current_A"] = amperes
            for name, values, unit in (("time", T, "s"), ("displacement", X, "mm"), ("force", force(amperes, n), "N")):
                if (n, name) != (3, "force"):
                    group.create_dataset(name, data=values).attrs["units"] = unit
        sensor = file.create_group("sensor check")
        for name, unit in (("time", "s"), ("displacement", "mm")):
            sensor.create_dataset(name, data=T[:40]).attrs["units"] = unit
    result = import_files([tmp_path])
    assert by_id(result) == {"rig_run_1": 0.0, "rig_run_2": 0.5}
    (refusal,) = result.refusals
    assert refusal.error.code == "E_COLUMN"
    assert "table run_3: no column is known to be force" in str(refusal.error)
    assert any("not taken for tests: sensor check" in finding.text for finding in result.records[0].findings)
    assert not import_files([tmp_path], parse_profile('[file]\nleave_out = ["run_3"]')).refusals


def test_a_plan_that_names_some_of_the_tests_is_compared_with_them(tmp_path):
    write_tests(tmp_path, (0.25, 0.5, 0.75, 1.0), heads="# coil current: {} A\n" + HEAD)
    (tmp_path / "plan.csv").write_text("Run,Current [A],Remark\nrun_1,0.25,\nrun_2,0.5,INVALID\nrun_3,1.5,\n")
    refused = {refusal.run: refusal.error.code for refusal in import_files([tmp_path]).refusals}
    assert refused == {"run_2": "E_DISCARDED", "run_3": "E_CURRENT_CONTRADICTS"}
    (tmp_path / "tests.csv").write_text("file,current_A\nrun_3.csv,0.75\n")
    result = import_files([tmp_path], parse_profile('[file]\nleave_out = ["run_2.csv"]'))
    assert by_id(result) == {"run_1": 0.25, "run_3": 0.75, "run_4": 1.0}
    assert any("tests.csv decides: plan.csv" in finding.text for finding in result.records[1].findings)


@pytest.mark.parametrize(
    ("line", "stated"),
    [
        ("The forces are in N (the template says kN).", [("force", "N")]),
        ("displacement (mm), force (kN)", [("displacement", "mm"), ("force", "kN")]),
        ("Время в секундах, сила в килоньютонах", [("time", "секундах"), ("force", "килоньютонах")]),
        ("| Amplitude (mm) | Current (A) | Force (kN) |", []), ("Test  Current (A)  Force (kN)", []),
        ("Figure 1: force (kN), displacement (mm)", []), ("model.py expects displacement in m, force in kN.", []),
        ("Max. values: Displacement (mm): 10.0, Force (kN): 1.2", []),
    ],
)  # fmt: skip
def test_a_line_on_something_else_states_no_units_of_columns(line, stated):
    assert units_in(line) == stated


@pytest.mark.parametrize("rest", ["", "0"])
def test_a_plan_that_counts_the_rests_of_a_session_gives_its_tests_no_currents(tmp_path, rest):
    pause = np.zeros(300)
    x = np.concatenate([np.r_[X, pause] for _ in range(3)])
    f = np.concatenate([np.r_[force(i, n), pause] for n, i in enumerate((0.25, 0.5, 1.0))])
    (tmp_path / "session.csv").write_text(HEAD + rows(0.005 * np.arange(x.size), x, f))
    steps = "".join(f"{2 * n + 1},rest,{rest}\n{2 * n + 2},sine,{i}\n" for n, i in enumerate((0.25, 0.5, 1.0)))
    (tmp_path / "plan.csv").write_text(f"Step,Type,Current [A]\n{steps}")
    result = import_files([tmp_path])
    assert not result.records
    assert {refusal.error.code for refusal in result.refusals} == {"E_CURRENT_MISSING"}


def test_a_stroke_that_all_tests_of_a_plan_have_may_be_the_dampers(tmp_path):
    for n, size in enumerate((1.0, 0.4, 1.6), 1):
        (tmp_path / f"run_{n}.csv").write_text(HEAD + rows(T, size * X, force(n / 4, n)))
    (tmp_path / "plan.csv").write_text("Run,Stroke [mm],Current [A]\n1,55,0.25\n2,55,0.5\n3,55,0.75\n")
    assert currents(import_files([tmp_path]).records) == [0.25, 0.5, 0.75]


def test_a_current_that_heat_lowers_does_not_excuse_a_force_that_fades(tmp_path):
    t, x, steady = (np.r_[channel, more] for channel, more in ((T, 3 + T), (X, X), (force(1.0, 1), force(1.0, 2))))
    fading, current = np.linspace(1.0, 0.5, t.size), np.linspace(1.0, 0.93, t.size)
    heads = "time [s],displacement [mm],force [N],current [A]\n"
    (tmp_path / "run_1.csv").write_text(heads + rows(t, x, fading * steady, current))
    (record,) = import_files([tmp_path]).records
    assert "W_UNSTEADY" in {finding.code for finding in record.findings}


NS = [f"{1_600_000_000_000_000_000 + round(1e9 * t)}" for t in T]
FILES_OF_CHANNELS = {  # text beside the folders of the tests, and files of each: what is above the rows, the rows
    "columns by their numbers": (
        "- `Tn_disp.out`: column 1 time (sec), column 2 damper displacement (mm)\n"
        "- `Tn_force.out`: column 1 time (sec), column 2 damper force (kN)\n\n"
        "| Test | Freq. (Hz) | Current (A) |\n|---|---|---|\n| T1 | 1 | 0.25 |\n| T2 | 1 | 0.5 |\n",
        {
            "exp/T{n}_disp.out": lambda f: rows(T, X, separator=" "),
            "exp/T{n}_force.out": lambda f: rows(T, f / 1e3, separator=" "),
        },
    ),
    "topics of a table": (
        "| topic | type | unit |\n|---|---|---|\n| /rig/lvdt | Stamped, piston displacement | mm |\n"
        "| /rig/cell | Stamped, force | N |\n| /rig/coil_current | Stamped, coil current | A |\n",
        {
            "bag_{n}/_slash_rig_slash_lvdt.csv": lambda f: topic("field.data", X),
            "bag_{n}/_slash_rig_slash_cell.csv": lambda f: topic("field.data", f),
            "bag_{n}/_slash_rig_slash_coil_current.csv": lambda f: topic("field.data", np.full(T.size, amperes(f))),
        },
    ),
    "columns by the ends of their names": (
        "joints: position0 [m] of the piston\nwrench: the damper force is force.z [N] of the sensor; x is parasitic\n"
        "coil_current: data = measured coil current [A]\n",
        {
            "run_{n}/joints.csv": lambda f: topic("field.position0", X / 1e3),
            "run_{n}/wrench.csv": lambda f: topic("field.wrench.force.x,field.wrench.force.z", 0 * X, f),
            "run_{n}/coil_current.csv": lambda f: topic("field.data", np.full(T.size, amperes(f))),
        },
    ),
    "scales by the numbers of channels": (
        "Calibration:\n  CH1 LVDT      displacement   5 mm/V\n  CH2 Cell  force     250 N/V\n"
        "  CH3 LEM  coil current  1 A/V\n",
        {
            "T{n}/CH1_LVDT.asc": lambda f: volts(1, "LVDT", X / 5),
            "T{n}/CH2_Cell.asc": lambda f: volts(2, "Load Cell", f / 250),
            "T{n}/CH3_LEM.asc": lambda f: volts(3, "LEM", np.full(T.size, amperes(f))),
        },
    ),
    "names of files alone": (
        "",
        {
            "run{n}_{i}A_disp_mm.txt": lambda f: f"Sample rate: 200 Hz\n{rows(X)}",
            "run{n}_{i}A_force_N.txt": lambda f: f"Sample rate: 200 Hz\n{rows(f)}",
        },
    ),
}  # fmt: skip


def topic(names, *values):
    lines = (",".join([stamp, *(f"{v:.6f}" for v in row)]) for stamp, *row in zip(NS, *values, strict=True))
    return "\n".join([f"%time,{names}", *lines, ""])


def volts(number, name, values):
    return f"; Channel {number}: {name}\n; Unit: V\n; Sample rate: 200 Hz\n{rows(values)}"


def amperes(load: np.ndarray) -> float:
    return 0.25 if np.max(load) < 500 else 0.5


@pytest.mark.parametrize("form", FILES_OF_CHANNELS)
def test_a_file_for_each_channel_is_named_by_a_text_or_by_its_own_name(tmp_path, form):
    text, files = FILES_OF_CHANNELS[form]
    (tmp_path / "README.md").write_text(f"Tests of a damper.\n\n{text}")
    for n, current in enumerate((0.25, 0.5), 1):
        for name, content in files.items():
            path = tmp_path / name.format(n=n, i=current)
            path.parent.mkdir(exist_ok=True)
            path.write_text(content(force(current, n)))
    result = import_files([tmp_path])
    assert currents(result.records) == [0.25, 0.5], result.refusals
    for record, current in zip(result.records, (0.25, 0.5), strict=True):
        assert np.ptp(record.force) == pytest.approx(np.ptp(force(current)), rel=0.02)
        assert np.ptp(record.displacement) == pytest.approx(0.02, rel=0.01)


def test_rows_of_one_key_below_the_names_are_units_or_none_of_the_names(tmp_path):
    heads = "time,x,F\n,Type: double,Type: double\n,Unit: mm,Unit: N\n,Block Path: rig/in:1,Block Path: rig/in:2\n"
    (tmp_path / "a_0.5A.csv").write_text(heads + rows(T, X, force(0.5)))
    (record,) = import_files([tmp_path]).records
    assert record.provenance["columns"] == "time = time in s, displacement = x in mm, force = F in N"


def test_names_and_units_in_persian_and_a_rate_in_russian_are_read(tmp_path):
    (tmp_path / "a_0.5A.csv").write_text("زمان (ثانیه),جابجایی (میلی\u200cمتر),نیرو (نیوتن)\n" + rows(T, X, force(0.5)))
    (tmp_path / "b_0.25A.txt").write_text(
        "Частота опроса, Гц: 200\n\nПеремещение, мм\tУсилие, Н\n" + rows(X, force(0.25), separator="\t")
    )
    assert currents(import_files([tmp_path]).records) == [0.25, 0.5]


@pytest.mark.parametrize(("heads", "count"), [(("1Hz", "2Hz"), 2), (("A", "B"), 0)])
def test_groups_of_columns_named_after_motions_are_tests_though_they_share_the_time(tmp_path, heads, count):
    slow = np.column_stack([T, X, force(0.5), 10 * np.sin(4 * np.pi * T), force(0.5)])
    slow[:, 4] = motion(2.0, 0.5, 1)[1]
    line = "Time (s)," + ",".join(f"Disp_{head} (mm),Force_{head} (N)" for head in heads)
    (tmp_path / "b_0.5A.csv").write_text(f"{line}\n{rows(*slow.T)}")
    assert len(import_files([tmp_path]).records) == count


@pytest.mark.parametrize(("older", "refused"), [((0.25, 0.45), []), ((0.35, 0.45, 0.6), ["run_1", "run_2", "run_3"])])
def test_two_versions_of_a_plan_are_not_taken_for_one(tmp_path, older, refused):
    """A small difference is stated; where one test differs by more, the others are of another version, too."""
    newer = (0.25, 0.5, 1.0)[: len(older)]
    write_tests(tmp_path, newer)
    for name, currents_of in (("plan_v1.csv", older), ("plan_v2.csv", newer)):
        rows_of = "".join(f"run_{n},{current}\n" for n, current in enumerate(currents_of, 1))
        (tmp_path / name).write_text(f"Test,Current (A)\n{rows_of}")
    result = import_files([tmp_path])
    assert sorted(Path(refusal.file).stem for refusal in result.refusals) == refused
    assert {refusal.error.code for refusal in result.refusals} <= {"E_CURRENT_CONTRADICTS"}
    told = [finding.text for record in result.records for finding in record.findings]
    assert any("plan_v2.csv" in text and "gives 0.5 A, run_2 has 0.45 A" in text for text in told) == (not refused)
    table = {r.id: (r.doubt is None, r.current is not None) for r in found_tests([tmp_path])[0]}
    agreed = {f"run_{n}" for n, (a, b) in enumerate(zip(older, newer, strict=True), 1) if a == b}
    assert {run for run, (sure, current) in table.items() if sure and current} == agreed
    cells = "".join(f"run_{n}.csv,{of}\n" for n, of in enumerate((older[0], *newer[1:]), 1))
    (tmp_path / "tests.csv").write_text(f"file,current_A\n{cells}")
    decided = [finding.text for record in import_files([tmp_path]).records for finding in record.findings]
    assert any("tests.csv decides: plan_v1.csv, Current (A) gives" in text for text in decided)
    assert any("tests.csv decides: plan_v2.csv, Current (A) gives" in text for text in decided) == bool(refused)


def test_a_table_of_cycle_maxima_beside_each_test_is_no_test_and_is_named_with_its_folder(tmp_path):
    for folder, amperes in (("A_0.25A", 0.25), ("B_0.5A", 0.5)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "timed.csv").write_text(HEAD + rows(T, X, force(amperes)))
        head = "Cycle,Displacement Maximum [mm],Displacement Minimum [mm],Force Maximum [N],Force Minimum [N]\n"
        (tmp_path / folder / "peaks.csv").write_text(head + "".join(f"{n},8.1,-8.0,403,-401\n" for n in range(1, 5)))
    result = import_files([tmp_path])
    assert not result.refusals
    assert [*by_id(result).values()] == [0.25, 0.5]
    assert sorted(result.left_out) == ["A_0.25A/peaks.csv", "B_0.5A/peaks.csv"]


def test_whole_numbers_without_a_unit_are_asked_for_a_scale_also_once_the_unit_is_set(tmp_path):
    columns = (T, np.round(4000 * X / 10), np.round(8 * force(0.5)))
    (tmp_path / "a_0.5A.csv").write_text("t_s,stroke,load\n" + rows(*columns))
    assert all("scale = ..." in refusal.error.remedy for refusal in import_files([tmp_path]).refusals)
    units = "[channels.displacement]\nunit = 'mm'\n[channels.force]\nunit = 'N'\n"
    (refusal,) = import_files([tmp_path], parse_profile(units)).refusals
    assert refusal.error.code == "E_RANGE"
    assert "in mm per count: [channels.displacement] scale" in refusal.error.remedy


def test_counts_of_a_converter_are_asked_for_their_scale_and_offset(tmp_path):
    counts = [np.round(4096 + 200 * X), np.round(4096 + 8 * force(0.5))]
    (tmp_path / "a_0.5A.csv").write_text("t_s,lvdt_adc,load_adc\n" + rows(T, *counts))
    remedies = [refusal.error.remedy for refusal in import_files([tmp_path]).refusals]
    assert all("offset = ... (value at zero counts)" in remedy for remedy in remedies)
    offsets = "[channels.displacement]\ncolumn = 2\nunit = 'mm'\nscale = 0.005\noffset = -20.48\n"
    offsets += "[channels.force]\ncolumn = 3\nunit = 'N'\nscale = 0.125\noffset = -512\n"
    (record,) = import_files([tmp_path], parse_profile(offsets)).records
    np.testing.assert_allclose(record.force, force(0.5), atol=0.1)


@pytest.mark.parametrize("filled", [None, '"', "ditto"])
def test_a_plan_in_a_workbook_may_merge_cells_or_repeat_by_ditto_marks(tmp_path, filled):
    write_tests(tmp_path, (0.25, 0.25, 0.5, 0.5), "B-0{}.csv")
    book = pytest.importorskip("openpyxl").Workbook()
    sheet = book.active
    for row in (["Structures Lab"], [], ["Test", "Coil current (A)", "Freq. (Hz)"], ["B-01", 0.25, 1],
                ["B-02", filled, 1], ["B-03", 0.5, 1], ["B-04", filled, 1]):  # fmt: skip
        sheet.append(row)
    if filled is None:
        for cells in ("A1:C1", "B4:B5", "B6:B7"):
            sheet.merge_cells(cells)
    book.save(tmp_path / "log sheet.xlsx")
    assert by_id(import_files([tmp_path])) == {"B-01": 0.25, "B-02": 0.25, "B-03": 0.5, "B-04": 0.5}


@pytest.mark.parametrize(
    ("nodes", "late"),
    [
        ("ns=4;s=Rig.Stroke,ns=4;s=Rig.Load", 0.0),
        ("ns=4;s=Rig.Stroke,ns=4;s=Rig.Load", 2e-4),
        ("ns=2;i=1042,ns=2;i=1043", 2e-4),
        ("Stroke,Load", 0.0),
    ],
)
def test_nodes_of_a_server_are_channels_with_the_units_of_a_list_or_of_a_profile(nodes, late, tmp_path):
    names = [node.strip() for node in nodes.split(",")]
    body = "".join(
        f'{t + late * n:.4f},"{node}",{value:.5f},Good\n'
        for t, x, f in zip(T, X, force(0.5), strict=True)
        for n, (node, value) in enumerate(zip(names, (x, f / 1e3), strict=True))
    )
    (tmp_path / "a_0.5A.csv").write_text(f"SourceTime_s,NodeId,Value,StatusCode\n{body}")
    (tmp_path / "tags.csv").write_text(
        f'NodeId,DisplayName,Units\n"{names[0]}",stroke of the rod,mm\n"{names[1]}",load cell,kN\n'
    )
    stated = "".join(
        f'[channels.{role}]\ncolumn = "{name}"\nunit = "{unit}"\n'
        for role, name, unit in zip(("displacement", "force"), names, ("mm", "kN"), strict=True)
    )
    for profile in ("", stated):
        (record,) = import_files([tmp_path], parse_profile(profile)).records
        np.testing.assert_allclose(record.force, force(0.5)[: record.force.size], atol=0.01)
        (tmp_path / "tags.csv").unlink(missing_ok=True)
    problems = " ".join(str(refusal.error) for refusal in import_files([tmp_path]).refusals)
    assert problems
    assert "SourceTime_s' and differ" not in problems


@pytest.mark.parametrize("form", ["I = {} A", "I={} A, 1 Hz", "{} A"])
@pytest.mark.parametrize("long", [True, False])
@pytest.mark.parametrize("folder", ["data", "I0.75A"])
def test_a_column_of_conditions_states_the_current_of_each_trial_and_not_the_folder(form, long, folder, tmp_path):
    lines = ["trial,condition,time_s,signal,value,unit" if long else "trial,condition,time_s,displacement_mm,force_N"]
    for trial, current in enumerate((0.25, 0.5), 1):
        for t, x, f in zip(T, X, force(current, trial), strict=True):
            start = f'{trial},"{form.format(current)}",{t:.4f}'
            cells = (f"displacement,{x:.5f},mm", f"force,{f:.4f},N") if long else (f"{x:.5f},{f:.4f}",)
            lines += [f"{start},{cell}" for cell in cells]
    (tmp_path / folder).mkdir()
    (tmp_path / folder / "session.csv").write_text("\n".join([*lines, ""]))
    assert by_id(import_files([tmp_path / folder])) == {"session_1": 0.25, "session_2": 0.5}


@pytest.mark.parametrize(("start", "samples", "frozen"), [(1.246, 5, False), (1.1, 60, True)])
def test_readings_in_steps_that_decimals_round_may_repeat_at_a_turning_point(start, samples, frozen, tmp_path):
    step = 0.00763  # mm
    noise = np.random.default_rng(1).standard_normal((2, 4000))
    t = 0.002 * np.arange(4000)
    stroke = step * np.round(10 * np.sin(2 * np.pi * t) / step + 1.2 * noise[0])
    first = round(start / 0.002)
    stroke[first : first + samples] = stroke[first]
    load = 300 * np.tanh(6 * np.cos(2 * np.pi * t)) + 100 * np.cos(2 * np.pi * t) + noise[1]
    (tmp_path / "a_0.5A.csv").write_text("t_s,stroke_mm,load_N\n" + rows(t, np.round(stroke, 3), np.round(load, 3)))
    codes = {finding.code for finding in import_files([tmp_path]).records[0].findings}
    assert ("W_FROZEN" in codes) == frozen
