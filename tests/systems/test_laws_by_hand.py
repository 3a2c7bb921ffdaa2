"""Laws of control beside their formulas: signs, limits, where a mixed law changes over, an optimal one's equations."""

from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_lyapunov
from support.systems import quarter_car

from mrdamper.systems.controllers import controller_type
from mrdamper.systems.controllers.clipped_optimal import ClippedOptimal
from mrdamper.systems.linear import aims, linear_system
from mrdamper.systems.structure import Link, shear_building

CAR = quarter_car("car", 300, 40, 20e3, 200e3)


class Seen:
    """Inputs of a control law: motions above and below the damper as given; outputs are demanded force or current."""

    def __init__(self, rate=0.0, **motions):
        self.motions, self.stroke_rate, self.tape = motions, rate, SimpleNamespace(select=lambda c, a, b: a if c else b)

    def __call__(self, end, what):
        return self.motions[f"{end}_{what}"]

    def on_off(self, on):
        return bool(on)

    def current_for(self, force):
        return force


SIGNS = list(product((-0.3, 0.7), (-0.2, 0.5)))


@pytest.mark.parametrize(("motion", "rate"), SIGNS)
def test_hooks_are_firm_where_they_brake_what_they_hold(motion, rate):
    assert controller_type("skyhook")().law(Seen(rate, above_velocity=motion)) == (motion * rate > 0)
    assert controller_type("groundhook")().law(Seen(rate, below_velocity=motion)) == (motion * rate < 0)
    assert controller_type("add")().law(Seen(rate, above_acceleration=motion)) == (motion * rate > 0)


@pytest.mark.parametrize("name", ["skyhook", "groundhook", "add", "sh-add"])
def test_hooks_are_soft_where_nothing_moves(name):
    still = Seen(0.0, **{f"{end}_{what}": 0.5 for end in ("above", "below") for what in ("velocity", "acceleration")})
    assert not controller_type(name)().law(still)


def test_a_hybrid_is_a_skyhook_a_groundhook_or_their_shares():
    seen = Seen(above_velocity=0.4, below_velocity=-0.7)
    hybrid = controller_type("hybrid")
    assert controller_type("skyhook-continuous")(c_sky=900.0).law(seen) == pytest.approx(360.0)
    assert hybrid(c_hook=900.0, share=1.0).law(seen) == pytest.approx(360.0)
    assert hybrid(c_hook=900.0, share=0.0).law(seen) == pytest.approx(630.0)
    assert hybrid(c_hook=900.0, share=0.25).law(seen) == pytest.approx(0.25 * 360 + 0.75 * 630)


@pytest.mark.parametrize(("ratio", "slow"), [(0.97, True), (1.03, False)])
@pytest.mark.parametrize("size", [0.01, 5.0])
def test_a_mixed_law_changes_over_at_its_frequency_whatever_the_amplitude(ratio, slow, size):
    law, omega = controller_type("sh-add")(crossover_Hz=2.5), 2 * np.pi * 2.5
    for v, rate in SIGNS:
        for sign in (-1, 1):
            a = sign * ratio * omega * v
            seen = Seen(
                rate, above_velocity=size * v, above_acceleration=size * a, below_velocity=9.0, below_acceleration=9.0
            )
            assert law.law(seen) == ((v if slow else a) * rate > 0)


@pytest.fixture(scope="module")
def designed():
    law = ClippedOptimal(effort=0.05, span_weight=3.0)
    return law.designed(CAR, CAR.links, 0.01).design


PAIR = shear_building(
    "pair", [100.0, 80.0], [4e5, 3e5], [50.0, 40.0], [Link("a", "floor1", "ground"), Link("b", "floor2", "floor1")]
)


@pytest.mark.parametrize("system", [CAR, PAIR], ids=["car", "two dampers"])
def test_an_optimal_feedback_is_beaten_by_no_other(system):
    dampers = [link for link in system.links if link.role == "damper"]
    design = ClippedOptimal(effort=0.05, span_weight=3.0).designed(system, system.links, 0.01).design
    linear = linear_system(system, dampers)
    weights = np.array([3.0 if aim.kind == "span" else 1.0 for aim in aims(system)])
    assert len(set(weights)) == 2
    of_state, of_force = (part * weights[:, None] for part in linear.aim)

    def spent(G):
        z, total = np.linspace(1.0, 2.0, len(design.A)) * [1, 1, 10, 10], 0.0
        for _ in range(1000):
            f = -G @ z
            total += np.sum((of_state @ z + of_force @ f) ** 2) + 0.05 / linear.mass**2 * f @ f
            z = design.A @ z + design.B @ f
        return total

    least, rng = spent(design.G), np.random.default_rng(0)
    for _ in range(6):
        way = 1e-3 * np.abs(design.G) * rng.standard_normal(design.G.shape)
        more, less = spent(design.G + way), spent(design.G - way)
        assert min(more, less) > least
        assert abs(more - less) < 0.05 * (more + less - 2 * least)  # a parabola with its vertex here


def test_an_optimal_force_is_asked_for_where_the_damper_can_come_nearer_to_it():
    law = ClippedOptimal()
    for size in (1e-4, 1.0, 1e4):
        for wanted, force in product((-2.0, -0.5, 0.5, 2.0), (-1.0, 1.0)):
            seen = Seen()
            seen.link, seen.force, seen.shared = (
                SimpleNamespace(name="d"),
                size * force,
                {"wanted": {"d": size * wanted}},
            )
            assert law.law(seen) == (wanted * force > 1)  # of the same sign, and larger


def test_an_observer_has_the_least_error_of_all(designed):
    """Beside white noise of the input and of the sensors, as densities; no other gain has a smaller covariance."""
    linear = linear_system(CAR, [link for link in CAR.links if link.role == "damper"])
    np.testing.assert_allclose(designed.C, linear.seen[0] * designed.size[:, None])
    np.testing.assert_allclose(designed.D, linear.seen[1] * designed.size[:, None])
    n, inputs = linear.E.shape
    step = np.zeros((n + inputs, n + inputs))
    step[:n] = 0.01 * np.hstack([linear.A, linear.E])
    E = expm(step)[:n, n:]
    W, V = E @ E.T * ClippedOptimal().noise_ratio, np.eye(3)

    def error(L):
        left = designed.A - L @ designed.C
        return np.trace(solve_discrete_lyapunov(left, W + L @ V @ L.T))

    rng, least = np.random.default_rng(2), error(designed.L)
    for _ in range(6):
        way = 1e-5 * designed.L * rng.standard_normal(designed.L.shape)
        more, less = error(designed.L + way), error(designed.L - way)
        assert min(more, less) > least
        assert abs(more - less) < 0.3 * (more + less - 2 * least)


def test_an_observer_steps_as_its_equation_says(designed):
    design = designed
    n, rng = len(design.A), np.random.default_rng(1)
    z, f, y = rng.standard_normal(n), rng.standard_normal(1), rng.standard_normal(3)
    stepped = {}
    tape = SimpleNamespace(remember=lambda name: z[int(name.removeprefix("estimate"))],
                           update=lambda cell, value: stepped.setdefault(float(cell), value))  # fmt: skip

    class Observed(Seen):
        def __call__(self, name, what):
            return y[design.coordinates.index(name)]

        def signal(self, name):
            return {"damper.force": f[0], "damper.stroke": y[2]}[name]

    seen = Observed()
    seen.tape = tape
    wanted = ClippedOptimal(design=design)._optimal(seen)
    gap = design.size * y - design.C @ z - design.D @ f
    assert [stepped[float(cell)] for cell in z] == pytest.approx(design.A @ z + design.B @ f + design.L @ gap)
    assert wanted == {"damper": pytest.approx(float(-(design.G @ z)[0]))}
    lowest = np.sqrt(np.linalg.eigvals(np.linalg.solve(CAR.M, CAR.K)).real.min())
    assert design.size == pytest.approx([1.0, 1.0, lowest**2])
    # The error of the estimate dies out: it forgets what it did not see begin.
    assert np.abs(np.linalg.eigvals(design.A - design.L @ design.C)).max() < 1
