"""Side of a hysteresis loop on which a model without memory lies."""

from __future__ import annotations

import numpy as np

from mrdamper.data import Floats
from mrdamper.tracing import choose


def side(displacement: Floats, width: float = 0.0) -> Floats:
    """+1 on the way back from a positive displacement, −1 from a negative one.

    Memoryless models shift their curve over velocity by sgn(x), which on a sine about
    mid-stroke equals −sgn(a). As published the shift changes side at once, and the force
    jumps a little at x = 0.

    Parameters
    ----------
    displacement : (N,) array
        From mid-stroke [m].
    width : float
        Displacement in which the shift changes side, tanh(x/width) [m]; 0: at once.
    """
    return choose(width > 0, lambda: np.tanh(displacement / width), lambda: np.sign(displacement))
