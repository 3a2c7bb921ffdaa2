"""The paper's figures under their numbers, and those of this study, which have names.

Figures 1, 2, 7 and 8 of the paper show its damper, its rig and two schemes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from mrdamper.identification.loop_analysis import dynamic_ranges
from mrdamper.paper.loop_figures import (
    Made,
    friction_figure,
    identified_loops,
    loops_by,
    predicted_loops,
    predicted_over,
)
from mrdamper.paper.parameter_figures import function_figure, over_motion, parameter_figure, r2_figure, readings_figure
from mrdamper.paper.recipes import LITERAL, TRADITIONAL
from mrdamper.paper.results import Reproduction
from mrdamper.paper.verdict_figures import (
    accuracy_rate,
    errors_figure,
    genetic_figure,
    methods_figure,
    seconds_figure,
    seeds_figure,
    sensitivity_figure,
)
from mrdamper.report.plots.rig_tests import test_analysis, test_matrix
from mrdamper.report.plots.style import Picture
from mrdamper.study.recipe import Progress

SECONDS = "seconds"  # name of the figure that differs from run to run; it stands beside the page

_F0, _M, _ALPHA, _BETA, _OFFSET = "F0 (N)", "m (kg)", "α (N/m)", "β (m⁻ⁿ)", "f0 (N)"

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
    "fig03": (
        "Fig. 3. Friction test at 0.01 mm/s: force, and half the force between the strokes.",
        friction_figure,
    ),
    "fig04": ("Fig. 4. One current and amplitude, several frequencies.", partial(loops_by, "frequency", 0)),
    "fig05": ("Fig. 5. Several currents, the motion of the smallest amplitude.", partial(loops_by, "current", 0)),
    "fig06": ("Fig. 6. Several currents, the motion of the largest amplitude.", partial(loops_by, "current", -1)),
    "fig09": (
        "Fig. 9. Identified (dashed) and tested loops at the smaller amplitude, all currents.",
        partial(identified_loops, 0),
    ),
    "fig10": (
        "Fig. 10. Identified (dashed) and tested loops at the larger amplitude, all currents.",
        partial(identified_loops, -1),
    ),
    "fig11": ("Fig. 11. F0 over the current, a curve a condition.", partial(readings_figure, "amplitude", _F0, "")),
    "fig12": (
        "Fig. 12. F0 fitted by quadratics of the current [Eq. 23].",
        partial(readings_figure, "amplitude", _F0, "quadratic-current"),
    ),
    "fig13": ("Fig. 13. R² of the fits of Fig. 12.", partial(r2_figure, "F0", "quadratic-current")),
    "fig14": (
        "Fig. 14. Constant term b of F0 over f · A, a quadratic [Eq. 25].",
        partial(over_motion, "F0", "speed", "b (N)", "quadratic-current-speed"),
    ),
    "fig15": (
        "Fig. 15. m fitted by quadratics of the current [Eq. 27].",
        partial(parameter_figure, "m", _M, "quadratic-current"),
    ),
    "fig16": ("Fig. 16. R² of the fits of Fig. 15.", partial(r2_figure, "m", "quadratic-current")),
    "fig17": (
        "Fig. 17. Constant term m3 of m over the frequency [Eq. 30].",
        partial(over_motion, "m", "frequency", "m3 (kg)", "mass-exponential"),
    ),
    "fig18": (
        "Fig. 18. α fitted by quadratics of the current [Eq. 32].",
        partial(parameter_figure, "alpha", _ALPHA, "quadratic-current"),
    ),
    "fig19": ("Fig. 19. R² of the fits of Fig. 18.", partial(r2_figure, "alpha", "quadratic-current")),
    "fig20": (
        "Fig. 20. Constant term d of α over the frequency, a line an amplitude [Eq. 34].",
        partial(over_motion, "alpha", "frequency", "d (N/m)", "plane"),
    ),
    "fig21": (
        "Fig. 21. β fitted by exponentials of the current [Eq. 37].",
        partial(parameter_figure, "beta", _BETA, "decaying-current"),
    ),
    "fig22": ("Fig. 22. R² of the fits of Fig. 21.", partial(r2_figure, "beta", "decaying-current")),
    "fig23": (
        "Fig. 23. Constant term q of β over the frequency, as ln β [Eq. 39].",
        partial(over_motion, "beta", "frequency", "ln β (–)", "mass-exponential"),
    ),
    "fig24": (
        "Fig. 24. Modified model (dashed) and test at the prediction motion, all currents.",
        partial(predicted_loops, LITERAL),
    ),
    "fig25": (
        "Fig. 25. Traditional Bouc–Wen model (dashed) and test at the prediction motion, all currents.",
        partial(predicted_loops, TRADITIONAL),
    ),
    "fig26": (
        "Fig. 26. Accuracy and identification rate of the methods over the current at the prediction motion. "
        "Rate: forces computed until a genetic search is within 1 % of its end; for the Ali-type model, by least "
        "squares, until its end.",
        accuracy_rate,
    ),
    SECONDS: ("Identification, in seconds.", seconds_figure),
    "matrix": ("Test matrix; hollow marks are validation runs.", lambda study: test_matrix(study.loops)),
    "analysis": (
        "Peak force, energy, equivalent damping and dynamic range before any model.",
        lambda study: test_analysis(study.loops, dynamic_ranges(study.loops)),
    ),
    "phase": (
        "Phase by which the first harmonic of the force leads the displacement.",
        partial(readings_figure, "phase", "Phase φ (rad)", ""),
    ),
    "offset": (
        "Offset force f0, and its mean for every motion.",
        partial(readings_figure, "offset", _OFFSET, "constant"),
    ),
    "function_c": ("c by the closed form, and its function [Eq. 26].", partial(function_figure, "c", "c (N s/m)")),
    "function_m": ("m by the closed form, and its function [Eq. 31].", partial(function_figure, "m", _M)),
    "function_alpha": ("α and its function [Eq. 36].", partial(function_figure, "alpha", _ALPHA)),
    "function_beta": ("β and its function [Eq. 40].", partial(function_figure, "beta", _BETA)),
    "predicted": (
        "Validation runs: tested, and predicted by the literal, the consistent and the traditional method.",
        predicted_over,
    ),
    "genetic": ("Genetic search with the paper's settings, 500 generations of 100 in each box.", genetic_figure),
    "methods": (
        "Error on validation runs, and forces computed to identify from one run, median.",
        methods_figure,
    ),
    "errors": ("Error of every validation run.", errors_figure),
    "seeds": ("Median validation error over noise seeds.", seeds_figure),
    "sensitivity": (
        "Change of the force when one coordinate changes by a tenth: the others held (bars), or identified anew "
        "(marks; what is less stands at 1e-8). Right: total Sobol indices with 95 % intervals.",
        sensitivity_figure,
    ),
}
