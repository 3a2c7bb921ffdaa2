"""Exports of laboratory machines: the tests of one damper in many kinds of files.

No code is shared with the readers: every file is written line by line or by the library of the format, from the same
true channels.
"""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mrdamper.models import model_type
from mrdamper.physics.motion import Excitation
from mrdamper.physics.simulation import simulate

POUND, INCH, KILOPOND = 4.4482216152605, 0.0254, 9.80665
UNITS = {
    "si": ("s", 1.0, "m", 1.0, "N", 1.0, "A", 1.0),
    "mm-N": ("s", 1.0, "mm", 1e-3, "N", 1.0, "A", 1.0),
    "mm-kN": ("s", 1.0, "mm", 1e-3, "kN", 1e3, "mA", 1e-3),
    "inch": ("sec", 1.0, "in", INCH, "lbf", POUND, "A", 1.0),
    "cm-kgf": ("ms", 1e-3, "cm", 1e-2, "kgf", KILOPOND, "A", 1.0),
    "daN": ("s", 1.0, "mm", 1e-3, "daN", 10.0, "mA", 1e-3),
}
# separator, decimal mark, encoding, names of channels, runs and the coil current
LOCALES = {
    "en": (",", ".", "utf-8", "Time", "Displacement", "Force", "Current", "Test No", "Coil current"),
    "de": (";", ",", "cp1252", "Zeit", "Weg", "Kraft", "Strom", "Versuch", "Spulenstrom"),
    "fr": ("\t", ",", "utf-8", "Temps", "Déplacement", "Force", "Courant", "Essai", "Courant bobine"),
    "excel": ("\t", ".", "utf-16", "Time", "Position", "Load", "Current", "Specimen", "Current"),
}


@dataclass(frozen=True)
class Truth:
    """One true test: channels in SI."""

    current: float
    frequency: float
    amplitude: float
    time: np.ndarray
    x: np.ndarray
    force: np.ndarray
    amperes: np.ndarray

    @property
    def table(self) -> np.ndarray:
        return np.column_stack([self.time, self.x, self.force, self.amperes])


@dataclass(frozen=True)
class Lab:
    """Format of a laboratory's files, and its tests."""

    tests: tuple[Truth, ...]
    locale: str = "en"
    units: str = "mm-N"
    digits: int = 5
    facts: dict = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        return list(LOCALES[self.locale][3:7])

    @property
    def unit_names(self) -> list[str]:
        return list(UNITS[self.units][::2])

    @property
    def separator(self) -> str:
        return LOCALES[self.locale][0]

    def values(self, test: Truth) -> np.ndarray:
        return test.table / np.array(UNITS[self.units][1::2])

    def number(self, value: float, digits: int | None = None) -> str:
        digits = self.digits if digits is None else digits
        return f"{value:.{digits}f}".replace(".", LOCALES[self.locale][1])

    def row(self, values) -> str:
        return self.separator.join("" if np.isnan(v) else self.number(v) for v in values)

    def encode(self, lines: list[str]) -> bytes:
        text = "\r\n".join(lines) + "\r\n"
        return text.encode(LOCALES[self.locale][2])

    def header(self, names: list[str] | None = None, units: list[str] | None = None) -> str:
        return self.separator.join(
            f"{n} [{u}]" for n, u in zip(names or self.names, units or self.unit_names, strict=True)
        )


def damper(current: float):
    """The true damper at a current: Bouc–Wen, stronger with current."""
    return model_type("bouc-wen").build(
        {"c": 1500 + 700 * current, "alpha": (250 + 1100 * current) / 1e-3, "beta": 5e5, "gamma": 5e5, "f0": 60.0}
    )


def campaign(seed: int, noise: float = 0.002, currents=(0.0, 0.4, 0.8, 1.2), cycles: int = 4, points: int = 120):
    """Four currents, three motions, with noise in force [share of 1 kN] and current."""
    rng = np.random.default_rng([31, seed])
    tests = []
    for current in currents:
        for frequency, amplitude in ((0.5, 0.02), (1.0, 0.02), (2.0, 0.01)):
            time = np.arange(cycles * points + 1) / (points * frequency)
            omega = 2 * np.pi * frequency
            x, v = amplitude * np.sin(omega * time), amplitude * omega * np.cos(omega * time)
            motion = Excitation(time, x, v, -(omega**2) * x, np.full(time.size, current))
            force = simulate(damper(current), motion).force + 1e3 * noise * rng.standard_normal(time.size)
            amperes = current + 2 * noise * rng.standard_normal(time.size)
            tests.append(Truth(current, frequency, amplitude, time, x, force, np.round(amperes, 4)))
    return tuple(tests)


def _motion(test: Truth) -> str:
    return f"{test.frequency:g}Hz_{1e3 * test.amplitude:g}mm".replace(".", "x")


def current_column(lab: Lab, folder: Path) -> None:
    """One file per test with a measured current."""
    for number, test in enumerate(lab.tests, 1):
        rows = [lab.header(), *map(lab.row, lab.values(test))]
        (folder / f"run{number:02}.csv").write_bytes(lab.encode(rows))


def file_names(lab: Lab, folder: Path) -> None:
    """The current in the file name, in the notation of the laboratory."""
    forms = (
        lambda i: f"{1e3 * i:.0f}mA", lambda i: f"{i:.1f}A", lambda i: f"{i:.1f}A".replace(".", "p"),
        lambda i: f"-{i:.1f}A-",
    )  # fmt: skip
    form = forms[lab.facts.get("form", 0) % len(forms)]
    for number, test in enumerate(lab.tests, 1):
        rows = [lab.header(lab.names[:3], lab.unit_names[:3]), *map(lab.row, lab.values(test)[:, :3])]
        (folder / f"{_motion(test)}_{form(test.current)}_{number}.txt").write_bytes(lab.encode(rows))


def header_lines(lab: Lab, folder: Path) -> None:
    """Lines of conditions above a row of names and a row of units."""
    s = lab.separator
    for number, test in enumerate(lab.tests, 1):
        rows = [
            f"MR damper test rig 4{s}",
            f"{LOCALES[lab.locale][8]}:{s} {lab.number(test.current, 2)} A",
            f"Amplitude:{s} {lab.number(1e3 * test.amplitude, 1)} mm",
            f"Operator:{s} KH",
            "",
            s.join(lab.names[:3]),
            s.join(lab.unit_names[:3]),
            *map(lab.row, lab.values(test)[:, :3]),
        ]
        (folder / f"messung_{number:03}.csv").write_bytes(lab.encode(rows))


def run_column(lab: Lab, folder: Path) -> None:
    """All tests in one file, numbered in a column."""
    rows = [LOCALES[lab.locale][7] + lab.separator + lab.header()]
    for number, test in enumerate(lab.tests, 1):
        rows += [f"{number}{lab.separator}{lab.row(v)}" for v in lab.values(test)]
    (folder / "all.csv").write_bytes(lab.encode(rows))


def specimen_names(lab: Lab, folder: Path) -> None:
    """All tests in one file, distinguished by words in the last column."""
    rows = [lab.header() + lab.separator + "Test name"]
    for test in lab.tests:
        rows += [lab.row(v) + f"{lab.separator}sine {_motion(test)} #{test.current:g}" for v in lab.values(test)]
    (folder / "campaign.csv").write_bytes(lab.encode(rows))


def side_by_side(lab: Lab, folder: Path) -> None:
    """Adjacent groups of columns, each with its own time; a row above states the condition."""
    s, width = lab.separator, 3
    over = [f"{lab.number(t.current, 1)} A{s * (width - 1)}" for t in lab.tests]
    longest = max(t.time.size for t in lab.tests) + 3
    table = np.full((longest, width * len(lab.tests)), np.nan)
    for i, test in enumerate(lab.tests):
        values = lab.values(test)[:, :width]
        values = values[: values.shape[0] - i]  # of different lengths
        table[: values.shape[0], width * i : width * (i + 1)] = values
    rows = [s.join(over), s.join([lab.header(lab.names[:3], lab.unit_names[:3])] * len(lab.tests))]
    rows += [lab.row(v) for v in table if not np.isnan(v).all()]
    (folder / "overview.csv").write_bytes(lab.encode(rows))


def numbered_groups(lab: Lab, folder: Path) -> None:
    """Groups of columns with numbers behind their names and a current each."""
    names = [[f"{n} {i}" for n in lab.names] for i in range(1, len(lab.tests) + 1)]
    longest = max(t.time.size for t in lab.tests)
    table = np.full((longest, 4 * len(lab.tests)), np.nan)
    for i, test in enumerate(lab.tests):
        table[: test.time.size, 4 * i : 4 * (i + 1)] = lab.values(test)
    rows = [lab.separator.join(lab.header(group) for group in names), *map(lab.row, table)]
    (folder / "groups.csv").write_bytes(lab.encode(rows))


def concatenated(lab: Lab, folder: Path) -> None:
    """Tests one after the other, the time starting again."""
    rows = [lab.header(), *(lab.row(v) for test in lab.tests for v in lab.values(test))]
    (folder / "session.csv").write_bytes(lab.encode(rows))


def repeated_headers(lab: Lab, folder: Path) -> None:
    """Acquisition blocks of a testing machine: conditions and header again before every block."""
    rows = ["MTS793|BTW|ENU|1|2|/|.|:|1|0|0|A", ""]
    for number, test in enumerate(lab.tests, 1):
        rows += [
            f"Data Acquisition {number}\tCyclic Acquisition",
            f"Coil current: {test.current:.2f} A",
            "Station Name:\tdamper.cfg",
            "\t".join(["Time", "Axial Displacement", "Axial Force"]),
            "\t".join(["Sec", "mm", "kN"]),
            *("\t".join(f"{v:.6f}" for v in row) for row in test.table[:, :3] * [1, 1e3, 1e-3]),
            "",
        ]
    (folder / "specimen.dat").write_text("\n".join(rows) + "\n", encoding="utf-8")


def lvm(lab: Lab, folder: Path) -> None:
    """LabVIEW measurement files: a header of the file, one of the segment, an empty column of comments."""
    mark = LOCALES[lab.locale][1]
    for number, test in enumerate(lab.tests, 1):
        values = lab.values(test)
        rows = [
            "LabVIEW Measurement\t", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab",
            f"Decimal_Separator\t{mark}", "Multi_Headings\tNo", "X_Columns\tOne", "Time_Pref\tRelative",
            "Operator\tlab", f"Date\t2024/03/{number:02}", "Time\t10:11:12.123456", "***End_of_Header***\t", "\t",
            "Channels\t3\t\t\t", "Samples\t" + "\t".join([str(test.time.size)] * 3) + "\t",
            "Date\t" + "\t".join(["2024/03/01"] * 3) + "\t", "Time\t" + "\t".join(["10:11:12.123456"] * 3) + "\t",
            "Y_Unit_Label\t" + "\t".join(lab.unit_names[1:]) + "\t",
            "X_Dimension\t" + "\t".join(["Time"] * 3) + "\t",
            "X0\t" + "\t".join([f"0{mark}0000000000000000E+0"] * 3) + "\t",
            "Delta_X\t" + "\t".join([f"{test.time[1]:.6f}".replace(".", mark)] * 3) + "\t",
            "***End_of_Header***\t\t\t\t",
            "X_Value\t" + "\t".join(lab.names[1:]) + "\tComment",
        ]  # fmt: skip
        rows += ["\t".join(f"{v:.6f}".replace(".", mark) for v in [t, *row[1:]]) + "\t" for t, row in
                 zip(test.time, values, strict=True)]  # fmt: skip
        (folder / f"meas_{number:03}.lvm").write_bytes("\r\n".join([*rows, ""]).encode("cp1252"))


def asc(lab: Lab, folder: Path) -> None:
    """Two headers: one of the measurement, one of the channels with units in a row of their own."""
    s = "\t"
    for number, test in enumerate(lab.tests, 1):
        rows = [
            "[Measurement]", f"Name={number}", "Device=Quantum", f"Current={lab.number(test.current, 2)} A", "",
            "[Channels]", "Count=3", f"Rate={lab.number(1 / test.time[1], 1)} Hz", "", s.join(lab.names[:3]),
            s.join(f"[{u}]" for u in lab.unit_names[:3]),
            *(s.join(lab.number(v) for v in row) for row in lab.values(test)[:, :3]),
        ]  # fmt: skip
        (folder / f"m{number:03}.asc").write_bytes(("\n".join(rows) + "\n").encode("cp1252"))


def tests_table(lab: Lab, folder: Path) -> None:
    """Currents in a table of tests beside the files."""
    rows = ["file,current [A],temperature [°C],split,session,notes"]
    for number, test in enumerate(lab.tests, 1):
        text = [lab.header(lab.names[:3], lab.unit_names[:3]), *map(lab.row, lab.values(test)[:, :3])]
        (folder / f"t{number:02}.csv").write_bytes(lab.encode(text))
        rows.append(f"t{number:02}.csv,{test.current:g},{23 + number},train,monday,")
    (folder / "tests.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")


def sheets(lab: Lab, folder: Path) -> None:
    """A workbook with one sheet per test, named after its condition."""
    from openpyxl import Workbook

    book = Workbook()
    book.remove(book.active)
    for number, test in enumerate(lab.tests, 1):
        sheet = book.create_sheet(f"{test.current:g} A {_motion(test)} {number}"[:31])
        sheet.append([f"{n} [{u}]" for n, u in zip(lab.names[:3], lab.unit_names[:3], strict=True)])
        for row in lab.values(test)[:, :3]:
            sheet.append([round(float(v), 6) for v in row])
    book.save(folder / "all tests.xlsx")


def struct_array(lab: Lab, folder: Path) -> None:
    """A MATLAB struct array, the channels in a struct within, units in the names of fields."""
    from scipy.io import savemat

    kind = [("current_A", object), ("label", object), ("data", object)]
    units = [u.replace("/", "_") for u in lab.unit_names]
    tests = np.empty((1, len(lab.tests)), dtype=kind)
    for i, test in enumerate(lab.tests):
        values = lab.values(test)
        data = {
            f"{n}_{u}": values[:, k] for k, (n, u) in enumerate(zip(("time", "disp", "force"), units, strict=False))
        }
        tests[0, i] = (test.current, _motion(test), data)
    savemat(folder / "tests.mat", {"tests": tests, "operator": "KH"})


def hdf5_groups(lab: Lab, folder: Path) -> None:
    """One group per test, the current as an attribute."""
    import h5py

    with h5py.File(folder / "tests.h5", "w") as file:
        for i, test in enumerate(lab.tests):
            group = file.create_group(f"tests/t{i:02}")
            group.attrs["coil current"] = f"{test.current:.2f} A"
            for name, unit, values in zip(
                ("time", "displacement", "force"), lab.unit_names, lab.values(test).T, strict=False
            ):
                group.create_dataset(name, data=values).attrs["units"] = unit


def tdms_groups(lab: Lab, folder: Path) -> None:
    """One group per test, waveforms with a step, the current in the group's name."""
    from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

    objects = [RootObject()]
    for i, test in enumerate(lab.tests):
        name = f"{i} {test.current:.1f}A"
        objects.append(GroupObject(name))
        for channel, unit, values in zip(
            ("Displacement", "Force"), lab.unit_names[1:], lab.values(test).T[1:3], strict=False
        ):
            wave = {"unit_string": unit, "wf_increment": float(test.time[1]), "wf_start_offset": 0.0}
            objects.append(ChannelObject(name, channel, values, properties=wave))
    with TdmsWriter(folder / "tests.tdms") as writer:
        writer.write_segment(objects)


def parquet(lab: Lab, folder: Path) -> None:
    """A table of all tests with a column of runs."""
    import polars as pl

    names = [f"{n} ({u})" for n, u in zip(lab.names, lab.unit_names, strict=True)]
    parts = [
        pl.DataFrame({"run": [f"r{i}"] * t.time.size, **dict(zip(names, lab.values(t).T, strict=True))})
        for i, t in enumerate(lab.tests)
    ]
    pl.concat(parts).write_parquet(folder / "tests.parquet")


def npz(lab: Lab, folder: Path) -> None:
    """Arrays by name, one file per test, the current as a number beside them."""
    for number, test in enumerate(lab.tests, 1):
        values = lab.values(test)
        arrays = {
            f"{n}_{u}": values[:, k] for k, (n, u) in enumerate(zip(("t", "x", "F"), lab.unit_names, strict=False))
        }
        np.savez(folder / f"{number}.npz", current_A=test.current, **arrays)


def zipped_files(lab: Lab, folder: Path) -> None:
    """Each file packed."""
    for number, test in enumerate(lab.tests, 1):
        content = lab.encode([lab.header(), *map(lab.row, lab.values(test))])
        target = io.BytesIO()
        with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr(f"run{number}.csv", content)
        (folder / f"run{number}.zip").write_bytes(target.getvalue())


KINDS = {
    function.__name__: function
    for function in (
        current_column, file_names, header_lines, run_column, specimen_names, side_by_side, numbered_groups,
        concatenated, tests_table, repeated_headers, lvm, asc, sheets, struct_array, hdf5_groups, tdms_groups,
        parquet, npz, zipped_files,
    )
}  # fmt: skip


def faults(lab: Lab, dataset) -> list[str]:
    """Differences of a dataset from its tests; empty if all are present and correct."""
    wrong = [] if len(dataset) == len(lab.tests) else [f"{len(dataset)} runs of {len(lab.tests)} tests"]
    left = list(dataset)
    for test in lab.tests:
        fitting = [run for run in left if _is(run, test)]
        if not fitting:
            wrong.append(f"no run for {test.current} A {_motion(test)}")
        else:
            left.remove(fitting[0])
    return wrong


def _is(run, test: Truth) -> bool:
    size = run.time.size
    if not test.time.size - 20 <= size <= test.time.size or abs(run.mean_current - test.current) > 0.004:
        return False
    span = np.ptp(test.x), np.ptp(test.force)
    return bool(
        np.allclose(run.time - run.time[0], test.time[:size], atol=1e-4)
        and np.max(np.abs(run.displacement - test.x[:size])) < 2e-3 * span[0]
        and np.max(np.abs(run.force - test.force[:size])) < 1e-2 * span[1]
    )
