"""Answers that are saved as files."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from fastapi.responses import Response


def download(content: bytes, name: str, kind: str) -> Response:
    """One file."""
    return Response(content, media_type=kind, headers={"Content-Disposition": f'attachment; filename="{name}"'})


def archive(written: Sequence[Path], name: str) -> Response:
    """Files of one folder, named as they stand in it, the first at its top."""
    top = written[0].parent
    return zipped({f"{name}/{path.relative_to(top).as_posix()}": path.read_bytes() for path in written}, f"{name}.zip")


def zipped(files: Mapping[str, bytes], name: str) -> Response:
    """Several files by their names."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as made:
        for inside, content in files.items():
            made.writestr(inside, content)
    return download(packed.getvalue(), name, "application/zip")
