"""Responses to the page: arrays of 32-bit floats behind a JSON head, and files to save.

A screen shows no more than 32 bits of a curve, and the page reads the arrays without parsing.
"""

from __future__ import annotations

import io
import json
import struct
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from starlette.responses import Response

from mrdamper.data import Floats

_FLOAT_BYTES = 4  # a typed array begins at a multiple


def frame(head: Mapping[str, Any], arrays: Mapping[str, Floats]) -> Response:
    """Return named arrays (N,) and a head of JSON values.

    Layout: length of the head (uint32, little endian), the head as JSON padded with blanks to a
    multiple of four bytes, then the arrays as little-endian float32 in the order of
    `head["arrays"]`, a list of [name, length].
    """
    index = [[name, int(values.size)] for name, values in arrays.items()]
    text = json.dumps({**head, "arrays": index}, ensure_ascii=False, allow_nan=False).encode()
    text += b" " * (-len(text) % _FLOAT_BYTES)
    with np.errstate(over="ignore"):  # in single precision infinite, which is not drawn
        body = b"".join(np.ascontiguousarray(values, dtype="<f4").tobytes() for values in arrays.values())
    return Response(struct.pack("<I", len(text)) + text + body, media_type="application/octet-stream")


_FACTORS = {"N": 1.0, "kN": 1e-3, "lbf": 1 / 4.4482216152605, "m": 1.0, "mm": 1e3, "in": 1 / 0.0254}  # from SI


def in_units(rows: Sequence[Mapping[str, Any]], force: str, length: str) -> list[dict[str, Any]]:
    """Convert rows of a prediction, and their names, to other units; with mm, velocities are in m/s."""
    speed = "m" if length == "mm" else length
    columns = {
        "displacement_m": (f"displacement_{length}", _FACTORS[length]),
        "velocity_m_s": (f"velocity_{speed}_s", _FACTORS[speed]),
        "force_N": (f"force_{force}", _FACTORS[force]),
    }
    return [
        {columns[k][0] if k in columns else k: columns[k][1] * v if k in columns else v for k, v in row.items()}
        for row in rows
    ]


def download(content: bytes, name: str, kind: str) -> Response:
    """Return one file to save."""
    return Response(content, media_type=kind, headers={"Content-Disposition": f'attachment; filename="{name}"'})


def archive(files: Sequence[Path], name: str, folder: str = "") -> Response:
    """Return files as a zip, in a folder of it, with their paths relative to that of the first."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in files:
            archive.writestr(f"{folder}{path.relative_to(files[0].parent).as_posix()}", path.read_bytes())
    return download(packed.getvalue(), f"{name}.zip", "application/zip")
