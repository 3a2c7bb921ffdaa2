"""Fits of one model of a whole damper to forces with other gains and offsets, without linearisation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.dampers.concatenated_runs import JointResiduals
from mrdamper.dampers.joint import JointProblem
from mrdamper.dampers.run_residuals import RunResiduals
from mrdamper.dampers.run_rows import RunRows
from mrdamper.data import Floats
from mrdamper.statistics.levenberg_marquardt import least_squares
from mrdamper.statistics.linear import on_one_blas_thread

_ROUNDS, _STEPS, _TOLERANCE = 2, 6, 1e-3  # of robust weights; steps in each, and the relative gain at which they end


@on_one_blas_thread
def refitted(
    damper: Damper,
    runs: Sequence[RunResiduals],
    rests: Sequence[Floats],
    names: Sequence[str],
    shifts: Floats,
    moved: Floats,
) -> Floats:
    """Return changes (K, P) of some parameters, or of their logarithms, the others held.

    The damper has one model, and the R runs are residuals of it; `rests` are their residuals that are no gain and no
    offset [N]. `shifts` (K, R, 2) are gains [-] and offsets [N] of the runs, of the predicted force. The searches start
    from changes by linearisation, `moved` (K, P).
    """
    model, numbers = damper.one_model, damper.fitted_parameters
    assert model is not None
    fixed = {name: value for name, value in model.values().items() if name not in names}
    rows = [RunRows.of(run.run) for run in runs]
    problem = JointProblem([run.run for run in runs], type(model), fixed, free=names, coil=damper.coil, parts=rows)
    table, box = JointResiduals(problem.space, rows), problem.space.box()
    predicted = [run.predicted for run in runs]
    changes = np.zeros((len(shifts), len(names)))
    for change, shift, start in zip(changes, shifts, moved, strict=True):
        values = {n: numbers[n].moved(step) for n, step in zip(names, start.tolist(), strict=True)}
        there = damper.with_parameters(values).one_model
        point = np.clip([axis.coordinate(getattr(there, axis.name)) for axis in problem.space.axes], *box)
        table.target = np.concatenate(
            [(1 + g) * force + o - rest for (g, o), force, rest in zip(shift, predicted, rests, strict=True)]
        )
        table.weigh(np.array([run.error for run in runs]))
        for _ in range(_ROUNDS if problem.space.axes else 0):
            table.weigh(table.solve(point).nrmse_pp)
            point = least_squares(
                table.solved_residual, point, *box, _STEPS, _TOLERANCE, products=table.products, curved=True
            ).point
        table.weigh(table.solve(point).nrmse_pp)
        solved = table.solve(point).model
        for i, name in enumerate(names):
            value, before = getattr(solved, name), numbers[name].value
            change[i] = np.log(value / before) if numbers[name].log else value - before
    return changes
