"""Names of columns: what they are called, in which unit, and when that is not plain."""

import pytest

from mrdamper.rig_files.column_names import DIMENSION, headers_of, is_unit, parse_unit, role_of, split_name


@pytest.mark.parametrize(
    ("header", "name", "unit"),
    [
        ("force_N", "force", "N"),
        ("Force [kN]", "Force", "kN"),
        ("Axial Load (kN)", "Axial Load", "kN"),
        ("Axial Force(kN)", "Axial Force", "kN"),
        ("Kraft in kN", "Kraft", "kN"),
        ("Force, N", "Force", "N"),
        ("F/N", "F", "N"),
        ("Weg / mm", "Weg", "mm"),
        ("velocity_m_s", "velocity", "m_s"),
        ("v_mm/s", "v", "mm/s"),
        ("v m/s", "v", "m/s"),
        ("Accel (m/s^2)", "Accel", "m/s^2"),
        ("Temp [°C]", "Temp", "°C"),
        ("Weg [µm]", "Weg", "\u03bcm"),
        ("force_kn", "force", "kn"),
        ("current_ma", "current", "ma"),
        ("freq_hz", "freq", "hz"),
        ("Force (filtered)", "Force", ""),
        ("force", "force", ""),
        ("m/s", "m/s", ""),
        ("x" * 300 + " [N]", "x" * 300 + " [N]", ""),
    ],
)
def test_name_and_unit_of_a_header(header, name, unit):
    assert split_name(header) == (name, unit)


@pytest.mark.parametrize(
    ("names", "units"),
    [
        (("force_n", "coil_current_a"), ("N", "A")),
        (("channel_a", "load_a", "current_b"), ("", "", "")),
        (("coil_current_a", "coil_current_b"), ("", "")),
        (("force_n", "force_t", "current_ma"), ("", "", "ma")),
    ],
)
def test_a_small_letter_behind_a_name_is_its_unit_where_no_other_name_has_another(names, units):
    assert tuple(header.unit for header in headers_of(names, ("",) * len(names))) == units


def test_a_row_of_units_leaves_the_names_alone():
    assert split_name("Force_N", "kN") == ("Force_N", "kN")
    assert split_name("Force [kN]", "kN") == ("Force", "kN")


@pytest.mark.parametrize(
    ("name", "role"),
    [
        ("Time", "time"), ("Running Time", "time"), ("Zeit", "time"), ("t", "time"),
        ("Axial Displacement", "displacement"), ("AxialDisplacement", "displacement"), ("Déplacement", "displacement"),
        ("x", "displacement"), ("Axial Load", "force"), ("Kraft1", "force"), ("F", "force"), ("力", "force"),
        ("load displacement", "displacement"), ("v", "velocity"), ("I", "current"), ("Strom", "current"),
        ("U", "voltage"), ("T", "temperature"),
        ("Force command", None), ("displacement_setpoint", None), ("Axial Count", None), ("Sollwert Weg", None),
        ("pressure", "pressure"), ("", None), ("X", None),
    ],
)  # fmt: skip
def test_what_a_name_stands_for(name, role):
    assert role_of(name) == role


@pytest.mark.parametrize(
    ("text", "dimension", "factor"),
    [
        ("kN", "force", 1e3), ("lbf", "force", 4.4482216152605), ("daN", "force", 10), ("mm", "length", 1e-3),
        ("in", "length", 0.0254), ("µs", "time", 1e-6), ("Sec", "time", 1), ("min", "time", 60),
        ("m/s²", "acceleration", 1), ("m_s2", "acceleration", 1), ("mm/s", "velocity", 1e-3), ("m s-1", "velocity", 1),
        ("deg_C", "temperature", 1), ("degrees C", "temperature", 1), ("میلی\u200cمتر", "length", 1e-3),
        ("mA", "current", 1e-3), ("kilonewton", "force", 1e3), ("mile", "length", 1609.344),
    ],
)  # fmt: skip
def test_units_to_si(text, dimension, factor):
    unit = parse_unit(text)
    assert unit is not None
    assert unit.dimension == dimension
    # Fifteen digits: one rounding of the tabled factor.
    assert unit.factor == pytest.approx(factor, rel=1e-14)


def test_temperatures_are_shifted():
    kelvin, fahrenheit = parse_unit("K"), parse_unit("degF")
    assert kelvin is not None
    assert fahrenheit is not None
    assert 300 * kelvin.factor + kelvin.offset == pytest.approx(26.85)
    assert 212 * fahrenheit.factor + fahrenheit.offset == pytest.approx(100.0)


@pytest.mark.parametrize("text", ["", "blub", "9**9**9", "(" * 50, "kN kN", "__import__('os')", "m" * 10_000])
def test_what_is_no_unit_is_none_at_once(text):
    unit = parse_unit(text)
    assert unit is None or unit.dimension not in DIMENSION.values()
    assert not is_unit(text)
