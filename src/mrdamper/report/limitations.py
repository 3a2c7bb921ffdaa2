"""Limitations of an identified damper and of its tests, as grouped sentences, the most serious first."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import pairwise

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.coil import Coil
from mrdamper.dampers.joint import JointFit
from mrdamper.dampers.modified import ModifiedFit
from mrdamper.dampers.prediction import NOT_A_SINE
from mrdamper.dampers.uncertainty import Uncertainty, uncertainty_warnings
from mrdamper.data import Floats, Run, session_of
from mrdamper.data.wording import counted, number
from mrdamper.errors import InputError, listed
from mrdamper.identification import Identification
from mrdamper.identification.intervals import f_exceedance
from mrdamper.identification.loop_analysis import LoopAnalysis
from mrdamper.physics.motion.sines import MIN_CYCLES
from mrdamper.study.contradictions import MIN_RUNS
from mrdamper.study.recipe import RecipeResult
from mrdamper.study.validation import RunScore, Validation

PREDICTION, TESTS, MODEL, PARAMETERS, RANGE = "Prediction", "Tests", "Model", "Parameters", "Range of validity"
_WORDS = frozenset({"a", "A", "I"})  # parameter names that are also words of a sentence
_SEARCHED = {"seat_share": "elastic displacement of the series spring over the free play"}
_MAX_FUNCTION_ERROR = 0.9  # cross-validated error of a parameter function over the parameter's spread [-]
_MAX_ENERGY_ERROR = 0.15  # relative error of the dissipated energy [-]
_MAX_DRIFT_M_S = 1e-4  # drift of the mean position [m/s]
_MAX_CORRELATION = 0.85  # correlation coefficient of tested frequencies and amplitudes [-]
_MIN_LEVELS = 4  # number of tested currents
_MAX_RUNS = 4  # number of runs named in one sentence
_SAME_CURRENT_A = 0.01  # difference of currents that are one level [A]
_SAME_TEMPERATURE_K = 5.0  # difference of temperatures that are one [K]
_SAME_GAIN, _SAME_OFFSET = (
    0.03,
    0.02,
)  # differences of the mean of two sessions: of gain, of offset per peak-to-peak force
_FALLS = 0.9  # ratio of dissipated energies below which the force falls with the current
_UNLIKE = 3.0  # cross-validated error over the median, from which a run is unlike the others
_CHANCE = 0.05  # probability of a difference between sessions by chance
_SAME_MOTION = 0.05  # relative difference of frequencies or amplitudes that are one


def limitations(
    scored: RecipeResult, loops: Sequence[LoopAnalysis], runs: Iterable[Run] = (), notes: Sequence[str] = ()
) -> dict[str, list[str]]:
    """List the limitations of a model and of its tests under their headings, the most serious first.

    `notes` are those of the comparison of the runs with each other.
    """
    groups = {
        PREDICTION: [
            *_design(loops, [run.run_id for run in scored.train.runs]),
            *notes,
            *_falling([loop for loop in loops if loop.run_id in {run.run_id for run in scored.train.runs}]),
            *_temperature(runs, {run.run_id for run in scored.train.runs}),
            *_sessions(runs, scored.train),
            *_prediction(scored.cross_validated, scored.validation),
        ],
        PARAMETERS: [
            *(uncertainty_warnings(scored.damper) if scored.damper.uncertainty else ()),
            *_identifications(scored.identifications),
        ],
        MODEL: [
            *(_joint(scored.fit, scored.damper) if isinstance(scored.fit, JointFit) else ()),
            *(_functions(scored.fit, scored.damper) if isinstance(scored.fit, ModifiedFit) else ()),
        ],
        TESTS: _tests(loops),
        RANGE: [_coil(scored.damper.coil), validity(scored.damper)],
    }
    _explain(list(groups.values()), scored.damper)
    return {group: texts for group, texts in groups.items() if texts}


def validity(damper: Damper) -> str:
    """State the tested range of a damper."""
    *motion, velocity = damper.envelope.ranges().values()
    return (
        f"Tested range: {', '.join(motion)}, peak velocity {velocity}. "
        "Predictions outside it are marked as extrapolation."
    )


def _coil(coil: Coil | None) -> str:
    """State how the field of the coil follows a changing current."""
    if coil is None:
        return "Changing current: no lag of the coil was identified; the force follows the current at once."
    rise, fall = (f"{number(1e3 * seconds, 3)} ms" for seconds in (coil.rise_s, coil.fall_s))
    return f"Changing current: its field follows with a time constant of {rise} while it rises, {fall} while it falls."


def _explain(groups: Sequence[list[str]], damper: Damper) -> None:
    """Add the meaning of each parameter where it is named first."""
    parameters = damper.model_at(damper.envelope.middle).parameters()
    meanings = {info.name: info.meaning for info in parameters if info.name not in _WORDS} | _SEARCHED
    for name, meaning in meanings.items():
        named = re.compile(rf"(?<![\w.^/])(?<![\d−] )({re.escape(name)}(?:\.\d+)?)(?![\w^]| [−ω])( \()?")
        places = ((texts, i) for texts in groups for i, text in enumerate(texts) if named.search(text))
        if first := next(places, None):
            texts, i = first
            texts[i] = named.sub(
                lambda match, text=meaning: f"{match[1]} ({text}{'; ' if match[2] else ')'}", texts[i], count=1
            )


def _design(loops: Sequence[LoopAnalysis], identified: Sequence[str]) -> list[str]:
    sentences = []
    if 0 < len(identified) < MIN_RUNS:
        sentences.append(
            f"Only {counted(len(identified), 'identification run')}: they were not compared with each other, "
            f"which shows wrong units, currents and signs from {MIN_RUNS} runs on."
        )
    sines = [loop.condition for loop in loops if loop.run_id in identified]
    if len(sines) < len(identified) or len(sines) < 2:
        return sentences
    currents, frequencies, amplitudes = (
        np.array([getattr(condition, name) for condition in sines])
        for name in ("current_A", "frequency_Hz", "amplitude_m")
    )
    if np.ptp(np.abs(currents)) <= _SAME_CURRENT_A:
        sentences.append(
            f"One current was tested ({abs(currents[0]):.3g} A): the dependence on the current is not identifiable."
        )
    if not _varied(frequencies) and not _varied(amplitudes):
        sentences.append(
            f"One motion was tested ({np.median(frequencies):.3g} Hz, {1e3 * np.median(amplitudes):.3g} mm): "
            "the dependence on frequency and amplitude is not identifiable."
        )
    return sentences


def _falling(loops: Sequence[LoopAnalysis]) -> list[str]:
    """Name neighbouring currents between which the dissipated energy falls at every motion tested at both."""
    at: dict[float, list[LoopAnalysis]] = {}
    for loop in sorted(loops, key=lambda loop: loop.condition.current_A):
        level = next((of for of in at if loop.condition.current_A - of <= _SAME_CURRENT_A), loop.condition.current_A)
        at.setdefault(level, []).append(loop)
    ratios = {
        (one, other): [b.dissipated_energy / a.dissipated_energy for a in at[one] for b in at[other] if _alike(a, b)]
        for one, other in pairwise(at)
    }
    falling = [both for both, own in ratios.items() if len(own) > 1 and max(own) < _FALLS]
    if min(at, default=0.0) < 0 or (len(ratios) > 1 and len(falling) == len(ratios)):
        return []  # a coil that weakens a magnet
    return [
        f"The dissipated energy falls from {one:.3g} A to {other:.3g} A at all {len(ratios[one, other])} motions "
        f"tested at both, to {100 * float(np.median(ratios[one, other])):.0f} % in the median: these currents may be "
        "interchanged; if so, correct current_A in runs.csv."
        for one, other in falling
    ]


def _alike(one: LoopAnalysis, other: LoopAnalysis) -> bool:
    """Tell if two runs have the same frequency and amplitude."""
    motions = [(loop.condition.frequency_Hz, loop.condition.amplitude_m) for loop in (one, other)]
    return not any(_varied(np.array(values)) for values in zip(*motions, strict=True))


def _temperature(runs: Iterable[Run], identified: Collection[str]) -> list[str]:
    noted = [run.notes.get("temperature_C", "") for run in runs if run.id in identified]
    values = [float(note) for note in noted if re.fullmatch(r"-?[0-9.]+", note)]
    if not values or max(values) - min(values) < _SAME_TEMPERATURE_K:
        return []
    return [
        f"Tests at {min(values):.0f} to {max(values):.0f} °C: the temperature is no input of the model, "
        "and its effect counts as scatter between runs."
    ]


def _sessions(runs: Iterable[Run], train: Validation) -> list[str]:
    """State gains and offsets of the sessions where these differ by more than runs of one session do (F test)."""
    readings = {score.run_id: score.reading for score in train.runs if score.reading is not None}
    try:
        session = {run.id: session_of(run) for run in runs if run.id in readings}
    except InputError:  # a clock that is no date tells no session
        return []
    names = sorted({*session.values()} - {None})  # type: ignore[type-var]
    own = [[readings[run_id] for run_id, of in session.items() if of == name] for name in names]
    more = sum(map(len, own)) - len(own)  # degrees of freedom within sessions
    sentences = []
    for what, unit, least in (
        (("gain", "", _SAME_GAIN), ("offset", " N", _SAME_OFFSET)) if len(own) > 1 and more else ()
    ):
        groups = [np.array([getattr(one, what) for one in of]) for of in own]
        means, weights = np.array([group.mean() for group in groups]), [len(group) for group in groups]
        within = sum(float(np.sum((group - group.mean()) ** 2)) for group in groups) / more
        between = float(np.dot(weights, (means - np.average(means, weights=weights)) ** 2)) / (len(groups) - 1)
        scale = 1.0 if what == "gain" else float(np.median([one.pp for of in own for one in of]))
        by_chance = f_exceedance(between / (within or 1e-12), len(groups) - 1, more)
        if by_chance < _CHANCE and np.ptp(means) > least * scale:
            all_shown = len(names) <= _MAX_RUNS
            shown = range(len(names)) if all_shown else (int(np.argmin(means)), int(np.argmax(means)))
            values = (", " if all_shown else " to ").join(f"{number(means[i], 3)}{unit} in {names[i]}" for i in shown)
            sentences.append(
                f"Sessions differ in the {what} of measured over predicted force: {values}; "
                "check load cell, mounting, coil current and temperature of these sessions."
            )
    return sentences


def _prediction(cross_validated: Validation, validation: Validation) -> list[str]:
    sentences = []
    for scores, name in ((validation, "validation run"), (cross_validated, "cross-validated run")):
        if not scores.runs:
            continue
        worst = scores.worst()
        odd = _unlike_others(scores) if scores is cross_validated else []
        if odd:
            values = [f"{100 * run.scores.nrmse_pp:.1f} % in {run.run_id} ({run.condition})" for run in odd]
            sentences.append(
                f"Error of a {name} over {_UNLIKE:g} times the median of {100 * scores.median():.1f} %, inside the "
                f"range of the other tests: {listed(values, _MAX_RUNS)}; check its current, mounting (backlash), "
                "filters and delays of its channels, and temperature, or repeat the test."
            )
        if worst not in odd and worst.scores.nrmse_pp > 2 * scores.median():
            flags = [flag for flag in worst.extrapolation if flag != NOT_A_SINE]
            outside = ", not a sine" if NOT_A_SINE in worst.extrapolation else ""
            tests = "the tested range" if scores is validation else "the range of the other tests"
            outside += f"; {' and '.join(flags)} outside {tests}" if flags else ""
            sentences.append(
                f"Largest error of a {name}: {100 * worst.scores.nrmse_pp:.1f} % in {worst.run_id} "
                f"({worst.condition}{outside}); median {100 * scores.median():.1f} %."
            )
    weak = sorted({r.run_id for r in cross_validated.runs if abs(r.scores.energy_error) > _MAX_ENERGY_ERROR})
    if weak:
        sentences.append(
            f"Error of the dissipated energy above {100 * _MAX_ENERGY_ERROR:.0f} % in {len(weak)} cross-validated "
            f"{'run' if len(weak) == 1 else 'runs'}: {listed(weak, _MAX_RUNS)}."
        )
    if not validation.runs:
        sentences.append("No validation runs: the errors stated are those of cross-validation.")
    return sentences


def _unlike_others(scores: Validation) -> list[RunScore]:
    """Return the runs inside the range of the others whose error is several times the median, the worst first."""
    inside = [run for run in scores.runs if {*run.extrapolation} <= {NOT_A_SINE}]
    odd = [run for run in inside if run.scores.nrmse_pp > _UNLIKE * scores.median()]
    return sorted(odd, key=lambda run: -run.scores.nrmse_pp)


def _functions(fit: ModifiedFit, damper: Damper) -> list[str]:
    sentences = []
    middle = fit.conditions[len(fit.conditions) // 2]
    highest = fit.damper.envelope.current_A[1]
    for name, fitted in fit.functions.items():
        turn = fitted.function.turning_point(highest, middle.frequency_Hz, middle.amplitude_m)
        if turn is not None:
            place = "within" if turn <= highest else "above"
            sentences.append(
                f"{name} is not monotonic (extremum at {turn:.2f} A, {place} the tested range up to {highest:.3g} A)."
            )
        if fitted.left_out > _MAX_FUNCTION_ERROR and fitted.function.form != "constant":
            sentences.append(
                f"The function of {name} predicts other conditions no better than its mean "
                f"(cross-validated error {fitted.left_out:.2f} of the spread)."
            )
    if names := _held(fit.at_bounds, damper):
        sentences.append(f"Parameter functions at a bound of the search: {', '.join(names)}.")
    levels = len({round(c.current_A, 3) for c in fit.conditions})
    if 1 < levels < _MIN_LEVELS:
        sentences.append(f"Only {counted(levels, 'current')} were tested: the form between them is an assumption.")
    return sentences


def _joint(fit: JointFit, damper: Damper) -> list[str]:
    sentences = []
    if not fit.ending.converged:
        sentences.append(f"The global fit did not converge: the search {fit.ending}.")
    if (other := fit.second) is not None:
        sentences.append(
            f"Second local minimum of the fit: yield displacement {1e3 * other.yield_length:.2f} mm instead of "
            f"{1e3 * other.chosen_yield_length:.2f} mm, mean error {100 * other.error:.2f} % instead of "
            f"{100 * other.chosen_error:.2f} %"
            + ("; chosen by cross-validation." if other.error < other.chosen_error else ".")
        )
    ratio = float(np.max(fit.nrmse_pp) / np.median(fit.nrmse_pp))
    if ratio > 2:
        sentences.append(f"Largest fitting error of a run: {ratio:.1f} times the median.")
    if names := _held(fit.at_bounds, damper):
        sentences.append(f"Parameters at a bound of the search (interval one-sided): {', '.join(names)}.")
    return sentences


def _held(at_bounds: Sequence[str], damper: Damper) -> list[str]:
    """List the parameters at bounds that the uncertainty of the damper does not state as such."""
    uncertainty: Uncertainty | None = damper.uncertainty
    stated = {name.partition(".")[0] for name in uncertainty.one_sided} if uncertainty else set[str]()
    return [name for name in at_bounds if name not in stated]


def _identifications(identifications: Sequence[Identification]) -> list[str]:
    sentences = []
    bound: dict[str, list[str]] = {}
    for identification in identifications:
        for name in identification.at_bounds:
            bound.setdefault(name, []).append(identification.run_id)
    for name, runs in bound.items():
        sentences.append(
            f"{name} at a bound of its range in {counted(len(runs), 'individual fit')}: {listed(runs, _MAX_RUNS)}."
        )
    notes = dict.fromkeys(note for identification in identifications for note in identification.notes)
    return sentences + [f"Individual fits: {note}." for note in notes if note.lower().startswith("mass")]


def short_records(cycles: Mapping[str, float]) -> list[str]:
    """Name the runs with fewer than two whole cycles, in a sentence; none where all have more."""
    short = [run for run, count in cycles.items() if count < MIN_CYCLES]
    return short and [
        f"Fewer than two whole cycles in {counted(len(short), 'run')}: {listed(short, _MAX_RUNS)}; "
        "their repeatability is not determined, and the start of the motion is part of them."
    ]


def _tests(loops: Sequence[LoopAnalysis]) -> list[str]:
    sentences = []
    amplitudes = np.array([loop.condition.amplitude_m for loop in loops])
    frequencies = np.array([loop.condition.frequency_Hz for loop in loops])
    if len(loops) > 3 and _varied(amplitudes) and _varied(frequencies):
        tied = float(np.corrcoef(np.log(amplitudes), np.log(frequencies))[0, 1])
        if abs(tied) > _MAX_CORRELATION:
            sentences.append(
                f"Frequency and amplitude were varied together (correlation {tied:.2f}): "
                "their separate effects are not identifiable."
            )
    distorted = [loop for loop in loops if not loop.motion.is_sine]
    if distorted:
        worst = max(loop.motion.distortion for loop in distorted)
        sentences.append(
            f"Distorted sine motion in {len(distorted)} of {counted(len(loops), 'run')} (distortion up to "
            f"{100 * worst:.0f} %); identification uses the measured motion."
        )
    sentences += short_records({loop.run_id: loop.motion.cycles for loop in loops})
    drifting = [loop.run_id for loop in loops if abs(loop.motion.drift) > _MAX_DRIFT_M_S]
    if drifting:
        fastest = max(abs(loop.motion.drift) for loop in loops)
        sentences.append(
            f"Drift of the mean position in {counted(len(drifting), 'run')}, up to {1e3 * fastest:.2f} mm/s: "
            f"{listed(drifting, _MAX_RUNS)}."
        )
    return sentences


def _varied(values: Floats) -> bool:
    return float(np.ptp(values)) > _SAME_MOTION * float(np.max(values))
