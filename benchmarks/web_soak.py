"""The app under many sessions, and the cost of each request: `python -m benchmarks.web_soak [--seconds 600]`.

Thirty sessions open the bundled tests. Each moves a slider every two seconds, simulates once a minute, and studies,
exports and saves its project once, at times of its own. Latencies hold for a machine that does nothing else;
processor seconds hold on a busy one too: `--costs` measures these alone, one request after the other.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

SESSIONS, SLIDER_S, SIMULATION_S = 30, 2.0, 60.0
_TICK = os.sysconf("SC_CLK_TCK")
_CLOSED_S = 70.0  # until the memory of closed sessions is given back: the app looks every minute
_LAWS = ("skyhook", "passive", "clipped-optimal", "groundhook", "add")
_SYSTEMS = (
    ("quarter-car", "iso8608-b"),
    ("quarter-car", "bump"),
    ("half-car", "iso8608-b"),
    ("dyke1996", "elcentro@5"),
)


class Server:
    """The app in a process of its own."""

    def __init__(self) -> None:
        command = [sys.executable, "-m", "mrdamper", "serve", "--port", "0", "--no-browser"]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        self.base, _, self.token = self.process.stdout.readline().split()[2].partition("?token=")

    def ask(self, method: str, path: str, body: Any = None) -> bytes:
        """Answer to a request; raises `OSError` on an error or after two minutes."""
        headers = {"Origin": self.base.rstrip("/"), "Content-Type": "application/json", "X-App-Token": self.token}
        content = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(f"{self.base}api/sessions{path}", content, headers, method=method)
        with urllib.request.urlopen(request, timeout=120) as answer:
            return answer.read()

    def seconds(self) -> float:
        """Processor time of the server and of the compilers it waited for [s], without its workers that still run."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return sum(map(int, fields[11:15])) / _TICK

    def megabytes(self) -> float:
        """Resident memory of the server."""
        pages = Path(f"/proc/{self.process.pid}/statm").read_text().split()[1]
        return int(pages) * os.sysconf("SC_PAGE_SIZE") / 1e6

    def stop(self) -> None:
        """End it."""
        self.process.terminate()
        self.process.wait(timeout=30)


class User:
    """A session and what its page asks."""

    def __init__(self, server: Server, seed: int, times: dict[str, list[float]], errors: list[str]):
        self.server, self.rng, self.times, self.errors = server, random.Random(seed), times, errors
        self.works: list[threading.Thread] = []
        self.at, self.keys, self.where = "", [""], {"current_A": 0.5, "frequency_Hz": 1.0, "amplitude_m": 0.012}

    def timed(self, kind: str, method: str, path: str, body: Any = None) -> bytes:
        """Ask, and note the time it took, or the error."""
        began = time.perf_counter()
        try:
            return self.server.ask(method, f"{self.at}{path}", body)
        except urllib.error.HTTPError as error:
            self.errors.append(f"{kind}: {error.code} {error.read()[:120]!r}")
        except OSError as error:
            self.errors.append(f"{kind}: {error}")
        finally:
            self.times.setdefault(kind, []).append(time.perf_counter() - began)
        return b""

    def open(self) -> None:
        """Begin a session with the bundled tests."""
        self.at = f"/{json.loads(self.timed('open', 'POST', '', {}))['session']}"
        self.timed("bundled tests", "POST", "/bundled", {})
        self.keys = [damper["key"] for damper in json.loads(self.timed("dampers", "GET", "/dampers"))]

    def slide(self) -> None:
        """Move one slider; the current most often."""
        name = self.rng.choice(["current_A", "current_A", "frequency_Hz", "amplitude_m"])
        low, high = {"current_A": (0, 1), "frequency_Hz": (0.5, 3), "amplitude_m": (0.004, 0.02)}[name]
        self.where[name] = self.rng.uniform(low, high)
        self.timed(
            "predict", "POST", f"/dampers/{self.keys[0]}/predict", {**self.where, "currents": 15, "interval": True}
        )

    def simulate(self) -> None:
        """Simulate with any current: no two simulations of the soak are the same."""
        system, source = self.rng.choice(_SYSTEMS)
        ask = {"damper": self.rng.choice(self.keys), "system": system, "source": source, "scaled": True}
        ask |= {"control": self.rng.choice(_LAWS), "current_A": self.rng.uniform(0.2, 1.0)}
        self.timed("simulation", "POST", "/simulate", ask)

    def save(self) -> None:
        """Save the project."""
        self.timed("save", "POST", "/project.zip", {"state": "{}", "damper": self.keys[0], "logo": ""})

    def work(self, kind: str, path: str, body: Any = None) -> Callable[[], None]:
        """Long work: begin it and look at it until it ends, while the sliders move on."""

        def follow() -> None:
            began = time.perf_counter()
            job = json.loads(self.timed(f"begin {kind}", "POST", path, {} if body is None else body) or b"{}")
            while job and job["state"] in ("waiting", "running"):
                time.sleep(1.0)
                job = json.loads(self.timed("progress", "GET", f"/jobs/{job['key']}") or b"{}")
            if job.get("state") == "done":
                self.times.setdefault(kind, []).append(time.perf_counter() - began)
            else:
                self.errors.append(f"{kind}: {job}")

        def begin() -> None:
            self.works.append(threading.Thread(target=follow, daemon=True))
            self.works[-1].start()

        return begin

    def use(self, seconds: float) -> None:
        """Everything, each at times of its own."""
        self.open()
        rng, begin = self.rng, time.perf_counter()
        plan = [(rng.uniform(0, SLIDER_S) + SLIDER_S * i, self.slide) for i in range(int(seconds / SLIDER_S))]
        plan += [
            (rng.uniform(0, SIMULATION_S) + SIMULATION_S * i, self.simulate)
            for i in range(max(1, int(seconds / SIMULATION_S)))
        ]
        once = (self.work("study", "/study"), self.work("export", f"/dampers/{self.keys[0]}/export/c"), self.save)
        plan += [(rng.uniform(0, 0.8 * seconds), action) for action in once]
        for moment, action in sorted(plan, key=lambda step: step[0]):
            if moment < seconds:
                time.sleep(max(0.0, begin + moment - time.perf_counter()))
                action()
        for work in self.works:
            work.join()  # a session is closed once its work has ended


def soak(seconds: float) -> list[str]:
    """Lines of the table: thirty sessions for so long, then none."""
    server, times, errors = Server(), {}, []
    try:
        first = User(server, 0, {}, errors)
        first.open()
        first.timed("rig", "GET", "/data/rigs/0/quality")
        first.simulate()
        server.ask("DELETE", first.at)
        time.sleep(_CLOSED_S)
        start, began = server.megabytes(), server.seconds()
        users = [User(server, 1 + i, times, errors) for i in range(SESSIONS)]
        threads = [threading.Thread(target=user.use, args=(seconds,)) for user in users]
        for thread in threads:
            thread.start()
        most = start
        while any(thread.is_alive() for thread in threads):
            time.sleep(1.0)
            most = max(most, server.megabytes())
        spent = server.seconds() - began
        finished = {kind: len(times.get(kind, [])) for kind in ("study", "export")}
        for user in users:
            server.ask("DELETE", user.at)
        time.sleep(_CLOSED_S)
        closed = server.megabytes()
    finally:
        server.stop()
    refused = [text for text in errors if ": 4" not in text.partition(" ")[0]]
    p95 = {kind: float(np.percentile(taken, 95)) for kind, taken in times.items()}
    rows = [
        ("answers 5xx, lost or failed", f"{len(refused)} of {sum(map(len, times.values()))}", "0"),
        ("predict p95", f"{1e3 * p95['predict']:.0f} ms of {len(times['predict'])}", "300 ms"),
        ("simulation p95", f"{p95['simulation']:.2f} s of {len(times['simulation'])}", "5 s"),
        (
            "memory after close over start",
            f"{closed / start:.2f} ({start:.0f}, most {most:.0f}, {closed:.0f} MB)",
            "1.2",
        ),
        ("studies, exports finished", f"{finished['study']}, {finished['export']} of {SESSIONS}", ""),
        ("p95 of a study, an export", ", ".join(f"{p95.get(kind, np.nan):.0f} s" for kind in finished), ""),
        ("processors of the server and its finished workers", f"{spent / seconds:.2f}", ""),
    ]
    return [*(f"{what:50} {found:42} {'goal ' + goal if goal else ''}" for what, found, goal in rows), *errors[:10]]


def costs() -> list[str]:
    """Lines of the table: processor time of one request, most of them calculated anew."""
    server, lines, errors = Server(), [], []
    try:
        user = User(server, 1, {}, errors)
        user.open()
        time.sleep(8)  # what is read ahead

        def cost(what: str, action: Callable[[], Any], count: int, goal: str = "") -> None:
            began = server.seconds()
            for _ in range(count):
                action()
            spent = 1e3 * (server.seconds() - began) / count
            lines.append(f"{what:50} {spent:8.1f} ms, {server.megabytes():4.0f} MB {'goal ' + goal if goal else ''}")

        others = [User(server, 2 + i, {}, errors) for i in range(10)]
        cost("open a session with the bundled tests", lambda: others.pop().open(), 10)
        cost("first prediction with its interval", user.slide, 1)
        cost("prediction after a slider", user.slide, 100, "20 ms")
        cost("ten simulations, compiling what is not compiled yet", user.simulate, 10)
        cost("simulation, compiled", user.simulate, 40, "500 ms")
        cost("save the project", user.save, 10)
    finally:
        server.stop()
    return [*lines, *errors]


def main() -> None:
    """Print the costs, then the soak."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=600.0, help="length of the soak")
    parser.add_argument("--costs", action="store_true", help="the costs alone")
    chosen = parser.parse_args()
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f} before")
    print("\n".join(costs()), flush=True)
    if not chosen.costs:
        print(f"{SESSIONS} sessions for {chosen.seconds:g} s", flush=True)
        print("\n".join(soak(chosen.seconds)))


if __name__ == "__main__":
    main()
