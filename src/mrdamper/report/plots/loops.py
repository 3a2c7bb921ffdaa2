"""Loops and forces in matplotlib axes, for notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from mrdamper.dampers.bands import Band
from mrdamper.dampers.prediction import Prediction
from mrdamper.data import Floats, Run
from mrdamper.errors import InputError, UnknownNameError, require, shown
from mrdamper.physics.motion import measured_motion
from mrdamper.report.plots.figure import Figure, new_figure
from mrdamper.report.plots.style import KN, MM, PREDICTED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_STYLE: dict[Any, Any] = {
    "lines.linewidth": 1.2,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e3e3e3",
}
_OVER = {"displacement": ("Displacement (mm)", MM), "velocity": ("Velocity (mm/s)", MM)}


def plot_loop(
    what: Run | Prediction,
    axes: Axes | None = None,
    over: Literal["displacement", "velocity"] = "displacement",
    **line: Any,
) -> Axes:
    """Draw the force [kN] of a run or a prediction over displacement [mm] or velocity [mm/s].

    Parameters
    ----------
    what : Run or Prediction
        Of a run, the part inside its steady window.
    axes : matplotlib Axes, optional
        To draw into; new ones by default.
    over : "displacement" or "velocity"
    **line
        Passed to `Axes.plot`.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    UnknownNameError
        If `over` is neither.

    Examples
    --------
    >>> from mrdamper import load_dataset, plot_loop
    >>> axes = plot_loop(load_dataset()["utf_5mm4Hz_1A"], over="velocity", label="measured")
    >>> axes.get_xlabel()
    'Velocity (mm/s)'
    """
    require(what, (Run, Prediction), "a run or a prediction")
    require(over, str, "a way to draw a loop")
    if over not in _OVER:
        raise UnknownNameError.of("way to draw a loop", over, _OVER)
    steady = what.steady() if isinstance(what, Run) else what
    motion = measured_motion(steady) if isinstance(steady, Run) else steady.motion
    name, factor = _OVER[over]
    return _drawn(axes, factor * getattr(motion, over), steady.force, name, line)


def plot_force(what: Run | Prediction, axes: Axes | None = None, **line: Any) -> Axes:
    """Draw the force [kN] of a run or a prediction over time [s].

    Parameters
    ----------
    what : Run or Prediction
    axes : matplotlib Axes, optional
        To draw into; new ones by default.
    **line
        Passed to `Axes.plot`.

    Raises
    ------
    AttributeError
        If a property of `line` is unknown to matplotlib.

    Examples
    --------
    >>> from mrdamper import load_dataset, plot_force
    >>> plot_force(load_dataset()["utf_5mm4Hz_1A"]).get_ylabel()
    'Force (kN)'
    """
    require(what, (Run, Prediction), "a run or a prediction")
    time = what.time if isinstance(what, Run) else what.motion.time
    return _drawn(axes, time, what.force, "Time (s)", line)


def predicted_force(prediction: Prediction, interval: Band | None = None, level: float = 0.9) -> Figure:
    """Draw a prediction with its interval of coverage `level`: both loops of a sine, force over time of others."""
    motion = prediction.motion
    abscissas = [("Time (s)", motion.time)]
    if prediction.is_sine:
        abscissas = [("Displacement (mm)", MM * motion.displacement), ("Velocity (m/s)", motion.velocity)]
    figure, *panels = new_figure(1, len(abscissas), 3.2)
    for axes, (name, x) in zip(panels, abscissas, strict=True):
        axes.plot(x, prediction.force, color=PREDICTED, label="predicted")
        for number, edge in enumerate((interval.low, interval.high) if interval else ()):
            text = "" if number else f"{100 * level:g} % interval"
            axes.plot(x, edge, color=PREDICTED, lw=0.6, ls=":", label=text)
        axes.label(name, "Force (N)")
    panels[0].title = str(prediction.condition)
    panels[-1].legend()
    return figure


def _drawn(axes: Axes | None, x: Floats, force: Floats, name: str, line: dict[str, Any]) -> Axes:
    from matplotlib import pyplot, rc_context

    if axes is not None and not hasattr(axes, "plot"):
        raise InputError(f"axes is {shown(axes)}", remedy="give axes of matplotlib, or none", code="E_ARGUMENT")
    with rc_context(_STYLE):
        axes = axes or pyplot.subplots()[1]
        axes.plot(x, KN * force, **line)
    axes.set_xlabel(name)
    axes.set_ylabel("Force (kN)")
    return axes
