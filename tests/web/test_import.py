"""Uploaded files become data, or an error with a remedy."""

from dataclasses import replace

import numpy as np
import pytest
from web.rig_files import csv_of

from mrdamper.errors import InputError
from mrdamper.rig_files.dataset_folder import save_dataset
from mrdamper.web.imported_data import bundled, read_upload
from mrdamper.web.uploads import FILE_COUNT_LIMIT, AllRefusedError, ImportedData, Upload, UploadError


@pytest.fixture
def drop(tmp_path):
    return Upload("drop1", tmp_path)


def put(drop, name, content):
    drop.place(name).write_bytes(content)


def test_a_dataset_folder_comes_back_as_it_was(drop, small_rig, tmp_path):
    folder = tmp_path / "saved"
    save_dataset(small_rig, folder)
    for path in folder.iterdir():
        put(drop, f"my rig/{path.name}", path.read_bytes())
    found = read_upload(drop)
    assert found.dataset.name == "my rig"
    assert [run.id for run in found.dataset] == [run.id for run in small_rig]
    for there, here in zip(found.dataset, small_rig, strict=True):
        np.testing.assert_array_equal(there.force, here.force)


def test_rig_files_are_read_with_the_current_of_their_names(drop, small_rig):
    runs = sorted(list(small_rig)[:3], key=lambda run: run.id)  # files are taken in the order of their names
    for run in runs:
        put(drop, f"{run.id}.csv", csv_of(run))
    found = read_upload(drop)
    assert [run.current_A for run in found.dataset] == [round(run.current_A, 3) for run in runs]
    for there, here in zip(found.dataset, runs, strict=True):
        # Written with six figures behind the point of millimetres.
        np.testing.assert_allclose(there.displacement, here.displacement, atol=1e-9)
    assert {v.state for v in found.verdicts} <= {"taken", "noted"}


def test_a_current_behind_a_label_is_told_by_the_other_names(drop, small_rig):
    run = next(iter(small_rig))
    for current in ("0", "0.5"):
        put(drop, f"MR7_{current}A_2Hz.csv", csv_of(run))
    assert [run.current_A for run in read_upload(drop).dataset] == [0.5, 0.0]


def test_the_profile_shown_reads_the_same(drop, small_rig):
    run = next(iter(small_rig))
    put(drop, f"{run.id}.csv", csv_of(run))
    first = read_upload(drop)
    again = read_upload(drop, first.profile)
    np.testing.assert_array_equal(again.dataset.runs[0].force, first.dataset.runs[0].force)
    assert again.profile == first.profile


def test_a_refused_drop_brings_the_profile_that_mends_it(drop, small_rig):
    run = next(iter(small_rig))
    put(drop, "no current in this name.csv", csv_of(run))
    with pytest.raises(AllRefusedError) as caught:
        read_upload(drop)
    (verdict,) = caught.value.verdicts
    assert verdict.name == "no current in this name.csv"
    assert verdict.findings[0][0] == "E_CURRENT_MISSING"
    mended = read_upload(drop, f"{caught.value.profile}\n[current]\nvalue = 0.25\n")
    assert mended.dataset.runs[0].current_A == 0.25


def test_a_wrong_profile_is_told(drop, small_rig):
    put(drop, "run_1A.csv", csv_of(next(iter(small_rig))))
    with pytest.raises(InputError) as caught:
        read_upload(drop, "rig = [")
    assert caught.value.code == "E_PROFILE"


@pytest.mark.parametrize(
    ("files", "code"),
    [
        ({}, "E_UPLOAD"),
        ({"runs.csv": b"run_id,rig\n"}, "E_DATASET"),
        ({"runs.csv": b"run_id,rig\na,b\n", "samples.csv": b"run_id,time_s\na,0\n"}, "E_COLUMN"),
        ({"runs.csv": b"\xff\xfe\x00"}, "E_DATASET"),
        ({"photo.png": b"\x89PNG\r\n\x1a\n\x00"}, "E_UPLOAD_REFUSED"),
    ],
)
def test_what_cannot_be_read_is_refused_by_name(drop, files, code):
    for name, content in files.items():
        put(drop, name, content)
    with pytest.raises(InputError) as caught:
        read_upload(drop)
    assert caught.value.code == code
    assert caught.value.remedy
    assert str(drop.folder) not in str(caught.value)


def test_too_many_files_are_refused(drop):
    drop.places = FILE_COUNT_LIMIT
    with pytest.raises(UploadError, match=str(FILE_COUNT_LIMIT)):
        drop.place("one more.csv")


def test_the_bundled_tests_are_read_once():
    assert bundled() is bundled()


def test_runs_that_do_not_move_are_shown_and_not_used(client, app, session, small_rig):
    one = next(iter(small_rig))
    still = replace(one, id="still", displacement=np.zeros(one.time.size))
    next(iter(app.state.sessions)).load(ImportedData(small_rig.only([*small_rig, still]), "upload"))
    table = client.get(f"{session}/data/rigs/0").json()
    shown = next(run for run in table["runs"] if run["id"] == "still")
    assert shown["condition"] is None
    assert "E_NO_EXCITATION" in shown["refused"]
    assert client.get(f"{session}/data/rigs/0/runs/{shown['key']}/cycle").status_code == 200
    verdict = client.get(f"{session}/data/rigs/0/quality").json()[shown["key"]]
    assert verdict["verdict"] == "refused"
    assert verdict["findings"][0]["code"] == "E_NO_EXCITATION"


def test_a_refused_file_is_mended_while_the_others_stay(drop, small_rig):
    first, second = list(small_rig)[:2]
    reversed_force = replace(second, force=-second.force)
    put(drop, f"day 1/{first.id}.csv", csv_of(first))
    put(drop, f"day 2/{second.id}.csv", csv_of(reversed_force))
    found = read_upload(drop)
    assert (found.verdicts[0].name, found.verdicts[0].state) == (f"day 2/{second.id}.csv", "refused")
    assert found.verdicts[0].findings[0][0] == "E_DISSIPATION_SIGN"
    before, force, after = found.profile.partition("[channels.force]")
    mended = read_upload(drop, before + force + after.replace("#sign = -1", "sign = -1", 1), refused_only=True)
    assert {v.state for v in mended.verdicts} <= {"taken", "noted"}
    assert len(mended.dataset) == 2
    for run, there in zip((first, second), mended.dataset, strict=True):
        assert np.corrcoef(run.force, there.force)[0, 1] > 0.99


def test_files_of_one_name_in_two_folders_are_two_runs(drop, small_rig):
    run = next(iter(small_rig))
    for day in (1, 2):
        put(drop, f"day {day}/{run.id}.csv", csv_of(run))
    found = read_upload(drop)
    assert len({r.id for r in found.dataset}) == 2
    assert [v.name for v in found.verdicts] == [f"day 1/{run.id}.csv", f"day 2/{run.id}.csv"]


def put_files(client, session, files):
    upload = client.post(f"{session}/uploads").json()["upload"]
    for name, content in files.items():
        client.put(f"{session}/uploads/{upload}/files", params={"name": name}, content=content).raise_for_status()
    return client.post(f"{session}/uploads/{upload}/read", json={})


def test_a_file_may_hold_good_and_refused_tests(client, session, small_rig):
    first, second = list(small_rig)[:2]
    rows = [csv_of(run).decode().splitlines() for run in (first, replace(second, force=-second.force))]
    text = "\n".join(["run," + rows[0][0], *(f"{i},{line}" for i, part in enumerate(rows, 1) for line in part[1:]), ""])
    put_files(client, session, {"both_0.5A.csv": text.encode()}).raise_for_status()
    tests = client.get(f"{session}/tests").json()["tests"]
    assert [(test["test"][-1], test["state"]) for test in tests] == [("2", "refused"), ("1", "taken")]
    assert "E_DISSIPATION_SIGN" in [code for code, _ in tests[0]["findings"]]


def test_a_dropped_table_of_tests_is_used_and_a_click_overrules_it(client, session, small_rig):
    files = {f"t{i}.csv": csv_of(run) for i, run in enumerate(list(small_rig)[:2])}
    files["tests.csv"] = b"file,current_A,split\nt0.csv,0.3,train\nt1.csv,0.7,validate\n"
    put_files(client, session, files).raise_for_status()
    tests = client.get(f"{session}/tests").json()["tests"]
    assert [(test["current_A"], test["split"]) for test in tests] == [(0.3, "train"), (0.7, "validate")]
    stated = {"file": tests[0]["file"], "run": tests[0]["test"], "current_A": 0.4}
    client.post(f"{session}/tests/current", json=stated).raise_for_status()
    assert client.get(f"{session}/tests").json()["tests"][0]["current_A"] == 0.4


@pytest.mark.parametrize(
    ("path", "body", "code"),
    [
        ("current", {"file": 99, "run": "t0", "current_A": 1.0}, "E_NAME"),
        ("current", {"file": 0, "run": "stranger", "current_A": 1.0}, "E_TESTS"),
        ("columns", {"channels": {"force": {"column": 2, "unit": "mm"}}}, "E_PROFILE"),
        ("columns", {"channels": {"colour": {"column": 2}}}, "E_PROFILE"),
        ("split", {"runs": ["stranger"]}, "E_NAME"),
        ("split", {"currents": [0.3, 0.7]}, "E_SPLIT"),
    ],
)
def test_a_wrong_wish_changes_nothing(client, session, small_rig, path, body, code):
    files = {f"t{i}.csv": csv_of(run) for i, run in enumerate(list(small_rig)[:2])}
    files["tests.csv"] = b"file,current_A\nt0.csv,0.3\nt1.csv,0.7\n"
    put_files(client, session, files).raise_for_status()
    before = client.get(f"{session}/tests").json()["tests"]
    answer = client.post(f"{session}/tests/{path}", json=body)
    assert (answer.status_code, answer.json()["code"]) == (422, code)
    assert client.get(f"{session}/tests").json()["tests"] == before
