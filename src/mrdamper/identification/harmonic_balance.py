"""Harmonic balance of a damper on a sine: the paper's closed forms, and their correction.

The paper balances the first harmonic of the whole force with viscosity, inertia and gas spring and obtains c and m in
closed form. The hysteretic force alpha z has a first harmonic, too, so c and m contain part of it and it is counted
twice: `double_counted` calculates this part. A balance that evaluates the hysteresis over three or more harmonics does
not have this error; `HarmonicProjection` maps signals to the space of this balance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mrdamper.data import Condition, Floats, Run
from mrdamper.data.runs import once_per_run
from mrdamper.data.wording import counted
from mrdamper.errors import ExcitationError, IdentificationError
from mrdamper.physics.hysteresis import Shape, loop_harmonics
from mrdamper.physics.motion import SINE_DISTORTION_LIMIT, STRAY_LIMIT, Excitation, analyse_motion
from mrdamper.physics.motion.harmonics import fit_harmonics
from mrdamper.physics.motion.path import memoize_per_path
from mrdamper.statistics.linear import solve_linear

AmplitudeReading = Literal["first-harmonic", "half-peak-to-peak", "maximum"]
PhaseReading = Literal["harmonic", "peaks"]
OffsetReading = Literal["extremes", "mean"]
_FORCE_HARMONICS = 9  # the first is needed; the next few must not leak into it if the last cycle is incomplete


@dataclass(frozen=True, eq=False)
class SineRecord:
    """A steady run for harmonic balance: x = amplitude · sin theta, and the force."""

    run_id: str
    condition: Condition  # with the amplitude of the first harmonic of the displacement
    theta: Floats  # (N,) phase of the displacement at the samples [rad], from 0 on
    force: Floats  # (N,) measured [N]

    @classmethod
    def of(cls, run: Run) -> SineRecord:
        """Read the steady window of a run.

        Raises `ExcitationError` if it holds under one cycle, or its motion is no sine.
        """
        return _sine_record(run)

    @property
    def omega(self) -> float:
        """2πf [rad/s]."""
        return 2 * np.pi * self.condition.frequency_Hz

    @property
    def motion(self) -> Excitation:
        """The sine itself at the samples, free of noise."""
        X, omega = self.condition.amplitude_m, self.omega
        x = X * np.sin(self.theta)
        v = X * omega * np.cos(self.theta)
        return Excitation(self.theta / omega, x, v, -(omega**2) * x, np.full(x.size, self.condition.current_A))


@once_per_run
def _sine_record(run: Run) -> SineRecord:
    analysis = analyse_motion(run)
    if not analysis.is_sine:
        raise ExcitationError(
            f"the motion is no sine: distortion {100 * analysis.distortion:.1f} %, "
            f"motion at other frequencies {100 * analysis.stray:.0f} %; "
            f"harmonic balance takes up to {100 * SINE_DISTORTION_LIMIT:g} and {100 * STRAY_LIMIT:g} %",
            where=f"run {run.id}",
            remedy="identify with method projection, which follows any motion",
        )
    steady, series = run.steady(), analysis.series
    omega = 2 * np.pi * series.frequency
    theta = omega * (steady.time - series.origin) + series.phase(1) % (2 * np.pi)
    measured = analysis.condition
    condition = Condition(measured.current_A, series.frequency, series.amplitude(1))
    return SineRecord(run.id, condition, theta, steady.force)


@dataclass(frozen=True)
class ForceReading:
    """Force ≈ offset + amplitude · sin(theta + phase), for the closed forms."""

    # amplitude, phase, offset: F0 [N], its lead phi over the displacement [rad], f0 [N]
    amplitude: float
    phase: float
    offset: float


def read_force(
    record: SineRecord,
    amplitude: AmplitudeReading = "first-harmonic",
    phase: PhaseReading = "harmonic",
    offset: OffsetReading = "extremes",
) -> ForceReading:
    """Calculate F0, phi and f0 of a measured force.

    [Qian et al. 2024, Eq. 16] The text leaves their definition open; the options are the possible ones. F0 is the
    amplitude of the first harmonic, half the peak-to-peak force, or the largest force; phi is the lead of the first
    harmonic, or that of the peaks; f0 is the mid-point of maximum and minimum (the paper's), or the mean over the
    cycles.
    """
    # No drift: over a few cycles a line is not orthogonal to the sines and would absorb part of them.
    series = fit_harmonics(record.theta, record.force, _FORCE_HARMONICS, frequency=1 / (2 * np.pi), drift=False)
    (top, at_top), (bottom, at_bottom) = _extremes(record)
    sizes = {"first-harmonic": series.amplitude(1), "half-peak-to-peak": (top - bottom) / 2, "maximum": top}
    # The series counts from the first sample, which lies at phase theta[0].
    leads = {
        "harmonic": series.phase(1) - record.theta[0],
        "peaks": np.pi / 2 - _circular_mean(at_top, at_bottom - np.pi),
    }
    offsets = {"extremes": (top + bottom) / 2, "mean": series.mean}
    lead = (leads[phase] + np.pi) % (2 * np.pi) - np.pi
    return ForceReading(sizes[amplitude], float(lead), offsets[offset])


def damping_and_mass(
    reading: ForceReading, amplitude: float, omega: float, k1: float, k3: float
) -> tuple[float, float]:
    """Viscous damping c [N s/m] and equivalent mass m [kg] by first-order harmonic balance.

    c = F0 sin(phi)/(X omega), m = (k1 X + 3/4 k3 X³ − F0 cos(phi))/(X omega²) [Qian et al. 2024, Eq. 17–19], with the
    amplitude X [m], omega [rad/s] and the stiffnesses of the gas spring k1 [N/m] and k3 [N/m³]; the even one has no
    first harmonic. The hysteretic force is counted in both: see `double_counted`.
    """
    X = amplitude
    c = reading.amplitude * np.sin(reading.phase) / (X * omega)
    m = (k1 * X + 0.75 * k3 * X**3 - reading.amplitude * np.cos(reading.phase)) / (X * omega**2)
    return float(c), float(m)


def double_counted(shape: Shape, yield_force: float, amplitude: float, omega: float) -> tuple[float, float]:
    """Calculate the first harmonic of the hysteretic force that the closed forms of c and m also contain.

    c_closed − c = f_z zc_1/(X omega),  m_closed − m = −f_z zs_1/(X omega²), with zs_1, zc_1
    the exact first harmonics of zeta. Derived for this package.

    `yield_force`: f_z, hysteretic force after yield [N]; `amplitude`, `omega` [m], [rad/s]. Returns c, m [N s/m],
    [kg].
    """
    sine, cosine = loop_harmonics(shape, amplitude, (1,))
    return (
        float(yield_force * cosine[0] / (amplitude * omega)),
        float(-yield_force * sine[0] / (amplitude * omega**2)),
    )


def separate_mass(conditions: Sequence[Condition], in_phase: Sequence[float]) -> tuple[float, float]:
    """Separate stiffness [N/m] and mass [kg] by regression of k1 − m omega² over several runs.

    At one frequency x and its acceleration are proportional, so one run does not determine both. Raises
    `IdentificationError` with fewer than two frequencies.

    `in_phase`: in-phase force over displacement of each run, the hysteretic part removed [N/m].
    """
    omega = 2 * np.pi * np.array([c.frequency_Hz for c in conditions])
    if omega.size < 2 or np.ptp(omega) < 0.03 * np.max(omega):
        raise IdentificationError(
            f"{counted(omega.size, 'run')} at one frequency: it takes two to tell mass from stiffness",
            remedy="add runs at another frequency, or give the gas spring",
        )
    columns = np.column_stack([np.ones_like(omega), -(omega**2)])
    k1, m = solve_linear(columns, np.asarray(in_phase, dtype=float)).tolist()
    return k1, m


class HarmonicProjection:
    """Projection of signals at given phases to their mean and harmonics 1...H, in an orthonormal basis.

    Measured and modelled force have the same projection, so neither an incomplete last cycle nor the omitted harmonics
    affect the balance: equal signals have equal projections. Squared differences of projections equal those in time of
    the harmonics. A linear drift is projected out. H is reduced to the harmonics that the samples resolve.
    """

    def __init__(self, theta: Floats, harmonics: int):
        resolved = int(np.pi / float(np.median(np.diff(theta))))
        self.harmonics = max(1, min(harmonics, resolved))
        self._rows = _harmonic_basis(theta, self.harmonics)

    def __call__(self, signals: Floats) -> Floats:
        """Project signals, (N,) or (N, S) -> (1 + 2H,) or (1 + 2H, S)."""
        return self._rows @ signals


@memoize_per_path
def _harmonic_basis(theta: Floats, harmonics: int) -> Floats:
    """(1 + 2H, N) orthonormal rows of the mean and the harmonics, without a linear drift."""
    angle = np.outer(theta, np.arange(1, harmonics + 1))
    basis = np.column_stack([theta - theta.mean(), np.ones_like(theta), np.sin(angle), np.cos(angle)])
    return np.asarray(np.linalg.qr(basis)[0].T[1:], dtype=float)


def _extremes(record: SineRecord) -> list[tuple[float, float]]:
    """Maximum and minimum of the force [N] and where in the cycle they lie [rad], median over the cycles."""
    cycle = np.floor((record.theta - record.theta[0]) / (2 * np.pi) + 1e-9).astype(int)
    parts = [np.flatnonzero(cycle == number) for number in range(cycle[-1] + 1)]
    most = max(part.size for part in parts)
    whole = [part for part in parts if part.size >= 0.95 * most]
    ends = ([part[pick(record.force[part])] for part in whole] for pick in (np.argmax, np.argmin))
    return [(float(np.median(record.force[at])), _circular_mean(*record.theta[at])) for at in ends]


def _circular_mean(*angles: float) -> float:
    return float(np.angle(np.mean(np.exp(1j * np.asarray(angles)))))
