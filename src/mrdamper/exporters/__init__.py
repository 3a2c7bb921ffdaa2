"""Export formats, one file each: a new file here, or a package with the entry point `mrdamper.exporters`."""

from __future__ import annotations

from pathlib import Path

from mrdamper.dampers.base import Damper
from mrdamper.discovery import Registry
from mrdamper.errors import UnknownNameError, validate_arguments
from mrdamper.exporters.base import Exporter, Written, identifier, write_export

__all__ = ["Exporter", "Written", "all_exporters", "export", "exporter"]


_registry: Registry[Exporter] = Registry("mrdamper.exporters", Exporter, "export format")  # type: ignore[type-abstract]
all_exporters = _registry.all


def exporter(name: str) -> type[Exporter]:
    """Return the export format of a name; raises `UnknownNameError` with all formats."""
    if (formats := all_exporters()).get(name) is None:
        remedy = f"known: {', '.join(formats)}; Simulink takes fmu or c"
        raise UnknownNameError(f"no export format is called {name!r}", remedy=remedy)
    return formats[name]


@validate_arguments()
def export(damper: Damper, to: str, out: str | Path, name: str = "") -> list[Path]:
    """Write a damper in an export format, atomically.

    Parameters
    ----------
    damper : Damper
    to : str
        Format: "c", "fmu", "page", "latex", "markdown", "table", "adams",
        "tydex", "dyna4", or one of a plug-in.
    out : path
        Folder, or file for formats of one file.
    name : str
        Prefix of the names of files and symbols; the rig's name if empty.

    Returns
    -------
    list of Path
        Written files.

    Raises
    ------
    UnknownNameError
        If there is no such format.
    InputError
        E_EXPORT_NAME, if the name makes no identifier in C; E_OUTPUT, if `out` cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> from mrdamper import export, identify, load_dataset
    >>> from mrdamper.dampers.modified import fit_modified
    >>> runs = load_dataset().rig("utfsm").split("train")[:8]
    >>> damper = fit_modified([identify(run, "bingham") for run in runs]).damper
    >>> [path.name for path in export(damper, "adams", Path(mkdtemp()) / "adams")]
    ['utfsm_0A.dmp', 'utfsm_0.2A.dmp', 'utfsm_0.4A.dmp', 'utfsm_0.6A.dmp', 'utfsm_0.8A.dmp', 'utfsm_1A.dmp']
    """
    kind = exporter(to)
    written = kind().export(damper, identifier(name or damper.rig or "damper"))
    return write_export(written, out, kind.suffix)
