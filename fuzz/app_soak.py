"""The app under twenty sessions with random requests: no response 500, constant memory and descriptors, and latency."""

from __future__ import annotations

import json
import os
import random
import signal
import statistics
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any
from urllib.parse import quote

from fuzz.counting import NASTY, ODD, Count

SESSIONS, SECONDS = 20, 600.0
_THINK = 0.25  # seconds a user looks at an answer
_LATE = 0.2  # answers: p95 below it [s]


def attack_app(share: float) -> list[Count]:
    """Random use: good and hostile questions, uploads that break off, sessions that end and begin."""
    held, flat = Count("app: no response 500"), Count("app: memory, descriptors, time")
    if not Path("/proc/self/statm").exists():
        return []
    command = [sys.executable, "-m", "mrdamper", "serve", "--port", "0", "--no-browser"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        address, token = server.stdout.readline().split()[2].split("?token=")
        until, lock, times = time.monotonic() + SECONDS * share, threading.Lock(), []
        users = [
            threading.Thread(target=_use, args=(_User(address, token, seed, held, lock, times), until), daemon=True)
            for seed in range(SESSIONS)
        ]
        for user in users:
            user.start()
        seen = []
        while any(user.is_alive() for user in users):
            time.sleep(1)
            seen.append((time.monotonic(), *_resources(server.pid)))
        _judge(flat, seen, times)
    finally:
        server.send_signal(signal.SIGTERM)
        try:
            said = server.communicate(timeout=30)[1]
        except subprocess.TimeoutExpired:
            server.kill()
            said = "did not end within 30 s of SIGTERM"
    flat.check("Traceback" not in said and "did not end" not in said, said[-400:])
    return [held, flat]


def _judge(flat: Count, seen: list[tuple[float, float, int]], times: list[float]) -> None:
    late = seen[len(seen) // 3 :]  # the first third fills what is kept
    hours = [(row[0] - late[0][0]) / 3600 for row in late]
    slopes = [statistics.linear_regression(hours, [row[i] for row in late]).slope for i in (1, 2)]
    p95 = statistics.quantiles(times, n=20)[-1]
    print(
        f"    {len(times)} answers, median {1e3 * statistics.median(times):.0f} ms, p95 {1e3 * p95:.0f} ms; memory "
        f"{seen[0][1]:.0f} -> {seen[-1][1]:.0f} MB, slope {slopes[0] / 60:+.2f} MB a minute; descriptors "
        f"{seen[0][2]} -> {seen[-1][2]}, slope {slopes[1] / 60:+.2f} a minute"
    )
    spread = max(row[1] for row in late) - min(row[1] for row in late)
    flat.check(
        slopes[0] * hours[-1] < 0.15 * late[0][1], f"memory grows: {slopes[0] / 60:.1f} MB a minute of {spread:.0f}"
    )
    flat.check(slopes[1] * hours[-1] < 20, f"descriptors grow: {slopes[1] / 60:.1f} a minute")
    flat.check(p95 < _LATE, f"p95 {1e3 * p95:.0f} ms")


def _resources(pid: int) -> tuple[float, int]:
    """Resident memory [MB] and open descriptors of the server."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6, len(os.listdir(f"/proc/{pid}/fd"))  # noqa: PTH208


class _User:
    """One page, and what it asks."""

    def __init__(self, address: str, token: str, seed: int, count: Count, lock: threading.Lock, times: list[float]):
        self.address, self.token, self.rng = address, token, random.Random(seed)
        self.count, self.lock, self.times = count, lock, times
        self.session = ""

    def ask(self, method: str, path: str, body: Any = None, raw: bytes | None = None) -> Any:
        """The answer as JSON, None if it is none or a refusal."""
        content = raw if raw is not None else b"" if body is None else json.dumps(body).encode()
        headers = {"Origin": self.address.rstrip("/"), "X-App-Token": self.token, "Content-Type": "application/json"}
        url = f"{self.address}api/sessions{path}"
        request = urllib.request.Request(url, None if method == "GET" else content, headers, method=method)
        began, status, found = time.monotonic(), 0, b""
        try:
            with urllib.request.urlopen(request, timeout=60) as answer:
                status, found = answer.status, answer.read()
        except urllib.error.HTTPError as error:
            status, found = error.code, error.read()
        except (OSError, ValueError) as error:
            found = repr(error).encode()
        with self.lock:
            self.times.append(time.monotonic() - began)
            self.count.check(0 < status < 500 or status == 503, (method, path, content[:80], status, found[:120]))
        try:
            return json.loads(found) if status == 200 else None
        except ValueError:
            return None

    def open(self) -> None:
        """A new session with the bundled data."""
        self.session = (self.ask("POST", "") or {}).get("session", "")
        self.ask("POST", f"/{self.session}/bundled")

    def step(self) -> None:
        """One thing a user, or somebody hostile, does."""
        rng, at = self.rng, f"/{self.session}"
        odd, name = rng.choice(ODD), rng.choice(NASTY)
        chance = rng.random()
        if chance < 0.35:
            table = self.ask("GET", f"{at}/data/rigs/{rng.randrange(2)}") or {"runs": []}
            if table["runs"]:
                key = rng.choice(table["runs"])["key"]
                self.ask("GET", f"{at}/data/rigs/{rng.randrange(3)}/runs/{key}/{rng.choice(['cycle', 'window'])}")
        elif chance < 0.5:
            self.ask("GET", at + rng.choice(["", "/data", "/jobs", "/exports", "/choices", "/files", "/dampers"]))
        elif chance < 0.65:
            self.upload(name)
        elif chance < 0.8:
            self.ask("POST", f"{at}/dampers", {"text": _saved_model(rng, odd)})
            for damper in (self.ask("GET", f"{at}/dampers") or [])[-1:]:
                usual: dict[str, Any] = {"current_A": rng.uniform(0, 2), "frequency_Hz": 1.0, "amplitude_m": 0.01}
                asked = {**usual, rng.choice([*usual, "held", "family"]): rng.choice([odd, 1.0, {"c": odd}, True])}
                self.ask("POST", f"{at}/dampers/{damper.get('key')}/predict", asked)
        elif chance < 0.9:
            path = rng.choice(["/identify", "/study", "/uploads", "/compare", "/dampers", "/project.zip", "/jobs/1"])
            self.ask(
                rng.choice(["POST", "DELETE", "PUT", "GET"]), at + path, {rng.choice(["rig", "model", "runs"]): odd}
            )
        elif chance < 0.95:
            job = self.ask("POST", f"{at}/identify", {"rig": 0, "model": "bingham", "method": "projection"}) or {}
            self.ask(rng.choice(["GET", "DELETE"]), f"{at}/jobs/{job.get('key', 1)}")
        else:
            self.ask("DELETE", at)
            self.open()

    def upload(self, name: str) -> None:
        """Upload files of a rig or a dataset, good and bad, and read them."""
        rng = self.rng
        key = (self.ask("POST", f"/{self.session}/uploads") or {}).get("upload", "0")
        rows = "".join(f"{i / 100},{10 * ((i % 100) - 50) / 50},{300 if i % 100 < 50 else -300}\n" for i in range(400))
        contents = [
            b"time [s],displacement [mm],force [N]\n" + rows.encode(),
            b"",
            b"PAR1" + bytes(40),
            os.urandom(900),
        ]
        for part in (f"{rng.randrange(3)}A 1Hz.csv", "runs.csv", "samples.parquet")[: rng.randint(1, 3)]:
            named = quote(rng.choice([part, part, name[:40]]), safe="", errors="replace")
            self.ask("PUT", f"/{self.session}/uploads/{key}/files?name={named}", raw=rng.choice(contents))
        self.ask("POST", f"/{self.session}/uploads/{key}/read", {"toml": rng.choice(["", "", "[file]\n", name])})


def _saved_model(rng: random.Random, odd: object) -> str:
    from fuzz.counting import sample_damper
    from mrdamper.dampers.model_file import dump_model

    document = json.loads(dump_model(sample_damper()))
    if rng.random() < 0.6:
        document[rng.choice(list(document))] = odd
    return json.dumps(document)


def _use(user: _User, until: float) -> None:
    user.open()
    while time.monotonic() < until:
        user.step()
        time.sleep(user.rng.uniform(0, 2 * _THINK))
    user.ask("DELETE", f"/{user.session}")
