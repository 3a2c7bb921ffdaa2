"""Batches give what the one exact algorithm gives; searches find the same minimum."""

import numpy as np
import pytest
from support.synthetic import synthetic_run

from benchmarks.batches import batch_cost
from mrdamper.data import Condition
from mrdamper.identification import Problem
from mrdamper.identification.columns import linear_table
from mrdamper.identification.elimination import Elimination, linear_structure
from mrdamper.identification.methods.projection import Projection, search_axes
from mrdamper.models import Scale, all_models
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.models.kwok import Kwok
from mrdamper.models.spencer import Spencer
from mrdamper.physics.hysteresis import Shape, follow
from mrdamper.physics.hysteresis.response import follow_alike, follow_one, follow_with_slope
from mrdamper.physics.motion import Path, sine
from mrdamper.statistics import linear
from mrdamper.statistics.levenberg_marquardt import least_squares
from mrdamper.statistics.linear import FixedColumns
from mrdamper.statistics.scalar_least_squares import least_squares_in_one
from mrdamper.statistics.stop_reason import StopReason

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
    force = target + 0.05 * np.random.default_rng(1).standard_normal(target.size)
    return FixedColumns.of(table, force), table, force


@pytest.mark.parametrize("n", [1.0, 2.0, 2.7])
@pytest.mark.parametrize("name", PATHS)
def test_shapes_at_once_are_the_states_of_each(name, n):
    kappa = np.geomspace(0.05, 3000, 9) / X
    for rho in (-0.6, 0.0, 0.4):
        expected = [follow(Shape(float(k), rho, n), PATHS[name]) for k in kappa]
        np.testing.assert_allclose(follow_alike(n, rho, kappa, PATHS[name]), expected, atol=1e-13)


@pytest.mark.parametrize("n", [1.0, 2.0, 3.5])
@pytest.mark.parametrize("rho", [-0.5, 0.0, 0.5])
def test_slope_is_the_derivative_by_the_length(n, rho):
    for name in ("sine", "random walk"):
        for kappa in (2 / X, 20 / X, 200 / X):
            state, slope = follow_with_slope(kappa, rho, n, PATHS[name], slice(50, None))
            np.testing.assert_array_equal(state, follow_one(kappa, rho, n, PATHS[name], slice(50, None)))
            up, down = (follow(Shape(kappa * np.exp(h), rho, n), PATHS[name])[50:] for h in (1e-6, -1e-6))
            # A central difference is good to 1e-9; at the few samples within its step of a kink it is not.
            assert np.quantile(np.abs((up - down) / 2e-6 - slope), 0.99) < 1e-7


@pytest.mark.parametrize("n", [1.0, 2.0, 1.6])
@pytest.mark.parametrize("name", ["sine", "random walk"])
def test_batch_cost_is_the_cost_of_each_shape(name, n):
    fixed, table, force = data(name)
    shapes = Shape(np.geomspace(0.3, 500, 12) / X, np.resize([0.0, -0.5, 0.5], 12), n)
    best = []
    for kappa, rho in zip(shapes.kappa, shapes.rho, strict=True):
        state = follow(Shape(float(kappa), float(rho), n), PATHS[name])
        whole = np.column_stack([table, state[-force.size :]])
        found = np.linalg.lstsq(whole, force, rcond=None)[0]
        if found[-1] < 0:
            whole, found = table, np.linalg.lstsq(table, force, rcond=None)[0]
        best.append(np.sum((whole @ found - force) ** 2))
    np.testing.assert_allclose(batch_cost(PATHS[name], fixed, shapes), best, rtol=1e-10)


def test_batch_makes_no_array_of_sets_times_samples():
    import tracemalloc

    fixed, _, _ = data()
    tracemalloc.start()
    batch_cost(PATHS["sine"], fixed, Shape(np.geomspace(1, 100, 2000) / X, 0.0, 2.0))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 12e6  # 2,000 sets × 1,500 samples would be 24 MB; 2^17 states are held in a few copies


def test_fixed_columns_say_when_they_explain_each_other():
    table = np.column_stack([np.ones(30), np.arange(30.0), 1e9 * np.arange(30.0) + 5])
    assert not FixedColumns.of(table, np.arange(30.0)).independent
    fixed = FixedColumns.of(table[:, :2], 3.0 + 2.0 * np.arange(30.0))
    assert fixed.independent
    np.testing.assert_allclose(fixed.inverse @ fixed.along, [3.0, 2.0])
    assert fixed.rest @ fixed.rest < 1e-20


def test_a_long_table_is_factored_block_by_block_as_at_once(monkeypatch):
    rng = np.random.default_rng(4)
    table = rng.standard_normal((1001, 4)) * [1.0, 1e6, 1e-4, 10.0]
    table[:, 3] = 10 * table[:, 0] + 1e-3 * table[:, 3]
    right = rng.standard_normal(1001)
    whole = FixedColumns.of(table, right)
    monkeypatch.setattr(linear, "_ROWS_PER_BLOCK", 100)
    blocks = FixedColumns.of(table, right)
    np.testing.assert_allclose(blocks.basis.T @ blocks.basis, np.eye(4), atol=1e-14)
    np.testing.assert_allclose(blocks.basis @ blocks.triangle, table / blocks.scale, atol=1e-14)
    np.testing.assert_allclose(blocks.rest, whole.rest, atol=1e-12)
    np.testing.assert_allclose(blocks.inverse @ blocks.along, whole.inverse @ whole.along, rtol=1e-10)
    assert not FixedColumns.of(table[:, [0, 1, 1]], right).independent


@pytest.mark.parametrize("size", [1, 2, 5, 48])
def test_a_triangle_times_its_inverse_is_one(size):
    triangle = np.tril(np.random.default_rng(size).standard_normal((size, size))) + 3 * np.eye(size)
    inverse = linear.inverse_of_triangle(triangle)
    np.testing.assert_allclose(triangle @ inverse, np.eye(size), atol=1e-12)


def test_a_bound_sends_the_search_the_general_way():
    """A force that falls with velocity would need a negative damping."""
    run = synthetic_run(
        Condition(0.0, 0.5, 0.01), model=BoucWen.build({"c": 0.0, "yield_force": 300.0, "yield_displacement": 1e-3})
    )
    tilted = np.asarray(run.force) - 400.0 * np.gradient(run.displacement, run.time)
    from dataclasses import replace

    problem = Problem.of(replace(run, force=tilted), BoucWen)
    axes = search_axes(problem)
    elimination = Elimination.of(problem, axes)
    assert elimination.residual({"yield_displacement": 1e-3}) is None
    found = Projection().solve(problem)
    assert found.model.c == 0.0
    assert "c" in found.at_bounds


def test_kinds_follow_from_what_models_declare():
    bent = linear_structure(BoucWen, ("c", "alpha", "beta", "f0", "k1"), (("gamma", -1.0), ("n", 2.0)))
    assert bent.state.name == "alpha"
    assert not bent.has_shape  # a gamma that is held bends the asymmetry with the length
    assert (
        linear_structure(BoucWen, ("c", "alpha", "beta"), (("gamma", 2e5),)) is None
    )  # the longest lengths allow no such gamma
    free = linear_structure(BoucWen, ("c", "alpha", "beta", "f0"), (("k1", 0.0), ("n", 2.0)))
    assert free.has_shape
    assert free.shape({"yield_displacement": 1e-3}) == (1e3, 0.0, 2.0)
    kwok = linear_structure(Kwok, ("c", "k", "alpha", "beta", "delta", "f0"), (("xs", 0.0),))
    assert kwok.state.name == "alpha"
    assert not kwok.has_shape
    assert linear_structure(Spencer, ("c1", "creep"), ()) is None


@pytest.mark.parametrize("name", [name for name, model in all_models().items() if model.state_column])
def test_the_declared_column_is_the_only_one_the_search_moves(name):
    """What a model declares is tried: two states at two places of the search change its state column alone."""
    model = all_models()[name]
    free = tuple(info.name for info in model.parameters() if not info.preset)
    linear = [info for info in model.parameters() if info.linear and info.name in free]
    motion = sine(Condition(0.5, 1.0, X), 1, 40)
    tables = []
    for axis_at in (lambda axis: axis.grid[0], lambda axis: axis.grid[-1]):
        point = {axis.name: axis_at(axis) for axis in model.search_axes(Scale(X, 0.1), free)}
        bare = model.build({**point, **{info.name: 0.0 for info in linear}})
        assert not bare.integrated
        for state in (bare.state(motion), np.cos(np.arange(len(motion)))):
            base, columns = linear_table(bare, linear, motion, state)
            np.testing.assert_array_equal(base, 0.0)
            moving = [info.name for info in linear].index(model.state_column)
            np.testing.assert_allclose(columns[:, moving], state, rtol=1e-12, atol=1e-12)
            tables.append(np.delete(columns, moving, axis=1))
        if bare.shape is not None:
            np.testing.assert_allclose(bare.state(motion), follow(bare.shape, motion.path) / bare.shape.kappa)
    for table in tables[1:]:
        np.testing.assert_allclose(table, tables[0], rtol=1e-9)


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
    assert bounded.ending is StopReason.AT_BOUNDS
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
