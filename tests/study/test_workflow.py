"""The main job on the real data: what a newcomer sees."""

import csv
import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from mrdamper.dampers.model_file import dump_model, load_model
from mrdamper.data import Dataset
from mrdamper.errors import IdentificationError, OutputError
from mrdamper.identification.loop_analysis import analyse_loop, dynamic_ranges
from mrdamper.report.study import write_study
from mrdamper.study import usable_runs
from mrdamper.study.processes import several
from mrdamper.study.validation import validate
from mrdamper.study.workflow import run_study

HOSTILE = "<script>alert(1)</script>=cmd"


@pytest.fixture(scope="module")
def few(bundled):
    """Some runs of a real damper: enough for every recipe, quick to study; their names are an attack on pages."""
    sines = [run for run in bundled.rig("utfsm") if run.excitation == "sine"]
    train, held_out = ([run for run in sines if run.split == split] for split in ("train", "validate"))
    runs = (*train[::2][:4], held_out[0])
    return Dataset(tuple(replace(run, rig="rig", id=f"{HOSTILE}{i}") for i, run in enumerate(runs)), HOSTILE)


@pytest.fixture(scope="module")
def small(few):
    return run_study(few)


@pytest.mark.parametrize("rig", ["utfsm", "labcontrol"])
def test_held_out_runs_are_predicted_better_than_by_bingham(bundled_study, rig):
    found = bundled_study.rig(rig)
    bingham = [c for c in found.candidates if c.recipe.model == "bingham"]
    assert found.chosen.validation.median() <= 0.05
    assert all(found.chosen.validation.median() < other.validation.median() for other in bingham)
    assert found.chosen.cross_validated.median() < min(other.cross_validated.median() for other in bingham)


@pytest.mark.parametrize(("rig", "left_out", "held_out"), [("utfsm", 0.037, 0.034), ("labcontrol", 0.028, 0.025)])
def test_real_dampers_are_predicted_where_nobody_tested(bundled_study, rig, left_out, held_out):
    """Bounds a little above what is measured (docs/play-and-bypass.md)."""
    candidates = next(r for r in bundled_study.rigs if r.rig == rig).candidates
    joint = next(c for c in candidates if c.recipe.name == "play-bypass")
    assert joint.cross_validated.median() < left_out
    assert joint.validation.median() < held_out


def test_train_runs_alone_make_the_model(bundled_study, bundled):
    validate_ids = {run.id for run in bundled.split("validate")}
    for rig in bundled_study.rigs:
        for candidate in rig.candidates:
            assert not validate_ids & {i.run_id for i in candidate.identifications}
            assert {r.run_id for r in candidate.validation.runs} <= validate_ids


def test_the_sweep_is_predicted_but_not_identified_from(bundled_study):
    rig = bundled_study.rig("utfsm")
    assert "utf_chirp15_0A" in rig.not_identified
    sweep = next(r for r in rig.chosen.validation.runs if r.run_id == "utf_chirp15_0A")
    assert {"amplitude", "not a sine"} <= set(sweep.extrapolation)


def test_several_rigs_have_no_single_model(bundled_study):
    with pytest.raises(IdentificationError, match="labcontrol"):
        _ = bundled_study.model


def test_loops_dissipate_and_rise_with_current(bundled):
    loops = [analyse_loop(run) for run in bundled.rig("utfsm") if run.excitation == "sine"]
    assert all(loop.dissipated_energy > 0 for loop in loops)
    for entry in dynamic_ranges(loops):
        assert entry.ratios[0] == 1.0
        assert np.all(np.diff(entry.ratios) > 0)


def test_every_file_of_the_contract_is_there(written):
    """With `--also pdf`."""
    names = {p.name for p in written.iterdir()}
    assert names == {
        "report.html",
        "report.pdf",
        "model-labcontrol.json",
        "model-utfsm.json",
        "identifications.csv",
        "parameters.csv",
        "validation.csv",
        "coverage.csv",
        "figures",
        "forces.csv",
        "made.json",
    }
    assert {p.suffix for p in (written / "figures").iterdir()} == {".svg", ".csv", ".pdf"}


def test_saved_models_predict_what_the_study_predicted(written, bundled_study, bundled):
    for rig in bundled_study.rigs:
        damper = load_model(written / f"model-{rig.rig}.json")
        again = validate(damper, bundled.rig(rig.rig).split("validate"))
        assert [r.scores for r in again.runs] == [r.scores for r in rig.chosen.validation.runs]


def test_tables_carry_units_and_numbers(written):
    with (written / "validation.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {"run_id", "nrmse_pp", "nrmse_std", "wape", "energy_error", "extrapolation"} <= set(rows[0])
    assert all(0 < float(row["nrmse_pp"]) < np.inf for row in rows)
    assert all(float(row["nrmse_pp"]) < 0.15 for row in rows if row["model"] == "play-bypass")
    with (written / "identifications.csv").open() as file:
        identifications = list(csv.DictReader(file))
    names = identifications[0]
    told = [(row["run_id"], row["model"], row["method"]) for row in identifications]
    assert len(set(told)) == len(told)  # two recipes are made of the same ones
    assert {"alpha [N/m]", "alpha low 95 %", "alpha high 95 %"} <= set(names)
    with (written / "parameters.csv").open() as file:
        numbers = list(csv.DictReader(file))
    known = [row for row in numbers if row["state"] == "determined"]
    assert len(known) > 20
    assert all(float(row["low_95"]) < float(row["value"]) < float(row["high_95"]) for row in known)
    assert all(float(row["low_cv"]) <= float(row["high_cv"]) for row in known)


def test_the_figures_of_a_report_agree(written, bundled_study):
    """Mean errors, numbers of parameters, their ranges and the scatter have one value in page, tables and model."""
    validation, parameters = (
        list(csv.DictReader((written / f"{name}.csv").read_text(encoding="utf-8").splitlines()))
        for name in ("validation", "parameters")
    )
    page = " ".join(re.sub(r"<[^>]+>", " ", (written / "report.html").read_text(encoding="utf-8")).split())
    for rig in bundled_study.rigs:
        model = json.loads((written / f"model-{rig.rig}.json").read_text(encoding="utf-8"))
        errors = [
            abs(float(row["nrmse_pp"]))
            for row in validation
            if (row["rig"], row["model"], row["set"]) == (rig.rig, rig.chosen.recipe.name, "cross-validation")
        ]
        mean = f"{100 * np.mean(errors):.2f} %"
        assert model["provenance"]["cross-validation, condition"] == mean
        assert f"condition {mean}, current" in page
        rows = [row for row in parameters if row["rig"] == rig.rig]
        assert len(rows) == len(model["damper"]["free"]) == rig.damper.parameter_count
        assert f"{rig.chosen.title}, {len(rows)} parameters" in page
        assert all(float(row["low_cv"]) <= float(row["value"]) <= float(row["high_cv"]) for row in rows)
        assert f"{100 * model['covariance']['runs']['gain']:.1f} % and" in page
    assert "over conditions, currents and fastest motions: play" in page  # of the rig with two sessions


class _Links(HTMLParser):
    def __init__(self):
        super().__init__()
        self.outside, self.images, self.scripts = [], 0, 0

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self.images += tag == "img"
        self.scripts += tag == "script"
        for name in ("src", "href"):
            value = attributes.get(name, "#")
            if not value.startswith(("#", "data:")):
                self.outside.append(value)
        if tag == "img":
            assert attributes["alt"]


def test_report_is_one_file_without_scripts_or_links_outside(written):
    page = _Links()
    text = (written / "report.html").read_text(encoding="utf-8")
    page.feed(text)
    assert page.outside == []
    assert page.scripts == 0
    assert page.images == 22 + 1  # the logo
    assert len(text) < 6_000_000


def numbers(rig):
    return [c.damper.fitted_parameters for c in rig.candidates], [r.scores for r in rig.chosen.cross_validated.runs]


@pytest.mark.slow
def test_rigs_are_studied_and_drawn_in_several_processes_as_in_one(small, few, tmp_path):
    beside = tuple(replace(run, id=f"other {run.id}", rig="other") for run in few)
    with several(2) as processes:
        again = run_study(Dataset((*beside, *few.runs), "both"), processes=processes)
        write_study(again, tmp_path / "out", processes=processes)
    for name in ("rig", "other"):  # one was studied in this process
        assert numbers(again.rig(name)) == numbers(small.rigs[0])
    assert dump_model(again.rig("rig").damper) == dump_model(small.model)
    assert sum(p.suffix == ".svg" for p in (tmp_path / "out" / "figures").iterdir()) == 22


def test_hostile_names_are_text_in_the_report_and_every_figure_is_a_png_too(small, tmp_path):
    write_study(small, tmp_path / "out", also=("png",))
    drawn = sorted(p.suffix for p in (tmp_path / "out" / "figures").iterdir())
    assert drawn.count(".png") == drawn.count(".svg") == 11
    assert "<script>" not in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    document = json.loads((tmp_path / "out" / "model.json").read_text(encoding="utf-8"))
    assert document["rig"] == "rig"


def test_one_train_run_is_not_enough(bundled):
    runs = [r for r in bundled.rig("utfsm") if r.excitation == "sine"][:1]
    with pytest.raises(IdentificationError, match="needs at least two"):
        run_study(Dataset(tuple(runs)))


def test_a_failed_report_leaves_nothing(small, tmp_path, monkeypatch):
    monkeypatch.setattr("mrdamper.report.study._draw", lambda *a, **k: {})
    monkeypatch.setattr("mrdamper.report.study.render_page", lambda *a, **k: "page")
    monkeypatch.setattr("mrdamper.report.study.dump_model", lambda *a: (_ for _ in ()).throw(RuntimeError("halt")))
    with pytest.raises(RuntimeError, match="halt"):
        write_study(small, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []
    monkeypatch.setattr("mrdamper.report.study.dump_model", lambda *a: "model")
    (tmp_path / "file").write_text("x")
    with pytest.raises(OutputError):
        write_study(small, tmp_path / "file" / "out")


def test_our_own_faults_are_not_a_reason_to_leave_a_run_out(bundled, monkeypatch):
    def broken(run):
        raise ValueError("a fault of the program")

    monkeypatch.setattr(usable_runs, "equivalent_sine", broken)
    with pytest.raises(ValueError, match="a fault of the program"):
        usable_runs.usable_sines(bundled)


def test_terms_the_runs_do_not_show_are_not_in_the_model(bundled_study):
    for rig in bundled_study.rigs:
        known = rig.damper.uncertainty
        for name in ("cq", "qb", "c1", "h1", "m"):  # what `identify_jointly` may do without
            if name in known.names:
                at = known.names.index(name)
                value, error = rig.damper.fitted_parameters[name].value, known.covariance[at, at] ** 0.5
                assert abs(value) > 1.5 * error, f"{rig.rig}: {name} {value:.3g} within {error:.2g} of none"
