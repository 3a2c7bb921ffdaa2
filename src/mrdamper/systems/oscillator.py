"""Simulation and identification of a mass on a spring, a viscous damper and a hysteretic element, driven by a force.

m y'' + c y' + k y + z = u, dz/dt = alpha v − beta (gamma |v| |z|^(n−1) z + delta v |z|^n), v = y'.

The input is the force and the output the displacement, as in the benchmark of [Noël and Schoukens 2016, "Hysteretic
benchmark with a dynamic nonlinearity"; recalled]. Here z is a force without bound if beta (gamma + delta) < 0 (a
stiffening spring); energy is dissipated if beta gamma >= 0. The dampers of `mrdamper.models` are driven by their motion
instead and need a bounded z.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cache

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.wording import number
from mrdamper.errors import ParameterError, RecordError, StepError
from mrdamper.statistics.levenberg_marquardt import least_squares
from mrdamper.tracing import Tape, program
from mrdamper.tracing.compiled import RecordProgram

_STEPS = 20  # steps between two samples, by Runge and Kutta's fourth order
_SEARCH_STEPS = 5  # the same in the first part of a search
_LEAD = 0.5  # share of a period that is simulated before for the transient
_WIDENED = 3  # number of times that a bound of the search is widened
_FARTHEST = 1e6  # times the static deflection, beyond which the state diverges


@dataclass(frozen=True)
class Oscillator:
    """A force-driven mass with a Bouc–Wen element.

    Raises `ParameterError` if the mass is not positive, the element generates energy (beta gamma < 0), or n is below 1.
    """

    # m, c, k: mass [kg], damping [N s/m], stiffness [N/m]
    m: float
    c: float
    k: float
    alpha: float  # stiffness of the hysteretic element at zero force [N/m]
    # beta, gamma, delta: beta [N^(1−n)/m] scales gamma, of |v|, and delta, of v [-]; only their products count
    beta: float
    gamma: float
    delta: float
    n: float = 1.0  # sharpness of the yield [-]

    def __post_init__(self) -> None:
        for name, good, remedy in (
            ("m", 0 < self.m < np.inf, "a mass is positive"),
            ("gamma", self.beta * self.gamma >= 0, "beta gamma >= 0, or the element feeds energy in"),
            ("n", 1 <= self.n <= 20, "n lies between 1 and 20"),
            ("k", np.isfinite([self.c, self.k, self.alpha, self.beta, self.delta]).all(), "give finite numbers"),
        ):
            if not good:
                raise ParameterError(f"{name} = {getattr(self, name):g}", where="oscillator", remedy=remedy)

    def response(self, force: Floats, sample_rate: float, *, periodic: bool = False, steps: int = _STEPS) -> Floats:
        """Return the displacement [m] under a force (N,) [N], from rest; of a periodic force, over one steady period.

        The force is sampled at `sample_rate` [Hz], band-limited between samples where it is periodic, else smooth, and
        integrated in so many steps between two samples.
        Raises `RecordError` if it is no record of numbers, and `StepError` (E_RUNAWAY) if the state diverges.
        """
        force = np.asarray(force, dtype=float)
        if force.ndim != 1 or force.size < 8 or not np.isfinite(force).all():
            raise RecordError("a force of under 8 samples, or not finite", remedy="give an (N,) array of forces [N]")
        fine = _refined(force, 2 * steps, periodic)
        lead = 2 * steps * int(_LEAD * force.size) if periodic else 0
        fine = np.concatenate([fine[-1 - lead : -1], fine])
        record = _march(self.n == 1)
        given = (
            1 / (steps * sample_rate), self.m, self.c, self.k, self.alpha,
            self.beta * self.gamma, self.beta * self.delta, self.n,
        )  # fmt: skip
        derived = record.prepare(given)
        assert derived is not None
        states = record.along(given, derived, record.starts, (fine[:-2:2], fine[1:-1:2], fine[2::2]))
        farthest = _FARTHEST * (np.abs(force).max() / self.k + 1e-9)
        y = np.concatenate([[0.0], states.outputs[0, steps - 1 :: steps]])
        lost = ~(np.abs(y) < farthest)
        if lost.any() or states.failed >= 0:
            bad = int(np.flatnonzero(lost)[0]) if lost.any() else states.failed // steps
            raise StepError(
                f"the state runs away after {number(bad / sample_rate, 3)} s", where="oscillator",
                remedy="lower the force: an element with beta (gamma + delta) < 0 has no bound", code="E_RUNAWAY",
            )  # fmt: skip
        start = lead // (2 * steps)
        return y[start : start + force.size]


class BoundWarning(UserWarning):
    """An identified parameter lies at a bound of its search."""


@dataclass(frozen=True, eq=False)
class OscillatorFit:
    """An identified oscillator."""

    oscillator: Oscillator  # with beta = 1: only beta gamma and beta delta are identifiable
    delay_s: float  # time by which the displacement channel lags behind the force channel [s]
    rmse_m: float  # of the displacement it was identified from [m]
    evaluations: int
    at_bounds: tuple[str, ...] = ()  # parameters that ended at a bound, whose values are no estimates


def identify_oscillator(
    force: Floats, displacement: Floats, sample_rate: float, *, n: float = 1.0, most_delay: float = 3.0
) -> OscillatorFit:
    """Identify an oscillator and the delay between the channels from one period of force and displacement.

    The linear part comes from the spectra, the rest from the least squares of the simulated displacement. An unmodelled
    delay acts as negative damping: with one sample of delay the damping of a lightly damped mass ends at zero. Raises
    `RecordError` if the records do not fit together or nothing moves, or the largest delay is negative.

    `force` and `displacement` (N,) are one period, or the mean of several [N], [m], at `sample_rate` [Hz]; `n` is the
    sharpness of the yield, which is held; `most_delay` is the largest delay between the channels in either direction
    [samples], zero for simultaneous sampling. Warns with `BoundWarning` if a parameter ends at a bound.

    Examples
    --------
    >>> import numpy as np
    >>> from mrdamper.systems.oscillator import Oscillator, identify_oscillator, multisine
    >>> force = multisine(np.random.default_rng(0), 1024, 750.0, (5.0, 150.0), rms=50.0)  # [N]
    >>> truth = Oscillator(m=2.0, c=10.0, k=5e4, alpha=5e4, beta=1e3, gamma=0.8, delta=-1.1)
    >>> fit = identify_oscillator(force, truth.response(force, 750.0, periodic=True), 750.0)
    >>> round(fit.oscillator.m, 3), abs(round(750.0 * fit.delay_s, 3))  # [kg], [samples]
    (2.0, 0.0)
    """
    force, displacement = (np.asarray(a, dtype=float) for a in (force, displacement))
    if force.shape != displacement.shape or np.ptp(displacement) == 0 or not np.isfinite(displacement).all():
        raise RecordError("force and displacement differ in length, or nothing moves", remedy="give one period of both")
    if not 0 <= most_delay < np.inf:
        raise RecordError(f"the largest delay is {most_delay:g} samples", remedy="give zero or more")
    search = _OscillatorSearch(force, displacement, sample_rate, n, most_delay)
    minimum, evaluations = search.best()
    at_bounds = search.at_bounds(minimum)
    if at_bounds:
        warnings.warn(
            f"{', '.join(at_bounds)} ended at a bound of the search: check the signs and units of both channels",
            BoundWarning,
            stacklevel=2,
        )
    rmse = search.spread * float(np.linalg.norm(search.residual(minimum)))
    return OscillatorFit(search.oscillator(minimum), search.delay(minimum), rmse, evaluations, at_bounds)


class _OscillatorSearch:
    """Least squares over m, c, k, alpha, beta gamma, beta delta and the delay, each divided by its scale."""

    NAMES = ("m", "c", "k", "alpha", "gamma", "delta", "delay")

    def __init__(self, force: Floats, displacement: Floats, sample_rate: float, n: float, most_delay: float) -> None:
        self.force, self.displacement, self.sample_rate, self.n = force, displacement, sample_rate, n
        self.spread = float(np.std(displacement))
        self._steps = _SEARCH_STEPS
        self._omega = 2 * np.pi * np.fft.rfftfreq(displacement.size, 1 / sample_rate)
        m, c, k = self._linear()
        self._scale = np.array([m, max(c, 0.05 * np.sqrt(m * k)), k, k, 1 / self.spread, 1 / self.spread, 1.0])
        self._size_of_z = (0.5 * k * self.spread) ** (n - 1) if n > 1 else 1.0
        # The oscillator itself allows no mass, damping, stiffness or dissipation below zero.
        self.lower = np.array([0.2, 0.0, 0.0, 0.0, 0.0, -5.0, -most_delay])
        self.upper = np.array([5.0, 5.0, 3.0, 3.0, 5.0, 5.0, most_delay])

    def best(self) -> tuple[Floats, int]:
        """Return the point of least error, and the evaluations; bounds that only limit the search are widened."""
        starts = [np.array([1.0, 0.3, share, 1 - share, 0.3, d, 0.0]) for share in (0.5, 0.2) for d in (0.0, -0.5)]
        minima = [least_squares(self.residual, start, self.lower, self.upper, 8, 1e-4) for start in starts]
        evaluations = sum(minimum.evaluations for minimum in minima)
        point = min(minima, key=lambda minimum: minimum.cost).point
        for _ in range(_WIDENED + 1):
            last = least_squares(self.residual, point, self.lower, self.upper, 60, 1e-10)
            point, evaluations = last.point, evaluations + last.evaluations
            wide = self._near(point, self.upper) & (np.array(self.NAMES) != "delay")
            narrow = self._near(point, self.lower) & np.isin(self.NAMES, ("m", "delta"))
            if not (wide.any() or narrow.any()):
                break
            self.upper[wide] *= 5
            self.lower[narrow] = np.where(self.lower[narrow] > 0, self.lower[narrow] / 5, self.lower[narrow] * 5)
        self._steps = _STEPS
        last = least_squares(self.residual, point, self.lower, self.upper, 60, 1e-10)
        return last.point, evaluations + last.evaluations

    def at_bounds(self, point: Floats) -> tuple[str, ...]:
        """Names of the parameters at a bound."""
        near = (self._near(point, self.lower) | self._near(point, self.upper)) & (self.lower < self.upper)
        return tuple(name for name, is_near in zip(self.NAMES, near, strict=True) if is_near)

    def oscillator(self, point: Floats) -> Oscillator:
        """Return the oscillator of a point."""
        m, c, k, alpha, gamma, delta, _ = (point * self._scale).tolist()
        return Oscillator(m, c, k, alpha, 1.0, gamma / self._size_of_z, delta / self._size_of_z, self.n)

    def delay(self, point: Floats) -> float:
        """Return the delay of a point [s]."""
        return float(point[-1]) / self.sample_rate

    def residual(self, point: Floats) -> Floats:
        """(N,) error of the displacement over its spread and the root of its samples."""
        size = self.displacement.size
        try:
            response = self.oscillator(point).response(self.force, self.sample_rate, periodic=True, steps=self._steps)
        except StepError:
            return np.full(size, 1e3)
        late = np.fft.irfft(np.fft.rfft(response) * np.exp(-1j * self._omega * self.delay(point)), size)
        return (late - self.displacement) / (self.spread * np.sqrt(size))

    def _linear(self) -> Floats:
        """Mass, damping and stiffness of the linear oscillator nearest to the spectra."""
        U, Y = np.fft.rfft(self.force), np.fft.rfft(self.displacement)
        excited = np.abs(U) > 1e-3 * np.abs(U).max()
        columns = [-(self._omega**2), 1j * self._omega, np.ones(self._omega.size)]
        table = (np.stack(columns, axis=1) * Y[:, None])[excited]
        forces = np.append(U[excited].real, U[excited].imag)
        linear = np.linalg.lstsq(np.vstack([table.real, table.imag]), forces, rcond=None)[0]
        return np.maximum(linear, 1e-6 * abs(linear[0]))

    @staticmethod
    def _near(point: Floats, bound: Floats) -> np.ndarray:
        return np.abs(point - bound) < 1e-6 * np.maximum(1.0, np.abs(bound))


def multisine(
    rng: np.random.Generator, size: int, sample_rate: float, band_Hz: tuple[float, float], rms: float
) -> Floats:
    """(size,) one period of a multisine with random phases and a flat spectrum over a band; RMS as its unit."""
    frequency = np.fft.rfftfreq(size, 1 / sample_rate)
    inside = (frequency >= band_Hz[0]) & (frequency <= band_Hz[1])
    wave = np.fft.irfft(inside * np.exp(2j * np.pi * rng.uniform(size=frequency.size)), size)
    return wave * rms / float(np.std(wave))


def _refined(force: Floats, times: int, periodic: bool) -> Floats:
    """Interpolate the force at `times` as many places, the last sample included; then the first of the next period."""
    if periodic:
        from scipy.signal import resample

        fine = np.asarray(resample(force, times * force.size))
        return np.append(fine, fine[0])
    from scipy.interpolate import CubicSpline

    places = np.arange((force.size - 1) * times + 1) / times
    return np.asarray(CubicSpline(np.arange(force.size), force)(places))


@cache
def _march(plain: bool) -> RecordProgram:
    """One step of Runge and Kutta's fourth order, from the force at its beginning, middle and end; `plain` is n = 1."""
    tape = Tape()
    force = [tape.input(name) for name in ("before", "between", "after")]
    names = ("h", "m", "c", "k", "alpha", "gamma", "delta", "n")
    h, m, c, k, alpha, gamma, delta, n = (tape.parameter(name, 1.0 if plain else 2.0) for name in names)
    begin = [tape.remember(name) for name in "xvz"]
    total, rates = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    for stage, u in enumerate((force[0], force[1], force[1], force[2])):
        share = (0.0, 0.5 * h, 0.5 * h, h)[stage]
        x, v, z = (value + share * rate for value, rate in zip(begin, rates, strict=True))
        size = abs(z)
        power = 1.0 if plain else size ** (n - 1.0)
        rates = [v, (u - c * v - k * x - z) / m, alpha * v - power * (gamma * abs(v) * z + delta * v * size)]
        weight = 1.0 if stage in (0, 3) else 2.0
        total = [sum_ + weight * rate for sum_, rate in zip(total, rates, strict=True)]
    end = [value + h / 6 * sum_ for value, sum_ in zip(begin, total, strict=True)]
    for memory, value in zip(begin, end, strict=True):
        tape.update(memory, value)
    return RecordProgram(program(tape, {"x": end[0]}))
