"""Parameters as functions of current, frequency and amplitude: p(I, f, A).

A form is a sum of terms, each a product of powers and decaying exponentials of the three
features. Its coefficients are linear and solved for; at most two rates inside exponentials
or powers are searched, bounded, from many starts. Logarithmic parameters (the yield
displacement spans decades) are fitted in the logarithm and stay positive.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from mrdamper.data import Condition, Floats
from mrdamper.errors import IdentificationError, UnknownNameError
from mrdamper.models import Model
from mrdamper.optimizers.levenberg_marquardt import least_squares

_RANK_LIMIT = 1e-7  # singular values below this share of the largest: the tests cannot tell the terms apart


@dataclass(frozen=True, slots=True)
class Term:
    """I^current · f^frequency · A^amplitude, times exponentials or a power with searched rates.

    `decay_I`, `decay_f` and `power_f` name the rate (0 or 1) in exp(−rate I), exp(−rate f)
    and f^(−rate).
    """

    current: int = 0
    frequency: int = 0
    amplitude: int = 0
    decay_I: int | None = None
    decay_f: int | None = None
    power_f: int | None = None

    def __call__(self, I: Floats, f: Floats, A: Floats, rates: Sequence[float]) -> Floats:
        value = I**self.current * f**self.frequency * A**self.amplitude
        if self.decay_I is not None:
            value = value * np.exp(-rates[self.decay_I] * I)
        if self.decay_f is not None:
            value = value * np.exp(-rates[self.decay_f] * f)
        if self.power_f is not None:
            value = value * f ** -rates[self.power_f]
        return value

    def label(self, rates: Sequence[float]) -> str:
        """The term as text, with its rates filled in."""
        powers = {"I": self.current, "f": self.frequency, "A": self.amplitude}
        factors = [name if power == 1 else f"{name}^{power}" for name, power in powers.items() if power]
        if self.decay_I is not None:
            factors.append(f"exp(-{rates[self.decay_I]:.4g} I)")
        if self.decay_f is not None:
            factors.append(f"exp(-{rates[self.decay_f]:.4g} f)")
        if self.power_f is not None:
            factors.append(f"f^-{rates[self.power_f]:.4g}")
        return " ".join(factors)


@dataclass(frozen=True, slots=True)
class Form:
    """A family of parameter functions.

    Attributes
    ----------
    name : str
    terms : tuple of Term
    rate_bounds : tuple of (float, float)
        Limits of the searched rates.
    source : str
        Equation it comes from.
    """

    name: str
    terms: tuple[Term, ...]
    rate_bounds: tuple[tuple[float, float], ...] = ()
    source: str = ""

    def columns(self, I: Floats, f: Floats, A: Floats, rates: Sequence[float]) -> Floats:
        """(N, terms) array of the terms."""
        return np.column_stack([term(I, f, A, rates) for term in self.terms])


_ONE, _I, _I2 = Term(), Term(current=1), Term(current=2)
_SPEED = Term(frequency=1, amplitude=1)  # f A, the peak velocity over 2π
_SPEED2 = Term(frequency=2, amplitude=2)

FORMS: Mapping[str, Form] = MappingProxyType(
    {
        form.name: form
        for form in (
            Form("constant", (_ONE,)),
            Form("linear-current", (_I, _ONE)),
            Form("quadratic-current", (_I2, _I, _ONE), source="Qian et al. 2024, Eq. 23, 27, 32"),
            Form("saturating-current", (_I, Term(current=1, decay_I=0), _ONE), ((0.5, 30.0),)),
            Form("decaying-current", (Term(decay_I=0), _ONE), ((0.2, 30.0),), "Qian et al. 2024, Eq. 37"),
            Form("linear-current-speed", (_I, _SPEED, _ONE)),
            Form("quadratic-current-linear-speed", (_I2, _I, _SPEED, _ONE)),
            Form("quadratic-current-speed", (_I2, _I, _SPEED2, _SPEED, _ONE), source="Qian et al. 2024, Eq. 24–25"),
            Form(
                "viscous-paper",
                tuple(Term(t.current, t.frequency - 1, t.amplitude - 1) for t in (_I2, _I, _SPEED2, _SPEED, _ONE)),
                source="Qian et al. 2024, Eq. 26",
            ),
            Form(
                "mass-exponential",
                (_I2, _I, Term(decay_f=0), _ONE),
                ((0.05, 20.0),),
                "Qian et al. 2024, Eq. 28–31, exponential reading of (29)",
            ),
            Form(
                "mass-power",
                (_I2, _I, Term(power_f=0), _ONE),
                ((0.1, 6.0),),
                "Qian et al. 2024, Eq. 28–31, power reading of (29)",
            ),
            Form(
                "mass-inverse-square",
                (_I2, _I, Term(frequency=-2), _ONE),
                source="Qian et al. 2024, Eq. 28–31, with the law harmonic balance implies",
            ),
            Form(
                "plane",
                (_I2, _I, Term(frequency=1), Term(amplitude=1), _ONE),
                source="Qian et al. 2024, Eq. 33–36",
            ),
            Form(
                "current-decay-frequency",
                (Term(decay_I=0, decay_f=1), Term(decay_I=0), _ONE),
                ((0.2, 30.0), (0.05, 20.0)),
                "Qian et al. 2024, Eq. 37–40",
            ),
        )
    }
)


@dataclass(frozen=True)
class ParameterFunction:
    """p(I, f, A) with its coefficients.

    Attributes
    ----------
    form : str
        Name of the form.
    coefficients, rates : tuple of float
        In the order of the form's terms and rate bounds; SI with I in A, f in Hz, A in m.
    log : bool
        The form gives the logarithm of the parameter.
    """

    form: str
    coefficients: tuple[float, ...]
    rates: tuple[float, ...] = ()
    log: bool = False

    def __post_init__(self) -> None:
        form = form_named(self.form)
        if len(self.coefficients) != len(form.terms) or len(self.rates) != len(form.rate_bounds):
            raise IdentificationError(
                f"form {self.form} with {len(self.coefficients)} coefficients and {len(self.rates)} rates",
                mend=f"it takes {len(form.terms)} and {len(form.rate_bounds)}",
            )

    def __call__(self, current: ArrayLike, frequency: ArrayLike, amplitude: ArrayLike) -> Floats:
        """Parameter at currents [A], frequencies [Hz] and amplitudes [m], broadcast together."""
        I, f, A = np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in (current, frequency, amplitude)))
        columns = form_named(self.form).columns(I.ravel(), f.ravel(), A.ravel(), self.rates)
        value = (columns @ np.array(self.coefficients)).reshape(I.shape)
        return np.exp(value) if self.log else value

    @property
    def formula(self) -> str:
        """The function as text."""
        terms = zip(self.coefficients, form_named(self.form).terms, strict=True)
        text = " ".join(f"{value:+.4g} {term.label(self.rates)}".strip() for value, term in terms).lstrip("+")
        return f"exp({text})" if self.log else text

    def turning_point(self, highest_current: float, frequency: float, amplitude: float) -> float | None:
        """Current [A] within 0...1.5 × the highest at which the parameter turns over, if any."""
        currents = np.linspace(0, 1.5 * highest_current, 601)
        slope = np.sign(np.diff(self(currents, frequency, amplitude)))
        turns = np.flatnonzero(slope[1:] * slope[:-1] < 0)
        return float(currents[turns[0] + 1]) if turns.size else None


def form_named(name: str) -> Form:
    """The form of that name.

    Raises
    ------
    UnknownNameError
        With the near matches.
    """
    if name not in FORMS:
        raise UnknownNameError.of("parameter function", name, FORMS)
    return FORMS[name]


@dataclass(frozen=True)
class FunctionFit:
    """A fitted parameter function and how well it describes the identified values.

    Attributes
    ----------
    function : ParameterFunction
    r2 : float
        Share of the variance it explains (in the logarithm, where the parameter is logarithmic).
    left_out : float
        RMS error at a condition left out of the fit, over the parameter's spread: under 1 the
        function knows more than the mean does.
    """

    function: ParameterFunction
    r2: float
    left_out: float


def fit_function(
    form: str | Form,
    conditions: Sequence[Condition],
    values: ArrayLike,
    *,
    log: bool = False,
    uncertainty: ArrayLike | None = None,
) -> FunctionFit:
    """Fit one form to a parameter's identified values.

    Parameters
    ----------
    form : str or Form
    conditions : sequence of Condition, length N
    values : (N,) array
        Identified values of the parameter.
    log : bool
        Fit the logarithm.
    uncertainty : (N,) array, optional
        Standard errors of the values (of the logarithm, with `log`): certain values count more,
        up to those of the most certain quarter.

    Raises
    ------
    IdentificationError
        If the conditions cannot tell the form's terms apart: too few currents, frequencies or
        amplitudes.
    """
    chosen = form_named(form) if isinstance(form, str) else form
    I, f, A = features(conditions)
    target = np.asarray(values, dtype=float)
    if log:
        target = np.log(target)
    if target.size < len(chosen.terms) + len(chosen.rate_bounds):
        raise _undetermined(chosen, f"{target.size} conditions", I, f, A)
    weight = _weights(uncertainty, target)
    rates = _best_rates(chosen, I, f, A, target, weight)
    columns = chosen.columns(I, f, A, rates)
    if not _determined(columns):
        raise _undetermined(chosen, "they do not tell its terms apart", I, f, A)
    coefficients = _solve(columns * weight[:, None], target * weight)
    cost = float(np.sum((columns @ coefficients - target) ** 2))
    spread = float(np.sum((target - target.mean()) ** 2))
    function = ParameterFunction(chosen.name, tuple(coefficients.tolist()), tuple(float(r) for r in rates), log)
    return FunctionFit(
        function,
        r2=1.0 - cost / spread if spread > 0 else 1.0,
        left_out=_left_out(columns, target, weight, len(rates)) / (np.sqrt(spread / target.size) or 1.0),
    )


def assess(function: ParameterFunction, conditions: Sequence[Condition], values: ArrayLike) -> FunctionFit:
    """How a function found otherwise, by a joint fit, describes values identified run by run."""
    target, found = np.asarray(values, dtype=float), function(*features(conditions))
    if function.log:
        target, found = np.log(target), np.log(found)
    spread = float(np.sum((target - target.mean()) ** 2))
    return FunctionFit(function, 1.0 - float(np.sum((found - target) ** 2)) / spread if spread else 1.0, float("nan"))


def choose_function(
    forms: Iterable[str],
    conditions: Sequence[Condition],
    values: ArrayLike,
    *,
    log: bool = False,
    uncertainty: ArrayLike | None = None,
) -> FunctionFit:
    """The form that predicts left-out conditions best; a longer one must win by a tenth.

    Parameters are those of `fit_function`; forms the conditions cannot determine are passed
    over.

    Raises
    ------
    IdentificationError
        If they can determine none.
    """
    best: FunctionFit | None = None
    refusal: IdentificationError | None = None
    for form in sorted((form_named(name) for name in forms), key=lambda f: len(f.terms) + len(f.rate_bounds)):
        try:
            fit = fit_function(form, conditions, values, log=log, uncertainty=uncertainty)
        except IdentificationError as error:
            refusal = error
            continue
        if best is None or fit.left_out < 0.9 * best.left_out:
            best = fit
    if best is None:
        raise refusal or IdentificationError("no form to choose from", mend="name at least one")
    return best


@dataclass(frozen=True, eq=False)
class ParameterMap:
    """A model type with one function per parameter: the modified model.

    Attributes
    ----------
    model_type : type of Model
    functions : mapping of str to ParameterFunction
        By parameter, or by a coordinate the model can be built from.
    """

    model_type: type[Model]
    functions: Mapping[str, ParameterFunction]

    def __post_init__(self) -> None:
        object.__setattr__(self, "functions", dict(self.functions))

    def at(self, condition: Condition) -> Model:
        """The model at a condition; values a function drives past a parameter's bounds stop there."""
        point = (condition.current_A, condition.frequency_Hz, condition.amplitude_m)
        bounds = {info.name: info.bounds for info in self.model_type.parameters()}
        values = {}
        for name, function in self.functions.items():
            low, high = bounds.get(name, (-np.inf, np.inf))
            values[name] = float(np.clip(function(*point), low, high))
        return self.model_type.build(values)

    @property
    def parameter_count(self) -> int:
        """Coefficients and rates over all functions."""
        return sum(len(f.coefficients) + len(f.rates) for f in self.functions.values())


def features(conditions: Sequence[Condition]) -> tuple[Floats, Floats, Floats]:
    """Currents [A], frequencies [Hz] and amplitudes [m] of conditions as arrays."""
    table = np.array([(c.current_A, c.frequency_Hz, c.amplitude_m) for c in conditions], dtype=float)
    return table[:, 0], table[:, 1], table[:, 2]


def _best_rates(
    form: Form,
    I: Floats,
    f: Floats,
    A: Floats,
    target: Floats,
    weight: Floats,
) -> tuple[float, ...]:
    """Search the rates in their logarithm: a grid, then refinement from its three best points."""
    if not form.rate_bounds:
        return ()
    bounds = np.log(np.array(form.rate_bounds))

    def residual(u: Floats) -> Floats:
        columns = form.columns(I, f, A, tuple(np.exp(u))) * weight[:, None]
        return columns @ _solve(columns, target * weight) - target * weight

    grid = [np.array(u) for u in product(*(np.linspace(low, high, 6) for low, high in bounds))]
    grid.sort(key=lambda u: float(np.sum(residual(u) ** 2)))
    found = [least_squares(residual, u, bounds[:, 0], bounds[:, 1], most_steps=15) for u in grid[:3]]
    best = min(found, key=lambda minimum: minimum.cost)
    return tuple(np.exp(best.point).tolist())


def _solve(columns: Floats, target: Floats) -> Floats:
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0] = 1.0
    return np.linalg.lstsq(columns / scale, target, rcond=None)[0] / scale


def _determined(columns: Floats) -> bool:
    scale = np.linalg.norm(columns, axis=0)
    if np.any(scale == 0):
        return False
    singular = np.linalg.svd(columns / scale, compute_uv=False)
    return columns.shape[0] >= columns.shape[1] and bool(singular[-1] > _RANK_LIMIT * singular[0])


def require_determined(form: str, conditions: Sequence[Condition]) -> None:
    """Refuse a form without rates whose terms the conditions cannot tell apart.

    Raises
    ------
    IdentificationError
        Also where the form has rates, which only a fit can settle.
    """
    chosen = form_named(form)
    I, f, A = features(conditions)
    if chosen.rate_bounds:
        raise IdentificationError(f"{form} has rates to search", mend="choose a form without")
    if len(conditions) < len(chosen.terms) or not _determined(chosen.columns(I, f, A, ())):
        raise _undetermined(chosen, f"{len(conditions)} conditions do not tell its terms apart", I, f, A)


def _left_out(columns: Floats, target: Floats, weight: Floats, rates: int) -> float:
    """Weighted RMS of leave-one-out errors, exact for the linear part through the hat matrix."""
    weighted = columns * weight[:, None]
    q, _ = np.linalg.qr(weighted / np.linalg.norm(weighted, axis=0))
    leverage = np.sum(q**2, axis=1)
    residual = target * weight - q @ (q.T @ (target * weight))
    spare = np.maximum(1.0 - leverage, 1e-9)
    penalty = target.size / max(target.size - rates, 1)
    return float(np.sqrt(np.sum((residual / spare) ** 2) / np.sum(weight**2)) * penalty)


def _weights(uncertainty: ArrayLike | None, target: Floats) -> Floats:
    if uncertainty is None:
        return np.ones(target.size)
    errors = np.asarray(uncertainty, dtype=float)
    known = errors[np.isfinite(errors)]
    if not known.size:
        return np.ones(target.size)
    floor = float(np.quantile(known, 0.25)) or 1.0
    return floor / np.maximum(np.where(np.isfinite(errors), errors, known.max()), floor)


def _undetermined(form: Form, found: str, I: Floats, f: Floats, A: Floats) -> IdentificationError:
    levels = [len(np.unique(np.round(column, 3))) for column in (I, f, 1e3 * A)]
    return IdentificationError(
        f"{form.name} has {len(form.terms) + len(form.rate_bounds)} coefficients and {found}: "
        f"{levels[0]} currents, {levels[1]} frequencies, {levels[2]} amplitudes",
        mend="test more conditions or choose a shorter form",
    )
