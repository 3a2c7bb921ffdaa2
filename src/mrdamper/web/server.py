"""Server of the app, on this machine only."""

from __future__ import annotations

import asyncio
import os
import secrets
import signal
import socket
import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

import uvicorn
from starlette.applications import Starlette
from uvicorn.protocols.http.h11_impl import H11Protocol

from mrdamper.errors import InputError

HEAD_TIMEOUT_S = 15.0  # for the head of a request
LOOPBACK = "127.0.0.1"
_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


def serve(create_app: Callable[..., Starlette], port: int, open_browser: bool = True) -> int:
    """Serve an app until a signal ends it, and remove all its files and processes; returns the signal.

    Port 0: any free port. Raises `InputError` if the port is taken, `MissingExtraError` without the chart library.
    """
    listener = _listen(port)
    port = listener.getsockname()[1]
    server: uvicorn.Server
    token = secrets.token_urlsafe(24)
    hosts = [f"{LOOPBACK}:{port}", f"localhost:{port}"]
    app = create_app(hosts, lambda: server.should_exit, read_ahead=True, token=token)
    settings: dict[str, Any] = {"http": Connection, "ws": "none", "log_level": "error", "access_log": False}
    config = uvicorn.Config(app, timeout_graceful_shutdown=3, server_header=False, **settings)
    server = _Server(config, f"http://{LOOPBACK}:{port}/?token={token}", open_browser)
    try:
        server.run(sockets=[listener])
    finally:
        listener.close()
    print("stopped", flush=True)
    return server.ended_by


class Connection(H11Protocol):
    """Connection that is closed when the head of a request stays incomplete; `Guard` limits bodies."""

    _deadline: asyncio.TimerHandle | None = None

    @property
    def _busy(self) -> bool:
        return self.cycle is not None and not self.cycle.response_complete

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._set_deadline()

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        self._set_deadline()

    def connection_lost(self, exc: Exception | None) -> None:
        self._cancel_deadline()
        super().connection_lost(exc)

    def _set_deadline(self) -> None:
        if self._busy:
            self._cancel_deadline()
        elif self._deadline is None:
            self._deadline = self.loop.call_later(HEAD_TIMEOUT_S, self._time_out)

    def _cancel_deadline(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
        self._deadline = None

    def _time_out(self) -> None:
        self._deadline = None
        if not self._busy and not self.transport.is_closing():
            self.transport.close()


class _Server(uvicorn.Server):
    """Server that prints its address when it is ready, and opens the browser."""

    def __init__(self, config: uvicorn.Config, address: str, open_browser: bool):
        super().__init__(config)
        self.address, self.open_browser, self.ended_by = address, open_browser, 0

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        # uvicorn would raise the signal again, and end the process before the files are removed
        before = {number: signal.signal(number, self.handle_exit) for number in _SIGNALS}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        self.ended_by = sig
        super().handle_exit(sig, frame)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets=sockets)
        print(f"mrdamper app: {self.address} (Ctrl-C stops it)", flush=True)
        if self.open_browser:
            threading.Thread(target=webbrowser.open, args=(self.address,), daemon=True).start()


def _listen(port: int) -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    if os.name == "posix":  # on other systems two programs could share the port
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((LOOPBACK, port))
    except (OSError, OverflowError) as error:
        listener.close()
        problem = f"port {port} cannot be used: {getattr(error, 'strerror', None) or error}"
        remedy = "choose another with --port, or --port 0 for any that is free"
        raise InputError(problem, remedy=remedy, code="E_PORT") from error
    return listener
