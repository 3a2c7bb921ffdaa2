"""Texts as programs of laboratories export them: each gives the samples it was made of."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timedelta

import numpy as np
import pytest

from mrdamper import import_files
from mrdamper.errors import InputError
from mrdamper.rig_files.profile import parse_profile
from mrdamper.rig_files.rig_import import read_run

T = np.arange(1001) / 200.0
X = 12.0 * np.sin(2 * np.pi * T)
V = np.gradient(X, T)


def force(amperes: float) -> np.ndarray:
    return (200 + 500 * amperes) * np.tanh(V / 5) + 2 * V + np.random.default_rng(3).normal(0, 1, T.size)


def lines(write: Callable[[int, float, float, float], str], amperes: float = 0.5) -> str:
    return "".join(write(i, *row) + "\n" for i, row in enumerate(zip(T, X, force(amperes), strict=True)))


START = datetime(2025, 2, 3, 23, 10, 4)


def clock(seconds: float) -> datetime:
    return START + timedelta(seconds=round(seconds, 6))


EXPORTS = {
    "a last line in quotes": "'Rig 7\ntime (s),stroke (mm),force (N)\n"
    + lines(lambda i, t, x, f: f"{t:.3f},{x:.6f},{f:.4f}")
    + "'end of test",
    "units behind numbers beside a stamp": '"Time","Load","Stroke"\n'
    + lines(lambda i, t, x, f: f'"{clock(t):%Y-%m-%d %H:%M:%S.%f}","{f:.4f} N","{x:.6f} mm"'),
    "stamps of seconds with microseconds": "date and time;us;stroke;load\n;;mm;N\n"
    + lines(lambda i, t, x, f: f"{clock(t):%Y-%m-%d %H:%M:%S};{clock(t).microsecond};{x:.6f};{f:.4f}"),
    "a clock with the name of its unit": "us,stroke [mm],load [N]\n"
    + lines(lambda i, t, x, f: f"{1e6 * t:.0f},{x:.6f},{f:.4f}"),
    "lines of a key with numbers, and short keys": "サンプリング周波数（Hz）,200\nレンジ,2000,20000,10V\n"
    "校正係数,0.01,0.002,0.5\nオフセット,0,0,0\nCH No.,1-1,1-2,1-3\nCH名称,変位計,荷重計,温度\n単位,mm,N,℃\n\n"
    + lines(lambda i, t, x, f: f"{t:.3f},{x:.6f},{f:.4f},24.0"),
    "a start in a key of one letter": "LabVIEW Measurement\t\n***End_of_Header***\t\n\t\nChannels\t2\t\t\n"
    "Y_Unit_Label\tmm\tN\t\nX_Dimension\tTime\tTime\t\nX0\t0,00E+0\t0,00E+0\t\nDelta_X\t0,005\t0,005\t\n"
    "***End_of_Header***\t\t\t\nX_Value\tKonum\tKuvvet\tComment\n"
    + lines(lambda i, t, x, f: f"{t:.6f}\t{x:.6f}\t{f:.4f}\t".replace(".", ",")),
    "units behind a key, one a column": "Active channels:\tTime\tDISP\tLOAD\nSample rate:\t200\n"
    "Channel units:\tsec\tmm\tN\nChannel description:\tTime\tStroke\tLoad cell\n\nTime\tDISP\tLOAD\n"
    + lines(lambda i, t, x, f: f"{t:.6f}\t{x:.6f}\t{f:.4f}"),
    "colons of full width": "采样频率：200.00Hz\n通道数：2\n\n位移(mm)\t阻尼力(kN)\n"
    + lines(lambda i, t, x, f: f"{x:.6f}\t{f / 1e3:.7f}"),
    "the name of the index below the others": "level,stroke,load\nunits,mm,N\nt [s],,\n"
    + lines(lambda i, t, x, f: f"{t:.3f},{x:.6f},{f:.4f}"),
    "units that change with the size of the number": "Time,Load,Stroke\n"
    + lines(
        lambda i, t, x, f: (
            f"{clock(t):%Y-%m-%d %H:%M:%S.%f},{f / 1e3:.7f} kN,{x:.6f} mm"
            if abs(f) >= 400
            else f"{clock(t):%Y-%m-%d %H:%M:%S.%f},{f:.4f} N,{x * 1e3:.3f} um"
        )
    ),
    "types of numbers below names with their devices": "time\tF_rod\\ES650:1\tz_piston\\ES650:1\tb_on\\DIO:1\n"
    + "f8\tf8\tf8\tu1\ns\tN\tmm\t\n"
    + lines(lambda i, t, x, f: f"{t:.3f}\t{f:.4f}\t{x:.6f}\t1"),
    "a table of gains with units of direct current": "Channel,Name,Function,Gain,Offset,Label\n"
    + "101,Coil,DC voltage,10,0,ADC\n\nScan,t (s),101 <Load> (LBF),102 <Stroke> (IN)\n"
    + lines(lambda i, t, x, f: f"{i + 1},{t:.3f},{f / 4.4482216152605:.6f},{x / 25.4:.9f}"),
    "a start and a step in keys of two words, and kinds of axes below": "Run\t:\t7\n\nPoint\t\tF:+Z\tX:+Z\n"
    + "Quantity\tTime\tForce\tDisplacement\nUnit\ts\tN\tmm\nX start\t\t0\t0\nX increment\t\t0.005\t0.005\n"
    + "Data\tX\tY\tY\n"
    + lines(lambda i, t, x, f: f"\t{t:.3f}\t{f:.4f}\t{x:.6f}"),
    "attributes above the rows": "% rig 7, units: time [s], stroke [mm], load [N]\n@RELATION rig\n\n"
    + "@ATTRIBUTE time NUMERIC\n@ATTRIBUTE stroke NUMERIC\n@ATTRIBUTE load NUMERIC\n\n@DATA\n"
    + lines(lambda i, t, x, f: f"{t:.3f},{x:.6f},{f:.4f}"),
    "waves": "IGOR\nWAVES/D stroke, load\nBEGIN\n"
    + lines(lambda i, t, x, f: f"\t{x:.6f}\t{f:.4f}")
    + 'END\nX SetScale/P x 0,0.005,"s", stroke; SetScale y 0,0,"mm", stroke\n'
    + 'X SetScale/P x 0,0.005,"s", load; SetScale y 0,0,"N", load\n',
    "blocks of channels below each other": "Version\t2\n\n{Outing}\nCar\trig\n\n{ChannelBlock}\nTime\tDamper Force[N]\n"
    + lines(lambda i, t, x, f: f"{t:.3f}\t{f:.4f}")
    + "\n{ChannelBlock}\nTime\tDamper Position[mm]\n"
    + lines(lambda i, t, x, f: f"{t:.3f}\t{x:.6f}"),
    "sections with a clock without colons": "[header]\ntime\nLoad N\n\n[channel units]\nN\nmm\n\n"
    + "[column names]\ntime load stroke\n\n[data]\n"
    + lines(lambda i, t, x, f: f"{clock(t):%H%M%S.%f} {f:+.9E} {x:+.9E}"),
    "sections with the channels of a vehicle before those with units": "[header]\nsatellites\ntime\nvelocity kmh\n"
    + "load\nstroke\n\n[channel units]\nN\nmm\n\n[comments]\nrig 7\n\n"
    + "[column names]\nsats time velocity load stroke\n\n[data]\n"
    + lines(lambda i, t, x, f: f"009 {clock(t):%H%M%S.%f} 000.012 {f:+.9E} {x:+.9E}"),
    "a rate in samples by seconds written out": "TEST ID,211\nSAMPLE RATE,200 samples/sec\n\nStroke (mm),Load (N)\n"
    + lines(lambda i, t, x, f: f"{x:.6f},{f:.4f}"),
    "the step of an abscissa": "Values: 1001\nAbscissa: Time / s, start 0, delta 0.005\nChannel 1: Displacement / mm\n"
    + "Channel 2: Force / N\n\n"
    + lines(lambda i, t, x, f: f"{x:.9E}\t{f:.9E}"),
    "a head in YAML": "#---\n#name: a\n#coil:\n#  current: 0.5\n#  unit: A\n#fields:\n#- name: t\n#  unit: s\n"
    + "#- name: stroke\n#  unit: mm\n#- name: force\n#  unit: N\n#---\nt,stroke,force\n"
    + lines(lambda i, t, x, f: f"{t:.3f},{x:.6f},{f:.4f}"),
    "a head in YAML of astropy": "# %ECSV 1.0\n# ---\n# datatype:\n# - {name: time, unit: s, datatype: float64}\n"
    + "# - {name: disp, unit: mm, datatype: float64}\n# - {name: force, unit: N, datatype: float64}\n# meta: !!omap\n"
    + "# - {coil_current: !astropy.units.Quantity {unit: !astropy.units.Unit {unit: A}, value: 0.5}}\n"
    + "# - {rig: A7}\n# schema: astropy-2.0\ntime disp force\n"
    + lines(lambda i, t, x, f: f"{t:.3f} {x:.6f} {f:.4f}"),
    "an object of Python, without YAML": "# params = {'I': 0.5, 'f': 1.0, 'note': ''}\n# I in ampere, f in Hz\n"
    + "# t[s] x[mm] F[N]\n"
    + lines(lambda i, t, x, f: f"{t:.3f} {x:.6f} {f:.4f}"),
    "notes in the last of four columns": "Time,Load,Stroke,Marks\nsec,N,mm,\n"
    + lines(lambda i, t, x, f: f"{t:.3f},{f:.4f},{x:.6f},{'start' if i == 30 else ''}"),
    "numbers of rows without a name": "t.s,stroke.mm,load.N\n"
    + lines(lambda i, t, x, f: f'"{i + 1}",{t:.3f},{x:.6f},{f:.4f}'),
    "a step for all channels, and a separator behind every line": '"Name","stroke","load",\n"VUnit","mm","N",\n'
    + '"HResolution",0.005,0.005,\n"HUnit","s","s",\n\n'
    + lines(lambda i, t, x, f: f",{x:.6f},{f:.4f},"),
    "scales above rows with a key": "Name,Time,Stroke,Load\nUnit,s,mm,N\nFull range,9,40,900\nScale,1,1,1\n"
    + lines(lambda i, t, x, f: f"Data,{t:.3f},{x:.6f},{f:.4f}"),
    "offsets above rows without a key": "Name,Time,Stroke,Load\nUnit,s,mm,N\nOffset,0,0.3,12\n"
    + lines(lambda i, t, x, f: f",{t:.3f},{x:.6f},{f:.4f}"),
    "paths of a model": "time,Rig model/plant/Ref/x_ref,Rig model/plant/Sensor/stroke,Rig model/plant/Sensor/load\n"
    + "s,mm,mm,N\n"
    + lines(lambda i, t, x, f: f"{t:.3f},{x:.4f},{x:.6f},{f:.4f}"),
}


@pytest.mark.parametrize("export", EXPORTS)
def test_an_export_gives_the_samples_it_was_made_of(tmp_path, export):
    (tmp_path / f"run{'_0.5A' * ('YAML' not in export)}.csv").write_text(EXPORTS[export])
    result = import_files([tmp_path])
    assert not [str(refusal.error) for refusal in result.refusals]
    (record,) = result.records
    assert record.current[0] == 0.5
    size = record.time.size
    assert size >= T.size - 1  # a last row without a line end is left out
    np.testing.assert_allclose(record.time - record.time[0], T[:size], rtol=0, atol=1e-9)
    np.testing.assert_allclose(record.displacement, 1e-3 * X[:size], rtol=0, atol=1e-9)
    np.testing.assert_allclose(record.force, force(0.5)[:size], rtol=0, atol=1e-4)


def test_comments_with_names_of_columns_begin_a_test_each(tmp_path):
    text = "# rig 7\n"
    for amperes in (0.0, 0.5):
        text += f"# coil {amperes} A\n# t/s stroke/mm load/N\n"
        text += lines(lambda i, t, x, f: f"{t:.3f} {x:.6f} {f:.4f}", amperes) + "\n\n"
    (tmp_path / "all.dat").write_text(text)
    records = import_files([tmp_path]).records
    assert [float(np.mean(record.current)) for record in records] == [0.0, 0.5]
    np.testing.assert_allclose(records[1].force, force(0.5), rtol=0, atol=1e-4)


def test_a_line_of_conditions_below_the_names_belongs_to_groups_of_columns(tmp_path):
    text = "time\tstroke\tload\ttime\tstroke\tload\ns\tmm\tN\ts\tmm\tN\n\t\tI = 0.2 A, 1 Hz\t\t\tI = 0.9 A, 1 Hz\n"
    text += "".join(
        f"{t:.3f}\t{x:.6f}\t{a:.4f}\t{t:.3f}\t{x:.6f}\t{b:.4f}\n"
        for t, x, a, b in zip(T, X, force(0.2), force(0.9), strict=True)
    )
    (tmp_path / "book.txt").write_text(text)
    assert [float(np.mean(record.current)) for record in import_files([tmp_path]).records] == pytest.approx([0.2, 0.9])


def test_a_long_table_of_a_data_base_is_told_apart_by_the_tag_that_has_several_values(tmp_path):
    text = "_time,_value,_field,_measurement,test\n"
    for name, amperes, start in (("A", 0.0, 0.0), ("B", 0.5, 60.0)):
        channels = {"stroke_mm": X, "load_N": force(amperes), "coil_current_A": np.full(T.size, amperes)}
        for field, values in channels.items():
            text += "".join(
                f"{clock(start + t):%Y-%m-%dT%H:%M:%S.%f}Z,{v:.6f},{field},rig,{name}\n"
                for t, v in zip(T, values, strict=True)
            )
    (tmp_path / "query.csv").write_text(text)
    records = import_files([tmp_path]).records
    assert [record.id for record in records] == ["query_A", "query_B"]
    np.testing.assert_allclose(records[1].force, force(0.5), rtol=0, atol=1e-4)


@pytest.mark.parametrize(
    ("field", "values", "late"),
    [("oil_temperature_degC", 30 + T, 0.001), ("coil_current_A", 0 * T + 0.5, 0.001), ("stroke_mm", X, 0.0)],
)
def test_a_channel_of_a_long_table_with_other_times_is_put_on_the_clock_of_the_force(tmp_path, field, values, late):
    """The last of these is only longer than the force's: at equal times it is what it was."""
    channels = {"stroke_mm": (T, X), "load_N": (T[:-20], force(0.5)[:-20]), "coil_current_A": (T, 0 * T + 0.5)}
    channels |= {"oil_temperature_degC": (T, 30 + T), field: (T + late, values + late)}
    text = "time_s,value,channel,message\n"  # of a bus: the message tells no tests apart
    for name, columns in channels.items():
        text += "".join(f"{t:.6f},{v:.6f},{name},{name[:5]}\n" for t, v in zip(*columns, strict=True))
    (tmp_path / "query.csv").write_text(text)
    (record,) = import_files([tmp_path]).records
    assert "W_RASTER" in [finding.code for finding in record.findings]
    np.testing.assert_allclose(record.force, force(0.5)[:-20], rtol=0, atol=1e-4)
    np.testing.assert_allclose(1e3 * record.displacement, X[:-20], rtol=0, atol=1e-4)
    assert record.temperature is not None
    np.testing.assert_allclose(record.temperature, 30 + record.time, rtol=0, atol=2e-3)


def test_a_temperature_on_a_slower_clock_has_the_samples_of_the_record(tmp_path):
    from scipy.io import savemat

    test = {"time_s": T, "disp_mm": X, "force_N": force(0.5), "time2_s": T[::10], "temperature_degC": 30 + T[::10]}
    savemat(tmp_path / "run_0.5A.mat", test)
    record = read_run(tmp_path / "run_0.5A.mat")
    assert record.temperature is not None
    np.testing.assert_allclose(record.temperature, 30 + record.time, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["run_0.5A.xls", "run_0.5A.mat", "run_0.5A.tdms"])
def test_the_content_decides_what_a_text_of_another_name_is(tmp_path, name):
    rows = lines(lambda i, t, x, f: f"{t:.3f}\t{x:.6f}\t{f:.4f}")
    (tmp_path / name).write_text("t (s)\tstroke (mm)\tload (N)\n" + rows)
    np.testing.assert_allclose(read_run(tmp_path / name).force, force(0.5), rtol=0, atol=1e-4)
    (tmp_path / name).write_bytes(b"t (s)\tstroke\x00 (mm)\tload (N)\n" + rows.encode())
    with pytest.raises(InputError, match="E_FORMAT"):
        read_run(tmp_path / name)


def saved_by_octave(**variables: np.ndarray | float | str) -> str:
    text = "# Created by Octave 9.1.0, Mon Feb 03 2025\n"
    for name, value in variables.items():
        if isinstance(value, np.ndarray):
            text += f"# name: {name}\n# type: matrix\n# rows: {value.size}\n# columns: 1\n"
            text += "".join(f" {v:.10g}\n" for v in value) + "\n\n"
        elif isinstance(value, str):
            text += f"# name: {name}\n# type: string\n# elements: 1\n# length: {len(value)}\n{value}\n\n\n"
        else:
            text += f"# name: {name}\n# type: scalar\n{value:.10g}\n\n\n"
    return text


def test_variables_saved_by_octave_as_text_are_read_and_a_cut_one_is_refused(tmp_path):
    text = saved_by_octave(who="lab 2", t_s=T, stroke_mm=X, load_N=force(0.7), I_A=0.7)
    (tmp_path / "run.mat").write_text(text)
    record = read_run(tmp_path / "run.mat")
    np.testing.assert_allclose(record.force, force(0.7), rtol=1e-9)
    assert record.current is not None
    assert float(np.mean(record.current)) == pytest.approx(0.7)
    (tmp_path / "run.mat").write_text(text[: len(text) * 3 // 4])
    with pytest.raises(InputError, match="E_TRUNCATED"):
        read_run(tmp_path / "run.mat")


@pytest.mark.parametrize(("stated", "code"), [("Decimal_Separator\t,\n", ""), ("", "E_AMBIGUOUS")])
def test_a_line_states_whether_a_comma_is_of_decimals_or_of_thousands(tmp_path, stated, code):
    body = lines(lambda i, t, x, f: f"{1 + t:.3f}\t{20 + x:.3f}\t{500 + f / 2:.3f}".replace(".", ","))
    (tmp_path / "a_0.5A.txt").write_text(f"{stated}time (s)\tstroke (mm)\tforce (N)\n{body}", encoding="utf-8")
    if code:
        with pytest.raises(InputError) as caught:
            read_run(tmp_path / "a_0.5A.txt")
        assert caught.value.code == code
    else:
        np.testing.assert_allclose(read_run(tmp_path / "a_0.5A.txt").time, 1 + T, atol=1e-9)


SCALED = {
    "counts of a converter, about a zero": (
        "# stroke: 0.002 mm/count, zero at 32768\n# force: 0.25 N/count, zero at 32768\n"
        "time (s),stroke_counts,force_counts\n",
        lambda x, f: (round(x / 0.002) + 32768, round(f / 0.25) + 32768),
    ),
    "per cent of a full scale in sections of the header": (
        "[Ch1]\nName=Stroke\nFullScale=75\nUnit=mm\n[Ch2]\nName=Force\nFullScale=10\nUnit=kN\n[Data]\n"
        "time (s),Stroke [%FS],Force [%FS]\n",
        lambda x, f: (round(100 * x / 75, 4), round(100 * f / 1e4, 4)),
    ),
}


@pytest.mark.parametrize("kind", SCALED)
def test_counts_and_shares_of_a_full_scale_are_scaled_as_the_file_states(tmp_path, kind):
    head, stored = SCALED[kind]
    body = lines(lambda i, t, x, f: ",".join(map(str, (round(t, 3), *stored(x, f)))))
    (tmp_path / "a_0.5A.csv").write_text(head + body, encoding="utf-8")
    record = read_run(tmp_path / "a_0.5A.csv")
    np.testing.assert_allclose(record.displacement, X / 1e3, atol=1.1e-6)
    np.testing.assert_allclose(record.force, force(0.5), atol=0.13)


@pytest.mark.parametrize("before", ["", "\\rowcolor{gray!10}", "\\rowcolor[gray]{0.9} ", "\\cmidrule(lr){1-2}\\hline "])
def test_a_table_of_latex_is_read_with_the_current_of_its_caption(before, tmp_path):
    head = "\\begin{table}\n\\caption{Loop at $I = 0.5$ A}\n\\begin{tabular}{rrr}\n\\hline\n"
    head += "\\textbf{$t$ [s]} & $x$ [mm] & \\textbf{$F$ [N]} \\\\\n\\hline\n"
    body = lines(lambda i, t, x, f: f"{before * (i % 3 == 0)}{t:.3f} & {x:.6f} & {f:.4f} \\\\")
    (tmp_path / "table.tex").write_text(head + body + "\\hline\n\\end{tabular}\n\\end{table}\n", encoding="utf-8")
    (record,) = import_files([tmp_path]).records
    assert np.mean(record.current) == 0.5
    np.testing.assert_allclose(record.force, force(0.5), rtol=0, atol=1e-3)


def test_messages_among_the_rows_of_a_running_clock_are_left_out_and_told_others_are_refused_with_their_text(tmp_path):
    rows = lines(lambda i, t, x, f: f"{t:.3f},{x:.6f},{f:.4f}").splitlines(keepends=True)
    (tmp_path / "a_0.5A.csv").write_text(
        "".join(["time (s),x (mm),F (N)\n", *rows[:99], "WARN hx711 retry\n", *rows[99:]])
    )
    record = read_run(tmp_path / "a_0.5A.csv")
    assert record.time.size == T.size
    assert "messages and left out: 1, the first (line 101) 'WARN hx711 retry'" in str(record.findings)
    plain = [row.partition(",")[2] for row in rows]  # a fixed rate: the line may stand for a sample
    (tmp_path / "a_0.5A.csv").write_text("".join(["x (mm),F (N)\n", *plain[:99], "WARN hx711 retry\n", *plain[100:]]))
    (refusal,) = import_files([tmp_path], parse_profile("[file]\nsample_rate_Hz = 200.0")).refusals
    assert "line 101: 1 fields where the other rows have 2: 'WARN hx711 retry'" in str(refusal.error)
