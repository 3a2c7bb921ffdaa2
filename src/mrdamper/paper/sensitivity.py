"""Sensitivity of the force to each parameter at a condition, and the cost of presetting one.

The loop is varied in coordinates that do not depend on the unit of length: yield force, yield displacement, exponent n
and asymmetry (gamma − beta)/(gamma + beta). A change of n with beta and gamma held would move the yield displacement by
a power of the unit chosen. A parameter may be preset if it hardly changes the force, or if the others compensate for it
when they are identified again, as they do for A = 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrdamper.data import Condition, Floats, Run
from mrdamper.errors import ParameterError, UnknownNameError
from mrdamper.identification import identify
from mrdamper.identification.methods.balance import Balance
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.physics.hysteresis import steady_loop
from mrdamper.physics.motion import Excitation, sine

NAMES = ("c", "yield_force", "yield_displacement", "n", "asymmetry", "k1", "k3", "m", "f0")
_SAMPLES = 256  # samples of the loop
_BOOTSTRAP_SAMPLES = 100  # of the intervals of the indices


@dataclass(frozen=True)
class OneAtATime:
    """Effect of a change of one parameter on the force."""

    name: str
    change: float  # relative change made
    effect: float  # RMS change of the force over its standard deviation, the other parameters held
    # the same after identification of the free parameters with this one preset wrongly; NaN without it
    left: float


@dataclass(frozen=True, eq=False)
class Sobol:
    """Sobol indices of the RMS change of the force."""

    names: tuple[str, ...]
    # first and total: (P,) share of the variance due to a parameter alone, and with all others [-]
    first: Floats
    total: Floats
    # first_confidence and total_confidence: (P,) half-widths at 95 %
    first_confidence: Floats
    total_confidence: Floats


def one_at_a_time(
    model: BoucWen,
    condition: Condition,
    names: Sequence[str] = (*NAMES, "A"),
    change: float = 0.1,
    refit: Sequence[str] = ("asymmetry", "A", "n"),
) -> tuple[OneAtATime, ...]:
    """Change single parameters, and identify the others again for those that may be preset.

    `names` are coordinates, and "A", the factor of v that the model keeps at 1. The change is relative; of the
    asymmetry, which lies between -1 and 1, it is a difference. For those in `refit` the others are identified again.
    Raises `UnknownNameError` if there is no such parameter.
    """
    base = _loop(model, condition)
    effects = []
    for name in names:
        changed = _varied(model, {name: 1 + change})
        effect = float(np.sqrt(np.mean((_loop(changed, condition) - base) ** 2)) / np.std(base))
        left = _left_after_refit(model, changed, condition) if name in refit else float("nan")
        effects.append(OneAtATime(name, change, effect, left))
    return tuple(effects)


def sobol(
    model: BoucWen,
    condition: Condition,
    names: Sequence[str] = NAMES,
    spread: float = 0.2,
    samples: int = 512,
    seed: int = 0,
) -> Sobol:
    """Compute Sobol indices by Saltelli's scheme.

    Parameters vary uniformly by ± `spread` of their value. The number of samples is a power of two; samples · (P + 2)
    loops are computed. Raises `ParameterError` if the spread is not within 0...1.
    """
    if not 0 < spread < 1:
        raise ParameterError(f"spread is {spread}", remedy="give a share between 0 and 1")
    from scipy.stats import qmc, sobol_indices

    rng, count, base = np.random.default_rng(seed), len(names), _loop(model, condition)
    seeded: Any = {"seed": rng}  # the name that every SciPy from 1.13 on takes
    one, two = np.split(qmc.Sobol(2 * count, **seeded).random(samples).T * 2 * spread + 1 - spread, 2)
    mixed = [np.where(np.arange(count)[:, None] == i, two, one) for i in range(count)]
    points = np.concatenate([one, two, *mixed], axis=1)
    effects = np.empty(points.shape[1])
    # One exponent n after the other: its curve is tabulated once.
    for i in np.argsort(points[names.index("n")] if "n" in names else points[0], kind="stable").tolist():
        changed = _varied(model, dict(zip(names, points[:, i].tolist(), strict=True)))
        effects[i] = np.sqrt(np.mean((_loop(changed, condition) - base) ** 2))
    f_A, f_B, *f_AB = effects.reshape(-1, samples)

    def indices(rows: np.ndarray) -> Floats:
        func = {"f_A": f_A[rows][None], "f_B": f_B[rows][None], "f_AB": np.array(f_AB)[:, None, rows]}
        result = sobol_indices(func=func, n=samples)
        return np.array([np.ravel(result.first_order), np.ravel(result.total_order)])

    first, total = indices(np.arange(samples))
    redrawn = [indices(rng.integers(samples, size=samples)) for _ in range(_BOOTSTRAP_SAMPLES)]
    low, high = np.quantile(redrawn, (0.025, 0.975), axis=0)
    first_half, total_half = (high - low) / 2
    return Sobol(tuple(names), first, total, first_half, total_half)


def _varied(model: BoucWen, factors: Mapping[str, float]) -> BoucWen:
    """Multiply coordinates of the model, and move the asymmetry by the factor less one.

    A factor A acts as on the printed equation with alpha, beta and gamma held.
    """
    values = {name: value for name, value in model.values().items() if name not in ("alpha", "beta", "gamma")}
    loop = (model.yield_force, model.yield_displacement, model.shape.rho)
    values |= dict(zip(("yield_force", "yield_displacement", "asymmetry"), map(float, loop), strict=True))
    for name, factor in factors.items():
        if name != "A" and name not in values:
            raise UnknownNameError.of("parameter", name, (*values, "A"))
        if name == "asymmetry":
            values[name] = float(np.clip(values[name] + factor - 1, -0.98, 0.98))
        elif name != "A":
            values[name] *= factor
    A, n = factors.get("A", 1.0), values["n"]
    values["yield_force"] *= A ** (1 / n)
    values["yield_displacement"] *= A ** (1 / n - 1)
    return BoucWen.build(values)


def _loop(model: BoucWen, condition: Condition, motion: Excitation | None = None) -> Floats:
    motion = motion or sine(condition, 1, _SAMPLES)
    theta = 2 * np.pi * condition.frequency_Hz * motion.time
    return model.force(motion, model.yield_displacement * steady_loop(model.shape, condition.amplitude_m, theta))


def _left_after_refit(model: BoucWen, changed: BoucWen, condition: Condition) -> float:
    """Identify c, yield force and displacement and f0 from the changed model with the old gamma/beta and n."""
    motion = sine(condition, 1.25, _SAMPLES).part(slice(_SAMPLES // 4, -1))
    run = Run("changed", motion.time, motion.displacement, _loop(changed, condition, motion), motion.current)
    held = {name: getattr(model, name) for name in ("n", "k1", "k2", "k3", "m")}
    refitted = identify(run, BoucWen, Balance(), fixed=held).model
    assert isinstance(refitted, BoucWen)
    measured = _loop(changed, condition)
    return float(np.sqrt(np.mean((_loop(refitted, condition) - measured) ** 2)) / np.std(measured))
