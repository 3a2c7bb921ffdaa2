"""Progress and cancellation of jobs."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import StreamingResponse

from mrdamper.web.jobs import Job
from mrdamper.web.sessions import OpenSession

router = APIRouter(prefix="/sessions/{session}/jobs")
_INTERVAL_S = 0.1  # between two looks at a job
_MAX_SILENCE_S = 15.0  # a report keeps the connection open


@router.get("")
def newest(session: OpenSession) -> list[dict[str, Any]]:
    """Return the newest job of each kind on the present data in the order of their start, for a reloaded page."""
    return [job.report() for job in sorted(session.newest.values(), key=lambda job: job.began)]


@router.get("/{key}")
def report(key: str, session: OpenSession) -> dict[str, Any]:
    """Return the state of a job."""
    return session.job(key).report()


@router.get("/{key}/events")
async def events(key: str, session: OpenSession, request: Request) -> StreamingResponse:
    """Stream the progress of a job as server-sent events, until it ends."""
    return StreamingResponse(_follow(session.job(key), request), media_type="text/event-stream")


@router.delete("/{key}")
def cancel(key: str, session: OpenSession) -> dict[str, Any]:
    """Cancel a job."""
    job = session.job(key)
    job.cancel()
    return job.report()


async def _follow(job: Job, request: Request) -> AsyncIterator[str]:
    sent, silent_s = None, 0.0
    while not request.app.state.stopping():
        report = job.report()
        content = {name: value for name, value in report.items() if name != "seconds"}
        if content != sent or silent_s >= _MAX_SILENCE_S:
            sent, silent_s = content, 0.0
            yield f"data: {json.dumps(report, allow_nan=False)}\n\n"
        if report["state"] not in ("waiting", "running"):
            return
        await asyncio.sleep(_INTERVAL_S)
        silent_s += _INTERVAL_S
        if await request.is_disconnected():
            return
