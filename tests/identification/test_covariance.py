"""Standard errors against textbook formulas and against the scatter of repeated identifications."""

import numpy as np
import pytest
from support.synthetic import synthetic_run

from mrdamper.data import Condition
from mrdamper.identification import identify
from mrdamper.identification.covariance import autocorrelation_time, standard_errors
from mrdamper.models.bingham import Bingham


def test_white_noise_gives_the_textbook_errors():
    rng = np.random.default_rng(3)
    J = rng.standard_normal((4000, 3)) * [1.0, 50.0, 0.02]
    residual = 2.0 * rng.standard_normal(4000)
    textbook = np.sqrt(np.sum(residual**2) / (4000 - 3) * np.diag(np.linalg.inv(J.T @ J)))
    # White noise has an autocorrelation time of one, estimated from 4000 samples to some per cent.
    assert standard_errors(J, residual) == pytest.approx(textbook, rel=0.08)
    assert np.isinf(standard_errors(np.column_stack([J, np.zeros(4000)]), residual)[3])


@pytest.mark.parametrize(("rho", "time"), [(0.0, 1.0), (0.5, 3.0), (0.8, 9.0)])
def test_the_autocorrelation_time_is_that_of_an_autoregressive_process(rho, time):
    noise = np.random.default_rng(5).standard_normal(60_000)
    series = np.empty_like(noise)
    series[0] = noise[0]
    for i in range(1, noise.size):
        series[i] = rho * series[i - 1] + noise[i]
    assert autocorrelation_time(series) == pytest.approx(time, rel=0.12)  # (1 + rho)/(1 - rho)


def test_standard_errors_are_the_scatter_of_repeated_identifications():
    condition = Condition(1.0, 1.0, 0.02)
    truth = Bingham(fy=300.0, c=1500.0, f0=20.0)
    found = [
        identify(synthetic_run(condition, 30.0, seed=s, cycles=3, samples_per_cycle=1000, model=truth), "bingham")
        for s in range(60)
    ]
    for name in ("c", "f0"):
        scatter = float(np.std([getattr(i.model, name) for i in found], ddof=1))
        said = float(np.median([i.standard_errors[name] for i in found]))
        assert said == pytest.approx(scatter, rel=0.25), name  # 60 repeats know their scatter to 9 %
