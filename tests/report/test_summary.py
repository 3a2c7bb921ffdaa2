"""A study on the terminal: at most 20 lines, at most five limitations."""

from dataclasses import replace

import jinja2
import pytest

from mrdamper.report import page
from mrdamper.report.page import percent, plain, render_page
from mrdamper.report.study import _chapter
from mrdamper.report.summary import omission_lines, study_lines


def test_a_study_fits_a_terminal_and_its_details_follow_with_verbose(bundled_study):
    short = study_lines(bundled_study, ["report: r.html"])
    assert len(short) <= 20
    assert 1 <= sum(line.startswith("  - ") for line in short) <= 5
    assert not any(line.endswith("...") for line in short)
    full = study_lines(bundled_study, ["report: r.html"], verbose=True)
    assert len(full) > len(short)
    for rig in bundled_study.rigs:
        median = f"cross-validation {100 * rig.chosen.cross_validated.median():.2f} %"
        assert any(median in line for line in short)
        for name in rig.damper.fitted_parameters:
            assert any(line.startswith(f"  {name} = ") for line in full)


def test_omitted_runs_stand_once_per_reason_and_those_that_other_models_use_apart(bundled_study):
    rig = bundled_study.rigs[0]
    used = rig.chosen.train.runs[0].run_id
    lines = omission_lines(rig.candidates, {used: "no sine", "a": "clipped", "b": "clipped", "c": "clipped"}, 2)
    assert lines == [f"no individual fit: {used} (no sine)", "not used: a, b and 1 more (clipped)"]


def test_a_model_with_a_smaller_error_than_the_chosen_one_has_a_reason(bundled_study):
    rig = bundled_study.rigs[0]
    worst = max(rig.candidates, key=lambda candidate: candidate.cross_validated.median())
    swapped = replace(rig, candidates=(worst, *(one for one in rig.candidates if one is not worst)))
    lines = study_lines(replace(bundled_study, rigs=(swapped,)), [], verbose=True)
    compared = [line for line in lines if line.startswith("  compared: ")]
    assert all("by a standard error" in line or "not eligible" in line for line in compared)
    assert len(compared) == len(rig.candidates) - 1
    assert not any("by a standard error" in line for line in study_lines(bundled_study, [], verbose=True))


def test_a_model_with_a_much_smaller_validation_error_is_named(bundled_study):
    rig = bundled_study.rigs[0]
    chosen, other = rig.chosen, rig.candidates[3]
    assert not any("validation error" in line for line in study_lines(bundled_study, [], verbose=True))
    half = 0.5 * chosen.validation.median()
    runs = [replace(run, scores=replace(run.scores, nrmse_pp=half)) for run in other.validation.runs]
    better = replace(other, validation=replace(other.validation, runs=tuple(runs)))
    candidates = tuple(better if one is other else one for one in rig.candidates)
    lines = study_lines(replace(bundled_study, rigs=(replace(rig, candidates=candidates),)), [])
    (named,) = [line for line in lines if line.startswith(f"  compared: {other.title}")]
    errors = f"validation error {100 * half:.2f} % instead of {200 * half:.2f} %"
    assert named.endswith(f"; {errors}, without effect on the selection: --model {other.recipe.name} takes it")


def test_a_model_that_was_asked_for_stands_beside_better_ones_and_its_other_ways(bundled_study):
    rig = bundled_study.rigs[0]
    chosen = next(one for one in rig.candidates if one.recipe.name == "bingham")
    asked = replace(rig, candidates=(chosen, *(c for c in rig.candidates if c is not chosen)), asked_for=True)
    lines = study_lines(replace(bundled_study, rigs=(asked,)), [])
    (better,) = [line for line in lines if line.startswith("  smaller error: ") and rig.chosen.title in line]
    assert "by a standard error" not in better
    assert not any("next best" in line for line in lines)
    for way in ("global fit", "current laws"):
        (line,) = [line for line in lines if f": modified Bingham, {way}" in line]
        smaller = "smaller error" in line
        assert smaller == ("by a standard error" in line or "not eligible" in line)


def test_runs_that_a_model_of_sines_does_not_use_are_not_among_its_identification_runs(bundled_study):
    rig = bundled_study.rigs[0]
    other = next(candidate for candidate in rig.candidates if candidate.identifications)
    shorter = replace(rig, candidates=(replace(other, identifications=other.identifications[:3]),))
    assert any(
        line.endswith(", 3 identification runs") for line in study_lines(replace(bundled_study, rigs=(shorter,)), [])
    )


def test_conditions_are_written_as_in_a_test_plan():
    assert [plain(v) for v in (1.5003, -0.0004, 0.500000000013146, 12.0, 0.25)] == ["1.5", "0", "0.5", "12", "0.25"]
    assert (percent(-0.0004), plain(None)) == ("0.0", "–")


@pytest.mark.parametrize(
    ("values", "columns"), [(("1", "–"), "abc"), (("–", "–"), "ac"), (("", "–"), "ac"), (("<b>–</b>", "–"), "abc")]
)
def test_a_column_without_a_value_in_any_row_is_left_out(monkeypatch, values, columns):
    rows = "".join(f'<tr class="r"><td>x</td><td class="wrap">{value}</td><td>0</td></tr>' for value in values)
    table = f"<table><thead><tr><th>a</th><th>b</th><th>c</th></tr></thead><tbody>{rows}</tbody></table>"
    facts = '<table class="facts"><tr><td>name</td><td>–</td></tr></table>'
    monkeypatch.setattr(page._ENVIRONMENT, "loader", jinja2.DictLoader({"page": table + facts}))
    text = render_page("page", "", "")
    assert [name for name in "abc" if f"<th>{name}</th>" in text] == list(columns)
    assert text.count("<td") == len(columns) * len(values) + 2
    assert text.endswith(facts)


def test_a_table_of_headings_alone_is_kept(monkeypatch):
    table = "<table><tr><th>a</th><th>b</th></tr></table>"
    monkeypatch.setattr(page._ENVIRONMENT, "loader", jinja2.DictLoader({"page": table}))
    assert render_page("page", "", "") == table


def test_the_caption_of_predicted_loops_tells_absent_validation_runs_from_those_that_are_no_sines(bundled_study):
    rig = bundled_study.rigs[0]
    trained = replace(rig, dataset=rig.dataset.only([replace(run, split="train") for run in rig.dataset]))
    assert _chapter(trained, {}, ())["predicted_caption"].startswith("Identification runs")
    assert "no validation run is a steady sine." in _chapter(trained, {}, ())["predicted_caption"]
    chosen = replace(rig.chosen, validation=replace(rig.chosen.validation, runs=()))
    alone = replace(trained, candidates=(chosen, *rig.candidates[1:]))
    assert "there are no validation runs." in _chapter(alone, {}, ())["predicted_caption"]
