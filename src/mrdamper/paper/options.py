"""The points that the paper's text leaves open, as options, and the recipe that a study follows with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, Literal, get_args, get_origin, get_type_hints

from mrdamper.data import Run
from mrdamper.errors import IdentificationError, ParameterError, UnknownNameError
from mrdamper.identification.harmonic_balance import AmplitudeReading, OffsetReading, PhaseReading
from mrdamper.paper.assumptions import PaperAssumptions, outside_paper_range, require_paper_functions
from mrdamper.paper.functions import fit_paper_functions
from mrdamper.paper.genetic import GeneticSettings
from mrdamper.paper.paper_method import Paper
from mrdamper.physics.gas_spring import GasSpring
from mrdamper.study.recipe import Recipe, StudyMethod, modified

MassLaw = Literal["exponential", "inverse-square", "power"]
FrictionTest = Literal["dry", "filled"]
Search = Literal["genetic", "optimum"]
# Titles of the methods that are compared.
LITERAL, HALF, SAME_FORMS = "paper, literal", "paper, F0 half peak-to-peak", "consistent, the paper's functions"
CONSISTENT, JOINT = "consistent", "joint"
TRADITIONAL, SLOWEST = "traditional, nearest speed", "traditional, slowest motion"
DIRECT, ALI = "direct genetic, nearest speed", "Ali-type (Spencer-based)"
_WAY, _SOURCE = "paper method", "Qian et al. 2024"
_LIMITS = "sines only; the parameter functions need the frequency and amplitude of a sine"


@dataclass(frozen=True)
class PaperOptions(StudyMethod):
    """Presets, gas spring, readings of the text and search of the paper's method."""

    name: ClassVar[str] = "paper"

    # gas spring of the damper [Eq. 3–8]. Unknown: k1 and m come from a regression of the in-phase stiffness over the
    # frequencies, k2 = k3 = 0
    gas: GasSpring | None = None
    # A and n: presets of the loop [-]. A scales alpha and beta and changes no force
    A: float = 1.0
    n: float = 2.0
    gamma: float | None = None  # preset [m^-n, for A = 1]; None ties it to beta
    # force_amplitude, phase, offset, quadratic_stiffness and search: as those of the method `Paper`
    force_amplitude: AmplitudeReading = "first-harmonic"
    phase: PhaseReading = "harmonic"
    offset: OffsetReading = "extremes"
    quadratic_stiffness: Literal["kept", "dropped"] = "kept"
    mass_law: MassLaw = "exponential"  # reading of Eq. 29
    # refuse tests that do not determine the paper's functions, or take shorter ones in their place
    functions: Literal["paper", "shorter"] = "paper"
    # of the virtual rig: without fluid, as in the paper, or with it, which adds the yield force without current
    friction_test: FrictionTest = "dry"
    search: Search = "genetic"
    generations: int = 500  # of the genetic search, in each of its seven boxes
    seed: int = 0  # of the genetic search
    # alpha_box and beta_box: bounds of the search [N/m, m^-n]
    alpha_box: tuple[float, float] = (0.0, 1e8)
    beta_box: tuple[float, float] = (0.0, 1e8)

    def __post_init__(self) -> None:
        if not 0 < self.A < float("inf"):
            raise ParameterError(f"preset A is {self.A:g}", remedy="give a positive number")
        if not 1 <= self.n <= 10:
            raise ParameterError(f"preset n is {self.n:g}", remedy="give a number from 1 to 10")
        if self.gamma is not None and not 0 <= self.gamma < float("inf"):
            raise ParameterError(f"preset gamma is {self.gamma:g}", remedy="give a number that is not negative")
        for name, (low, high) in (("alpha", self.alpha_box), ("beta", self.beta_box)):
            if not 0 <= low < high < float("inf"):
                raise ParameterError(f"the box of {name} runs from {low:g} to {high:g}", remedy="give 0 <= LOW < HIGH")
        for name, kind in get_type_hints(type(self)).items():
            if get_origin(kind) is Literal and getattr(self, name) not in get_args(kind):
                raise UnknownNameError.of(name.replace("_", " "), getattr(self, name), get_args(kind))
        GeneticSettings(generations=self.generations)  # refuses a count that is too small

    @property
    def fixed(self) -> tuple[tuple[str, float], ...]:
        """Presets other than the method's own, as parameters held [SI, for A = 1]."""
        presets = (("n", self.n if self.n != 2.0 else None), ("gamma", self.gamma))
        return tuple((name, value) for name, value in presets if value is not None)

    @property
    def bounds(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The boxes of the search, for A = 1."""
        a, b = self.A, self.A ** (self.n - 1)
        return (a * self.alpha_box[0], a * self.alpha_box[1]), (b * self.beta_box[0], b * self.beta_box[1])

    def scaled(self, name: str, value: float) -> float:
        """Scale a parameter identified with A = 1 to the preset A."""
        powers = {"alpha": -1.0, "beta": 1 - self.n, "gamma": 1 - self.n}
        return value * self.A ** powers.get(name, 0.0)

    def method(self, search: Search | None = None) -> Paper:
        """Return the identification of single runs."""
        genetic = GeneticSettings(generations=self.generations, seed=self.seed)
        return Paper(
            self.force_amplitude, self.phase, self.offset, self.quadratic_stiffness, search or self.search, genetic,
            self.bounds,
        )  # fmt: skip

    def recipe(self, train: Sequence[Run]) -> Recipe:
        """Make the recipe; raises `IdentificationError` E_PAPER_TESTS, or `ParameterError` without gas volume."""
        if self.functions == "paper":
            require_paper_functions(train)
        assumptions = PaperAssumptions.of(train, self.gas).preset(self.fixed)
        return Recipe(
            name=self.name,
            basis=assumptions.basis(self.method()),
            make=partial(fit_paper_functions, mass_law=self.mass_law),
            way=_WAY,
            source=_SOURCE,
            limits=_LIMITS,
            pure=True,
            notes=(*assumptions.notes, *outside_paper_range(train)),
        )

    def beside_others(self) -> PaperOptions:
        """Return the method with the optimum that its genetic search approaches, and shorter functions if necessary."""
        return replace(self, search="optimum", functions="shorter")

    def compared(self) -> Sequence[Recipe]:
        """Return the method, and Bouc–Wen by the genetic searches with the functions of other models."""
        searches = [replace(modified("bouc-wen", method), on_request=True) for method in ("paper", "direct-genetic")]
        heading = Recipe("paper", None, fit_paper_functions, _WAY, source=_SOURCE, limits=_LIMITS)
        return [replace(heading, complete=self._recipe_beside_others), *searches]

    def _recipe_beside_others(self, train: Sequence[Run]) -> Recipe:
        if len(train) < 3:
            raise IdentificationError("fewer than three identification runs of a pure sine", remedy="test sines")
        return self.beside_others().recipe(train)
