"""Comparison of controllers on one system and one input, from no current to the non-causal optimum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mrdamper.dampers.base import Damper
from mrdamper.data.progress import Progress, silent
from mrdamper.systems.controllers import Controller
from mrdamper.systems.controllers.passive import Passive
from mrdamper.systems.controllers.preview import NonCausalOptimum
from mrdamper.systems.inputs import Input
from mrdamper.systems.measures import cost
from mrdamper.systems.result import Simulation
from mrdamper.systems.simulate import SystemLoop


@dataclass(frozen=True, eq=False)
class ControllerComparison:
    """Runs of one system at one step."""

    runs: Mapping[str, Simulation]  # by title; no current and the highest current first, the non-causal optimum last

    def share(self, title: str) -> float:
        """Calculate the mean square of a run between no current (0) and the non-causal optimum (1)."""
        costs = {name: cost(run) for name, run in self.runs.items()}
        worst, best = next(iter(costs.values())), list(costs.values())[-1]
        return (worst - costs[title]) / (worst - best) if worst > best else 1.0


def compare_controllers(
    done: Simulation,
    source: Input,
    dampers: Mapping[str, Damper],
    controllers: Sequence[Controller],
    highest: float | None = None,
    progress: Progress = silent,
) -> ControllerComparison:
    """Run no current, the highest, other controllers and the non-causal optimum at the step of a simulation."""
    if highest is None:
        highest = max(damper.envelope.current_A[1] for damper in dampers.values())
    between = {"no current": Passive(), f"{highest:.3g} A": Passive(highest), **{_title(c): c for c in controllers}}
    several = {**between, NonCausalOptimum.title: NonCausalOptimum()}
    runs = {}
    for number, (title, controller) in enumerate(several.items()):
        progress(title, number / len(several))
        same = controller == done.controller
        runs[title] = done if same else SystemLoop(done.system, source, dampers, controller, highest).run(done.step)
    return ControllerComparison(runs)


def _title(controller: Controller) -> str:
    changed = [
        f"{info.name} {getattr(controller, info.name):g}"
        for info in controller.parameters()
        if getattr(controller, info.name) != info.default
    ]
    return ", ".join([type(controller).title, *changed])
