"""Finding on a run that contradicts the others: code, explanation and remedy."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from mrdamper.data import Run
from mrdamper.data.wording import counted, number
from mrdamper.rig_files.column_names import DIMENSION, SI, Unit, parse_unit
from mrdamper.study.contradictions.copies import Copy
from mrdamper.study.contradictions.explanations import Explanation, Trial
from mrdamper.study.contradictions.tracks import SAME_CURRENT

CODES = {
    "force": "E_FORCE_SCALE",
    "offset": "E_FORCE_ZERO",
    "current": "E_OTHER_CURRENT",
    "displacement": "E_STROKE_SCALE",
    "time": "E_TIME_SCALE",
    "sign": "E_BOTH_SIGNS",
    "damper": "E_OTHER_DAMPER",
    "shifted": "E_SHIFTED_ROWS",
    "copy": "E_TWICE",
    "clipped": "W_CLIPPED",
    "lag": "W_LAG",
    "filter": "W_FILTERED",
}
_LAGS = {"W_FILTERED": "filter", "W_LAG": "lag"}  # causes by findings on a record that change the form of its loop
_DECADE = 0.02  # decimal logarithm within which a ratio is a power of ten
_MAX_POWER = 20  # of ten, up to which odds are told


@dataclass(frozen=True)
class Contradiction:
    """A run that contradicts the others of its rig."""

    run_id: str
    cause: str  # one of `CODES`
    # factor that corrects force, displacement or time; force to add [N]; apparent current [A]; correlation of the noise
    # of a copy
    value: float
    evidence: float  # logarithm of the odds of the explanation against none
    explanation: str
    remedy: str

    @property
    def code(self) -> str:
        """The stable code of the cause."""
        return CODES[self.cause]

    def __str__(self) -> str:
        return f"{self.explanation}; {self.remedy} [{self.code}]"


def describe(run: Run, explanation: Explanation, others: int) -> Contradiction:
    """Describe the explanation of a run, which was compared with a number of others."""
    text = {
        "force": _force, "offset": _offset, "current": _current, "displacement": _displacement, "time": _time,
        "sign": _sign, "damper": _damper, "shifted": _shifted,
    }[explanation.cause]  # fmt: skip
    cause: str = explanation.cause
    if cause == "damper" and (code := next((code for code in _LAGS if code in run.findings), None)):
        cause, text = _LAGS[code], _lag
    contradiction, remedy = text(run, explanation.trial)
    power = explanation.gain / np.log(10)
    odds = f"10^{power:.0f}" if power < _MAX_POWER else f"over 10^{_MAX_POWER}"
    against = f"contradicts the other {counted(others, 'run')}: {contradiction} (odds of {odds} to 1)"
    return Contradiction(run.id, cause, explanation.trial.value, explanation.gain, against, remedy)


def describe_copy(copy: Copy, validation: bool) -> Contradiction:
    """Describe a copy of a run."""
    text = f"a copy of run {copy.original}: their forces share the noise (correlation {copy.correlation:.2f})"
    remedy = "a test counts once" + (", and validation needs tests of its own" if validation else "")
    return Contradiction(copy.run_id, "copy", copy.correlation, float("inf"), text, f"{remedy}: delete the file")


def describe_clipped(run: Run, level: float, others: int) -> Contradiction:
    """Describe a run whose force ends at a level [N] at which other runs are cut off."""
    text = f"its force is flat at {number(level, 3)} N, where that of {counted(others, 'other run')} is cut off"
    return Contradiction(run.id, "clipped", level, float("inf"), text, "record it again with a wider range")


def _force(run: Run, e: Trial) -> tuple[str, str]:
    if e.unit:
        return _misread(run, "force", "N", e)
    what = f"its force is {number(1 / e.value, 3)} times what the others show: another range of the load cell"
    remedy = f"{_corrected(run, 'force', e.value)}, or {_specimen(run)}"
    if abs(run.mean_current) <= SAME_CURRENT:
        what += ", a magnetisation that other tests left"
        remedy += ", or demagnetise the damper before every test without current"
    return f"{what}, or another damper", remedy


def _displacement(run: Run, e: Trial) -> tuple[str, str]:
    if e.unit:
        return _misread(run, "displacement", "mm", e)
    text = f"its displacement is about {number(1 / e.value, 2)} times what its force shows"
    return text, _corrected(run, "displacement", e.value)


def _misread(run: Run, channel: str, usual: str, e: Trial) -> tuple[str, str]:
    true, read = (usual, e.unit[4:]) if e.unit.startswith("not ") else (e.unit, usual)
    text = f"its {channel} is {number(1 / e.value, 3)} times what the others show, the ratio of {read} to {true}"
    return text, _corrected(run, channel, e.value, true, read=read)


def _offset(run: Run, e: Trial) -> tuple[str, str]:
    return f"the zero of its force is off by {number(-e.value, 3)} N", _shifted_by(run, "force", e.value)


def _current(run: Run, e: Trial) -> tuple[str, str]:
    tested = abs(run.mean_current)
    if e.unit == "mA":
        return (f"its current of {_amperes(tested)} looks like {1e3 * e.value:.4g} mA", corrected_unit(run, e.value))
    why = "an open coil, or no supply" if e.value == 0 else "a partly open coil, or another current than written down"
    if e.value > tested:
        why = "another current than written down"
    return (f"its force is that of {_amperes(e.value)}, not of {_amperes(tested)}: {why}", _repeated(run, e.value))


def _time(run: Run, e: Trial) -> tuple[str, str]:
    remedy = _corrected(run, "time", e.value)
    if run.notes.get("time_from"):  # no column contains it
        rate = (run.time.size - 1) / float(np.ptp(run.time)) / e.value
        remedy = _own_profile(run, f"[file] sample_rate_Hz = {rate:.5g}")
    return f"its time runs {number(1 / e.value, 2)} times as long as its force shows: another sample rate", remedy


def _sign(run: Run, e: Trial) -> tuple[str, str]:
    lines = [f"[channels.{name}] sign = {-_sign_read(run, name)}" for name in ("force", "displacement")]
    text = "its force and displacement both count in the other direction"
    remedy = _own_profile(run, " and ".join(lines))
    if not e.zero:
        return text, remedy
    text += f", or the zero of its force is off by {number(-e.zero, 3)} N"
    return text, f"{remedy}; or, if it is the zero, {_shifted_by(run, 'force', e.zero)}"


def _damper(run: Run, e: Trial) -> tuple[str, str]:
    return "no factor, offset or current explains its force: another damper, or another state of it", _specimen(run)


def _lag(run: Run, e: Trial) -> tuple[str, str]:
    codes = " and ".join(code for code in _LAGS if code in run.findings)
    return (
        f"its force lags or is filtered, as the check of its record shows ({codes}), and no factor, offset or current "
        "explains it",
        "repeat the test with both channels filtered alike and without play in the mounting",
    )


def _shifted(run: Run, e: Trial) -> tuple[str, str]:
    return (
        f"its current is that of another row of tests.csv, as those of other runs are: its force is that of "
        f"{_amperes(e.value)}, not of {_amperes(abs(run.mean_current))}",
        _repeated(run, e.value),
    )


def _own_profile(run: Run, line: str) -> str:
    file = run.notes.get("file", "") or run.id
    return f"import {file} on its own with {line} in the profile, then add it with import --add"


def _corrected(run: Run, channel: str, factor: float, unit: str = "", *, read: str = "") -> str:
    """State how a channel is multiplied by a factor: by its true unit, where the file was read in the other one."""
    stated, of = _unit_read(run, channel)
    if unit and of == parse_unit(read):
        return _own_profile(run, f'[channels.{channel}] unit = "{unit}"')
    scale = _scale_read(run, channel) * factor
    return _own_profile(run, f'[channels.{channel}] unit = "{stated}" and scale = {scale:.3g}')


def _shifted_by(run: Run, channel: str, value: float) -> str:
    unit, of = _unit_read(run, channel)
    offset, scale = _sign_read(run, channel) * value / of.factor, _scale_read(run, channel)
    return _own_profile(run, f'[channels.{channel}] unit = "{unit}" and scale = {scale:g} and offset = {offset:.3g}')


def _sign_read(run: Run, channel: str) -> int:
    return -1 if channel in run.notes.get("sign_changed", "").split(", ") else 1


def _scale_read(run: Run, channel: str) -> float:
    return float(dict(part.split(" = ") for part in run.notes.get("scaled", "").split(", ") if part).get(channel, 1.0))


def _unit_read(run: Run, channel: str) -> tuple[str, Unit]:
    """Return the unit in which the import read a channel of the run's file; the SI unit if it was not imported."""
    columns = re.split(r", (?=[a-z]+ = )", run.notes.get("columns", ""))
    text = next((c.rpartition(" in ")[2] for c in columns if c.startswith(f"{channel} = ")), SI[channel])
    return (text, unit) if (unit := parse_unit(text)) else (SI[channel], Unit(DIMENSION[channel], 1.0))


def _specimen(run: Run) -> str:
    return f"if {run.id} and other runs are of another damper, name it for them in the column rig of runs.csv"


def _stated_current(run: Run, current: float) -> str:
    """State how the current of a run without a current channel is corrected; another import would read the old one."""
    return f"set current_A of {run.id} to {current:.3g} in runs.csv of the dataset"


def corrected_unit(run: Run, current: float) -> str:
    """State how a current that was written in milliamperes is corrected, measured or stated."""
    return _stated_current(run, current) if _is_stated(run) else _own_profile(run, '[channels.current] unit = "mA"')


def _repeated(run: Run, current: float) -> str:
    """State how another current is corrected, the measured one by a decade or an offset, or that the test is wrong."""
    if _is_stated(run):
        return f"{_stated_current(run, current)}, or repeat the test"
    factor = max(current, 1e-9) / max(abs(run.mean_current), 1e-9)
    decades = np.log10(factor)
    remedy = _shifted_by(run, "current", np.copysign(current, run.mean_current) - run.mean_current)
    if min(current, abs(run.mean_current)) > SAME_CURRENT:
        remedy += f" (or with scale = {_scale_read(run, 'current') * factor:.3g}: one current does not show which)"
    if round(decades) != 0 and abs(decades - round(decades)) < _DECADE:
        remedy = _corrected(run, "current", 10.0 ** round(decades))
    return f"{remedy} (and correct the name of the file if it states a current), or repeat the test"


def _is_stated(run: Run) -> bool:
    return float(np.ptp(run.current)) == 0


def _amperes(current: float) -> str:
    return f"{current + 0.0:.3g} A"
