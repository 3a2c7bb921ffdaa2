"""The benchmarks' own arithmetic, and that every row of the quick tables is there; no time is judged."""

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent.parent))

from benchmarks import accuracy, commands, conditions, goals, page, streams, study, testing
from benchmarks.batches import prepared
from benchmarks.genetic import plain_genetic
from benchmarks.identification import Task
from benchmarks.timing import growth, race
from mrdamper.identification.methods.projection import Projection
from mrdamper.physics.hysteresis import Shape, follow
from mrdamper.physics.motion import Path as Strokes
from mutants.groups import GROUPS


def test_growth_is_the_exponent():
    assert growth([10, 100, 1000], [3e-3, 9e-3, 27e-3]) == pytest.approx(np.log10(3))


def test_a_race_calls_everybody_and_ranks_by_work():
    calls = {"short": 0, "long": 0}

    def work(name, loops):
        calls[name] += 1
        return sum(range(loops))

    found = race({"short": lambda: work("short", 10), "long": lambda: work("long", 300_000)}, seconds=0.02)
    assert min(calls.values()) >= 3
    assert found["short"] < found["long"]  # thirty thousand times the work


def test_rk4_of_the_peer_solves_the_same_equation():
    """Stepped finely, where it is accurate, it agrees with the exact strokes."""
    from benchmarks.rk4 import rk4  # with Numba

    t = np.arange(40_001) / 20_000
    beta = 0.5 / 2e-3**2
    x, v = 0.02 * np.sin(2 * np.pi * t), 0.04 * np.pi * np.cos(2 * np.pi * t)
    exact = follow(Shape.from_bouc_wen(beta, beta), Strokes.of(x))
    np.testing.assert_allclose(rk4(v, 5e-5, 1.0, beta, beta, 2.0) / 2e-3, exact, atol=1e-4)


def test_the_plain_genetic_algorithm_lowers_a_cost():
    def bowl(points):
        return np.sum((points - 0.3) ** 2, axis=1)

    found = plain_genetic(bowl, np.zeros(3), np.ones(3), seed=1, generations=60)
    assert found < 1e-2
    assert found == plain_genetic(bowl, np.zeros(3), np.ones(3), seed=1, generations=60)


def test_peers_and_ours_see_the_same_cost():
    task = Task(0)
    model = Projection().solve(task.problem).model
    point = np.array([model.c, model.k1, model.f0, model.yield_force, model.yield_displacement])
    assert task.best == pytest.approx(float(np.sum(np.square(task.residual(point)))), rel=1e-9)
    assert task.costs(point[None])[0] == pytest.approx(task.best, rel=1e-9)
    lower, upper = task.box
    assert np.all((point > lower) & (point < upper))


def test_the_truth_of_the_conditions_is_found():
    for condition in conditions.MATRIX[::11]:
        problem = prepared(conditions.run(condition))
        model = Projection().solve(problem).model
        assert model.yield_displacement == pytest.approx(conditions.damper(condition).yield_displacement, rel=0.3)
        error = model.force(problem.seen, model.state(problem.motion)[problem.scored]) - problem.force
        assert np.std(error) == pytest.approx(conditions.NOISE * np.std(problem.force), rel=0.1)


@pytest.mark.slow  # tests/hysteresis compares strokes with the same distance
def test_accuracy_meets_its_goals():
    found = accuracy.largest_errors()
    assert found["closed"] <= 1e-12
    assert found["tables"] <= 1e-8


@pytest.mark.skipif(not any(map(shutil.which, ("gcc", "clang", "cc"))), reason="needs a C compiler")
def test_generated_c_is_built_timed_and_weighed():
    model = streams.dampers()["Bouc–Wen, n = 2"]
    compiler = next(filter(shutil.which, ("gcc", "clang", "cc")))
    assert streams._in_c(model, compiler, rounds=3) > 0
    sizes = streams._sizes(model, compiler)
    assert sizes is None or 500 < sizes[1] <= sizes[0] < 20_000  # single precision is not larger


def test_parts_of_a_study_add_up_run_by_run():
    clock = study._Clock(["rig_1", "rig_2"])
    for what in ("loops", "bouc-wen run rig_1", "bouc-wen run rig_2", "bouc-wen over all conditions, joint"):
        clock.tell(what, 0.0)
    parts = ["motions and loops", "bouc-wen per-run fits", "bouc-wen over all conditions, joint"]
    assert list(clock.stopped()) == parts
    text = page.page(page.Results(quick=True, study=[study.PartRow(part, (0.5, 1.0)) for part in parts]))
    assert "| bouc-wen per-run fits | 1.50 | 0.500 + 1.00 |" in text


def test_a_missed_goal_says_why():
    rows = [commands.ProcessRow("mrdamper study, caches filled", 7.0, 12.0, 200.0)]
    text = page.page(page.Results(quick=True, processes=rows))
    assert "| 12.0 | missed | every fold of every candidate" in text
    met = page.page(page.Results(quick=True, processes=[commands.ProcessRow(rows[0].name, 4.0, 6.0, 200.0)]))
    assert "| 6.00 | met |  |" in met


def test_an_empty_page_says_what_was_not_measured():
    text = page.page(page.Results(quick=True, accuracy={"closed": 1e-15, "tables": None}))
    assert "| error over z_max for n = 1 and 2 | ≤ 1.0e-12  | 1.0e-15 | met |  |" in text
    assert text.count("not measured") >= 12
    assert "202" not in page.machine().split("Python")[0]  # no date
    assert goals.Goal("x", 1.0, 2.0, "").verdict == "missed"
    assert goals.Goal("x", 1.0, 2.0, "", at_least=True).verdict == "met"


def test_the_page_of_tests_takes_the_last_lines_of_a_command():
    page = testing.PAGE.read_text(encoding="utf-8")
    commands = testing.commands_of(page)
    assert {command.split()[2] for command in commands.values()} == {
        "mutants",
        "fuzz.fuzz_import",
        "fuzz.attack",
        "benchmarks.coverage",
    }
    first, *others = commands.values()
    changed = testing.with_output(page, first, "\n".join(f"line {i}" for i in range(20)))
    assert f"$ {first}\nline 8\n" in changed
    assert "line 19\n```" in changed
    assert all(f"$ {other}\n" in changed for other in others)
    assert testing.with_output(changed, first, "done") == testing.with_output(page, first, "done")


@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.modules[0])
def test_faults_are_planted_in_modules_that_exist(group):
    root = Path(__file__).parent.parent
    assert all((root / test).exists() for test in group.tests)
    assert all((root / "src" / f"{module.replace('.', '/')}.py").is_file() for module in group.modules)
