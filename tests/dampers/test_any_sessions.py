"""Any way of stating sessions: every interval is bounded or refused, and planning and drawing go on."""

from dataclasses import replace

import numpy as np
import pytest
from support.dampers import joint_damper, modified_damper
from support.sessions import session_runs

from mrdamper.dampers.bands import band, portable_band
from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.dampers.model_file import dump_model, parse_model
from mrdamper.dampers.uncertainty import table
from mrdamper.data import Condition
from mrdamper.study.limits import Limits
from mrdamper.study.plan import plan_tests
from mrdamper.systems.monte_carlo import draw

STATED = {
    "one": lambda i: "campaign-1",
    "two": lambda i: f"day {i % 2}",
    "three": lambda i: f"day {i % 3}",
    "unknown": lambda i: "",
    "one a run": lambda i: f"day {i}",
    "empty cells": lambda i: "a" if i % 3 else "",
}
SLOW = pytest.mark.slow
LIMITS = Limits((0.0, 1.0), (0.5, 4.0), (2.0, 20.0), velocity_m_s=0.2, force_N=1500.0, session_minutes=5.0)


@pytest.mark.parametrize(
    ("make", "runs", "stated"),
    [
        pytest.param(make, runs, stated, marks=[] if stated in fast else SLOW)
        for make, runs, fast in (
            (joint_damper, 9, ("one", "three", "unknown", "one a run")),
            (joint_damper, 1, ("one a run",)),
            (joint_damper, 2, ("one", "one a run")),
            (modified_damper, 9, ("three",)),
        )
        for stated in STATED
    ],
)
def test_intervals_are_bounded_or_refused(make, runs, stated):
    truth = make()
    every = session_runs(truth, seed=2)[:runs]
    made = estimate_uncertainty(truth, [replace(r, notes={"session": STATED[stated](i)}) for i, r in enumerate(every)])
    known = made.uncertainty
    for row in table(made):
        half = (row["high"] - row["low"]) / 2
        assert np.isnan(half) or half < 1e3 * abs(row["value"]), row
        assert not np.isnan(half) or "not identifiable" in row["state"] or "one-sided" in row["state"]
    assert np.isfinite(known.covariance).all()
    assert np.linalg.eigvalsh(known.covariance).min() > -1e-9 * max(np.trace(known.covariance), 1e-30)
    assert known.of_sessions == (runs == 9 and stated in ("three", "one a run"))
    assert parse_model(dump_model(made)).uncertainty.run_gain == known.run_gain
    around, three = band(made, made.predict(Condition(0.5, 1.0, 0.01))), portable_band(made)
    assert (around is None) == (three is None) == (not known.of_sessions and not known.run_dof)
    assert around is None or np.isfinite([*around.low, *around.high, *around.peak, *around.energy]).all()
    drawn = [draws["x"].numbers for draws in draw({"x": made}, 50)]
    assert all(np.isfinite(list(numbers.values())).all() for numbers in drawn)


@pytest.mark.parametrize("stated", ["unknown", *(pytest.param(stated, marks=SLOW) for stated in ("one", "one a run"))])
def test_tests_are_planned_whatever_is_known_of_sessions(stated):
    truth = joint_damper()
    runs = [replace(r, notes={"session": STATED[stated](i)}) for i, r in enumerate(session_runs(truth))]
    proposals, _ = plan_tests(estimate_uncertainty(truth, runs), LIMITS, 0.5)
    assert proposals
    assert proposals[-1].after < proposals[0].before
