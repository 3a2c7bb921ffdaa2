"""Coefficients of the "-type" dampers come back from models made by them; formulas of the start written once more."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mrdamper.dampers.envelope import Envelope
from mrdamper.dampers.piece import Pieces
from mrdamper.dampers.published import all_published
from mrdamper.dampers.published.base import AT_BOUNDS, fit_quadratic
from mrdamper.data import Condition, Run
from mrdamper.errors import IdentificationError, ParameterError
from mrdamper.models.bingham import Bingham
from mrdamper.models.guo import Guo
from mrdamper.physics.motion import sine

CURRENTS = (0.0, 0.3, 0.9, 1.7)
MOTIONS = ((0.5, 0.03), (1.1, 0.012), (2.2, 0.02), (1.1, 0.006))
CONDITIONS = [Condition(I, f, A) for I in CURRENTS for f, A in MOTIONS]
# Geometric middle of the motions, and the lowest current that is not zero.
REFERENCE = Condition(0.3, math.prod(f for f, _ in MOTIONS) ** 0.25, math.prod(A for _, A in MOTIONS) ** 0.25)
ALI = {
    "c10": 2e4, "c11": 1e4, "c12": -1e3, "c1_p": -0.1, "c1_q": 0.2,
    "c00": 900.0, "c01": 800.0, "c02": 50.0, "c0_p": 0.3, "c0_q": -0.15,
    "yield_force0": 200.0, "yield_force1": 700.0, "yield_force2": -50.0, "yield_force_p": 0.25, "yield_force_q": 0.35,
    "k0": 2e3, "k1": 300.0, "f0": 40.0, "yield_displacement_log": math.log(2e-4),
}  # fmt: skip
LEI = {
    "cpo0": 500.0, "cpo1": 300.0, "cpo2": -40.0, "cpr0": 9e3, "cpr1": 7e3, "cpr2": 600.0, "fy0": 100.0, "fy1": 800.0,
    "fy2": -90.0, "v00": 2e-3, "v01": 3e-3, "v02": -5e-4, "f0": 25.0,
}  # fmt: skip
DOMINGUEZ = {
    "c1": 900.0, "c2": 500.0, "c3": 3.0, "c4": 300.0, "alpha1": 2e6, "alpha2": 4e6, "alpha3": 3.0, "alpha4": 8e5,
    "d2": 0.15, "d4": 0.4, "beta": 4e6, "gamma1": 4e6, "gamma2": 0.0, "k1": 700.0, "k2": 300.0, "f0": 47.0,
}  # fmt: skip
LV = {"fy0": 150.0, "fy1": 900.0, "fy2": -80.0, "m": 0.7, "consistency_log": 7.8, "f0": -12.0}


def identified(models, conditions=CONDITIONS):
    return [SimpleNamespace(rig="bench", model=m, condition=c) for m, c in zip(models, conditions, strict=True)]


def regressed(name, coefficients, conditions=CONDITIONS):
    """Coefficients from the models that a damper with known ones has at the conditions."""
    cls = all_published()[name]
    truth = cls(coefficients, REFERENCE, rig="bench", envelope=Envelope.of(conditions))
    return cls.regressed(
        identified([truth.model_at(c) for c in conditions], conditions), {"identification runs": "16"}
    ), truth


def close(found, wanted):
    assert {name: found[name] for name in wanted} == pytest.approx(wanted, rel=1e-6, abs=1e-6)


def test_ali():
    found, _ = regressed("ali-type", {**ALI, "c1_floor": 1e-3, "c0_floor": 1e-3, "yield_force_floor": 1e-3})
    close(found.coefficients, ALI)
    # A fifth of the least value at a tested current keeps the quadratic from dipping below zero between them.
    for name in ("c0", "c1", "yield_force"):
        level = [ALI[f"{name}0"] + ALI[f"{name}1"] * I + ALI[f"{name}2"] * I**2 for I in CURRENTS]
        assert found.coefficients[f"{name}_floor"] == pytest.approx(0.2 * min(level), rel=1e-6)
    assert found.parameter_count == len(ALI)


def test_the_reference_is_the_middle_of_the_motions_and_everything_is_kept():
    found, _ = regressed("lei-type", LEI)
    reference = found.reference
    assert (reference.current_A, reference.frequency_Hz, reference.amplitude_m) == pytest.approx(
        (0.3, REFERENCE.frequency_Hz, REFERENCE.amplitude_m)
    )
    close(found.coefficients, LEI)
    assert (found.rig, dict(found.provenance)) == ("bench", {"identification runs": "16"})
    assert found.envelope == Envelope.of(CONDITIONS)
    assert {n: found.numbers[n] for n in ("I_r", "f_r", "A_r", "fy0")} == pytest.approx(
        {"I_r": 0.3, "f_r": REFERENCE.frequency_Hz, "A_r": REFERENCE.amplitude_m, "fy0": 100.0}
    )
    dark = [Condition(0.0, c.frequency_Hz, c.amplitude_m) for c in CONDITIONS]
    assert regressed("lei-type", LEI, dark)[0].reference.current_A == 1.0


def test_dominguez():
    found, _ = regressed("dominguez-type", DOMINGUEZ)
    close(found.coefficients, DOMINGUEZ)


def test_dominguez_keeps_the_yield_force_where_gamma_falls_with_the_current():
    conditions = [c for c in CONDITIONS if c.current_A != 0.9]  # as many currents as the law has levels
    found, truth = regressed("dominguez-type", {**DOMINGUEZ, "gamma1": 3e6, "gamma2": 1e6}, conditions)
    for condition in conditions:
        wanted, model = truth.model_at(condition), found.model_at(condition)
        assert model.yield_force == pytest.approx(wanted.yield_force, rel=1e-4)  # gamma stops at beta
        assert model.c == pytest.approx(wanted.c, rel=1e-6)
    total = np.repeat([7e6, 7e6 - 0.3e6, 7e6 - 1.7e6], len(MOTIONS))
    currents = np.array([c.current_A for c in conditions])
    beta = float(np.quantile(total, 0.9)) / 2
    line = np.polyfit(currents, np.exp(np.polyval(np.polyfit(currents, np.log(total), 1), currents)) - beta, 1)
    close(found.coefficients, {"beta": beta, "gamma1": float(line[1]), "gamma2": float(-line[0])})


def test_dominguez_at_one_current_has_no_slope():
    conditions = [Condition(0.9, f, A) for f, A in MOTIONS]
    found, truth = regressed("dominguez-type", DOMINGUEZ, conditions)
    for condition in conditions:
        assert found.model_at(condition).yield_force == pytest.approx(truth.model_at(condition).yield_force, rel=1e-6)
    close(found.coefficients, {"k1": 700.0 + 300.0 * 0.9, "k2": 0.0, "gamma1": 4e6, "gamma2": 0.0, "beta": 4e6})


def test_lv_starts_from_the_medians_of_bingham():
    models = [Bingham(fy=150 + 900 * c.current_A, c=1200.0 + n, f0=-12.0 + (n == 3)) for n, c in enumerate(CONDITIONS)]
    found = all_published()["lv-type"].regressed(identified(models))
    speed = np.median([2 * np.pi * c.frequency_Hz * c.amplitude_m for c in CONDITIONS])
    consistency = np.median([1200.0 + n for n in range(16)]) * speed**0.2 / 3
    close(found.coefficients, {"fy0": 150.0, "fy1": 900.0, "fy2": 0.0, "m": 0.8, "f0": -12.0})
    assert found.coefficients["consistency_log"] == pytest.approx(math.log(consistency))


def test_boada_standardises_what_it_learns():
    def model(c):
        return Guo(fy=math.exp(5 + 0.6 * c.current_A), kappa=math.exp(4 - 0.2 * c.frequency_Hz), v0=math.exp(-4.0),
                   c=900 + 100 * c.current_A, k=300 + 4e3 * c.amplitude_m, f0=20 + c.current_A)  # fmt: skip

    found = all_published()["boada-type"].regressed(identified([model(c) for c in CONDITIONS]))
    raw = np.array([(c.current_A, math.log(c.frequency_Hz), math.log(c.amplitude_m)) for c in CONDITIONS])
    outputs = np.array(
        [[math.log(m.fy), math.log(m.kappa), math.log(m.v0), m.c, m.k, m.f0] for m in map(model, CONDITIONS)]
    )
    width = np.where(outputs.std(axis=0) > 1e-9, outputs.std(axis=0), 1.0)
    for name, values in (("centre", raw.mean(0)), ("spread", raw.std(0)), ("middle", np.median(outputs, 0)),
                         ("width", width)):  # fmt: skip
        assert [found.coefficients[f"{name}{i}"] for i in range(len(values))] == pytest.approx(values.tolist()), name
    for condition in CONDITIONS:
        wanted, given = model(condition), found.model_at(condition)
        for name in ("fy", "kappa", "v0", "c", "k"):
            assert getattr(given, name) == pytest.approx(getattr(wanted, name), rel=0.05), name


def test_boada_names_the_weights_at_a_bound_of_their_search(monkeypatch):
    models = [Guo(fy=math.exp(5 + c.current_A), kappa=60.0, v0=0.02, c=900.0, k=300.0, f0=20.0) for c in CONDITIONS]
    cls = all_published()["boada-type"]
    assert AT_BOUNDS not in cls.fit([], identified(models)).provenance
    monkeypatch.setattr("mrdamper.dampers.published.boada._MAX_WEIGHT", 0.5)
    damper = cls.fit([], identified(models))
    ended = {name for name, value in damper.coefficients.items() if name[:6] == "weight" and abs(value) == 0.5}
    assert ended
    assert set(damper.provenance[AT_BOUNDS].split(", ")) == ended


def test_refining_on_runs_finds_the_coefficients_they_were_made_with():
    truth = {"fy0": 150.0, "fy1": 900.0, "fy2": -80.0, "m": 0.7, "consistency_log": math.log(2500.0), "f0": -12.0}
    cls = all_published()["lv-type"]
    runs = []
    for condition in (Condition(I, f, A) for I in (0.0, 0.9, 1.7) for f, A in ((1.0, 0.02), (2.0, 0.005))):
        motion = sine(condition, 2, 101)  # no sample stands still, where the sign of its speed would be chance
        damper = cls(truth, REFERENCE, rig="bench", envelope=Envelope.of(CONDITIONS))
        force = damper.force_along(motion, condition)
        window = (1 / condition.frequency_Hz, float(motion.time[-1]))
        runs.append(Run(f"{condition}", motion.time, motion.displacement, force, condition.current_A, window=window))
    start = {**truth, "fy0": 180.0, "fy1": 800.0, "m": 0.8, "f0": -11.0}
    found = cls(start, REFERENCE, rig="bench", envelope=Envelope.of(CONDITIONS)).refined(runs)
    assert found.coefficients == pytest.approx(truth, rel=0.02)
    assert AT_BOUNDS not in found.provenance
    far = replace(found, coefficients={**truth, "fy1": 300.0}).refined(runs)  # truth is three times the start
    assert "fy1" in far.provenance[AT_BOUNDS].split(", ")


def a_run(condition, cycles=2):
    """A noisy sine that rests first, so that every piece begins with another memory than the last one ended with."""
    motion = sine(condition, cycles, 101)
    force = 2e3 * motion.velocity + 300 * np.tanh(80 * motion.velocity) + 20 * np.sin(7 * motion.time)
    window = (1 / condition.frequency_Hz, float(motion.time[-1]))
    return Run(f"{condition}", motion.time, motion.displacement, force, condition.current_A, window=window)


@pytest.mark.parametrize(("name", "own"), [("lei-type", LEI), ("lv-type", LV), ("dominguez-type", DOMINGUEZ)])
def test_residuals_and_slopes_of_all_runs_at_once_are_those_of_single_ones(name, own, monkeypatch):
    own = {**own, "gamma1": 3.1e6, "gamma2": 2e5} if name == "dominguez-type" else own  # else gamma is beta, a corner
    damper = all_published()[name](own, REFERENCE, envelope=Envelope.of(CONDITIONS))
    pieces = Pieces([a_run(condition) for condition in CONDITIONS])
    exchanged = replace(damper, coefficients=dict(reversed(own.items())))
    assert pieces.residual(exchanged) == pytest.approx(pieces.residual(damper), abs=1e-12)
    at_once, slopes = pieces.residual(damper), pieces.slopes(damper)
    assert slopes is not None, "a compiler is needed"
    monkeypatch.setattr(Pieces, "_along", lambda *_: None)  # one after the other, as without a compiler
    assert at_once == pytest.approx(pieces.residual(damper), abs=1e-12)
    for coefficient, column in zip(own, slopes.T, strict=True):
        step = 1e-6 * max(abs(own[coefficient]), 1e-3)
        moved = [replace(damper, coefficients={**own, coefficient: own[coefficient] + s}) for s in (step, -step)]
        difference = (pieces.residual(moved[0]) - pieces.residual(moved[1])) / (2 * step)
        off = np.abs(column - difference) > 1e-5 * np.abs(difference).max()
        assert np.mean(off) < 0.01, coefficient  # all but the samples that a corner lies between


@pytest.mark.parametrize("currents", [(0.7,), (0.0, 1.0), (0.0, 0.5, 1.0), (0.0, 0.5, 1.0, 2.0)])
def test_a_quadratic_has_as_many_terms_as_there_are_currents(currents):
    terms = min(3, len(currents))
    values = sum(c * np.array(currents) ** k for k, c in enumerate((5.0, -3.0, 7.0)[:terms]))
    found = fit_quadratic("x", np.array(currents), values + np.zeros(len(currents)))
    wanted = (5.0, -3.0, 7.0)[:terms] + (0.0,) * (3 - terms)
    assert [found[f"x{i}"] for i in range(3)] == pytest.approx(wanted, abs=1e-12)


def test_three_identifications_of_its_own_model_are_needed():
    cls = all_published()["lv-type"]
    some = identified([Bingham(fy=1.0, c=1.0, f0=0.0)] * 3, CONDITIONS[:3])
    assert cls.regressed(some).coefficients["fy0"] == pytest.approx(1.0)
    with pytest.raises(IdentificationError, match="2 identifications"):
        cls.regressed(some[:2])
    with pytest.raises(IdentificationError, match="another model"):
        all_published()["lei-type"].regressed(some)


@pytest.mark.parametrize(
    ("name", "own", "common"),
    [
        ("ali-type", {**ALI, "c1_floor": 1.0, "c0_floor": 1.0, "yield_force_floor": 1.0},
         ("k0", "k1", "f0", "yield_displacement_log")),
        ("lei-type", LEI, ("f0",)),
        ("dominguez-type", DOMINGUEZ, ("f0",)),
    ],
)  # fmt: skip
def test_one_run_far_off_moves_no_parameter_that_all_conditions_share(name, own, common):
    cls, envelope = all_published()[name], Envelope.of(CONDITIONS)
    other = cls(own | {n: 0.7 * own[n] for n in common}, REFERENCE, rig="bench", envelope=envelope)
    models = [cls(own, REFERENCE, rig="bench", envelope=envelope).model_at(c) for c in CONDITIONS]
    models[3] = other.model_at(CONDITIONS[3])
    close(cls.regressed(identified(models)).coefficients, {n: own[n] for n in common})


@pytest.mark.parametrize("name", ["ali-type", "lei-type", "lv-type", "dominguez-type"])
def test_a_saved_damper_has_the_same_laws_and_damaged_ones_are_refused(name):
    ali = {**ALI, "c1_floor": 1.0, "c0_floor": 1.0, "yield_force_floor": 1.0}
    own = {"ali-type": ali, "lei-type": LEI, "dominguez-type": DOMINGUEZ, "lv-type": LV}
    cls, envelope = all_published()[name], Envelope.of(CONDITIONS)
    one = cls(own[name], REFERENCE, rig="bench", envelope=envelope)
    saved = one.to_saved()
    again = cls.from_saved(saved, rig="bench", envelope=envelope, provenance={"a": "b"})
    at = Condition(0.7, 0.9, 0.017)
    assert again.model_at(at).values() == one.model_at(at).values()
    assert (again.rig, again.envelope, again.reference, dict(again.provenance)) == (
        "bench", envelope, REFERENCE, {"a": "b"},
    )  # fmt: skip
    missing = replace(saved, coefficients={k: v for k, v in own[name].items() if k != "f0"})
    with pytest.raises(ParameterError, match="coefficients do not fit"):
        cls.from_saved(missing, envelope=envelope)
