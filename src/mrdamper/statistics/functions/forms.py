"""Parameters as functions of current, frequency and amplitude: p(I, f, A).

A form is a sum of terms, each a product of powers and decaying exponentials of the three
features. Its coefficients are linear and solved for; at most two rates inside exponentials
or powers are searched, bounded, from many starts. Logarithmic parameters (the yield displacement spans decades)
are fitted in the logarithm and stay positive.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from mrdamper.data.arrays import Floats
from mrdamper.data.conditions import Condition
from mrdamper.data.wording import number
from mrdamper.errors import IdentificationError, UnknownNameError
from mrdamper.tracing import Expression


@dataclass(frozen=True, slots=True)
class Term:
    """I^current · f^frequency · A^amplitude, times exponentials or a power with searched rates.

    `decay_I`, `decay_f` and `power_f` name the rate (0 or 1) in exp(−rate I), exp(−rate f)
    and f^(−rate), `onset_I` that in (1 + rate I) exp(−rate I), whose slope is zero at 0 A.
    """

    current: int = 0
    frequency: int = 0
    amplitude: int = 0
    decay_I: int | None = None
    onset_I: int | None = None
    decay_f: int | None = None
    power_f: int | None = None

    @property
    def follows_motion(self) -> bool:
        """True if it depends on the frequency or the amplitude."""
        return bool(self.frequency or self.amplitude) or self.decay_f is not None or self.power_f is not None

    def __call__(self, I: Floats, f: Floats, A: Floats, rates: Sequence[float]) -> Floats:
        value = I**self.current * f**self.frequency * A**self.amplitude
        if self.decay_I is not None:
            value = value * np.exp(-rates[self.decay_I] * I)
        if self.onset_I is not None:
            value = value * (1 + rates[self.onset_I] * I) * np.exp(-rates[self.onset_I] * I)
        if self.decay_f is not None:
            value = value * np.exp(-rates[self.decay_f] * f)
        if self.power_f is not None:
            value = value * f ** -rates[self.power_f]
        return value

    def unit(self, of: str, rates: Sequence[float]) -> str:
        """Write the unit of the coefficient of the term in a function of that unit."""
        power = self.frequency - (0 if self.power_f is None else rates[self.power_f])
        powers = {"A": self.current, "Hz": power, "m": self.amplitude}
        sized = {name: name if abs(p) == 1 else f"{name}^{number(abs(p), 3)}" for name, p in powers.items() if p}
        times = [text for name, text in sized.items() if powers[name] < 0]
        over = "".join(f"/{text}" for name, text in sized.items() if powers[name] > 0)
        return (" ".join([*times, *({of} - {"-"})]) or ("1" if over else "-")) + over

    def label(self, rates: Sequence[float]) -> str:
        """Write the term as text, with its rates filled in."""
        powers = {"I": self.current, "f": self.frequency, "A": self.amplitude}
        factors = [name if power == 1 else f"{name}^{power}" for name, power in powers.items() if power]
        if self.decay_I is not None:
            factors.append(f"exp(-{number(rates[self.decay_I])} I)")
        if self.onset_I is not None:
            factors.append(f"(1 + {number(rates[self.onset_I])} I) exp(-{number(rates[self.onset_I])} I)")
        if self.decay_f is not None:
            factors.append(f"exp(-{number(rates[self.decay_f])} f)")
        if self.power_f is not None:
            factors.append(f"f^-{number(rates[self.power_f])}")
        return " ".join(factors)


@dataclass(frozen=True, slots=True)
class Form:
    """A family of parameter functions."""

    name: str
    terms: tuple[Term, ...]
    rate_bounds: tuple[tuple[float, float], ...] = ()  # limits of the searched rates
    source: str = ""  # equation it comes from

    @property
    def current_terms(self) -> int:
        """Parameters over the current, including the constant."""
        terms = [term for term in self.terms if not term.follows_motion]
        return len(terms) + len({rate for term in terms for rate in (term.decay_I, term.onset_I)} - {None})

    @property
    def motion_terms(self) -> int:
        """Parameters over frequency and amplitude."""
        return len(self.terms) + len(self.rate_bounds) - self.current_terms

    @property
    def follows_motion(self) -> bool:
        """True if it depends on the frequency or the amplitude."""
        return any(term.follows_motion for term in self.terms)

    def columns(self, I: Floats, f: Floats, A: Floats, rates: Sequence[float]) -> Floats:
        """(N, terms) array of the terms."""
        return np.column_stack([term(I, f, A, rates) for term in self.terms]) if self.terms else np.empty((I.size, 0))

    def slopes(self, columns: Floats, I: Floats, f: Floats, rates: Sequence[float]) -> Floats:
        """(rates, N, terms) derivatives of the columns by the logarithm of each rate."""
        by = np.zeros((len(rates), *columns.shape))
        for j, term in enumerate(self.terms):
            for rate, feature in ((term.decay_I, I), (term.decay_f, f), (term.power_f, np.log(f))):
                if rate is not None:
                    by[rate, :, j] -= rates[rate] * feature * columns[:, j]
            if term.onset_I is not None:
                by[term.onset_I, :, j] -= (rates[term.onset_I] * I) ** 2 / (1 + rates[term.onset_I] * I) * columns[:, j]
        return by


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
            Form("onset-current", (Term(onset_I=0), _ONE), ((0.2, 30.0),)),
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
            Form("plane", (_I2, _I, Term(frequency=1), Term(amplitude=1), _ONE), source="Qian et al. 2024, Eq. 33–36"),
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
    """p(I, f, A) with its coefficients."""

    form: str  # name of the form
    # coefficients and rates: in the order of the form's terms and rate bounds; SI with I in A, f in Hz, A in m
    coefficients: tuple[float, ...]
    rates: tuple[float, ...] = ()
    log: bool = False  # the form gives the logarithm of the parameter

    def __post_init__(self) -> None:
        form = form_named(self.form)
        if len(self.coefficients) != len(form.terms) or len(self.rates) != len(form.rate_bounds):
            raise IdentificationError(
                f"form {self.form} with {len(self.coefficients)} coefficients and {len(self.rates)} rates",
                remedy=f"it takes {len(form.terms)} and {len(form.rate_bounds)}",
            )

    def __call__(self, current: Any, frequency: Any, amplitude: Any) -> Any:
        """Parameter at currents [A], frequencies [Hz] and amplitudes [m], broadcast together."""
        point = (_numbers(current), _numbers(frequency), _numbers(amplitude))
        value: Any = 0.0
        for coefficient, term in zip(self.coefficients, form_named(self.form).terms, strict=True):
            value = value + coefficient * term(*point, self.rates)
        if not self.log:
            return value
        with np.errstate(over="ignore"):  # infinite far outside the tests
            return np.exp(value)

    @property
    def formula(self) -> str:
        """The function as text."""
        terms = zip(self.coefficients, form_named(self.form).terms, strict=True)
        text = " + ".join(f"{number(value)} {term.label(self.rates)}".strip() for value, term in terms)
        text = text.replace("+ -", "- ")
        return f"exp({text})" if self.log else text

    def units(self, unit: str) -> list[str]:
        """Write the units of the coefficients and rates, for a parameter of that unit."""
        terms = form_named(self.form).terms
        constant, of = ("-" if unit == "-" else f"ln({unit})", "-") if self.log else (unit, unit)
        named = (
            {t.decay_I: "1/A" for t in terms}
            | {t.onset_I: "1/A" for t in terms}
            | {t.decay_f: "1/Hz" for t in terms}
            | {t.power_f: "-" for t in terms}
        )
        return [constant if t == _ONE else t.unit(of, self.rates) for t in terms] + [
            named[i] for i in range(len(self.rates))
        ]

    def turning_point(self, highest_current: float, frequency: float, amplitude: float) -> float | None:
        """Find the current [A] within 0...1.5 × the highest at which the parameter has an extremum, if any."""
        currents = np.linspace(0, 1.5 * highest_current, 601)
        slope = np.sign(np.diff(self(currents, frequency, amplitude)))
        turned = np.flatnonzero(slope * slope[0] < 0)
        return float(currents[turned[0]]) if turned.size else None


def _numbers(value: Any) -> Any:
    if isinstance(value, Expression):
        return value
    return np.float64(value) if isinstance(value, float) else np.asarray(value, dtype=float)


def form_named(name: str) -> Form:
    """Return the form of that name; raises `UnknownNameError` with the near matches."""
    if name not in FORMS:
        raise UnknownNameError.of("parameter function", name, FORMS)
    return FORMS[name]


def features(conditions: Sequence[Condition]) -> tuple[Floats, Floats, Floats]:
    """Currents [A], frequencies [Hz] and amplitudes [m] of conditions as arrays."""
    table = np.array([(c.current_A, c.frequency_Hz, c.amplitude_m) for c in conditions], dtype=float)
    return table[:, 0], table[:, 1], table[:, 2]
