"""Traced programs compiled by the C compiler of this machine, for whole records.

`RecordProgram` runs a traced program along a record: as C, compiled once and cached, or in the interpreter without a
compiler. Both give the same numbers.
"""

from mrdamper.tracing.compiled.record import RecordProgram

__all__ = ["RecordProgram"]
