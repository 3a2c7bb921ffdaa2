"""Exports by machine or program: testing machines, loggers, manual sheets, many languages.

As in `lab_exports`, no code is shared with the readers. A text is defined by its header, the format of its rows and its
footer; a function writes any other file.
"""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from support.lab_exports import INCH, POUND, Truth, _motion

G = 9.80665


@dataclass(frozen=True)
class Text:
    """One file. Fields: n, i (current stated), I, mA, t, ms, x and um, inch, F, kN, daN, lbf, clock, k (row)."""

    file: str
    head: tuple[str, ...]
    row: str
    foot: tuple[str, ...] = ()
    encoding: str = "utf-8"
    comma: bool = False
    end: str = "\r\n"

    def __call__(self, tests: tuple[Truth, ...], folder: Path) -> None:
        for n, test in enumerate(tests, 1):
            said = {"n": n, "i": f"{test.current:.2f}", "motion": _motion(test), "rate": 1 / test.time[1]}
            said |= {"step": test.time[1], "top": 1e-3 * test.force.max(), "mA": f"{1e3 * test.current:.0f}"}
            mark = (lambda text: text.replace(".", ",")) if self.comma else str
            stated = {key: mark(f"{v:.7g}" if isinstance(v, float) else str(v)) for key, v in said.items()}
            rows = [mark(self.row.format(**sample)) for sample in samples(test)]
            if self.file.startswith("log"):  # stamps keep their points
                rows = [self.row.format(**sample) for sample in samples(test)]
            lines = [*(h.format(**stated) for h in self.head), *rows, *(f.format(**stated) for f in self.foot), ""]
            path = folder / self.file.format(**stated)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(self.end.join(lines).encode(self.encoding))


def samples(test: Truth):
    """Every sample in every unit."""
    start = datetime.datetime(2024, 3, 1, 9, 59, 58)
    v = np.gradient(test.x, test.time)
    a = np.gradient(v, test.time) / G
    for k, (t, x, f, i) in enumerate(test.table.tolist()):
        soon = start + datetime.timedelta(seconds=-3000, microseconds=round(1e6 * t))
        now = start + datetime.timedelta(microseconds=round(1e6 * t))
        yield {
            "k": k, "t": t, "ms": 1e3 * t, "x": 1e3 * x, "um": 1e6 * x, "inch": x / INCH, "metre": x, "F": f,
            "kN": 1e-3 * f, "daN": 0.1 * f, "lbf": f / POUND, "I": i, "mA": 1e3 * i, "now": now, "hour": now.hour,
            "soon": soon, "ns": 1_709_283_598_000_000_000 + round(1e9 * t),
            "total": t + 120.5, "cycle": int(t * test.frequency + 1e-9), "v": v[k], "a": a[k],
            "inside": t % (1 / test.frequency), "slow": f"{i:.4f}" if k % 10 == 0 else "", "set": test.current,
            "nan": f"{i:.4f}" if k % 5 == 0 else "NaN", "warm": 25 + 0.01 * k,
            "beside": (f"Coil current (A),{test.current:g}", "Operator,KH", "Damper,7")[k] if k < 3 else ",",
            "tag": "trace_values" if k == 0 else "",
        }  # fmt: skip


_PLAIN = "{t:.5f},{x:.5f},{F:.3f},{I:.4f}"
_GERMAN = "{t:.5f};{x:.5f};{F:.3f};{I:.4f}"
TEXTS = {
    "mts_testsuite": Text(
        "TestRun{n}.csv",
        ('"MTS TestSuite","TWE"', '"Test Run Name:","DMP-01 {i} A"', "", '"Time","Axial Displacement","Axial Force"',
         '"sec","mm","kN"'),
        '"{t:.5f}","{x:.5f}","{kN:.6f}"',
    ),
    "instron_bluehill": Text(
        "Specimen_RawData_{n}.csv",
        ('"Results Table 1"', '"Specimen label","Maximum Load (kN)","Extension at max (mm)"', '"S{n}","1.234","5.6"',
         "", '"Coil current","{i}","A"', "", '"Time","Extension","Load"', '"(s)","(mm)","(kN)"'),
        '"{t:.5f}","{x:.5f}","{kN:.6f}"',
    ),
    "instron_wavematrix": Text(
        "damper {i}A {motion}.csv",
        ("Total Time (s),Cycle Elapsed Time (s),Total Cycles,Step,Total Cycle Count(Linear Waveform),"
         "Position(Linear:Digital Position) (mm),Load(Linear:Load) (kN)",),
        "{t:.5f},{inside:.5f},{cycle},1,{cycle},{x:.5f},{kN:.6f}",
    ),
    "zwick": Text(
        "Probe{n}.TRA",
        ('"Prüfprotokoll"', '"Prüfer";"KH"', '"Spulenstrom";{i};"A"', '"Prüfzeit";"Standardweg";"Standardkraft"',
         '"s";"mm";"N"'),
        "{t:.5f};{x:.5f};{F:.3f}", encoding="cp1252", comma=True,
    ),
    "servotest": Text(
        "run{n}.txt",
        ("Servotest PULSAR data export", "File:\tRun{n}", "Sample Rate:\t{rate} Hz", "Current setpoint:\t{i} A", "",
         "Time\tActuator Position\tLoad Cell", "s\tmm\tkN"),
        "{t:.5f}\t{x:.5f}\t{kN:.6f}\t",
    ),
    "dspace": Text(
        "rec{n}.csv",
        ("type,measurement,,,", "path,,Model Root/Disp,Model Root/Force,Model Root/Current",
         "description,time,Displacement,Force,Current", "unit,s,mm,N,A"),
        "{tag}," + _PLAIN,
    ),
    "catman": Text(
        "catman{n}.ASC",
        ("HBM_CATMAN_DATAFILE", "T0 = 01.03.2024 10:11:12", "Number of channels: 4", "",
         "Zeit  1 - Standardmessrate\tWeg\tKraft\tStrom", "s\tmm\tkN\tA", "Kanal 0\tKanal 1\tKanal 2\tKanal 3"),
        "{t:.5f}\t{x:.5f}\t{kN:.6f}\t{I:.4f}", encoding="cp1252", comma=True,
    ),
    "diadem": Text(
        "kanal{n}.csv", ("Name;Zeit;Weg;Kraft;Spulenstrom", "Einheit;s;mm;N;A", "Kommentar;;;;"), ";" + _GERMAN,
        encoding="cp1252", comma=True,
    ),
    "statistics_below": Text(
        "r{n}.csv", ("Time (s);Stroke (mm);Load (kN);Current (A)",), "{t:.5f};{x:.5f};{kN:.6f};{I:.4f}",
        foot=("", "Maximum;20.0;{top};1.0", "Minimum;-20.0;-1.0;1.0", "End of data"),
    ),
    "french": Text(
        "essai{n}.csv", ("Banc d'essai amortisseur", "Temps (s);Déplacement (mm);Effort (daN);Intensité (A)"),
        "{t:.5f};{x:.5f};{daN:.4f};{I:.4f}", encoding="cp1252", comma=True,
    ),
    "japanese": Text(
        "data{n}.csv", ("試験機データ", "時間[s],変位[mm],荷重[kN],電流[A]"), "{t:.5f},{x:.5f},{kN:.6f},{I:.4f}",
        encoding="cp932",
    ),
    "chinese": Text("试验{n}.csv", ("时间(s),位移(mm),力(N),电流(A)",), _PLAIN, encoding="gb18030"),
    "chinese_units": Text(
        "试验{n}.csv", ("时间（秒）,位移（毫米）,阻尼力（牛）,线圈电流（安）",), _PLAIN, encoding="utf-8-sig",
    ),
    "korean": Text("r{n}.csv", ("시간(s),변위(mm),하중(N),전류(A)",), _PLAIN, encoding="cp949"),
    "russian": Text(
        "опыт{n}.csv", ("Время, с;Перемещение, мм;Сила, кН;Ток, А",), "{t:.5f};{x:.5f};{kN:.6f};{I:.4f}",
        encoding="cp1251", comma=True,
    ),
    "czech": Text("r{n}.csv", ("Čas [s];Dráha [mm];Síla [N];Proud [A]",), _GERMAN, encoding="cp1250", comma=True),
    "polish": Text("r{n}.csv", ("Czas [s];Droga [mm];Siła [N];Prąd [A]",), _GERMAN, encoding="cp1250", comma=True),
    "spanish": Text(
        "r{n}.csv", ("Tiempo (s);Posición (mm);Fuerza (N);Intensidad (A)",), _GERMAN, encoding="cp1252", comma=True,
    ),
    "italian": Text(
        "r{n}.txt", ("Tempo [s];Spostamento [mm];Forza [N];Corrente [A]",), _GERMAN, encoding="mac_roman", comma=True,
    ),
    "clock": Text("log{n}.csv", ("Timestamp,Position [mm],Force [N],Current [A]",), "{now:%H:%M:%S.%f}," + _PLAIN[8:]),
    "clock_beside_date": Text(
        "log{n}.csv", ("Date;Time;Position [mm];Force [N];Current [A]",),
        "01.03.2024;{hour}:{now:%M:%S.%f};{x:.5f};{F:.3f};{I:.4f}",
    ),
    "american_clock": Text(
        "log{n}.csv", ("Time,Position (in),Load (lbs),Current (A)",),
        "3/4/2024 {now:%I:%M:%S.%f %p},{inch:.6f},{lbf:.4f},{I:.4f}",
    ),
    "iso_clock": Text(
        "log{n}.csv", ("time,displacement_mm,force_N,current_A",), "{now:%Y-%m-%dT%H:%M:%S.%f}+01:00," + _PLAIN[8:],
    ),
    "counted_samples": Text(
        "r{n}.csv", ("Sample rate: {rate} Hz", "Coil current: {i} A", "Sample,Position (mm),Force (N)"),
        "{k},{x:.5f},{F:.3f}",
    ),
    "stated_step": Text(
        "r{n}.csv", ("# dt = {step} s", "Position (mm),Force (N),Current (A)"), "{x:.5f},{F:.3f},{I:.4f}",
    ),
    "fixed_width": Text(
        "r{n}.txt",
        ("      Time   Axial Displ   Axial Force       Current",
         "       (s)          (mm)           (N)           (A)"),
        "{t:10.5f}{x:14.5f}{F:14.3f}{I:14.4f}",
    ),
    "folders": Text("{i}A/{motion}.csv", ("time_s,disp_mm,force_N",), "{t:.5f},{x:.5f},{F:.3f}"),
    "folders_alike": Text("I = {mA} mA/{motion}/data.csv", ("time_s,disp_mm,force_N",), "{t:.5f},{x:.5f},{F:.3f}"),
    "trailing_marks": Text(
        "r{n}.csv", ("Zeit [s];Weg [mm];Kraft [N];Strom [mA];",), "{t:.5f};{x:.5f};{F:.3f};{mA:.2f};",
        encoding="utf-8-sig", comma=True,
    ),
    "sep_line": Text("r{n}.csv", ("sep=;", "Time [s];Position [mm];Force [N];Current [A]"), _GERMAN),
    "imperial_words": Text(
        "r{n}.csv", ("Time sec,Stroke in,Load lbs,Current amps",), "{t:.5f},{inch:.6f},{lbf:.5f},{I:.4f}",
    ),
    "slashed_units": Text("r{n}.csv", ("t / ms,s / µm,F / kN,I / mA",), "{ms:.3f},{um:.3f},{kN:.6f},{mA:.2f}"),
    "further_channels": Text(
        "r{n}.csv",
        ("Force (N),Displacement (mm),Time (s),Velocity (m/s),Acceleration (g),Oil temperature (°C),Surface temp (°C),"
         "Supply voltage (V),Current (A),Displacement Command (mm),Status",),
        "{F:.3f},{x:.5f},{t:.5f},{v:.5f},{a:.5f},{warm:.2f},{warm:.1f},12.0,{I:.4f},{x:.5f},OK",
    ),
    "slow_channels": Text(
        "r{n}.csv", ("Time (s),Displacement (mm),Force (N),Temperature (degC),Current (A)",),
        "{t:.5f},{x:.5f},{F:.3f},{slow},{slow}",
    ),
    "slow_current": Text(
        "r{n}.csv", ("Time (s),Displacement (mm),Force (N),Current (A)",), "{t:.5f},{x:.5f},{F:.3f},{nan}",
    ),
    "symbols": Text("r{n}.csv", ("t[s];x[mm];F[N];I[A];U[V]",), "{t:.5f};{x:.5f};{F:.3f};{I:.4f};{warm:.3f}"),
    "sensors_above": Text(
        "r{n}.csv", ("Channel 1,Channel 2,Channel 3,Channel 4", "Time,LVDT,Load cell,Coil current", "s,mm,N,A"), _PLAIN,
    ),
    "types_below": Text(
        "r{n}.csv", ("Time,LVDT,Load cell,Coil current", "s,mm,N,A", "double,double,double,double", ""), _PLAIN,
    ),
    "pandas": Text(
        "r{n}.csv", (",Time (s),Displacement (mm),Force (N),Current (A)",), "{k},{t!r},{x!r},{F!r},{I!r}", end="\n",
    ),
    "two_clocks": Text(
        "r{n}.csv", ("Running Time (s),Total Time (s),Axial Displacement (mm),Axial Force (N),Coil Current (A)",),
        "{t:.5f},{total:.5f},{x:.5f},{F:.3f},{I:.4f}",
    ),
    "set_point_beside": Text(
        "r{n}.csv", ("Time (s),Displacement (mm),Force (N),Current setpoint (A),Current actual (A)",),
        "{t:.5f},{x:.5f},{F:.3f},{set:.2f},{I:.4f}",
    ),
    "set_point_only": Text(
        "r{n}.csv", ("Time (s),Displacement (mm),Force (N),Current setpoint (A)",), "{t:.5f},{x:.5f},{F:.3f},{set:.2f}",
    ),
    "json_line": Text(
        "r{n}.dat",
        ('# {{"operator": "KH", "coil_current_A": {i}, "rig": "B2"}}', "# time_s displacement_mm force_N"),
        "{t:.5f} {x:.5f} {F:.3f}",
    ),
    "savetxt": Text("r{n}.txt", ("# t [s] x [m] F [N] I [A]",), "{t:.18e} {metre:.18e} {F:.18e} {I:.18e}", end="\n"),
    "notes_beside": Text(
        "r{n}.csv", ("Time (s),Disp (mm),Force (N),,Parameter,Value",), "{t:.5f},{x:.5f},{F:.3f},,{beside}",
    ),
    "key_values": Text(
        "r{n}.csv", ("[Header]", "Version=2", "Strom_A={i}", "[Data]", "Zeit_s;Weg_mm;Kraft_N"),
        "{t:.5f};{x:.5f};{F:.3f}", encoding="cp1252", comma=True,
    ),
    "devices": Text(
        "r{n}.csv", ("timestamps,Force\\ETKC:1,Pos\\ETKC:1,Current\\ETKC:1", "s,N,mm,A"),
        "{t:.5f},{F:.3f},{x:.5f},{I:.4f}",
    ),
    "units_behind_numbers": Text(
        "r{n}.csv", ("Time;Stroke;Load;Current",), "{t:.5f}s;{x:.5f}mm;{kN:.6f} kN;{mA:.2f} mA",
    ),
    "unit_behind_one_column": Text(
        "r{n}.csv", ("Time (s);Stroke (mm);Load;Current (A)",), "{t:.5f};{x:.5f};{F:.3f} N;{I:.4f}", comma=True,
    ),
    "units_above_names": Text("r{n}.csv", ("s,mm,N,A", "Time,Displacement,Force,Current"), _PLAIN),
    "rule_below_names": Text(
        "r{n}.txt",
        ("Time     Displ    Force    Current", "[s]      [mm]     [N]      [A]", "-------- -------- -------- ---"),
        "{t:9.5f}  {x:9.5f} {F:9.3f} {I:8.4f}",
    ),
    "between_bars": Text(
        "r{n}.txt", ("| Time [s] | Disp [mm] | Force [N] | Current [A] |", "|---|---|---|---|"),
        "| {t:.5f} | {x:.5f} | {F:.3f} | {I:.4f} |",
    ),
    "minutes_and_seconds": Text(
        "log{n}.csv", ("Time,Position (mm),Force (N),Current (A)",), "{soon:%M:%S.%f}," + _PLAIN[8:],
    ),
    "epoch": Text("r{n}.csv", ("time_ns,disp_mm,force_N,current_A",), "{ns}," + _PLAIN[8:]),
    "empty_velocity": Text(
        "r{n}.csv", ("Time (s),Disp (mm),Velocity (mm/s),Damper force (N),I_coil (A)",),
        "{t:.5f},{x:.5f},,{F:.3f},{I:.4f}",
    ),
    "marked_end": Text("r{n}.csv", ("time_s,disp_mm,force_N,current_A",), _PLAIN, foot=("", "[EOF]")),
    "name_with_letter": Text("MRD_I{i}A_f1_A20_{n}.csv", ("time_s,disp_mm,force_N",), "{t:.5f},{x:.5f},{F:.3f}"),
    "name_with_word": Text("Strom{mA}mA_{n}.csv", ("time_s,disp_mm,force_N",), "{t:.5f},{x:.5f},{F:.3f}"),
    "name_in_small_letters": Text("rig {mA}ma {n}.csv", ("time_s,disp_mm,force_N",), "{t:.5f},{x:.5f},{F:.3f}"),
    "name_with_amps": Text("damper_{i}amps_{n}.csv", ("time_s,disp_mm,force_N",), "{t:.5f},{x:.5f},{F:.3f}"),
    "unnamed_amperes": Text("r{n}.csv", ("Time (s),Sz (mm),Fz (kN),Ch 4 (A)",), "{t:.5f},{x:.5f},{kN:.6f},{I:.4f}"),
    "hungarian": Text(
        "r{n}.csv", ("Idő [s];Elmozdulás [mm];Erő [N];Áram [A]",), _GERMAN, encoding="cp1250", comma=True,
    ),
    "greek": Text(
        "r{n}.csv", ("Χρόνος [s];Μετατόπιση [mm];Δύναμη [N];Ρεύμα [A]",), _GERMAN, encoding="cp1253", comma=True,
    ),
    "ukrainian": Text(
        "r{n}.csv", ("Час, с;Переміщення, мм;Сила, Н;Струм, А",), _GERMAN, encoding="cp1251", comma=True,
    ),
    "norwegian": Text(
        "r{n}.csv", ("Tid [s];Forskyvning [mm];Kraft [N];Strøm [A]",), _GERMAN, encoding="cp1252", comma=True,
    ),
    "own_suffix": Text("damper.{n}", ("Time (s)\tPosition (mm)\tForce (N)\tCurrent (A)",), _GERMAN.replace(";", "\t")),
}  # fmt: skip
