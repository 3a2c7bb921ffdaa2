"""Work done before it is asked for: the bundled tests open at once, and the first drop waits for no import."""

from __future__ import annotations

import threading

from mrdamper.web.intake import bundled
from mrdamper.web.rig_table import rig_table


class ReadAhead:
    """Analyses and judges the bundled tests in a thread, once, when first told to begin.

    It begins with the first session: before that it would compete with the page being loaded.
    """

    def __init__(self) -> None:
        self._thread = threading.Thread(target=_read, name="bench-read-ahead", daemon=True)
        self._first = threading.Lock()  # taken by whoever is first, and never given back

    def begin(self) -> None:
        """Begin; harmless when it has begun."""
        if self._first.acquire(blocking=False):
            self._thread.start()


def _read() -> None:
    data = bundled().dataset
    tables = [rig_table(data, rig) for rig in data.rigs]
    for table in tables:
        _ = table.quality  # also brings the libraries that judging takes
