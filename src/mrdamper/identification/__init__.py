"""Identification: the parameters of a model from one run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from mrdamper.data import Run
from mrdamper.errors import IdentificationError, is_a, validate_arguments
from mrdamper.identification.methods import all_methods, method_named
from mrdamper.identification.problem import Identification, Method, Problem, Solution
from mrdamper.identification.uncertainty import uncertainty_of_run
from mrdamper.models import model_type
from mrdamper.models.base import Model
from mrdamper.physics.gas_spring import GasSpring
from mrdamper.physics.motion.sines import MIN_CYCLES
from mrdamper.statistics.linear import on_one_blas_thread
from mrdamper.statistics.metrics import score

__all__ = ["Identification", "Method", "Problem", "Solution", "all_methods", "identify"]


@on_one_blas_thread
@validate_arguments("run")
def identify(
    run: Run,
    model: str | type[Model] = "bouc-wen",
    method: str | Method = "projection",
    *,
    free: Sequence[str] = (),
    fixed: Mapping[str, float] | None = None,
    gas: GasSpring | None = None,
    with_delay: bool = False,
    clipped: bool = False,
) -> Identification:
    """Identify a model from one run, inside its steady window.

    Parameters
    ----------
    run : Run
        At one current, at least one cycle of motion.
    model : str or type of Model
    method : str or Method
    free : sequence of str
        Preset parameters to determine as well, for example ("gamma", "n").
    fixed : mapping
        Parameters to hold at a value [SI].
    gas : GasSpring, optional
        Known gas spring: fixes k1, k2, k3 and lets the mass be determined.
    with_delay : bool
        Determine a delay of the force channel, too, within ±3 ms.
    clipped : bool
        Use a record with a clipped channel, too.

    Returns
    -------
    Identification

    Raises
    ------
    UnknownNameError
        If there is no such model, method or parameter.
    ExcitationError
        If the steady window has less than one cycle.
    IdentificationError
        If the run does not determine the parameters.
    QualityError
        As `mrdamper.identify`, if the record is refused by a quality check.

    Examples
    --------
    >>> from mrdamper import identify, load_dataset
    >>> run = load_dataset()["utf_5mm4Hz_1A"]
    >>> identify(run, "bingham")
    <bingham from run utf_5mm4Hz_1A at 1 A, 4.07 Hz, 4.38 mm: 11.02 % of the peak-to-peak force
    c = 10800 ± 7800 N s/m (11 of 1966 samples independent)
    fy = 480 ± 380 N (22 of 1966 samples independent)
    f0 = 41 ± 4.5 N (1966 of 1966 samples independent)>
    >>> found = identify(run)  # Bouc–Wen
    >>> found.free
    ('c', 'alpha', 'beta', 'f0', 'k1', 'k3')
    >>> round(found.model.c, -3)  # post-yield damping [N s/m]
    7000.0
    """
    if not is_a(run, Run):
        remedy = 'identify one run, identify(dataset["ID"]); run_study(dataset) identifies them all'
        raise IdentificationError(f"a {type(run).__name__} in place of a run", remedy=remedy)
    refuse_unusable(run, clipped)
    chosen_model = model_type(model) if isinstance(model, str) else model
    chosen_method = method_named(method) if isinstance(method, str) else method
    problem = Problem.of(run, chosen_model, free=free, fixed=fixed, gas=gas, with_delay=with_delay)
    run.current_A  # noqa: B018  refuses a varying current before anything is computed
    where = f"run {run.id}"
    try:
        result = conclude(problem, chosen_method, chosen_method.solve(problem))
    except (np.linalg.LinAlgError, ArithmeticError) as error:
        raise IdentificationError(
            f"the samples do not determine the parameters ({error})",
            where=where,
            remedy="record more cycles, or more samples per cycle, and check the units",
        ) from error
    if not np.isfinite(result.scores.nrmse_pp):
        raise IdentificationError(
            "the error of the fit is no number", where=where, remedy="check the units of the force"
        )
    return result


def refuse_unusable(run: Run, clipped: bool = False) -> None:
    """Refuse a run with a constant force or a clipped channel.

    Raises `IdentificationError`; for clipping unless `clipped` is set.
    """
    force = run.force[run.in_window]  # an empty window is refused when its samples are used
    if force.size and np.ptp(force) == 0:
        raise IdentificationError("the force does not change", where=f"run {run.id}", remedy="check the channel")
    if "W_CLIPPED" in run.findings and not clipped:
        raise IdentificationError(
            "a channel is cut off at its extreme (W_CLIPPED)",
            where=f"run {run.id}",
            remedy="record it again with a wider range, or identify it alone with --clipped (clipped=True)",
        )


def conclude(problem: Problem, method: Method, solution: Solution) -> Identification:
    """Score a solution; its uncertainty is computed on request."""
    motion = problem.motion.delayed(solution.delay) if solution.delay else problem.motion
    scored = motion.part(problem.scored)
    state = solution.model.state(motion)[problem.scored]
    predicted = solution.model.force(scored, state)
    residual = predicted - problem.force
    return Identification(
        run_id=problem.run.id,
        rig=problem.run.rig,
        condition=problem.analysis.condition,
        model=solution.model,
        method=method.name,
        free=problem.free,
        at_bounds=solution.at_bounds,
        delay=solution.delay,
        scores=score(problem.force, predicted, scored.velocity, scored.time),
        floor=problem.run.repeatability,
        start=solution.start,
        end=solution.end,
        evaluations=solution.evaluations,
        ending=solution.ending,
        seed=solution.seed,
        notes=(*_notes(problem), *solution.notes),
        residual=residual,
        ask=partial(uncertainty_of_run, problem, solution, motion, state, residual),
    )


def _notes(problem: Problem) -> tuple[str, ...]:
    notes: list[str] = []
    names = {info.name for info in problem.model_type.parameters()}
    if "m" in names and "m" not in problem.free and not problem.fixed.get("m"):
        notes.append("mass not identified: at one frequency it is part of k1 (a = −ω² x); k1 holds k1 − m ω²")
    if not problem.analysis.is_sine:
        notes.append(f"the motion is no pure sine (distortion {100 * problem.analysis.distortion:.1f} %)")
    if problem.analysis.cycles < MIN_CYCLES:
        notes.append("fewer than two whole cycles: the start of the motion is part of them")
    if problem.run.window is None:
        notes.append("no steady window is given: the whole record was used")
    return tuple(notes)
