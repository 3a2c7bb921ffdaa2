"""A bench to ask, and a browser to look at it."""

import threading
import time
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("fastapi", reason="the web extra is not installed")
pytest.importorskip("uvicorn", reason="the web extra is not installed")
pytest.importorskip("plotly", reason="the web extra is not installed")

from support.browser import AUDIT

from mrdamper.web import create_app

HOST = "bench.test:1"
ORIGIN = f"http://{HOST}"
SCREENSHOTS = Path(__file__).parents[2] / "artefacts"


@pytest.fixture
def app():
    return create_app([HOST])


@pytest.fixture
def client(app):
    pytest.importorskip("httpx2", reason="the test client of FastAPI needs httpx2")
    from fastapi.testclient import TestClient

    with TestClient(app, base_url=ORIGIN, headers={"origin": ORIGIN}, raise_server_exceptions=False) as client:
        yield client


@pytest.fixture
def session(client):
    """Path of an open session."""
    return f"/api/sessions/{client.post('/api/sessions').json()['session']}"


@pytest.fixture
def bench(client, session):
    """A session with the bundled data."""
    client.post(f"{session}/bundled").raise_for_status()
    return session


@pytest.fixture(scope="session")
def address():
    """A bench that is served, for browsers and streams."""
    with served() as address:
        yield address


@contextmanager
def served():
    import uvicorn

    from mrdamper.web.server import Connection, _listen

    listener = _listen(0)
    port = listener.getsockname()[1]
    app = create_app([f"127.0.0.1:{port}"], lambda: server.should_exit)
    server = uvicorn.Server(
        uvicorn.Config(app, http=Connection, log_level="error", access_log=False, timeout_graceful_shutdown=1)
    )
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    yield f"http://127.0.0.1:{port}"
    server.should_exit = True
    thread.join(timeout=10)
    listener.close()


@pytest.fixture
def page(browser, address):
    """A page on the bench; anything on its console but notes fails the test."""
    context = browser.new_context(viewport={"width": 1366, "height": 768}, accept_downloads=True)
    page = context.new_page()
    page.set_default_timeout(120_000)  # a condition is waited for, on a busy machine too
    complaints = []
    page.on("console", lambda m: complaints.append(m.text) if m.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("dialog", lambda dialog: complaints.append(f"a script ran: {dialog.message}"))
    page.complaints = complaints
    page.goto(address)
    page.locator("html[data-ready]").wait_for()
    yield page
    context.close()
    assert not complaints, complaints


@pytest.fixture
def shoot():
    """Keep a picture of the page, in a folder that git ignores, and check what holds for any picture."""

    def shoot(page, name):
        SCREENSHOTS.mkdir(exist_ok=True)
        page.screenshot(path=SCREENSHOTS / f"{name}.png")
        assert page.evaluate(AUDIT) == []

    return shoot


@pytest.fixture(scope="session")
def small_rig(bundled):
    """Eight thinned runs of a real rig, two of them held out: enough for a study, quick to study."""
    runs = [run for run in bundled.rig("utfsm") if run.excitation == "sine"]
    train = [run for run in runs if run.split == "train"][:6]
    held_out = [run for run in runs if run.split == "validate"][:2]
    return bundled.only([_thinned(run) for run in (*train, *held_out)], name="small rig")


def _thinned(run, step=5):
    """Every fifth sample: 200 a second, 50 and more a cycle."""
    channels = {n: getattr(run, n)[::step] for n in ("time", "displacement", "force", "current")}
    return replace(run, velocity=None, segments=(), **channels)
