"""The check says nothing of a sound FMU, and finds what is planted: nothing takes the caller down."""

import re
from subprocess import CompletedProcess
from unittest.mock import patch

import numpy as np
import pytest
from support.fmu_files import COMPILERS, DAMPERS, fmu_bytes, unpacked
from support.forked import forked

from mrdamper.errors import MissingExtraError
from mrdamper.exporters import fmu_check, fmu_probe, toolchain
from mrdamper.exporters.fmu import token_of, zipped
from mrdamper.exporters.fmu_check import check_fmu
from mrdamper.exporters.toolchain import build_library, here

FMIS = (2, 3)
pytest.importorskip("fmpy", reason="FMPy is not installed")
pytestmark = pytest.mark.skipif(not COMPILERS or not here(), reason="no C compiler or an unknown platform")


@pytest.fixture
def check_apart(tmp_path):
    """Codes of the errors found in changed files of an FMU, and the texts."""

    def run(files):
        path = tmp_path / "damper.fmu"
        path.write_bytes(files if isinstance(files, bytes) else zipped(files))
        findings = check_fmu(path)
        return {f.code for f in findings if f.level == "error"}, " | ".join(map(str, findings))

    return run


@pytest.fixture
def check(check_apart, monkeypatch):
    """The same, with the check's program in a fork of this process, which has loaded NumPy and FMPy."""

    def run(command, **_):
        return CompletedProcess(command, forked(fmu_probe.main, *command[3:]))

    monkeypatch.setattr(fmu_check.subprocess, "run", run)
    return check_apart


def binary_of(files):
    return next(path for path in files if path.startswith("binaries/"))


def rebuilt(files, change):
    """The FMU with a binary of sources that were changed, but with the texts as they were."""
    sources = {p.removeprefix("sources/"): t for p, t in files.items() if p.startswith("sources/")}
    name = next(n for n in sources if n.endswith((".c",)) and change(sources[n]) != sources[n])
    with patch.object(toolchain, "FLAGS", (*toolchain.FLAGS, "-O0")):  # compiled in a third of the time
        built = build_library({**sources, name: change(sources[name])}, here())
    assert built.library is not None, built.reason
    return {**files, binary_of(files): built.library}


def in_function(name, code):
    """A change that puts code at the beginning of an FMI function's body."""

    def change(text):
        return re.sub(rb"(\)\(%s\)|FMI\(%s\))(\([^;{]*\)\n)\{" % (name, name), rb"\1\2{\n" + code, text)

    return change


@pytest.mark.parametrize(
    ("name", "fmi"),
    [
        pytest.param(n, fmi, marks=() if (n, fmi) in (("joint", 2), ("modified", 3)) else pytest.mark.slow)
        for n in DAMPERS
        for fmi in FMIS
    ],
)
def test_a_sound_fmu_passes(check, name, fmi):
    assert check(fmu_bytes(name, fmi)) == (set(), "")


def test_one_of_sources_alone_is_compiled_to_be_checked(check_apart):
    codes, text = check_apart(fmu_bytes("joint", 3, compiled=False))
    assert not codes
    assert "its sources were compiled instead [N_FMU_PLATFORM]" in text


@pytest.mark.parametrize("fmi", FMIS)
def test_a_wrong_guid_is_caught(check, fmi):
    files = unpacked(fmu_bytes("joint", fmi))
    other = b"{00000000-1111-4222-8333-444444444444}"
    description = re.sub(rb'(guid|instantiationToken)="[^"]*"', rb'\1="' + other + b'"', files["modelDescription.xml"])
    codes, text = check({**files, "modelDescription.xml": description})
    assert codes == {"E_FMU_TOKEN"}
    assert "refuses the token of modelDescription.xml" in text
    assert "was not made from these texts" in text


def test_a_binary_that_takes_any_guid_is_caught(check):
    files = rebuilt(
        unpacked(fmu_bytes("joint", 3)), lambda text: text.replace(b"strcmp(token, ", b"0 * strcmp(token, ")
    )
    codes, text = check(files)
    assert codes == {"E_FMU_TOKEN"}
    assert "takes any token" in text


@pytest.mark.parametrize(("fmi", "symbol"), [(2, "DoStep"), (3, "SetString")])
def test_a_missing_symbol_is_caught(check, fmi, symbol):
    name = f"fmi{fmi}{symbol}".encode()
    files = rebuilt(
        unpacked(fmu_bytes("joint", fmi)), lambda text: text.replace(b"(" + name + b")", b"(gone" + name + b")")
    )
    codes, text = check(files)
    assert codes == {"E_FMU_SYMBOL"}
    assert f"lacks {name.decode()}" in text


@pytest.mark.parametrize("garbage", [b"", b"MZ" + bytes(4000)])
def test_a_garbage_binary_is_caught(check, garbage):
    files = unpacked(fmu_bytes("joint", 3))
    codes, text = check({**files, binary_of(files): garbage})
    assert codes == {"E_FMU_BINARY"}
    assert "cannot be loaded" in text


def test_a_binary_cut_short_is_caught(check_apart):
    files = unpacked(fmu_bytes("joint", 3))
    whole = files[binary_of(files)]
    codes, _ = check_apart({**files, binary_of(files): whole[: len(whole) // 2]})
    assert codes == {"E_FMU_BINARY"}


@pytest.mark.parametrize(("fmi", "function"), [(2, "DoStep"), (3, "FreeInstance")])
def test_a_binary_that_crashes_takes_nobody_along(check_apart, fmi, function):
    crash = in_function(f"fmi{fmi}{function}".encode(), b"    *(volatile int *)0 = 1;\n")
    codes, text = check_apart(rebuilt(unpacked(fmu_bytes("joint", fmi)), crash))
    assert codes == {"E_FMU_BINARY"}
    assert "crashed (signal 11)" in text


def test_a_binary_that_hangs_is_given_up(check_apart, monkeypatch):
    monkeypatch.setattr(fmu_check, "_CHECK_TIMEOUT_S", 1)
    hang = in_function(b"fmi3DoStep", b"    for (;;) { if (time < -1.0) { break; } }\n")
    codes, text = check_apart(rebuilt(unpacked(fmu_bytes("joint", 3)), hang))
    assert codes == {"E_FMU_BINARY"}
    assert "did not answer within 1 s" in text


def test_a_binary_of_another_damper_is_caught(check):
    """One parameter differs by a part in a million, the token is right."""
    files = unpacked(fmu_bytes("joint", 3))
    codes, text = check(rebuilt(files, lambda text: text.replace(b"R(600.0)", b"R(600.0006)")))
    assert codes == {"E_FMU_REFERENCE"}
    assert "differs from the reference by" in text


@pytest.mark.parametrize("which", ["in", "out"])
def test_a_changed_reference_is_caught_even_with_a_new_token(check, which):
    files = unpacked(fmu_bytes("joint", 3))
    path = f"resources/reference_{which}.csv"
    rows = files[path].decode().splitlines()
    cells = rows[100].split(",")
    cells[1] = repr(float(cells[1]) * (1 + 1e-4))
    rows[100] = ",".join(cells)
    changed = {**files, path: "\n".join([*rows, ""]).encode()}
    codes, _ = check(changed)
    assert codes == {"E_FMU_TOKEN", "E_FMU_REFERENCE"}
    old = re.search(rb'instantiationToken="([^"]*)"', files["modelDescription.xml"])[1]
    texts = {p: t.replace(old, b"") for p, t in changed.items() if not p.startswith("binaries/")}
    new = token_of(texts).encode()
    forged = {p: t.replace(old, new) for p, t in changed.items()}
    assert check(forged)[0] == {"E_FMU_REFERENCE"}


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (None, "cannot be read"),
        (b"time,force\n0,1\n", "do not fit"),
        (b"time,force\n0,x\n", "cannot be read"),
    ],
)
def test_a_reference_that_is_none_is_caught(check, content, found):
    files = unpacked(fmu_bytes("joint", 3))
    del files["resources/reference_out.csv"]
    codes, text = check(files if content is None else {**files, "resources/reference_out.csv": content})
    assert "E_FMU_REFERENCE" in codes
    assert found in text


def test_a_changed_source_is_caught(check):
    files = unpacked(fmu_bytes("joint", 2))
    source = files["sources/damper.c"]
    codes, _ = check({**files, "sources/damper.c": source.replace(b"R(600.0)", b"R(601.0)")})
    assert codes == {"E_FMU_TOKEN"}


@pytest.mark.parametrize(
    ("change", "code", "found"),
    [
        ((b'name="velocity"', b'name="current"'), "E_FMU_SCHEMA", '"current" (line'),
        ((b'valueReference="2"', b'valueReference="1"'), "E_FMU_SCHEMA", "same value reference"),
        ((b'valueReference="2"', b'valueReference="-2"'), "E_FMU_SCHEMA", "-2"),
        ((b'unit="N s/m"', b'unit="N s/mm"'), "E_FMU_SCHEMA", 'unit "N s/mm"'),
        ((b'name="force"', b'name="power"'), "E_FMU_DESCRIPTION", "force"),
    ],
)
def test_a_description_that_contradicts_itself_is_caught(check, change, code, found):
    files = unpacked(fmu_bytes("joint", 3))
    codes, text = check({**files, "modelDescription.xml": files["modelDescription.xml"].replace(*change)})
    assert codes >= {code, "E_FMU_TOKEN"}
    assert found in text


def test_a_source_that_is_missing_is_caught(check):
    files = unpacked(fmu_bytes("joint", 2))
    del files["sources/damper.c"]
    assert check(files)[0] == {"E_FMU_TOKEN"}


def test_without_fmpy_the_check_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setattr(fmu_check.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match="fmu"):
        check_fmu(tmp_path / "damper.fmu")


@pytest.mark.parametrize(
    ("files", "code"),
    [
        (b"no zip at all", "E_FMU_ARCHIVE"),
        ({"a": b"b"}, "E_FMU_DESCRIPTION"),
        ({"../../a": b"b"}, "E_FMU_ARCHIVE"),
        ({"modelDescription.xml": b"<fmiModelDescription"}, "E_FMU_DESCRIPTION"),
        ({"modelDescription.xml": b'<fmiModelDescription fmiVersion="1.0"/>'}, "E_FMU_DESCRIPTION"),
    ],
)
def test_what_is_no_fmu_is_said_to_be_none(check, files, code):
    assert code in check(files)[0]


def test_any_changed_byte_of_the_archive_is_noticed_and_none_takes_us_down(tmp_path):
    """Names, sizes, checksums, packed texts: where a byte changes nothing it is no part of a file."""
    whole = fmu_bytes("joint", 2, compiled=False)
    path = tmp_path / "damper.fmu"
    rng = np.random.default_rng(5)
    sound = dict(unpacked(whole))
    for at in rng.integers(0, len(whole), 60).tolist():
        content = bytearray(whole)
        content[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(content)
        try:
            same = unpacked(bytes(content)) == sound
        except Exception:  # any: zipfile's own for damaged archives
            same = False
        if not same:
            assert any(f.level == "error" for f in check_fmu(path)), at


def test_an_archive_cut_short_or_missing(check, tmp_path):
    assert check(fmu_bytes("joint", 3)[:-2000])[0] == {"E_FMU_ARCHIVE"}
    assert [f.code for f in check_fmu(tmp_path / "gone.fmu")] == ["E_FMU_ARCHIVE"]


@pytest.mark.parametrize(
    ("before", "after", "code", "found"),
    [
        (b"if (!isfinite(value)) {", b"if (0) {", "E_FMU_REFUSAL", "lets pass: input nan"),
        (b"if (!(step > 0.0)) {", b"if (step == 0.0) { return 0; } if (0) {", "E_FMU_REFUSAL", "lets pass: step 0.0"),
        (b"bytes = put(bytes, s->last.displacement);", b"bytes = put(bytes, 0.0);", "E_FMU_STATE", "carried"),
        (
            b"bytes = put(bytes, s->set.current);",
            b"bytes = put(bytes, NAN);",
            "E_FMU_STATE",
            "cannot be carried",
        ),
    ],
    ids=["NaN", "a step of zero", "forgotten memory", "state it refuses itself"],
)
def test_refusals_and_states_are_tried(check, before, after, code, found):
    codes, text = check(rebuilt(unpacked(fmu_bytes("joint", 3)), lambda text: text.replace(before, after)))
    assert codes == {code}
    assert found in text


def test_fmpys_validation_alone_does_not_look_at_the_binary(check, tmp_path):
    """Why there is a check of our own."""
    validation = pytest.importorskip("fmpy.validation", reason="FMPy is not installed")
    files = unpacked(fmu_bytes("joint", 3))
    path = tmp_path / "garbage.fmu"
    path.write_bytes(zipped({**files, binary_of(files): b"garbage"}))
    assert validation.validate_fmu(str(path)) == []
    assert [f.code for f in check_fmu(path)] == ["E_FMU_BINARY"]
