"""The binary without any FMI library: a C program opens it, through many lives, under sanitizers."""

import shutil
import subprocess

import numpy as np
import pytest
from support.fmu_files import COMPILERS, DAMPERS, FEW, drive, driver, fmu_bytes, library, unpacked

from mrdamper.dampers.streaming import stepper, stream
from mrdamper.exporters.fmu import FMUExporter, reference
from mrdamper.exporters.toolchain import PLATFORMS, compiler_for

pytestmark = pytest.mark.skipif(not COMPILERS, reason="no C compiler on this machine")
FMIS = (2, 3)
SANITIZED = ("-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")


@pytest.fixture(scope="session")
def plain(tmp_path_factory):
    return driver(tmp_path_factory.mktemp("driver"), COMPILERS[0], "-O1")


def motion(name, count=300):
    known = reference(stream(DAMPERS[name]))
    rows = np.column_stack([known.displacement, known.velocity, known.current])[:count]
    return [tuple(row) for row in rows.tolist()], known.internal_step


def binary(content, folder):
    """The FMU's own binary, unpacked."""
    path = folder / "damper.so"
    path.write_bytes(next(text for name, text in unpacked(content).items() if name.startswith("binaries/")))
    return path


def walk(name, rows, step, drive_number, count):
    """Forces of the stepper after each row, in equal internal steps from row to row."""
    steps, last, found = stepper(DAMPERS[name]), rows[0], []
    speed, dt = None, step / count
    for row in rows:
        for k in range(1, count + 1):
            x, v, current = row if k == count else (a + (b - a) * (k / count) for a, b in zip(last, row, strict=True))
            acceleration = 0.0 if speed is None else (v - speed) / dt
            force = {
                1: lambda x=x, i=current: steps.step(x, i, dt),
                2: lambda v=v, i=current: steps.step_velocity(v, i, dt),
                3: lambda x=x, v=v, a=acceleration, i=current: steps.step_motion(x, v, a, i, dt),
            }[drive_number]()
            speed = v
        last = row
        found.append(force)
    return found


def forces(name, rows, step, drive_number, count):
    """What the FMU has to say: the look before the first step, then the walk."""
    return [*walk(name, rows[:1], step / count, drive_number, 1), *walk(name, rows, step, drive_number, count)]


@pytest.mark.parametrize("fmi", FMIS)
@pytest.mark.parametrize("drive_number", [1, 2, 3])
@pytest.mark.parametrize("name", FEW)
@pytest.mark.parametrize("internal", [1, 4])
def test_every_drive_equals_the_stepper_to_the_last_bit(plain, tmp_path, fmi, drive_number, name, internal):
    content = fmu_bytes(name, fmi)
    path = binary(content, tmp_path)
    rows, step = motion(name)
    step *= internal
    found = drive(plain, path, fmi, content, step, "run", drive_number, rows)
    assert [float(f) for f in found] == forces(name, rows, step, drive_number, internal)


@pytest.mark.parametrize("fmi", FMIS)
@pytest.mark.parametrize("name", FEW)
def test_many_lives_two_at_a_time(plain, tmp_path, fmi, name):
    content = fmu_bytes(name, fmi)
    rows, step = motion(name, 10)
    found = drive(plain, binary(content, tmp_path), fmi, content, step, "cycle", 1, rows)
    assert found == ["1000", "cycles"]


@pytest.mark.parametrize("fmi", [pytest.param(2, marks=pytest.mark.slow), 3])
@pytest.mark.parametrize("name", ["joint", *(pytest.param(n, marks=pytest.mark.slow) for n in DAMPERS if n != "joint")])
def test_many_lives_under_sanitizers(tmp_path, fmi, name):
    """No read or write out of place, no leak, nothing undefined in 1,000 lives."""
    content = fmu_bytes(name, fmi, compiled=False)
    path = library(content, tmp_path, COMPILERS[0], *SANITIZED)
    program = driver(tmp_path, COMPILERS[0], *SANITIZED)
    rows, step = motion(name, 10)
    assert drive(program, path, fmi, content, step, "cycle", 1, rows) == ["1000", "cycles"]


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("valgrind"), reason="valgrind is not installed")
@pytest.mark.parametrize("fmi", FMIS)
@pytest.mark.parametrize("name", FEW)
def test_many_lives_under_valgrind(plain, tmp_path, fmi, name):
    content = fmu_bytes(name, fmi)
    rows, step = motion(name, 10)
    watch = ("valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full", "--track-origins=yes")
    found = drive(plain, binary(content, tmp_path), fmi, content, step, "cycle", 1, rows, before=watch)
    assert found == ["1000", "cycles"]


EMULATORS = {
    "x86_64-windows": (shutil.which("wine64") or shutil.which("wine64", path="/usr/lib/wine"),),
    "aarch64-linux": (shutil.which("qemu-aarch64"), "-L", "/usr/aarch64-linux-gnu"),
}


@pytest.mark.slow
@pytest.mark.parametrize("platform", [p for p in PLATFORMS if p.name in EMULATORS], ids=lambda p: p.name)
@pytest.mark.parametrize("name", ["joint", "modified", "lugre"])
def test_binaries_of_other_platforms_run_in_an_emulator(tmp_path, monkeypatch, platform, name):
    pytest.importorskip("ziglang", reason="ziglang is not installed")
    emulator = EMULATORS[platform.name]
    if not emulator[0]:
        pytest.skip(f"no emulator for {platform.name}: install wine64 or qemu-user with libc6-arm64-cross")
    monkeypatch.setenv("WINEPREFIX", str(tmp_path / "wine"))
    monkeypatch.setenv("WINEDEBUG", "-all")
    monkeypatch.chdir(tmp_path)
    known = reference(stream(DAMPERS[name]))
    rows = [*zip(*(c[:-1].tolist() for c in (known.displacement, known.velocity, known.current)), strict=True)]
    content = FMUExporter(3, (platform.name,)).export(DAMPERS[name], "damper").files["damper.fmu"]
    path = f"./{binary(content, tmp_path).name}"
    ending = ".exe" if platform.suffix == ".dll" else ""
    program = driver(tmp_path, *compiler_for(platform), name=f"driver{ending}")
    found = drive(program, path, 3, content, known.step, "run", 1, rows, before=emulator)
    # Another C library rounds exp and tanh otherwise; a stepped state passes that on from step to step.
    np.testing.assert_allclose([float(f) for f in found], known.force, rtol=0, atol=1e-9 * np.abs(known.force).max())
    assert drive(program, path, 3, content, known.step, "cycle", 1, rows[:10], before=emulator)[0] == "1000"


@pytest.mark.parametrize(("fmi", "compiler"), [*zip(FMIS, COMPILERS, strict=False)])
def test_sources_compile_without_a_warning(tmp_path, fmi, compiler):
    library(fmu_bytes("modified", fmi, compiled=False), tmp_path, compiler, "-O2")


@pytest.mark.slow
@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("fmi", FMIS)
@pytest.mark.parametrize("name", DAMPERS)
def test_all_sources_compile_without_a_warning(tmp_path, fmi, compiler, name):
    library(fmu_bytes(name, fmi, compiled=False), tmp_path, compiler, "-O2")


def test_names_of_two_fmus_do_not_meet_when_linked_into_one_program(tmp_path):
    """Source code FMUs carry their name in front of every function."""
    content = fmu_bytes("joint", 3, compiled=False)
    path = library(content, tmp_path, COMPILERS[0], "-DFMI3_FUNCTION_PREFIX=damper_")
    symbols = subprocess.run(["nm", "-D", "--defined-only", path], capture_output=True, text=True, check=True).stdout
    names = [line.split()[-1] for line in symbols.splitlines()]
    assert len(names) > 90
    assert all(name.startswith("damper_") for name in names)
