"""Claim by claim: what the paper says of its damper and its method, in numbers, and the verdict on them.

Every function here measures; the thresholds and the verdicts stand in `verdicts`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from mrdamper.dampers.modified import ModifiedFit
from mrdamper.data import Condition, Floats, Run, same_motion
from mrdamper.errors import IdentificationError
from mrdamper.functions.fitting import fit_function
from mrdamper.identification.harmonic_balance import SineRecord
from mrdamper.motion import equivalent_sine, measured_motion
from mrdamper.reproduction.found import Reproduction
from mrdamper.reproduction.sensitivity import OneAtATime
from mrdamper.reproduction.verdicts import RECOVERED, Verdict, judge, steadiness, thresholds
from mrdamper.reproduction.ways import ALI, CONSISTENT, DIRECT, LITERAL

_SAME = 0.08  # relative tolerance within which two runs have one motion


@dataclass(frozen=True)
class Measured:
    """The numbers a claim rests on.

    Attributes
    ----------
    numbers : mapping of str to float
        By the words of the claim's limits; empty where it cannot be judged.
    evidence : str
        More of what was found, or why nothing could be.
    """

    numbers: Mapping[str, float] = field(default_factory=dict)
    evidence: str = ""


@dataclass(frozen=True)
class Claim:
    """One claim of the paper.

    Attributes
    ----------
    key : str
        Of the table of limits.
    text : str
    source : str
        Equation or section of Qian et al. 2024.
    verdict : str
        As `verdicts.judge` gives it.
    said : str
        The verdict for a reader: what a virtual rig was built with is recovered, not confirmed.
    evidence : str
        The numbers it rests on.
    threshold : str
    figure : str
        Name of the figure that shows it.
    seeds : str
        How many noise seeds say the same, and what the others say; empty where it was judged once.
    """

    key: str
    text: str
    source: str
    verdict: Verdict
    said: str
    evidence: str
    threshold: str
    figure: str
    seeds: str


def judge_all(study: Reproduction) -> tuple[Claim, ...]:
    """Measure and judge every claim; one that the data do not allow says why."""
    claims = []
    for key, text, source, figure, built_in, measure in _CLAIMS:
        found = measure(study)
        verdict = judge(key, found.numbers)
        numbers = "; ".join(
            f"{name} {value:.3g}" if np.isfinite(value) else f"{name}: not tested"
            for name, value in found.numbers.items()
        )
        said = RECOVERED.get(verdict, verdict) if built_in and study.rig is not None else verdict
        evidence = "; ".join(part for part in (numbers, found.evidence) if part)
        seeds = steadiness(verdict, study.seed_verdicts.get(key, ()))
        claims.append(Claim(key, text, source, verdict, said, evidence, thresholds(key), figure, seeds))
    return tuple(claims)


def friction_along(run: Run) -> tuple[Floats, Floats]:
    """Positions [m] and friction [N] of a slow test: half the force between out-stroke and in-stroke.

    At one position the gas spring is the same in both strokes and drops out.
    """
    path = measured_motion(run).path
    longest = np.argsort(np.bincount(path.stroke))[-2:]
    sweeps = []
    for stroke in longest:
        inside = path.stroke == stroke
        order = np.argsort(run.displacement[inside])
        width = max(1, order.size // 60)
        keep = order.size // width * width
        x, force = (c[inside][order][:keep].reshape(-1, width).mean(1) for c in (run.displacement, run.force))
        sweeps.append((x, force, path.direction[inside][0]))
    (xa, fa, direction), (xb, fb, _) = sweeps
    low, high = max(xa[0], xb[0]), min(xa[-1], xb[-1])
    x = np.linspace(low + 0.05 * (high - low), high - 0.05 * (high - low), 80)
    return x, direction * (np.interp(x, xa, fa) - np.interp(x, xb, fb)) / 2


def lost_length(run: Run, damping: float) -> float:
    """Distance [m] after a reversal in which the force is back at 90 % of its mid-stroke value; median.

    The viscous force, at a damping [N s/m], is taken out: it lags the stroke end for another reason.
    """
    steady = run.steady()
    motion, centre = measured_motion(steady), equivalent_sine(run).centre
    path, force = motion.path, steady.force - np.mean(steady.force) - damping * motion.velocity
    amplitude = float(np.ptp(motion.displacement)) / 2
    middle = np.abs(motion.displacement - centre) < 0.3 * amplitude
    full = 0.9 * float(np.median((path.direction * force)[middle]))
    found = []
    for stroke in range(1, path.stroke[-1]):
        inside = path.stroke == stroke
        back = np.flatnonzero(path.direction[inside] * force[inside] >= full)
        if back.size:
            found.append(path.distance[inside][back[0]])
    return float(np.median(found)) if found else float("nan")


def rising_shares(conditions: Sequence[Condition], energies: Sequence[float]) -> tuple[float, float]:
    """Shares of steps in current at one motion, and in frequency at one current and amplitude, that raise the energy.

    NaN where there is no such step.
    """
    by_current: list[bool] = []
    for group in same_motion(conditions, tolerance=_SAME):
        ordered = sorted(group, key=lambda i: conditions[i].current_A)
        by_current += [energies[b] > energies[a] for a, b in pairwise(ordered)]
    by_frequency: list[bool] = []
    keys = [(round(c.current_A, 2), round(np.log(c.amplitude_m) / _SAME)) for c in conditions]
    for key in sorted(set(keys)):
        ordered = sorted((i for i, k in enumerate(keys) if k == key), key=lambda i: conditions[i].frequency_Hz)
        by_frequency += [energies[b] > energies[a] for a, b in pairwise(ordered)]
    return _share(by_current), _share(by_frequency)


def _share(steps: Sequence[bool]) -> float:
    return float(np.mean(steps)) if steps else float("nan")


def bulge(run: Run) -> float:
    """Width of the force–displacement loop [N] at x = 0 over that at 0.8 X."""
    record = SineRecord.of(run)
    phase = np.degrees(record.theta) % 360
    width = []
    for angle in (0.0, float(np.degrees(np.arcsin(0.8)))):
        out = np.abs((phase - angle + 180) % 360 - 180) < 5
        back = np.abs((phase - (180 - angle) + 180) % 360 - 180) < 5
        width.append(float(np.mean(record.force[out]) - np.mean(record.force[back])))
    return width[0] / width[1]


def amplitude_spread(conditions: Sequence[Condition], values: Floats) -> float:
    """Largest spread of values over amplitudes at one current and frequency, over the mean magnitude of all."""
    keys = [(round(c.current_A, 2), round(c.frequency_Hz, 2)) for c in conditions]
    spreads = [
        float(np.ptp(values[[i for i, k in enumerate(keys) if k == key]])) for key in set(keys) if keys.count(key) > 1
    ]
    return max(spreads) / float(np.mean(np.abs(values))) if spreads else float("nan")


def scatter_over_motions(conditions: Sequence[Condition], values: Floats) -> tuple[float, float]:
    """Standard deviation over the motions at the lowest and at the highest current tested at three motions or more."""
    currents = np.round([c.current_A for c in conditions], 2)
    levels = [level for level in np.unique(currents) if np.sum(currents == level) > 2]
    if len(levels) < 2:
        return float("nan"), float("nan")
    return float(np.std(values[currents == levels[0]])), float(np.std(values[currents == levels[-1]]))


def factors(ends: Sequence[float]) -> float:
    """Median factor by which values miss one, whichever side they lie on."""
    return float(np.exp(np.median(np.abs(np.log(np.maximum(ends, 1e-12))))))


def presets(single: Sequence[OneAtATime]) -> Measured:
    """What wrong presets cost once the other parameters are identified anew."""
    left = {effect.name: effect.left for effect in single}
    names = {"n": "n", "asymmetry": "γ/β", "A": "A"}
    numbers = {
        f"error left by a wrong {text}, others identified anew": left[name]
        for name, text in names.items()
        if name in left
    }
    return Measured(numbers, f"each preset wrong by {100 * single[0].change:.0f} %" if single else "no run to judge by")


def _presets(study: Reproduction) -> Measured:
    return presets(study.sensitivity)


def _gas_series(study: Reproduction) -> Measured:
    if study.gas is None:
        return Measured(evidence="the gas spring of this rig is not known")
    X = max(loop.condition.amplitude_m for loop in study.loops)
    return Measured({"error of the series over the gas force": study.gas.taylor_error(X)}, f"within ±{1e3 * X:.0f} mm")


def _friction(study: Reproduction) -> Measured:
    if study.friction is None:
        return Measured(evidence="the data hold no friction test")
    _, friction = friction_along(study.friction)
    share = float(np.mean(friction)) / min(loop.peak_force for loop in study.loops)
    return Measured(
        {
            "least friction, N": float(friction.min()),
            "largest friction, N": float(friction.max()),
            "mean friction over the smallest peak force": share,
        },
        f"test {'with' if study.switches.friction_test == 'filled' else 'without'} fluid",
    )


def _bulge(study: Reproduction) -> Measured:
    ratios = [bulge(run) for run in study.train]
    share = float(np.mean(np.array(ratios) > 1))
    return Measured(
        {"share of loops wider at x = 0 than at 0.8 X": share}, f"ratio of widths {min(ratios):.2f}–{max(ratios):.2f}"
    )


def _energy(study: Reproduction) -> Measured:
    loops = study.loops
    by_current, by_frequency = rising_shares(
        [loop.condition for loop in loops], [loop.dissipated_energy for loop in loops]
    )
    energies = [loop.dissipated_energy for loop in loops]
    return Measured(
        {
            "share of current steps that raise the energy": by_current,
            "share of frequency steps that raise the energy": by_frequency,
        },
        f"{min(energies):.3g}–{max(energies):.3g} J a cycle",
    )


def _stroke_end(study: Reproduction) -> Measured:
    consistent = study.contender(CONSISTENT)
    if consistent is None:
        return Measured(evidence="the viscous force is not known: the consistent way could not be followed")
    top = max(c.current_A for c in study.conditions)
    damping = _values(study, CONSISTENT, "c")
    pairs = [
        (condition.peak_velocity, run, float(c))
        for condition, run, c in zip(study.conditions, study.train, damping, strict=True)
        if condition.current_A > top - 0.01
    ]
    slow, fast = min(pairs, key=lambda p: p[0]), max(pairs, key=lambda p: p[0])
    if fast[0] < 1.3 * slow[0]:
        return Measured(evidence="one speed at the highest current")
    lengths = [1e3 * lost_length(run, c) for _, run, c in (slow, fast)]
    return Measured(
        {"lost length at the fast motion over that at the slow one": lengths[1] / lengths[0]},
        f"at {top:g} A 90 % of the force beyond the viscous one is back after {lengths[0]:.2f} mm at "
        f"{slow[0]:.2f} m/s and after {lengths[1]:.2f} mm at {fast[0]:.2f} m/s",
    )


def _phase(study: Reproduction) -> Measured:
    phase = np.array([r.phase for r in study.readings])
    several = [group for group in _motions(study) if len(group) > 1]
    spread = max((float(np.ptp(phase[group])) for group in several), default=float("nan"))
    return Measured(
        {
            "share of runs within 1.4–1.5 rad": float(np.mean((phase > 1.4) & (phase < 1.5))),
            "largest change with the current at one motion, rad": spread,
        },
        f"{phase.min():.3f}–{phase.max():.3f} rad; smallest sine {np.sin(phase).min():.3f}",
    )


def motion_fits(study: Reproduction, values: Floats, form: str = "quadratic-current") -> list[tuple[list[int], float]]:
    """R² of a function of the current at every motion that determines it, with the indices of its runs."""
    fits = []
    for group in _motions(study):
        try:
            fits.append((group, fit_function(form, [study.conditions[i] for i in group], values[group]).r2))
        except IdentificationError:
            continue
    return fits


def _quadratic(study: Reproduction) -> Measured:
    fits = [r2 for _, r2 in motion_fits(study, _amplitudes(study))]
    if not fits:
        return Measured(evidence=f"{_motions_at(study, 4)}: a quadratic through three of them would prove nothing")
    return Measured({"least R² of a motion": min(fits)}, f"up to {max(fits):.4f} over {len(fits)} motions")


def _speed_shift(study: Reproduction) -> Measured:
    try:
        fit = fit_function("quadratic-current-speed", study.conditions, _amplitudes(study))
    except IdentificationError as error:
        return Measured(evidence=str(error))
    return Measured({"R² of one surface for all runs": fit.r2})


def _saturation(study: Reproduction) -> Measured:
    currents, F0 = np.array([c.current_A for c in study.conditions]), _amplitudes(study)
    levels = np.unique(np.round(currents, 3))
    low, high = levels[levels <= 1.0], levels[levels >= 1.5]
    if low.size < 2 or high.size < 2:
        return Measured(
            evidence=f"tested up to {levels.max():g} A: two currents at or above 1.5 A and two up to 1 A are needed"
        )
    mean = {level: float(F0[np.abs(currents - level) < 1e-3].mean()) for level in levels}
    slopes = [float(np.polyfit(part, [mean[x] for x in part], 1)[0]) for part in (low, high)]
    return Measured(
        {"slope above 1.5 A over slope below 1 A": slopes[1] / slopes[0]},
        f"F0 rises by {slopes[0]:.0f} N/A up to 1 A and by {slopes[1]:.0f} N/A above 1.5 A",
    )


def _viscosity(study: Reproduction) -> Measured:
    literal, consistent = _values(study, LITERAL, "c"), _values(study, CONSISTENT, "c")
    if not literal.size or literal.size != consistent.size:
        return Measured(evidence="one of the two balances could not be followed on every run")
    ratio = float(np.median(literal / np.maximum(consistent, 1e-9)))
    return Measured(
        {"median of closed form over consistent c": ratio},
        f"closed form {literal.min():.0f}–{literal.max():.0f} N s/m, consistent balance "
        f"{consistent.min():.0f}–{consistent.max():.0f} N s/m",
    )


def _mass(study: Reproduction) -> Measured:
    literal, fit = _values(study, LITERAL, "m"), _function(study, "m")
    if fit is None or not fit.function.form.startswith("mass") or not np.ptp(literal):
        return Measured(evidence="m is held, or the runs determine no function of current and frequency for it")
    return Measured(
        {
            "R² of m over current and frequency": fit.r2,
            "largest spread of m over amplitudes, over its mean": amplitude_spread(study.conditions, literal),
            "least m, kg": float(literal.min()),
        },
        f"closed form {literal.min():.0f}…{literal.max():.0f} kg"
        + (f"; true {study.rig.mass:g} kg" if study.rig else ""),
    )


def _alpha(study: Reproduction) -> Measured:
    fit = _function(study, "alpha")
    if fit is None or fit.function.form != "plane":
        return Measured(evidence="too few motions for a plane over frequency and amplitude")
    _, _, e1, e2, _ = fit.function.coefficients
    return Measured(
        {
            "sign of the slope over frequency": float(np.sign(e1)),
            "sign of the slope over amplitude": float(np.sign(e2)),
            "R²": fit.r2,
        },
        f"{e1:+.3g} N/m per Hz, {1e-3 * e2:+.3g} N/m per mm",
    )


def _beta(study: Reproduction) -> Measured:
    fit, contender = _function(study, "beta"), study.contender(LITERAL)
    if fit is None or contender is None:
        return Measured(evidence="the literal recipe could not be followed")
    beta = np.log(np.maximum(_values(study, LITERAL, "beta"), 1e-9))
    first, last = scatter_over_motions(study.conditions, beta)
    if not np.isfinite(first):
        return Measured(evidence="no two currents were tested at three motions")
    if first < 1e-6:
        return Measured(
            evidence="at the lowest current every run ended at the same limit of the box: nothing to compare"
        )
    limit = float(np.mean(["beta" in i.at_bounds for i in contender.identifications]))
    return Measured(
        {
            "scatter of ln β at the highest current over that at the lowest": last / first,
            "R² of ln β": fit.r2,
            "share of runs at the limit of the box": limit,
        },
        f"median β {np.exp(np.median(beta)):.3g} m⁻ⁿ; runs at the limit are in every number, as they are for α",
    )


def _search(study: Reproduction) -> Measured:
    if not study.ended:
        return Measured(evidence="no genetic search was made")
    alpha, beta = factors([e.alpha for e in study.ended]), factors([e.beta for e in study.ended])
    return Measured(
        {
            "median factor by which α misses the optimum": alpha,
            "median factor by which β misses the optimum": beta,
        },
        f"{len(study.ended)} runs, a seed each; worst factors {_worst_factor([e.alpha for e in study.ended]):.3g} and "
        f"{_worst_factor([e.beta for e in study.ended]):.3g}; largest error over the least "
        f"{max(e.error for e in study.ended):.3g}",
    )


def _accuracy(study: Reproduction) -> Measured:
    paired = _beside_direct(study)
    if paired is None:
        return Measured(evidence="no traditional identification to compare with")
    own, direct = paired
    return Measured(
        {"median error of identification over that of the traditional Bouc–Wen": own / direct},
        f"nrmse_pp {100 * own:.2f} % against {100 * direct:.2f} % on the same runs",
    )


def _few_parameters(study: Reproduction) -> Measured:
    literal, ali = study.contender(LITERAL), study.contender(ALI)
    if literal is None or ali is None or not (ali.held_out.runs and literal.held_out.runs):
        return Measured(evidence="Ali's model could not be followed on these runs, or no run is held out")
    return Measured(
        {
            "median held-out error over the Ali-type's": literal.held_out.median() / ali.held_out.median(),
            "searched parameters a run over the Ali-type's": 2 / max(ali.numbers_per_run, 1),
        },
        f"held out {100 * literal.held_out.median():.1f} % against {100 * ali.held_out.median():.1f} %; "
        f"worst {100 * literal.held_out.worst().scores.nrmse_pp:.1f} % and "
        f"{100 * ali.held_out.worst().scores.nrmse_pp:.1f} %; 2 searched against {ali.numbers_per_run}",
    )


def _fast(study: Reproduction) -> Measured:
    direct = study.contender(DIRECT)
    if direct is None or not study.ended or not direct.identifications:
        return Measured(evidence="no genetic searches to time")
    own, other = float(np.mean([e.seconds for e in study.ended])), direct.seconds / len(direct.identifications)
    return Measured(
        {"time of an identification over that of the traditional Bouc–Wen": own / other},
        f"{own:.2f} s against {other:.2f} s a run, both by 60 generations of 100 in every box",
    )


def _generalisation(study: Reproduction) -> Measured:
    literal = study.contender(LITERAL)
    if literal is None or not literal.held_out.runs:
        return Measured(evidence="the literal recipe could not be followed, or predicts no held-out run")
    median, worst = literal.held_out.median(), literal.held_out.worst()
    consistent = study.contender(CONSISTENT)
    beside = f"; consistent {100 * consistent.held_out.median():.1f} %" if consistent else ""
    return Measured(
        {
            "median held-out error over the median error of identification": median / literal.per_run,
            "worst held-out error, nrmse_pp": worst.scores.nrmse_pp,
        },
        f"median {100 * median:.1f} %, worst {100 * worst.scores.nrmse_pp:.1f} % at {worst.condition}{beside}",
    )


def _beside_direct(study: Reproduction) -> tuple[float, float] | None:
    """Median errors of the literal and the traditional identification on the runs both were made of."""
    literal, direct = study.contender(LITERAL), study.contender(DIRECT)
    if literal is None or direct is None:
        return None
    own = {i.run_id: i.scores.nrmse_pp for i in literal.identifications}
    pairs = [(own[i.run_id], i.scores.nrmse_pp) for i in direct.identifications if i.run_id in own]
    return tuple(np.median(pairs, axis=0).tolist()) if pairs else None


def _worst_factor(ends: Sequence[float]) -> float:
    return float(np.exp(np.max(np.abs(np.log(np.maximum(ends, 1e-12))))))


def _motions(study: Reproduction) -> list[list[int]]:
    return same_motion(study.conditions, tolerance=_SAME)


def _motions_at(study: Reproduction, least: int) -> str:
    """How many motions were tested at how many currents, in words."""
    counts = [len({round(study.conditions[i].current_A, 3) for i in group}) for group in _motions(study)]
    enough = sum(count >= least for count in counts)
    return f"{enough} of {len(counts)} motions were tested at {least} currents or more"


def _amplitudes(study: Reproduction) -> Floats:
    return np.array([r.amplitude for r in study.readings])


def _values(study: Reproduction, title: str, name: str) -> Floats:
    contender = study.contender(title)
    found = contender.identifications if contender else ()
    return np.array([float(getattr(i.model, name)) for i in found])


def _function(study: Reproduction, name: str):
    """The function of a parameter by the literal recipe, if there is one."""
    contender = study.contender(LITERAL)
    fit = contender.fit if contender else None
    return fit.functions.get(name) if isinstance(fit, ModifiedFit) else None


# Key of the limits, claim, where it stands, figure, built into the virtual rig, measurement.
_CLAIMS: tuple[tuple[str, str, str, str, bool, Callable[[Reproduction], Measured]], ...] = (
    ("gas series", "A series of third order replaces the gas force.", "Eq. 3–7", "", True, _gas_series),
    (
        "friction",
        "Seal friction is 25–100 N at 0.01 mm/s and may be neglected.",
        "section 2",
        "fig03_friction",
        True,
        _friction,
    ),
    ("bulge", "Force–displacement loops bulge at x = 0.", "section 2", "fig04_loops_current", False, _bulge),
    (
        "energy",
        "The dissipated energy rises with frequency and current.",
        "section 2",
        "fig05_loops_frequency",
        False,
        _energy,
    ),
    (
        "stroke end",
        "After each stroke end the force is missing for a length that grows with speed.",
        "section 2",
        "fig04_loops_current",
        True,
        _stroke_end,
    ),
    ("phase", "The force leads by 1.4–1.5 rad whatever the current.", "Eq. 16–19", "fig12_phase", False, _phase),
    ("quadratic", "At every motion F0 is a quadratic of the current.", "Eq. 23", "fig11_F0", False, _quadratic),
    (
        "speed shift",
        "f · A shifts the quadratic of F0 (and so c X ω) without bending it.",
        "Eq. 24–26",
        "fig14_F0_shift",
        False,
        _speed_shift,
    ),
    ("saturation", "The magnetic circuit saturates near 1.5 A.", "section 3", "fig11_F0", True, _saturation),
    ("viscosity", "F0 sin φ/(X ω) is the viscous damping.", "Eq. 19", "fig15_c", False, _viscosity),
    (
        "mass",
        "The equivalent mass falls off with frequency and does not depend on the amplitude.",
        "Eq. 27–31",
        "fig16_m",
        False,
        _mass,
    ),
    (
        "alpha",
        "α rises with the frequency and falls with the amplitude, in a plane beside its current law.",
        "Eq. 32–36",
        "fig19_alpha",
        False,
        _alpha,
    ),
    (
        "beta",
        "β over current: curves that differ at small current merge at large current.",
        "Eq. 37–40",
        "fig21_beta",
        False,
        _beta,
    ),
    ("presets", "The preset parameters are insensitive.", "section 3", "sensitivity", False, _presets),
    ("search", "The genetic algorithm finds α and β.", "section 4.3, Eq. 21–22", "genetic", False, _search),
    (
        "accuracy",
        "The accuracy is comparable to that of the traditional Bouc–Wen model.",
        "section 5",
        "fig26_accuracy_rate",
        False,
        _accuracy,
    ),
    (
        "few parameters",
        "The accuracy is close to that of Ali's model with fewer parameters.",
        "section 5",
        "fig26_accuracy_rate",
        False,
        _few_parameters,
    ),
    (
        "fast",
        "Identification is faster than that of the traditional Bouc–Wen model.",
        "section 5",
        "fig26_accuracy_rate",
        False,
        _fast,
    ),
    (
        "generalisation",
        "The model predicts a motion that was not tested (80 mm, 1 Hz).",
        "section 5",
        "fig24_predicted_displacement",
        False,
        _generalisation,
    ),
)
