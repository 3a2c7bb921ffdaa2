"""Short texts beside records: legends, lists of tests, descriptions, notes."""

from __future__ import annotations

from pathlib import Path

_LARGEST = 2**18  # bytes


def decoded(content: bytes) -> str:
    """Return a text in UTF-8, UTF-16 with its mark, or what spreadsheets write without being asked."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16", "replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", "replace")


def short_lines(path: Path) -> list[str]:
    """Return the lines of a short text; none of a file that is long, or cannot be read."""
    try:
        with path.open("rb") as file:
            content = file.read(_LARGEST + 1)
    except OSError:
        return []
    return decoded(content).splitlines() if len(content) <= _LARGEST else []
