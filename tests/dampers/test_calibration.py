"""Calibrated intervals: closed forms, equivariance, exchange of labels, coverage of a known truth."""

import warnings
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

from mrdamper.dampers.calibration import (
    LEVELS,
    Calibration,
    Growth,
    ModelError,
    PredictedRun,
    _squared_errors,
    measured_peak,
    model_error,
    scatter_between_sessions,
    standardized,
)
from mrdamper.dampers.distance import Distance
from mrdamper.data import Run

TIME = np.linspace(0.0, 1.0, 201)
SWING = 100 * np.sin(2 * np.pi * TIME)


def run(name, error=0.0, session=None, peak=1.0, energy=1.0):
    return PredictedRun(name, session, SWING, SWING + error, np.atleast_1d(peak), np.atleast_1d(energy))


def scored(force, peak=1.0, energy=1.0):
    return {"force": np.atleast_1d(force), "peak": np.atleast_1d(peak), "energy": np.atleast_1d(energy)}


def calibrated(scores, sessions=None):
    names = sessions or [None] * len(scores)
    return Calibration.of([run(f"r{i}", session=s) for i, s in enumerate(names)], scores)


def alike(a, b):
    return all(getattr(a, n) == pytest.approx(getattr(b, n)) for n in ("force", "peak", "energy", "coverage"))


def test_a_run_is_compared_inside_its_window_with_what_it_takes_out_of_the_motion():
    velocity = np.cos(2 * np.pi * TIME)
    force = 50 * velocity
    record = Run("r", TIME, np.sin(2 * np.pi * TIME), 1.2 * force + 3, 0.0, window=(0.0, 0.75), notes={"session": "a"})
    found = PredictedRun.of(record, force, velocity)
    assert (found.run_id, found.session) == ("r", "a")
    asked = []
    far = PredictedRun.of(record, force, velocity, lambda: asked.append("far") or Distance(motion=0.5))
    assert not asked  # a study asks for the distances of the selected damper alone
    assert (far.distance, far.distance, asked) == (Distance(motion=0.5), Distance(motion=0.5), ["far"])
    assert found.peak == pytest.approx(1.2)
    inside = TIME <= 0.75
    power = [np.trapezoid(f[inside] * velocity[inside], TIME[inside]) for f in (1.2 * force + 3, force)]
    assert found.energy == pytest.approx(power[0] / power[1])
    assert found.measured == pytest.approx(1.2 * found.predicted + 3)
    assert (found.reading.gain, found.reading.offset) == pytest.approx((1.2, 3.0))
    assert found.half == pytest.approx(50.0)
    assert found.predicted.size == np.sum(inside)  # some hundred samples are not thinned
    small = replace(found, predicted=1e-4 * found.predicted, measured=1e-4 * found.measured)
    assert (small.reading.gain, small.reading.offset) == pytest.approx((1.2, 3e-4))
    parts = [found, *(replace(found, peak=np.array([p]), energy=np.array([e])) for p, e in ((1.4, 0.9), (2.5, 2.0)))]
    both = PredictedRun.joined("whole", parts)
    assert (both.run_id, both.session) == ("whole", "a")
    assert both.peak == pytest.approx([1.2, 1.4, 2.5])
    assert both.energy == pytest.approx([*found.energy, 0.9, 2.0])
    assert both.predicted == pytest.approx(np.tile(found.predicted[::3], 3))
    assert both.measured == pytest.approx(np.tile(found.measured[::3], 3))
    still = replace(found, predicted=np.full(5, 7.0), measured=np.full(5, 9.0))
    assert (still.reading.gain, still.reading.offset) == pytest.approx((1.0, 2.0))  # a constant shows no gain
    assert still.half == 1.0  # nor a swing: errors are then in N


def test_peaks_do_not_depend_on_the_place_of_the_piston_nor_on_the_time_of_a_cycle():
    """Two cycles of changing current have a loop each; less than a cycle has its own peak."""
    turns = np.linspace(0.0, 2.05, 412)
    force = 100 * np.sin(2 * np.pi * turns)
    force[:200] *= 1.3
    for frequency in (0.25, 1.0, 4.0):
        time, size = turns / frequency, np.where(turns < 1, 0.01, 0.002)
        for place in (0.0, 1.0):
            path = place + 0.01 * np.sin(2 * np.pi * turns)
            record = Run("r", time, path, force, np.where(turns < 1, 0.0, 1.0))
            found = PredictedRun.of(record, 100 * np.sin(2 * np.pi * turns), np.gradient(path, time))
            assert found.peak == pytest.approx([1.3, 1.0], abs=0.15)
            less = record.part(20, 160)  # a rise, a fall and half a rise: its halves have smaller peaks
            assert measured_peak(less) == pytest.approx(np.ptp(less.force) / 2)
            uneven = replace(record, displacement=place + size * np.sin(2 * np.pi * turns))
            assert PredictedRun.of(uneven, force, np.gradient(path, time)).peak.size == 1  # the second hardly moves


def test_squared_errors_are_means_and_count_as_one_where_there_is_no_number():
    uneven = np.concatenate([np.zeros(150), np.linspace(0.0, 30.0, 51)])
    peak, energy = np.array([1.0, 1.1, np.nan, 1.3]), np.array([np.inf, 0.5, 1.0, 1.0])
    found = _squared_errors(run("r", uneven, peak=peak, energy=energy))
    half = np.ptp(SWING) / 2
    assert found == pytest.approx([np.mean(uneven**2) / half**2, (0.01 + 1 + 0.09) / 4, (1 + 0.25) / 4])
    assert _squared_errors(run("r", np.inf))[0] == 1.0


def test_the_peak_of_several_cycles_is_that_of_most_of_them():
    """The start of a motion and a spike are in few cycles; noise of many cycles does not add up."""
    time = np.arange(0.0, 10.0, 0.002)
    force = 100 * np.sin(2 * np.pi * time)
    struck = force.copy()
    struck[20], struck[2300] = 400.0, -300.0
    one = Run("a", time, 0.01 * np.sin(2 * np.pi * time), struck, 0.0)
    assert measured_peak(one) == pytest.approx(100.0, rel=1e-3)
    compared = PredictedRun.of(one, force, np.gradient(0.01 * np.sin(2 * np.pi * time), time))
    assert compared.peak == pytest.approx([1.0], rel=1e-3)


def test_a_record_of_changing_current_is_compared_cycle_by_cycle():
    """Errors of its currents cancel over the record; a prediction is asked for one of them."""
    time = np.linspace(0.0, 40.0, 4001)
    velocity = 2 * np.pi * np.cos(2 * np.pi * time)
    current = np.where(time < 20, 0.0, 1.0)
    force = 50 * velocity
    measured = np.where(time < 20, 0.9, 1.1) * force
    record = Run("r", time, np.sin(2 * np.pi * time), measured, current)
    found = PredictedRun.of(record, force, velocity)
    assert found.peak.size == found.energy.size == 40
    for ratios in (found.peak, found.energy):
        assert np.median(np.abs(ratios - 1)) == pytest.approx(0.1)
        assert ratios.mean() == pytest.approx(1.0, abs=0.01)
    alone = PredictedRun.of(replace(record, current=np.zeros(time.size)), force, velocity)
    assert alone.energy == pytest.approx([1.0], abs=0.01)
    error = model_error([found])
    assert (error.peak, error.energy) == pytest.approx((0.1, 0.1), rel=0.05)
    # At rest in one half: cycles that do not move have no loop.
    still = np.where(time < 20, 0.0, np.sin(2 * np.pi * time))
    half = PredictedRun.of(replace(record, displacement=still), force, velocity)
    assert 18 <= half.peak.size <= 30
    assert half.peak == pytest.approx(1.1, abs=0.1)


def test_the_model_error_is_what_gain_and_offset_leave():
    beyond = 4 * np.cos(2 * np.pi * TIME)
    gains, offsets = (0.9, 1.1, 1.1), (-6.0, 6.0, 6.0)
    runs = [
        replace(run(str(i)), measured=g * SWING + o + beyond, peak=np.array([1.05 * g]), energy=np.array([0.9 * g]))
        for i, (g, o) in enumerate(zip(gains, offsets, strict=True))
    ]
    found = model_error(runs)
    # A cosine sampled with both its ends is not quite at right angles to a constant.
    assert found.force == pytest.approx(4 / np.sqrt(2) / 100, rel=0.01)
    assert (found.peak, found.energy) == pytest.approx((0.05, 0.1), rel=0.01)
    assert (found.gain, found.offset) == pytest.approx((1.4826 * 0.1, 1.4826 * 6), rel=0.01)


def test_the_model_error_is_the_mean_square_over_samples_and_runs_of_uneven_errors():
    rng = np.random.default_rng(6)
    runs = [
        run(str(i), size * rng.exponential(1.0, TIME.size), peak=1 + size / 50, energy=1 - size / 30)
        for i, size in enumerate((1.0, 2.0, 30.0, 3.0))
    ]
    squares, gains = [], []
    for each in runs:
        gain, offset = np.polyfit(each.predicted, each.measured, 1)
        squares.append(np.mean((each.measured - gain * each.predicted - offset) ** 2) / 100**2)
        gains.append(gain)
    found = model_error(runs)
    assert found.force == pytest.approx(np.sqrt(np.mean(squares)), rel=1e-3)
    assert found.gain == pytest.approx(1.4826 * np.median(np.abs(np.array(gains) - 1)))
    for name in ("peak", "energy"):
        over = np.concatenate([getattr(each, name) for each in runs]) / gains - 1
        assert getattr(found, name) == pytest.approx(np.sqrt(np.mean(over**2)))
    # An energy that cannot be compared, or a gain that is none, takes no part.
    infinite, nine = np.array([np.inf]), np.array([9.0])
    lost = [*runs, replace(runs[0], energy=infinite), replace(runs[0], measured=-runs[0].predicted, peak=nine)]
    assert model_error(lost).energy == pytest.approx(model_error([*runs]).energy)
    assert model_error([*runs, replace(runs[0], measured=-SWING, peak=nine)]).peak == pytest.approx(found.peak)


def test_every_run_counts_alike_in_the_model_error_however_many_loops_it_has():
    loops = [np.array([1.1]), np.array([1.0, 1.02, 1.3, 0.98]), np.array([0.97, 1.01, np.inf])]
    runs = [replace(run(str(i)), peak=each, energy=each[::-1]) for i, each in enumerate(loops)]
    finite = [each[np.isfinite(each)] for each in loops]
    expected = np.sqrt(np.mean([np.mean((each - 1) ** 2) for each in finite]))
    assert model_error(runs).peak == model_error(runs).energy == pytest.approx(expected)


def test_a_record_of_changing_frequency_is_compared_loop_by_loop():
    time = np.linspace(0.0, 12.0, 2401)
    turns = np.where(time < 4, time, 2 * time - 4)  # four cycles, sixteen twice as fast
    size = np.where(time < 10, 0.02, 0.002)  # the last ones have no loop worth the name
    path, velocity = size * np.sin(2 * np.pi * turns), np.cos(2 * np.pi * turns)
    factor = np.where(time < 6, 1.2, 0.9)
    found = PredictedRun.of(Run("r", time, path, factor * 50 * velocity, 0.0), 50 * velocity, velocity)
    late = PredictedRun.of(Run("r", time + 100.0, path, factor * 50 * velocity, 0.0), 50 * velocity, velocity)
    assert late.peak == pytest.approx(found.peak)  # whenever its clock begins
    count = found.peak.size
    assert 10 < count < 19
    assert np.mean(np.isclose(found.peak, 1.2) | np.isclose(found.peak, 0.9)) > 0.85
    assert np.isclose(found.energy, 1.2).any() & np.isclose(found.energy, 0.9).any()
    steady = PredictedRun.of(Run("r", TIME, np.sin(2 * np.pi * TIME), SWING, 0.0), SWING, np.cos(2 * np.pi * TIME))
    assert steady.peak.size == 1


def test_peaks_are_calibrated_as_split_conformal_prediction():
    """The (n + 1) level-th smallest of n scores, between its neighbours where that is no whole number."""
    for count in (9, 14, 39):
        scores = np.random.default_rng(count).permutation(np.arange(1.0, count + 1))
        found = calibrated([scored(1.0, peak=p, energy=2 * p) for p in scores])
        for level, peak, energy in zip(LEVELS, found.peak, found.energy, strict=False):
            k = (count + 1) * level  # the k-th smallest score is k
            assert peak == pytest.approx(k / ndtri((1 + level) / 2))
            assert energy == pytest.approx(2 * peak)
        assert len(found.peak) == sum(level <= count / (count + 1) + 1e-12 for level in LEVELS)


def test_peaks_of_few_runs_are_covered_at_the_level_and_not_above():
    """Twelve runs at 90 %: the largest of them alone would cover 12 of 13."""
    rng, count, repeats = np.random.default_rng(8), 12, 800
    values = np.sort(np.abs(rng.standard_normal((repeats, count))), axis=1)
    limits = [calibrated([scored(1.0, peak=p) for p in row]).factor("peak", 0.9) * ndtri(0.95) for row in values]
    covered = 2 * ndtr(limits) - 1  # of a run to come
    # A distribution that thins out is covered a little above the level; three standard errors are 0.9 points.
    assert 0.9 - 0.009 <= np.mean(covered) <= 0.915
    assert calibrated([scored(1.0, peak=np.inf)] * 12).factor("peak", 0.9) == 1e3


def test_few_units_reach_a_lower_level_and_say_so():
    found = calibrated([scored(1.0, peak=p) for p in (1.0, 2.0, 3.0, 4.0)])
    assert found.reachable == found.level == pytest.approx(0.8)
    assert found.summary.startswith("80 % prediction intervals covered")
    assert found.summary.endswith(
        "of 4 cross-validated runs (conditions omitted, not currents); 90 % requires 9 independent runs"
    )
    assert found.factor("peak", 0.99) == found.factor("peak", 0.8) == pytest.approx(4 / ndtri(0.9))
    assert replace(found, peak=()).factor("peak", 0.9) == 1.0
    many = calibrated([scored(1.0, peak=p) for p in np.arange(1.0, 40)])
    assert many.level == 0.9
    assert "requires" not in many.summary


@pytest.mark.parametrize("size", [1.0, 0.4, 3.0])
def test_samples_of_a_true_error_model_need_its_own_factor(size):
    rng = np.random.default_rng(1)
    found = calibrated([scored(size * np.abs(rng.standard_normal(400)), peak=0.0) for _ in range(60)])
    assert found.force == pytest.approx([size] * len(found.force), rel=0.05)
    assert found.coverage[0] == pytest.approx(0.9, abs=0.01)
    assert found.peak == (0.0,) * len(found.peak)


def test_peaks_of_many_loops_are_pooled_as_samples_are():
    rng = np.random.default_rng(5)
    found = calibrated([scored(1.0, peak=np.abs(rng.standard_normal(400))) for _ in range(4)])
    assert found.peak == pytest.approx([1.0] * len(found.peak), rel=0.1)


@pytest.mark.parametrize("loops", [2, 3])
def test_runs_of_several_loops_are_pooled_and_one_of_a_single_loop_makes_room_for_a_run_to_come(loops):
    values = np.arange(1.0, 20 * loops + 1).reshape(loops, 20).T
    pooled = calibrated([scored(1.0, peak=row) for row in values])
    for level, factor in zip(LEVELS, pooled.peak, strict=False):
        smallest = np.sort(values.ravel())[int(np.ceil(level * values.size - 1e-9)) - 1]
        assert factor == pytest.approx(smallest / ndtri((1 + level) / 2))
    single = calibrated([scored(1.0, peak=values[0].mean()), *(scored(1.0, peak=row) for row in values[1:])])
    assert all(a > b for a, b in zip(single.peak[-2:], pooled.peak[-2:], strict=True))


def test_what_a_unit_is_called_and_how_long_a_run_is_changes_nothing():
    rng = np.random.default_rng(2)
    scores = [scored(np.abs(rng.standard_normal(50)), *np.abs(rng.standard_normal(2))) for _ in range(20)]
    plain = calibrated(scores)
    assert alike(calibrated(scores[::-1]), plain)
    longer = [{**s, "force": np.tile(s["force"], 7)} if i % 2 else s for i, s in enumerate(scores)]
    assert alike(calibrated(longer), plain)
    # Every run twice in a session: units of two alike are units of one.
    names = [f"day {i}" for i in range(20)] * 2
    doubled = calibrated([*scores, *scores], names)
    assert (doubled.unit, doubled.units) == ("session", 20)
    assert alike(doubled, plain)
    assert calibrated([*scores, *scores], [n if i % 9 else None for i, n in enumerate(names)]).unit == "run"
    assert calibrated(scores[:16], [f"day {i // 2}" for i in range(16)]).unit == "run"  # eight sessions are too few
    assert calibrated(scores[:18], [f"day {i // 2}" for i in range(18)]).unit == "session"


def test_peaks_of_runs_to_come_are_covered_whatever_their_distribution():
    rng = np.random.default_rng(3)
    inside = []
    for _ in range(120):
        values = np.abs(rng.standard_t(2, 15))
        found = calibrated([scored(1.0, peak=p) for p in values[:14]])
        inside.append(values[14] <= found.factor("peak", 0.9) * ndtri(0.95))
        assert found.coverage[1] >= 12 / 14
    # 14 of 15 at 90 %; three standard errors of 120 are 7 points.
    assert np.mean(inside) >= 14 / 15 - 0.07


def test_coverage_is_found_without_the_unit_that_is_covered():
    found = calibrated([scored(1.0, peak=1.0)] * 20 + [scored(5.0, peak=5.0, energy=0.5)])
    assert found.coverage == pytest.approx((20 / 21, 20 / 21, 1.0))


def test_every_run_of_a_unit_counts_in_its_coverage():
    """Nine sessions of three runs, one of them far off by as much as its rank: a third of three sessions is missed.

    Of 8 others at the level 8/9 the sixth outlier is the limit: those of rank 7, 8 and 9 are beyond it.
    """
    scores = [scored(size) for rank in range(1, 10) for size in (0.1, 0.1, 10.0 * rank)]
    found = calibrated(scores, [f"day {i // 3}" for i in range(27)])
    assert found.unit == "session"
    assert found.coverage[0] == pytest.approx((6 + 3 * 2 / 3) / 9)


def test_coverage_of_few_units_is_at_the_level_that_the_others_reach():
    """Of 2 units one is left for each: it reaches a half, the median of its samples."""
    low, high = np.arange(1.0, 10.0), np.arange(1.0, 10.0) + 0.5
    found = calibrated([scored(low), scored(high)])
    assert found.coverage[0] == pytest.approx(((low <= 5.5).mean() + (high <= 5.0).mean()) / 2)


def test_errors_are_over_their_standard_deviations():
    at = run("r", error=np.where(TIME < 0.5, 6.0, -3.0), session="a", peak=0.9, energy=1.3)
    found = standardized(at, np.full(TIME.size, 2.0), 0.05, 0.1)
    assert found["force"] == pytest.approx(np.where(TIME < 0.5, 3.0, 1.5))
    assert (found["peak"], found["energy"]) == (pytest.approx([2.0]), pytest.approx([3.0]))
    exact = standardized(run("r"), np.zeros(TIME.size), 0.0, 0.0)
    assert not np.any(np.concatenate([*exact.values()]))
    assert np.isinf(standardized(run("r", energy=np.inf), np.ones(TIME.size), 1.0, 1.0)["energy"]).all()


@pytest.mark.parametrize(("gain", "offset"), [(0.0, 0.0), (0.05, 7.0)])
def test_errors_grow_with_the_distance_from_the_tests_as_they_were_made(gain, offset):
    at_tests = ModelError(force=0.02, peak=0.01, energy=0.03, gain=gain, offset=offset)
    moved = gain**2 * np.mean(SWING**2) / 100**2 + (offset / 100) ** 2  # by a gain and an offset of the run
    ways = [Distance(b, e, m) for b, e, m in ((0.0, 0.0, 0.0), (0.06, 0.0, 0.0), (0.0, 0.4, 0.0), (0.0, 0.3, 0.8))]
    runs = []
    for way in ways:
        peak, energy = (
            1 + np.sqrt(gain**2 + own**2 + g @ way.squares) for own, g in ((0.01, PEAK**2), (0.03, ENERGY**2))
        )
        error = np.sqrt(moved + 0.02**2 + FORCE**2 @ way.squares) * np.ptp(SWING) / 2
        runs.append(replace(run("r", error, peak=peak, energy=energy), away=lambda way=way: way))
    found = Growth.of(runs, at_tests)
    assert found.force == pytest.approx(beside_typical(FORCE))
    assert found.peak == pytest.approx(beside_typical(PEAK))
    assert found.energy == pytest.approx(beside_typical(ENERGY))
    assert found.variance("peak", ways[2]) == pytest.approx((0.4 * beside_typical(PEAK)[1]) ** 2)
    unshown = Growth.of(runs[:1], at_tests)
    assert unshown.force == unshown.peak == unshown.energy == tuple(TYPICAL)
    assert (found.dof, unshown.dof) == ((2.0, 2.0, 2.0), (1.0, 1.0, 1.0))
    one = Growth.of(runs[:2], at_tests)
    assert one.peak == pytest.approx((beside_typical(PEAK)[0], *TYPICAL[1:]))
    assert one.dof == (2.0, 1.0, 1.0)
    far = Growth.of(
        [replace(run("r", peak=1e4), away=lambda: ways[2])], at_tests
    )  # beyond ten it is no longer told apart
    assert far.peak[1] == pytest.approx(np.sqrt((10.0**2 + TYPICAL[1] ** 2) / 2))
    # An energy that cannot be compared is wrong by all of it.
    lost, twice = (Growth.of([replace(run("r", energy=e), away=lambda: ways[1])], at_tests) for e in (np.inf, 2.0))
    assert lost == twice
    none = Growth.of(
        [replace(run("r"), away=lambda way=way: way) for way in ways], at_tests
    )  # better than at the tests
    assert none.force == none.energy == pytest.approx(beside_typical(0.0))


def test_a_distance_widens_by_student_s_quantile_of_its_own_degrees_of_freedom():
    growth, way = Growth(tuple(FORCE), tuple(PEAK), tuple(ENERGY), (1.0, 2.0, 1e9)), Distance(0.3, 0.4, 0.8)
    for quantity, each in (("force", FORCE), ("peak", PEAK), ("energy", ENERGY)):
        for level, quantiles in ((0.5, (1.0, np.sqrt(2 / 3), 0.6744898)), (0.9, (6.3137515, 2.9199856, 1.6448536))):
            expected = np.sqrt(np.square(each * np.array(quantiles)) @ way.squares)
            assert growth.half_width(quantity, way, level) == pytest.approx(expected)


def test_the_scatter_at_the_tests_is_no_growth():
    """Errors away from the tests as at them: their mean square in excess of these is nothing."""
    at_tests = ModelError(force=0.02, peak=0.02, energy=0.02, gain=0.0, offset=0.0)
    errors = 0.02 * np.sqrt(2) * np.array([1.0, 0.0, 1.0, 0.0])
    way = Distance(0.0, 0.0, 0.5)
    runs = [
        replace(run("r", e * np.ptp(SWING) / 2, peak=1 + e, energy=1 - e), away=lambda way=way: way) for e in errors
    ]
    found = Growth.of(runs, at_tests)
    for quantity in ("force", "peak", "energy"):
        assert getattr(found, quantity) == pytest.approx((*TYPICAL[:2], TYPICAL[2] / np.sqrt(2)))


TYPICAL = np.array([0.15, 0.25, 0.25])


def test_the_error_that_the_parameters_account_for_is_no_growth():
    way, error = Distance(0.0, 0.0, 0.5), 0.3
    runs = [
        replace(run("r", error * np.ptp(SWING) / 2, peak=1 + error, energy=1 - error), away=lambda way=way: way)
    ] * 4
    nothing = ModelError(force=0.0, peak=0.0, energy=0.0, gain=0.0, offset=0.0)
    for share in (0.0, 0.75, 1.0):
        found = Growth.of(runs, nothing, {"r": np.full(3, share * error**2)})
        motion = np.sqrt(((1 - share) * error**2 / 0.5**2 + TYPICAL[2] ** 2) / 2)
        for quantity in ("force", "peak", "energy"):
            assert getattr(found, quantity)[2] == pytest.approx(motion)


def test_the_curvature_over_the_velocity_counts_as_much_as_the_folds():
    """Of the typical growth, that of the folds and that by curvature the squares have their mean."""
    nothing = ModelError(force=0.0, peak=0.0, energy=0.0, gain=0.0, offset=0.0)
    fold = [replace(run("r", 0.1 * np.ptp(SWING) / 2, peak=1.1, energy=0.9), away=partial(Distance, 0.0, 0.0, 0.5))]
    curvature = np.array([0.3, 0.4, 0.5])
    for runs, shown in ((fold, [0.2]), ([], [])):
        found = Growth.of(runs, nothing, curvature=curvature)
        for quantity, own in zip(("force", "peak", "energy"), curvature, strict=True):
            motion = np.sqrt(np.mean(np.square([TYPICAL[2], own, *shown])))
            assert getattr(found, quantity) == pytest.approx((*TYPICAL[:2], motion))
        assert found.dof == (1.0, 1.0, 2.0 + len(shown))


def beside_typical(growth):
    return np.sqrt((np.square(growth) + TYPICAL**2) / 2)


FORCE, PEAK, ENERGY = np.array([0.5, 0.2, 0.1]), np.array([0.4, 0.3, 0.15]), np.array([0.8, 0.1, 0.25])


def test_the_scatter_between_sessions_is_that_of_their_means():
    gains = {"a": (1.02, 1.06), "b": (0.9, 0.91, 1.01), "c": (1.0,)}
    runs = [
        replace(run("r", session=name), measured=g * SWING + 10 * (g - 1)) for name, each in gains.items() for g in each
    ]
    gain, offset = scatter_between_sessions(runs)
    assert gain == pytest.approx(np.sqrt((0.04**2 + 0.06**2 + 0.0) / 3 * 2 / 3))
    assert offset == pytest.approx(10 * gain)
    assert scatter_between_sessions(runs[::-1]) == pytest.approx((gain, offset))
    # The gain of a session beyond the currents of the others is that of an extrapolation.
    far = replace(run("r", session="d"), measured=8 * SWING, away=lambda: Distance(beyond=1.2))
    assert scatter_between_sessions([*runs, far])[0] == pytest.approx(gain * np.sqrt(3 / 2 * 3 / 4))
    assert scatter_between_sessions([runs[0], far]) is None


def test_a_ratio_whose_square_overflows_counts_as_one_without_a_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert _squared_errors(run("a", peak=1e200, energy=np.inf)).tolist() == [0.0, 1.0, 1.0]
