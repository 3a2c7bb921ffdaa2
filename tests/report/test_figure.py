"""Layout of figures: what is drawn lies where its numbers say, and every file shows the same."""

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from mrdamper.report.plots.comparison import ranking
from mrdamper.report.plots.drawing import DrawnText
from mrdamper.report.plots.figure import Axis, Figure
from mrdamper.report.plots.style import current_colours, picture_of


@pytest.fixture
def figure():
    figure = Figure(1, 2, 3.0)
    left, right = figure.axes
    left.plot([0.0, 10.0], [-1.0, 1.0], label="a <b> & c", color="#123456")
    left.line("x", 0.0)
    left.label("Current (A)", "Force (N)", "one")
    left.legend()
    right.plot([1.0, np.nan, 3.0, 4.0], [1.0, 5.0, 100.0, 1000.0], "o", ls="--", ms=4, mfc="none")
    right.y.log = True
    return figure


def test_points_lie_in_proportion_to_their_numbers(figure):
    axes = figure.axes[0]
    (curve,) = [p for p in figure.drawn().parts if getattr(getattr(p, "look", None), "color", "") == "#123456"][:1]
    (x0, y0), (x1, y1) = curve.points
    assert x1 - x0 == pytest.approx(axes.width / 1.1)  # a margin of a twentieth on either side
    assert y0 - y1 == pytest.approx(axes.height / 1.1)
    assert (y0 + y1) / 2 == pytest.approx(axes.top + axes.height / 2)


def test_an_svg_is_well_formed_escaped_and_the_same_each_time(figure):
    picture = picture_of(figure)
    root = ElementTree.fromstring(picture["svg"])
    texts = ["".join(e.itertext()) for e in root.iter() if e.tag.endswith("text")]
    assert {"(a) one", "(b)", "a <b> & c", "Current (A)", "Force (N)", "1000"} <= set(texts)
    assert picture["svg"] == picture_of(figure)["svg"]
    assert "nan" not in picture["svg"].decode()
    assert b",a <b> & c,10.0,1.0\n" in picture["csv"]


def test_a_gap_in_a_curve_is_a_gap_on_paper(figure):
    (dashed,) = re.findall(r'd="([^"]*)" fill="none"[^>]*stroke-dasharray', picture_of(figure)["svg"].decode())
    assert dashed.count("M") == 2


@pytest.mark.parametrize(("kind", "begin"), [("pdf", b"%PDF"), ("png", b"\x89PNG")])
def test_a_figure_is_printed_the_same_each_time(figure, kind, begin):
    printed = figure.drawn().file(kind)
    assert printed.startswith(begin)
    assert printed == figure.drawn().file(kind)


@pytest.mark.parametrize("low", [-7.3, 0.0, 1e-4])
@pytest.mark.parametrize("width", [1e-6, 0.11, 1.0, 37.0, 9e7])
def test_ticks_are_even_inside_the_ends_and_tell_their_places(low, width):
    axis = Axis()
    axis.most = 5
    places, texts = axis.ticks((low, low + width))
    assert 2 <= len(places) <= 6
    assert np.ptp(np.diff(places)) < 1e-6 * width
    assert places[0] >= low - 1e-6 * width
    assert places[-1] <= low + 1.000001 * width
    assert [float(text.replace("−", "-")) for text in texts] == pytest.approx(places, abs=1e-6 * width)


def test_ticks_are_fewer_where_their_texts_would_touch():
    axis = Axis()
    axis.most = 6
    assert len(axis.ticks((-0.1, 0.1), 8.0)[0]) < len(axis.ticks((-0.1, 0.1))[0])


def test_the_name_of_an_axis_is_clear_of_its_numbers_in_a_wide_type():
    axes = Figure(1, 1, 2.0).axes[0]
    axes.plot([0.0, 1.0], [-200.0, 0.0])
    axes.label("", "m (kg)")
    texts = [part for part in axes.drawn("", (500.0, 150.0)) if isinstance(part, DrawnText)]
    name = next(text for text in texts if text.turned)
    number = next(text for text in texts if text.text == "−200")
    wide = (0.84 + 3 * 0.64) * number.size  # the minus and the digits of DejaVu Sans
    assert number.x - wide - name.x > 0.35 * name.size  # its letters descend by a quarter


def test_a_logarithmic_axis_has_ticks_at_powers_of_ten_and_between_few_of_them():
    axis = Axis()
    axis.log = True
    assert axis.ticks((0.9, 30.0))[1] == ["1", "2", "5", "10", "20"]
    assert axis.ticks((1e-6, 1.0))[1][0] == "10⁻⁶"
    assert axis.ticks((9e5, 6e6))[1] == ["10⁶", "2·10⁶", "5·10⁶"]
    assert axis.share([1.0, 10.0, 100.0], (1.0, 100.0)) == pytest.approx([0, 0.5, 1])
    axis.most = 6
    assert axis.ticks((0.85, 1.8))[1] == ["1.0", "1.2", "1.4", "1.6", "1.8"]  # one power of ten is no scale
    assert len(axis.ticks((2.1, 19.0))[0]) >= 3
    assert axis.ticks((0.19, 79.0))[1] == ["0.2", "0.5", "1", "2", "5", "10", "20", "50"]


@pytest.mark.parametrize("amplitudes", [(12.0, 12.0), (11.99, 12.01)])
def test_marks_are_clear_of_the_frame_where_one_end_of_the_axis_is_given(amplitudes):
    axis = Axis()
    axis.low = 0.0
    low, high = axis.limits([np.array(amplitudes)])
    assert low == 0.0
    assert high > 12.5
    axis.low, axis.high = None, 12.0
    assert axis.limits([np.array([0.0, 6.0])]) == (pytest.approx(-0.6), 12.0)


def test_a_ranking_without_validation_runs_does_not_list_them():
    texts = {getattr(part, "text", "") for part in ranking({"one": (0.1, 0.2, np.nan)}).drawn().parts}
    assert "cross-validation" in texts
    assert "validation" not in texts


def test_colours_rise_in_brightness_with_their_value():
    colours = current_colours([0.5, 0.0, 1.0, 0.25])
    bright = [
        sum(w * int(colours[v][i : i + 2], 16) for w, i in ((0.3, 1), (0.59, 3), (0.11, 5))) for v in sorted(colours)
    ]
    assert bright == sorted(bright)
