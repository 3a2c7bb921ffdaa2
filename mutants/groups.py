"""Modules in which faults are planted, and the tests that must detect them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Group:
    """Modules, and the tests that must detect faults in them.

    Attributes
    ----------
    modules, tests : tuple of str
    without : tuple of str
        Words of excluded tests: statistics that take seconds, for which exact tests exist.
    """

    modules: tuple[str, ...]
    tests: tuple[str, ...]
    without: tuple[str, ...] = ()


def _group(modules: str, tests: str, without: str = "") -> Group:
    return Group(
        tuple(f"mrdamper.{name}" for name in modules.split()),
        tuple(f"tests/{name}" for name in tests.split()),
        tuple(without.split()),
    )


GROUPS = (
    _group("study.validation statistics.metrics", "test_validation.py test_metrics.py"),
    _group("identification.loop_analysis", "identification/test_loop_analysis.py"),
    _group(
        "identification.covariance",
        "identification/test_covariance.py identification/test_covariance_by_hand.py",
        "cover_what_they_say scatter_of_repeated",
    ),
    _group("statistics.functions.forms statistics.functions.fitting", "functions"),
    _group(
        "paper.claims paper.claims_on_tests paper.claims_on_fits",
        "paper/test_verdicts.py paper/test_claims.py paper/test_measured.py paper/test_seeds.py",
    ),
    _group("paper.output", "paper/test_output.py"),
    _group("paper.sensitivity", "paper/test_sensitivity.py"),
    _group(
        "dampers.bands dampers.uncertainty dampers.sessions data.sessions",
        "dampers/test_bands_by_hand.py dampers/test_sessions.py data/test_sessions.py",
    ),
    _group(
        "dampers.calibration dampers.random_effects",
        "dampers/test_calibration.py dampers/test_random_effects.py",
    ),
    _group(
        "dampers.covariance dampers.run_residuals",
        "dampers/test_covariance_laws.py dampers/test_bands_by_hand.py dampers/test_parameter_uncertainty.py"
        " identification/test_covariance.py",
        "cover_what_they_say scatter_of_repeated",
    ),
    _group("identification.intervals", "identification/test_intervals.py"),
    _group("study.plan", "study/test_plan.py", "beats_chance read_back first_matrix limits_that too_many"),
    _group(
        "systems.controllers.hooks systems.controllers.add systems.controllers.clipped_optimal systems.inverse",
        "systems/test_laws_by_hand.py systems/test_control.py",
        "preview lets_energy_into never_in_reach",
    ),
    _group("systems.measures", "systems/test_measures.py"),
    _group("systems.monte_carlo", "systems/test_uncertainty.py"),
    _group("fleet.charts", "fleet/test_charts.py"),
    _group("fleet.verdicts", "fleet/test_verdicts.py", "page charted no_column lower_limit another_rig"),
    _group("paper.options paper.assumptions paper.recipes", "paper/test_ways.py study/test_recipe.py"),
    _group("paper.virtual_rig", "paper/test_virtual_rig.py"),
    _group(
        "report.tables study.recipe study.cross_validation",
        "report/test_tables.py study/test_recipe.py study/test_folds.py",
    ),
    _group(
        "paper.functions dampers.modified",
        "dampers/test_modified.py dampers/test_normal_equations.py study/test_recipe.py",
    ),
    _group("dampers.joint", "dampers/test_joint.py"),
    _group(
        "dampers.published.ali dampers.published.boada dampers.published.dominguez dampers.published.lei"
        " dampers.published.lv dampers.published.base",
        "dampers/test_published_laws.py dampers/test_published_fits.py",
    ),
    _group("models.play_bypass", "models/test_play_bypass.py"),
    _group(
        "paper.paper_method identification.harmonic_balance",
        "identification/test_harmonic_balance.py paper/test_functions.py",
    ),
    _group("rig_files.quality.loop", "rig_files/test_loop_check.py rig_files/test_silent_faults.py"),
)

# A fault that every valid trial detects: the sign in the root mean square error.
CERTAIN = _group("statistics.metrics", "test_metrics.py")
CERTAIN_FAULT = ("return float(np.linalg.norm(predicted - measured) / np.sqrt(measured.size))", "Sub → Add")
