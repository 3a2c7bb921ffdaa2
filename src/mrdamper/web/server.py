"""Run the bench on this machine, and only there."""

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

import uvicorn
from starlette.applications import Starlette
from uvicorn.protocols.http.h11_impl import H11Protocol

from mrdamper.errors import InputError

HALF_SENT_S = 15.0  # that the head of a request may take
LOOPBACK = "127.0.0.1"
_ENDS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


def serve(create_app: Callable[..., Starlette], port: int, open_browser: bool = True) -> int:
    """Serve an app until a signal ends it; then every file and process of the bench is gone. Gives the signal.

    Port 0 is any that is free. Raises `InputError` if the port is taken, `MissingExtraError` without the chart library.
    """
    listener = _listen(port)
    port = listener.getsockname()[1]
    server: uvicorn.Server
    token = secrets.token_urlsafe(24)
    hosts = [f"{LOOPBACK}:{port}", f"localhost:{port}"]
    app = create_app(hosts, lambda: server.should_exit, read_ahead=True, token=token)
    server = _Server(
        uvicorn.Config(
            app,
            http=Connection,
            log_level="error",
            ws="none",
            access_log=False,
            timeout_graceful_shutdown=3,
            server_header=False,
        ),
        f"http://{LOOPBACK}:{port}/?token={token}",
        open_browser,
    )
    try:
        server.run(sockets=[listener])
    finally:
        listener.close()
    print("stopped", flush=True)
    return server.ended_by


class Connection(H11Protocol):
    """One that is closed when a request's head is begun and not finished; `Guard` looks after bodies."""

    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._watch()

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        self._watch()

    def connection_lost(self, exc: Exception | None) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
        super().connection_lost(exc)

    def _watch(self) -> None:
        if self.cycle is not None and not self.cycle.response_complete:
            if self._deadline is not None:
                self._deadline.cancel()
            self._deadline = None
        elif self._deadline is None:
            self._deadline = self.loop.call_later(HALF_SENT_S, self._give_up)

    def _give_up(self) -> None:
        self._deadline = None
        busy = self.cycle is not None and not self.cycle.response_complete
        if not busy and not self.transport.is_closing():
            self.transport.close()


class _Server(uvicorn.Server):
    """Says where it is once it answers, and opens the browser there."""

    def __init__(self, config: uvicorn.Config, address: str, open_browser: bool):
        super().__init__(config)
        self.address, self.open_browser, self.ended_by = address, open_browser, 0

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        # uvicorn would raise the signal again, and the process would end before it has cleaned up.
        before = {number: signal.signal(number, self.handle_exit) for number in _ENDS}
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
    if os.name == "posix":  # elsewhere it would let two programs share the port
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((LOOPBACK, port))
    except (OSError, OverflowError) as error:
        listener.close()
        raise InputError(
            f"port {port} cannot be used: {getattr(error, 'strerror', None) or error}",
            remedy="choose another with --port, or --port 0 for any that is free",
            code="E_PORT",
        ) from error
    return listener
