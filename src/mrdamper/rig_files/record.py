"""Record of a rig's file: channels in SI, missing information, findings.

Readers make a `Record`, quality checks add findings to it or refuse it, `to_run` hands it on.
Nothing is filled in or moved: missing samples stay NaN here and are left out of the run.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from mrdamper.data.arrays import Floats, chunks
from mrdamper.errors import InputError

REQUIRED = ("time", "displacement", "force")
OPTIONAL = ("velocity", "acceleration", "current", "voltage", "temperature", "pressure")
SIGNED = ("displacement", "force")  # rigs count them positive in extension or in compression
HEAD = "head"  # in the provenance: lines above a test with a name and a value, for rows of a table that state the same
COARSE_CLOCK = 0.1  # share of the samples whose stamp is that of the one before
FURTHER = {"acceleration": "m_s2", "voltage": "V", "temperature": "C", "pressure": "Pa"}  # and their SI unit


@dataclass(frozen=True, slots=True)
class Finding:
    """Something noticed in a record that does not stop its use."""

    code: str  # stable: W_MISSING, W_CLIPPED, ...
    text: str  # one sentence with the figures behind it

    def __str__(self) -> str:
        return f"{self.text} [{self.code}]"


@dataclass(frozen=True, slots=True)
class SteadyPart:
    """The steady motion of a record."""

    window: tuple[float, float] | None  # start and end of its last whole cycles [s]; None for a motion without a period
    repeatability: float | None  # scatter of the force over its peak-to-peak value; None under two cycles


@dataclass(frozen=True, eq=False)
class Record:
    """One test as a rig's file holds it."""

    id: str  # name of the run to be
    time: Floats  # (N,) [s]; NaN where a sample is missing, as in all channels
    displacement: Floats  # [m], positive in extension
    force: Floats  # [N], positive in extension
    velocity: Floats | None = None  # [m/s]; this and the others where the file or the profile has them
    acceleration: Floats | None = None  # [m/s²]
    current: Floats | None = None  # [A]
    voltage: Floats | None = None  # [V]
    temperature: Floats | None = None  # [°C]
    pressure: Floats | None = None  # [Pa]
    further: Mapping[str, Floats] = field(default_factory=dict)  # by name and SI unit: second sensors, the raw force
    findings: tuple[Finding, ...] = ()  # in the order they were noticed
    provenance: Mapping[str, str] = field(default_factory=dict)  # file name, hash, profile and remarks
    rig: str = ""  # this and the next two as for `Run`
    excitation: str = "sine"
    split: str = "train"
    segments: tuple[tuple[int, int], ...] = ()  # sample ranges without a gap in time; empty before the checks looked
    lines: np.ndarray | None = None  # (N,) line of every sample, counted from one, where the file is text
    window: tuple[float, float] | None = None  # steady window of a stored run [s]; of a new record it is found
    steady: SteadyPart | None = None  # found by the checks; of a long record, checked in parts, found afterwards
    doubt: InputError | None = None  # statements of its current that contradict each other, until another decides

    @property
    def channels(self) -> dict[str, Floats]:
        """The channels there are, by name."""
        named = {name: getattr(self, name) for name in (*REQUIRED, *OPTIONAL)}
        return {name: values for name, values in named.items() if values is not None}

    @property
    def present(self) -> np.ndarray:
        """(N,) mask of the samples at which time, displacement, force and current are there."""
        there = np.ones(self.time.size, dtype=bool)
        for values in (self.time, self.displacement, self.force, self.current):
            for at, piece in () if values is None else chunks(values):
                there[at : at + piece.size] &= np.isfinite(piece)
        return there

    def noticed(self, *findings: Finding) -> Record:
        """Return the same record with further findings."""
        return replace(self, findings=(*self.findings, *findings))


def part_of_record(record: Record, rows: slice, name: str = "") -> Record:
    """Return the samples of some rows of a record, under its name or another."""
    channels = {channel: values[rows] for channel, values in record.channels.items()}
    further = {channel: values[rows] for channel, values in record.further.items()}
    lines = None if record.lines is None else record.lines[rows]
    return replace(record, id=name or record.id, lines=lines, further=further, **channels)  # type: ignore[arg-type]


def unique_names(names: Iterable[str], taken: Iterable[str] = ()) -> list[str]:
    """Return names told apart by numbers, from those that are taken and from each other."""
    used, own = set(taken), []
    for name in names:
        new, count = name, 2
        while new in used:
            new, count = f"{name}_{count}", count + 1
        used.add(new)
        own.append(new)
    return own


def last_parts(paths: Iterable[tuple[str, ...]]) -> dict[tuple[str, ...], str]:
    """Return the name of each path, with as many of its folders as tell it from the others."""
    paths = {*paths}
    endings = Counter(path[-n:] for path in paths for n in range(1, len(path) + 1))
    alone = {path: [path[-n:] for n in range(1, len(path) + 1) if endings[path[-n:]] == 1] for path in paths}
    return {path: "/".join(own[0] if own else path) for path, own in alone.items()}


@dataclass(frozen=True, eq=False)
class Refusal:
    """A file or a test of it that cannot be used, and why."""

    file: str
    error: InputError
    run: str = ""  # of a test that could be read and not used, its name
