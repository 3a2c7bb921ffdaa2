"""Records that are refused: a test a code, and how often a fault is found."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from support import rig_detection as rig
from support.rig_records import clean_record, codes_of, random_record, with_channel

from mrdamper.errors import QualityError
from mrdamper.rig_files.quality import check_record


@pytest.fixture
def good():
    return clean_record(3, cycles=4, points=200, velocity=True)


def test_infinite_values_are_refused(good):
    def overflow(force):
        force[17] = np.inf

    with pytest.raises(QualityError, match="sample 17") as caught:
        check_record(with_channel(good, "force", overflow))
    assert caught.value.code == "E_NONFINITE"


@pytest.mark.parametrize(
    ("step", "code"),
    [pytest.param(40, "E_MISSING", id="2.5 %"), pytest.param(None, "E_MISSING", id="six in a row")],
)
@pytest.mark.parametrize("channel", ["force", "displacement", "time", "current", "velocity"])
def test_too_many_missing_samples_are_refused(good, channel, step, code):
    def lose(values):
        values[slice(5, None, step) if step else slice(100, 106)] = np.nan

    assert codes_of(with_channel(good, channel, lose)) == [code]


def test_samples_missing_in_turn_from_one_channel_and_the_other_are_a_hole(good):
    """Eight rows in a row lack force or displacement, though no channel lacks two in a row."""
    record = good
    for name, first in (("force", 100), ("displacement", 101)):
        values = getattr(record, name).copy()
        values[first : first + 8 : 2] = np.nan
        record = replace(record, **{name: values})
    with pytest.raises(QualityError, match="8 samples in a row") as caught:
        check_record(record)
    assert caught.value.code == "E_MISSING"


def test_a_few_missing_samples_are_counted(good):
    def lose(values):
        values[50:55] = np.nan
        values[300] = np.nan

    judged = check_record(with_channel(good, "force", lose))
    assert [finding.code for finding in judged.findings] == ["W_MISSING"]
    assert "6 of 801" in judged.findings[0].text
    assert "5 in a row" in judged.findings[0].text


def test_missing_cells_in_a_channel_that_is_not_used_do_not_refuse(good):
    temperature = np.full(good.time.size, 21.0)
    temperature[::2] = np.nan
    assert codes_of(replace(good, temperature=temperature)) == ["W_MISSING"]


@pytest.mark.parametrize("code", [-9999.0, 9999.0, -999.0, 99999.0, -999.25, 9.91e37, -32768.0, 1e30])
@pytest.mark.parametrize("scale", [1.0, 1e3, 1e-3])
def test_missing_value_codes_are_refused(good, code, scale):
    """Wherever the decimal point went when units were converted."""

    def scatter(force):
        force[[30, 95, 96, 411]] = code * scale

    assert codes_of(with_channel(good, "force", scatter)) == ["E_SENTINEL"]


@pytest.mark.parametrize("channel", ["displacement", "time", "current"])
def test_missing_value_codes_are_found_in_any_channel(good, channel):
    def scatter(values):
        values[[30, 95, 411]] = -9999.0

    assert codes_of(with_channel(good, channel, scatter)) == ["E_SENTINEL"]


@pytest.mark.parametrize("bad", [-9999.0, np.inf])
def test_a_damaged_channel_that_is_not_used_is_said(good, bad):
    temperature = 21 + 0.1 * np.random.default_rng(1).standard_normal(good.time.size)
    temperature[[30, 95, 411]] = bad
    assert codes_of(replace(good, temperature=temperature)) == ["W_MISSING"]


@pytest.mark.parametrize("levels", [(0.5, 0.501), (0.0, 0.001), (0.499, 0.5, 0.501, 0.502)])
def test_a_current_that_flickers_between_levels_passes(good, levels):
    weights = np.array([1.0, *(0.03 for _ in levels[1:])])
    current = np.random.default_rng(1).choice(levels, good.time.size, p=weights / weights.sum())
    assert codes_of(replace(good, current=current)) == []


def test_drop_outs_to_zero_are_refused(good):
    """Where the force is far from zero, exact zeros are no force."""
    away = np.flatnonzero(np.abs(good.force) > 0.5 * np.ptp(good.force) / 2)[[20, 90, 170]]

    def drop(force):
        force[away] = 0.0

    assert codes_of(with_channel(good, "force", drop)) == ["E_SENTINEL"]


def test_repeated_time_stamps_are_refused(good):
    def repeat(time):
        time[120] = time[119]

    with pytest.raises(QualityError, match="sample 120") as caught:
        check_record(with_channel(good, "time", repeat))
    assert caught.value.code == "E_TIME_DUPLICATE"


def test_time_running_backwards_is_refused_with_its_line(good):
    def swap(time):
        time[[200, 201]] = time[[201, 200]]

    record = replace(with_channel(good, "time", swap), lines=np.arange(good.time.size) + 3)
    with pytest.raises(QualityError, match="line 204") as caught:
        check_record(record)
    assert caught.value.code == "E_TIME_ORDER"


def test_forces_of_the_wrong_sign_are_refused():
    """All; `benchmarks/import_detection.py` takes more."""
    assert rig.opposite_found(50).missed == ()


def test_a_wrong_sign_in_one_of_several_segments_is_refused():
    """As where the second of two acquisition blocks was recorded after the load cell was turned round."""
    one = clean_record(3, cycles=3, points=200, damper="bouc-wen")
    span = one.time[-1] - one.time[0]
    two = {name: np.concatenate([getattr(one, name)] * 2) for name in ("displacement", "current")}
    time = np.concatenate([one.time, one.time + 2 * span])
    force = np.concatenate([one.force, -one.force])
    assert codes_of(replace(one, time=time, force=force, **two)) == ["E_DISSIPATION_SIGN"]
    both = replace(one, time=time, force=np.abs(force) * np.sign(np.concatenate([one.force] * 2)), **two)
    assert codes_of(both) == ["W_TIME_GAP"]


@pytest.mark.parametrize("unit", rig.EXCHANGED_UNITS)
def test_exchanged_columns_are_refused(unit):
    """100 of 100, whatever units the header gave them."""
    assert rig.exchanged_found(100, unit).missed == ()


def test_the_message_tells_exchanged_columns_from_a_wrong_sign():
    """In 19 of 20: a force that is nearly a sine looks like a motion."""
    told = Counter()
    for seed in range(40):
        record = clean_record(seed, cycles=4)
        for name, wrong in (
            ("opposite", replace(record, force=-record.force)),
            ("exchanged", replace(record, displacement=record.force * 1e-4, force=record.displacement * 1e4)),
        ):
            with pytest.raises(QualityError) as caught:
                check_record(wrong)
            told[name] += name in str(caught.value)
    assert told["opposite"] >= 38
    assert told["exchanged"] >= 38


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"displacement": 1e3}, "displacement"),
        ({"force": 1e6}, "force"),
        ({"force": 1e-6}, "force"),
        ({"current": 1e3}, "current"),
        ({"time": 1e-4}, "speed"),
    ],
)
def test_units_out_of_all_proportion_are_refused(good, change, what):
    (name, factor) = next(iter(change.items()))
    values = getattr(good, name) * factor + (1e3 if name == "current" else 0.0)
    with pytest.raises(QualityError, match=what) as caught:
        check_record(replace(good, **{name: values}, velocity=None))
    assert caught.value.code == "E_RANGE"
    assert factor <= 1 or f"in a profile: [channels.{name}] unit" in caught.value.remedy


def test_a_late_velocity_channel_is_refused_with_its_lag():
    """All, the lag within one sample, with 1 % noise on the channel."""
    assert rig.late_velocity_found(50).missed == ()


@pytest.mark.parametrize(
    ("factor", "what"), [(-1.0, "against"), (1e-3, "0.001 times"), (2.0, "2 times")], ids=["sign", "mm/s", "gain"]
)
def test_a_velocity_of_wrong_sign_or_unit_is_refused(good, factor, what):
    with pytest.raises(QualityError, match=what) as caught:
        check_record(replace(good, velocity=factor * good.velocity))
    assert caught.value.code == "E_CHANNEL_LAG"


def test_another_quantity_under_the_name_of_velocity_is_refused(good):
    with pytest.raises(QualityError, match="not the derivative") as caught:
        check_record(replace(good, velocity=np.random.default_rng(1).standard_normal(good.time.size)))
    assert caught.value.code == "E_CHANNEL_LAG"


def test_velocity_by_backward_differences_passes(good):
    backward = np.diff(good.displacement, prepend=good.displacement[0]) / (good.time[1] - good.time[0])
    assert codes_of(replace(good, velocity=backward)) == []


def test_a_late_velocity_is_found_on_random_motion():
    record = random_record(2)
    velocity = np.gradient(record.displacement, record.time)
    assert codes_of(replace(record, velocity=velocity)) == ["W_NOT_SINE"]
    with pytest.raises(QualityError, match=r"\b(9\.9|10|10\.[01])\d* ms behind"):
        check_record(replace(record, velocity=np.interp(record.time - 0.01, record.time, velocity)))


def test_time_of_day_past_midnight_is_named(good):
    clock = (86_399.0 + good.time - good.time[0]) % 86_400.0
    with pytest.raises(QualityError, match="midnight") as caught:
        check_record(replace(good, time=clock))
    assert caught.value.code == "E_TIME_ORDER"


def test_a_rig_at_rest_has_no_motion_rather_than_no_force(good):
    still = np.full(good.time.size, 0.01)
    assert codes_of(replace(good, displacement=still, force=0 * still + 12.0, velocity=None)) == ["E_NO_EXCITATION"]


@pytest.mark.parametrize("noise", [0.0, 2e-6, 3e-5])
def test_no_motion_is_refused(good, noise):
    """A constant, and a sensor's noise alone up to 0.2 mm peak to peak."""
    still = 0.01 + noise * np.random.default_rng(1).standard_normal(good.time.size)
    assert codes_of(replace(good, displacement=still, velocity=None)) == ["E_NO_EXCITATION"]
