"""Where faults are planted, and the tests that answer for them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Room:
    """Modules, and the tests that must notice faults in them.

    Attributes
    ----------
    modules, tests : tuple of str
    without : tuple of str
        Words of tests that are left out: statistics of seconds, beside which exact ones stand.
    """

    modules: tuple[str, ...]
    tests: tuple[str, ...]
    without: tuple[str, ...] = ()


def _room(modules: str, tests: str, without: str = "") -> Room:
    return Room(
        tuple(f"mrdamper.{name}" for name in modules.split()),
        tuple(f"tests/{name}" for name in tests.split()),
        tuple(without.split()),
    )


ROOMS = (
    _room("study.validation statistics.metrics", "test_validation.py test_metrics.py"),
    _room("identification.loop_analysis", "identification/test_loop_analysis.py"),
    _room(
        "identification.covariance",
        "identification/test_covariance.py identification/test_covariance_by_hand.py",
        "cover_what_they_say scatter_of_repeated",
    ),
    _room("statistics.functions.forms statistics.functions.fitting", "functions"),
    _room(
        "paper.claims paper.claims_on_tests paper.claims_on_fits",
        "paper/test_verdicts.py paper/test_claims.py paper/test_measured.py paper/test_seeds.py",
    ),
    _room("paper.output", "paper/test_output.py"),
    _room("paper.sensitivity", "paper/test_sensitivity.py"),
    _room(
        "dampers.bands dampers.uncertainty dampers.sessions data.sessions",
        "dampers/test_bands_by_hand.py dampers/test_sessions.py data/test_sessions.py",
    ),
    _room(
        "dampers.calibration dampers.random_effects",
        "dampers/test_calibration.py dampers/test_random_effects.py",
    ),
    _room(
        "dampers.covariance dampers.run_residuals",
        "dampers/test_covariance_laws.py dampers/test_bands_by_hand.py dampers/test_parameter_uncertainty.py"
        " identification/test_covariance.py",
        "cover_what_they_say scatter_of_repeated",
    ),
    _room("identification.intervals", "identification/test_intervals.py"),
    _room("study.plan", "study/test_plan.py", "beats_chance read_back first_matrix limits_that too_many"),
    _room(
        "systems.controllers.hooks systems.controllers.add systems.controllers.clipped_optimal systems.inverse",
        "systems/test_laws_by_hand.py systems/test_control.py",
        "preview lets_energy_into never_in_reach",
    ),
    _room("systems.measures", "systems/test_measures.py"),
    _room("systems.monte_carlo", "systems/test_uncertainty.py"),
    _room("fleet.charts", "fleet/test_charts.py"),
    _room("fleet.verdicts", "fleet/test_verdicts.py", "page charted no_column lower_limit another_rig"),
    _room("paper.options paper.assumptions paper.recipes", "paper/test_ways.py study/test_recipe.py"),
    _room("paper.virtual_rig", "paper/test_virtual_rig.py"),
    _room(
        "report.tables study.recipe study.cross_validation",
        "report/test_tables.py study/test_recipe.py study/test_folds.py",
    ),
    _room(
        "paper.functions dampers.modified",
        "dampers/test_modified.py dampers/test_normal_equations.py study/test_recipe.py",
    ),
    _room("dampers.joint", "dampers/test_joint.py"),
    _room(
        "dampers.published.ali dampers.published.boada dampers.published.dominguez dampers.published.lei"
        " dampers.published.lv dampers.published.base",
        "dampers/test_published_laws.py dampers/test_published_fits.py",
    ),
    _room("models.play_bypass", "models/test_play_bypass.py"),
    _room(
        "paper.paper_method identification.harmonic_balance",
        "identification/test_harmonic_balance.py paper/test_functions.py",
    ),
    _room("rig_files.quality.loop", "rig_files/test_loop_check.py rig_files/test_silent_faults.py"),
)

# A fault that no working trial lets live: the sign in the root mean square error.
CERTAIN = _room("statistics.metrics", "test_metrics.py")
CERTAIN_FAULT = ("return float(np.sqrt(np.mean((predicted - measured) ** 2)))", "Sub → Add")
