"""Base class of the published condition-dependent dampers: coefficients, and a model at every condition."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, field, fields, replace
from typing import Any, ClassVar, Self

import numpy as np

from mrdamper.dampers.base import Damper, Saved
from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.piece import Pieces
from mrdamper.dampers.uncertainty import FittedParameter
from mrdamper.data import Condition, Floats, Run
from mrdamper.data.wording import counted
from mrdamper.errors import IdentificationError, ParameterError
from mrdamper.identification.problem import Identification
from mrdamper.models import Model
from mrdamper.physics.motion import sine
from mrdamper.statistics.levenberg_marquardt import forward_differences, least_squares

_MAX_STEPS = 8
AT_BOUNDS = "at a bound of the search"  # entry of the provenance: coefficients whose values are no estimates
_LOGARITHM = "_log"  # end of the name of a coefficient that is the logarithm of a parameter
_COEFFICIENT_RANGE = 0.8  # a coefficient may change by this share of its start, or of one
Tables = dict[str, list[float] | list[list[float]]]


@dataclass(frozen=True)
class SavedConditioned(Saved):
    """A condition-dependent damper in a saved model."""

    model: str
    coefficients: dict[str, float]
    reference: tuple[float, float, float]  # current [A], frequency [Hz], amplitude [m]
    tables: Tables = field(default_factory=Tables)


@dataclass(frozen=True, eq=False, repr=False)
class ConditionedDamper(Damper):
    """A damper with an explicit model for every condition. Subclasses are final."""

    kind: ClassVar[str] = "conditioned"
    saved: ClassVar[type[Saved]] = SavedConditioned
    conditional: ClassVar[bool] = True
    name: ClassVar[str]
    heading: ClassVar[str]
    source: ClassVar[str]  # type: ignore[assignment]
    equation: ClassVar[str]  # type: ignore[assignment]
    unverified: ClassVar[str] = ""  # parts of the form that could not be checked against the publication
    basis: ClassVar[str]  # model of individual fits, from which the coefficients start
    basis_free: ClassVar[tuple[str, ...]] = ()
    limits: ClassVar[str]  # limitations, for tables

    coefficients: Mapping[str, float]  # numbers determined from the data, SI
    reference: Condition  # reference frequency, amplitude and current of powers and breaks

    @property
    def title(self) -> str:
        return self.heading

    @property
    def parameter_count(self) -> int:
        return len(self.coefficients)

    @property
    def numbers(self) -> Mapping[str, float]:
        reference = dict(zip(("I_r", "f_r", "A_r"), astuple(self.reference), strict=True))
        return {**self.coefficients, **reference}

    @classmethod
    @abstractmethod
    def start(cls, identifications: Sequence[Identification], reference: Condition) -> dict[str, float]:
        """Coefficients from the identifications of single runs."""

    @abstractmethod
    def model_at(self, condition: Condition) -> Model:
        """Return the model at a condition."""

    @classmethod
    def fit(
        cls, runs: Sequence[Run], identifications: Sequence[Identification], provenance: Mapping[str, str] | None = None
    ) -> Self:
        """Determine the coefficients from runs of one rig and their identifications with `basis`.

        Raises `IdentificationError` if there are fewer than three runs or the identifications are of another model.
        """
        return cls.regressed(identifications, provenance).refined(runs)

    @classmethod
    def regressed(cls, identifications: Sequence[Identification], provenance: Mapping[str, str] | None = None) -> Self:
        """Return the damper from the identifications alone."""
        if len(identifications) < 3:
            raise IdentificationError(
                counted(len(identifications), "identification"),
                where=cls.heading,
                remedy="give runs at three conditions or more",
            )
        if {i.model.name for i in identifications} != {cls.basis}:
            raise IdentificationError(
                "identifications of another model", where=cls.heading, remedy=f"identify with model {cls.basis}"
            )
        conditions = [i.condition for i in identifications]
        reference = _middle(conditions)
        envelope, about = Envelope.of(conditions), dict(provenance or {})
        start = cls.start(identifications, reference)
        return cls(start, reference, rig=identifications[0].rig, envelope=envelope, provenance=about)

    def refined(self, runs: Sequence[Run]) -> Self:
        """Refine all coefficients on the last cycle of every run at once, each by its own force scale."""
        pieces = Pieces(runs)
        names = list(self.coefficients)
        begin = np.array([self.coefficients[name] for name in names])
        size = np.maximum(np.abs(begin), 1e-3)
        lower, upper = (begin / size + end for end in (-_COEFFICIENT_RANGE, _COEFFICIENT_RANGE))

        def damper(u: Floats) -> Self:
            return replace(self, coefficients=dict(zip(names, (u * size).tolist(), strict=True)))

        def residual(u: Floats) -> Floats:
            return pieces.residual(damper(u))

        def slopes(u: Floats) -> Floats:
            exact = pieces.slopes(damper(u))
            return forward_differences(residual, u, residual(u), lower, upper) if exact is None else exact * size

        solution = least_squares(residual, begin / size, lower, upper, most_steps=_MAX_STEPS, slopes=slopes)
        ended = np.abs(solution.point - begin / size) > (1 - 1e-6) * _COEFFICIENT_RANGE
        at_bounds = [name for name, at_bound in zip(names, ended, strict=True) if at_bound]
        return damper(solution.point).stating_bounds(at_bounds)

    def stating_bounds(self, names: Sequence[str]) -> Self:
        """Return the damper whose provenance names the coefficients that ended at a bound of the search."""
        return replace(self, provenance={**self.provenance, AT_BOUNDS: ", ".join(names)}) if names else self

    @property
    def fitted_parameters(self) -> Mapping[str, FittedParameter]:
        return {
            name: FittedParameter(value, exponent=float(name.endswith(_LOGARITHM)))
            for name, value in self.coefficients.items()
        }

    def with_parameters(self, values: Mapping[str, float]) -> Self:
        return replace(self, coefficients={**self.coefficients, **values})

    def to_saved(self) -> SavedConditioned:
        own = {f.name: getattr(self, f.name) for f in fields(self)}
        tables = {name: value.tolist() for name, value in own.items() if isinstance(value, np.ndarray)}
        return SavedConditioned(self.name, dict(self.coefficients), astuple(self.reference), tables)

    @classmethod
    def from_saved(cls, saved: SavedConditioned, **shared: Any) -> Self:
        from mrdamper.dampers.published import conditioned_type  # imports every file, including this one

        kind = conditioned_type(saved.model)
        reference = Condition(*saved.reference)
        tables = {name: np.array(table) for name, table in saved.tables.items()}
        try:
            damper = kind(saved.coefficients, reference, **tables, **shared)
            damper.force_along(sine(reference, 1, 8), reference)
            for condition in damper.envelope.corners:
                damper.force_along(sine(condition, 1, 8), condition)
        except (KeyError, TypeError, ValueError, IndexError, ArithmeticError) as error:
            raise ParameterError(
                f"coefficients do not fit the model: {error}", remedy="write the model again"
            ) from error
        return damper  # type: ignore[return-value]


def quadratic(current: float, coefficients: Mapping[str, float], name: str) -> float:
    """name0 + name1 I + name2 I²."""
    return coefficients[f"{name}0"] + current * (coefficients[f"{name}1"] + current * coefficients[f"{name}2"])


def powers_of_motion(conditions: Sequence[Condition], reference: Condition, logarithms: Floats) -> tuple[float, float]:
    """Powers of amplitude and frequency in values, from their logarithms, with a level for every current."""
    currents = np.array([c.current_A for c in conditions])
    amplitude = np.log([c.amplitude_m / reference.amplitude_m for c in conditions])
    frequency = np.log([c.frequency_Hz / reference.frequency_Hz for c in conditions])
    levels = [np.isclose(currents, level, atol=2e-3) for level in np.unique(np.round(currents, 3))]
    p, q = np.linalg.lstsq(np.column_stack([amplitude, frequency, *levels]), logarithms, rcond=1e-6)[0][:2].tolist()
    return p, q


def scale_of_motion(condition: Condition, reference: Condition, p: float, q: float) -> float:
    """(A/A_r)^p (f/f_r)^q."""
    return (condition.amplitude_m / reference.amplitude_m) ** p * (condition.frequency_Hz / reference.frequency_Hz) ** q


def fit_quadratic(name: str, currents: Floats, values: Floats) -> dict[str, float]:
    """Coefficients of `quadratic` by least squares; as many as the distinct currents allow, the rest zero."""
    terms = min(3, len(np.unique(np.round(currents, 3))))
    table = np.vander(currents, terms, increasing=True)
    solution = np.linalg.lstsq(table, values, rcond=None)[0]
    return {f"{name}{i}": float(solution[i]) if i < terms else 0.0 for i in range(3)}


def _middle(conditions: Sequence[Condition]) -> Condition:
    """Geometric middle of the motions; the lowest current that is not zero."""
    positive = sorted({round(c.current_A, 3) for c in conditions if c.current_A > 1e-3})
    return Condition(
        positive[0] if positive else 1.0,
        float(np.exp(np.mean([np.log(c.frequency_Hz) for c in conditions]))),
        float(np.exp(np.mean([np.log(c.amplitude_m) for c in conditions]))),
    )
