"""Names, units, scales and currents that a laboratory keeps in texts beside its files."""

from __future__ import annotations

import json

import numpy as np
import pytest

from mrdamper import import_files

T = np.arange(1001) / 200.0
X = 12.0 * np.sin(2 * np.pi * T)
V = np.gradient(X, T)
CURRENTS = {"m07": 0.2, "m08": 0.9, "m09": 0.0}


def force(amperes: float) -> np.ndarray:
    return (200 + 500 * amperes) * np.tanh(V / 5) + 2 * V + np.random.default_rng(3).normal(0, 1, T.size)


def write(folder, header: str, scale: tuple[float, float] = (1.0, 1.0)) -> None:
    for name, amperes in CURRENTS.items():
        rows = zip(T, X / scale[0], force(amperes) / scale[1], strict=True)
        (folder / f"{name}.csv").write_text(header + "".join(f"{t:.3f},{x:.7f},{f:.6f}\n" for t, x, f in rows))


def require_the_tests(folder) -> None:
    result = import_files([folder])
    assert not [str(refusal.error) for refusal in result.refusals]
    assert [float(np.mean(record.current)) for record in result.records] == pytest.approx(list(CURRENTS.values()))
    for record, amperes in zip(result.records, CURRENTS.values(), strict=True):
        np.testing.assert_allclose(record.displacement, 1e-3 * X, rtol=0, atol=1e-8)
        np.testing.assert_allclose(record.force, force(amperes), rtol=0, atol=1e-2)


def test_units_and_current_of_a_json_file_of_the_same_name(tmp_path):
    write(tmp_path, "zeit,hub,kraft\n")
    for name, amperes in CURRENTS.items():
        units = [{"name": n, "unit": u} for n, u in (("zeit", "s"), ("hub", "mm"), ("kraft", "N"))]
        says = {"operator": "lab 3", "coil current": {"value": 1000 * amperes, "unit": "mA"}}
        says["channels"] = {entry["name"]: entry for entry in units}
        (tmp_path / f"{name}.json").write_text(json.dumps(says))
    require_the_tests(tmp_path)


def test_units_and_currents_of_a_yaml_file_for_all_files(tmp_path):
    write(tmp_path, "time,stroke,load\n")
    runs = "".join(f"  - file: {name}.csv\n    current: {amperes}\n" for name, amperes in CURRENTS.items())
    text = "bench: 4\nunits: {time: s, stroke: mm, load: N, current: A}\nruns:\n" + runs
    (tmp_path / "campaign.yaml").write_text(text)
    require_the_tests(tmp_path)
    (tmp_path / "campaign.yaml").write_text(text.replace(", current: A", ""))  # 0.2 of what?
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_CURRENT_MISSING"}


def test_currents_of_a_table_in_a_readme_are_taken_and_those_of_names_compared_with_it(tmp_path):
    write(tmp_path, "time [s],stroke [mm],load [N]\n")
    table = "".join(f"| {name}.csv | {1000 * amperes:g} |\n" for name, amperes in CURRENTS.items())
    (tmp_path / "README.md").write_text("# Tests\n\n| file | coil current [mA] |\n|:---|---:|\n" + table)
    require_the_tests(tmp_path)
    for name in CURRENTS:
        (tmp_path / f"{name}.csv").rename(tmp_path / f"{name}_0.5A.csv")
    (tmp_path / "README.md").write_text((tmp_path / "README.md").read_text().replace(".csv", "_0.5A.csv"))
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_CURRENT_CONTRADICTS"}


def test_scales_of_numbered_channels_in_a_list_of_channels(tmp_path):
    write(tmp_path, "x-axis,1,2\nsecond,Volt,Volt\n", scale=(5.0, 400.0))
    (tmp_path / "channels.csv").write_text("ch,what,factor,unit\n1,stroke,5,mm/V\n2,load,400,N/V\n")
    (tmp_path / "tests.csv").write_text(
        "Measurement no.;I set point / mA;Remark\n" + "".join(f"{n[1:]};{1000 * i:g};\n" for n, i in CURRENTS.items())
    )
    require_the_tests(tmp_path)


def test_a_list_of_tests_without_anything_that_names_them_is_not_applied(tmp_path):
    write(tmp_path, "time [s],stroke [mm],load [N]\n")
    (tmp_path / "tests.csv").write_text("Remark;Current / A\nfirst;0.2\nsecond;0.9\nthird;0.0\n")
    assert {refusal.error.code for refusal in import_files([tmp_path]).refusals} == {"E_CURRENT_MISSING"}


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("README.md", "# Rig\nExtension counts negative: sign of the rig.\n"),
        ("setup.yaml", "rig: B\nsign convention: compression positive\n"),
    ],
)
def test_a_text_beside_the_files_states_the_signs_of_all(tmp_path, name, text):
    header = "time [s],disp [mm],load [N]\n"
    write(tmp_path, header, (-1.0, -1.0))
    (tmp_path / name).write_text(text)
    for own, amperes in CURRENTS.items():
        (tmp_path / f"{own}.csv").rename(tmp_path / f"{own}_{amperes}A.csv")
    require_the_tests(tmp_path)


@pytest.mark.parametrize(
    ("text", "codes"),
    [
        ("Alle Größen in SI-Einheiten.\n", []),
        ("Units: SI\n", []),
        ("SI units, except the stroke in mm\n", ["E_UNITS_MISSING"]),
        ("Si las unidades faltan, preguntar\n", ["E_UNITS_MISSING"]),
        ("All in SI units: mm and N\n", ["E_UNITS_MISSING"]),
    ],
)
def test_a_text_may_state_that_all_units_are_those_of_the_si(tmp_path, text, codes):
    (tmp_path / "README.txt").write_text(text, encoding="utf-8")
    rows = zip(T, 1e-3 * X, force(0.5), strict=True)
    (tmp_path / "a_0.5A.csv").write_text(
        "time,stroke,load\n" + "".join(f"{t:.3f},{x:.7f},{f:.4f}\n" for t, x, f in rows)
    )
    found = import_files([tmp_path])
    assert {refusal.error.code for refusal in found.refusals} == {*codes}
    assert [round(1e3 * np.ptp(record.displacement)) for record in found.records] == ([] if codes else [24])


def test_the_text_of_one_test_states_the_sign_of_no_other(tmp_path):
    write(tmp_path, "time [s],disp [mm],load [N]\n", (1.0, 1.0))
    for own, amperes in CURRENTS.items():
        (tmp_path / f"{own}.csv").rename(tmp_path / f"{own}_{amperes}A.csv")
    first, *others = sorted(tmp_path.glob("*.csv"))
    first.with_suffix(".json").write_text('{"sign convention": "compression positive"}')
    found = import_files([tmp_path])
    changed = {r.id: r.provenance.get("sign_changed", "") for r in found.records}
    assert changed[first.stem]
    assert not any(changed[other.stem] for other in others)


@pytest.mark.parametrize(
    "text",
    [
        "Start direction: compression, positive ramp\n",
        "The damper is pushed to the positive end stop before each test.\n",
    ],
)
def test_sentences_about_the_test_state_no_sign(tmp_path, text):
    write(tmp_path, "time [s],disp [mm],load [N]\n", (1.0, 1.0))
    (tmp_path / "README.txt").write_text(text)
    for own, amperes in CURRENTS.items():
        (tmp_path / f"{own}.csv").rename(tmp_path / f"{own}_{amperes}A.csv")
    require_the_tests(tmp_path)


def test_steps_of_a_procedure_are_no_tests(tmp_path):
    write(tmp_path, "time [s],disp [mm],load [N]\n", (1.0, 1.0))
    for number, path in enumerate(sorted(tmp_path.glob("*.csv")), 1):
        path.rename(tmp_path / f"rec_{number}.csv")
    (tmp_path / "procedure.txt").write_text("Step 1: warm up at 0.2 A\nStep 2: heat the coil at 0.8 A\n")
    found = import_files([tmp_path])
    assert not found.records
    assert {refusal.error.code for refusal in found.refusals} == {"E_CURRENT_MISSING"}
