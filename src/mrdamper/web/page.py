"""The page and its files."""

from __future__ import annotations

import mimetypes
from pathlib import Path

from starlette.responses import Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

STATIC = Path(__file__).parent / "static"
mimetypes.add_type("text/javascript", ".js")  # systems register other types, which browsers refuse


class PageFiles(StaticFiles):
    """Files of the page; browsers check each time whether they have changed, for an update of the package."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Return the file of that path."""
        response = await super().get_response(path, scope)
        response.headers["Cache-Control"] = "no-cache"
        return response


def page() -> str:
    """Return the page with a preload link for every module, so that all are fetched at once."""
    modules = [path.relative_to(STATIC).as_posix() for path in sorted(STATIC.rglob("*.js"))]
    links = "".join(f'  <link rel="modulepreload" href="/static/{name}">\n' for name in modules)
    return (STATIC / "index.html").read_text(encoding="utf-8").replace("</head>", f"{links}</head>")
