"""
A study in three lines
======================

The study of the bundled tests of two dampers."""

from mrdamper import load_dataset, run_study

dataset = load_dataset()
study = run_study(dataset)
for rig in study.rigs:
    print(f"{rig.rig}: {rig.chosen.title}, validation {100 * rig.chosen.validation.median():.1f} % of peak-to-peak")
