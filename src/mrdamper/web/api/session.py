"""Open a session, keep it alive, end it."""

from __future__ import annotations

import secrets
import threading
from typing import Any

from fastapi import APIRouter, Depends, HTTPException, Request

from mrdamper.web.imported_data import bundled
from mrdamper.web.rig_table import rig_table
from mrdamper.web.sessions import OpenSession
from mrdamper.web.uploads import FILE_COUNT_LIMIT, FILE_LIMIT

router = APIRouter(prefix="/sessions")


async def _complete(request: Request) -> None:
    """Wait for the end of a request: an incomplete one opens no session, and so ends none."""
    await request.body()


@router.post("", dependencies=[Depends(_complete)])
def open_session(request: Request) -> dict[str, Any]:
    """Open a session; returns its name and the limits of uploads."""
    token, given = request.app.state.token, request.headers.get("x-app-token", "")
    if token is not None and not secrets.compare_digest(given.encode(), token.encode()):
        text = "The token is missing or of an earlier start of the app: open the address in the terminal, or enter it."
        raise HTTPException(403, text)
    session = request.app.state.sessions.open()
    if request.app.state.read_ahead:  # not at the start of the app, where it would delay the page
        request.app.state.read_ahead = False
        threading.Thread(target=_read_ahead, name="read-ahead", daemon=True).start()
    return {"session": session.name, "limits": {"file_bytes": FILE_LIMIT, "files": FILE_COUNT_LIMIT}}


@router.get("/{session}")
def keep_alive(session: OpenSession) -> dict[str, Any]:
    """Keep a session alive; returns the source and name of its data."""
    imported = session.imported
    return {"data": None if imported is None else {"source": imported.source, "name": imported.dataset.name}}


@router.delete("/{session}")
def end(session: OpenSession, request: Request) -> dict[str, bool]:
    """End a session and remove its files."""
    request.app.state.sessions.end(session.name)
    return {"ended": True}


def _read_ahead() -> None:
    """Analyse and check the bundled tests before they are requested: they open at once, with all imports done."""
    data = bundled().dataset
    for table in [rig_table(data, rig) for rig in data.rigs]:
        _ = table.quality
