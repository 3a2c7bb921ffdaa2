"""The covariance of a damper: closed forms of one parameter, scales, order, what bounds hold and what nothing shows."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.linalg import sqrtm
from support.dampers import joint_damper

from mrdamper.dampers.bands import band
from mrdamper.dampers.calibration import Calibration, PredictedRun, model_error, standardized
from mrdamper.dampers.concatenated_runs import JointResiduals
from mrdamper.dampers.covariance import _determined, _Spread, _within, estimate_uncertainty
from mrdamper.dampers.distance import Distance
from mrdamper.dampers.envelope import UNTESTED
from mrdamper.dampers.joint import JointDamper, JointProblem
from mrdamper.dampers.random_effects import Draws, Effects, GainsAndOffsets
from mrdamper.dampers.run_residuals import RunResiduals, normal_matrix
from mrdamper.data import Condition, Run
from mrdamper.identification.covariance import score_covariance
from mrdamper.models.bingham import Bingham
from mrdamper.physics.motion import sine


def bingham(c, fy, f0):
    return JointDamper(Bingham(c=float(c), fy=float(fy), f0=float(f0)), ("c", "fy", "f0"), envelope=UNTESTED)


TRUTH = bingham(2000.0, 150.0, 20.0)
CONDITIONS = [Condition(0.5, f, a) for f in (0.5, 1.0, 2.0) for a in (0.005, 0.01, 0.02)]


def runs_of(gain=0.03, session=0.0, noise=0.02, seed=0, sessions=0, conditions=CONDITIONS, size=1.0):
    rng = np.random.default_rng(seed)
    shared = session * rng.standard_normal(max(sessions, 1))
    made = []
    for i, condition in enumerate(conditions):
        motion = sine(condition, 6, 200)
        clean = TRUTH.force_along(motion, condition) * size
        force = clean * (1 + gain * rng.standard_normal() + shared[i % max(sessions, 1)])
        force = force + noise * np.ptp(clean) * rng.standard_normal(force.size)
        notes = {"session": f"day {i % sessions}"} if sessions else {}
        made.append(Run(f"r{i}", motion.time, motion.displacement, force, 0.5, notes=notes))
    return made


def fitted(runs, size=1.0):
    """Least squares with the weights of the error estimate, which for Bingham is linear."""
    damper = bingham(2000.0 * size, 150.0 * size, 20.0 * size)
    for _ in range(6):
        parts = [RunResiduals.of(damper, run) for run in runs]
        columns = [np.column_stack([m.velocity, np.sign(m.velocity), np.ones(len(m))])[p.picked] for p in parts
                   for m in [p.prediction.motion]]  # fmt: skip
        normal = normal_matrix(columns, parts)
        right = sum(p.weighted(c).T @ (p.measured * p.weight) for c, p in zip(columns, parts, strict=True))
        c, fy, f0 = np.linalg.solve(normal, right)
        damper = bingham(c, fy, f0)
    return damper


def test_columns_that_no_run_shows_are_unseen_and_the_unit_of_a_parameter_changes_nothing():
    """Two columns that do the same are told as such in newtons and in millionths of one."""
    parts = [RunResiduals.of(TRUTH, run) for run in runs_of(conditions=CONDITIONS[:2])]
    shown = [np.column_stack([np.sin(p.picked), np.cos(p.picked), np.sin(p.picked) + 1e-3]) for p in parts]
    for size in (np.ones(3), np.array([1e6, 1e-6, 1.0])):
        keep, unseen, alike, inverse = _determined([table * size for table in shown], parts, 3)
        assert (keep, unseen, alike) == ([0, 1, 2], [], [])
        normal = normal_matrix([table * size for table in shown], parts)
        assert inverse @ normal == pytest.approx(np.eye(3), abs=1e-4 * max(np.outer(1 / size, size).ravel()))
    nothing = [np.zeros((p.picked.size, 3)) for p in parts]
    assert _determined(nothing, parts, 3)[:3] == ([], [0, 1, 2], [])
    twice = [np.column_stack([table[:, 0], 1e6 * table[:, 0], table[:, 1]]) for table in shown]
    keep, unseen, alike, _ = _determined(twice, parts, 3)
    assert (len(keep), unseen, [sorted(group) for group in alike]) == (2, [], [[0, 1]])


class OfFunctions(JointDamper):
    """Damper without one model for all conditions."""

    one_model = None


@pytest.mark.parametrize("window", [None, (1.0, 11.5)])
def test_of_a_run_beside_parameter_functions_the_last_four_cycles_enter_evenly(window):
    (run,) = runs_of(conditions=CONDITIONS[:1])
    run = replace(run, window=window, force=run.force + 40.0)
    part = RunResiduals.of(OfFunctions(TRUTH.model, TRUTH.free, envelope=UNTESTED), run)
    time, end = part.prediction.motion.time, window[1] if window else run.time[-1]
    at = np.searchsorted(run.time, time[part.picked])
    assert part.measured == pytest.approx(run.force[at])
    assert part.predicted == pytest.approx(TRUTH.predict(run).force[at])
    assert (time[part.picked[0]], time[part.picked[-1]]) == pytest.approx((end - 4 / 0.5, end), abs=0.03)
    assert time[[0, -1]] == pytest.approx([max(0.0, end - 5.5 / 0.5), end], abs=0.02)  # it has forgotten its start
    assert 400 <= part.picked.size < 800
    assert np.ptp(np.diff(part.picked)) == 0
    inside = (run.time >= end - 4 / 0.5 - 0.02) & (run.time <= end)
    assert (part.scale, part.information) == (pytest.approx(np.ptp(run.force[inside]), rel=1e-3), 1.0)
    assert part.error == pytest.approx(np.sqrt(np.mean(part.residual**2)) / part.scale)
    assert part.weight == pytest.approx(1 / part.scale / np.sqrt(part.error * part.picked.size))


def test_what_enters_of_a_run_is_what_entered_its_fit():
    (run,) = runs_of(conditions=CONDITIONS[:1])
    part, joint = RunResiduals.of(TRUTH, run), JointProblem([run], "bingham")
    table = JointResiduals(joint.space, joint.parts)
    time = part.prediction.motion.time[part.picked]
    at = np.searchsorted(run.time, time)
    assert part.measured == pytest.approx(table.target)
    assert part.measured == pytest.approx(run.force[at])
    assert part.residual == pytest.approx(part.predicted - run.force[at])
    assert np.sum(part.weight**2) * part.error == pytest.approx(1 / np.ptp(run.force) ** 2)
    assert part.weight * np.sqrt(part.error) == pytest.approx(table.unit)
    assert part.error == pytest.approx(np.sqrt(np.sum((part.residual * table.unit) ** 2)))
    assert part.session is None
    # Ramps and rests enter with a tenth of the weight, the steady window as its last four cycles.
    window = replace(run, window=(4.0, 10.0), notes={"session": "a"})
    inside = RunResiduals.of(TRUTH, window)
    time = inside.prediction.motion.time[inside.picked]
    outside = (time < 4.0) | (time > 10.0)
    assert np.sum(inside.weight[outside] ** 2) == pytest.approx(0.1 / 1.1 * np.sum(inside.weight**2))
    assert inside.session == "a"
    steady, before, after = inside.stretches
    assert (steady.frequency, before.frequency, after.frequency) == (pytest.approx(0.5, rel=1e-3), None, None)
    assert (steady.time[0], steady.time[-1]) == (pytest.approx(4.0, abs=0.02), pytest.approx(10.0, abs=0.02))
    assert before.time[-1] < 4.0 < 10.0 < after.time[0]
    for stretch in inside.stretches:
        assert np.ptp(np.diff(stretch.time)) < 1e-9
        measured = np.interp(stretch.time, run.time, run.force)
        assert stretch.residual == pytest.approx(stretch.predicted - measured)
    parts = [stretch.weight**2 * stretch.time.size for stretch in inside.stretches]
    assert sum(parts) == pytest.approx(np.sum(inside.weight**2))
    forces = inside.evenly(inside.predicted[:, None], steady)[:, 0]
    assert np.median(np.abs(forces - steady.predicted)) < 0.01 * np.ptp(forces)


@pytest.mark.parametrize("sessions", [0, 3])
def test_intervals_scale_with_the_force_and_forget_the_order_of_runs(sessions):
    runs = runs_of(sessions=sessions, session=0.03)
    damper = fitted(runs)
    plain = estimate_uncertainty(damper, runs).uncertainty
    turned = estimate_uncertainty(damper, runs[::-1]).uncertainty
    if not sessions:  # draws of sessions belong to places in the list
        assert np.sqrt(np.diag(turned.covariance)) == pytest.approx(np.sqrt(np.diag(plain.covariance)), rel=0.12)
    assert turned.run_gain == pytest.approx(plain.run_gain)
    double = [replace(run, force=2 * run.force) for run in runs]
    twice = estimate_uncertainty(fitted(double, 2.0), double).uncertainty
    assert twice.covariance == pytest.approx(4 * plain.covariance, rel=1e-6)
    assert (twice.run_gain, twice.run_offset) == pytest.approx((plain.run_gain, 2 * plain.run_offset), rel=1e-6)
    assert (twice.force, twice.peak, twice.energy) == pytest.approx((plain.force, plain.peak, plain.energy), rel=1e-6)
    assert twice.dof == pytest.approx(plain.dof, rel=1e-6)
    assert sum(plain.information.values()) == pytest.approx(1.0)
    assert twice.effective == pytest.approx(plain.effective, rel=1e-6)
    assert set(plain.effective) == set(plain.names) == {"c", "fy", "f0"}
    assert all(1 <= n <= sum(RunResiduals.of(damper, r).picked.size for r in runs) for n in plain.effective.values())


def test_intervals_hold_the_truth_of_gains_and_noise():
    inside, widths = [], []
    for seed in range(15):
        runs = runs_of(seed=seed)
        damper = fitted(runs)
        made = estimate_uncertainty(damper, runs)
        for name in ("c", "fy"):
            low, high = made.uncertainty.interval(made, name)
            inside.append(low <= getattr(TRUTH.one_model, name) <= high)
            widths.append((high - low) / getattr(TRUTH.one_model, name))
    # 95 % of 30, pairs of them correlated: two standard errors are 11 points, and these draws hold more.
    assert np.mean(inside) >= 0.83
    assert np.median(widths) < 0.2


def test_without_gains_the_intervals_are_those_of_the_noise():
    runs = runs_of(gain=0.0, noise=0.01)
    damper = fitted(runs)
    known = estimate_uncertainty(damper, runs).uncertainty
    fits = [fitted(runs_of(gain=0.0, noise=0.01, seed=seed)).one_model.values() for seed in range(1, 31)]
    scatter = np.std([[fit[name] for name in known.names] for fit in fits], axis=0)
    c, fy, f0 = np.sqrt(np.diag(known.covariance)) / scatter
    assert (c, f0) == pytest.approx((1.0, 1.0), rel=0.3)
    assert 0.8 < fy < 2.5  # samples at a reversal have the other sign of a velocity, in every cycle and every fit
    few = estimate_uncertainty(damper, runs[:3]).uncertainty
    assert np.all(np.diag(few.covariance) > np.diag(known.covariance))


def linear_parts(damper, runs):
    """Residuals of runs with the columns of Bingham's force and the inverse of their normal matrix."""
    parts = [RunResiduals.of(damper, run) for run in runs]
    motions = [part.prediction.motion for part in parts]
    columns = [np.column_stack([m.velocity, np.sign(m.velocity), np.ones(len(m))])[p.picked]
               for p, m in zip(parts, motions, strict=True)]  # fmt: skip
    return parts, columns, np.linalg.inv(normal_matrix(columns, parts))


def test_information_and_effective_samples_are_those_of_weighted_least_squares():
    """A run's share is that of its residuals in the variance; n independent samples would give the same variance."""
    runs = runs_of(sessions=3, session=0.05)
    runs[2] = replace(runs[2], force=runs[2].force + 0.1 * np.ptp(runs[2].force) * np.sin(40 * runs[2].time))
    damper = fitted(runs)
    known = estimate_uncertainty(damper, runs).uncertainty
    parts, columns, inverse = linear_parts(damper, runs)
    squares = np.array([np.sum((p.weighted(c) @ inverse) ** 2, axis=0) for c, p in zip(columns, parts, strict=True)])
    shares = (squares / squares.sum(axis=0)).mean(axis=1)
    assert list(known.information.values()) == pytest.approx(shares.tolist(), rel=1e-5)
    left = sum(np.sum((p.residual * p.weight) ** 2) for p in parts)
    samples = left * np.diag(inverse) / np.diag(known.covariance)
    most = sum(p.picked.size for p in parts)
    assert list(known.effective.values()) == pytest.approx(np.minimum(samples, most).tolist(), rel=1e-5)
    assert min(samples) < most / 5


def test_noise_counts_by_its_square_however_large_beside_the_force():
    """The same noise ten times smaller: what a run's own gain takes up of it does not grow with it."""
    spreads, doubts = [], []
    for noise in (0.1, 1.0):
        runs = runs_of(gain=0.0, noise=noise)
        spread, doubt = _within(*linear_parts(fitted(runs), runs))
        spreads.append(np.diag(spread)), doubts.append(doubt)
    assert spreads[1] == pytest.approx(100 * spreads[0], rel=0.25)
    alone = runs_of(conditions=CONDITIONS[:1])
    parts, (columns,), inverse = linear_parts(fitted(alone), alone)
    (part,) = parts
    (stretch,) = part.stretches
    table = np.column_stack([stretch.predicted, np.ones(stretch.predicted.size)])
    rest = stretch.residual - table @ np.linalg.lstsq(table, stretch.residual)[0]
    own = inverse * stretch.weight**2
    dof = score_covariance(part.evenly(columns, stretch), rest, stretch.time, stretch.frequency, own)[1]
    assert _within(parts, [columns], inverse)[1] == pytest.approx(2 / dof)  # of a variance with its degrees of freedom


def test_without_cross_validation_the_residuals_of_the_fit_stand_in():
    runs = [replace(r, force=r.force * (1 + 0.1 * np.sin(9 * r.time))) for r in runs_of(noise=0.05)]
    damper = fitted(runs)
    known = estimate_uncertainty(damper, runs).uncertainty
    inside = []
    for part in linear_parts(damper, runs)[0]:
        (steady,) = part.stretches
        measured = steady.predicted - steady.residual
        powers = [np.trapezoid(force * steady.velocity, steady.time) for force in (measured, steady.predicted)]
        peak = np.ptp(measured) / np.ptp(steady.predicted)
        inside.append(PredictedRun(part.run.id, None, steady.predicted, measured, peak, powers[0] / powers[1]))
    error = model_error(inside)
    assert (known.force, known.peak, known.energy) == pytest.approx((error.force, error.peak, error.energy), rel=1e-6)
    assert error.peak != pytest.approx(error.energy, rel=0.1)


def test_a_parameter_rests_on_one_run_of_three_or_more_only():
    """Of one fast run beside slow ones most is known of the viscosity; of two runs it is no news."""
    slow = [Condition(0.5, 0.1, a) for a in (0.001, 0.0011)]
    runs = runs_of(conditions=[Condition(0.5, 2.0, 0.02), *slow], gain=0.0)
    said = " ".join(estimate_uncertainty(fitted(runs), runs).uncertainty.words)
    assert "c is determined mainly by run r0" in said
    assert "determined mainly" not in " ".join(estimate_uncertainty(fitted(runs[:2]), runs[:2]).uncertainty.words)


def test_student_s_interval_holds_its_share_of_errors_drawn_as_the_tests_scatter():
    """A common gain of nine sessions has their degrees of freedom or more, noise alone the many of its samples."""
    runs = runs_of(gain=0.0, session=0.2, noise=1e-4, sessions=9, conditions=CONDITIONS * 3)
    known = estimate_uncertainty(fitted(runs), runs).uncertainty
    assert known.session_dof <= 8
    at = known.names.index("c")
    # The fit is near the median of the sessions, which is the farther off the more they scatter: more than theirs.
    assert known.dof[at] > 0.5 * known.session_dof
    # Noise alone has the many degrees of freedom of its samples.
    still = estimate_uncertainty(fitted(runs_of(gain=0.0)), runs_of(gain=0.0)).uncertainty
    assert np.min(still.dof) > 20


@pytest.mark.parametrize("dof", [4.0, 25.0])
def test_where_no_gain_moves_the_parameters_the_degrees_of_freedom_are_those_within_the_runs(dof):
    still = Draws(np.zeros((1, 1, 2)), np.zeros((200_000, 2)), np.ones((200_000, 2)))
    within = np.diag([4.0, 1e-8])
    spread = _Spread(("c", "fy"), [], within, np.full(2, 2 / dof), still, Effects(), [], np.ones(2), np.ones((1, 2)))
    assert spread.covariance == pytest.approx(within)
    assert spread.dof == pytest.approx(dof, rel=0.1)  # a quantile of 200,000 draws


def test_parameters_that_make_up_for_each_other_leave_no_variance_of_what_both_do():
    """However differently their residuals show it: a factor on one of them alone would make variance from nothing."""
    a = np.random.default_rng(6).standard_normal(600)
    shown = np.column_stack([np.ones(600), a**2])
    draws, within = Draws(np.zeros((600, 1, 2)), np.column_stack([a, -a]), shown), np.zeros((2, 2))
    spread = _Spread(("c", "fy"), [], within, np.zeros(2), draws, Effects(), [], np.ones(2), np.ones((1, 2)))
    assert spread.quantiles[1] < 1.5 < spread.quantiles[0]
    # Where a normal interval would hold more than its share, it is narrower by as much, else as wide.
    assert spread.interval_factor == pytest.approx(np.minimum(spread.quantiles / 1.959964, 1.0), rel=1e-6)
    assert spread.interval_factor[1] < 0.8
    assert np.ones(2) @ spread.covariance @ np.ones(2) == pytest.approx(0.0, abs=1e-12)


def test_intervals_are_as_wide_as_refits_and_no_narrower_than_linearised_fits(monkeypatch):
    rng, names = np.random.default_rng(4), ("c", "fy")
    draws = Draws(np.zeros((600, 3, 2)), rng.standard_normal((600, 2)), np.ones((600, 2)))
    spread = _Spread(names, [], np.eye(2), np.ones(2), draws, Effects(), [], np.ones(2), np.ones((3, 2)))
    start = np.array([[7.0, 5.0]])  # where the fit without gains ends

    def refits(damper, parts, rests, names, shifts, starts):
        assert len(shifts) == len(starts) == 17
        assert not starts[0].any()
        assert not shifts[0].any()
        return start + factor * starts + np.concatenate([np.zeros((1, 2)), departures])

    def widened():
        curved = spread.curved(joint_damper(), [None] * 3)
        assert curved.covariance == pytest.approx(spread.covariance)  # of the force: it hardly changes along the curve
        assert curved.interval_factor == pytest.approx(np.sqrt((1 + curved.wider**2) / 2), rel=0.1)
        return curved.wider

    monkeypatch.setattr("mrdamper.dampers.covariance.refitted", refits)
    departures, factor = np.zeros((16, 2)), 1.5
    assert widened() == pytest.approx([1.5, 1.5])
    factor = 0.1
    assert widened() == pytest.approx([1.0, 1.0])
    departures, factor = np.tile([9.0, 0.0], (16, 1)), 1.0  # all refits are off to one side: their bias
    assert widened() == pytest.approx([9.0 / np.sqrt(2 / np.pi), 1.0], rel=0.15)
    departures = np.zeros((16, 2))
    departures[5] = [16.0, 0.0]  # one refit far off: by mean squares 4 times as wide
    assert 1.5 < widened()[0] < 2.5
    still = replace(spread, draws=replace(draws, moved=np.zeros((600, 2))))
    assert still.curved(joint_damper(), [None] * 3) is still  # no gains, nothing to fit


def test_what_gains_of_other_runs_moved_is_no_error_within_a_run():
    """Parameters that large gains have moved leave the shape of their force in every run's residual."""
    runs = runs_of(gain=0.3, noise=0.002, seed=3)
    parts, columns, inverse = linear_parts(fitted(runs), runs)
    influence = [inverse @ p.weighted(p.weighted(c)).T for c, p in zip(columns, parts, strict=True)]
    moved = GainsAndOffsets(parts, columns, influence).by_gains()
    counted, free = (_within(parts, columns, inverse, by)[0][0, 0] for by in (0.0, moved))
    assert free < 0.5 * counted


def test_other_sessions_show_the_scatter_of_sessions_and_far_runs_the_growth():
    runs = runs_of(sessions=3, session=0.2)
    damper = fitted(runs)
    seen = [PredictedRun.of(r, damper.predict(r).force, damper.predict(r).motion.velocity) for r in runs]
    far = [replace(p, predicted=1.5 * p.predicted, away=partial(Distance, 0.0, 0.5, 0.0)) for p in seen]
    plain = estimate_uncertainty(damper, runs, seen).uncertainty
    for factor in (1.4, 1.01):  # two of three parts of it are the session's own
        others = [replace(p, measured=p.predicted * factor) for p in seen]
        known = estimate_uncertainty(damper, runs, seen, other_sessions=others).uncertainty
        assert known.gain == pytest.approx(np.sqrt(2 / 3) * (factor - 1))
        assert known.offset == pytest.approx(0.0, abs=1e-9)
        assert known.growth == plain.growth
    shifted = [replace(p, measured=p.predicted + 500.0) for p in seen]
    known = estimate_uncertainty(damper, runs, seen, other_sessions=shifted).uncertainty
    assert (known.gain, known.offset) == pytest.approx((0.0, np.sqrt(2 / 3) * 500.0), abs=1e-9)
    known = estimate_uncertainty(damper, runs, seen, away=far).uncertainty
    assert (known.gain, known.offset) == (plain.gain, plain.offset)
    assert known.growth.force[1] > plain.growth.force[1]


def test_a_record_that_is_no_sine_enters_from_where_it_has_moved_by_its_amplitude():
    time = np.linspace(0.0, 8.0, 801)
    path = 0.01 * np.sin(2 * np.pi * (0.3 * time + 0.1 * time**2))
    run = Run("sweep", time, path, 2000 * np.gradient(path, time), 0.5)
    part = RunResiduals.of(TRUTH, run)
    (stretch,) = part.stretches
    assert stretch.frequency is None
    assert stretch.time[[0, -1]] == pytest.approx([0.65, 8.0], abs=0.02)  # before, it has not moved by its amplitude
    assert part.measured == pytest.approx(np.interp(part.prediction.motion.time[part.picked], time, run.force))


def slopes_of(parts):
    """Derivatives of the force by c, fy and f0 at the samples of each run."""
    speeds = [part.prediction.motion.velocity[part.picked] for part in parts]
    return [np.column_stack([v, np.sign(v), np.ones(v.size)]) for v in speeds]


def error_factors(parts, conditions):
    """Variance of the error of the form in a fit without the condition of each run, over that in the fit of all."""
    columns = slopes_of(parts)
    normal, factors = normal_matrix(columns, parts), []
    for condition in conditions:
        own = [k for k, other in enumerate(conditions) if other == condition]
        force = np.concatenate([parts[k].predicted * parts[k].weight for k in own])
        table = np.concatenate([parts[k].weighted(columns[k]) for k in own])
        factors.append(1 / (1 - force @ table @ np.linalg.solve(normal, table.T @ force) / (force @ force)))
    return factors


def test_the_model_error_of_cross_validation_takes_the_place_of_the_residuals():
    runs = runs_of(noise=0.002)
    damper = fitted(runs)
    rng = np.random.default_rng(4)
    seen = []
    for run in runs:
        motion = damper.predict(run).motion
        beyond = 0.1 * np.ptp(run.force) * np.sin(3 * np.pi * 2 * run.time / (run.time[-1] / 6))
        seen.append(PredictedRun.of(run, (run.force + beyond) * (1 + 0.06 * rng.standard_normal()), motion.velocity))
    inside, known = estimate_uncertainty(damper, runs).uncertainty, estimate_uncertainty(damper, runs, seen).uncertainty
    error = model_error(seen)
    assert (known.force, known.peak, known.energy) == (error.force, error.peak, error.energy)
    assert known.run_gain == pytest.approx(np.sqrt(error.gain**2 - known.gain**2))
    assert known.run_offset == pytest.approx(np.sqrt(max(error.offset**2 - known.offset**2, 0.0)))
    assert (known.left_out, known.run_dof) == (9, 8.0)
    assert known.force > 1.3 * inside.force
    assert known.covariance == pytest.approx(inside.covariance)
    assert (inside.left_out, inside.calibration) == (0, None)
    # The intervals hold their share of errors as the fit to all conditions has them, whatever the size of the error.
    made, shares = replace(damper, uncertainty=known), []
    factors = error_factors([RunResiduals.of(damper, run) for run in runs], CONDITIONS)
    for run, prediction, factor in zip(runs, seen, factors, strict=True):
        around = band(made, damper.predict(run), 0.8)
        half = np.interp(np.arange(prediction.predicted.size), [0, prediction.predicted.size], [0, run.time.size])
        width = (around.high - around.low)[half.astype(int)] / 2
        shares.append(np.mean(np.abs(prediction.measured - prediction.predicted) <= width * np.sqrt(factor)))
    assert np.mean(shares) == pytest.approx(0.8, abs=0.1)
    # Twice the error is a model error of twice the size, and the factor of the calibration stays.
    wide = [replace(p, measured=p.predicted + 2 * (p.measured - p.predicted)) for p in seen]
    double = estimate_uncertainty(damper, runs, wide).uncertainty
    assert double.force == pytest.approx(2 * known.force, rel=0.05)
    assert double.calibration.force == pytest.approx(known.calibration.force, rel=0.1)


def test_a_parameter_at_its_bound_is_held_and_one_the_runs_do_not_show_is_named():
    runs = [replace(run, force=run.force - 20) for run in runs_of()]
    held = bingham(2000.0, 0.0, 0.0)
    known = estimate_uncertainty(held, runs).uncertainty
    assert known.one_sided == ("fy",)
    assert "fy" not in known.names
    assert estimate_uncertainty(held, runs, held=["c"]).uncertainty.one_sided == ("c", "fy")
    assert "fy" in estimate_uncertainty(held, runs, bounded=False).uncertainty.names
    assert estimate_uncertainty(held, []) is held


def test_cross_validated_errors_are_over_the_whole_error_model():
    """Parameters, gains and offsets as the folds left them, and the form: their squares add up."""
    conditions = [*CONDITIONS, CONDITIONS[2]]
    drawn = runs_of(sessions=3, session=0.05, conditions=conditions)
    runs = [replace(r, force=r.force + 12 * (i % 3)) for i, r in enumerate(drawn)]
    damper = fitted(runs)
    rng = np.random.default_rng(5)
    seen = []
    for run in runs:
        shifted = run.force * (1 + 0.08 * rng.standard_normal()) + 40 * rng.standard_normal()
        seen.append(PredictedRun.of(run, shifted, damper.predict(run).motion.velocity))
    seen[1] = replace(seen[1], peak=1.3 * seen[1].peak, energy=0.7 * seen[1].energy)
    seen[3] = replace(seen[3], away=partial(Distance, 0.05, 0.2, 0.3))
    seen[6] = replace(seen[6], run_id="recorded later")  # the parameters move it as they move the median run
    known = estimate_uncertainty(damper, runs, seen).uncertainty
    assert known.of_sessions
    assert min(known.run_gain, known.run_offset, known.offset, known.force, known.peak, known.energy) > 0
    error = model_error(seen)
    # A fold that saw two of the three parts of a session's scatter leaves as much in its errors.
    assert known.run_gain == pytest.approx(np.sqrt(error.gain**2 - 2 / 3 * known.gain**2))
    assert known.run_offset == pytest.approx(np.sqrt(error.offset**2 - 2 / 3 * known.offset**2))
    shares, scores, parts = [], [], [RunResiduals.of(damper, run) for run in runs]
    columns, forms = slopes_of(parts), error_factors(parts, conditions)
    normal = normal_matrix(columns, parts)
    for part, condition in zip(parts, conditions, strict=True):
        # Without its condition a fit has (N - N_c)⁻¹ N of the covariance.
        left = [k for k, other in enumerate(conditions) if other != condition]
        rest = normal_matrix([columns[k] for k in left], [parts[k] for k in left])
        root = sqrtm(np.linalg.solve(rest, normal)).real
        covariance = root @ known.covariance @ root.T
        every, velocity = part.prediction.motion.velocity[part.picked], part.stretches[0].velocity
        table = np.column_stack([every, np.sign(every), np.ones(every.size)])
        slopes, predicted = part.evenly(table, part.stretches[0]), part.stretches[0].predicted
        power, *lost = (np.trapezoid(f * velocity, part.stretches[0].time) for f in (predicted, *slopes.T))
        swing = (slopes[predicted.argmax()] - slopes[predicted.argmin()]) / np.ptp(predicted)
        share = np.mean(np.sum(slopes @ covariance * slopes, axis=1)) / (np.ptp(predicted) / 2) ** 2
        shares.append([share, *(d @ covariance @ d for d in (swing, np.array(lost) / power))])
    shares[6], forms[6] = np.median(shares, axis=0), np.median(forms)
    assert 1.1 < min(forms) < max(forms) < 3
    for own, form, prediction in zip(shares, forms, seen, strict=True):
        grown = [known.growth.variance(name, prediction.distance) for name in ("force", "peak", "energy")]
        share, of_peak, of_energy = np.add(own, grown)
        gain = 2 / 3 * known.gain**2 + form * known.run_gain**2
        offset, half = 2 / 3 * known.offset**2 + form * known.run_offset**2, prediction.half
        force = np.sqrt(gain * prediction.predicted**2 + offset + (share + form * known.force**2) * half**2)
        peak, energy = (np.sqrt(v + gain + form * e**2) for v, e in ((of_peak, known.peak), (of_energy, known.energy)))
        scores.append(standardized(prediction, force, peak, energy))
    expected = Calibration.of(seen, scores)
    for name in ("force", "peak", "energy", "coverage"):
        assert getattr(known.calibration, name) == pytest.approx(getattr(expected, name), rel=1e-6)


def test_the_fit_of_one_run_takes_its_gain_and_offset_up():
    (run,) = runs_of(conditions=CONDITIONS[:1])
    known = estimate_uncertainty(fitted([run]), [run]).uncertainty
    assert set(known.names) == {"c", "fy", "f0"}
    assert (known.run_gain, known.run_offset, known.run_dof, known.session_dof) == (0.0, 0.0, 0.0, 0.0)
