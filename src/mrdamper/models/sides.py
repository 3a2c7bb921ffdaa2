"""Branch of a hysteresis loop for models without memory."""

from __future__ import annotations

import numpy as np

from mrdamper.data import Floats
from mrdamper.tracing import choose


def side(displacement: Floats, width: float = 0.0) -> Floats:
    """+1 on the way back from a positive displacement, −1 from a negative one.

    Memoryless models shift their curve over velocity by sgn(x) of the displacement x (N,) from mid-stroke [m], which on
    a sine equals −sgn(a). As published, the shift changes its sign at once, and the force has a small jump at x = 0.
    With a width [m] it changes as tanh(x/width).
    """
    return choose(width > 0, lambda: np.tanh(displacement / width), lambda: np.sign(displacement))
