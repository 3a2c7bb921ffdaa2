"""The application: guard, views, page, and an end that leaves nothing behind."""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import gc
import importlib.util
import sys
import traceback
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import asynccontextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import HTMLResponse, JSONResponse, Response
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from mrdamper.errors import InputError, MissingExtraError
from mrdamper.web.api import routers
from mrdamper.web.jobs import refusal
from mrdamper.web.page import STATIC, PageFiles, page
from mrdamper.web.security import Guard
from mrdamper.web.sessions import BrowserSessions
from mrdamper.web.uploads import NothingTakenError

_SWEEP_SECONDS = 60.0
# Two arenas (M_ARENA_MAX), as one a thread keeps what each has held; arrays of 256 KB and more
# (M_MMAP_THRESHOLD) return to the system when they are freed.
_ALLOCATOR = {-8: 2, -3: 1 << 18}
_STATUS = {"E_SESSION_ENDED": 410, "E_DROP_SIZE": 413}


def create_app(
    hosts: Iterable[str],
    stopping: Callable[[], bool] = lambda: False,
    read_ahead: bool = False,
    token: str | None = None,
) -> FastAPI:
    """Make the application; raises `MissingExtraError` if the chart library is not installed.

    `hosts`: values of the Host header that are this app, with the port. `stopping`: true once the server is about to
    stop, so that open streams end. `read_ahead`: the first session reads the bundled tests before they are asked for.
    `token`: what a page has to show to open a session. It is part of the printed address, so that other users of this
    machine cannot open one; without a token, anybody who reaches the app can.
    """
    chart_library = plotly_script().read_bytes()  # sent in one piece: the first picture waits for it
    sessions = BrowserSessions()

    @asynccontextmanager
    async def life(app: FastAPI) -> AsyncIterator[None]:
        for option, value in _ALLOCATOR.items():
            _of_the_allocator("mallopt", option, value)
        sweeper = asyncio.create_task(_sweep(sessions))
        yield
        sweeper.cancel()
        sessions.close()

    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None, redirect_slashes=False, lifespan=life)
    app.state.sessions, app.state.stopping = sessions, stopping
    app.state.read_ahead, app.state.token = read_ahead, token
    app.add_exception_handler(InputError, _refuse)
    app.add_exception_handler(RequestValidationError, _misunderstand)
    app.add_exception_handler(HTTPException, _decline)
    for router in routers():
        app.include_router(router, prefix="/api")

    front = HTMLResponse(page(), headers={"Cache-Control": "no-cache"})

    @app.get("/")
    async def first() -> HTMLResponse:
        return front

    @app.get("/static/plotly.js")
    async def charts() -> Response:
        return Response(chart_library, media_type="text/javascript", headers={"Cache-Control": "max-age=3600"})

    app.mount("/static", PageFiles(directory=STATIC))
    app.add_middleware(_Faults)
    app.add_middleware(Guard, hosts=tuple(hosts))
    return app


def plotly_script() -> Path:
    """Return the chart library's script inside the plotly package, found without importing it.

    Raises `MissingExtraError` if the package is not installed.
    """
    spec = importlib.util.find_spec("plotly")
    script = Path(spec.origin).parent / "package_data" / "plotly.min.js" if spec and spec.origin else None
    if script is None or not script.is_file():
        raise MissingExtraError("the app requires plotly", remedy="pip install 'mrdamper[web]'")
    return script


async def _sweep(sessions: BrowserSessions) -> None:
    while True:
        await asyncio.sleep(_SWEEP_SECONDS)
        await asyncio.to_thread(sessions.sweep)
        await asyncio.to_thread(_give_memory_back)


def _give_memory_back() -> None:
    """Return the memory of ended sessions to the system; the allocator would keep it."""
    gc.collect()
    _of_the_allocator("malloc_trim", 0)


def _of_the_allocator(name: str, *arguments: int) -> None:
    """Call one of its functions, where this system's C library has it."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError, AttributeError):
            getattr(ctypes.CDLL(None), name)(*arguments)


def _refuse(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, InputError)
    return _refusal(error)


def _refusal(error: InputError) -> JSONResponse:
    body: dict[str, Any] = dict(refusal(error))
    if isinstance(error, NothingTakenError):
        body |= {"verdicts": [asdict(v) for v in error.verdicts], "profile": error.profile}
    return JSONResponse(body, status_code=_STATUS.get(error.code, 422))


def _decline(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    return JSONResponse({"text": error.detail, "code": f"E_{error.status_code}"}, status_code=error.status_code)


def _misunderstand(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"][1:])
    return JSONResponse(refusal(InputError(first["msg"], where=where, code="E_REQUEST")), status_code=422)


class _Faults:
    """Our own faults: traced on the terminal, admitted on the page, the inside kept in.

    Inside the guard, so that this answer too carries its headers.
    """

    def __init__(self, app: ASGIApp):
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        begun = False

        async def watched(message: Message) -> None:
            nonlocal begun
            begun = begun or message["type"] == "http.response.start"
            await send(message)

        try:
            await self.app(scope, receive, watched)
        except ClientDisconnect:
            return  # an upload that broke off: nobody is left to answer
        except Exception:
            if not begun and (ended := _ended(scope)):
                await ended(scope, receive, send)
                return
            traceback.print_exc(file=sys.stderr)
            if scope["type"] != "http" or begun:
                raise
            text = "Internal error (please report); the details are in the terminal."
            await JSONResponse({"text": text, "code": "E_OURS"}, status_code=500)(scope, receive, send)


def _ended(scope: Scope) -> JSONResponse | None:
    """Return the answer to a request whose session has ended; None where it named no session."""
    try:
        scope["app"].state.sessions.find(scope["path_params"]["session"])
    except InputError as error:
        return _refusal(error)
    except KeyError:
        return None  # it asked for no session
    return None
