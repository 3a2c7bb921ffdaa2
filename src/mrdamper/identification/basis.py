"""Model, method and options by which every single run of a rig is identified."""

from __future__ import annotations

from dataclasses import dataclass

from mrdamper.data.runs import Run
from mrdamper.identification import Identification, Method, Problem, identify
from mrdamper.models import model_type
from mrdamper.physics.gas_spring import GasSpring


@dataclass(frozen=True)
class Basis:
    """Model, method and options of the identification of every single run."""

    model: str
    method: str | Method = "projection"
    free: tuple[str, ...] = ()  # preset parameters to determine as well
    fixed: tuple[tuple[str, float], ...] = ()  # parameters held at a value [SI]
    gas: GasSpring | None = None  # known gas spring

    def identify(self, run: Run) -> Identification:
        """Identify it from one run."""
        return identify(run, self.model, self.method, free=self.free, fixed=dict(self.fixed), gas=self.gas)

    def problem(self, run: Run) -> Problem:
        """Return the identification problem of a run, for a method of one's own."""
        fixed = dict(self.fixed)
        return Problem.of(run, model_type(self.model), free=self.free, fixed=fixed, gas=self.gas)

    @property
    def costly(self) -> bool:
        """True where only a few cycles of a run are used in a comparison of many runs."""
        return self.method != "projection" or model_type(self.model).integrated
