"""Faults a rig operator meets, a second set: amplifiers, loggers, telemetry, mounting and post-processing.

They are kinds as in `fuzz.record_faults`, written without the limits of the checks at hand, and scored apart.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fuzz.record_faults import (
    OF_PERIOD,
    OF_SPAN,
    Change,
    Kind,
    Rng,
    line,
    part,
    period_of,
    share_of_time,
    span_of,
    step_of,
)
from mrdamper.data import Floats
from mrdamper.rig_files.record import Record


def _slew_limited(name: str) -> Change:
    """An amplifier whose output changes at most at `1 - size` of the fastest rate of a channel."""

    def change(record: Record, size: float, rng: Rng) -> Record:
        values = getattr(record, name)
        fastest = float(np.quantile(np.abs(np.diff(values)), 0.999)) * (1 - size)
        output, at = np.empty_like(values), values[0]
        for i, value in enumerate(values):
            at += min(max(value - at, -fastest), fastest)
            output[i] = at
        return replace(record, **{name: output})

    return change


def _overloaded(record: Record, size: float, rng: Rng) -> Record:
    """A force amplifier that overloads at `1 - size` of its upper half range and takes a twentieth of a period to recover."""
    force = record.force
    limit = float(np.mean(force)) + (1 - size) * (float(np.max(force)) - float(np.mean(force)))
    keep = float(np.exp(-step_of(record) / (0.05 * period_of(record))))
    output, excess = np.empty_like(force), 0.0
    for i, value in enumerate(force):
        excess = max(value - limit, keep * excess)
        output[i] = min(value, limit) - 0.3 * excess
    return replace(record, force=output + 5e-4 * span_of(force) * rng.standard_normal(force.size))


def _dead_zone(record: Record, size: float, rng: Rng) -> Record:
    """A force amplifier with a dead zone of `size` peak-to-peak about zero."""
    half = 0.5 * size * span_of(record.force)
    output = np.sign(record.force) * np.maximum(np.abs(record.force) - half, 0.0)
    return replace(record, force=output + 5e-4 * span_of(record.force) * rng.standard_normal(output.size))


def _packets(bridged: bool) -> Change:
    """Telemetry packets of a fiftieth of a period lost, `size` of them; bridged by lines, or the last sample held."""

    def change(record: Record, size: float, rng: Rng) -> Record:
        count = max(4, round(period_of(record) / step_of(record) / 50))
        index = np.arange(record.time.size)
        lost = np.repeat(rng.random(index.size // count + 1) < size, count)[: index.size]
        lost[[0, -1]] = False
        kept = np.flatnonzero(~lost)
        last = kept[np.searchsorted(kept, index, side="right") - 1]
        return replace(record, **{
            name: np.interp(index, kept, values[kept]) if bridged else values[last]
            for name, values in record.channels.items() if name in ("displacement", "force")
        })  # fmt: skip

    return change


def _compressed(name: str) -> Change:
    """A historian that stores a sample only after a change of `size` peak-to-peak, and draws lines between them."""

    def change(record: Record, size: float, rng: Rng) -> Record:
        values = getattr(record, name)
        band, stored = size * span_of(values), [0]
        for i, value in enumerate(values):
            if abs(value - values[stored[-1]]) > band:
                stored.append(i)
        at = np.array([*stored, values.size - 1])
        return replace(record, **{name: np.interp(np.arange(values.size), at, values[at])})

    return change


def _averaged(name: str) -> Change:
    """The mean of the last `size` of a period, as a display shows it."""

    def change(record: Record, size: float, rng: Rng) -> Record:
        values = getattr(record, name)
        count = max(2, round(size * period_of(record) / step_of(record)))
        total = np.cumsum(np.concatenate([np.full(count, values[0]), values]))
        return replace(record, **{name: (total[count:] - total[:-count]) / count})

    return change


def _ac_coupled(record: Record, size: float, rng: Rng) -> Record:
    """The displacement behind a first-order high-pass of `size` of the frequency, settled."""
    x = record.displacement
    keep = float(np.exp(-2 * np.pi * size * step_of(record) / period_of(record)))
    start, output, at = float(np.mean(x)), np.empty_like(x), 0.0
    for i, value in enumerate(x):
        at = keep * (at + value - (x[i - 1] if i else start))
        output[i] = at
    return replace(record, displacement=output)


def _held_uneven(name: str) -> Change:
    """Recorded at a slower rate that is no whole part of the logger's, and held."""

    def change(record: Record, size: float, rng: Rng) -> Record:
        every = max(1.5, size * period_of(record) / step_of(record)) * rng.uniform(1.0, 1.2)
        index = (np.floor(np.arange(record.time.size) / every) * every).astype(int)
        return replace(record, **{name: getattr(record, name)[index]})

    return change


def _aliased(name: str) -> Change:
    """A carrier far above the sampling rate, seen at any frequency up to half of it."""

    def change(record: Record, size: float, rng: Rng) -> Record:
        rate = 1 / step_of(record)
        return line(name, float(rng.uniform(0.002, 0.998)) * rate / 2)(record, size, rng)

    return change


def _stuck_bit(name: str) -> Change:
    """A bit of the converter, worth `size` peak-to-peak, that is always one."""

    def change(record: Record, size: float, rng: Rng) -> Record:
        values = getattr(record, name)
        bit = size * span_of(values)
        zero = np.floor((values - np.min(values)) / bit) % 2 == 0
        return replace(record, **{name: np.where(zero, values + bit, values)})

    return change


def _clamp_slips(record: Record, size: float, rng: Rng) -> Record:
    """The displacement sensor's clamp slips by `size` peak-to-peak in every fast stroke outwards, and back."""
    x = record.displacement
    force = record.force - float(np.median(record.force))
    pulled = np.clip(force / float(np.quantile(np.abs(force), 0.9)), -1, 1)
    return replace(record, displacement=x - 0.5 * size * span_of(x) * pulled)


def _slips_once(record: Record, size: float, rng: Rng) -> Record:
    """The clamp slips over the half cycle at one place of the record, by `size` peak-to-peak."""
    at = rng.uniform(0.3, 0.7)
    width = 0.5 * period_of(record) / float(record.time[-1] - record.time[0])
    slip = np.clip((share_of_time(record) - at) / width, 0, 1)
    return replace(record, displacement=record.displacement + size * span_of(record.displacement) * slip)


def _buffers_exchanged(record: Record, size: float, rng: Rng) -> Record:
    """Two neighbouring buffers of `size` of a period written in the wrong order, once in two periods."""
    count = max(2, round(size * period_of(record) / step_of(record)))
    index = np.arange(record.time.size)
    for at in range(count, index.size - 2 * count, 2 * round(period_of(record) / step_of(record)) + 2 * count):
        index[at : at + 2 * count] = np.roll(index[at : at + 2 * count], count)
    return replace(record, displacement=record.displacement[index], force=record.force[index])


def _buffer_twice(record: Record, size: float, rng: Rng) -> Record:
    """A buffer of the force of a twentieth of a period written over the next one, in `size` of the buffers."""
    count = max(4, round(0.05 * period_of(record) / step_of(record)))
    index = np.arange(record.force.size)
    for at in range(count, index.size - count, count):
        if rng.random() < size:
            index[at : at + count] = np.arange(at - count, at)
    return replace(record, force=record.force[index])


def _rounded_stamps(record: Record, size: float, rng: Rng) -> Record:
    """Time stamps rounded to `size` of a step: below one step no two are equal."""
    unit = size * step_of(record)
    return replace(record, time=np.round(record.time / unit) * unit)


def _scale_error(record: Record, size: float, rng: Rng) -> Record:
    """An encoder whose scale has an error of `size` peak-to-peak that repeats ten to thirty times over the stroke."""
    x = record.displacement
    pitch = span_of(x) / rng.uniform(10, 30)
    return replace(record, displacement=x + 0.5 * size * span_of(x) * np.sin(2 * np.pi * x / pitch))


def _pulsating(record: Record, size: float, rng: Rng) -> Record:
    """The gain of the force pulsates by `size` at one to three times a record, as with a supply that hunts."""
    wave = np.sin(2 * np.pi * (rng.uniform(1, 3) * share_of_time(record) + rng.uniform(0, 1)))
    return replace(record, force=record.force * (1 + size * wave))


def _averaged_cycles(record: Record, size: float, rng: Rng) -> Record:
    """Cycles averaged with a period that is wrong by `size`, and written as many."""
    count = round(period_of(record) / step_of(record) * (1 + size * rng.choice([-1, 1])))
    cycles = record.time.size // count
    values = {
        name: np.tile(record.channels[name][: cycles * count].reshape(cycles, count).mean(axis=0), cycles)
        for name in ("displacement", "force")
    }
    return replace(part(record, np.arange(cycles * count)), **values)


def _zero_relaxes(record: Record, size: float, rng: Rng) -> Record:
    """The load cell's zero moves by `size` peak-to-peak while it warms up, in the first fifth of the record."""
    relaxed = 1 - np.exp(-share_of_time(record) / 0.2)
    return replace(record, force=record.force + rng.choice([-1, 1]) * size * span_of(record.force) * relaxed)


def _switched_on_late(record: Record, size: float, rng: Rng) -> Record:
    """The force reads its zero for the first `size` of the record, with noise."""
    force = record.force.copy()
    off = share_of_time(record) < size
    force[off] = 5e-4 * span_of(force) * rng.standard_normal(int(np.count_nonzero(off)))
    return replace(record, force=force)


def _reversed_polarity(record: Record, size: float, rng: Rng) -> Record:
    """The force counts the other way round in the last `size` of the record."""
    return replace(record, force=np.where(share_of_time(record) > 1 - size, -record.force, record.force))


def _skewed(record: Record, size: float, rng: Rng) -> Record:
    """Every second sample of the force is `size` of a period older than it should be: a multiplexer."""
    late: Floats = np.interp(record.time - size * period_of(record), record.time, record.force)
    return replace(record, force=np.where(np.arange(late.size) % 2, late, record.force))


def _displacement_late(record: Record, size: float, rng: Rng) -> Record:
    """The displacement comes over the controller's bus, late by `size` of a period."""
    late = size * period_of(record)
    moved = np.interp(record.time - late, record.time, record.displacement)
    return part(replace(record, displacement=moved), record.time >= record.time[0] + late)


def _echo(record: Record, size: float, rng: Rng) -> Record:
    """The displacement's cable couples `size` of its peak-to-peak noise bursts in, at one moment of every cycle."""
    phase = record.time / period_of(record) % 1.0
    at = rng.uniform(0.1, 0.9)
    near = np.abs(phase - at) < 0.03
    noise = rng.standard_normal(phase.size) * near
    return replace(record, displacement=record.displacement + size * span_of(record.displacement) * noise)


KINDS: tuple[Kind, ...] = (
    Kind("force amplifier limited in slew rate", "of the fastest rate", 0.1, 0.9, _slew_limited("force")),
    Kind("displacement amplifier limited in slew rate", "of the fastest rate", 0.02, 0.4,
         _slew_limited("displacement")),
    Kind("force amplifier overloads, recovers slowly", "of the half range", 0.05, 0.6, _overloaded),
    Kind("telemetry packets lost, last sample held", "of the packets", 0.01, 0.4, _packets(False)),
    Kind("telemetry packets lost, bridged by lines", "of the packets", 0.02, 0.7, _packets(True)),
    Kind("force stored on change only", OF_SPAN, 0.005, 0.3, _compressed("force")),
    Kind("displacement stored on change only", OF_SPAN, 0.005, 0.3, _compressed("displacement")),
    Kind("force averaged over a moving window", OF_PERIOD, 0.01, 0.3, _averaged("force")),
    Kind("displacement averaged over a moving window", OF_PERIOD, 0.01, 0.3, _averaged("displacement")),
    Kind("displacement coupled AC", "of the frequency", 0.01, 0.6, _ac_coupled),
    Kind("force held at a slower, uneven rate", OF_PERIOD, 0.01, 0.15, _held_uneven("force")),
    Kind("displacement held at a slower, uneven rate", OF_PERIOD, 0.01, 0.1, _held_uneven("displacement")),
    Kind("carrier aliased into the force", OF_SPAN, 0.02, 0.6, _aliased("force")),
    Kind("carrier aliased into the displacement", OF_SPAN, 1e-3, 0.1, _aliased("displacement")),
    Kind("bit of the force stuck", OF_SPAN, 0.01, 0.4, _stuck_bit("force")),
    Kind("bit of the displacement stuck", OF_SPAN, 2e-3, 0.2, _stuck_bit("displacement")),
    Kind("displacement sensor's clamp gives with the force", OF_SPAN, 5e-3, 0.2, _clamp_slips),
    Kind("displacement sensor's clamp slips once", OF_SPAN, 0.01, 0.5, _slips_once),
    Kind("buffers of the logger exchanged", OF_PERIOD, 0.01, 0.2, _buffers_exchanged),
    Kind("buffers of the force written twice", "of the buffers", 0.01, 0.4, _buffer_twice),
    Kind("time stamps rounded", "of a step", 0.1, 0.99, _rounded_stamps),
    Kind("encoder's scale error", OF_SPAN, 1e-3, 0.05, _scale_error),
    Kind("gain of the force pulsates", "of the gain", 0.02, 0.5, _pulsating),
    Kind("cycles averaged with a wrong period", "of the period", 0.002, 0.06, _averaged_cycles),
    Kind("load cell's zero relaxes", OF_SPAN, 0.005, 0.4, _zero_relaxes),
    Kind("force switched on late", "of the record", 0.02, 0.6, _switched_on_late),
    Kind("polarity of the force reversed late", "of the record", 0.02, 0.5, _reversed_polarity),
    Kind("every second force sample late", OF_PERIOD, 5e-3, 0.2, _skewed),
    Kind("displacement late, by the controller's bus", OF_PERIOD, 2e-3, 0.12, _displacement_late),
    Kind("bursts on the displacement in every cycle", "RMS, of the peak-to-peak value", 1e-3, 0.05, _echo),
)  # fmt: skip

# A loop that crosses zero steeply is, with a dead zone, that of a damper of a smaller yield force.
UNOBSERVABLE: tuple[Kind, ...] = (Kind("force amplifier with a dead zone", OF_SPAN, 0.02, 0.4, _dead_zone),)
