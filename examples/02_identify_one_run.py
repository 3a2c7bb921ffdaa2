"""
Identification of one run
=========================

A Bouc–Wen model from one test, with the uncertainty of its parameters."""

from mrdamper import identify, load_dataset, plot_loop
from mrdamper.physics.motion import measured_motion

run = load_dataset()["utf_5mm4Hz_1A"]
found = identify(run, "bouc-wen")
print(f"{found.condition}: error {100 * found.scores.nrmse_pp:.2f} %, scatter of the rig {100 * found.floor:.2f} %")
print(f"yield force {found.model.yield_force:.0f} N within {1e6 * found.model.yield_displacement:.0f} µm")
print(f"c = {found.model.c:.0f} ± {found.standard_errors['c']:.0f} N s/m")
print(found.ending)
for note in found.notes:
    print(f"note: {note}")

axes = plot_loop(run, over="velocity", color="black", label="measured")
steady = run.steady()
axes.plot(1e3 * measured_motion(steady).velocity, 1e-3 * (steady.force + found.residual), label="Bouc–Wen")
axes.legend()
