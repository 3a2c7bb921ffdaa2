"""Laws of the hysteresis first, then the vectors of the method, then independent numerics."""

import json
import math
from functools import cache
from pathlib import Path as File

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.special import hyp2f1, iv

from mrdamper.errors import ExcitationError, ParameterError
from mrdamper.physics.hysteresis import (
    Shape,
    dissipates,
    follow,
    loop_harmonics,
    steady_loop,
    step,
    z_max,
)
from mrdamper.physics.motion import Path

# Rounding of closed forms, and of tables whose own error is near 1e-14 for these n.
ROUNDING = 1e-12
# Leaving a reversal at −1 multiplies an error by up to 1/(1 − rho) or 1 + |rho|, 31 in these tests,
# and the tables of n = 7.3 hold 3e-12 there.
LEAVING = 1e-10
# What other n promise over the whole range of n and rho.
TABLE = 1e-8

exponents = st.sampled_from([1.0, 1.5, 2.0, 3.0, 7.3])
asymmetries = st.sampled_from([-30.0, -2.0, -1.0, -1e-7, 0.0, 1e-7, 0.4, 0.95])
shapes = st.builds(Shape, st.floats(1.0, 1e5), asymmetries, exponents)
# Whole micrometres: repeated samples and rests turn up, and no move is too small to be real.
motions = arrays(np.int64, st.integers(1, 40), elements=st.integers(-20_000, 20_000)).map(lambda x: x * 1e-6)


@cache
def vectors(group: str):
    found = json.loads((File(__file__).parents[1] / "vectors.json").read_text())
    (key,) = (k for k in found if k.startswith(group + "_"))
    return found[key]["cases"] if isinstance(found[key], dict) else found[key]


def shape_of(case: dict) -> tuple[Shape, float]:
    """The shape of a vector and its z_max."""
    shape = Shape.from_bouc_wen(case["beta"], case["gamma"], case["n"], case["A"])
    return shape, z_max(case["beta"], case["gamma"], case["n"], case["A"])


def sequential(shape: Shape, x: np.ndarray, zeta0: float = 0.0) -> np.ndarray:
    zeta = [zeta0]
    for dx in np.diff(x):
        zeta.append(step(shape, zeta[-1], float(dx)))
    return np.array(zeta)


def stroke(shape: Shape, zeta0, distance):
    """State after a monotone stroke, both counted in the direction of motion."""
    pairs = np.broadcast(zeta0, distance)
    ends = [follow(shape, Path.of([0.0, float(way)], peaks="samples"), float(start))[-1] for start, way in pairs]
    return np.reshape(ends, pairs.shape)[()]


def peak_of(shape: Shape, amplitude: float):
    return steady_loop(shape, amplitude, np.array([np.nextafter(np.pi / 2, 0)]))[0]


def area_of(shape: Shape, amplitude: float):
    """∮ zeta dx of the steady loop, which only the first cosine adds to."""
    return np.pi * amplitude * loop_harmonics(shape, amplitude, [1])[1][0]


# Laws


@given(shapes, motions, st.floats(-1, 1))
def test_follow_is_the_sequential_step(shape, x, zeta0):
    given_at_once = follow(shape, Path.of(x, peaks="samples"), zeta0)
    # Leaving −1 spreads rounding by at most 1/(1 − rho) = 20; forty strokes do not add up to more.
    np.testing.assert_allclose(given_at_once, sequential(shape, x, zeta0), atol=LEAVING)


@given(shapes, motions, st.sampled_from(["parabola", "samples"]))
def test_reversed_motion_reverses_the_state(shape, x, peaks):
    np.testing.assert_array_equal(follow(shape, Path.of(-x, peaks=peaks)), -follow(shape, Path.of(x, peaks=peaks)))


@given(shapes, motions)
def test_more_samples_on_the_way_change_nothing(shape, x):
    fine = np.interp(np.arange(4 * x.size - 3) / 4, np.arange(x.size), x)
    coarse_state = follow(shape, Path.of(x, peaks="samples"))
    fine_state = follow(shape, Path.of(fine, peaks="samples"))[::4]
    # interp moves a sample by a rounding of x, 4e-18 m; kappa <= 1e5/m makes 4e-13 of it.
    np.testing.assert_allclose(fine_state, coarse_state, atol=LEAVING)


@given(shapes, motions)
def test_state_stays_within_z_max(shape, x):
    assert np.all(np.abs(follow(shape, Path.of(x))) <= 1 + LEAVING)


@given(shapes, motions.filter(lambda x: np.ptp(x) > 0), st.floats(-1, 1))
def test_closed_loops_never_create_energy(shape, x, zeta0):
    """Repeat a closed motion until its loop closes: ∮ zeta dx >= 0 then."""
    cycle = np.interp(np.linspace(0, x.size, 400), np.arange(x.size + 1), np.append(x, x[0]))
    # Below yield a loop closes slowly: make it large enough to close in a few cycles.
    cycle *= 20 / (shape.kappa * np.ptp(cycle))
    motion = np.concatenate([cycle, cycle[1:], cycle[1:], cycle[1:]])
    zeta = follow(shape, Path.of(motion, peaks="samples"), zeta0)[-cycle.size :]
    work = float(np.sum(np.diff(cycle) * (zeta[1:] + zeta[:-1]) / 2))
    # The trapezoid errs by at most kappa dx² · roughness on each sample; the loop area is of order ptp.
    assert work >= -0.02 * np.ptp(cycle)


@given(shapes, st.floats(1e-4, 1e4))
def test_steady_loops_never_create_energy(shape, reach):
    amplitude = reach / shape.kappa
    assert -LEAVING <= area_of(shape, amplitude) / (4 * amplitude) <= 1


@pytest.mark.parametrize("n", [1.0, 1.5, 2.0])
def test_without_beta_it_is_an_elastic_spring(n):
    x = 0.01 * np.sin(np.linspace(0, 20, 500))
    shape = Shape.from_bouc_wen(0.0, 200.0**n, n)
    zeta = follow(shape, Path.of(x))
    one_way = np.sign(x) * stroke(shape, 0.0, np.abs(x))
    # At kappa X = 2 the way back from the peak spreads rounding by 1/(1 − Z^n), under 100.
    np.testing.assert_allclose(zeta, one_way, atol=1e-12)
    for amplitude in (1e-6, 0.01, 1e3):
        assert area_of(shape, amplitude) == pytest.approx(0, abs=LEAVING * amplitude)
        assert peak_of(shape, amplitude) == pytest.approx(stroke(shape, 0.0, amplitude), rel=ROUNDING)
        assert np.all(np.isfinite(loop_harmonics(shape, amplitude)))


@given(exponents, asymmetries)
def test_far_below_yield_it_is_a_spring(n, rho):
    x = 0.01 * np.sin(np.linspace(0, 12, 300))
    kappa = 1e-7 / 0.01
    # The first correction is of relative size (1 + |rho|) (kappa x)^n, n >= 1; rho >= −30.
    tolerance = 2 * 31 * 1e-7 * 1e-7
    np.testing.assert_allclose(follow(Shape(kappa, rho, n), Path.of(x)), kappa * x, atol=tolerance)


@given(exponents, st.sampled_from([-30.0, -1.0, 0.0, 0.4]))
def test_far_beyond_yield_it_is_the_sign_of_the_velocity(n, rho):
    theta = np.linspace(0, 12, 300)
    path = Path.of(0.01 * np.sin(theta))
    away = path.distance > 100 * 1e-9  # a sample can lie within nanometres of a reversal
    zeta = follow(Shape(1e9, rho, n), path)
    np.testing.assert_allclose(zeta[away], np.sign(np.cos(theta[away])), atol=ROUNDING)


@given(shapes, st.floats(-1, 1), st.floats(0, 5), st.floats(0, 5))
def test_two_strokes_one_way_are_one(shape, zeta0, a, b):
    a, b = a / shape.kappa, b / shape.kappa
    twice = stroke(shape, stroke(shape, zeta0, a), b)
    assert twice == pytest.approx(stroke(shape, zeta0, a + b), abs=LEAVING)


@given(shapes, st.sampled_from([-1, 1]))
def test_a_state_that_rounding_carries_beyond_one_is_one(shape, sign):
    assert stroke(shape, sign * (1 + 1e-9), 0.0) == stroke(shape, float(sign), 0.0)


@given(shapes, st.floats(-1, 1), st.floats(0, 5))
def test_float_and_array_strokes_agree(shape, zeta0, reach):
    one_float = step(shape, zeta0, reach / shape.kappa)
    assert one_float == pytest.approx(stroke(shape, zeta0, reach / shape.kappa), abs=ROUNDING)


@pytest.mark.parametrize("n", [1.0, 2.0, 1.5])
def test_steady_loops_of_many_shapes_are_one_by_one(n):
    kappa, rho = np.array([30.0, 300.0, 3e4]), np.array([-0.5, 0.0, 0.7])
    many = Shape(kappa, rho, n)
    singles = [Shape(k, r, n) for k, r in zip(kappa.tolist(), rho.tolist(), strict=True)]
    theta = np.linspace(0, 7, 50)
    np.testing.assert_array_equal(steady_loop(many, 0.01, theta), [steady_loop(s, 0.01, theta) for s in singles])


# The steady loop


@given(shapes, st.floats(1e-6, 1e8))
def test_steady_loop_closes_on_itself(shape, reach):
    amplitude = reach / shape.kappa
    peak = peak_of(shape, amplitude)
    assert 0 < peak <= 1 + LEAVING
    theta = np.linspace(-np.pi / 2, np.pi / 2, 101)
    np.testing.assert_allclose(
        steady_loop(shape, amplitude, theta + np.pi), -steady_loop(shape, amplitude, theta), atol=1e-7
    )
    ends = steady_loop(shape, amplitude, np.array([-np.pi / 2, np.pi / 2 - 1e-12]))
    np.testing.assert_allclose(ends, [-peak, peak], atol=LEAVING)


@pytest.mark.parametrize("reach", np.geomspace(1e-6, 1e8, 57))
def test_the_peak_from_tiny_to_saturated_keeps_its_digits(reach):
    # n = 1, gamma = 0: Z = tanh(kappa X), closed.
    assert peak_of(Shape(1.0, -1.0, 1), reach) == pytest.approx(np.tanh(reach), rel=ROUNDING)


@pytest.mark.parametrize("rho", [-5.0, -1.0, 0.0, 0.6])
@pytest.mark.parametrize("n", [1.0, 1.3, 2.0, 4.0])
def test_steady_loop_is_where_a_long_simulation_ends(n, rho):
    shape, amplitude = Shape(500.0, rho, n), 0.004
    theta = np.linspace(0, 40 * np.pi, 40 * 200 + 1)
    # The samples hit every peak, so no parabola is needed; 20 cycles at 2 yield displacements converge.
    zeta = follow(shape, Path.of(amplitude * np.sin(theta), peaks="samples"))
    expected = steady_loop(shape, amplitude, theta[-300:])
    np.testing.assert_allclose(zeta[-300:], expected, atol=1e-9)


def test_harmonics_sum_up_to_the_loop():
    shape, amplitude, theta = Shape(300.0, -0.4, 2), 0.004, np.linspace(0, 6, 30)
    orders = np.arange(1, 400)
    sine, cosine = loop_harmonics(shape, amplitude, orders)
    series = np.sin(np.outer(theta, orders)) @ sine + np.cos(np.outer(theta, orders)) @ cosine
    # The state has a kink at the reversal: coefficients fall as k^−2, the rest after 400 as 1/400².
    np.testing.assert_allclose(series, steady_loop(shape, amplitude, theta), atol=1e-4)
    assert np.all(sine[1::2] == 0)


# The peak between two samples


@pytest.mark.parametrize("phase", [0.1, 0.33, 0.5, 0.77])
def test_parabola_finds_the_missed_peak(phase):
    theta = 2 * np.pi * (np.arange(4000) + phase) / 1000
    shape, amplitude = Shape(1 / 0.002, 0.0, 2), 0.02
    truth = steady_loop(shape, amplitude, theta[2000:])

    def error(peaks):
        return np.max(np.abs(follow(shape, Path.of(amplitude * np.sin(theta), peaks=peaks))[2000:] - truth))

    # The parabola leaves a term of fourth order: kappa X (2 pi/1000)^4/100.
    assert error("parabola") < 1e-8
    if phase != 0.1:
        assert error("samples") > 1e-6


def test_equal_samples_that_straddle_the_peak_are_no_rest():
    x = np.array([0.0, 0.8, 1.0, 1.0, 0.8, 0.0])
    path = Path.of(x)
    assert path.lengths == (pytest.approx(1.0 + 0.2 / 8),)
    rest = Path.of(np.array([0.0, 0.8, 1.0, 1.0, 1.0, 0.8, 0.0]))
    assert rest.lengths == (1.0,)


@given(motions)
def test_an_inserted_peak_stays_near_its_sample(x):
    path, plain = Path.of(x), Path.of(x, peaks="samples")
    moves = np.max(np.abs(np.diff(x)), initial=0.0)
    # Uniform sampling: each end of a stroke moves by at most an eighth of the neighbouring move.
    assert np.all(np.abs(np.subtract(path.lengths, plain.lengths)) <= moves / 4 + 1e-15)
    assert np.all(path.distance >= 0)


def test_triangle_wave_turns_at_its_corner():
    x = np.concatenate([np.arange(0, 11), np.arange(9, -1, -1)]) * 1e-3
    np.testing.assert_array_equal(Path.of(x).lengths, [0.01])


@pytest.mark.parametrize("x", [[0.3], [0.3, 0.3, 0.3], [0.3, 0.3, 0.2, 0.2], [0.0, 1.0], [0.0, 1.0, 0.0]])
def test_short_and_resting_records(x):
    shape = Shape(2.0, -0.5)
    path = Path.of(x, peaks="samples")
    np.testing.assert_allclose(follow(shape, path, 0.2), sequential(shape, np.array(x), 0.2), atol=ROUNDING)
    assert len(path) == len(x)


# Vectors of the method: each made by two algorithms that agree to 1e-13


@pytest.mark.parametrize("case", vectors("V02"))
def test_v02_stroke(case):
    shape, scale = shape_of(case)
    start = case["w0"] / scale
    assert stroke(shape, start, case["u"]) * scale == pytest.approx(case["w"], rel=ROUNDING)
    assert step(shape, start, case["u"]) * scale == pytest.approx(case["w"], rel=ROUNDING)


@pytest.mark.parametrize("case", vectors("V03"))
def test_v03_steady_loop(case):
    shape, scale = shape_of(case)
    assert scale == pytest.approx(case["z_max"], rel=ROUNDING)
    assert peak_of(shape, case["X"]) * scale == pytest.approx(case["Z_peak"], rel=ROUNDING)
    assert area_of(shape, case["X"]) * scale == pytest.approx(case["loop_area"], abs=4e-13 * scale * case["X"])
    sine, cosine = loop_harmonics(shape, case["X"], [int(k) for k in case["zs"]])
    np.testing.assert_allclose(sine * scale, list(case["zs"].values()), atol=1e-13 * scale)
    np.testing.assert_allclose(cosine * scale, list(case["zc"].values()), atol=1e-13 * scale)


@pytest.mark.parametrize("case", vectors("V04"))
def test_v04_sine_from_rest(case):
    shape, scale = shape_of(case)
    # All asked times, and every reversal, so that the path is exact as sampled.
    turns = (np.arange(1, 8) * 0.5 - 0.25) / case["f"]
    t = np.union1d(np.append(case["t"], 0.0), turns[turns < max(case["t"])])
    zeta = follow(shape, Path.of(case["X"] * np.sin(2 * np.pi * case["f"] * t), peaks="samples"))
    np.testing.assert_allclose(zeta[np.searchsorted(t, case["t"])] * scale, case["z"], atol=ROUNDING * scale)


def test_v05_samples_of_any_motion():
    found = json.loads((File(__file__).parents[1] / "vectors.json").read_text())["V05_bw_sampled"]
    for case in found["cases"]:
        shape, scale = shape_of(case)
        zeta = follow(shape, Path.of(found["x"], peaks="samples"))
        np.testing.assert_allclose(zeta * scale, case["z"], atol=ROUNDING * scale)


@pytest.mark.parametrize("case", vectors("V12"))
def test_v12_dahl(case):
    shape, scale = shape_of(case)
    xi = case["beta"] * case["X"]
    (sine,), (cosine,) = loop_harmonics(shape, case["X"], [1])
    assert peak_of(shape, case["X"]) * scale == pytest.approx(case["Z_peak"], rel=ROUNDING)
    assert area_of(shape, case["X"]) * scale == pytest.approx(case["loop_area"], rel=ROUNDING)
    assert sine * scale == pytest.approx(case["zs1"], rel=ROUNDING)
    assert cosine * scale == pytest.approx(case["zc1"], rel=ROUNDING)
    assert sine == pytest.approx(2 * iv(1, xi) / math.cosh(xi), rel=ROUNDING)
    loading = steady_loop(shape, case["X"], np.arcsin(np.array(case["x"]) / case["X"]))
    np.testing.assert_allclose(loading * scale, case["z_loading"], rtol=ROUNDING)


@pytest.mark.parametrize("case", vectors("V18"))
def test_v18_normal_form(case):
    shape, scale = shape_of(case)
    assert scale == pytest.approx(case["z0"], rel=ROUNDING)
    assert shape.kappa == pytest.approx(case["rho"], rel=ROUNDING)
    assert shape.sigma == pytest.approx(case["sigma"], rel=ROUNDING)
    back = Shape.from_ikhouane_rodellar(case["rho"], case["sigma"], case["n"]).to_bouc_wen(case["A"])
    np.testing.assert_allclose(back, [case["beta"], case["gamma"]], rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("case", vectors("V21"))
def test_v21_saturated_area(case):
    """∮ zeta dx → 4 X − 2 C/kappa for X ≫ 1/kappa."""
    assert 4 * 200 - area_of(Shape(1.0, -case["d_over_s"], case["n"]), 200.0) == pytest.approx(2 * case["C"])


# Independent numerics for other n


@pytest.mark.parametrize("rho", [-1000.0, -9.0, -1.0, -0.01, 0.0, 0.01, 0.5, 0.9])
@pytest.mark.parametrize("n", [1.0, 1.02, 1.5, 2.0, 2.7, 5.0, 10.0, 20.0])
def test_stroke_against_hypergeometric_distance(n, rho):
    """The distance between two states is a difference of hypergeometric functions."""
    before, after = np.meshgrid([0.01, 0.3, 0.9, 1.0], [0.02, 0.4, 0.95, 0.9999])

    def distance(size, q):
        return size * hyp2f1(1, 1 / n, 1 + 1 / n, q * size**n)

    through_zero = stroke(Shape(1.0, rho, n), -before, distance(before, rho) + distance(after, 1.0))
    # scipy's hyp2f1 is good to 1e-12 here; the tables promise 1e-8.
    np.testing.assert_allclose(through_zero, after, atol=TABLE)
    half = stroke(Shape(1.0, rho, n), -before, distance(before, rho) - distance(before / 2, rho))
    # Leaving −1 at −1000 a distance rounded to 1e-16 is blurred by the rate of 1000.
    np.testing.assert_allclose(half, -before / 2, atol=TABLE)


@pytest.mark.parametrize("n", [1.0, 2.0])
@pytest.mark.parametrize("rho", [-3.0, 0.0, 0.5])
def test_tables_meet_the_closed_forms(n, rho):
    x = 0.02 * np.sin(np.linspace(0, 20, 500))
    closed, near = (follow(Shape(200.0, rho, m), Path.of(x)) for m in (n, n + 1e-9))
    # zeta changes by order one with n, so by order 1e-9 here.
    np.testing.assert_allclose(near, closed, atol=TABLE)


# Saying no


@pytest.mark.parametrize(
    ("kappa", "rho", "n"), [(0, 0, 2), (-1, 0, 2), (np.inf, 0, 2), (1, 1.1, 2), (1, np.nan, 2), (1, 0, 0.5), (1, 0, 99)]
)
def test_impossible_shapes_are_refused(kappa, rho, n):
    with pytest.raises(ParameterError):
        Shape(kappa, rho, n)


@pytest.mark.parametrize(
    ("beta", "gamma", "fine"), [(1, 1, True), (1, 9, True), (0, 1, True), (-0.1, 1, False), (1, -1, False)]
)
def test_only_energy_sources_are_refused(beta, gamma, fine):
    assert bool(dissipates(beta, gamma)) is fine
    if fine:
        Shape.from_bouc_wen(beta, gamma)
    else:
        with pytest.raises(ParameterError, match="beta"):
            Shape.from_bouc_wen(beta, gamma)


@pytest.mark.parametrize("x", [[], [[0.0, 1.0]], [0.0, np.nan]])
def test_impossible_motions_are_refused(x):
    with pytest.raises(ExcitationError):
        Path.of(x)


@pytest.mark.parametrize("start", [1.001, -50.0, np.nan])
def test_starts_beyond_z_max_are_refused(start):
    with pytest.raises(ParameterError, match="within ±z_max"):
        follow(Shape(1.0, 0.5), Path.of([0.0, 1.0]), start)
    with pytest.raises(ExcitationError, match="amplitude"):
        peak_of(Shape(1.0, 0.0), 0.0)
