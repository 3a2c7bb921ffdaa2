"""Check the built site, opened from disk: links, accessibility by axe, and what the search finds.

python docs/check.py docs/_build/html
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

CHROMIUM = "/usr/bin/chromium"
SEARCHES = {  # words a reader types, and a page that must be among the first five
    "PVP": "nomenclature",
    "CVP": "nomenclature",
    "dyno": "how-to/your-own-rig",
    "shock": "how-to/your-own-rig",
    "hysteresis": "models",
    "prediction interval": "explanation/how-sure",
    "FMU": "how-to/fmpy",
}
_SHOWN = 5  # results that a reader looks at


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


def pages_of(site: Path) -> list[Path]:
    """Pages of the site, without those of the theme."""
    return sorted(path for path in site.rglob("*.html") if "_static" not in path.parts)


def broken_links(site: Path) -> list[str]:
    """Links within the site that lead nowhere."""
    pages = {path: _Page(path.read_text(encoding="utf-8")) for path in pages_of(site)}
    broken = []
    for path, page in pages.items():
        for target in sorted(page.targets):
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                continue
            there = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            place = unquote(parts.fragment)
            if not there.exists() or (place and there in pages and place not in pages[there].places):
                broken.append(f"{path.relative_to(site)}: {target}")
    return broken


def violations(site: Path, pages: Sequence[Path], searches: Sequence[str] = ()) -> list[str]:
    """Violations that axe reports, errors on the console, and searches without their page; no network is reached."""
    from axe_playwright_python.sync_playwright import Axe
    from playwright.sync_api import sync_playwright

    found: list[str] = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        tab = browser.new_context(viewport={"width": 1280, "height": 900}).new_page()
        tab.route(lambda url: url.startswith("http"), lambda route: route.abort())
        for words in searches:
            tab.goto(f"{(site / 'search.html').resolve().as_uri()}?q={words.replace(' ', '+')}")
            tab.wait_for_selector("#search-results p.search-summary:not(:empty)", state="attached")
            tab.wait_for_timeout(1000)  # results appear one after another
            links = tab.eval_on_selector_all("#search-results li a", "all => all.map(a => a.getAttribute('href'))")
            first = [link.partition(".html")[0] for link in links][:_SHOWN]
            ordered = sorted(first, key=lambda name: name.startswith(("decisions/", "changes")))
            if SEARCHES[words] not in first or first != ordered:
                found.append(f"search {words!r}: finds {', '.join(first) or 'nothing'}; expected {SEARCHES[words]}")
        tab.on("pageerror", lambda error: found.append(f"{tab.url}: {error}"))
        tab.on("requestfailed", lambda request: found.append(f"{tab.url}: cannot load {request.url}"))
        for path in pages:
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
        pages, searches, workers = pages_of(site), list(SEARCHES), os.cpu_count() or 1
        with ProcessPoolExecutor(workers) as pool:
            parts = [pool.submit(violations, site, pages[i::workers], searches[i::workers]) for i in range(workers)]
            wrong += [line for part in parts for line in part.result()]
    else:
        print(f"no browser at {CHROMIUM}: accessibility and search were not checked", file=sys.stderr)
    print("\n".join(wrong) or "0 broken links, 0 accessibility violations; every search finds its page")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
