"""A mass on a spring, a dashpot and a hysteretic element, driven by a force: simulated, and identified.

m y'' + c y' + k y + z = u, dz/dt = alpha v − beta (gamma |v| |z|^(n−1) z + delta v |z|^n), v = y'.

The force goes in and the displacement comes out, as in the benchmark of the field [Noël and
Schoukens 2016, "Hysteretic benchmark with a dynamic nonlinearity"; recalled]. Here z is a force
and may grow without bound while it is loaded (beta (gamma + delta) < 0, a spring that stiffens);
energy is dissipated as long as beta gamma >= 0. The dampers of `mrdamper.models` are driven by
their motion instead and need a bounded z.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from mrdamper.data import Floats
from mrdamper.errors import ParameterError, RecordError, StepError
from mrdamper.optimizers.levenberg_marquardt import least_squares
from mrdamper.tracing import Tape, program
from mrdamper.tracing.compiled import RecordProgram

_STEPS = 20  # between two samples, by Runge and Kutta's fourth order
_LEAD = 0.5  # of a period, run before the one that counts: what the oscillator has to forget
_FARTHEST = 1e6  # times the static deflection: a state beyond runs away


@dataclass(frozen=True)
class Oscillator:
    """A force-driven mass with a Bouc–Wen element.

    Attributes
    ----------
    m, c, k : float
        Mass [kg], damping [N s/m], stiffness [N/m].
    alpha : float
        Stiffness of the hysteretic element at zero force [N/m].
    beta, gamma, delta : float
        beta [N^(1−n)/m] scales gamma, of |v|, and delta, of v [-]; only their products count.
    n : float
        Sharpness of the yield [-].

    Raises
    ------
    ParameterError
        If the mass is not positive, the element feeds energy in (beta gamma < 0), or n is below 1.
    """

    m: float
    c: float
    k: float
    alpha: float
    beta: float
    gamma: float
    delta: float
    n: float = 1.0

    def __post_init__(self) -> None:
        for name, good, mend in (
            ("m", 0 < self.m < np.inf, "a mass is positive"),
            ("gamma", self.beta * self.gamma >= 0, "beta gamma >= 0, or the element feeds energy in"),
            ("n", 1 <= self.n <= 20, "n lies between 1 and 20"),
            ("k", np.isfinite([self.c, self.k, self.alpha, self.beta, self.delta]).all(), "give finite numbers"),
        ):
            if not good:
                raise ParameterError(f"{name} = {getattr(self, name):g}", where="oscillator", mend=mend)

    def response(self, force: Floats, sample_rate: float, *, periodic: bool = False) -> Floats:
        """Displacement [m] under a force, from rest; of a periodic force, over one settled period.

        Parameters
        ----------
        force : (N,) array
            [N]; band-limited between samples where it is periodic, else smooth.
        sample_rate : float
            [Hz]
        periodic : bool
            The record is one period of a force that has always been there.

        Raises
        ------
        RecordError
            If the force is no record of numbers.
        StepError
            E_RUNAWAY if the state runs away.
        """
        force = np.asarray(force, dtype=float)
        if force.ndim != 1 or force.size < 8 or not np.isfinite(force).all():
            raise RecordError("a force of under 8 samples, or not finite", mend="give an (N,) array of forces [N]")
        fine = _refined(force, 2 * _STEPS, periodic)
        lead = 2 * _STEPS * int(_LEAD * force.size) if periodic else 0
        fine = np.concatenate([fine[-1 - lead : -1], fine])
        record = _march(self.n == 1)
        given = (
            1 / (_STEPS * sample_rate), self.m, self.c, self.k, self.alpha,
            self.beta * self.gamma, self.beta * self.delta, self.n,
        )  # fmt: skip
        derived = record.prepare(given)
        assert derived is not None
        found = record.along(given, derived, record.starts, (fine[:-2:2], fine[1:-1:2], fine[2::2]))
        farthest = _FARTHEST * (np.abs(force).max() / self.k + 1e-9)
        y = np.concatenate([[0.0], found.outputs[0, _STEPS - 1 :: _STEPS]])
        lost = ~(np.abs(y) < farthest)
        if lost.any() or found.failed >= 0:
            bad = int(np.flatnonzero(lost)[0]) if lost.any() else found.failed // _STEPS
            raise StepError(
                f"the state runs away after {bad / sample_rate:.3g} s", where="oscillator",
                mend="lower the force: an element with beta (gamma + delta) < 0 has no bound", code="E_RUNAWAY",
            )  # fmt: skip
        return y[y.size - force.size :] if periodic else y[: force.size]


@dataclass(frozen=True, eq=False)
class OscillatorFit:
    """An identified oscillator.

    Attributes
    ----------
    oscillator : Oscillator
        With beta = 1: only beta gamma and beta delta can be told.
    rmse_m : float
        Of the displacement it was identified from [m].
    evaluations : int
    """

    oscillator: Oscillator
    rmse_m: float
    evaluations: int


def identify_oscillator(force: Floats, displacement: Floats, sample_rate: float, *, n: float = 1.0) -> OscillatorFit:
    """Identify an oscillator from one period of force and displacement.

    The linear part comes from the spectra, the rest from the least squares of the simulated
    displacement.

    Parameters
    ----------
    force, displacement : (N,) arrays
        One period, or the mean of several [N], [m].
    sample_rate : float
        [Hz]
    n : float
        Sharpness of the yield, held.

    Raises
    ------
    RecordError
        If the records do not fit together or nothing moves.

    Examples
    --------
    >>> import numpy as np
    >>> from mrdamper.systems.oscillator import Oscillator, identify_oscillator, multisine
    >>> force = multisine(np.random.default_rng(0), 1024, 750.0, (5.0, 150.0), rms=50.0)  # [N]
    >>> truth = Oscillator(m=2.0, c=10.0, k=5e4, alpha=5e4, beta=1e3, gamma=0.8, delta=-1.1)
    >>> fit = identify_oscillator(force, truth.response(force, 750.0, periodic=True), 750.0)
    >>> round(fit.oscillator.m, 3)
    2.0
    """
    force, displacement = (np.asarray(a, dtype=float) for a in (force, displacement))
    if force.shape != displacement.shape or np.ptp(displacement) == 0 or not np.isfinite(displacement).all():
        raise RecordError("force and displacement differ in length, or nothing moves", mend="give one period of both")
    size, spread = displacement.size, float(np.std(displacement))
    omega = 2 * np.pi * np.fft.rfftfreq(size, 1 / sample_rate)
    U, Y = np.fft.rfft(force), np.fft.rfft(displacement)
    told = np.abs(U) > 1e-3 * np.abs(U).max()
    table = (np.stack([-(omega**2), 1j * omega, np.ones(omega.size)], axis=1) * Y[:, None])[told]
    linear = np.linalg.lstsq(np.vstack([table.real, table.imag]), np.append(U[told].real, U[told].imag), rcond=None)[0]
    m, c, k = (max(float(v), 1e-6 * abs(linear[0])) for v in linear)
    scale = np.array([m, max(c, 1e-3 * np.sqrt(m * k)), k, k, 1 / spread, 1 / spread])
    size_of_z = (0.5 * k * spread) ** (n - 1) if n > 1 else 1.0

    def made(u: Floats) -> Oscillator:
        m, c, k, alpha, gamma, delta = (u * scale).tolist()
        return Oscillator(m, c, k, alpha, 1.0, gamma / size_of_z, delta / size_of_z, n)

    def residual(u: Floats) -> Floats:
        try:
            return (made(u).response(force, sample_rate, periodic=True) - displacement) / (spread * np.sqrt(size))
        except StepError:
            return np.full(size, 1e3)

    lower = np.array([0.2, 0.0, 0.0, 0.0, 0.0, -5.0])
    upper = np.array([5.0, 5.0, 3.0, 3.0, 5.0, 5.0])
    starts = [np.array([1.0, 0.3, share, 1 - share, 0.3, delta]) for share in (0.5, 0.2) for delta in (0.0, -0.5)]
    found = [least_squares(residual, start, lower, upper, 6, 1e-4) for start in starts]
    best = min(found, key=lambda minimum: minimum.cost)
    last = least_squares(residual, best.point, lower, upper, 60, 1e-10)
    evaluations = sum(each.evaluations for each in (*found, last))
    return OscillatorFit(made(last.point), spread * float(np.linalg.norm(residual(last.point))), evaluations)


def multisine(
    rng: np.random.Generator, size: int, sample_rate: float, band_Hz: tuple[float, float], rms: float
) -> Floats:
    """(size,) one period of a multisine with random phases and a flat spectrum over a band; RMS as its unit."""
    frequency = np.fft.rfftfreq(size, 1 / sample_rate)
    inside = (frequency >= band_Hz[0]) & (frequency <= band_Hz[1])
    wave = np.fft.irfft(inside * np.exp(2j * np.pi * rng.uniform(size=frequency.size)), size)
    return wave * rms / float(np.std(wave))


def _refined(force: Floats, times: int, periodic: bool) -> Floats:
    """The force at `times` as many places, the last sample included; after it, the first one of the next period."""
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
