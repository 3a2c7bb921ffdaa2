"""How much each parameter matters at a condition, and what presetting it costs.

The loop is varied in coordinates that no unit of length changes: yield force, yield
displacement, exponent n and asymmetry (gamma − beta)/(gamma + beta). A change of n with beta
and gamma held would move the yield displacement by a power of the unit chosen.

A parameter may be preset if changing it hardly changes the force, or if the others make up
for it when they are identified anew. The two are told apart here: the second is why A = 1
costs nothing at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrdamper.data import Condition, Floats, Run
from mrdamper.errors import ParameterError, UnknownNameError
from mrdamper.identification import identify
from mrdamper.identification.methods.balance import Balance
from mrdamper.models.bouc_wen import BoucWen
from mrdamper.physics.hysteresis import steady_loop
from mrdamper.physics.motion import sine

LOOP = ("yield_force", "yield_displacement", "n", "asymmetry")
NAMES = ("c", *LOOP, "k1", "k3", "m", "f0")
_SAMPLES = 256  # of the loop
_REDRAWN = 100  # bootstrap samples of the intervals of the indices


@dataclass(frozen=True)
class OneAtATime:
    """What a change of one parameter does to the force.

    Attributes
    ----------
    name : str
    change : float
        Relative change made.
    effect : float
        RMS change of the force over its standard deviation, the other parameters held.
    left : float
        The same, once the free parameters were identified anew with this one preset wrongly.
        NaN where nothing was refitted.
    """

    name: str
    change: float
    effect: float
    left: float


@dataclass(frozen=True, eq=False)
class Sobol:
    """Sobol indices of the RMS change of the force.

    Attributes
    ----------
    names : tuple of str
    first, total : (P,) arrays
        Share of the variance a parameter makes alone, and with all others [-].
    first_confidence, total_confidence : (P,) arrays
        Half-widths at 95 %.
    spread : float
        Every parameter was varied by ± this share.
    """

    names: tuple[str, ...]
    first: Floats
    total: Floats
    first_confidence: Floats
    total_confidence: Floats
    spread: float


def one_at_a_time(
    model: BoucWen,
    condition: Condition,
    names: Sequence[str] = (*NAMES, "A"),
    change: float = 0.1,
    refit: Sequence[str] = ("asymmetry", "A", "n"),
) -> tuple[OneAtATime, ...]:
    """Change one parameter after the other, and identify the others anew for those that may be preset.

    Parameters
    ----------
    model : BoucWen
    condition : Condition
    names : sequence of str
        Coordinates, and "A", the factor of v that the model keeps at 1.
    change : float
        Relative change; of the asymmetry, which runs from -1 to 1, a difference.
    refit : sequence of str
        Parameters whose change the others are given the chance to make up for.

    Raises
    ------
    UnknownNameError
        If there is no such parameter.
    """
    base = _loop(model, condition)
    size = float(np.std(base))
    found = []
    for name in names:
        changed = _varied(model, {name: 1 + change})
        effect = float(np.sqrt(np.mean((_loop(changed, condition) - base) ** 2)))
        left = _left_after_refit(model, changed, condition) if name in refit else float("nan")
        found.append(OneAtATime(name, change, effect / size, left))
    return tuple(found)


def sobol(
    model: BoucWen,
    condition: Condition,
    names: Sequence[str] = NAMES,
    spread: float = 0.2,
    samples: int = 512,
    seed: int = 0,
) -> Sobol:
    """Sobol indices by Saltelli's scheme.

    Parameters
    ----------
    model : BoucWen
    condition : Condition
    names : sequence of str
    spread : float
        Parameters vary uniformly by ± this share of their value.
    samples : int
        A power of two; samples · (P + 2) loops are computed.
    seed : int

    Raises
    ------
    ParameterError
        If the spread is not within 0...1.
    """
    if not 0 < spread < 1:
        raise ParameterError(f"spread is {spread}", mend="give a share between 0 and 1")
    base = _loop(model, condition)

    def change(points: Floats) -> Floats:
        return np.array(
            [
                np.sqrt(np.mean((_loop(_varied(model, dict(zip(names, p, strict=True))), condition) - base) ** 2))
                for p in points.T.tolist()
            ]
        )

    from scipy.stats import qmc, sobol_indices

    rng, count = np.random.default_rng(seed), len(names)
    seeded: Any = {"seed": rng}  # the name that every SciPy from 1.13 on takes
    one, two = np.split(qmc.Sobol(2 * count, **seeded).random(samples).T * 2 * spread + 1 - spread, 2)
    mixed = np.stack([np.where(np.arange(count)[:, None] == i, two, one) for i in range(count)])
    forces = change(one), change(two), np.stack([change(points) for points in mixed])

    def indices(rows: np.ndarray) -> Floats:
        f_A, f_B, f_AB = forces[0][rows], forces[1][rows], forces[2][:, rows]
        found = sobol_indices(func={"f_A": f_A[None], "f_B": f_B[None], "f_AB": f_AB[:, None]}, n=samples)
        return np.array([np.ravel(found.first_order), np.ravel(found.total_order)])

    first, total = indices(np.arange(samples))
    redrawn = [indices(rng.integers(samples, size=samples)) for _ in range(_REDRAWN)]
    low, high = np.quantile(redrawn, (0.025, 0.975), axis=0)
    first_half, total_half = (high - low) / 2
    return Sobol(tuple(names), first, total, first_half, total_half, spread)


def _varied(model: BoucWen, factors: dict[str, float]) -> BoucWen:
    """The model with coordinates multiplied, the asymmetry moved by the factor less one.

    A factor A acts as on the printed equation with alpha, beta and gamma held.
    """
    plain = {name: value for name, value in model.values().items() if name not in ("alpha", "beta", "gamma")}
    values = plain | {
        "yield_force": float(model.yield_force),
        "yield_displacement": float(model.yield_displacement),
        "asymmetry": float(model.shape.rho),
    }
    for name in factors:
        if name != "A" and name not in values:
            raise UnknownNameError.of("parameter", name, (*values, "A"))
    for name, factor in factors.items():
        if name == "asymmetry":
            values[name] = float(np.clip(values[name] + factor - 1, -0.98, 0.98))
        elif name != "A":
            values[name] *= factor
    A, n = factors.get("A", 1.0), values["n"]
    values["yield_force"] *= A ** (1 / n)
    values["yield_displacement"] *= A ** (1 / n - 1)
    return BoucWen.build(values)


def _loop(model: BoucWen, condition: Condition) -> Floats:
    motion = sine(condition, 1, _SAMPLES)
    theta = 2 * np.pi * condition.frequency_Hz * motion.time
    z = model.yield_displacement * steady_loop(model.shape, condition.amplitude_m, theta)
    return model.force(motion, z)


def _left_after_refit(model: BoucWen, changed: BoucWen, condition: Condition) -> float:
    """Identify c, yield force and displacement and f0 from the changed model with the old gamma/beta and n."""
    motion = sine(condition, 1.25, _SAMPLES).part(slice(_SAMPLES // 4, -1))
    theta = 2 * np.pi * condition.frequency_Hz * motion.time
    z = changed.yield_displacement * steady_loop(changed.shape, condition.amplitude_m, theta)
    run = Run("changed", motion.time, motion.displacement, changed.force(motion, z), motion.current)
    held = {name: getattr(model, name) for name in ("n", "k1", "k2", "k3", "m")}
    found = identify(run, BoucWen, Balance(), fixed=held).model
    assert isinstance(found, BoucWen)
    measured = _loop(changed, condition)
    return float(np.sqrt(np.mean((_loop(found, condition) - measured) ** 2)) / np.std(measured))
