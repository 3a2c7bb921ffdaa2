"""Compiles exported C beside a driver that reads samples and writes forces, status and flags."""

import shutil
import struct
import subprocess

import numpy as np

from mrdamper.dampers.streaming import stream
from mrdamper.exporters.c import c_sources

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror")
COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]
DRIVER = """
#include "m.h"
#include <stdio.h>
int main(void)
{
    m_model model;
    double row[6];
    m_real force;
    if (m_init(&model) != M_OK) {
        return 1;
    }
    while (fread(row, sizeof row, 1, stdin) == 1) {
        double out[3];
        if (row[5] > 0.5) { /* a new condition */
            (void)m_reset(&model);
        }
        out[1] = (double)m_step_motion(&model, (m_real)row[0], (m_real)row[1], (m_real)row[2], (m_real)row[3],
            (m_real)row[4], &force);
        out[0] = (double)force;
        out[2] = (double)m_flags(&model);
        (void)fwrite(out, sizeof out, 1, stdout);
    }
    return 0;
}
"""


def build(damper, folder, compiler, *flags, driver=DRIVER):
    """Compile a damper's sources with a driver; the program's path."""
    folder.mkdir(exist_ok=True)
    for name, text in c_sources(stream(damper), "m", "bench").items():
        (folder / name).write_text(text)
    (folder / "driver.c").write_text(driver)
    program = folder / f"run{abs(hash((compiler, flags)))}"
    command = [compiler, *STRICT, *flags, "m.c", "driver.c", "-lm", "-o", str(program)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return program


def run(program, rows):
    """(N, 3): force, status, flags for (N, 6) rows of x, v, a, current, dt, reset."""
    done = subprocess.run([program], input=np.ascontiguousarray(rows, float).tobytes(), capture_output=True, check=True)
    count = len(done.stdout) // struct.calcsize("3d")
    return np.frombuffer(done.stdout).reshape(count, 3)
