"""Worker processes: progress streams, errors keep their kind, cancelling ends everything."""

import json
import os
import signal
import subprocess
import sys
import time
import urllib.request
from functools import partial
from pathlib import Path

import pytest
from web import slow_tasks
from web.processes import alive

from mrdamper.study.workflow import Study
from mrdamper.web.api.identify import Head
from mrdamper.web.jobs import Job


def run(task, *arguments, conclude=lambda result: {"result": result}):
    return Job("job1", "test", partial(task, *arguments), conclude).start()


def ended(job, seconds=30):
    deadline = time.monotonic() + seconds
    while not job.ended and time.monotonic() < deadline:
        time.sleep(0.01)
    return job


def test_progress_is_told_on_the_way_and_the_result_at_the_end():
    job, shares = run(slow_tasks.count, 6), []
    while not job.ended:
        shares.append(job.share)
        time.sleep(0.01)
    assert job.state == "done"
    assert job.result == {"result": 6}
    assert shares == sorted(shares)
    assert any(0 < share < 1 for share in shares)


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="no list of open descriptors here")
def test_a_report_that_is_kept_holds_no_descriptor():
    ended(run(slow_tasks.count, 1)).wait(30)  # opens what all workers share
    before = len(list(Path("/proc/self/fd").iterdir()))
    jobs = [ended(run(slow_tasks.count, 1)) for _ in range(3)]
    for job in jobs:
        job.wait(30)
        job.cancel()  # harmless
    assert len(list(Path("/proc/self/fd").iterdir())) <= before


def test_a_refusal_keeps_what_where_and_remedy():
    job = ended(run(slow_tasks.refuse))
    assert job.state == "refused"
    assert job.error["code"] == "E_IDENTIFICATION"
    assert (job.error["found"], job.error["where"], job.error["remedy"]) == ("too few runs", "rig x", "record more")


def test_an_internal_error_is_reported_as_one(capsys):
    job = ended(run(slow_tasks.break_down))
    assert job.state == "failed"
    assert job.error["code"] == "E_INTERNAL"
    assert "a fault of ours" in capsys.readouterr().out


def test_a_result_that_cannot_be_shown_is_an_internal_error(capsys):
    job = ended(run(slow_tasks.count, 1, conclude=lambda result: result / 0))
    assert job.state == "failed"
    assert "ZeroDivisionError" in capsys.readouterr().out


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs process groups")
def test_cancelling_ends_the_worker_and_what_it_started(tmp_path):
    job = run(slow_tasks.sleep_with_child, str(tmp_path))
    note = tmp_path / "child"
    while not (note.is_file() and note.read_text()):
        time.sleep(0.01)
    job.cancel()
    assert ended(job).state == "cancelled"
    deadline = time.monotonic() + 10
    while alive(int(note.read_text())) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not alive(int(note.read_text()))


def test_cancelling_before_it_runs_is_enough():
    job = run(slow_tasks.count, 1000)
    job.cancel()
    assert ended(job).state == "cancelled"


def test_new_data_end_the_work_on_the_old(client, app, loaded):
    job = client.post(f"{loaded}/study").json()
    client.post(f"{loaded}/bundled")
    session = next(iter(app.state.sessions))
    assert ended(session.jobs[job["key"]]).state == "cancelled"


def test_progress_streams_as_server_sent_events(address):
    def ask(method, path, body=None):
        request = urllib.request.Request(f"{address}{path}", method=method, data=body, headers={"Origin": address})
        request.add_header("Content-Type", "application/json")
        return urllib.request.urlopen(request, timeout=60)

    session = f"/api/sessions/{json.load(ask('POST', '/api/sessions', b''))['session']}"
    ask("POST", f"{session}/bundled", b"").close()
    choice = {"rig": 1, "model": "bingham", "method": "projection"}
    job = json.load(ask("POST", f"{session}/identify", json.dumps(choice).encode()))
    with ask("GET", f"{session}/jobs/{job['key']}/events") as stream:
        assert stream.headers["content-type"].startswith("text/event-stream")
        reports = [json.loads(line[6:]) for line in stream.read().decode().splitlines() if line.startswith("data: ")]
    assert reports[-1]["state"] == "done"
    shares = [report["share"] for report in reports]
    assert shares == sorted(shares)
    ask("DELETE", session).close()


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs signals")
def test_a_worker_that_is_killed_is_told_from_our_faults(capsys):
    job = run(slow_tasks.count, 1000)
    while job.share == 0:
        time.sleep(0.01)
    os.kill(job._process.pid, signal.SIGKILL)
    assert ended(job).state == "failed"
    assert job.error["code"] == "E_WORKER"
    assert "signal 9" in job.error["found"]
    assert capsys.readouterr().out == ""


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="looks into /proc for what is left running")
def test_workers_end_with_an_app_that_was_killed(tmp_path):
    """Whatever a worker is doing: it waits for a child here, and would never look at its pipe again.

    The script has no guard: a worker must not run it once more.
    """
    code = (
        "import sys, time; from functools import partial\n"
        "from web import slow_tasks; from mrdamper.web.jobs import Job\n"
        "open(sys.argv[1] + '/begun', 'a').write('x')\n"
        "Job('job1', 'test', partial(slow_tasks.sleep_with_child, sys.argv[1]), lambda r: {}).start(); time.sleep(20)\n"
    )
    script = tmp_path / "app.py"
    script.write_text(code)
    tests = Path(__file__).parents[1]
    app = subprocess.Popen(
        [sys.executable, str(script), str(tmp_path)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tests), os.environ.get("PYTHONPATH", "")])},
    )
    note = tmp_path / "child"
    while not (note.is_file() and note.read_text()):
        time.sleep(0.01)
    app.kill()
    app.wait()
    assert (tmp_path / "begun").read_text() == "x"
    child = int(note.read_text())
    deadline = time.monotonic() + 20
    while alive(child) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not alive(child)


def test_a_page_loaded_again_finds_the_work(client, loaded):
    choice = {"rig": 1, "model": "bingham", "method": "projection"}
    job = client.post(f"{loaded}/identify", json=choice).json()
    deadline = time.monotonic() + 60
    while (found := client.get(f"{loaded}/jobs").json())[-1]["state"] != "done" and time.monotonic() < deadline:
        time.sleep(0.05)
    assert [(report["key"], report["state"]) for report in found] == [(job["key"], "done")]
    assert found[0]["result"]["runs"]
    client.post(f"{loaded}/bundled")  # other data: what was found of these is gone
    assert client.get(f"{loaded}/jobs").json() == []


def test_work_of_one_kind_takes_the_place_of_the_same_kind_only(client, app, loaded):
    study, first = (
        client.post(f"{loaded}/{path}", json=body).json()
        for path, body in (("study", None), ("identify", {"rig": 0, "model": "bouc-wen", "method": "projection"}))
    )
    session = next(iter(app.state.sessions))
    replaced = session.jobs[first["key"]]  # jobs that have ended are not kept there
    second = client.post(f"{loaded}/identify", json={"rig": 0, "model": "bingham", "method": "projection"}).json()
    assert {job.key for job in session.newest.values()} == {study["key"], second["key"]}
    assert session.newest["study"]._stop.is_set() is False
    assert ended(replaced).state == "cancelled"


def test_a_stored_result_is_used_without_a_worker():
    job = ended(Job("job1", "test", slow_tasks.break_down, lambda result: {"result": result}, lambda: 7).start())
    assert (job.state, job.result, job._process) == ("done", {"result": 7}, None)


def test_workers_leave_the_processors_to_the_page():
    assert ended(run(slow_tasks.niceness)).result == {"result": min(os.nice(0) + 5, 19)}


def test_a_study_of_the_bundled_tests_is_calculated_once_for_all_sessions(client, app, loaded, tmp_path):
    (session,) = app.state.sessions
    report = tmp_path / "report.html"
    report.write_text("report")
    shared = app.state.sessions.studies
    shared.keep(Head().model_dump_json(), Study(session.dataset, (), 1.0), tmp_path, [report])
    report.unlink()  # the first session is over
    job = client.post(f"{loaded}/study").json()
    assert ended(session.job(job["key"])).state == "done"
    assert [path.read_text() for path in session.results["study.files"]] == ["report"]
    assert session.results["study.files"][0].is_relative_to(session.folder)
    assert shared.find("another head", tmp_path / "none") is None
    for i in range(9):
        shared.keep(str(i), Study(session.dataset, (), 1.0), tmp_path, [])
    assert len(list(app.state.sessions.folder.glob("*-*"))) == 4
