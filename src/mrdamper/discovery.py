"""Extension points: the models, methods, readers and other parts that installed packages provide.

A package registers one entry point a group. The entry point names a module, a package or a class;
of a package every module is imported, so that a new part is one new file. mrdamper registers its
own parts in the same way (pyproject.toml).
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import threading
import traceback
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import Distribution, EntryPoint, entry_points, version
from types import MappingProxyType, ModuleType
from typing import Any, Generic, TypeVar

from mrdamper.errors import InputError, UnknownNameError, is_a, shown

T = TypeVar("T")
OWN = "mrdamper"  # the distribution whose broken parts are errors, not skipped
GROUPS = (
    "mrdamper.models",
    "mrdamper.methods",
    "mrdamper.studies",
    "mrdamper.dampers",
    "mrdamper.readers",
    "mrdamper.checks",
    "mrdamper.exporters",
    "mrdamper.controllers",
    "mrdamper.inputs",
    "mrdamper.commands",
)
HOOKS = {"mrdamper.commands": "app", "mrdamper.checks": "check"}  # groups of modules: the name each defines


class PluginWarning(UserWarning):
    """A part of an installed package that could not be used and was skipped."""


@dataclass(frozen=True)
class ExtensionPart:
    """Something an installed package provides."""

    group: str  # one of `GROUPS`
    name: str  # of the part; of the entry point where it could not be loaded
    package: str  # distribution that provides it, with its version
    target: str  # module, or module and class
    problem: str = ""  # why it was skipped; empty if it is used
    own: bool = False  # it belongs to mrdamper, or to a script that registered it


@cache
def _named(distribution: Distribution | None) -> tuple[str, str]:
    """Name and version of a distribution: reading either parses all of its description."""
    return (distribution.name, distribution.version) if distribution else ("", "")


def package_of(distribution: Distribution | None) -> str:
    """Name and version of a distribution."""
    return " ".join(_named(distribution)) if distribution else "unknown package"


@cache
def provided_modules(group: str) -> tuple[tuple[EntryPoint, tuple[ModuleType, ...] | type], ...]:
    """Load the entry points of a group, its own first, then by package and name: modules of a package, or a class.

    Another package that cannot be loaded is skipped with a `PluginWarning`.
    """
    loaded: list[tuple[EntryPoint, tuple[ModuleType, ...] | type]] = []
    for point in sorted(_entry_points().select(group=group), key=_order):
        try:
            _require_this_version(point.dist)
            loaded.append((point, _load(point)))
        except Exception as error:  # whatever a package raises when it is imported
            if _is_own(point):
                raise
            skip(ExtensionPart(group, point.name, package_of(point.dist), point.value), error)
    return tuple(loaded)


@cache
def _entry_points():
    """Read the entry points of all packages, once for all groups: a file of every installed package is opened."""
    return entry_points()


def _order(point: EntryPoint) -> tuple[bool, str, str]:
    return not _is_own(point), _named(point.dist)[0], point.name


def _is_own(point: EntryPoint) -> bool:
    return _named(point.dist)[0] == OWN


def _require_this_version(distribution: Distribution | None) -> None:
    """Refuse a package that is made for another version of mrdamper."""
    if distribution is None or _named(distribution)[0] == OWN:
        return
    from packaging.requirements import Requirement

    for wanted in map(Requirement, distribution.requires or ()):
        if wanted.name == OWN and not wanted.specifier.contains(version(OWN), prereleases=True):
            raise ImportError(f"it needs mrdamper {wanted.specifier}, this is {version(OWN)}")


def _load(point: EntryPoint) -> tuple[ModuleType, ...] | type:
    target = point.load()
    if isinstance(target, type):
        return target
    if not isinstance(target, ModuleType):
        raise TypeError(f"{point.value} is neither a module nor a class")
    names = (module.name for module in pkgutil.iter_modules(getattr(target, "__path__", ())))
    return (target, *(importlib.import_module(f"{target.__name__}.{name}") for name in sorted(names)))


_skipped: list[ExtensionPart] = []


def fault_of_package(error: BaseException) -> str:
    """State which installed package raised an error while it was used; empty if none did."""
    places = traceback.extract_tb(error.__traceback__)
    modules = [frame.f_globals.get("__name__", "") for frame, _ in traceback.walk_tb(error.__traceback__)]
    points = [p for group in GROUPS for p in _entry_points().select(group=group) if not _is_own(p)]
    for place, module in reversed(list(zip(places, modules, strict=True))):
        for point in points:
            if module.partition(".")[0] == point.module.partition(".")[0]:
                return (
                    f"{package_of(point.dist)} ({point.group}) raised {type(error).__name__}: {error}, in {place.name} "
                    f"of {module}, line {place.lineno}; correct or uninstall that package [E_PLUGIN]"
                )
    return ""


def skip(part: ExtensionPart, problem: Exception | str) -> None:
    """Note that a part of an outside package is not used, and warn once."""
    if isinstance(problem, Exception):
        problem = f"{type(problem).__name__}: {problem}"
    if (noted := replace(part, problem=problem)) in _skipped:
        return
    _skipped.append(noted)
    warnings.warn(f"{part.name} of {part.package} ({part.group}) is skipped: {problem}", PluginWarning, stacklevel=2)


class Registry(Generic[T]):
    """The classes of one extension point by their `name`.

    `group`: entry-point group; `base`: every class of the group is a subclass of it that is not abstract and has a
    `name` of its own; `kind`: what one of them is called in messages.
    """

    def __init__(self, group: str, base: type[T], kind: str):
        self.group, self.base, self.kind = group, base, kind
        self._parts: dict[str, ExtensionPart] | None = None
        self._lock = threading.RLock()
        self._types: dict[str, type[T]] = {}
        _registries[group] = self

    def all(self) -> Mapping[str, type[T]]:
        """Every class by its name, sorted."""
        with self._lock:  # another thread waits until all classes are there
            if self._parts is None:
                self._parts = {}
                for point, target in provided_modules(self.group):
                    for cls in self._classes(target, is_own=_is_own(point)):
                        self._add(cls, package_of(point.dist), is_own=_is_own(point))
        return MappingProxyType(dict(sorted(self._types.items())))

    def parts(self) -> tuple[ExtensionPart, ...]:
        """Every class of the group and the package it comes from, sorted by name."""
        return tuple(part for name in self.all() if (part := (self._parts or {}).get(name)))

    def type_named(self, name: str) -> type[T]:
        """Return the class of that name; raises `UnknownNameError` with the near matches."""
        types = self.all()
        if not is_a(name, str) or name not in types:
            raise UnknownNameError.of(self.kind, str(name)[:100], types)
        return types[name]

    def register(self, cls: type[T]) -> None:
        """Add a class of a script or notebook for this process; one of the same name and module is replaced."""
        earlier = self.all().get(cls.name)  # type: ignore[attr-defined]
        if earlier is not None and (earlier.__module__, earlier.__qualname__) != (cls.__module__, cls.__qualname__):
            raise InputError(
                f"the {self.kind} {cls.name!r} exists already ({earlier.__module__}.{earlier.__qualname__})",  # type: ignore[attr-defined]
                remedy="give the class another name",
                code="E_ARGUMENT",
            )
        self._types.pop(cls.name, None)  # type: ignore[attr-defined]
        self._add(cls, cls.__module__, is_own=True)

    def lacking(self, cls: type) -> list[str]:
        """Name the class variables and methods that a class of the group needs and this one has not."""
        stated = {name: kind for base in reversed(cls.__mro__) for name, kind in inspect.get_annotations(base).items()}
        fields = [name for name, kind in stated.items() if str(kind).startswith("ClassVar") and not hasattr(cls, name)]
        return [*fields, *sorted(getattr(cls, "__abstractmethods__", ()))]

    @property
    def of_main_script(self) -> bool:
        """True if a class stands in the main script or a notebook, which other processes do not import."""
        return any(cls.__module__ == "__main__" for cls in self._types.values())

    def _classes(self, target: tuple[ModuleType, ...] | type, *, is_own: bool) -> Iterator[type[T]]:
        if isinstance(target, type):
            yield target
            return
        modules = {module.__name__ for module in target}
        for cls in _subclasses(self.base):
            # Of an outside package, a class without a name of which there is no further one is incomplete.
            incomplete = not is_own and not cls.__subclasses__() and not cls.__name__.startswith("_")
            if cls.__module__ in modules and ("name" in vars(cls) or incomplete):
                yield cls

    def _add(self, cls: Any, package: str, *, is_own: bool) -> None:
        parts = self._parts if self._parts is not None else {}
        name, target = getattr(cls, "name", cls.__name__), f"{cls.__module__}.{cls.__qualname__}"
        problem = ""
        if not issubclass(cls, self.base):
            problem = f"{target} is not a subclass of {self.base.__module__}.{self.base.__qualname__}"
        elif lacking := self.lacking(cls):
            problem = f"{target} lacks {', '.join(lacking)}"
        elif not isinstance(name, str):
            problem = f"the name of {target} is {shown(name)}, no text"
        elif name in self._types:
            problem = f"the {self.kind} {name!r} exists already in {parts[name].package}"
        part = ExtensionPart(self.group, str(name), package, target, own=is_own)
        if not problem:
            self._types[name], parts[name] = cls, part
        elif is_own:
            raise TypeError(problem)
        else:
            skip(part, problem)


_registries: dict[str, Registry[Any]] = {}


def _subclasses(base: type) -> Iterator[type]:
    """Yield the subclasses at any depth."""
    for cls in base.__subclasses__():
        yield cls
        yield from _subclasses(cls)


def register(cls: type[T]) -> type[T]:
    """Make a model, method, damper, reader, exporter, controller or input of a script known by its name.

    May be used as a decorator. A package registers its parts by an entry point instead.

    Parameters
    ----------
    cls : type
        Subclass of the base class of an extension point, with a `name`.

    Returns
    -------
    type
        The same class.

    Raises
    ------
    InputError
        E_ARGUMENT, if it belongs to no extension point, lacks a name, or another class has its name.

    Examples
    --------
    >>> from dataclasses import dataclass, replace
    >>> from typing import ClassVar
    >>> from mrdamper import register
    >>> from mrdamper.models import Model, model_type
    >>> from mrdamper.models.bingham import Bingham
    >>> @register
    ... @dataclass(frozen=True)
    ... class Renamed(Bingham):
    ...     name: ClassVar[str] = "renamed"
    ...     title: ClassVar[str] = "renamed Bingham"
    >>> model_type("renamed").__name__
    'Renamed'
    """
    registry = next((r for r in _registries.values() if is_a(cls, type) and issubclass(cls, r.base)), None)
    if registry is None or not isinstance(getattr(cls, "name", None), str) or inspect.isabstract(cls):
        raise InputError(
            f"{shown(cls)} cannot be registered",
            remedy="give a complete subclass of Model, Method, Exporter, Controller, Input or Reader with a name",
            code="E_ARGUMENT",
        )
    if lacking := registry.lacking(cls):
        problem = f"{cls.__name__} lacks {', '.join(lacking)}"
        raise InputError(problem, remedy="define it in the class", code="E_ARGUMENT")
    registry.register(cls)
    return cls


def in_main_script() -> bool:
    """Tell if the main script or a notebook has registered a class: other processes do not import it."""
    return any(registry.of_main_script for registry in _registries.values())


def modules_with(group: str, hook: str) -> tuple[tuple[ExtensionPart, ModuleType], ...]:
    """List the modules of a group that define something of that name, as commands and checks do.

    An outside package of which no module does is skipped with a `PluginWarning`.
    """
    modules: list[tuple[ExtensionPart, ModuleType]] = []
    for point, target in provided_modules(group):
        package, is_own = package_of(point.dist), _is_own(point)
        hooked = [m for m in target if hasattr(m, hook)] if isinstance(target, tuple) else []
        for module in hooked:
            name = module.__name__.rpartition(".")[2]
            modules.append((ExtensionPart(group, name, package, module.__name__, own=is_own), module))
        if not hooked and not is_own:
            skip(ExtensionPart(group, point.name, package, point.value), f"{point.value} defines no {hook}")
    return tuple(modules)


def all_parts() -> tuple[ExtensionPart, ...]:
    """Everything that installed packages provide, used and skipped, by group and name."""
    for group in GROUPS:  # importing the module that holds a group's registry creates it
        provided_modules(group)
    modules = [part for group, hook in HOOKS.items() for part, _ in modules_with(group, hook)]
    parts = [part for registry in _registries.values() for part in registry.parts()]
    return tuple(sorted((*parts, *modules, *_skipped), key=lambda part: (GROUPS.index(part.group), part.name)))
