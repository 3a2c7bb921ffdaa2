"""Errors of a predicted force against the measured one; the normaliser is part of each name.

Every score is a fraction, not per cent. Arguments are (N,) forces [N], measured first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrdamper.data.arrays import Floats


def rmse(measured: Floats, predicted: Floats) -> float:
    """Root mean square error [N]."""
    return float(np.linalg.norm(predicted - measured) / np.sqrt(measured.size))


def nrmse_pp(measured: Floats, predicted: Floats) -> float:
    """RMSE over the peak-to-peak value of the measured force."""
    return rmse(measured, predicted) / float(np.ptp(measured))


def nrmse_std(measured: Floats, predicted: Floats) -> float:
    """RMSE over the standard deviation of the measured force."""
    return rmse(measured, predicted) / float(np.std(measured))


def wape(measured: Floats, predicted: Floats) -> float:
    """Weighted absolute percentage error Σ|e| / Σ|F|."""
    return float(np.sum(np.abs(predicted - measured)) / np.sum(np.abs(measured)))


def mean_relative_error(measured: Floats, predicted: Floats) -> float:
    """Mean of |e| / |F|.

    [Qian et al. 2024, Eq. 44] It is unbounded where the force crosses zero: compare it with `wape`. Samples with a
    measured force of exactly zero are omitted.
    """
    counted = slice(None) if measured.all() else measured != 0
    return float(np.mean(np.abs((predicted - measured)[counted] / measured[counted])))


def explained_variance(values: Floats, fitted: Floats) -> float:
    """Share of the variance of values (N,) of any unit that others explain, R²; NaN where they do not vary."""
    if not np.ptp(values) > 1e-9 * np.max(np.abs(values)):
        return float("nan")
    return 1.0 - float(np.sum((fitted - values) ** 2)) / float(np.sum((values - values.mean()) ** 2))


def peak_force(force: Floats) -> float:
    """Half the peak-to-peak force [N]."""
    return float(np.ptp(force) / 2)


def dissipated_power(force: Floats, velocity: Floats, time: Floats) -> float:
    """Mean dissipated power F·v [W]; over whole cycles, dissipated energy × frequency."""
    power = force * velocity
    return float((time[1:] - time[:-1]) @ (power[1:] + power[:-1])) / 2 / float(time[-1] - time[0])


@dataclass(frozen=True, slots=True)
class Scores:
    """Scores of one predicted run; fractions.

    Attributes
    ----------
    nrmse_pp, nrmse_std : float
        RMS error over the peak-to-peak value, and over the standard deviation, of the measured force.
    wape : float
        Σ|e| / Σ|F|.
    peak_error, energy_error : float
        Of half the peak-to-peak force and of the dissipated energy, relative; positive if those of the model are too
        large.
    mean_relative_error : float
        Mean of |e| / |F| [Qian et al. 2024, Eq. 44], unbounded where the force crosses zero.
    """

    nrmse_pp: float
    nrmse_std: float
    wape: float
    peak_error: float
    energy_error: float
    mean_relative_error: float


def score(measured: Floats, predicted: Floats, velocity: Floats, time: Floats) -> Scores:
    """Score one predicted run: forces measured and predicted [N], velocity [m/s] and time [s], (N,) each."""
    dissipated = dissipated_power(measured, velocity, time)
    return Scores(
        nrmse_pp=nrmse_pp(measured, predicted),
        nrmse_std=nrmse_std(measured, predicted),
        wape=wape(measured, predicted),
        peak_error=peak_force(predicted) / peak_force(measured) - 1,
        energy_error=dissipated_power(predicted, velocity, time) / dissipated - 1 if dissipated else float("nan"),
        mean_relative_error=mean_relative_error(measured, predicted),
    )
