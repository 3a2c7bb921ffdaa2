"""Watch and cancel long work."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import StreamingResponse

from mrdamper.errors import UnknownNameError
from mrdamper.web.sessions import Current, Session
from mrdamper.web.work import Job

router = APIRouter(prefix="/sessions/{session}/jobs")
_BETWEEN = 0.1  # seconds between two looks at a job
_SILENCE = 15.0  # seconds after which a comment keeps the connection open


@router.get("/{key}")
def look(key: str, session: Current) -> dict[str, Any]:
    """How it stands."""
    return _job(session, key).report()


@router.get("/{key}/events")
async def events(key: str, session: Current, request: Request) -> StreamingResponse:
    """Its progress as server-sent events, until it ends."""
    job = _job(session, key)
    return StreamingResponse(_follow(job, request), media_type="text/event-stream")


@router.delete("/{key}")
def cancel(key: str, session: Current) -> dict[str, Any]:
    """Stop it."""
    job = _job(session, key)
    job.cancel()
    return job.report()


async def _follow(job: Job, request: Request) -> AsyncIterator[str]:
    said, silent = "", 0.0
    while not request.app.state.stopping():
        report = job.report()
        text = json.dumps({k: v for k, v in report.items() if k != "seconds"}, allow_nan=False)
        if text != said or silent >= _SILENCE:
            said, silent = text, 0.0
            yield f"data: {json.dumps(report, allow_nan=False)}\n\n"
        if report["state"] not in ("waiting", "running"):
            return
        await asyncio.sleep(_BETWEEN)
        silent += _BETWEEN
        if await request.is_disconnected():
            return


def _job(session: Session, key: str) -> Job:
    if key not in session.jobs:
        raise UnknownNameError("that work is not known here", mend="start it again")
    return session.jobs[key]
