"""Play and bypass: a yield force that seats only after lost motion, bridged by a viscous bypass.

Real dampers lose some 0.4 mm of motion after every reversal: the force drops to a viscous
shoulder, stays there while the play closes, then jumps to the full yield force. A Bouc–Wen
element is steepest right at the reversal and cannot do that. No frequency and no amplitude
enters: what looks like dependence on them comes out of play, rate and lag.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from mrdamper.data import Floats
from mrdamper.models.base import Model, Scale, SearchAxis
from mrdamper.motion import Excitation, Path
from mrdamper.motion.lag import first_order_lag
from mrdamper.parameters import param
from mrdamper.tracing import Tape, streamed

RISE_CURRENT = 0.12  # A; the yield force starts with zero slope in the current and is straight beyond


@dataclass(frozen=True)
class PlayBypass(Model):
    """F = f0 + k x (1 − S) + (c0 + c1 I) v + fy(I) (S + q |S|) + m a, S the lagged share of the yield force.

    With δ the play's position (stop operator, |δ| ≤ d), φ = sgn δ · max(0, |δ| − (d − e))/e is
    how far the seat is loaded and η its loading along the motion; b = r/√(1 + r²) with
    r = cb |v|/fy is the bypass, capped by the yield force. Then

    s = (1 − h) φ + sgn v [h |v|/(|v| + vh) η + (1 − η) b],  T dS/dt + S = s,

    fy(I) = fy0 + fy1 I (1 − exp(−I/0.12 A)), h = h0 + h1 I within 0 and 1, q the asymmetry.

    References
    ----------
    Derived from the bundled tests of two dampers (docs/play-and-bypass.md).
    """

    name: ClassVar[str] = "play-bypass"
    title: ClassVar[str] = "play and bypass"
    equation: ClassVar[str] = (
        r"F = f_0 + k x (1 - S) + (c_0 + c_1 I) v + f_y (S + q |S|) + m a,\quad "
        r"f_y = f_{y0} + f_{y1} I \left(1 - e^{-I/(0.12\,\mathrm{A})}\right),\quad "
        r"T \dot S + S = (1 - h) \varphi + \mathrm{sgn}\,v \left[h \frac{|v|}{|v| + v_h} \eta + (1 - \eta) b\right],"
        r"\quad "
        r"h = \min(1, \max(0, h_0 + h_1 I)),\quad "
        r"\dot\delta = v \;\mathrm{where}\; |\delta| < d \;\mathrm{or}\; \delta v < 0,\;\mathrm{else}\; 0,\quad "
        r"\varphi = \mathrm{sgn}\,\delta\, \max(0, |\delta| - (d - e))/e,\quad "
        r"\eta = \max(0, \varphi\,\mathrm{sgn}\,v),\quad b = \frac{r}{\sqrt{1 + r^2}},\quad r = \frac{c_b |v|}{f_y}"
    )
    source: ClassVar[str] = "derived from the bundled tests"

    f0: float = param("N", "offset force", linear=True)
    k: float = param("N/m", "stiffness while the seat is not loaded", linear=True)
    c0: float = param("N s/m", "post-yield viscous damping without current", bounds=(0, np.inf), linear=True)
    c1: float = param("N s/m/A", "rise of the viscous damping with current", bounds=(0, np.inf), linear=True)
    fy0: float = param("N", "yield force without current", bounds=(0.1, 1e6), scale="log")
    fy1: float = param("N/A", "rise of the yield force with current", bounds=(0, 1e6), scale="log")
    d: float = param("m", "half the play and seat: lost motion is 2 (d − e)", bounds=(1e-6, 1e-2), scale="log")
    e: float = param("m", "elastic displacement of the seat", bounds=(1e-7, 1e-2), scale="log")
    cb: float = param("N s/m", "viscous damping of the bypass in the play", bounds=(1, 1e7), scale="log")
    h0: float = param("-", "share of the seated force that fades with velocity", bounds=(-1, 2))
    h1: float = param("1/A", "rise of that share with current", bounds=(-5, 5))
    vh: float = param("m/s", "velocity at which that share has faded by half", bounds=(1e-5, 1), scale="log")
    T: float = param("s", "lag of the yield force", bounds=(0, 0.2), scale="log")
    asymmetry: float = param(
        "-",
        "surplus of the yield force in extension over the mean",
        bounds=(-0.5, 0.5),
        linear=True,
        default=0.0,
        symbol="q",
    )
    m: float = param("kg", "inertia", bounds=(0, np.inf), linear=True, default=0.0)

    @property
    def knee(self) -> float:
        """Lost motion and seat, 2 d [m]."""
        return 2 * self.d

    def yield_force(self, current: Floats) -> Floats:
        """fy(I) [N]."""
        return self.fy0 + self.fy1 * current * -np.expm1(-np.abs(current) / RISE_CURRENT)

    def state(self, motion: Excitation) -> Floats:
        """S (N,), the lagged share of the yield force."""
        v, speed = motion.velocity, np.abs(motion.velocity)
        play = play_position(motion.path, self.d)
        seat = np.minimum(self.e, self.d)
        loaded = np.sign(play) * np.maximum(0.0, np.abs(play) - (self.d - seat)) / seat
        along = np.maximum(0.0, loaded * np.sign(v))
        ratio = self.cb * speed / self.yield_force(motion.current)
        bypass = ratio / np.sqrt(1 + ratio**2)
        fading = np.clip(self.h0 + self.h1 * motion.current, 0.0, 1.0)
        seated = fading * speed / (speed + self.vh) * along
        share = (1 - fading) * loaded + np.sign(v) * (seated + (1 - along) * bypass)
        return first_order_lag(motion.time, share, self.T)

    def force(self, motion: Excitation, state: Floats) -> Floats:
        x, v, a, current = motion.displacement, motion.velocity, motion.acceleration, motion.current
        viscous = (self.c0 + self.c1 * current) * v
        yielded = self.yield_force(current) * (state + self.asymmetry * np.abs(state))
        return self.f0 + self.k * x * (1 - state) + viscous + yielded + self.m * a

    @classmethod
    def search_axes(cls, scale: Scale, free: Sequence[str]) -> tuple[SearchAxis, ...]:
        """Each nonlinear parameter on its own scale, from one start that both bundled rigs share."""
        starts = {
            "fy0": (1.0, 1e4, 100.0),
            "fy1": (1.0, 1e5, 1000.0),
            "d": (2e-5, 2e-3, 2e-4),
            "e": (1e-6, 2e-4, 2e-5),
            "cb": (1e3, 1e6, 3.5e4),
            "h0": (0.0, 1.0, 0.4),
            "h1": (-1.0, 3.0, 0.3),
            "vh": (2e-4, 5e-2, 3e-3),
            "T": (2e-4, 5e-2, 5e-3),
        }
        infos = {info.name: info for info in cls.parameters()}
        return tuple(
            SearchAxis(name, low, high, (start,), log=infos[name].scale == "log")
            for name, (low, high, start) in starts.items()
            if name in free
        )


def play_step(tape: Tape, path: Any, limit: Any, start: float = 0.0) -> Any:
    """`play_position` for one sample."""
    held = tape.remember("play", start)
    moved = np.clip(held + path.step, -limit, limit)
    tape.update(held, moved)
    return moved


@streamed(play_step)
def play_position(path: Path, limit: float, start: float = 0.0) -> Floats:
    """Position δ of a stop operator along a path: it moves with the motion and stops at ±limit.

    [Brokate and Sprekels 1996; recalled] Within a stroke δ rises with the distance until it
    stops, so samples are independent; only the reversals follow one another.
    """
    at_start, w = [], path.first_direction * start
    for length in path.lengths:
        at_start.append(w)
        w = -min(w + length, limit)
    at_start.append(w)
    return path.direction * np.minimum(np.array(at_start)[path.stroke] + path.distance, limit)
