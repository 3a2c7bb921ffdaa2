"""Identification methods, one file each: a new file here, or a package with the entry point `mrdamper.methods`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args, get_origin, get_type_hints

from mrdamper.discovery import Registry
from mrdamper.errors import InputError, UnknownNameError
from mrdamper.identification.problem import Method

if TYPE_CHECKING:
    from collections.abc import Mapping


_registry = Registry("mrdamper.methods", Method, "method")


def all_methods() -> Mapping[str, type[Method]]:
    """Every method by its name, those of other packages included."""
    return _registry.types


def method_named(name: str, settings: Mapping[str, str] | None = None) -> Method:
    """The method of that name.

    Parameters
    ----------
    name : str
    settings : mapping of str to str, optional
        Switches and numbers of the method, as text.

    Raises
    ------
    UnknownNameError
        If there is no such method, switch or value; with the near matches.
    """
    chosen = _registry.type_named(name)
    if not settings:
        return chosen()
    kinds = {k: t for k, t in get_type_hints(chosen).items() if _is_simple(t)}
    values: dict[str, object] = {}
    for key, text in settings.items():
        if key not in kinds:
            raise UnknownNameError.of(f"setting of {name}", key, kinds)
        allowed = get_args(kinds[key])
        if allowed and text not in allowed:
            raise UnknownNameError.of(f"value of {key}", text, allowed)
        values[key] = text if allowed else _number(kinds[key], key, text)
    return chosen(**values)


def _is_simple(kind: object) -> bool:
    return kind in (int, float) or get_origin(kind) is Literal


def _number(kind: type, key: str, text: str) -> float:
    try:
        return kind(text)
    except ValueError as error:
        raise InputError(f"{key} = {text}", mend=f"give a number ({kind.__name__})") from error
