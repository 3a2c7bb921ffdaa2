"""What a reader should distrust: read off the results, in sentences."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.certainty import unsure
from mrdamper.dampers.joint import JointFit
from mrdamper.dampers.modified import ModifiedFit
from mrdamper.identification import Identification
from mrdamper.identification.loop_analysis import LoopAnalysis
from mrdamper.study.recipe import Scored
from mrdamper.validation import Validation

_WORDS = frozenset({"a", "A", "I"})  # names that are words of a sentence too
_SEARCHED = {"seat_share": "elastic displacement of the seat, as a share of the play"}
_WEAK_FUNCTION = 0.9  # left-out error over spread from which a function hardly beats the mean


def doubts(found: Scored, loops: Sequence[LoopAnalysis]) -> list[str]:
    """Sentences on where the model and its data deserve distrust, most consequential first."""
    sentences = [
        *_outside(found.damper),
        *(unsure(found.damper) if found.damper.certainty else ()),
        *_runs(found.cross_validated, found.validation),
        *(_functions(found.fit) if isinstance(found.fit, ModifiedFit) else ()),
        *(_joint(found.fit) if isinstance(found.fit, JointFit) else ()),
        *_identifications(found.identifications),
    ]
    return [*_explained(sentences, found.damper), *_tests(loops)]


def _explained(sentences: Sequence[str], damper: Damper) -> list[str]:
    """The same, each parameter with its meaning where it is first named."""
    parameters = damper.model_at(damper.envelope.middle).parameters()
    meanings = {info.name: info.meaning for info in parameters if info.name not in _WORDS} | _SEARCHED
    found = list(sentences)
    for name, meaning in meanings.items():
        named = re.compile(rf"(?<![\w.^])(?<!\d ){re.escape(name)}(\.\d+)?(?![\w^])")
        first = next((i for i, sentence in enumerate(found) if named.search(sentence)), None)
        if first is not None:
            found[first] = named.sub(lambda match, said=meaning: f"{match[0]} ({said})", found[first], count=1)
    return found


def _outside(damper: Damper) -> list[str]:
    e = damper.envelope
    return [
        f"Outside {e.current_A[0]:g}–{e.current_A[1]:g} A, {e.frequency_Hz[0]:.3g}–{e.frequency_Hz[1]:.3g} Hz, "
        f"{1e3 * e.amplitude_m[0]:.3g}–{1e3 * e.amplitude_m[1]:.3g} mm and "
        f"{e.peak_velocity_m_s[0]:.3g}–{e.peak_velocity_m_s[1]:.3g} m/s nothing was tested: "
        "predictions there are flagged as extrapolation."
    ]


def _runs(left_out: Validation, held_out: Validation) -> list[str]:
    sentences = []
    for validation, what in ((left_out, "left out"), (held_out, "held out")):
        if not validation.runs:
            continue
        worst = validation.worst()
        if worst.scores.nrmse_pp > 2 * validation.median():
            flags = f" ({', '.join(worst.extrapolation)} outside the tests)" if worst.extrapolation else ""
            sentences.append(
                f"The worst {what} run is {worst.run_id} at {worst.condition}: "
                f"{100 * worst.scores.nrmse_pp:.1f} % against a median of {100 * validation.median():.1f} %{flags}."
            )
    weak = sorted({r.run_id for r in left_out.runs if abs(r.scores.energy_error) > 0.15})
    if weak:
        names = _some(weak)
        sentences.append(f"Dissipated energy is off by more than 15 % when left out in {len(weak)} runs: {names}.")
    return sentences


def _functions(fit: ModifiedFit) -> list[str]:
    sentences = []
    middle = fit.conditions[len(fit.conditions) // 2]
    highest = fit.damper.envelope.current_A[1]
    for name, found in fit.functions.items():
        turn = found.function.turning_point(highest, middle.frequency_Hz, middle.amplitude_m)
        if turn is not None:
            place = "within" if turn <= highest else "beyond"
            sentences.append(f"{name} turns over at {turn:.2f} A, {place} the tested currents (up to {highest:g} A).")
        if found.left_out > _WEAK_FUNCTION and found.function.form != "constant":
            sentences.append(
                f"The function of {name} hardly predicts conditions left out of it "
                f"(error {found.left_out:.2f} of the spread)."
            )
    if fit.at_bounds:
        sentences.append(f"The function of {', '.join(fit.at_bounds)} leaves what was looked for.")
    levels = len({round(c.current_A, 3) for c in fit.conditions})
    if levels < 4:
        sentences.append(f"Only {levels} currents were tested: what happens between them is an assumption of the form.")
    return sentences


def _joint(fit: JointFit) -> list[str]:
    sentences = []
    if fit.at_bounds:
        sentences.append(f"At a limit of what is looked for, known from one side only: {', '.join(fit.at_bounds)}.")
    if not fit.ending.converged:
        sentences.append(f"The search for one set of parameters {fit.ending}.")
    if (other := fit.second) is not None:
        sentences.append(
            f"The search also ended at a knee of {1e3 * other.knee:.2f} mm instead of {1e3 * other.chosen_knee:.2f}, "
            f"with a mean error of {100 * other.error:.2f} % instead of {100 * other.chosen_error:.2f} %"
            + ("; conditions left out decided." if other.error < other.chosen_error else ".")
        )
    ratio = float(np.max(fit.nrmse_pp) / np.median(fit.nrmse_pp))
    if ratio > 2:
        sentences.append(f"The run described worst has {ratio:.1f} times the median error.")
    return sentences


def _identifications(identifications: Sequence[Identification]) -> list[str]:
    sentences = []
    bound: dict[str, list[str]] = {}
    for found in identifications:
        for name in found.at_bounds:
            bound.setdefault(name, []).append(found.run_id)
    for name, runs in bound.items():
        sentences.append(f"{name} ended at a limit of its range in {len(runs)} runs: {_some(runs)}.")
    for note in dict.fromkeys(n for found in identifications for n in found.notes if n.startswith("mass")):
        sentences.append(f"{note[0].upper()}{note[1:]}.")
    return sentences


def _tests(loops: Sequence[LoopAnalysis]) -> list[str]:
    sentences = []
    distorted = [loop for loop in loops if not loop.motion.is_sine]
    if distorted:
        worst = max(loop.motion.distortion for loop in distorted)
        sentences.append(
            f"In {len(distorted)} of {len(loops)} runs the motion is no pure sine "
            f"(distortion up to {100 * worst:.0f} %): "
            "identification in time allows for it, harmonic balance would not."
        )
    drifting = [loop.run_id for loop in loops if abs(loop.motion.drift) > 1e-4]
    if drifting:
        fastest = max(abs(loop.motion.drift) for loop in loops)
        sentences.append(
            f"The mean position drifts in {len(drifting)} runs, by up to {1e3 * fastest:.2f} mm/s: {_some(drifting)}."
        )
    amplitudes = np.array([loop.condition.amplitude_m for loop in loops])
    frequencies = np.array([loop.condition.frequency_Hz for loop in loops])
    if len(loops) > 3:
        tied = float(np.corrcoef(np.log(amplitudes), np.log(frequencies))[0, 1])
        if abs(tied) > 0.85:
            sentences.append(
                f"Frequency and amplitude were changed together (correlation {tied:.2f}): "
                "their separate effects cannot be told apart."
            )
    return sentences


def _some(names: Sequence[str], most: int = 4) -> str:
    shown = ", ".join(names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"
