"""What a notebook shows: a line, a table, data frames, loops in axes of one's own."""

from dataclasses import replace
from importlib.resources import files

import numpy as np
import polars
import pytest
from support.dampers import all_dampers, joint_damper

from mrdamper import (
    identify,
    invert,
    load_input,
    load_model,
    load_system,
    plot_force,
    plot_loop,
    simulate_system,
    validate,
)
from mrdamper.dampers.base import Damper
from mrdamper.dampers.streaming import stepper
from mrdamper.data import Condition
from mrdamper.errors import InputError
from mrdamper.study.recipe import RecipeResult, whole_damper
from mrdamper.study.validation import Validation
from mrdamper.study.workflow import RigStudy


@pytest.fixture(scope="module")
def shown(bundled):
    run, damper = bundled["utf_5mm4Hz_1A"], joint_damper()
    return {
        "run": run,
        "dataset": bundled,
        "identification": identify(run),
        "prediction": damper.predict(Condition(0.5, 2.0, 0.01)),
        "validation": validate(damper, [run]),
        "simulation": simulate_system(load_system("quarter-car").system, load_input("bump"), {}, step=1e-3),
        **{f"damper {name}": d for name, d in all_dampers().items() if isinstance(d, Damper)},
    }


def test_objects_without_a_table_are_shown_in_a_line():
    model = load_model(files("mrdamper.data.bundled") / "models/labcontrol.json")
    shown = [
        model.prediction_interval(model.predict(Condition(0.5, 1.0, 0.01))),
        load_system("dyke1996").system,
        stepper(model),
        invert(model),
    ]
    for one in shown:
        assert repr(one).startswith("<")
        assert len(repr(one)) < 200
        assert " at 0x" not in repr(one)
        assert "array" not in repr(one)


def test_a_line_a_table_and_data_frames(shown):
    import pandas  # for which no other test waits

    for name, one in shown.items():
        assert all(len(line) < 200 for line in repr(one).splitlines()), name
        html = one._repr_html_()
        assert 0 < html.count("<tr>") <= 31
        assert len(html) < 20_000
        frames = one.to_polars(), one.to_pandas()
        assert isinstance(frames[0], polars.DataFrame)
        assert isinstance(frames[1], pandas.DataFrame)
        for frame in frames:
            assert list(frame.columns) == list(one.table)
            assert len(frame) == len(next(iter(one.table.values())))


def test_a_headline_names_neither_a_missing_rig_nor_missing_runs_nor_the_noise_of_a_current(bundled):
    run = bundled["utf_5mm4Hz_1A"]
    off = 0.015 * np.random.default_rng(0).standard_normal(run.time.size)
    one = replace(run, rig="", current=off)
    assert repr(one) == f"<run {run.id}: {run.time.size} samples, {run.time[-1] - run.time[0]:.4g} s, 0 A, {run.split}>"
    assert repr(bundled.only([run])).endswith(": 1 run, 1 of rig utfsm; no validation runs>")
    damper = replace(joint_damper(), rig="")
    assert repr(damper).startswith(f"<{damper.title}: ")
    scored = RecipeResult(whole_damper("play-bypass"), damper, None, (), 0.1, *3 * (Validation("none", ()),), 0.1)
    study = RigStudy("", bundled.only([one]), (), (), (scored,), {}, {})
    assert repr(study).splitlines()[0].startswith(f"<{scored.title}, no cross-validation runs, no validation runs")


def test_names_from_files_are_text(bundled):
    run = replace(bundled["utf_5mm4Hz_1A"], rig="</td><script>alert(1)</script>")
    assert "<script>" not in bundled.only([run])._repr_html_()


def test_loops_are_drawn_into_given_axes(bundled):
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    run = bundled["utf_5mm4Hz_1A"]
    assert plot_loop(run, axes, over="velocity", color="black") is axes
    assert plot_loop(joint_damper().predict(run), axes, over="velocity") is axes
    measured, predicted = axes.lines
    assert measured.get_color() == "black"
    assert np.array_equal(measured.get_ydata(), 1e-3 * run.steady().force)
    assert predicted.get_xdata().size == run.time.size
    assert plot_force(run, Figure().subplots()).get_xlabel() == "Time (s)"
    with pytest.raises(InputError, match="speed"):
        plot_loop(run, axes, over="speed")
