"""Uncertainty through the loop: many dampers in one system, bands on what comes out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.joint import JointDamper
from mrdamper.data import Floats
from mrdamper.errors import ParameterError
from mrdamper.systems.kernel import Numbers
from mrdamper.systems.result import Simulation
from mrdamper.systems.simulate import Loop

LEVELS = (0.05, 0.5, 0.95)


@dataclass(frozen=True, eq=False)
class Bands:
    """Peaks over many dampers.

    Attributes
    ----------
    peaks : mapping of str to (S, ·) array
        As `Simulation.peaks`, one row a damper.
    """

    peaks: Mapping[str, Floats]

    def quantiles(self, levels: Sequence[float] = LEVELS) -> dict[str, Floats]:
        """(L, ·) quantiles of every peak."""
        return {name: np.quantile(rows, levels, axis=0) for name, rows in self.peaks.items()}


def drawn(damper: JointDamper, names: Sequence[str], covariance: Floats, count: int, seed: int = 1) -> list[Damper]:
    """Dampers whose parameters scatter as an identification, or the sessions behind it, say they do.

    Parameters
    ----------
    damper : JointDamper
        The mean.
    names : sequence of str
        Parameters that scatter.
    covariance : (P, P) array
        Of them; those on a log scale in their logarithms.
    count, seed : int

    Raises
    ------
    ParameterError
        If the covariance is none of these parameters.
    """
    known = {info.name: info for info in type(damper.model).parameters()}
    matrix = np.asarray(covariance, dtype=float)
    if matrix.shape != (len(names), len(names)) or not np.allclose(matrix, matrix.T) or set(names) - set(known):
        raise ParameterError(
            f"a covariance of shape {matrix.shape} for {', '.join(names)}",
            where=damper.title,
            mend="give a symmetric one, a row a parameter of the model",
        )
    nudges = np.random.default_rng(seed).multivariate_normal(np.zeros(len(names)), matrix, count, check_valid="raise")
    found: list[Damper] = []
    for row in nudges:
        values = {}
        for name, nudge in zip(names, row.tolist(), strict=True):
            mean, (low, high) = getattr(damper.model, name), known[name].bounds
            moved = mean * np.exp(nudge) if known[name].scale == "log" else mean + nudge
            values[name] = float(np.clip(moved, low, high))
        found.append(replace(damper, model=replace(damper.model, **values)))
    return found


def monte_carlo(loop: Loop, dampers: Sequence[Mapping[str, Damper]], step: float) -> Bands:
    """Run the same loop with other dampers of the same models.

    The loop is traced and compiled once; only numbers differ from run to run.

    Parameters
    ----------
    loop : Loop
    dampers : sequence of mapping of str to Damper
        By link, as the loop's own.
    step : float
        [s], one at which the loop was found to have settled.

    Raises
    ------
    ParameterError
        If a damper is not of the same model and branch as the loop's.
    """
    machine = len(dampers) > 5 or None
    rows = [loop.run(step, machine=machine and loop.can_compile, numbers=_numbers(loop, one)).peaks for one in dampers]
    return Bands({name: np.array([peaks[name] for peaks in rows]) for name in Simulation.PEAKS})


def _numbers(loop: Loop, dampers: Mapping[str, Damper]) -> Numbers:
    stages = []
    for link, stage in zip(loop.links, loop.stages, strict=True):
        if link.role == "damper":
            model = dampers[link.name].one_model
            own = loop.dampers[link.name].one_model
            if model is None or own is None or type(model) is not type(own):
                raise ParameterError(
                    f"{dampers[link.name].title} for {loop.dampers[link.name].title}",
                    where=link.name,
                    mend="give dampers of one model, which keep their parameters free",
                )
            stage = stage.at(tuple(model.values().values()))
        stages.append(stage)
    return Numbers.of(stages)
