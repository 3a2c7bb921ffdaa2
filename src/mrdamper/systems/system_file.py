"""Systems from TOML files: bundled ones by name, others by path."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np
from pydantic import Field

from mrdamper.dampers.base import Damper
from mrdamper.dampers.model_file import load_model
from mrdamper.data import Floats
from mrdamper.data.atomic import path_of
from mrdamper.errors import StructureError, UnknownNameError
from mrdamper.rig_files.strict_toml import load_toml
from mrdamper.systems.cars import HalfCar, NotNegative, Positive, QuarterCar, SystemPart
from mrdamper.systems.structure import Link, System, building, shear_building


class _Building(SystemPart):
    mass_kg: list[float] | list[list[float]]
    damping_N_s_m: list[list[float]]
    stiffness_N_m: list[list[float]]
    floors: list[str] = Field([])

    def build(self, name: str, title: str, links: Sequence[Link]) -> System:
        M = np.array(self.mass_kg, dtype=float)
        floors = self.floors or [f"floor{i + 1}" for i in range(len(self.mass_kg))]
        matrices = (np.diag(M) if M.ndim == 1 else M, _array(self.damping_N_s_m), _array(self.stiffness_N_m))
        return building(name, floors, *matrices, links, title)


class _Storey(SystemPart):
    mass_kg: float
    stiffness_N_m: Positive
    damping_N_s_m: NotNegative = 0.0


class _DamperEntry(SystemPart):
    name: str
    above: str | None = None
    below: str = "ground"
    model: str | None = None


class SystemDocument(SystemPart):
    """A vehicle or building in a file."""

    title: str = ""
    source: str = ""
    building: _Building | None = None
    storey: list[_Storey] | None = None
    quarter_car: QuarterCar | None = None
    half_car: HalfCar | None = None
    damper: list[_DamperEntry] = Field([])


@dataclass(frozen=True, eq=False)
class SystemFile:
    """A system, and the saved dampers its file names."""

    system: System
    dampers: Mapping[str, Damper]  # by link; links without a damper in the file are missing


def bundled_systems() -> dict[str, Path]:
    """Systems that ship with the package, by name."""
    folder = Path(str(files("mrdamper.data.bundled") / "systems"))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def load_system(name: str | Path) -> SystemFile:
    """Read a system.

    Parameters
    ----------
    name : str or path
        Of one that ships with the package, or a TOML file.

    Raises
    ------
    UnknownNameError
        If there is no such file and no such system.
    StructureError, ModelFileError
        If the file, its structure or a damper it names cannot be used.

    Examples
    --------
    >>> from mrdamper import load_system
    >>> found = load_system("dyke1996")
    >>> sorted(found.dampers)
    ['mr']
    """
    systems = bundled_systems()
    given = path_of(name)
    path = systems.get(str(name), given)
    if not path.is_file():
        if path.suffix == ".toml":
            raise StructureError("no such file", where=str(path), remedy="give a system TOML file")
        raise UnknownNameError.of("system", str(name), systems)
    document = load_toml(path, SystemDocument, StructureError, "see docs/how-to/simulate.md", 2**20)
    system = _build(document, path)
    models = {d.name: d.model for d in document.damper if d.model is not None}
    return SystemFile(system, {link: load_model(path.parent / model) for link, model in models.items()})


def _build(document: SystemDocument, path: Path) -> System:
    shapes = [shape for shape in ("building", "storey", "quarter_car", "half_car") if getattr(document, shape)]
    if len(shapes) != 1:
        raise StructureError(
            f"{len(shapes)} structures: {', '.join(shapes) or 'none'}",
            where=str(path),
            remedy="give one of [building], [[storey]], [quarter_car], [half_car]",
        )
    car = document.quarter_car or document.half_car
    if car is not None:
        system = car.build(path.stem, document.title)
        own = {link.name for link in system.dampers}
        for damper in document.damper:
            if damper.name not in own or damper.above is not None:
                problem = f"damper {damper.name!r} in a car, which has {', '.join(sorted(own))} in their places"
                raise StructureError(problem, where=str(path), remedy="use those names, with a model only")
        return system
    links = []
    for damper in document.damper:
        if damper.above is None:
            raise StructureError(
                f"damper {damper.name!r} hangs nowhere", where=str(path), remedy="give above and below"
            )
        links.append(Link(damper.name, damper.above, damper.below))
    if len({link.name for link in links}) < len(links):
        raise StructureError("two dampers of one name", where=str(path), remedy="name each differently")
    if document.building is not None:
        return document.building.build(path.stem, document.title, links)
    storeys = document.storey or []
    masses, dampings = [s.mass_kg for s in storeys], [s.damping_N_s_m for s in storeys]
    return shear_building(path.stem, masses, [s.stiffness_N_m for s in storeys], dampings, links, document.title)


def _array(rows: list[list[float]]) -> Floats:
    try:
        return np.array(rows, dtype=float)
    except ValueError as error:
        raise StructureError("rows of a matrix differ in length", remedy="give it square") from error
