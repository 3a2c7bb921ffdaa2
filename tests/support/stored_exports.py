"""Exports in binary formats: sheets, archives, structs, tables of records, netCDF; tables of tests beside them.

As in `lab_exports`, no code is shared with the readers.
"""

from __future__ import annotations

import io
import tarfile
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from support.lab_exports import Truth
from support.machine_exports import TEXTS

_CHANNELS = (("Displacement", "mm", 1e3, 1), ("Force", "N", 1.0, 2), ("Current", "A", 1.0, 3))


def fortran(tests: tuple[Truth, ...], folder: Path) -> None:
    """Exponents with a D."""
    for n, test in enumerate(tests, 1):
        rows = ["".join(f"{v:14.6E}".replace("E", "D") for v in row) for row in test.table * [1, 1e3, 1, 1]]
        lines = ["  TIME (S)      DISP (MM)     FORCE (N)     CURRENT (A)", *rows, ""]
        (folder / f"r{n}.dat").write_text("\n".join(lines), encoding="ascii")


def pages(tests: tuple[Truth, ...], folder: Path) -> None:
    """One heading per page."""
    for n, test in enumerate(tests, 1):
        lines = [f"TEST REPORT  coil current {test.current:.2f} A"]
        rows = [f"{a:12.5f}{1e3 * b:12.5f}{c:12.3f}" for a, b, c, _ in test.table]
        for at in range(0, len(rows), 50):
            lines += [f"Page {at // 50 + 1}", "    Time [s]   Disp [mm]   Force [N]", *rows[at : at + 50], ""]
        (folder / f"r{n}.txt").write_text("\n".join(lines), encoding="utf-8")


def _book(rows: list[list], path: Path) -> None:
    from openpyxl import Workbook

    book = Workbook()
    for row in rows:
        book.active.append(row)
    book.save(path)


def _cells(test: Truth, columns: int = 3) -> list[list[float]]:
    return [[round(float(v), 6) for v in row] for row in (test.table * [1, 1e3, 1, 1])[:, :columns]]


def hand_made_sheets(tests: tuple[Truth, ...], folder: Path) -> None:
    """A table that begins in the second column, a title, a condition, notes to the right."""
    for n, test in enumerate(tests, 1):
        rows = [[None, *row] for row in _cells(test)]
        rows[0] += [None, None, "note: pump was off"]
        rows[1] += [None, None, "looks good"]
        head = [[None, "MR damper, my test"], [None, "Coil current", test.current, "A"], []]
        _book([*head, [None, "Time (s)", "Disp. (mm)", "Force (N)"], *rows], folder / f"test{n}.xlsx")


def sheets_with_statistics(tests: tuple[Truth, ...], folder: Path) -> None:
    """Rows of statistics below."""
    for n, test in enumerate(tests, 1):
        foot = [[], ["Max", 20.0, 1000.0, 0.1], ["Mittelwert", 0.0, 1.0, 0.1]]
        head = ["Zeit [s]", "Weg [mm]", "Kraft [N]", "Strom [A]"]
        _book([head, *_cells(test, 4), *foot], folder / f"test{n}.xlsx")


def tests_below_each_other(tests: tuple[Truth, ...], folder: Path) -> None:
    """All tests in one sheet, a title and names of columns above each."""
    rows: list[list] = []
    for n, test in enumerate(tests, 1):
        rows += [[f"Test {n}: {test.current:.1f} A"], ["Time [s]", "Disp [mm]", "Force [N]"], *_cells(test), []]
    _book(rows, folder / "all.xlsx")


def matlab_matrix(tests: tuple[Truth, ...], folder: Path) -> None:
    """A matrix, its names and its units in cells, samples in rows and in columns."""
    from scipy.io import savemat

    for n, test in enumerate(tests, 1):
        data = test.table * [1, 1e3, 1, 1]
        words = {
            "names": np.array(["Time", "Displacement", "Force", "Current"], dtype=object),
            "units": np.array(["s", "mm", "N", "A"], dtype=object),
        }
        savemat(folder / f"r{n}.mat", {"data": data if n % 2 else data.T, **words})


def matlab73_structs(tests: tuple[Truth, ...], folder: Path) -> None:
    """An array of structs as MATLAB 7.3 stores it: references into a group of their own."""
    import h5py

    path = folder / "tests.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        store, group = file.create_group("#refs#"), file.create_group("tests")
        fields: dict[str, list] = {"time_s": [], "disp_mm": [], "force_N": [], "current_A": []}
        for i, test in enumerate(tests):
            for name, values in zip(fields, (test.time, 1e3 * test.x, test.force, [test.current]), strict=True):
                item = store.create_dataset(f"{name}{i}", data=np.reshape(values, (1, -1)))
                item.attrs["MATLAB_class"] = np.bytes_("double")
                fields[name].append(item.ref)
        for name, references in fields.items():
            kind = h5py.ref_dtype
            group.create_dataset(name, data=np.array(references, dtype=kind).reshape(1, -1), dtype=kind)
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    path.write_bytes(head.ljust(512, b"\0") + path.read_bytes()[512:])


def npz_matrix(tests: tuple[Truth, ...], folder: Path) -> None:
    """A matrix and the names of its columns."""
    for n, test in enumerate(tests, 1):
        np.savez(folder / f"r{n}.npz", data=test.table, columns=np.array(["time_s", "x_m", "force_N", "current_A"]))


def hdf5_matrix(tests: tuple[Truth, ...], folder: Path) -> None:
    """A matrix with attributes."""
    import h5py

    for n, test in enumerate(tests, 1):
        with h5py.File(folder / f"r{n}.h5", "w") as file:
            item = file.create_dataset("data", data=test.table * [1, 1e3, 1, 1])
            item.attrs["columns"] = ["Time", "Displacement", "Force", "Current"]
            item.attrs["units"] = ["s", "mm", "N", "A"]


def parquet_stamps(tests: tuple[Truth, ...], folder: Path) -> None:
    """Stamps of a date, single precision."""
    import polars as pl

    for n, test in enumerate(tests, 1):
        stamps = (np.round(1e9 * test.time).astype("int64") + 1_709_287_872 * 10**9).astype("datetime64[ns]")
        rest = {"position_mm": 1e3 * test.x, "force_N": test.force, "current_A": test.amperes}
        rest = {name: values.astype(np.float32) for name, values in rest.items()}
        pl.DataFrame({"timestamp": stamps, **rest}).write_parquet(folder / f"r{n}.parquet")


def _packed(tests: tuple[Truth, ...], *, current: bool):
    for n, test in enumerate(tests, 1):
        rows = [f"{a:.5f},{1e3 * b:.5f},{c:.3f}" + f",{i:.4f}" * current for a, b, c, i in test.table]
        name = f"campaign/r{n}.csv" if current else f"campaign/{test.current:.1f}A/r{n}.csv"
        yield name, "\n".join(["time_s,disp_mm,force_N" + ",current_A" * current, *rows, ""]).encode()


def tar_of_a_folder(tests: tuple[Truth, ...], folder: Path) -> None:
    """tgz."""
    with tarfile.open(folder / "campaign.tgz", "w:gz") as archive:
        for name, content in _packed(tests, current=True):
            member = tarfile.TarInfo(name)
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))


def zip_of_a_folder(tests: tuple[Truth, ...], folder: Path) -> None:
    """The current in the names of folders within, and what a Mac adds."""
    with zipfile.ZipFile(folder / "campaign.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("__MACOSX/campaign/._r1.csv", b"\0\1\2")
        for name, content in _packed(tests, current=False):
            archive.writestr(name, content)


def structs_of_channels(tests: tuple[Truth, ...], folder: Path) -> None:
    """Real-time systems: an axis X and an array Y of structs with name, unit and data."""
    from scipy.io import savemat

    kind = [("Name", object), ("Data", object), ("Unit", object)]
    for n, test in enumerate(tests, 1):
        axis, channels = np.empty((1, 1), dtype=kind), np.empty((1, 3), dtype=kind)
        axis[0, 0] = ("Time", test.time[None, :], "s")
        for i, (name, unit, factor, column) in enumerate(_CHANNELS):
            channels[0, i] = (f"Model/{name}", factor * test.table[None, :, column], unit)
        savemat(folder / f"r{n}.mat", {f"rec{n}": {"X": axis, "Y": channels, "Description": "sine"}})


def matlab73_matrix(tests: tuple[Truth, ...], folder: Path) -> None:
    """A matrix with cells of names and units, as MATLAB 7.3 stores them: references to characters."""
    import h5py

    lists = {"names": ("Time", "Displacement", "Force", "Current"), "units": ("s", "mm", "N", "A")}
    for n, test in enumerate(tests, 1):
        path = folder / f"r{n}.mat"
        with h5py.File(path, "w", userblock_size=512) as file:
            store = file.create_group("#refs#")
            file.create_dataset("data", data=(test.table * [1, 1e3, 1, 1]).T).attrs["MATLAB_class"] = np.bytes_(
                "double"
            )
            for key, words in lists.items():
                cells = [store.create_dataset(f"{key}{i}", data=[[ord(c)] for c in w]) for i, w in enumerate(words)]
                for cell in cells:
                    cell.attrs["MATLAB_class"] = np.bytes_("char")
                item = file.create_dataset(key, data=np.array([[c.ref for c in cells]], dtype=h5py.ref_dtype))
                item.attrs["MATLAB_class"] = np.bytes_("cell")
        head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
        path.write_bytes(head.ljust(512, b"\0") + path.read_bytes()[512:])


def pandas_table(tests: tuple[Truth, ...], folder: Path) -> None:
    """A data frame in HDF5: names of columns beside a block of values."""
    import h5py

    names = np.array([b"time_s", b"disp_mm", b"force_N", b"current_A"])
    for n, test in enumerate(tests, 1):
        with h5py.File(folder / f"r{n}.h5", "w") as file:
            group = file.create_group("df")
            group.create_dataset("axis0", data=names)
            group.create_dataset("axis1", data=np.arange(test.time.size))
            group.create_dataset("block0_items", data=names)
            group.create_dataset("block0_values", data=test.table * [1, 1e3, 1, 1])


def records(tests: tuple[Truth, ...], folder: Path) -> None:
    """A table of records in HDF5, its units and the current as attributes of its own."""
    import h5py

    for n, test in enumerate(tests, 1):
        table = np.zeros(test.time.size, dtype=[("time", "f8"), ("disp", "f8"), ("force", "f4")])
        table["time"], table["disp"], table["force"] = test.time, 1e3 * test.x, test.force
        with h5py.File(folder / f"r{n}.h5", "w") as file:
            item = file.create_dataset("records", data=table)
            item.attrs["units"] = ["s", "mm", "N"]
            item.attrs["coil current"] = f"{test.current} A"


def netcdf4(tests: tuple[Truth, ...], folder: Path) -> None:
    """The time counted from a date, as the conventions of netCDF want it."""
    import h5py

    for n, test in enumerate(tests, 1):
        with h5py.File(folder / f"r{n}.nc", "w") as file:
            file.create_dataset("time", data=test.time).attrs["units"] = "seconds since 2024-03-01 10:00:00"
            for name, unit, factor, column in _CHANNELS:
                file.create_dataset(name, data=factor * test.table[:, column]).attrs["units"] = unit


def classic_netcdf(tests: tuple[Truth, ...], folder: Path) -> None:
    """The format before HDF5, numbers packed into two bytes."""
    from scipy.io import netcdf_file

    for n, test in enumerate(tests, 1):
        with netcdf_file(str(folder / f"r{n}.nc"), "w") as file:
            file.createDimension("time", test.time.size)
            file.createVariable("time", "d", ("time",))[:] = test.time
            file.variables["time"].units = "s"
            for name, unit, factor, column in _CHANNELS:
                values = factor * test.table[:, column]
                item = file.createVariable(name, "h", ("time",))
                scale = float(np.max(np.abs(values))) / 32_000
                item[:] = np.round(values / scale).astype("int16")
                item.units, item.scale_factor, item.add_offset = unit, scale, 0.0


def feather(tests: tuple[Truth, ...], folder: Path) -> None:
    """Arrow's own file."""
    import polars as pl

    for n, test in enumerate(tests, 1):
        table = test.table * [1, 1e3, 1, 1]
        frame = dict(zip(("time_s", "disp_mm", "force_N", "current_A"), table.T, strict=True))
        pl.DataFrame(frame).write_ipc(folder / f"r{n}.feather")


def open_document(tests: tuple[Truth, ...], folder: Path) -> None:
    """A sheet of LibreOffice."""
    spaces = "".join(
        f' xmlns:{name}="urn:oasis:names:tc:opendocument:xmlns:{name}:1.0"' for name in ("office", "table", "text")
    )
    for n, test in enumerate(tests, 1):
        rows = [["Time [s]", "Disp [mm]", "Force [N]", "Current [A]"], *(test.table * [1, 1e3, 1, 1]).round(6).tolist()]
        body = "".join(f"<table:table-row>{''.join(map(_open_cell, row))}</table:table-row>" for row in rows)
        with zipfile.ZipFile(folder / f"r{n}.ods", "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
            archive.writestr(
                "content.xml",
                f'<?xml version="1.0"?><office:document-content{spaces}><office:body><office:spreadsheet>'
                f'<table:table table:name="Sheet1">{body}</table:table>'
                "</office:spreadsheet></office:body></office:document-content>",
            )
            archive.writestr("META-INF/manifest.xml", "<manifest/>")


def _open_cell(value: float | str) -> str:
    kind = (
        'office:value-type="string"' if isinstance(value, str) else f'office:value-type="float" office:value="{value}"'
    )
    return f"<table:table-cell {kind}><text:p>{value}</text:p></table:table-cell>"


def conditions_on_a_sheet_of_their_own(tests: tuple[Truth, ...], folder: Path) -> None:
    """One sheet states the conditions of the other."""
    from openpyxl import Workbook

    for n, test in enumerate(tests, 1):
        book = Workbook()
        book.active.title = "Info"
        for row in (["Operator", "KH"], ["Coil current", test.current, "A"], ["Frequency", test.frequency, "Hz"]):
            book.active.append(row)
        data = book.create_sheet("Data")
        for row in [["Time [s]", "Disp [mm]", "Force [N]"], *(test.table[:, :3] * [1, 1e3, 1]).tolist()]:
            data.append(row)
        book.save(folder / f"r{n}.xlsx")


def columns_of_conditions(tests: tuple[Truth, ...], folder: Path) -> None:
    """All tests in one table, the time starting again, what was set in columns of their own."""
    rows = ["f_Hz,A_mm,I_set_A,time_s,disp_mm,force_N"]
    for test in tests:
        said = f"{test.frequency:g},{1e3 * test.amplitude:g},{test.current:g}"
        rows += [f"{said},{t:.5f},{1e3 * x:.5f},{f:.3f}" for t, x, f, _ in test.table]
    (folder / "all.csv").write_text("\n".join([*rows, ""]), encoding="utf-8")


def _table_of_tests(tests: tuple[Truth, ...], folder: Path, head: str, row: str, encoding: str) -> None:
    for n, test in enumerate(tests, 1):
        rows = [f"{t:.5f},{1e3 * x:.5f},{f:.3f}" for t, x, f, _ in test.table]
        (folder / f"Test{n}.csv").write_text("\n".join(["time_s,disp_mm,force_N", *rows, ""]), encoding="utf-8")
    said = [row.format(n=n, i=f"{t.current:.1f}", mA=f"{1e3 * t.current:.0f}") for n, t in enumerate(tests, 1)]
    text = "\r\n".join([head, *(line.replace(".", ",") if ";" in line else line for line in said), ""])
    (folder / "tests.csv").write_bytes(text.replace(",csv", ".csv").encode(encoding))


def table_of_tests_from_excel(tests: tuple[Truth, ...], folder: Path) -> None:
    """As Excel saves it in Germany: semicolons, decimal commas, an encoding of its own, milliamperes."""
    _table_of_tests(tests, folder, "Dateiname;Strom (mA);Bemerkung", "Test{n}.csv;{mA};für später", "cp1252")


def table_of_tests_with_other_columns(tests: tuple[Truth, ...], folder: Path) -> None:
    """Numbers, frequencies and amplitudes beside; names without suffix, in small letters."""
    head = "No;File name;I [A];f [Hz];A [mm];T (°C)"
    _table_of_tests(tests, folder, head, "{n};test{n};{i};1.0;20;23.5", "utf-16")


def table_of_tests_with_units_in_cells(tests: tuple[Truth, ...], folder: Path) -> None:
    """Tabs, paths, amperes behind the numbers."""
    _table_of_tests(tests, folder, "File\tCoil current\tComment", '.\\Test{n}.csv\t{i} A\t"ok"', "utf-8")


MACHINES: dict[str, Callable[[tuple[Truth, ...], Path], None]] = {
    **TEXTS,
    **{
        function.__name__: function
        for function in (
            fortran, pages, hand_made_sheets, sheets_with_statistics, tests_below_each_other, matlab_matrix,
            matlab73_structs, npz_matrix, hdf5_matrix, parquet_stamps, tar_of_a_folder, zip_of_a_folder,
            structs_of_channels, matlab73_matrix, pandas_table, records, netcdf4, classic_netcdf, feather,
            open_document, conditions_on_a_sheet_of_their_own, columns_of_conditions, table_of_tests_from_excel,
            table_of_tests_with_other_columns, table_of_tests_with_units_in_cells,
        )
    },
}  # fmt: skip
