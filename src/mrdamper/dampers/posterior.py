"""Samples of a damper's parameters by Markov chains over their likelihood, refused without convergence."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrdamper.dampers.likelihood import Likelihood
from mrdamper.data import Floats
from mrdamper.data.wording import counted
from mrdamper.errors import InputError, MissingExtraError
from mrdamper.statistics.linear import positive

_SEED = 1
_PROPOSAL_DOF = 5.0  # degrees of freedom of the proposals
_BURN_IN_SHARE = 0.2  # share of a chain that is discarded
_MIN_AUTOCORRELATION_TIMES, _MAX_RHAT = 50, 1.01  # least length in autocorrelation times; limit of split-R̂


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples from the posterior of a damper's parameters, with flat priors within their bounds."""

    names: tuple[str, ...]  # length P
    values: Floats  # (N, P)
    time: float  # longest autocorrelation time [steps]
    steps: int  # of each walker, after the discarded part
    split_rhat: float  # largest split-R̂ of any parameter


def posterior(likelihood: Likelihood, steps: int = 2000) -> Samples:
    """Markov chains over the likelihood, within the bounds; of the steps of each walker the first fifth is discarded.

    Half of the moves propose from the covariance with wider tails, independent of the chain's position, the others are
    stretch moves [Goodman and Weare 2010]. Raises `MissingExtraError` if emcee is not installed, and `InputError`
    (E_CONVERGENCE) below 50 autocorrelation times or above a split-R̂ of 1.01.
    """
    if importlib.util.find_spec("emcee") is None:
        raise MissingExtraError("samples need emcee", remedy="pip install 'mrdamper[uq]'")
    emcee: Any = importlib.import_module("emcee")

    size = len(likelihood.names)
    count = 2 * size + 2  # walkers
    root = np.linalg.cholesky(positive(likelihood.covariance))
    inverse = np.linalg.inv(root)
    rng = np.random.default_rng(_SEED)

    def wide(points: Floats) -> Floats:
        """Logarithm of the density the proposals come from: Student's t of five degrees."""
        squares = np.sum(((points - likelihood.start) @ inverse.T) ** 2, axis=1)
        return -0.5 * (_PROPOSAL_DOF + size) * np.log1p(squares / _PROPOSAL_DOF)

    def propose(points: Floats, random: np.random.RandomState) -> tuple[Floats, Floats]:
        shape = points.shape
        scale = np.sqrt(_PROPOSAL_DOF / random.chisquare(_PROPOSAL_DOF, len(points)))
        new = likelihood.start + (random.standard_normal(shape) * scale[:, None]) @ root.T
        return new, wide(points) - wide(new)

    def logarithm(point: Floats) -> float:
        return -0.5 * likelihood(point)

    begin = likelihood.start + 0.5 * rng.standard_normal((count, size)) @ root.T
    begin = np.clip(begin, likelihood.bounds[:, 0], likelihood.bounds[:, 1])
    moves = [(emcee.moves.MHMove(propose), 0.7), (emcee.moves.StretchMove(), 0.3)]
    sampler = emcee.EnsembleSampler(count, size, logarithm, moves=moves)
    sampler.random_state = np.random.RandomState(_SEED).get_state()
    sampler.run_mcmc(begin, steps, skip_initial_state_check=True)
    # (steps, walkers, P)
    kept: Floats = np.asarray(sampler.get_chain(discard=int(_BURN_IN_SHARE * steps)), dtype=float)
    time = float(np.max(emcee.autocorr.integrated_time(kept, tol=0)))
    rhat = split_rhat(kept)
    if not (len(kept) > _MIN_AUTOCORRELATION_TIMES * time and rhat <= _MAX_RHAT):
        raise InputError(
            f"not converged: {counted(len(kept), 'step')} of {time:.0f} autocorrelation times each, split-R̂ {rhat:.3f}",
            remedy=f"take {int(70 * time * 1.25)} steps or more; more than 50 times and 1.01 at most are asked for",
            code="E_CONVERGENCE",
        )
    flat = kept[:: max(1, int(time))].reshape(-1, size)
    values = np.where(likelihood.logs, np.exp(np.where(likelihood.logs, flat, 0)), flat)
    return Samples(likelihood.names, values, time, len(kept), rhat)


def split_rhat(chains: Floats) -> float:
    """Largest potential scale reduction of chains (steps, walkers, P) cut in halves [Gelman et al. 2013]."""
    half = len(chains) // 2
    parts = np.concatenate([chains[:half], chains[half : 2 * half]], axis=1)
    within = parts.var(axis=0, ddof=1).mean(axis=0)
    between = parts.mean(axis=0).var(axis=0, ddof=1)
    return float(np.max(np.sqrt((half - 1) / half + between / np.maximum(within, 1e-300))))
