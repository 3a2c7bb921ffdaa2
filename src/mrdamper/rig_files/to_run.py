"""From a judged record to a run."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from mrdamper.data import Run
from mrdamper.data.arrays import chunks, drop_pages
from mrdamper.errors import ColumnError, RunError
from mrdamper.rig_files.quality import check_record
from mrdamper.rig_files.quality.loop import steady_part
from mrdamper.rig_files.quality.presence import USED
from mrdamper.rig_files.quality.view import SHORTEST, View
from mrdamper.rig_files.record import FURTHER, Record


def to_run(record: Record) -> Run:
    """Return the run a record holds.

    Missing samples are left out, as are segments of under five samples. Where the motion is
    periodic, the steady window is the largest whole number of its last steady cycles. The
    codes of the findings stand in the notes under "findings", separated by spaces. Nothing
    is zeroed, filtered or resampled.

    Parameters
    ----------
    record : Record
        Judged; a record that was not is judged first.

    Raises `QualityError` if the record cannot be used; `ColumnError` if it has no current; `RunError` if under three
    samples are left.
    """
    if not record.segments:
        record = check_record(record)
    if record.current is None:
        raise ColumnError("no current", where=f"run {record.id}", remedy="name its column or value in the rig profile")
    keep = _kept(record)
    count = np.count_nonzero(keep)
    sizes = [int(np.count_nonzero(keep[start:stop])) for start, stop in record.segments]
    bounds = np.cumsum([0, *(size for size in sizes if size)]).tolist()
    if count == keep.size:
        keep = slice(None)  # nothing is copied: a long record lies in a file
    if count < 3:
        raise RunError(f"{count} samples", where=f"run {record.id}", remedy="a run needs at least 3")
    steady = record.steady or steady_part(View(record))
    codes = " ".join(dict.fromkeys(finding.code for finding in record.findings))
    further = {f"{name}_{unit}": getattr(record, name) for name, unit in FURTHER.items()} | dict(record.further)
    own: dict[str, Any] = {name: getattr(record, name) for name in ("id", "rig", "excitation", "split")}
    own |= {name: values[keep] for name, values in record.channels.items() if name in USED}
    run = Run(
        **own,
        further={name: values[keep] for name, values in further.items() if values is not None},
        window=steady.window,
        repeatability=steady.repeatability,
        segments=tuple(pairwise(bounds)),
        notes={**record.provenance, **({"findings": codes} if codes else {})},
    )
    for values in (record.time, record.displacement, record.force, record.current):
        if values is not None:
            drop_pages(values)
    return run


def _kept(record: Record) -> np.ndarray:
    keep = record.present
    for at, piece in () if record.velocity is None else chunks(record.velocity):
        keep[at : at + piece.size] &= np.isfinite(piece)
    for start, stop in record.segments:
        if np.count_nonzero(keep[start:stop]) < SHORTEST:
            keep[start:stop] = False
    return keep
