"""Watch and cancel long work."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import StreamingResponse

from mrdamper.web.jobs import Job
from mrdamper.web.sessions import Current

router = APIRouter(prefix="/sessions/{session}/jobs")
_BETWEEN = 0.1  # seconds between two looks at a job
_SILENCE = 15.0  # seconds after which a comment keeps the connection open


@router.get("")
def newest(session: Current) -> list[dict[str, Any]]:
    """Return the newest work of each kind on the data of now, the last begun last.

    A page that is loaded again finds its results here.
    """
    return [job.report() for job in sorted(session.newest.values(), key=lambda job: job.began)]


@router.get("/{key}")
def look(key: str, session: Current) -> dict[str, Any]:
    """Return the state of a job."""
    return session.job(key).report()


@router.get("/{key}/events")
async def events(key: str, session: Current, request: Request) -> StreamingResponse:
    """Its progress as server-sent events, until it ends."""
    return StreamingResponse(_follow(session.job(key), request), media_type="text/event-stream")


@router.delete("/{key}")
def cancel(key: str, session: Current) -> dict[str, Any]:
    """Stop it."""
    job = session.job(key)
    job.cancel()
    return job.report()


async def _follow(job: Job, request: Request) -> AsyncIterator[str]:
    sent, silent = "", 0.0
    while not request.app.state.stopping():
        report = job.report()
        text = json.dumps({k: v for k, v in report.items() if k != "seconds"}, allow_nan=False)
        if text != sent or silent >= _SILENCE:
            sent, silent = text, 0.0
            yield f"data: {json.dumps(report, allow_nan=False)}\n\n"
        if report["state"] not in ("waiting", "running"):
            return
        await asyncio.sleep(_BETWEEN)
        silent += _BETWEEN
        if await request.is_disconnected():
            return
