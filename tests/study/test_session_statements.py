"""Any way of stating sessions, from the study to the export: intervals are bounded or refused, and no command fails."""

from dataclasses import replace

import numpy as np
import pytest
from support.command import mrdamper

from benchmarks import synthetic_dampers
from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.dampers.joint import JointProblem
from mrdamper.dampers.model_file import save_model
from mrdamper.dampers.uncertainty import table
from mrdamper.data import Dataset, session_of
from mrdamper.study.workflow import run_study

STATED = {
    "one": lambda i: {"session": "campaign-1"},
    "two": lambda i: {"session": f"day {i % 2}"},
    "three": lambda i: {"session": f"day {i % 3}"},
    "unknown": lambda i: {},
    "one a run": lambda i: {"session": f"day {i}"},
}
MAX_RELATIVE = 1e3  # half width of an interval over its estimate, from which a parameter is not identifiable


def synthetic(number):
    damper = synthetic_dampers.drawn(10)[number]
    runs = synthetic_dampers.tests_of(damper, "sparse", np.random.default_rng(number))[::2]
    return [replace(run, id=f"{run.id}_{k}") for k, run in enumerate(runs)]


def stated_in(runs, way):
    clock = ("session", "recorded_at")
    kept = [{key: note for key, note in run.notes.items() if key not in clock} for run in runs]
    return [
        replace(run, notes={**notes, **STATED[way](i)}) for i, (run, notes) in enumerate(zip(runs, kept, strict=True))
    ]


def studied(runs):
    (study,) = run_study(Dataset(tuple(runs), "rig")).rigs
    return study


def require_bounded(damper):
    for row in table(damper):
        half = (row["high"] - row["low"]) / 2
        assert half < MAX_RELATIVE * abs(row["value"]) or np.isnan(half), row
        assert np.isfinite(half) or "not identifiable" in row["state"] or "one-sided" in row["state"], row


def require_usable(damper, folder):
    model = folder / "model.json"
    save_model(damper, model)
    middle = damper.envelope.middle
    asked = ("--current", middle.current_A, "--frequency", middle.frequency_Hz, "--amplitude", 1e3 * middle.amplitude_m)
    hours = 1.0 + 30 / damper.envelope.frequency_Hz[0] / 3600
    for command in (
        ("predict", model, *asked, "--out", folder / "force.csv"),
        ("plan", model, "--hours", hours, "--out", folder / "plan"),
        ("simulate", "quarter-car", "--input", "bump:length_s=0.3", "--damper", model, "--draws", 5, "--json"),
        ("export", model, "--to", "c", "--out", folder / "c"),
    ):
        done = mrdamper(*command)
        assert done.returncode == 0, (command, done.stderr)


def test_a_small_rig_whose_runs_are_of_one_session(tmp_path):
    """The model that most studies choose; the study itself is among the slow tests."""
    runs = stated_in(synthetic(4), "one")
    damper = estimate_uncertainty(JointProblem(runs, "play-bypass").fit().damper, runs)
    require_bounded(damper)
    require_usable(damper, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize(("number", "rig"), list(enumerate(["utfsm", "labcontrol", *range(10)])))
def test_every_rig_and_every_statement(number, rig, tmp_path, bundled):
    """One study a rig; its runs and their cross-validated predictions are then of other sessions.

    The commands, which take most of the time, are run for two statements a rig, each with four or five of the rigs.
    """
    if isinstance(rig, int):
        runs = synthetic(rig)
    else:
        runs = [run for run in bundled.rig(rig) if run.excitation == "sine" and run.split == "train"][::3]
    study = studied(runs)
    predicted = [score.predicted for score in study.chosen.cross_validated.runs if score.predicted is not None]
    assert predicted
    for turn, way in enumerate(STATED):
        relabelled = stated_in(runs, way)
        sessions = {run.id: session_of(run) for run in relabelled}
        seen = [replace(one, session=sessions[one.run_id]) for one in predicted]
        damper = estimate_uncertainty(study.damper, relabelled, seen)
        require_bounded(damper)
        if (turn - number) % len(STATED) in (0, 2):
            (tmp_path / way).mkdir()
            require_usable(damper, tmp_path / way)
