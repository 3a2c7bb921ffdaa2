"""Run the bench on this machine, and only there."""

from __future__ import annotations

import os
import signal
import socket
import threading
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

import uvicorn

from mrdamper.errors import InputError
from mrdamper.web.app import create_app

LOOPBACK = "127.0.0.1"
_ENDS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


def serve(port: int, open_browser: bool = True) -> int:
    """Serve until a signal ends it; then every file and process of the bench is gone.

    Parameters
    ----------
    port : int
        0 for any that is free.
    open_browser : bool

    Returns
    -------
    int
        The signal.

    Raises
    ------
    InputError
        If the port is taken.
    MissingExtraError
        If the chart library is not installed.
    """
    listener = _listen(port)
    port = listener.getsockname()[1]
    server: uvicorn.Server
    app = create_app([f"{LOOPBACK}:{port}", f"localhost:{port}"], lambda: server.should_exit, read_ahead=True)
    server = _Server(
        uvicorn.Config(
            app, log_level="error", ws="none", access_log=False, timeout_graceful_shutdown=3, server_header=False
        ),
        f"http://{LOOPBACK}:{port}/",
        open_browser,
    )
    try:
        server.run(sockets=[listener])
    finally:
        listener.close()
    print("stopped", flush=True)
    return server.ended_by


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
        print(f"live bench: {self.address} (Ctrl-C stops it)", flush=True)
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
            mend="choose another with --port, or --port 0 for any that is free",
            code="E_PORT",
        ) from error
    return listener
