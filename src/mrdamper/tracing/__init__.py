"""Programs for one sample and source code from array code that runs on symbols.

`Tape` records the operations, `Expression` replaces arrays in the model's arithmetic, `streamed` gives a function with
memory its form for one sample, `program` orders the result.
"""

from mrdamper.tracing.expression import Expression, Traced, TraceError, choose, plain, settled
from mrdamper.tracing.program import Program, program
from mrdamper.tracing.tape import Tape, streamed

__all__ = ["Expression", "Program", "Tape", "TraceError", "Traced", "choose", "plain", "program", "settled", "streamed"]
