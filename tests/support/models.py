"""Parameters of a plausible damper for each model."""

from functools import cache

from mrdamper.identification import identify
from mrdamper.rig_files.dataset_folder import load_dataset

EXAMPLES = {
    "bingham": {"c": 1500.0, "fy": 700.0, "f0": 60.0},
    "smooth-bingham": {"c": 1500.0, "fy": 700.0, "vs": 0.01, "f0": 60.0},
    "bouc-wen": {"c": 1440.0, "alpha": 9e5, "beta": 2e5, "gamma": 2e5, "f0": 60.0, "k1": 800.0},
    "kwok": {"c": 1500.0, "k": 800.0, "alpha": 700.0, "beta": 60.0, "delta": 0.7, "f0": 60.0},
    "guo": {"fy": 800.0, "c": 1100.0, "kappa": 80.0, "v0": 0.012, "f0": 60.0},
    "biviscous": {"cpo": 1200.0, "fy": 700.0, "vy": 0.02, "vh": 0.008, "f0": 60.0},
    "dahl": {"kappa_x": 1300.0, "kappa_w": 700.0, "yield_displacement": 6e-4, "f0": 60.0},
    "herschel-bulkley": {"fy": 500.0, "vc": 0.05, "m": 0.8, "f0": 60.0},
    "lugre": {
        "fc": 600.0, "presliding": 5e-4, "stribeck": 1.3, "vs": 0.01, "sigma1": 300.0, "sigma2": 900.0, "f0": 60.0,
    },
    "spencer": {
        "c1": 2.6e4, "c0_ratio": 0.06, "k0_rate": 0.15, "creep": 0.03, "yield_displacement": 1e-4, "k1": 800.0,
        "f0": 60.0,
    },
    "tanh": {
        "f0": 40.0, "k0": 800.0, "c0": 600.0, "c1": 900.0, "fy0": 90.0, "fy1": 700.0, "vy": 0.02, "shift": 0.8,
        "k1": 100.0, "si": 0.4, "p": -0.3, "tail": 0.2,
    },
    "play-bypass": {
        "f0": 40.0, "k": 800.0, "c0": 600.0, "c1": 3800.0, "fy0": 140.0, "fy1": 1000.0, "d": 2e-4, "e": 2.5e-5,
        "cb": 3.6e4, "h0": 0.4, "h1": 0.3, "vh": 3e-3, "T": 5e-3,
    },
}  # fmt: skip


@cache
def example_values(name):
    """Parameters of a model; for an added model those identified from a real run."""
    return EXAMPLES.get(name) or identify(load_dataset()["utf_5mm4Hz_1A"], name).model.values()
