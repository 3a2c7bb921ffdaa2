"""The built site, opened from disk: every link leads to a page and a place on it; axe finds nothing wrong.

python docs/check.py docs/_build/html
"""

from __future__ import annotations

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

CHROMIUM = "/usr/bin/chromium"


class _Page(HTMLParser):
    """Targets a page links to, and the places on it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.targets: set[str] = set()
        self.places: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("id", "name") and value:
                self.places.add(value)
            elif name in ("href", "src") and value and tag != "base":
                self.targets.add(value)


def broken_links(site: Path) -> list[str]:
    """Links within the site that lead nowhere, and files that would be loaded from a network."""
    pages = {path: _Page(path.read_text(encoding="utf-8")) for path in site.rglob("*.html")}
    broken = []
    for path, page in pages.items():
        if "_static" in path.parts:
            continue
        for target in sorted(page.targets):
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                continue
            there = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            place = unquote(parts.fragment)
            if not there.exists() or (place and there in pages and place not in pages[there].places):
                broken.append(f"{path.relative_to(site)}: {target}")
    return broken


def violations(site: Path) -> list[str]:
    """What axe says of every page in chromium, from disk and without a network; complaints on the console too."""
    from axe_playwright_python.sync_playwright import Axe
    from playwright.sync_api import sync_playwright

    found: list[str] = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        tab = browser.new_context(viewport={"width": 1280, "height": 900}).new_page()
        tab.route(lambda url: url.startswith("http"), lambda route: route.abort())
        tab.on("pageerror", lambda error: found.append(f"{tab.url}: {error}"))
        tab.on("requestfailed", lambda request: found.append(f"{tab.url}: cannot load {request.url}"))
        for path in sorted(site.rglob("*.html")):
            if "_static" in path.parts:
                continue
            tab.goto(path.resolve().as_uri())
            response = Axe().run(tab, options={"iframes": False, "preload": False}).response
            for rule in response["violations"]:
                shown = rule["nodes"][0]["html"][:120]
                found.append(
                    f"{path.relative_to(site)}: {rule['id']} ({rule['impact']}), {len(rule['nodes'])} ×: {shown}"
                )
        browser.close()
    return found


def main() -> None:
    """Print what is wrong; end with 1 if anything is."""
    site = Path(sys.argv[1])
    wrong = broken_links(site)
    if Path(CHROMIUM).is_file():
        wrong += violations(site)
    else:
        print(f"no browser at {CHROMIUM}: accessibility was not checked", file=sys.stderr)
    print("\n".join(wrong) or "0 broken links, 0 accessibility violations")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
