"""Runs that contradict the others are found with their cause; sound runs, sessions and reversed coils are not."""

import re
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.data import Dataset, Run
from mrdamper.rig_files.dataset_folder import load_dataset, save_dataset
from mrdamper.rig_files.rig_import import import_files, to_dataset
from mrdamper.study.check import check
from mrdamper.study.contradictions import ContradictionError, compare_runs
from mrdamper.study.contradictions.evidence import AssumedScatter, Evidence
from mrdamper.study.contradictions.explanations import Explanation, Trial, completed_matrix_odds, unproven_currents
from mrdamper.study.contradictions.findings import describe
from mrdamper.study.contradictions.gains import gain_differences
from mrdamper.study.contradictions.repeats import unequal_repeats
from mrdamper.study.contradictions.tracks import tracks_of

sys.path.insert(0, str(Path(__file__).parent.parent.parent))
from benchmarks import synthetic_dampers
from benchmarks.contradicting_folders import DAMPERS, folders, full_matrix, make_run, motions, sound_folder
from benchmarks.contradicting_folders_two import DAMPERS as SECOND
from benchmarks.contradicting_folders_two import second_folders

first_set, second_set = cache(folders), cache(second_folders)  # their dampers are integrated step by step


@pytest.fixture(scope="module")
def sound():
    return full_matrix(DAMPERS[0], np.random.default_rng(11), drift=0.08)


@pytest.fixture(scope="module")
def cases():
    return {folder.name: folder for folder in first_set(DAMPERS[0])}


def find_contradictions(runs, keep=()):
    return compare_runs(runs, keep).contradictions


def changed(runs, k, **channels):
    return [*runs[:k], replace(runs[k], **channels), *runs[k + 1 :]]


def repeated(runs, gains, session=""):
    """Runs, and some of them measured again with other noise and another gain."""
    rng, first = np.random.default_rng(5), [replace(run, notes={"session": "one"} if session else {}) for run in runs]
    again = [
        replace(run, id=f"{run.id} again", force=gain * (run.force + rng.normal(0, 3, run.force.size)))
        for run, gain in zip(runs, gains, strict=False)
    ]
    return [*first, *(replace(run, notes={"session": session} if session else {}) for run in again)]


@pytest.mark.parametrize(
    ("gains", "text"),
    [
        ([1.25] * 6, "6 runs ("),
        ([1.12, 1.13, 1.12, 1.14], "4 runs ("),
        ([1.3, 1.0, 1.0, 1.02], " times the force of run "),
        ([1.05] * 6, ""),
        ([1.08, 0.94, 1.11, 0.97], ""),
    ],
)
def test_repeated_tests_that_differ_in_force_are_stated(sound, gains, text):
    notes = unequal_repeats(tracks_of(repeated(sound, gains)))
    assert [text in note for note in notes] == [True] * bool(text)


def test_repeated_tests_of_stated_sessions_are_stated_by_session_and_exclude_no_run(sound):
    runs = repeated(sound, [1.25] * 4, "two")
    comparison = compare_runs(runs)
    assert comparison.contradictions == []
    assert comparison.notes[0].startswith("The tests of session two have 1.25 times the force of those of session one")
    findings = check(Dataset(tuple(runs), "rig")).findings
    assert ("W_REPEATS", "noted", "") in [(one.code, one.severity, one.run_id) for one in findings]


def test_the_command_states_repeated_tests_that_differ(sound, tmp_path):
    save_dataset(Dataset(tuple(repeated(sound, [1.25] * 4)), "rig"), tmp_path / "rig")
    result = CliRunner().invoke(application(), ["check", str(tmp_path / "rig")])
    assert "W_REPEATS: 4 runs (" in result.stderr


def test_both_signs_are_told_from_a_zero_of_the_force_only_where_the_loop_shows_it(sound):
    """Inverted, the loop of a symmetric damper is the loop with its mean force of the other sign."""
    half = float(np.median([np.ptp(run.force) / 2 for run in sound]))
    mean = float(np.mean(sound[4].steady().force))
    runs = [replace(run, force=run.force - mean + 0.5 * half) for run in sound]
    (one,) = find_contradictions(changed(runs, 4, force=-runs[4].force, displacement=-runs[4].displacement))
    assert one.cause == "sign"
    assert f"or the zero of its force is off by {-half:.0f}"[:-2] in one.explanation
    assert "sign = -1" in one.remedy
    assert "if it is the zero" in one.remedy
    (zero,) = find_contradictions(changed(runs, 4, force=runs[4].force - 0.5 * half))
    assert zero.cause == "offset"


@pytest.mark.parametrize("rig", ["labcontrol", "utfsm"])
def test_no_run_of_a_bundled_rig_is_accused(bundled_study, rig):
    assert bundled_study.rig(rig).contradictions == ()
    assert bundled_study.rig(rig).comparison_notes == ()


@pytest.mark.parametrize(
    "number", [4, 86, 3191, *(pytest.param(k, marks=pytest.mark.slow) for k in (1, 9, 14, 24, 3152, 3159))]
)
def test_no_run_of_a_sound_folder_is_accused(number):
    assert find_contradictions(sound_folder(number)) == []


@pytest.mark.slow
@pytest.mark.parametrize("number", [3, 21])
def test_a_motion_that_the_comparison_describes_badly_accuses_no_run(number):
    """The loops of these dampers at the slowest motion are none that elastic-plastic elements make."""
    damper = synthetic_dampers.drawn(number + 1)[number]
    runs = synthetic_dampers.tests_of(damper, "matrix", np.random.default_rng(number))
    assert find_contradictions(runs) == []
    slow = next(run for run in runs if run.id == "sine18")  # 0.75 of the full current at that motion
    in_lbf = [replace(run, force=run.force / 4.448) if run is slow else run for run in runs]
    assert [(one.run_id, one.cause) for one in find_contradictions(in_lbf)] == [("sine18", "force")]


def test_a_gain_of_sessions_is_no_contradiction(sound):
    runs = [replace(run, force=(1.08 if k % 2 else 0.92) * run.force) for k, run in enumerate(sound)]
    assert find_contradictions(runs) == []


def test_a_reversed_coil_is_no_contradiction(sound):
    runs = [replace(run, current=-run.current) if k % 3 == 0 else run for k, run in enumerate(sound)]
    assert find_contradictions(runs) == []


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("one run in lbf", 4.448),
        ("one run in inches", 25.4),
        ("current in mA", 1.0),
        ("open coil", 0.0),
        ("both channels inverted", -1.0),
        pytest.param("N under lbf", 1 / 4.448, marks=pytest.mark.slow),
        pytest.param("two half-open coils", 0.75, marks=pytest.mark.slow),
        pytest.param("a random record in lbf", 4.448, marks=pytest.mark.slow),
        pytest.param("one run in kgf", 9.807, marks=pytest.mark.slow),
        pytest.param("three runs in lbf", 4.448, marks=pytest.mark.slow),
        pytest.param("one run in cm", 10.0, marks=pytest.mark.slow),
        pytest.param("half-open coil", 0.5, marks=pytest.mark.slow),
        pytest.param("half the force", 2.0, marks=pytest.mark.slow),
    ],
)
def test_the_run_and_its_cause_are_named(cases, name, value):
    folder = cases[name]
    found = find_contradictions(folder.runs)
    assert {one.run_id for one in found} == folder.wrong
    assert {one.cause for one in found} <= set(folder.causes)
    assert [one.value for one in found] == pytest.approx([value] * len(found), rel=0.1, abs=0.01)


def test_a_stated_current_is_corrected_in_the_dataset(cases, tmp_path):
    stated = [replace(run, current=run.mean_current) for run in cases["open coil"].runs]
    (found,) = find_contradictions(stated)
    run, current = re.search(r"set current_A of (\S+) to (\S+) in runs.csv of the dataset", found.remedy).groups()
    save_dataset(Dataset(tuple(stated)), tmp_path / "rig")
    table = pl.read_csv(tmp_path / "rig" / "runs.csv", infer_schema=False)
    corrected = pl.when(pl.col("run_id") == run).then(pl.lit(current)).otherwise(pl.col("current_A"))
    table.with_columns(current_A=corrected).write_csv(tmp_path / "rig" / "runs.csv")
    assert not find_contradictions(load_dataset(tmp_path / "rig").runs)


def test_a_run_of_another_unit_does_not_hide_another_with_a_wrong_current(sound):
    runs = changed(sound, 4, force=sound[4].force / 4.448)
    runs = changed(runs, 9, current=runs[9].current / 10)
    limit = 0.8 * np.max(np.abs(runs[8].force))
    runs = changed(runs, 8, force=np.clip(runs[8].force, -limit, limit))  # makes the currents less certain
    assert {one.run_id: one.cause for one in find_contradictions(runs)} == {
        sound[4].id: "force",
        sound[9].id: "current",
    }


@pytest.mark.parametrize("stated", [{3: 0.0, 9: 0.5}, {4: 1.0, 6: 1.5}])
def test_wrong_currents_of_several_runs_are_found_together(sound, stated):
    runs = [replace(run, current=0 * run.current + stated.get(k, run.mean_current)) for k, run in enumerate(sound)]
    found = {one.run_id: one.value for one in find_contradictions(runs)}
    assert found == pytest.approx({sound[k].id: sound[k].mean_current for k in stated}, abs=0.01)


def test_a_session_with_a_part_of_the_current_is_found_where_others_are_at_its_currents(sound):
    sessions = [replace(run, notes={"session": "ABC"[k % 3]}) for k, run in enumerate(sound)]
    runs = [replace(run, current=run.current / 0.7) if k % 3 == 1 else run for k, run in enumerate(sessions)]
    assert {one.run_id: one.cause for one in find_contradictions(runs)} == {"t04": "current", "t07": "current"}


def test_clipped_runs_get_no_other_current_and_show_the_range_that_cuts_off_others(sound):
    """Those flat at a level at which two others are cut off are excluded, though their own loop could be a damper's."""
    limit = 0.6 * max(float(np.max(np.abs(run.force))) for run in sound[9:])
    cut = [replace(run, force=np.clip(run.force, -limit, limit)) for run in sound[9:]]
    reduction = limit / (limit**12 + np.abs(sound[11].force) ** 12) ** (1 / 12)
    runs = [*sound[:9], *cut[:2], replace(sound[11], force=sound[11].force * reduction)]
    assert {one.run_id: one.code for one in find_contradictions(runs)} == {"t11": "W_CLIPPED"}
    assert find_contradictions([*sound[:9], cut[0], *sound[10:]]) == []


@pytest.mark.parametrize("code", ["W_LAG", "W_FILTERED"])
def test_a_lag_that_the_check_of_the_record_states_is_the_cause_instead_of_another_damper(sound, code):
    explanation = Explanation(Trial("damper", 1.0, "", 10.0), 50.0, None)
    one = describe(replace(sound[4], notes={"findings": code}), explanation, 11)
    assert one.code == code
    assert "rig of runs.csv" not in one.remedy


@pytest.mark.parametrize(
    ("channel", "factor", "remedy"),
    [
        ("force", 1 / 9.80665, 'unit = "kN" and scale = 9.8'),  # kilonewtons in thousands of kgf
        pytest.param("displacement", 1 / 25.4, 'unit = "inch"', marks=pytest.mark.slow),
        pytest.param("time", 5.0, 'unit = "s" and scale = 0.2', marks=pytest.mark.slow),
        pytest.param("rate", 0.2, "[file] sample_rate_Hz = ", marks=pytest.mark.slow),
        pytest.param("current", 0.5, 'unit = "mA" and scale = 1 and offset = 500', marks=pytest.mark.slow),
        ("current", 0.5, "or with scale = 2: one current does not show which"),
        pytest.param("current", 0.1, 'unit = "mA" and scale = 10', marks=pytest.mark.slow),
    ],
)
def test_the_remedy_of_a_wrong_scale_obeyed_literally_corrects_the_test(sound, tmp_path, channel, factor, remedy):
    names = {"time": "time [s]", "displacement": "stroke [mm]", "force": "load [kN]", "current": "current [mA]"}
    (tmp_path / "rig").mkdir()
    for k, run in enumerate(sound):
        columns = {"time": run.time, "displacement": 1e3 * run.displacement, "force": 1e-3 * run.force}
        rate = (factor if k == 7 else 1.0) * (run.time.size - 1) / float(np.ptp(run.time))
        if channel == "rate":
            del columns["time"]
        elif channel == "current":
            columns["current"] = 1e3 * (factor if k == 7 else 1.0) * run.mean_current + np.arange(run.time.size) % 2
        else:
            columns[channel] = columns[channel] * (factor if k == 7 else 1.0)
        table = pl.DataFrame({names[name]: values for name, values in columns.items()})
        head = f"Sample rate: {rate:.6g} Hz\n" if channel == "rate" else ""
        stated = "" if channel == "current" else f"_{run.mean_current:g}A"
        path = tmp_path / "rig" / f"{run.id}{stated}.csv"
        path.write_text(head + table.write_csv())
    imported = import_files([tmp_path / "rig"])
    assert not imported.refusals
    save_dataset(to_dataset(imported.records), tmp_path / "data")
    (found,) = find_contradictions(load_dataset(tmp_path / "data").runs)
    assert remedy in found.remedy
    file, section, keys = re.search(
        r"import (\S+) on its own with (\[\S+\]) (.*) in the profile", found.remedy
    ).groups()
    (tmp_path / "rig.toml").write_text(f"{section}\n{keys.replace(' and ', chr(10))}\n")
    given = ["import", str(tmp_path / "rig" / file), "--profile", str(tmp_path / "rig.toml")]
    done = CliRunner().invoke(application(), [*given, "--out", str(tmp_path / "data"), "--add"])
    assert done.exit_code == 0, done.output
    assert not find_contradictions(load_dataset(tmp_path / "data").runs)


@pytest.mark.parametrize(
    ("name", "code"),
    [("two rows exchanged", "E_OTHER_CURRENT"), ("rows shifted from the seventh on", "E_SHIFTED_ROWS")],
)
def test_rows_of_the_table_are_found_exchanged_and_shifted(cases, name, code):
    folder = cases[name]
    found = find_contradictions(folder.runs)
    assert {one.run_id for one in found} == folder.wrong
    assert {one.code for one in found} == {code}
    real = {run.id: run.mean_current for run in folder.sound}
    assert [one.value for one in found] == pytest.approx([real[one.run_id] for one in found], abs=0.01)


def test_a_loop_that_widens_with_the_current_accuses_no_run():
    """A lead of the friction that grows with the current is described worst at the highest current, in slow runs."""
    rng, runs = np.random.default_rng(2), []
    for frequency, amplitude in ((0.5, 0.025), (1.0, 0.01), (2.0, 0.01), (1.0, 0.025)):
        for current in (0.0, 0.4, 0.8, 1.6):
            time = np.arange(0, 6 / frequency, 1 / 500)
            x = amplitude * np.sin(2 * np.pi * frequency * time)
            v = np.gradient(x, time)
            lead = (0.25 + 0.55 * current) * np.clip(x / 4e-4, -1, 1)
            force = (900 + 650 * current) * v + 1500 * x
            force += (40 + 900 * np.tanh(current / 0.8)) * np.tanh(38 * v + lead) + 3 * rng.normal(size=time.size)
            runs.append(Run(f"t{len(runs):02d}", time, x, force, np.full(time.size, current)))
    assert find_contradictions(runs) == []


@pytest.mark.parametrize(
    "name", ["half-open coil", pytest.param("rows shifted from the seventh on", marks=pytest.mark.slow)]
)
def test_a_saturating_coil_hides_no_current(name):
    """The force of a smooth damper changes by a third only, but its course over the current is known."""
    folder = next(f for f in first_set(DAMPERS[2]) if f.name == name)
    assert {one.run_id for one in find_contradictions(folder.runs)} == folder.wrong


def test_without_bends_all_coefficients_follow_one_course_over_the_current(sound):
    """Given a coefficient at two currents, that at a third is known as far as it bends."""
    evidence = Evidence(tracks_of(sound))
    elements = len(evidence.prior.mean) // evidence.nodes.size
    for saturation in (4.0, 0.5):
        evidence.spread = AssumedScatter(saturation=saturation, bend=1e-3)
        root = evidence.prior.root[::elements]
        covariance = root @ root.T
        course = np.tanh(evidence.nodes / evidence.nodes.max() / saturation)
        share = (course[1] - course[0]) / (course[-1] - course[0])
        contrast = np.array([1 - share, -1.0, 0.0, share])
        assert contrast @ covariance @ contrast < 1e-5 * covariance[1, 1]
    assert evidence.prior is evidence.prior


def test_a_motion_that_empties_cells_of_the_matrix_is_less_probable(sound):
    tracks = tracks_of(sound)
    twice = {0: tracks[0].scaled(time=0.5)}  # then tested like its neighbour, and at no other current
    assert completed_matrix_odds(10.0, tracks, twice) > 10.0
    repaired = [*tracks[:-1], tracks[-1].scaled(time=0.5)]
    assert completed_matrix_odds(10.0, repaired, {len(tracks) - 1: tracks[-1]}) < 10.0


@pytest.mark.parametrize("kind", [1, pytest.param(3, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["a random record in inches", "three open coils", "rows shifted up from the third on"])
def test_the_second_set_is_found(kind, name):
    folder = next(f for f in second_set(SECOND[kind]) if f.name == name)
    found = find_contradictions(folder.runs)
    assert {one.run_id for one in found} == folder.wrong
    assert {one.cause for one in found} <= set(folder.causes)


@pytest.mark.parametrize("name", [
    "stroke for amplitude in three runs", pytest.param("a worn damper in a random record", marks=pytest.mark.slow),
])  # fmt: skip
def test_runs_that_are_not_the_first_suspects_are_found(name):
    """Two of three alike raise the error assumed of the third; a record of many currents is improbable in any case."""
    folder = next(f for f in second_set(SECOND[0]) if f.name == name)
    found = find_contradictions(folder.runs)
    assert {one.run_id for one in found} == folder.wrong
    assert {one.cause for one in found} <= set(folder.causes)


def test_a_gain_of_a_run_multiplies_the_expected_force(sound):
    """Runs without contradiction determine the same coefficients whatever model error is assumed."""
    tracks = tracks_of(sound)
    evidence = Evidence(tracks)
    means = []
    for misfit in (2.0, 0.5):
        evidence.spread = AssumedScatter(misfit)
        expected = evidence.prior
        for _ in range(3):
            expected = evidence.posterior(expected.weigh(evidence.products(tracks)))
        run = evidence.products(tracks)[4]
        means.append(float(np.sqrt(expected.at(run.over)[0] @ run.gram @ expected.at(run.over)[0])))
    assert means[0] == pytest.approx(means[1], rel=0.02)


@pytest.mark.parametrize("factors", [{}, {4: 0.6, 8: 0.45, 9: 0.7}, {1: 1.6}])
def test_runs_with_gains_of_their_own_are_found_and_gains_of_sessions_are_not(sound, factors):
    """A wide gain of a run costs evidence where sessions explain the differences."""
    tracks = tracks_of([replace(run, force=factors.get(k, 1.0) * run.force) for k, run in enumerate(sound)])
    evidence = Evidence(tracks)
    differences = gain_differences(evidence, evidence.products(tracks))
    assert differences.members == set(factors)
    assert (differences.odds > 15) == bool(factors)
    assert factors or differences.everywhere < 0


@pytest.mark.parametrize("kind", [pytest.param(0, marks=pytest.mark.slow), 3])
def test_two_dampers_half_the_runs_each_are_refused_with_both_groups(kind, tmp_path):
    """A single model of many coefficients describes both dampers together with an error of a few per cent."""
    folder = next(f for f in first_set(DAMPERS[kind]) if f.name == "two dampers, half the runs each")
    with pytest.raises(ContradictionError, match=r"times what the others show\) against t") as refusal:
        find_contradictions(folder.runs)
    groups = re.findall(r"((?:t\d\d(?:, )?)+) \(", str(refusal.value))
    smaller = min((group.split(", ") for group in groups), key=len)
    find_contradictions(folder.runs, keep=smaller)
    column, file = re.search(r"two names in the column (\S+) of (\S+);", str(refusal.value)).groups()
    save_dataset(Dataset(tuple(folder.runs)), tmp_path / "data")
    table = pl.read_csv(tmp_path / "data" / file, infer_schema=False)
    named = pl.when(pl.col("run_id").is_in(smaller)).then(pl.lit("B")).otherwise(pl.lit("A"))
    table.with_columns(named.alias(column)).write_csv(tmp_path / "data" / file)
    dataset = load_dataset(tmp_path / "data")
    assert [find_contradictions(dataset.rig(name).runs) for name in ("A", "B")] == [[], []]


def test_motions_that_complete_the_matrix_of_tests_are_those_of_another_stroke(sound):
    """Three strokes counted from peak to peak leave three cells of the matrix of tests empty."""
    folder = next(f for f in second_set(SECOND[1]) if f.name == "stroke for amplitude in three runs")
    found = find_contradictions(folder.runs)
    assert [(one.run_id, one.cause, one.value) for one in found] == [
        (name, "displacement", 0.5) for name in sorted(folder.wrong)
    ]
    runs = {run.id: run for run in sound}
    tested = [run for run in sound if run.id not in ("t05", "t08")]
    assert find_contradictions(tested) == []  # two missing tests are no fault
    damper = DAMPERS[0]
    further = make_run(
        damper, "t12", damper.currents[1], 2.0, 0.8 * damper.amplitude, np.random.default_rng(5)
    )  # a further test at the doubled stroke, whose cell of the matrix is tested as well
    assert find_contradictions([*runs.values(), further]) == []


@pytest.mark.parametrize("name", [
    "a copy cropped, decimated, with noise", "a validation run that is a copy", "a copy under another current",
    *(pytest.param(f"a copy {how}", marks=pytest.mark.slow) for how in ("with noise", "cropped", "decimated")),
])  # fmt: skip
def test_a_copy_is_found_and_its_original_kept(cases, name):
    (found,) = find_contradictions(cases[name].runs)
    assert (found.run_id, found.code) == ("t12", "E_TWICE")


@pytest.mark.parametrize(("pasted", "source"), [(1, 10), (10, 1)])
def test_of_a_force_pasted_into_another_test_the_test_is_kept(sound, pasted, source):
    """Either may come first: not the order tells which force is a copy, but the other runs."""
    force = np.resize(sound[source].force, sound[pasted].force.size)
    (found,) = find_contradictions(changed(sound, pasted, force=force, displacement=sound[source].displacement))
    assert found.run_id == sound[pasted].id


def test_a_repeated_test_is_no_copy(sound):
    damper, rng = DAMPERS[0], np.random.default_rng(2)
    again = make_run(damper, "again", damper.currents[1], *motions(damper)[1], rng)
    assert find_contradictions([*sound, again]) == []


def test_the_units_of_all_runs_do_not_matter(sound):
    """A factor common to all runs contradicts nothing, and the same run is found at any scale."""
    runs = [replace(run, force=100 * run.force) for run in sound]
    (found,) = find_contradictions(changed(runs, 4, force=runs[4].force / 4.448))
    assert (found.run_id, found.code) == ("t04", "E_FORCE_SCALE")


def test_a_kept_run_is_not_set_aside(cases):
    folder = cases["one run in lbf"]
    assert find_contradictions(folder.runs, keep=["t04"]) == []


def test_three_runs_contradict_nothing(sound):
    assert find_contradictions([sound[0], sound[4], replace(sound[8], force=sound[8].force / 4.448)]) == []


def test_records_of_changing_current_alone_are_compared():
    damper = synthetic_dampers.drawn(3, seed=7)[2]
    runs = synthetic_dampers.tests_of(damper, "random", np.random.default_rng(0))
    assert not any(run.excitation == "sine" or np.ptp(run.current) == 0 for run in runs)
    assert find_contradictions(runs) == []


def test_a_validation_run_never_takes_part_in_the_comparison(sound):
    """Whatever validation runs hold, what is found of identification runs is the same."""
    harmed = changed(sound, 4, force=sound[4].force / 4.448)
    (alone,) = find_contradictions(harmed)
    wild = [replace(run, id=f"v{run.id}", split="validate", force=3 * run.force[::-1]) for run in sound[:6]]
    assert [one for one in find_contradictions([*harmed, *wild]) if one.run_id == "t04"] == [alone]


def test_so_many_contradictions_are_refused_with_both_groups(sound):
    wrong = [replace(run, force=run.force / 4.448) if k in (0, 2, 4, 6, 8) else run for k, run in enumerate(sound)]
    with pytest.raises(ContradictionError, match=r"runs contradict the other .*E_FORCE_SCALE.* against t0") as refusal:
        find_contradictions(wrong)
    assert refusal.value.code == "E_CONTRADICTIONS"


def test_runs_are_not_named_by_currents_of_others_that_have_no_evidence():
    """Five of twelve runs in lbf look like exchanged currents, by which a correct run would be the wrong one."""
    (rebound,) = (damper for damper in SECOND if damper.kind == "rebound")
    folder = next(f for f in second_set(rebound) if f.name == "40 % of the runs in lbf")
    with pytest.raises(ContradictionError, match="E_FORCE_SCALE"):
        find_contradictions(folder.runs)


def test_runs_of_which_none_agrees_with_another_are_refused(sound):
    factors = np.exp(np.random.default_rng(4).uniform(-2, 2, len(sound)))
    with pytest.raises(ContradictionError):
        find_contradictions([replace(run, force=g * run.force) for run, g in zip(sound, factors, strict=True)])


def past_a_bypass(leak, viscous=1700.0):
    """Tests of a dashpot over a spring below the yield force, whose fluid leaks past it by a function of the force."""
    points = [(i, f, a) for i in (0.0, 0.4, 0.8, 1.2, 1.5) for a in (0.008, 0.02) for f in (0.5, 1.5, 4.0)]
    current, frequency, amplitude = np.array(points).T
    yield_force = 60 + 1150 * (current / 1.5) ** 1.4
    steps, cycles = 4000, 4
    dt, force = 1 / frequency / steps, np.zeros((cycles * steps, len(points)))
    for k in range(1, len(force)):
        v = 2 * np.pi * frequency * amplitude * np.cos(2 * np.pi * k / steps)
        before = force[k - 1]
        flow = np.sign(before) * (leak(np.abs(before)) + np.maximum(np.abs(before) - yield_force, 0) / viscous)
        force[k] = before + 2e6 * (v - flow) * dt
    rng, runs = np.random.default_rng(1), []
    for n, (i, f, a) in enumerate(points):
        time = np.arange(len(force))[::20] * dt[n]
        gain, noise = 1 + 0.01 * rng.normal(), 4 * rng.normal(size=time.size)
        x, own = a * np.sin(2 * np.pi * f * time), force[::20, n]
        runs.append(Run(f"t{n:02d}", time, x, gain * own + 900 * x + 25 + noise, np.full(time.size, i)))
    return runs


@pytest.mark.parametrize("resistance", [3e4, pytest.param(7e3, marks=pytest.mark.slow)])
def test_a_bypass_that_carries_the_slow_motions_accuses_no_run(resistance):
    """Slow loops of a linear bypass have no yield displacement, which a leak describes."""
    assert find_contradictions(past_a_bypass(lambda force: force / resistance)) == []


def test_a_current_is_not_contradicted_where_the_force_does_not_depend_on_it(sound):
    """A run at a current as far from the stated as from the apparent one shows that the force is limited."""
    track = tracks_of(sound)[0]
    for force, unproven in ((1.0, {1}), (0.7, set())):
        tests = ((0.0, 0.5), (0.5, 1.0), (1.0, force), (1.5, 1.0))
        tracks = [replace(track, current=0 * track.current + i, half_range=100 * half) for i, half in tests]
        assert unproven_currents(tracks, {1: 1.5}) == unproven


@pytest.mark.slow
def test_an_orifice_that_carries_the_slow_motions_accuses_no_run_and_hides_no_open_coil():
    """Its flow grows with the root of the force: slow loops are alike at all currents but the lowest."""
    runs = past_a_bypass(lambda force: (np.sqrt(700**2 + 4.4e5 * force) - 700) / 2.2e5)
    comparison = compare_runs(runs)
    assert comparison.contradictions == []
    (note,) = comparison.notes
    assert "0.5 Hz and 8 mm" in note
    assert "4 Hz and 20 mm" not in note
    (found,) = find_contradictions(changed(runs, 5, current=runs[23].current))  # without current, at 4 Hz and 20 mm
    assert (found.run_id, found.code, found.value) == ("t05", "E_OTHER_CURRENT", 0.0)


@pytest.mark.parametrize("current", [0.0, 0.5])
def test_a_factor_of_the_force_without_current_may_be_a_magnetisation(sound, current):
    run = next(run for run in sound if run.mean_current == current)
    found = describe(run, Explanation(Trial("force", 1.8, "", 0.0), 20.0, None), 11)
    assert ("magnetisation that other tests left" in found.explanation) == (current == 0)
    assert ("demagnetise the damper" in found.remedy) == (current == 0)
