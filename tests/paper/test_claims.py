"""What claims measure, on made data whose numbers are known, and how each verdict follows from them."""

from types import SimpleNamespace

import numpy as np
import pytest

from mrdamper.data import Condition, Run
from mrdamper.identification.harmonic_balance import ForceReading
from mrdamper.paper import claims_on_fits, claims_on_tests
from mrdamper.paper.claims import verdict_on
from mrdamper.paper.options import ALI, CONSISTENT, LITERAL, TRADITIONAL
from mrdamper.paper.results import GeneticEnd
from mrdamper.paper.sensitivity import OneAtATime
from mrdamper.physics.motion import sine

CONDITIONS = [Condition(I, f, A) for f, A in ((1.0, 0.02), (2.0, 0.02), (0.5, 0.05), (1.0, 0.05))
              for I in (0.0, 0.5, 1.0, 1.5, 2.0)]  # fmt: skip


def verdict(key, measured):
    return verdict_on(key, measured.values)


def study_of(readings=None, contenders=(), **more):
    made = SimpleNamespace(conditions=CONDITIONS, readings=readings, rig=None, **more)
    made.contender = lambda title: dict(contenders).get(title)
    return made


def scored(values=None, at_bounds=(), median=0.03, worst=0.04, per_run=0.02, **more):
    """A contender with identifications of made parameters, one a condition."""
    found = []
    for i, _ in enumerate(CONDITIONS):
        model = SimpleNamespace(**{name: v[i] for name, v in (values or {}).items()})
        edge = ("beta",) if i in at_bounds else ()
        found.append(
            SimpleNamespace(model=model, at_bounds=edge, run_id=str(i), scores=SimpleNamespace(nrmse_pp=per_run))
        )
    held = SimpleNamespace(
        runs=(1,), median=lambda: median,
        worst=lambda: SimpleNamespace(scores=SimpleNamespace(nrmse_pp=worst), condition=CONDITIONS[0]),
    )  # fmt: skip
    return SimpleNamespace(identifications=tuple(found), validation=held, per_run=per_run, fit=None, **more)


@pytest.mark.parametrize(
    ("low", "high", "want"), [(1.41, 1.41, "agrees"), (1.45, 1.49, "agrees in part"), (1.1, 1.3, "differs")]
)
def test_the_phase_is_judged_by_band_and_by_its_change_with_current(low, high, want):
    readings = [ForceReading(100.0, low + (high - low) * c.current_A / 2, 0.0) for c in CONDITIONS]
    found = claims_on_tests.phase(study_of(readings))
    assert found.values[1] == pytest.approx(high - low)
    assert verdict("phase", found) == want


@pytest.mark.parametrize(("bend", "want"), [(0.0, "agrees"), (120.0, "agrees in part"), (600.0, "differs")])
def test_the_quadratic_is_judged_by_the_worst_motion(bend, want):
    readings = []
    for i, c in enumerate(CONDITIONS):
        swing = bend * (-1) ** i if (c.frequency_Hz, c.amplitude_m) == (2.0, 0.02) else 0.0
        readings.append(ForceReading(200 + 900 * c.current_A - 150 * c.current_A**2 + swing, 1.5, 0.0))
    assert verdict("quadratic", claims_on_tests.quadratic(study_of(readings))) == want


@pytest.mark.parametrize(("above", "want"), [(100.0, "agrees"), (550.0, "agrees in part"), (1000.0, "differs")])
def test_saturation_is_the_ratio_of_slopes(above, want):
    readings = [
        ForceReading(100 + 1000 * min(c.current_A, 1.0) + 600 * np.clip(c.current_A - 1, 0, 0.5)
                     + above * max(c.current_A - 1.5, 0), 1.5, 0.0)
        for c in CONDITIONS
    ]  # fmt: skip
    found = claims_on_tests.saturation(study_of(readings))
    assert found.values[0] == pytest.approx(above / 1000)
    assert verdict("saturation", found) == want


@pytest.mark.parametrize(("share", "want"), [(1.05, "agrees"), (1.4, "agrees in part"), (3.0, "differs")])
def test_viscosity_is_the_closed_form_over_the_consistent_one(share, want):
    c = np.linspace(1000, 2000, len(CONDITIONS))
    contenders = {LITERAL: scored({"c": share * c}), CONSISTENT: scored({"c": c})}
    found = claims_on_fits.viscosity(study_of(contenders=contenders))
    assert found.values[0] == pytest.approx(share)
    assert verdict("viscosity", found) == want


@pytest.mark.parametrize(("factor", "want"), [(1.05, "agrees"), (1.8, "agrees in part"), (4.5, "differs")])
def test_the_search_is_judged_by_parameters_on_either_side(factor, want):
    ended = [GeneticEnd(str(i), i, factor if i % 2 else 1 / factor, factor, 1.001, 9, 5, 1.0) for i in range(8)]
    found = claims_on_fits.search(study_of(ended=ended))
    assert list(found.values) == pytest.approx([factor, factor])
    assert verdict("search", found) == want
    assert verdict("search", claims_on_fits.search(study_of(ended=()))) == "cannot be checked"


@pytest.mark.parametrize(("own", "want"), [(0.020, "agrees"), (0.028, "agrees in part"), (0.09, "differs")])
def test_accuracy_is_compared_on_the_validation_runs(own, want):
    def predicted(error):
        return SimpleNamespace(validation=SimpleNamespace(runs=(1,), median=lambda name="nrmse_pp": error))

    contenders = {LITERAL: predicted(own), TRADITIONAL: predicted(0.02)}
    found = claims_on_fits.accuracy(study_of(contenders=contenders))
    assert list(found.values) == pytest.approx([own / 0.02] * 2)
    assert verdict("accuracy", found) == want


@pytest.mark.parametrize(
    ("own", "count", "want"),
    [(0.03, 7, "agrees"), (0.04, 7, "agrees in part"), (0.03, 2, "agrees in part"), (0.9, 7, "differs")],
)
def test_few_parameters_are_judged_by_error_and_count(own, count, want):
    contenders = {LITERAL: scored(median=own, worst=own), ALI: scored(median=0.03, parameters_per_run=count)}
    found = claims_on_fits.few_parameters(study_of(contenders=contenders))
    assert found.values[0] == pytest.approx(own / 0.03)
    assert verdict("few parameters", found) == want


@pytest.mark.parametrize(("forces", "want"), [(500, "agrees"), (1200, "agrees in part"), (5000, "differs")])
def test_speed_is_judged_by_the_forces_computed_until_a_search_settles(forces, want):
    ended = [GeneticEnd("a", 0, 1, 1, 1, 9000, forces, 1.0), GeneticEnd("b", 1, 1, 1, 1, 9000, forces, 1.0)]
    found = claims_on_fits.fast(study_of(ended=ended, direct={"0": 500, "1": 1000, "2": 7000}))
    assert list(found.values) == pytest.approx([forces / 1000])
    assert verdict("fast", found) == want


@pytest.mark.parametrize(
    ("median", "worst", "want"),
    [(0.03, 0.05, "agrees"), (0.03, 0.15, "agrees in part"), (0.03, 4.19, "differs"), (0.2, 0.4, "differs")],
)
def test_generalisation_is_judged_by_the_worst_run_too(median, worst, want):
    found = claims_on_fits.generalisation(study_of(contenders={LITERAL: scored(median=median, worst=worst)}))
    assert list(found.values) == pytest.approx([median / 0.02, worst])
    assert verdict("generalisation", found) == want


@pytest.mark.parametrize(
    ("last", "limit", "want"), [(0.1, 0, "agrees"), (0.6, 4, "agrees in part"), (0.9, 12, "differs")]
)
def test_beta_merges_or_not_and_runs_at_the_limit_count(last, limit, want):
    scatter = {1.0: 0.5, 2.0: -0.5, 0.5: 1.0}
    beta = [np.exp(12 + scatter[c.frequency_Hz] * (1 - (1 - last) * c.current_A / 2)) for c in CONDITIONS]
    fit = SimpleNamespace(r2={"agrees": 0.95, "agrees in part": 0.7, "differs": 0.2}[want])
    study = study_of(contenders={LITERAL: scored({"beta": beta}, at_bounds=range(limit))})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(claims_on_fits, "function_of", lambda study, name: fit)
        found = claims_on_fits.beta(study)
    assert found.values[0] == pytest.approx(last)
    assert found.values[2] == pytest.approx(limit / len(CONDITIONS))
    assert verdict("beta", found) == want


@pytest.mark.parametrize(
    ("e1", "e2", "r2", "want"),
    [(5.0, -3.0, 0.95, "agrees"), (5.0, 3.0, 0.95, "agrees in part"), (-5.0, 3.0, 0.3, "differs")],
)
def test_alpha_is_judged_by_the_signs_of_its_plane(e1, e2, r2, want):
    fit = SimpleNamespace(r2=r2, function=SimpleNamespace(form="plane", coefficients=(1.0, 2.0, e1, e2, 3.0)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(claims_on_fits, "function_of", lambda study, name: fit)
        found = claims_on_fits.alpha(study_of())
    assert list(found.values) == [np.sign(e1), np.sign(e2), r2]
    assert verdict("alpha", found) == want


def test_mass_is_judged_by_fit_spread_and_sign():
    m = np.array([10 / c.frequency_Hz + 100 * (c.amplitude_m - 0.02) for c in CONDITIONS])
    fit = SimpleNamespace(r2=0.95, function=SimpleNamespace(form="mass-exponential"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(claims_on_fits, "function_of", lambda study, name: fit)
        found = claims_on_fits.mass(study_of(contenders={LITERAL: scored({"m": m})}))
        below = claims_on_fits.mass(study_of(contenders={LITERAL: scored({"m": m - 20})}))
    assert found.values[1] == pytest.approx(3.0 / np.mean(np.abs(m)))
    assert found.values[2] == pytest.approx(m.min())
    assert verdict("mass", found) == "agrees in part"
    assert below.values[2] < 0


def test_presets_are_judged_by_what_is_left_and_not_by_the_effect():
    def effects(n, asymmetry, A):
        effects = [
            OneAtATime("n", 0.1, 0.9, n),
            OneAtATime("asymmetry", 0.1, 0.9, asymmetry),
            OneAtATime("A", 0.1, 0.9, A),
        ]
        return study_of(sensitivity=effects)

    assert verdict("presets", claims_on_fits.presets(effects(0.01, 0.01, 1e-12))) == "agrees"
    assert verdict("presets", claims_on_fits.presets(effects(0.04, 0.01, 1e-12))) == "agrees in part"
    assert verdict("presets", claims_on_fits.presets(effects(0.4, 0.4, 0.4))) == "differs"
    assert verdict("presets", claims_on_fits.presets(study_of(sensitivity=()))) == "cannot be checked"


def test_rising_shares_count_steps_at_one_motion_and_at_one_amplitude():
    energy = [c.current_A + c.frequency_Hz for c in CONDITIONS]
    assert claims_on_tests.rising_shares(CONDITIONS, energy) == (1.0, 1.0)
    by_current, by_frequency = claims_on_tests.rising_shares(CONDITIONS, [-e for e in energy])
    assert (by_current, by_frequency) == (0.0, 0.0)
    mixed = [c.current_A - c.frequency_Hz for c in CONDITIONS]
    assert claims_on_tests.rising_shares(CONDITIONS, mixed) == (1.0, 0.0)
    assert np.isnan(claims_on_tests.rising_shares(CONDITIONS[:5], energy[:5])[1])


@pytest.mark.parametrize(("force", "ratio"), [(lambda m: m.velocity, 1 / 0.6), (lambda m: np.sign(m.velocity), 1.0)])
def test_a_bulge_is_the_width_at_mid_stroke_over_that_further_out(force, ratio):
    motion = sine(Condition(1.0, 1.0, 0.02), 4, 2000)
    run = Run("one", motion.time, motion.displacement, 300 * force(motion) + 5 * motion.displacement, 1.0)
    assert claims_on_tests.bulge(run) == pytest.approx(ratio, rel=0.01)


def test_factors_are_symmetric_and_the_spread_is_over_amplitudes_only():
    assert [claims_on_fits.miss_factor(ratio) for ratio in (2.0, 0.5, 1.0)] == pytest.approx([2.0, 2.0, 1.0])
    values = np.array([100 * c.amplitude_m + 7 * c.frequency_Hz for c in CONDITIONS])
    assert claims_on_fits.amplitude_spread(CONDITIONS, values) == pytest.approx(3.0 / np.mean(values))
    first, last = claims_on_fits.scatter_over_motions(
        CONDITIONS, np.array([c.frequency_Hz * (1 + c.current_A) for c in CONDITIONS])
    )
    assert last == pytest.approx(3 * first)
