from dataclasses import replace

import numpy as np
import pytest

from mrdamper.data import Condition, Dataset, Run, same_condition
from mrdamper.errors import ConditionError, NonFiniteError, RunError, TimeOrderError, UnknownNameError
from mrdamper.physics.motion import analyse_motion


def run(**changes):
    t = np.linspace(0, 1, 11)
    fields = {"id": "a", "time": t, "displacement": np.sin(t), "force": np.cos(t), "current": 0.5, **changes}
    return Run(**fields)


def test_scalar_current_holds_for_the_whole_run():
    assert run().current.shape == (11,)
    assert run().current_A == 0.5


def test_channels_are_read_only():
    with pytest.raises(ValueError, match="read-only"):
        run().force[0] = 1.0


@pytest.mark.parametrize(
    ("changes", "error", "text"),
    [
        ({"force": np.zeros(10)}, RunError, "force has 10 samples, time has 11"),
        ({"time": np.zeros(11)}, TimeOrderError, "at sample 1"),
        ({"time": np.linspace(1, 0, 11)}, TimeOrderError, "sort the samples"),
        ({"force": np.full(11, np.nan)}, NonFiniteError, "11 values"),
        ({"displacement": np.zeros((11, 2))}, RunError, "2 dimensions"),
        ({"split": "test"}, RunError, "use train or validate"),
    ],
)
def test_what_does_not_fit_is_refused_with_the_run_and_the_remedy(changes, error, text):
    with pytest.raises(error) as caught:
        run(**changes)
    assert text in str(caught.value)
    assert "run a" in str(caught.value)
    assert caught.value.code in str(caught.value)


def test_varying_current_has_no_single_value():
    with pytest.raises(RunError, match="current changes"):
        _ = run(current=np.linspace(0, 1, 11)).current_A


def test_a_part_keeps_its_segments():
    whole = run(segments=((0, 4), (4, 11)))
    assert whole.part(2, 9).segments == ((0, 2), (2, 7))


def test_an_empty_window_is_said():
    with pytest.raises(RunError, match="correct steady_t0_s"):
        run(window=(5.0, 6.0)).steady()


def test_dataset_refuses_twins_and_offers_near_names():
    with pytest.raises(RunError, match="two runs are called a"):
        Dataset((run(), run()))
    with pytest.raises(UnknownNameError, match="did you mean run_1"):
        _ = Dataset((run(id="run_1"),))["run_l"]
    for split, near in (
        ("validation", "did you mean validate"),
        ("Train", "did you mean train"),
        ("x", "known: train"),
    ):
        with pytest.raises(UnknownNameError, match=near):
            Dataset((run(),)).split(split)
    with pytest.raises(RunError, match="no runs"):
        Dataset(())


def test_a_rig_without_a_name_is_found_by_that_of_the_dataset():
    dataset = Dataset((run(id="a", rig=""), run(id="b", rig="other")), "bench")
    assert [one.id for one in dataset.rig("bench")] == [one.id for one in dataset.rig("")] == ["a"]
    assert dataset.rig("bench").name == "bench"
    with pytest.raises(UnknownNameError, match="known: bench, other"):
        dataset.rig("xyz")


def test_a_run_of_a_dataset_is_found_by_id_and_by_position():
    dataset = Dataset((run(id="a"), run(id="b")))
    assert (dataset["b"], dataset[1], dataset[-2]) == (dataset.runs[1], dataset.runs[1], dataset.runs[0])
    with pytest.raises(UnknownNameError, match="no run at position 2; there are 2, from 0"):
        _ = dataset[2]


def test_conditions_agree_to_three_per_cent():
    a, b, c = Condition(0.5, 1.0, 0.01), Condition(0.5, 1.02, 0.0102), Condition(0.5, 1.2, 0.01)
    assert same_condition([a, b, c]) == [[0, 1], [2]]


@pytest.mark.parametrize(
    "values",
    [
        (float("nan"), 1, 0.01), (0.5, -1, 0.01), (0.5, 1, -0.01), (0.5, float("inf"), 0.01), (0.5, 1, 10.0),
        (0.5, 5e-324, 0.01), (0.5, 1e300, 0.01),
    ],
)  # fmt: skip
def test_conditions_no_test_can_have_are_refused(values):
    with pytest.raises(ConditionError) as error:
        Condition(*values)
    assert "give" in error.value.remedy


def test_a_measured_current_may_be_negative():
    assert Condition(-0.5, 1.0, 0.01).current_A == -0.5


@pytest.mark.parametrize(("mean", "written"), [(-0.0003, "0"), (0.4997, "0.5"), (-1.4985, "-1.5"), (0.333, "0.333")])
def test_a_noisy_current_is_the_level_a_test_plan_would_write(mean, written):
    t = np.arange(2000) / 500
    noise = 0.004 * np.random.default_rng(0).standard_normal(t.size)
    run = Run("r", t, 0.01 * np.sin(6 * t), np.cos(6 * t), mean + noise - noise.mean())
    assert f"{run.current_A:g}" == written
    assert str(replace(Condition(0, 1, 0.01), current_A=run.current_A)).startswith(f"{written} A")


@pytest.mark.parametrize("current", [-0.0003, -0.0001, 0.0004])
def test_a_current_near_zero_is_zero_without_a_sign(current):
    t = np.arange(200) / 500
    for channel in (current, current + 1e-5 * np.sin(300 * t)):
        found = Run("r", t, 0.01 * np.sin(6 * t), np.cos(6 * t), channel).current_A
        assert str(found) == "0.0"


def test_the_direction_of_the_current_changes_nothing():
    """A coil connected the other way is no fault: models and conditions are given the magnitude."""
    t = np.arange(2000) / 500
    run = Run("r", t, 0.01 * np.sin(6 * t), np.cos(6 * t), 0.5)
    turned = replace(run, current=-run.current)
    assert turned.current_A == -0.5
    assert (turned.coil_current == run.coil_current).all()
    assert analyse_motion(turned).condition == analyse_motion(run).condition
