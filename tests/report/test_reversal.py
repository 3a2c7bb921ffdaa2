"""The figure of the force since the reversal: a curve is the mean of the same runs and strokes at every distance."""

from types import SimpleNamespace

import numpy as np

from mrdamper.data import Condition, Run
from mrdamper.physics.motion import sine
from mrdamper.report.plots.reversal import force_since_reversal


def recorded(frequency, amplitude, samples):
    """A run whose force along the motion rises with the distance since the reversal, the faster the longer it is."""
    motion = sine(Condition(0.5, frequency, amplitude), 4, samples)
    path = motion.path
    force = path.direction * (1000 + 300 * np.minimum(path.distance / (0.05 * amplitude), 2.0))
    return Run(f"{samples}", motion.time, motion.displacement, force, 0.5), SimpleNamespace(motion=motion, force=force)


def test_runs_of_any_amplitude_and_sample_rate_have_a_curve_without_steps():
    pairs = [recorded(0.5, 0.004, 250), recorded(4.0, 0.022, 250), recorded(1.0, 0.01, 2000), recorded(2.0, 5e-4, 100)]
    predictions = {run.id: prediction for run, prediction in pairs}
    figure = force_since_reversal([run for run, _ in pairs], SimpleNamespace(predict=lambda run: predictions[run.id]))
    measured, predicted = (curve for curve in figure.axes[0].series if curve.x.size)
    np.testing.assert_allclose(measured.y, predicted.y)
    assert np.all(np.diff(measured.y) >= 0)
    assert measured.x.size > 70
