"""The gas spring held in every identification, the paper's range of tests, and the functions that tests determine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrdamper.data import Condition, Floats, Run
from mrdamper.errors import IdentificationError
from mrdamper.identification import Method, identify
from mrdamper.identification.basis import Basis
from mrdamper.identification.harmonic_balance import separate_mass
from mrdamper.identification.methods.balance import Balance
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.physics.gas_spring import GasSpring
from mrdamper.physics.motion import analyse_motion

HIGHEST_CURRENT, HIGHEST_FREQUENCY = 2.0, 2.0  # of the paper's tests [A], [Hz]
_TOLERANCE = 1.05  # relative, of a measured current or frequency against its nominal value
SAME = 0.08  # relative difference within which two amplitudes or frequencies are one level

# Function, levels it takes: currents, frequencies, amplitudes, products of frequency and amplitude.
_FUNCTIONS = (
    ("c over current, frequency and amplitude (Eq. 23–26)", (3, 1, 1, 3)),
    ("m over current and frequency (Eq. 27–31)", (3, 3, 1, 1)),
    ("alpha over current, frequency and amplitude (Eq. 32–36)", (3, 2, 2, 1)),
    ("beta over current and frequency (Eq. 37–40)", (3, 3, 1, 1)),
)


@dataclass(frozen=True)
class PaperAssumptions:
    """Parameters held in every identification by the paper's method: the gas spring, or what replaces it."""

    gas: GasSpring | None
    fixed: tuple[tuple[str, float], ...] = ()
    free: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()  # origin of the stiffness, where the gas spring is not known

    @classmethod
    def of(cls, train: Sequence[Run], gas: GasSpring | None) -> PaperAssumptions:
        """Take the gas spring (`ParameterError` without gas volume), or separate stiffness and mass by frequency."""
        if gas is not None:
            longest = max(float(np.ptp(run.displacement)) / 2 for run in train)
            gas.force([-longest, longest])  # refuses motions that leave no gas volume
            return cls(gas)
        identifications = [identify(run, BoucWen, Balance()) for run in train]
        stiffness = [float(i.model.k1) for i in identifications if isinstance(i.model, BoucWen)]
        try:
            k1, m = separate_mass([i.condition for i in identifications], stiffness)
        except IdentificationError as error:
            note = f"the gas spring is unknown and {error}: the mass is not identified, k1 holds k1 − m ω²"
            return cls(None, notes=(note,))
        note = (
            f"the gas spring is unknown: k1 = {k1:.4g} N/m comes from a regression of the consistent in-phase "
            f"stiffness k1 − m ω² over the frequencies (with m = {m:.3g} kg); k2 = k3 = 0"
        )
        return cls(None, (("k1", k1), ("k2", 0.0), ("k3", 0.0)), ("m",), (note,))

    def basis(self, method: str | Method) -> Basis:
        """Return the identification of the Bouc–Wen model by a method, with these parameters held."""
        return Basis("bouc-wen", method, self.free, self.fixed, self.gas)

    def preset(self, presets: Sequence[tuple[str, float]]) -> PaperAssumptions:
        """Return the same with more parameters held."""
        return replace(self, fixed=(*self.fixed, *presets))


def outside_paper_range(train: Sequence[Run]) -> tuple[str, ...]:
    """Name currents and frequencies above those of the paper's tests."""
    conditions = [analyse_motion(run).condition for run in train]
    current = max(abs(c.current_A) for c in conditions)
    frequency = max(c.frequency_Hz for c in conditions)
    beyond = []
    if current > _TOLERANCE * HIGHEST_CURRENT:
        beyond.append(f"currents up to {current:.3g} A (the paper: up to {HIGHEST_CURRENT:g} A)")
    if frequency > _TOLERANCE * HIGHEST_FREQUENCY:
        beyond.append(f"frequencies up to {frequency:.3g} Hz (the paper: 0.5 to {HIGHEST_FREQUENCY:g} Hz)")
    text = f"outside the range of the paper, where its functions were not tested: {'; '.join(beyond)}"
    return (text,) if beyond else ()


def missing_functions(conditions: Sequence[Condition]) -> tuple[str, ...]:
    """Name the functions of the paper that tests at these conditions do not determine."""
    there = _levels(conditions)
    return tuple(name for name, least in _FUNCTIONS if any(n < m for n, m in zip(there, least, strict=True)))


def require_paper_functions(train: Sequence[Run]) -> None:
    """Refuse, as E_PAPER_TESTS with their names, tests that do not determine every function of the paper."""
    conditions = [analyse_motion(run).condition for run in train]
    if missing := missing_functions(conditions):
        names = ("current", "currents"), ("frequency", "frequencies"), ("amplitude", "amplitudes")
        levels = zip(_levels(conditions), names, strict=False)
        text = ", ".join(f"{count} {one if count == 1 else several}" for count, (one, several) in levels)
        raise IdentificationError(
            f"the tests have {text}: the paper's functions of {'; of '.join(missing)} cannot be made",
            remedy="test at least 3 currents, 3 frequencies and 2 amplitudes, or take shorter functions "
            "in their place: --set functions=shorter",
            code="E_PAPER_TESTS",
        )


def _levels(conditions: Sequence[Condition]) -> tuple[int, int, int, int]:
    """Count currents, frequencies, amplitudes and their products that differ by more than a rig's repeatability."""
    currents = np.unique(np.round([c.current_A for c in conditions], 2)).size
    frequency, amplitude = (np.log([getattr(c, name) for c in conditions]) for name in ("frequency_Hz", "amplitude_m"))

    def count(logs: Floats) -> int:
        return 1 + int(np.count_nonzero(np.diff(np.sort(logs)) > SAME))

    return currents, count(frequency), count(amplitude), count(frequency + amplitude)
