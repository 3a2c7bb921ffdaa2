"""Classic netCDF, as xarray and ship's loggers still write it, by SciPy; netCDF 4 is HDF5."""

from __future__ import annotations

import numpy as np

from mrdamper.rig_files.file_form import FileForm
from mrdamper.rig_files.readers.arrays import array_table, check_unpacked, refusing_damage, tests_across, unpacked
from mrdamper.rig_files.readers.base import RawTable, Reader, Source


class NetCdf(Reader):
    """Variables as columns."""

    name = "netcdf"
    title = "classic netCDF"
    suffixes = (".nc", ".cdf")
    library = "scipy.io"

    def recognises(self, source: Source) -> bool:
        """By the mark at the start."""
        return source.head(4) in (b"CDF\x01", b"CDF\x02")

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """Return the one table: single numbers and attributes stand beside it."""
        with refusing_damage(source, self.title):
            from scipy.io import netcdf_file

            source.file.seek(0)
            file = netcdf_file(source.file, mmap=False)
            arrays = {name: variable for name, variable in file.variables.items() if np.prod(variable.shape) > 1}
            check_unpacked(source, 8 * sum(int(np.prod(variable.shape)) for variable in arrays.values()))
            units = [_text(getattr(variable, "units", "")).partition(" since ")[0] for variable in arrays.values()]
            single = {
                f"{name} [{_text(getattr(variable, 'units', ''))}]": float(np.reshape(variable[...], -1)[0])
                for name, variable in file.variables.items()
                if variable.shape == () and np.asarray(variable.data).dtype.kind in "iuf"
            }
            remarks = [f"{name}: {_text(value)}"[:200] for name, value in file._attributes.items()]
        if not arrays:
            raise source.refuse("E_NO_DATA", "no array of numbers", "export the file again")
        variables = list(arrays.values())

        def column_of(column: int) -> np.ndarray:
            variable = variables[column]
            return unpacked(variable._attributes, np.array(variable[:]).astype(variable[:].dtype.newbyteorder("=")))

        across = tests_across({name: tuple(variable.shape) for name, variable in arrays.items()})
        if not across:
            return [
                array_table(source, list(arrays), units, column_of, title=self.title, constants=single, remarks=remarks)
            ]
        return self._tests(source, arrays, units, column_of, arrays[across[0]].shape, single, remarks)

    def _tests(self, source, arrays, units, column_of, shape, single, remarks) -> list[RawTable]:
        """Return a table for each row of the arrays of a shape, with its own of the numbers one a row."""
        variables = list(arrays.values())
        count, samples = shape
        kept = [i for i, variable in enumerate(variables) if samples in variable.shape]
        names = list(arrays)
        tables = []
        for test in range(count):
            stated = {f"{names[i]} [{units[i]}]": float(column_of(i)[test]) for i in range(len(names)) if i not in kept}

            def row_of(column: int, test: int = test) -> np.ndarray:
                array = column_of(kept[column])
                return array[test] if array.ndim == 2 else array

            tables.append(
                array_table(
                    source,
                    [names[i] for i in kept],
                    [units[i] for i in kept],
                    row_of,
                    title=self.title,
                    label=f"test_{test + 1}",
                    constants={**single, **stated},
                    remarks=remarks,
                )
            )
        return tables


def _text(value: object) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
