"""Who is answered, and what every answer forbids."""

import asyncio
import contextlib
import re
import shutil
from concurrent.futures import ThreadPoolExecutor

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from starlette.datastructures import Headers
from starlette.requests import ClientDisconnect

from mrdamper.web.security import FORM_LIMIT, HEADERS, Guard
from mrdamper.web.uploads import FILE_LIMIT, Upload

GUARD = Guard(None, ["127.0.0.1:8765", "localhost:8765"])
GOOD = {"host": "127.0.0.1:8765", "origin": "http://127.0.0.1:8765"}
LATIN = st.text(st.characters(codec="latin-1"), max_size=40)  # what a header can carry
METHODS = st.sampled_from(["GET", "HEAD", "POST", "PUT", "DELETE", "PATCH", "OPTIONS"])


@given(METHODS, LATIN)
@settings(max_examples=200, deadline=None)
def test_a_strange_host_is_never_answered(method, host):
    strange = host.lower() not in GUARD.hosts
    assert bool(GUARD.refusal(method, Headers({**GOOD, "host": host}))) == strange


@given(METHODS, LATIN)
@settings(max_examples=200, deadline=None)
def test_a_strange_origin_is_never_answered(method, origin):
    headers = Headers({**GOOD, "origin": origin})
    assert bool(GUARD.refusal(method, headers)) == (origin not in GUARD.origins)


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS"])
def test_changes_need_an_origin(method):
    assert GUARD.refusal(method, Headers({"host": GOOD["host"]}))
    assert not GUARD.refusal(method, Headers(GOOD))


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_other_sites_may_not_even_read(site):
    assert GUARD.refusal("GET", Headers({"host": GOOD["host"], "sec-fetch-site": site}))
    assert not GUARD.refusal("GET", Headers({"host": GOOD["host"], "sec-fetch-site": "none"}))


def test_the_guard_stands_before_the_application(client):
    for headers in ({"host": "evil.example"}, {"origin": "http://evil.example"}, {"origin": "null"}):
        assert client.post("/api/sessions", headers=headers).status_code == 403
    assert client.get("/", headers={"host": "app.test:2"}).status_code == 403


@pytest.mark.parametrize(
    "path", ["/", "/static/js/main.js", "/static/plotly.js", "/nowhere", "/api/sessions/unknown", "/api/sessions"]
)
def test_every_answer_forbids_what_is_not_ours(client, path):
    answer = client.get(path)
    for name, value in HEADERS.items():
        assert answer.headers[name] == value
    policy = answer.headers["content-security-policy"]
    assert "unsafe" not in policy
    assert "http" not in policy
    assert "cache-control" in answer.headers


def test_data_are_not_cached(client, loaded):
    for path in (f"{loaded}/data", f"{loaded}/data/rigs/0", f"{loaded}/data/rigs/0/runs/run0/cycle"):
        assert client.get(path).headers["cache-control"] == "no-store"


def test_the_page_holds_no_inline_script_or_style(client):
    text = client.get("/").text
    assert "<style" not in text
    assert " style=" not in text
    assert text.count("<script") == text.count('<script type="module" src=')


@pytest.mark.parametrize("path", ["/static/../app.py", "/static/%2e%2e/app.py", "/static/js/../../app.py", "/app.py"])
def test_nothing_but_the_page_is_served(client, path):
    assert client.get(path).status_code == 404


def test_a_large_file_is_refused_before_it_is_sent(client, session):
    upload = client.post(f"{session}/uploads").json()["upload"]
    answer = client.put(f"{session}/uploads/{upload}/files?name=big.csv", content=bytes(FILE_LIMIT + 1))
    assert answer.status_code == 413
    assert answer.json()["code"] == "E_UPLOAD_SIZE"


def test_a_large_file_of_unsaid_length_is_stopped_on_the_way(client, app, session):
    upload = client.post(f"{session}/uploads").json()["upload"]
    sent = []

    def pieces():
        for _ in range(100):
            sent.append(1)
            yield bytes(1_000_000)

    answer = client.put(f"{session}/uploads/{upload}/files?name=big.csv", content=pieces())
    assert answer.status_code == 413
    assert not [path for path in app.state.sessions.folder.rglob("*") if path.is_file()]


HOSTILE = [
    "../../etc/passwd",
    "..\\..\\x.csv",
    "/abs.csv",
    "a\u202egnp.csv",
    "<img src=x>.csv",
    "con.csv",
    ".hidden",
    "a" * 900,
]


@pytest.mark.parametrize("name", HOSTILE)
def test_files_are_stored_under_names_made_here(client, app, session, name):
    upload = client.post(f"{session}/uploads").json()["upload"]
    answer = client.put(f"{session}/uploads/{upload}/files", params={"name": name}, content=b"1,2,3\n")
    assert answer.status_code == 200
    stored = [path for path in app.state.sessions.folder.rglob("*") if path.is_file()]
    assert len(stored) == 1
    assert stored[0].parent.name == "0000"
    assert stored[0].name.isascii()
    assert not stored[0].name.startswith(".")


def test_sessions_do_not_see_each_other(client, loaded):
    other = f"/api/sessions/{client.post('/api/sessions').json()['session']}"
    assert other != loaded
    assert client.get(f"{other}/data").json()["code"] == "E_NO_DATA"
    assert client.get(f"{loaded}/data").status_code == 200


def test_a_session_that_ended_is_gone_with_its_files(client, app, session):
    upload = client.post(f"{session}/uploads").json()["upload"]
    client.put(f"{session}/uploads/{upload}/files?name=a.csv", content=b"1,2,3\n")
    folder = next(iter(app.state.sessions)).folder
    assert any(folder.rglob("*"))
    client.delete(session)
    assert not folder.exists()
    assert client.get(session).status_code == 410
    assert client.get(session).json()["code"] == "E_SESSION_ENDED"


def test_an_unused_session_is_swept(client, app, session):
    app.state.sessions.sweep(idle_s=3600)
    assert len(list(app.state.sessions)) == 1
    app.state.sessions.sweep(idle_s=-1)
    assert len(list(app.state.sessions)) == 0


def test_stopping_leaves_nothing_behind(app):
    from fastapi.testclient import TestClient

    with TestClient(app, base_url="http://app.test:1", headers={"origin": "http://app.test:1"}) as client:
        client.post("/api/sessions")
        assert app.state.sessions.folder.is_dir()
    assert not app.state.sessions.folder.exists()


def test_an_internal_error_shows_no_details(client, session, monkeypatch, capsys):
    monkeypatch.setattr("mrdamper.web.api.data.bundled", lambda: 1 / 0)
    answer = client.get(f"{session}/data")
    assert answer.status_code == 500
    assert answer.json()["code"] == "E_INTERNAL"
    assert "division" not in answer.text
    assert "division" in capsys.readouterr().err
    assert answer.headers["content-security-policy"] == HEADERS["Content-Security-Policy"]


def test_a_question_too_long_is_declined(client, session):
    answer = client.post(f"{session}/dampers", content=b"x" * (FORM_LIMIT + 1))
    assert answer.status_code == 413
    assert answer.json()["code"] == "E_413"


def test_a_file_that_broke_off_does_not_stop_the_next(client, session):
    upload = client.post(f"{session}/uploads").json()["upload"]
    path = f"{session}/uploads/{upload}/files"
    client.put(f"{path}?name=a.csv", content=b"1\n")
    assert client.put(f"{path}?name=big.csv", content=bytes(FILE_LIMIT + 1)).status_code == 413
    assert client.put(f"{path}?name=b.csv", content=b"1\n").status_code == 200
    assert client.put(f"{path}?name=c.csv", content=b"1\n").status_code == 200


def test_a_file_of_an_upload_that_was_replaced_meanwhile_is_refused(client, app, session, monkeypatch):
    upload = client.post(f"{session}/uploads").json()["upload"]
    (mine,) = app.state.sessions

    def replaced(self, name, place=Upload.place):
        mine.upload = Upload("another", self.folder)
        shutil.rmtree(self.folder)
        return place(self, name)

    monkeypatch.setattr(Upload, "place", replaced)
    answer = client.put(f"{session}/uploads/{upload}/files?name=a.csv", content=b"1\n")
    assert (answer.status_code, answer.json()["code"]) == (422, "E_NAME")


def test_the_page_announces_its_modules_and_no_more(client):
    text = client.get("/").text
    announced = re.findall(r'rel="modulepreload" href="([^"]+)"', text)
    assert "/static/js/main.js" in announced
    for path in announced:
        answer = client.get(path)
        assert answer.status_code == 200
        assert answer.headers["content-type"].startswith("text/javascript")


def test_a_session_that_ends_while_it_is_asked_is_said_to_have_ended(client, app, session, monkeypatch, capsys):
    mine = app.state.sessions.find(session.rsplit("/", 1)[-1])
    monkeypatch.setattr(type(mine), "key", lambda self, kind: app.state.sessions.end(self.name) or kind)
    answer = client.post(f"{session}/uploads")  # its folder is gone by now
    assert (answer.status_code, answer.json()["code"]) == (410, "E_SESSION_ENDED")
    assert "Traceback" not in capsys.readouterr().err


def test_a_half_sent_request_opens_no_session(app):
    """Sessions are opened when the request is whole: half-sent ones push nobody out."""
    sent = []
    pieces = iter([{"type": "http.request", "body": b"{", "more_body": True}, {"type": "http.disconnect"}])

    async def receive():
        return next(pieces)

    async def send(message):
        sent.append(message)

    host = "app.test:1"
    scope = {
        "type": "http", "asgi": {"version": "3.0"}, "http_version": "1.1", "method": "POST", "path": "/api/sessions",
        "raw_path": b"/api/sessions", "query_string": b"", "root_path": "", "scheme": "http",
        "headers": [(b"host", host.encode()), (b"origin", f"http://{host}".encode()), (b"content-length", b"100")],
        "client": ("127.0.0.1", 1), "server": ("127.0.0.1", 80),
    }  # fmt: skip
    before = len(list(app.state.sessions))
    with contextlib.suppress(ClientDisconnect), ThreadPoolExecutor(1) as thread:  # a loop beside that of a browser
        thread.submit(lambda: asyncio.run(app(scope, receive, send))).result()
    assert len(list(app.state.sessions)) == before
    assert all(message.get("status") != 200 for message in sent)
