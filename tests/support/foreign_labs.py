# ruff: noqa: E501, B905
"""Exports of laboratories of many kinds, of machines, loggers, scripts and spreadsheets, in several languages.

No code is shared with the readers and `lab_exports`: the damper is another one, and files are written line by line or
by the library of the format. Every kind writes the same tests into a folder.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

KINDS: dict[str, Callable] = {}


@dataclass(frozen=True)
class Test:
    """One true test, in SI."""

    __test__ = False
    current: float
    frequency: float
    amplitude: float
    t: np.ndarray
    x: np.ndarray
    f: np.ndarray
    i: np.ndarray
    v: np.ndarray


def campaign(seed: int = 3, currents=(0.0, 0.6, 1.2), motions=((1.0, 0.02), (2.0, 0.01)), rate: float = 200.0):
    """Tests of a damper with a smooth yield force, friction, gas force and noise; measured currents."""
    rng = np.random.default_rng(seed)
    tests = []
    for current in currents:
        for frequency, amplitude in motions:
            t = np.arange(0, 4 / frequency + 0.37, 1 / rate)
            w = 2 * np.pi * frequency
            x, v = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t)
            lag = v + 0.012 * w * x
            f = (130 + 900 * current) * np.tanh(lag / 0.012) + (700 + 500 * current) * v + 2500 * x + 90
            f = f + rng.normal(0, 3, t.size)
            i = current + rng.normal(0, 0.003, t.size)
            tests.append(Test(current, frequency, amplitude, t, x + rng.normal(0, 4e-6, t.size), f, i, v))
    return tuple(tests)


def kind(function):
    KINDS[function.__name__] = function
    return function


def rows(*columns, fmt="%.6g", sep=",", mark="."):
    lines = [
        sep.join((fmt if isinstance(fmt, str) else fmt[j]) % v for j, v in enumerate(row)) for row in zip(*columns)
    ]
    return [line.replace(".", mark) for line in lines] if mark != "." else lines


def put(path: Path, lines, encoding="utf-8", eol="\n"):
    path.write_bytes((eol.join(lines) + eol).encode(encoding))


def name(q: Test) -> str:
    return f"{q.frequency:g}Hz_{1e3 * q.amplitude:g}mm"


@kind
def zwick_testxpert(tests, p):
    for k, q in enumerate(tests, 1):
        head = [
            '"Prüfvorschrift";"Dämpfer zyklisch"',
            f'"Spulenstrom";{str(q.current).replace(".", ",")};"A"',
            '"Prüfgeschwindigkeit";50;"mm/min"',
            '"Prüfzeit";"Standardweg";"Standardkraft"',
            '"s";"mm";"N"',
        ]
        put(p / f"Probe {k}.TRA", head + rows(q.t, 1e3 * q.x, q.f, fmt="%.5f", sep=";", mark=","), "cp1252", "\r\n")


@kind
def mts_dat(tests, p):
    for k, q in enumerate(tests, 1):
        head = [
            "MTS793|MPT|ENU|1|0|/|.|0|1|1|A",
            "",
            "Data Header:\tData Acquisition: Timed\tTime: 12.5\tSec\t3/12/2024",
            f"Specimen:\tMRD-7\tCoil current:\t{q.current:.2f} A",
            "Running Time\tAxial Displacement\tAxial Force",
            "Sec\tmm\tkN",
        ]
        put(p / f"specimen_{k}.dat", head + rows(q.t, 1e3 * q.x, q.f / 1e3, fmt="%.7f", sep="\t"))


@kind
def simulink_structure_with_time(tests, p):
    import scipy.io as sio

    for k, q in enumerate(tests):
        dt = [("values", "O"), ("dimensions", "O"), ("label", "O"), ("blockName", "O")]
        s = np.zeros((1, 3), dtype=dt)
        for j, (v, label) in enumerate(((1e3 * q.x, "displacement_mm"), (q.f, "force_N"), (q.i, "current_A"))):
            s[0, j]["values"], s[0, j]["dimensions"] = v[:, None], 1.0
            s[0, j]["label"], s[0, j]["blockName"] = label, f"rig/Scope{j}"
        sio.savemat(
            p / f"log{k}.mat",
            {"ScopeData": {"time": q.t[:, None], "signals": s, "blockName": "rig/Scope"}, "time_unit": "s"},
        )


@kind
def timeseries_structs(tests, p):
    import scipy.io as sio

    for k, q in enumerate(tests):

        def ts(v, n, u, step=1, q=q):
            return {
                "Name": n,
                "Time": q.t[::step, None],
                "Data": v[::step, None],
                "TimeInfo": {"Units": "seconds"},
                "DataInfo": {"Units": u},
            }

        sio.savemat(
            p / f"run{k}.mat",
            {
                "logs": {
                    "x": ts(1e3 * q.x, "Piston position", "mm"),
                    "F": ts(q.f, "Damper force", "N"),
                    "I": ts(q.i, "Coil current", "A", 4),
                }
            },
        )


@kind
def struct_array_of_tests(tests, p):
    import scipy.io as sio

    dt = [("I_A", "O"), ("freq_Hz", "O"), ("time_s", "O"), ("stroke_mm", "O"), ("load_N", "O")]
    a = np.zeros((1, len(tests)), dtype=dt)
    for j, q in enumerate(tests):
        a[0, j]["I_A"], a[0, j]["freq_Hz"] = q.current, q.frequency
        a[0, j]["time_s"], a[0, j]["stroke_mm"], a[0, j]["load_N"] = q.t[:, None], 1e3 * q.x[:, None], q.f[:, None]
    sio.savemat(p / "all_tests.mat", {"tests": a})


@kind
def picoscope(tests, p):
    for k, q in enumerate(tests, 1):
        head = ["Time,Channel A,Channel B,Channel C", "(ms),(V),(V),(V)", ""]
        put(
            p / f"scope_{k:02d}.csv",
            [
                "# Channel A: LVDT 5 mm/V",
                "# Channel B: load cell 500 N/V",
                "# Channel C: current monitor 0.5 A/V",
                *head,
                *rows(1e3 * q.t, q.x * 1e3 / 5, q.f / 500, q.i / 0.5, fmt="%.6f"),
            ],
        )


@kind
def tektronix(tests, p):
    for k, q in enumerate(tests, 1):
        head = [
            "Model,MSO44",
            "Firmware Version,1.28",
            f"Record Length,{q.t.size}",
            "Sample Interval,5.000E-03",
            "Horizontal Units,s",
            "",
            "Labels,displacement,force,coil current",
            "TIME,CH1 [mm],CH2 [N],CH3 [A]",
        ]
        put(p / f"tek{k:04d}.csv", head + rows(q.t, 1e3 * q.x, q.f, q.i))


@kind
def campbell_toa5(tests, p):
    for k, q in enumerate(tests, 1):
        stamps = [f'"2024-03-12 10:{15 + int(t // 60):02d}:{t % 60:06.3f}"' for t in q.t]
        head = [
            '"TOA5","CR6","CR6","1234","CR6.Std.10","CPU:damper.CR6","5521","Table1"',
            '"TIMESTAMP","RECORD","Disp","Force","Coil_I"',
            '"TS","RN","mm","N","A"',
            '"","","Smp","Smp","Smp"',
        ]
        put(
            p / f"TOA5_{k}.dat",
            head
            + [f"{s},{n},{1e3 * x:.4f},{f:.3f},{i:.4f}" for n, (s, x, f, i) in enumerate(zip(stamps, q.x, q.f, q.i))],
        )


@kind
def daqexpress(tests, p):
    for k, q in enumerate(tests, 1):
        head = ["Time (s),Position (mm) - cDAQ1Mod1/ai0,Force (N) - cDAQ1Mod1/ai1,Coil current (A) - cDAQ1Mod2/ai0"]
        put(p / f"acq{k}.csv", head + rows(q.t, 1e3 * q.x, q.f, q.i, fmt="%.6f"))


@kind
def tidy_long_table(tests, p):
    lines = ["test_id,current_A,frequency_Hz,time_s,channel,value,unit"]
    for k, q in enumerate(tests, 1):
        for t, x, f in zip(q.t, q.x, q.f):
            lines.append(f"T{k},{q.current},{q.frequency},{t:.4f},displacement,{1e3 * x:.4f},mm")
            lines.append(f"T{k},{q.current},{q.frequency},{t:.4f},force,{f:.3f},N")
    put(p / "long.csv", lines)


@kind
def wide_table_with_conditions(tests, p):
    lines = ["current_A,frequency_Hz,amplitude_mm,time_s,displacement_mm,force_N"]
    for q in tests:
        lines += [
            f"{q.current},{q.frequency},{1e3 * q.amplitude:g},{t:.4f},{1e3 * x:.4f},{f:.3f}"
            for t, x, f in zip(q.t, q.x, q.f)
        ]
    put(p / "campaign.csv", lines)


@kind
def matrix_beside_files(tests, p):
    for k, q in enumerate(tests, 1):
        put(p / f"D{k:03d}.csv", ["t [s],s [mm],F [N]", *rows(q.t, 1e3 * q.x, q.f)])
    put(
        p / "test_matrix.csv",
        [
            "File,I [A],f [Hz],A [mm]",
            *[f"D{k:03d}.csv,{q.current},{q.frequency},{1e3 * q.amplitude:g}" for k, q in enumerate(tests, 1)],
        ],
    )


@kind
def matrix_in_a_workbook(tests, p):
    import openpyxl

    for k, q in enumerate(tests, 1):
        put(
            p / f"messung_{k}.txt",
            ["Zeit/s\tWeg/mm\tKraft/N", *rows(q.t, 1e3 * q.x, q.f, sep="\t", mark=",")],
            "cp1252",
        )
    book = openpyxl.Workbook()
    book.active.append(["Messung", "Strom in A", "Frequenz in Hz", "Bemerkung"])
    for k, q in enumerate(tests, 1):
        book.active.append([f"messung_{k}", q.current, q.frequency, "ok"])
    book.save(p / "Prüfplan.xlsx")


@kind
def merged_headings(tests, p):
    import openpyxl

    book = openpyxl.Workbook()
    book.remove(book.active)
    for motion in sorted({(q.frequency, q.amplitude) for q in tests}):
        sheet = book.create_sheet(f"{motion[0]:g}Hz {1e3 * motion[1]:g}mm")
        group = [q for q in tests if (q.frequency, q.amplitude) == motion]
        sheet.append(["Time", "Displacement", "Force", *[None] * (len(group) - 1)])
        sheet.append([None, None, *[f"{q.current:g} A" for q in group]])
        sheet.append(["s", "mm", *["N"] * len(group)])
        sheet.merge_cells(start_row=1, start_column=3, end_row=1, end_column=2 + len(group))
        for j in range(group[0].t.size):
            sheet.append([float(group[0].t[j]), float(1e3 * group[0].x[j]), *[float(q.f[j]) for q in group]])
    book.save(p / "results.xlsx")


@kind
def groups_under_merged_currents(tests, p):
    import openpyxl

    book = openpyxl.Workbook()
    book.remove(book.active)
    for motion in sorted({(q.frequency, q.amplitude) for q in tests}):
        sheet = book.create_sheet(f"f={motion[0]:g} Hz")
        group = [q for q in tests if (q.frequency, q.amplitude) == motion]
        sheet.append([c for q in group for c in (f"I = {q.current:g} A", None, None)])
        sheet.append([c for _ in group for c in ("t (s)", "x (mm)", "F (N)")])
        for j in range(group[0].t.size):
            sheet.append([float(v) for q in group for v in (q.t[j], 1e3 * q.x[j], q.f[j])])
    book.save(p / "groups.xlsx")


@kind
def pandas_multi_index(tests, p):
    motion = (tests[0].frequency, tests[0].amplitude)
    for number, motion in enumerate(sorted({(q.frequency, q.amplitude) for q in tests})):
        group = [q for q in tests if (q.frequency, q.amplitude) == motion]
        lines = [
            ",".join(["", *[c for _ in group for c in ("displacement_mm", "force_N")]]),
            ",".join(["current", *[c for q in group for c in (f"{q.current} A",) * 2]]),
            "time_s" + "," * (2 * len(group)),
        ]
        lines += [
            ",".join(f"{v:.5g}" for v in (group[0].t[j], *[v for q in group for v in (1e3 * q.x[j], q.f[j])]))
            for j in range(group[0].t.size)
        ]
        put(p / f"pivot_{number}.csv", lines)


@kind
def parquet_partitions(tests, p):
    import polars as pl

    for q in tests:
        folder = p / f"current_A={q.current}" / f"frequency_Hz={q.frequency}"
        folder.mkdir(parents=True)
        pl.DataFrame({"time_s": q.t, "displacement_mm": 1e3 * q.x, "force_N": q.f}).write_parquet(
            folder / "part-0.parquet"
        )


@kind
def folders_by_current(tests, p):
    for q in tests:
        folder = p / f"I={q.current:g}A"
        folder.mkdir(exist_ok=True)
        put(folder / f"{name(q)}.csv", ["Time (s),Disp (mm),Load (N)", *rows(q.t, 1e3 * q.x, q.f)])


@kind
def netcdf_xarray(tests, p):
    from scipy.io import netcdf_file

    for k, q in enumerate(tests):
        with netcdf_file(p / f"test{k}.nc", "w") as file:
            file.coil_current_A = q.current
            file.createDimension("time", q.t.size)
            for n, v, u in (("time", q.t, "s"), ("piston_displacement", 1e3 * q.x, "mm"), ("damper_force", q.f, "N")):
                variable = file.createVariable(n, "f8", ("time",))
                variable[:], variable.units = v, u


@kind
def hdf5_nested_conditions(tests, p):
    import h5py

    with h5py.File(p / "campaign.h5", "w") as file:
        for k, q in enumerate(tests):
            group = file.create_group(f"specimen_A/run_{k:02d}")
            group.attrs["current"], group.attrs["current_unit"] = q.current, "A"
            group.attrs["current_A"] = q.current
            for n, v, u in (("t", q.t, "s"), ("x", 1e3 * q.x, "mm"), ("F", q.f, "N")):
                group.create_dataset(n, data=v).attrs["units"] = u


@kind
def hdf5_channels_with_own_time(tests, p):
    import h5py

    for k, q in enumerate(tests):
        with h5py.File(p / f"rec{k}.h5", "w") as file:
            for n, v, u, step in (
                ("Displacement", 1e3 * q.x, "mm", 1),
                ("Force", q.f, "N", 1),
                ("Current", q.i, "A", 10),
            ):
                group = file.create_group(n)
                d = group.create_dataset("value", data=v[::step])
                d.attrs["unit"] = u
                group.create_dataset("time", data=q.t[::step]).attrs["unit"] = "s"


@kind
def h5py_structured(tests, p):
    import h5py

    for k, q in enumerate(tests):
        with h5py.File(p / f"t{k}.hdf5", "w") as file:
            a = np.zeros(q.t.size, dtype=[("Time (s)", "f8"), ("Displacement (mm)", "f8"), ("Force (N)", "f8")])
            a["Time (s)"], a["Displacement (mm)"], a["Force (N)"] = q.t, 1e3 * q.x, q.f
            d = file.create_dataset("data", data=a)
            d.attrs["Current [A]"] = q.current


@kind
def mdf_rasters(tests, p):
    from asammdf import MDF, Signal

    for k, q in enumerate(tests):
        file = MDF(version="4.10")
        file.append(
            [Signal(1e3 * q.x, q.t, name="Damper_Travel", unit="mm"), Signal(q.f, q.t, name="Damper_Force", unit="N")]
        )
        file.append([Signal(q.i[::10], q.t[::10], name="Coil_Current", unit="A")])
        file.save(p / f"m{k}.mf4")
        file.close()


@kind
def tdms_two_rates(tests, p):
    from nptdms import ChannelObject, TdmsWriter

    for k, q in enumerate(tests):
        step = {"wf_increment": q.t[1], "wf_start_offset": 0.0, "wf_samples": q.t.size}
        with TdmsWriter(p / f"r{k}.tdms") as file:
            file.write_segment(
                [
                    ChannelObject("Fast", "Stroke", 1e3 * q.x, {**step, "unit_string": "mm"}),
                    ChannelObject("Fast", "Load", q.f, {**step, "unit_string": "N"}),
                    ChannelObject(
                        "Slow", "Coil current", q.i[::10], {**step, "wf_increment": 10 * q.t[1], "unit_string": "A"}
                    ),
                ]
            )


@kind
def json_rows_with_meta(tests, p):
    for k, q in enumerate(tests):
        doc = {
            "rig": "B2",
            "test": {"id": k, "coil_current": {"value": q.current, "unit": "A"}},
            "columns": ["time", "position", "force"],
            "units": ["s", "mm", "N"],
            "data": [[round(float(v), 5) for v in r] for r in zip(q.t, 1e3 * q.x, q.f)],
        }
        (p / f"r{k}.json").write_text(json.dumps(doc))


@kind
def json_all_in_one(tests, p):
    doc = {
        "tests": [
            {
                "name": f"t{k}",
                "current_mA": 1e3 * q.current,
                "signals": [
                    {"name": n, "unit": u, "values": v.round(5).tolist()}
                    for n, u, v in (("Time", "s", q.t), ("Weg", "mm", 1e3 * q.x), ("Kraft", "N", q.f))
                ],
            }
            for k, q in enumerate(tests)
        ]
    }
    (p / "export.json").write_text(json.dumps(doc))


@kind
def json_lines(tests, p):
    for k, q in enumerate(tests):
        lines = [
            json.dumps(
                {
                    "t_ms": round(1e3 * float(t), 3),
                    "disp_mm": round(1e3 * float(x), 4),
                    "force_N": round(float(f), 2),
                    "current_mA": round(1e3 * float(i), 1),
                }
            )
            for t, x, f, i in zip(q.t, q.x, q.f, q.i)
        ]
        put(p / f"stream_{k}.jsonl", lines)


@kind
def roehrig_shock(tests, p):
    for k, q in enumerate(tests, 1):
        head = [
            "Roehrig Engineering Shock 6.3",
            "Test Name:,MRD-7",
            f"Current:,{q.current:.1f},A",
            "",
            "Time (sec),Position (in),Velocity (in/sec),Force (lbs),Temp (F)",
        ]
        put(
            p / f"shock{k}.csv",
            head + rows(q.t, q.x / 0.0254, q.v / 0.0254, q.f / 4.4482216152605, 75 + 0 * q.t, fmt="%.6f"),
        )


@kind
def arduino_millis(tests, p):
    for q in tests:
        t = np.round(1e3 * q.t).astype(int)
        put(
            p / f"log_{name(q)}_{1e3 * q.current:.0f}mA.csv",
            ["millis;weg_mm;kraft_N", *[f"{a};{1e3 * b:.3f};{c:.1f}" for a, b, c in zip(t, q.x, q.f)]],
        )


@kind
def sampling_rate_header(tests, p):
    for k, q in enumerate(tests):
        head = ["Abtastrate: 200 Hz", f"Strom: {q.current:g} A".replace(".", ","), "Weg [mm]\tKraft [N]"]
        put(p / f"m{k}.asc", head + rows(1e3 * q.x, q.f, sep="\t", mark=",", fmt="%.5f"), "cp1252")


@kind
def chinese_headings(tests, p):
    for k, q in enumerate(tests):
        put(
            p / f"试验{k}.csv",
            [f"线圈电流,{q.current:g},A", "时间(s),位移(mm),阻尼力(N)", *rows(q.t, 1e3 * q.x, q.f)],
            "gb18030",
        )


@kind
def japanese_headings(tests, p):
    for k, q in enumerate(tests):
        put(
            p / f"data{k}.csv",
            ["試験日,2024/03/12", "時間[s],変位[mm],荷重[kN],コイル電流[A]", *rows(q.t, 1e3 * q.x, q.f / 1e3, q.i)],
            "cp932",
        )


@kind
def russian_headings(tests, p):
    for k, q in enumerate(tests):
        put(
            p / f"опыт_{k}.txt",
            [
                "Время, с\tПеремещение, мм\tУсилие, Н\tТок, А",
                *rows(q.t, 1e3 * q.x, q.f, q.i, sep="\t", mark=",", fmt="%.5f"),
            ],
            "cp1251",
        )


@kind
def french_headings(tests, p):
    for k, q in enumerate(tests):
        put(
            p / f"essai{k}.csv",
            [
                f"Intensité bobine;{q.current:g};A".replace(".", ","),
                "Temps (s);Déplacement (mm);Effort (daN)",
                *rows(q.t, 1e3 * q.x, q.f / 10, sep=";", mark=",", fmt="%.5f"),
            ],
            "cp1252",
        )


@kind
def spanish_headings(tests, p):
    for k, q in enumerate(tests):
        put(
            p / f"ensayo{k}.csv",
            [
                "Tiempo [s];Desplazamiento [mm];Fuerza [N];Corriente [A]",
                *rows(q.t, 1e3 * q.x, q.f, q.i, sep=";", mark=",", fmt="%.5f"),
            ],
        )


@kind
def excel_serial_days(tests, p):
    for k, q in enumerate(tests):
        put(
            p / f"log{k}.csv",
            [
                "Date (days),Position (mm),Force (N),Current (A)",
                *rows(45363.4 + q.t / 86400, 1e3 * q.x, q.f, q.i, fmt=["%.10f", "%.4f", "%.3f", "%.4f"]),
            ],
        )


@kind
def epoch_milliseconds(tests, p):
    for k, q in enumerate(tests):
        put(
            p / f"log{k}.csv",
            [
                "timestamp_ms,position_mm,force_N,coil_current_mA",
                *rows(1710237600000 + 1e3 * q.t, 1e3 * q.x, q.f, 1e3 * q.i, fmt=["%.0f", "%.4f", "%.3f", "%.1f"]),
            ],
        )


@kind
def date_and_time_columns(tests, p):
    for k, q in enumerate(tests):
        lines = ["Date,Time,Displ. [mm],Force [N],I [A]"]
        lines += [f"12.03.2024,10:15:{t:06.3f},{1e3 * x:.4f},{f:.2f},{i:.4f}" for t, x, f, i in zip(q.t, q.x, q.f, q.i)]
        put(p / f"rec{k}.csv", lines)


@kind
def hioki_logger(tests, p):
    for k, q in enumerate(tests):
        head = [
            '"HIOKI 8861-50"',
            '"Comment","MR damper"',
            '"Trigger Time","24-03-12 10:15:33"',
            '"Time[s]","CH1-1[mm]","CH1-2[N]","CH2-1[A]"',
        ]
        put(p / f"AUTO{k:04d}.CSV", head + rows(q.t, 1e3 * q.x, q.f, q.i, fmt="%.5E"))


@kind
def yokogawa(tests, p):
    for k, q in enumerate(tests):
        head = [
            '"Model","DL850"',
            '"BlockNumber",1',
            '"TraceName","Stroke","Load","Coil"',
            f'"BlockSize",{q.t.size},{q.t.size},{q.t.size}',
            '"VUnit","mm","N","A"',
            '"HResolution",5.0E-03,5.0E-03,5.0E-03',
            '"HUnit","s","s","s"',
            "",
        ]
        put(p / f"dl{k}.csv", head + ["," + line for line in rows(1e3 * q.x, q.f, q.i, fmt="%.5E")])


@kind
def graphtec(tests, p):
    for k, q in enumerate(tests):
        head = [
            "Vendor,GRAPHTEC Corporation",
            "Sampling interval,5ms",
            "Data",
            "Number,Date&Time,ms,Stroke,Load,Current",
            "NO.,Time,ms,mm,N,A",
        ]
        lines = [
            f"{n + 1},2024/03/12 10:15:{int(t):02d},{round(1e3 * t) % 1000},{1e3 * x:+.4f},{f:+.2f},{i:+.4f}"
            for n, (t, x, f, i) in enumerate(zip(q.t, q.x, q.f, q.i))
        ]
        put(p / f"gl{k}.csv", head + lines)


@kind
def dewesoft_text(tests, p):
    for k, q in enumerate(tests):
        head = [
            "Data file information",
            "File name: damper.dxd",
            "Sample rate: 200 Hz",
            "",
            "Time (s)\tWEG (mm)\tKRAFT (N)\tSTROM (A)",
        ]
        put(p / f"dw{k}.txt", head + rows(q.t, 1e3 * q.x, q.f, q.i, sep="\t"))


@kind
def origin_export(tests, p):
    for k, q in enumerate(tests):
        put(
            p / f"Book{k}.dat",
            ["t\tx\tF", "s\tmm\tN", f"\t\tI = {q.current:g} A", *rows(q.t, 1e3 * q.x, q.f, sep="\t")],
        )


@kind
def quanser_matrix(tests, p):
    import scipy.io as sio

    for k, q in enumerate(tests):
        sio.savemat(
            p / f"q{k}.mat",
            {
                "data": np.vstack([q.t, 1e3 * q.x, q.f, q.i]),
                "names": np.array(["time (s)", "position (mm)", "force (N)", "current (A)"], dtype=object),
            },
        )


@kind
def one_variable_a_channel(tests, p):
    import scipy.io as sio

    sio.savemat(
        p / "all.mat",
        {
            key: v
            for k, q in enumerate(tests, 1)
            for key, v in ((f"t{k}_s", q.t), (f"x{k}_mm", 1e3 * q.x), (f"F{k}_N", q.f), (f"I{k}_A", q.i))
        },
    )


@kind
def mac_zip_of_one_file(tests, p):
    with zipfile.ZipFile(p / "data.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        lines = ["run,time_s,displacement_mm,force_N,current_A"]
        for k, q in enumerate(tests):
            lines += [f"{k}," + line for line in rows(q.t, 1e3 * q.x, q.f, q.i)]
        archive.writestr("data/all.csv", "\n".join(lines) + "\n")
        archive.writestr("__MACOSX/data/._all.csv", bytes(120))
        archive.writestr("data/.DS_Store", bytes(60))


@kind
def gzip_csv(tests, p):
    import gzip

    for k, q in enumerate(tests):
        with gzip.open(p / f"t{k}.csv.gz", "wt") as file:
            file.write("\n".join(["time_s,disp_mm,force_N,current_A", *rows(q.t, 1e3 * q.x, q.f, q.i)]) + "\n")


@kind
def comparison_of_two_force_sensors(tests, p):
    for k, q in enumerate(tests):
        rng = np.random.default_rng(k)
        put(
            p / f"c{k}.csv",
            [
                "time [s],position [mm],sensor A [N],sensor B [N],current [A]",
                *rows(q.t, 1e3 * q.x, q.f, rng.normal(0, 4, q.t.size), q.i),
            ],
        )


@kind
def command_and_feedback(tests, p):
    for k, q in enumerate(tests):
        put(
            p / f"c{k}.csv",
            [
                "time [s],position command [mm],position feedback [mm],load feedback [N],current set [A],current feedback [A]",
                *rows(q.t, 1.01e3 * q.x, 1e3 * q.x, q.f, q.current + 0 * q.t, q.i),
            ],
        )


@kind
def controller_and_supply(tests, p):
    for k, q in enumerate(tests):
        put(p / f"servo-{k:03d}.txt", ["Time\tStroke\tLoad", "s\tmm\tN", *rows(q.t, 1e3 * q.x, q.f, sep="\t")])
        t = np.arange(0, q.t[-1] + 0.1, 0.25)
        put(
            p / f"psu-{k:03d}.csv",
            [
                "Elapsed [s];Voltage [V];Current [A]",
                *rows(t, 5 * q.current + 0 * t, q.current + 0 * t + 1e-3 * np.sin(t), sep=";"),
            ],
        )


@kind
def markdown_of_a_script(tests, p):
    for k, q in enumerate(tests):
        put(
            p / f"run{k}.csv",
            [
                "# title: MR damper",
                f"# current: {q.current} A",
                f"# freq: {q.frequency:g} Hz",
                "# columns: t[s] x[mm] F[N]",
                *rows(q.t, 1e3 * q.x, q.f, sep=" "),
            ],
        )


@kind
def dictionary_npz(tests, p):
    for k, q in enumerate(tests):
        np.savez(p / f"r{k}.npz", time_s=q.t, displacement_m=q.x, force_N=q.f, current_A=np.float64(q.current))


@kind
def npy_structured(tests, p):
    for k, q in enumerate(tests):
        a = np.zeros(
            q.t.size, dtype=[("time_s", "f8"), ("displacement_mm", "f8"), ("force_N", "f8"), ("current_A", "f8")]
        )
        a["time_s"], a["displacement_mm"], a["force_N"], a["current_A"] = q.t, 1e3 * q.x, q.f, q.i
        np.save(p / f"r{k}.npy", a)


@kind
def uff58(tests, p):
    for k, q in enumerate(tests):
        lines = []
        for code, label, unit, v in ((8, "displacement", "m", q.x), (13, "force", "N", q.f)):
            lines += [
                "    -1",
                "    58",
                f"MR damper {label}",
                "NONE",
                "12-Mar-24 10:15:33",
                f"Coil current: {q.current:g} A",
                "NONE",
                "    1         0    0         0       NONE         1   3       NONE         0   0",
                f"         2{q.t.size:10d}         1{0.0:13.5e}{q.t[1]:13.5e}{0.0:13.5e}",
                f"{17:10d}{0:5d}{0:5d}{0:5d} {'Time':<20s} {'s':<20s}",
                f"{code:10d}{0:5d}{0:5d}{0:5d} {label:<20s} {unit:<20s}",
                f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20s} {'NONE':<20s}",
                f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20s} {'NONE':<20s}",
            ]
            lines += ["".join(f"{x:13.5e}" for x in v[j : j + 6]) for j in range(0, v.size, 6)]
            lines += ["    -1"]
        put(p / f"r{k}.uff", lines)


@kind
def session_cut_by_rests(tests, p):
    parts = []
    t0 = 0.0
    for q in tests:
        rest = np.arange(0, 1.0, q.t[1])
        keep = q.t < 4 / q.frequency
        parts.append((t0 + rest, 0 * rest, 90 + 0 * rest, q.current + 0 * rest))
        t0 += 1.0
        parts.append((t0 + q.t[keep], q.x[keep], q.f[keep], q.i[keep]))
        t0 += q.t[keep][-1] + q.t[1]
    t, x, f, i = (np.concatenate([part[j] for part in parts]) for j in range(4))
    rng = np.random.default_rng(5)
    put(
        p / "session.csv",
        [
            "time_s,displacement_mm,force_N,current_A",
            *rows(
                t,
                1e3 * x + rng.normal(0, 0.003, t.size),
                f + rng.normal(0, 2, t.size),
                i + rng.normal(0, 0.002, t.size),
                fmt="%.5f",
            ),
        ],
    )


@kind
def counter_and_rate(tests, p):
    for k, q in enumerate(tests):
        put(
            p / f"n{k}.csv",
            [
                "Scan rate: 200 Hz",
                "Sample,Displacement (mm),Force (N),Current (A)",
                *[f"{n},{1e3 * a:.4f},{b:.3f},{c:.4f}" for n, (a, b, c) in enumerate(zip(q.x, q.f, q.i))],
            ],
        )


@kind
def italian_portuguese(tests, p):
    for k, q in enumerate(tests):
        put(
            p / f"prova{k}.csv",
            [
                "Tempo (s);Spostamento (mm);Forza (N);Corrente (A)",
                *rows(q.t, 1e3 * q.x, q.f, q.i, sep=";", mark=",", fmt="%.5f"),
            ],
        )


@kind
def measurement_computing(tests, p):
    for k, q in enumerate(tests):
        head = ["Device: USB-1608G", "Sample Number,Date/Time,CHAN0,CHAN1,CHAN2", ",,mm,N,A"]
        lines = [
            f"{n},03/12/2024 10:15:{t:06.3f} AM,{1e3 * x:.4f},{f:.2f},{i:.4f}"
            for n, (t, x, f, i) in enumerate(zip(q.t, q.x, q.f, q.i))
        ]
        put(p / f"mcc{k}.csv", head + lines)


@kind
def instron_wavematrix(tests, p):
    for k, q in enumerate(tests, 1):
        head = [
            '"Total Time (s)","Elapsed Cycles","Total Cycles","Position(Linear:Digital Position) (mm)","Load(Linear:Load) (kN)"'
        ]
        cycle = (q.t * q.frequency).astype(int)
        put(p / f"MRD7_{q.current:.1f}A_{k}.csv", head + rows(q.t, cycle, cycle + 1, 1e3 * q.x, q.f / 1e3, fmt="%.6f"))


@kind
def apparatus_xlsx_with_units_in_cells(tests, p):
    import openpyxl

    for k, q in enumerate(tests):
        book = openpyxl.Workbook()
        sheet = book.active
        sheet.append(["Operator", "KM"])
        sheet.append(["Coil current", q.current, "A"])
        sheet.append([])
        sheet.append(["No.", "Time", "Stroke", "Load"])
        sheet.append([None, "[s]", "[mm]", "[N]"])
        for n, (t, x, f) in enumerate(zip(q.t, q.x, q.f)):
            sheet.append([n, float(t), float(1e3 * x), float(f)])
        book.save(p / f"T{k}.xlsx")


@kind
def session_cut_by_steps_of_the_current(tests, p):
    for number, motion in enumerate(sorted({(q.frequency, q.amplitude) for q in tests})):
        group = [q for q in tests if (q.frequency, q.amplitude) == motion]
        size = np.count_nonzero(group[0].t < 4 / motion[0])
        t = group[0].t[1] * np.arange(size * len(group))
        x, f, i = (np.concatenate([getattr(q, c)[:size] for q in group]) for c in "xfi")
        put(p / f"sweep{number}.csv", ["time_s,displacement_mm,force_N,current_A", *rows(t, 1e3 * x, f, i)])


@kind
def crank_dynamometer(tests, p):
    for k, q in enumerate(tests, 1):
        head = [f"Drehzahl: {60 * q.frequency:g} 1/min", f"Spulenstrom: {q.current:g} A".replace(".", ",")]
        angle = (360 * q.frequency * q.t) % 360
        lines = rows(angle, 1e3 * q.x, q.f, sep=";", mark=",", fmt="%.4f")
        put(p / f"kurbel{k}.csv", [*head, "Kurbelwinkel [°];Weg [mm];Kraft [N]", *lines], "cp1252")


@kind
def data_beside_headers_of_channels(tests, p):
    """Channel_1_Data beside Channel_1_Header, as measuring amplifiers export to MATLAB."""
    import scipy.io as sio

    for k, q in enumerate(tests, 1):
        channels = (("Time  1 - default sample rate", "s", q.t), ("Weg", "mm", 1e3 * q.x), ("Kraft", "kN", q.f / 1e3),
                    ("Strom", "mA", 1e3 * q.i))  # fmt: skip
        says = {}
        for j, (title, unit, values) in enumerate(channels, 1):
            says[f"Channel_{j}_Header"] = {"SignalName": title, "Unit": unit, "NoOfSamples": str(values.size)}
            says[f"Channel_{j}_Data"] = values[:, None]
        sio.savemat(p / f"test{k}.mat", says)


@kind
def labview_with_a_clock_for_each_channel(tests, p):
    for k, q in enumerate(tests, 1):
        head = ["LabVIEW Measurement\t", "Separator\tTab", "Decimal_Separator\t.", "X_Columns\tMulti",
                "***End_of_Header***\t", "Channels\t3", "Y_Unit_Label\tmm\t\tN\t\tA\t", "X_Dimension\tTime\t\tTime\t\tTime",
                "***End_of_Header***", "X_Value\tPosition\tX_Value\tLoad\tX_Value\tCoil current\tComment"]  # fmt: skip
        slow = list(zip(q.t[::10], q.i[::10], strict=True))
        body = [
            f"{t:.5f}\t{1e3 * x:.5f}\t{t:.5f}\t{f:.4f}\t"
            + (f"{slow[j][0]:.5f}\t{slow[j][1]:.5f}\t" if j < len(slow) else "\t\t")
            for j, (t, x, f) in enumerate(zip(q.t, q.x, q.f, strict=True))
        ]
        put(p / f"test_{k}.lvm", head + body, eol="\r\n")


@kind
def oscilloscope_with_scales_in_labels(tests, p):
    for k, q in enumerate(tests, 1):
        head = ["Model,MSO", "Horizontal Units,s,,", "Vertical Units,V,V,V", "Label,LVDT 5 mm/V,LOAD 400 N/V,COIL 2 A/V",
                "TIME,CH1,CH2,CH3"]  # fmt: skip
        body = rows(q.t - 1, 200 * q.x, q.f / 400, q.i / 2, fmt=("%.5f", "%.6f", "%.6f", "%.5f"))
        put(p / f"tek{k:04d}.csv", head + body)


@kind
def counts_with_their_scale_in_the_heading(tests, p):
    for k, q in enumerate(tests, 1):
        head = ["# sample rate = 200 Hz", "n;pos_cnt [0.005 mm/count];load_cnt [0.25 N/count];coil_cnt [1 mA/count]"]
        n = np.arange(q.t.size)
        counts = (np.round(v) for v in (q.x / 5e-6, q.f / 0.25, 1e3 * q.i))
        put(p / f"RUN{k}.TXT", head + rows(n, *counts, fmt="%d", sep=";"))


@kind
def pages_of_a_printer(tests, p):
    for k, q in enumerate(tests, 1):
        lines = []
        for j, (t, x, f) in enumerate(zip(q.t, q.x, q.f, strict=True)):
            if j % 50 == 0:
                title = f"Ensayo: {k:02d}   Corriente: {q.current:.2f} A   Frecuencia: {q.frequency:.1f} Hz"
                lines += [("\f" if j else "") + f"BANCO DE ENSAYOS     Página {j // 50 + 1}", title.replace(".", ","), "-" * 45,
                          "      Tiempo       Desplaz.         Fuerza", "         (s)           (cm)          (daN)", "-" * 45]  # fmt: skip
            lines.append(f"{t:12.3f}{100 * x:15.5f}{f / 10:15.3f}".replace(".", ","))
        put(p / f"AMR-{k:02d}.LST", lines, "cp1252")


@kind
def table_by_run_and_a_plan(tests, p):
    import polars as pl

    parts = [pl.DataFrame({"run_id": np.full(q.t.size, 100 + k), "t_ms": 1e3 * q.t, "stroke_mm": 1e3 * q.x,
                           "load_kN": q.f / 1e3}) for k, q in enumerate(tests)]  # fmt: skip
    pl.concat(parts).write_parquet(p / "campaign.parquet")
    plan = [f"{100 + k},{q.current},{q.frequency},{1e3 * q.amplitude}" for k, q in enumerate(tests)]
    put(p / "plan.csv", ["run_id,current [A],frequency [Hz],amplitude [mm]", *plan])


@kind
def sheet_of_results_before_the_sheets_of_samples(tests, p):
    import openpyxl

    book = openpyxl.Workbook()
    book.active.append(["번호", "전류(A)", "주파수(Hz)", "변위 진폭(mm)", "최대하중(kgf)"])
    for k, q in enumerate(tests, 1):
        book.active.append([k, q.current, q.frequency, 1e3 * q.amplitude, float(q.f.max() / 9.80665)])
        sheet = book.create_sheet(f"시험{k:02d}")
        sheet.append(["시간(s)", "변위(mm)", "하중(kgf)"])
        for row in np.column_stack([q.t, 1e3 * q.x, q.f / 9.80665]).tolist():
            sheet.append(row)
    book.save(p / "시험.xlsx")


@kind
def json_lines_below_a_header(tests, p):
    for k, q in enumerate(tests, 1):
        head = {"rig": "small", "run": k, "units": {"t": "s", "x": "mm", "F": "N", "drive": "%"},
                "drive_full_scale": "100 % = 2.0 A"}  # fmt: skip
        samples = [
            {"t": float(t), "x": 1e3 * float(x), "F": float(f), "drive": 50 * float(i)}
            for t, x, f, i in zip(q.t, q.x, q.f, q.i, strict=True)
        ]
        put(p / f"run_{k}.jsonl", [json.dumps(entry) for entry in (head, *samples)])


@kind
def steps_with_rests_between(tests, p):
    """A file for each current: its motions one after the other, with the total time and that within the step."""
    for current in sorted({q.current for q in tests}):
        lines, start = ['"Total Time (s)","Elapsed Time (s)","Step","Position (mm)","Load (kN)"'], 0.0
        for step, q in enumerate([q for q in tests if q.current == current]):
            t, x, f = (v[: round(4 / (q.frequency * 0.005)) + 1] for v in (q.t - q.t[0], q.x - q.x[0], q.f))
            lines += rows(start + t, t, np.full(t.size, 2 * step), 1e3 * x, f / 1e3)
            rest = 0.005 * np.arange(400)
            still = np.full(400, 1e3 * x[-1]), np.full(400, f[-1] / 1e3)
            lines += rows(start + t[-1] + 0.005 + rest, rest, np.full(400, 2 * step + 1), *still)
            start += t[-1] + 2.01
        put(p / f"damper {current:.1f}A.tracking.csv", lines)


@kind
def plan_that_agrees_with_the_names(tests, p):
    plan = ["file;current [A];frequency [Hz]"]
    for q in tests:
        file = f"damper_{q.current:.1f}A_{name(q)}.csv"
        put(p / file, ["time [s];displacement [mm];force [N]", *rows(q.t, 1e3 * q.x, q.f, sep=";")])
        plan.append(f"{file};{q.current:.1f};{q.frequency:g}")
    put(p / "test_matrix.csv", plan)
    put(p / "notes.txt", ["Runs 1 to 4: 1.5 Hz, 10 mm. Run 5: 0.5 Hz, 20 mm.", "Written by hand, not checked."])


@kind
def plan_by_the_step_column(tests, p):
    lines = ['"Total Time (s)","Cycle Time (s)","Step","Position (mm)","Load (kN)"']
    plan = ["Step,Waveform,Frequency (Hz),Coil Current (A)"]
    for step, q in enumerate(tests, 1):
        lines += rows(40 * step + q.t, q.t % (1 / q.frequency), np.full(q.t.size, step), 1e3 * q.x, q.f / 1e3)
        plan.append(f"{step},Sine,{q.frequency:g},{q.current:g}")
    put(p / "tracking_1.csv", lines)
    put(p / "method_steps.csv", plan)


@kind
def recorder_with_axes_apart(tests, p):
    import scipy.io as sio

    def structs(items):
        out = np.empty((1, len(items)), dtype=[(key, "O") for key in items[0]])
        for j, item in enumerate(items):
            out[0, j] = tuple(item.values())
        return out

    for k, q in enumerate(tests, 1):
        slow = slice(None, None, 10)
        channels = (
            ("pos_act", 1e3 * q.x, "mm", 1.0),
            ("pos_ref", 1e3 * q.x + 0.02, "mm", 1.0),
            ("F_rod", q.f, "N", 1.0),
            ("i_coil", q.i[slow], "A", 2.0),
        )
        y = structs(
            [{"Name": f'"Model Root"/"{n}"/"Out1"', "Data": v[None], "Unit": u, "XIndex": x} for n, v, u, x in channels]
        )
        x = structs([{"Name": "", "Data": t[None], "Raster": "r", "Unit": "s"} for t in (q.t, q.t[slow])])
        sio.savemat(p / f"rec_{k:03d}.mat", {f"rec_{k:03d}": {"X": x, "Y": y, "Capture": "rec"}})


@kind
def signals_with_a_step_each(tests, p):
    def signal(title, unit, values, step):
        return {"name": title, "unit": unit, "dt": step, "t0": 0.0, "values": values.tolist()}

    made = [
        {
            "conditions": {
                "coil_current": {"value": q.current, "unit": "A"},
                "frequency": {"value": q.frequency, "unit": "Hz"},
            },
            "signals": [
                signal("rodForce", "kN", q.f / 1e3, 0.005),
                signal("pistonDisplacement", "mm", 1e3 * q.x, 0.005),
            ],
        }
        for q in tests
    ]
    (p / "campaign.json").write_text(json.dumps({"tests": made}))


@kind
def datasets_with_a_rate_each(tests, p):
    import h5py

    with h5py.File(p / "campaign.h5", "w") as file:
        for k, q in enumerate(tests):
            for title, values, unit, step in (
                ("force", q.f, "N", 1),
                ("displacement", q.x, "m", 2),
                ("coil_current", q.i, "A", 10),
            ):
                item = file.create_dataset(f"test_{k}/{title}", data=values[::step])
                item.attrs.update({"unit": unit, "sampling_rate_Hz": 200.0 / step})


@kind
def units_as_a_text_beside_arrays(tests, p):
    units = json.dumps({"time": "s", "pos": "mm", "force": "N", "current": "A"})
    for k, q in enumerate(tests):
        np.savez(
            p / f"run{k}.npz", time=q.t, pos=1e3 * q.x, force=q.f, current=q.current, fs=200.0, units=np.array(units)
        )


@kind
def columns_named_once_for_all_tests(tests, p):
    import scipy.io as sio

    made = np.empty((1, len(tests)), dtype=[("cur_A", "O"), ("data", "O")])
    for j, q in enumerate(tests):
        made[0, j] = (q.current, np.c_[q.t, 100 * q.x, q.f])
    words = {
        key: np.array([cells], dtype=object)
        for key, cells in (("channels", ["time", "disp", "force"]), ("units", ["s", "cm", "N"]))
    }
    sio.savemat(p / "all_tests.mat", {"tests": made, **words})


@kind
def labview_rows_without_their_comment(tests, p):
    lines = [
        "LabVIEW Measurement\t",
        "Separator\tTab",
        "Decimal_Separator\t,",
        "X_Columns\tOne",
        "***End_of_Header***\t",
    ]
    for q in tests:
        lines += [
            "\t",
            "Channels\t3",
            "Y_Unit_Label\tmm\tN\tA",
            "X_Dimension\tTime\tTime\tTime",
            "***End_of_Header***\t",
        ]
        lines.append("X_Value\tDéplacement\tEffort\tCourant\tComment")
        body = rows(q.t, 1e3 * q.x, q.f, q.i, fmt="%.5f", sep="\t", mark=",")
        lines += [body[0] + "\tdébut", *body[1:]]
    put(p / "essais.lvm", lines, "cp1252", "\r\n")


@kind
def logger_with_date_clock_and_thousandths(tests, p):
    import datetime as dt

    start, lines = dt.datetime(2022, 11, 17, 23, 58, 51), ["Data;Godzina;ms;Droga [mm];Siła [N];Prąd [mA];Uwagi"]
    for n, q in enumerate(tests):
        for t, x, f, i in zip(q.t, q.x, q.f, q.i):
            at = start + dt.timedelta(milliseconds=round(40_000 * n + 1e3 * t))
            cells = f"{1e3 * x:.3f};{f:.1f};{1e3 * i:.1f}".replace(".", ",")
            lines.append(
                f"{at:%d.%m.%Y};{at:%H:%M:%S};{at.microsecond // 1000:03d};{cells};{'próba' if t == 0 else ''}"
            )
    put(p / "rejestr.csv", lines, "cp1250", "\r\n")


@kind
def numbered_columns_and_a_sign_convention(tests, p):
    for n, q in enumerate(tests, 1):
        head = [
            f"INPUT: SINE  FREQ =  {q.frequency:5.2f} HZ   COIL CURRENT =  {q.current:5.2f} AMP",
            "SIGN CONVENTION: DISPLACEMENT POSITIVE IN EXTENSION, FORCE POSITIVE IN COMPRESSION",
            "COL  1  TIME  (SEC)",
            "COL  2  DISPLACEMENT  (IN)",
            "COL  3  FORCE  (LBF)",
            "COL  4  COMMAND  (IN)",
        ]
        body = zip(q.t, q.x / 0.0254, -q.f / 4.4482216, q.x / 0.0254)
        put(p / f"MRB{n:03d}.OUT", head + ["".join(f"{v:13.5E}" for v in row) for row in body])


@kind
def serial_monitor_with_duty(tests, p):
    for n, q in enumerate(tests, 1):
        body = zip(1e3 * q.t + 4711, 1e3 * q.x, q.f / 9.80665)
        lines = [
            "tare done",
            "millis,pos_mm,load_kgf,pwm_pct",
            *(f"{t:.0f},{x:.2f},{f:.3f},{50 * q.current:.0f}" for t, x, f in body),
        ]
        put(p / f"log{n}.txt", [f"16:04:{k % 60:02d}.{k % 1000:03d} -> {line}" for k, line in enumerate(lines)])
    put(p / "README.md", ["# Rig", "- coil driver: 100 % PWM = 2 A, linear"])


@kind
def groups_in_a_language_nobody_listed(tests, p):
    for n, pair in enumerate([tests[i : i + 2] for i in (0, 2, 4)]):
        titles, names, columns = [], [], []
        size = min(q.t.size for q in pair)
        for q in pair:
            titles += [f"{q.current:g} A {name(q)}", "", ""]
            names += ["Zaman (sn)", "Kayma (mm)", "Kuvvet (N)"]
            columns += [q.t[:size], 1e3 * q.x[:size], q.f[:size]]
        put(p / f"seri{n}.csv", [";".join(titles), ";".join(names), *rows(*columns, sep=";")])


@kind
def long_table_with_conditions_beside(tests, p):
    import polars as pl

    ids = [f"MRD-{1040 + 3 * n}" for n in range(len(tests))]
    parts = [
        pl.DataFrame({"test_id": [i] * q.t.size, "t_s": q.t, "stroke_mm": 1e3 * q.x, "load_N": q.f})
        for i, q in zip(ids, tests)
    ]
    pl.concat(parts).write_parquet(p / "timeseries.parquet")
    conditions = {"test_id": ids[::-1], "operator": ["ab"] * len(ids), "current_A": [q.current for q in tests[::-1]]}
    pl.DataFrame(conditions).write_parquet(p / "conditions.parquet")


@kind
def file_a_channel_in_a_folder_a_test(tests, p):
    for n, q in enumerate(tests, 1):
        folder = p / f"Ensayo_{n:02d}_I={q.current:g}A"
        folder.mkdir()
        for title, values in (("tiempo_s", q.t), ("desplazamiento_mm", 1e3 * q.x), ("fuerza_N", q.f)):
            put(folder / f"{title}.txt", rows(values, fmt="%.5f"))
