"""Formats of testing machines as lists of columns: a servohydraulic one, a shock dynamometer, a real-time system."""

from __future__ import annotations

from mrdamper.rig_files.readers.column_list import ColumnList


class MtsText(ColumnList):
    """Text of an MTS station: a block an acquisition, with its name above it."""

    name = "mts-text"
    title = "MTS station text"
    mark = r"^(?:MTS793\||Data Acquisition:)"
    columns = (
        ("time", "Running Time (*)"),
        ("time", "Time (*)"),
        ("displacement", "Axial Displacement (*)"),
        ("displacement", "Axial Stroke (*)"),
        ("force", "Axial Force (*)"),
        ("force", "Axial Load (*)"),
    )


class ShockDyno(ColumnList):
    """Tests of a shock dynamometer beside each other, each under a title."""

    name = "shock-dyno"
    title = "shock dynamometer text"
    mark = r"(?i)shock dyno"
    columns = (
        ("displacement", "Disp (*)"),
        ("displacement", "Position (*)"),
        ("force", "Force (*)"),
        ("velocity", "Velocity (*)"),
    )


class RealTimeRecorder(ColumnList):
    """Recorder of a real-time system: rows of headings that begin with what they hold, paths of a model."""

    name = "real-time-recorder"
    title = "real-time recorder text"
    mark = r'"xaxis"\s*[;,]\s*"trace_values"'
    columns = (
        ("displacement", "xPiston (*)"),
        ("displacement", "Stroke (*)"),
        ("displacement", "LVDT (*)"),
        ("force", "FRod (*)"),
        ("force", "Load cell (*)"),
        ("current", "iMeas (*)"),
        ("current", "iCoil (*)"),
    )
