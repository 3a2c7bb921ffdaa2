"""The adiabatic air spring: exact force and its Taylor series.

[Qian et al. 2024, Eq. 3–7]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from mrdamper.data.arrays import Floats
from mrdamper.data.wording import number
from mrdamper.errors import ParameterError, require_positive, validate_arguments

Direction = Literal["compression", "extension"]
AIR = 1.4  # polytropic exponent of a fast change of air or nitrogen


@dataclass(frozen=True, slots=True)
class GasSpring:
    """Gas behind a floating piston or membrane, at static equilibrium.

    Attributes
    ----------
    pressure : float
        p0, absolute [Pa].
    volume : float
        V0 [m³].
    rod_area : float
        A_r, the area whose motion changes the volume [m²].
    force_area : float, optional
        A_f, the area that turns pressure into force [m²]. Default: the rod area, which is
        what equilibrium of the rod gives; the chamber area is the other reading of the paper.
    exponent : float
        Polytropic exponent κ.

    Raises
    ------
    ParameterError
        If a value is not positive.

    Examples
    --------
    >>> from mrdamper import GasSpring
    >>> gas = GasSpring(pressure=2e6, volume=1e-4, rod_area=8e-5, exponent=1.4)  # [Pa], [m³], [m²]
    >>> round(float(gas.force(0.01)), 1)  # [N] at a displacement [m]
    1.8
    """

    pressure: float
    volume: float
    rod_area: float
    force_area: float | None = None
    exponent: float = AIR

    def __post_init__(self) -> None:
        values = {name: getattr(self, name) for name in self.__slots__}
        if self.force_area is None:
            del values["force_area"]
        require_positive(ParameterError, **{f"gas {name}": value for name, value in values.items()})

    @property
    def _force_area(self) -> float:
        return self.rod_area if self.force_area is None else self.force_area

    @validate_arguments()
    def force(self, compression: ArrayLike) -> Floats:
        """Exact gas force beyond the static one [N], for compressions [m].

        F_k = p0 A_f [(1 − A_r x/V0)^(−κ) − 1]; positive, against the motion, for x > 0.

        Raises
        ------
        ParameterError
            If the motion would compress the gas to no volume at all.
        """
        x = np.asarray(compression, dtype=float)
        left = 1.0 - self.rod_area * x / self.volume
        if np.any(left <= 0):
            limit = self.volume / self.rod_area
            raise ParameterError(
                f"a compression of {number(1e3 * np.max(x))} mm leaves no gas volume (limit {number(1e3 * limit)} mm)",
                remedy="check V0 and the rod area, or stay below the limit",
            )
        return self.pressure * self._force_area * (left**-self.exponent - 1.0)

    @validate_arguments()
    def stiffnesses(self, positive: Direction = "compression") -> tuple[float, float, float]:
        """Coefficients k1 [N/m], k2 [N/m²], k3 [N/m³] of F_k ≈ k1 x + k2 x² + k3 x³.

        [Qian et al. 2024, Eq. 6] With displacements positive in extension, as measured runs
        are kept, the even coefficient changes sign.
        """
        kappa, ratio = self.exponent, self.rod_area / self.volume
        unit = self.pressure * self._force_area
        k1 = kappa * unit * ratio
        k2 = kappa * (kappa + 1) / 2 * unit * ratio**2
        k3 = kappa * (kappa + 1) * (kappa + 2) / 6 * unit * ratio**3
        return k1, (k2 if positive == "compression" else -k2), k3

    @validate_arguments()
    def taylor_error(self, amplitude: float) -> float:
        """Largest error of the third-order series within ±amplitude [m], relative to the exact force."""
        exact = self.force([-amplitude, amplitude])
        k1, k2, k3 = self.stiffnesses()
        x = np.array([-amplitude, amplitude])
        series = k1 * x + k2 * x**2 + k3 * x**3
        return float(np.max(np.abs(series - exact)) / np.max(np.abs(exact))) if amplitude else math.nan
