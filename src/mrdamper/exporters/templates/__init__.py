"""Templates, and `render`, which fills them."""

from __future__ import annotations

from functools import cache
from typing import Any

from mrdamper.data.encoding import xml


def render(template: str, **facts: Any) -> str:
    """Fill a template of this folder; a missing value is an error."""
    return _environment().get_template(template).render(**facts)


@cache
def _environment() -> Any:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("mrdamper.exporters", "templates"),
        undefined=StrictUndefined,
        keep_trailing_newline=True,
        autoescape=False,  # each place has its own encoding
    )
    environment.filters["xml"] = xml
    return environment
