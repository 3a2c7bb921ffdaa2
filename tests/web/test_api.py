"""Responses of the app are the results of the package."""

import base64
import io
import json
import re
import struct
import time
import zipfile
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from support.browser import LOGO

from mrdamper.dampers.bands import band
from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.dampers.joint import JointProblem
from mrdamper.dampers.kernel import KernelDamper
from mrdamper.dampers.model_file import dump_model, parse_model
from mrdamper.dampers.modified import fit_modified
from mrdamper.data import Condition
from mrdamper.exporters import exporter
from mrdamper.exporters.base import identifier
from mrdamper.identification import identify
from mrdamper.identification.loop_analysis import analyse_loop
from mrdamper.identification.methods import all_methods
from mrdamper.web.responses import frame
from mrdamper.web.saved_project import DATA
from mrdamper.web.tasks import export_name

SCREEN = 1e-6  # arrays travel as 32-bit floats: 6e-8 of each value, and sums of two


def opened(content):
    """Head and arrays of a frame."""
    (length,) = struct.unpack_from("<I", content)
    head = json.loads(content[4 : 4 + length])
    at, found = 4 + length, {}
    for name, size in head["arrays"]:
        found[name] = np.frombuffer(content, "<f4", size, at)
        at += 4 * size
    assert at == len(content)
    return head, found


@pytest.fixture(scope="module")
def joint(bundled):
    runs = [run for run in bundled.rig("utfsm").split("train")][:6]
    return JointProblem(runs, "play-bypass").fit(rounds=1, most_steps=4).damper


@pytest.fixture(scope="module")
def modified(bundled):
    runs = [run for run in bundled.rig("utfsm").split("train") if run.excitation == "sine"][:6]
    return fit_modified([identify(run, "bingham") for run in runs]).damper


def test_a_methods_tool_tip_is_its_own(client, loaded):
    methods = client.get(f"{loaded}/choices").json()["methods"]
    assert {m["name"]: m["about"] for m in methods} == {
        name: cls.__doc__.split("\n")[0] for name, cls in all_methods().items()
    }


def put_on(client, loaded, damper):
    return client.post(f"{loaded}/dampers", json={"text": dump_model(damper)}).json()["damper"]


@given(
    st.dictionaries(
        st.text(max_size=8),
        arrays(np.float32, st.integers(0, 30), elements=st.floats(width=32, allow_nan=False)),
        max_size=4,
    )
)
@settings(max_examples=25, suppress_health_check=[HealthCheck.too_slow])
def test_frames_keep_every_array(named):
    head, found = opened(frame({"a": "β"}, named).body)
    assert head["a"] == "β"
    assert list(found) == list(named)
    for name, values in named.items():
        np.testing.assert_array_equal(found[name], values)


def test_the_bundled_data_are_one_call_away(client, session, bundled):
    overview = client.post(f"{session}/bundled").json()
    assert [rig["name"] for rig in overview["rigs"]] == list(bundled.rigs)
    assert overview["runs"] == len(bundled)


def test_the_matrix_holds_every_steady_sine_once(client, loaded):
    table = client.get(f"{loaded}/data/rigs/1").json()
    in_matrix = [key for m in table["matrix"]["motions"] for cell in m["cells"] for key in cell]
    sines = [run["key"] for run in table["runs"] if run["peak_N"] is not None]
    assert sorted(in_matrix) == sorted(sines)
    assert len(set(in_matrix)) == len(in_matrix)


def test_figures_of_a_run_are_the_loop_analysis(client, loaded, bundled):
    table = client.get(f"{loaded}/data/rigs/1").json()
    shown = next(run for run in table["runs"] if run["peak_N"] is not None)
    found = analyse_loop(bundled[shown["id"]])
    assert shown["peak_N"] == found.peak_force
    assert shown["energy_J"] == found.dissipated_energy
    assert shown["condition"]["amplitude_mm"] == pytest.approx(1e3 * found.condition.amplitude_m, rel=1e-12)


def test_a_measured_cycle_closes_and_begins_on_the_way_up(client, loaded):
    table = client.get(f"{loaded}/data/rigs/1").json()
    for run in table["runs"][:6]:
        if run["peak_N"] is None:
            continue
        _, curve = opened(client.get(f"{loaded}/data/rigs/1/runs/{run['key']}/cycle").content)
        amplitude = run["condition"]["amplitude_mm"]
        # A twentieth of the amplitude is how far a cycle's start is off by harmonics and drift.
        assert abs(curve["x"][0]) < 0.1 * amplitude
        assert abs(curve["x"][-1] - curve["x"][0]) < 0.1 * amplitude
        assert curve["v"][0] > 0
        assert curve["t"][-1] == pytest.approx(1 / run["condition"]["frequency_Hz"], rel=0.03)


@pytest.mark.parametrize("kind", ["joint", "modified"])
def test_a_prediction_is_the_dampers(client, loaded, request, kind):
    damper = request.getfixturevalue(kind)
    key = put_on(client, loaded, damper)
    condition = Condition(0.4, 1.1, 0.012)
    ask = {"current_A": 0.4, "frequency_Hz": 1.1, "amplitude_m": 0.012, "family": True, "currents": 5}
    head, curves = opened(client.post(f"{loaded}/dampers/{key}/predict", json=ask).content)
    expected = damper.predict(condition)
    picked = np.linspace(0, expected.force.size - 1, curves["now.F"].size).round().astype(int)
    scale = np.ptp(expected.force)
    np.testing.assert_allclose(curves["now.F"], expected.force[picked], atol=SCREEN * scale)
    np.testing.assert_allclose(curves["now.x"], 1e3 * expected.motion.displacement[picked], atol=SCREEN * 12)
    assert head["extrapolation"] == list(expected.extrapolation)
    tested = [0.0, 0.25, 0.5, 1.0]  # the levels of that rig, not a spread over its range
    assert [loop["current_A"] for loop in head["loops"][1:]] == tested
    at_zero = damper.predict(Condition(0.0, 1.1, 0.012))
    assert curves["over.peak"][0] == pytest.approx(np.ptp(at_zero.force) / 2, rel=SCREEN)


def test_a_held_parameter_replaces_the_models(client, loaded, joint):
    key = put_on(client, loaded, joint)
    condition = Condition(0.4, 1.1, 0.012)
    ask = {"current_A": 0.4, "frequency_Hz": 1.1, "amplitude_m": 0.012, "held": {"f0": 100.0}}
    head, curves = opened(client.post(f"{loaded}/dampers/{key}/predict", json=ask).content)
    moved = replace(joint, model=replace(joint.model, f0=100.0)).predict(condition).force
    assert head["parameters"]["f0"] == 100.0
    assert np.mean(curves["now.F"]) == pytest.approx(np.mean(moved), abs=1e-3 * np.ptp(moved))  # thinned by a sample
    text = client.post(f"{loaded}/dampers/{key}/document", json={"held": {"f0": 100.0}}).json()["text"]
    assert parse_model(text).model.f0 == 100.0
    assert "held by hand" in parse_model(text).provenance
    refused = client.post(f"{loaded}/dampers/{key}/document", json={"held": {"nothing": 1.0}})
    assert refused.json()["code"] == "E_HELD"


def test_a_function_can_be_held_in_a_saved_model(client, loaded, modified):
    key = put_on(client, loaded, modified)
    text = client.post(f"{loaded}/dampers/{key}/document", json={"held": {"c": 1234.5}}).json()["text"]
    model = parse_model(text).parameters.at(Condition(0.3, 2.0, 0.01))
    assert model.c == pytest.approx(1234.5, rel=1e-12)


def test_documents_come_back_bit_for_bit(client, loaded, joint, modified):
    for damper in (joint, modified):
        key = put_on(client, loaded, damper)
        assert client.post(f"{loaded}/dampers/{key}/document", json={}).json()["text"] == dump_model(damper)


@pytest.mark.parametrize(
    ("ask", "code"),
    [
        ({"current_A": 0.1, "frequency_Hz": 0, "amplitude_m": 0.01}, "E_REQUEST"),
        ({"current_A": 0.1, "frequency_Hz": 1, "amplitude_m": 0.01, "held": {"nothing": 1.0}}, "E_PARAMETER"),
        ({"current_A": 0.1, "frequency_Hz": 1, "amplitude_m": 0.01, "held": {"d": -1.0}}, "E_PARAMETER"),
        ({"current_A": 0.1, "frequency_Hz": 1, "amplitude_m": 0.01, "other": 1}, "E_REQUEST"),
    ],
)
def test_questions_out_of_bounds_are_refused(client, loaded, joint, ask, code):
    key = put_on(client, loaded, joint)
    answer = client.post(f"{loaded}/dampers/{key}/predict", json=ask)
    assert answer.status_code == 422
    assert answer.json()["code"] == code


def test_sliders_reach_around_their_values_inside_the_bounds(client, loaded, joint, modified):
    for damper in (joint, modified):
        shown = client.get(f"{loaded}/dampers/{put_on(client, loaded, damper)}").json()
        assert shown["parameters"]
        for p in shown["parameters"]:
            low, high = p["bounds"]
            assert p["low"] <= p["value"] <= p["high"]
            assert p["low"] < p["high"]
            assert low is None or p["low"] >= low
            assert high is None or p["high"] <= high


def test_the_loop_leaves_as_csv_(client, loaded, joint):
    key = put_on(client, loaded, joint)
    ask = {"current_A": 0.4, "frequency_Hz": 1.1, "amplitude_m": 0.012}
    table = client.post(f"{loaded}/dampers/{key}/csv", json=ask)
    assert table.text.splitlines()[0].startswith("time_s,displacement_m,velocity_m_s,current_A,force_N")


def test_the_table_of_a_loop_is_in_the_units_asked_for(client, loaded, joint):
    key = put_on(client, loaded, joint)
    texts = [
        client.post(
            f"{loaded}/dampers/{key}/csv",
            json={"current_A": 0.4, "frequency_Hz": 1.1, "amplitude_m": 0.012, "units": units},
        ).text
        for units in ({}, {"force": "lbf", "length": "in"}, {"force": "kN", "length": "mm"})
    ]
    si, imperial, mixed = (pl.read_csv(text.encode()) for text in texts)
    assert imperial.columns == ["time_s", "displacement_in", "velocity_in_s", "current_A", "force_lbf", "extrapolation"]
    assert mixed.columns == ["time_s", "displacement_mm", "velocity_m_s", "current_A", "force_kN", "extrapolation"]
    factors = {"displacement_in": ("displacement_m", 0.0254), "velocity_in_s": ("velocity_m_s", 0.0254)}
    for name, (own, size) in {**factors, "force_lbf": ("force_N", 0.45359237 * 9.80665)}.items():
        assert np.allclose(imperial[name] * size, si[own], rtol=1e-12, atol=0)
    assert np.allclose(1e3 * mixed["force_kN"], si["force_N"], rtol=1e-12, atol=0)
    assert (
        client.post(
            f"{loaded}/dampers/{key}/csv",
            json={"current_A": 0.4, "frequency_Hz": 1.1, "amplitude_m": 0.012, "units": {"force": "in"}},
        ).status_code
        == 422
    )


def test_models_to_compare_have_titles_of_their_own(client, session):
    titles = [choice["title"] for choice in client.get(f"{session}/compare/choices").json()]
    assert all(titles)
    assert len(set(titles)) == len(titles)


@pytest.mark.parametrize("form", ["c", "latex"])
def test_exports_are_made_in_a_worker(client, loaded, joint, form):
    assert form in {f["name"] for f in client.get(f"{loaded}/exports").json()}
    key = put_on(client, loaded, joint)
    report = wait(client, loaded, client.post(f"{loaded}/dampers/{key}/export/{form}", json={}).json())
    assert report["state"] == "done", report
    answer = client.get(f"{loaded}/exported/{report['result']['exported']}")
    assert "attachment" in answer.headers["content-disposition"]
    expected = exporter(form)().export(joint, identifier(joint.rig)).files
    if len(expected) == 1:
        assert answer.content == next(iter(expected.values()))
    else:
        packed = zipfile.ZipFile(io.BytesIO(answer.content))
        assert {name: packed.read(name) for name in packed.namelist()} == dict(expected)


def test_the_curve_over_current_has_points_where_the_tests_end_on_both_sides(client, loaded, bundled):
    runs = [run for run in bundled.rig("utfsm").split("train") if run.excitation == "sine" and run.current_A > 0.1]
    damper = JointProblem(runs[:5], "play-bypass").fit(rounds=1, most_steps=2).damper
    key = put_on(client, loaded, damper)
    ask = {"current_A": 0.1, "frequency_Hz": 1.1, "amplitude_m": 0.012, "currents": 11}
    head, curves = opened(client.post(f"{loaded}/dampers/{key}/predict", json=ask).content)
    low, high = head["tested_A"]
    assert low > 0.2
    assert curves["over.current"][0] == 0.0
    for end in (low, high):
        assert np.min(np.abs(curves["over.current"] - end)) < 1e-6
    assert "current" in head["extrapolation"]


def test_a_band_is_the_dampers_own_and_not_of_a_held_one(client, loaded, bundled, joint):
    runs = list(bundled.rig("utfsm").split("train"))[:5]
    damper = estimate_uncertainty(joint, runs)
    key = put_on(client, loaded, damper)
    ask = {"current_A": 0.4, "frequency_Hz": 1.1, "amplitude_m": 0.012, "currents": 0, "interval": True}
    head, curves = opened(client.post(f"{loaded}/dampers/{key}/predict", json=ask).content)
    prediction = damper.predict(Condition(0.4, 1.1, 0.012))
    around = band(damper, prediction, 0.9)
    picked = np.linspace(0, prediction.force.size - 1, curves["low.F"].size).round().astype(int)
    np.testing.assert_allclose(curves["low.F"], around.low[picked], rtol=1e-5, atol=1e-3)
    assert np.all(curves["low.F"] < curves["now.F"])
    assert head["loops"][0]["peak_to_N"] == pytest.approx(around.peak[1])
    held = {**ask, "held": {"f0": 10.0}}
    _, curves = opened(client.post(f"{loaded}/dampers/{key}/predict", json=held).content)
    assert "low.F" not in curves


def test_a_saved_project_has_data_dampers_and_state(client, app, session, small_rig, joint, modified):
    from mrdamper.web.uploads import ImportedData

    next(iter(app.state.sessions)).load(ImportedData(small_rig, "upload"))
    keys = [put_on(client, session, damper) for damper in (joint, modified)]
    logo = base64.b64encode(LOGO).decode()
    shown = {"state": json.dumps({"format": "mrdamper-state"}), "damper": keys[1], "logo": logo}
    saved = client.post(f"{session}/project.zip", json=shown)
    assert saved.status_code == 200, saved.text
    assert saved.content[30:42] == b"project.json"  # by which the page knows it

    other = f"/api/sessions/{client.post('/api/sessions').json()['session']}"
    answer = open_project(client, other, saved.content)
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert (found["state"], found["logo"]) == (shown["state"], logo)
    listed = client.get(f"{other}/dampers").json()
    assert [d["key"] for d in listed].index(found["damper"]) == 1
    texts = [client.post(f"{other}/dampers/{d['key']}/document", json={}).json()["text"] for d in listed]
    assert texts == [dump_model(joint), dump_model(modified)]
    back = list(app.state.sessions)[1].dataset
    assert back.name == small_rig.name
    for run in small_rig:
        np.testing.assert_array_equal(back[run.id].force, run.force)


def open_project(client, session, content):
    key = client.post(f"{session}/uploads").json()["upload"]
    client.put(f"{session}/uploads/{key}/files", params={"name": "project.zip"}, content=content).raise_for_status()
    return client.post(f"{session}/uploads/{key}/open")


def test_what_is_wrong_in_a_saved_project_is_told_without_the_servers_folders(client, app, session):
    parts = {"project.json": {**LIST, "source": "upload"}, "state.json": {}, f"{DATA}/runs.csv": "run_id\na\n"}
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        for name, part in parts.items():
            archive.writestr(name, part if isinstance(part, str) else json.dumps(part))
    answer = open_project(client, session, content.getvalue())
    assert answer.status_code >= 400
    assert "runs.csv" in answer.text or "samples" in answer.text
    assert str(app.state.sessions.folder) not in answer.text


LIST = {"format": "mrdamper-project", "version": 1, "source": "", "name": "", "dampers": [], "current": None}


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ([("project.json", LIST)], "has no state.json"),
        ([("project.json", LIST), ("state.json", {}), ("../evil", {})], "contains 'evil'"),
        ([("project.json", {**LIST, "version": 2}), ("state.json", {})], "has another version"),
        ([("project.json", {**LIST, "more": 1}), ("state.json", {})], "has another version"),
        ([("project.json", {**LIST, "current": 0}), ("state.json", {})], "names a damper"),
        ([("project.json", LIST), ("state.json", "0" * 6_000_000)], "over 5 MB"),
        ([("project.json", {**LIST, "source": "upload"}), ("state.json", {})], "runs.csv"),
        ([("project.json", LIST), ("state.json", {}), ("logo", "<svg>")], "neither PNG nor JPEG"),
    ],
)
def test_a_file_that_is_no_project_is_refused(client, session, parts, said):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as made:
        for name, content in parts:
            made.writestr(name, content if isinstance(content, str) else json.dumps(content))
    answer = open_project(client, session, packed.getvalue())
    assert answer.status_code == 422
    assert said in answer.json()["text"]


def test_a_damaged_project_is_refused_and_nothing_is_lost(client, loaded):
    saved = client.post(f"{loaded}/project.zip", json={"state": "{}"}).content
    for damaged in (saved[:-30], saved[:60] + b"\0\0\0" + saved[63:], b"PK\3\4"):
        answer = open_project(client, loaded, damaged)
        assert answer.status_code == 422
        assert answer.json()["code"] == "E_PROJECT"
    assert client.get(loaded).json()["data"] is not None


@pytest.mark.parametrize(
    ("head", "code"),
    [
        ({"about": {"custommer": "x"}}, "E_ABOUT"),
        ({"about": {"notes": "x" * 6000}}, "E_ABOUT"),
        ({"logo": "bm8gcGljdHVyZQ=="}, "E_ABOUT"),
        ({"logo": "%%%"}, "E_ABOUT"),
        ({"other": 1}, "E_REQUEST"),
    ],
)
def test_a_head_that_cannot_be_printed_is_refused_before_the_study(client, loaded, head, code):
    answer = client.post(f"{loaded}/study", json=head)
    assert answer.status_code == 422
    assert answer.json()["code"] == code


def wait(client, session, job):
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        report = client.get(f"{session}/jobs/{job['key']}").json()
        if report["state"] not in ("waiting", "running"):
            return report
        time.sleep(0.05)
    raise AssertionError(report)


def test_identified_values_are_those_of_identify(client, app, session, small_rig):
    from mrdamper.web.uploads import ImportedData

    next(iter(app.state.sessions)).load(ImportedData(small_rig, "upload"))
    choice = {"rig": 0, "model": "bingham", "method": "projection", "runs": ["run0", "run1", "run2"]}
    report = wait(client, session, client.post(f"{session}/identify", json=choice).json())
    assert report["state"] == "done", report
    for shown in report["result"]["runs"]:
        assert shown["values"] == pytest.approx(identify(small_rig[shown["id"]], "bingham").model.values(), rel=1e-12)
        alone = identify(small_rig[shown["id"]], "bingham")
        assert shown["intervals"]
        for name, ends in shown["intervals"].items():
            assert ends == pytest.approx(alone.interval(name))
    held = wait(client, session, client.post(f"{session}/identify", json={**choice, "fixed": {"f0": 12.0}}).json())
    assert all(run["values"]["f0"] == 12.0 and "f0" not in run["intervals"] for run in held["result"]["runs"])
    head, curves = opened(client.get(f"{session}/identified/runs/0").content)
    assert head["id"] == report["result"]["runs"][0]["id"]
    np.testing.assert_allclose(
        curves["residual"], curves["model.F"] - curves["measured.F"], atol=SCREEN * np.ptp(curves["measured.F"])
    )
    # The residual over one cycle is what the error of the whole window says, to the drift between cycles.
    share = np.sqrt(np.mean(curves["residual"] ** 2)) / np.ptp(curves["measured.F"])
    assert share == pytest.approx(held["result"]["runs"][0]["nrmse_pp"], rel=0.5)


def test_input_a_model_cannot_use_is_told_with_its_remedy(client, loaded):
    choice = {"rig": 0, "model": "bing-ham", "method": "projection"}
    report = wait(client, loaded, client.post(f"{loaded}/identify", json=choice).json())
    assert report["state"] == "refused"
    assert report["error"]["code"] == "E_NAME"
    assert "bingham" in report["error"]["remedy"]


def test_downloads_have_harmless_names(client, loaded, joint):
    key = put_on(client, loaded, replace(joint, rig='"X-Evil: <b>'))
    report = wait(client, loaded, client.post(f"{loaded}/dampers/{key}/export/latex", json={}).json())
    answer = client.get(f"{loaded}/exported/{report['result']['exported']}")
    assert "x-evil" not in answer.headers
    assert answer.headers["content-disposition"] == 'attachment; filename="x_evil_b.tex"'
    assert answer.headers["x-content-type-options"] == "nosniff"


@given(st.text())
def test_any_rig_gives_files_a_name(rig):
    assert re.fullmatch(r"[a-z_][a-z0-9_]*", export_name(rig), re.ASCII)


def test_a_damper_without_a_model_behind_it_moves_too(client, loaded, bundled):
    rig = bundled.rig("utfsm")
    kernel = KernelDamper.fit([run for run in rig.split("train")][:4], [])
    key = put_on(client, loaded, kernel)
    assert client.get(f"{loaded}/dampers/{key}").json()["parameters"] == []
    ask = {"current_A": 0.5, "frequency_Hz": 1.0, "amplitude_m": 0.01, "currents": 3}
    assert client.post(f"{loaded}/dampers/{key}/predict", json=ask).status_code == 200
