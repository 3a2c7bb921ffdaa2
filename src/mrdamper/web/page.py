"""The page's own files, read once: nothing else can be asked for, whatever the path says."""

from __future__ import annotations

import mimetypes
from pathlib import Path

from starlette.responses import PlainTextResponse, Response
from starlette.types import Receive, Scope, Send

STATIC = Path(__file__).parent / "static"
_ASK_EACH_TIME = {"Cache-Control": "no-cache"}  # so that an update is seen


class PageFiles:
    """Serves what lies in the folder of the page when the bench starts."""

    def __init__(self, folder: Path = STATIC):
        self.files = {
            path.relative_to(folder).as_posix(): (path.read_bytes(), _kind(path))
            for path in sorted(folder.rglob("*"))
            if path.is_file()
        }

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        name = scope["path"].removeprefix(scope.get("root_path", "")).lstrip("/")
        await self.answer(name)(scope, receive, send)

    def answer(self, name: str) -> Response:
        """Return the file of that name, or that there is none."""
        if name not in self.files:
            return PlainTextResponse("there is no such file", status_code=404)
        content, kind = self.files[name]
        return Response(content, media_type=kind, headers=_ASK_EACH_TIME)

    def page(self) -> bytes:
        """Return the page, with every module announced: fetched at once instead of one import after the other."""
        links = "".join(
            f'  <link rel="modulepreload" href="/static/{name}">\n' for name in self.files if name.endswith(".js")
        )
        return self.files["index.html"][0].replace(b"</head>", f"{links}</head>".encode())


def _kind(path: Path) -> str:
    # Said here for scripts: what a system's registry says of them differs, and browsers insist.
    return (
        "text/javascript" if path.suffix == ".js" else mimetypes.guess_type(path.name)[0] or "application/octet-stream"
    )
