"""Finding what was dropped into a package, and modules under the names they had in version 0.1."""

from __future__ import annotations

import importlib
import pkgutil
import warnings
from collections.abc import Iterable, Mapping
from importlib.machinery import ModuleSpec
from types import MappingProxyType, ModuleType
from typing import TypeVar

from mrdamper.errors import UnknownNameError

N = TypeVar("N", bound=type)

# Modules above the core that hold classes of a kind: imported when these are looked up.
EXTENSIONS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "methods": ("mrdamper.paper.paper_method", "mrdamper.paper.direct_genetic"),
        "study methods": ("mrdamper.paper.options",),
    }
)


def subclasses_in(package: str, path: Iterable[str], base: N, kind: str = "") -> Mapping[str, N]:
    """Import every module of a package and the extensions of a kind; the direct subclasses of `base` by `name`."""
    for module in pkgutil.iter_modules(path):
        importlib.import_module(f"{package}.{module.name}")
    return known_subclasses(base, kind)


def known_subclasses(base: N, kind: str = "") -> Mapping[str, N]:
    """Direct subclasses of `base`, those of the extensions of a kind included, by their `name`, sorted."""
    for module in EXTENSIONS.get(kind, ()):
        importlib.import_module(module)
    found = sorted(base.__subclasses__(), key=lambda cls: cls.name)
    return MappingProxyType({cls.name: cls for cls in found})


def named(kind: str, name: str, known: Mapping[str, N]) -> N:
    """The one of that name.

    Raises
    ------
    UnknownNameError
        With the near matches.
    """
    if not isinstance(name, str) or name not in known:
        raise UnknownNameError.of(kind, str(name)[:100], known)
    return known[name]


MOVED = MappingProxyType(
    {
        "comparison": "study.comparison",
        "condensed": "dampers.gram",
        "conditioned": "dampers.published",
        "damper": "dampers.base",
        "datasets": "files.bundled",
        "excitation": "motion",
        "formulas": "export.equations",
        "function_fitting": "functions.fitting",
        "harmonic_balance": "identification.harmonic_balance",
        "harmonics": "motion.harmonics",
        "io": "rig_files",
        "io.atomic": "files.atomic",
        "io.dataset": "files.dataset",
        "io.model_file": "files.model_file",
        "io.motion": "files.motion",
        "joint": "dampers.joint",
        "loop_analysis": "identification.loop_analysis",
        "modified": "dampers.modified",
        "parameter_functions": "functions.forms",
        "plots": "report.plots",
        "publication": "report.study",
        "recursion": "motion.lag",
        "sensitivity": "paper.sensitivity",
        "threads": "optimizers.linear",
        "uncertainty": "identification.covariance",
        "virtual_rig": "paper.virtual_rig",
        "workflow": "study.workflow",
    }
)


class MovedNames:
    """Modules under their names of version 0.1: found in the import system's list of finders, said once each."""

    def __init__(self, package: str):
        self.package = package
        self.spec: ModuleSpec | None = None

    def new_name(self, name: str) -> str | None:
        """Where a module of 0.1 stands now; None if it did not move."""
        parts = name.split(".")
        for count in range(min(len(parts), 3), 1, -1):
            if (home := MOVED.get(".".join(parts[1:count]))) and parts[0] == self.package:
                return ".".join([self.package, home, *parts[count:]])
        return None

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        new = self.new_name(name)
        return ModuleSpec(name, self, origin=new) if new else None  # type: ignore[arg-type]

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        warnings.warn(f"{spec.name} is now {spec.origin}", FutureWarning, stacklevel=2)
        module = importlib.import_module(str(spec.origin))
        self.spec = module.__spec__  # the import system puts the old name's there
        return module

    def exec_module(self, module: ModuleType) -> None:
        module.__spec__ = self.spec
