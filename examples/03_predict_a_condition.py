"""
Prediction of an untested condition
===================================

The loops of two untested conditions, with their extrapolation flags."""

import numpy as np

from mrdamper import Condition, load_dataset, plot_loop, run_study

damper = run_study(load_dataset().rig("utfsm")).model
axes = None
for condition in (Condition(0.75, 1.5, 0.012), Condition(0.75, 6.0, 0.012)):
    prediction = damper.predict(condition)
    x, force = prediction.motion.displacement, prediction.force
    energy = float(np.sum((force[1:] + force[:-1]) / 2 * np.diff(x)))
    flags = ", ".join(prediction.extrapolation) or "inside the tests"
    print(f"{condition}: peak force {np.ptp(force) / 2:.0f} N, {energy:.1f} J per cycle ({flags})")
    axes = plot_loop(prediction, axes, linestyle="--" if prediction.extrapolation else "-", label=str(condition))
axes.legend()
