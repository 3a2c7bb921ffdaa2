"""Classic netCDF, as xarray and data loggers still write it, by SciPy; netCDF 4 is HDF5."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrdamper.rig_files.profile import FileForm
from mrdamper.rig_files.readers.arrays import check_unpacked, refusing_damage, text_of, unpacked
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
            arrays = {name: variable for name, variable in file.variables.items() if np.prod(variable.shape) > 1}
            check_unpacked(source, 8 * sum(int(np.prod(variable.shape)) for variable in arrays.values()))
            single = {
                f"{name} [{_unit_of(variable)}]": float(np.reshape(variable[...], -1)[0])
                for name, variable in file.variables.items()
                if variable.shape == () and np.asarray(variable.data).dtype.kind in "iuf"
            }
            says = {name: text_of(value) for name, value in file._attributes.items()}
            columns = {
                name: unpacked(v._attributes, np.array(v[:]).astype(v[:].dtype.newbyteorder("=")))
                for name, v in arrays.items()
            }
        units = {name: _unit_of(variable) for name, variable in arrays.items()}
        return nested_tables(source, {**says, **columns, **single, "units": units}, self.title)


def _unit_of(variable: Any) -> str:
    """Return the unit of a variable: that of a time is followed by the date it counts from."""
    return text_of(getattr(variable, "units", "")).partition(" since ")[0]
