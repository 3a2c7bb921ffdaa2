"""A study, a comparison and an identification check stored runs as the import does."""

from dataclasses import replace

import numpy as np
import pytest

from mrdamper.study.usable_runs import accepted_runs, usable_sines


@pytest.fixture(scope="module")
def runs(bundled):
    return [run for run in bundled.rig("utfsm") if run.excitation == "sine"][:5]


def sampled(run, time, displacement, force):
    channels = {"time": time, "displacement": displacement, "force": force, "current": np.full(time.size, 0.5)}
    return replace(run, **channels, velocity=None, window=None, segments=())


def square(run):
    t = np.arange(2000) / 500
    return sampled(run, t, 0.01 * np.sign(np.sin(6 * t)), 500 * np.sign(np.cos(6 * t)))


def coarse(run):
    t = np.arange(60) / 3.1
    return sampled(run, t, 0.01 * np.sin(2 * np.pi * t), 500 * np.cos(2 * np.pi * t))


def noise(run):
    return replace(run, force=500 * np.random.default_rng(1).normal(size=run.time.size))


def random_walk(run):
    return replace(run, force=np.cumsum(np.random.default_rng(3).normal(0, 1, run.time.size)))


@pytest.mark.parametrize(
    ("harm", "code"),
    [
        (lambda run: replace(run, force=-run.force), "E_DISSIPATION_SIGN"),
        (lambda run: replace(run, force=run.force[::-1], displacement=run.displacement[::-1]), "E_DISSIPATION_SIGN"),
        (noise, "E_NOISE"),
        (lambda run: replace(run, displacement=1e-5 * noise(run).force), "E_NOISE"),
        (lambda run: replace(run, force=np.zeros(run.time.size)), "E_RANGE"),
        (lambda run: replace(run, force=1e5 * run.displacement), "E_NO_ENERGY"),
        (lambda run: replace(run, force=300 * np.sin(5 * run.time)), ""),
        (random_walk, ""),
        (lambda run: replace(run, force=run.force.clip(max=0.8 * run.force.max())), "W_CLIPPED"),
        (lambda run: replace(run, force=1000 * run.force), "E_OTHER_SIZE"),
        (lambda run: replace(run, current=np.full(run.time.size, 26.0)), "E_OTHER_SIZE"),
        (square, "E_UNRESOLVED"),
        (coarse, ""),
    ],
    ids=[
        "force reversed", "time reversed", "noise", "a motion of noise", "no force", "a spring", "another test",
        "random walk", "clipped", "kilonewtons", "temperature as current", "square wave", "three samples a cycle",
    ],
)  # fmt: skip
def test_a_run_that_cannot_be_believed_is_left_out_by_name(bundled, runs, harm, code):
    harmed = replace(harm(runs[0]), id="harmed")
    sines, refused = usable_sines(bundled.only([harmed, *runs[1:]]))
    assert [run.id for run in sines] == [run.id for run in runs[1:]]
    assert list(refused) == ["harmed"]
    assert code in refused["harmed"]


def test_the_same_samples_count_once_and_leak_into_nothing(bundled, runs):
    again = replace(runs[0], id="again", split="validate")
    rounded = replace(runs[0], id="rounded", force=np.round(runs[0].force, 3), time=runs[0].time + 5)
    kept, refused = accepted_runs(bundled.only([*runs, again, rounded]))
    assert [run.id for run in kept] == [run.id for run in runs]
    assert all("the same samples as run " + runs[0].id in refused[name] for name in ("again", "rounded"))


def test_all_bundled_runs_are_believed(bundled):
    kept, refused = accepted_runs(bundled)
    assert len(kept) == len(bundled)
    assert not refused
