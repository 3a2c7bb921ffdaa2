"""Detection rates of faults in synthetic records, and rates of false findings in clean records.

Tests compare the rates with their goals on few records, `benchmarks/import_detection.py` on more.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from mrdamper.errors import QualityError
from mrdamper.physics.motion import analyse_motion
from mrdamper.rig_files.quality import check_record
from mrdamper.rig_files.quality.table import record_of, to_run
from mrdamper.rig_files.record import Record
from support.rig_records import clean_record, codes_of, with_channel

EXCHANGED_UNITS = (1.0, 1e3, 1e-4)  # metres that stand for a newton where the columns are exchanged


@dataclass(frozen=True)
class Rate:
    """Result of a number of records.

    Attributes
    ----------
    missed : tuple of (seed or run id, result)
    tried : int
    """

    missed: tuple[tuple[object, object], ...]
    tried: int

    @property
    def found(self) -> int:
        return self.tried - len(self.missed)

    @property
    def share(self) -> float:
        return self.found / self.tried


def rate(cases: Iterable[tuple[object, Record]], wanted: Callable[[list[str]], bool]) -> Rate:
    """Check every record, and count those with the required codes."""
    missed, tried = [], 0
    for name, record in cases:
        codes = codes_of(record)
        tried += 1
        if not wanted(codes):
            missed.append((name, codes))
    return Rate(tuple(missed), tried)


def clean_passed(count: int, first: int = 0, make=None) -> Rate:
    """Clean records of all dampers without findings, every other one with a velocity channel."""
    seeds = range(first, first + count)
    return rate(((s, clean_record(s, velocity=s % 2 == 0, make=make)) for s in seeds), lambda codes: not codes)


def bundled_passed(runs) -> Rate:
    """Bundled runs without findings beyond those of their data sheets."""
    missed = [(run.id, wrong) for run in runs if (wrong := unfounded_codes(run, codes_of(record_of(run))))]
    return Rate(tuple(missed), len(runs))


def unfounded_codes(run, codes: list[str]) -> list[str]:
    """Codes of a run beyond its known faults: a flattened sine at the shaking table, positions that drift there."""
    founded = set()
    if run.excitation == "chirp":
        founded = {"W_NOT_SINE", "W_DRIFT"}
    else:
        motion, (start, stop) = analyse_motion(run), run.window
        # The checks determine the steady window: distortions near the limit may be on either side.
        if motion.distortion > 0.045:
            founded.add("W_NOT_SINE")
        if abs(motion.drift) * (stop - start) > 0.2 * motion.condition.amplitude_m:
            founded.add("W_DRIFT")
    return [code for code in codes if code not in founded]


def opposite_found(count: int) -> Rate:
    """Forces of the wrong sign."""
    records = ((s, clean_record(s)) for s in range(count))
    return rate(((s, replace(r, force=-r.force)) for s, r in records), lambda codes: codes == ["E_DISSIPATION_SIGN"])


def exchanged_found(count: int, unit: float) -> Rate:
    """Exchanged displacement and force, in the units of the header."""
    records = ((s, clean_record(s)) for s in range(count))
    cases = ((s, replace(r, displacement=r.force * unit, force=r.displacement / unit)) for s, r in records)
    return rate(cases, lambda codes: codes[:1] in (["E_DISSIPATION_SIGN"], ["E_RANGE"]))


def clipping_found(count: int, seed: int = 11) -> Rate:
    """Flat tops of five samples and more, of 3 to 30 % of the amplitude, in displacement or force."""
    rng = np.random.default_rng(seed)
    records = ((s, clip(clean_record(s, sensor=rng.choice([0, 5e-6])), rng)) for s in range(count))
    return rate(((s, r) for s, r in records if r is not None), lambda codes: "W_CLIPPED" in codes)


def clip(record: Record, rng: np.random.Generator) -> Record | None:
    """Cut a random channel off at one or both ends so that at least five samples are equal; None if it does not."""
    name = str(rng.choice(["displacement", "force"]))
    values = getattr(record, name)
    middle, half, level = (values.max() + values.min()) / 2, np.ptp(values) / 2, rng.uniform(0.7, 0.97)
    low, high = [(-np.inf, level), (-level, np.inf), (-level, level)][rng.integers(3)]
    cut = np.clip(values, middle + low * half, middle + high * half)
    flat = max(longest_equal(cut, edge) for edge in (cut.max(), cut.min()))
    return replace(record, **{name: cut}) if flat >= 5 else None


def longest_equal(values, level) -> int:
    longest = here = 0
    for same in values == level:
        here = here + 1 if same else 0
        longest = max(longest, here)
    return longest


def freezing_found(count: int, seed: int = 12) -> Rate:
    """Stretches of 8 to 60 equal samples anywhere in displacement or force."""
    return rate(_frozen(count, np.random.default_rng(seed)), lambda codes: "W_FROZEN" in codes)


def _frozen(count: int, rng: np.random.Generator) -> Iterator[tuple[int, Record]]:
    for seed in range(count):
        record = clean_record(seed, sensor=rng.choice([0, 5e-6]))
        length = int(rng.integers(8, 61))
        start = int(rng.integers(5, record.time.size - length - 5))

        def freeze(values, start=start, length=length):
            values[start : start + length] = values[start]

        yield seed, with_channel(record, str(rng.choice(["displacement", "force"])), freeze)


def late_velocity_found(count: int, seed: int = 5) -> Rate:
    """Velocity channels 2 to 20 samples late or early, with 1 % noise, refused with the lag to one sample."""
    rng, missed = np.random.default_rng(seed), []
    for number in range(count):
        record = clean_record(number, velocity=True)
        step = record.time[1] - record.time[0]
        samples = int(rng.choice([-15, -8, -4, -2, 2, 3, 5, 10, 20]))
        late = np.interp(record.time - samples * step, record.time, record.velocity)
        late += 0.01 * np.ptp(late) / 2 * rng.standard_normal(late.size)
        inside = slice(25, -25)
        cut = {name: getattr(record, name)[inside] for name in ("time", "displacement", "force", "current")}
        stated = stated_lag(replace(record, velocity=late[inside], **cut))
        if stated is None or abs(stated - samples * step) >= step:
            missed.append((number, stated))
    return Rate(tuple(missed), count)


def stated_lag(record: Record) -> float | None:
    """Lag of the velocity channel [s] for which a record is refused, None if it is not."""
    try:
        check_record(record)
    except QualityError as error:
        words = error.found.split()
        if error.code == "E_CHANNEL_LAG" and "ms" in words:
            return float(words[words.index("ms") - 1]) / 1e3 * (1 if "behind" in words else -1)
    return None


def late_force_found(count: int, lag: float, damper: str | None = None, first: int = 0) -> Rate:
    """Forces delayed by a share of the period. A smooth delayed force equals one with a spring."""
    seeds = range(first, first + count)
    records = ((s, late_force(clean_record(s, damper=damper, cycles=3.4), lag)) for s in seeds)
    return rate(records, lambda codes: "W_LAG" in codes)


def late_force(record: Record, lag: float) -> Record:
    period = 1 / analyse_motion(to_run(record)).condition.frequency_Hz
    return replace(record, force=np.interp(record.time - lag * period, record.time, record.force))
