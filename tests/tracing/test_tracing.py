"""A traced function computes what the function computes, and only what is needed."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrdamper.tracing import Tape, TraceError, choose, program, settled, streamed
from mrdamper.tracing.python import python_functions, python_source

finite = st.floats(-50, 50)


def traced(function, *names):
    tape = Tape()
    made = program(tape, {"out": function(tape, *(tape.input(name) for name in names))})
    step = python_functions(made)[1]
    memory = tuple(tape.starts.values())
    return made, lambda *values, memory=memory: step((), (), memory, values)


@given(finite, finite)
def test_arithmetic_and_numpy_functions_give_the_same_bits(x, y):
    def formula(x, y):
        bent = np.tanh(x / 7) + np.exp(-abs(y)) - np.sign(x) * np.sqrt(np.maximum(y, 0.25))
        return np.where(x > y, bent**3 - x * y, np.clip(bent, -0.5, 0.5)) + np.expm1(x / 99) * np.arctan(y)

    _, step = traced(lambda tape, x, y: formula(x, y), "x", "y")
    # NumPy's own tanh, exp and expm1 may differ from the C library's in the last digits.
    assert step(x, y)[1][0] == pytest.approx(float(formula(x, y)), rel=1e-13, abs=1e-13)


def test_an_operator_in_place_binds_the_name_and_leaves_the_other_value():
    def formula(tape, x):
        y = x
        y *= 3.0
        y += x
        return y

    _, step = traced(formula, "x")
    assert step(2.0)[1] == (8.0,)


def test_only_the_branch_that_is_taken_is_computed():
    _, step = traced(lambda tape, x: choose(x > 0, lambda: np.log(x), lambda: np.sqrt(-x)), "x")
    assert step(math.e)[1] == (1.0,)
    assert step(-4.0)[1] == (2.0,)


def test_a_value_shared_by_both_branches_is_computed_once():
    def formula(tape, x):
        shared = np.exp(x)
        return choose(x > 0, lambda: shared + 1, lambda: shared - 1)

    made, step = traced(formula, "x")
    assert python_source(made).count("math.exp") == 1
    assert step(0.0)[1] == (0.0,)


def test_what_depends_on_parameters_only_is_computed_before_the_first_sample():
    tape = Tape()
    k, x = tape.parameter("k", 2.0), tape.input("x")
    source = python_source(program(tape, {"out": np.exp(k) * x}))
    before, at = source.split("def step")
    assert "exp" in before
    assert "exp" not in at


def test_a_question_about_the_motion_is_refused_and_about_a_parameter_guarded():
    tape = Tape()
    k, x = tape.parameter("k", 2.0), tape.input("x")
    with pytest.raises(TraceError, match="choose"):
        bool(x > 0)
    out = x * (3.0 if k > 1 else 5.0)
    prepare, step = python_functions(program(tape, {"out": out}))
    assert prepare((2.0,))[0] == 0
    assert prepare((0.5,))[0] == 1
    assert step((2.0,), (), (), (1.0,))[1] == (3.0,)


def test_a_settled_number_holds_for_that_number_only():
    tape = Tape()
    n = tape.parameter("n", 2.0)
    assert settled(n) == 2.0
    prepare, _ = python_functions(program(tape, {"out": tape.input("x")}))
    assert prepare((2.0,))[0] == 0
    assert prepare((3.0,))[0] == 1


def test_a_plain_number_cannot_be_pulled_out_of_an_expression():
    with pytest.raises(TraceError):
        math.sqrt(Tape().input("x"))
    with pytest.raises(TraceError):
        np.median(Tape().input("x"))


def test_memory_is_stored_after_everything_is_computed():
    def swap(tape, x):
        a, b = tape.remember("a", 1.0), tape.remember("b", 2.0)
        tape.update(a, b)
        tape.update(b, a)
        return a - b + 0 * x

    _, step = traced(swap, "x")
    status, out, memory = step(0.0)
    assert (status, out, memory) == (0, (-1.0,), (2.0, 1.0))
    assert step(0.0, memory=memory)[2] == (1.0, 2.0)


def test_previous_is_the_value_of_the_sample_before():
    _, step = traced(lambda tape, x: x - tape.previous(x, "x"), "x")
    _, out, memory = step(5.0)
    assert out == (0.0,)
    assert step(7.0, memory=memory)[1] == (2.0,)


def test_a_loop_ends_when_it_says_so_or_at_its_bound():
    def halve(tape, x):
        return tape.loop([x, 0.0], lambda v, n: (v * 0.5 > 1, [v * 0.5, n + 1]), 6)[1]

    _, step = traced(halve, "x")
    assert step(8.0)[1] == (3.0,)
    assert step(1e9)[1] == (6.0,)


def test_a_streamed_function_runs_as_it_is_on_arrays():
    def step(tape, values):
        held = tape.remember("sum")
        tape.update(held, held + values)
        return held + values

    total = streamed(step)(np.cumsum)
    assert total(np.array([1.0, 2.0, 3.0])).tolist() == [1.0, 3.0, 6.0]
    _, run = traced(lambda tape, x: total(x), "x")
    _, out, memory = run(1.0)
    assert run(2.0, memory=memory)[1] == (3.0,)
    assert out == (1.0,)
