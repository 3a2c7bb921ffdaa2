"""Who takes part in a comparison, and what there is to say about each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mrdamper.dampers.base import Damper
from mrdamper.dampers.published import ConditionedDamper, all_conditioned
from mrdamper.errors import UnknownNameError
from mrdamper.models import Scale, all_models, model_type
from mrdamper.study.workflow import JOINTLY

GENETIC = ("bouc-wen:paper", "bouc-wen:direct-genetic")


@dataclass(frozen=True)
class Basis:
    """What is identified from single runs."""

    model: str
    method: str = "projection"
    free: tuple[str, ...] = ()

    @property
    def costly(self) -> bool:
        """Whether a few cycles of a run have to do."""
        return self.method != "projection" or model_type(self.model).integrated


@dataclass(frozen=True)
class Contestant:
    """What enters a comparison."""

    name: str
    basis: Basis | None
    damper: type[ConditionedDamper] | None = None
    jointly: bool = False  # its parameter functions are fitted to all forces at once


def contestants(names: Sequence[str] = (), genetic: bool = False) -> list[Contestant]:
    """All that can be compared, or those of some names.

    Parameters
    ----------
    names : sequence of str
    genetic : bool
        Also the identifications by genetic algorithm, which take most of the time. Those named
        take part in any case.

    Raises
    ------
    UnknownNameError
        With the near matches.
    """
    known = {name: Contestant(name, Basis(name)) for name in all_models() if name != JOINTLY}
    known |= {f"{name}:joint": Contestant(f"{name}:joint", Basis(name), jointly=True) for name in _closed_shapes()}
    known |= {name: Contestant(name, Basis(name.split(":")[0], name.split(":")[1])) for name in GENETIC}
    known[JOINTLY] = Contestant(JOINTLY, None)
    for name, cls in all_conditioned().items():
        known[name] = Contestant(name, Basis(cls.basis, free=cls.basis_free) if cls.basis else None, cls)
    for name in names:
        if name not in known:
            raise UnknownNameError.of("model", name, known)
    return [known[name] for name in (names or known) if names or genetic or name not in GENETIC]


def _closed_shapes() -> list[str]:
    """Models whose loop has at most one shape coordinate, the yield displacement: all runs fit at once."""
    shapes = {
        name: [
            axis.name for axis in cls.search_axes(Scale(1.0, 1.0), [i.name for i in cls.parameters() if not i.preset])
        ]
        for name, cls in all_models().items()
        if name != JOINTLY
    }
    return [name for name, axes in shapes.items() if axes in ([], ["yield_displacement"])]


def title(contestant: Contestant, damper: Damper) -> str:
    """What to call it in a table."""
    if contestant.basis is None or contestant.damper is not None:
        return damper.title
    method = contestant.basis.method
    about = (
        ", functions fitted jointly" if contestant.jointly else "" if method == "projection" else f", method {method}"
    )
    return model_type(contestant.basis.model).title + about


def source(contestant: Contestant) -> str:
    """Where it was published, or that its equations were not seen."""
    return contestant.damper.source if contestant.damper else model_type(contestant.name.split(":")[0]).source


def limits(contestant: Contestant) -> str:
    """What it cannot do."""
    if contestant.damper is not None:
        return contestant.damper.limits
    if contestant.basis is None:
        return "takes any motion and a current that varies"
    stepped = "stepped, not closed; " if model_type(contestant.basis.model).integrated else ""
    return f"{stepped}parameter functions need the frequency and amplitude of a sine"


def conditions_needed(damper: Damper) -> int:
    """As many conditions as the longest law has numbers; dampers of one fit need currents, not conditions."""
    functions = getattr(getattr(damper, "parameters", None), "functions", None)
    if functions:
        return max(len(f.coefficients) + len(f.rates) for f in functions.values())
    return 3
