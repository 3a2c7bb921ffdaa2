"""Faults that no test can detect, with the reason. They are not planted; their number is printed."""

from __future__ import annotations

from typing import NamedTuple

from mutants.faults import Fault


class Explained(NamedTuple):
    """Changes without an effect, by a part of the line, where an empty one matches any.

    A change may be given from the beginning of one of its words, or whole, as `change: the changed expression`.
    """

    module: str
    line: str
    change: str
    why: str


_SIGN = "a sign divides as it multiplies"
_GUARD = "a guard of a division or a logarithm, which no test reaches"
_ORDER = "the order has no meaning"
_BUDGET = "resolution, duration or range of a search with the same result"
_ALIKE = "exchanged values are equal"
_SCALE = "a factor that cancels"
EXPLAINED = (
    Explained("paper.", "% 360", "Add → Sub", "half a turn forth or back is the same angle"),
    Explained("paper.", "< 5", "5 → 6", _BUDGET),
    Explained("paper.output", '"nrmse_pp": None', "", _ORDER),
    Explained("paper.", "keys = [", "items", _ORDER),
    Explained("paper.", "sorted(set(keys))", "sorted backwards", _ORDER),
    Explained("paper.", "order.size // 60", "1 → 2", _BUDGET),
    Explained("paper.", "back[0]", "0 → 1", _BUDGET),
    Explained("paper.", "path.direction[inside][0]", "0 → 1", "a stroke has one direction"),
    Explained("study.recipe", "Scale(1.0, 1.0)", "1.0 → 10.0", "which axes there are does not depend on the scale"),
    Explained("study.recipe", "identifications[0].method", "0 → 1", "all identifications are by one method"),
    Explained("paper.assumptions", 'cls(None, (("k1"', "items", _ORDER),
    Explained(
        "paper.recipes",
        "for title, speed in",
        "items 0 and 1 exchanged: ((TRADITIONAL, _peak_velocity(held_out)), (SLOWEST, 0.0))",
        _ORDER,
    ),
    Explained("paper.options", "for name, (low, high) in", "items 0 and 1", _ORDER),
    Explained("systems.inverse", "sample = (x, v, -(omega**2) * x)", "USub", "inertia is the same at every current"),
    Explained("systems.inverse", "status, outputs, memory = 1", "1 → 2", "any status but 0 is a refusal"),
    Explained("study.recipe", "in ([],", "items", _ORDER),
    Explained("paper.assumptions", "[-longest, longest]", "", "the gas is compressed at one end alone"),
    Explained("paper.", "np.mean(steady.force)", "mean → median", "a loop's force has its mean in its middle"),
    Explained("paper.", "np.mean(record.force", "mean → median", "samples within five degrees have one force"),
    Explained("paper.", "< 1e-3", "0.001 → 0.01", "levels lie further apart"),
    Explained("paper.virtual_rig", "default_rng((seed,", "items", "another draw of the same noise"),
    Explained("paper.virtual_rig", "default_rng((seed,", "10000 → 100000", "another draw of the same noise"),
    Explained(
        "paper.virtual_rig",
        "path.direction * np.where",
        "Mult → Div: self.yield_force(motion.current) * path.direction",
        _SIGN,
    ),
    Explained("paper.sensitivity", "_SAMPLES", "1 → 2", "a whole cycle more, or another of the same samples"),
    Explained("paper.sensitivity", "_SAMPLES", "1.25 → 12.5", "a whole cycle more, or another of the same samples"),
    Explained("paper.sensitivity", "_SAMPLES", "4 → 5", "a whole cycle more, or another of the same samples"),
    Explained(
        "dampers.published.dominguez",
        "np.log(c.frequency_Hz / reference.frequency_Hz)",
        ".frequency_Hz → .current_A: reference.frequency_Hz",
        "a constant factor goes into the level every current has of its own",
    ),
    Explained("dampers.published.ali", "np.clip(", "1000.0 →", _GUARD),
    Explained("dampers.published.ali", "np.clip(", "10000.0 →", _GUARD),
    Explained("dampers.published.ali", "np.clip(", "100.0 →", _GUARD),
    Explained("dampers.published.boada", "np.clip(", "3 → 4", _GUARD),
    Explained("dampers.published.boada", "np.clip(", "4 → 5", _GUARD),
    Explained("dampers.published", "1e-3)", "0.001 → 0.01", _GUARD),
    Explained("dampers.modified", "identifications[0]", "0 → 1", "all identifications are of one model and rig"),
    Explained("dampers.modified", "if data.shape else 1.0", "1.0 → 10.0", "a model without a shape has no use for one"),
    Explained(
        "dampers.calibration",
        "np.multiply(",
        "arguments 0 and 1 exchanged: np.multiply(getattr(self, quantity), quantiles)",
        _ALIKE,
    ),
    Explained("dampers.calibration", "size = np.sqrt(np.mean(table", "sqrt", _SCALE),
    Explained("dampers.calibration", "size = np.sqrt(np.mean(table", "mean", _SCALE),
    Explained("dampers.calibration", "size = np.sqrt(np.mean(table", "Pow", _SCALE),
    Explained("dampers.calibration", "size = np.sqrt(np.mean(table", "2 → 3", _SCALE),
    Explained("dampers.random_effects", "weight = 1 / np.maximum(", "1 → 2", _SCALE),
    Explained("dampers.calibration", "parts[0].distance", "0 → 1", "the stretches of a run have one distance"),
    Explained("dampers.calibration", "parts[0].session", "0 → 1", "the stretches of a run have one session"),
    Explained("dampers.calibration", "size[size == 0] = 1.0", "1.0 → 10.0", "zero, whatever divides it"),
    Explained("dampers.calibration", "+ _ROUNDING, 1.0)", "Add → Sub: level * (len(units) + 1) + _ROUNDING", _GUARD),
    Explained("dampers.calibration", "share > 2 * _ROUNDING", "2 → 3", _GUARD),
    Explained(
        "dampers.random_effects", "(solved < 0)", "0 → 1", "without a negative one both ways of solving end at the same"
    ),
    Explained("dampers.random_effects", "names = sorted({run.session", "sorted backwards", _ORDER),
    Explained(
        "dampers.random_effects", "max(table.sum(), 1.0)", "1.0 → 10.0", "zero is below whatever it is compared with"
    ),
    Explained(
        "dampers.random_effects",
        "moved, weight = np.zeros(",
        "items 0 and 1 exchanged: (len(shift), size)",
        "zeros that are replaced before they are read",
    ),
    Explained("dampers.random_effects", "self.slopes[0].shape[1]", "0 → 1", "all runs have one number of columns"),
    Explained("dampers.bands", "student(level, 1.0)", "1.0 → 10.0", "the level alone is checked"),
    Explained("dampers.bands", "**ends, **peaks", "exchanged", _ORDER),
    Explained("dampers.bands", "or 1.0", "1.0 → 10.0", "zero, whatever divides it"),
    Explained("dampers.sessions", "point, step = np.log(", "→", _BUDGET),
    Explained("study.plan", "_PRIOR_LOG_DEVIATION**2", "2 → 3", "one, to whatever power"),
    Explained("dampers.sessions", "for start in (", "items", "another start of the same search"),
    Explained("dampers.sessions", "for start in (", "1.0 → 10.0", "another start of the same search"),
    Explained("dampers.sessions", "for start in (", "0.01 → 0.1", "another start of the same search"),
    Explained("dampers.sessions", "np.where(good, scale, 1.0)", "1.0 → 10.0", _GUARD),
    Explained("dampers.sessions", "best[0] - 1e-6", "Sub → Add", "which of equals is taken"),
    Explained("dampers.covariance", "infinite = np.diag", "1.0 → 10.0", "whatever is finite"),
    Explained("study.plan", "return np.trace(", "axis1 and axis2", _ALIKE),
    Explained("study.plan", "affordable = takewhile(", "60 → 600", "sessions that hold no record are tried, and lose"),
    Explained(
        "study.plan", "least = self.limits.opening", "Add → Sub", "more sessions than hold a record are tried, and lose"
    ),
    Explained("study.plan", "motion, last = sine(", "2 → 3", "the last of three cycles is as the last of two"),
    Explained("fleet.charts", "step = -(", "USub dropped: -(-values.size // _MOST_NORMALITY)", _ORDER),
    Explained("fleet.charts", "np.minimum((below * count)", "Sub → Add", _GUARD),
    Explained("fleet.charts", "np.minimum((below * count)", "1 → 2", _GUARD),
    Explained("dampers.sessions", "trials = np.clip(", "Add → Sub", _BUDGET),
    Explained("dampers.sessions", "trials = np.clip(", "14 → 140", _BUDGET),
    Explained("dampers.sessions", "trials = np.clip(", "9 → 10", _BUDGET),
    Explained("dampers.joint", "solution = least_squares(", "slopes and curved exchanged", _BUDGET),
    Explained("dampers.joint", "_TRIAL_STEPS", "0.001 → 0.01", _BUDGET),
    Explained("dampers.joint", "len(axis.grid) > 1", "1 → 2", "no axis has two starts before the one of lengths"),
    Explained(
        "models.play_bypass",
        "turned = path.first_direction",
        "Mult → Div: path.first_direction * np.where(np.arange(len(path.lengths)) % 2, -1.0, 1.0)",
        _SIGN,
    ),
    Explained("statistics.functions.fitting", "or 1.0", "1.0 → 10.0", "zero, whatever divides it"),
    Explained(
        "statistics.functions.forms",
        "for rate, feature in",
        "items 0 and 1 exchanged: ((term.decay_I, I), (term.decay_f, f), (term.power_f, np.log(f)))",
        _ORDER,
    ),
    Explained("identification.harmonic_balance", '"peaks":', "arguments", _ORDER),
    Explained(
        "identification.harmonic_balance",
        '"peaks":',
        "Sub → Add: bottom.theta - np.pi",
        "half a turn forth or back is the same angle",
    ),
    Explained(
        "identification.harmonic_balance", "lead = (leads", "Add → Sub", "half a turn forth or back is the same angle"
    ),
    Explained(
        "identification.harmonic_balance",
        "range(cycle[-1] + 1)",
        "1 → 2",
        "a part without samples, or the last without enough",
    ),
    Explained("paper.paper_method", "1e-6 * X", "Mult → Div: 1e-06 * X", _BUDGET),
    Explained(
        "paper.paper_method",
        '"alpha": 0.0, "beta": 1.0',
        "values 1 and 2",
        "the force of a state of zero, whatever weighs it",
    ),
    Explained(
        "paper.paper_method",
        '"alpha": 0.0, "beta": 1.0',
        "1.0 → 10.0",
        "the force of a state of zero, whatever weighs it",
    ),
    Explained("systems.monte_carlo", "machine = len(draws)", "", _BUDGET),
    Explained("identification.covariance", "for group in (odd, ~odd)", "items", _ORDER),
    Explained("identification.covariance", "odd = orders", "Eq → NotEq", _ALIKE),
    Explained("identification.covariance", "-logs", "", "the space columns span does not depend on their signs"),
    Explained("identification.covariance", "squares / max(", "1 → 2", _GUARD),
    Explained("identification.covariance", "free[rows] = np.clip(", "1 → 2", _GUARD),
    Explained("identification.covariance", "np.clip(share / whole", "1000.0 → 10000.0", _GUARD),
    Explained("identification.covariance", "taken = np.clip(", "1.0 → 10.0", _GUARD),
    Explained("identification.covariance", "powers[k - 1] if k", "arguments", "a product of two"),
    Explained("identification.covariance", "safe = np.maximum(values, np.finfo(float)", "Mult → Div", _GUARD),
    Explained(
        "identification.intervals",
        "math.pi / 2 - 1e-12",
        "Sub → Add",
        "Newton's steps come from below and do not reach it",
    ),
    Explained(
        "identification.intervals",
        "math.pi / 2 - 1e-12",
        "Div → Mult",
        "Newton's steps come from below and do not reach it",
    ),
    Explained("identification.intervals", "(nodes + 1)", "Add → Sub", "a cosine has no sign"),
    Explained("identification.intervals", 'max(values["current"]) == 0', "max → min", _ALIKE),
    Explained("identification.intervals", "(i, j): float(covariance", "items", _ALIKE),
    Explained("identification.loop_analysis", "t = motion.time", "", "a constant beside a column of ones"),
    Explained("fleet.verdicts", "far.get(n, 0) * sign", "Mult → Div", _SIGN),
    Explained("paper.output", "literal.identifications[0].free", "0 → 1", "all identifications are of one model"),
    Explained("systems.controllers.clipped_optimal", "design.A.shape[0]", "0 → 1", "a square matrix"),
    Explained("systems.controllers.clipped_optimal", "1e-15 * np.eye(n)", "Add → Sub", _GUARD),
    Explained("systems.inverse", "_MOTION // 2 :", "2 → 3", _BUDGET),
    Explained("systems.inverse", "range(_ROUNDS + 1)", "1 → 2", "it breaks off before"),
    Explained("systems.measures", "-step / _WINDOW", "Div → Mult", "the window is of one second"),
    Explained("quality.loop", "leap = float(", "mean → median", "sizes that are compared are even"),
    Explained("quality.loop", "0.01 * (force.size - 1)", "1 → 2", _BUDGET),
    Explained("quality.loop", "sides > 0.2 * low.size > 1", "1 → 2", _GUARD),
    Explained(
        "published.dominguez",
        "[np.log(c.amplitude_m / reference",
        "Div → Mult",
        "a constant factor goes into the levels",
    ),
    Explained(
        "published.dominguez",
        "[np.log(c.frequency_Hz / reference",
        "Div → Mult",
        "a constant factor goes into the levels",
    ),
    Explained(
        "published.boada",
        "in zip(factors, values",
        "arguments 0 and 1 exchanged: zip(factors, values, strict=True)",
        "a product of two",
    ),
    Explained("published.dominguez", "np.log(np.maximum(force, 1.0))", "1.0 → 10.0", _GUARD),
    Explained("published.dominguez", 'np.maximum(given["beta"], 1.0)', "1.0 → 10.0", _GUARD),
    Explained("published.dominguez", "np.log(total)", "log → log1p", "a loop's beta + gamma is far above one"),
    Explained("published.dominguez", "np.log(total)", "exp → expm1", "a loop's beta + gamma is far above one"),
    Explained("published.lv", "max(viscous, 1.0)", "1.0 → 10.0", _GUARD),
    Explained("identification.covariance", "np.median(np.diff(time))", "median → mean", "samples are even, or nearly"),
    Explained("dampers.modified", "ends = zip(function.rates", "arguments", "nearness of two"),
    Explained("dampers.joint", "reach = _DIFFERENCE_RATIO * (upper", "", _BUDGET),
    Explained("dampers.joint", "_DIFFERENCE_RATIO * (upper - lower), 0.0)", "Mult → Div", _BUDGET),
    Explained("dampers.joint", "middle = np.mean(self.box()", "mean → median", "the median of two is their mean"),
    Explained("dampers.joint", "here, there = ", "items", _ALIKE),
    Explained("dampers.joint", "point, 1, _REFIT_STEPS", "1 → 2", "weights are found once more"),
    Explained("dampers.random_effects", "unit: Floats = np.sqrt(", "", _SCALE),
    *(
        Explained("dampers.random_effects", "self.unit = ", change, _SCALE)
        for change in ("median →", "ptp → max", "2 → 3", "1.0 → 10.0")
    ),
    Explained("dampers.covariance", "error = moved + ", "Add → Sub", "a draw is as likely the other way"),
    Explained("systems.inverse", "rises = np.where(", "0 → 1", "the current next to the lowest"),
    Explained("systems.inverse", "rises = np.where(", "1 → 2", "the current next to the highest"),
    Explained("systems.monte_carlo", "size = np.where(scale > 0", "1.0 → 10.0", "zero, whatever divides it"),
    Explained("paper.paper_method", "issubclass(problem.model_type", "arguments", "no model is another's subclass"),
    Explained("paper.paper_method", 'values["c"] > 0', "0 → 1", "a damper has more than 1 N s/m"),
    Explained("dampers.sessions", "while step > 0.02", "0.02 → 0.2", _BUDGET),
    Explained("dampers.sessions", "step /= 2", "2 → 3", _BUDGET),
    Explained("study.plan", "axis=(0, 1, 2)", "items 0 and 1 exchanged: (0, 1, 2)", _ALIKE),
    Explained("study.plan", "uncertainty.covariance + 1e-12", "Add → Sub", _GUARD),
    Explained(
        "study.plan", "n.value * math.exp(s)", "Mult → Div: n.value * math.exp(s)", "a draw is as likely the other way"
    ),
)


def reason(fault: Fault) -> str:
    """Reason why a change has no effect; empty if it is a fault."""
    for module, line, change, why in EXPLAINED:
        if (
            module in fault.module
            and line in fault.text
            and (f" {change}" in f" {fault.change}" or change == f"{fault.change}: {fault.of}")
        ):
            return why
    return ""
