"""XML and HTML: elements with samples, workbooks of Excel 2003, tables saved as .xls, and hostile documents."""

import numpy as np
import pytest

from mrdamper.errors import InputError
from mrdamper.rig_files.rig_import import import_files, read_run
from mrdamper.rig_files.text.elements import numbers_in

T = np.arange(0, 6, 0.005)
X = 0.01 * np.sin(2 * np.pi * T)
V = np.gradient(X, T)
F = 650 * np.tanh(V / 0.01) + 900 * V
ROWS = list(zip(T, 1e3 * X, F / 1e3, strict=True))
COIL = '<CoilCurrent unit="A">0.5</CoilCurrent>'
PARAMETERS = '<Parameter name="Strom" unit="A">0.5</Parameter><Parameter name="Temperatur" unit="°C">24</Parameter>'
EXCEL = "urn:schemas-microsoft-com:office:spreadsheet"


def _records():
    samples = "".join(f'<S t_s="{t:.3f}" disp_mm="{x:.5f}" force_kN="{f:.6f}"/>\n' for t, x, f in ROWS)
    return f'<?xml version="1.0"?><Test xmlns="urn:a"><Info current_A="0.5"/><Samples>{samples}</Samples></Test>'


def _channels():
    lists = (("Time", "s", T), ("Displacement", "mm", 1e3 * X), ("Force", "kN", F / 1e3))
    channels = "".join(
        f"<Channel><Name>{name}</Name><Unit>{unit}</Unit><Values>{' '.join(f'{v:.7g}' for v in values)}</Values>"
        "</Channel>"
        for name, unit, values in lists
    )
    return f"<Test>{COIL}{channels}</Test>"


def _elements():
    samples = "".join(
        f"<R><Time_s>{t:.3f}</Time_s><Pos_mm>{x:.5f}</Pos_mm><Load_kN>{f:.6f}</Load_kN></R>" for t, x, f in ROWS
    )
    return f"<!-- a comment --><Data><Current_A>0.5</Current_A>{samples}</Data>"


def _with_attributes():
    lists = (("Time", "s", T), ("Pos", "mm", 1e3 * X), ("Load", "kN", F / 1e3))
    channels = "".join(f"<{n} unit='{u}'>{';'.join(f'{v:.7f}' for v in values)}</{n}>" for n, u, values in lists)
    return f"<Test><CoilCurrent unit='A'>0.5</CoilCurrent>{channels}</Test>"


def _elements_with_units():
    samples = "".join(
        f'<R><Time unit="s">{t:.3f}</Time><Pos unit="mm">{x:.5f}</Pos><Load unit="kN">{f:.6f}</Load></R>'
        for t, x, f in ROWS
    )
    return f'<Data><Current unit="A">0.5</Current>{samples}</Data>'


def _workbook():
    def row(cells, kind):
        return "".join(f'<Cell ss:Index="{i}"><Data ss:Type="{kind}">{c}</Data></Cell>' for i, c in enumerate(cells, 2))

    head = row(("Time [s]", "Displacement [mm]", "Force [kN]"), "String")
    body = "".join(f"<Row>{row((f'{t:.3f}', f'{x:.5f}', f'{f:.6f}'), 'Number')}</Row>" for t, x, f in ROWS)
    note = row(("Coil current", 0.5, "A"), "String")
    sheet = f'<Worksheet ss:Name="A"><Table><Row>{note}</Row><Row ss:Index="4">{head}</Row>{body}</Table></Worksheet>'
    return f'<?xml version="1.0"?><Workbook xmlns="{EXCEL}" xmlns:ss="{EXCEL}">{sheet}</Workbook>'


def _page():
    body = "".join(f"<tr><td>{t:.3f}<td>{x:.5f}</td><td>{f:.6f}</td></tr>\n" for t, x, f in ROWS)
    head = (
        "<tr><td colspan=3>Coil current: 0.5 A</td></tr><tr><th>Time [s]<th>Displacement [mm]</th><th>Force [kN]</tr>"
    )
    return f"<html><body><p>Test</p><table>{head}{body}</table></body></html>"


@pytest.mark.parametrize(
    ("name", "text", "encoding"),
    [
        ("records.xml", _records(), "utf-8"), ("channels.xml", _channels(), "utf-8"),
        ("channels16.xml", '<?xml version="1.0" encoding="UTF-16"?>' + _channels(), "utf-16"),
        ("attributes.xml", _with_attributes(), "utf-8"), ("units.xml", _elements_with_units(), "utf-8"),
        ("decimal_commas.xml", _with_attributes().replace(".", ",").replace("0,5<", "0.5<"), "utf-8"),
        ("parameters.xml", _channels().replace(COIL, PARAMETERS), "utf-8"),
        ("elements.xml", _elements(), "utf-8"), ("workbook.xls", _workbook(), "utf-8"), ("page.xls", _page(), "utf-8"),
    ],
)  # fmt: skip
def test_samples_units_and_current_of_a_document(tmp_path, name, text, encoding):
    (tmp_path / name).write_text(text, encoding=encoding)
    record = read_run(tmp_path / name)
    assert np.allclose(record.time, T)
    assert np.allclose(record.displacement, X, atol=1e-8)
    assert np.allclose(record.force, F, atol=1e-3)
    assert record.current == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ('<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>', "E_UNSAFE"),
        ("<a>" * 10**5 + "</a>" * 10**5, "E_FORMAT"),
        ("<a>" * 10**5, "E_TRUNCATED"),
        (_records()[:-20], "E_FORMAT"),
        ('<?xml version="1.0" encoding="klingon"?><a/>', "E_FORMAT"),
        (_workbook().replace('ss:Index="4"', 'ss:Index="nan"'), "E_FORMAT"),
        ("<html><body>no table</body></html>", "E_FORMAT"),
        ("<setup><low>1</low></setup>", "E_FORMAT"),
        ("<a>" + "1e999 " * 20 + "</a>", "E_FORMAT"),
    ],
)
def test_hostile_documents_are_refused_by_name(tmp_path, text, code):
    (tmp_path / "a.xml").write_text(text)
    with pytest.raises(InputError, match=r"a\.xml") as refused:
        read_run(tmp_path / "a.xml")
    assert refused.value.code == code


def test_commas_that_may_be_of_decimals_or_between_numbers_and_underscores_are_in_no_number():
    pairs = " ".join(["1,5", "2,5"] * 50)
    assert numbers_in(pairs) == pairs
    assert numbers_in("0_5") == "0_5"
    np.testing.assert_array_equal(numbers_in(", ".join(map(str, range(60)))), np.arange(60))
    np.testing.assert_array_equal(numbers_in("0.5,1.5;" * 29 + "0.5,1.5"), [0.5, 1.5] * 30)


def test_a_document_without_samples_beside_tests_is_no_test(tmp_path):
    (tmp_path / "a.xml").write_text(_records())
    (tmp_path / "setup.xml").write_text("<setup><limits><low>1</low></limits></setup>")
    result = import_files(tmp_path)
    assert (len(result.records), len(result.refusals), result.left_out) == (1, 0, ("setup.xml",))
