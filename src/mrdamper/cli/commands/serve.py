"""`mrdamper serve`: the app, a page served on this machine."""

from __future__ import annotations

import importlib.util
import os
import signal
import sys

import typer

from mrdamper.errors import MissingExtraError

_NEEDS = ("fastapi", "uvicorn", "plotly")

app = typer.Typer()


@app.command(epilog="Example: mrdamper serve --port 8765")
def serve(
    port: int = typer.Option(8765, min=0, max=65535, help="Port on this machine; 0: any free port."),
    browser: bool = typer.Option(True, "--browser/--no-browser", help="Open the page in the browser."),
) -> None:
    """Open the app: import files, identify, explore and export."""
    missing = [name for name in _NEEDS if importlib.util.find_spec(name) is None]
    if missing:
        raise MissingExtraError(f"the app needs {', '.join(missing)}", remedy="pip install 'mrdamper[web]'")
    from mrdamper.web.app import create_app
    from mrdamper.web.server import serve as run

    ended_by = run(create_app, port, browser)
    sys.stdout.flush()
    # Clean-up is complete; computing threads are not waited for.
    os._exit(0 if ended_by == signal.SIGINT else 128 + ended_by)  # Ctrl-C is the way to stop it
