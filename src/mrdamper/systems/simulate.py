"""Simulation of a system with an input, dampers and a controller, and its accuracy."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from mrdamper.dampers.base import Damper
from mrdamper.data import Floats
from mrdamper.data.wording import number
from mrdamper.errors import ExcitationError, StepError, StructureError, numbers, validate_arguments
from mrdamper.statistics.linear import on_one_blas_thread
from mrdamper.systems.controllers import Controller
from mrdamper.systems.controllers.passive import Passive
from mrdamper.systems.controllers.preview import NonCausalOptimum
from mrdamper.systems.inputs import Input
from mrdamper.systems.kernel import ElementParameters, LoopElement, interpreted_loop, slope_and_scale
from mrdamper.systems.linear import aims, linear_system
from mrdamper.systems.links import contact_stage, damper_stage
from mrdamper.systems.machine import compiled_loop
from mrdamper.systems.result import HALVING, PART, Simulation
from mrdamper.systems.structure import System

PERIOD = 1e-3  # s between two evaluations of a control law, as usual on a real-time target
_MAX_STEP_S, _MIN_STEP_S = 1e-3, 1e-5  # s
_MAX_CHANGE_RATIO = 0.7  # ratio of successive changes of a peak, from the third halving on
_MAX_HALVED_SAMPLES = 1_000_000  # samples, beyond which a step is not halved again
_STEPS_PER_PERIOD = 40  # initial step relative to the period of the highest natural frequency
_MAX_INTERPRETED_LINES = 1_000_000  # up to which the interpreter is used; more are compiled
_LINES_PER_STEP = 60  # of the loop itself
_MAX_STEPS = 20_000_000


@on_one_blas_thread
@validate_arguments("step")
def simulate_system(
    system: System,
    source: Input,
    dampers: Mapping[str, Damper],
    controller: Controller | None = None,
    step: float | None = None,
    highest: float | None = None,
) -> Simulation:
    """Run a system, with a step found by halving, or with the one given.

    Parameters
    ----------
    system : System
    source : Input
    dampers : mapping of str to Damper
        By the name of their link; a link without one stays empty.
    controller : Controller, optional
        Default: no current.
    step : float, optional
        Time step [s]; refused if halving it changes a peak by more than 0.5 %.
    highest : float, optional
        Largest current of the controller [A]. Default: the largest tested.

    Returns
    -------
    Simulation
        At the finer of the two steps compared; `settled` states whether they agree.

    Raises
    ------
    StepError
        If the step is too coarse, naming the step needed, or a step has no solution.
    ExcitationError
        If the input does not fit the system.

    Examples
    --------
    >>> from mrdamper import load_input, load_system, simulate_system
    >>> frame = load_system("dyke1996")
    >>> bare = simulate_system(frame.system, load_input("elcentro", time_scale=5), {}, step=1e-3)
    >>> damped = simulate_system(frame.system, load_input("elcentro", time_scale=5), frame.dampers, step=5e-4)
    >>> bool(abs(damped.x[:, 2]).max() < 0.5 * abs(bare.x[:, 2]).max())  # [m], the top floor
    True
    """
    loop = SystemLoop(system, source, dampers, controller or Passive(), highest)
    dt = loop.first_step if step is None else numbers(step)[0]
    peaks, first, first_step, last = loop.run(dt).peaks, None, dt, math.inf
    while True:
        fine = loop.run(dt / 2)
        change = changed(peaks, fine.peaks)
        first = change if first is None else first
        # Sensitive to any change: no step suffices.
        lost = dt <= first_step / 4 and change > _MAX_CHANGE_RATIO * last
        if change <= HALVING or dt / 2 <= _MIN_STEP_S or fine.time.size > _MAX_HALVED_SAMPLES or lost:
            break
        peaks, dt, last = fine.peaks, dt / 2, change
        del fine  # releases its histories before the next run
    if step is not None and dt < step:
        raise StepError(
            f"halving the step of {step:g} s changes a peak by {number(100 * first, 2)} %",
            where=system.name,
            remedy=f"give --step {number(dt, 3)} or less, or none" if change <= HALVING else "leave --step out",
            code="E_STEP_COARSE",
        )
    return replace(fine, halving=change)


class SystemLoop:
    """A system with its links and controller, prepared; `run` may be called repeatedly.

    `system`, `source`, `dampers`, `controller`, `highest`: as `simulate_system`; `free`: allow other parameters of the
    dampers in each run.
    """

    def __init__(
        self,
        system: System,
        source: Input,
        dampers: Mapping[str, Damper],
        controller: Controller,
        highest: float | None = None,
        free: bool = False,
    ):
        _fit(system, source, dampers)
        self.system, self.source, self.controller = system, source, controller
        self.links = tuple(link for link in system.links if link.role != "damper" or link.name in dampers)
        self.stages = [
            damper_stage(dampers[link.name], free) if link.role == "damper" else contact_stage(link)
            for link in self.links
        ]
        self.numbers = ElementParameters.of(self.stages)
        self.dampers = dict(dampers)
        self.B, self.D = system.extensions(self.links)
        self.control = controller.prepare(system, self.links, dampers, PERIOD, highest)
        self._walks: dict[bool, Any] = {}

    @property
    def first_step(self) -> float:
        """Initial step: that of the input, a share of the period of the highest mode, or a millisecond."""
        highest = float(self.system.frequencies_Hz().max())
        step = min(_MAX_STEP_S, self.source.step, 1 / (_STEPS_PER_PERIOD * highest) if highest else _MAX_STEP_S)
        whole = PERIOD if self.control.program else self.source.step
        return whole / math.ceil(whole / step - 1e-9)

    def run(self, dt: float, machine: bool | None = None, numbers: ElementParameters | None = None) -> Simulation:
        """Simulate the whole input at one step dt [s].

        `machine`: compiled, where there is a compiler; by default for many steps. `numbers` are other parameters of the
        links than those of the dampers. Raises `StepError` if there are too many steps, or one has no solution.
        """
        system = self.system
        samples = int(min(self.source.duration / dt, 2.0 * _MAX_STEPS) + 1e-6) + 1 if 0 < dt < math.inf else 0
        if not 2 < samples <= _MAX_STEPS:
            raise StepError(
                f"{self.source.duration:g} s in steps of {dt:g} s",
                where=system.name,
                remedy=f"between two and {_MAX_STEPS:,} steps",
            )
        if machine is None:
            lines = _LINES_PER_STEP + 3 * sum(stage.source.lines for stage in (*self.stages, *self._controllers))
            machine = 3 * samples * lines > _MAX_INTERPRETED_LINES  # this run and that at half the step
        done = self._at_rest(dt * np.arange(samples, dtype=np.float64))
        S: Any = np.linalg.inv(2 / dt * system.M + system.C + dt / 2 * system.K)
        numbers, control = numbers or self.numbers, ElementParameters.of(self._controllers)
        memory = (numbers.given, numbers.derived, numbers.start.copy(), control.given, control.derived, control.start)
        memory = (*memory, *slope_and_scale(len(self.links)))
        every = max(1, round(PERIOD / dt))
        # In blocks that fit the processor's cache, each of whole periods of the control law.
        size = samples if isinstance(self.controller, NonCausalOptimum) else every * max(1, PART // every)
        for begin in range(0, samples - 1, size):
            self._fill(done, slice(begin, begin + size + 1), S, every, memory, machine)
        return done

    def _at_rest(self, time: Floats) -> Simulation:
        shapes = [(time.size, width) for width in (len(self.system.coordinates), len(self.links))]
        x, v, a, load = (np.zeros(shapes[0]) for _ in range(4))
        force, current = (np.zeros(shapes[1]) for _ in range(2))
        road, road_rate = (np.zeros((time.size, len(self.system.channels))) for _ in range(2))
        current[0] = self.control.start
        return Simulation(
            self.system, time, x, v, a, self.links, force, current, np.zeros(shapes[1], np.uint8), road, road_rate,
            load, self.controller, self.control.limits,
        )  # fmt: skip

    def _fill(
        self, done: Simulation, part: slice, S: Floats, every: int, memory: tuple[Floats, ...], machine: bool
    ) -> None:
        """Compute the samples of a block from the first, which is known."""
        system, dt, failed = self.system, done.step, -1
        ground, done.road[part], done.road_rate[part] = self._driven(done.time[part])
        road, rate = done.road[part], done.road_rate[part]
        done.load[part] = load = self._load(ground, road, rate)
        mean_load = np.zeros_like(load)
        mean_load[1:] = 0.5 * (load[1:] + load[:-1]) @ S.T
        x, v, force = done.x[part], done.v[part], done.force[part]
        if isinstance(self.controller, NonCausalOptimum):
            self._previewed(dt, S, mean_load, load, road, x, v, force)
        else:
            R, flags = S @ self.B.T, done.flags[part].astype(float)
            rows = (S @ (2 / dt * system.M), -S @ system.K, R, self.B @ R, self.B, mean_load)
            rows = (*rows, road @ self.D.T, rate @ self.D.T, *self._sight(ground, road, rate))
            written = (done.current[part], x, v, force, flags)
            try:
                failed = self._walk(machine)(dt, every, *map(np.ascontiguousarray, rows), *memory, *written)
            except ArithmeticError:  # of the interpreter, where machine code continues with values that are not finite
                failed = int(np.flatnonzero(x.any(axis=1))[-1]) + 1 if x.any() else 1
            done.flags[part] = flags
        if failed >= 0 or not np.isfinite(x).all():
            raise StepError(
                f"no solution at {done.time[part][max(failed, 0)]:.6g} s",
                where=system.name,
                remedy="shorten the step, and check the damper's range against the motion",
                code="E_STEP_LOST",
            )
        relative = (load - v @ system.C - x @ system.K - force @ self.B) @ np.linalg.inv(system.M)
        done.a[part] = relative if system.ground is None else relative + np.outer(ground, system.ground)

    def _previewed(
        self, dt: float, S: Floats, mean_load: Floats, load: Floats, road: Floats, x: Floats, v: Floats, force: Floats
    ) -> None:
        """Fill x, v and force with the optimum for the whole input; bump stops and tyres have no force."""
        system, n = self.system, len(self.system.coordinates)
        at = [i for i, link in enumerate(self.links) if link.role == "damper"]
        # End velocity 2 m − v and displacement x + dt m, m the mean velocity of the step.
        m = np.hstack([-S @ system.K, S @ (2 / dt * system.M)])
        A = np.vstack([dt * m, 2 * m]) + np.kron(np.diag([1, -1]), np.eye(n))
        push = -S @ self.B[at].T
        assert isinstance(self.controller, NonCausalOptimum)
        linear = linear_system(system, [self.links[i] for i in at])
        aimed = np.zeros((load.shape[0], linear.aim[0].shape[0]))
        pushed = load @ np.linalg.inv(system.M)
        for k, aim in enumerate(aims(system)):
            if aim.kind == "span":
                aimed[:, k] = aim.weight * road @ system.span(*system.spans[aim.name])[1]
            elif system.ground is None:
                aimed[:, k] = aim.weight * pushed @ system.point(aim.name)[0]
        driven = np.hstack([dt * mean_load, 2 * mean_load])
        force[:, at] = self.controller.forces(A, np.vstack([dt * push, 2 * push]), driven, *linear.aim, aimed)
        z = np.zeros(2 * n)
        for k in range(1, x.shape[0]):
            z = A @ z + np.concatenate([dt * push, 2 * push]) @ (force[k, at] + force[k - 1, at]) / 2 + driven[k]
            x[k], v[k] = z[:n], z[n:]

    def _driven(self, time: Floats) -> tuple[Floats, Floats, Floats]:
        """Acceleration of the ground (N,), height and rate of the road (N, q)."""
        q = len(self.system.channels)
        still = np.zeros((time.size, q))
        if self.system.ground is not None:
            return self.source.value(time), still, still
        late = [time - behind / self.source.speed_m_s for behind in self.system.behind]
        height, rate = (np.column_stack([of(t) for t in late]) for of in (self.source.value, self.source.rate))
        return np.zeros(time.size), height, rate

    def _load(self, ground: Floats, road: Floats, road_rate: Floats) -> Floats:
        """(N, n) forces of the input on the coordinates."""
        if self.system.ground is not None:
            return -np.outer(ground, self.system.M @ self.system.ground)
        assert self.system.push is not None
        height, rate = self.system.push
        return road @ height.T + road_rate @ rate.T

    def _sight(self, ground: Floats, road: Floats, road_rate: Floats) -> tuple[Floats, Floats]:
        """Signals as H [x; v; f] + seen: (S, 2n + E) and (N, S)."""
        names = self.control.signals
        n, count = len(self.system.coordinates), len(self.links)
        H, driven = np.zeros((len(names), 2 * n + count)), np.zeros((ground.size, len(names)))
        inverse = np.linalg.inv(self.system.M)
        pushed = self._load(0 * ground, road, road_rate) @ inverse
        for s, name in enumerate(names):
            at, _, quantity = name.rpartition(".")
            link = next((i for i, other in enumerate(self.links) if other.name == at), None)
            if quantity == "force" and link is not None:
                H[s, 2 * n + link] = 1.0
                continue
            row, ways = (self.B[link], self.D[link]) if link is not None else self.system.point(at)
            if quantity in ("stroke", "position"):
                H[s, :n], driven[:, s] = row, road @ ways
            elif quantity in ("stroke_rate", "velocity"):
                H[s, n : 2 * n], driven[:, s] = row, road_rate @ ways
            else:
                H[s] = row @ inverse @ np.hstack([-self.system.K, -self.system.C, -self.B.T])
                driven[:, s] = pushed @ row
        return H, driven

    @cached_property
    def _controllers(self) -> list[LoopElement]:
        """None or one."""
        return [LoopElement.of(self.control.program)] if self.control.program else []

    def _walk(self, machine: bool) -> Any:
        if machine not in self._walks:
            law = next(iter(self._controllers), None)
            compiled = compiled_loop(self.stages, law) if machine else None
            self._walks[machine] = compiled or interpreted_loop(self.stages, law)
        return self._walks[machine]


def _fit(system: System, source: Input, dampers: Mapping[str, Damper]) -> None:
    wanted = "road" if system.ground is None else "ground"
    if source.kind != wanted:
        raise ExcitationError(
            f"a {source.kind} input for a system on a {wanted}",
            where=system.name,
            remedy="give acceleration_m_s2 or acceleration_g" if wanted == "ground" else "give a road, or height_m",
        )
    names = {link.name for link in system.dampers}
    for name in dampers:
        if name not in names:
            raise StructureError(
                f"no damper is called {name!r}",
                where=system.name,
                remedy=f"known: {', '.join(sorted(names)) or 'none'}",
            )


def changed(coarse: Mapping[str, Floats], fine: Mapping[str, Floats]) -> float:
    """Largest relative change of a peak, over the largest peak of its kind."""
    worst = 0.0
    for kind, values in fine.items():
        if values.size and (largest := float(values.max())) > 0:
            worst = max(worst, float(np.abs(values - coarse[kind]).max()) / largest)
    return worst
