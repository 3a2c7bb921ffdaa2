"""Classic netCDF, as xarray and data loggers still write it, by SciPy; netCDF 4 is HDF5."""

from __future__ import annotations

import numpy as np

from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.arrays import check_unpacked, refusing_damage, text_of, unit_in, unpacked, value_of
from mrdamper.rig_files.readers.base import RawTable, Reader, Source
from mrdamper.rig_files.readers.nested import nested_tables


class NetCdf(Reader):
    """Variables as columns."""

    name = "netcdf"
    title = "classic netCDF"
    suffixes = (".nc", ".cdf")
    library = "scipy.io"
    marks = (b"CDF\x01", b"CDF\x02")

    def tables(self, source: Source, form: FileForm) -> list[RawTable]:
        """Return one table, or one a test where rows are tests: single numbers and attributes stand beside it."""
        with refusing_damage(source, self.title):
            from scipy.io import netcdf_file

            source.file.seek(0)
            file = netcdf_file(source.file, mmap=False)
            variables = {name: variable for name, variable in file.variables.items() if np.prod(variable.shape)}
            check_unpacked(source, 8 * sum(int(np.prod(variable.shape)) for variable in variables.values()))
            arrays = {name: np.array(v[...]) for name, v in variables.items()}
            says = {name: text_of(value) for name, value in file._attributes.items()}
        native = {name: array.astype(array.dtype.newbyteorder("=")) for name, array in arrays.items()}
        columns = {name: value_of(unpacked(variables[name]._attributes, array)) for name, array in native.items()}
        units = {name: unit_in(variable._attributes) for name, variable in variables.items()}
        return nested_tables(source, {**says, **columns, "units": units}, self.title)
