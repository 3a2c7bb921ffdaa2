"""Speed of the app in a browser: `python -m benchmarks.web`.

First page, first picture, and slider to picture while ten loops of a thousand points are dragged. Needs the
web extra, playwright and Chromium. Many sessions at once: `python -m benchmarks.web_soak`.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from mrdamper.dampers.joint import JointProblem
from mrdamper.dampers.model_file import dump_model
from mrdamper.rig_files.dataset_folder import load_dataset

CHROMIUM = os.environ.get("CHROMIUM", "/usr/bin/chromium")
DRAG_SECONDS = 5.0
GOALS = "goals: first page 1 s; first picture 2 s; slider to picture 50 ms median"


def main() -> None:
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f} before; {GOALS}")
    document = model_document()
    server = subprocess.Popen(
        [sys.executable, "-m", "mrdamper", "serve", "--port", "0", "--no-browser"],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        address = server.stdout.readline().split()[2]  # type: ignore[union-attr]
        for line in in_browser(address, document):
            print(line, flush=True)
    finally:
        server.terminate()
        server.wait(timeout=10)
    print(f"load {os.getloadavg()[0]:.1f} after")


def model_document() -> str:
    """The model of the second bundled rig."""
    return dump_model(JointProblem(load_dataset().rig("utfsm").split("train"), "play-bypass").fit().damper)


def in_browser(address: str, document: str):
    """First page, then drags of current, amplitude and a parameter."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        yield first_page(browser, address)
        yield first_picture(browser, address)
        page = browser.new_page(viewport={"width": 1366, "height": 768})
        page.goto(address)
        page.locator("html[data-ready]").wait_for()
        page.get_by_role("button", name="Open the bundled tests", exact=True).click()
        page.locator(".matrix").wait_for()
        page.locator("input[type=file]").first.set_input_files(
            {"name": "model.json", "mimeType": "application/json", "buffer": document.encode()}
        )
        page.get_by_label("Loops at all tested currents").check()
        page.wait_for_timeout(2000)
        for name in ("current_A", "amplitude_m", "fy1"):
            yield drag(page, name)
        browser.close()


def first_page(browser, address: str, repeats: int = 5) -> str:
    """From the address to the first view that can be used, in a fresh browser profile each time."""
    taken = []
    for _ in range(repeats):
        context = browser.new_context()
        page = context.new_page()
        begin = time.perf_counter()
        page.goto(address, wait_until="commit")
        page.locator("html[data-ready]").wait_for()
        taken.append(time.perf_counter() - begin)
        context.close()
    return f"first page: median {np.median(taken):.2f} s, worst {max(taken):.2f} s of {repeats}"


def first_picture(browser, address: str, repeats: int = 5) -> str:
    """From the click on the bundled tests to the first loop drawn."""
    taken = []
    for _ in range(repeats):
        context = browser.new_context()
        page = context.new_page()
        page.goto(address)
        page.locator("html[data-ready]").wait_for()
        begin = time.perf_counter()
        page.get_by_role("button", name="Open the bundled tests", exact=True).click()
        page.locator(".js-line").first.wait_for(state="attached")
        taken.append(time.perf_counter() - begin)
        context.close()
    return f"first picture of the bundled tests: median {np.median(taken):.2f} s, worst {max(taken):.2f} s of {repeats}"


def drag(page, name: str) -> str:
    """Drag a slider to and fro by the mouse; the page times every picture."""
    slider = page.locator(f"#slider-{name}")
    slider.scroll_into_view_if_needed()
    box = slider.bounding_box()
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.evaluate("performance.clearMeasures()")
    page.mouse.move(*middle)
    page.mouse.down()
    begin = time.perf_counter()
    while (now := time.perf_counter() - begin) < DRAG_SECONDS:
        page.mouse.move(middle[0] + 0.35 * box["width"] * math.sin(2 * now), middle[1])
        time.sleep(0.008)
    page.wait_for_timeout(200)
    times = page.evaluate("performance.getEntriesByName('slider-to-picture').map((e) => e.duration)")
    page.mouse.up()
    page.wait_for_timeout(1000)
    return (
        f"drag {name}, 10 loops x 1000 points: slider to picture median {np.median(times):.0f} ms, "
        f"p95 {np.percentile(times, 95):.0f} ms, {len(times) / DRAG_SECONDS:.0f} pictures a second"
    )


if __name__ == "__main__":
    if not Path(CHROMIUM).is_file():
        sys.exit(f"no browser at {CHROMIUM}; set CHROMIUM")
    main()
