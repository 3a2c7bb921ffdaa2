"""Steps that are lengthened where they gain more than the Jacobian promised."""

import numpy as np

from mrdamper.statistics.levenberg_marquardt import least_squares

PLACES, WIDTH = np.array([0.9, 1.0, 1.15, 1.3]), 0.02
TIME = np.linspace(0.0, 2.0, 801)
MEASURED = np.tanh((TIME - PLACES[:, None]) / WIDTH)


def search(lengthened, residual, slopes, start):
    calls = {"residual": 0, "slopes": 0}

    def counted(name, function):
        def call(u):
            calls[name] += 1
            return function(u)

        return call

    found = least_squares(
        counted("residual", residual), np.array([start]), np.zeros(1), np.full(1, 2.0), 200, 1e-6,
        slopes=counted("slopes", slopes), lengthened=lengthened,
    )  # fmt: skip
    return found, calls


def test_a_front_is_shifted_in_fewer_steps():
    """One front stands for four at other places: the Jacobian sees their width, the cost their spread."""

    def residual(u):
        return (np.tanh((TIME - u[0]) / WIDTH) - MEASURED).ravel()

    def slopes(u):
        front = -(1 - np.tanh((TIME - u[0]) / WIDTH) ** 2) / WIDTH
        return np.tile(front, len(PLACES))[:, None]

    (plain, slow), (best, fast) = (search(on, residual, slopes, 0.2) for on in (False, True))
    assert best.cost <= plain.cost * (1 + 1e-6)
    assert fast["slopes"] < 0.6 * slow["slopes"]
    assert best.evaluations == fast["residual"] + fast["slopes"]


def test_what_is_linear_is_never_lengthened():
    outcomes = [search(on, lambda u: TIME * u[0] - MEASURED[0], lambda u: TIME[:, None], 1.9) for on in (False, True)]
    assert outcomes[0][1] == outcomes[1][1]
    assert outcomes[0][0].point == outcomes[1][0].point
