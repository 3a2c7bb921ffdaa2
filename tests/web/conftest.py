"""An app with a test client, and a browser."""

import os
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

from mrdamper.web.app import create_app

HOST = "app.test:1"
ORIGIN = f"http://{HOST}"
SCREENSHOTS = Path(__file__).parents[2] / "artefacts"
WINDOW = {"width": 1366, "height": 768}


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
def loaded(client, session):
    """A session with the bundled data."""
    client.post(f"{session}/bundled").raise_for_status()
    return session


@pytest.fixture(scope="session")
def address():
    """Address of a served app, for browsers and streams."""
    with served() as address:
        yield address


@contextmanager
def served(token=None, **options):
    """An app in a thread of its own, with a token or without; options are those of uvicorn."""
    import uvicorn

    from mrdamper.web.server import Connection, _listen

    listener = _listen(0)
    port = listener.getsockname()[1]
    app = create_app([f"127.0.0.1:{port}"], lambda: server.should_exit, token=token)
    options = {"http": Connection, "log_level": "error", "access_log": False, "timeout_graceful_shutdown": 1, **options}
    server = uvicorn.Server(uvicorn.Config(app, **options))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    yield f"http://127.0.0.1:{port}"
    server.should_exit = True
    thread.join(timeout=10)
    listener.close()


@pytest.fixture(scope="module")
def profile(browser):
    """One profile for the pages of a module: the chart library is fetched and compiled once."""
    context = browser.new_context(viewport=WINDOW, accept_downloads=True, reduced_motion="reduce")
    context.set_default_timeout(1000 * float(os.environ.get("PAGE_SECONDS", "300")))  # for a busy machine
    yield context
    context.close()


@contextmanager
def watched_page(profile, address):
    """A page of the app; anything on its console but notes is a complaint, and fails the test."""
    page, complaints = profile.new_page(), []
    page.on("console", lambda m: complaints.append(m.text) if m.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("dialog", lambda dialog: complaints.append(f"a script ran: {dialog.message}"))
    page.complaints = complaints
    page.goto(address)
    page.locator("html[data-ready]").wait_for()
    yield page
    page.evaluate("localStorage.clear()")
    page.close()
    assert not complaints, complaints


@pytest.fixture
def page(profile, address):
    """A page nothing was done on."""
    with watched_page(profile, address) as page:
        yield page


@pytest.fixture(scope="session")
def shoot():
    """Check what holds for any picture of the page; keep it, in a folder that git ignores, where PICTURES is set."""

    def shoot(page, name):
        if os.environ.get("PICTURES"):
            SCREENSHOTS.mkdir(exist_ok=True)
            page.screenshot(path=SCREENSHOTS / f"{name}.png")
        assert page.evaluate(AUDIT) == []

    return shoot


@pytest.fixture(scope="session")
def small_rig(bundled):
    """Five thinned runs of a real rig at three motions and 0 to 1 A, one of them for validation: quick to study."""
    runs = [run for run in bundled.rig("utfsm") if run.excitation == "sine"]
    train, held_out = ([run for run in runs if run.split == split] for split in ("train", "validate"))
    return bundled.only([_thinned(run) for run in (*(train[k] for k in (0, 3, 5, 8)), held_out[0])], name="small rig")


def _thinned(run, step=5):
    """Every fifth sample: 200 a second, 50 and more a cycle."""
    channels = {n: getattr(run, n)[::step] for n in ("time", "displacement", "force", "current")}
    return replace(run, velocity=None, segments=(), **channels)
