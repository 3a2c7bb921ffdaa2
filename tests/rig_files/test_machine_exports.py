"""Exports of testing machines, controllers and loggers, as whole folders: each gives the tests it was made of."""

import json
from datetime import datetime, timedelta

import numpy as np
import pytest
from openpyxl import Workbook
from scipy.io import savemat

from mrdamper import import_files
from mrdamper.rig_files.profile import Profile, parse_profile
from mrdamper.rig_files.profile_template import profile_template

T = np.arange(1001) / 250
X = 10 * np.sin(2 * np.pi * T + 0.3)  # [mm]
CURRENTS = (0.0, 0.6)


def force(amperes):
    noise = np.random.default_rng(3).normal(0, 1, T.size)
    return (150 + 400 * amperes) * np.tanh(8 * np.cos(2 * np.pi * T + 0.3)) + noise


def rows(write, amperes=0.6):
    return "".join(write(*row) + "\n" for row in zip(T, X, force(amperes), strict=True))


def expect(folder, *currents, profile=""):
    result = import_files([folder], parse_profile(profile))
    assert not [str(refusal.error) for refusal in result.refusals]
    means = [float(np.mean(record.current)) for record in result.records if record.current is not None]
    assert means == pytest.approx(currents, abs=1e-6)
    for record, amperes in zip(result.records, currents, strict=True):
        np.testing.assert_allclose(record.time - record.time[0], T, rtol=0, atol=1e-4)
        np.testing.assert_allclose(record.displacement, 1e-3 * X, rtol=0, atol=2e-6)
        np.testing.assert_allclose(record.force, force(amperes), rtol=0, atol=0.1)


def test_a_clock_has_the_name_of_its_channel_in_any_language(tmp_path):
    body = "".join(
        f"{t:.4f};{f:.3f};{t:.4f};{x:.5f};{f'{s:.4f};0.6' if s < T[-1] + 0.02 else ';'}\n"
        for t, s, x, f in zip(T, 0.04 * np.arange(T.size), X, force(0.6), strict=True)
    )
    head = "Čas_Síla [s];Síla [N];Čas_Zdvih [s];Zdvih [mm];Čas_Proud [s];Proud cívky [A]\n"
    (tmp_path / "mereni.csv").write_text(head + body, "utf-8")
    expect(tmp_path, 0.6)
    (finding,) = (f for f in import_files(tmp_path).records[0].findings if f.code == "W_RASTER")
    assert finding.text.endswith("the force's: Proud cívky")  # the clock of Zdvih is the same


def test_a_sheet_of_means_over_the_tests_is_no_table_of_results(tmp_path):
    book = Workbook()
    results, means = book.create_sheet("Ergebnisse"), book.create_sheet("Statistik")
    book.remove(book.worksheets[0])
    for line in (["Nr", "Erregerstrom", "Arbeit"], ["", "mA", "J"], [1, 0, 5.2], [2, 600, 9.1]):
        results.append(line)
    for line in (["Serie", "Erregerstrom"], ["n = 2", "mA"], ["x", 300], ["s", 424], ["v", 140]):
        means.append(line)
    for number, amperes in enumerate(CURRENTS, 1):
        sheet = book.create_sheet(f"Probe {number}")
        for line in (["Zeit", "Weg", "Kraft"], ["s", "mm", "N"], *zip(T, X, force(amperes), strict=True)):
            sheet.append([cell if isinstance(cell, str) else float(cell) for cell in line])
    book.save(tmp_path / "serie.xlsx")
    expect(tmp_path, *CURRENTS)


@pytest.mark.parametrize(("name", "read"), [("Probe_MR_0.6A", True), ("probe_0.6A", False), ("hall probe 0.6A", False)])
def test_a_specimen_is_called_probe_in_german(tmp_path, name, read):
    (tmp_path / f"{name}.csv").write_text("t [s],x [mm],F [N]\n" + rows(lambda t, x, f: f"{t:.4f},{x:.5f},{f:.3f}"))
    result = import_files([tmp_path])
    assert [refusal.error.code for refusal in result.refusals] == [] if read else ["E_CURRENT_MISSING"]
    assert len(result.records) == read


def test_properties_of_a_channel_state_its_scale(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    clock = {"wf_increment": 0.004, "wf_start_offset": 0.0, "wf_samples": T.size, "unit_string": "V"}
    channels = (("Position", X / 5, "5 mm/V"), ("Load cell", force(0.6) / 200, "200 N/V"))
    with nptdms.TdmsWriter(str(tmp_path / "run 0.6 A.tdms")) as writer:
        for name, values, scale in channels:
            writer.write_segment([nptdms.ChannelObject("run", name, values, {**clock, "Sensitivity": scale})])
    expect(tmp_path, 0.6)


@pytest.mark.parametrize("key", ["Strom_Einheit", "Strom unit"])
def test_a_property_of_a_group_has_the_unit_that_another_property_states(tmp_path, key):
    nptdms = pytest.importorskip("nptdms")
    channels = (("Zeit", "s", T), ("Weg", "mm", X), ("Kraft", "N", force(0.6)))
    with nptdms.TdmsWriter(str(tmp_path / "Kennfeld.tdms")) as writer:
        writer.write_segment([nptdms.GroupObject("V1", {"Strom": 0.6, key: "A", "Ruhestrom": 0.1})])
        for name, unit, values in channels:
            writer.write_segment([nptdms.ChannelObject("V1", name, values, {"unit_string": unit})])
    expect(tmp_path, 0.6)


def test_keys_of_nested_structures_are_known_in_other_languages(tmp_path):
    channels = [("Przemieszczenie", "mm", X), ("Siła", "N", force(0.6))]
    tree = {
        "badanie": {"prad_cewki": {"wartosc": 0.6, "jednostka": "A"}},
        "czestotliwosc_probkowania_Hz": 250,
        "kanaly": [{"nazwa": name, "jednostka": unit, "dane": list(values)} for name, unit, values in channels],
    }
    (tmp_path / "badanie.json").write_text(json.dumps(tree))
    expect(tmp_path, 0.6)


def test_names_of_columns_are_explained_behind_an_equals_sign(tmp_path):
    head = "Scan rate: 250 Hz\ny0 = AIN0: y=10*(v), Units: mm, position\ny1 = AIN1: y=200*(v), Units: N, force\n"
    body = rows(lambda t, x, f: f"{t:.4f}\t{x / 10:.6f}\t{f / 200:.6f}\t{x:.5f}\t{f:.3f}")
    (tmp_path / "data 600mA.dat").write_text(f"{head}\nTime\tv0\tv1\ty0\ty1\n{body}")
    expect(tmp_path, 0.6)


@pytest.mark.parametrize("times", ["Time_ms", "Time"])
def test_days_since_1900_need_no_unit_and_their_millionths_the_dates_beside_them(tmp_path, times):
    start = datetime(2024, 3, 12, 10, 15, 2)
    body = ""
    for t, x, f in zip(T, X, force(0.6), strict=True):
        moment = start + timedelta(seconds=float(t))
        days = (moment - datetime(1899, 12, 30)) / timedelta(days=1)
        for name, value in (("Weg_mm", x), ("Kraft_N", f), ("Spulenstrom_A", 0.6)):
            clock = f"{1e6 * days:.4f}" if times == "Time_ms" else f"{days:.11f}"
            body += f'"{name}";"{moment:%d.%m.%Y %H:%M:%S}";{value:.4f};1;{clock}\n'
    stamps = "TimeString" if times == "Time_ms" else "Remark"
    (tmp_path / "trend.csv").write_text(f'"VarName";"{stamps}";"VarValue";"Validity";"{times}"\n{body}')
    expect(tmp_path, 0.6)


@pytest.mark.parametrize(("frequency", "code"), [(1, ""), (2, "E_COLUMN")])
def test_a_rate_without_a_unit_counts_where_the_motion_has_the_frequency_that_is_stated(tmp_path, frequency, code):
    head = f"CONTROLLER ASCII DATA FILE\nTITLE=damper 0.6 A sine {frequency} Hz\nSAMPLE_RATE=250\n"
    for number, (name, unit, scale) in enumerate((("Displacement", "mm", 0.001), ("Force", "N", 0.05)), 1):
        head += f"CHAN_{number}_NAME={name}\nCHAN_{number}_UNITS={unit}\nCHAN_{number}_SCALE={scale}\n"
    body = rows(lambda t, x, f: f"{round(x / 0.001):7d}{round(f / 0.05):8d}")
    (tmp_path / "run.asc").write_text(f"{head}DATA=INTEGER\n{body}")
    if code:
        assert [refusal.error.code for refusal in import_files([tmp_path]).refusals] == [code]
    else:
        expect(tmp_path, 0.6)


def test_lines_of_channels_units_and_remarks_above_the_names_are_read(tmp_path):
    head = "Channel;ACT1.Position;ACT1.Force;AI3.CoilMonitor\nUnit;mm;N;V\nRemark;LVDT;load cell;current 0.5 A/V\n"
    body = rows(lambda t, x, f: f"{t:.4f};{x:.5f};{f:.3f};1.2")
    (tmp_path / "rec.csv").write_text(f"Controller;V4\n{head}Time [s];C1;C2;C3\n{body}")
    expect(tmp_path, 0.6)


@pytest.mark.parametrize("separator", ["; ", ",", "  "])
def test_rows_that_name_every_value_are_a_table(tmp_path, separator):
    row = separator.join(("t={:.0f} ms", "pos={:.5f} mm", "F={:.3f} N", "pwm=102"))
    text = "=~=~= PuTTY log =~=~=\nHX711 ok\n" + rows(lambda t, x, f: row.format(1000 * t, x, f))
    (tmp_path / "putty.log").write_text(text)
    (tmp_path / "README.txt").write_text("pwm 255 = 1.5 A in the coil\n")
    expect(tmp_path, 0.6)
    (tmp_path / "putty.log").write_text(text.replace("t=2000 ms", "t=2000x ms"))
    (refusal,) = import_files([tmp_path]).refusals
    assert "line 503" in str(refusal.error)


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("new driver: pwm 255 = 1.5 A\nold driver: pwm 255 = 3 A\n", "102"),
        ("pwm 255 = 1.5 A, pwm 20 = 0 A\n", "102"),
        ("pwm 255 = 1.5 A\npwm 20 = 0 A\n", "102"),
        ("pwm 255 = 1.5 A\n", "0.6"),
        ("dac 255 = 1.5 A\n", "102"),
    ],
    ids=["two drivers", "two points", "two points on lines", "no whole numbers", "another name"],
)
def test_numbers_of_a_converter_with_an_unclear_scale_are_asked_about(tmp_path, text, number):
    body = rows(lambda t, x, f: f"{t:.4f},{x:.5f},{f:.3f},{number}")
    (tmp_path / "a.csv").write_text("t [s],x [mm],F [N],pwm\n" + body)
    (tmp_path / "README.txt").write_text(text)
    assert not import_files([tmp_path]).records


def test_rows_with_another_unit_of_the_same_quantity_are_scaled_and_others_named(tmp_path):
    def write(unit, factor):
        row = "t={:.4f} s; pos={:.5f} mm; F={:.7f} {}".format
        return rows(lambda t, x, f: row(t, x, f if abs(f) < 300 else factor * f, "N" if abs(f) < 300 else unit))

    (tmp_path / "run_0.6A.log").write_text(write("kN", 1e-3))
    expect(tmp_path, 0.6)
    (tmp_path / "run_0.6A.log").write_text(write("V", 1.0))
    (refusal,) = import_files([tmp_path]).refusals
    assert "line 47: F in N, in other rows in V; export" in str(refusal.error)


def test_a_list_beside_folders_names_them_by_their_currents(tmp_path):
    profile = '[file]\nnames = ["t [s]", "y"]\n'
    for role, number, unit in (("displacement", 1, "mm"), ("force", 2, "N")):
        profile += f'[channels.{role}]\nfile = "{{run}}CH{number}.CSV"\ncolumn = 2\nunit = "{unit}"\n'
    for number, amperes in enumerate(CURRENTS):
        folder = tmp_path / f"ALL{number:04d}"
        folder.mkdir()
        for channel, values in enumerate((X, force(amperes)), 1):
            body = "".join(f"{t:.4f},{y:.5f}\n" for t, y in zip(T, values, strict=True))
            (folder / f"F{number:04d}CH{channel}.CSV").write_text(body)
    listed = [f"ALL{number:04d}: {amperes} A, 1 Hz" for number, amperes in enumerate(CURRENTS)]
    (tmp_path / "README.txt").write_text("\n".join(listed))
    expect(tmp_path, *CURRENTS, profile=profile)


def test_a_clock_before_every_channel_of_a_controllers_trace_is_a_time(tmp_path):
    head = "Name\tScope YT\n\nName\tPos_mm\tName\tForce_N\tName\tCoilCurrent_A\n" + "\t".join(["SampleTime[ms]\t4"] * 3)
    head += "\n" + "\t".join(["Data-Type\tREAL64"] * 3)
    body = rows(lambda t, x, f: f"{1000 * t:.0f}\t{x:.5f}\t{1000 * t:.0f}\t{f:.3f}\t{1000 * t:.0f}\t0.6")
    (tmp_path / "scope.txt").write_text(f"{head}\n\n{body}")
    expect(tmp_path, 0.6)


def test_the_interval_above_the_samples_gives_a_clock_its_unit(tmp_path):
    body = rows(lambda t, x, f: f"{t:.4E},{x:.5f},{f:.3f}")
    (tmp_path / "AUTO_0.6A.csv").write_text(f'"Interval","4ms"\n"Time","CH1-1[mm]","CH1-2[N]"\n{body}')
    expect(tmp_path, 0.6)


def test_a_line_that_lists_a_channel_with_its_gain_states_no_current(tmp_path):
    listed = '"CH1-1","Stroke","1.0E+00","mm"\n"CH1-2","Force","1.0E+00","N"\n"CH2-1","Coil current","1.0E+00","A"\n'
    body = rows(lambda t, x, f: f"{t:.4E},{x:.5f},{f:.3f},0.6")
    (tmp_path / "wave.csv").write_text(f'{listed}"Time[s]","CH1-1[mm]","CH1-2[N]","CH2-1[A]"\n{body}')
    expect(tmp_path, 0.6)
    body = rows(lambda t, x, f: f"{t:.4E},{x:.5f},{f:.3f}")  # the current is listed, and not exported
    (tmp_path / "wave.csv").write_text(f'{listed}"Time[s]","CH1-1[mm]","CH1-2[N]"\n{body}')
    (refusal,) = import_files([tmp_path]).refusals
    assert refusal.error.code == "E_CURRENT_MISSING"


@pytest.mark.parametrize("together", [True, False])
def test_functions_of_a_vibration_analyser_are_channels_whose_unit_is_asked_for_unless_it_is_of_si(tmp_path, together):
    channels = (("Stroke:S", "mm", X), ("Force:+Z", "N", force(0.6)), ("Coil current", "A", np.full(T.size, 0.6)))
    names, units, samples = zip(*channels, strict=True)
    clock = {"start_value": 0.0, "increment": 1 / 250, "number_of_values": T.size, "quantity": {"label": "s"}}

    def function(names, units, values):
        quantity = [{"label": unit} for unit in units]
        return {
            "x_values": clock,
            "y_values": {"values": values, "quantity": quantity},
            "function_record": {"name": np.array(names, dtype=object)},
        }

    apart = {f"Signal_{i}": function([n], [u], y[:, None]) for i, (n, u, y) in enumerate(channels)}
    whole = {"Signal": function(names, units, np.column_stack(samples))}
    savemat(tmp_path / "run.mat", whole if together else apart)
    (refusal,) = import_files([tmp_path]).refusals
    assert str(refusal.error).count("has no unit") == 1
    assert "[channels.displacement] unit" in refusal.error.remedy
    expect(tmp_path, 0.6, profile='[channels.displacement]\nunit = "mm"\n')


@pytest.mark.parametrize("end", [",,,", ",,"])
def test_a_row_of_units_may_end_with_the_start_and_the_step_of_the_samples(tmp_path, end):
    body = "".join(f"{i},{x / 5:.6f},{f / 300:.6f}{end}\n" for i, (x, f) in enumerate(zip(X, force(0.6), strict=True)))
    head = "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-5.0e-01,4.0e-03,\n"
    (tmp_path / "scope 0.6A.csv").write_text(head + body)
    (tmp_path / "readme.txt").write_text("CH1: displacement 5 mm/V\nCH2: force 300 N/V\n")
    (refusal,) = import_files([tmp_path]).refusals
    assert "[file] sample_rate_Hz" in refusal.error.remedy
    expect(tmp_path, 0.6, profile="[file]\nsample_rate_Hz = 250\n")


def test_a_folder_of_an_oscilloscope_has_a_file_for_each_channel_and_notes_beside_its_rows(tmp_path):
    notes = [
        "Record Length,1001,",
        "Source,{},Second",
        "Vertical Units,V,",
        "Horizontal Units,s,",
        "Model Number,TDS2014,",
    ]
    for number, amperes in enumerate(CURRENTS):
        folder = tmp_path / f"ALL{number:04d}"
        folder.mkdir()
        for channel, values in (("CH1", X / 4), ("CH2", force(amperes) / 100)):
            beside = [note.format(channel) for note in notes] + [",,"] * (T.size - len(notes))
            body = "".join(f"{note},{t - 2:.4f},{y:.6f},\n" for note, t, y in zip(beside, T, values, strict=True))
            (folder / f"F{number:04d}{channel}.CSV").write_text(body)
    listed = [f"ALL{number:04d}: {amperes} A, 1 Hz\n" for number, amperes in enumerate(CURRENTS)]
    (tmp_path / "README.txt").write_text("CH1 = LVDT, 4 mm/V\nCH2 = load cell, 100 N/V\n" + "".join(listed))
    expect(tmp_path, *CURRENTS)
    (tmp_path / "README.txt").write_text("".join(listed))
    for refusal in import_files([tmp_path]).refusals:  # the list of tests waits for the columns
        assert refusal.error.code == "E_COLUMN"
        assert "current" not in refusal.error.remedy
    (tmp_path / "README.txt").unlink()
    written, _ = profile_template([tmp_path], Profile())
    asked = [f'"{number:04d}" =' for number in range(len(CURRENTS))]
    assert written.endswith("#[current.values]\n" + "".join(f"#{line}\n" for line in asked))
    for channel, name, unit, scale in (("displacement", "CH1", "mm", 4), ("force", "CH2", "N", 100)):
        stated = f'file = "F{{run}}{name}.CSV"\ncolumn = "{name}"\nunit = "{unit}"\nscale = {scale}\n'
        written = written.replace(f"[channels.{channel}]\n", f"[channels.{channel}]\n{stated}")
    for number, current in enumerate(CURRENTS):
        written = written.replace(f'#"{number:04d}" =', f'"ALL{number:04d}" = {current}')  # by its folder
    expect(tmp_path, *CURRENTS, profile=written.replace("#[current.values]", "[current.values]"))


def test_a_long_table_is_known_by_what_stands_in_its_columns(tmp_path):
    body = ""
    for t, x, f in zip(T, X, force(0.6), strict=True):
        for name, unit, value in (("Zdvih", "mm", x), ("Síla", "N", f), ("Proud cívky", "A", 0.6)):
            body += f"{name};{t:.4f};{value:.4f};{unit}\n"
    (tmp_path / "archiv.csv").write_text(f"Veličina;Čas [s];Naměřeno;Jedn.\n{body}")
    expect(tmp_path, 0.6)


def test_tables_of_a_database_are_joined_by_their_numbers(tmp_path):
    rows = [
        f"{run},{channel},{t:.4f},{value:.4f}"
        for run, amperes in enumerate(CURRENTS, 1)
        for t, x, f in zip(T, X, force(amperes), strict=True)
        for channel, value in ((1, x), (2, f), (3, 24.0))
    ]
    (tmp_path / "samples.csv").write_text("\n".join(["run_id,channel_id,t_s,value", *rows, ""]))
    (tmp_path / "channels.csv").write_text("id,name,unit\n1,displacement,mm\n2,force,N\n3,temperature,degC\n")
    runs = "".join(f"{run},MR-4,{amperes}\n" for run, amperes in enumerate(CURRENTS, 1))
    (tmp_path / "runs.csv").write_text("id,damper,current_A\n" + runs)
    expect(tmp_path, *CURRENTS)
    (tmp_path / "samples.csv").write_text("\n".join(["run_id,channel_id,t_s,value", *rows[:-1], ""]))
    sizes = [record.time.size for record in import_files([tmp_path]).records]
    assert sizes == [*[T.size] * (len(CURRENTS) - 1), T.size - 1]  # the last sample is cut


@pytest.mark.parametrize(
    ("counter", "number", "profile", "noted"),
    [
        ("RecordNo", "", "", "Test"),
        ("Measurement No.", "Uhrzeit", '[file]\nrun_column = "Test"', "Test"),
        ("Run", "UTC Time", "", "Run"),
        ("Datum", "Uhrzeit", '[file]\nleave_out = ["Datum"]', "Test"),
    ],
)  # a time of day is no clock of the column of tests behind it
def test_numbers_of_tests_stand_beside_other_counters_and_clocks(tmp_path, counter, number, profile, noted):
    """Rows numbered 0 belong to no test and are omitted, although the damper moves in them."""
    lines, at = [], 0
    for test, amperes in ((0, 0.2), (1, 0.0), (0, 0.2), (2, 0.6), (0, 0.2)):
        for x, f in zip(X, force(amperes), strict=True):
            first = test if counter == "Run" else "12.11.2024" if counter == "Datum" else at
            clock = f"{(datetime(2024, 11, 12, 9) + timedelta(milliseconds=4 * at)):%H:%M:%S},"
            beside = 7 if counter == "Run" else test
            lines.append(f"{first},{clock if number else ''}{beside},{4 * at},{x:.5f},{f:.3f},{1e3 * amperes:.0f}\n")
            at += 1
    head = f"{counter},{number and f'{number},'}Test,T_ms,Position_mm,Force_N,Current_mA\n"
    (tmp_path / "shift.csv").write_text(head + "".join(lines))
    expect(tmp_path, 0.0, 0.6, profile=profile)
    findings = import_files([tmp_path], parse_profile(profile)).records[0].findings
    assert [f.text for f in findings] == [f"the rows of '0' in {noted!r}, before and after the tests, are omitted"]


def table(head, write=lambda t, x, f: f"{t:.4f},{x:.5f},{f:.3f}", amperes=0.6):
    return f"{head}\n" + rows(write, amperes)


def series(*channels, **beside):
    of_each = [{"name": n, "unit": unit, "sampleRateHz": 250, "values": list(v)} for n, unit, v in channels]
    return json.dumps({**beside, "series": of_each})


PLAIN = "time [s],stroke [mm],force [N]"
RANGES = '"Channel","Signal","Range","Scaling"\n"CH1","Stroke","5V","1 V = 4 mm"\n"CH2","Load","10V","1 V = 200 N"\n'


@pytest.mark.parametrize(
    "files",
    [
        {"a.dat": table(f"COIL CURRENT (AMPS DC) ........ 0.60\nTEMPERATURE (DEGC) ..... 21.0\n{PLAIN}")},
        {"a.csv": table(f"{PLAIN},COIL_SET_A", lambda t, x, f: f"{t:.4f},{x:.5f},{f:.3f},0.6")},
        {"a 0.6 A.csv": table("Zeit [s],Sollhub [mm],Isthub [mm],Kraft [N]", lambda t, x, f: f"{t},{1.1 * x},{x},{f}")},
        {"a 0.6 A.csv": table("t [s],weg [1/10 mm],kraft [N]", lambda t, x, f: f"{t:.4f},{10 * x:.4f},{f:.3f}")},
        {
            "a 0.6 A.csv": table(
                "Stamp,Weg,Kraft\nOLE-Date,mm,N", lambda t, x, f: f"{45608.4 + t / 86400:.12f},{x:.5f},{f:.3f}"
            )
        },
        {"a 0.6 A.csv": RANGES + table("Time[s],CH1[V],CH2[V]", lambda t, x, f: f"{t},{x / 4:.6f},{f / 200:.6f}")},
        {
            "a.json": series(
                ("force", "N", force(0.6)),
                ("stroke", "mm", X),
                setpoints={"coil": {"value": 600, "unit": "mA"}},
            )
        },
        {
            "ensaio_01.csv": table(PLAIN),
            "plano.txt": "Ensaios 01 a 02: corrente 0,6 A\nEnsaios 03 a 04: corrente 0 A\n",
        },
    ],
)
def test_writings_of_industrial_exports_are_read(tmp_path, files):
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    expect(tmp_path, 0.6)


def test_a_number_that_is_no_current_of_the_coil_is_named_where_none_is_stated(tmp_path):
    channels = ("force", "N", force(0.6)), ("stroke", "mm", X)
    (tmp_path / "a.json").write_text(series(*channels, **{"Supply current (A)": 0.6}))
    (refusal,) = import_files([tmp_path]).refusals
    assert "number 'Supply current (A)' (of a limit, a supply or another device)" in refusal.error.found
