"""The page as a browser shows it: from drop to report, sliders, bad files, hostile names, links."""

import base64
import json
import re
import zipfile
from dataclasses import replace

import pytest
from support.browser import AUDIT, LOGO
from web.conftest import WINDOW, served, watched_page
from web.rig_files import csv_of

from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.dampers.joint import JointProblem
from mrdamper.dampers.model_file import dump_model
from mrdamper.rig_files.dataset_folder import save_dataset

HOSTILE = [
    "<img src=x onerror=alert(1)>",
    "<script>alert(1)</script>",
    '"><svg onload=alert(1)>',
    "<b>bold</b>",
    "<a href='javascript:alert(1)'>x</a>",
    "=cmd|' /C calc'!A0",
    '=HYPERLINK("http://evil.example")',
    "+1+1",
    "-2+3",
    "@SUM(A1)",
    "e\u0301\u0327\u0328",
    "名前 ダンパ",
    "a\u0000b".replace("\u0000", "␀"),
    "%{x}<extra></extra>",
    "{{7*7}}${7*7}",
    "../../etc/passwd",
    "con",
    "x" * 120,
]


TAB_STOPS_OF_TOOL_BARS = """() => [...document.querySelectorAll(".modebar")].map(
    (bar) => [...bar.querySelectorAll(".modebar-btn")].filter((button) => button.tabIndex === 0).length)"""


def drop(page, files):
    """Upload files on the page as a hand would: {name: bytes}."""
    packed = [[name, base64.b64encode(content).decode()] for name, content in files.items()]
    page.evaluate(
        """(files) => {
            const transfer = new DataTransfer();
            for (const [name, text] of files) {
                const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
                transfer.items.add(new File([bytes], name));
            }
            document.dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, bubbles: true, cancelable: true }));
        }""",
        packed,
    )


def drop_dataset(page, dataset, folder):
    save_dataset(dataset, folder)
    drop(page, {path.name: path.read_bytes() for path in sorted(folder.iterdir())})


def open_tab(page, name):
    page.get_by_role("tab", name=name).click()


def curve(page, chart):
    """Path of the predicted loop in a chart, as drawn."""
    return page.locator(f"section[aria-label='{chart}'] .scatterlayer .js-line").last.get_attribute("d")


def comes_to(page, what, wanted, tries=1200):
    """Ask until the answer is the wanted one; the page's policy forbids polling inside it."""
    for _ in range(tries):
        if what() == wanted:
            return
        page.wait_for_timeout(50)
    assert what() == wanted


def expect_refusal(page):
    """Wait for the browser's own note on a refused request and drop it from the complaints."""
    comes_to(page, lambda: any("422" in text for text in page.complaints), True)
    page.complaints[:] = [text for text in page.complaints if "422" not in text]


def at_rest(page):
    """The Model view once its picture is that of its panel."""
    page.locator(".stage[aria-busy=false]").wait_for()
    return page


def link_of(page):
    """The page's address, once it holds the state that is shown."""
    page.locator("html[data-address=current]").wait_for()
    return page.evaluate("location.href")


def charts_fill_their_cards(page):
    """Whether every chart is as wide as its place."""
    return page.evaluate(
        """() => [...document.querySelectorAll(".chart .frame > .plot")].every((place) =>
            Math.abs(place.querySelector(".main-svg").getBoundingClientRect().width - place.clientWidth) < 2)"""
    )


def test_from_drop_to_report(page, small_rig, tmp_path, shoot):
    shoot(page, "1-empty")
    drop_dataset(page, small_rig, tmp_path / "rig")
    page.locator(".matrix .cell").first.wait_for()
    assert page.locator(".matrix .cell").count() == len(small_rig)
    assert page.locator(".cell.validate").count() == len(small_rig.split("validate"))
    page.locator("section[aria-label='Force over displacement'] .js-line").first.wait_for(state="attached")
    shoot(page, "2-data")

    open_tab(page, "Identify")
    page.get_by_label("One model").check()
    page.get_by_label("Model", exact=True).select_option("bouc-wen")
    page.get_by_role("button", name="Start").click()
    page.get_by_role("heading", name="runs identified").wait_for()
    page.locator("section[aria-label='Residual over time'] .js-line").wait_for(state="attached")
    shoot(page, "3-identified")

    page.reload()  # what was found is found again
    page.locator("html[data-ready]").wait_for()
    page.get_by_role("heading", name="runs identified").wait_for()
    page.locator("section[aria-label='Residual over time'] .js-line").wait_for(state="attached")

    open_tab(page, "Compare")
    page.locator("input[name=compared]").first.wait_for()
    for box in page.locator("input[name=compared]").all():
        box.set_checked(box.get_attribute("value") in ("bingham:individual", "smooth-bingham"))
    page.get_by_role("button", name="Compare", exact=True).click()
    page.locator("#compare-run").wait_for()
    page.locator("section[aria-label='Force over velocity'] .js-line").first.wait_for(state="attached")
    assert page.locator("#view tbody tr").count() == 2
    shoot(page, "4-compared")
    page.get_by_role(
        "button", name="Explore modified Bingham, individual fits", exact=True
    ).click()  # how sure it is is worked out now
    page.get_by_text("% prediction interval").wait_for()
    open_tab(page, "Compare")

    with page.expect_download() as waiting:
        page.get_by_role("link", name="Ranking as CSV").click()
    assert waiting.value.path().read_text(encoding="utf-8").startswith("rig,rank,model,title")
    with page.expect_download() as waiting:
        page.get_by_role("button", name="Page, tables and models as zip").click()
    assert "mrdamper-comparison/comparison.html" in zipfile.ZipFile(waiting.value.path()).namelist()

    open_tab(page, "Export")
    page.get_by_text("Head of the report").click()
    page.get_by_label("Customer").fill("<b>Customer & Sons</b>")
    page.get_by_label("Logo").set_input_files({"name": "logo.png", "mimeType": "image/png", "buffer": LOGO})
    page.get_by_role("img", name="The logo").wait_for()
    page.get_by_role("button", name="Create the report").click()
    page.get_by_role("progressbar").wait_for()
    page.get_by_role("link", name="report.html").wait_for()
    shoot(page, "5-export")
    with page.expect_download() as waiting:
        page.get_by_role("link", name="report.html").click()
    report = tmp_path / "report.html"
    waiting.value.save_as(report)
    said = report.read_text(encoding="utf-8")
    assert "MR damper study" in said
    assert "&lt;b&gt;Customer &amp; Sons&lt;/b&gt;" in said
    assert base64.b64encode(LOGO).decode() in said
    with page.expect_download() as waiting:
        page.get_by_role("link", name="Everything as one zip").click()
    waiting.value.save_as(tmp_path / "all.zip")
    everything = zipfile.ZipFile(tmp_path / "all.zip")
    assert everything.testzip() is None
    assert {f"mrdamper-study/{name}" for name in ("model.json", "report.html", "report.pdf")} <= {
        *everything.namelist()
    }
    with page.expect_download() as waiting:
        page.get_by_role("button", name="model.json").click()
    waiting.value.save_as(tmp_path / "model.json")
    assert json.loads((tmp_path / "model.json").read_text())["format"] == "mrdamper-model"


@pytest.fixture(scope="module")
def document(small_rig):
    """A saved model of the rig, with its covariance."""
    runs = small_rig.split("train")
    return dump_model(
        estimate_uncertainty(JointProblem(runs, "play-bypass").fit(rounds=1, most_steps=6).damper, list(runs))
    )


@pytest.fixture(scope="module")
def model_page(profile, address, document):
    """A page with the bundled tests and a damper of one of their rigs, dropped as a file."""
    with watched_page(profile, address) as page:
        page.get_by_role("button", name="Open the bundled tests", exact=True).click()
        page.locator(".matrix").wait_for()
        drop(page, {"model.json": document.encode()})
        page.locator("section[aria-label='Force over displacement'] .js-line").nth(1).wait_for(state="attached")
        yield page


@pytest.fixture
def on_model(model_page):
    """The Model view of that page, as a reader who has moved nothing sees it; left so, without complaints."""
    page = model_page
    yield at_rest(page)
    page.unroute_all()
    page.set_viewport_size(WINDOW)
    open_tab(page, "Model")
    page.get_by_label("Loops at all tested currents").uncheck()
    page.get_by_role("button", name="Reset all").click()
    at_rest(page)
    complaints, page.complaints[:] = list(page.complaints), []
    assert not complaints, complaints


def number(page, name):
    return float(page.locator(f".slider[data-name={name}] input[type=number]").input_value())


def type_number(page, name, text):
    """Type into the field beside a slider."""
    box = page.locator(f".slider[data-name={name}] input[type=number]")
    box.fill(text)
    box.press("Enter")


def test_sliders_move_the_loops_and_undo_takes_it_back(on_model, shoot):
    page = on_model
    shoot(page, "6-model")
    before, at_first = curve(page, "Force over displacement"), number(page, "current_A")
    slider = page.locator("#slider-current_A")
    slider.focus()
    for _ in range(12):
        slider.press("ArrowRight")
    assert number(page, "current_A") > at_first
    assert curve(at_rest(page), "Force over displacement") != before
    for _ in range(12):
        page.keyboard.press("Control+z")
    assert number(page, "current_A") == at_first
    comes_to(page, lambda: curve(page, "Force over displacement"), before)

    page.get_by_label("Loops at all tested currents").check()
    page.locator("section[aria-label='Force over displacement'] .js-line").nth(5).wait_for(state="attached")
    at_rest(page)
    keys = page.locator("section[aria-label='Force over displacement'] .keys").inner_text()
    assert "0.25 A" in keys
    assert "dotted: measured at this motion" in keys
    shoot(page, "7-family")


def test_impossible_input_is_refused_in_words_and_the_tool_bar_is_beside_the_curve(on_model, shoot):
    page = on_model
    shown = {name: number(page, name) for name in ("current_A", "frequency_Hz", "amplitude_m", "d")}
    for name, typed, said in (
        ("current_A", "-1", "−1 A is refused"),
        ("current_A", "1e9", "lies between 0 A and"),
        ("frequency_Hz", "0", "0 Hz is refused: a motion has a frequency above 0 Hz"),
        ("amplitude_m", "-3", "−3 mm is refused"),
        ("d", "-1", "is refused: "),
        ("current_A", "", "type a number"),
    ):
        type_number(page, name, typed)
        wrong = page.locator(f".slider[data-name={name}] .wrong")
        wrong.wait_for()
        assert said in wrong.inner_text()
        assert number(page, name) == shown[name]  # the field is what the picture shows
    shoot(page, "18-refused")
    for name, typed in (("current_A", "0.3"), ("frequency_Hz", "1"), ("amplitude_m", "10")):
        type_number(page, name, typed)
        assert not page.locator(f".slider[data-name={name}] .wrong").is_visible()
    chart = page.locator("section[aria-label='Force over velocity']")
    chart.locator(".plot").hover()
    bar, area = (chart.locator(part).bounding_box() for part in (".modebar", ".nsewdrag"))
    assert bar["x"] >= area["x"] + area["width"]
    assert chart.get_by_text("Chart Studio").count() == 0
    # Below the lowest tested current as above the highest the curve over current is dashed.
    dashes = page.locator("section[aria-label='Peak force over current'] .js-line").evaluate_all(
        "(lines) => lines.map((line) => line.style.strokeDasharray)"
    )
    assert any(dash not in ("", "none") for dash in dashes)


def test_the_band_follows_a_slider_that_is_dragged(on_model):
    page, chart = on_model, "section[aria-label='Force over displacement']"
    page.locator(f"{chart} .keys").get_by_text("90 % interval").wait_for()

    def low():
        return page.locator(f"{chart} .scatterlayer .js-line").first.get_attribute("d")

    type_number(page, "current_A", "0.3")
    before = low() if at_rest(page) else None
    box = page.locator("#slider-current_A").bounding_box()
    page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + box["height"] / 2)
    comes_to(page, lambda: low() != before, True)
    assert page.get_by_text("% prediction interval").count() == 1
    page.mouse.up()
    at_rest(page)


def test_the_bundled_tests_come_with_models_and_every_view_shows_something(page, shoot):
    page.get_by_role("button", name="Open the bundled tests", exact=True).click()
    page.locator(".matrix").wait_for()
    for tab, sight in (
        ("Model", "section[aria-label='Force over displacement'] .js-line"),
        ("Simulate", "section[aria-label='Acceleration'] .js-line"),
        ("Export", "#export-damper option"),
    ):
        open_tab(page, tab)
        page.locator(sight).first.wait_for(state="attached")
    assert page.locator("#export-damper optgroup").count() == 2
    names = page.locator("#export-damper option").all_inner_texts()
    assert len(names) == len(set(names))  # of two rigs with one model
    open_tab(page, "Model")
    for typed in ("90", "1e9", "-1", "0.4"):  # far outside, impossible twice, inside
        type_number(page, "current_A", typed)
        at_rest(page)
    assert number(page, "current_A") == 0.4
    assert page.evaluate(TAB_STOPS_OF_TOOL_BARS) == [1, 1, 1, 1, 1]
    shoot(page, "19-bundled-model")


def test_a_parameter_is_held_until_released(on_model):
    page = on_model
    row = page.locator(".slider[data-name=f0]")
    at_first = number(page, "f0")
    type_number(page, "f0", str(at_first + 50))
    row.get_by_role("button", name="Release f0").wait_for()
    assert number(page, "f0") == pytest.approx(at_first + 50)
    page.get_by_text("No prediction interval: the tests carry no information on a parameter held by hand.").wait_for()
    row.get_by_role("button", name="Release f0").click()
    comes_to(page, lambda: number(page, "f0"), pytest.approx(at_first, rel=1e-4))  # the field shows five figures


def test_a_slow_answer_dims_the_picture_and_extrapolation_is_said(on_model, shoot):
    page = on_model
    held = []
    page.route("**/predict", lambda route: held.append(route))
    page.locator("#slider-current_A").press("ArrowRight")
    page.get_by_text("Calculating …").wait_for()
    shoot(page, "17-late")
    page.unroute("**/predict")
    page.get_by_text("Calculating …").wait_for(state="detached")
    type_number(page, "current_A", "1.2")
    page.locator(".message.warn").filter(has_text="current 1.2 A, tested 0–1 A").wait_for()
    shoot(page, "8-extrapolation")


def test_a_link_asks_for_the_token_and_keeps_its_state(profile):
    with served(token="of-this_app1") as address:
        page = profile.new_page()
        page.goto(f"{address}/#s=eJw")
        for given in ("wrong", f"{address}/?token=of-this_app1"):  # the token alone, or the printed address
            page.get_by_label("Token").fill(given)
            with page.expect_navigation():
                page.get_by_role("button", name="Open").click()
        page.locator("html[data-ready]").wait_for()
        assert page.url.startswith(f"{address}/#s=")
        page.close()


def test_a_link_brings_the_state_back(on_model):
    page = on_model
    link_of(page)
    type_number(page, "current_A", "0.31")
    link = link_of(page)
    shown = curve(at_rest(page), "Force over velocity")
    other = page.context.new_page()  # a session of its own
    other.goto(link)
    other.locator("html[data-ready]").wait_for()
    other.locator("section[aria-label='Force over velocity'] .js-line").first.wait_for(state="attached")
    assert curve(at_rest(other), "Force over velocity") == shown
    assert number(other, "current_A") == pytest.approx(0.31)
    type_number(other, "current_A", "0.9")
    assert curve(at_rest(other), "Force over velocity") != shown
    open_tab(page, "Export")
    for button, name in (("Save the state", "mrdamper-state.json"), ("Save the project", "project.zip")):
        with page.expect_download() as waiting:
            page.get_by_role("button", name=button).click()
        drop(other, {name: waiting.value.path().read_bytes()})
        comes_to(other, lambda: number(other, "current_A"), pytest.approx(0.31))
        assert curve(at_rest(other), "Force over velocity") == shown
        type_number(other, "current_A", "0.9")
        at_rest(other)
    other.close()


def test_a_page_loaded_again_at_once_is_where_it_was(on_model):
    page = on_model
    link_of(page)
    for value in ("0.2", "0.31"):  # the second is not in the address yet
        type_number(page, "current_A", value)
    page.reload()
    page.locator("html[data-ready]").wait_for()
    assert number(at_rest(page), "current_A") == pytest.approx(0.31)
    link_of(page)


def test_rig_files_are_read_and_bad_ones_named(page, small_rig, shoot):
    files = {f"{run.id}.csv": csv_of(run) for run in list(small_rig)[:3]}
    drop(page, {**files, "<b>notes of the rig.csv": b"hello\nworld\n"})
    page.locator(".matrix .cell").first.wait_for()
    assert page.locator(".matrix .cell").count() == 3
    refused = page.locator(".message.bad").filter(has_text="<b>notes of the rig").first
    refused.wait_for()
    assert "E_" in refused.inner_text()
    row = page.locator("#tests th[scope=row]").filter(has_text="<b>notes of the rig")
    row.wait_for()
    assert row.inner_text() == "<b>notes of the rig.csv"  # once
    shoot(page, "9-verdicts")


def test_a_bad_file_says_what_where_and_how_to_mend_it(page, shoot):
    drop(page, {"runs.csv": b"run_id,rig\n", "samples.csv": b"run_id,time_s\n"})
    message = page.locator(".message.bad")
    message.wait_for()
    assert "no rows" in message.inner_text()
    assert "Add one row a run" in message.inner_text()
    assert "E_DATASET" in message.inner_text()
    assert ".scratch" not in message.inner_text()  # no path of this machine
    shoot(page, "10-bad-file")
    expect_refusal(page)


def test_hostile_names_are_text(page, small_rig, tmp_path, shoot):
    one = next(iter(small_rig))
    runs = [replace(one, id=name, rig=HOSTILE[0], force=one.force + i) for i, name in enumerate(HOSTILE)]
    dataset = small_rig.only(runs, name="hostile")  # the same samples twice would be left out
    drop_dataset(page, dataset, tmp_path / "hostile")
    page.locator(".cell").first.wait_for()
    assert page.locator(".cell").count() == len(HOSTILE)
    for cell, name in zip(page.locator(".cell").all(), HOSTILE, strict=True):
        assert cell.get_attribute("title").startswith(name)
    for i in (0, 1, 10, 13):
        page.locator(".cell").nth(i).click()
        page.get_by_role("heading", name=f"Run {HOSTILE[i]}", exact=True).wait_for()
    assert page.locator("main img, main script, main a[href^=javascript]").count() == 0
    assert page.evaluate("document.title") == "mrdamper app"
    shoot(page, "11-hostile-names")


def test_dark_projector_and_narrow(on_model, shoot):
    page = on_model
    page.get_by_role("button", name="Use dark colours").click()
    assert page.evaluate("document.documentElement.dataset.theme") == "dark"
    for size, name in (((1920, 1080), "12-dark-projector"), ((1024, 700), "16-dark-small"), ((700, 1000), "13-narrow")):
        page.set_viewport_size({"width": size[0], "height": size[1]})
        comes_to(page, lambda: charts_fill_their_cards(page), True)
        shoot(page, name)
    page.get_by_role("button", name="Use light colours").click()


def test_a_simulation_is_animated_with_its_loop(on_model, shoot):
    page = on_model
    page.emulate_media(reduced_motion="no-preference")  # else it stands still at first
    open_tab(page, "Simulate")
    mark = page.locator('section[aria-label="Loop of the damper"] .points path')
    mark.wait_for(state="attached")
    page.get_by_role("button", name="Pause").click()
    tyre, moment = page.locator(".scene .tyre"), page.get_by_label("Time of the simulation")

    def at(sample):
        moment.fill(str(sample))
        return tyre.get_attribute("cy"), mark.get_attribute("transform")

    first, later = at(400), at(470)
    assert first[0] != later[0]
    assert first[1] != later[1]
    assert at(400) == first
    shoot(page, "22-vehicle")
    page.get_by_label("In", exact=True).select_option("dyke1996")
    page.locator(".scene[aria-label^='Three-storey']").wait_for()
    comes_to(page, lambda: page.locator(".scene .mass").get_attribute("d").count("M"), 3)
    page.get_by_role("button", name="Pause").click()
    moment.fill("600")
    shoot(page, "23-building")
    page.emulate_media(reduced_motion="reduce")


def test_work_can_be_cancelled(on_model):
    page = on_model
    open_tab(page, "Identify")
    page.get_by_role("button", name="Start").click()
    page.get_by_role("button", name="Cancel").click()
    page.get_by_text("Cancelled. Nothing was changed.").wait_for()
    assert page.get_by_role("button", name="Start").is_enabled()


def test_the_keyboard_reaches_everything(on_model):
    page = on_model
    page.get_by_role("tab", name="Model").focus()
    for key, name in (("ArrowRight", "Compare"), ("ArrowLeft", "Model"), ("End", "Export"), ("Home", "Data")):
        page.keyboard.press(key)
        tab = page.get_by_role("tab", name=name)
        assert tab.get_attribute("aria-selected") == "true"
        assert page.get_by_role("tabpanel").get_attribute("aria-labelledby") == tab.get_attribute("id")
    page.get_by_role("button", name="utfsm").focus()
    page.keyboard.press("Enter")
    cells = page.locator(".matrix .cell")
    page.get_by_role("heading", name="Run utf_25mm0x25Hz_0A", exact=True).wait_for()
    assert page.locator("#data-rig-1:focus").count() == 1  # where the reader was
    cells.first.focus()
    for key in ("ArrowRight", "ArrowDown", "Enter"):
        page.keyboard.press(key)
    page.get_by_role("heading", name="Run utf_25mm0x5Hz_0.25A", exact=True).wait_for()
    assert page.locator(".cell[aria-pressed=true]:focus").count() == 1
    assert page.locator(".cell[tabindex='0']").count() == 1


def test_every_view_passes_axe(on_model):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    for tab in ("Model", "Data", "Identify", "Compare", "Simulate", "Export"):
        open_tab(on_model, tab)
        if tab == "Simulate":
            on_model.locator(".playback").wait_for()
        assert axe.run(on_model).response["violations"] == [], tab
    on_model.get_by_text("Units", exact=True).click()
    assert axe.run(on_model).response["violations"] == [], "units"
    on_model.get_by_text("Units", exact=True).click()


def test_the_main_action_of_every_view_is_a_few_tab_stops_away(on_model):
    page = on_model
    actions = {
        "Data": ".matrix .cell", "Identify": "Start", "Model": "#damper", "Compare": "Compare",
        "Simulate": "#simulate-damper", "Export": "Create the report",
    }  # fmt: skip
    for tab, action in actions.items():
        open_tab(page, tab)
        wanted = (
            page.locator(action).first if action[0] in "#." else page.get_by_role("button", name=action, exact=True)
        )
        wanted.wait_for()
        page.evaluate("document.activeElement.blur(); document.body.tabIndex = -1; document.body.focus()")
        page.keyboard.press("Tab")
        assert page.locator(":focus").inner_text() == "Skip to the view"
        page.keyboard.press("Enter")
        stops = 1
        while not wanted.evaluate("(it) => it === document.activeElement || document.activeElement.matches('.cell')"):
            page.keyboard.press("Tab")
            stops += 1
            assert stops <= 8, (tab, page.evaluate("document.activeElement.outerHTML"))
        page.evaluate("document.body.removeAttribute('tabindex')")


def test_every_number_and_axis_follows_the_units_chosen(on_model, shoot):
    page = on_model
    axes = lambda: page.locator("#view .xtitle, #view .ytitle").all_text_contents()  # noqa: E731
    chart = page.locator("section[aria-label='Force over displacement']")
    verdict = page.locator(".message").filter(has_text="Predicted: peak force")
    peak = lambda unit: float(re.search(rf"peak force ([\d.]+) {unit}", verdict.inner_text())[1])  # noqa: E731
    before, shape = (peak("N"), number(page, "amplitude_m")), curve(page, "Force over displacement")
    page.get_by_text("Units", exact=True).click()
    page.get_by_label("Force", exact=True).select_option("lbf")
    page.get_by_label("Length", exact=True).select_option("in")
    page.keyboard.press("Escape")
    comes_to(page, lambda: any("lbf" in text for text in axes()), True)
    at_rest(page)
    assert set(axes()) == {"Displacement (in)", "Force (lbf)", "Velocity (in/s)", "Time (s)", "Current (A)",
                           "Peak force (lbf)", "Energy (in·lbf)"}  # fmt: skip
    assert peak("lbf") == pytest.approx(before[0] / 4.4482216, rel=2e-3)
    assert number(page, "amplitude_m") == pytest.approx(before[1] / 25.4, rel=1e-3)
    comes_to(page, lambda: curve(page, "Force over displacement") == shape, True)  # the same picture on other axes
    assert page.locator(".slider[data-name=k] .unit, .slider[data-name=k1] .unit").first.inner_text() in (
        "lbf/in",
        "lbf/in/A",
    )
    type_number(page, "amplitude_m", "0.5")
    assert number(page, "amplitude_m") == 0.5
    shoot(page, "20-imperial")
    for tab, texts in {"Data": (" in", "lbf"), "Simulate": ("lbf", "in/s²"), "Export": (" in.",)}.items():
        open_tab(page, tab)
        if tab == "Simulate":
            page.locator(".playback").wait_for()
        for text in texts:
            page.locator("#view").get_by_text(text).first.wait_for()
    with page.expect_download() as waiting:
        page.get_by_role("button", name="Loop as CSV").click()
    assert waiting.value.path().read_text().startswith("time_s,displacement_in,velocity_in_s,current_A,force_lbf")
    page.reload()
    page.locator("html[data-ready]").wait_for()
    open_tab(page, "Model")
    at_rest(page)
    assert "Force (lbf)" in axes()
    for _ in range(3):  # the amplitude, the length, the force
        page.keyboard.press("Control+z")
    page.get_by_text("Units", exact=True).click()
    page.get_by_label("Force", exact=True).select_option("N")
    page.get_by_label("Length", exact=True).select_option("mm")
    page.get_by_text("Units", exact=True).click()
    assert chart.locator(".ytitle").text_content() == "Force (N)"


def test_opening_says_at_once_what_is_being_done(page, shoot):
    held = []

    def continue_(at):
        for _ in range(500):  # the request may follow the words that announce it
            if len(held) > at:
                break
            page.wait_for_timeout(10)
        held[at].continue_()

    page.route("**/bundled", lambda route: held.append(route))
    page.get_by_role("button", name="Open the bundled tests", exact=True).click()
    page.get_by_role("status").filter(has_text="Opening the bundled tests").wait_for()
    shoot(page, "14-opening")
    page.route("**/data/rigs/0", lambda route: held.append(route))
    continue_(0)
    page.get_by_role("status").filter(has_text="Analysing 34 runs").wait_for()
    continue_(1)
    page.locator(".matrix").wait_for()


def test_a_refused_file_is_mended_by_its_profile(page, small_rig, shoot):
    first, second = list(small_rig)[:2]
    wrong = replace(second, force=-second.force)
    drop(page, {f"{first.id}.csv": csv_of(first), f"{second.id}.csv": csv_of(wrong)})
    page.locator(".cell").wait_for()
    page.locator(".message.bad").filter(has_text="E_DISSIPATION_SIGN").wait_for()
    shoot(page, "15-refused")
    page.get_by_text("Rig profile as text").click()
    profile = page.get_by_label("Rig profile, TOML")
    before, force, after = profile.input_value().partition("[channels.force]")
    profile.fill(before + force + after.replace("#sign = -1", "sign = -1", 1))
    page.get_by_role("button", name="Read the refused file").click()
    page.locator(".cell").nth(1).wait_for()
    assert page.locator(".message.bad").count() == 0


def test_the_test_list_mends_currents_and_split_by_click(page, small_rig, shoot):
    runs = list(small_rig)[:4]
    drop(page, {f"test {i}.csv": csv_of(run) for i, run in enumerate(runs, 1)})
    tests = page.locator("#tests")
    tests.locator(".badge.bad").nth(3).wait_for()  # their names state no current: refused, and listed one by one
    expect_refusal(page)
    for i, run in enumerate(runs, 1):
        place = tests.get_by_label(f"Current of test_{i}, ampere")
        place.fill(str(run.current_A))
        place.press("Enter")
        tests.get_by_label(f"Use test_{i} for validation").wait_for()
    assert tests.locator(".badge.bad").count() == 0
    shoot(page, "17-test-list")
    tests.get_by_role("button", name="Use test_1 for validation").click()
    tests.get_by_role("button", name="Use test_1 for validation", pressed=True).wait_for()
    page.locator(".cell.validate").first.wait_for()
    tests.get_by_role("button", name="Nothing").click()
    tests.get_by_role("button", name="Use test_1 for validation", pressed=False).wait_for()


def test_columns_are_picked_by_eye(page, small_rig):
    run, lists = next(iter(small_rig)), []
    page.on("request", lambda request: lists.append(request) if request.url.endswith("/tests") else None)
    drop(page, {f"{run.current_A:g}A.csv": csv_of(run, "Time (s),A,Sensor B (N)")})
    expect_refusal(page)
    tests = page.locator("#tests")
    tests.get_by_label("Column of displacement").select_option(label="A")
    page.wait_for_timeout(200)
    assert len(lists) == 1  # a second list would replace the first with the choice in it
    assert tests.get_by_label("Column of displacement").input_value() == "1"
    tests.get_by_label("Unit of displacement").select_option("mm")
    tests.get_by_role("button", name="Read with these columns").click()
    page.locator(".matrix .cell").first.wait_for()
    assert page.locator(".message.bad").count() == 0


def test_a_browser_that_blocks_storage_gets_a_sentence_and_the_app(profile, address):
    page = profile.new_page()
    for name in ("localStorage", "sessionStorage"):
        refuse = "{ get() { throw new DOMException('denied', 'SecurityError'); } }"
        page.add_init_script(f"Object.defineProperty(window, '{name}', {refuse})")
    page.goto(address)
    page.locator("html[data-ready]").wait_for()
    page.get_by_text("This browser blocks storage").wait_for()
    page.get_by_role("button", name="Use dark colours").click()
    page.get_by_role("button", name="Open the bundled tests", exact=True).click()
    page.locator(".matrix").wait_for()
    page.close()


def test_a_browser_without_webassembly_gets_the_app(profile, address):
    page = profile.new_page()
    page.add_init_script(
        "delete window.WebAssembly; delete window.CompressionStream; delete window.DecompressionStream"
    )
    page.goto(f"{address}#s=eJw")  # a link that cannot be unpacked here
    page.locator("html[data-ready]").wait_for()
    page.get_by_text("This browser cannot write the state into a link").first.wait_for()
    page.get_by_role("button", name="Open the bundled tests", exact=True).click()
    page.locator(".matrix").wait_for()
    open_tab(page, "Model")
    page.locator("section[aria-label='Force over displacement'] .js-line").first.wait_for(state="attached")
    page.close()


def test_a_head_that_is_too_much_is_answered_by_a_sentence(page, shoot, tmp_path):
    huge = tmp_path / "huge.png"
    with huge.open("wb") as file:
        file.truncate(50_000_000)
    page.get_by_role("button", name="Open the bundled tests", exact=True).click()
    page.locator(".matrix").wait_for()
    open_tab(page, "Export")
    page.get_by_text("Head of the report").click()
    page.get_by_label("Logo").set_input_files(huge)
    page.get_by_text("huge.png is over 500 kB: give a smaller picture.").wait_for()
    page.get_by_label("Logo").set_input_files({"name": "no.png", "mimeType": "image/png", "buffer": b"no picture"})
    page.get_by_label("Customer").fill("x" * 5000)
    page.get_by_role("button", name="Create the report").click()
    page.locator(".message.bad").filter(has_text="E_ABOUT").wait_for()
    expect_refusal(page)
    page.get_by_label("Customer").fill("مختبر المخمدات")
    page.get_by_label("Customer").press("Tab")
    assert page.get_by_label("Customer").input_value() == "مختبر المخمدات"
    shoot(page, "21-head")


def test_the_audit_of_pictures_sees_what_is_wrong(page):
    page.evaluate(
        """() => {
            const weak = Object.assign(document.createElement("p"), { textContent: "weak text", id: "view" });
            weak.style.color = "#aaa";
            weak.style.width = "3000px";
            document.body.append(weak, document.createElement("button"));
        }"""
    )
    found = page.evaluate(AUDIT)
    assert {text.split(":")[0] for text in found} == {"weak", "no name", "used twice", "wider than its window"}
