"""The paper's figures by their numbers, and those that only this study has.

Figures 1, 2, 7 and 8 of the paper are photographs and sketches. Which of 13 to 23 shows which
parameter was not seen; the order here is that of the equations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from mrdamper.identification.loop_analysis import dynamic_ranges
from mrdamper.paper.loop_figures import Made, friction_figure, identified_over, loops_by, predicted_over
from mrdamper.paper.parameter_figures import function_figure, over_motion, parameter_figure, readings_figure
from mrdamper.paper.results import Reproduction
from mrdamper.paper.verdict_figures import (
    accuracy_rate,
    errors_figure,
    genetic_figure,
    seeds_figure,
    sensitivity_figure,
    times,
)
from mrdamper.report.plots.rig_tests import test_analysis, test_matrix
from mrdamper.report.plots.style import Picture
from mrdamper.study.recipe import Progress

TIMES = "fig26_times"  # differs from run to run; stands beside the page, not in it

Figures = Mapping[str, tuple[str, Callable[[Reproduction], Made]]]


def pictures(
    study: Reproduction, also: tuple[str, ...], names: tuple[str, ...], progress: Progress
) -> dict[str, Picture | str]:
    """Figures by name, or why they cannot be drawn."""
    found: dict[str, Picture | str] = {}
    for number, name in enumerate(names):
        progress(f"figure {name}", number / len(names))
        made = FIGURES[name][1](study)
        found[name] = made if isinstance(made, str) else Picture.of(made, also)
    return found


FIGURES: Figures = {
    "fig03_friction": (
        "Fig. 3. Friction test at 0.01 mm/s: force, and half the force between the strokes.",
        friction_figure,
    ),
    "fig04_loops_current": ("Fig. 4. Loops at several currents.", partial(loops_by, "current")),
    "fig05_loops_frequency": ("Fig. 5. Loops at several frequencies.", partial(loops_by, "frequency")),
    "fig06_loops_amplitude": ("Fig. 6. Loops at several amplitudes.", partial(loops_by, "amplitude")),
    "fig09_identified_displacement": (
        "Fig. 9. Force over displacement: tested, and identified from the same run.",
        partial(identified_over, "displacement"),
    ),
    "fig10_identified_velocity": (
        "Fig. 10. Force over velocity: tested, and identified from the same run.",
        partial(identified_over, "velocity"),
    ),
    "fig11_F0": (
        "Fig. 11. F0, a quadratic of the current for every motion [Eq. 23].",
        partial(readings_figure, "amplitude", "F0 (N)", "quadratic-current"),
    ),
    "fig12_phase": (
        "Fig. 12. Phase by which the first harmonic of the force leads the displacement.",
        partial(readings_figure, "phase", "Phase φ (rad)", ""),
    ),
    "fig13_f0": (
        "Fig. 13. Offset force f0, and its mean for every motion.",
        partial(readings_figure, "offset", "f0 (N)", "constant"),
    ),
    "fig14_F0_shift": (
        "Fig. 14. What is left of F0 beside its common current law, a quadratic of f · A [Eq. 24–25].",
        partial(over_motion, "F0", "speed", "b (N)", "quadratic-current-speed"),
    ),
    "fig15_c": (
        "Fig. 15. c by the closed form, and its function of current, frequency and amplitude [Eq. 26].",
        partial(function_figure, "c", "c (N s/m)"),
    ),
    "fig16_m": (
        "Fig. 16. m by the closed form, a quadratic of the current for every motion [Eq. 27].",
        partial(parameter_figure, "m", "m (kg)", "quadratic-current"),
    ),
    "fig17_m3": (
        "Fig. 17. What is left of m beside its common current law, falling with the frequency [Eq. 29–30].",
        partial(over_motion, "m", "frequency", "m3 (kg)", "mass-exponential"),
    ),
    "fig18_m_function": (
        "Fig. 18. m, and its function of current and frequency [Eq. 31].",
        partial(function_figure, "m", "m (kg)"),
    ),
    "fig19_alpha": (
        "Fig. 19. α, a quadratic of the current for every motion [Eq. 32].",
        partial(parameter_figure, "alpha", "α (N/m)", "quadratic-current"),
    ),
    "fig20_alpha_d": (
        "Fig. 20. What is left of α beside its common current law, a plane over frequency and amplitude [Eq. 33–35].",
        partial(over_motion, "alpha", "frequency", "d (N/m)", "plane"),
    ),
    "fig21_beta": (
        "Fig. 21. β, an exponential of the current for every motion [Eq. 37].",
        partial(parameter_figure, "beta", "β (m⁻ⁿ)", "decaying-current"),
    ),
    "fig22_beta_q": (
        "Fig. 22. What is left of ln β beside its common current law, falling with the frequency [Eq. 39–40].",
        partial(over_motion, "beta", "frequency", "ln β (–)", "mass-exponential"),
    ),
    "fig23_alpha_function": (
        "Fig. 23. α, and its function of current, frequency and amplitude [Eq. 36].",
        partial(function_figure, "alpha", "α (N/m)"),
    ),
    "fig23_beta_function": (
        "Fig. 23. β, and its function of current and frequency [Eq. 40].",
        partial(function_figure, "beta", "β (m⁻ⁿ)"),
    ),
    "fig24_predicted_displacement": (
        "Fig. 24. Force over displacement of held-out runs: tested, and predicted.",
        partial(predicted_over, "displacement"),
    ),
    "fig25_predicted_velocity": (
        "Fig. 25. Force over velocity of held-out runs: tested, and predicted.",
        partial(predicted_over, "velocity"),
    ),
    "fig26_accuracy_rate": (
        "Fig. 26. Error on held-out runs, and forces computed to identify from one run, median; “paper, literal” by "
        "its genetic search where that was made, else by the optimum it is after.",
        accuracy_rate,
    ),
    TIMES: ("Fig. 26, in seconds.", times),
    "matrix": ("Test matrix; hollow marks are held out.", lambda study: test_matrix(study.loops)),
    "analysis": (
        "Peak force, energy, equivalent damping and dynamic range before any model.",
        lambda study: test_analysis(study.loops, dynamic_ranges(study.loops)),
    ),
    "genetic": ("Genetic search with the paper's settings, 500 generations of 100 in each box.", genetic_figure),
    "errors": ("Error of every held-out run.", errors_figure),
    "seeds": ("Median held-out error over noise seeds.", seeds_figure),
    "sensitivity": (
        "Change of the force when one coordinate changes by a tenth: the others held (bars), or identified anew "
        "(marks; what is less stands at 1e-8). Right: total Sobol indices with 95 % intervals.",
        sensitivity_figure,
    ),
}
