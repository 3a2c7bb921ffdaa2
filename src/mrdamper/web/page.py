"""The page and its own files."""

from __future__ import annotations

import mimetypes
from pathlib import Path

from starlette.responses import Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

STATIC = Path(__file__).parent / "static"
mimetypes.add_type("text/javascript", ".js")  # what a system's registry says of scripts differs, and browsers insist


class PageFiles(StaticFiles):
    """Serves the folder of the page; browsers ask each time whether a file has changed, so that an update is seen."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Return the file of that path."""
        response = await super().get_response(path, scope)
        response.headers["Cache-Control"] = "no-cache"
        return response


def page() -> str:
    """Return the page, with every module announced: fetched at once instead of one import after the other."""
    modules = [path.relative_to(STATIC).as_posix() for path in sorted(STATIC.rglob("*.js"))]
    links = "".join(f'  <link rel="modulepreload" href="/static/{name}">\n' for name in modules)
    return (STATIC / "index.html").read_text(encoding="utf-8").replace("</head>", f"{links}</head>")
