"""Identification methods, one file each, found here and in packages with the entry point `mrdamper.methods`."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin, get_type_hints

from mrdamper.discovery import Registry
from mrdamper.errors import InputError, UnknownNameError
from mrdamper.identification.problem import Method

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


_registry = Registry("mrdamper.methods", Method, "method")
all_methods = _registry.all


def method_named(name: str, settings: Mapping[str, str] | None = None) -> Method:
    """Return the method of that name.

    Raises `UnknownNameError` if there is no such method, switch or value; with the near matches.

    `settings`: switches and numbers of the method, as text.
    """
    chosen = _registry.type_named(name)
    return chosen(**values_of_fields(chosen, settings)) if settings else chosen()


def values_of_fields(cls: type, settings: Mapping[str, str]) -> dict[str, Any]:
    """Read the values of a dataclass's fields from text: numbers, ranges LOW:HIGH and choices.

    Raises `UnknownNameError` if there is no such field or choice. Raises `InputError` if a number cannot be read.
    """
    kinds = {name: read for name, kind in get_type_hints(cls).items() if (read := _reader(kind))}
    for key in settings:
        if key not in kinds:
            raise UnknownNameError.of(f"setting of {cls.__dict__.get('name', cls.__name__)}", key, kinds)
    return {key: kinds[key](key, text) for key, text in settings.items()}


def _reader(kind: Any) -> Callable[[str, str], Any] | None:
    """Return the parser of a field of a type; None if the type has no text form."""
    if get_origin(kind) is Literal:
        return partial(_choice, get_args(kind))
    if kind == tuple[float, float]:
        return _range
    plain = next((part for part in (kind, *get_args(kind)) if part in (int, float)), None)
    return partial(_number, plain) if plain else None


def _choice(allowed: tuple[str, ...], key: str, text: str) -> str:
    if text not in allowed:
        raise UnknownNameError.of(f"value of {key}", text, allowed)
    return text


def _number(kind: type, key: str, text: str) -> float:
    try:
        return kind(text)
    except ValueError as error:
        raise InputError(f"{key} = {text}", remedy=f"give a number ({kind.__name__})") from error


def _range(key: str, text: str) -> tuple[float, float]:
    low, colon, high = text.partition(":")
    if not colon:
        raise InputError(f"{key} = {text}", remedy=f"write {key}=LOW:HIGH")
    return _number(float, key, low), _number(float, key, high)
