"""
A force-driven Bouc–Wen system
==============================

The system of the benchmark of Noël and Schoukens is simulated and identified from force and displacement.

A mass of 2 kg on a spring and a hysteretic element that stiffens while it is loaded, driven by a
multisine of 5 to 150 Hz and 50 N. The data are synthetic, with noise 40 dB below the displacement;
another multisine is the test.
"""

import numpy as np

from mrdamper.systems.oscillator import Oscillator, identify_oscillator, multisine

RATE, SIZE, PERIODS = 750.0, 4096, 4
rng = np.random.default_rng(2016)
truth = Oscillator(m=2.0, c=10.0, k=5e4, alpha=5e4, beta=1e3, gamma=0.8, delta=-1.1)

force = multisine(rng, SIZE, RATE, (5.0, 150.0), rms=50.0)
clean = truth.response(force, RATE, periodic=True)
noisy = clean + 1e-2 * np.std(clean) * rng.standard_normal((PERIODS, SIZE))
fit = identify_oscillator(force, noisy.mean(axis=0), RATE)

found = fit.oscillator
for name, value, true in (
    ("m [kg]", found.m, truth.m),
    ("c [N s/m]", found.c, truth.c),
    ("k [N/m]", found.k, truth.k),
    ("alpha [N/m]", found.alpha, truth.alpha),
    ("beta gamma [1/m]", found.beta * found.gamma, truth.beta * truth.gamma),
    ("beta delta [1/m]", found.beta * found.delta, truth.beta * truth.delta),
):
    print(f"{name:18}{value:12.5g}   true {true:g}")

test = multisine(rng, SIZE, RATE, (5.0, 150.0), rms=50.0)
missed = found.response(test, RATE, periodic=True) - truth.response(test, RATE, periodic=True)
print(f"test multisine: rmse {1e9 * np.sqrt(np.mean(missed**2)):.0f} nm of {1e6 * np.std(clean):.0f} um")
