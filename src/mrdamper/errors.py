"""Everything a user can get wrong, one exception each, with a code that never changes.

A message says what was found, where, and how to correct it, in one line.
Anything that is not an `InputError` is an internal error, not the user's.
"""

from __future__ import annotations

import errno
import inspect
import math
import re
import unicodedata
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from difflib import get_close_matches
from functools import cache, wraps
from numbers import Integral, Real
from types import UnionType
from typing import TYPE_CHECKING, Any, Literal, TypeVar, Union, cast, get_args, get_origin, get_type_hints

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_MAX_SHOWN = 60  # characters of a user's value in a message
Function = TypeVar("Function", bound=Callable[..., Any])


def printable(text: str) -> str:
    """Text on one line of a terminal: nothing in it moves a cursor or turns the direction of writing."""
    odd = ("Cc", "Cf", "Cn", "Co", "Cs", "Zl", "Zp")
    return "".join(f"\\x{ord(c):02x}" if unicodedata.category(c) in odd else c for c in text)


class InputError(ValueError):
    """Input that cannot be used.

    Parameters
    ----------
    found : str
        What was found.
    where : str, optional
        File, line, column, run or argument it was found in.
    remedy : str, optional
        What the user can do about it.
    code : str, optional
        Replaces the class's code where one exception serves a family of findings.

    Examples
    --------
    >>> from mrdamper import InputError, load_dataset
    >>> try:
    ...     load_dataset("no/such/folder")
    ... except InputError as error:
    ...     print(error.code)
    E_DATASET
    """

    code = "E_INPUT"

    def __init__(self, found: str, *, where: str = "", remedy: str = "", code: str | None = None):
        self.found, self.where, self.remedy = found, where, remedy
        self.code = code or type(self).code
        super().__init__(found)

    def __str__(self) -> str:
        text = f"{self.where}: {self.found}" if self.where else self.found
        if self.remedy:
            text += f"; {self.remedy}"
        return printable(f"{text} [{self.code}]")


def is_a(value: object, kind: type | tuple[type, ...]) -> bool:
    """Tell if a value is of a kind; unlike `isinstance` it says nothing to a type checker, who trusts annotations."""
    return isinstance(value, kind)


def require(value: object, kind: type | tuple[type, ...], wanted: str, remedy: str = "") -> None:
    """Refuse an argument of another kind in a public function: E_ARGUMENT, naming what came and what is wanted."""
    if not isinstance(value, kind):
        raise InputError(f"a {type(value).__name__} in place of {wanted}", remedy=remedy, code="E_ARGUMENT")


def validate_arguments(*but: str) -> Callable[[Function], Function]:
    """Refuse the arguments of a public function that its annotations do not allow: E_ARGUMENT.

    Numbers have to be finite; sequences and mappings hold what they say; arrays, numbers. Of a
    `Literal` only the kind is looked at. The function itself checks the arguments named in `but`.
    """

    def guard(function: Function) -> Function:
        signature = inspect.signature(function)
        names = [one.name for one in signature.parameters.values() if one.kind is one.POSITIONAL_OR_KEYWORD]
        plain = len(names) == len(signature.parameters)
        kinds: dict[str, object] = {}

        @wraps(function)
        def call(*given: Any, **named: Any) -> Any:
            if not kinds:  # names are known once all modules are read
                kinds.update(get_type_hints(function))
            try:
                complete = plain and not named and len(given) == len(names)  # binding takes most of the time
                bound = (
                    zip(names, given, strict=True) if complete else signature.bind(*given, **named).arguments.items()
                )
            except TypeError as error:
                wanted = re.sub(r": '([^']*)'", r": \1", str(signature).replace("(self, ", "(").partition(" -> ")[0])
                wanted = re.sub(r"<function .*? at 0x\w+>", "...", wanted)
                raise InputError(
                    f"{function.__qualname__}: {error}",
                    remedy=f"call {function.__name__}{wanted}; see help({function.__qualname__})",
                    code="E_ARGUMENT",
                ) from error
            for name, value in bound:
                if name in kinds and name not in but:
                    _require_fit(name, value, kinds[name])
            return function(*given, **named)

        return cast("Function", call)

    return guard


def check_fields(owner: object, *names: str) -> None:
    """Refuse fields of a dataclass, all or those named, of another type than declared, as `validate_arguments` does."""
    kinds = _field_kinds(type(owner))
    for name in names or kinds:
        _require_fit(name, getattr(owner, name), kinds[name])


@cache
def _field_kinds(kind: type) -> dict[str, object]:
    return get_type_hints(kind)


def _require_fit(name: str, value: object, kind: object) -> None:
    try:
        fits = _fits(value, kind)
    except (TypeError, ValueError, OverflowError):  # hostile objects, ragged arrays, numbers beyond all floats
        fits = False
    if not fits:
        # A class by its name, several or what they hold without their modules: Iterable[Run].
        wanted = kind.__name__ if isinstance(kind, type) and not get_args(kind) else re.sub(r"\b\w+\.", "", str(kind))
        hint = f", which {reader} reads" if (reader := getattr(kind, "read_by", "")) else ""
        raise InputError(f"{name} is {shown(value)}", remedy=f"give it as {wanted}{hint}", code="E_ARGUMENT")


def _fits(value: Any, kind: Any) -> bool:
    origin, inner, of_numbers = _parts(kind)
    if of_numbers:
        return is_series(value)
    if origin in (Union, UnionType):
        return any(_fits(value, one) for one in inner)
    if kind is float:
        return hasattr(value, "tape") or (isinstance(value, Real) and math.isfinite(value))
    if kind is int:
        return isinstance(value, Integral)
    if origin is Literal:
        return isinstance(value, str)
    if origin is type:
        return isinstance(value, type) and issubclass(value, inner)
    if origin is None or not inner:
        return not isinstance(kind, type) or isinstance(value, kind)
    if not issubclass(origin, Iterable):  # a callable, or one of our own
        return isinstance(value, origin)
    if issubclass(origin, Mapping):
        return is_a(value, Mapping) and all(_fits(k, inner[0]) and _fits(v, inner[1]) for k, v in value.items())
    wanted = Iterable if origin is Iterable else Collection
    if is_a(value, (str, bytes, Mapping)) or not is_a(value, wanted):
        return False
    if not is_a(value, Collection):
        return True  # looked at while it is used up
    each = inner[:1] * len(value) if origin is not tuple or inner[-1] is ... else inner
    return len(each) == len(value) and all(map(_fits, value, each))


@cache
def _parts(kind: Any) -> tuple[Any, tuple[Any, ...], bool]:
    """Origin and arguments of an annotation, and if it is one of NumPy's: ArrayLike, NDArray; asked for once."""
    origin = get_origin(kind)
    module = "" if isinstance(kind, type) else getattr(origin or kind, "__module__", "")  # an alias has one since 2.5
    of_numbers = "numpy._typing" in str(kind) or module.startswith("numpy")
    return origin, get_args(kind), of_numbers


def is_series(value: object) -> bool:
    """Tell if a value is a number or an array of numbers, all finite."""
    import numpy as np

    array = np.asarray(value)
    return array.dtype.kind in "biuf" and bool(np.isfinite(array).all())


def numbers(*values: object) -> tuple[float, ...]:
    """Values as floats; raises `InputError` (E_ARGUMENT) if one is no number."""
    try:
        return tuple(map(float, values))  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError) as error:
        what = f"not all numbers: {', '.join(map(shown, values))}"
        raise InputError(what, remedy="give a number for each", code="E_ARGUMENT") from error


def series(**given: Any) -> tuple[NDArray[np.float64], ...]:
    """Arguments as (N,) arrays of finite numbers, all as long as the first; a single number holds throughout.

    Raises `InputError`: E_ARGUMENT, naming the one that is none.
    """
    import numpy as np

    arrays: list[NDArray[np.float64]] = []
    for name, value in given.items():
        with suppress(TypeError, ValueError, OverflowError):
            if is_series(value) and np.ndim(value) <= 1:
                size = arrays[0].shape if arrays else np.atleast_1d(value).shape
                arrays.append(np.ascontiguousarray(np.broadcast_to(value, size), dtype=float))
                continue
        what = f"{name} is {shown(value)}"
        raise InputError(what, remedy="give finite numbers, as many as for the others", code="E_ARGUMENT")
    return tuple(arrays)


def require_positive(kind: type[InputError], where: str = "", **values: object) -> None:
    """Refuse values that are no positive, finite numbers, by an error of a kind; a traced number has its value."""
    for name, value in values.items():
        number = isinstance(value, Real) or hasattr(value, "tape")
        if isinstance(value, bool) or not number or not 0 < cast(Any, value) < math.inf:
            raise kind(f"{name} is {shown(value)}", where=where, remedy="give a positive, finite value in SI units")


def shown(value: object) -> str:
    """Whatever a user gave, in the first line of a few characters; a number of thousands of digits has no text."""
    try:
        text = f"{value:.10g}" if isinstance(value, float) else f"{value!r}".partition("\n")[0]
    except ValueError:
        return "a number of thousands of digits"
    return text if len(text) <= _MAX_SHOWN else f"{text[: _MAX_SHOWN - 1]}…"


def listed(names: Sequence[str], most: int) -> str:
    """Join the first names of a list with commas, and state how many more there are."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


class CombinedError(InputError):
    """Several things wrong with one input: at least two `errors`; its code is that of the first."""

    def __init__(self, errors: Iterable[InputError]):
        self.errors = tuple(errors)
        first = self.errors[0]
        super().__init__(first.found, where=first.where, remedy=first.remedy, code=first.code)

    def __str__(self) -> str:
        return "; also: ".join(map(str, self.errors))

    @classmethod
    def raise_from(cls, errors: Iterable[InputError]) -> None:
        """Raise what was found: nothing, the one error, or all together."""
        errors = tuple(errors)
        if errors:
            raise errors[0] if len(errors) == 1 else cls(errors)


class DatasetError(InputError):
    """The dataset folder is missing, or one of its tables cannot be read."""

    code = "E_DATASET"


class ColumnError(InputError):
    """A column is missing or holds something else than its name says."""

    code = "E_COLUMN"


class UnitError(InputError):
    """A unit is missing, unknown or of the wrong dimension."""

    code = "E_UNITS"


class RunError(InputError):
    """The arrays of a run do not fit together."""

    code = "E_RUN"


class TimeOrderError(RunError):
    """Time stamps repeat or run backwards."""

    code = "E_TIME_ORDER"


class NonFiniteError(RunError):
    """A channel holds NaN or infinity."""

    code = "E_NONFINITE"


class QualityError(InputError):
    """A record's channels contradict each other or physics; the code says how."""

    code = "E_QUALITY"


class UnknownNameError(InputError):
    """A model, method, rig or run of that name does not exist."""

    code = "E_NAME"

    @classmethod
    def of(cls, kind: str, name: str, names: Iterable[str]) -> UnknownNameError:
        """Build the error with the near matches as the remedy."""
        names = sorted(set(names))
        near = get_close_matches(name, names, n=3, cutoff=0.5)
        remedy = f"did you mean {' or '.join(near)}?" if near else f"known: {', '.join(names)}"
        return cls(f"no {kind} is called {name!r}", remedy=remedy)


class ConditionError(InputError):
    """A current, frequency or amplitude that no test can have."""

    code = "E_CONDITION"


class ExcitationError(InputError):
    """The motion does not allow what was asked: under a cycle, not a sine, no motion."""

    code = "E_EXCITATION"


class ParameterError(InputError):
    """A model parameter lies outside what its physics allows."""

    code = "E_PARAMETER"


class IdentificationError(InputError):
    """The data cannot determine the parameters asked for."""

    code = "E_IDENTIFICATION"


class ModelFileError(InputError):
    """A saved model cannot be read: damaged, too new, or with unknown fields."""

    code = "E_MODEL_FILE"


class OutputError(InputError):
    """A result cannot be written where it was asked for."""

    code = "E_OUTPUT"


class MissingExtraError(InputError):
    """An optional dependency is not installed."""

    code = "E_EXTRA"


class StructureError(InputError):
    """A structure, or what hangs in it, is impossible: masses, matrices, points."""

    code = "E_STRUCTURE"


class RecordError(InputError):
    """A ground motion or road cannot be used: units, step, gaps."""

    code = "E_RECORD"


class StepError(InputError):
    """The time step of a simulation is too coarse, or a step has no solution."""

    code = "E_STEP"


class ResourceError(InputError):
    """The machine has run out of room, memory, files or processes; the code says of what."""

    code = "E_RESOURCE"


_RESOURCES = {
    errno.ENOSPC: ("E_DISK_FULL", "the disk is full", "make room, or choose another disk"),
    errno.EDQUOT: ("E_DISK_FULL", "the disk quota is used up", "make room, or choose another disk"),
    errno.EFBIG: ("E_FILE_SIZE", "the file grows beyond the limit for files", "raise the limit (ulimit -f)"),
    errno.ENOMEM: ("E_MEMORY", "the memory does not suffice", "close other programs, or take less data"),
    errno.EMFILE: ("E_OPEN_FILES", "too many files are open", "raise the limit (ulimit -n)"),
    errno.ENFILE: ("E_OPEN_FILES", "too many files are open", "close other programs"),
    errno.EAGAIN: ("E_PROCESSES", "no further process can be started", "close other programs, or raise the limit"),
    errno.EIO: ("E_DISK", "the disk does not answer", "choose another disk"),
}


def resource_error(error: BaseException, where: str = "") -> ResourceError | None:
    """Name the resource the machine has run out of, if that is what an exception says; None otherwise."""
    number = getattr(error, "errno", None)
    if match := re.search(r"(?<=\(os error )(\d+)|(?<=Os \{ code: )(\d+)", str(error)):  # libraries in Rust
        number = int(match[0])
    if isinstance(error, MemoryError) or "out of memory" in str(error).lower():
        number = errno.ENOMEM
    if isinstance(error, FileNotFoundError) and "temporary directory" in str(error):
        return ResourceError(
            "there is no folder for temporary files", remedy="set TMPDIR to one you may write to", code="E_TEMP"
        )
    if isinstance(error, RuntimeError) and "start new thread" in str(error):
        number = errno.EAGAIN
    if number not in _RESOURCES:
        return None
    code, text, remedy = _RESOURCES[number]
    return ResourceError(text, where=where, remedy=remedy, code=code)
