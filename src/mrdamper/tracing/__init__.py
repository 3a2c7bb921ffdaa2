"""One definition of a model for arrays, streams and source code: its array code runs on symbols.

`Tape` is what is written on, `Expression` what the model's arithmetic sees in place of arrays,
`streamed` the form of a function with memory for one sample, `program` the result in order.
"""

from mrdamper.tracing.expression import Expression, Traced, TraceError, choose, plain, settled
from mrdamper.tracing.program import Program, program
from mrdamper.tracing.tape import Tape, streamed

__all__ = ["Expression", "Program", "Tape", "TraceError", "Traced", "choose", "plain", "program", "settled", "streamed"]
