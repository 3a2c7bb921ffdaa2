"""The exported C computes what the stream computes, bit for bit, and says no where it must."""

import re
import shutil
import subprocess

import numpy as np
import pytest
from export.c_bench import COMPILERS, STRICT, build, run
from support.dampers import ENVELOPE, all_dampers, joint_damper

from mrdamper.dampers.streaming import stepper
from mrdamper.data import Condition
from mrdamper.errors import InputError
from mrdamper.exporters import all_exporters, exporter
from mrdamper.exporters.base import identifier
from mrdamper.exporters.c import CExporter
from mrdamper.physics.motion import sine

DAMPERS = all_dampers()
# Of each kind of generated code one: without memory, hysteresis, inner equations, functions of the condition.
KINDS = ("bingham", "bouc-wen", "spencer", "play-bypass", "joint", "modified", "conditioned")
needs_compiler = pytest.mark.skipif(not COMPILERS, reason="no C compiler on this machine")
pytestmark = needs_compiler


def many_conditions(conditions, steps, seed=3):
    """(N, 6) rows: sines at random conditions inside the tests, with noise on every channel."""
    rng = np.random.default_rng(seed)
    rows = []
    for _ in range(conditions):
        condition = Condition(*(float(rng.uniform(*r)) for r in (ENVELOPE.current_A, (0.5, 4.0), (0.004, 0.02))))
        motion = sine(condition, 4, steps // 4)
        block = np.zeros((steps, 6))
        for column, channel in enumerate((motion.displacement, motion.velocity, motion.acceleration, motion.current)):
            size = 1e-3 * max(float(np.abs(channel).max()), 1e-3)
            block[:, column] = channel[:steps] + size * rng.standard_normal(steps)
        block[:, 4], block[0, 5] = motion.time[1], 1.0
        rows.append(block)
    return np.concatenate(rows)


def expected(damper, rows):
    stream = stepper(damper)
    force = []
    for *sample, new in rows.tolist():
        if new:
            stream.reset()
        force.append(stream.step_motion(*sample))
    return np.array(force)


@pytest.mark.parametrize(
    ("name", "conditions", "steps"),
    [*((name, 4, 1000) for name in KINDS), *(pytest.param(name, 8, 4000, marks=pytest.mark.slow) for name in DAMPERS)],
)
def test_c_equals_python_to_the_last_bit(name, conditions, steps, tmp_path):
    rows = many_conditions(conditions, steps)
    force = expected(DAMPERS[name], rows)
    strict = run(build(DAMPERS[name], tmp_path, COMPILERS[0], "-O2", "-ffp-contract=off"), rows)
    assert np.all(strict[:, 1] == 0)
    assert np.array_equal(strict[:, 0], force)


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize(
    "name", ["kwok", "joint", *(pytest.param(n, marks=pytest.mark.slow) for n in ("bouc-wen, gamma apart", "modified"))]
)
def test_optimised_c_stays_within_rounding(name, compiler, tmp_path):
    rows = many_conditions(20, 4000, 5)
    fast = run(build(DAMPERS[name], tmp_path, compiler, "-O3"), rows)[:, 0]
    force = expected(DAMPERS[name], rows)
    assert np.max(np.abs(fast - force)) <= 4 * np.finfo(float).eps * np.max(np.abs(force))


@pytest.mark.parametrize("name", [n if n in KINDS[-3:] else pytest.param(n, marks=pytest.mark.slow) for n in DAMPERS])
def test_the_self_test_passes_in_both_precisions(name, tmp_path):
    written = CExporter().export(DAMPERS[name], "damper")
    for file, content in written.files.items():
        (tmp_path / file).write_bytes(content)
    for flags in (["-O2"], ["-O2", "-DDAMPER_SINGLE"]):
        command = [COMPILERS[-1], *STRICT, *flags, "damper.c", "damper_test.c", "-lm", "-o", "t"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert subprocess.run([tmp_path / "t"], capture_output=True, check=False).returncode == 0


def test_the_self_test_notices_a_changed_source(tmp_path):
    written = CExporter().export(joint_damper(), "damper")
    for file, content in written.files.items():
        (tmp_path / file).write_bytes(content)
    source = (tmp_path / "damper.c").read_text()
    assert "R(800.0)" in source
    (tmp_path / "damper.c").write_text(source.replace("R(800.0)", "R(801.0)"))
    subprocess.run([COMPILERS[0], "-O2", "damper.c", "damper_test.c", "-lm", "-o", "t"], cwd=tmp_path, check=True)
    assert subprocess.run([tmp_path / "t"], capture_output=True, check=False).returncode == 1


BAD = """
#include "m.h"
#include <math.h>
#include <stdio.h>
#include <string.h>
int main(void)
{
    m_model a, b;
    m_state kept, now;
    m_parameters p;
    m_real force = 0, other = 0, good;
    int i;
    memset(&a, 0, sizeof a);
    if (m_step(&a, 0, 0, 1, &force) != M_NOT_READY) { return 1; }
    if (m_init(&a) != M_OK || m_init(&b) != M_OK || m_init(0) != M_NOT_READY) { return 2; }
    if (m_step(&a, (m_real)0.001, (m_real)0.5, (m_real)0.001, &good) != M_OK) { return 3; }
    (void)m_get_state(&a, &kept);
    if (m_step(&a, (m_real)NAN, 0, (m_real)0.001, &force) != M_BAD_INPUT || force != good) { return 4; }
    if (m_step(&a, 0, (m_real)INFINITY, (m_real)0.001, &force) != M_BAD_INPUT) { return 5; }
    if (m_step(&a, 0, 0, 0, &force) != M_BAD_TIME_STEP) { return 6; }
    if (m_step(&a, 0, 0, (m_real)-1, &force) != M_BAD_TIME_STEP) { return 7; }
    if (m_step(&a, 0, 0, (m_real)NAN, &force) != M_BAD_INPUT) { return 8; }
    (void)m_get_state(&a, &now);
    if (memcmp(&kept, &now, sizeof kept) != 0) { return 9; }
    if (m_step(&a, 0, 0, 1, 0) != M_NOT_READY) { return 10; }
    (void)m_get_parameters(&a, &p);
    p.c0 = (m_real)-1;
    if (m_set_parameters(&a, &p) != M_BAD_PARAMETER) { return 11; }
    p.c0 = (m_real)NAN;
    if (m_set_parameters(&a, &p) != M_BAD_PARAMETER) { return 12; }
    now.force = (m_real)NAN;
    if (m_set_state(&a, &now) != M_BAD_STATE) { return 13; }
    /* two instances side by side do not know of each other */
    (void)m_reset(&a);
    (void)m_reset(&b);
    for (i = 0; i < 1000; i++) {
        const m_real x = (m_real)(0.01 * sin(0.01 * i));
        if (m_step(&a, x, (m_real)0.5, (m_real)0.001, &force) != M_OK) { return 14; }
        if (m_step(&b, -x, (m_real)0.2, (m_real)0.001, &other) != M_OK) { return 15; }
        (void)m_get_state(&a, &kept);
        (void)m_reset(&a);
        if (m_set_state(&a, &kept) != M_OK) { return 16; }
    }
    if (m_step(&a, (m_real)0.5, (m_real)9, (m_real)0.001, &force) != M_OK || m_flags(&a) != 7u) { return 17; }
    return 0;
}
"""


def test_bad_calls_are_answered_and_leave_the_state(tmp_path):
    program = build(joint_damper(), tmp_path, COMPILERS[0], "-O1", "-fsanitize=address,undefined", driver=BAD)
    assert subprocess.run([program], check=False).returncode == 0


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("valgrind"), reason="valgrind is not installed")
def test_valgrind_finds_nothing(tmp_path):
    program = build(joint_damper(), tmp_path, COMPILERS[0], "-O1", "-g", driver=BAD)
    done = subprocess.run(["valgrind", "-q", "--error-exitcode=99", program], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_source_keeps_off_the_heap_and_off_files(tmp_path):
    for damper in DAMPERS.values():
        written = CExporter().export(damper, "damper")
        source = written.files["damper.c"].decode()
        assert set(re.findall(r"#include (\S+)", source)) == {'"damper.h"', "<math.h>"}
        assert not re.search(r"\b(malloc|calloc|free|printf|while \(1\)|goto)\b", source)
        assert source.isascii()


def test_exporting_twice_gives_the_same_bytes():
    assert CExporter().export(joint_damper(), "damper") == CExporter().export(joint_damper(), "damper")


def test_names_become_identifiers_or_are_refused():
    assert identifier("My rig 2") == "my_rig_2"
    assert identifier("2 rig") == "damper_2_rig"
    for bad in ("", "***", "double", "x" * 60):
        with pytest.raises(InputError, match="E_EXPORT_NAME"):
            identifier(bad)


def test_a_hostile_rig_name_stays_in_its_comment(tmp_path):
    from dataclasses import replace

    damper = replace(joint_damper(), rig='*/ int evil; /* \\\n#error "x" ??/')
    build(damper, tmp_path, COMPILERS[0])
    written = CExporter().export(damper, "damper").files["damper.h"].decode()
    assert "*/ int evil" not in written
    written = CExporter().export(replace(damper, rig=""), "damper").files["damper.h"].decode()
    assert "from a model. C99" in written


@pytest.mark.usefixtures("one_platform")
def test_every_format_exports_a_saved_damper():
    for name in all_exporters():
        written = exporter(name)().export(joint_damper(), "damper")
        assert written.files
        assert all(written.files.values())
