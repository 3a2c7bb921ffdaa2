"""What a rig's file holds after reading: channels in SI, what is missing, what was noticed.

Readers make a `Record`, quality checks add findings to it or refuse it, `to_run` hands it on.
Nothing is filled in or moved: missing samples stay NaN here and are left out of the run.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from mrdamper.data import Floats, Run

REQUIRED = ("time", "displacement", "force")
OPTIONAL = ("velocity", "acceleration", "current", "voltage", "temperature")


@dataclass(frozen=True, slots=True)
class Finding:
    """Something noticed in a record that does not stop its use.

    Attributes
    ----------
    code : str
        Stable: W_MISSING, W_CLIPPED, ...
    text : str
        One sentence with the figures behind it.
    """

    code: str
    text: str

    def __str__(self) -> str:
        return f"{self.text} [{self.code}]"


@dataclass(frozen=True, eq=False)
class Record:
    """One test as a rig's file holds it.

    Attributes
    ----------
    id : str
        Name of the run to be.
    time, displacement, force : (N,) arrays
        [s], [m], [N], NaN where a sample is missing; positive in extension.
    velocity, acceleration, current, voltage, temperature : (N,) arrays or None
        [m/s], [m/s²], [A], [V], [°C], where the file or the profile has them.
    findings : tuple of Finding
        In the order they were noticed.
    provenance : mapping of str to str
        File name, hash, profile and remarks.
    rig, excitation, split : str
        As for `Run`.
    segments : tuple of (int, int)
        Half-open sample ranges without a gap in time; empty before the checks looked.
    """

    id: str
    time: Floats
    displacement: Floats
    force: Floats
    velocity: Floats | None = None
    acceleration: Floats | None = None
    current: Floats | None = None
    voltage: Floats | None = None
    temperature: Floats | None = None
    findings: tuple[Finding, ...] = ()
    provenance: Mapping[str, str] = field(default_factory=dict)
    rig: str = ""
    excitation: str = "sine"
    split: str = "train"
    segments: tuple[tuple[int, int], ...] = ()

    @property
    def present(self) -> np.ndarray:
        """(N,) mask of the samples at which time, displacement, force and current are there."""
        there = np.isfinite(self.time) & np.isfinite(self.displacement) & np.isfinite(self.force)
        return there if self.current is None else there & np.isfinite(self.current)

    def noticed(self, *findings: Finding) -> Record:
        """The same record with further findings."""
        return replace(self, findings=(*self.findings, *findings))
