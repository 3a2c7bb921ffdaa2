"""Machine code and batches give what the one exact algorithm gives; searches find the same minimum."""

import numpy as np
import pytest
from support.synthetic import synthetic_run

from mrdamper.data import Condition
from mrdamper.hysteresis import Shape, follow
from mrdamper.hysteresis.batch import Fixed, batch_cost, follow_alike, follow_quickly, follow_with_slope, products
from mrdamper.hysteresis.compiled import follow_compiled
from mrdamper.hysteresis.compiled_math import expm1, tan, tanh
from mrdamper.hysteresis.compiled_search import GENERAL_WAY, search_length, search_lengths
from mrdamper.hysteresis.compiled_tables import curve_of
from mrdamper.hysteresis.master_curve import master_curve
from mrdamper.identification import Problem, identify
from mrdamper.identification.elimination import Elimination, kind_of
from mrdamper.identification.methods.projection import Projection, length_search, search_axes
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.models.kwok import Kwok
from mrdamper.models.spencer import Spencer
from mrdamper.motion import Path
from mrdamper.optimizers.levenberg_marquardt import least_squares
from mrdamper.optimizers.one_number import least_squares_in_one

X = 0.02
RHOS = (-20.0, -1.0, -0.3, -1e-7, 0.0, 1e-6, 0.5, 0.95)  # rho = 1 forgets where it is once zeta rounds to 1


def motions():
    phase = 2 * np.pi * np.arange(1500) / 600 + 0.3
    walk = np.cumsum(np.random.default_rng(3).standard_normal(1500)) * 1e-3
    rests = np.repeat([0.0, 1e-3, 1e-3, -2e-3, 5e-3], 40)
    return {"sine": X * np.sin(phase), "random walk": walk, "steps and rests": rests, "still": np.zeros(9)}


PATHS = {name: Path.of(x) for name, x in motions().items()}


def columns(path, first=100):
    x = np.cumsum(path.direction) * 1e-4
    return np.column_stack([np.ones(x.size), x, np.sin(np.arange(x.size) / 90)])[first:]


def data(name="sine", first=100):
    path = PATHS[name]
    table = columns(path, first)
    target = follow(Shape(9 / X, 0.0, 2.0), path)[first:] + table @ np.array([0.3, 0.1, -0.2])
    return Fixed.of(path, table, target + 0.05 * np.random.default_rng(1).standard_normal(target.size)), table


@pytest.mark.parametrize("name", PATHS)
@pytest.mark.parametrize("n", [1.0, 2.0, 1.5, 4.0])
def test_machine_code_follows_as_numpy_does(name, n):
    """To 1e-13 of z_max; the tables too, for their cells are the same numbers."""
    for rho in RHOS:
        for reach in (0.1, 1.0, 10.0, 1000.0):
            shape = Shape(reach / X, rho, n)
            for start in (0.0, 0.7, -1.0):
                expected = follow(shape, PATHS[name], start)
                np.testing.assert_allclose(follow_compiled(shape, PATHS[name], start), expected, atol=1e-13)


@pytest.mark.parametrize("n", [1.0001, 1.3, 2.7, 10.0])
def test_tables_made_in_machine_code_are_those_of_numpy(n):
    """To the rounding of a sum over 769 nodes."""
    rising, growing = master_curve(n)._rising, master_curve(n)._growing
    quintics = (rising._r_of_phi, rising._phi_of_r, growing._r_of_phi, growing._phi_of_r)
    for cells, quintic in zip(curve_of(n).cells, quintics, strict=True):
        np.testing.assert_allclose(cells[:, 0], quintic.nodes, rtol=1e-13, atol=1e-13)
        np.testing.assert_allclose(cells[:-1, 1], quintic.cells[:, 6], rtol=1e-11)
        np.testing.assert_allclose(cells[:-1, 2:], quintic.cells[:, :6], atol=1e-12)
    assert not curve_of(n, growing=False).cells[2:].any()


@pytest.mark.parametrize("n", [1.0, 2.0, 2.7])
@pytest.mark.parametrize("name", PATHS)
def test_shapes_at_once_and_the_quick_way_are_the_same_states(name, n):
    kappa = np.geomspace(0.05, 3000, 9) / X
    for rho in (-0.6, 0.0, 0.4):
        expected = follow(Shape(kappa, rho, n), PATHS[name])
        np.testing.assert_allclose(follow_alike(n, rho, kappa, PATHS[name]), expected, atol=1e-13)
        quick = [follow_quickly(float(k), rho, n, PATHS[name]) for k in kappa]
        np.testing.assert_allclose(quick, expected, atol=1e-13)


@pytest.mark.parametrize("n", [1.0, 2.0, 3.5])
@pytest.mark.parametrize("rho", [-0.5, 0.0, 0.5])
def test_slope_is_the_derivative_by_the_length(n, rho):
    for name in ("sine", "random walk"):
        for kappa in (2 / X, 20 / X, 200 / X):
            state, slope = follow_with_slope(kappa, rho, n, PATHS[name], slice(50, None))
            np.testing.assert_array_equal(state, follow_quickly(kappa, rho, n, PATHS[name], slice(50, None)))
            up, down = (follow(Shape(kappa * np.exp(h), rho, n), PATHS[name])[50:] for h in (1e-6, -1e-6))
            # A central difference is good to 1e-9; at the few samples within its step of a kink it is not.
            assert np.quantile(np.abs((up - down) / 2e-6 - slope), 0.99) < 1e-7


def test_vectorised_functions_keep_their_last_digits():
    """To four units in the last place."""
    x = np.concatenate([np.linspace(-40, 15, 4001), np.geomspace(1e-300, 1, 400), -np.geomspace(1e-300, 1, 400)])
    for value in x.tolist():
        assert expm1(value) == pytest.approx(np.expm1(value), rel=9e-16, abs=0)
    for value in np.concatenate([np.linspace(0, 40, 2001), np.geomspace(1e-300, 1, 200)]).tolist():
        assert tanh(value) == pytest.approx(np.tanh(value), rel=9e-16, abs=0)
    for value in np.concatenate([np.linspace(0, 1.55, 2001), np.geomspace(1e-300, 1, 200)]).tolist():
        # Towards pi/2 the tangent itself amplifies the rounding of its argument.
        assert tan(value) == pytest.approx(np.tan(value), rel=9e-16 * max(1.0, np.tan(value)), abs=0)


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("n", [1.0, 2.0, 1.6])
@pytest.mark.parametrize("name", ["sine", "random walk"])
def test_batch_cost_is_the_cost_of_each_set(name, n, compiled):
    fixed, table = data(name)
    force = fixed.basis @ fixed.along + fixed.rest
    shapes = Shape(np.geomspace(0.3, 500, 12) / X, np.resize([0.0, -0.5, 0.5], 12), n)
    zeta = follow(shapes, PATHS[name])[:, fixed.first :]
    best = []
    for state in zeta:
        whole = np.column_stack([table, state])
        found = np.linalg.lstsq(whole, force, rcond=None)[0]
        if found[-1] < 0:
            whole, found = table, np.linalg.lstsq(table, force, rcond=None)[0]
        best.append(np.sum((whole @ found - force) ** 2))
    np.testing.assert_allclose(batch_cost(fixed, shapes, compiled=compiled), best, rtol=1e-10)
    given = np.random.default_rng(5).standard_normal((12, 4))
    error = given[:, :3] @ table.T + given[:, 3:] * zeta - force
    np.testing.assert_allclose(
        batch_cost(fixed, shapes, given, compiled=compiled), np.sum(error**2, axis=1), rtol=1e-10
    )


def test_batch_makes_no_array_of_sets_times_samples():
    import tracemalloc

    fixed, _ = data()
    shapes = Shape(np.geomspace(1, 100, 2000) / X, 0.0, 2.0)
    batch_cost(fixed, shapes, compiled=True)  # compiles
    for compiled in (True, False):
        tracemalloc.start()
        batch_cost(fixed, shapes, compiled=compiled)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        # 2,000 sets × 1,500 samples would be 24 MB; the NumPy path holds 2^17 states in a few copies.
        assert peak < (1e6 if compiled else 12e6)


def test_small_work_takes_numpy_whatever_is_loaded():
    """The choice depends on the work alone, so that the same input gives the same bits."""
    fixed, _ = data()
    shapes = Shape(np.array([200.0, 700.0]), 0.0, 2.0)
    chosen, numpy = products(fixed, shapes), products(fixed, shapes, compiled=False)
    for name in ("along", "force", "square"):
        np.testing.assert_array_equal(getattr(chosen, name), getattr(numpy, name))


def prepared(condition, noise=20.0, **options):
    problem = Problem.of(synthetic_run(condition, noise=noise), BoucWen, **options)
    axes = search_axes(problem)
    elimination = Elimination.of(problem, axes)
    return problem, elimination, length_search(axes, elimination)


CONDITIONS = [Condition(c, f, a) for c in (0.0, 1.0) for f in (0.5, 2.0) for a in (0.01, 0.03)]


@pytest.mark.parametrize("fixed", [{}, {"n": 1.0}, {"n": 3.0}], ids=str)
def test_compiled_search_finds_the_minimum_numpy_finds(fixed):
    general = 0
    for condition in CONDITIONS:
        problem, _, search = prepared(condition, fixed=fixed)
        machine, numpy = search_length(search), Projection().solve(problem)
        general += machine.status == GENERAL_WAY  # a coefficient of a wrong model may want to pass its bound
        if machine.status == GENERAL_WAY:
            assert numpy.model.c < 1.0
            continue
        # Both end where a step promises under 1e-9 of the cost; the place is less sharp than that.
        assert np.exp(machine.log_length) == pytest.approx(numpy.end["yield_displacement"], rel=1e-4)
        error = numpy.model.force(problem.seen, numpy.model.state(problem.motion)[problem.scored]) - problem.force
        assert machine.cost == pytest.approx(float(error @ error), rel=1e-8)
    assert general <= (6 if fixed == {"n": 1.0} else 0)


@pytest.mark.parametrize("free", [("n",), ("gamma",), ("gamma", "n")], ids=str)
def test_every_shape_is_searched_in_machine_code_too(free):
    problem = Problem.of(synthetic_run(CONDITIONS[5], noise=20.0), BoucWen, free=free)
    machine, numpy = Projection(compiled=True).solve(problem), Projection(compiled=False).solve(problem)
    for name, value in numpy.end.items():
        # The same steps; a cost flat to 1e-9 leaves that much of the place open.
        assert machine.end[name] == pytest.approx(value, rel=1e-4, abs=1e-4)
    assert machine.message == numpy.message


def test_machine_code_is_chosen_by_the_work():
    """One record of a test matrix is not worth it, one of ten million samples is."""
    problem, axes = prepared(CONDITIONS[0])[0], (None,)
    assert not Projection()._is_compiled(problem, axes)
    assert Projection(compiled=True)._is_compiled(problem, axes)
    long = type("Long", (), {"motion": range(20_000_000)})()
    assert Projection()._is_compiled(long, axes)
    assert not Projection(compiled=False)._is_compiled(long, axes)


def test_method_with_machine_code_gives_the_same_model():
    run = synthetic_run(CONDITIONS[2], noise=20.0)
    machine, numpy = identify(run, method=Projection(compiled=True)), identify(run)
    for name, value in numpy.model.values().items():
        assert machine.model.values()[name] == pytest.approx(value, rel=1e-3, abs=1e-9)
    assert machine.scores.nrmse_pp == pytest.approx(numpy.scores.nrmse_pp, rel=1e-8)
    assert machine.message == numpy.message


def test_threads_do_not_change_a_bit(monkeypatch):
    from mrdamper.hysteresis import compiled_search

    monkeypatch.setattr(compiled_search, "_WORTH_THREADS", 0)
    searches = [prepared(condition)[2] for condition in CONDITIONS] * 3
    one, two = search_lengths(searches), search_lengths(searches, threads=2)
    for a, b in zip(one, two, strict=True):
        assert (a.log_length, a.cost, a.evaluations) == (b.log_length, b.cost, b.evaluations)
        np.testing.assert_array_equal(a.coefficients, b.coefficients)


def test_a_bound_sends_the_search_the_general_way():
    """A force that falls with velocity would need a negative damping."""
    run = synthetic_run(
        CONDITIONS[0], model=BoucWen.build({"c": 0.0, "yield_force": 300.0, "yield_displacement": 1e-3})
    )
    tilted = np.asarray(run.force) - 400.0 * np.gradient(run.displacement, run.time)
    from dataclasses import replace

    problem = Problem.of(replace(run, force=tilted), BoucWen)
    axes = search_axes(problem)
    elimination = Elimination.of(problem, axes)
    assert search_length(length_search(axes, elimination)).status == GENERAL_WAY
    assert elimination.residual({"yield_displacement": 1e-3}) is None
    for method in (Projection(), Projection(compiled=True)):
        found = method.solve(problem)
        assert found.model.c == 0.0
        assert "c" in found.at_bounds


def test_kinds_are_found_by_trying():
    bent = kind_of(BoucWen, ("c", "alpha", "beta", "f0", "k1"), (("gamma", -1.0), ("n", 2.0)))
    assert bent.state.name == "alpha"
    assert not bent.has_shape  # a gamma that is held bends the asymmetry with the length
    assert (
        kind_of(BoucWen, ("c", "alpha", "beta"), (("gamma", 2e5),)) is None
    )  # the longest lengths allow no such gamma
    free = kind_of(BoucWen, ("c", "alpha", "beta", "f0"), (("k1", 0.0), ("n", 2.0)))
    assert free.has_shape
    assert free.shape({"yield_displacement": 1e-3}) == (1e3, 0.0, 2.0)
    kwok = kind_of(Kwok, ("c", "k", "alpha", "beta", "delta", "f0"), (("xs", 0.0),))
    assert kwok.state.name == "alpha"
    assert not kwok.has_shape
    assert kind_of(Spencer, ("c1", "creep"), ()) is None


def test_one_number_search_matches_levenberg_marquardt_and_keeps_its_bounds():
    t = np.linspace(0, 3, 200)
    measured = np.exp(-1.3 * t) + 0.3 * np.sin(9 * t)  # much residual remains: Gauss–Newton alone is slow

    def evaluate(u):
        return np.exp(-u * t) - measured, -t * np.exp(-u * t)

    quick = least_squares_in_one(evaluate, 0.3, 0.0, 5.0)
    slow = least_squares(lambda u: evaluate(float(u[0]))[0], np.array([0.3]), np.zeros(1), np.full(1, 5.0))
    curved = least_squares(
        lambda u: evaluate(float(u[0]))[0], np.array([0.3]), np.zeros(1), np.full(1, 5.0), curved=True
    )
    assert quick.cost <= slow.cost * (1 + 1e-9)
    assert curved.cost <= slow.cost * (1 + 1e-9)
    assert quick.point[0] == pytest.approx(slow.point[0], rel=1e-4)
    bounded = least_squares_in_one(evaluate, 0.3, 0.0, 1.0)
    assert bounded.point[0] == 1.0
    assert "bound" in bounded.message
    assert least_squares_in_one(lambda u: None, 0.3, 0.0, 1.0) is None


def test_learnt_curvature_converges_where_gauss_newton_creeps():
    """Beside a residual of 1 that bends by 1.4, each Gauss–Newton step leaves 0.7 of the distance."""

    def residual(p):
        return np.array([p[0] - 0.2, 1 + 0.7 * (p[0] - 0.2) ** 2, p[1] + 0.3, 1 + 0.6 * (p[1] + 0.3) ** 2])

    box = np.full(2, -3.0), np.full(2, 3.0)
    plain, curved = (
        least_squares(residual, np.array([0.9, -1.0]), *box, tolerance=1e-13, curved=curved) for curved in (False, True)
    )
    np.testing.assert_allclose(curved.point, [0.2, -0.3], atol=1e-5)
    assert curved.cost <= plain.cost * (1 + 1e-12)
    assert curved.evaluations < 0.7 * plain.evaluations
