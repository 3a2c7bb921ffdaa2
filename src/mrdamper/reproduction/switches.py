"""What the paper's text leaves open, as switches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from mrdamper.errors import ParameterError, UnknownNameError

MassLaw = Literal["exponential", "inverse-square", "power"]
FrictionTest = Literal["dry", "filled"]


@dataclass(frozen=True)
class Switches:
    """Presets, the law of the mass, the friction test and the boxes of the genetic search.

    Attributes
    ----------
    A, n : float
        Presets of the loop [-]. A scales alpha and beta and changes no force.
    gamma : float or None
        Preset [m^-n, for A = 1]; None ties it to beta.
    mass_law : {"exponential", "inverse-square", "power"}
        Reading of Eq. 29.
    friction_test : {"dry", "filled"}
        Without fluid, as in the paper, or with it: then the yield force without current is in it.
    alpha_box, beta_box : (float, float)
        Of the genetic search [N/m, m^-n].
    """

    A: float = 1.0
    n: float = 2.0
    gamma: float | None = None
    mass_law: MassLaw = "exponential"
    friction_test: FrictionTest = "dry"
    alpha_box: tuple[float, float] = (0.0, 1e8)
    beta_box: tuple[float, float] = (0.0, 1e8)

    def __post_init__(self) -> None:
        if not 0 < self.A < float("inf"):
            raise ParameterError(f"preset A is {self.A:g}", mend="give a positive number")
        if not 1 <= self.n <= 10:
            raise ParameterError(f"preset n is {self.n:g}", mend="give a number from 1 to 10")
        for name, (low, high) in (("alpha", self.alpha_box), ("beta", self.beta_box)):
            if not 0 <= low < high < float("inf"):
                raise ParameterError(f"the box of {name} runs from {low:g} to {high:g}", mend="give 0 <= LOW < HIGH")
        for name, value, allowed in (
            ("mass law", self.mass_law, get_args(MassLaw)),
            ("friction test", self.friction_test, get_args(FrictionTest)),
        ):
            if value not in allowed:
                raise UnknownNameError.of(name, value, allowed)

    @property
    def fixed(self) -> tuple[tuple[str, float], ...]:
        """Presets other than the method's own, as parameters held [SI, for A = 1]."""
        presets = (("n", self.n if self.n != 2.0 else None), ("gamma", self.gamma))
        return tuple((name, value) for name, value in presets if value is not None)

    @property
    def bounds(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The boxes as the method takes them, for A = 1."""
        a, b = self.A, self.A ** (self.n - 1)
        return (a * self.alpha_box[0], a * self.alpha_box[1]), (b * self.beta_box[0], b * self.beta_box[1])

    def scaled(self, name: str, value: float) -> float:
        """A parameter identified with A = 1, as it reads with the preset A."""
        powers = {"alpha": -1.0, "beta": 1 - self.n, "gamma": 1 - self.n}
        return value * self.A ** powers.get(name, 0.0)
