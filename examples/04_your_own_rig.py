"""
From rig files to a model
=========================

The files have decimal commas, units in a row and currents in their names; one of them has an inverted force.

With `--keep FOLDER` the files are only written, for the commands of docs/how-to/your-own-rig.md.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

from mrdamper import Condition, run_study
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.physics.motion import sine
from mrdamper.physics.simulation import simulate
from mrdamper.rig_files.quality.table import quality_table
from mrdamper.rig_files.rig_import import import_files, to_dataset


def rig_test(condition: Condition, rng: np.random.Generator) -> np.ndarray:
    """Columns of one test: s, mm, kN, with the rig's zeros and noise."""
    motion = sine(condition, cycles=4, samples_per_cycle=150)
    strength = 0.15 + condition.current_A
    damper = BoucWen(c=700 + 900 * condition.current_A, alpha=9e5 * strength, beta=5e5, gamma=5e5, f0=60, k1=900)
    force = simulate(damper, motion).force + 5 * rng.standard_normal(len(motion))
    return np.column_stack([motion.time, 1e3 * motion.displacement - 30, 1e-3 * force])


def write_like_a_rig(path: Path, columns: np.ndarray) -> None:
    """Write semicolons, decimal commas, two lines of remarks, a row of names and a row of units."""
    head = ["Dämpferprüfstand 2", f"Prüfung;{path.stem}", "Zeit;Weg;Kraft", "s;mm;kN"]
    rows = [";".join(f"{cell:.5f}".replace(".", ",") for cell in row) for row in columns]
    path.write_text("\r\n".join([*head, *rows]) + "\r\n", encoding="cp1252")


def make_folder(folder: Path) -> None:
    """Write nine tests at three currents; in one of them the sign of the force is inverted."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(4)
    for current in (0.0, 0.5, 1.0):
        for frequency, millimetres in ((0.5, 10), (1.0, 20), (2.0, 10)):
            columns = rig_test(Condition(current, frequency, 1e-3 * millimetres), rng)
            name = f"{frequency:g}Hz_{millimetres}mm_{current:g}A".replace(".", "x")
            if name == "2Hz_10mm_0x5A":
                columns[:, 2] *= -1
            write_like_a_rig(folder / f"{name}.txt", columns)


def main(folder: Path) -> None:
    """Write the files, import them, check their quality, study them."""
    make_folder(folder)
    imported = import_files([folder])
    for refusal in imported.refusals:
        print(f"refused: {refusal.error}")
    for quality in quality_table(imported.records):
        of = quality.figures
        motion = f"{of['current_A']:.3g} A, {of['frequency_Hz']:.3g} Hz, {of['amplitude_mm']:.3g} mm"
        print(f"{quality.record.id}: {motion}, {of['cycles']:.1f} cycles, {quality.verdict}")
    rig = run_study(to_dataset(imported.records, "my rig")).rigs[0]
    error = rig.chosen.cross_validated.median()
    print(f"{rig.chosen.title}: {100 * error:.1f} % of peak-to-peak at cross-validated conditions")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--keep"]:
        make_folder(Path(sys.argv[2]))
    else:
        with tempfile.TemporaryDirectory() as scratch:
            main(Path(scratch))
