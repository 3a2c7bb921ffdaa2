"""Counterpart of an `Excitation` for one sample, for a model that runs on symbols."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mrdamper.tracing import Tape, Traced


@dataclass(frozen=True, eq=False)
class TracedStep(Traced):
    """A channel that enters by its step from sample to sample only: the path, or time."""

    tape: Tape
    step: Any
    # steps to the reversals between the last sample and this one, zero where there are none; `step` is what follows
    # them
    turns: tuple[Any, ...] = ()


@dataclass(frozen=True, eq=False)
class TracedMotion(Traced):
    """Motion and current at one sample."""

    tape: Tape
    displacement: Any
    velocity: Any
    acceleration: Any
    current: Any
    time: TracedStep
    path: TracedStep

    def __len__(self) -> int:
        return 1
