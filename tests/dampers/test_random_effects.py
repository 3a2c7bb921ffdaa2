"""Variances of gains and offsets: closed forms of balanced tests, a known truth, exchange of labels, bounds."""

from types import SimpleNamespace

import numpy as np
import pytest

from mrdamper.dampers.random_effects import Draws, Effects, GainsAndOffsets

PHASE = np.linspace(0.0, 2 * np.pi, 120, endpoint=False)
FORCE = 100 * np.sin(PHASE)


class Residuals(SimpleNamespace):
    """Residuals of a run of evenly spaced samples, which counts by its error."""

    information = 1.0

    @property
    def error(self):
        return max(np.sqrt(np.mean(self.residual**2)) / self.scale, 1e-3)

    @property
    def weight(self):
        return np.full(self.picked.size, self.information / self.scale / np.sqrt(self.picked.size * self.error))

    def weighted(self, table):
        return table * self.weight[:, None]


class SampledUnevenly(Residuals):
    """Residuals of a run whose samples count by the time that they stand for."""

    @property
    def weight(self):
        return super().weight / np.sqrt(self.density)


def covariance_of(scatter, effects):
    moved = scatter.draws(effects).moved
    return moved.T @ moved / len(moved)


def runs_of(gains, offsets, sessions, noise=0.0, seed=0):
    rng = np.random.default_rng(seed)
    return [
        Residuals(
            session=s, predicted=FORCE, picked=np.arange(PHASE.size), scale=200.0,
            residual=-(g * FORCE + o) + noise * rng.standard_normal(PHASE.size),
        )
        for g, o, s in zip(gains, offsets, sessions, strict=True)
    ]  # fmt: skip


def effects_of(runs, slope=None, influence=None):
    """Of runs whose fit has absorbed nothing, unless told otherwise."""
    slopes = [np.zeros((PHASE.size, 1)) if slope is None else slope] * len(runs)
    shares = [np.zeros((1, PHASE.size)) if influence is None else influence] * len(runs)
    return GainsAndOffsets(runs, slopes, shares)


def drawn(count, each, seed=0):
    rng = np.random.default_rng(seed)
    names = np.repeat([f"day {i}" for i in range(count)], each)
    shared = np.repeat(rng.standard_normal((count, 2)), each, axis=0) * [0.05, 4.0]
    own = rng.standard_normal((count * each, 2)) * [0.02, 2.0]
    return (shared + own).T, names.tolist()


@pytest.mark.parametrize(("sessions", "each"), [(8, 5), (3, 40)])
def test_balanced_sessions_give_the_analysis_of_variance(sessions, each):
    (gains, offsets), names = drawn(sessions, each)
    found = effects_of(runs_of(gains, offsets, names)).effects()
    for values, session, run in ((gains, found.gain, found.run_gain), (offsets, found.offset, found.run_offset)):
        table = values.reshape(sessions, each)
        within = np.sum((table - table.mean(axis=1, keepdims=True)) ** 2) / (each - 1) / sessions
        between = np.mean(table.mean(axis=1) ** 2) - within / each
        assert run == pytest.approx(np.sqrt(within))
        assert session == pytest.approx(np.sqrt(between))
    assert (found.session_dof, found.run_dof) == (
        pytest.approx(sessions - 1.0), pytest.approx(sessions * (each - 1.0), rel=1e-3),
    )  # fmt: skip


def test_no_variance_is_negative():
    """Residuals that show less than their noise, in one of the forms or in all of them."""
    sessions = np.kron(np.eye(3), np.ones((2, 1)))
    effects = GainsAndOffsets.__new__(GainsAndOffsets)
    vars(effects).update(_designs={0: sessions, 2: np.eye(6)}, _turned=np.eye(6), _noise=np.full(6, 2.0))
    for shown in (np.zeros(6), np.tile([3.0, -3.0], 3), np.full(6, 3.0)):
        assert np.all(effects._variances(shown[None], np.ones((1, 2)))[0] >= 0)
    assert not effects._variances(np.zeros((1, 6)), np.ones((1, 2)))[0].any()


def test_a_truth_is_found_from_many_sessions():
    (gains, offsets), names = drawn(120, 3, seed=1)
    found = effects_of(runs_of(gains, offsets, names, noise=20.0)).effects()
    assert (found.gain, found.run_gain) == pytest.approx((0.05, 0.02), rel=0.2)
    assert (found.offset, found.run_offset) == pytest.approx((4.0, 2.0), rel=0.2)


def test_forms_are_those_of_their_matrices():
    rng = np.random.default_rng(3)
    designs, noise = {0: rng.standard_normal((7, 3)), 2: np.eye(7)}, rng.uniform(0.1, 0.3, 7)
    effects = GainsAndOffsets.__new__(GainsAndOffsets)
    vars(effects).update(_designs=designs, _turned=np.eye(7), _noise=noise)
    shown = 2 * rng.standard_normal((4, 3)) @ designs[0].T + rng.standard_normal((4, 7))
    at = rng.uniform(0.5, 2.0, (4, 2))
    found, inner = effects._variances(shown, at)
    own = [z @ z.T for z in designs.values()]
    for y, variances, row, products in zip(shown, at, found, inner, strict=True):
        inverse = np.linalg.inv(np.diag(noise) + variances[0] * own[0] + variances[1] * own[1])
        weights = [inverse @ v @ inverse for v in own]
        table = [[np.trace(w @ v) for v in own] for w in weights]
        exact = np.linalg.solve(table, [y @ w @ y - np.trace(w @ np.diag(noise)) for w in weights])
        if (exact > 0).all():
            assert row == pytest.approx(exact, rel=1e-6)
        assert products[:3, :3] == pytest.approx(designs[0].T @ inverse @ designs[0], rel=1e-6)
    assert (found > 0).all(axis=1).any()


def test_noise_alone_is_no_scatter_of_gains():
    names = [f"day {i // 4}" for i in range(40)]
    squares = []
    for seed in range(30):
        found = effects_of(runs_of(np.zeros(40), np.zeros(40), names, noise=50.0, seed=seed)).effects()
        squares.append([found.gain**2 + found.run_gain**2, found.offset**2 + found.run_offset**2])
    # Of white noise of 50 N in 120 samples: (50/√120)² over the square of the force, or alone; most is taken off.
    seen = np.array([(50 / np.sqrt(120) / (100 / np.sqrt(2))) ** 2, 50**2 / 120])
    assert np.all(np.mean(squares, axis=0) < 0.25 * seen)


def test_noise_is_averaged_over_time_however_densely_a_part_is_sampled():
    """Noise of 8 N in one half of the time, where two samples stand for one, and of 24 N in the other."""
    (gains, _), _ = drawn(12, 1, seed=9)
    at = np.concatenate([np.repeat(np.arange(60), 2), np.arange(60, 120)])
    noise = np.where(np.arange(120) < 60, 8.0, 24.0) * (-1.0) ** np.arange(120)
    runs = runs_of(gains, np.zeros(12), [None] * 12)
    for run in runs:
        run.predicted, run.residual, run.picked = FORCE[at], (run.residual + noise)[at], np.arange(at.size)
        run.density = np.repeat([2.0, 1.0], [120, 60])
    dense = effects_of([SampledUnevenly(**vars(run)) for run in runs], np.zeros((180, 1)), np.zeros((1, 180)))
    seen = np.mean(gains**2) - dense.effects().run_gain ** 2
    # Of the variance that noise shows, half a cycle sampled twice has half of its half.
    assert seen == pytest.approx(0.75 * (8.0**2 + 24.0**2) / 2 / (FORCE @ FORCE), rel=0.02)


def test_labels_and_order_change_nothing():
    (gains, offsets), names = drawn(6, 3, seed=2)
    plain = effects_of(runs_of(gains, offsets, names)).effects()
    order = np.random.default_rng(0).permutation(18)
    renamed = {f"day {i}": f"{(7 * i) % 11}" for i in range(6)}
    mixed = effects_of(runs_of(gains[order], offsets[order], [renamed[names[i]] for i in order])).effects()
    assert vars(mixed) == pytest.approx(vars(plain))
    doubled = effects_of(runs_of(2 * gains, 2 * offsets, names)).effects()
    assert (doubled.gain, doubled.run_offset) == pytest.approx((2 * plain.gain, 2 * plain.run_offset))


@pytest.mark.parametrize("names", [["a"] * 12, ["a", "b"] * 6, [None] * 12, ["a", "b", None] * 4])
def test_fewer_than_three_known_sessions_are_no_sessions(names):
    (gains, offsets), _ = drawn(12, 1, seed=3)
    found = effects_of(runs_of(gains, offsets, names)).effects()
    assert (found.gain, found.offset, found.session_dof) == (0.0, 0.0, 0.0)
    assert (found.run_gain, found.run_offset) == pytest.approx(
        (np.sqrt(np.mean(gains**2)), np.sqrt(np.mean(offsets**2)))
    )


def test_sessions_of_one_run_each_hold_all_the_scatter():
    (gains, offsets), names = drawn(12, 1, seed=4)
    found = effects_of(runs_of(gains, offsets, names)).effects()
    assert (found.run_gain, found.run_offset, found.run_dof) == (0.0, 0.0, 0.0)
    assert (found.gain, found.offset) == pytest.approx((np.sqrt(np.mean(gains**2)), np.sqrt(np.mean(offsets**2))))


def test_what_the_fit_has_absorbed_is_not_divided_by():
    """A fit of the gain of one run leaves no scatter of gains; a common one leaves a share, which is scaled up."""
    (gains, _), names = drawn(6, 3, seed=5)
    runs, slope = runs_of(gains, np.zeros(18), names), FORCE[:, None]
    own = slope.T / (slope.T @ slope)
    lost = [Residuals(**{**vars(run), "residual": 1e-13 * run.residual}) for run in runs[:1]]
    assert effects_of(lost, slope, own).effects() == Effects()
    mean = float(np.mean(gains))
    left = [Residuals(**{**vars(r), "residual": r.residual + mean * FORCE}) for r in runs]
    found = effects_of(left, slope, own / 18).effects()
    table = (gains - mean).reshape(6, 3)
    within = np.sum((table - table.mean(axis=1, keepdims=True)) ** 2) / 12
    between = np.sum(table.mean(axis=1) ** 2) / 5 - within / 3
    assert found.run_gain == pytest.approx(np.sqrt(within), rel=1e-6)
    assert found.gain == pytest.approx(np.sqrt(between), rel=1e-6)
    assert found.session_dof == pytest.approx(5.0)


@pytest.mark.parametrize("absorbed", [0.98, 0.9])
def test_offsets_are_not_asked_of_runs_that_do_not_show_their_gain(absorbed):
    """Each run has a parameter that takes 98 % of its gain up: what is left is not scaled up by fifty."""
    (gains, offsets), _ = drawn(20, 1, seed=6)
    runs, rows = runs_of((1 - absorbed) * gains, offsets, [None] * 20), np.eye(20)
    slopes = [np.outer(FORCE, row) for row in rows]
    influence = [absorbed * np.outer(row, FORCE) / (FORCE @ FORCE) for row in rows]
    assert GainsAndOffsets(runs, slopes, influence).effects() == Effects()


def test_sessions_of_unequal_size_have_the_degrees_of_freedom_of_satterthwaite():
    names = ["a", "b", *["c"] * 10]
    (gains, offsets), _ = drawn(12, 1, seed=7)
    # Of 12² / (1 + 1 + 100) where sums of squares count each run alike, to 2 of the three sessions.
    assert 12**2 / 102 < effects_of(runs_of(gains, offsets, names)).effects().session_dof <= 2
    # A parameter for each of four kinds of run takes a degree of freedom each.
    slope = np.kron(np.eye(4), np.ones((3, 1)))
    slopes = [np.outer(FORCE, row) for row in slope]
    influence = [np.outer(row, FORCE) / (FORCE @ FORCE) / 3 for row in slope]
    means = np.repeat(gains.reshape(4, 3).mean(axis=1), 3)
    found = GainsAndOffsets(runs_of(gains - means, offsets, [None] * 12), slopes, influence).effects()
    assert found.run_dof == pytest.approx(8.0)


def test_a_scatter_is_found_beside_a_larger_one_that_the_fit_has_mixed_into_it():
    """Gains of 5 % move a parameter that residuals show as offsets: five sessions show offsets of 1 N all the same."""
    slope, errors = (FORCE + 100.0)[:, None], []
    influence = slope.T / (slope.T @ slope) / 20
    for seed in range(20):
        rng = np.random.default_rng(seed)
        gains, offsets = (np.repeat(rng.standard_normal(5), 4) * size for size in (0.05, 1.0))
        runs = runs_of(gains, offsets, [f"day {i // 4}" for i in range(20)], noise=0.2, seed=seed)
        moved = sum(influence @ (g * FORCE + o) for g, o in zip(gains, offsets, strict=True))
        for run in runs:
            run.residual = run.residual + slope @ moved
        found = effects_of(runs, slope, influence).effects()
        errors.append([found.offset / np.std(offsets), found.gain / np.std(gains)])
    # Four of five degrees of freedom are left: √(5 / 4).
    assert np.median(errors, axis=0) == pytest.approx(np.sqrt(5 / 4), rel=0.12)


def test_one_parameter_scatters_as_the_mean_of_gains():
    """A common gain of R runs in S sessions: session² / S + run² / R, whatever draws say of it."""
    names = [f"day {i // 4}" for i in range(20)]
    slope = FORCE[:, None]
    runs = runs_of(np.zeros(20), np.zeros(20), names, noise=60.0)  # beside which gains change no weight
    scatter = effects_of(runs, slope, slope.T / (slope.T @ slope) / 20)
    effects = Effects(gain=0.05, session_dof=4.0, run_gain=0.08, run_dof=19.0)
    expected = 0.05**2 / 5 + 0.08**2 / 20
    assert covariance_of(scatter, effects)[0, 0] == pytest.approx(expected, rel=0.2)  # 600 draws show it to 6 %
    assert not covariance_of(scatter, Effects()).any()
    assert np.array_equal(scatter.draws(Effects()).shown, np.ones((600, 1)))
    # An offset moves a parameter of the gain nowhere.
    assert covariance_of(scatter, Effects(offset=5.0, run_offset=5.0))[0, 0] == pytest.approx(0.0, abs=1e-20)


@pytest.mark.parametrize("unit", [1e3, pytest.param(1.0, marks=pytest.mark.slow)])
def test_draws_show_a_variance_with_the_degrees_of_freedom_behind_it(unit):
    """One parameter that gains move and offsets do not; the unit of the force drops out."""
    force, slope = unit * FORCE, unit * FORCE[:, None]
    runs = runs_of(np.zeros(40), np.zeros(40), [f"day {i // 4}" for i in range(40)], noise=60.0)
    for run in runs:
        run.predicted, run.residual, run.scale = force, unit * run.residual, unit * run.scale
    scatter = effects_of(runs, slope, slope.T / (slope.T @ slope) / 40)
    for effects, fewest, most in (
        (Effects(gain=0.05, offset=8.0 * unit, session_dof=9.0), 6.0, 12.0),
        # Of runs alone: scatter between sessions, which is not there, is estimated beside theirs.
        (Effects(run_gain=0.05, run_offset=8.0 * unit, run_dof=39.0), 9.0, 30.0),
    ):
        shown = scatter.draws(effects).shown[:, 0]
        assert 0.97 < np.mean(shown) < 1.15  # an absent variance is estimated above zero in half of the draws
        assert fewest < 2 / np.var(shown) < most


def test_gains_that_the_residuals_show_are_taken_out_with_what_they_moved():
    """Of two parameters that gains of the runs have moved, nothing is left of the residuals but their noise."""
    rng = np.random.default_rng(8)
    gains, slope = rng.standard_normal(12) * 0.05, np.column_stack([FORCE**3 / 1e4, np.abs(FORCE) + FORCE + 20.0])
    influence = np.linalg.solve(12 * slope.T @ slope, slope.T)
    moved = influence @ np.outer(FORCE, gains).sum(axis=1)
    runs = runs_of(gains, np.zeros(12), [None] * 12)
    for run in runs:
        run.residual = run.residual + slope @ moved
    scatter = effects_of(runs, slope, influence)
    for rest in scatter.rests:
        assert rest == pytest.approx(0.0, abs=1e-9)


def test_runs_far_off_pull_less_than_their_gain_would_say():
    """Beside small residuals runs are weighed by their distance: the common gain is nearly the median of theirs."""
    names = [f"day {i}" for i in range(40)]
    runs, slope = runs_of(np.zeros(40), np.zeros(40), names), FORCE[:, None]
    scatter = effects_of(runs, slope, slope.T / (slope.T @ slope) / 40)
    variance = covariance_of(scatter, Effects(run_gain=0.05, run_dof=39.0))[0, 0]
    assert 1.2 < variance / (0.05**2 / 40) < 1.8  # of a median: π / 2


def test_a_run_counts_the_less_the_noisier_it_is():
    """Weighted by one over its error, a run of a tenth of the noise moves a common gain ten times as much."""
    noises = np.array([20.0] + [200.0] * 19)
    slope, runs = FORCE[:, None], []
    for seed, noise in enumerate(noises):
        runs += runs_of([0.0], [0.0], [None], noise=noise, seed=seed)
    effects = Effects(run_gain=0.02, run_dof=19.0)
    scatter = effects_of(runs, slope, slope.T / (slope.T @ slope) / 20)
    share = (1 / noises) / np.sum(1 / noises)
    assert covariance_of(scatter, effects)[0, 0] == pytest.approx(0.02**2 * np.sum(share**2), rel=0.2)
    # Its own gain and offset are no noise.
    moved = scatter.draws(effects).moved
    for run, gain in zip(runs, np.linspace(-0.5, 0.5, 20), strict=True):
        run.residual = run.residual + gain * (FORCE + 80.0)
    found = effects_of(runs, slope, slope.T / (slope.T @ slope) / 20).draws(effects).moved
    assert found == pytest.approx(moved, rel=1e-6, abs=1e-9)


def test_a_run_counts_by_the_square_of_its_information():
    """As in the joint fit, whose residuals it multiplies."""
    slope, runs = FORCE[:, None], runs_of(np.zeros(20), np.zeros(20), [None] * 20, noise=60.0)
    informations = np.array([3.0] + [1.0] * 19)
    for run, information in zip(runs, informations.tolist(), strict=True):
        run.information = information
    variance = covariance_of(effects_of(runs, slope), Effects(run_gain=0.02, run_dof=19.0))[0, 0]
    share = informations**2 / np.sum(informations**2)
    assert variance == pytest.approx(0.02**2 * np.sum(share**2), rel=0.2)


def test_a_run_counts_by_its_relative_error_whatever_its_force():
    runs = runs_of(np.zeros(20), np.zeros(20), [None] * 20, noise=60.0)
    slopes = []
    for k, run in enumerate(runs):
        size = 10.0 ** (k % 3)
        if k % 2:  # nor however long it is
            run.predicted, run.residual = np.tile(run.predicted, 36), np.tile(run.residual, 36)
            run.picked = np.arange(run.predicted.size)
        run.predicted, run.residual, run.scale = size * run.predicted, size * run.residual, size * run.scale
        slopes.append(run.predicted[:, None])
    scatter = GainsAndOffsets(runs, slopes, [s.T / (s.T @ s) / 20 for s in slopes])
    variance = covariance_of(scatter, Effects(run_gain=0.08, run_dof=19.0))[0, 0]
    assert variance == pytest.approx(0.08**2 / 20, rel=0.2)


@pytest.mark.parametrize("count", [3, 15])
def test_representative_draws_have_no_mean_and_the_mean_squares_of_all(count):
    for seed in range(5):
        moved = np.random.default_rng(seed).standard_normal((600, count)) * np.logspace(-3, 3, count)
        draws = Draws(np.zeros((600, 1, 2)), moved, np.ones(moved.shape))
        chosen, unit = draws.representative(16), np.sqrt(np.mean(moved**2, axis=0))
        assert len(chosen) == 16
        assert np.mean(moved[chosen], axis=0) / unit == pytest.approx(np.zeros(count), abs=0.2)
        assert np.mean(moved[chosen] ** 2, axis=0) == pytest.approx(unit**2, rel=0.25)
