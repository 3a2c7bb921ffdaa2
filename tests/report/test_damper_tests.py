"""The test report: a damper whose forces are known is read back, side by side, judged and printed."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from pypdf import PdfReader
from support.browser import LOGO
from typer.testing import CliRunner

from mrdamper.cli import application
from mrdamper.data import Condition, Dataset, Run, current_levels
from mrdamper.errors import IdentificationError
from mrdamper.identification.characteristics import characterise
from mrdamper.physics.motion import sine
from mrdamper.report.about import About, AboutError, about_of, load_about, load_limits, parse_ladder
from mrdamper.report.damper_tests import facts_of_tests
from mrdamper.report.page import render_page
from mrdamper.report.pdf import pdf_of
from mrdamper.rig_files.dataset_folder import save_dataset

GAS, COULOMB, REBOUND, COMPRESSION = 80.0, 120.0, 3000.0, 1500.0  # N, N, N s/m, N s/m


def made_run(current, frequency, amplitude=0.01, seed=0, scale=1.0):
    """A damper stiffer in rebound than in compression, with noise in force and current."""
    motion = sine(Condition(current, frequency, amplitude), 5.0, 200)
    rng = np.random.default_rng(seed)
    v = motion.velocity
    slope = np.where(v > 0, REBOUND, COMPRESSION)
    friction = (COULOMB + 600 * current) * np.tanh(v / 1e-3)
    force = scale * (GAS + slope * v + friction) + rng.normal(0, 0.5, v.size)
    noisy = current + rng.normal(0, 2e-3, v.size)
    return Run(f"{current:g}A_{frequency:g}Hz", motion.time, motion.displacement, force, noisy, rig="made")


@pytest.fixture(scope="module")
def dataset():
    runs = [made_run(i, f, seed=n) for n, (i, f) in enumerate((i, f) for i in (0.0, 0.5, 1.0) for f in (0.5, 1, 2, 3))]
    return Dataset(tuple(runs), "made damper")


@pytest.fixture(scope="module")
def folder(dataset, tmp_path_factory):
    place = tmp_path_factory.mktemp("specimens") / "made"
    save_dataset(dataset, place)
    return place


def invoke(*arguments):
    return CliRunner().invoke(application(), [str(a) for a in arguments])


def test_noisy_currents_fall_on_levels():
    assert current_levels([0.5003, -0.0004, 0.4991, 1.502, 0.0011, 1.498]) == [0.5, 0.0, 0.5, 1.5, 0.0, 1.5]


def test_sides_gas_force_and_friction_are_told_apart(dataset):
    found = characterise(dataset.runs)
    assert found.currents == (0.0, 0.5, 1.0)
    assert found.gas_force == pytest.approx(GAS, abs=15)
    for current in found.currents:
        for velocity in (0.05, 0.1, 0.15):
            for side, slope in ((0, REBOUND), (1, COMPRESSION)):
                sign = 1 if side == 0 else -1
                truth = slope * velocity + COULOMB + 600 * current + sign * (GAS - found.gas_force)
                assert found.at_velocity(current, velocity, side) == pytest.approx(truth, rel=0.02)


def test_a_difference_of_the_sides_that_grows_with_the_force_is_no_gas_force():
    motion = sine(Condition(0.0, 1.0, 0.01), 5.0, 200)

    def run(current, share, name):
        damping = (COULOMB + 600 * current) * np.tanh(motion.velocity / 1e-3) + 1000 * motion.velocity
        force = GAS + share * damping * np.where(damping > 0, 1.06, 0.94)
        return Run(name, motion.time, motion.displacement, force, current)

    runs = [run(current, 1.0, f"{current} A") for current in (0.0, 0.5, 1.0)]
    found = characterise(runs)
    assert found.gas_force == pytest.approx(GAS, abs=1)
    repeated = characterise([*runs, run(0.5, 1.1, "0.5 A, another day")])
    assert repeated.curve(0.5, 0)[1] == pytest.approx(1.05 * found.curve(0.5, 0)[1], rel=2e-3)  # mean of both days


def test_slow_tests_say_gas_force_and_friction():
    slow = [made_run(0.0, f) for f in (0.02, 0.05, 1.0)]
    found = characterise(slow)
    assert found.gas_force == pytest.approx(GAS, abs=4)
    assert found.friction == pytest.approx(COULOMB, rel=0.05)
    assert "slow" in found.gas_from
    assert "slow" in found.friction_from


def test_nothing_is_said_outside_the_tests(dataset):
    found = characterise(dataset.runs)
    assert np.isnan(found.at_velocity(1.0, 0.5, 0))
    assert all(0.03 < v < 0.19 for v in found.ladder())


def test_a_force_channel_that_was_dead_has_no_dynamic_range():
    dead = [replace(made_run(i, 1.0), force=np.zeros(1001)) for i in (0.0, 0.5)]
    facts = facts_of_tests({"made": characterise(dead)})
    assert np.isnan([row["dynamic_range"] for row in facts["currents"]]).all()


def test_without_a_cycle_nothing_is_characterised():
    time = np.linspace(0, 1, 200)
    run = Run("ramp", time, 0.01 * time, time, 0.0)
    with pytest.raises(IdentificationError, match="no run holds a steady cycle"):
        characterise([run])


def test_the_report_has_page_print_and_tables(folder, dataset, tmp_path):
    (tmp_path / "about.toml").write_text('title = "A <b>report</b>"\ncustomer = "ACME & sons"\ntemperature_C = 21\n')
    (tmp_path / "limits.toml").write_text(
        "".join(
            f'[[limit]]\ncurrent_A = {i}\nvelocity_m_s = {v}\nside = "rebound"\nlower_N = {low}\nupper_N = {high}\n'
            for i, v, low, high in ((0.5, 0.1, 600, 800), (0.5, 0.05, 0, 100), (0.5, 9.0, 0, 100))
        )
    )
    other = tmp_path / "worn"
    save_dataset(Dataset(tuple(made_run(i, f, scale=0.8) for i in (0.0, 1.0) for f in (1, 2)), "worn"), other)
    out = tmp_path / "report"
    options = ("--about", tmp_path / "about.toml", "--limits", tmp_path / "limits.toml", "--velocities", "0.1,0.05")
    done = invoke("report", folder, other, "--out", out, *options)
    assert done.exit_code == 0, done.output
    page = (out / "report.html").read_text()
    assert "A &lt;b&gt;report&lt;/b&gt;" in page
    assert "ACME &amp; sons" in page
    assert "21 °C" in page
    assert "datasets: made, 12 runs; worn, 4 runs" in page
    assert "fastest test of made at each current" in page  # whose loops these are
    assert "against the given limits: 1 passed, 1 failed, 4 not tested." in page
    for verdict in ("pass", "fail", "not tested"):
        assert f"<strong>{verdict}</strong>" in page
    rows = list(csv.DictReader(io.StringIO((out / "forces.csv").read_text())))
    assert {row["specimen"] for row in rows} == {"made", "worn"}
    assert {float(row["velocity_m_s"]) for row in rows} == {0.05, 0.1}
    new, worn = (
        sum(float(r["damping_force_N"]) for r in rows if r["specimen"] == name and r["current_A"] == "1.0"
            and r["velocity_m_s"] == "0.1")
        for name in ("made", "worn")
    )  # fmt: skip
    assert worn == pytest.approx(0.8 * new, rel=0.03)
    text = "\n".join(p.extract_text() for p in PdfReader(out / "report.pdf").pages)
    assert "A <b>report</b>" in text
    assert "Data and software" in text  # what the page folds stands open in print
    assert f"page 1 of {len(PdfReader(out / 'report.pdf').pages)}" in text
    assert b"CreationDate" not in (out / "report.pdf").read_bytes()  # the same tests, the same bytes
    for name in ("peak_velocity", "cycle", "energy"):
        assert (out / "figures" / f"{name}.csv").read_text().startswith("panel,x_is,y_is,series,x,y")
        assert (out / "figures" / f"{name}.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('titel = "x"', "did you mean title?"),
        ("title = [1]", "title: Input should be a valid string"),
        ("title = ", "correct the TOML"),
        ('logo = "absent.png"', "absent.png: No such file"),
        ('logo = "large.png"', "kB"),
        ('logo = "about.toml"', "neither PNG nor JPEG"),
        ('logo = "damaged.png"', "is damaged"),
    ],
)
def test_a_head_that_cannot_be_used_is_refused(tmp_path, text, said):
    (tmp_path / "damaged.png").write_bytes(LOGO[:40])
    (tmp_path / "large.png").write_bytes(b"\x89PNG" + bytes(20_000_000))
    (tmp_path / "about.toml").write_text(text)
    with pytest.raises(AboutError) as error:
        load_about(tmp_path / "about.toml")
    assert said in str(error.value)
    assert "E_ABOUT" in str(error.value)


GOOD = {"current_A": 1, "velocity_m_s": 0.1, "side": '"rebound"', "lower_N": 1, "upper_N": 2}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"lower_N": 3}, "lies above"),
        ({"side": '"up"'}, "'rebound' or 'compression'"),
        ({"upper_N": "true"}, "valid number"),
        ({"upper_N": "nan"}, "finite number"),
        ({"velocity_m_s": -1}, "greater than or equal to 0"),
        ({"velocity": 1}, "did you mean velocity_m_s?"),
    ],
)
def test_limits_that_cannot_hold_are_refused(tmp_path, change, said):
    entry = "\n".join(f"{name} = {value}" for name, value in {**GOOD, **change}.items())
    (tmp_path / "limits.toml").write_text(f"[[limit]]\n{entry}\n")
    with pytest.raises(AboutError, match="limit 1") as error:
        load_limits(tmp_path / "limits.toml")
    assert said in str(error.value)


def test_limits_that_exclude_each_other_are_named(tmp_path):
    first, second = ({**GOOD, "lower_N": low, "upper_N": high} for low, high in ((600, 800), (0, 100)))
    text = "".join("[[limit]]\n" + "".join(f"{k} = {v}\n" for k, v in one.items()) for one in (first, second))
    (tmp_path / "limits.toml").write_text(text)
    with pytest.raises(AboutError, match=r"no force meets limit 1 \(600 to 800 N\) and limit 2 \(0 to 100 N\)"):
        load_limits(tmp_path / "limits.toml")
    (tmp_path / "limits.toml").write_text(text.replace("upper_N = 100", "upper_N = 700"))
    assert len(load_limits(tmp_path / "limits.toml")) == 2


@pytest.mark.parametrize("customer", ["c" * 5_000, "Wort " * 1_000, "שלום עולם " * 20, "عميل الاختبار"])
def test_a_long_or_right_to_left_customer_stays_on_the_page_and_in_the_print(customer):
    empty = {"summary": "", "ladder": (), "forces": [], "currents": [], "verdicts": []}
    pictures = dict.fromkeys(("peak_velocity", "cycle", "energy"), b"<svg/>")
    facts = {"provenance": [], "lead": "", "t": empty, "pictures": pictures, "passed_over": {}}
    page = render_page("tests.html.j2", "Report", "footer", about=About(customer=customer), **facts)
    assert f'dir="auto">{customer.strip()}' in page
    printed = PdfReader(io.BytesIO(pdf_of(page, {})))
    text = "".join("".join(sheet.extract_text().split()) for sheet in printed.pages)
    if customer.isascii():
        assert "".join(customer.split()) in text
    else:
        assert len(text) > 20  # its letters, or the sentence that names the missing ones


def test_a_customer_of_more_letters_is_refused():
    with pytest.raises(AboutError, match="at most 5000 characters"):
        about_of({"customer": "c" * 5_001}, "about")


def test_a_ladder_is_positive_numbers():
    assert parse_ladder("0.2, 0.1 0.2") == (0.1, 0.2)
    for text in ("0.1,zero", "-1", "0", "inf", "nan"):
        with pytest.raises(AboutError):
            parse_ladder(text)


def test_two_dampers_in_one_folder_are_asked_about(bundled, tmp_path):
    save_dataset(bundled.only([run for run in bundled if run.current_A == 0][::4]), tmp_path / "two")
    done = invoke("report", tmp_path / "two", "--out", tmp_path / "out")
    assert isinstance(done.exception, IdentificationError)
    assert "FOLDER:RIG" in str(done.exception)
    assert not (tmp_path / "out").exists()


def test_a_clipped_test_is_named_and_decides_no_limit(dataset, tmp_path):
    """The force that the load cell cut off would pass where the damper fails."""
    clipped = made_run(0.5, 2.9, seed=99)
    top = 0.7 * float(np.max(clipped.force))
    clipped = replace(clipped, id="clipped", force=np.minimum(clipped.force, top))
    save_dataset(Dataset((*dataset.runs, clipped), "made damper"), tmp_path / "ds")
    (tmp_path / "limits.toml").write_text(
        f'[[limit]]\ncurrent_A = 0.5\nvelocity_m_s = 0.182\nside = "rebound"\nlower_N = 1\nupper_N = {top - GAS:.0f}\n'
    )
    done = invoke("report", tmp_path / "ds", "--limits", tmp_path / "limits.toml", "--out", tmp_path / "report")
    assert "not evaluated: clipped: a channel is cut off" in done.output
    page = (tmp_path / "report/report.html").read_text(encoding="utf-8")
    assert "Not evaluated: clipped (" in page
    assert "0 passed, 1 failed, 0 not tested" in page
