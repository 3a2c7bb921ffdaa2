"""Run the bench on this machine, and only there."""

from __future__ import annotations

import os
import signal
import socket
import threading
import webbrowser

import uvicorn

from mrdamper.errors import InputError
from mrdamper.web.app import create_app

LOOPBACK = "127.0.0.1"


def serve(port: int, open_browser: bool = True) -> None:
    """Serve until interrupted; then every file and process of the bench is gone.

    Parameters
    ----------
    port : int
        0 for any that is free.
    open_browser : bool

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
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, server.handle_exit)  # the terminal was closed
    try:
        server.run(sockets=[listener])
    except KeyboardInterrupt:
        pass  # the way to stop it; the application has cleaned up
    finally:
        listener.close()
    print("stopped", flush=True)


class _Server(uvicorn.Server):
    """Says where it is once it answers, and opens the browser there."""

    def __init__(self, config: uvicorn.Config, address: str, open_browser: bool):
        super().__init__(config)
        self.address, self.open_browser = address, open_browser

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
