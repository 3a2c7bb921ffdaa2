"""What claims read off runs and results, on made ones whose numbers were put in."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mrdamper.data import Condition, Run
from mrdamper.paper import claims, claims_on_fits, claims_on_tests
from mrdamper.paper import results as found_module
from mrdamper.paper.claims import check_claims
from mrdamper.paper.claims_on_tests import Measured, friction_along, lost_length
from mrdamper.paper.options import ALI, CONSISTENT, DIRECT, LITERAL
from mrdamper.paper.results import GeneticEnd, function_of
from mrdamper.physics.motion import measured_motion, sine, triangle


def study_of(contenders=(), **more):
    made = SimpleNamespace(rig=None, seed_verdicts={}, **more)
    made.contender = lambda title: dict(contenders).get(title)
    return made


def loop(current=1.0, frequency=1.0, amplitude=0.02, peak=500.0, energy=10.0):
    return SimpleNamespace(
        condition=Condition(current, frequency, amplitude), peak_force=peak, dissipated_energy=energy
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_friction_is_half_the_force_between_the_strokes_where_both_were_measured(sign):
    motion = triangle(Condition(0.0, 0.01, 0.02), 1.25, 4000)
    x = sign * motion.displacement
    size = 50 + 1000 * x  # [N]
    force = size * np.sign(sign * motion.velocity) + 3e3 * x + 1e6 * x**2 + 120.0
    found, friction = friction_along(Run("slow", motion.time, x, force, 0.0))
    assert found.size == 80
    assert (found[0], found[-1]) == pytest.approx(
        (-0.018, 0.018), abs=8e-4
    )  # less a twentieth a side, and what fills no bin
    assert np.all(np.diff(found) > 0)
    assert friction == pytest.approx(50 + 1000 * found, abs=0.5)


def test_noise_of_the_samples_is_averaged_before_strokes_are_compared():
    """2000 samples a stroke in 60 means: 20 N of noise leave some 2.5 N."""
    motion = triangle(Condition(0.0, 0.01, 0.02), 1.25, 4000)
    noise = 20 * np.random.default_rng(0).standard_normal(motion.time.size)
    _, friction = friction_along(
        Run("slow", motion.time, motion.displacement, 50 * np.sign(motion.velocity) + noise, 0.0)
    )
    assert np.std(friction - 50) < 5


def test_friction_is_compared_where_both_strokes_were():
    x = np.concatenate([np.linspace(0, -0.02, 500), np.linspace(-0.02, 0.02, 2000), np.linspace(0.02, -0.01, 1500)])
    force = 60 * np.sign(np.gradient(x)) + 2e3 * x
    found, friction = friction_along(Run("slow", np.arange(x.size) / 100, x, force, 0.0))  # type: ignore[arg-type]
    assert (found[0], found[-1]) == pytest.approx((-0.01 + 0.0015, 0.02 - 0.0015), abs=8e-4)
    assert friction == pytest.approx(60, abs=0.5)
    found, _ = friction_along(Run("slow", np.arange(x.size) / 100, -x, -force, 0.0))  # type: ignore[arg-type]
    assert (found[0], found[-1]) == pytest.approx((-0.02 + 0.0015, 0.01 - 0.0015), abs=8e-4)


def test_mid_stroke_is_a_third_of_the_stroke_either_side():
    A, L = 0.03, 0.02
    motion = sine(Condition(1.0, 1.0, A), 4, 8000)
    path, x = motion.path, motion.displacement
    size = np.minimum(path.distance / L, 1) * (1 + np.abs(x) / A)
    run = Run("one", motion.time, x + 0.05, 400 * path.direction * size, 1.0, window=(1.0, float(motion.time[-1])))
    # Of a sine the phases within 0.3 X are even: the middle one lies at sin(asin(0.3)/2).
    full = 0.9 * (1 + np.sin(np.arcsin(0.3) / 2))
    ways = np.linspace(0, L, 4001)
    expected = ways[np.flatnonzero(ways / L * (1 + (A - ways) / A) >= full)[0]]
    assert lost_length(run, 0.0) == pytest.approx(expected, rel=3e-3)


def reversals(lengths, damping=800.0, full=400.0, offset=90.0):
    """A sine whose force is back over a length [m] after every reversal, a length a stroke."""
    motion = sine(Condition(1.0, 1.0, 0.03), 4, 4000)
    path = motion.path
    length = np.array([lengths[k % len(lengths)] for k in path.stroke])
    force = full * path.direction * np.minimum(path.distance / length, 1) + damping * motion.velocity + offset
    return Run("one", motion.time, motion.displacement + 0.004, force, 1.0, window=(1.0, float(motion.time[-1])))


def test_the_lost_length_ends_where_nine_tenths_of_the_force_beyond_the_viscous_one_are_back():
    assert lost_length(reversals([0.005]), 800.0) == pytest.approx(0.9 * 0.005, rel=0.01)
    assert lost_length(reversals([0.010], full=100.0), 800.0) == pytest.approx(0.9 * 0.010, rel=0.01)
    # One stroke in six is slow to recover: the median does not care.
    assert lost_length(reversals([0.005] * 5 + [0.02]), 800.0) == pytest.approx(0.9 * 0.005, rel=0.02)
    # Strokes 3, 4 and 5 lie whole in the window; the ones cut off at its ends do not count.
    some = replace(reversals([0.02, 0.02, 0.02, 0.003, 0.005, 0.008, 0.02, 0.02, 0.02]), window=(1.0, 3.0))
    assert lost_length(some, 800.0) == pytest.approx(0.9 * 0.005, rel=0.05)
    # Without the viscous force taken out, the force at mid-stroke counts for more.
    assert lost_length(reversals([0.005]), 0.0) > 0.0055
    assert measured_motion(reversals([0.005])).path.stroke[-1] >= 7


def test_a_bulge_on_one_stroke_alone_is_seen_there():
    motion = sine(Condition(1.0, 1.0, 0.02), 4, 2000)
    run = Run("one", motion.time, motion.displacement, 300 * np.maximum(motion.velocity, 0) + 7.0, 1.0)
    assert claims_on_tests.bulge(run) == pytest.approx(1 / 0.6, rel=0.01)


def test_the_width_is_taken_at_one_place_of_both_strokes():
    motion = sine(Condition(1.0, 1.0, 0.02), 4, 2000)
    run = Run("one", motion.time, motion.displacement, (1 + motion.displacement / 0.02) * np.sign(motion.velocity), 1.0)
    assert claims_on_tests.bulge(run) == pytest.approx(2.0 / 3.6, rel=0.01)


def test_the_largest_spread_over_amplitudes_counts_and_three_motions_are_enough():
    conditions = [Condition(1.0, f, A) for f in (1.0, 2.0) for A in (0.01, 0.02)] + [Condition(0.5, 1.0, 0.03)]
    assert claims_on_fits.amplitude_spread(conditions, np.array([10.0, 12.0, 10.0, 17.0, 11.0])) == pytest.approx(
        7 / 12
    )
    assert np.isnan(claims_on_fits.amplitude_spread(conditions[-1:], np.array([10.0])))
    three = [Condition(I, f, 0.01) for I in (0.0, 1.0, 2.0) for f in (1.0, 2.0, 3.0)]
    first, last = claims_on_fits.scatter_over_motions(three, np.array([1.0, 2.0, 3.0, 0.0, 9.0, 0.0, 2.0, 4.0, 6.0]))
    assert last / first == pytest.approx(2.0)
    assert np.isnan(claims_on_fits.scatter_over_motions(three[:5], np.arange(5.0))[0])
    # A level with two motions does not count; two levels with three do.
    found = claims_on_fits.scatter_over_motions(three[1:], np.array([9.0, 0.0, 0.0, 9.0, 0.0, 2.0, 4.0, 6.0]))
    assert found == pytest.approx((np.std([0.0, 9.0, 0.0]), np.std([2.0, 4.0, 6.0])))
    negative = claims_on_fits.amplitude_spread(conditions, np.array([-10.0, -12.0, 10.0, 17.0, 11.0]))
    assert negative == pytest.approx(7 / 12)


def test_gas_and_friction_are_measured_where_they_were_tested():
    asked = []
    gas = SimpleNamespace(taylor_error=lambda X: asked.append(X) or 0.013)
    found = claims_on_tests.gas_series(study_of(gas=gas, loops=[loop(amplitude=A) for A in (0.02, 0.08, 0.05)]))
    assert (asked, found.values) == ([0.08], (0.013,))
    assert "±80 mm" in found.evidence
    assert "not known" in claims_on_tests.gas_series(study_of(gas=None)).evidence
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(claims_on_tests, "friction_along", lambda run: (None, np.array([30.0, 45.0, 90.0])))
        options = SimpleNamespace(friction_test="filled")
        found = claims_on_tests.friction(
            study_of(friction=1, loops=[loop(peak=P) for P in (900.0, 550.0)], options=options)
        )
    assert list(found.values) == pytest.approx([30.0, 90.0, 55.0 / 550.0])
    assert found.evidence == "test with fluid"
    assert claims_on_tests.friction(study_of(friction=None)).values == ()


def test_shares_of_loops_and_of_steps_are_counted():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(claims_on_tests, "bulge", lambda run: run)
        found = claims_on_tests.bulges(study_of(train=[0.9, 1.1, 1.2, 1.3]))
    assert found.values == (0.75,)
    assert found.evidence == "ratio of widths 0.9–1.3"
    energies = {(0.0, 1.0): 5.0, (1.0, 1.0): 9.0, (0.0, 2.0): 7.0, (1.0, 2.0): 9.5}
    loops = [loop(I, f, energy=E) for (I, f), E in energies.items()]
    found = claims_on_tests.energy(study_of(loops=loops))
    assert list(found.values) == [1.0, 1.0]
    assert found.evidence == "5–9.5 J per cycle"
    falling = claims_on_tests.energy(study_of(loops=[*loops, loop(2.0, 1.0, energy=1.0)][::-1]))
    assert list(falling.values) == pytest.approx([2 / 3, 1.0])


def test_the_phase_counts_runs_in_the_band_and_the_motion_that_changes_most():
    conditions = [Condition(I, f, 0.02) for f in (1.0, 2.0) for I in (0.0, 1.0)] + [Condition(0.0, 0.5, 0.05)]
    readings = [SimpleNamespace(phase=p) for p in (1.41, 1.45, 1.45, 1.30, 1.2)]
    above = claims_on_tests.phase(
        study_of(conditions=conditions, readings=[*readings[:4], SimpleNamespace(phase=1.55)])
    )
    assert above.values[0] == 3 / 5
    found = claims_on_tests.phase(study_of(conditions=conditions, readings=readings))
    assert list(found.values) == pytest.approx([3 / 5, 0.15])
    assert found.evidence == f"1.2–1.45 rad; smallest sine {np.sin(1.2):.3f}"


def test_the_stroke_end_compares_the_fastest_with_the_slowest_motion_at_the_highest_current():
    speeds = {"slow": 0.5, "fast": 2.0, "middle": 1.0, "other": 9.0}
    conditions = [Condition(2.0 if name != "other" else 1.95, f, 0.02) for name, f in speeds.items()]
    models = [SimpleNamespace(c=100.0 + n, k1=900.0 + n, m=8.0) for n in range(4)]
    consistent = SimpleNamespace(identifications=[SimpleNamespace(model=m) for m in models])
    # In phase are k1 − m ω².
    lengths = {
        ("slow", 100.0, round(900 - 8 * (2 * np.pi * 0.5) ** 2, 6)): 0.002,
        ("fast", 101.0, round(901 - 8 * (2 * np.pi * 2.0) ** 2, 6)): 0.005,
    }
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(claims_on_tests, "lost_length", lambda run, c, k: lengths[run, c, round(k, 6)])
        study = study_of({CONSISTENT: consistent}, conditions=conditions, train=list(speeds))
        found = claims_on_tests.stroke_end(study)
    assert list(found.values) == pytest.approx([2.5])
    assert found.evidence.startswith("at 2 A 90 % of the hysteretic force is back after 2.00 mm at 0.06 m/s")
    assert found.evidence.endswith("after 5.00 mm at 0.25 m/s")
    alike = study_of({CONSISTENT: consistent}, conditions=[Condition(2.0, 1 + 0.05 * n, 0.02) for n in range(4)],
                     train=list(speeds))  # fmt: skip
    assert claims_on_tests.stroke_end(alike).evidence == "one speed at the highest current"


def test_a_claim_is_said_with_its_numbers_and_what_was_built_in_is_recovered():
    asked = []

    def measure(study):
        asked.append(study)
        return Measured.of(0.995, evidence="more")

    limits = claims.ROWS["quadratic"].limits
    virtual = study_of()
    virtual.rig, virtual.seed_verdicts = "rig", {"quadratic": ("agrees", "differs")}

    def judged(kind, study):
        row = claims._Row("the text", "Eq. 23", "fig11", kind, measure, limits)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(claims, "ROWS", {"quadratic": row})
            return check_claims(study)[0]

    built_in, open_, values = (judged(kind, virtual) for kind in ("built in", "method", "damper"))
    real = judged("built in", study_of())
    assert (built_in.verdict, built_in.said) == ("agrees", "recovered (built into the virtual damper)")
    assert open_.said == "agrees with the paper on the virtual damper"
    assert real.said == "agrees with the paper on this damper"
    assert (values.verdict, values.said) == ("not checked", "not decided: the damper is virtual")
    assert (built_in.key, built_in.text, built_in.source, built_in.figure) == (
        "quadratic",
        "the text",
        "Eq. 23",
        "fig11",
    )
    assert built_in.evidence == "least R² of a motion 0.995; more"
    assert built_in.threshold == "least R² of a motion ≥ 0.98 (in part: ≥ 0.9)"
    assert (built_in.seeds, real.seeds) == ("1 of 2; 1 differs", "")


def test_every_claim_points_to_a_figure_that_is_drawn_and_stands_once():
    from mrdamper.paper.figures import FIGURES

    assert len(claims.ROWS) == 19
    assert {row.figure for row in claims.ROWS.values()} <= {*FIGURES, ""}
    assert {key for key, row in claims.ROWS.items() if row.kind == "built in"} == {
        "gas series", "stroke end", "saturation",
    }  # fmt: skip


def test_searches_are_judged_parameter_by_parameter_with_the_worst_beside():
    ends = ((2.0, 0.1, 1.0), (0.5, 8.0, 1.2), (3.0, 5.0, 1.1))
    ended = [GeneticEnd(str(i), i, *end, 9, 5, 1.0) for i, end in enumerate(ends)]
    found = claims_on_fits.search(study_of(ended=ended))
    assert found.values == pytest.approx((2.0, 8.0))
    assert found.evidence == "3 runs, a seed each; worst factors 3 and 10; largest error over the least 1.2"


def test_what_cannot_be_measured_says_why():
    one = SimpleNamespace(identifications=(), validation=SimpleNamespace(runs=()))
    for contenders in ({}, {LITERAL: one}, {ALI: one}, {LITERAL: one, ALI: one}):
        assert "could not be followed" in claims_on_fits.few_parameters(study_of(contenders)).evidence
    for contenders in ({}, {LITERAL: one}, {DIRECT: one}, {LITERAL: one, DIRECT: one}):
        assert "no validation run" in claims_on_fits.accuracy(study_of(contenders)).evidence
        assert "no genetic searches" in claims_on_fits.fast(study_of(contenders, ended=(), direct={"0": 7})).evidence
    assert "could not be followed" in claims_on_fits.generalisation(study_of({LITERAL: one})).evidence


@pytest.mark.parametrize("form", [None, "plane", "mass-power"])
def test_a_mass_that_was_held_or_has_another_function_is_not_judged(form):
    fit = form and SimpleNamespace(r2=0.95, function=SimpleNamespace(form=form))
    held = SimpleNamespace(identifications=[SimpleNamespace(model=SimpleNamespace(m=4.0))] * 2)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(claims_on_fits, "function_of", lambda study, name: fit)
        found = claims_on_fits.mass(study_of({LITERAL: held}, conditions=[Condition(0, 1, 1), Condition(0, 2, 1)]))
    assert found.values == ()
    assert "m is held" in found.evidence


def test_time_and_accuracy_are_ratios_of_ours_to_theirs():
    ended = [GeneticEnd(name, 0, 1, 1, 1, 99, forces, 1.0) for name, forces in (("a", 10), ("b", 30), ("c", 90))]
    found = claims_on_fits.fast(study_of(ended=ended, direct={"0": 10, "1": 15, "2": 90}))
    assert list(found.values) == [2.0]
    assert found.evidence.startswith("median 30 forces computed against 15")
    worst = {"scores": SimpleNamespace(nrmse_pp=0.174), "condition": Condition(2.0, 1.0, 0.08)}
    literal = SimpleNamespace(
        validation=SimpleNamespace(runs=(1,), median=lambda: 0.156, worst=lambda: SimpleNamespace(**worst)), per_run=0.1
    )
    ali = SimpleNamespace(
        validation=SimpleNamespace(
            runs=(1,),
            median=lambda: 0.04,
            worst=lambda: SimpleNamespace(**{**worst, "scores": SimpleNamespace(nrmse_pp=0.099)}),
        ),
        parameters_per_run=8,
    )
    found = claims_on_fits.few_parameters(study_of({LITERAL: literal, ALI: ali}))
    assert list(found.values) == pytest.approx([3.9, 0.25])
    assert found.evidence.startswith("validation 15.6 % against 4.0 %; worst 17.4 % and 9.9 %; 2 searched against 8")
    ali.parameters_per_run = 1
    assert claims_on_fits.few_parameters(study_of({LITERAL: literal, ALI: ali})).values == pytest.approx((3.9, 2.0))
    empty = SimpleNamespace(validation=SimpleNamespace(runs=()))
    for pair in ({LITERAL: empty, ALI: ali}, {LITERAL: literal, ALI: empty}, {LITERAL: literal}, {ALI: ali}):
        assert "no validation run" in claims_on_fits.few_parameters(study_of(pair)).evidence
    found = claims_on_fits.generalisation(study_of({LITERAL: literal}))
    assert list(found.values) == pytest.approx([1.56, 0.174])
    assert found.evidence == "median 15.6 %, worst 17.4 % at 2 A, 1 Hz, 80 mm"


def test_slopes_of_the_saturation_are_in_newtons_an_ampere_and_motions_are_averaged():
    conditions = [Condition(I, f, 0.02) for f in (1.0, 2.0) for I in (0.0, 0.5, 1.0, 1.5, 2.0)]
    readings = [
        SimpleNamespace(amplitude=100 * c.frequency_Hz + 800 * min(c.current_A, 1.5) + 80 * max(c.current_A - 1.5, 0))
        for c in conditions
    ]
    found = claims_on_tests.saturation(study_of(conditions=conditions, readings=readings))
    assert list(found.values) == pytest.approx([0.1])
    assert found.evidence == "F0 rises by 800 N/A up to 1 A and by 80 N/A above 1.5 A"
    some = [c for c in conditions if c.current_A <= 1.0]
    assert "tested up to 1 A" in claims_on_tests.saturation(study_of(conditions=some, readings=readings[:6])).evidence


def test_two_currents_on_either_side_are_enough_for_the_saturation():
    conditions = [Condition(I, 1.0, 0.02) for I in (0.5, 1.0, 1.5, 2.0)]
    readings = [SimpleNamespace(amplitude=F) for F in (300.0, 700.0, 900.0, 980.0)]
    found = claims_on_tests.saturation(study_of(conditions=conditions, readings=readings))
    assert list(found.values) == pytest.approx([0.2])


def made_of(**values):
    numbers = [dict(zip(values, row, strict=True)) for row in zip(*values.values(), strict=True)]
    return SimpleNamespace(identifications=[SimpleNamespace(model=SimpleNamespace(**n), at_bounds=()) for n in numbers])


def test_the_closed_form_is_compared_where_both_balances_were_followed():
    both = {LITERAL: made_of(c=[200.0, 300.0, 900.0]), CONSISTENT: made_of(c=[100.0] * 3)}
    assert list(claims_on_fits.viscosity(study_of(both)).values) == [3.0]
    for pair in ({LITERAL: both[LITERAL], CONSISTENT: made_of(c=[100.0])}, {CONSISTENT: both[CONSISTENT]}, {}):
        assert "could not be followed" in claims_on_fits.viscosity(study_of(pair)).evidence


def test_functions_are_those_of_the_literal_recipe(monkeypatch):
    fit = SimpleNamespace(functions={"alpha": "its function"})
    monkeypatch.setattr(found_module, "ModifiedFit", SimpleNamespace)
    assert function_of(study_of({LITERAL: SimpleNamespace(fit=fit)}), "alpha") == "its function"
    assert function_of(study_of({LITERAL: SimpleNamespace(fit=fit)}), "beta") is None
    assert function_of(study_of({CONSISTENT: SimpleNamespace(fit=fit)}), "alpha") is None
    assert function_of(study_of({LITERAL: SimpleNamespace(fit=None)}), "alpha") is None
    assert "too few motions" in claims_on_fits.alpha(study_of()).evidence
    assert "could not be followed" in claims_on_fits.beta(study_of()).evidence
    monkeypatch.setattr(claims_on_fits, "function_of", lambda study, name: SimpleNamespace(r2=0.9, function="any"))
    assert "could not be followed" in claims_on_fits.beta(study_of()).evidence
    monkeypatch.setattr(
        claims_on_fits, "function_of", lambda study, name: SimpleNamespace(function=SimpleNamespace(form="tilt"))
    )
    assert "too few motions" in claims_on_fits.alpha(study_of()).evidence


def test_the_scatter_of_beta_is_that_of_its_logarithm(monkeypatch):
    monkeypatch.setattr(claims_on_fits, "function_of", lambda study, name: SimpleNamespace(r2=0.9))
    conditions = [Condition(I, f, 0.01) for I in (0.0, 1.0) for f in (1.0, 2.0, 3.0)]
    # Betas about one: the logarithm of one more would be another.
    study = study_of({LITERAL: made_of(beta=[0.1, 1.0, 10.0, 1.0, 2.0, 4.0])}, conditions=conditions)
    found = claims_on_fits.beta(study)
    ratio = np.std(np.log([1.0, 2.0, 4.0])) / np.std(np.log([0.1, 1.0, 10.0]))
    assert list(found.values) == pytest.approx([ratio, 0.9, 0.0])


def test_a_quadratic_needs_four_currents_at_a_motion():
    conditions = [Condition(I, 1.0, 0.02) for I in (0.0, 0.5, 1.0)] + [Condition(I, 3.0, 0.02) for I in (0.0, 1.0)]
    readings = [SimpleNamespace(amplitude=100.0 + 50 * n) for n in range(5)]
    three = claims_on_tests.quadratic(study_of(conditions=conditions, readings=readings))
    assert three.values == ()
    assert three.evidence.startswith("none of 2 motions was tested at 4 currents or more")
