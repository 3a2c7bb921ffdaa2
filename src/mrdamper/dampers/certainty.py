"""How sure a damper is: the spread of its numbers, of a session it has not seen, and of its form.

Three parts, stated apart. The numbers it was identified from are uncertain (*parameter*): noise
and model error within the runs, and gains and offsets that differ from session to session. A
session nobody has seen brings a gain and an offset of its own (*session*). And the form is not
the damper (*model*): what conditions left out of the fit were wrong by, beyond the other two.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import InputError

if TYPE_CHECKING:
    from mrdamper.dampers.base import Damper


@dataclass(frozen=True)
class OwnNumber:
    """A number of a damper determined from data: its value, its bounds, and whether it is searched in the logarithm."""

    value: float
    bounds: tuple[float, float] = (-np.inf, np.inf)
    log: bool = False


@dataclass(frozen=True, eq=False)
class Certainty:
    """What is known of how wrong a damper may be.

    Attributes
    ----------
    names : tuple of str, length P
        Numbers determined from the data.
    logs : tuple of bool, length P
        Whether the covariance is that of the logarithm.
    covariance : (P, P) array
    dof : (P,) array
        Degrees of freedom behind each variance.
    one_sided : tuple of str
        Numbers held by a bound: only the other side is open.
    unknown : tuple of str
        Numbers these runs cannot tell apart from others.
    gain, offset : float
        Standard deviations between sessions, of the force as a share and as a shift [N].
    session_dof : float
        Degrees of freedom behind them; below 1 there are too few runs to know.
    force, peak, energy : float
        Standard deviations of the model's own error: of the force over half its peak-to-peak value,
        of the peak force and of the dissipated energy, relative.
    left_out : int
        Runs left out that say so.
    """

    names: tuple[str, ...]
    logs: tuple[bool, ...]
    covariance: Floats
    dof: Floats
    one_sided: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()
    gain: float = 0.0
    offset: float = 0.0
    session_dof: float = 0.0
    force: float = 0.0
    peak: float = 0.0
    energy: float = 0.0
    left_out: int = 0

    def interval(self, damper: Damper, name: str, level: float = 0.95) -> tuple[float, float]:
        """Ends of a number's interval.

        Raises
        ------
        InputError
            E_CERTAINTY if it is not among those whose spread is known.
        """
        if name not in self.names:
            why = "held by a bound" if name in self.one_sided else "not determined by these runs"
            raise InputError(f"{name} is {why}", mend="test where it matters", code="E_CERTAINTY")
        i = self.names.index(name)
        value, half = (
            damper.own_numbers[name].value,
            student(level, self.dof[i]) * float(np.sqrt(self.covariance[i, i])),
        )
        if self.logs[i]:
            return float(value * np.exp(-half)), float(value * np.exp(half))
        return float(value - half), float(value + half)


def student(level: float, dof: float) -> float:
    """Two-sided quantile of Student's t.

    Raises
    ------
    InputError
        E_LEVEL if the level is not between 0 and 1.
    """
    from scipy.special import stdtrit

    if not 0 < level < 1:
        raise InputError(f"level {level:g}", mend="give a share between 0 and 1, as 0.9", code="E_LEVEL")
    return float(stdtrit(max(dof, 1.0), (1 + level) / 2))


def unsure(damper: Damper) -> list[str]:
    """What cannot be known from these runs, and what is known badly, in words."""
    known: Certainty | None = damper.certainty
    if known is None:
        return ["How sure the numbers are is not known: the model was saved without it."]
    said = [f"{name} ended at a limit of its range: only one side of it is open." for name in known.one_sided]
    if known.unknown:
        said.append(f"{', '.join(known.unknown)} cannot be known from these runs: others do the same to the force.")
    if known.session_dof < 2:
        said.append("There are too few sessions to know how much they differ.")
    numbers = damper.own_numbers
    for i, name in enumerate(known.names):
        error = float(np.sqrt(known.covariance[i, i])) / (1.0 if known.logs[i] else abs(numbers[name].value) or 1.0)
        if error > 0.5:
            said.append(f"{name} is known to a factor only: its standard error is {100 * error:.0f} %.")
    scale = np.sqrt(np.diag(known.covariance))
    alike = known.covariance / np.outer(scale, scale) if known.names else np.zeros((0, 0))
    for i, j in zip(*np.where(np.triu(np.abs(alike), 1) > 0.98), strict=True):
        said.append(
            f"{known.names[i]} and {known.names[j]} are known together, not apart (correlation {alike[i, j]:.2f})."
        )
    return said


def table(damper: Damper, level: float = 0.95) -> list[Mapping[str, float | str]]:
    """Numbers with the ends of their intervals, one row each."""
    known: Certainty | None = damper.certainty
    rows = []
    for name, own in damper.own_numbers.items():
        row: dict[str, float | str] = {"name": name, "value": own.value, "low": "", "high": ""}
        if known is not None and name in known.names:
            row["low"], row["high"] = known.interval(damper, name, level)
        rows.append(row)
    return rows
