"""A synthetic fleet: dampers of one population on a virtual rig with known parameters.

Production scatter, ageing, session drift, planted faults, master dampers. It is used by tests and benchmarks.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date, timedelta
from pathlib import Path

import numpy as np

from mrdamper.data import Condition, Dataset, Run
from mrdamper.errors import UnknownNameError
from mrdamper.paper.virtual_rig import SYNTHETIC, VirtualRig
from mrdamper.physics.motion import sine
from mrdamper.rig_files.dataset_folder import save_dataset

MATRIX = tuple(Condition(current, f, 0.020) for f in (1.0, 2.0) for current in (0.0, 1.0))
SPREAD: Mapping[str, float] = {  # of one damper from the next, relative
    "gas_pressure": 0.01,
    "offset_force": 0.01,
    "yield_per_ampere": 0.015,
    "viscosity": 0.02,
    "friction_low": 0.04,
    "friction_high": 0.04,
    "knee": 0.03,
    "cavity_time": 0.04,
}
FAULTS: Mapping[str, Mapping[str, float]] = {  # factors
    "low gas": {"gas_pressure": 0.6, "offset_force": 0.6},
    "air in oil": {"cavity_time": 2.0, "cavity_depth": 2.0},
    "worn seal": {"friction_low": 0.3, "friction_high": 0.3, "viscosity": 0.85},
    "wrong coil": {"yield_per_ampere": 0.8, "saturation_current": 1.25},
}
_FIRST_DAY = date(2024, 1, 8)


@dataclass(frozen=True)
class VirtualDamper:
    """One damper of one session, and what is true of it."""

    serial: str
    session: str
    batch: str
    date: str
    golden: bool
    fault: str  # a name of `FAULTS`, or empty
    rig: VirtualRig  # the damper and its sensors
    gain: float  # of the rig's load cell in this session
    seed: int  # of its sensor noise

    def dataset(self, conditions: Sequence[Condition] = MATRIX, cycles: int = 3) -> Dataset:
        """Its records: steady cycles after one of run-in."""
        return Dataset(tuple(self._run(c, n, cycles) for n, c in enumerate(conditions)), self.serial)

    def _run(self, condition: Condition, number: int, cycles: int) -> Run:
        motion = sine(condition, cycles + 1, round(self.rig.sample_rate / condition.frequency_Hz))
        facts = {"serial": self.serial, "session": self.session, "batch": self.batch, "date": self.date}
        return self.rig.sense(
            motion,
            self.gain * self.rig.force(motion),
            np.random.default_rng((self.seed, number)),
            id=f"{condition.frequency_Hz:g}Hz-{condition.current_A:g}A",
            nominal=condition,
            window=(1 / condition.frequency_Hz, float(motion.time[-1])),
            notes={**SYNTHETIC, **facts, "golden": "yes" if self.golden else "no"},
        )


@dataclass(frozen=True)
class Population:
    """Production and test plan of a synthetic population of dampers."""

    dampers: int = 200
    sessions: int = 10  # test days, the dampers spread over them evenly; three sessions are a batch
    golden: int = 2  # dampers that are tested again in every session
    # relative change of the load cell, and of the dampers' forces, from the first session to the last
    rig_drift: float = 0.0
    line_drift: float = 0.0
    session_scatter: float = 0.002  # standard deviation of the load cell's gain from session to session
    ageing: float = 0.0  # relative loss of viscosity of a golden damper by all its tests
    faults: Mapping[str, int] = field(default_factory=dict)  # number of dampers with each fault
    base: VirtualRig = field(default_factory=VirtualRig)
    seed: int = 0

    def __iter__(self) -> Iterator[VirtualDamper]:
        """Yield the dampers in the order they are tested, master dampers first in every session."""
        for name in self.faults:
            if name not in FAULTS:
                raise UnknownNameError.of("fault", name, FAULTS)
        rng = np.random.default_rng(self.seed)
        gains = 1 + self.session_scatter * rng.standard_normal(self.sessions)
        golden = [self._spread(rng) for _ in range(self.golden)]
        planted = self._planted(rng)
        for session, numbers in enumerate(np.array_split(np.arange(self.dampers), self.sessions)):
            share = session / max(1, self.sessions - 1)
            about = {
                "session": f"S{session + 1:03}",
                "batch": f"B{session // 3 + 1:02}",
                "date": (_FIRST_DAY + timedelta(days=session)).isoformat(),
                "gain": float(gains[session] * (1 + self.rig_drift * share)),
            }
            for number, rig in enumerate(golden):
                aged = replace(rig, viscosity=rig.viscosity * (1 - self.ageing * share))
                seed = self.seed * 1_000_000 + 900_000 + 100 * session + number
                yield VirtualDamper(f"G{number + 1}", golden=True, fault="", rig=aged, seed=seed, **about)  # type: ignore[arg-type]
            for number in numbers.tolist():
                fault = planted.get(number, "")
                rig = _scaled(self._spread(rng), dict.fromkeys(_STRONG, 1 + self.line_drift * share))
                rig = _scaled(rig, FAULTS.get(fault, {}))
                seed = self.seed * 1_000_000 + number
                yield VirtualDamper(f"D{number + 1:06}", golden=False, fault=fault, rig=rig, seed=seed, **about)  # type: ignore[arg-type]

    def _planted(self, rng: np.random.Generator) -> dict[int, str]:
        names = [name for name, count in self.faults.items() for _ in range(count)]
        places = rng.choice(self.dampers, size=len(names), replace=False)
        return {int(place): name for place, name in zip(places, names, strict=True)}

    def _spread(self, rng: np.random.Generator) -> VirtualRig:
        return _scaled(self.base, {name: 1 + spread * rng.standard_normal() for name, spread in SPREAD.items()})


_STRONG = ("yield_off", "yield_per_ampere", "viscosity", "viscosity_per_ampere", "friction_low", "friction_high")


def _scaled(rig: VirtualRig, factors: Mapping[str, float]) -> VirtualRig:
    return replace(rig, **{name: getattr(rig, name) * float(factor) for name, factor in factors.items()})


def write_fleet(dampers: Iterator[VirtualDamper] | Population, folder: str | Path) -> None:
    """Write a dataset folder a damper and session: SERIAL, or SERIAL-SESSION for golden dampers.

    Raises `OutputError` if a folder exists already or cannot be written.
    """
    for damper in dampers:
        name = f"{damper.serial}-{damper.session}" if damper.golden else damper.serial
        save_dataset(damper.dataset(), Path(folder) / name)
