"""Identification of one condition by every installed method: time, and how often the optimum is reached."""

from __future__ import annotations

import importlib.util
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from benchmarks import conditions
from benchmarks.batches import products
from benchmarks.genetic import GENERATIONS, POPULATION, plain_genetic
from mrdamper.identification import Problem, identify
from mrdamper.identification.methods.projection import Projection
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.physics.hysteresis import Shape, follow
from mrdamper.statistics.linear import FixedColumns

REACHED = 1.01  # cost over the best known that counts as reached


@dataclass
class Task:
    """One noisy condition, and its cost as peers see it: c, k1, f0, yield force, yield displacement."""

    seed: int
    problem: Problem = field(init=False)

    def __post_init__(self) -> None:
        fixed = {"k3": 0.0}
        self.problem = Problem.of(conditions.run(seed=self.seed), BoucWen, fixed=fixed)

    @cached_property
    def best(self) -> float:
        """Squared error [N²] of the least-squares search."""
        return _cost_of_model(self, Projection().solve(self.problem).model)

    @cached_property
    def columns(self) -> np.ndarray:
        seen = self.problem.seen
        return np.column_stack([seen.velocity, seen.displacement, np.ones(len(seen))])

    @cached_property
    def fixed(self) -> FixedColumns:
        return FixedColumns.of(self.columns, self.problem.force)

    @cached_property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Twice the value for the largest force, for each parameter."""
        peak, seen = 2 * float(np.max(np.abs(self.problem.force))), self.problem.seen
        X, speed = float(np.max(np.abs(seen.displacement))), float(np.max(np.abs(seen.velocity)))
        return (
            np.array([0.0, -peak / X, -peak, 0.0, 1e-4 * X]),
            np.array([peak / speed, peak / X, peak, peak, 0.5 * X]),
        )

    def costs(self, points: np.ndarray) -> np.ndarray:
        """(P,) squared errors [N²] from the sums of mrdamper's batch."""
        fixed = self.fixed
        sums = products(self.problem.motion.path, fixed, Shape(1 / points[:, 4], 0.0, 2.0))
        off, size = points[:, :3] * fixed.scale @ fixed.triangle.T - fixed.along, points[:, 3]
        beside = size**2 * sums.square - 2 * size * sums.force
        return np.sum(off * (off + 2 * size[:, None] * sums.along), axis=1) + beside + float(fixed.rest @ fixed.rest)

    def residual(self, point: np.ndarray) -> np.ndarray:
        """By the closed form in NumPy."""
        zeta = follow(Shape(1 / float(point[4]), 0.0, 2.0), self.problem.motion.path)[self.problem.scored]
        return self.columns @ point[:3] + point[3] * zeta - self.problem.force

    def unit(self, residual: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray], np.ndarray]:
        """The same over the unit box, as searches without scales of their own like it."""
        lower, upper = self.box
        return lambda u: residual(lower + u * (upper - lower))

    def stepped_costs(self, points: np.ndarray) -> np.ndarray:
        """By RK4 at the sample step, compiled."""
        from benchmarks.rk4 import rk4

        motion = self.problem.motion
        dt, costs = float(motion.time[1] - motion.time[0]), np.empty(len(points))
        for i, (c, k1, f0, fz, length) in enumerate(points.tolist()):
            beta = 0.5 / length**2
            with np.errstate(over="ignore", invalid="ignore"):  # diverges if the yield is shorter than a sample
                zeta = rk4(motion.velocity, dt, 1.0, beta, beta, 2.0)[self.problem.scored] / length
                error = self.columns @ np.array([c, k1, f0]) + fz * zeta - self.problem.force
                costs[i] = np.nan_to_num(error @ error, nan=1e300, posinf=1e300)
        return costs


@dataclass(frozen=True)
class IdentificationRow:
    """How often a way reached the best known cost, and how long a condition takes."""

    name: str
    ratio: float
    seconds: float
    reached: str
    computed: bool = False


def identification_rows(quick: bool) -> list[IdentificationRow]:
    """Ours first, then the peers by time."""
    tasks = [Task(seed) for seed in range(3 if quick else 20)]
    for task in tasks:
        _ = task.fixed, task.costs(np.mean(task.box, axis=0)[None]), task.problem.motion.path
    best = [task.best for task in tasks]
    rows = []
    for name, (way, most) in _ways(quick).items():
        way(tasks[0])  # compiles, imports
        costs, times = [], []
        for task in tasks[:most]:
            cost, seconds = _least(way, task)
            costs.append(cost)
            times.append(seconds)
        hits = sum(c <= REACHED * b for c, b in zip(costs, best, strict=False))
        rows.append(IdentificationRow(name, 0.0, float(np.median(times)), f"{hits}/{len(costs)}"))
    rows += _computed(tasks[0], quick)
    ours = rows[0].seconds
    rows = [IdentificationRow(r.name, r.seconds / ours, r.seconds, r.reached, r.computed) for r in rows]
    return sorted(rows, key=lambda row: row.seconds)


def _least(way: Callable[[Task], float], task: Task) -> tuple[float, float]:
    """Cost found, and the least seconds of a few calls; a slow way is called once."""
    times: list[float] = []
    while not times or (len(times) < 7 and sum(times) < 0.1):
        begin = time.process_time()
        cost = way(task)
        times.append(time.process_time() - begin)
    return cost, min(times)


def _ways(quick: bool) -> dict[str, tuple[Callable[[Task], float], int]]:
    """Name -> (way to a cost, most seeds)."""
    few = 2 if quick else 10
    ways: dict[str, tuple[Callable[[Task], float], int]] = {
        "mrdamper, variable projection": (lambda t: _cost_of_model(t, Projection().solve(t.problem).model), 20),
        "mrdamper identify(): motion analysis, errors and scores too": (_whole, 20),
        "plain GA, paper's settings, over mrdamper's batch": (
            lambda t: plain_genetic(t.costs, *t.box, seed=t.seed),
            few,
        ),
        **_scipy(few),
    }
    if importlib.util.find_spec("cma"):
        ways["cma (CMA-ES), closed form"] = (_cma, few)
    if importlib.util.find_spec("pymoo"):
        ways["pymoo GA, defaults, 500 generations, over mrdamper's batch"] = (_pymoo, 1 if quick else 5)
    return ways


def _cost_of_model(task: Task, model: object) -> float:
    motion = task.problem.motion
    error = model.force(task.problem.seen, model.state(motion)[task.problem.scored]) - task.problem.force  # type: ignore[attr-defined]
    return float(error @ error)


def _whole(task: Task) -> float:
    fresh = replace(task.problem.run)  # nothing remembered of its motion
    found = identify(fresh, fixed={"k3": 0.0})
    return float(found.residual @ found.residual)


def _scipy(few: int) -> dict[str, tuple[Callable[[Task], float], int]]:
    from scipy.optimize import differential_evolution, least_squares

    def fit(task: Task, residual: Callable[[np.ndarray], np.ndarray]) -> float:
        return 2 * least_squares(task.unit(residual), np.full(5, 0.5), bounds=(np.zeros(5), np.ones(5))).cost

    def evolve(task: Task) -> float:
        lower, upper = task.box
        found = differential_evolution(
            lambda u: task.costs((lower + u.T * (upper - lower)).reshape(-1, 5)),
            [(0, 1)] * 5,
            rng=np.random.default_rng(task.seed),
            vectorized=True,
            updating="deferred",
        )
        return float(found.fun)

    return {
        "scipy least_squares, 5 parameters, closed form": (lambda t: fit(t, t.residual), 20),
        "scipy least_squares, 5 parameters, odeint": (lambda t: fit(t, _by_odeint(t)), 1 if few < 5 else 3),
        "scipy differential_evolution, over mrdamper's batch": (evolve, few),
    }


def _by_odeint(task: Task) -> Callable[[np.ndarray], np.ndarray]:
    from scipy.integrate import odeint

    motion = task.problem.motion

    def residual(point: np.ndarray) -> np.ndarray:
        c, k1, f0, fz, length = point.tolist()
        beta = 0.5 / length**2

        def rate(z: float, t: float) -> float:
            v = np.interp(t, motion.time, motion.velocity)
            return v - beta * abs(v) * abs(z) * z - beta * v * z * z

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            zeta = odeint(rate, 0.0, motion.time)[task.problem.scored, 0] / length
        return task.columns @ np.array([c, k1, f0]) + fz * zeta - task.problem.force

    return residual


def _cma(task: Task) -> float:
    import cma

    lower, upper = task.box
    search = cma.CMAEvolutionStrategy(
        np.full(5, 0.5), 0.3, {"bounds": [0, 1], "seed": task.seed + 1, "verbose": -9, "tolfun": 1e-9}
    )
    while not search.stop():
        asked = search.ask()
        search.tell(asked, task.costs(lower + np.array(asked) * (upper - lower)).tolist())
    return float(search.result.fbest)


def _pymoo(task: Task) -> float:
    from pymoo.algorithms.soo.nonconvex.ga import GA
    from pymoo.core.problem import Problem as PymooProblem
    from pymoo.optimize import minimize

    class Cost(PymooProblem):
        def __init__(self) -> None:
            super().__init__(n_var=5, n_obj=1, xl=task.box[0], xu=task.box[1])

        def _evaluate(self, x: np.ndarray, out: dict, *args: object, **kwargs: object) -> None:
            out["F"] = task.costs(x)

    return float(minimize(Cost(), GA(pop_size=POPULATION), ("n_gen", GENERATIONS), seed=task.seed).F[0])


def _computed(task: Task, quick: bool) -> list[IdentificationRow]:
    """The GA over integrators: one generation measured, times the generations (RK4 measured in a full run)."""
    from scipy.integrate import solve_ivp

    population = np.random.default_rng(0).uniform(*task.box, (POPULATION, 5))
    task.stepped_costs(population[:1])
    generations = 5 if quick else GENERATIONS
    begin = time.process_time()
    best = plain_genetic(task.stepped_costs, *task.box, seed=0, generations=generations)
    stepped = (time.process_time() - begin) * GENERATIONS / generations
    hit = "-" if quick else f"{int(best <= REACHED * task.best)}/1"
    motion = task.problem.motion

    def integrate() -> None:
        beta = 0.5 / (0.06 * conditions.ONE.amplitude_m) ** 2

        def rate(t: float, z: np.ndarray) -> np.ndarray:
            v = np.interp(t, motion.time, motion.velocity)
            return v - beta * abs(v) * np.abs(z) * z - beta * v * z * z

        solve_ivp(rate, (motion.time[0], motion.time[-1]), [0.0], t_eval=motion.time)

    begin = time.process_time()
    for _ in range(3):
        integrate()
    each = (time.process_time() - begin) / 3
    return [
        IdentificationRow("plain GA, paper's settings, over numba RK4", 0.0, stepped, hit, quick),
        IdentificationRow(
            "plain GA, paper's settings, over scipy solve_ivp", 0.0, each * POPULATION * GENERATIONS, "-", True
        ),
    ]
