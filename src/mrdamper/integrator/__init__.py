"""Error-controlled integration of a model's state along a sampled motion.

For models that are not rate independent and so have no closed form between reversals. The
method is linearly implicit and L-stable, so a knee a thousand times shorter than a sample
costs a few steps and not an explosion; every step's error is estimated and kept below the
tolerance, and what cannot be kept below it is refused, never returned.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import ExcitationError, MissingExtraError, ParameterError
from mrdamper.integrator.streamed import Rate, integrate_step
from mrdamper.tracing import streamed


@streamed(integrate_step)
def integrate(
    rate: Rate,
    parameters: Sequence[float],
    motion: tuple[Floats, Floats, Floats, Floats],
    start: Sequence[float],
    scale: Sequence[float],
    *,
    tolerance: float = 1e-5,
) -> Floats:
    """State along a motion.

    Between samples the displacement is the cubic with the given values and slopes, the velocity
    its derivative, and the current straight.

    Parameters
    ----------
    rate : function (x, v, current, state, parameters, out)
        Writes d(state)/dt into `out`. A plain module-level function of numbers and arrays: it
        is compiled.
    parameters : P numbers
        Passed on to `rate`.
    motion : four (N,) arrays
        Time [s], displacement [m], velocity [m/s], current [A].
    start : S numbers
        State at the first sample.
    scale : S numbers
        A usual size of each state; errors are measured against the larger of it and the state.
    tolerance : float
        Error allowed per step, relative.

    Returns
    -------
    (N, S) array

    Raises
    ------
    ExcitationError
        If time does not increase.
    MissingExtraError
        If numba is not installed.
    ParameterError
        If the tolerance cannot be kept: the parameters make the model too stiff, or it runs away.

    References
    ----------
    Rodas3: Sandu et al. (1997), "Benchmarking stiff ODE solvers for atmospheric chemistry
    problems II: Rosenbrock solvers", Atmospheric Environment 31, 3459–3472; coefficients
    recalled, order and stability tested here.
    """
    time, x, v, current = (np.array(channel, dtype=float, order="C") for channel in motion)
    if not np.all(np.diff(time) > 0):
        raise ExcitationError("time does not increase", mend="sort the samples and drop the repeated ones")
    out = np.empty((time.size, len(start)))
    try:
        from mrdamper.integrator import rosenbrock  # compiles, or reads what was compiled before
    except ImportError as error:
        raise MissingExtraError(
            "a model that is integrated needs numba for whole records", mend="pip install 'mrdamper[fast]'"
        ) from error
    status, at = rosenbrock.path(
        rosenbrock.compiled(rate),
        np.array(parameters, dtype=float),
        time,
        x,
        v,
        current,
        np.array(start, dtype=float),
        np.array(scale, dtype=float),
        tolerance,
        out,
    )
    if status:
        why = "needs more than 20 000 steps" if status == rosenbrock.TOO_STIFF else "runs away"
        raise ParameterError(
            f"the model's state {why} between samples {at - 1} and {at} ({time[at]:.4g} s)",
            mend="its parameters are too stiff or unstable; bring them nearer to the data's scales",
        )
    return out
