"""A browser for tests of pages, and checks of their screenshots."""

import base64
from contextlib import contextmanager
from pathlib import Path

import pytest

# Headless, a page takes a third of the processor time.
BROWSERS = (Path("/usr/bin/chromium-headless-shell"), Path("/usr/bin/chromium"))
# One red point as PNG.
LOGO = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
WIDE = 'A "maker" & <b>sons</b>, of a name as long as a name can be without being cut anywhere on a page of paper'
AUDIT = (Path(__file__).parent / "audit.js").read_text(encoding="utf-8")


@contextmanager
def launched():
    """Debian's chromium, driven by playwright."""
    sync = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    chromium = next(filter(Path.is_file, BROWSERS), None)
    if chromium is None:
        pytest.skip(f"no browser at {BROWSERS[0]}")
    with sync.sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=str(chromium), args=["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]
        )
        yield browser
        browser.close()
