"""Installed fonts for characters that the bundled font of a PDF does not contain."""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from mrdamper.errors import listed

_MAX_FILE_BYTES = 40_000_000  # size of a font file [bytes]; larger ones are not opened


@dataclass(frozen=True)
class Fallback:
    """Fonts that contain further characters."""

    files: tuple[tuple[str, int], ...] = ()  # font files, each with its index within a collection
    missing: str = ""  # characters that no installed font contains

    @property
    def sentence(self) -> str:
        """State which characters are not printed, and why."""
        shown = listed([f"U+{ord(c):04X} {unicodedata.name(c, 'unnamed character')}" for c in self.missing], 3)
        return (
            f"Not printed, because no installed font contains them: {shown}. Install a font for this script, "
            "for example Noto Sans, and write the report again; report.html shows them."
        )


def fallback_fonts(text: str, bundled: str) -> Fallback:
    """Find installed fonts for the characters of a text that the font it is set in, `bundled`, does not contain."""
    missing = {c for c in text if c.isprintable() and not c.isspace()} - _characters(bundled)[0]
    files = []
    for path in installed_fonts() if missing else ():
        for index, characters in enumerate(_characters(path)):
            if covered := missing & characters:
                files.append((path, index))
                missing -= covered
        if not missing:
            break
    return Fallback(tuple(files), "".join(sorted(missing)))


def installed_fonts() -> list[str]:
    """List the font files of this machine, fonts for many scripts first."""
    from matplotlib.font_manager import findSystemFonts

    paths = [path for path in findSystemFonts() if Path(path).suffix.lower() in (".ttf", ".otf", ".ttc")]
    paths = [path for path in paths if Path(path).stat().st_size <= _MAX_FILE_BYTES]
    return sorted(paths, key=lambda path: ("CJK" not in path, "Noto" not in path, "Regular" not in path, path))


@cache
def _characters(path: str) -> tuple[frozenset[str], ...]:
    """Return the characters of every font in a file; a damaged or unsupported file has none and is not used."""
    from fontTools.ttLib import TTCollection, TTFont, TTLibError

    try:
        if path.lower().endswith(".ttc"):
            with TTCollection(path, lazy=True) as collection:
                return tuple(frozenset(map(chr, font.getBestCmap() or ())) for font in collection.fonts)
        with TTFont(path, lazy=True) as font:
            return (frozenset(map(chr, font.getBestCmap() or ())),)
    except (TTLibError, OSError, ValueError, AssertionError):
        return ()
