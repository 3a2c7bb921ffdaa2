"""Open a session, keep it, end it."""

from __future__ import annotations

import secrets
import threading
from importlib.metadata import version
from typing import Any

from fastapi import APIRouter, Depends, HTTPException, Request

from mrdamper.web.imported_data import bundled
from mrdamper.web.rig_table import rig_table
from mrdamper.web.sessions import Current
from mrdamper.web.uploads import FILE_COUNT_LIMIT, FILE_LIMIT

router = APIRouter(prefix="/sessions")


async def _whole(request: Request) -> None:
    """Wait for the end of a request: one that is half sent opens no session and ends none."""
    await request.body()


@router.post("", dependencies=[Depends(_whole)])
def open_session(request: Request) -> dict[str, Any]:
    """Return a new session and what the page must know of the bench."""
    token, shown = request.app.state.token, request.headers.get("x-bench-token", "")
    if token is not None and not secrets.compare_digest(shown.encode(), token.encode()):
        raise HTTPException(
            403, "Open the address that the terminal shows: its token is missing or of an earlier start of the app."
        )
    session = request.app.state.sessions.open()
    if request.app.state.read_ahead:  # not before: it would compete with the page being loaded
        request.app.state.read_ahead = False
        threading.Thread(target=_read_ahead, name="bench-read-ahead", daemon=True).start()
    return {
        "session": session.name,
        "version": version("mrdamper"),
        "limits": {"file_bytes": FILE_LIMIT, "files": FILE_COUNT_LIMIT},
    }


@router.get("/{session}")
def keep(session: Current) -> dict[str, Any]:
    """Say that the page is still open; says what is on the bench."""
    imported = session.imported
    return {
        "data": None if imported is None else {"source": imported.source, "name": imported.dataset.name},
        "dampers": len(session.dampers),
    }


@router.delete("/{session}")
def end(session: Current, request: Request) -> dict[str, bool]:
    """End it and remove its files."""
    request.app.state.sessions.end(session.name)
    return {"ended": True}


def _read_ahead() -> None:
    """Analyse and check the bundled tests before they are asked for: they open at once, no drop waits for an import."""
    data = bundled().dataset
    for table in [rig_table(data, rig) for rig in data.rigs]:
        _ = table.quality  # also brings the libraries that judging takes
