"""Access to the server, and the content that the page may load.

The app listens on the loopback device, but any page in the same browser can reach that: a request
must name this host (against DNS rebinding) and, if it changes something, come from the app's own page
(against forged requests). The page itself may load nothing from elsewhere and run no inline script or style.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "font-src 'self'; img-src 'self' data: blob:; "  # the chart library draws its image files through them
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
}
FORM_LIMIT = 5_000_000  # bytes of a request body; files come by PUT and have a limit of their own
MAX_PAUSE_S = 30.0  # between two pieces of a body
_SAFE_METHODS = frozenset({"GET", "HEAD"})
_OWN_SITES = frozenset({"same-origin", "none"})  # sec-fetch-site of the app's page, and of a typed address


class Guard:
    """Refuse foreign requests, and add headers to every response; `hosts`: accepted Host headers, with the port."""

    def __init__(self, app: ASGIApp, hosts: Iterable[str]):
        self.app = app
        self.hosts = frozenset(hosts)
        self.origins = frozenset(f"http://{host}" for host in self.hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            # WebSocket is not used; start and stop of the application pass.
            if scope["type"] == "lifespan":
                await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        refusal = self.refusal(scope["method"], headers)
        received, complete = 0, False

        async def receive_some() -> Message:
            nonlocal received, complete
            try:  # after the body, the next message is the end of the connection, whenever it comes
                message = await asyncio.wait_for(receive(), None if complete else MAX_PAUSE_S)
            except TimeoutError:
                raise HTTPException(408, "the request was not completed in time") from None
            complete = complete or not message.get("more_body", False)
            received += len(message.get("body", b""))
            if received > FORM_LIMIT and scope["method"] != "PUT":
                raise HTTPException(413, "the request is too long")
            return message

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers[name] = value
                headers.setdefault("Cache-Control", "no-store" if scope["path"].startswith("/api/") else "no-cache")
            await send(message)

        if refusal:
            body = {"text": refusal, "code": "E_FORBIDDEN"}
            await JSONResponse(body, status_code=403)(scope, receive, send_guarded)
        else:
            await self.app(scope, receive_some, send_guarded)

    def refusal(self, method: str, headers: Headers) -> str | None:
        """Return the reason a request is refused, or None."""
        if headers.get("host", "").lower() not in self.hosts:
            return "This host name is not that of the app."
        if headers.get("sec-fetch-site", "same-origin") not in _OWN_SITES:
            return "Other pages may not use the app."
        origin = headers.get("origin")
        if method in _SAFE_METHODS and origin is None:
            return None
        if origin not in self.origins:
            return "Changes are accepted from the app's own page only."
        return None
