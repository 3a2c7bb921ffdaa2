"""Says which records have an odd number of samples."""

from __future__ import annotations

from collections.abc import Iterator

from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Finding


def check(view: View) -> Iterator[Finding]:
    """Find an odd number of samples."""
    if view.run.time.size % 2:
        yield Finding("W_ODD_COUNT", f"{view.run.time.size} samples")
