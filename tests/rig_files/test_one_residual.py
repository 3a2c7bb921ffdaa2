"""The residual of the mean cycle: every kind of fault is found at a size that matters, none in clean records."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.signal

from mrdamper.data import Condition, Run
from mrdamper.errors import QualityError
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.physics.motion import sine
from mrdamper.physics.simulation import simulate
from mrdamper.rig_files.quality.cycles import POINTS, damping, elastic_plastic, steady_cycles
from mrdamper.rig_files.quality.disturbance import noise_by_octave
from mrdamper.rig_files.quality.lag import force_channel, force_lag
from mrdamper.rig_files.quality.motion import agrees_with_its_name
from mrdamper.rig_files.quality.samples import no_bit_is_stuck
from mrdamper.rig_files.quality.table import check_run, record_of
from mrdamper.rig_files.quality.view import View
from mrdamper.rig_files.record import Record

sys.path.insert(0, str(Path(__file__).parents[2]))
from fuzz import operator_faults
from fuzz.fuzz_records import (
    CRASHED,
    GOALS,
    LARGE,
    MODERATE,
    clean_records,
    codes_of,
    damping_and_peak,
    false_alarms,
    share_found,
    table,
    trials,
)
from fuzz.record_faults import KINDS, UNOBSERVABLE
from fuzz.synthetic_records import FAMILIES, OTHERS, clean_record

PHASE = 2 * np.pi * np.arange(POINTS) / POINTS


def sine_record(force=None, cycles=8, points=200, seed=1):
    """A sine of 20 mm and 1 Hz with the noise of a good rig; the force as a function of displacement and velocity."""
    rng = np.random.default_rng(seed)
    time = np.arange(cycles * points + 1) / points
    x, v = 0.02 * np.sin(2 * np.pi * time), 0.04 * np.pi * np.cos(2 * np.pi * time)
    force = (1500 * v + 300 * np.tanh(v / 0.01)) if force is None else force(x, v)
    noise = rng.standard_normal((2, time.size))
    return Record("r", time, x + 2e-6 * noise[0], force + 2.0 * noise[1])


# Laws


@pytest.mark.parametrize("bend", [0.003, 0.03, 0.3, 0.9])
def test_the_steady_elastic_plastic_loop_is_that_of_the_sequential_element(bend):
    x, rising = np.sin(PHASE), np.cos(PHASE) > 0
    state, states = 0.0, []
    for step in np.diff(np.concatenate([x, x, x, x[:1]])):
        state = min(max(state + step / bend, -1.0), 1.0)
        states.append(state)
    expected = np.array(states[2 * POINTS - 1 : 3 * POINTS - 1])
    inside = np.abs(np.cos(PHASE)) > 0.1  # the reversal itself lies between two phases
    np.testing.assert_allclose(elastic_plastic(x, rising, np.array([bend]))[inside, 0], expected[inside], atol=2e-3)


@pytest.mark.parametrize(("c", "bend"), [(200.0, 0.05), (3000.0, 0.3), (1.0, 0.02)])
def test_the_damping_of_a_known_loop_is_recovered(c, bend):
    x, v = 0.02 * np.sin(PHASE), 0.12 * np.cos(PHASE)
    loop = elastic_plastic(x, v > 0, np.array([0.02 * bend]))[:, 0]
    assert damping(x, v, 40 + 900 * x + c * v + 500 * loop) == pytest.approx(c, rel=0.05, abs=30)


def test_offset_gain_and_delay_of_a_cycle_are_recovered():
    record = sine_record(cycles=6)
    late = record.force.copy()
    late[800:1000] = 1.1 * late[800:1000] + 50
    cycles = steady_cycles(View(Record("r", record.time, record.displacement, late)))
    assert cycles is not None
    others = np.delete(cycles.force.gain, 3)
    assert cycles.force.gain[3] - np.mean(others) == pytest.approx(0.1, rel=0.1)
    assert cycles.force.offset[3] - np.mean(np.delete(cycles.force.offset, 3)) == pytest.approx(50, rel=0.1)
    assert np.max(np.abs(cycles.displacement.late)) < 1e-4


def lag_of(record):
    lag = force_lag(View(record))
    assert lag is not None
    assert lag.is_clear
    return lag


def with_corners(x, v):
    return 1500 * v + 300 * np.tanh(v / 0.001)


@pytest.mark.parametrize("share", [-0.08, -0.03, 0.03, 0.08])
def test_the_delay_of_a_force_with_corners_is_recovered_within_its_interval(share):
    record = sine_record(with_corners)
    moved = np.interp(record.time - share, record.time, record.force)
    lag = lag_of(Record("r", *(a[50:-50] for a in (record.time, record.displacement, moved))))
    assert lag.best.constant == 0
    assert lag.best.delay == pytest.approx(share, abs=0.01)
    low, high = lag.interval("delay")
    assert low - 0.0051 <= share <= high + 0.0051


def elastic_plastic_force(bend):
    """A viscous force beside an element that yields at a share of the amplitude of 20 mm."""

    def force(x, v):
        state, states = 0.0, []
        for step in np.diff(x, prepend=x[0]) / (0.02 * bend):
            state = min(max(state + step, -1.0), 1.0)
            states.append(state)
        return 1500 * v + 400 * np.array(states)

    return force


def low_passed(record, constant):
    force, kept = [record.force[0]], np.exp(-(record.time[1] - record.time[0]) / constant)
    for value in record.force[1:]:
        force.append(kept * force[-1] + (1 - kept) * value)
    return replace(record, force=np.array(force))


@pytest.mark.parametrize(("bend", "constant"), [(0.1, 0.02), (0.1, 0.06), (0.03, 0.04)])
def test_the_time_constant_of_a_first_order_filter_is_recovered_within_its_interval(bend, constant):
    lag = lag_of(low_passed(sine_record(elastic_plastic_force(bend)), constant))
    low, high = lag.interval("constant")
    assert low - 0.01 <= constant <= high + 0.02
    assert lag.best.delay == 0


def test_a_filtered_force_is_reported_with_its_effect_on_damping_and_force():
    from mrdamper.rig_files.quality.lag import force_channel

    record = sine_record(elastic_plastic_force(0.1))
    (finding,) = force_channel(View(low_passed(record, 0.06)))
    assert finding.code == "W_LAG"
    for words in ("first-order filter of", "explain it nearly as well", "the damping by about", "the peak force by"):
        assert words in finding.text
    assert damping_and_peak(low_passed(record, 0.06))[0] != pytest.approx(damping_and_peak(record)[0], rel=0.05)


@pytest.mark.parametrize("bend", np.geomspace(0.003, 0.5, 24))
def test_a_clean_element_of_any_yield_displacement_is_not_late(bend):
    lag = force_lag(View(sine_record(elastic_plastic_force(bend))))
    assert lag is None or not lag.is_clear


def jumping(jump, at):
    """A viscous force beside friction that changes by `jump` [N] where the piston passes a place."""

    def force(x, v):
        return 3000 * v + (600 + jump * (x > at)) * np.tanh(v / 0.01)

    return force


@pytest.mark.parametrize("size", np.linspace(0.05, 0.18, 8))
def test_a_stuck_bit_skips_levels_of_the_force(size):
    kind = next(kind for kind in operator_faults.KINDS if kind.name == "bit of the force stuck")
    assert "W_COARSE" in codes_of(kind.change(sine_record(points=1000), size, np.random.default_rng(3)))


@pytest.mark.parametrize("step", [30.0, 40.0])
def test_a_step_of_a_coarse_converter_is_reported_as_no_stuck_bit(step):
    record = sine_record(points=1000)
    rounded = replace(record, force=step * np.round(record.force / step))
    (finding,) = no_bit_is_stuck(View(rounded))
    assert finding.text.startswith(f"the force changes in steps of {step:g} N, ")


@pytest.mark.parametrize("jump", [-300, -100, -60, 60, 100, 300])
@pytest.mark.parametrize("at", [-0.006, 0.0, 0.006])
def test_a_force_that_leaps_by_itself_skips_no_level(jump, at):
    assert "W_COARSE" not in codes_of(sine_record(jumping(jump, at)))


def leaking(leak, stiffness, power):
    """A yield force of 1400 N that builds up over a leak velocity [m/s], in series with a spring [N/m]."""

    def force(x, v):
        def dashpot(w):
            share = abs(w) / leak
            return np.sign(w) * (1400 * np.minimum(share**power, 1) + 1500 * np.maximum(abs(w) - leak, 0))

        flows = np.linspace(-1, 1, 2001)
        forces = dashpot(flows)
        forces = dashpot(flows)
        total = forces + stiffness * flows * (0.1 / 200)  # after a step in time
        state, states = 0.0, []
        fine = np.interp(np.arange(0, x.size - 1, 0.1), np.arange(x.size), x)
        for step in np.diff(fine, prepend=fine[0]):  # implicit: the spring's force changes by k (dx - w dt)
            w = np.interp(state + stiffness * step, total, flows)
            state = np.interp(w, flows, forces)
            states.append(state)
        return np.append(states[::10], states[-1]) + 45 * np.tanh(v / 0.002)

    return force


@pytest.mark.parametrize("leak", [0.03, 0.07])
@pytest.mark.parametrize("stiffness", [2.5e6, 1e8])
@pytest.mark.parametrize("power", [1.5, 2.0, 3.0])
def test_a_yield_force_that_leaks_is_not_early(leak, stiffness, power):
    assert "W_LAG" not in codes_of(sine_record(leaking(leak, stiffness, power), points=200))


@pytest.mark.parametrize(
    ("switched_at", "late"), [(0.1, True), (0.0, False)]
)  # at 0.0 a lag of either sign explains it
def test_a_force_that_follows_a_switched_current_is_not_late(switched_at, late):
    record = sine_record(points=500)
    velocity = np.gradient(record.displacement, record.time)
    coil = scipy.signal.lfilter([0.05], [1, -0.95], ((record.time + switched_at) % 1.0 < 0.5) * 1.2)
    force = record.force + 1000 * coil * np.tanh(velocity / 0.05)
    stated = (np.full(coil.size, 0.5), coil)
    views = [View(replace(record, force=force, current=current)) for current in stated]
    codes = [[finding.code for finding in force_channel(view)] for view in views]
    assert codes == [["W_LAG"] * late, []]


@pytest.mark.parametrize("noise", [0.5, 5.0, 50.0])
@pytest.mark.parametrize("share", [-0.06, 0.0, 0.06])
def test_ending_the_search_for_a_lag_early_changes_no_finding(noise, share, monkeypatch):
    """Where noise leaves no lag that could be reported, none is fitted: fitting them all reports none either."""
    from mrdamper.rig_files.quality import lag as module

    clean = sine_record(with_corners)
    moved = np.interp(clean.time - share, clean.time, clean.force)
    moved += noise * np.random.default_rng(5).standard_normal(moved.size)
    record = Record("r", *(a[50:-50] for a in (clean.time, clean.displacement, moved)))
    early = [finding.code for finding in module.force_channel(View(record))]
    monkeypatch.setattr(module, "_may_be_clear", lambda misfit, noise: True)
    assert early == [finding.code for finding in module.force_channel(View(record))]
    assert early == ["W_LAG"] * (share != 0)


@pytest.mark.parametrize("current", [0.0, 0.5, 1.0, 1.5])
@pytest.mark.parametrize("frequency", [0.5, 2.0])
def test_a_plateau_in_a_noisy_single_cycle_is_not_cut_off(current, frequency):
    """The window excludes the cycle that starts from rest, and the noise of one cycle hides how its ends are formed."""
    model = BoucWen.build({"c": 1300.0, "yield_force": 100 + 600 * current, "yield_displacement": 3e-4, "f0": 120.0})
    motion = sine(Condition(current, frequency, 0.005), 2, 1000)
    force = simulate(model, motion).force
    force = force + 0.03 * np.std(force) * np.random.default_rng(0).standard_normal(force.size)
    window = (1 / frequency, float(motion.time[-1]))
    run = Run("r", motion.time, motion.displacement, force, current, window=window)
    refused, findings = check_run(run)
    assert refused is None
    assert "W_CLIPPED" not in {finding.code for finding in findings}
    cycles = steady_cycles(View(record_of(run)))
    assert cycles is not None
    assert len(cycles.starts) == 1


# Recovery: one size of every kind that moves the result


SEVERE = {
    "mains hum, 50 Hz, on the displacement": 0.05, "other line on the displacement": 0.08,
    "mains hum, 50 Hz, on the force": 0.2, "other line on the force": 0.2,
    "force clipped before noise": 0.2, "force clipped before a filter": 0.2,
    "displacement clipped before noise": 0.15, "displacement clipped at one end before noise": 0.15,
    "force late, as by a clock of its own": 0.06, "force early": 0.06, "clock of the force runs fast": 0.1,
    "gain of the force drifts": 0.3, "gain of the force steps": 0.2, "offset of the force drifts": 0.2,
    "samples lost and renumbered": 0.05, "samples written twice": 0.05, "one cycle pasted": 10, "a stretch pasted": 1,
    "one force sample off": 1.5, "noise on the force": 0.06, "noise on the displacement": 0.02,
    "displacement held at a slower rate": 0.06, "force behind a second-order low-pass": 0.04,
    "backlash in the displacement sensor": 0.05,
}  # fmt: skip


SEVERE |= {
    "displacement behind a first-order low-pass": 0.04, "force smoothed without phase": 0.02,
    "force clipped at one end before noise": 0.5, "gain of the displacement steps": 0.2,
    "hum for a quarter of the record, displacement": 0.03, "displacement stored on change only": 0.05,
    "force stored on change only": 0.1, "bit of the force stuck": 0.15, "telemetry packets lost, last sample held": 0.2,
    "displacement averaged over a moving window": 0.1, "carrier aliased into the displacement": 0.05,
    "buffers of the logger exchanged": 0.1, "polarity of the force reversed late": 0.3,
}  # fmt: skip
ALL_KINDS = (*KINDS, *operator_faults.KINDS)


@pytest.mark.parametrize("kind", [kind for kind in ALL_KINDS if kind.name in SEVERE], ids=lambda kind: kind.name)
def test_a_fault_of_a_size_that_matters_is_found(kind):
    faulty = kind.change(sine_record(), SEVERE[kind.name], np.random.default_rng(3))
    assert codes_of(faulty) - codes_of(sine_record())


def test_findings_state_their_effect_in_per_cent():
    from mrdamper.rig_files.quality import check_record

    for name in ("mains hum, 50 Hz, on the force", "gain of the force drifts", "force clipped before noise"):
        kind = next(kind for kind in KINDS if kind.name == name)
        found = check_record(kind.change(sine_record(), SEVERE[name], np.random.default_rng(3))).findings
        assert any("%" in finding.text for finding in found), name


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("1Hz_20mm", 0), ("1.1Hz_40mm_0.5A", 0), ("t3_20mm1Hz", 0), ("0x5Hz_20mm", 1), ("1p0Hz_20mm", 0), ("60Hz", 1),
        ("1Hz_0.8mm", 1), ("1-15Hz_20mm", 1), ("20mm/s", 0), ("1kHz_sampling", 0), ("5Hz and 9Hz", 0), ("0Hz", 0),
    ],
)  # fmt: skip
def test_what_a_name_states_is_compared_with_the_motion(name, said):
    """The record has 1 Hz and 20 mm; a name may state the stroke, and a machine falls short of its command."""
    found = list(agrees_with_its_name(View(replace(sine_record(), id=name))))
    assert [finding.code for finding in found] == ["W_NAME"] * said


def test_a_motion_of_another_frequency_and_another_amplitude_than_its_name_is_refused():
    """One of them may be a nominal value or a slipped unit; both are another test."""
    with pytest.raises(QualityError, match="2 Hz and 300 mm") as refused:
        list(agrees_with_its_name(View(replace(sine_record(), id="2 Hz, 300 mm"))))
    assert refused.value.code == "E_MOTION_CONTRADICTS"


def test_there_are_forty_kinds_and_each_changes_a_record():
    assert len(KINDS) >= 40
    assert len(operator_faults.KINDS) >= 25
    record = clean_record(1, np.random.default_rng(0), least_cycles=4.0)
    for kind in (*KINDS, *UNOBSERVABLE, *operator_faults.KINDS, *operator_faults.UNOBSERVABLE):
        faulty = kind.change(record, float(np.sqrt(kind.low * kind.high)), np.random.default_rng(1))
        Run("r", faulty.time, faulty.displacement, faulty.force, faulty.current)  # a record as any
        same = faulty.time.size == record.time.size and all(
            np.array_equal(values, getattr(record, name)) for name, values in faulty.channels.items()
        )
        assert not same, kind.name


def test_clean_records_of_every_family_give_no_finding():
    assert not [n for n in range(3 * len(FAMILIES)) if codes_of(clean_record(n, np.random.default_rng([99, n])))]


@pytest.mark.slow
@pytest.mark.parametrize("families", [FAMILIES, OTHERS], ids=["of the checks", "others"])
def test_at_most_one_clean_record_in_two_hundred_has_a_finding(families):
    false = false_alarms(clean_records(400, 1, families))
    assert false["records"] <= GOALS["clean"] * 400, false


def printed_table():
    page = (Path(__file__).parents[2] / "docs" / "rig-procedure.md").read_text(encoding="utf-8")
    return page[page.index("| Fault |") : page.index("A single record cannot show")].strip()


def test_the_table_of_the_rig_procedure_has_every_kind():
    rows = [row for row in printed_table().splitlines() if row and not row.startswith(("| Fault", "|---"))]
    names = [kind.name for kind in (*KINDS, *operator_faults.KINDS)]
    assert [row.split(" | ")[0].removeprefix("| ") for row in rows] == names


@pytest.mark.slow
def test_the_table_of_the_rig_procedure_is_what_the_command_prints():
    first, second = (list(trials(kinds, 12, 1)) for kinds in (KINDS, operator_faults.KINDS))
    assert printed_table() == f"{table(first)}\n\n{table(second)}"
    assert not any(CRASHED in trial.codes for trial in first + second)
    for goal, ends in (("large", (LARGE,)), ("moderate", (MODERATE, LARGE))):
        found, count = share_found(first, *ends)
        assert found >= GOALS[goal] * count, goal


def test_noise_is_white_by_octave_until_a_filter_colours_it():
    """A first-order filter takes 6 dB an octave; without noise there is nothing to tell."""
    record = sine_record(cycles=16, points=400)
    levels, highest = noise_by_octave(View(record), "force")
    assert highest == pytest.approx(200)
    assert np.ptp(levels) < 4
    falls = np.diff(noise_by_octave(View(low_passed(record, 0.05)), "force")[0])[1:4]
    assert np.all((falls > 4) & (falls < 9)), falls
    clean = replace(record, force=1500 * 0.04 * np.pi * np.cos(2 * np.pi * record.time))
    assert noise_by_octave(View(clean), "force")[0].size == 0
