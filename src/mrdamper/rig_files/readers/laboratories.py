"""Formats of machines as lists of columns, where headings alone do not state the channels: a real-time system."""

from __future__ import annotations

from mrdamper.rig_files.readers.column_list import ColumnList


class RealTimeRecorder(ColumnList):
    """Recorder of a real-time system: rows of headings that begin with what they hold, paths of a model."""

    name = "real-time-recorder"
    title = "real-time recorder text"
    mark = r'"xaxis"\s*[;,]\s*"trace_values"'
    columns = (("displacement", "xPiston (*)"), ("force", "FRod (*)"), ("current", "iMeas (*)"))
