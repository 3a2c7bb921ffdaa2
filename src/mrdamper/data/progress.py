"""Progress of long work, as a function that is told the present step and the share done, 0...1."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]


def silent(step: str, share: float) -> None:
    """Show no progress."""
