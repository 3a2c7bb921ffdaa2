"""The damper as a page: what it shows is what the damper says, whatever browser, name or file it meets."""

import base64
import importlib.util
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from support.browser import AUDIT
from support.dampers import all_dampers, joint_damper, modified_damper
from support.sessions import session_runs

from mrdamper.dampers.covariance import estimate_uncertainty
from mrdamper.dampers.joint import JointDamper
from mrdamper.dampers.streaming import stepper
from mrdamper.data import Condition, Run
from mrdamper.exporters import page as page_module
from mrdamper.exporters.page import PageExporter
from mrdamper.exporters.toolchain import Built, build_webassembly
from mrdamper.models import model_type
from mrdamper.physics.motion import measured_motion

DAMPERS = all_dampers()
TRANSCENDENTAL = re.compile(r"Math\.(exp|expm1|log|log1p|tan|tanh|atan|atanh|pow)\(")
WIDTHS = """  // that were asked for
    const known = Object.getOwnPropertyDescriptor(Element.prototype, "clientWidth");
    window.widths = [];
    Object.defineProperty(Element.prototype, "clientWidth", {
        get() { return widths[widths.push(known.get.call(this)) - 1]; }
    });
"""
HOSTILE = [
    "</script><script>alert(1)</script>",
    "🛠️ Prüfstand 名前 \u202egnp",
    '"><img src=x onerror=alert(1)>',
    "<!--<script>",
    "{{7*7}}${7*7}",
    "x" * 300,
]


@pytest.fixture(scope="module")
def page_of():
    """A function that gives a damper's page, made once: with a compiler or, under `no_compiler`, without."""
    made = {}

    def page_of(damper):
        key = (repr(damper), page_module.build_webassembly is build_webassembly)
        if key not in made:
            made[key] = next(iter(PageExporter().export(damper, "damper").files.values()))
        return made[key]

    return page_of


@pytest.fixture
def no_compiler(monkeypatch):
    """Pages in plain JavaScript, whatever is installed."""
    monkeypatch.setattr(page_module, "build_webassembly", lambda _: Built(None, "no compiler for it"))


@pytest.fixture
def opened(browser, tmp_path, page_of):
    """A function that opens a damper's page from disk, with scripts run before it; complaints of the page fail."""
    contexts, complaints = [], []

    def opened(damper, *, before="", size=(1280, 900), **options):
        path = tmp_path / "damper.html"
        path.write_bytes(page_of(damper))
        contexts.append(browser.new_context(viewport=dict(zip(("width", "height"), size, strict=True)), **options))
        page = contexts[-1].new_page()
        page.set_default_timeout(20_000)
        page.on("console", lambda m: complaints.append(m.text) if m.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("dialog", lambda dialog: complaints.append(f"a script ran: {dialog.message}"))
        page.on(
            "request", lambda r: None if r.url.startswith(("file:", "data:", "blob:")) else complaints.append(r.url)
        )
        if before:
            page.add_init_script(before)
        page.goto(path.as_uri())
        if options.get("java_script_enabled", True):
            page.locator("html[data-ready]").wait_for()
        return page

    yield opened
    for context in contexts:
        context.close()
    assert not complaints, complaints


def doubles(text):
    return np.frombuffer(base64.b64decode(text), "<f8")


def put(page, **values):
    """Type numbers into the fields, and wait for the picture."""
    for key, value in values.items():
        page.locator(f"#{key}-number").fill(repr(value))
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def saved(page):
    """(N, 5): what the page saves as CSV."""
    with page.expect_download() as download:
        page.get_by_role("button", name="Save the curve").click()
    head, *rows = download.value.path().read_text().splitlines()
    assert head == "time_s,displacement_m,velocity_m_s,current_A,force_N"
    return np.array([[float(cell) for cell in row.split(",")] for row in rows])


def csv_of(**columns):
    rows = zip(*columns.values(), strict=True)
    return "\n".join([",".join(columns), *(",".join(map(repr, map(float, row))) for row in rows)]).encode()


def give(page, content, name="motion.csv"):
    page.locator("#file").set_input_files({"name": name, "mimeType": "text/csv", "buffer": content})
    page.wait_for_function("!document.getElementById('file-message').textContent.startsWith('Reading')")
    return page.locator("#file-message").inner_text()


@pytest.fixture(scope="module")
def blank(browser):
    """An empty page, to run scripts in."""
    page = browser.new_page()
    yield page
    page.context.close()


@pytest.mark.parametrize("name", DAMPERS)
def test_javascript_is_python_to_the_last_bit_or_to_rounding(name, blank, no_compiler):
    """Every way to stream a damper; with library functions their rounding is the browser's."""
    text = next(iter(PageExporter().export(DAMPERS[name], "damper").files.values())).decode()
    assert len(text.encode()) <= 150_000
    script = text[text.index("function makeDamper") : text.index("\n// The page:")]
    facts = json.loads(re.search(r'id="facts">(.*?)</script>', text, re.DOTALL)[1])
    tests, curves = facts["test"], [doubles(curve["data"]).tolist() for curve in facts["curves"]]
    x, current, force = (doubles(tests[key]) for key in ("displacement", "current", "force"))
    answer = blank.evaluate(
        """([script, x, current, step, curves]) => {
            const makeDamper = new Function(`${script}\nreturn makeDamper;`)();
            const damper = makeDamper(curves.map((points) => Float64Array.from(points)));
            damper.begin();
            return x.map((one, i) => damper.drive(one, current[i], step));
        }""",
        [script, x.tolist(), current.tolist(), tests["step"], curves],
    )
    assert np.ptp(force) > 1  # the vectors move the damper
    if TRANSCENDENTAL.search(script):
        # What is integrated decides on its step by its error, and so amplifies rounding.
        limit = tests["tolerance"] if "spencer" in name or "lugre" in name else 2e-14
        assert np.max(np.abs(np.array(answer) - force)) <= limit * np.max(np.abs(force))
    else:
        assert np.array_equal(answer, force)


@pytest.mark.parametrize(
    "damper", [joint_damper(), joint_damper("bouc-wen"), modified_damper()], ids=["play", "bouc-wen", "modified"]
)
def test_the_sine_is_the_dampers_own_loop(opened, damper, no_compiler):
    page = opened(damper)
    put(page, current=0.7, frequency=1.5, amplitude=12.0)
    shown, loop = saved(page), damper.loop(Condition(0.7, 1.5, 0.012))
    span = np.ptp(loop.force)
    assert abs(shown[:, 4].max() - loop.force.max()) < 2e-3 * span
    assert abs(shown[:, 4].min() - loop.force.min()) < 2e-3 * span
    energy = np.trapezoid(loop.force, loop.excitation.displacement)
    assert np.trapezoid(shown[:, 4], shown[:, 1]) == pytest.approx(energy, rel=5e-3)
    told = page.locator("#numbers").inner_text()
    assert f"{energy:.3g} J per cycle" in told
    assert page.locator("#outside").inner_text() == ""
    # Counted at once: the wide picture is drawn later.
    outside = "[...document.querySelectorAll('path.outside')].filter((path) => !path.closest('#wide')).length"
    assert page.evaluate(outside) == 0


def test_beyond_the_tests_curves_are_dashed_and_said_so(opened, no_compiler):
    page = opened(joint_damper())
    put(page, frequency=6.0)
    assert "frequency was tested 0.5–4 Hz" in page.locator("#outside").inner_text()
    assert page.locator("#over-displacement path.outside").count() == 1
    put(page, frequency=1.0)
    assert page.locator("#over-displacement path.outside").count() == 0


def test_a_band_is_shaded_where_it_was_tested_and_nowhere_else(opened, no_compiler):
    truth = joint_damper()
    page = opened(estimate_uncertainty(truth, session_runs(truth)))
    text = page.locator("main").inner_text()
    assert "Shaded: 90 % prediction interval of the force" in text
    assert "at untested conditions the widest inside the tested ranges" in text
    assert page.locator("#over-displacement path.band, #over-velocity path.band").count() == 2
    assert re.search(r"extension\s+[\d,.]+ ± [\d,.]+ N", page.locator("#numbers").inner_text())
    put(page, frequency=6.0)
    assert page.locator("path.band").count() == 0
    assert "±" not in page.locator("#numbers").inner_text()


def test_a_motion_of_ones_own_is_predicted_as_on_the_command_line(opened, no_compiler):
    damper = joint_damper()
    t = np.arange(2000) * 2e-3
    x = 0.03 + 0.008 * np.sin(2 * np.pi * t) + 0.003 * np.sin(2 * np.pi * 2.5 * t) + 1e-5 * np.cos(37 * t)
    current = 0.2 + 0.1 * t
    predicted = damper.predict(measured_motion(Run("motion", t, x, np.zeros(t.size), current)))
    page = opened(damper)
    said = give(page, csv_of(time_s=t, displacement_m=x, current_A=current, force_N=predicted.force + 10))
    assert "2000 samples" in said
    shown = saved(page)
    given, stream = predicted.motion, stepper(damper)
    channels = (given.displacement, given.velocity, given.acceleration, given.current, np.full(t.size, 2e-3))
    stepped = np.array([stream.step_motion(*sample) for sample in zip(*(c.tolist() for c in channels), strict=True)])
    span = np.ptp(predicted.force)
    assert np.max(np.abs(shown[:, 4] - stepped)) < 1e-6 * span
    assert np.max(np.abs(shown[:, 4] - predicted.force)) < 3e-3 * span  # a stream turns between samples, arrays at one
    assert page.locator("path.measured").count() == 3
    error = 100 * 10 / np.ptp(predicted.force)
    assert f"{error:.2f}"[:3] in page.locator("#numbers").inner_text()
    page.get_by_role("button", name="Back to the sine").click()
    page.locator("#numbers", has_text="per cycle").wait_for()


ROWS = [f"{0.001 * i:.6f};{0.01 * np.sin(0.05 * i):.6f}" for i in range(400)]


def test_a_file_of_a_german_spreadsheet_is_read(opened, no_compiler):
    text = "\ufefftime_s;displacement_m\r\n" + "\r\n".join(ROWS).replace(".", ",") + "\r\n\r\n"
    assert "400 samples" in give(opened(joint_damper()), text.encode())


UNUSABLE = [
    (b"", "0 rows"),
    (b"\x00\x01PK\x03\x04" * 500, "rows"),
    ("time_s,displacement_m\n" + "0,0\n0.1,NaN\n0.2,1\n0.3,2\n", "row 3"),
    ("time_s,displacement_m\n" + "0,0\n0.1,1e999\n0.2,1\n0.3,2\n", "row 3"),
    ("time_s,displacement_m\n" + "0,0\n0.1,\n0.2,1\n0.3,2\n", "is not a finite number"),
    ("time_s,displacement_m\n" + "0,0\n0.1,1\n0.1,1\n0.3,2\n", "does not increase at row 4"),
    ("time_s,displacement_mm\n" + "0,0\n0.1,1\n0.2,1\n0.3,2\n", "convert it to SI"),
    ("time_s,current_mA,displacement_m\n" + "0,0,0\n0.1,1,1\n0.2,1,2\n0.3,2,1\n", '"current_A" is expected'),
    ("a,<img src=x onerror=alert(1)>\n" + "0,0\n0.1,1\n0.2,1\n0.3,2\n", "time_s is missing"),
    ("time_s,displacement_m\n" + "0,1\n0.1,1\n0.2,1\n0.3,1\n", "does not move"),
    ("time_s,displacement_m\n" + "0,0\n0.1,1\n0.2,1\n0.3,2\n9,1\n9.1,2\n", "a gap of"),
]


def test_a_file_that_cannot_be_used_gets_a_sentence_and_the_picture_stays(opened, no_compiler):
    page = opened(joint_damper())
    for i, (content, word) in enumerate(UNUSABLE):
        name, content = f"weird <b>{i}</b>.csv", content if isinstance(content, bytes) else content.encode()
        page.locator("#file").set_input_files({"name": name, "mimeType": "text/csv", "buffer": content})
        page.locator("#file-message", has_text=f"{name}: ").wait_for()
        assert word in page.locator("#file-message").inner_text(), content
        assert page.locator("svg path").count() >= 2
    put(page, current=0.3)
    assert "per cycle" in page.locator("#numbers").inner_text()


def test_a_gigabyte_is_refused_before_it_is_read(opened, no_compiler, tmp_path):
    path = tmp_path / "long.csv"
    with path.open("wb") as file:
        file.truncate(10**9)
    page = opened(joint_damper())
    page.locator("#file").set_input_files(path)
    page.locator("#file-message", has_text="this page reads up to 50 MB").wait_for()


def test_a_name_is_text_and_nothing_else(opened, no_compiler):
    rig = " ".join(HOSTILE)
    page = opened(replace(joint_damper(), rig=rig, provenance={rig: rig}))
    assert page.locator("h1").inner_text() == f"Damper of rig {rig}"
    assert page.evaluate("document.scripts.length") == 2
    assert page.evaluate(AUDIT) == []


def test_without_scripts_it_says_why_nothing_moves(opened, no_compiler):
    page = opened(joint_damper(), java_script_enabled=False)
    assert "scripts are disabled" in page.locator("#message").inner_text()


def test_forces_that_differ_are_not_shown_as_good(opened, no_compiler):
    page = opened(joint_damper(), before="Math.exp = (x) => 1 + x;")
    assert "do not use the numbers" in page.locator("#message").inner_text()


@pytest.mark.parametrize(("size", "scheme"), [((360, 740), "dark"), ((1280, 900), "light")], ids=["phone", "desk"])
def test_it_reads_well_on_a_phone_and_in_the_dark(opened, no_compiler, size, scheme):
    page = opened(joint_damper(), before=WIDTHS, size=size, color_scheme=scheme, has_touch=size[0] < 500)
    page.locator("#wide svg").wait_for()
    assert min(page.evaluate("widths")) > 240  # no chart is drawn before its panel has a width
    assert page.evaluate(AUDIT) == []


def test_the_keyboard_alone_serves(opened, no_compiler):
    page = opened(joint_damper())
    before = page.locator("#over-velocity path").get_attribute("d")
    for _ in range(20):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.id") == "current":
            break
    page.keyboard.press("End")
    page.locator("#outside", has_text="current was tested 0–1 A").wait_for()
    assert page.locator("#over-velocity path").get_attribute("d") != before
    reached = set()
    for _ in range(12):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("document.activeElement.id || document.activeElement.tagName"))
    assert {"frequency", "amplitude", "file", "save", "SUMMARY"} <= reached


def test_a_slider_is_a_picture_within_a_thirtieth_of_a_second(opened, no_compiler):
    """Median over the compute and drawing of forty moves."""
    page = opened(joint_damper())
    assert (
        page.evaluate("performance.getEntriesByType('navigation')[0].domComplete") < 3000
    )  # a busy machine takes three
    spent = page.evaluate(
        """async () => {
            const slider = document.getElementById("current"), spent = [];
            for (let i = 0; i < 40; i++) {
                slider.value = i / 40;
                slider.dispatchEvent(new Event("input"));
                await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
                spent.push(Number(document.documentElement.dataset.ready));
            }
            return spent;
        }"""
    )
    assert np.median(spent) <= 33


def test_a_bare_model_and_a_condition_without_an_answer(opened, no_compiler):
    page = opened(model_type("bouc-wen").build({"c": 1e3, "alpha": 1e5, "beta": 1e6, "gamma": 1e6, "n": 2.0}))
    assert "A model that was not identified from tests." in page.locator("main").inner_text()
    page.locator("#frequency-number").fill("-1")
    page.locator("#outside", has_text="above zero").wait_for()
    page.locator("#frequency-number").fill("")
    page.locator("#outside", has_text="Give a number").wait_for()


needs_zig = pytest.mark.skipif(not importlib.util.find_spec("ziglang"), reason="ziglang is not installed")


@needs_zig
@pytest.mark.parametrize("name", ["bouc-wen, n = 1.6", "conditioned"])
def test_webassembly_agrees_and_imports_nothing(opened, name):
    page = opened(DAMPERS[name] if name == "conditioned" else _joint(DAMPERS[name]))
    assert re.search(r"Self-test passed: .* Computed in WebAssembly\.", page.locator("#test").inner_text())
    assert len(page.content()) <= 150_000


@needs_zig
@pytest.mark.parametrize(
    "before",
    [
        "delete globalThis.WebAssembly;",
        "WebAssembly.instantiate = () => Promise.reject(new WebAssembly.CompileError('blocked by policy'));",
    ],
)
def test_a_browser_that_forbids_webassembly_computes_in_javascript(opened, before):
    page = opened(joint_damper(), before=before)
    told = page.locator("#test").inner_text()
    assert "Self-test passed" in told
    assert "this browser forbids WebAssembly" in told


def test_without_a_compiler_the_note_says_what_to_install(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert "pip install ziglang" in PageExporter().export(joint_damper(), "damper").notes[0]


def _joint(model):
    return JointDamper(model, ("alpha",), rig="bench", envelope=joint_damper().envelope)


def test_a_damper_with_laws_of_the_current_alone_does_not_follow_the_motion(page_of, no_compiler):
    damper = modified_damper()
    functions = {**damper.functions, "yield_force": damper.functions["c"], "k1": damper.functions["f0"]}
    of_current = replace(damper, parameters=replace(damper.parameters, functions=functions))
    sentence = b"Its parameters are functions of the current."
    assert (sentence in page_of(damper), sentence in page_of(of_current)) == (False, True)
