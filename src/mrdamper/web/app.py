"""The application: routes, error responses, and the removal of all files at its end."""

from __future__ import annotations

import asyncio
import contextlib
import ctypes
import gc
import importlib.util
import mimetypes
import sys
import traceback
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import asynccontextmanager
from dataclasses import asdict
from pathlib import Path

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import HTMLResponse, JSONResponse, Response
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from mrdamper.errors import InputError, MissingExtraError
from mrdamper.web.api import routers
from mrdamper.web.jobs import error_parts
from mrdamper.web.security import Guard
from mrdamper.web.sessions import BrowserSessions
from mrdamper.web.uploads import AllRefusedError

STATIC = Path(__file__).parent / "static"
mimetypes.add_type("text/javascript", ".js")  # systems register other types, which browsers refuse
_SWEEP_S = 60.0
# Two arenas (M_ARENA_MAX), as one a thread keeps all it has held; arrays of 256 KB and more
# (M_MMAP_THRESHOLD) return to the system when they are freed.
_ALLOCATOR = {-8: 2, -3: 1 << 18}
_STATUS = {"E_SESSION_ENDED": 410, "E_UPLOAD_SIZE": 413}


def create_app(
    hosts: Iterable[str],
    stopping: Callable[[], bool] = lambda: False,
    read_ahead: bool = False,
    token: str | None = None,
) -> FastAPI:
    """Make the application; raises `MissingExtraError` if the chart library is not installed.

    `hosts`: accepted values of the Host header, with the port. `stopping`: true once the server is about to stop, so
    that open streams end. `read_ahead`: the first session reads the bundled tests before they are requested. `token`:
    required to open a session. It is part of the printed address, so that other users of this machine cannot open one;
    without a token, everybody who reaches the app can.
    """
    chart_library = plotly_script().read_bytes()  # sent in one piece: the first chart waits for it
    sessions = BrowserSessions()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        for option, value in _ALLOCATOR.items():
            _call_allocator("mallopt", option, value)
        sweeper = asyncio.create_task(_sweep(sessions))
        yield
        sweeper.cancel()
        sessions.close()

    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None, redirect_slashes=False, lifespan=lifespan)
    app.state.sessions, app.state.stopping = sessions, stopping
    app.state.read_ahead, app.state.token = read_ahead, token
    app.exception_handler(InputError)(_input_error)
    app.exception_handler(RequestValidationError)(_invalid_request)
    app.exception_handler(HTTPException)(_http_error)
    for router in routers():
        app.include_router(router, prefix="/api")

    front = HTMLResponse(_page())

    @app.get("/")
    async def front_page() -> HTMLResponse:
        return front

    @app.get("/static/plotly.js")
    async def charts() -> Response:
        return Response(chart_library, media_type="text/javascript", headers={"Cache-Control": "max-age=3600"})

    app.mount("/static", StaticFiles(directory=STATIC))
    app.add_middleware(_InternalErrors)
    app.add_middleware(Guard, hosts=tuple(hosts))
    return app


def plotly_script() -> Path:
    """Find the script of the chart library without importing it; raises `MissingExtraError` if it is not installed."""
    spec = importlib.util.find_spec("plotly")
    script = Path(spec.origin).parent / "package_data" / "plotly.min.js" if spec and spec.origin else None
    if script is None or not script.is_file():
        raise MissingExtraError("the app requires plotly", remedy="pip install 'mrdamper[web]'")
    return script


def _page() -> str:
    """Return the page with a preload link for every module, so that all are fetched at once."""
    modules = [path.relative_to(STATIC).as_posix() for path in sorted(STATIC.rglob("*.js"))]
    links = "".join(f'  <link rel="modulepreload" href="/static/{name}">\n' for name in modules)
    return (STATIC / "index.html").read_text(encoding="utf-8").replace("</head>", f"{links}</head>")


async def _sweep(sessions: BrowserSessions) -> None:
    while True:
        await asyncio.sleep(_SWEEP_S)
        await asyncio.to_thread(sessions.sweep)
        await asyncio.to_thread(gc.collect)
        await asyncio.to_thread(_call_allocator, "malloc_trim", 0)  # would keep the memory of ended sessions


def _call_allocator(name: str, *arguments: int) -> None:
    """Call a function of the allocator where the C library of this system has it."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError, AttributeError):
            getattr(ctypes.CDLL(None), name)(*arguments)


def _input_error(request: Request | None, error: InputError) -> JSONResponse:
    more = {}
    if isinstance(error, AllRefusedError):
        more = {"verdicts": [asdict(v) for v in error.verdicts], "profile": error.profile}
    return JSONResponse({**error_parts(error), **more}, status_code=_STATUS.get(error.code, 422))


def _http_error(request: Request, error: HTTPException) -> JSONResponse:
    return JSONResponse({"text": error.detail, "code": f"E_{error.status_code}"}, status_code=error.status_code)


def _invalid_request(request: Request, error: RequestValidationError) -> JSONResponse:
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"][1:])
    return _input_error(request, InputError(first["msg"], where=where, code="E_REQUEST"))


class _InternalErrors:
    """Response to an internal error, its details on the terminal only; inside `Guard`, which adds headers to it too."""

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
            return  # an interrupted upload: nobody receives a response
        except Exception:
            if not begun and (ended := _session_ended(scope)):
                await ended(scope, receive, send)
                return
            traceback.print_exc(file=sys.stderr)
            if scope["type"] != "http" or begun:
                raise
            text = "Internal error (please report); the details are in the terminal."
            await JSONResponse({"text": text, "code": "E_INTERNAL"}, status_code=500)(scope, receive, send)


def _session_ended(scope: Scope) -> JSONResponse | None:
    """Return the response to a request whose session has ended; None where it named no session."""
    try:
        scope["app"].state.sessions.find(scope["path_params"]["session"])
    except InputError as error:
        return _input_error(None, error)
    except KeyError:
        return None
    return None
