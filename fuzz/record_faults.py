"""Physical faults of a record: kinds, how they change its channels, and the range of their size.

A kind is a function of a record, a size and a generator. A kind that is exactly what another
damper, or another clean test, would have recorded cannot be found in a single record; it stands
in `UNOBSERVABLE`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mrdamper.data import Floats
from mrdamper.physics.motion.harmonics import fundamental_frequency
from mrdamper.rig_files.record import Record

Rng = np.random.Generator
Change = Callable[[Record, float, Rng], Record]


@dataclass(frozen=True)
class Kind:
    """A kind of fault: its name, what its size is, and the sizes it is drawn from."""

    name: str
    size: str  # noun and unit of the size
    low: float
    high: float
    change: Change
    cycles: float = 3.0  # a record of fewer cycles is not drawn


def span_of(values: Floats) -> float:
    """Return the peak-to-peak value."""
    return float(np.ptp(values))


def period_of(record: Record) -> float:
    """Return the period of the motion [s]."""
    return 1 / fundamental_frequency(record.time, record.displacement)


def step_of(record: Record) -> float:
    """Return the usual step of time [s]."""
    return float(np.median(np.diff(record.time)))


def share_of_time(record: Record) -> Floats:
    """Return the time from 0 at the record's first sample to 1 at its last."""
    return (record.time - record.time[0]) / float(record.time[-1] - record.time[0])


def _add(record: Record, name: str, values: Floats) -> Record:
    return replace(record, **{name: getattr(record, name) + values})


def _scale(record: Record, name: str, gain: Floats) -> Record:
    values = getattr(record, name)
    middle = 0.0 if name == "force" else float(np.mean(values))
    return replace(record, **{name: middle + gain * (values - middle)})


def line(name: str, frequency: float | None) -> Change:
    """Build a sine of `size` peak-to-peak of a channel; no frequency stands for any of 2.3 to 40 times the motion's."""

    def change(record: Record, size: float, rng: Rng) -> Record:
        f = frequency or float(np.exp(rng.uniform(np.log(2.3), np.log(40.0)))) / period_of(record)
        wave = np.sin(2 * np.pi * f * record.time + rng.uniform(0, 2 * np.pi))
        return _add(record, name, 0.5 * size * span_of(getattr(record, name)) * wave)

    return change


def _burst(name: str) -> Change:
    def change(record: Record, size: float, rng: Rng) -> Record:
        share, at = share_of_time(record), rng.uniform(0.1, 0.7)
        wave = np.sin(2 * np.pi * 50.0 * record.time) * ((share > at) & (share < at + 0.25))
        return _add(record, name, 0.5 * size * span_of(getattr(record, name)) * wave)

    return change


def _clip(name: str, after: str, sides: int = 2) -> Change:
    """Cut off at a share of the range, then add noise or filter, so that no two samples are equal."""

    def change(record: Record, size: float, rng: Rng) -> Record:
        values = getattr(record, name)
        low, high = float(np.min(values)), float(np.max(values))
        cut = np.clip(values, low + (size * (high - low) / 2 if sides == 2 else 0), high - size * (high - low) / 2)
        if after == "noise":
            cut = cut + 0.002 * (high - low) * rng.standard_normal(cut.size)
        else:
            cut = _low_pass(record.time, cut, 0.01 * period_of(record))
        return replace(record, **{name: cut})

    return change


def _low_pass(time: Floats, values: Floats, constant: float, order: int = 1) -> Floats:
    """Filter causally with a Butterworth low-pass of a time constant [s]."""
    from scipy.signal import butter, sosfilt, sosfilt_zi

    rate = 1 / float(np.median(np.diff(time)))
    sections = butter(order, min(1 / (2 * np.pi * constant), 0.45 * rate), fs=rate, output="sos")
    return np.asarray(sosfilt(sections, values, zi=sosfilt_zi(sections) * values[0])[0])


def _filter(name: str, order: int) -> Change:
    def change(record: Record, size: float, rng: Rng) -> Record:
        return replace(record, **{name: _low_pass(record.time, getattr(record, name), size * period_of(record), order)})

    return change


def _high_pass(record: Record, size: float, rng: Rng) -> Record:
    force = record.force
    return replace(record, force=force - _low_pass(record.time, force, period_of(record) / size))


def _zero_phase(record: Record, size: float, rng: Rng) -> Record:
    from scipy.ndimage import gaussian_filter1d

    step = step_of(record)
    return replace(record, force=gaussian_filter1d(record.force, max(size * period_of(record) / step, 0.3)))


def _shift(sign: float, name: str = "force") -> Change:
    def change(record: Record, size: float, rng: Rng) -> Record:
        delay = sign * size * period_of(record)
        inside = (record.time - delay >= record.time[0]) & (record.time - delay <= record.time[-1])
        moved = np.interp(record.time - delay, record.time, getattr(record, name))
        return part(replace(record, **{name: moved}), inside)

    return change


def part(record: Record, rows: np.ndarray) -> Record:
    """Keep some rows of every channel."""
    return replace(record, **{name: values[rows] for name, values in record.channels.items()})


def _two_clocks(record: Record, size: float, rng: Rng) -> Record:
    """The force's clock runs fast: at the record's end it is late by `size` of a period."""
    late = size * period_of(record) * share_of_time(record)
    return replace(record, force=np.interp(record.time - late, record.time, record.force))


def _trend(name: str, shape: str, scaled: bool) -> Change:
    """Build a gain or an offset that ramps, relaxes or steps over the record."""

    def change(record: Record, size: float, rng: Rng) -> Record:
        share, sign = share_of_time(record), rng.choice([-1.0, 1.0])
        at = rng.uniform(0.3, 0.7)
        curve = {"ramp": share, "relax": 1 - np.exp(-share / 0.25), "step": (share > at).astype(float)}[shape]
        if scaled:
            return _scale(record, name, 1 + (sign if shape != "relax" else -1.0) * size * curve)
        return _add(record, name, sign * size * span_of(getattr(record, name)) * curve)

    return change


def _wander(name: str) -> Change:
    """Build a random walk without the record's mean, of an RMS of `size` peak-to-peak."""

    def change(record: Record, size: float, rng: Rng) -> Record:
        walk = np.cumsum(rng.standard_normal(record.time.size))
        walk -= walk.mean()
        return _add(record, name, size * span_of(getattr(record, name)) * walk / float(np.std(walk)))

    return change


def _lost(record: Record, size: float, rng: Rng) -> Record:
    """Single samples lost, the rest numbered anew."""
    kept = np.flatnonzero(rng.random(record.time.size) > size)
    return replace(part(record, kept), time=record.time[: kept.size])


def _lost_block(record: Record, size: float, rng: Rng) -> Record:
    """One block of a share of a period lost, the rest numbered anew."""
    step = step_of(record)
    count = max(1, round(size * period_of(record) / step))
    at = int(rng.uniform(0.25, 0.75) * record.time.size)
    kept = np.r_[0:at, at + count : record.time.size]
    return replace(part(record, kept), time=record.time[: kept.size])


def _lost_of_one(record: Record, size: float, rng: Rng) -> Record:
    """A block lost in the force alone: from there on it is early."""
    step = step_of(record)
    count = max(1, round(size * period_of(record) / step))
    at = int(rng.uniform(0.25, 0.75) * record.time.size)
    force = np.delete(record.force, slice(at, at + count))
    short = part(record, np.arange(force.size))
    return replace(short, force=force)


def _doubled(record: Record, size: float, rng: Rng) -> Record:
    """Single samples recorded twice, numbered anew."""
    index = np.repeat(np.arange(record.time.size), 1 + (rng.random(record.time.size) < size))[: record.time.size]
    return replace(part(record, index), time=record.time)


def _warped(record: Record, size: float, rng: Rng) -> Record:
    """The logger's clock speeds up by `size` over the record."""
    share, length = share_of_time(record), float(record.time[-1] - record.time[0])
    return replace(record, time=record.time[0] + length * (share + 0.5 * size * share**2))


def _jitter(record: Record, size: float, rng: Rng) -> Record:
    """Samples taken at other times than written, RMS `size` of a step."""
    step = step_of(record)
    taken = record.time + np.clip(size * step * rng.standard_normal(record.time.size), -3 * step, 3 * step)
    return replace(
        record,
        displacement=np.interp(taken, record.time, record.displacement),
        force=np.interp(taken, record.time, record.force),
    )


def _pasted(record: Record, size: float, rng: Rng) -> Record:
    """One cycle pasted `size` times: no noise differs."""
    step = step_of(record)
    count = round(period_of(record) / step)
    at = int(rng.uniform(0, record.time.size - count - 1))
    index = np.tile(np.arange(at, at + count), max(2, round(size)))
    return replace(part(record, np.arange(1)), time=step * np.arange(index.size), **{
        name: values[index] for name, values in record.channels.items() if name != "time"
    })  # fmt: skip


def _patched(record: Record, size: float, rng: Rng) -> Record:
    """A stretch replaced by a copy of the one a period earlier."""
    step = step_of(record)
    period = round(period_of(record) / step)
    count = min(max(8, round(size * period)), record.time.size - period - 1)
    at = int(rng.uniform(period, record.time.size - count))
    index = np.r_[0:at, at - period : at - period + count, at + count : record.time.size][: record.time.size]
    return replace(record, displacement=record.displacement[index], force=record.force[index])


def _wild(name: str, count: int) -> Change:
    """Single samples off by `size` peak-to-peak."""

    def change(record: Record, size: float, rng: Rng) -> Record:
        values = getattr(record, name).copy()
        at = rng.choice(np.arange(5, values.size - 5), count, replace=False)
        values[at] += rng.choice([-1.0, 1.0], count) * size * span_of(values)
        return replace(record, **{name: values})

    return change


def _held(name: str) -> Change:
    """Recorded at a slower rate and held: steps of `size` of a period."""

    def change(record: Record, size: float, rng: Rng) -> Record:
        step = step_of(record)
        every = max(2, round(size * period_of(record) / step))
        index = np.arange(record.time.size) // every * every
        return replace(record, **{name: getattr(record, name)[index]})

    return change


def _dropouts(name: str, value: str) -> Change:
    """Stretches of a fortieth of a period that stay at zero or at the last value, `size` of the record."""

    def change(record: Record, size: float, rng: Rng) -> Record:
        step = step_of(record)
        width = max(2, round(period_of(record) / step / 40))
        values = getattr(record, name).copy()
        for at in rng.integers(1, values.size - width, max(1, round(size * values.size / width))):
            values[at : at + width] = values[at - 1] if value == "last" else 0.0
        return replace(record, **{name: values})

    return change


def _noise(name: str) -> Change:
    def change(record: Record, size: float, rng: Rng) -> Record:
        values = getattr(record, name)
        return _add(record, name, size * span_of(values) * rng.standard_normal(values.size))

    return change


def _coarse(name: str) -> Change:
    """Quantised in steps of `size` peak-to-peak."""

    def change(record: Record, size: float, rng: Rng) -> Record:
        values = getattr(record, name)
        step = size * span_of(values)
        return replace(record, **{name: np.round(values / step) * step})

    return change


def _flipped_bit(record: Record, size: float, rng: Rng) -> Record:
    """One bit of the force's counts inverted in one sample in a hundred; the bit is worth `size` peak-to-peak."""
    force, bit = record.force, size * span_of(record.force)
    at = rng.random(force.size) < 0.01
    up = np.floor(force / bit) % 2 == 0
    return replace(record, force=force + np.where(at, np.where(up, bit, -bit), 0.0))


def _stick(record: Record, size: float, rng: Rng) -> Record:
    """The displacement sensor's rod sticks: it follows with a backlash of `size` peak-to-peak."""
    x, gap = record.displacement, 0.5 * size * span_of(record.displacement)
    seen = np.empty_like(x)
    at = x[0]
    for i, value in enumerate(x):
        at = min(max(at, value - gap), value + gap)
        seen[i] = at
    return replace(record, displacement=seen + 1e-4 * span_of(x) * rng.standard_normal(x.size))


OF_SPAN, OF_PERIOD, OF_RECORD = "of the peak-to-peak value", "of the period", "over the record"
KINDS: tuple[Kind, ...] = (
    Kind("mains hum, 50 Hz, on the displacement", OF_SPAN, 5e-4, 0.1, line("displacement", 50.0)),
    Kind("mains hum, 60 Hz, on the displacement", OF_SPAN, 5e-4, 0.1, line("displacement", 60.0)),
    Kind("mains hum, 50 Hz, on the force", OF_SPAN, 0.01, 0.6, line("force", 50.0)),
    Kind("mains hum, 60 Hz, on the force", OF_SPAN, 0.01, 0.6, line("force", 60.0)),
    Kind("other line on the displacement", OF_SPAN, 2e-3, 0.15, line("displacement", None)),
    Kind("other line on the force", OF_SPAN, 0.01, 0.6, line("force", None)),
    Kind("hum for a quarter of the record, displacement", OF_SPAN, 1e-3, 0.2, _burst("displacement")),
    Kind("hum for a quarter of the record, force", OF_SPAN, 0.02, 0.8, _burst("force")),
    Kind("force clipped before noise", "of the half range", 0.02, 0.5, _clip("force", "noise")),
    Kind("force clipped before a filter", "of the half range", 0.02, 0.5, _clip("force", "filter")),
    Kind("force clipped at one end before noise", "of the half range", 0.02, 0.6, _clip("force", "noise", 1)),
    Kind("displacement clipped before noise", "of the half range", 0.02, 0.4, _clip("displacement", "noise")),
    Kind("displacement clipped before a filter", "of the half range", 0.02, 0.4, _clip("displacement", "filter")),
    Kind("displacement clipped at one end before noise", "of the half range", 0.02, 0.4,
         _clip("displacement", "noise", 1)),
    Kind("force late, as by a clock of its own", OF_PERIOD, 2e-3, 0.12, _shift(1.0)),
    Kind("force early", OF_PERIOD, 2e-3, 0.12, _shift(-1.0)),
    Kind("force behind a first-order low-pass", OF_PERIOD, 2e-3, 0.12, _filter("force", 1)),
    Kind("force behind a second-order low-pass", OF_PERIOD, 2e-3, 0.1, _filter("force", 2)),
    Kind("force behind a high-pass", "of the frequency", 0.01, 0.6, _high_pass),
    Kind("force smoothed without phase", OF_PERIOD, 2e-3, 0.1, _zero_phase),
    Kind("displacement behind a first-order low-pass", OF_PERIOD, 2e-3, 0.12, _filter("displacement", 1)),
    Kind("clock of the force runs fast", OF_PERIOD, 5e-3, 0.25, _two_clocks),
    Kind("gain of the force drifts", OF_RECORD, 0.01, 0.6, _trend("force", "ramp", True)),
    Kind("force falls while warming up", OF_RECORD, 0.01, 0.5, _trend("force", "relax", True)),
    Kind("gain of the force steps", "of the gain", 0.01, 0.5, _trend("force", "step", True)),
    Kind("offset of the force drifts", OF_SPAN, 0.005, 0.4, _trend("force", "ramp", False)),
    Kind("offset of the force steps", OF_SPAN, 0.005, 0.4, _trend("force", "step", False)),
    Kind("force wanders", "RMS, of the peak-to-peak value", 0.005, 0.2, _wander("force")),
    Kind("gain of the displacement drifts", OF_RECORD, 0.01, 0.5, _trend("displacement", "ramp", True)),
    Kind("gain of the displacement steps", "of the gain", 0.01, 0.4, _trend("displacement", "step", True)),
    Kind("displacement drifts", OF_SPAN, 0.01, 0.5, _trend("displacement", "ramp", False)),
    Kind("displacement steps", OF_SPAN, 0.005, 0.3, _trend("displacement", "step", False)),
    Kind("displacement wanders", "RMS, of the peak-to-peak value", 1e-3, 0.1, _wander("displacement")),
    Kind("samples lost and renumbered", "of the samples", 2e-3, 0.15, _lost),
    Kind("a block lost and renumbered", OF_PERIOD, 0.01, 0.5, _lost_block),
    Kind("a block of the force lost", OF_PERIOD, 0.005, 0.3, _lost_of_one),
    Kind("samples written twice", "of the samples", 2e-3, 0.15, _doubled),
    Kind("logger's clock speeds up", "of its rate", 2e-3, 0.2, _warped),
    Kind("time stamps jitter", "of a step, RMS", 0.05, 2.0, _jitter),
    Kind("one cycle pasted", "times", 3, 15, _pasted),
    Kind("a stretch pasted", OF_PERIOD, 0.1, 1.5, _patched),
    Kind("one force sample off", OF_SPAN, 0.05, 3.0, _wild("force", 1)),
    Kind("five displacement samples off", OF_SPAN, 2e-3, 0.5, _wild("displacement", 5)),
    Kind("force held at a slower rate", OF_PERIOD, 0.01, 0.15, _held("force")),
    Kind("displacement held at a slower rate", OF_PERIOD, 0.01, 0.1, _held("displacement")),
    Kind("force drops out to zero", "of the samples", 2e-3, 0.2, _dropouts("force", "zero")),
    Kind("force sticks for a while", "of the samples", 5e-3, 0.4, _dropouts("force", "last")),
    Kind("displacement sticks for a while", "of the samples", 2e-3, 0.2, _dropouts("displacement", "last")),
    Kind("noise on the force", "RMS, of the peak-to-peak value", 0.005, 0.15, _noise("force")),
    Kind("noise on the displacement", "RMS, of the peak-to-peak value", 5e-4, 0.03, _noise("displacement")),
    Kind("force of few bits", OF_SPAN, 2e-3, 0.15, _coarse("force")),
    Kind("displacement of few bits", OF_SPAN, 1e-3, 0.05, _coarse("displacement")),
    Kind("a bit of the force flips", OF_SPAN, 0.01, 0.5, _flipped_bit),
    Kind("backlash in the displacement sensor", OF_SPAN, 5e-3, 0.15, _stick),
)  # fmt: skip


def _soft(record: Record, size: float, rng: Rng) -> Record:
    """An amplifier that saturates softly, by `size` at the peak."""
    middle = 0.5 * float(np.max(record.force) + np.min(record.force))
    half = 0.5 * span_of(record.force)
    share = (record.force - middle) / half
    return replace(record, force=middle + half * share * (1 - size * share**2))


UNOBSERVABLE: tuple[Kind, ...] = (
    Kind("constant gain of the force", "of the gain", 0.01, 0.5,
         lambda record, size, rng: replace(record, force=record.force * (1 + size))),
    Kind("constant gain of the displacement", "of the gain", 0.01, 0.5,
         lambda record, size, rng: replace(record, displacement=record.displacement * (1 + size))),
    Kind("clock of a wrong rate", "of the rate", 0.01, 0.5,
         lambda record, size, rng: replace(record, time=record.time * (1 + size))),
    Kind("amplifier saturates softly", "at the peak", 0.01, 0.3, _soft),
    Kind("current of another step", "of the yield force", 0.01, 0.5,
         lambda record, size, rng: replace(
             record, force=record.force + size * np.sign(np.gradient(record.displacement)) * 0.3 * span_of(record.force)
         )),
)  # fmt: skip
