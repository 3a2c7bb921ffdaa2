"""Play and bypass: a yield force behind a free play with a parallel viscous bypass.

Real dampers have a free play of some 0.4 mm after every reversal: the force decreases to a viscous plateau until the
play is closed, and then rises to the full yield force. The tangent stiffness of a Bouc–Wen element is largest at the
reversal, so it cannot describe this. Frequency and amplitude are no inputs: the apparent dependence on them follows
from play, velocity and lag.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from mrdamper.data import Floats
from mrdamper.data.parameters import param
from mrdamper.models.base import Model, Scale, SearchAxis
from mrdamper.models.recorded import recorded
from mrdamper.physics.motion import Excitation, Path
from mrdamper.physics.motion.lag import first_order_lag, leaking_load
from mrdamper.physics.motion.path import memoize_per_path
from mrdamper.tracing import Tape, streamed

RISE_CURRENT = 0.12  # A; preset of Ic: the current over which the yield force begins to rise with zero slope


@dataclass(frozen=True)
class PlayBypass(Model):
    """F = f0 + k x (1 − S) + (c0 + c1 I) v + cq |v| + fy(I) (S + q |S|) + m a, S the lagged share of the yield force.

    With δ the position in the play (stop operator, |δ| ≤ d), φ = sgn δ · max(0, |δ| − (d − e))/e is the relative load
    of the series spring and η its load along the motion; b = r/√(1 + r²) with r = cb |v|/fy is the bypass, limited by
    the yield force. Then

    s = (1 − h) φ G + sgn v [h |v|/(|v| + vh) η + (1 − η) b],  T dS/dt + S = s,
    dG/dt = (|v|/e)(1 − G) − l G,

    G the remaining load of the series spring (l = 0: no relaxation),

    fy(I) = fy0 + fy1 I (1 − exp(−I/Ic))/(1 + si I), h = h0 + h1 I within 0 and 1, q, cq and qb the excess of yield,
    viscosity and bypass (cb (1 + qb sgn v)) in extension. Parameters of fy(I) and asymmetries are free only if
    cross-validation selects them (`dampers.choice`).

    References
    ----------
    Derived from the bundled tests of two dampers (docs/play-and-bypass.md).
    """

    name: ClassVar[str] = "play-bypass"
    title: ClassVar[str] = "play and bypass"
    equation: ClassVar[str] = (
        r"F = f_0 + k x (1 - S) + (c_0 + c_1 I) v + c_q |v| + f_y (S + q |S|) + m a,\quad "
        r"f_y = f_{y0} + f_{y1} I \frac{1 - e^{-I/I_c}}{1 + s_i I},\quad "
        r"T \dot S + S = (1 - h) \varphi G + \mathrm{sgn}\,v \left[h \frac{|v|}{|v| + v_h} \eta + (1 - \eta) b\right],"
        r"\quad \dot G = \frac{|v|}{e} (1 - G) - l G,\quad "
        r"h = \min(1, \max(0, h_0 + h_1 I)),\quad "
        r"\dot\delta = v \;\mathrm{where}\; |\delta| < d \;\mathrm{or}\; \delta v < 0,\;\mathrm{else}\; 0,\quad "
        r"\varphi = \mathrm{sgn}\,\delta\, \max(0, |\delta| - (d - e))/e,\quad "
        r"\eta = \max(0, \varphi\,\mathrm{sgn}\,v),\quad b = \frac{r}{\sqrt{1 + r^2}},\quad "
        r"r = \frac{c_b (1 + q_b\,\mathrm{sgn}\,v) |v|}{f_y}"
    )
    source: ClassVar[str] = "derived from the bundled tests"
    current_levels: ClassVar[Mapping[str, int]] = {"fy1": 2, "c1": 2, "h1": 2, "si": 3}

    f0: float = param("N", "offset force", linear=True)
    k: float = param("N/m", "stiffness within the free play", linear=True)
    c0: float = param("N s/m", "post-yield viscous damping without current", bounds=(0, np.inf), linear=True)
    c1: float = param("N s/m/A", "rise of the viscous damping with current", bounds=(0, np.inf), linear=True)
    fy0: float = param("N", "yield force without current", bounds=(1e-6, 1e7), scale="log")
    fy1: float = param("N/A", "rise of the yield force with current", bounds=(0, 1e8), scale="log")
    d: float = param(
        "m", "half the free play and spring travel: the free play is 2 (d − e)", bounds=(1e-6, 1e-2), scale="log"
    )
    e: float = param("m", "elastic displacement of the series spring", bounds=(1e-9, 1e-2), scale="log")
    cb: float = param("N s/m", "viscous damping of the bypass in the free play", bounds=(1e-2, 1e10), scale="log")
    h0: float = param("-", "Stribeck amplitude: decreasing share of the yield force", bounds=(-1, 2))
    h1: float = param("1/A", "rise of that share with current", bounds=(-1e3, 1e3))
    vh: float = param("m/s", "Stribeck velocity: the share has decreased by half", bounds=(1e-7, 10), scale="log")
    T: float = param("s", "lag of the yield force", bounds=(0, 0.2), scale="log")
    asymmetry: float = param(
        "-",
        "surplus of the yield force in extension over the mean",
        bounds=(-0.9, 0.9),
        linear=True,
        default=0.0,
        symbol="q",
    )
    m: float = param("kg", "inertia", bounds=(0, np.inf), linear=True, default=0.0)
    cq: float = param("N s/m", "surplus of the viscous damping in extension", linear=True, preset=True, default=0.0)
    qb: float = param("-", "surplus of the bypass in extension", bounds=(-0.95, 0.95), preset=True, default=0.0)
    Ic: float = param(
        "A",
        "current over which the yield force begins to rise",
        bounds=(1e-4, 20),
        scale="log",
        preset=True,
        default=RISE_CURRENT,
    )
    leak: float = param(
        "1/s",
        "relaxation rate of the spring force at rest",
        bounds=(0, 1e5),
        scale="log",
        preset=True,
        default=0.0,
        symbol="l",
    )
    si: float = param("1/A", "saturation of the yield force with current", bounds=(0, 1e3), preset=True, default=0.0)

    @property
    def yield_length(self) -> float:
        """Free play and spring travel, 2 d [m]."""
        return 2 * self.d

    @property
    def seat_share(self) -> float:
        """Share of the spring in the travel, e/d; from 1 on there is no free play [-]."""
        return self.e / self.d

    @classmethod
    def build(cls, values: Mapping[str, float]) -> Self:
        """Make the model from its parameters, or from `seat_share` [-] in place of e."""
        given = dict(values)
        if (share := given.pop("seat_share", None)) is not None:
            given["e"] = share * given["d"]
        return cls(**given)

    def yield_force(self, current: Floats) -> Floats:
        """fy(I) [N]."""
        size = np.abs(current)
        return self.fy0 + self.fy1 * current * (1 - np.exp(-size / self.Ic)) / (1 + self.si * size)

    @recorded
    def state(self, motion: Excitation) -> Floats:
        """S (N,), the lagged share of the yield force."""
        v, current, seat = motion.velocity, motion.current, np.minimum(self.e, self.d)
        speed, sign = np.abs(v), np.sign(v)
        play = play_position(motion.path, self.d)
        loaded = np.sign(play) * np.maximum(0.0, np.abs(play) - (self.d - seat)) * (1 / seat)
        along = np.maximum(0.0, loaded * sign)
        ratio = (self.cb / self.yield_force(current)) * (1 + self.qb * sign) * speed
        bypass = ratio / np.sqrt(1 + ratio**2)
        fading = np.clip(self.h0 + self.h1 * current, 0.0, 1.0)
        seated = fading * speed / (speed + self.vh) * along
        held = (1 - fading) * loaded * leaking_load(motion.time, motion.path, seat, self.leak)
        return first_order_lag(motion.time, held + sign * (seated + (1 - along) * bypass), self.T)

    def force(self, motion: Excitation, state: Floats) -> Floats:
        x, v, a, current = motion.displacement, motion.velocity, motion.acceleration, motion.current
        viscous = (self.c0 + self.c1 * current) * v
        yielded = self.yield_force(current) * (state + self.asymmetry * np.abs(state))
        return self.f0 + self.k * x * (1 - state) + viscous + self.cq * np.abs(v) + yielded + self.m * a

    @classmethod
    def search_axes(cls, scale: Scale, free: Sequence[str]) -> tuple[SearchAxis, ...]:
        """Each nonlinear parameter on its own scale: forces, speeds and currents of the data, lengths of any damper.

        Several lengths of free play are tried, because no search converges from 0.4 mm to 8 mm.
        """
        X, V, F, I = scale.amplitude, scale.speed, scale.force, scale.current or 1.0
        longest = min(1e-2, 0.7 * X)
        lengths = tuple(length for length in (2e-4, 5e-5, 8e-4, 3e-3) if length < longest) or (0.2 * longest,)
        boxes = {
            "fy0": (1e-3 * F, 3 * F, (0.08 * F,)),
            "fy1": (1e-3 * F / I, 30 * F / I, (0.7 * F / I,)),
            "d": (1e-6, longest, lengths),
            "seat_share": (5e-3, 1.0, (0.1,)),
            "cb": (0.02 * F / V, 1e3 * F / V, (1.0 * F / V, 5.0 * F / V)),
            "h0": (0.0, 1.0, (0.4,)),
            "h1": (-2.0 / I, 3.0 / I, (0.3 / I,)),
            "vh": (1e-3 * V, 0.5 * V, (0.02 * V,)),
            "T": (2e-4, 5e-2, (5e-3,)),
            "qb": (-0.9, 0.9, (0.0,)),
            "Ic": (0.01 * I, 2.0 * I, (0.12 * I,)),
            "leak": (0.2, 2e3, (18.0,)),
            "si": (0.0, 10.0 / I, (0.1 / I,)),
        }
        infos = {info.name: info for info in cls.parameters()}
        return tuple(
            SearchAxis(name, low, high, starts, log=name == "seat_share" or infos[name].scale == "log")
            for name, (low, high, starts) in boxes.items()
            if ("e" if name == "seat_share" else name) in free
        )


def play_step(tape: Tape, path: Any, limit: Any) -> Any:
    """`play_position` for one sample."""
    held = tape.remember("play")
    turned = held
    for turn in path.turns:
        turned = tape.select(turn == 0.0, turned, np.clip(turned + turn, -limit, limit))
    moved = np.clip(turned + path.step, -limit, limit)
    tape.update(held, moved)
    return moved


@streamed(play_step)
def play_position(path: Path, limit: float) -> Floats:
    """Position δ of a stop operator along a path: it moves with the motion and stops at ±limit.

    [Brokate and Sprekels 1996; recalled] Within a stroke δ increases with the distance until it stops, so samples are
    independent; only the reversals are sequential.
    """
    return _stopped(path, limit)


@memoize_per_path
def _stopped(path: Path, limit: float) -> Floats:
    turned = path.first_direction * np.where(np.arange(len(path.lengths)) % 2, -1.0, 1.0) * path.lengths
    at_start = np.concatenate([[0.0], _clipped_sums(turned, limit)])
    return path.direction * np.minimum((path.direction * at_start[path.stroke]) + path.distance, limit)


def _clipped_sums(moves: Floats, limit: float) -> Floats:
    """δ after each of some moves from 0, δ → clip(δ + move, ±limit).

    The composition of two such maps is a third, clip(δ + a, low, high): spans of 1, 2, 4, ... are joined until the
    result is independent of the start.
    """
    a, low, high = moves.copy(), np.full(moves.size, -limit), np.full(moves.size, limit)
    span = 1
    while span < moves.size and (low < high).any():
        later = slice(span, None)
        low[later], high[later] = (
            np.clip(end[:-span] + a[later], low[later], high[later]) for end in (low.copy(), high.copy())
        )
        a[later] = a[:-span] + a[later]
        span *= 2
    return np.clip(a, low, high)
