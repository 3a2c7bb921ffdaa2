"""Traced programs compiled by the C compiler of this machine, for whole records.

`RecordProgram` runs a traced program along a record: as C, compiled once and kept in the user's
cache, or in the interpreter where there is no compiler. Both give the same numbers.
"""

from mrdamper.tracing.compiled.record import RecordProgram

__all__ = ["RecordProgram"]
