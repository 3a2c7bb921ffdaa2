"""Branch of a hysteresis loop for models without memory."""

from __future__ import annotations

import numpy as np

from mrdamper.data import Floats
from mrdamper.tracing import choose


def side(displacement: Floats, width: float = 0.0) -> Floats:
    """+1 on the way back from a positive displacement, −1 from a negative one.

    Memoryless models shift their curve over velocity by sgn(x), which on a sine about mid-stroke equals −sgn(a). As
    published, the shift changes its sign at once, and the force has a small jump at x = 0.

    Parameters
    ----------
    displacement : (N,) array
        From mid-stroke [m].
    width : float
        Displacement over which the shift changes its sign, tanh(x/width) [m]; 0: at once.
    """
    return choose(width > 0, lambda: np.tanh(displacement / width), lambda: np.sign(displacement))
