"""Requests no page would send: anything in any field, odd bodies and headers, sessions of others, uploads that vanish."""

from __future__ import annotations

import contextlib
import io
import json
import random
import threading
from collections.abc import Iterator, Mapping
from typing import Any

from fuzz.counting import NASTY, ODD, Count, sample_damper, within

HOST = "app.test:1"
BODIES = (
    b"", b"null", b"[]", b"{", b'{"a":' * 5000, b"[" * 200_000, b'"\\ud800"', b"\xff\xfe", b'{"key": 1e999}', b"NaN",
    b'{"rig": ' + b"9" * 5000 + b"}", b'{"a": 1, "a": 2}', b"--x\r\nContent-Disposition: form-data; name=a\r\n\r\n1",
    b"PK\x03\x04" + bytes(60),
)  # fmt: skip
HEADERS = (
    {"content-type": "text/plain"}, {"content-type": "multipart/form-data"}, {"content-type": "multipart/form-data; boundary="},
    {"content-type": "application/json; charset=utf-99"}, {"content-type": ""}, {"range": "bytes=5-1"}, {"range": "bytes=-0"},
    {"range": "lines=1"}, {"range": "bytes=0-1,2-3,1-9"}, {"if-modified-since": "never"}, {"if-none-match": "*"},
    {"accept": "\xff"}, {"accept-encoding": "gzip;q=x"}, {"content-length": "-1"}, {"content-length": "x"},
    {"content-encoding": "gzip"}, {"expect": "100-continue"}, {"x-app-token": ""}, {"cookie": "a=\xff"}, {"last-event-id": "x"},
    {"transfer-encoding": "chunked"}, {"upgrade": "websocket", "connection": "upgrade"}, {"x-http-method-override": "DELETE"},
)  # fmt: skip


def attack_requests(share: float) -> list[Count]:
    """Every endpoint, in one process: below 500, and nothing of another session."""
    from fastapi.testclient import TestClient

    from mrdamper.dampers.model_file import dump_model
    from mrdamper.web.app import create_app

    held, apart = Count("request with anything: below 500"), Count("session of others, token")
    rng, said = random.Random(9), io.StringIO()
    app, origin = create_app([HOST], token="the token"), f"http://{HOST}"
    asks = list(_asks(app.openapi()))
    common = {"origin": origin, "x-app-token": "the token"}
    with (
        contextlib.redirect_stderr(said),
        TestClient(app, base_url=origin, headers=common, raise_server_exceptions=False) as client,
    ):
        session = client.post("/api/sessions").json()["session"]
        client.post(f"/api/sessions/{session}/bundled")
        document = dump_model(sample_damper())
        damper = client.post(f"/api/sessions/{session}/dampers", json={"text": document}).json()["damper"]
        known = {"session": session, "rig": 0, "number": 0, "key": damper, "name": "c", "part": "cycle"}
        for _ in within(range(max(60, int(4000 * share)))):
            method, path, fields = rng.choice(asks)
            if (method, path) == ("DELETE", "/api/sessions/{session}"):
                continue
            _ask(client, held, rng, method, path, {**known, "name": rng.choice(["c", *NASTY])}, fields)
        held.check("Traceback" not in said.getvalue(), said.getvalue()[-600:])
        _strangers(client, apart, asks, session)
        for _ in within(range(max(3, int(40 * share)))):
            _at_once(client, held, rng)
    return [held, apart]


def _asks(schema: Mapping[str, Any]) -> Iterator[tuple[str, str, Mapping[str, Any]]]:
    """Method, path and fields of the body of every request of the app."""
    for path, methods in schema["paths"].items():
        for method, facts in methods.items():
            body = facts.get("requestBody", {}).get("content", {}).get("application/json", {}).get("schema", {})
            name = body.get("$ref", "").rsplit("/", 1)[-1]
            yield (
                method.upper(),
                path,
                schema.get("components", {}).get("schemas", {}).get(name, {}).get("properties", {}),
            )


def _ask(
    client: Any,
    count: Count,
    rng: random.Random,
    method: str,
    path: str,
    known: Mapping[str, Any],
    fields: Mapping[str, Any],
) -> None:
    odd = (*ODD, *NASTY[:20], 2**63, -(2**31), [[[]]], {"a": {"b": 1}}, [0] * 3000)
    chance, headers, content = rng.random(), {}, None
    usual = {
        "current_A": 0.5,
        "frequency_Hz": 1.0,
        "amplitude_m": 0.01,
        "rig": 0,
        "model": "bingham",
        "method": "projection",
    }
    body: Any = {name: usual.get(name, rng.choice(odd)) for name in fields}
    if chance < 0.6 and body:
        body[rng.choice(list(body))] = rng.choice(odd)
    elif chance < 0.7:
        body = rng.choice(odd)
    elif chance < 0.85:
        content = rng.choice(BODIES)
    if rng.random() < 0.3:
        headers = rng.choice(HEADERS)
    at = path
    for name, value in known.items():
        value = rng.choice(odd) if name != "session" and rng.random() < 0.2 else value
        at = at.replace(f"{{{name}}}", _quoted(value))
    if rng.random() < 0.3 or method == "PUT":
        at += f"?name={_quoted(rng.choice([*NASTY, 'a.csv', 'runs.csv']))}"
    if content is None:
        content = json.dumps(body).encode("utf-8", "replace") if method != "GET" else b""
        headers = {"content-type": "application/json", **headers}
    try:
        answer = client.request(method, at, content=content, headers=headers, timeout=30)
    except (ValueError, TypeError):
        return  # what no client can send
    held = answer.status_code < 500 or answer.status_code == 503
    count.check(held, (method, at[:120], content[:120], headers, answer.status_code, answer.text[:100]))


def _quoted(value: object) -> str:
    from urllib.parse import quote

    return quote(str(value)[:400], safe="", errors="replace") or "%20"


def _strangers(client: Any, count: Count, asks: list[tuple[str, str, Mapping[str, Any]]], session: str) -> None:
    """Wrong, missing and doubled tokens open nothing; sessions that are not open, or nearly named, answer nothing."""
    for tokens in (
        [],
        [""],
        ["wrong"],
        ["the toke"],
        ["the token "],
        ["the token\t"],
        ["wrong", "the token"],
        ["THE TOKEN"],
    ):
        headers = [("origin", f"http://{HOST}"), *(("x-app-token", token) for token in tokens)]
        del client.headers["x-app-token"]
        answer = client.post("/api/sessions", headers=headers)
        client.headers["x-app-token"] = "the token"
        count.check(answer.status_code == 403, (tokens, answer.status_code))
    for method, path, _ in asks:
        for stranger in ("x" * len(session), session[:-1], session.swapcase(), f"{session}%00", f"..%2F{session}", "*"):
            if "{session}" not in path or stranger == session:
                continue
            at = path.replace("{session}", stranger)
            for name in ("rig", "number", "key", "name", "part"):
                at = at.replace(f"{{{name}}}", "0")
            status = client.request(method, at, json={} if method != "GET" else None).status_code
            count.check(400 <= status < 500, (method, at, status))
    count.check(client.get(f"/api/sessions/{session}").status_code == 200, "the session itself")


def _at_once(client: Any, count: Count, rng: random.Random) -> None:
    """Files uploaded, read, listed and the session ended, all at the same time."""
    at = f"/api/sessions/{client.post('/api/sessions').json()['session']}"
    rows = b"time [s],displacement [mm],force [N]\n" + b"".join(
        b"%f,%f,%f\n" % (i / 100, (i % 100) / 5 - 10, 300) for i in range(300)
    )

    def ask(method: str, path: str, **more: Any) -> Any:
        answer = client.request(method, at + path, timeout=60, **more)
        held = answer.status_code < 500 or answer.status_code == 503
        count.check(held, (method, path, answer.status_code, answer.text[:100]))
        return answer

    def upload() -> None:
        begun = ask("POST", "/uploads")
        key = begun.json().get("upload", "0") if begun.status_code == 200 else "0"
        for name in ("0A 1Hz.csv", "runs.csv"):
            ask("PUT", f"/uploads/{key}/files?name={name}", content=rows)
        ask("POST", f"/uploads/{key}/read", json={"toml": ""})

    works = [upload, upload, lambda: ask("GET", "/tests"), lambda: ask("GET", "/data"), lambda: ask("POST", "/bundled")]
    if rng.random() < 0.5:
        works.append(lambda: ask("DELETE", ""))
    threads = [threading.Thread(target=work) for work in works]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
