"""Survivors that are no gap in the tests, and why: (module, line, change) to a reason.

They count among the survivors all the same.
"""

from __future__ import annotations

EXPLAINED: dict[tuple[str, str, str], str] = {}
