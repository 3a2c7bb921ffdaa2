"""The command: starts, answers on this machine only, stops cleanly, and says what it lacks."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest
from typer.testing import CliRunner
from web.conftest import served
from web.processes import alive

from mrdamper.cli import application
from mrdamper.errors import InputError, MissingExtraError
from mrdamper.web import security, server
from mrdamper.web.app import plotly_script


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="looks into /proc for what is left running")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", pytest.param("SIGHUP", marks=pytest.mark.slow)])
def test_it_starts_answers_and_stops_cleanly(tmp_path, name):
    stop = getattr(signal, name)
    process = subprocess.Popen(
        [sys.executable, "-m", "mrdamper", "serve", "--port", "0", "--no-browser"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "TMPDIR": str(tmp_path)},
    )
    address, token = process.stdout.readline().split()[2].split("?token=")
    assert len(token) > 30
    assert address.startswith("http://127.0.0.1:")
    with urllib.request.urlopen(address, timeout=10) as answer:
        assert b"mrdamper app" in answer.read()
    # All end the server in one way; one of them with work under way is enough.
    with pytest.raises(urllib.error.HTTPError, match="403"):
        post(address, "", "a guess")
    workers = workers_of_a_study(process.pid, address, token) if name == "SIGTERM" else []
    assert list(tmp_path.glob("mrdamper-*.scratch"))
    process.send_signal(stop)
    out, err = process.communicate(timeout=20)
    assert process.returncode == (0 if stop == signal.SIGINT else 128 + stop)
    assert out.endswith("stopped\n")
    assert "Traceback" not in out + err
    assert not list(tmp_path.glob("mrdamper-*.scratch"))
    deadline = time.monotonic() + 10
    while any(map(alive, workers)) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not [pid for pid in workers if alive(pid)]


def post(address, path, token):
    headers = {"Origin": address.rstrip("/"), "X-App-Token": token}
    request = urllib.request.Request(f"{address}api/sessions{path}", b"", headers)
    with urllib.request.urlopen(request, timeout=20) as answer:
        return json.load(answer)


def workers_of_a_study(server, address, token):
    """Begin long work; gives the process ids of the server's children."""
    session = post(address, "", token)["session"]
    post(address, f"/{session}/bundled", token)
    post(address, f"/{session}/study", token)
    deadline = time.monotonic() + 20
    while not (found := children(server)) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert found
    return found


def children(pid):
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for task in tasks for child in task.read_text().split()]


def test_it_listens_on_the_loopback_device_only():
    listener = server._listen(0)
    host, port = listener.getsockname()
    listener.close()
    assert host == "127.0.0.1"
    assert port > 0


def test_a_taken_port_is_said():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(InputError, match=f"port {port} cannot be used") as caught:
            server._listen(port)
    assert caught.value.code == "E_PORT"
    assert "--port" in caught.value.remedy


@pytest.mark.parametrize("lacking", ["fastapi", "uvicorn", "plotly"])
def test_a_missing_extra_is_said_with_its_command(monkeypatch, lacking):
    import importlib.util

    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name, *a: None if name == lacking else found(name, *a))
    result = CliRunner().invoke(application(), ["serve", "--no-browser"])
    assert isinstance(result.exception, MissingExtraError)
    assert lacking in str(result.exception)
    assert "mrdamper[web]" in str(result.exception)


def test_the_chart_library_is_the_packages_own():
    script = plotly_script()
    assert script.name == "plotly.min.js"
    with script.open(encoding="utf-8") as file:
        assert "plotly.js v" in file.read(200)


def test_the_help_shows_an_example():
    result = CliRunner().invoke(application(), ["serve", "--help"])
    assert result.exit_code == 0
    assert "Example: mrdamper serve" in result.output


@pytest.mark.parametrize(
    ("sent", "answer"),
    [
        (b"GET / HT", b""),
        (b"", b""),
        (b"GET / HTTP/1.1\r\nHost: {host}\r\n\r\nGET / HT", b"HTTP/1.1 200 OK"),
        (b"POST /api/sessions HTTP/1.1\r\nHost: {host}\r\nContent-Le", b""),
        (
            b"POST /api/sessions/x/dampers HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\n"
            b"Content-Type: application/json\r\nContent-Length: 900\r\n\r\n{",
            b"HTTP/1.1 408",
        ),
    ],
    ids=["head", "nothing", "second head", "header", "body"],
)
def test_half_sent_requests_are_given_up(monkeypatch, sent, answer):
    monkeypatch.setattr(server, "HEAD_TIMEOUT_S", 0.3)
    monkeypatch.setattr(security, "MAX_PAUSE_S", 0.3)
    with (
        served(timeout_keep_alive=0.3) as address,
        socket.create_connection(("127.0.0.1", int(address.rsplit(":", 1)[1])), 10) as line,
    ):
        line.sendall(sent.replace(b"{host}", address.removeprefix("http://").encode()))
        received = b""
        while part := line.recv(65536):
            received += part
            if answer.endswith(b"408") and answer in received:
                break
    assert received.startswith(answer)
    assert bool(received) == bool(answer)
